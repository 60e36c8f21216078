//! What a person can do at any tick: overrides, feed hold, single block, abort. Each of them only changes what is
//! permitted; the strips hold in all of them, and the machine stays on the path.

use crate::planner::Planner;
use pkm_kins::Kinematics;

/// What the look-ahead has to know of the operator's panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Panel {
    /// 1 = 100 %.
    pub(crate) feed: f64,
    pub(crate) rapid: f64,
    /// At rest at the end of every block.
    pub(crate) single_block: bool,
}

impl Panel {
    pub(crate) const NEUTRAL: Self = Self { feed: 1.0, rapid: 1.0, single_block: false };

    /// The higher of both overrides.
    pub(crate) fn highest(self, other: Self) -> Self {
        Self { feed: self.feed.max(other.feed), rapid: self.rapid.max(other.rapid), ..self }
    }

    /// The factor by which ṡ² of a plan made with `planned` has to be reduced. Such a plan is admissible, feeds included,
    /// when it is driven slower throughout: x and s̈ by one factor (Pham & Pham 2018).
    pub(crate) fn share(self, planned: Self) -> f64 {
        let slower = |now: f64, planned: f64| if now < planned { now / planned } else { 1.0 };
        let factor = slower(self.feed, planned.feed).min(slower(self.rapid, planned.rapid));
        factor * factor
    }
}

impl<K: Kinematics, const R: usize, const PIECES: usize, const NODES: usize> Planner<K, R, PIECES, NODES> {
    /// Feed override, 1 = 100 %, clamped to 0 to 2. What is not finite is refused: false, and nothing changes.
    pub fn set_feed_override(&mut self, factor: f64) -> bool {
        let panel = self.executor.panel;
        self.set_panel(Panel { feed: factor.clamp(0.0, 2.0), ..panel }, factor)
    }

    /// Rapid override, 1 = 100 %, clamped to 0 to 1. What is not finite is refused: false, and nothing changes.
    pub fn set_rapid_override(&mut self, factor: f64) -> bool {
        let panel = self.executor.panel;
        self.set_panel(Panel { rapid: factor.clamp(0.0, 1.0), ..panel }, factor)
    }

    /// Single block: the machine comes to rest at the end of the block it is in, or of the first one at whose end the
    /// limits let it stop, and waits for [`Self::step`]. A block is what one source line makes; with a blend after it, it
    /// ends where the blend does.
    pub fn set_single_block(&mut self, on: bool) {
        let panel = self.executor.panel;
        self.set_panel(Panel { single_block: on, ..panel }, 1.0);
    }

    /// Lets the machine run to the end of the next block. False if it does not wait for that.
    pub fn step(&mut self) -> bool {
        let waits = self.waits_for_step() && self.executor.has_settled();
        if waits {
            self.executor.stepped = true;
            if let Some(node) = self.nodes.front_mut() {
                node.blocks = node.blocks.saturating_sub(1);
            }
        }
        waits
    }

    fn set_panel(&mut self, panel: Panel, factor: f64) -> bool {
        if !factor.is_finite() {
            return false;
        }
        if panel != self.executor.panel {
            self.executor.panel = panel;
            self.executor.replan();
        }
        true
    }

    /// True at rest at the end of a block with another one behind it, in single block.
    pub(crate) fn waits_for_step(&self) -> bool {
        self.executor.panel.single_block
            && self.executor.is_at_node()
            && !self.executor.stepped
            && self.nodes.front().is_some_and(|node| node.blocks > 0)
    }

    /// Feed hold: brakes to rest on the path as fast as the limits allow; false resumes.
    pub fn hold(&mut self, hold: bool) {
        if self.executor.hold != hold {
            self.executor.hold = hold;
            self.executor.replan();
        }
    }

    /// Brakes to rest on the path, then empties the queue: the program is over, the machine stays where it is.
    pub fn abort(&mut self) {
        self.executor.abort = true;
        self.executor.replan();
    }
}
