//! `streamer`: puts rows of values on its pins, one row a period, as long as there are any.
//!
//! | pin                      | type          | meaning                                          |
//! |--------------------------|---------------|--------------------------------------------------|
//! | `streamer.0.pin.N`       | as configured | the value of the row of this period              |
//! | `streamer.0.enable`      | bit in        | false: the pins stay as they are                 |
//! | `streamer.0.curr-depth`  | s32 out       | rows that wait                                   |
//! | `streamer.0.empty`       | bit out       | there was no row for this period                 |
//! | `streamer.0.underruns`   | s32 out       | periods without a row so far                     |
//!
//! Function: `streamer.0`.

use crate::component::{Component, Fault, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, PinType, S32Pin, U32Pin, Value, Values};
use std::collections::VecDeque;

#[derive(Debug, Clone, Copy)]
enum Streamed {
    Bit(BitPin),
    Float(FloatPin),
    S32(S32Pin),
    U32(U32Pin),
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Streamer {
    pins: Vec<Streamed>,
    enable: BitPin,
    curr_depth: S32Pin,
    empty: BitPin,
    underruns: S32Pin,
    depth: usize,
    values: VecDeque<Value>,
}

impl Streamer {
    /// Loads the component for pins of these types and room for `depth` rows.
    ///
    /// # Errors
    /// `Taken` if it is loaded already.
    pub fn load(hal: &mut Hal, types: &[PinType], depth: usize) -> Result<(), HalError> {
        let owner = "streamer";
        let mut pins = Vec::new();
        for (n, pin_type) in types.iter().enumerate() {
            let name = format!("streamer.0.pin.{n}");
            pins.push(match pin_type {
                PinType::Bit => Streamed::Bit(hal.new_bit(owner, &name, Role::Out, false)?),
                PinType::Float => Streamed::Float(hal.new_float(owner, &name, Role::Out, 0.0)?),
                PinType::S32 => Streamed::S32(hal.new_s32(owner, &name, Role::Out, 0)?),
                PinType::U32 => Streamed::U32(hal.new_u32(owner, &name, Role::Out, 0)?),
            });
        }
        let streamer = Self {
            pins,
            enable: hal.new_bit(owner, "streamer.0.enable", Role::In, true)?,
            curr_depth: hal.new_s32(owner, "streamer.0.curr-depth", Role::Out, 0)?,
            empty: hal.new_bit(owner, "streamer.0.empty", Role::Out, true)?,
            underruns: hal.new_s32(owner, "streamer.0.underruns", Role::Out, 0)?,
            depth,
            values: VecDeque::with_capacity(depth * types.len()),
        };
        hal.add_component(Box::new(streamer), &["streamer.0".to_owned()])
    }

    /// Types of its pins.
    pub fn types(&self) -> impl Iterator<Item = PinType> {
        self.pins.iter().map(|pin| match pin {
            Streamed::Bit(_) => PinType::Bit,
            Streamed::Float(_) => PinType::Float,
            Streamed::S32(_) => PinType::S32,
            Streamed::U32(_) => PinType::U32,
        })
    }

    /// Appends a row; false if there is no room, or its types are not those of the pins, or a number is not finite.
    pub fn put(&mut self, row: &[Value]) -> bool {
        let fits = row.len() == self.pins.len()
            && self.values.len() < self.depth * self.pins.len()
            && row.iter().zip(self.types()).all(|(value, pin_type)| value.pin_type() == pin_type)
            && row.iter().all(|value| !matches!(value, Value::Float(number) if !number.is_finite()));
        if fits {
            self.values.extend(row);
        }
        fits
    }
}

impl Component for Streamer {
    fn name(&self) -> &'static str {
        "streamer"
    }

    fn run(&mut self, _function: usize, values: &mut Values, _tick: &Tick<'_>) -> Result<(), Fault> {
        if values.bit(self.enable) {
            let empty = self.values.is_empty();
            if empty {
                values.set_s32(self.underruns, values.s32(self.underruns).saturating_add(1));
            }
            for (pin, value) in
                self.pins.iter().zip(self.values.drain(..self.pins.len().min(self.values.len())))
            {
                match (*pin, value) {
                    (Streamed::Bit(pin), Value::Bit(value)) => values.set_bit(pin, value),
                    (Streamed::Float(pin), Value::Float(value)) => values.set_float(pin, value),
                    (Streamed::S32(pin), Value::S32(value)) => values.set_s32(pin, value),
                    (Streamed::U32(pin), Value::U32(value)) => values.set_u32(pin, value),
                    _ => {} // `put` has looked
                }
            }
            values.set_bit(self.empty, empty);
        }
        let rows = self.values.len() / self.pins.len().max(1);
        values.set_s32(self.curr_depth, i32::try_from(rows).unwrap_or(i32::MAX));
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
