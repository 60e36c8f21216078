//! Bands of |det K|: levels that divide a workspace into parts of about equal area, and their colours.

use super::{label, nice_step};
use pkm_kins::maths::round;

/// Light to dark, told apart by colour-blind eyes and in grey.
const COLOURS: [&str; 8] =
    ["#fff7cf", "#e3f3b4", "#b5e2b6", "#78cbbd", "#41acc3", "#2a86b8", "#2c5da5", "#2a3a84"];

/// Levels from low to high, and how their numbers are written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bands {
    /// `levels[0]` is below everything.
    pub levels: Vec<f64>,
    names: Vec<String>,
}

impl Bands {
    /// From the values of a map; those that are not numbers do not count.
    pub(crate) fn of(values: &[f64], sign: f64) -> Self {
        let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        let quantile = |k: usize| sizes.get((sizes.len() * k) / 8).copied().unwrap_or(0.0);
        let mut levels = Vec::new();
        let mut names = Vec::new();
        for k in 1..8 {
            // Rounded as coarsely as the neighbours allow.
            let step = nice_step(quantile(k + 1).min(quantile(k) * 2.0) - quantile(k - 1), 4.0);
            let level = round(quantile(k) / step) * step;
            if level > 0.0 && levels.last().is_none_or(|last| level > last * (1.0 + 1e-9)) {
                levels.push(level);
                names.push(label(sign * level, step));
            }
        }
        levels.insert(0, f64::NEG_INFINITY);
        Self { levels, names }
    }

    pub(crate) fn colour(&self, band: usize) -> &'static str {
        // Few bands keep their distance on the scale.
        let last = self.levels.len().max(2) - 1;
        COLOURS[(band * (COLOURS.len() - 1) + last / 2) / last]
    }

    /// The text of a band in the legend.
    pub(crate) fn name(&self, band: usize) -> String {
        let at = |k: usize| self.names.get(k).cloned().unwrap_or_default();
        if self.names.is_empty() {
            "everywhere the same".to_owned()
        } else if band == 0 {
            format!("between 0 and {}", at(0))
        } else if band == self.names.len() {
            format!("beyond {}", at(band - 1))
        } else {
            format!("{} to {}", at(band - 1), at(band))
        }
    }
}
