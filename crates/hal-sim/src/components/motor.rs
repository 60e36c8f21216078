//! `motor`: simulated hardware: a stepper motor and the drive train behind it.
//!
//! | pin or parameter             | type      | meaning                                                          |
//! |------------------------------|-----------|------------------------------------------------------------------|
//! | `motor.N.counts`             | s32 in    | position of the driver's field, steps (wraps)                    |
//! | `motor.N.position`           | float out | position of the joint, mm or degrees                             |
//! | `motor.N.scale`              | float rw  | steps per mm or degree, not 0                                    |
//! | `motor.N.backlash`           | float rw  | play between motor and joint, mm or degrees                      |
//! | `motor.N.microsteps`         | u32 rw    | steps per full step; 0: the motor follows exactly, whatever is asked |
//! | `motor.N.max-acceleration`   | float rw  | what its torque gives at rest, mm/s² or degrees/s²               |
//! | `motor.N.max-speed`          | float rw  | where no torque is left, mm/s or degrees/s                       |
//! | `motor.N.lost`               | s32 out   | steps lost so far, in the field's direction                      |
//!
//! Function: `motor.update`.
//!
//! The rotor is taken to the field with an acceleration of at most a₀ (1 − |v|/v₀), a straight torque-speed curve. Two full
//! steps from the field its torque turns round: it falls back by four full steps, one electrical cycle, and stands.

use crate::component::{Component, Fault, PinIndex, PinName, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{FloatPin, S32Pin, U32Pin, Values};

/// One motor as its place in the machine has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorChannel {
    /// Steps per mm or degree.
    pub scale: f64,
    /// Position at the start, steps.
    pub start: i64,
}

#[derive(Debug, Clone)]
struct Motor {
    counts: S32Pin,
    position: FloatPin,
    scale: FloatPin,
    backlash: FloatPin,
    microsteps: U32Pin,
    max_acceleration: FloatPin,
    max_speed: FloatPin,
    lost: S32Pin,
    /// Steps of the field, without wrapping.
    field: i64,
    /// Steps by which the rotor has fallen back, in whole cycles.
    slipped: i64,
    /// Steps.
    rotor: f64,
    /// Steps a period.
    speed: f64,
    /// Position of the joint, mm or degrees; within the play of that of the motor.
    joint: f64,
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Motors {
    motors: Vec<Motor>,
}

impl Motors {
    /// Loads the component: pins and function.
    ///
    /// # Errors
    /// `Taken` if it is loaded already.
    pub fn load(hal: &mut Hal, channels: &[MotorChannel]) -> Result<(), HalError> {
        let mut motors = Vec::new();
        for (n, channel) in channels.iter().enumerate() {
            let name = |pin: &str| format!("motor.{n}.{pin}");
            let start = channel.start as i32;
            let position = channel.start as f64 / channel.scale;
            let mut parameter = |pin: &str, value| hal.new_float("motor", &name(pin), Role::Parameter, value);
            motors.push(Motor {
                scale: parameter("scale", channel.scale)?,
                backlash: parameter("backlash", 0.0)?,
                max_acceleration: parameter("max-acceleration", 0.0)?,
                max_speed: parameter("max-speed", 0.0)?,
                microsteps: hal.new_u32("motor", &name("microsteps"), Role::Parameter, 0)?,
                counts: hal.new_s32("motor", &name("counts"), Role::In, start)?,
                position: hal.new_float("motor", &name("position"), Role::Out, position)?,
                lost: hal.new_s32("motor", &name("lost"), Role::Out, 0)?,
                field: channel.start,
                slipped: 0,
                rotor: channel.start as f64,
                speed: 0.0,
                joint: position,
            });
        }
        hal.add_component(Box::new(Self { motors }), &["motor.update".to_owned()])
    }
}

impl Motor {
    /// Takes the rotor towards the field for one period.
    fn turn(&mut self, values: &Values, scale: f64, seconds: f64) {
        let full_step = f64::from(values.u32(self.microsteps));
        let to_field = (self.field - self.slipped) as f64 - self.rotor;
        if full_step == 0.0 {
            (self.rotor, self.speed) = (self.rotor + to_field, 0.0);
            return;
        }
        // in steps a period
        let top = values.float(self.max_speed).abs() * scale.abs() * seconds;
        let start = values.float(self.max_acceleration).abs() * scale.abs() * seconds * seconds;
        let change = if top > 0.0 { (start * (1.0 - self.speed.abs() / top)).max(0.0) } else { 0.0 };
        self.speed = to_field.min(self.speed + change).max(self.speed - change);
        self.rotor += self.speed;
        let behind = to_field - self.speed;
        if behind.abs() > 2.0 * full_step {
            let cycle = 4.0 * full_step;
            let cycles = ((behind.abs() + 2.0 * full_step) / cycle) as i64;
            let back = cycles * i64::from(values.u32(self.microsteps)) * 4;
            self.slipped += if behind > 0.0 { back } else { -back };
            self.speed = 0.0;
        }
    }
}

impl Component for Motors {
    fn name(&self) -> &'static str {
        "motor"
    }

    fn run(&mut self, _function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        let mut result = Ok(());
        for (n, motor) in self.motors.iter_mut().enumerate() {
            // the pin wraps at 2³¹, the motor does not
            let moved = values.s32(motor.counts).wrapping_sub(motor.field as i32);
            motor.field += i64::from(moved);
            let scale = values.float(motor.scale);
            if scale == 0.0 {
                let pin = PinName { owner: "motor", index: PinIndex::Number(n as u8), pin: "scale" };
                result = Err(Fault::Parameter { tick: tick.number, pin });
                continue;
            }
            motor.turn(values, scale, tick.period.seconds());
            let (shaft, play) = (motor.rotor / scale, 0.5 * values.float(motor.backlash).abs());
            motor.joint = motor.joint.min(shaft + play).max(shaft - play);
            values.set_float(motor.position, motor.joint);
            values.set_s32(motor.lost, motor.slipped as i32);
        }
        result
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
