//! `scale`: out = in × gain + offset.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Scale {
    input: FloatPin,
    gain: FloatPin,
    offset: FloatPin,
    out: FloatPin,
}

impl Block for Scale {
    const NAME: &'static str = "scale";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            input: pins.float_in("in", 0.0)?,
            gain: pins.float_in("gain", 0.0)?,
            offset: pins.float_in("offset", 0.0)?,
            out: pins.float_out("out")?,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let out = values.float(self.input) * values.float(self.gain) + values.float(self.offset);
        values.set_float(self.out, out);
    }
}
