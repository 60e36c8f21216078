//! The one door to `libm`: every transcendental function of the workspace comes from here, so that every
//! platform gives the same bits (std's `sin` differs from libm's in 3 % of arguments). `libm`'s feature `arch` lets
//! `sqrt`, `floor`, `ceil` and `round` use the processor's instruction: these are exactly rounded everywhere.

pub use core::f64::consts::{PI, TAU};
pub use libm::{
    acos, asin, atan, atan2, ceil, cos, exp, floor, hypot, log, pow, rint, round, sin, sincos, sqrt, tan,
};

/// |x|.
#[inline]
pub const fn fabs(x: f64) -> f64 {
    x.abs()
}

/// Two square roots for the time of one where the processor has a pair of them: exactly rounded like [`sqrt`], hence the same
/// bits.
#[inline]
pub fn sqrt_2(x: [f64; 2]) -> [f64; 2] {
    #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
    #[allow(unsafe_code)] // the only unsafe code of this crate
    {
        use core::arch::x86_64::{_mm_cvtsd_f64, _mm_set_pd, _mm_sqrt_pd, _mm_unpackhi_pd};
        // SAFETY: these need SSE2 and nothing else; this block exists only where the target has it.
        unsafe {
            let roots = _mm_sqrt_pd(_mm_set_pd(x[1], x[0]));
            [_mm_cvtsd_f64(roots), _mm_cvtsd_f64(_mm_unpackhi_pd(roots, roots))]
        }
    }
    #[cfg(not(all(target_arch = "x86_64", target_feature = "sse2")))]
    [sqrt(x[0]), sqrt(x[1])]
}

/// Radians of an angle in degrees.
pub fn radians(degrees: f64) -> f64 {
    degrees * (PI / 180.0)
}

/// Degrees of an angle in radians.
pub fn degrees(radians: f64) -> f64 {
    radians * (180.0 / PI)
}

/// Cosine and sine of an angle in degrees; exact 0 and ±1 at multiples of 90°.
pub fn cos_sin_deg(degrees: f64) -> (f64, f64) {
    let quarter = degrees / 90.0;
    if quarter == floor(quarter) && libm::fabs(quarter) < 1e9 {
        return match (quarter as i64).rem_euclid(4) {
            0 => (1.0, 0.0),
            1 => (0.0, 1.0),
            2 => (-1.0, 0.0),
            _ => (0.0, -1.0),
        };
    }
    (cos(radians(degrees)), sin(radians(degrees)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every 2⁴⁷th bit pattern: all exponents, with subnormal numbers, infinities and negative ones.
    #[test]
    fn a_pair_of_roots_has_the_bits_of_two() {
        let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        for i in 0..1u64 << 17 {
            let x = f64::from_bits((i << 47) + i * 0x1234_5677);
            let y = f64::from_bits((i << 46) ^ i);
            let [a, b] = sqrt_2([x, y]);
            assert!(same(a, sqrt(x)) && same(b, sqrt(y)), "{x:e} {y:e}");
        }
    }
}
