//! `not`: out = not in.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Not {
    input: BitPin,
    out: BitPin,
}

impl Block for Not {
    const NAME: &'static str = "not";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self { input: pins.bit_in("in")?, out: pins.bit_out("out")? })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let input = values.bit(self.input);
        values.set_bit(self.out, !input);
    }
}
