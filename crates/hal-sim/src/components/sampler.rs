//! `sampler`: keeps the values of its pins, one row a period, until someone takes them.
//!
//! | pin                     | type          | meaning                                                |
//! |-------------------------|---------------|--------------------------------------------------------|
//! | `sampler.0.pin.N`       | as configured | what is sampled                                        |
//! | `sampler.0.enable`      | bit in        | false: nothing is sampled                              |
//! | `sampler.0.curr-depth`  | s32 out       | rows that wait                                         |
//! | `sampler.0.full`        | bit out       | there was no room for the row of this period           |
//! | `sampler.0.overruns`    | s32 out       | rows lost so far                                       |
//!
//! Function: `sampler.0`.

use crate::component::{Component, Fault, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, PinType, S32Pin, U32Pin, Value, Values};
use std::collections::VecDeque;

#[derive(Debug, Clone, Copy)]
enum Sampled {
    Bit(BitPin),
    Float(FloatPin),
    S32(S32Pin),
    U32(U32Pin),
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Sampler {
    pins: Vec<Sampled>,
    enable: BitPin,
    curr_depth: S32Pin,
    full: BitPin,
    overruns: S32Pin,
    depth: usize,
    /// Ticks of the rows that wait, and their values.
    ticks: VecDeque<u64>,
    values: VecDeque<Value>,
}

impl Sampler {
    /// Loads the component for pins of these types and room for `depth` rows.
    ///
    /// # Errors
    /// `Taken` if it is loaded already.
    pub fn load(hal: &mut Hal, types: &[PinType], depth: usize) -> Result<(), HalError> {
        let owner = "sampler";
        let mut pins = Vec::new();
        for (n, pin_type) in types.iter().enumerate() {
            let name = format!("sampler.0.pin.{n}");
            pins.push(match pin_type {
                PinType::Bit => Sampled::Bit(hal.new_bit(owner, &name, Role::In, false)?),
                PinType::Float => Sampled::Float(hal.new_float(owner, &name, Role::In, 0.0)?),
                PinType::S32 => Sampled::S32(hal.new_s32(owner, &name, Role::In, 0)?),
                PinType::U32 => Sampled::U32(hal.new_u32(owner, &name, Role::In, 0)?),
            });
        }
        let sampler = Self {
            pins,
            enable: hal.new_bit(owner, "sampler.0.enable", Role::In, true)?,
            curr_depth: hal.new_s32(owner, "sampler.0.curr-depth", Role::Out, 0)?,
            full: hal.new_bit(owner, "sampler.0.full", Role::Out, false)?,
            overruns: hal.new_s32(owner, "sampler.0.overruns", Role::Out, 0)?,
            depth,
            ticks: VecDeque::with_capacity(depth),
            values: VecDeque::with_capacity(depth * types.len()),
        };
        hal.add_component(Box::new(sampler), &["sampler.0".to_owned()])
    }

    /// The oldest row: its period and values in pin order.
    pub fn take(&mut self) -> Option<(u64, Vec<Value>)> {
        let tick = self.ticks.pop_front()?;
        Some((tick, self.values.drain(..self.pins.len()).collect()))
    }
}

impl Component for Sampler {
    fn name(&self) -> &'static str {
        "sampler"
    }

    fn run(&mut self, _function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        let enabled = values.bit(self.enable);
        let full = enabled && self.ticks.len() == self.depth;
        if full {
            values.set_s32(self.overruns, values.s32(self.overruns).saturating_add(1));
        } else if enabled {
            self.ticks.push_back(tick.number);
            for pin in &self.pins {
                self.values.push_back(match *pin {
                    Sampled::Bit(pin) => Value::Bit(values.bit(pin)),
                    Sampled::Float(pin) => Value::Float(values.float(pin)),
                    Sampled::S32(pin) => Value::S32(values.s32(pin)),
                    Sampled::U32(pin) => Value::U32(values.u32(pin)),
                });
            }
        }
        values.set_bit(self.full, full);
        values.set_s32(self.curr_depth, i32::try_from(self.ticks.len()).unwrap_or(i32::MAX));
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
