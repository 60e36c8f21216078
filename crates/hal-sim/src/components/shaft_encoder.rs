//! `shaft-encoder`: simulated hardware: an incremental encoder on a shaft, and what can go wrong with it.
//!
//! | pin or parameter                    | type     | meaning                                                       |
//! |-------------------------------------|----------|---------------------------------------------------------------|
//! | `position`                          | float in | of the shaft at the end of the period, any unit               |
//! | `phase-a`, `phase-b`, `phase-z`     | bit out  | the lines; A leads B while the position grows                 |
//! | `scale`                             | float rw | counts (quarters of a line) per unit, not 0                   |
//! | `counts-per-turn`                   | u32 rw   | Z is high at the counts that are multiples of it; 0: no index |
//! | `lost`                              | bit in   | fault: all lines low                                          |
//! | `frozen`                            | bit in   | fault: lines stay as they are                                 |
//! | `reversed`                          | bit in   | fault: A and B exchanged                                      |
//! | `offset`                            | float in | fault: a jump by so much                                      |
//!
//! Within a period the shaft moves uniformly. More than one count per timer tick is lost.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, U32Pin, Values};
use pkm_stepgen::Crossings;
use pkm_stepgen::step_types::QUADRATURE;

/// See the module.
#[derive(Debug, Clone)]
pub struct ShaftEncoder {
    position: FloatPin,
    /// A, B, Z
    lines: [BitPin; 3],
    scale: FloatPin,
    counts_per_turn: U32Pin,
    lost: BitPin,
    frozen: BitPin,
    reversed: BitPin,
    offset: FloatPin,
    /// None before the first period.
    shaft: Option<Crossings>,
    levels: [bool; 3],
}

/// Levels of A, B, Z at a count.
fn levels(count: i64, per_turn: u32, reversed: bool) -> [bool; 3] {
    let state = QUADRATURE.state(count);
    let (a, b) = (state & 1 == 1, state & 2 == 2);
    let z = per_turn > 0 && count.rem_euclid(i64::from(per_turn)) == 0;
    if reversed { [b, a, z] } else { [a, b, z] }
}

impl Block for ShaftEncoder {
    const NAME: &'static str = "shaft-encoder";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            position: pins.float_in("position", 0.0)?,
            lines: [pins.bit_out("phase-a")?, pins.bit_out("phase-b")?, pins.bit_out("phase-z")?],
            scale: pins.float_parameter("scale", 1.0)?,
            counts_per_turn: pins.u32_parameter("counts-per-turn", 0)?,
            lost: pins.bit_in("lost")?,
            frozen: pins.bit_in("frozen")?,
            reversed: pins.bit_in("reversed")?,
            offset: pins.float_in("offset", 0.0)?,
            shaft: None,
            levels: [false; 3],
        })
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        let target = (values.float(self.position) + values.float(self.offset)) * values.float(self.scale);
        let (lost, frozen) = (values.bit(self.lost), values.bit(self.frozen));
        let (reversed, per_turn) = (values.bit(self.reversed), values.u32(self.counts_per_turn));
        for line in self.lines {
            values.edges_mut(line).retire(tick.period.start());
        }
        let (lines, shown) = (self.lines, &mut self.levels);
        let mut show = |time: u64, count: i64| {
            let wanted = if lost { [false; 3] } else { levels(count, per_turn, reversed) };
            for ((line, shown), wanted) in lines.into_iter().zip(&mut *shown).zip(wanted) {
                if !frozen && *shown != wanted {
                    values.edges_mut(line).push(time, wanted);
                    *shown = wanted;
                }
            }
        };
        if self.shaft.is_none() {
            self.shaft = Crossings::new(target).ok();
        }
        if let Some(shaft) = &mut self.shaft {
            let mut count = shaft.count();
            show(tick.period.start() + 1, count);
            let most = u64::from(tick.period.ticks());
            let moved = shaft.advance_straight(target, &tick.period, most, &mut |time, forward| {
                count += if forward { 1 } else { -1 };
                show(time, count);
            });
            if moved.is_err() {
                // a jump, or no number: the lines show the place where it ends, if there is one
                if let Ok(there) = Crossings::new(target) {
                    show(tick.period.end(), there.count());
                    *shaft = there;
                }
            }
        }
        for line in self.lines {
            values.show_edges(line, tick.period.end());
        }
    }
}
