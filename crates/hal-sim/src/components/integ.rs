//! `integ`: out = sum of in × gain over time, kept between min and max.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Integ {
    input: FloatPin,
    gain: FloatPin,
    min: FloatPin,
    max: FloatPin,
    reset: BitPin,
    out: FloatPin,
}

impl Block for Integ {
    const NAME: &'static str = "integ";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            input: pins.float_in("in", 0.0)?,
            gain: pins.float_in("gain", 1.0)?,
            min: pins.float_in("min", -1e20)?,
            max: pins.float_in("max", 1e20)?,
            reset: pins.bit_in("reset")?,
            out: pins.float_out("out")?,
        })
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        let rate = values.float(self.input) * values.float(self.gain);
        let sum = values.float(self.out) + rate * tick.period.seconds();
        let kept = sum.min(values.float(self.max)).max(values.float(self.min));
        values.set_float(self.out, if values.bit(self.reset) { 0.0 } else { kept });
    }
}
