//! A chain in step with the spindle (G33, G76) or a rigid tap (G33.1), from rest to rest: what is checked before anything
//! moves, and how it is driven.

use crate::messages;
use crate::program::Program;
use crate::setup::HostLimits;
use pkm_canon::Span;
use pkm_canon::diagnostic::Diagnostic;
use pkm_hal_sim::{SpindleCommand, SpindleFeedback};
use pkm_kins::machine::Mechanism;
use pkm_machine::Machine;
use pkm_planner::{
    PlanError, Setpoint, SpindleOrder, SpindleReading, Stage, Synchronised, SynchronisedMove, Tap,
};

/// Moves without a break in step.
pub(crate) const MOST_MOVES: usize = 256;

/// They and the blends between them.
type Chain = Synchronised<512>;

/// What makes a chain a tap on this machine.
fn tap(machine: &Machine, retract_scale: Option<f64>) -> Option<Tap> {
    let spindle_rate = machine.spindle.acceleration_rpm_s / 60.0;
    retract_scale.map(|retract_scale| Tap { retract_scale, spindle_rate })
}

/// What can be said of a move in step with the spindle before anything moves. `retract_scale`: of a tap.
pub(crate) fn judge(
    program: &Program,
    machine: &Machine,
    limits: &HostLimits,
    mechanism: &Mechanism,
    step: &SynchronisedMove,
    retract_scale: Option<f64>,
) -> Result<(), Diagnostic> {
    let rpm = step.turns_s * 60.0;
    if !(rpm > 0.0) {
        return Err(messages::spindle_stands(program, step.span));
    }
    if rpm * retract_scale.unwrap_or(1.0) > machine.spindle.max_speed_rpm {
        let wanted = rpm * retract_scale.unwrap_or(1.0);
        return Err(messages::spindle_too_slow(program, step.span, wanted, machine.spindle.max_speed_rpm));
    }
    let period_s = machine.servo_period_ns as f64 / 1e9;
    let tap = tap(machine, retract_scale);
    let plan = |error: PlanError| messages::plan(program, machine, &error);
    let chain = Synchronised::<4>::new(limits, mechanism, period_s, &[*step], tap)
        .map_err(plan)?
        .ok_or_else(|| {
            // One move is one stretch.
            messages::host(program, "a move in step with the spindle has no room")
        })?;
    let fastest_rpm = chain.fastest_turns_s() * 60.0;
    if rpm > fastest_rpm {
        return Err(messages::spindle_too_fast(program, step, fastest_rpm, tap.is_some()));
    }
    let fastest_rpm_s = chain.fastest_rate() * 60.0;
    if tap.is_some() && machine.spindle.acceleration_rpm_s > fastest_rpm_s {
        return Err(messages::spindle_ramp(
            program,
            step.span,
            machine.spindle.acceleration_rpm_s,
            fastest_rpm_s,
        ));
    }
    Ok(())
}

/// A chain under way.
#[derive(Debug, Clone)]
pub(crate) struct SynchronisedDrive {
    chain: Box<Chain>,
    order: SpindleOrder,
    /// 1 or −1: turns count in the direction in which the spindle turns at the start.
    direction: f64,
    pub(crate) span: Span,
    is_tap: bool,
    /// Setpoints given, those of a period, and periods still to rest at the end.
    given: u64,
    substeps: u64,
    settle: u64,
    /// Periods in a row in which nothing moved, and how many are too many.
    waited: u64,
    most: u64,
}

impl SynchronisedDrive {
    /// The machine stands at the start of the first move; the spindle turns, or soon will, as `order` says.
    #[inline(never)] // the chain is 400 KB until it is in its box: not on the stack of every tick
    pub(crate) fn new(
        program: &Program,
        machine: &Machine,
        limits: &HostLimits,
        mechanism: &Mechanism,
        moves: &[SynchronisedMove],
        retract_scale: Option<f64>,
        (order, substeps): (SpindleOrder, u32),
    ) -> Result<Self, Diagnostic> {
        let span = moves.first().map_or(Span::default(), |step| step.span);
        let period_s = machine.servo_period_ns as f64 / 1e9;
        let tap = tap(machine, retract_scale);
        let chain = Chain::new(limits, mechanism, period_s, moves, tap)
            .map_err(|error| messages::plan(program, machine, &error))?
            .ok_or_else(|| messages::chain_too_long(program, span, MOST_MOVES))?;
        Ok(Self {
            chain: Box::new(chain),
            order,
            direction: if order.speed_rpm < 0.0 { -1.0 } else { 1.0 },
            span,
            is_tap: tap.is_some(),
            given: 0,
            substeps: u64::from(substeps.max(1)),
            settle: u64::from(machine.path.smoothing_periods),
            waited: 0,
            most: pkm_kins::maths::ceil(machine.spindle.timeout_s / period_s) as u64,
        })
    }

    /// The next setpoint; `now` is the last one.
    pub(crate) fn next(
        &mut self,
        program: &Program,
        machine: &Machine,
        mechanism: &Mechanism,
        feedback: &SpindleFeedback,
        now: &Setpoint,
    ) -> Result<Setpoint, Diagnostic> {
        let within = self.given % self.substeps;
        if within == 0 {
            if self.chain.stage() == Stage::Over {
                self.settle = self.settle.saturating_sub(1);
            }
            self.chain.tick(&SpindleReading {
                turns: feedback.revs * self.direction,
                turns_s: feedback.speed_rps * self.direction,
                at_speed: feedback.at_speed,
                index_enable: feedback.index_enable,
            });
        }
        self.given += 1;
        let share = (within + 1) as f64 / self.substeps as f64;
        let setpoint = self
            .chain
            .setpoint(mechanism, share, now)
            .map_err(|error| messages::plan(program, machine, &error))?;
        if within + 1 == self.substeps {
            self.waited = if setpoint.pose == now.pose { self.waited + 1 } else { 0 };
        }
        if self.waited > self.most {
            let timeout_s = machine.spindle.timeout_s;
            let rpm = feedback.speed_rps * 60.0;
            return Err(messages::spindle_timeout(
                program,
                self.span,
                self.chain.stage(),
                &self.order,
                rpm,
                timeout_s,
            ));
        }
        Ok(setpoint)
    }

    /// Brakes to rest on the path.
    pub(crate) fn abort(&mut self) {
        self.chain.abort();
    }

    /// What the spindle is to do meanwhile.
    pub(crate) fn command(&self) -> SpindleCommand {
        SpindleCommand {
            on: self.order.on,
            speed_rpm: self.order.speed_rpm * self.chain.spindle_factor(),
            orient: None,
            index_enable: self.chain.wants_index(),
        }
    }

    /// At rest for good, and the average over the joints has arrived.
    pub(crate) fn is_over(&self) -> bool {
        let whole = self.given.is_multiple_of(self.substeps);
        self.chain.stage() == Stage::Over && self.settle == 0 && whole
    }

    /// True if the tool never caught up with the spindle.
    pub(crate) fn was_never_in_step(&self) -> bool {
        !self.chain.was_in_step()
    }

    pub(crate) fn is_tap(&self) -> bool {
        self.is_tap
    }

    /// How far the tool is from where the spindle's turns say it should be, mm, while it is in step.
    pub(crate) fn error_mm(&self, feedback: &SpindleFeedback) -> Option<f64> {
        self.chain.error(feedback.revs * self.direction)
    }
}
