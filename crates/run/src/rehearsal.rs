//! A program rehearsed with faults: the fault-free run once, then any number of runs with a fault, each judged.
//!
//! Setpoints do not depend on what the machine does, so those of the fault-free run are kept, and the machine is kept (a
//! copy of it) every few periods: a fault costs only what comes after it. A fault on a pin that the planner listens to is
//! a run of its own from the beginning of the program.

use crate::controller::Controller;
use crate::program::Program;
use crate::wiring;
use crate::{Options, check, messages};
use pkm_analysis::outcome::{End, JOINTS, Objection, Outcome, Row, judge};
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_hal_sim::{FaultKind, Homing, PinFault, PinType, Role, Setpoint, Simulation, TickError, Value};
use pkm_machine::Machine;

/// Copies of the machine that are kept at most.
const MOST_COPIES: usize = 512;
/// Longest rehearsal, servo periods: its memory grows with it.
const MOST_PERIODS: usize = 2_000_000;
/// Periods that are watched after the end of a program.
const AFTER: usize = 3;
/// Periods between the end of a fault and the reset.
const SETTLE: usize = 30;
/// Pins that the planner listens to: with a fault on one of them, setpoints are others.
const PLANNER_PINS: [&str; 4] = ["motion.feed-hold", "motion.adaptive-feed", "halui.abort", "servo.doubled"];
/// Periods in which a machine must have come to rest.
const MOST_STOPPING: usize = 100_000;

/// A program on a machine, and what they did without a fault.
pub struct Rehearsal<'a> {
    program: &'a Program,
    machine: &'a Machine,
    options: Options,
    /// The machine as it stood at the ends of periods 0, `every`, ...
    copies: Vec<Session>,
    /// Periods between two copies.
    every: usize,
    setpoints: Vec<Setpoint>,
    rows: Vec<Row>,
    /// What a fault can be put on.
    pins: Vec<(String, PinType)>,
}

/// A run with a fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    /// Why it stopped; empty: it did not.
    pub message: String,
    /// What the judge says.
    pub verdict: Result<Outcome, Objection>,
    /// After a stop: the fault gone, reset, homed, and the program run to its end. Why not, otherwise.
    pub recovery: Result<(), String>,
}

/// The machine with a kept homing and its place among the kept setpoints.
#[derive(Clone)]
struct Session {
    simulation: Simulation,
    homing: Option<Homing>,
    next: usize,
}

/// Why a session stopped.
struct Stop {
    tick: u64,
    message: String,
    /// The program was aborted: the machine stands on the path.
    at_rest: bool,
}

impl Stop {
    fn end(&self) -> End<'_> {
        if self.at_rest {
            End::AtRest(self.tick, &self.message)
        } else {
            End::Stopped(self.tick, &self.message)
        }
    }
}

/// The machine as the judge sees it.
fn row(simulation: &Simulation, homing: bool, zeroed: bool) -> Row {
    let report = simulation.report();
    let mut row = Row {
        tick: report.tick,
        on: simulation.drives_on(),
        homed: simulation.is_homed() && !homing,
        zeroed,
        missed: simulation.missed_periods() > 0,
        commanded: [0.0; JOINTS],
        counted: [0.0; JOINTS],
        actual: [0.0; JOINTS],
    };
    let actual = simulation.true_joints();
    for (j, joint) in report.joints.iter().enumerate().take(JOINTS) {
        (row.commanded[j], row.counted[j], row.actual[j]) = (joint.commanded, joint.position, actual[j]);
    }
    row
}

impl Session {
    /// One period on the way to the end; false: it is there.
    fn period(&mut self, setpoints: &[Setpoint], rows: &mut Vec<Row>) -> Result<bool, Stop> {
        let tick = self.simulation.tick_number() + 1;
        let offsets = self.simulation.home_offsets();
        let result = match &mut self.homing {
            Some(homing) => match self.simulation.home(homing, &mut []) {
                Err(TickError::Source(error)) => {
                    return Err(Stop { tick: tick - 1, message: error.to_string(), at_rest: false });
                }
                Err(TickError::Fault(fault)) => Err(fault),
                Ok(_) => Ok(()),
            },
            None => match setpoints
                .get(self.next)
                .or(setpoints.last().filter(|_| self.simulation.missed_periods() > 0))
            {
                // a fault in the last period is noticed in the next
                None if self.next < setpoints.len() + AFTER => {
                    self.next += 1;
                    self.simulation.idle(&mut []).map(|_| ())
                }
                None => return Ok(false),
                Some(setpoint) => {
                    self.next += 1;
                    self.simulation.tick_to(setpoint, &mut []).map(|_| ())
                }
            },
        };
        let homing = self.homing.is_some();
        rows.push(row(&self.simulation, homing, offsets != self.simulation.home_offsets()));
        self.homing.take_if(|homing| homing.is_done());
        match result {
            Err(fault) => Err(Stop { tick, message: fault.to_string(), at_rest: false }),
            Ok(()) if !self.simulation.drives_on() => {
                Err(Stop { tick, message: "emergency stop".to_owned(), at_rest: false })
            }
            Ok(()) => Ok(true),
        }
    }

    fn run(&mut self, setpoints: &[Setpoint], rows: &mut Vec<Row>) -> Result<(), Stop> {
        while self.period(setpoints, rows)? {}
        Ok(())
    }

    /// To rest, and three periods more.
    fn stop(&mut self, rows: &mut Vec<Row>) {
        let mut left = 3;
        for _ in 0..MOST_STOPPING {
            let rests = self.simulation.report().setpoint.velocities.iter().all(|v| *v == 0.0);
            left -= i32::from(rests || !self.simulation.drives_on());
            if left < 0 {
                return;
            }
            // what has failed is told already
            let _ = self.simulation.idle(&mut []);
            rows.push(row(&self.simulation, self.homing.is_some(), false));
        }
    }
}

impl<'a> Rehearsal<'a> {
    /// Runs the program without a fault and keeps what is needed to run it with one.
    ///
    /// # Errors
    /// Why the program cannot be run to its end: the first error found.
    pub fn new(program: &'a Program, machine: &'a Machine, options: &Options) -> Result<Self, Diagnostic> {
        let options = Options { substeps: 1, faults: &[], ..*options };
        let checked = check(program, machine, &options)?;
        if let Some(error) = checked.diagnostics.iter().find(|d| d.severity == Severity::Error) {
            return Err(error.clone());
        }
        let mut controller = Controller::new(program, machine, &options, (true, true))?;
        let mut kept = Self {
            program,
            machine,
            options,
            copies: Vec::new(),
            every: 16,
            setpoints: Vec::new(),
            rows: vec![row(&controller.simulation, controller.is_homing(), false)],
            pins: controller
                .simulation
                .hal()
                .pins()
                .filter(|(name, _, role, ..)| *role == Role::In && !is_place_of_a_switch(name))
                .map(|(name, pin_type, ..)| (name.to_owned(), pin_type))
                .collect(),
        };
        while !controller.is_done() && kept.rows.len() < MOST_PERIODS {
            let periods = kept.rows.len() - 1;
            if kept.copies.len() == MOST_COPIES && periods.is_multiple_of(kept.every) {
                let mut n = 0;
                kept.copies.retain(|_| {
                    n += 1;
                    n % 2 == 1
                });
                kept.every *= 2;
            }
            if periods.is_multiple_of(kept.every) {
                kept.copies.push(Session {
                    simulation: controller.simulation.clone(),
                    homing: controller.homing().cloned(),
                    next: kept.setpoints.len(),
                });
            }
            let homing = controller.is_homing();
            let offsets = controller.simulation.home_offsets();
            controller.period(&mut [])?;
            if !homing {
                kept.setpoints.push(*controller.simulation.report().setpoint);
            }
            let zeroed = offsets != controller.simulation.home_offsets();
            kept.rows.push(row(&controller.simulation, homing, zeroed));
        }
        if let Some(failure) = controller.feeder.failure() {
            return Err(failure.clone());
        }
        if !controller.is_done() {
            return Err(messages::max_ticks(program, MOST_PERIODS as u64, controller.feeder.line()));
        }
        let verdict = judge(machine, &kept.rows, &kept.rows, End::Finished);
        verdict.map_err(|objection| messages::host(program, &format!("without a fault: {objection}")))?;
        Ok(kept)
    }

    /// Servo periods of the fault-free run.
    pub fn periods(&self) -> u64 {
        self.rows.len() as u64 - 1
    }

    /// What the machine did without a fault.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Input pins: those that can have a fault.
    pub fn pins(&self) -> impl Iterator<Item = &str> {
        self.pins.iter().map(|(name, _)| name.as_str())
    }

    /// The fault of a seed: any kind on any pin at any time, for a while or for good.
    pub fn random_fault(&self, seed: u64) -> PinFault {
        let mut state = seed;
        let mut below = |n: u64| {
            state = splitmix(state);
            (state >> 16) % n.max(1)
        };
        let (pin, pin_type) = &self.pins[below(self.pins.len() as u64) as usize];
        let tick = 1 + below(self.periods());
        let ticks = match below(4) {
            0 => None,
            1 => Some(1),
            2 => Some(1 + below(20)),
            _ => Some(1 + below(300)),
        };
        let number = |n: u64| {
            [-1e6, -1000.0, -3.0, -1.0, -0.01, -1e-4, 0.0, 1e-4, 0.01, 1.0, 3.0, 1000.0, 1e6][n as usize]
        };
        let kind = match (pin_type, below(4)) {
            (PinType::Bit, 0) => FaultKind::Set(Value::Bit(false)),
            (PinType::Bit, 1) => FaultKind::Set(Value::Bit(true)),
            (PinType::Float, 0) => [FaultKind::NotANumber, FaultKind::Infinite][below(2) as usize],
            (PinType::Float, 1) => FaultKind::Set(Value::Float(number(below(13)))),
            (PinType::S32 | PinType::U32, 0 | 1) => FaultKind::Offset(1.0 - 2.0 * below(2) as f64),
            (_, 2) => FaultKind::Freeze,
            (PinType::Bit, _) => FaultKind::Invert,
            (_, _) => [FaultKind::Invert, FaultKind::Offset(number(below(13)))][below(2) as usize],
        };
        PinFault { tick, ticks, pin: pin.clone(), kind }
    }

    /// Runs the program with faults, judges, and sees whether the machine can be used again.
    ///
    /// # Errors
    /// A fault is for a pin that the machine does not have.
    pub fn play(&self, faults: &[PinFault]) -> Result<Played, Diagnostic> {
        let first = faults.iter().map(|fault| fault.tick).min().unwrap_or(1);
        let at = usize::try_from(first).unwrap_or(usize::MAX).saturating_sub(1);
        let copy = (at / self.every).min(self.copies.len() - 1);
        let mut session = self.copies[copy].clone();
        self.inject(&mut session.simulation, faults)?;
        let begin = copy * self.every;
        let mut rows = self.rows[begin.saturating_sub(2)..=begin].to_vec();
        let planner = |fault: &PinFault| PLANNER_PINS.contains(&fault.pin.as_str());
        let stop = if faults.iter().any(planner) {
            rows = self.rows[..1].to_vec();
            self.anew(faults, &mut session, &mut rows)?
        } else {
            let stop = session.run(&self.setpoints, &mut rows).err();
            if stop.is_some() {
                session.stop(&mut rows);
            }
            stop
        };
        let end = stop.as_ref().map_or(End::Finished, Stop::end);
        let verdict = judge(self.machine, &self.rows, &rows, end);
        let recovery = if stop.is_some() { self.recover(session) } else { Ok(()) };
        Ok(Played { message: stop.map_or_else(String::new, |stop| stop.message), verdict, recovery })
    }

    fn inject(&self, simulation: &mut Simulation, faults: &[PinFault]) -> Result<(), Diagnostic> {
        for fault in faults {
            let injected = simulation.hal_mut().inject(fault);
            injected.map_err(|error| messages::no_such_pin(self.program, fault, &error))?;
        }
        Ok(())
    }

    /// The whole program, interpreted and planned anew.
    fn anew(
        &self,
        faults: &[PinFault],
        session: &mut Session,
        rows: &mut Vec<Row>,
    ) -> Result<Option<Stop>, Diagnostic> {
        let mut controller = Controller::new(self.program, self.machine, &self.options, (true, true))?;
        self.inject(&mut controller.simulation, faults)?;
        let mut stop = None;
        while !controller.is_done() && stop.is_none() {
            // a feed hold that stays on would hold for ever: the operator lets go
            if rows.len() > self.rows.len() * 4 + 1000 {
                controller.simulation.hal_mut().clear_faults();
            }
            let (homing, offsets) = (controller.is_homing(), controller.simulation.home_offsets());
            if let Err(diagnostic) = controller.period(&mut []) {
                stop = Some(Stop {
                    tick: controller.simulation.tick_number(),
                    message: diagnostic.message,
                    at_rest: false,
                });
            }
            let zeroed = offsets != controller.simulation.home_offsets();
            rows.push(row(&controller.simulation, homing, zeroed));
        }
        session.simulation = controller.simulation.clone();
        session.homing = None;
        if stop.is_none()
            && let Some(failure) = controller.feeder.failure()
        {
            let tick = controller.simulation.tick_number();
            stop = Some(Stop { tick, message: failure.message.clone(), at_rest: true });
        }
        if stop.is_some() {
            session.stop(rows);
        }
        Ok(stop)
    }

    /// The fault gone, reset, homed: the program must run to its end, and the machine be where it says.
    fn recover(&self, mut session: Session) -> Result<(), String> {
        let simulation = &mut session.simulation;
        simulation.hal_mut().clear_faults();
        simulation.emergency_stop();
        // contacts that opened have come to rest when a person presses reset
        for _ in 0..SETTLE {
            simulation.idle(&mut []).map_err(|fault| format!("not to be reset: {fault}"))?;
        }
        simulation.reset();
        let (count, to) = (self.machine.joints.len(), self.options.program_start(self.machine));
        simulation.forget_home();
        session.homing =
            Some(wiring::homing(self.machine, to, 1, &simulation.report().setpoint.joints[..count]));
        session.next = 0;
        let mut rows = vec![row(&session.simulation, true, true)];
        let result = session.run(&self.setpoints, &mut rows);
        result.map_err(|stop| format!("stopped again at tick {}: {}", stop.tick, stop.message))?;
        match judge(self.machine, &self.rows, &rows, End::Finished) {
            Ok(_) => Ok(()),
            Err(objection) => Err(format!("after homing: {objection}")),
        }
    }
}

/// A home switch that was moved (not its wire) cannot be noticed by any controller.
fn is_place_of_a_switch(pin: &str) -> bool {
    pin.starts_with("home-switch.") && pin.ends_with(".position")
}

/// splitmix64
fn splitmix(state: u64) -> u64 {
    let z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
