//! Straight probing: G38.2 to G38.5.

use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use pkm_canon::{Canon, Position, Probe};

impl State {
    /// A probing move; where it ended the caller must tell (see `Status::Synch`).
    pub(crate) fn probe(&mut self, code: GCode, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        if self.modal.compensation.is_some() {
            return Err(block.motion_error(ErrorKind::ProbeCc));
        }
        if self.modal.feed == 0.0 || self.modal.feed_mode == FeedMode::PerTurn {
            return Err(block.motion_error(ErrorKind::ProbeFeed));
        }
        let end = self.end_point(block)?;
        self.no_indexer(&end, block)?;
        let probe = Probe { away: matches!(code, 384 | G38_5), must_trip: matches!(code, G38_2 | 384) };
        if probe.must_trip && end == self.position {
            return Err(block.motion_error(ErrorKind::ProbeShort { code: Code(code) }));
        }
        self.modal.motion = code;
        out.emit(Canon::TurnProbe(true));
        out.emit(Canon::StraightProbe { end: Position::from_array(end), probe });
        out.emit(Canon::TurnProbe(false));
        // Until the machine says where it met something.
        self.position = end;
        Ok(())
    }
}
