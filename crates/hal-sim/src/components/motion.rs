//! `motion`: takes one setpoint per servo period and gives each joint its command.
//!
//! | pin                      | type      | meaning                                                    |
//! |--------------------------|-----------|------------------------------------------------------------|
//! | `joint.N.pos-cmd`        | float out | commanded position at the end of the period, mm or degrees |
//! | `joint.N.vel-cmd`        | float out | commanded velocity there, mm/s or degrees/s                |
//! | `joint.N.motor-pos-cmd`  | float out | the same as `pos-cmd` (no backlash or offset correction)   |
//! | `joint.N.motor-pos-fb`   | float in  | position of the motor, mm or degrees                       |
//! | `joint.N.motor-pos-stepped` | float in | where the steps stand, mm or degrees; not linked: `motor-pos-fb` |
//! | `joint.N.pos-fb`         | float out | `motor-pos-fb` as it was at the beginning of the period    |
//! | `joint.N.f-error`        | float out | commanded less actual position there                       |
//! | `axis.L.pos-cmd`         | float out | commanded pose, mm or degrees                              |
//! | `joint.N.f-error-lim`    | float rw  | largest such difference allowed; 0 = any                   |
//! | `joint.N.motor-offset`   | float out | motor position at which the joint is at 0; set by homing   |
//! | `joint.N.homed`          | bit out   | the joint knows where it is; its travel counts             |
//! | `joint.N.home-sw-in`     | bit in    | home switch (see [`crate::homing`])                        |
//! | `joint.N.index-in`       | bit in    | index of the encoder, for homing                           |
//! | `joint.N.pos-lim-sw-in`, `.neg-lim-sw-in` | bit in | limit switches                               |
//! | `joint.N.amp-fault-in`   | bit in    | the joint's drive has failed                               |
//! | `joint.N.amp-enable-out` | bit out   | the joint's drive is to be on                              |
//! | `motion.enable`          | bit in    | false (emergency stop): drives off, commands follow the steps |
//! | `motion.feed-hold`       | bit in    | the planner brakes on the path and waits                   |
//! | `motion.adaptive-feed`   | float in  | feed override, 0 to 2, on top of the operator's            |
//! | `halui.abort`            | bit in    | the planner brakes on the path and gives the program up    |
//! | `servo.missed`           | bit in    | simulated: the setpoint of this period does not come       |
//! | `servo.doubled`          | bit in    | simulated: the planner runs twice before the next period   |
//! | `motion.in-position`     | bit out   | nothing moves and nothing is waiting                       |
//! | `motion.program-line`    | s32 out   | line of the block under way                                |
//! | `motion.probe-input`     | bit in    | the probe touches: read by the planner                     |
//! | `motion.servo.overruns`  | u32 out   | setpoints that did not come while the machine moved        |
//!
//! Functions: `motion-command-handler` takes the operator's pins ([`Motion::operator`]), `motion-controller` does the rest.
//!
//! What no machine can follow is refused here, before any pin shows it: NaN, infinity, a position out of travel, a jump
//! beyond what the pulses of one period can do, an acceleration beyond the joint's. Each refusal is a [`Fault`] and a stop:
//!
//! * **category 0** (drives off in the same period, nothing moves any more): following error, feedback that is no number, a
//!   failed drive. A joint that is not held moves the platform of a parallel mechanism, so all drives go off together.
//! * **category 1** (all joints brake together, straight on in joint space, the slowest to stop at its acceleration limit;
//!   then drives off): refused commands, limit switches, setpoints missing for more than [`MOST_MISSED`] periods. No joint
//!   travels further than v²/2a.
//!
//! After a stop for what was fed back the joints are no longer homed: steps and motors may have parted.
//! Either lasts until `motion.enable` has been false and true again. If a limit switch is still on then, the joint may move
//! away from it only. A missing setpoint is bridged at constant acceleration; the next one must fit, within the limits.

use crate::component::{Component, Fault, PinIndex, PinName, Setpoint, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, S32Pin, U32Pin, Values};
use pkm_kins::{Axis, AxisSet, JointKind, JointRange, maths};

/// What motion knows of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionJoint {
    /// Length or angle.
    pub kind: JointKind,
    /// Travel, mm or rad.
    pub range: JointRange,
    /// Where it stands at the start, mm or rad.
    pub start: f64,
    /// mm or rad that one step moves.
    pub step: f64,
    /// The most steps in one servo period.
    pub max_steps: u64,
    /// mm/s² or rad/s²; infinite: any.
    pub max_acceleration: f64,
    /// mm or rad; 0: any.
    pub following_error: f64,
    /// It knows where it is.
    pub homed: bool,
}

/// How long a contact may bounce when it opens, s.
const BOUNCE_S: f64 = 0.05;

/// Setpoints that may be missing in a row while the machine moves.
pub const MOST_MISSED: u32 = 3;

/// Relative and absolute (mm or rad a period) slack of the acceleration, for rounding.
const ACCELERATION_SLACK: (f64, f64) = (0.01, 1e-9);

/// What the operator asks of the planner, as the pins were in the last period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Operator {
    /// Brake on the path and wait.
    pub feed_hold: bool,
    /// 0 to 2.
    pub adaptive_feed: f64,
    /// Brake on the path and give up.
    pub abort: bool,
    /// The planner is to run twice before the next period.
    pub doubled: bool,
}

impl Default for Operator {
    fn default() -> Self {
        Self { feed_hold: false, adaptive_feed: 1.0, abort: false, doubled: false }
    }
}

#[derive(Debug, Clone)]
struct JointPins {
    pos_cmd: FloatPin,
    vel_cmd: FloatPin,
    motor_pos_cmd: FloatPin,
    motor_pos_fb: FloatPin,
    motor_pos_stepped: FloatPin,
    pos_fb: FloatPin,
    f_error: FloatPin,
    f_error_lim: FloatPin,
    motor_offset: FloatPin,
    homed: BitPin,
    /// Against the positive and the negative end.
    limit_switches: [BitPin; 2],
    amp_fault_in: BitPin,
    amp_enable_out: BitPin,
}

/// Where a joint is and how it moves.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    /// Commanded, mm or rad.
    position: f64,
    /// Travel in the last period and in the one before, mm or rad.
    moved: [f64; 2],
    /// Motor position less joint position, mm or rad.
    offset: f64,
    /// Fed-back position less joint position, mm or rad: the same, unless steps were lost.
    feedback_offset: f64,
    /// Enabled with a limit switch on: it may be left for so long, s. Contacts bounce when they open.
    leaves_s: [f64; 2],
}

/// Whether the machine follows its setpoints.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Follows,
    /// Joints brake together; each travels this share of what it travelled in the period before the stop, less and less.
    Brakes {
        share: f64,
        less: f64,
    },
    /// Drives off until `enable` has been false.
    Stopped,
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Motion {
    joints: Vec<(MotionJoint, JointPins)>,
    states: Vec<State>,
    axes: Vec<(Axis, FloatPin)>,
    enable: BitPin,
    feed_hold: BitPin,
    adaptive_feed: FloatPin,
    abort: BitPin,
    servo_missed: BitPin,
    servo_doubled: BitPin,
    in_position: BitPin,
    program_line: S32Pin,
    overruns: U32Pin,
    operator: Operator,
    mode: Mode,
    was_enabled: bool,
    /// The last setpoint was the end of a motion.
    rests: bool,
    /// Setpoints missing in a row.
    missed: u32,
}

/// mm stay mm, rad become degrees.
pub(crate) fn shown(kind: JointKind, value: f64) -> f64 {
    match kind {
        JointKind::Linear => value,
        JointKind::Rotary => maths::degrees(value),
    }
}

/// mm stay mm, degrees become rad.
fn kept(kind: JointKind, value: f64) -> f64 {
    match kind {
        JointKind::Linear => value,
        JointKind::Rotary => maths::radians(value),
    }
}

fn bit(hal: &mut Hal, joint: usize, pin: &str, role: Role, value: bool) -> Result<BitPin, HalError> {
    hal.new_bit("motion", &format!("joint.{joint}.{pin}"), role, value)
}

const fn joint_pin(joint: usize, pin: &'static str) -> PinName {
    PinName { owner: "joint", index: PinIndex::Number(joint as u8), pin }
}

impl Motion {
    /// Loads the component: pins and functions.
    ///
    /// # Errors
    /// `Taken` if it is loaded already.
    pub fn load(hal: &mut Hal, joints: &[MotionJoint], axes: AxisSet) -> Result<(), HalError> {
        let mut with_pins = Vec::new();
        for (n, joint) in joints.iter().enumerate() {
            let start = shown(joint.kind, joint.start);
            let mut float =
                |pin: &str, role, value| hal.new_float("motion", &format!("joint.{n}.{pin}"), role, value);
            let pins = JointPins {
                pos_cmd: float("pos-cmd", Role::Out, start)?,
                vel_cmd: float("vel-cmd", Role::Out, 0.0)?,
                motor_pos_cmd: float("motor-pos-cmd", Role::Out, start)?,
                motor_pos_fb: float("motor-pos-fb", Role::In, start)?,
                motor_pos_stepped: float("motor-pos-stepped", Role::In, start)?,
                pos_fb: float("pos-fb", Role::Out, start)?,
                f_error: float("f-error", Role::Out, 0.0)?,
                f_error_lim: float("f-error-lim", Role::Parameter, shown(joint.kind, joint.following_error))?,
                motor_offset: float("motor-offset", Role::Out, 0.0)?,
                homed: bit(hal, n, "homed", Role::Out, joint.homed)?,
                limit_switches: [
                    bit(hal, n, "pos-lim-sw-in", Role::In, false)?,
                    bit(hal, n, "neg-lim-sw-in", Role::In, false)?,
                ],
                amp_fault_in: bit(hal, n, "amp-fault-in", Role::In, false)?,
                amp_enable_out: bit(hal, n, "amp-enable-out", Role::Out, true)?,
            };
            // read by homing
            bit(hal, n, "home-sw-in", Role::In, false)?;
            bit(hal, n, "index-in", Role::In, false)?;
            with_pins.push((*joint, pins));
        }
        let mut axis_pins = Vec::new();
        for axis in axes.iter() {
            let name = format!("axis.{}.pos-cmd", axis.letter().to_ascii_lowercase());
            axis_pins.push((axis, hal.new_float("motion", &name, Role::Out, 0.0)?));
        }
        hal.new_bit("motion", "motion.probe-input", Role::In, false)?;
        let mut switch = |name: &str, value| hal.new_bit("motion", name, Role::In, value);
        let motion = Self {
            enable: switch("motion.enable", true)?,
            feed_hold: switch("motion.feed-hold", false)?,
            abort: switch("halui.abort", false)?,
            servo_missed: switch("servo.missed", false)?,
            servo_doubled: switch("servo.doubled", false)?,
            adaptive_feed: hal.new_float("motion", "motion.adaptive-feed", Role::In, 1.0)?,
            in_position: hal.new_bit("motion", "motion.in-position", Role::Out, true)?,
            program_line: hal.new_s32("motion", "motion.program-line", Role::Out, 0)?,
            overruns: hal.new_u32("motion", "motion.servo.overruns", Role::Out, 0)?,
            states: joints.iter().map(|joint| State { position: joint.start, ..State::default() }).collect(),
            joints: with_pins,
            axes: axis_pins,
            operator: Operator::default(),
            mode: Mode::Follows,
            was_enabled: true,
            rests: true,
            missed: 0,
        };
        hal.add_component(
            Box::new(motion),
            &["motion-command-handler".to_owned(), "motion-controller".to_owned()],
        )
    }

    /// What the operator asked for in the last period.
    pub const fn operator(&self) -> Operator {
        self.operator
    }

    /// Nothing moves any more after a fault; `motion.enable` must become false and true again.
    pub fn is_stopped(&self) -> bool {
        self.mode == Mode::Stopped
    }

    /// As if `motion.enable` had been false for a period: a stop is over when it is true.
    pub(crate) const fn release(&mut self) {
        self.mode = Mode::Follows;
        self.was_enabled = false;
    }

    /// The drives are on, as of the last period.
    pub fn drives_on(&self) -> bool {
        self.was_enabled && self.mode != Mode::Stopped
    }

    /// Commanded position of a joint, mm or rad.
    pub fn commanded(&self, joint: usize) -> f64 {
        self.states.get(joint).map_or(0.0, |state| state.position)
    }

    /// Travel of a joint in the last period, mm or rad.
    pub fn travelled(&self, joint: usize) -> f64 {
        self.states.get(joint).map_or(0.0, |state| state.moved[0])
    }

    /// Setpoints that are missing now, in a row.
    pub const fn missed(&self) -> u32 {
        self.missed
    }

    /// Every joint knows where it is.
    pub fn is_homed(&self) -> bool {
        self.joints.iter().all(|(joint, _)| joint.homed)
    }

    /// The joint's zero is from now on where `shift` (mm or rad) was; the motor stays. It is homed then, if `homed`.
    pub(crate) fn set_home(&mut self, values: &mut Values, n: usize, shift: f64, homed: bool) {
        let ((joint, pins), state) = (&mut self.joints[n], &mut self.states[n]);
        joint.homed = homed;
        state.offset += shift;
        state.feedback_offset += shift;
        state.position -= shift;
        values.set_bit(pins.homed, homed);
        values.set_float(pins.motor_offset, shown(joint.kind, state.offset));
        values.set_float(pins.pos_cmd, shown(joint.kind, state.position));
    }

    /// Category 0 or 1: what must not be carried on at all, and what is braked from.
    fn check(&self, values: &Values, setpoint: &Setpoint, tick: &Tick<'_>) -> Result<(), Fault> {
        let (number, seconds) = (tick.number, tick.period.seconds());
        for &(axis, _) in &self.axes {
            let value = setpoint.pose.get(axis);
            if !value.is_finite() {
                let pin = PinName { owner: "axis", index: PinIndex::Letter(axis.letter()), pin: "pos-cmd" };
                return Err(Fault::NotFinite { tick: number, pin, value });
            }
        }
        let commands = setpoint.joints.iter().zip(&setpoint.velocities);
        let joints = self.joints.iter().zip(&self.states).zip(commands).enumerate();
        for (n, (((joint, pins), state), (&value, &velocity))) in joints {
            let (tick, pin) = (number, joint_pin(n, "pos-cmd"));
            if !value.is_finite() {
                return Err(Fault::NotFinite { tick, pin, value });
            }
            if !velocity.is_finite() {
                return Err(Fault::NotFinite { tick, pin: joint_pin(n, "vel-cmd"), value: velocity });
            }
            let slack = joint.step.abs();
            let limit = if value < joint.range.min - slack { joint.range.min } else { joint.range.max };
            if joint.homed && (value < joint.range.min - slack || value > joint.range.max + slack) {
                let (value, limit) = (shown(joint.kind, value), shown(joint.kind, limit));
                return Err(Fault::OutOfTravel { tick, pin, value, limit });
            }
            let travel = value - state.position;
            let steps = travel / joint.step;
            if steps.abs() > joint.max_steps as f64 {
                return Err(Fault::Jump { tick, pin, steps, max: joint.max_steps });
            }
            let most = joint.max_acceleration * (seconds * seconds);
            let change = travel - state.moved[0];
            if change.abs() > most * (1.0 + ACCELERATION_SLACK.0) + ACCELERATION_SLACK.1 {
                let value = shown(joint.kind, change / (seconds * seconds));
                let limit = shown(joint.kind, joint.max_acceleration);
                return Err(Fault::Acceleration { tick, pin, value, limit });
            }
            for (switch, name, towards) in LIMIT_SWITCHES {
                let leaves = state.leaves_s[switch] > 0.0 && values.bit(pins.limit_switches[switch]);
                // standing on it is no way towards it, rounded as it may be
                if leaves && travel * towards > ACCELERATION_SLACK.1 {
                    return Err(Fault::LimitSwitch { tick, pin: joint_pin(n, name) });
                }
            }
        }
        Ok(())
    }

    /// Drives and following errors, as they were at the beginning of the period.
    fn watch(&self, values: &mut Values, tick: u64) -> Result<(), Fault> {
        let mut result = Ok(());
        for (n, ((joint, pins), state)) in self.joints.iter().zip(&self.states).enumerate() {
            if values.bit(pins.amp_fault_in) {
                result = result.and(Err(Fault::AmplifierFault { tick, pin: joint_pin(n, "amp-fault-in") }));
            }
            let position = values.float(pins.motor_pos_fb);
            if !position.is_finite() {
                let pin = joint_pin(n, "motor-pos-fb");
                result = result.and(Err(Fault::NotFinite { tick, pin, value: position }));
                continue;
            }
            let position = position - shown(joint.kind, state.feedback_offset);
            let error = values.float(pins.pos_cmd) - position;
            values.set_float(pins.pos_fb, position);
            values.set_float(pins.f_error, error);
            let limit = values.float(pins.f_error_lim);
            if limit > 0.0 && error.abs() > limit {
                let pin = joint_pin(n, "f-error");
                result = result.and(Err(Fault::FollowingError { tick, pin, value: error, limit }));
            }
        }
        result
    }

    /// Limit switches. One that was on when the drives were enabled may be left.
    fn limit_switches(&mut self, values: &Values, tick: &Tick<'_>, enabled: bool) -> Result<(), Fault> {
        let mut result = Ok(());
        for (n, ((_, pins), state)) in self.joints.iter().zip(&mut self.states).enumerate() {
            for (switch, name, _) in LIMIT_SWITCHES {
                let on = values.bit(pins.limit_switches[switch]);
                let leaves_s = &mut state.leaves_s[switch];
                // on while the drives are off, or shortly before they went on
                if on && (*leaves_s > 0.0 || !enabled || !self.was_enabled) {
                    *leaves_s = BOUNCE_S;
                } else if on {
                    let pin = joint_pin(n, name);
                    result = result.and(Err(Fault::LimitSwitch { tick: tick.number, pin }));
                } else {
                    *leaves_s -= tick.period.seconds();
                }
            }
        }
        result
    }

    /// Drives off; the commands are where the motors are, as far as that can be told.
    fn stand(&mut self, values: &mut Values) {
        for ((joint, pins), state) in self.joints.iter().zip(&mut self.states) {
            let linked = values.float_is_linked(pins.motor_pos_stepped);
            let seen = values.float(if linked { pins.motor_pos_stepped } else { pins.motor_pos_fb });
            let commanded = shown(joint.kind, state.position + state.offset);
            let motor = if seen.is_finite() { seen } else { commanded };
            state.position = kept(joint.kind, motor) - state.offset;
            state.moved = [0.0; 2];
            let feedback = values.float(pins.motor_pos_fb);
            if !joint.homed && feedback.is_finite() {
                state.feedback_offset = kept(joint.kind, feedback) - state.position;
            }
            values.set_float(pins.pos_cmd, shown(joint.kind, state.position));
            values.set_float(pins.motor_pos_cmd, motor);
            values.set_float(pins.vel_cmd, 0.0);
            values.set_bit(pins.amp_enable_out, false);
        }
        values.set_bit(self.in_position, false);
        self.rests = true;
        self.missed = 0;
    }

    /// A joint goes on by `travel` and ends the period at `velocity`.
    fn go(&mut self, values: &mut Values, n: usize, travel: f64, velocity: f64) {
        let position = self.states[n].position + travel;
        self.command(values, n, position, velocity);
    }

    /// A joint is to be at `position` (mm or rad), with `velocity`, at the end of the period.
    fn command(&mut self, values: &mut Values, n: usize, position: f64, velocity: f64) {
        let ((joint, pins), state) = (&self.joints[n], &mut self.states[n]);
        state.moved = [position - state.position, state.moved[0]];
        state.position = position;
        values.set_float(pins.pos_cmd, shown(joint.kind, position));
        values.set_float(pins.motor_pos_cmd, shown(joint.kind, position + state.offset));
        values.set_float(pins.vel_cmd, shown(joint.kind, velocity));
    }

    /// Braking begins: every joint loses the same share of its speed each period, the slowest to stop at its limit.
    fn begin_to_brake(&mut self, seconds: f64) {
        let mut less = f64::INFINITY;
        for ((joint, _), state) in self.joints.iter().zip(&self.states) {
            if state.moved[0] != 0.0 {
                less = less.min(joint.max_acceleration * (seconds * seconds) / state.moved[0].abs());
            }
        }
        for state in &mut self.states {
            state.moved[1] = state.moved[0]; // what the shares are shares of
        }
        self.mode = Mode::Brakes { share: 1.0, less };
    }

    fn brake(&mut self, values: &mut Values, share: f64, less: f64, seconds: f64) {
        let now = (share - less).max(0.0);
        let next = (now - less).max(0.0);
        for n in 0..self.joints.len() {
            let full = self.states[n].moved[1];
            self.go(values, n, full * now, full * (0.5 * (now + next)) / seconds);
            self.states[n].moved[1] = full;
        }
        self.mode = if now > 0.0 { Mode::Brakes { share: now, less } } else { Mode::Stopped };
    }

    /// No setpoint while the machine moves: on at the same acceleration, never backwards.
    fn bridge(&mut self, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        self.missed += 1;
        values.set_u32(self.overruns, values.u32(self.overruns).saturating_add(1));
        if self.missed > MOST_MISSED {
            return Err(Fault::MissedPeriods { tick: tick.number, periods: self.missed });
        }
        for n in 0..self.joints.len() {
            let [last, before] = self.states[n].moved;
            let travel = last + (last - before);
            let travel = if travel * last < 0.0 { 0.0 } else { travel };
            self.go(values, n, travel, (travel + 0.5 * (travel - last)) / tick.period.seconds());
        }
        Ok(())
    }

    fn follow(&mut self, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        let setpoint = tick.setpoint.filter(|_| !values.bit(self.servo_missed));
        let Some(setpoint) = setpoint else {
            if !self.rests {
                return self.bridge(values, tick);
            }
            if tick.setpoint.is_some() {
                // at rest nothing moves on, but someone should be there
                self.missed += 1;
                values.set_u32(self.overruns, values.u32(self.overruns).saturating_add(1));
                if self.missed > MOST_MISSED {
                    return Err(Fault::MissedPeriods { tick: tick.number, periods: self.missed });
                }
            }
            for n in 0..self.joints.len() {
                self.go(values, n, 0.0, 0.0);
            }
            return Ok(());
        };
        self.check(values, setpoint, tick)?;
        self.missed = 0;
        self.rests = setpoint.velocities.iter().all(|velocity| *velocity == 0.0);
        for n in 0..self.joints.len() {
            self.command(values, n, setpoint.joints[n], setpoint.velocities[n]);
        }
        for &(axis, pin) in &self.axes {
            let value = setpoint.pose.get(axis);
            values.set_float(pin, if axis.is_rotary() { maths::degrees(value) } else { value });
        }
        values.set_bit(self.in_position, setpoint.in_position);
        values.set_s32(self.program_line, i32::try_from(setpoint.line).unwrap_or(i32::MAX));
        Ok(())
    }

    fn control(&mut self, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        let seconds = tick.period.seconds();
        let enabled = values.bit(self.enable);
        let watched = self.watch(values, tick.number);
        let limits = self.limit_switches(values, tick, enabled);
        self.was_enabled = enabled;
        if !enabled {
            self.mode = Mode::Follows;
            self.stand(values);
            return Ok(());
        }
        if self.mode == Mode::Stopped {
            self.stand(values);
            return Ok(());
        }
        if let Err(fault) = watched {
            self.mode = Mode::Stopped;
            for (joint, pins) in &mut self.joints {
                joint.homed = false;
                values.set_bit(pins.homed, false);
            }
            self.stand(values);
            return Err(fault);
        }
        for (_, pins) in &self.joints {
            values.set_bit(pins.amp_enable_out, true);
        }
        if let Mode::Brakes { share, less } = self.mode {
            self.brake(values, share, less, seconds);
            return Ok(());
        }
        let followed = limits.and_then(|()| self.follow(values, tick));
        if followed.is_err() {
            self.begin_to_brake(seconds);
            if let Mode::Brakes { share, less } = self.mode {
                self.brake(values, share, less, seconds);
            }
        }
        followed
    }

    /// The pins that the planner listens to.
    fn listen(&mut self, values: &Values) {
        let feed = values.float(self.adaptive_feed);
        self.operator = Operator {
            feed_hold: values.bit(self.feed_hold),
            // what is no number is no feed
            adaptive_feed: if feed.is_finite() { feed.clamp(0.0, 2.0) } else { 0.0 },
            abort: values.bit(self.abort),
            doubled: values.bit(self.servo_doubled),
        };
    }
}

/// Place among a joint's pins, name, and the sign of travel towards the end that it guards.
const LIMIT_SWITCHES: [(usize, &str, f64); 2] = [(0, "pos-lim-sw-in", 1.0), (1, "neg-lim-sw-in", -1.0)];

impl Component for Motion {
    fn name(&self) -> &'static str {
        "motion"
    }

    fn run(&mut self, function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        match function {
            1 => self.control(values, tick),
            _ => {
                self.listen(values);
                Ok(())
            }
        }
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
