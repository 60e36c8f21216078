//! The two small problems of one interval: how fast it may be entered, and how fast it can be left.
//!
//! Within an interval of length Δs the acceleration s̈ is constant, so x′ = x + 2 Δs s̈ at its end. The strips at
//! both ends are then linear in (x, x′). The set they allow is convex and holds (0, 0): stopping is always possible.

use crate::limits::Rows;

/// a·x + b·x′ ≤ c with c ≥ 0.
#[derive(Clone, Copy)]
struct HalfPlane {
    a: f64,
    b: f64,
    c: f64,
}

/// The k-th of the 4·rows half planes of an interval of length `h / 2`.
fn half_planes<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    h: f64,
) -> impl Iterator<Item = HalfPlane> + Clone {
    let left = left.first.iter().zip(&left.second).take(rows).map(move |(p, q)| (h * q - p, *p));
    let right = right.first.iter().zip(&right.second).take(rows).map(move |(p, q)| (-p, p + h * q));
    left.chain(right).flat_map(move |(a, b)| [HalfPlane { a, b, c: h }, HalfPlane { a: -a, b: -b, c: h }])
}

/// The largest x ≤ `cap` from which some x′ ≤ `next_cap` can be reached within all strips: a linear programme in two
/// unknowns, solved by adding one half plane at a time (Seidel). Cost: at most (4·rows)² / 2 steps, no iteration.
pub(crate) fn fastest_entry<const R: usize>(
    left: &Rows<R>,
    right: &Rows<R>,
    rows: usize,
    length: f64,
    cap: f64,
    next_cap: f64,
) -> f64 {
    let planes = half_planes(left, right, rows, 2.0 * length);
    let (mut x, mut y) = (cap, next_cap);
    for (k, plane) in planes.clone().enumerate() {
        if plane.a * x + plane.b * y <= plane.c * (1.0 + 1e-12) {
            continue;
        }
        // The optimum moves onto this border; t runs along it.
        let along_x = plane.b.abs() >= plane.a.abs();
        // (x, y) = (x0 + dx t, y0 + dy t)
        let (x0, dx, y0, dy) = if along_x {
            (0.0, 1.0, plane.c / plane.b, -plane.a / plane.b)
        } else {
            (plane.c / plane.a, -plane.b / plane.a, 0.0, 1.0)
        };
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut clip = |slope: f64, room: f64| {
            if slope > 0.0 {
                high = high.min(room / slope);
            } else if slope < 0.0 {
                low = low.max(room / slope);
            }
        };
        clip(dx, cap - x0);
        clip(-dx, x0);
        clip(dy, next_cap - y0);
        clip(-dy, y0);
        for earlier in planes.clone().take(k) {
            clip(earlier.a * dx + earlier.b * dy, earlier.c - earlier.a * x0 - earlier.b * y0);
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
    let (mut low, mut high) = (0.0_f64, f64::INFINITY);
    for plane in half_planes(left, right, rows, 2.0 * length) {
        let room = plane.c * (1.0 + SLACK) - plane.a * x;
        if plane.b > 0.0 {
            high = high.min(room / plane.b);
        } else if plane.b < 0.0 {
            low = low.max(room / plane.b);
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
                for p in half_planes(&rows[0], &rows[1], 3, 2.0 * length) {
                    let room = p.c - p.b * y;
                    if p.a > 0.0 {
                        hi = hi.min(room / p.a);
                    } else if p.a < 0.0 {
                        lo = lo.max(room / p.a);
                    } else if room < 0.0 {
                        lo = f64::INFINITY;
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
