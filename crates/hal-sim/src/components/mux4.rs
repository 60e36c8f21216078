//! `mux4`: out = the input with the number sel0 + 2 sel1.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Mux4 {
    inputs: [FloatPin; 4],
    sel: [BitPin; 2],
    out: FloatPin,
}

impl Block for Mux4 {
    const NAME: &'static str = "mux4";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        let mut input = |n: usize| pins.float_in(&format!("in{n}"), 0.0);
        Ok(Self {
            inputs: [input(0)?, input(1)?, input(2)?, input(3)?],
            sel: [pins.bit_in("sel0")?, pins.bit_in("sel1")?],
            out: pins.float_out("out")?,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let [sel0, sel1] = self.sel.map(|pin| usize::from(values.bit(pin)));
        values.set_float(self.out, values.float(self.inputs[sel0 + 2 * sel1]));
    }
}
