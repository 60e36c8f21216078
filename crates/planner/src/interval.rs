//! The two small problems of one interval: how fast it may be entered, and how fast it can be left.
//!
//! Within an interval of length Δs the acceleration s̈ is constant, so x′ = x + 2 Δs s̈ at its end. The strips at
//! both ends are then linear in (x, x′). The set they allow is convex and holds (0, 0): stopping is always possible.

use crate::limits::Rows;

/// Calls `each` with a and b of every strip |a·x + b·x′| ≤ h, where h = 2 Δs.
#[inline(always)]
fn borders<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    h: f64,
    mut each: impl FnMut(f64, f64),
) {
    for (p, q) in left.first.iter().zip(&left.second).take(rows) {
        each(h * q - p, *p);
    }
    for (p, q) in right.first.iter().zip(&right.second).take(rows) {
        each(-p, p + h * q);
    }
}

/// The largest x ≤ `cap` from which some x′ ≤ `next_cap` can be reached within all strips.
///
/// The highest and the lowest x′ that the strips leave are a concave and a convex function of x, both straight in pieces. From
/// an x where the lowest is above the highest, the x at which those two borders meet is nearer to the answer and
/// not below it: Newton's method, which ends after finitely many steps here because the pieces are straight (two as a
/// rule; each costs one walk over the strips).
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
    let reached = |x: f64| {
        let mut widest = 0.0_f64;
        borders(left, right, rows, h, |a, b| widest = widest.max((a * x + b * next_cap).abs()));
        widest <= h * (1.0 + 1e-12)
    };
    if reached(x) {
        return x;
    }
    // The borders as lines x′ = slope·x ± half. One that is all but upright does not care for x′: as a line it would be
    // the difference of two huge numbers.
    const UPRIGHT: f64 = 1e-9;
    let mut upright = f64::INFINITY;
    let mut lines = [[(0.0, f64::INFINITY); 2]; R];
    for (row, slot) in lines.iter_mut().enumerate().take(rows) {
        let (p, q) = (left.first[row], left.second[row]);
        let (p_end, q_end) = (right.first[row], right.second[row]);
        for (slot, (a, b)) in slot.iter_mut().zip([(h * q - p, p), (-p_end, p_end + h * q_end)]) {
            if b.abs() * next_cap <= UPRIGHT * h {
                upright = upright.min(h / a.abs());
            } else {
                let part = 1.0 / b;
                *slot = (-a * part, h * part.abs());
            }
        }
    }
    // Every step leaves at least one of the 4·rows + 2 borders behind for good.
    for _ in 0..4 * R + 2 {
        // Highest and lowest x′ at x, and where the same borders are at 0.
        let (mut low, mut high) = (0.0, next_cap);
        let (mut low_at_0, mut high_at_0) = (0.0, next_cap);
        for &(slope, half) in lines.iter().take(rows).flatten() {
            let middle = slope * x;
            if middle - half > low {
                (low, low_at_0) = (middle - half, -half);
            }
            if middle + half < high {
                (high, high_at_0) = (middle + half, half);
            }
        }
        // The gap between the two is open at 0 and, where it is closed at x, closes in between.
        let (gap, gap_at_0) = (high - low, high_at_0 - low_at_0);
        let next = if gap >= 0.0 { x } else { x * (gap_at_0 / (gap_at_0 - gap)) }.min(upright);
        // What is left of the way is rounding.
        if !(next < x * (1.0 - 1e-14)) {
            return x.min(next);
        }
        x = next.max(0.0);
        if reached(x) {
            return x;
        }
    }
    x
}

/// The range of x′ that the strips allow when the interval is entered with `x`. `low` may lie above `high` by
/// rounding only, as long as `x` does not exceed [`fastest_entry`].
pub(crate) fn exits<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    length: f64,
    x: f64,
) -> (f64, f64) {
    // Where a joint's q′ passes zero, b is all rounding and so is the room at the limit: without a little slack their
    // quotient is anything.
    const SLACK: f64 = 1e-9;
    let (mut low, mut high) = (0.0_f64, f64::INFINITY);
    let h = 2.0 * length;
    borders(left, right, rows, h, |a, b| {
        if b != 0.0 {
            let part = 1.0 / b;
            let (middle, half) = (-a * x * part, h * (1.0 + SLACK) * part.abs());
            high = high.min(middle + half);
            low = low.max(middle - half);
        }
    });
    (low, high)
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
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for side in [left, right] {
        for (p, q) in side.first.iter().zip(&side.second).take(rows) {
            // |p a + q x| ≤ 1 at both x.
            let (p, q) = if *p >= 0.0 { (*p, *q) } else { (-p, -q) };
            let (at_low, at_high) = (q * x_low, q * x_high);
            if p > 0.0 {
                high = high.min((1.0 - at_low.max(at_high)) / p);
                low = low.max((-1.0 - at_low.min(at_high)) / p);
            }
        }
    }
    (low, high)
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
            let rows: [Rows<3>; 2] = core::array::from_fn(|_| Rows {
                first: core::array::from_fn(|_| next(&mut seed)),
                second: core::array::from_fn(|_| next(&mut seed) * 0.3),
            });
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
