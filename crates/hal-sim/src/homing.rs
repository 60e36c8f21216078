//! Homing: every joint finds its home switch, then its zero, and goes to its home position.
//!
//! ```text
//!  on the switch ─▶ leave it ─▶ wait ─▶ search ─▶ twice: leave it ─▶ wait ─▶ latch [─▶ index] ─▶ zero ─▶ (others) ─▶ home
//! ```
//!
//! A switch is on from its place to the end of the travel (a flag), so that a joint knows at the start on which side it
//! stands. *Search* goes towards the flag at the search velocity and brakes when it is on; *latch* comes back at the latch
//! velocity and takes the place of the **first** edge, by its time; what the contact does afterwards does not
//! count. It latches twice, and both must agree. Before each latch the joint waits until the contact has been off for
//! [`HomingConfig::debounce_s`]. With an index, the next index pulse after the switch counts instead.
//!
//! Joints with the same |`sequence`| home at the same time, lower numbers first. A negative number: they wait for each
//! other before they go to their home positions together, as in LinuxCNC.
//!
//! Every search is bounded by [`HomeJoint::travel`]. When one joint fails, all joints brake; the error names it.

use crate::free::Free;
use std::fmt;

/// How one joint homes. Lengths mm or rad.
#[derive(Debug, Clone, PartialEq)]
pub struct HomeJoint {
    /// For messages.
    pub name: String,
    /// Towards the switch, with sign; mm/s or rad/s, not 0.
    pub search_velocity: f64,
    /// Towards the switch, without sign; mm/s or rad/s, above 0.
    pub latch_velocity: f64,
    /// Where the switch (or the index after it) is.
    pub switch: f64,
    /// Where the joint goes when it is homed.
    pub home: f64,
    /// Order; negative: the last move is made together.
    pub sequence: i32,
    /// The index pulse after the switch is the reference.
    pub use_index: bool,
    /// How far apart two latches may be.
    pub repeat: f64,
    /// The longest way in search of a switch.
    pub travel: f64,
    /// Of the last move, mm/s or rad/s.
    pub velocity: f64,
    /// mm/s² or rad/s²
    pub acceleration: f64,
}

/// What homing sees of a joint in a period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HomeInput {
    /// The switch at the end of the period.
    pub on: bool,
    /// It was on at any time in the period.
    pub was_on: bool,
    /// Where the command was when it switched on first in the period.
    pub made_at: Option<f64>,
    /// Where the command was at the first index pulse of the period.
    pub index_at: Option<f64>,
}

/// Where a joint is to be at the end of the period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HomeCommand {
    /// mm or rad
    pub position: f64,
    /// Travel since the last period, mm or rad.
    pub travel: f64,
    /// The joint's zero is from now on where this was; it is homed.
    pub homed_by: Option<f64>,
}

/// Why homing failed. All joints stand.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)]
pub enum HomingError {
    /// The switch was not found.
    NotFound { joint: usize, name: String, travel: f64 },
    /// The switch does not let go.
    Stuck { joint: usize, name: String, travel: f64 },
    /// Two latches found two places.
    Unsteady { joint: usize, name: String, travel: f64 },
    /// No index pulse came after the switch.
    NoIndex { joint: usize, name: String, travel: f64 },
}

impl HomingError {
    /// Joint, name, way.
    const fn parts(&self) -> (usize, &String, f64) {
        match self {
            Self::NotFound { joint, name, travel }
            | Self::Stuck { joint, name, travel }
            | Self::Unsteady { joint, name, travel }
            | Self::NoIndex { joint, name, travel } => (*joint, name, *travel),
        }
    }

    /// The joint at fault.
    pub const fn joint(&self) -> usize {
        self.parts().0
    }
}

impl fmt::Display for HomingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (joint, name, travel) = self.parts();
        let what = match self {
            Self::NotFound { .. } => "no home switch was found",
            Self::Stuck { .. } => "the home switch stays on",
            Self::NoIndex { .. } => "no index pulse came after the home switch",
            Self::Unsteady { .. } => {
                return write!(
                    f,
                    "homing of joint {joint} ({name}) failed: the home switch was found at two places, {travel} apart; \
                     all joints stopped"
                );
            }
        };
        write!(f, "homing of joint {joint} ({name}) failed: {what} within {travel}; all joints stopped")
    }
}

impl std::error::Error for HomingError {}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Its sequence has not come yet.
    Waits,
    /// Off the switch; then `then`.
    Leaves {
        then: Then,
    },
    /// The contact must be off for so many periods.
    Settles {
        periods: u64,
        then: Then,
    },
    Searches,
    Latches,
    SeeksIndex,
    /// Zero is known; brakes.
    Stops,
    /// At rest, may wait for the others of its sequence.
    Ready,
    GoesHome,
    Done,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Then {
    Search,
    Latch,
}

#[derive(Debug, Clone)]
struct Joint {
    config: HomeJoint,
    free: Free,
    phase: Phase,
    /// Where the phase began.
    from: f64,
    /// Where the first latch found the reference.
    first: Option<f64>,
}

/// The homing of a machine.
#[derive(Debug, Clone)]
pub struct Homing {
    joints: Vec<Joint>,
    period_s: f64,
    debounce_periods: u64,
    /// |sequence| under way; None: over.
    sequence: Option<u32>,
    failure: Option<HomingError>,
}

/// What all joints have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HomingConfig {
    /// Servo period, s.
    pub period_s: f64,
    /// How long a contact must have been off to count as off, s.
    pub debounce_s: f64,
}

impl Joint {
    /// Towards the switch: 1 or −1.
    fn sign(&self) -> f64 {
        self.config.search_velocity.signum()
    }

    fn enter(&mut self, phase: Phase, period_s: f64) {
        self.phase = phase;
        self.from = self.free.position();
        let HomeJoint { search_velocity, latch_velocity, travel, velocity, acceleration, home, .. } =
            self.config;
        let (sign, fast) = (self.sign(), search_velocity.abs());
        let (target, velocity) = match phase {
            Phase::Leaves { .. } => (self.from - sign * travel, fast),
            Phase::Searches => (self.from + sign * travel, fast),
            Phase::Latches | Phase::SeeksIndex => (self.from + sign * travel, latch_velocity),
            Phase::GoesHome => (home, velocity),
            _ => {
                self.free.stop();
                return;
            }
        };
        self.free.go(target, velocity, acceleration, period_s);
    }

    /// The error of a way that was too long.
    fn gave_up(&self, joint: usize) -> Option<HomingError> {
        // the target of a search is the end of its bound
        let far = self.free.is_done();
        let (name, travel) = (self.config.name.clone(), self.config.travel);
        match self.phase {
            _ if !far => None,
            Phase::Searches | Phase::Latches => Some(HomingError::NotFound { joint, name, travel }),
            Phase::Leaves { .. } => Some(HomingError::Stuck { joint, name, travel }),
            Phase::SeeksIndex => Some(HomingError::NoIndex { joint, name, travel }),
            _ => None,
        }
    }

    /// One period; `place` is where the zero's reference was found.
    fn step(&mut self, input: &HomeInput, period_s: f64, debounce_periods: u64) -> Option<f64> {
        let mut place = None;
        match self.phase {
            // it lets go: brake, wait
            Phase::Leaves { then } if !input.on => {
                self.enter(Phase::Settles { periods: 0, then }, period_s);
            }
            Phase::Settles { periods, then } => {
                let periods = if input.was_on || input.on { 0 } else { periods + 1 };
                self.phase = Phase::Settles { periods, then };
                if input.on && self.free.is_done() {
                    // braked on the flag's edge: further
                    self.enter(Phase::Leaves { then }, period_s);
                } else if periods >= debounce_periods && self.free.is_done() {
                    let next = if then == Then::Search { Phase::Searches } else { Phase::Latches };
                    self.enter(next, period_s);
                }
            }
            Phase::Searches if input.on || input.made_at.is_some() => {
                self.enter(Phase::Leaves { then: Then::Latch }, period_s);
            }
            Phase::Latches if input.on || input.made_at.is_some() => {
                if self.config.use_index {
                    self.enter(Phase::SeeksIndex, period_s);
                } else {
                    place = Some(input.made_at.unwrap_or_else(|| self.free.position()));
                }
            }
            Phase::SeeksIndex => place = input.index_at,
            Phase::Stops if self.free.is_done() => self.phase = Phase::Ready,
            Phase::GoesHome if self.free.is_done() => self.phase = Phase::Done,
            _ => {}
        }
        place.map(|place| place - self.config.switch)
    }
}

impl Homing {
    /// `positions`: where the joints stand by what is known now, mm or rad.
    pub fn new(config: HomingConfig, joints: Vec<HomeJoint>, positions: &[f64]) -> Self {
        let joint = |(config, position): (HomeJoint, &f64)| Joint {
            config,
            free: Free::new(*position),
            phase: Phase::Waits,
            from: *position,
            first: None,
        };
        let mut homing = Self {
            joints: joints.into_iter().zip(positions).map(joint).collect(),
            period_s: config.period_s,
            debounce_periods: pkm_kins::maths::ceil(config.debounce_s / config.period_s) as u64,
            sequence: None,
            failure: None,
        };
        homing.sequence = homing.next_sequence(0);
        homing
    }

    fn next_sequence(&self, from: u32) -> Option<u32> {
        let sequences = self.joints.iter().map(|joint| joint.config.sequence.unsigned_abs());
        sequences.filter(|sequence| *sequence >= from).min()
    }

    /// All joints are homed and at their home positions.
    pub const fn is_done(&self) -> bool {
        self.sequence.is_none() && self.failure.is_none()
    }

    /// One period: what the joints saw in the last one → where they go in this one.
    ///
    /// # Errors
    /// [`HomingError`] once all joints stand.
    pub fn tick(&mut self, inputs: &[HomeInput], commands: &mut [HomeCommand]) -> Result<(), HomingError> {
        match &self.failure {
            // the last setpoint said that all stand
            Some(failure) if self.joints.iter().all(|joint| joint.free.is_done()) => {
                return Err(failure.clone());
            }
            Some(_) => {}
            None => self.step(inputs, commands),
        }
        for (joint, command) in self.joints.iter_mut().zip(commands.iter_mut()) {
            joint.free.tick();
            (command.position, command.travel) = (joint.free.position(), joint.free.travel());
        }
        Ok(())
    }

    fn step(&mut self, inputs: &[HomeInput], commands: &mut [HomeCommand]) {
        let Some(sequence) = self.sequence else { return };
        let (period_s, debounce) = (self.period_s, self.debounce_periods);
        for (n, ((joint, input), command)) in
            self.joints.iter_mut().zip(inputs).zip(commands.iter_mut()).enumerate()
        {
            command.homed_by = None;
            if joint.config.sequence.unsigned_abs() != sequence {
                continue;
            }
            if joint.phase == Phase::Waits {
                let first = if input.on {
                    Phase::Leaves { then: Then::Search }
                } else {
                    Phase::Settles { periods: 0, then: Then::Search }
                };
                joint.enter(first, period_s);
            }
            if let Some(shift) = joint.step(input, period_s, debounce) {
                match joint.first.replace(shift) {
                    // once more: a contact that lies is found out
                    None => joint.enter(Phase::Leaves { then: Then::Latch }, period_s),
                    Some(first) if (shift - first).abs() <= joint.config.repeat => {
                        command.homed_by = Some(shift);
                        joint.free.shift(shift);
                        joint.enter(Phase::Stops, period_s);
                    }
                    Some(first) => {
                        let (name, travel) = (joint.config.name.clone(), (shift - first).abs());
                        self.failure =
                            self.failure.take().or(Some(HomingError::Unsteady { joint: n, name, travel }));
                    }
                }
            }
            self.failure = self.failure.take().or_else(|| joint.gave_up(n));
        }
        if self.failure.is_some() {
            for joint in &mut self.joints {
                joint.free.stop();
            }
            return;
        }
        let now = |joint: &&mut Joint| joint.config.sequence.unsigned_abs() == sequence;
        let ready = |joint: &Joint| matches!(joint.phase, Phase::Ready | Phase::GoesHome | Phase::Done);
        let in_turn = |joint: &&Joint| joint.config.sequence.unsigned_abs() == sequence;
        let all_ready = self.joints.iter().filter(in_turn).all(ready);
        for joint in self.joints.iter_mut().filter(now) {
            if joint.phase == Phase::Ready && (all_ready || joint.config.sequence >= 0) {
                joint.enter(Phase::GoesHome, period_s);
            }
        }
        if self.joints.iter().filter(in_turn).all(|joint| joint.phase == Phase::Done) {
            self.sequence = self.next_sequence(sequence + 1);
        }
    }
}
