//! The step generator of one joint: crossings and conditioner together.

use crate::conditioner::{Conditioner, ConditionerReport, Edge};
use crate::edges::{Crossings, Cubic, EdgeError};
use crate::step_types::StepType;
use crate::timing::{Period, PulseTiming};

/// The step generator of one joint with step/dir lines.
///
/// After each period the count is ⌊commanded position in steps + ½⌋, so |count − commanded| ≤ ½ step; the *lines* show
/// that count at the end of the period unless the conditioner had to delay the last steps.
#[derive(Debug, Clone, PartialEq)]
pub struct StepGenerator {
    steps_per_unit: f64,
    crossings: Crossings,
    conditioner: Conditioner,
}

impl StepGenerator {
    /// A joint at rest at `position` (mm or rad). `steps_per_unit` (steps/mm, steps/rad) may be negative: the joint is
    /// then wired backwards.
    ///
    /// # Errors
    /// `NotFinite` if a number is not finite or `steps_per_unit` is 0; `OutOfRange`.
    pub fn new(
        joint: u8,
        steps_per_unit: f64,
        timing: PulseTiming,
        position: f64,
    ) -> Result<Self, EdgeError> {
        if !steps_per_unit.is_finite() || steps_per_unit == 0.0 {
            return Err(EdgeError::NotFinite);
        }
        let crossings = Crossings::new(position * steps_per_unit)?;
        Ok(Self { steps_per_unit, crossings, conditioner: Conditioner::new(joint, timing) })
    }

    /// The same for another step type.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_type(
        joint: u8,
        steps_per_unit: f64,
        timing: PulseTiming,
        position: f64,
        step_type: StepType,
    ) -> Result<Self, EdgeError> {
        let generator = Self::new(joint, steps_per_unit, timing, position)?;
        Ok(Self { conditioner: Conditioner::with_type(joint, timing, step_type), ..generator })
    }

    /// Moves to `position` (mm or rad), reached with `velocity` (mm/s or rad/s) at the end of `period`. Periods follow
    /// each other without a gap. The edges go to `sink` in the order of their times, all after `period.start()`; those
    /// that the conditioner delayed, and the end of the last pulse, may lie after `period.end()`.
    ///
    /// # Errors
    /// See [`EdgeError`]. Nothing is changed and no edge made then.
    pub fn advance(
        &mut self,
        position: f64,
        velocity: f64,
        period: &Period,
        mut sink: impl FnMut(Edge),
    ) -> Result<(), EdgeError> {
        let max_steps = self.max_steps(period)?;
        let known_from = period.start().saturating_add(1);
        let conditioner = &mut self.conditioner;
        self.crossings.advance(
            position * self.steps_per_unit,
            velocity * self.steps_per_unit,
            period,
            max_steps,
            &mut |time, forward| conditioner.step(time, forward, known_from, &mut sink),
        )
    }

    /// As [`Self::advance`], on a straight line: for commands without velocity.
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn advance_straight(
        &mut self,
        position: f64,
        period: &Period,
        mut sink: impl FnMut(Edge),
    ) -> Result<(), EdgeError> {
        let max_steps = self.max_steps(period)?;
        let known_from = period.start().saturating_add(1);
        let conditioner = &mut self.conditioner;
        self.crossings.advance_straight(
            position * self.steps_per_unit,
            period,
            max_steps,
            &mut |time, forward| conditioner.step(time, forward, known_from, &mut sink),
        )
    }

    /// The most steps in a period; an error if delays have piled up.
    fn max_steps(&self, period: &Period) -> Result<u64, EdgeError> {
        let delay = self.conditioner.earliest_step().saturating_sub(period.start());
        if delay > u64::from(period.ticks()) {
            return Err(EdgeError::Late { delay });
        }
        Ok(self.conditioner.timing().max_steps(period))
    }

    /// Other pulse times and steps per mm or rad from now on; the count stays.
    ///
    /// # Errors
    /// `NotFinite` if `steps_per_unit` is not finite or 0.
    pub fn configure(&mut self, steps_per_unit: f64, timing: PulseTiming) -> Result<(), EdgeError> {
        if !steps_per_unit.is_finite() || steps_per_unit == 0.0 {
            return Err(EdgeError::NotFinite);
        }
        self.steps_per_unit = steps_per_unit;
        self.conditioner.set_timing(timing);
        Ok(())
    }

    /// Stands still at the step `count`, e.g. after pulses were cut off by an emergency stop: the commanded position is
    /// that of the step, the velocity 0. Steps still to come are the caller's to drop.
    ///
    /// # Errors
    /// `OutOfRange`.
    pub fn stand_at(&mut self, count: i64) -> Result<(), EdgeError> {
        self.crossings = Crossings::new(count as f64)?;
        Ok(())
    }

    /// The step that belongs to the commanded position.
    pub const fn count(&self) -> i64 {
        self.crossings.count()
    }

    /// Commanded position less the position of the step `count`, steps, exact.
    pub fn offset(&self, count: i64) -> f64 {
        self.crossings.offset(count)
    }

    /// Position of a step, mm or rad.
    pub fn position_of(&self, count: i64) -> f64 {
        count as f64 / self.steps_per_unit
    }

    /// The commanded path of the last period.
    pub const fn cubic(&self) -> &Cubic {
        self.crossings.cubic()
    }

    /// Steps per mm or rad.
    pub const fn steps_per_unit(&self) -> f64 {
        self.steps_per_unit
    }

    /// The pulse times that are kept.
    pub const fn timing(&self) -> &PulseTiming {
        self.conditioner.timing()
    }

    /// What the conditioner did so far.
    pub const fn report(&self) -> &ConditionerReport {
        self.conditioner.report()
    }
}
