//! One number for the edges of a long random motion: the same as in the step generator's own test.

use pkm_stepgen::{Line, Period, PulseTimingNs, StepGenerator};

/// splitmix64, as in the step generator's tests.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        low + (high - low) * ((z >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

/// FNV-1a over the edges of 20 000 servo periods; 0 if the generator refuses.
pub fn hash() -> u64 {
    let timing = PulseTimingNs { step_length: 2000, step_space: 2000, dir_setup: 5000, dir_hold: 5000 };
    let Ok(ticks) = timing.ticks(100) else { return 0 };
    let (Ok(mut joint), Ok(mut period)) =
        (StepGenerator::new(3, 400.0, ticks, 0.0), Period::new(0, 1_000_000, 100))
    else {
        return 0;
    };
    let mut random = Random(42);
    let (mut position, mut velocity) = (0.0, 0.0);
    let mut hash = super::Hash(0xcbf2_9ce4_8422_2325);
    for _ in 0..20_000 {
        let next = velocity * 0.95 + random.between(-8.0, 8.0);
        position += 0.5 * (velocity + next) * 1e-3;
        velocity = next;
        let result = joint.advance(position, velocity, &period, |edge| {
            let line = u64::from(edge.line == Line::Step);
            hash.word(edge.time * 4 + line * 2 + u64::from(edge.level));
        });
        if result.is_err() {
            return 0;
        }
        period = period.next();
    }
    hash.0
}
