//! `dbounce`: out follows in once in has kept its level for `delay` periods more than the one that shows it.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, U32Pin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Dbounce {
    input: BitPin,
    out: BitPin,
    delay: U32Pin,
    cursor: u64,
    kept: u32,
}

impl Block for Dbounce {
    const NAME: &'static str = "dbounce";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            input: pins.bit_in("in")?,
            out: pins.bit_out("out")?,
            delay: pins.u32_parameter("delay", 5)?,
            cursor: 0,
            kept: 0,
        })
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        let input = values.bit(self.input);
        let bounced = values.edges(self.input).read(&mut self.cursor, tick.period.end()).len() > 1;
        let out = values.bit(self.out);
        self.kept = if input == out || bounced { 0 } else { self.kept + 1 };
        if self.kept > values.u32(self.delay) {
            values.set_bit(self.out, input);
            self.kept = 0;
        }
    }
}
