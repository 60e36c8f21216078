//! `shaft-switch`: simulated hardware: a limit or home switch that bounces.
//!
//! | pin or parameter | type     | meaning                                                                       |
//! |------------------|----------|-------------------------------------------------------------------------------|
//! | `position`       | float in | of the joint at the end of the period                                         |
//! | `out`            | bit out  | the contact, with its edges inside the period                                 |
//! | `at`             | float rw | where it switches                                                             |
//! | `below`          | bit rw   | false: on from `at` upwards; true: on from `at` downwards                     |
//! | `hysteresis`     | float rw | it switches off so much further back                                          |
//! | `bounce-ns`      | u32 rw   | how long the contact bounces                                                  |
//! | `seed`           | u32 rw   | of the bounces                                                                |
//! | `stuck-on`, `stuck-off` | bit in | faults                                                                 |
//!
//! A switch that is on at the start does not bounce. Two to six bounces, at times that depend on the seed alone.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, U32Pin, Values};

/// See the module.
#[derive(Debug, Clone)]
pub struct ShaftSwitch {
    position: FloatPin,
    out: BitPin,
    at: FloatPin,
    below: BitPin,
    hysteresis: FloatPin,
    bounce_ns: U32Pin,
    seed: U32Pin,
    stuck_on: BitPin,
    stuck_off: BitPin,
    timer_period_ns: u64,
    /// Position at the end of the last period; None before the first.
    last: Option<f64>,
    on: bool,
    /// The level after the last edge.
    shown: bool,
    switched: u64,
    /// Time of the last edge.
    busy_until: u64,
}

/// splitmix64
fn hash(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Block for ShaftSwitch {
    const NAME: &'static str = "shaft-switch";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            position: pins.float_in("position", 0.0)?,
            out: pins.bit_out("out")?,
            at: pins.float_parameter("at", 0.0)?,
            below: pins.bit_parameter("below")?,
            hysteresis: pins.float_parameter("hysteresis", 0.0)?,
            bounce_ns: pins.u32_parameter("bounce-ns", 0)?,
            seed: pins.u32_parameter("seed", 0)?,
            stuck_on: pins.bit_in("stuck-on")?,
            stuck_off: pins.bit_in("stuck-off")?,
            timer_period_ns: pins.timer_period_ns(),
            last: None,
            on: false,
            shown: false,
            switched: 0,
            busy_until: 0,
        })
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        let (start, end) = (tick.period.start(), tick.period.end());
        let position = values.float(self.position);
        let sign = if values.bit(self.below) { -1.0 } else { 1.0 };
        let level = values.float(self.at) * sign;
        let here = position * sign;
        let threshold = if self.on { level - values.float(self.hysteresis).abs() } else { level };
        let on = here >= threshold;
        let bounce = u64::from(values.u32(self.bounce_ns)) / self.timer_period_ns;
        let seed = u64::from(values.u32(self.seed));
        let queue = values.edges_mut(self.out);
        queue.retire(start);
        match self.last {
            None => {
                self.shown = on;
                queue.push(start + 1, on);
            }
            Some(last) if on != self.on => {
                // the shaft moves uniformly within the period
                let before = last * sign;
                let part = if here == before { 1.0 } else { (threshold - before) / (here - before) };
                let ticks = f64::from(tick.period.ticks());
                let after = (part.clamp(0.0, 1.0) * ticks).max(1.0) as u64;
                let mut time = (start + after).max(self.busy_until + 1);
                let mut edge = |time: u64, level: bool| {
                    if level != self.shown {
                        queue.push(time, level);
                        (self.shown, self.busy_until) = (level, time);
                    }
                };
                self.switched += 1;
                let mut random = hash(seed << 32 ^ self.switched);
                if bounce > 0 {
                    let bounces = 2 + random % 5;
                    let mut left = bounce;
                    for _ in 0..bounces {
                        edge(time, on);
                        random = hash(random);
                        let closed = 1 + random % (left / 2).max(1);
                        edge(time + closed, !on);
                        random = hash(random);
                        let open = 1 + random % (left / 2).max(1);
                        time += closed + open;
                        left = left.saturating_sub(closed + open);
                    }
                }
                edge(time, on);
            }
            Some(_) => {}
        }
        (self.last, self.on) = (Some(position), on);
        values.show_edges(self.out, end);
        // a contact that is stuck shows no edges either
        if values.bit(self.stuck_on) || values.bit(self.stuck_off) {
            values.edges_mut(self.out).retire(u64::MAX);
            self.shown = values.bit(self.stuck_on);
            values.set_bit(self.out, self.shown);
        } else if self.shown != self.on && end > self.busy_until {
            // let loose again
            self.shown = self.on;
            values.set_bit(self.out, self.on);
        }
    }
}
