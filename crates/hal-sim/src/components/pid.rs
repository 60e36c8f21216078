//! `pid`: output = bias + P error + I ∫error + D d(error)/dt + FF0 command + FF1 d(command)/dt + FF2 d²(command)/dt².
//!
//! | pin                                            | meaning                                                    |
//! |------------------------------------------------|------------------------------------------------------------|
//! | `command`, `feedback`                          | float in                                                   |
//! | `enable`                                       | bit in; false: output 0, integral 0                        |
//! | `pgain` `igain` `dgain` `ff0` `ff1` `ff2` `bias` | float in (LinuxCNC writes `Pgain`, `FF0`; HAL files may too) |
//! | `deadband`                                     | errors below count as 0                                    |
//! | `maxoutput` `maxerror` `maxerrori`             | limits; 0 = none                                           |
//! | `error`, `output`, `saturated`                 | out                                                        |
//!
//! The integral does not grow while the output is at its limit and the error would drive it further.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct Pid {
    command: FloatPin,
    feedback: FloatPin,
    enable: BitPin,
    /// P, I, D, FF0, FF1, FF2, bias
    gains: [FloatPin; 7],
    deadband: FloatPin,
    max_output: FloatPin,
    max_error: FloatPin,
    max_integral: FloatPin,
    error: FloatPin,
    output: FloatPin,
    saturated: BitPin,
    state: State,
}

#[derive(Debug, Clone, Default)]
struct State {
    integral: f64,
    error: f64,
    command: f64,
    command_rate: f64,
    limited: f64,
}

/// `value` within ±limit; a limit of 0 is none.
fn within(value: f64, limit: f64) -> f64 {
    if limit == 0.0 { value } else { value.min(limit.abs()).max(-limit.abs()) }
}

impl Block for Pid {
    const NAME: &'static str = "pid";
    const FUNCTION: &'static str = ".do-pid-calcs";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            command: pins.float_in("command", 0.0)?,
            feedback: pins.float_in("feedback", 0.0)?,
            enable: pins.bit_in("enable")?,
            gains: [
                pins.float_in("pgain", 1.0)?,
                pins.float_in("igain", 0.0)?,
                pins.float_in("dgain", 0.0)?,
                pins.float_in("ff0", 0.0)?,
                pins.float_in("ff1", 0.0)?,
                pins.float_in("ff2", 0.0)?,
                pins.float_in("bias", 0.0)?,
            ],
            deadband: pins.float_in("deadband", 0.0)?,
            max_output: pins.float_in("maxoutput", 0.0)?,
            max_error: pins.float_in("maxerror", 0.0)?,
            max_integral: pins.float_in("maxerrori", 0.0)?,
            error: pins.float_out("error")?,
            output: pins.float_out("output")?,
            saturated: pins.bit_out("saturated")?,
            state: State::default(),
        })
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        let seconds = tick.period.seconds();
        let state = &mut self.state;
        let command = values.float(self.command);
        let raw = within(command - values.float(self.feedback), values.float(self.max_error));
        let error = if raw.abs() <= values.float(self.deadband) { 0.0 } else { raw };
        let error_rate = (error - state.error) / seconds;
        let command_rate = (command - state.command) / seconds;
        let command_acceleration = (command_rate - state.command_rate) / seconds;
        (state.error, state.command, state.command_rate) = (error, command, command_rate);
        values.set_float(self.error, error);
        if !values.bit(self.enable) {
            (state.integral, state.limited) = (0.0, 0.0);
            values.set_float(self.output, 0.0);
            values.set_bit(self.saturated, false);
            return;
        }
        if error * state.limited <= 0.0 {
            let grown = state.integral + error * seconds;
            state.integral = within(grown, values.float(self.max_integral));
        }
        let [p, i, d, ff0, ff1, ff2, bias] = self.gains.map(|pin| values.float(pin));
        let wanted = bias
            + p * error
            + i * state.integral
            + d * error_rate
            + ff0 * command
            + ff1 * command_rate
            + ff2 * command_acceleration;
        let output = within(wanted, values.float(self.max_output));
        state.limited = wanted - output;
        values.set_float(self.output, output);
        values.set_bit(self.saturated, state.limited != 0.0);
    }
}
