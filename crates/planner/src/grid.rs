//! Nodes along the path, and the look-ahead over them.
//!
//! The grid walks along the pieces and sets a node wherever the strips (see `limits`) have changed by 0.7 %; on a line
//! of a Cartesian machine that is at its ends only. The look-ahead then computes for every node, from the end of what is
//! known backwards, the largest x = ṡ² from which the machine can still follow: the controllable set of TOPP-RA.

use crate::PlanError;
use crate::interval::fastest_entry;
use crate::limits::{FASTEST, Rows, Sample};
use crate::path::Geometry;
use crate::planner::{Piece, Planner};
use pkm_kins::{Kinematics, maths::sqrt};

/// Change of the strips from node to node, in shares of the limits.
const CHANGE: f64 = 0.007;
/// However fast the strips change, nodes are no closer than this many to a servo period at full speed.
const NODES_PER_PERIOD: f64 = 16.0;
/// The speed is held so low that no more than about twice this many nodes are passed in a servo period.
const NODES_PER_TICK: usize = 64;
/// Nodes added in one go: bounds the work of a tick.
const BATCH: usize = NODES_PER_TICK;
/// The look-ahead plans at least so many more nodes at a time.
const STRETCH: usize = 4 * NODES_PER_TICK;
/// Less room than this is not worth a walk.
const WORTH: usize = 16;

/// A point of the path where the speed is planned; the interval it begins reaches to the next node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node<const R: usize> {
    /// Piece the interval to the right belongs to, and where on it the interval begins.
    pub(crate) piece: u64,
    pub(crate) s: f64,
    /// Length of the interval to the right; 0 while nothing is known there.
    pub(crate) length: f64,
    /// Largest x from which the machine can follow the path.
    pub(crate) entry: f64,
    /// Caps on x: velocity limits, feed at 100 %.
    hard: f64,
    feed: f64,
    rapid: bool,
    /// The machine rests here.
    pub(crate) stop: bool,
    /// And for so long.
    pub(crate) dwell_ns: u64,
    /// Strips at the end of the interval to the left and at the start of the one to the right.
    pub(crate) left: Rows<R>,
    pub(crate) right: Rows<R>,
    /// Distance along the path since the queue was empty; only differences count.
    pub(crate) distance: f64,
}

impl<const R: usize> Node<R> {
    /// Cap on x with the overrides (1 = 100 %).
    pub(crate) fn cap(&self, feed_override: f64, rapid_override: f64) -> f64 {
        if self.stop { 0.0 } else { self.speed_cap(feed_override, rapid_override) }
    }

    /// The same without regard to a stop.
    pub(crate) fn speed_cap(&self, feed_override: f64, rapid_override: f64) -> f64 {
        let hard = if self.rapid { self.hard * rapid_override * rapid_override } else { self.hard };
        hard.min(self.feed * feed_override * feed_override)
    }
}

/// How far the path has been cut into nodes.
#[derive(Debug, Clone)]
pub(crate) struct Grid<const R: usize> {
    pub(crate) piece: u64,
    pub(crate) s: f64,
    step: f64,
    last: Option<Sample<R>>,
    /// Nodes from the front on that the look-ahead has planned; the last of them as a stop.
    pub(crate) planned: usize,
    /// How many of them the last pass had to plan again.
    depth: usize,
    /// As far as this (the nodes' `distance`) nothing depends on where the queue ends.
    pub(crate) settled: f64,
}

impl<const R: usize> Grid<R> {
    pub(crate) fn new() -> Self {
        Self {
            piece: 0,
            s: 0.0,
            step: f64::INFINITY,
            last: None,
            planned: 0,
            depth: 0,
            settled: f64::NEG_INFINITY,
        }
    }
}

impl<K: Kinematics, const R: usize, const PIECES: usize, const NODES: usize> Planner<K, R, PIECES, NODES> {
    /// Cuts more of the path into nodes, if there is room for a batch or the machine would otherwise run dry.
    pub(crate) fn refill(&mut self) -> Result<(), PlanError> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        let worth = self.is_short() || self.nodes.len() + WORTH <= NODES;
        let result = if worth { self.cut(BATCH) } else { Ok(()) };
        self.look_ahead();
        if let Err(fault) = result {
            self.fault = Some(fault);
        }
        result
    }

    /// True when so little is known that a push must not wait for the next tick.
    pub(crate) fn is_short(&self) -> bool {
        self.nodes.len() < BATCH
    }

    fn cut(&mut self, budget: usize) -> Result<(), PlanError> {
        let target = (self.nodes.len() + budget).min(NODES);
        // Every turn adds a node or goes on to the next piece, of which there are at most PIECES.
        for _ in 0..budget + PIECES {
            if self.nodes.len() >= target {
                break;
            }
            let Some(&Piece { to, open, .. }) = self.piece(self.grid.piece) else { break };
            if self.nodes.is_empty() {
                self.first_node()?;
            } else if self.grid.s < to {
                self.march()?;
            } else if open || !self.next_piece()? {
                break;
            }
        }
        Ok(())
    }

    fn first_node(&mut self) -> Result<(), PlanError> {
        let Some(piece) = self.piece(self.grid.piece) else { return Ok(()) };
        let sample = self.limits.sample(&self.kinematics, piece, piece.from)?;
        let node = Node {
            piece: self.grid.piece,
            s: piece.from,
            length: 0.0,
            entry: 0.0,
            hard: sample.hard,
            feed: sample.feed,
            rapid: piece.rapid,
            stop: true,
            dwell_ns: piece.dwell_ns,
            left: sample.rows,
            right: sample.rows,
            distance: 0.0,
        };
        self.grid.s = node.s;
        self.grid.step = f64::INFINITY;
        self.grid.last = Some(sample);
        self.work.samples += 1;
        self.add(node);
        Ok(())
    }

    fn add(&mut self, node: Node<R>) {
        // `cut` goes on only while there is room.
        let _ = self.nodes.push_back(node);
        self.work.nodes += 1;
    }

    /// The end of a piece: what begins here joins the last node. False if nothing follows yet.
    fn next_piece(&mut self) -> Result<bool, PlanError> {
        let number = self.grid.piece + 1;
        let stop = self.piece(self.grid.piece).is_some_and(|ended| ended.stop);
        let Some(next) = self.piece(number) else { return Ok(false) };
        let (from, rapid, dwell_ns) = (next.from, next.rapid, next.dwell_ns);
        let still = matches!(next.geometry, Geometry::Hold(_));
        let sample = if still { None } else { Some(self.limits.sample(&self.kinematics, next, from)?) };
        let Some(tail) = self.nodes.back_mut() else { return Ok(false) };
        tail.stop |= stop || still;
        tail.dwell_ns += dwell_ns;
        if let Some(sample) = sample {
            tail.right = sample.rows;
            tail.piece = number;
            tail.s = from;
            tail.hard = tail.hard.min(sample.hard);
            tail.feed = tail.feed.min(sample.feed);
            tail.rapid |= rapid;
            self.grid.last = Some(sample);
            self.work.samples += 1;
        }
        self.grid.piece = number;
        self.grid.s = from;
        Ok(true)
    }

    /// One interval further along a piece.
    fn march(&mut self) -> Result<(), PlanError> {
        let index = self.grid.piece.wrapping_sub(self.first_piece) as usize;
        let (Some(piece), Some(last)) = (self.pieces.get(index), &self.grid.last) else { return Ok(()) };
        let remaining = piece.to - self.grid.s;
        self.work.samples += 1;
        let guess = self.grid.step;
        let mut step = even(remaining, guess);
        let period = self.settings.servo_period_s;
        let mut sample = self.limits.sample(&self.kinematics, piece, self.grid.s + step)?;
        let mut next_guess = guess;
        for _ in 0..60 {
            let scales = last.variation(&sample);
            let shortest = period * sqrt(scales.speed) / NODES_PER_PERIOD;
            if step <= shortest || scales.change <= CHANGE {
                // What would have been right here is right for the next, or nearly so.
                next_guess = (step * (0.9 * CHANGE / scales.change).min(4.0)).max(0.75 * shortest);
                // A short piece says little of what the path could bear; a straight one nothing.
                if step >= remaining || scales.change == 0.0 {
                    next_guess = next_guess.max(guess);
                }
                break;
            }
            // Change grows about linearly with the step; never below what is needed.
            let by_change = step * (0.9 * CHANGE / scales.change).clamp(0.1, 1.0);
            let shorter = even(remaining, by_change.max(0.5 * shortest).min(0.75 * step));
            if !(shorter < step) {
                break;
            }
            step = shorter;
            self.work.samples += 1;
            sample = self.limits.sample(&self.kinematics, piece, self.grid.s + step)?;
        }
        let at_end = step >= remaining;
        let between = self.limits.between(last, &sample, step, piece, self.grid.s)?;
        let s = if at_end { piece.to } else { self.grid.s + step };
        let number = self.grid.piece;
        let Some(tail) = self.nodes.back_mut() else { return Ok(()) };
        tail.length = step;
        tail.hard = tail.hard.min(between);
        let distance = tail.distance + step;
        let mut hard = sample.hard.min(between);
        if let Some(earlier) = self.nodes.len().checked_sub(NODES_PER_TICK)
            && let Some(earlier) = self.nodes.get(earlier)
        {
            let speed = (distance - earlier.distance) / period;
            hard = hard.min(speed * speed);
        }
        let node = Node {
            piece: number,
            s,
            length: 0.0,
            entry: 0.0,
            hard,
            feed: sample.feed,
            rapid: piece.rapid,
            stop: false,
            dwell_ns: 0,
            left: sample.rows,
            right: sample.rows,
            distance,
        };
        self.add(node);
        self.grid.s = s;
        self.grid.step = next_guess;
        self.grid.last = Some(sample);
        Ok(())
    }

    /// Plans as far ahead as what the machine comes to soon depends on; the rest waits.
    pub(crate) fn look_ahead(&mut self) {
        // Every turn plans as much more as the last one had to plan again, so the turns about double: all in all no
        // more than three times what the queue holds.
        for _ in 0..NODES {
            let soon = self.nodes.get(2 * NODES_PER_TICK).or(self.nodes.back());
            if self.grid.planned >= self.nodes.len()
                || soon.is_none_or(|node| self.grid.settled >= node.distance)
            {
                return;
            }
            let more = self.grid.depth.max(STRETCH);
            self.pass(self.grid.planned, (self.grid.planned + more).min(self.nodes.len()));
        }
    }

    /// The caps have changed: what was planned is void.
    pub(crate) fn look_ahead_anew(&mut self) {
        self.grid.planned = 0;
        self.grid.settled = f64::NEG_INFINITY;
        self.look_ahead();
    }

    /// The backward pass, from a stop at the last of `end` nodes to where nothing changes any more; `known` nodes were
    /// planned before.
    fn pass(&mut self, known: usize, end: usize) {
        let rows = self.limits.rows();
        let (feed, rapid) = self.executor.overrides();
        let mut next = end.wrapping_sub(1);
        if let Some(last) = self.nodes.get_mut(next) {
            last.entry = 0.0;
        }
        self.grid.planned = end;
        self.grid.depth = 0;
        while next > 1 {
            let i = next - 1;
            let (Some(node), Some(after)) = (self.nodes.get(i), self.nodes.get(next)) else { return };
            let cap = node.cap(feed, rapid).min(FASTEST);
            let entry = if cap > 0.0 {
                fastest_entry(&node.right, &after.left, rows, node.length, cap, after.entry)
            } else {
                0.0
            };
            self.work.planned += 1;
            self.grid.depth += usize::from(next < known);
            let Some(node) = self.nodes.get_mut(i) else { return };
            let same = entry == node.entry && next < known;
            node.entry = entry;
            // At its cap a node asks nothing of what follows; and one that a longer queue leaves as it is, no longer
            // queue will change (the entry is a concave function of the next one).
            if (same || entry >= cap) && node.distance > self.grid.settled {
                self.grid.settled = node.distance;
            }
            if same {
                return;
            }
            next = i;
        }
    }
}

/// The largest step ≤ `step` that divides `remaining` evenly.
fn even(remaining: f64, step: f64) -> f64 {
    if step >= remaining { remaining } else { remaining / pkm_kins::maths::ceil(remaining / step) }
}
