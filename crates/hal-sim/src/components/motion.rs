//! `motion`: takes one setpoint per servo period and gives each joint its command.
//!
//! | pin                      | type      | meaning                                                    |
//! |--------------------------|-----------|------------------------------------------------------------|
//! | `joint.N.pos-cmd`        | float out | commanded position at the end of the period, mm or degrees |
//! | `joint.N.vel-cmd`        | float out | commanded velocity there, mm/s or degrees/s                |
//! | `joint.N.motor-pos-cmd`  | float out | the same as `pos-cmd` (no backlash or offset correction)   |
//! | `joint.N.motor-pos-fb`   | float in  | position of the motor, mm or degrees                       |
//! | `joint.N.pos-fb`         | float out | `motor-pos-fb` as it was at the beginning of the period    |
//! | `joint.N.f-error`        | float out | commanded less actual position there                       |
//! | `axis.L.pos-cmd`         | float out | commanded pose, mm or degrees                              |
//! | `joint.N.f-error-lim`    | float rw  | largest such difference allowed; 0 = any                   |
//! | `joint.N.pos-lim-sw-in`, `.neg-lim-sw-in` | bit in | limit switches                               |
//! | `joint.N.amp-enable-out` | bit out   | the joint's drive is to be on                              |
//! | `motion.enable`          | bit in    | false (emergency stop): drives off, commands follow `motor-pos-fb` |
//! | `motion.in-position`     | bit out   | nothing moves and nothing is waiting                       |
//! | `motion.program-line`    | s32 out   | line of the block under way                                |
//! | `motion.probe-input`     | bit in    | the probe touches: read by the planner                     |
//!
//! Functions: `motion-command-handler` (nothing to do here, kept for HAL files), `motion-controller`.
//!
//! What no machine can follow is refused here, before any pin shows it: NaN, infinity, a position out of travel, a jump
//! beyond what the pulses of one period can do. A following error beyond its limit or a limit switch stops too. Each of
//! them is a [`Fault`] and switches all drives off in the same period, as if `motion.enable` were false, until that has
//! been false and true again.

use crate::component::{Component, Fault, PinIndex, PinName, Setpoint, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, S32Pin, Values};
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
}

#[derive(Debug, Clone)]
struct JointPins {
    pos_cmd: FloatPin,
    vel_cmd: FloatPin,
    motor_pos_cmd: FloatPin,
    motor_pos_fb: FloatPin,
    pos_fb: FloatPin,
    f_error: FloatPin,
    f_error_lim: FloatPin,
    pos_lim_sw_in: BitPin,
    neg_lim_sw_in: BitPin,
    amp_enable_out: BitPin,
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Motion {
    joints: Vec<(MotionJoint, JointPins)>,
    axes: Vec<(Axis, FloatPin)>,
    enable: BitPin,
    in_position: BitPin,
    program_line: S32Pin,
    /// mm or rad
    last: Vec<f64>,
    /// A fault keeps the drives off until `enable` has been false.
    stopped: bool,
}

/// mm stay mm, rad become degrees.
fn shown(kind: JointKind, value: f64) -> f64 {
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
                pos_fb: float("pos-fb", Role::Out, start)?,
                f_error: float("f-error", Role::Out, 0.0)?,
                f_error_lim: float("f-error-lim", Role::Parameter, 0.0)?,
                pos_lim_sw_in: bit(hal, n, "pos-lim-sw-in", Role::In, false)?,
                neg_lim_sw_in: bit(hal, n, "neg-lim-sw-in", Role::In, false)?,
                amp_enable_out: bit(hal, n, "amp-enable-out", Role::Out, true)?,
            };
            with_pins.push((*joint, pins));
        }
        let mut axis_pins = Vec::new();
        for axis in axes.iter() {
            let name = format!("axis.{}.pos-cmd", axis.letter().to_ascii_lowercase());
            axis_pins.push((axis, hal.new_float("motion", &name, Role::Out, 0.0)?));
        }
        hal.new_bit("motion", "motion.probe-input", Role::In, false)?;
        let motion = Self {
            joints: with_pins,
            axes: axis_pins,
            enable: hal.new_bit("motion", "motion.enable", Role::In, true)?,
            in_position: hal.new_bit("motion", "motion.in-position", Role::Out, true)?,
            program_line: hal.new_s32("motion", "motion.program-line", Role::Out, 0)?,
            last: joints.iter().map(|joint| joint.start).collect(),
            stopped: false,
        };
        hal.add_component(
            Box::new(motion),
            &["motion-command-handler".to_owned(), "motion-controller".to_owned()],
        )
    }

    fn check(&self, setpoint: &Setpoint, tick: u64) -> Result<(), Fault> {
        for &(axis, _) in &self.axes {
            let value = setpoint.pose.get(axis);
            if !value.is_finite() {
                let pin = PinName { owner: "axis", index: PinIndex::Letter(axis.letter()), pin: "pos-cmd" };
                return Err(Fault::NotFinite { tick, pin, value });
            }
        }
        let commands = setpoint.joints.iter().zip(&setpoint.velocities);
        for (n, (((joint, _), (&value, &velocity)), last)) in
            self.joints.iter().zip(commands).zip(&self.last).enumerate()
        {
            if !value.is_finite() {
                return Err(Fault::NotFinite { tick, pin: joint_pin(n, "pos-cmd"), value });
            }
            if !velocity.is_finite() {
                return Err(Fault::NotFinite { tick, pin: joint_pin(n, "vel-cmd"), value: velocity });
            }
            let slack = joint.step.abs();
            let limit = if value < joint.range.min - slack { joint.range.min } else { joint.range.max };
            if value < joint.range.min - slack || value > joint.range.max + slack {
                let (value, limit) = (shown(joint.kind, value), shown(joint.kind, limit));
                return Err(Fault::OutOfTravel { tick, pin: joint_pin(n, "pos-cmd"), value, limit });
            }
            let steps = (value - last) / joint.step;
            if steps.abs() > joint.max_steps as f64 {
                let pin = joint_pin(n, "pos-cmd");
                return Err(Fault::Jump { tick, pin, steps, max: joint.max_steps });
            }
        }
        Ok(())
    }

    /// Following errors and limit switches, as they were at the beginning of the period.
    fn watch(&self, values: &mut Values, tick: u64) -> Result<(), Fault> {
        let mut result = Ok(());
        for (n, (_, pins)) in self.joints.iter().enumerate() {
            let position = values.float(pins.motor_pos_fb);
            if !position.is_finite() {
                let pin = joint_pin(n, "motor-pos-fb");
                result = result.and(Err(Fault::NotFinite { tick, pin, value: position }));
                continue;
            }
            let error = values.float(pins.pos_cmd) - position;
            values.set_float(pins.pos_fb, position);
            values.set_float(pins.f_error, error);
            let limit = values.float(pins.f_error_lim);
            if limit > 0.0 && error.abs() > limit {
                let pin = joint_pin(n, "f-error");
                result = result.and(Err(Fault::FollowingError { tick, pin, value: error, limit }));
            }
            for (pin, name) in [(pins.pos_lim_sw_in, "pos-lim-sw-in"), (pins.neg_lim_sw_in, "neg-lim-sw-in")]
            {
                if values.bit(pin) {
                    result = result.and(Err(Fault::LimitSwitch { tick, pin: joint_pin(n, name) }));
                }
            }
        }
        result
    }

    /// Drives off; the commands are where the motors are, as far as that can be told.
    fn stand(&mut self, values: &mut Values) {
        for ((joint, pins), last) in self.joints.iter().zip(&mut self.last) {
            let feedback = values.float(pins.motor_pos_fb);
            let position = if feedback.is_finite() { feedback } else { shown(joint.kind, *last) };
            values.set_float(pins.pos_cmd, position);
            values.set_float(pins.motor_pos_cmd, position);
            values.set_float(pins.vel_cmd, 0.0);
            values.set_bit(pins.amp_enable_out, false);
            *last = kept(joint.kind, position);
        }
        values.set_bit(self.in_position, false);
    }

    fn control(&mut self, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        let watched = self.watch(values, tick.number);
        if !values.bit(self.enable) {
            self.stopped = false;
            self.stand(values);
            return Ok(());
        }
        if self.stopped {
            self.stand(values);
            return Ok(());
        }
        let checked = watched.and(tick.setpoint.map_or(Ok(()), |setpoint| self.check(setpoint, tick.number)));
        if checked.is_err() {
            self.stopped = true;
            self.stand(values);
            return checked;
        }
        for (_, pins) in &self.joints {
            values.set_bit(pins.amp_enable_out, true);
        }
        let Some(setpoint) = tick.setpoint else {
            for (_, pins) in &self.joints {
                values.set_float(pins.vel_cmd, 0.0);
            }
            return Ok(());
        };
        let commands = setpoint.joints.iter().zip(&setpoint.velocities);
        for (((joint, pins), (&value, &velocity)), last) in
            self.joints.iter().zip(commands).zip(&mut self.last)
        {
            let position = shown(joint.kind, value);
            values.set_float(pins.pos_cmd, position);
            values.set_float(pins.motor_pos_cmd, position);
            values.set_float(pins.vel_cmd, shown(joint.kind, velocity));
            *last = value;
        }
        for &(axis, pin) in &self.axes {
            let value = setpoint.pose.get(axis);
            values.set_float(pin, if axis.is_rotary() { maths::degrees(value) } else { value });
        }
        values.set_bit(self.in_position, setpoint.in_position);
        values.set_s32(self.program_line, i32::try_from(setpoint.line).unwrap_or(i32::MAX));
        Ok(())
    }
}

impl Component for Motion {
    fn name(&self) -> &'static str {
        "motion"
    }

    fn run(&mut self, function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        match function {
            1 => self.control(values, tick),
            _ => Ok(()),
        }
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
