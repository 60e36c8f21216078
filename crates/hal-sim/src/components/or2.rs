//! `or2`: out = in0 or in1.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Or2 {
    inputs: [BitPin; 2],
    out: BitPin,
}

impl Block for Or2 {
    const NAME: &'static str = "or2";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self { inputs: [pins.bit_in("in0")?, pins.bit_in("in1")?], out: pins.bit_out("out")? })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let [in0, in1] = self.inputs.map(|pin| values.bit(pin));
        values.set_bit(self.out, in0 || in1);
    }
}
