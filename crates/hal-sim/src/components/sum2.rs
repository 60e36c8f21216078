//! `sum2`: out = in0 × gain0 + in1 × gain1 + offset.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Sum2 {
    /// Input and its gain.
    terms: [(FloatPin, FloatPin); 2],
    offset: FloatPin,
    out: FloatPin,
}

impl Block for Sum2 {
    const NAME: &'static str = "sum2";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            terms: [
                (pins.float_in("in0", 0.0)?, pins.float_in("gain0", 1.0)?),
                (pins.float_in("in1", 0.0)?, pins.float_in("gain1", 1.0)?),
            ],
            offset: pins.float_in("offset", 0.0)?,
            out: pins.float_out("out")?,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let [a, b] = self.terms.map(|(input, gain)| values.float(input) * values.float(gain));
        values.set_float(self.out, a + b + values.float(self.offset));
    }
}
