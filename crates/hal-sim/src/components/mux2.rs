//! `mux2`: out = in1 if sel, else in0.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Mux2 {
    inputs: [FloatPin; 2],
    sel: BitPin,
    out: FloatPin,
}

impl Block for Mux2 {
    const NAME: &'static str = "mux2";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            inputs: [pins.float_in("in0", 0.0)?, pins.float_in("in1", 0.0)?],
            sel: pins.bit_in("sel")?,
            out: pins.float_out("out")?,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let chosen = self.inputs[usize::from(values.bit(self.sel))];
        values.set_float(self.out, values.float(chosen));
    }
}
