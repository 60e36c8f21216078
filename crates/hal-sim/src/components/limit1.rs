//! `limit1`: out = in, kept between min and max.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Limit1 {
    input: FloatPin,
    min: FloatPin,
    max: FloatPin,
    out: FloatPin,
}

impl Block for Limit1 {
    const NAME: &'static str = "limit1";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            input: pins.float_in("in", 0.0)?,
            min: pins.float_in("min", -1e20)?,
            max: pins.float_in("max", 1e20)?,
            out: pins.float_out("out")?,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let out = values.float(self.input).min(values.float(self.max)).max(values.float(self.min));
        values.set_float(self.out, out);
    }
}
