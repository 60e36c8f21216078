//! A whole move looked at from end to end before anything moves: reach, working and assembly mode, travel and the
//! singularity guard, at places along it and, for travel, between them too. `pkm check` and [`crate::Planner::push`]
//! take the same walk; the nodes, set later and closer, are the second look.

use crate::PlanErrorKind;
use crate::limits::Limits;
use crate::pair::{higher, highest, with};
use crate::path::{Geometry, Place};
use core::ops::ControlFlow;
use pkm_kins::{InverseError, Kinematics, Pose, Singularity};

/// What a push looks at: a place every millimetre (or as [`Geometry::places`] has it for what turns), but no more than this: a prime
/// number, so that those of an arc of many turns are not all on the same side of it.
const SPACING_MM: f64 = 1.0;
const MOST_PLACES: u32 = 67;

/// Places that a push looks at on a move.
pub(crate) fn places(geometry: &Geometry) -> u32 {
    geometry.places(SPACING_MM, MOST_PLACES)
}

impl<const R: usize> Limits<R> {
    /// Looks at `places` + 1 places evenly along `geometry`, and at where a joint or an axis turns back between them.
    /// `each` gets the pose and the distance from singularities (infinite unless `measure`d or guarded), or what is wrong there; it may end the walk.
    ///
    /// `start`: where the joints and axes are at the start, if it has been looked at already; it is not looked at again then.
    /// Returns where they are at the end, unless something is wrong there or the walk was ended.
    ///
    /// Between the places a joint is taken for a parabola through three of them: travel is judged with an error of the
    /// third order in their distance.
    pub fn walk<K: Kinematics>(
        &self,
        kinematics: &K,
        geometry: &Geometry,
        (places, measure): (u32, bool),
        start: Option<[f64; R]>,
        mut each: impl FnMut(&Pose, Result<Singularity, PlanErrorKind>) -> ControlFlow<()>,
    ) -> Option<[f64; R]> {
        let (length, places) = (geometry.length(), places.max(1));
        // Rows at the two places before, where they are known.
        let mut known = usize::from(start.is_some());
        let mut last = [start.unwrap_or([0.0; R]); 2];
        let mut middle = Pose::ZERO;
        let mut place = Place::ZERO;
        let first = u32::from(start.is_some());
        for k in first..=places {
            let s = if k == places { length } else { length * f64::from(k) / f64::from(places) };
            if k == first {
                geometry.look(s, &mut place);
            } else {
                geometry.look_on(s, &mut place);
            }
            let Place { pose, first: velocity, second: acceleration } = &place;
            // Not the place alone: an axis may be locked, a form switch too near to be passed.
            let looked = kinematics.passage(pose, velocity, acceleration).map_err(PlanErrorKind::Unreachable);
            let found = looked.and_then(|joints| {
                let rows = self.row_values(pose, &joints);
                self.check_rows(&rows)?;
                if !measure && !(self.singularity_guard > 0.0) {
                    let far =
                        Singularity { inverse: f64::INFINITY, inverse_joint: 0, forward: f64::INFINITY };
                    return Ok((rows, far));
                }
                let near = kinematics.singularity(pose).map_err(PlanErrorKind::Unreachable)?;
                let measure = near.inverse.min(near.forward);
                if self.singularity_guard > 0.0 && !(measure >= self.singularity_guard) {
                    return Err(PlanErrorKind::Unreachable(InverseError::Singular { measure }));
                }
                Ok((rows, near))
            });
            let outcome = match found {
                Ok((now, near)) => {
                    if known >= 2
                        && let Some(kind) = self.turns_outside(&last, &now)
                        && each(&middle, Err(kind)).is_break()
                    {
                        return None;
                    }
                    known = (known + 1).min(2);
                    last = [last[1], now];
                    Ok(near)
                }
                Err(kind) => {
                    known = 0;
                    Err(kind)
                }
            };
            middle = *pose;
            if each(pose, outcome).is_break() {
                return None;
            }
        }
        (known > 0).then_some(last[1])
    }

    /// A joint or axis that turns back outside its travel around the second of three evenly spaced places.
    fn turns_outside(&self, [a, b]: &[[f64; R]; 2], c: &[f64; R]) -> Option<PlanErrorKind> {
        // As a rule none does.
        let pairs = a.as_chunks().0.iter().zip(b.as_chunks().0).zip(c.as_chunks().0);
        let back = pairs.fold([0.0; 2], |most, ((&a, &b), &c)| {
            let (before, after) = (with(a, b, |a, b| b - a), with(b, c, |b, c| b - c));
            with(most, with(before, after, |before, after| before * after), higher)
        });
        if !(highest(back) > 0.0) {
            return None;
        }
        for (row, ((a, b), c)) in a.iter().zip(b).zip(c).enumerate().take(self.rows()) {
            if (b - a) * (c - b) < 0.0 {
                // The top of the parabola through the three.
                let value = b - (c - a) * (c - a) / (8.0 * (c - 2.0 * b + a));
                if let Some(range) = self.range(row).filter(|range| !range.contains(value)) {
                    return Some(self.out_of_travel(row, value, range));
                }
            }
        }
        None
    }
}
