//! What may not be exceeded, and how it looks along the path.
//!
//! Every joint, and every axis the machine file limits, is one *row*: with q′ and q″ its derivatives along s and
//! x = ṡ², its speed is |q′|√x and its acceleration q′ s̈ + q″ x. Rows are stored divided by their acceleration
//! limit, so each asks for |d₁ s̈ + d₂ x| ≤ 1. (Bobrow, Dubowsky, Gibson 1985; Pham & Pham, TOPP-RA, 2018.)

use crate::pair::{Pair, each, higher, highest, lower, two, two_mut, with};
use crate::path::{FeedGroup, Place, feed_length};
use crate::planner::Piece;
use crate::{PlanError, PlanErrorKind};
use pkm_kins::{Axis, InverseError, JointMotion, JointRange, Joints, Kinematics, MAX_JOINTS, Pose};

/// Plans are made to this share of every limit, so that what happens between two nodes (measured: 3e-4 more than at
/// the nodes) stays within the limit itself. Costs 0.03 % of the time.
pub const GUARD: f64 = 0.9995;

/// Largest ṡ² ever planned, (mm/s)²: a path nothing limits must still have a finite speed.
pub(crate) const FASTEST: f64 = 1e12;

/// Limits of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Travel, mm or rad.
    pub range: JointRange,
    /// mm/s or rad/s; finite and positive.
    pub max_velocity: f64,
    /// mm/s² or rad/s²; finite and positive.
    pub max_acceleration: f64,
}

/// Limits of one axis, where the machine file states them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLimits {
    /// Which axis.
    pub axis: Axis,
    /// Travel, mm or rad.
    pub range: Option<JointRange>,
    /// mm/s or rad/s; infinite = no limit.
    pub max_velocity: f64,
    /// mm/s² or rad/s²; infinite = no limit.
    pub max_acceleration: f64,
}

/// All limits of a machine with at most `R` rows (joints + limited axes); `R` is even.
#[derive(Debug, Clone)]
pub struct Limits<const R: usize> {
    joints: heapless::Vec<JointLimits, MAX_JOINTS>,
    axes: heapless::Vec<AxisLimits, 9>,
    /// 1 / (limit · [`GUARD`]) of velocity and acceleration, row by row.
    per_velocity: [f64; R],
    per_acceleration: [f64; R],
    /// Travel, row by row; infinite where there is none.
    lowest: [f64; R],
    highest: [f64; R],
    /// A pose nearer to a singularity than this (either measure) is refused.
    pub singularity_guard: f64,
}

/// A limit that makes no machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitsError {
    /// More joints and limited axes than this planner has rows for.
    TooMany {
        /// Joints plus limited axes.
        rows: usize,
        /// What there is room for.
        room: usize,
    },
    /// Joint `joint` (from 0) has a limit that is not finite and positive, or an empty range.
    Joint(usize),
    /// This axis has a limit that is not positive, or an empty range.
    Axis(Axis),
}

impl<const R: usize> Limits<R> {
    /// Checks and keeps the limits.
    ///
    /// # Errors
    /// [`LimitsError`]: a joint's velocity or acceleration limit is not finite and > 0, an axis limit is not > 0, a
    /// range is empty or NaN, or there are more rows than `R`.
    pub fn new(
        joints: &[JointLimits],
        axes: &[AxisLimits],
        singularity_guard: f64,
    ) -> Result<Self, LimitsError> {
        const { assert!(R.is_multiple_of(2), "rows are worked on in pairs") };
        let rows = joints.len() + axes.len();
        let too_many = LimitsError::TooMany { rows, room: R };
        if rows > R {
            return Err(too_many);
        }
        let good = |limit: f64| limit > 0.0 && limit.is_finite();
        for (i, joint) in joints.iter().enumerate() {
            if !good(joint.max_velocity)
                || !good(joint.max_acceleration)
                || !(joint.range.min < joint.range.max)
            {
                return Err(LimitsError::Joint(i));
            }
        }
        for limit in axes {
            let range_ok = limit.range.is_none_or(|range| range.min < range.max);
            if !(limit.max_velocity > 0.0) || !(limit.max_acceleration > 0.0) || !range_ok {
                return Err(LimitsError::Axis(limit.axis));
            }
        }
        let velocities = joints.iter().map(|l| l.max_velocity).chain(axes.iter().map(|l| l.max_velocity));
        let accelerations =
            joints.iter().map(|l| l.max_acceleration).chain(axes.iter().map(|l| l.max_acceleration));
        let none = JointRange { min: f64::NEG_INFINITY, max: f64::INFINITY };
        let ranges = joints.iter().map(|l| l.range).chain(axes.iter().map(|l| l.range.unwrap_or(none)));
        let (mut per_velocity, mut per_acceleration) = ([0.0; R], [0.0; R]);
        let (mut lowest, mut highest) = ([f64::NEG_INFINITY; R], [f64::INFINITY; R]);
        for (row, ((velocity, acceleration), range)) in
            velocities.zip(accelerations).zip(ranges).enumerate().take(R)
        {
            per_velocity[row] = 1.0 / (velocity * GUARD);
            per_acceleration[row] = 1.0 / (acceleration * GUARD);
            lowest[row] = range.min - JointRange::TOLERANCE;
            highest[row] = range.max + JointRange::TOLERANCE;
        }
        Ok(Self {
            per_velocity,
            per_acceleration,
            lowest,
            highest,
            joints: heapless::Vec::from_slice(joints).map_err(|_| too_many)?,
            axes: heapless::Vec::from_slice(axes).map_err(|_| too_many)?,
            singularity_guard,
        })
    }

    /// Number of rows in use.
    pub(crate) fn rows(&self) -> usize {
        self.joints.len() + self.axes.len()
    }

    /// Joints and limited axes, row by row.
    pub(crate) fn row_values(&self, pose: &Pose, joints: &Joints) -> [f64; R] {
        let mut values = [0.0; R];
        let axes = self.axes.iter().map(|limits| pose.get(limits.axis));
        let all = joints.iter().copied().take(self.joints.len()).chain(axes);
        for (slot, value) in values.iter_mut().zip(all) {
            *slot = value;
        }
        values
    }

    /// A row outside its travel.
    pub(crate) fn out_of_travel(&self, row: usize, value: f64, range: JointRange) -> PlanErrorKind {
        match self.axes.get(row.wrapping_sub(self.joints.len())) {
            Some(limits) => PlanErrorKind::AxisTravel { axis: limits.axis, value, range },
            None => PlanErrorKind::JointTravel { joint: row, value, range },
        }
    }

    /// The travel of a row.
    pub(crate) fn range(&self, row: usize) -> Option<JointRange> {
        match self.joints.get(row) {
            Some(limits) => Some(limits.range),
            None => self.axes.get(row - self.joints.len()).and_then(|limits| limits.range),
        }
    }

    /// Checks a pose and its joints against travel.
    ///
    /// # Errors
    /// The first joint, or else axis, outside its travel.
    pub fn check_travel(&self, pose: &Pose, joints: &Joints) -> Result<(), PlanErrorKind> {
        self.check_rows(&self.row_values(pose, joints))
    }

    /// The same, row by row.
    pub(crate) fn check_rows(&self, values: &[f64; R]) -> Result<(), PlanErrorKind> {
        let ends = self.lowest.iter().zip(&self.highest);
        if values.iter().zip(ends).all(|(value, (low, high))| value >= low && value <= high) {
            return Ok(());
        }
        for (row, &value) in values.iter().enumerate().take(self.rows()) {
            if let Some(range) = self.range(row).filter(|range| !range.contains(value)) {
                return Err(self.out_of_travel(row, value, range));
            }
        }
        Ok(())
    }

    /// The strips and caps at one point of a piece, into `sample`.
    ///
    /// # Errors
    /// The point is out of reach, out of travel or too near a singularity.
    #[inline(always)]
    pub(crate) fn sample<K: Kinematics>(
        &self,
        kinematics: &K,
        piece: &Piece,
        spot: &mut Spot,
        sample: &mut Sample<R>,
    ) -> Result<(), PlanError> {
        let Spot { place: Place { pose, first, second }, feed, motion } = spot;
        let fail = |kind| PlanError { kind, span: piece.span, pose: *pose };
        kinematics
            .motion_into(pose, first, second, motion)
            .map_err(|error| fail(PlanErrorKind::Unreachable(error)))?;
        if self.singularity_guard > 0.0 {
            self.check_travel(pose, &motion.position).map_err(fail)?;
            let measure = kinematics.singularity(pose).map_err(|e| fail(PlanErrorKind::Unreachable(e)))?;
            let nearest = measure.inverse.min(measure.forward);
            if !(nearest >= self.singularity_guard) {
                return Err(fail(PlanErrorKind::Unreachable(InverseError::Singular { measure: nearest })));
            }
        }
        sample.feed = *feed;
        let (mut fastest, mut within) = ([0.0; 2], true);
        let joints = self.joints.len().min(R).min(MAX_JOINTS);
        // Joints two by two; there are no more than rows: that it is said here spares the loop its checks.
        let pairs = (joints / 2).min(R / 2);
        let (q, d1, d2) = (two(&motion.position), two(&motion.velocity), two(&motion.acceleration));
        let (per_velocity, per_acceleration) = (two(&self.per_velocity), two(&self.per_acceleration));
        let (lowest, highest_place) = (two(&self.lowest), two(&self.highest));
        for k in 0..pairs {
            let times = |a: Pair, b: Pair| with(a, b, |a, b| a * b);
            let speed = times(d1[k], per_velocity[k]);
            two_mut(&mut sample.rows.first)[k] = times(d1[k], per_acceleration[k]);
            two_mut(&mut sample.rows.second)[k] = times(d2[k], per_acceleration[k]);
            two_mut(&mut sample.speed)[k] = speed;
            two_mut(&mut sample.position)[k] = q[k];
            fastest = with(fastest, each(speed, f64::abs), higher);
            let (low, high) = (lowest[k], highest_place[k]);
            within &= q[k][0] >= low[0] && q[k][1] >= low[1] && q[k][0] <= high[0] && q[k][1] <= high[1];
        }
        let mut fastest = highest(fastest);
        let mut set = |row: usize, q: f64, d1: f64, d2: f64| {
            let speed = d1 * self.per_velocity[row];
            sample.rows.first[row] = d1 * self.per_acceleration[row];
            sample.rows.second[row] = d2 * self.per_acceleration[row];
            sample.speed[row] = speed;
            sample.position[row] = q;
            fastest = higher(fastest, speed.abs());
            within &= q >= self.lowest[row] && q <= self.highest[row];
        };
        for row in 2 * pairs..joints {
            set(row, motion.position[row], motion.velocity[row], motion.acceleration[row]);
        }
        for (limits, row) in self.axes.iter().zip(joints..R) {
            let axis = limits.axis;
            set(row, pose.get(axis), first.get(axis), second.get(axis));
        }
        sample.hard = speed_cap(fastest);
        if within { Ok(()) } else { self.check_travel(pose, &motion.position).map_err(fail) }
    }
}

impl<const R: usize> Limits<R> {
    /// What happens between two neighbouring nodes, `length` apart: the cap on x from a speed that peaks between them,
    /// and a joint or axis that turns back between them checked against its travel.
    ///
    /// # Errors
    /// A joint or axis leaves its travel between the nodes.
    #[inline(always)]
    pub(crate) fn between(
        &self,
        a: &Sample<R>,
        b: &Sample<R>,
        length: f64,
        piece: &Piece,
        s: f64,
    ) -> Result<f64, PlanError> {
        let mut cap = lower(a.hard, b.hard);
        // As a rule neither q′ nor q″ of any row changes its sign.
        let opposite = |a: &[f64; R], b: &[f64; R]| {
            let products = a.as_chunks().0.iter().zip(b.as_chunks().0).take(self.rows().div_ceil(2));
            highest(products.fold([0.0; 2], |most, (&a, &b)| with(most, with(a, b, |a, b| -a * b), higher)))
                > 0.0
        };
        let (bends, turns) = (opposite(&a.rows.second, &b.rows.second), opposite(&a.speed, &b.speed));
        if !(bends || turns) {
            return Ok(cap);
        }
        for row in 0..self.rows().min(R) {
            let (speed_a, speed_b) = (a.speed[row], b.speed[row]);
            let (bend_a, bend_b) = (a.rows.second[row], b.rows.second[row]);
            if bend_a * bend_b < 0.0 {
                // q″ changes sign: q′ has an extremum, about a triangle's area away from either end.
                let to_peak = length * bend_a.abs() / (bend_a.abs() + bend_b.abs());
                let extra =
                    0.5 * bend_a.abs() * self.per_velocity[row] / self.per_acceleration[row] * to_peak;
                if extra.is_finite() {
                    cap = cap.min(speed_cap(speed_a.abs().max(speed_b.abs()) + extra));
                }
            }
            if speed_a * speed_b < 0.0
                && let Some(range) = self.range(row)
            {
                let to_turn = length * speed_a.abs() / (speed_a.abs() + speed_b.abs());
                let value = a.position[row] + 0.5 * speed_a / self.per_velocity[row] * to_turn;
                if !range.contains(value) {
                    let kind = self.out_of_travel(row, value, range);
                    let pose = Pose::from_array(piece.geometry.at(s + to_turn).position);
                    return Err(PlanError { kind, span: piece.span, pose });
                }
            }
        }
        Ok(cap)
    }
}

/// Largest ṡ² with |speed| ṡ ≤ 1.
pub(crate) fn speed_cap(speed: f64) -> f64 {
    let square = speed * speed;
    if square * FASTEST > 1.0 { 1.0 / square } else { FASTEST }
}

/// How fast the program wants to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feed {
    /// mm/s (rad/s where only ABC move); infinite for rapids.
    pub speed: f64,
    /// What the speed counts.
    pub group: FeedGroup,
}

impl Feed {
    /// Speed along the path at ṡ = `speed`, as a share of what was asked for.
    #[inline]
    pub(crate) fn share(&self, first: &[f64; 9], speed: f64) -> f64 {
        if self.speed > 0.0 { feed_length(first, self.group) * speed / self.speed } else { 0.0 }
    }

    pub(crate) fn cap(&self, first: &[f64; 9]) -> f64 {
        if self.speed == f64::INFINITY {
            return f64::INFINITY;
        }
        let length = feed_length(first, self.group);
        if length > 0.0 { (self.speed / length) * (self.speed / length) } else { f64::INFINITY }
    }
}

/// Strips |first·s̈ + second·x| ≤ 1; past the rows in use both are 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<const R: usize> {
    pub(crate) first: [f64; R],
    pub(crate) second: [f64; R],
}

impl<const R: usize> Rows<R> {
    /// first and second of the rows in use, two rows at a time.
    #[inline(always)]
    pub(crate) fn pairs(&self, rows: usize) -> impl Iterator<Item = (Pair, Pair)> {
        let (first, second) = (self.first.as_chunks().0, self.second.as_chunks().0);
        first.iter().copied().zip(second.iter().copied()).take(rows.div_ceil(2))
    }
}

/// Where a piece is looked at just now.
#[derive(Debug, Clone)]
pub(crate) struct Spot {
    place: Place,
    /// Cap on x from the feed at 100 %.
    feed: f64,
    motion: JointMotion,
}

impl Spot {
    pub(crate) const NONE: Self = Self {
        place: Place::ZERO,
        feed: 0.0,
        motion: JointMotion {
            position: [0.0; MAX_JOINTS],
            velocity: [0.0; MAX_JOINTS],
            acceleration: [0.0; MAX_JOINTS],
        },
    };

    /// A first look at a piece.
    #[inline]
    pub(crate) fn look(&mut self, piece: &Piece, s: f64) {
        piece.geometry.look(s, &mut self.place);
        self.feed = piece.feed_cap(&self.place.first);
    }

    /// Another look at the same one.
    #[inline]
    pub(crate) fn look_on(&mut self, piece: &Piece, s: f64) {
        if !piece.geometry.look_on(s, &mut self.place) {
            self.feed = piece.feed_cap(&self.place.first);
        }
    }
}

/// Everything known at one point of the path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample<const R: usize> {
    pub(crate) rows: Rows<R>,
    /// q′ over the velocity limit.
    pub(crate) speed: [f64; R],
    pub(crate) position: [f64; R],
    /// Cap on x from velocity limits.
    pub(crate) hard: f64,
    /// Cap on x from the feed at 100 %; infinite for rapids.
    pub(crate) feed: f64,
}

impl<const R: usize> Sample<R> {
    pub(crate) const EMPTY: Self = Self {
        rows: Rows { first: [0.0; R], second: [0.0; R] },
        speed: [0.0; R],
        position: [0.0; R],
        hard: FASTEST,
        feed: f64::INFINITY,
    };

    /// How much the strips change between two points, in shares of the limits: the measure that spaces the nodes.
    #[inline(always)]
    pub(crate) fn variation(&self, other: &Self, rows: usize) -> Scales {
        let (mut steepest, mut bend) = ([0.0; 2], [0.0; 2]);
        for ((a1, a2), (b1, b2)) in self.rows.pairs(rows).zip(other.rows.pairs(rows)) {
            let largest = |a: f64, b: f64| higher(a.abs(), b.abs());
            steepest = with(steepest, with(a1, b1, largest), higher);
            bend = with(bend, with(a2, b2, largest), higher);
        }
        let (steepest, bend) = (highest(steepest), highest(bend));
        let cap = lower(lower(self.hard, other.hard), lower(self.feed, other.feed));
        let x = if bend * cap > 2.0 { 2.0 / bend } else { cap };
        let unit = higher(steepest, 1.0 / FASTEST);
        let per_bend = x * unit;
        let mut change = [0.0; 2];
        for ((a1, a2), (b1, b2)) in self.rows.pairs(rows).zip(other.rows.pairs(rows)) {
            let steeper = with(a1, b1, |a, b| (b - a).abs());
            let bent = with(a2, b2, |a, b| (b - a).abs() * per_bend);
            change = with(change, with(steeper, bent, |steeper, bent| steeper + bent), higher);
        }
        Scales { change: highest(change), unit, x }
    }

    /// What decides by how much a row exceeds, between two points `step` apart, what it is at them while one acceleration is kept: q″ and
    /// x both go linearly, so their product is bowed by Δq″ Δx/4, and q′ by Δq″ Δs/8. With Δx = 2 s̈ Δs that is 5/8 of |Δq″ s̈ Δs|; s̈
    /// is at most 1/`unit`, and Δx no more than x̂.
    #[inline(always)]
    pub(crate) fn bow(&self, other: &Self, rows: usize, step: f64, scales: &Scales) -> f64 {
        let Scales { change, unit, x } = *scales;
        let span = lower(step, x * unit);
        // Most of the time the change alone says that it is little.
        if change * span <= BOW * x * unit * unit {
            return 0.0;
        }
        let pairs = self.rows.pairs(rows).zip(other.rows.pairs(rows));
        let bent = pairs
            .fold([0.0; 2], |most, ((_, a), (_, b))| with(most, with(a, b, |a, b| (b - a).abs()), higher));
        highest(bent) * span / unit
    }
}

/// The [`Sample::bow`] that is small enough: what [`GUARD`] leaves is more.
pub(crate) const BOW: f64 = 6e-4;

/// See [`Sample::variation`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scales {
    /// The largest change of a strip, where `unit` is all of its limit.
    pub(crate) change: f64,
    pub(crate) unit: f64,
    /// x̂, the scale of speed.
    pub(crate) x: f64,
}
