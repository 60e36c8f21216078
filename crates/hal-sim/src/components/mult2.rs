//! `mult2`: out = in0 × in1.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Mult2 {
    inputs: [FloatPin; 2],
    out: FloatPin,
}

impl Block for Mult2 {
    const NAME: &'static str = "mult2";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            inputs: [pins.float_in("in0", 0.0)?, pins.float_in("in1", 0.0)?],
            out: pins.float_out("out")?,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let [a, b] = self.inputs.map(|pin| values.float(pin));
        values.set_float(self.out, a * b);
    }
}
