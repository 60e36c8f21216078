//! Keeps the rows of a stream that matter: between two kept rows every channel is straight within a tolerance.
//!
//! From the row kept last, each new row narrows, per channel, the fan of slopes that pass all rows since within the
//! tolerance. A row outside the fan closes it: the row before is kept. When more rows are kept than there is room for, the
//! tolerance is doubled and the kept rows go through again, so memory is bounded whatever the length of the stream.

/// A row of the stream.
pub(crate) trait Row: Clone {
    /// What the channels are straight over; never falls.
    fn at(&self) -> f64;
    /// Values of all channels, as many in every row.
    fn channels(&self, out: &mut Vec<f64>);
    /// Kept in any case, and so is the row before it.
    fn forced(&self) -> bool;
}

/// The rows kept of a stream.
#[derive(Debug)]
pub(crate) struct Fan<R> {
    kept: Vec<R>,
    /// The newest row, not yet kept.
    last: Option<R>,
    /// Lowest and highest slope of each channel.
    slopes: Vec<[f64; 2]>,
    /// Channels of the row kept last, and of the newest.
    from: Vec<f64>,
    now: Vec<f64>,
    tolerance: f64,
    /// Sum of the tolerances applied so far: no row is further off than this.
    error: f64,
    most: usize,
}

impl<R: Row> Fan<R> {
    /// Keeps at most `most` rows (at least 16).
    pub(crate) fn new(tolerance: f64, most: usize) -> Self {
        Self {
            kept: Vec::new(),
            last: None,
            slopes: Vec::new(),
            from: Vec::new(),
            now: Vec::new(),
            tolerance,
            error: tolerance,
            most: most.max(16),
        }
    }

    /// The next row.
    pub(crate) fn push(&mut self, row: R) {
        let Some(anchor) = self.kept.last().map(Row::at) else {
            return self.keep(row);
        };
        row.channels(&mut self.now);
        let span = row.at() - anchor;
        let straight = span > 0.0
            && !row.forced()
            && self.slopes.iter().zip(&self.from).zip(&self.now).all(|((slope, from), now)| {
                let s = (now - from) / span;
                s >= slope[0] && s <= slope[1]
            });
        if !straight && let Some(last) = self.last.take() {
            self.keep(last);
        }
        if row.forced() {
            return self.keep(row);
        }
        let span = row.at() - self.kept.last().map_or(0.0, Row::at);
        row.channels(&mut self.now);
        for ((slope, from), now) in self.slopes.iter_mut().zip(&self.from).zip(&self.now) {
            if span > 0.0 {
                slope[0] = slope[0].max((now - from - self.tolerance) / span);
                slope[1] = slope[1].min((now - from + self.tolerance) / span);
            }
        }
        self.last = Some(row);
    }

    fn keep(&mut self, row: R) {
        row.channels(&mut self.from);
        self.slopes.clear();
        self.slopes.resize(self.from.len(), [f64::NEG_INFINITY, f64::INFINITY]);
        self.kept.push(row);
        if self.kept.len() > self.most {
            self.coarsen();
        }
    }

    /// Doubles the tolerance until a quarter of the room is free.
    fn coarsen(&mut self) {
        // Forced rows alone may fill the room: then every second of all is dropped.
        for _ in 0..64 {
            self.tolerance *= 2.0;
            self.error += self.tolerance;
            let mut again = Fan { error: self.error, ..Fan::new(self.tolerance, usize::MAX) };
            for row in self.kept.drain(..) {
                again.push(row);
            }
            self.kept = again.into_rows();
            if self.kept.len() <= self.most - self.most / 4 {
                break;
            }
        }
        if self.kept.len() > self.most - self.most / 4 {
            let mut n = 0_usize;
            let end = self.kept.len() - 1;
            self.kept.retain(|_| {
                n += 1;
                n % 2 == 1 || n - 1 == end
            });
            self.error = f64::INFINITY;
        }
        if let Some(row) = self.kept.last() {
            row.channels(&mut self.from);
        }
        self.slopes.fill([f64::NEG_INFINITY, f64::INFINITY]);
    }

    /// No row left out is further from the straight lines between the kept ones than this.
    pub(crate) fn error(&self) -> f64 {
        self.error
    }

    /// The kept rows, the newest among them.
    pub(crate) fn into_rows(mut self) -> Vec<R> {
        self.kept.extend(self.last.take());
        self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, PartialEq)]
    struct Sample(f64, f64);

    impl Row for Sample {
        fn at(&self) -> f64 {
            self.0
        }
        fn channels(&self, out: &mut Vec<f64>) {
            out.clear();
            out.push(self.1);
        }
        fn forced(&self) -> bool {
            false
        }
    }

    /// A wave of changing shape, its kept rows, and the bound that was promised.
    fn wave(count: u32, most: usize) -> (Vec<Sample>, Vec<Sample>, f64) {
        let all: Vec<Sample> = (0..count)
            .map(|i| {
                let x = f64::from(i) / 50.0;
                let bumps = (x - x.floor()) * (1.0 - x + x.floor());
                Sample(f64::from(i), x * x * 1e-3 + bumps + f64::from(i % 7) * 1e-4)
            })
            .collect();
        let mut fan = Fan::new(1e-3, most);
        for row in &all {
            fan.push(row.clone());
        }
        let error = fan.error();
        (all, fan.into_rows(), error)
    }

    #[test]
    fn every_row_lies_within_the_error_of_the_lines_between_kept_rows() {
        for (count, most) in [(1_000, usize::MAX), (20_000, 200), (5_000, 16)] {
            let (all, kept, error) = wave(count, most);
            assert!(kept.len() <= most.saturating_add(1), "{} kept", kept.len());
            assert!(kept.len() * 2 < all.len(), "{} kept of {}", kept.len(), all.len());
            assert_eq!((kept.first(), kept.last()), (all.first(), all.last()));
            let mut worst = 0.0_f64;
            for pair in kept.windows(2) {
                let (a, b) = (&pair[0], &pair[1]);
                for row in &all[a.0 as usize..=b.0 as usize] {
                    let line = a.1 + (b.1 - a.1) * (row.0 - a.0) / (b.0 - a.0);
                    worst = worst.max((line - row.1).abs());
                }
            }
            assert!(worst <= error, "{count} rows, {most} kept: {worst} > {error}");
            assert!(worst > error / 100.0, "the bound {error} says nothing: {worst}");
        }
    }
}
