//! The functions of expressions to the last bit, as LinuxCNC has them on a PC (dialect section 4): FIX and FUP make a whole
//! number of it. Angles in degrees pass through the processor's 80-bit numbers with 64 bits of mantissa, so that
//! FIX[2*SIN[30]] is 1 and COS[90] a trifle below 0; LN, EXP and powers are rounded to the nearest, so that LN[9]/LN[3] is 2
//! and 125**[1/3] a trifle below 5 (checked with rs274 2.9). Here that is done with integers and with pairs of doubles, hence the same everywhere.

use pkm_kins::maths;

/// A number as the sum of a double and what is left of it.
#[derive(Clone, Copy)]
struct Pair(f64, f64);

/// Sine of an angle in degrees. A zero keeps its sign here and below: ATAN tells -0 from 0.
pub(crate) fn sin(x: f64) -> f64 {
    if x == 0.0 { x } else { sin_cos(radians(x)).0.nearest() }
}

/// Cosine of an angle in degrees.
pub(crate) fn cos(x: f64) -> f64 {
    sin_cos(radians(x)).1.nearest()
}

/// Tangent of an angle in degrees.
pub(crate) fn tan(x: f64) -> f64 {
    let (sin, cos) = sin_cos(radians(x));
    let near = sin.0 / cos.0;
    if x == 0.0 { x } else { near + sin.less(cos.times(near)).nearest() / cos.0 }
}

/// Angle of the direction (x, y) in degrees.
pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    let near = maths::atan2(y, x);
    let (sin, cos) = sin_cos(Pair(near, 0.0));
    let off = cos.times(y).less(sin.times(x)).nearest() / (cos.0 * x + sin.0 * y);
    degrees(if off.is_finite() && near != 0.0 { near + off } else { near })
}

/// Angle in degrees whose sine is x, |x| ≤ 1.
pub(crate) fn asin(x: f64) -> f64 {
    let near = maths::asin(x);
    let (sin, cos) = sin_cos(Pair(near, 0.0));
    let inside = x != 0.0 && x.abs() < 1.0;
    degrees(if inside { near + Pair(x, 0.0).less(sin).nearest() / cos.0 } else { near })
}

/// Angle in degrees whose cosine is x, |x| ≤ 1.
pub(crate) fn acos(x: f64) -> f64 {
    let near = maths::acos(x);
    let (sin, cos) = sin_cos(Pair(near, 0.0));
    degrees(if x.abs() < 1.0 { near + cos.less(Pair(x, 0.0)).nearest() / sin.0 } else { near })
}

/// Natural logarithm of a positive number.
pub(crate) fn ln(x: f64) -> f64 {
    logarithm(x).nearest()
}

/// e to the power of x.
pub(crate) fn exp(x: f64) -> f64 {
    power_of_e(Pair(x, 0.0))
}

/// x to the power of y; of a negative x only to a whole power.
pub(crate) fn pow(x: f64, y: f64) -> f64 {
    let plain = maths::pow(x, y);
    if x == 0.0 || !(1e-250..1e250).contains(&plain.abs()) {
        return plain;
    }
    power_of_e(logarithm(x.abs()).times(y)).copysign(plain)
}

/// ln 2: 40 bits, so that whole multiples are exact, and the rest.
const LN_2: Pair = Pair(0.6931471805592082, 7.371002565167799e-13);

/// π is this · 2⁻⁶².
const PI: u64 = 0xC90F_DAA2_2168_C235;

/// π/2 in three parts of 33 bits and a rest, so that a million of each are exact.
const HALF_PI: [f64; 4] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_711_166_5e-21,
    8.478_427_660_368_9e-32,
];

/// Radians of an angle in degrees.
fn radians(x: f64) -> Pair {
    let Some((mantissa, exponent)) = parts(x) else { return Pair(x * maths::PI / 180.0, 0.0) };
    let (turned, exponent) = rounded(u128::from(mantissa) * u128::from(PI), exponent - 62, false);
    let n = u128::from(turned) << 64;
    let (mantissa, exponent) = rounded(n / 180, exponent - 64, n % 180 != 0);
    let near = mantissa as f64;
    let rest = (i128::from(mantissa) - near as i128) as f64;
    let unit = power_of_two(exponent).copysign(x);
    Pair(near * unit, rest * unit)
}

/// Degrees of an angle in radians.
fn degrees(x: f64) -> f64 {
    let turned = x * 180.0;
    let Some((mantissa, exponent)) = parts(turned) else { return turned / maths::PI };
    let n = u128::from(mantissa) << 74;
    let (quotient, rest) = (n / u128::from(PI), (n % u128::from(PI)) << 2);
    let n = (quotient << 2) + rest / u128::from(PI);
    let (mantissa, exponent) = rounded(n, exponent - 74 - 2 + 62, !rest.is_multiple_of(u128::from(PI)));
    mantissa as f64 * power_of_two(exponent).copysign(x)
}

/// |x| as mantissa · 2^exponent; none of 0 and of what is so small or large that nobody turns by it.
fn parts(x: f64) -> Option<(u64, i32)> {
    if !(1e-250..1e250).contains(&x.abs()) {
        return None;
    }
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7FF) as i32 - 1075;
    Some((bits & ((1 << 52) - 1) | 1 << 52, exponent))
}

/// n · 2^exponent to 64 bits of mantissa, to the nearest, ties to even; `more`: something follows the last bit of n.
fn rounded(n: u128, exponent: i32, more: bool) -> (u64, i32) {
    let shift = 64 - n.leading_zeros() as i32;
    if shift <= 0 {
        return ((n << -shift) as u64, exponent + shift);
    }
    let (mantissa, rest, half) = ((n >> shift) as u64, n & ((1 << shift) - 1), 1 << (shift - 1));
    let up = rest > half || (rest == half && (more || mantissa & 1 == 1));
    match mantissa.checked_add(u64::from(up)) {
        Some(mantissa) => (mantissa, exponent + shift),
        None => (1 << 63, exponent + shift + 1),
    }
}

/// 2^exponent of a normal number.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// Sine and cosine of an angle in radians, to some 60 bits.
fn sin_cos(angle: Pair) -> (Pair, Pair) {
    let quarters = maths::rint(angle.0 / (maths::PI / 2.0));
    if quarters.abs() > 1e6 || angle.0 == 0.0 {
        let (sin, cos) = maths::sincos(angle.0);
        return (Pair(sin, angle.1 * cos), Pair(cos, -angle.1 * sin));
    }
    // What is left of the angle beyond whole quarters of a turn.
    let [a, b, c, d] = HALF_PI.map(|part| quarters * part);
    let r = sum(angle.0 - a, -b);
    let r = sum(r.0, angle.1).plus(r.1);
    let r = sum(r.0, -c).plus(r.1).plus(-d);
    // Taylor: the first terms as pairs, what follows them as doubles.
    let square = r.by(r);
    let x = square.0;
    let tail = |inverse: [f64; 9]| inverse.into_iter().rev().fold(0.0, |sum, one| 1.0 / one - x * sum);
    let sin = SIXTH.by(square).by(r);
    let sin = r.less(sin).plus(x * x * r.0 * tail(SIN_TAIL));
    let cos = TWENTY_FOURTH.by(square).by(square);
    let cos = Pair(1.0, 0.0).less(square.times(0.5)).less(cos.times(-1.0)).plus(-x * x * x * tail(COS_TAIL));
    let turned = |Pair(near, rest): Pair| Pair(-near, -rest);
    match (quarters as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, turned(sin)),
        2 => (turned(sin), turned(cos)),
        _ => (turned(cos), sin),
    }
}

/// 5! to 21! and 6! to 22!, every second.
const SIN_TAIL: [f64; 9] = [
    120.0,
    5_040.0,
    362_880.0,
    39_916_800.0,
    6_227_020_800.0,
    1_307_674_368_000.0,
    355_687_428_096_000.0,
    121_645_100_408_832_000.0,
    51_090_942_171_709_440_000.0,
];
const COS_TAIL: [f64; 9] = [
    720.0,
    40_320.0,
    3_628_800.0,
    479_001_600.0,
    87_178_291_200.0,
    20_922_789_888_000.0,
    6_402_373_705_728_000.0,
    2_432_902_008_176_640_000.0,
    1_124_000_727_777_607_680_000.0,
];
const THIRD: Pair = Pair(1.0 / 3.0, 1.850371707708594e-17);
const SIXTH: Pair = Pair(1.0 / 6.0, 9.251_858_538_542_97e-18);
const TWENTY_FOURTH: Pair = Pair(1.0 / 24.0, 2.312_964_634_635_743e-18);

/// ln x of a positive x, to some 60 bits.
fn logarithm(x: f64) -> Pair {
    let Some((mantissa, exponent)) = parts(x) else { return Pair(maths::log(x), 0.0) };
    // x = m · 2^k with m from √½ to √2; ln m = 2 artanh((m - 1) / (m + 1))
    let (mut m, mut k) = (mantissa as f64 * power_of_two(-52), exponent + 52);
    if m > core::f64::consts::SQRT_2 {
        (m, k) = (m / 2.0, k + 1);
    }
    let (above, below) = (m - 1.0, sum(m, 1.0));
    let near = above / below.0;
    let s = sum(near, Pair(above, 0.0).less(below.times(near)).nearest() / below.0);
    let square = s.by(s);
    let x = square.0;
    let tail = (0..16).rev().fold(0.0, |sum, n| 1.0 / f64::from(2 * n + 5) + x * sum);
    let small = THIRD.by(square).by(s).plus(x * x * s.0 * tail);
    let k = f64::from(k);
    let whole = sum(k * LN_2.0, k * LN_2.1);
    whole.less(s.times(-2.0)).less(small.times(-2.0))
}

/// e to the power of x.
fn power_of_e(x: Pair) -> f64 {
    if !(1e-300..700.0).contains(&x.0.abs()) {
        return maths::exp(x.0);
    }
    // x = k ln 2 + r, and Taylor
    let k = maths::rint(x.0 / LN_2.0);
    let r = sum(x.0 - k * LN_2.0, x.1 - k * LN_2.1);
    let x = r.0;
    let tail = (4..20).rev().fold(0.0, |sum, n| (1.0 + x * sum) / f64::from(n));
    let square = r.by(r);
    let cube = SIXTH.by(square).by(r);
    let small = square.times(0.5).less(cube.times(-1.0)).plus(x * x * x / 6.0 * x * tail);
    let one = Pair(1.0, 0.0).less(r.times(-1.0)).less(small.times(-1.0));
    one.nearest() * power_of_two(k as i32)
}

/// a + b without loss (Knuth).
fn sum(a: f64, b: f64) -> Pair {
    let near = a + b;
    let of_b = near - a;
    Pair(near, (a - (near - of_b)) + (b - of_b))
}

/// a · b without loss (Dekker): factors in halves of 26 bits.
fn product(a: f64, b: f64) -> Pair {
    let halves = |x: f64| {
        let high = x * 134_217_729.0;
        let high = high - (high - x);
        (high, x - high)
    };
    let ((a1, a2), (b1, b2), near) = (halves(a), halves(b), a * b);
    Pair(near, ((a1 * b1 - near) + a1 * b2 + a2 * b1) + a2 * b2)
}

impl Pair {
    fn nearest(self) -> f64 {
        self.0 + self.1
    }
    fn plus(self, small: f64) -> Self {
        sum(self.0, self.1 + small)
    }
    fn less(self, other: Self) -> Self {
        sum(self.0, -other.0).plus(self.1 - other.1)
    }
    fn times(self, factor: f64) -> Self {
        product(self.0, factor).plus(self.1 * factor)
    }
    fn by(self, other: Self) -> Self {
        self.times(other.0).plus(self.0 * other.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simple_angles_are_as_on_a_pc() {
        // The 64 bits of π/2 lie 2.508e-20 above it.
        assert!((cos(90.0) / -2.508e-20 - 1.0).abs() < 1e-3, "{:e}", cos(90.0));
        for turn in [-720.0, -360.0, 0.0, 360.0] {
            assert_eq!(sin(30.0 + turn), 0.5);
            assert_eq!(sin(-30.0 + turn), -0.5);
            assert_eq!(cos(60.0 + turn), 0.5);
            assert_eq!(tan(45.0 + turn), 1.0);
        }
        for (sine, angle) in [(0.5, 30.0), (1.0, 90.0), (-1.0, -90.0), (0.0, 0.0)] {
            assert_eq!(asin(sine), angle);
            assert_eq!(acos(sine), 90.0 - angle);
        }
        assert_eq!((atan2(1.0, 1.0), atan2(0.0, -1.0), atan2(-2.0, 0.0)), (45.0, 180.0, -90.0));
        assert_eq!((atan2(0.0, 0.0), sin(0.0), tan(0.0), cos(0.0)), (0.0, 0.0, 0.0, 1.0));
        assert_eq!(sin(1e300), maths::sin(1e300 * maths::PI / 180.0));
        let zeros = [sin(-0.0), tan(-0.0), asin(-0.0), atan2(-0.0, 1.0)];
        assert!(zeros.iter().all(|zero| *zero == 0.0 && zero.is_sign_negative()), "{zeros:?}");
    }

    #[test]
    fn logarithms_of_powers_are_whole() {
        assert_eq!((ln(9.0) / ln(3.0), ln(1000.0) / ln(10.0)), (2.0, 2.999_999_999_999_999_6));
        assert_eq!((ln(1.0), ln(2.0), exp(1.0)), (0.0, core::f64::consts::LN_2, core::f64::consts::E));
        assert_eq!((exp(0.0), exp(800.0), exp(-800.0)), (1.0, f64::INFINITY, 0.0));
        assert_eq!((pow(125.0, 1.0 / 3.0), pow(-2.0, 3.0)), (4.999_999_999_999_999, -8.0));
        assert_eq!((pow(0.0, 2.0), pow(7.0, 0.0), pow(1e200, 2.0)), (0.0, 1.0, f64::INFINITY));
        for n in -700..700 {
            let x = f64::from(n) / 7.0;
            assert!((ln(exp(x)) - x).abs() <= 2.3e-16 * x.abs().max(1.0), "{x}");
            assert!((exp(x) / maths::exp(x) - 1.0).abs() < 3e-16, "{x}");
        }
    }
}
