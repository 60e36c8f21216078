//! `lut5`: any function of five bits: out = the bit of `function` with the number in-0 + 2 in-1 + ... + 16 in-4.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, U32Pin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Lut5 {
    inputs: [BitPin; 5],
    function: U32Pin,
    out: BitPin,
}

impl Block for Lut5 {
    const NAME: &'static str = "lut5";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        let mut input = |n: usize| pins.bit_in(&format!("in-{n}"));
        Ok(Self {
            inputs: [input(0)?, input(1)?, input(2)?, input(3)?, input(4)?],
            function: pins.u32_parameter("function", 0)?,
            out: pins.bit_out("out")?,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let number = self.inputs.iter().rev().fold(0, |number, pin| 2 * number + u32::from(values.bit(*pin)));
        values.set_bit(self.out, values.u32(self.function) >> number & 1 == 1);
    }
}
