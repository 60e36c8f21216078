//! `charge-pump`: `out` toggles in each period while `enable` is true; `out-2` and `out-4` at half and a quarter of the
//! frequency. A machine that stops running the thread stops the pump.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct ChargePump {
    enable: BitPin,
    outs: [BitPin; 3],
    count: u32,
}

impl Block for ChargePump {
    const NAME: &'static str = "charge-pump";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            enable: pins.bit_in_true("enable")?,
            outs: [pins.bit_out("out")?, pins.bit_out("out-2")?, pins.bit_out("out-4")?],
            count: 0,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let enabled = values.bit(self.enable);
        self.count = if enabled { self.count.wrapping_add(1) } else { 0 };
        for (bit, out) in self.outs.into_iter().enumerate() {
            values.set_bit(out, self.count >> bit & 1 == 1);
        }
    }
}
