//! A number in fixed decimals, exactly rounded (half to even on the exact binary value, as C's `printf` does),
//! without the cost of the general formatter.

/// Room for one printed number: sign, 16 digits, point, 6 decimals, and the general formatter's worst case.
const ROOM: usize = 336;

/// Bytes of one printed number.
pub(crate) struct Decimal {
    bytes: [u8; ROOM],
    start: usize,
}

impl Decimal {
    /// `value` with `decimals` (0 to 6) digits after the point.
    pub(crate) fn new(value: f64, decimals: u32) -> Self {
        let mut out = Self { bytes: [0; ROOM], start: ROOM };
        match scaled(value.abs(), decimals) {
            Some(n) => out.digits(n, decimals, value.is_sign_negative()),
            None => out.general(value, decimals),
        }
        out
    }

    pub(crate) fn as_bytes(&self) -> &[u8] {
        &self.bytes[self.start..]
    }

    fn push_front(&mut self, byte: u8) {
        if let Some(start) = self.start.checked_sub(1) {
            self.start = start;
            self.bytes[start] = byte;
        }
    }

    fn digits(&mut self, mut n: u64, decimals: u32, negative: bool) {
        for place in 0.. {
            if place == decimals && decimals > 0 {
                self.push_front(b'.');
            }
            self.push_front(b'0' + (n % 10) as u8);
            n /= 10;
            if n == 0 && place >= decimals {
                break;
            }
        }
        if negative {
            self.push_front(b'-');
        }
    }

    /// Huge and non-finite numbers: the standard formatter, which is exact too.
    fn general(&mut self, value: f64, decimals: u32) {
        use core::fmt::Write;
        struct Front([u8; ROOM], usize);
        impl Write for Front {
            fn write_str(&mut self, s: &str) -> core::fmt::Result {
                for byte in s.bytes() {
                    *self.0.get_mut(self.1).ok_or(core::fmt::Error)? = byte;
                    self.1 += 1;
                }
                Ok(())
            }
        }
        let mut text = Front([0; ROOM], 0);
        if write!(text, "{value:.*}", decimals as usize).is_ok() {
            self.start = ROOM - text.1;
            self.bytes[self.start..].copy_from_slice(&text.0[..text.1]);
        }
    }
}

/// `|value| * 10^decimals` rounded half to even, where it fits.
///
/// value = m 2^e with m < 2^53, so m 10^6 < 2^73 and the product is exact in 128 bits.
fn scaled(value: f64, decimals: u32) -> Option<u64> {
    if value.is_nan() || value >= 1e12 {
        return None;
    }
    let bits = value.to_bits();
    let (exponent, fraction) = ((bits >> 52) as i32, bits & ((1 << 52) - 1));
    let (m, e) = if exponent == 0 { (fraction, -1074) } else { (fraction | (1 << 52), exponent - 1075) };
    let product = u128::from(m) * u128::from(10_u64.pow(decimals));
    if e >= 0 {
        return u64::try_from(product << e).ok(); // value < 1e12 < 2^40: e < 0 always, kept for safety
    }
    let shift = e.unsigned_abs();
    if shift > 100 {
        return Some(0); // product < 2^73 is less than half of 2^100
    }
    let (quotient, rest, half) = (product >> shift, product & ((1 << shift) - 1), 1_u128 << (shift - 1));
    let up = rest > half || (rest == half && quotient & 1 == 1);
    u64::try_from(quotient + u128::from(up)).ok()
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::{format, string::String};

    fn text(value: f64, decimals: u32) -> String {
        String::from_utf8(Decimal::new(value, decimals).as_bytes().to_vec()).unwrap()
    }

    /// The standard library's formatter is exact; ours must agree on hard and ordinary values.
    #[test]
    fn agrees_with_the_general_formatter() {
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        for i in 0..20_000 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value = match i % 4 {
                0 => f64::from_bits(seed),
                1 => (seed >> 40) as f64 / 16384.0, // exact halves of the last place
                2 => -((seed >> 34) as f64) / 1e5,
                _ => (seed >> 11) as f64 * 1e-12,
            };
            for decimals in [0, 4, 6] {
                assert_eq!(text(value, decimals), format!("{value:.*}", decimals as usize), "{value:e}");
            }
        }
        for value in
            [0.0, -0.0, 0.5, 1.5, 2.5, 0.00005, 0.00015, 1e12, 1e30, 1e300, f64::MIN_POSITIVE, 5e-324]
        {
            assert_eq!(text(value, 4), format!("{value:.4}"));
            assert_eq!(text(-value, 0), format!("{:.0}", -value));
        }
        assert_eq!(text(1e30, 4), "1000000000000000019884624838656.0000");
    }
}
