//! `ddt`: out = change of in per second.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Ddt {
    input: FloatPin,
    out: FloatPin,
    last: f64,
}

impl Block for Ddt {
    const NAME: &'static str = "ddt";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self { input: pins.float_in("in", 0.0)?, out: pins.float_out("out")?, last: 0.0 })
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        let input = values.float(self.input);
        values.set_float(self.out, (input - self.last) / tick.period.seconds());
        self.last = input;
    }
}
