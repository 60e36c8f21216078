//! Lowest and highest value of every curve in equal stretches of time, while the run goes on. When the stretches run out
//! they are joined in pairs, so no extreme is ever lost and memory is bounded.

/// Stretches kept: twice what a wide screen has columns.
const MOST: usize = 2048;

/// Lowest and highest values; NaN is "nothing here".
#[derive(Debug, Clone)]
pub(crate) struct Envelope {
    channels: usize,
    /// Ticks in a stretch.
    pub width: u64,
    /// Stretch by stretch, channel by channel.
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    /// Ticks in the newest stretch.
    filled: u64,
}

impl Envelope {
    pub(crate) fn new(channels: usize) -> Self {
        Self { channels, width: 1, low: Vec::new(), high: Vec::new(), filled: 1 }
    }

    /// The values of the next tick.
    pub(crate) fn push(&mut self, values: &[f64]) {
        if self.filled == self.width {
            if self.low.len() >= MOST * self.channels {
                self.join();
            } else {
                self.filled = 0;
            }
        }
        if self.filled == 0 {
            self.low.resize(self.low.len() + self.channels, f64::NAN);
            self.high.resize(self.high.len() + self.channels, f64::NAN);
        }
        self.filled += 1;
        let at = self.low.len() - self.channels;
        for ((low, high), value) in self.low[at..].iter_mut().zip(&mut self.high[at..]).zip(values) {
            // `min` and `max` pass NaN by.
            *low = low.min(*value);
            *high = high.max(*value);
        }
    }

    fn join(&mut self) {
        for (list, wider) in [
            (&mut self.low, f64::min as fn(f64, f64) -> f64),
            (&mut self.high, f64::max as fn(f64, f64) -> f64),
        ] {
            let stretches = list.len() / self.channels;
            for to in 0..stretches / 2 {
                for c in 0..self.channels {
                    let pair =
                        wider(list[2 * to * self.channels + c], list[(2 * to + 1) * self.channels + c]);
                    list[to * self.channels + c] = pair;
                }
            }
            list.truncate(stretches / 2 * self.channels);
        }
        self.width *= 2;
        // The newest stretch is whole again: the next tick begins another.
        self.filled = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_extreme_is_lost() {
        let mut envelope = Envelope::new(2);
        let count = 100_003_u64;
        for i in 0..count {
            let spike = if i == 77_777 { 1e6 } else { 0.0 };
            envelope.push(&[i as f64, spike]);
        }
        let stretches = envelope.low.len() / 2;
        assert!((MOST / 2..=MOST).contains(&stretches), "{stretches}");
        for n in 0..stretches {
            let (first, last) = (n as u64 * envelope.width, ((n as u64 + 1) * envelope.width).min(count) - 1);
            assert_eq!([envelope.low[2 * n], envelope.high[2 * n]], [first as f64, last as f64]);
            let spike = (first..=last).contains(&77_777);
            assert_eq!(envelope.high[2 * n + 1], if spike { 1e6 } else { 0.0 });
        }
    }
}
