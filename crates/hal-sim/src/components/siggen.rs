//! `siggen`: square, sawtooth, triangle, sine and cosine between offset − amplitude and offset + amplitude, and a clock.
//!
//! The phase is 0 at the start and after `reset`. Square and clock are high in the first half; the sawtooth rises
//! through the whole, the triangle in the first half; the sine begins at offset, rising.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};
use pkm_kins::maths::{TAU, cos, floor, sin};

/// See the module.
#[derive(Debug, Clone)]
pub struct Siggen {
    frequency: FloatPin,
    amplitude: FloatPin,
    offset: FloatPin,
    reset: BitPin,
    square: FloatPin,
    sawtooth: FloatPin,
    triangle: FloatPin,
    sine: FloatPin,
    cosine: FloatPin,
    clock: BitPin,
    /// In [0, 1).
    phase: f64,
}

impl Block for Siggen {
    const NAME: &'static str = "siggen";
    const FUNCTION: &'static str = ".update";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            frequency: pins.float_in("frequency", 1.0)?,
            amplitude: pins.float_in("amplitude", 1.0)?,
            offset: pins.float_in("offset", 0.0)?,
            reset: pins.bit_in("reset")?,
            square: pins.float_out("square")?,
            sawtooth: pins.float_out("sawtooth")?,
            triangle: pins.float_out("triangle")?,
            sine: pins.float_out("sine")?,
            cosine: pins.float_out("cosine")?,
            clock: pins.bit_out("clock")?,
            phase: 0.0,
        })
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        if values.bit(self.reset) {
            self.phase = 0.0;
        }
        let phase = self.phase;
        let first_half = phase < 0.5;
        let (amplitude, offset) = (values.float(self.amplitude), values.float(self.offset));
        let waves = [
            (self.square, if first_half { 1.0 } else { -1.0 }),
            (self.sawtooth, 2.0 * phase - 1.0),
            (self.triangle, if first_half { 4.0 * phase - 1.0 } else { 3.0 - 4.0 * phase }),
            (self.sine, sin(TAU * phase)),
            (self.cosine, cos(TAU * phase)),
        ];
        for (pin, wave) in waves {
            values.set_float(pin, amplitude * wave + offset);
        }
        values.set_bit(self.clock, first_half);
        // as LinuxCNC: no more than half a turn a period
        let turn = (values.float(self.frequency) * tick.period.seconds()).clamp(-0.5, 0.5);
        let next = phase + turn;
        self.phase = next - floor(next);
    }
}
