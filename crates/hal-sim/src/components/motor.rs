//! `motor`: a stepper motor that follows its driver exactly.
//!
//! | pin or parameter  | type      | meaning                                    |
//! |-------------------|-----------|--------------------------------------------|
//! | `motor.N.counts`  | s32 in    | position of the driver, steps (wraps)      |
//! | `motor.N.position`| float out | position of the joint, mm or degrees       |
//! | `motor.N.scale`   | float ro  | steps per mm or degree                     |
//!
//! Function: `motor.update`.

use crate::component::{Component, Fault, Tick};
use crate::hal::{Hal, HalError, Role};
use crate::values::{FloatPin, S32Pin, Values};

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
    scale: f64,
    steps: i64,
    counts: S32Pin,
    position: FloatPin,
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
            let position = channel.start as f64 / channel.scale;
            hal.new_float("motor", &format!("motor.{n}.scale"), Role::ReadOnly, channel.scale)?;
            motors.push(Motor {
                scale: channel.scale,
                steps: channel.start,
                counts: hal.new_s32("motor", &format!("motor.{n}.counts"), Role::In, channel.start as i32)?,
                position: hal.new_float("motor", &format!("motor.{n}.position"), Role::Out, position)?,
            });
        }
        hal.add_component(Box::new(Self { motors }), &["motor.update".to_owned()])
    }
}

impl Component for Motors {
    fn name(&self) -> &'static str {
        "motor"
    }

    fn run(&mut self, _function: usize, values: &mut Values, _tick: &Tick<'_>) -> Result<(), Fault> {
        for motor in &mut self.motors {
            // the pin wraps at 2³¹, the motor does not
            let moved = values.s32(motor.counts).wrapping_sub(motor.steps as i32);
            motor.steps += i64::from(moved);
            values.set_float(motor.position, motor.steps as f64 / motor.scale);
        }
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
