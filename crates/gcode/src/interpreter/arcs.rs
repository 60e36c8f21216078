//! Arcs and helices: G2 and G3 by centre or by radius (RS274/NGC 3.5.3).

use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use pkm_canon::{Canon, LengthUnit, Plane, Position};
use pkm_kins::maths;

/// The axes of a plane: first, second, normal, and the letters of the centre words.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaneAxes {
    pub(crate) first: usize,
    pub(crate) second: usize,
    pub(crate) normal: usize,
    pub(crate) first_centre: u8,
    pub(crate) second_centre: u8,
    pub(crate) normal_centre: u8,
    pub(crate) name: &'static str,
}

impl PlaneAxes {
    /// Of G17, G18, G19; of the UVW planes the partners.
    pub(crate) const fn of(plane: Plane) -> Self {
        let (axes, centres, name) = match plane {
            Plane::Xy => ([0, 1, 2], *b"IJK", "XY"),
            Plane::Xz => ([2, 0, 1], *b"KIJ", "XZ"),
            Plane::Yz => ([1, 2, 0], *b"JKI", "YZ"),
            Plane::Uv => ([6, 7, 8], *b"IJK", "UV"),
            Plane::Uw => ([8, 6, 7], *b"KIJ", "UW"),
            Plane::Vw => ([7, 8, 6], *b"JKI", "VW"),
        };
        let [first, second, normal] = axes;
        let [first_centre, second_centre, normal_centre] = centres;
        Self { first, second, normal, first_centre, second_centre, normal_centre, name }
    }
}

/// Centre of an arc in its plane.
type Centre = [f64; 2];

/// Half chords this close to the radius (relative) count as equal.
const TINY: f64 = 1e-12;

impl State {
    /// Smallest radius, and how far the end of a radius arc may be out of reach: 0.00005 in, 0.00127 mm.
    pub(crate) fn radius_resolution(&self) -> f64 {
        match self.modal.units {
            LengthUnit::Inch => 0.00005,
            LengthUnit::Mm => 0.00127,
        }
    }

    /// G2, G3.
    pub(crate) fn arc(&mut self, code: GCode, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        if matches!(self.modal.plane, Plane::Uv | Plane::Uw | Plane::Vw) {
            return Err(block.motion_error(ErrorKind::ArcPlane));
        }
        let axes = PlaneAxes::of(self.modal.plane);
        let has_centre = block.has_any(b"IJK");
        if block.has(b'R') && has_centre {
            return Err(block.word_error(b'R', ErrorKind::ArcMixed));
        }
        if !block.has(b'R') && !has_centre {
            return Err(block.motion_error(ErrorKind::ArcNoCentre { code: Code(code) }));
        }
        if block.has(b'R')
            && !block.has_polar()
            && block.axis(axes.first).is_none()
            && block.axis(axes.second).is_none()
        {
            return Err(block.word_error(b'R', ErrorKind::ArcAxisMissing { plane: axes.name }));
        }
        if block.has(axes.normal_centre) {
            let letter = axes.normal_centre.into();
            let kind = ErrorKind::ArcWrongAxis { letter, plane: axes.name };
            return Err(block.word_error(axes.normal_centre, kind));
        }
        let turns = super::check::turns_of(block)?;
        let turns = if code == G2 { -turns } else { turns };
        self.check_feed(code, block)?;
        if self.cutter.arc_refused {
            return Err(block.motion_error(ErrorKind::CcArcAfter));
        }

        let end = self.end_point(block)?;
        self.no_indexer(&end, block)?;
        let from = [self.position[axes.first], self.position[axes.second]];
        let to = [end[axes.first], end[axes.second]];
        let centre = match block.get(b'R') {
            Some(radius) => self.centre_of_radius(code, radius, from, to, block)?,
            None => self.centre_of_words(code, axes, from, to, block)?,
        };
        self.modal.motion = code;
        let rise = end[axes.normal] - self.position[axes.normal];
        self.inverse_time_rate(block, |_| helix_length(from, to, centre, turns, rise), out);
        if let Some(side) = self.compensates() {
            return self.arc_compensated(side, end, centre, turns, block, out);
        }
        self.position = end;
        out.emit(Canon::ArcFeed {
            end: Position::from_array(end),
            first_centre: centre[0],
            second_centre: centre[1],
            turns,
        });
        Ok(())
    }

    /// I J K: the centre as offsets from the start (G91.1) or as coordinates (G90.1).
    pub(super) fn centre_of_words(
        &mut self,
        code: GCode,
        axes: PlaneAxes,
        from: Centre,
        to: Centre,
        block: &Block,
    ) -> Result<Centre, Error> {
        let (first, second) = (block.get(axes.first_centre), block.get(axes.second_centre));
        let centre = match (self.modal.arc_centre_absolute, first, second) {
            (true, Some(first), Some(second)) => [first, second],
            (true, _, _) => {
                return Err(block.motion_error(ErrorKind::ArcCentreAbsolute { code: Code(code) }));
            }
            (false, first, second) => [from[0] + first.unwrap_or(0.0), from[1] + second.unwrap_or(0.0)],
        };
        let letter = if first.is_some() { axes.first_centre } else { axes.second_centre };
        let start = maths::hypot(centre[0] - from[0], centre[1] - from[1]);
        let end = maths::hypot(centre[0] - to[0], centre[1] - to[1]);
        let smallest = self.radius_resolution();
        if start < smallest || end < smallest {
            return Err(block.word_error(letter, ErrorKind::ArcZeroRadius { start, end }));
        }
        let tolerance = match self.modal.units {
            LengthUnit::Inch => self.settings.arc_radius_tolerance_inch,
            LengthUnit::Mm => self.settings.arc_radius_tolerance_mm,
        };
        let difference = (start - end).abs();
        let relative = difference / start.max(end);
        if difference > 100.0 * tolerance || (difference > tolerance && relative > 0.001) {
            return Err(block.word_error(letter, ErrorKind::ArcRadiusMismatch { start, end, tolerance }));
        }
        let difference_mm = difference * self.modal.units.mm();
        if difference_mm > self.largest_spiral_mm {
            self.largest_spiral_mm = difference_mm;
            self.notice = Some(block.word_error(letter, ErrorKind::ArcSpiral { difference }));
        }
        Ok(centre)
    }

    /// R: positive the shorter arc, negative the longer one. The centre is on the perpendicular bisector of the
    /// chord, at the distance that the radius leaves.
    pub(super) fn centre_of_radius(
        &self,
        code: GCode,
        radius: f64,
        from: Centre,
        to: Centre,
        block: &Block,
    ) -> Result<Centre, Error> {
        if from == to {
            return Err(block.word_error(b'R', ErrorKind::ArcSameEnd));
        }
        let size = radius.abs();
        let mut half_chord = maths::hypot(from[0] - to[0], from[1] - to[1]) / 2.0;
        if half_chord - size > self.radius_resolution() {
            return Err(block.word_error(b'R', ErrorKind::ArcRadiusSmall { radius, half_chord }));
        }
        if half_chord / size > 1.0 - TINY {
            half_chord = size;
        }
        let middle = [(from[0] + to[0]) / 2.0, (from[1] + to[1]) / 2.0];
        let along = maths::atan2(to[1] - from[1], to[0] - from[0]);
        // Clockwise with a positive radius: the centre lies right of the chord; each sign change swaps sides.
        let to_centre = if (code == G2) == (radius > 0.0) { -maths::PI / 2.0 } else { maths::PI / 2.0 };
        let distance = size * maths::cos(maths::asin(half_chord / size));
        let direction = along + to_centre;
        Ok([middle[0] + distance * maths::cos(direction), middle[1] + distance * maths::sin(direction)])
    }
}

/// Length of a helix that turns from `from` to `to` about `centre`.
pub(crate) fn helix_length(from: Centre, to: Centre, centre: Centre, turns: i32, rise: f64) -> f64 {
    let radius = maths::hypot(from[0] - centre[0], from[1] - centre[1]);
    let length = radius * sweep(from, to, centre, turns).abs();
    if rise == 0.0 { length } else { maths::hypot(length, rise) }
}

/// Signed angle of an arc: positive counter-clockwise, full turns included.
pub(crate) fn sweep(from: Centre, to: Centre, centre: Centre, turns: i32) -> f64 {
    if turns == 0 {
        return 0.0;
    }
    let begin = maths::atan2(from[1] - centre[1], from[0] - centre[0]);
    let mut end = maths::atan2(to[1] - centre[1], to[0] - centre[0]);
    if turns > 0 {
        if end <= begin {
            end += maths::TAU;
        }
        end - begin + f64::from(turns - 1) * maths::TAU
    } else {
        if end >= begin {
            end -= maths::TAU;
        }
        end - begin + f64::from(turns + 1) * maths::TAU
    }
}
