//! `comp`: out = in1 > in0, with hysteresis: true from in1 > in0 + hyst/2 on, false from in1 < in0 − hyst/2 on.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Comp {
    in0: FloatPin,
    in1: FloatPin,
    hyst: FloatPin,
    out: BitPin,
    equal: BitPin,
}

impl Block for Comp {
    const NAME: &'static str = "comp";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            in0: pins.float_in("in0", 0.0)?,
            in1: pins.float_in("in1", 0.0)?,
            hyst: pins.float_parameter("hyst", 0.0)?,
            out: pins.bit_out("out")?,
            equal: pins.bit_out("equal")?,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let half = 0.5 * values.float(self.hyst).abs();
        let above = values.float(self.in1) - values.float(self.in0);
        if above > half {
            values.set_bit(self.out, true);
        } else if above < -half {
            values.set_bit(self.out, false);
        }
        values.set_bit(self.equal, above.abs() <= half);
    }
}
