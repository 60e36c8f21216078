//! The two small problems of one interval: how fast it may be entered, and how fast it can be left.
//!
//! Within an interval of length Δs the acceleration s̈ is constant, so x′ = x + 2 Δs s̈ at its end. The strips at
//! both ends are then linear in (x, x′). The set they allow is convex and holds (0, 0): stopping is always possible.

use crate::limits::Rows;

/// |a·x + b·x′| ≤ h, the form of every strip at either end of an interval of length h / 2.
#[derive(Clone, Copy, Default)]
struct Strip {
    a: f64,
    b: f64,
}

/// The strips of an interval, those of its left end first.
struct Strips<const R: usize> {
    ends: [[Strip; R]; 2],
    rows: usize,
    h: f64,
}

impl<const R: usize> Strips<R> {
    fn new(left: &Rows<R>, right: &Rows<R>, rows: usize, length: f64) -> Self {
        let h = 2.0 * length;
        let mut ends = [[Strip::default(); R]; 2];
        let [at_left, at_right] = &mut ends;
        for ((strip, p), q) in at_left.iter_mut().zip(&left.first).zip(&left.second).take(rows) {
            *strip = Strip { a: h * q - p, b: *p };
        }
        for ((strip, p), q) in at_right.iter_mut().zip(&right.first).zip(&right.second).take(rows) {
            *strip = Strip { a: -p, b: p + h * q };
        }
        Self { ends, rows, h }
    }

    fn iter(&self) -> impl Iterator<Item = Strip> {
        let [left, right] = &self.ends;
        left.iter().take(self.rows).chain(right.iter().take(self.rows)).copied()
    }
}

/// The largest x ≤ `cap` from which some x′ ≤ `next_cap` can be reached within all strips: a linear programme in two
/// unknowns, solved by adding one strip at a time (Seidel). Cost: at most (2·rows)² / 2 steps, no iteration.
pub(crate) fn fastest_entry<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    length: f64,
    cap: f64,
    next_cap: f64,
) -> f64 {
    let strips = Strips::new(left, right, rows, length);
    let h = strips.h;
    let (mut x, mut y) = (cap, next_cap);
    for (k, strip) in strips.iter().enumerate() {
        let value = strip.a * x + strip.b * y;
        if value.abs() <= h * (1.0 + 1e-12) {
            continue;
        }
        // The optimum moves onto this border, a x + b y = c; t runs along it.
        let c = if value > 0.0 { h } else { -h };
        let along_x = strip.b.abs() >= strip.a.abs();
        // (x, y) = (x0 + dx t, y0 + dy t)
        let (x0, dx, y0, dy) = if along_x {
            (0.0, 1.0, c / strip.b, -strip.a / strip.b)
        } else {
            (c / strip.a, -strip.b / strip.a, 0.0, 1.0)
        };
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        // min ≤ base + slope·t ≤ max
        let mut clip = |slope: f64, base: f64, min: f64, max: f64| {
            if slope > 0.0 {
                high = high.min((max - base) / slope);
                low = low.max((min - base) / slope);
            } else if slope < 0.0 {
                high = high.min((min - base) / slope);
                low = low.max((max - base) / slope);
            }
        };
        clip(dx, x0, 0.0, cap);
        clip(dy, y0, 0.0, next_cap);
        for earlier in strips.iter().take(k) {
            clip(earlier.a * dx + earlier.b * dy, earlier.a * x0 + earlier.b * y0, -h, h);
        }
        let best = if dx >= 0.0 { high } else { low };
        // Rounding may cross the bounds by an ulp; never leave the box.
        let t = if low <= high { best } else { 0.5 * (low + high) };
        x = (x0 + dx * t).clamp(0.0, cap);
        y = (y0 + dy * t).clamp(0.0, next_cap);
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
    let strips = Strips::new(left, right, rows, length);
    let h = strips.h * (1.0 + SLACK);
    let (mut low, mut high) = (0.0_f64, f64::INFINITY);
    for strip in strips.iter() {
        let at = strip.a * x;
        if strip.b > 0.0 {
            high = high.min((h - at) / strip.b);
            low = low.max((-h - at) / strip.b);
        } else if strip.b < 0.0 {
            high = high.min((-h - at) / strip.b);
            low = low.max((h - at) / strip.b);
        }
    }
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
                for strip in Strips::new(&rows[0], &rows[1], 3, length).iter() {
                    for sign in [1.0, -1.0] {
                        let (a, room) = (sign * strip.a, 2.0 * length - sign * strip.b * y);
                        if a > 0.0 {
                            hi = hi.min(room / a);
                        } else if a < 0.0 {
                            lo = lo.max(room / a);
                        } else if room < 0.0 {
                            lo = f64::INFINITY;
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
