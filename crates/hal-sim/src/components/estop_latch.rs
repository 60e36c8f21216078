//! `estop-latch`: the emergency stop chain. `ok-out` becomes true at a rising `reset` while `ok-in` is true and
//! `fault-in` is false; it falls, and `fault-out` rises, in the same period as `ok-in` falls or `fault-in` rises.
//! `watchdog` toggles while all is well.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct EstopLatch {
    ok_in: BitPin,
    fault_in: BitPin,
    reset: BitPin,
    ok_out: BitPin,
    fault_out: BitPin,
    watchdog: BitPin,
    last_reset: bool,
}

impl Block for EstopLatch {
    const NAME: &'static str = "estop-latch";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            ok_in: pins.bit_in("ok-in")?,
            fault_in: pins.bit_in("fault-in")?,
            reset: pins.bit_in("reset")?,
            ok_out: pins.bit_out("ok-out")?,
            fault_out: pins.bit_out("fault-out")?,
            watchdog: pins.bit_out("watchdog")?,
            last_reset: false,
        })
    }

    fn update(&mut self, values: &mut Values, _tick: &Tick<'_>) {
        let healthy = values.bit(self.ok_in) && !values.bit(self.fault_in);
        let reset = values.bit(self.reset);
        let pressed = reset && !self.last_reset;
        self.last_reset = reset;
        let ok = healthy && (values.bit(self.ok_out) || pressed);
        values.set_bit(self.ok_out, ok);
        values.set_bit(self.fault_out, !ok);
        let toggled = ok && !values.bit(self.watchdog);
        values.set_bit(self.watchdog, toggled);
    }
}
