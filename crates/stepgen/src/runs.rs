//! Runs (interval, count, add): a step stream small enough for a microcontroller's timer.
//!
//! A run is `count` steps in one direction of one joint; the first comes `interval` ticks after the joint's last step,
//! and each further gap is `add` ticks longer: step i (from 1) comes at last + i·interval + add·i(i−1)/2. A timer
//! interrupt needs one addition for the next time and one for the next interval.
//!
//! As bytes, a run is
//!
//! ```text
//! joint (bits 0-6), direction (bit 7: 1 = positive)     1 byte
//! interval      LEB128, unsigned                        1 to 10 bytes
//! count         LEB128, unsigned                        1 to 5
//! add           LEB128 of its zigzag form 0 −1 1 −2 …   1 to 10
//! ```

/// Most bytes of a run.
pub const MAX_RUN_BYTES: usize = 26;

/// Steps at slowly changing intervals; see the module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// Counted from 0, at most 127.
    pub joint: u8,
    /// In the joint's positive direction.
    pub forward: bool,
    /// Ticks from the joint's last step to the first of the run.
    pub interval: u64,
    /// Number of steps, ≥ 1.
    pub count: u32,
    /// Ticks by which each gap is longer than the one before.
    pub add: i64,
}

/// How exact runs must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunLimits {
    /// Largest deviation of a step, ticks. 0: exact.
    pub tolerance: u64,
    /// Least gap between two steps, ticks; where it forbids the tolerance, it wins.
    pub min_interval: u64,
    /// Steps stay in their period of so many ticks; 0: no such bound.
    pub period: u64,
}

/// Why bytes are no run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunError {
    /// They end before the run does.
    Short,
    /// A number is too large, or the count is 0.
    BadNumber,
}

impl Run {
    /// Time of step `i` (1 to count) if the joint's last step came at `last`; saturating.
    pub fn time(&self, last: u64, i: u32) -> u64 {
        let i = i128::from(i);
        let time =
            i128::from(last) + i * i128::from(self.interval) + i128::from(self.add) * (i * (i - 1) / 2);
        time.clamp(0, i128::from(u64::MAX)) as u64
    }

    /// Times of all its steps.
    pub fn times(&self, last: u64) -> impl Iterator<Item = u64> + use<> {
        let run = *self;
        (1..=run.count).map(move |i| run.time(last, i))
    }

    /// The longest run found for the steps at `times` (ascending), of a joint whose last step came at `last`. It covers
    /// `count` of them from the first on, at least one; None if there is none.
    ///
    /// For the second differences seen over 2, 4, 8 ... steps, and their neighbours, it keeps the range of intervals that
    /// suits all steps so far. Cost: a few passes over the steps of the run.
    pub fn longest(joint: u8, forward: bool, last: u64, times: &[u64], limits: &RunLimits) -> Option<Run> {
        let first = *times.first()?;
        let interval = first.saturating_sub(last).max(limits.min_interval);
        let mut best = Run { joint, forward, interval, count: 1, add: 0 };
        let mut reach = 2;
        // the fit over `reach` steps is worth trying while the best run came that far at least half way
        while reach <= times.len() && best.count as usize * 2 >= reach {
            let guess = second_difference(last, times, reach);
            for add in [guess, guess - 1, guess + 1] {
                if let Some((interval, count)) = fit(last, times, add, limits)
                    && count > best.count
                {
                    best = Run { interval, count, add, ..best };
                }
            }
            reach *= 2;
        }
        Some(best)
    }

    /// As bytes: how many of `bytes` are used.
    pub fn encode(&self, bytes: &mut [u8; MAX_RUN_BYTES]) -> usize {
        bytes[0] = self.joint & 0x7f | u8::from(self.forward) << 7;
        let zigzag = (self.add << 1 ^ self.add >> 63) as u64;
        let mut length = 1;
        for mut number in [self.interval, u64::from(self.count), zigzag] {
            loop {
                let more = number > 0x7f;
                if let Some(byte) = bytes.get_mut(length) {
                    *byte = (number & 0x7f) as u8 | u8::from(more) << 7;
                }
                length += 1;
                number >>= 7;
                if !more {
                    break;
                }
            }
        }
        length
    }

    /// The run at the beginning of `bytes`, and what follows it.
    ///
    /// # Errors
    /// `Short`, `BadNumber`.
    pub fn decode(bytes: &[u8]) -> Result<(Run, &[u8]), RunError> {
        let (head, rest) = bytes.split_first().ok_or(RunError::Short)?;
        let (interval, rest) = number(rest)?;
        let (count, rest) = number(rest)?;
        let (zigzag, rest) = number(rest)?;
        let count = u32::try_from(count).ok().filter(|count| *count > 0).ok_or(RunError::BadNumber)?;
        let add = (zigzag >> 1) as i64 ^ -((zigzag & 1) as i64);
        Ok((Run { joint: head & 0x7f, forward: head >> 7 == 1, interval, count, add }, rest))
    }
}

fn number(bytes: &[u8]) -> Result<(u64, &[u8]), RunError> {
    let mut value = 0_u64;
    let mut shift = 0;
    let mut rest = bytes;
    loop {
        let (byte, after) = rest.split_first().ok_or(RunError::Short)?;
        let bits = u64::from(byte & 0x7f);
        if shift > 63 || bits << shift >> shift != bits {
            return Err(RunError::BadNumber);
        }
        value |= bits << shift;
        (shift, rest) = (shift + 7, after);
        if byte >> 7 == 0 {
            return Ok((value, rest));
        }
    }
}

/// Change of the gap per step over the first `n` ≥ 2 steps: with t(i) = i·I + A·i(i−1)/2,
/// t(n) − n/m · t(m) = A·n(n−m)/2.
fn second_difference(last: u64, times: &[u64], n: usize) -> i64 {
    let at = |i: usize| times.get(i - 1).map_or(0, |time| time.saturating_sub(last)) as i128;
    let (m, n) = ((n / 2).max(1), n);
    let (whole, half) = (at(n), at(m));
    let (m, n) = (m as i128, n as i128);
    // × 2 m / (m n (n − m)), rounded to the nearest
    let (numerator, denominator) = (2 * (m * whole - n * half), m * n * (n - m));
    let rounded = (2 * numerator + denominator).div_euclid(2 * denominator);
    rounded.clamp(-(1 << 62), 1 << 62) as i64
}

/// How far steps with this `add` can follow `times`: an interval, and the number of steps.
fn fit(last: u64, times: &[u64], add: i64, limits: &RunLimits) -> Option<(u64, u32)> {
    let (mut lowest, mut highest) = (i128::from(limits.min_interval.max(1)), i128::from(u64::MAX));
    let mut found = None;
    for (i, &time) in (1_i128..).zip(times).take(1 << 20) {
        let (mut from, mut to) =
            (time.saturating_sub(limits.tolerance), time.saturating_add(limits.tolerance));
        if let Some(period) = time.saturating_sub(1).checked_div(limits.period) {
            from = from.max(period.saturating_mul(limits.period).saturating_add(1));
            to = to.min(period.saturating_add(1).saturating_mul(limits.period));
        }
        let grown = i128::from(last) + i128::from(add) * (i * (i - 1) / 2);
        // ⌈(from − grown)/i⌉ ≤ interval ≤ ⌊(to − grown)/i⌋, and the last gap is not below the least
        lowest = lowest.max(-(grown - i128::from(from)).div_euclid(i));
        lowest = lowest.max(i128::from(limits.min_interval.max(1)) - i128::from(add) * (i - 1));
        highest = highest.min((i128::from(to) - grown).div_euclid(i));
        if lowest > highest {
            break;
        }
        found = Some((((lowest + highest) / 2) as u64, i as u32));
    }
    found
}
