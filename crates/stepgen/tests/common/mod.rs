//! A generator of random numbers (splitmix64) and the number of cases.
#![allow(dead_code, missing_docs, unreachable_pub)]

pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    pub fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }
}

/// `base` cases, times PKM_TEST_SCALE.
pub fn cases(base: u64) -> u64 {
    let scale = std::env::var("PKM_TEST_SCALE").ok().and_then(|text| text.parse().ok());
    base * scale.unwrap_or(1)
}
