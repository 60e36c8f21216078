//! When each line of the program was executed: one entry where the line changes, their number bounded.

/// Entries kept: more than most programs have lines.
const MOST: usize = 1 << 18;

/// Lines in the order they were executed.
#[derive(Debug, Clone, Default)]
pub(crate) struct Blocks {
    /// Line, and the last tick before it was the machine's.
    pub entries: Vec<(u32, u64)>,
    /// Entries are at least so many ticks apart.
    gap: u64,
}

impl Blocks {
    /// The line at this tick.
    pub(crate) fn push(&mut self, line: u32, tick: u64) {
        match self.entries.last() {
            Some((last, _)) if *last == line => return,
            Some((_, at)) if tick < at + self.gap => return,
            _ => self.entries.push((line, tick)),
        }
        if self.entries.len() >= MOST {
            // Too many for any screen: those that last least go.
            while self.entries.len() > MOST / 2 {
                self.gap = (self.gap * 2).max(2);
                let (gap, mut last) = (self.gap, None);
                self.entries.retain(|(_, tick)| match last {
                    Some(at) if tick - at < gap => false,
                    _ => {
                        last = Some(*tick);
                        true
                    }
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounded_and_in_order() {
        let mut blocks = Blocks::default();
        for tick in 0..3_000_000_u64 {
            blocks.push((tick / 3) as u32, tick);
        }
        assert!(blocks.entries.len() > MOST / 8 && blocks.entries.len() < MOST);
        assert!(blocks.entries.windows(2).all(|pair| pair[0].1 < pair[1].1));
        assert!(blocks.entries.iter().all(|(line, tick)| *line == (*tick / 3) as u32));
    }
}
