//! The one door to `libm`: every transcendental function of the workspace comes from here, so that every
//! platform gives the same bits (std's `sin` differs from libm's in 3 % of arguments). `libm`'s feature `arch` lets
//! `sqrt`, `floor`, `ceil` and `round` use the processor's instruction: these are exactly rounded everywhere.

pub use core::f64::consts::{PI, TAU};
pub use libm::{
    acos, asin, atan, atan2, ceil, cos, exp, fabs, floor, hypot, log, pow, round, sin, sincos, sqrt, tan,
};

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
