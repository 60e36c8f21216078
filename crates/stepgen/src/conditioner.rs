//! The conditioner: makes a wanted stream of steps legal for the driver by moving edges later, never earlier.
//!
//! Every pulse is active for exactly the step length; between pulses lies at least the step space; a change of
//! direction comes no sooner than the direction hold after the last pulse *ended* and the next pulse no sooner than
//! the direction setup after it. (Data sheets that count the hold from the pulse's beginning are then met as well.)
//! A reversal is announced as early as the hold allows, within the servo period that needs it, so that a step is late
//! only where the path itself turns faster than the driver can. What a step does to the lines: [`crate::step_types`].

use crate::step_types::{Phases, StepType};
use crate::timing::PulseTiming;

/// A line between the step generator and a driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Line {
    /// Direction: high = the joint's positive direction.
    Dir,
    /// Step: the rising edge is the step.
    Step,
    /// A pulse is a step forward.
    Up,
    /// A pulse is a step back.
    Down,
    /// Line of a phase table: 0 = A, ...
    Phase(u8),
}

/// A change of one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Timer ticks since the start.
    pub time: u64,
    /// Counted from 0.
    pub joint: u8,
    /// Which line.
    pub line: Line,
    /// The level after the edge.
    pub level: bool,
}

/// What the conditioner did so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ConditionerReport {
    /// Steps that went through.
    pub steps: u64,
    /// Changes of direction.
    pub reversals: u64,
    /// Steps that had to come later than wanted.
    pub delayed_steps: u64,
    /// The largest such delay, timer ticks.
    pub max_delay: u64,
}

/// The conditioner of one joint. All lines are low at time 0; those of a phase table take their state with the first
/// step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditioner {
    timing: PulseTiming,
    step_type: StepType,
    /// For phase tables: steps so far, and the levels of the lines.
    phase: i64,
    levels: u8,
    joint: u8,
    forward: bool,
    /// No active step edge before this time (step space after the last pulse, setup after the last reversal).
    step_from: u64,
    /// No change of direction before this time.
    dir_from: u64,
    report: ConditionerReport,
}

impl Conditioner {
    /// A conditioner for step and direction lines that has not moved yet.
    pub const fn new(joint: u8, timing: PulseTiming) -> Self {
        Self::with_type(joint, timing, StepType::StepDir)
    }

    /// A conditioner that has not moved yet.
    pub const fn with_type(joint: u8, timing: PulseTiming, step_type: StepType) -> Self {
        let report = ConditionerReport { steps: 0, reversals: 0, delayed_steps: 0, max_delay: 0 };
        Self {
            timing,
            step_type,
            phase: 0,
            levels: 0,
            joint,
            forward: false,
            step_from: 0,
            dir_from: 0,
            report,
        }
    }

    /// One step wanted at `time`. `known_from` is the time from which the future is known, the first tick of the
    /// period: no edge is placed before it. Steps come in the order of their times.
    ///
    /// Emits, in order of time, at most one edge of the direction line and the two edges of the pulse. All may lie
    /// after `time`; the end of a pulse may lie in the next period.
    pub fn step(&mut self, time: u64, forward: bool, known_from: u64, sink: &mut impl FnMut(Edge)) {
        let joint = self.joint;
        if forward != self.forward {
            let turn = self.dir_from.max(known_from);
            if self.step_type == StepType::StepDir {
                sink(Edge { time: turn, joint, line: Line::Dir, level: forward });
            }
            self.forward = forward;
            self.step_from = self.step_from.max(turn.saturating_add(self.timing.dir_setup()));
            self.report.reversals += 1;
        }
        let rise = time.max(self.step_from);
        let line = match self.step_type {
            StepType::StepDir => Line::Step,
            StepType::UpDown if forward => Line::Up,
            StepType::UpDown => Line::Down,
            StepType::Phases(phases) => {
                self.next_state(&phases, rise, forward, sink);
                self.count(time, rise);
                return;
            }
        };
        let fall = rise.saturating_add(self.timing.step_length());
        sink(Edge { time: rise, joint, line, level: true });
        sink(Edge { time: fall, joint, line, level: false });
        self.step_from = fall.saturating_add(self.timing.step_space());
        self.dir_from = fall.saturating_add(self.timing.dir_hold());
        self.count(time, rise);
    }

    /// One step on the lines of a phase table.
    fn next_state(&mut self, phases: &Phases, time: u64, forward: bool, sink: &mut impl FnMut(Edge)) {
        self.phase = if forward { self.phase.wrapping_add(1) } else { self.phase.wrapping_sub(1) };
        let state = phases.state(self.phase);
        for line in 0..phases.lines() as u8 {
            if (state ^ self.levels) >> line & 1 == 1 {
                let level = state >> line & 1 == 1;
                sink(Edge { time, joint: self.joint, line: Line::Phase(line), level });
            }
        }
        self.levels = state;
        self.step_from = time.saturating_add(self.timing.step_length());
        self.dir_from = time.saturating_add(self.timing.dir_hold());
    }

    fn count(&mut self, wanted: u64, made: u64) {
        self.report.steps += 1;
        if made > wanted {
            self.report.delayed_steps += 1;
            self.report.max_delay = self.report.max_delay.max(made - wanted);
        }
    }

    /// The earliest time at which another step is possible, timer ticks.
    pub const fn earliest_step(&self) -> u64 {
        self.step_from
    }

    /// What was done so far.
    pub const fn report(&self) -> &ConditionerReport {
        &self.report
    }

    /// Another timing from the next step on.
    pub const fn set_timing(&mut self, timing: PulseTiming) {
        self.timing = timing;
    }

    /// The timing that is kept.
    pub const fn timing(&self) -> &PulseTiming {
        &self.timing
    }
}
