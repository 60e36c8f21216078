//! A number in fixed decimals, exactly rounded (half to even on the exact binary value, as C's `printf` does),
//! without the cost of the general formatter.

/// Room for one printed number: sign, 18 digits and point. A power of two, so that a masked place is always inside.
const ROOM: usize = 32;

/// The characters of one number.
pub(crate) struct Digits {
    /// Filled from the end.
    bytes: [u8; ROOM],
    start: usize,
}

impl Digits {
    /// `value` with `DECIMALS` (0 to 6) digits after the point; `None` from 1e12 on and for what is no number: those
    /// are left to the standard formatter, which is exact too.
    #[inline]
    pub(crate) fn decimal<const DECIMALS: u32>(value: f64) -> Option<Self> {
        let scaled = scaled::<DECIMALS>(value.abs())?;
        let one = const { 10_u64.pow(DECIMALS) };
        let (whole, mut fraction) = (scaled / one, scaled % one);
        let mut digits = Self { bytes: [0; ROOM], start: ROOM };
        if DECIMALS > 0 {
            for _ in 0..DECIMALS {
                digits.push((fraction % 10) as u8 + b'0');
                fraction /= 10;
            }
            digits.push(b'.');
        }
        digits.push_integer(whole);
        if value.is_sign_negative() {
            digits.push(b'-');
        }
        Some(digits)
    }

    /// A whole number.
    #[inline]
    pub(crate) fn integer(value: u64) -> Self {
        let mut digits = Self { bytes: [0; ROOM], start: ROOM };
        digits.push_integer(value);
        digits
    }

    #[inline]
    pub(crate) fn as_bytes(&self) -> &[u8] {
        &self.bytes[self.start % ROOM..]
    }

    #[inline]
    fn push(&mut self, byte: u8) {
        self.start = self.start.wrapping_sub(1) % ROOM;
        self.bytes[self.start] = byte;
    }

    #[inline]
    fn push_integer(&mut self, mut value: u64) {
        loop {
            self.push((value % 10) as u8 + b'0');
            value /= 10;
            if value == 0 {
                break;
            }
        }
    }
}

/// `value * 10^DECIMALS` of a positive number, rounded half to even; below 10^18.
///
/// value = m 2^e with m < 2^53, so m 10^6 < 2^73 and the product is exact in 128 bits.
#[inline]
fn scaled<const DECIMALS: u32>(value: f64) -> Option<u64> {
    if value.is_nan() || value >= 1e12 {
        return None;
    }
    let bits = value.to_bits();
    let (exponent, fraction) = ((bits >> 52) as u32, bits & ((1 << 52) - 1));
    // m 2^-shift; 1e12 < 2^40 has exponent 1062, so that the shift is at least 13.
    let (m, shift) = if exponent == 0 { (fraction, 1074) } else { (fraction | (1 << 52), 1075 - exponent) };
    if shift > 100 {
        return Some(0); // m 10^6 < 2^73 is less than half of 2^100
    }
    let product = u128::from(m) * u128::from(const { 10_u64.pow(DECIMALS) });
    // Half of the last place, less a trifle where what stays is even: a tie goes to the even one.
    let is_odd = (product >> shift) & 1;
    Some(((product + ((1_u128 << (shift - 1)) - 1) + is_odd) >> shift) as u64)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use crate::buffer::Buffer;
    use std::{format, string::String};

    /// As the line buffer writes it.
    fn text<const DECIMALS: u32>(value: f64) -> String {
        let mut out = Buffer::<400>::new();
        out.number::<DECIMALS>(value);
        String::from_utf8(out.as_bytes().to_vec()).unwrap()
    }

    fn assert_agrees(value: f64) {
        assert_eq!(text::<0>(value), format!("{value:.0}"), "{value:e}");
        assert_eq!(text::<4>(value), format!("{value:.4}"), "{value:e}");
        assert_eq!(text::<6>(value), format!("{value:.6}"), "{value:e}");
    }

    /// The standard library's formatter is exact; ours must agree on hard and ordinary values.
    #[test]
    fn agrees_with_the_general_formatter() {
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        for i in 0..300_000 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            assert_agrees(match i % 6 {
                0 => f64::from_bits(seed),
                1 => (seed >> 40) as f64 / 16384.0, // exact halves of the last place
                2 => -((seed >> 34) as f64) / 1e5,  // decimal halves, which lie beside the binary ones
                3 => (seed >> 11) as f64 * 1e-12,   // ordinary magnitudes
                4 => f64::from_bits(seed >> 12 | (1023 + (seed & 63) - 24) << 52), // 2^-24 to 2^40
                _ => -((seed >> 50) as f64) / 64.0 - 0.5,
            });
        }
        for value in [
            0.0,
            0.5,
            1.5,
            2.5,
            0.00005,
            0.00015,
            0.999_949_999,
            0.999_95,
            999_999_999_999.999_9,
            1e12 - 1e-4,
            1e12,
            1e30,
            1e300,
            f64::MAX,
            f64::INFINITY,
            f64::NAN,
            f64::MIN_POSITIVE,
            5e-324,
        ] {
            assert_agrees(value);
            assert_agrees(-value);
        }
        assert_eq!(text::<4>(-0.0), "-0.0000");
        assert_eq!(text::<4>(1e30), "1000000000000000019884624838656.0000");
    }
}
