//! The two small problems of one interval: how fast it may be entered, and how fast it can be left.
//!
//! Within an interval of length Δs the acceleration s̈ is constant, so x′ = x + 2 Δs s̈ at its end. The strips at
//! both ends are then linear in (x, x′). The set they allow is convex and holds (0, 0): stopping is always possible.

use crate::limits::Rows;
use crate::pair::{Pair, each, higher, highest, lower, with};

/// Calls `look` with a and b of every strip |a·x + b·x′| ≤ h, where h = 2 Δs; two rows at a time.
#[inline(always)]
fn borders<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    h: f64,
    mut look: impl FnMut(Pair, Pair),
) {
    for ((p, q), (p_end, q_end)) in left.pairs(rows).zip(right.pairs(rows)) {
        let (start, end) = (with(p, q, |p, q| h * q - p), with(p_end, q_end, |p, q| p + h * q));
        for (a, b) in [(start, p), (each(p_end, |p| -p), end)] {
            look(a, b);
        }
    }
}

/// True if all strips allow to go from `x` to `x_next`; `slack` is for rounding.
#[inline(always)]
pub(crate) fn allows<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    length: f64,
    (x, x_next): (f64, f64),
    slack: f64,
) -> bool {
    let h = 2.0 * length;
    let mut widest = [0.0; 2];
    borders(left, right, rows, h, |a, b| {
        widest = with(widest, with(a, b, |a, b| (a * x + b * x_next).abs()), higher);
    });
    highest(widest) <= h * (1.0 + slack)
}

/// A pair of borders x′ = slope·x ± half.
#[derive(Clone, Copy)]
struct Lines {
    slope: Pair,
    half: Pair,
}

/// Lowest and (its negative, a maximum like the lowest) highest x′ at an x, and where the same borders are at 0.
struct Gap {
    low: Pair,
    low_at_0: Pair,
    minus_high: Pair,
    minus_high_at_0: Pair,
}

impl Gap {
    fn below(next_cap: f64) -> Self {
        Self {
            low: [0.0; 2],
            low_at_0: [0.0; 2],
            minus_high: [-next_cap; 2],
            minus_high_at_0: [-next_cap; 2],
        }
    }

    #[inline(always)]
    fn narrow(&mut self, lines: &Lines, x: f64) {
        for k in [0, 1] {
            let (middle, at_0) = (lines.slope[k] * x, -lines.half[k]);
            let (bottom, minus_top) = (at_0 + middle, at_0 - middle);
            self.low_at_0[k] = if bottom > self.low[k] { at_0 } else { self.low_at_0[k] };
            self.minus_high_at_0[k] =
                if minus_top > self.minus_high[k] { at_0 } else { self.minus_high_at_0[k] };
            self.low[k] = higher(self.low[k], bottom);
            self.minus_high[k] = higher(self.minus_high[k], minus_top);
        }
    }

    /// How far it is open at x and at 0.
    fn width(&self) -> (f64, f64) {
        let of_both = |at: Pair, at_0: Pair| if at[1] > at[0] { (at[1], at_0[1]) } else { (at[0], at_0[0]) };
        let (low, low_at_0) = of_both(self.low, self.low_at_0);
        let (minus_high, minus_high_at_0) = of_both(self.minus_high, self.minus_high_at_0);
        (-minus_high - low, -minus_high_at_0 - low_at_0)
    }
}

/// The largest x ≤ `cap` from which some x′ ≤ `next_cap` can be reached within all strips.
///
/// The highest and the lowest x′ that the strips leave are a concave and a convex function of x, both straight in pieces. From
/// an x where the lowest is above the highest, the x at which those two borders meet is nearer to the answer and
/// not below it: Newton's method, which ends after finitely many steps here because the pieces are straight (two as a
/// rule; each costs one walk over the strips).
#[inline]
pub(crate) fn fastest_entry<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    length: f64,
    cap: f64,
    next_cap: f64,
) -> f64 {
    let h = 2.0 * length;
    let mut x = cap;
    // As a rule the highest x′ asked for is the one.
    let reached = |x: f64| allows(left, right, rows, length, (x, next_cap), 1e-12);
    if reached(x) {
        return x;
    }
    // The borders as lines. One that is all but upright does not care for x′: as a line it would be the difference of two
    // huge numbers.
    const UPRIGHT: f64 = 1e-9;
    let mut upright = f64::INFINITY;
    const NONE: Lines = Lines { slope: [0.0; 2], half: [f64::INFINITY; 2] };
    let mut lines = [NONE; R];
    let mut slots = lines.iter_mut();
    let mut gap = Gap::below(next_cap);
    borders(left, right, rows, h, |a, b| {
        let Some(slot) = slots.next() else { return };
        let part = each(b, |b| 1.0 / b);
        slot.slope = with(a, part, |a, part| -a * part);
        slot.half = each(part, |part| h * part.abs());
        let is_upright = |k: usize| b[k].abs() * next_cap <= UPRIGHT * h;
        if is_upright(0) || is_upright(1) {
            for k in [0, 1] {
                if is_upright(k) {
                    upright = lower(upright, h / a[k].abs());
                    (slot.slope[k], slot.half[k]) = (0.0, f64::INFINITY);
                }
            }
        }
        gap.narrow(slot, x);
    });
    // Every step leaves at least one of the 4·rows + 2 borders behind for good.
    for _ in 0..4 * R + 2 {
        // The gap is open at 0 and, where it is closed at x, closes in between.
        let (open, open_at_0) = gap.width();
        let next = lower(if open >= 0.0 { x } else { x * (open_at_0 / (open_at_0 - open)) }, upright);
        // What is left of the way is rounding.
        if !(next < x * (1.0 - 1e-14)) {
            return lower(x, next);
        }
        x = higher(0.0, next);
        if reached(x) {
            return x;
        }
        gap = Gap::below(next_cap);
        for pair in lines.iter().take(2 * rows.div_ceil(2)) {
            gap.narrow(pair, x);
        }
    }
    x
}

/// Where a joint's q′ passes zero, b is all rounding and so is the room at the limit: without a little slack their
/// quotient is anything.
pub(crate) const SLACK: f64 = 1e-9;

/// The range of x′ that the strips allow when the interval is entered with `x`. `low` may lie above `high` by
/// rounding only, as long as `x` does not exceed [`fastest_entry`].
pub(crate) fn exits<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    length: f64,
    x: f64,
) -> (f64, f64) {
    // The negative of `high` is a maximum too: one and the same operation for all.
    let (mut low, mut minus_high) = ([0.0; 2], [f64::NEG_INFINITY; 2]);
    let h = 2.0 * length;
    borders(left, right, rows, h, |a, b| {
        // Where b is 0, what comes out is infinite or no number, and asks for nothing.
        let part = each(b, |b| 1.0 / b);
        let middle = with(a, part, |a, part| -a * x * part);
        let half = each(part, |part| h * (1.0 + SLACK) * part.abs());
        low = with(low, with(middle, half, |middle, half| middle - half), higher);
        minus_high = with(minus_high, with(middle, half, |middle, half| -middle - half), higher);
    });
    (highest(low), -highest(minus_high))
}

/// The accelerations that the strips at both ends allow for every x from `x_low` to `x_high`: (hardest braking,
/// hardest speeding up). The first may be above 0 and the second below it.
pub(crate) fn accelerations<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    x_low: f64,
    x_high: f64,
) -> (f64, f64) {
    let (mut low, mut minus_high) = ([f64::NEG_INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for side in [left, right] {
        for (p, q) in side.pairs(rows) {
            // |p a + q x| ≤ 1 at both x.
            let q = with(p, q, |p, q| if p >= 0.0 { q } else { -q });
            let p = each(p, f64::abs);
            let (at_low, at_high) = (each(q, |q| q * x_low), each(q, |q| q * x_high));
            let most = with(at_low, at_high, higher);
            let minus_least = with(each(at_low, |q| -q), each(at_high, |q| -q), higher);
            // Where p is 0, nothing is asked for.
            let part =
                |room: Pair| with(room, p, |room, p| if p > 0.0 { room / p } else { f64::NEG_INFINITY });
            low = with(low, part(each(minus_least, |q| q - 1.0)), higher);
            minus_high = with(minus_high, part(each(most, |q| q - 1.0)), higher);
        }
    }
    (highest(low), -highest(minus_high))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint whose q′ is all rounding (−7e-21) where another one decides: met on a path of half circles of 0.5 µm.
    #[test]
    fn an_all_but_upright_border_hides_no_other() {
        let left = Rows {
            first: [-7.26673310003658e-21, 0.0033350008337502076],
            second: [-2.1466087112274015, -3.344462417456647],
        };
        let right = Rows {
            first: [-9.747767652901864e-5, 0.0031785939589947074],
            second: [-2.0409939413685905, -3.3747154182543015],
        };
        let (length, next_cap) = (4.6555360962239324e-5, 0.2804407824314615);
        let x = fastest_entry(&left, &right, 2, length, 1588.0, next_cap);
        let (low, high) = exits(&left, &right, 2, length, x);
        assert!(low <= next_cap * (1.0 + 1e-9) && low <= high, "from {x}: {low} to {high}");
    }

    fn next(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    }

    /// Against a dense scan of x′: the closed form finds the true optimum.
    #[test]
    fn fastest_entry_is_the_optimum() {
        let mut seed = 0x1234_5678_9abc_def1;
        for case in 0..2000 {
            // Three rows: the second pair is half empty.
            let mut values = |size: f64| {
                let mut three = [0.0; 4];
                three[..3].fill_with(|| next(&mut seed) * size);
                three
            };
            let rows: [Rows<4>; 2] =
                core::array::from_fn(|_| Rows { first: values(1.0), second: values(0.3) });
            let (length, cap, next_cap) =
                (1.0 + next(&mut seed).abs(), 5.0 + next(&mut seed), 4.0 * next(&mut seed).abs());
            let got = fastest_entry(&rows[0], &rows[1], 3, length, cap, next_cap);
            let mut best = 0.0_f64;
            for k in 0..=400 {
                let y = next_cap * f64::from(k) / 400.0;
                let (mut lo, mut hi) = (0.0_f64, cap);
                let h = 2.0 * length;
                for (end, side) in rows.iter().enumerate() {
                    for (p, q) in side.first.iter().zip(&side.second) {
                        // |p s̈ + q x| ≤ 1 (with x′ at the far end), as a·x + room.
                        let (a, rest) =
                            if end == 0 { (q - p / h, p / h * y) } else { (-p / h, (p / h + q) * y) };
                        for sign in [1.0, -1.0] {
                            let (a, room) = (sign * a, 1.0 - sign * rest);
                            if a > 0.0 {
                                hi = hi.min(room / a);
                            } else if a < 0.0 {
                                lo = lo.max(room / a);
                            } else if room < 0.0 {
                                lo = f64::INFINITY;
                            }
                        }
                    }
                }
                if lo <= hi {
                    best = best.max(hi);
                }
            }
            assert!(got >= best - 1e-9, "case {case}: {got} < {best}");
            assert!(got <= best + 0.2, "case {case}: {got} > {best}");
            let (lo, hi) = exits(&rows[0], &rows[1], 3, length, got);
            assert!(
                lo <= hi.min(next_cap) + 1e-9,
                "case {case}: from {got} nothing is reachable: {lo}..{hi}"
            );
        }
    }
}
