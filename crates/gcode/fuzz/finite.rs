//! A sink that refuses numbers that are not finite, for the fuzz targets and for `tests/hostile.rs`.

use pkm_canon::{Canon, CanonSink, Span};

/// Nothing that is not finite gets past it.
pub struct Finite;

impl CanonSink for Finite {
    fn command(&mut self, command: &Canon<'_>, _: Span) {
        let positions = match command {
            Canon::StraightTraverse(p) | Canon::StraightFeed(p) => p.to_array(),
            Canon::ArcFeed { end, .. } | Canon::StraightProbe { end, .. } => end.to_array(),
            Canon::SetG92Offset(p) | Canon::SetG5xOffset { offset: p, .. } => p.to_array(),
            _ => return,
        };
        assert!(positions.iter().all(|value| value.is_finite()), "{command:?}");
    }
}
