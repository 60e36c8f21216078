//! Nodes along the path, and the look-ahead over them.
//!
//! The grid walks along the pieces and sets a node wherever the strips (see `limits`) have changed by 1 %; on a line
//! of a Cartesian machine that is at its ends only. The look-ahead then computes for every node, from the end of what is
//! known backwards, the largest x = ṡ² from which the machine can still follow: the controllable set of TOPP-RA.

use crate::PlanError;
use crate::interval::fastest_entry;
use crate::limits::{FASTEST, Rows, Sample};
use crate::path::Geometry;
use crate::planner::{Piece, Planner};
use pkm_kins::{Kinematics, maths::sqrt};

/// Change of the strips from node to node, in shares of the limits.
const CHANGE: f64 = 0.01;
/// However fast the strips change, nodes are no closer than this many to a servo period at full speed.
const NODES_PER_PERIOD: f64 = 16.0;
/// The speed is held so low that no more than about twice this many nodes are passed in a servo period.
const NODES_PER_TICK: usize = 64;
/// Nodes added in one go: bounds the work of a tick.
const BATCH: usize = NODES_PER_TICK;
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
    /// Nodes at the end that the look-ahead has not seen.
    pending: usize,
    /// Nodes the last look-ahead computed.
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
            pending: 0,
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
        if !self.is_short() && self.nodes.len() + WORTH > NODES {
            return Ok(());
        }
        let result = self.cut(BATCH);
        // What the machine comes to soon must be final. Beyond that a pass waits until it is worth its price.
        let soon = self.nodes.get(2 * NODES_PER_TICK).or(self.nodes.back()).map_or(0.0, |node| node.distance);
        let hurry = !(self.grid.settled >= soon);
        if self.grid.pending > 0 && (hurry || 4 * self.grid.pending >= self.grid.depth) {
            self.look_ahead(self.nodes.len().saturating_sub(self.grid.pending));
        }
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
        while self.nodes.len() < target {
            let Some(&piece) = self.piece(self.grid.piece) else { break };
            if self.nodes.is_empty() {
                self.first_node(&piece)?;
            } else if self.grid.s < piece.to {
                self.march(&piece)?;
            } else if piece.open || !self.next_piece(&piece)? {
                break;
            }
        }
        Ok(())
    }

    fn sample(&mut self, piece: &Piece, s: f64) -> Result<Sample<R>, PlanError> {
        self.work.samples += 1;
        self.limits.sample(&self.kinematics, &piece.geometry, s, piece.feed, piece.span)
    }

    fn first_node(&mut self, piece: &Piece) -> Result<(), PlanError> {
        let sample = self.sample(piece, piece.from)?;
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
        self.grid.s = piece.from;
        self.grid.step = f64::INFINITY;
        self.grid.last = Some(sample);
        self.add(node);
        Ok(())
    }

    fn add(&mut self, node: Node<R>) {
        // `cut` goes on only while there is room.
        let _ = self.nodes.push_back(node);
        self.grid.pending += 1;
        self.work.nodes += 1;
    }

    /// The end of a piece: what begins here joins the last node. False if nothing follows yet.
    fn next_piece(&mut self, ended: &Piece) -> Result<bool, PlanError> {
        let number = self.grid.piece + 1;
        let Some(&next) = self.piece(number) else { return Ok(false) };
        let still = matches!(next.geometry, Geometry::Hold(_));
        let sample = if still { None } else { Some(self.sample(&next, next.from)?) };
        let Some(tail) = self.nodes.back_mut() else { return Ok(false) };
        tail.stop |= ended.stop || still;
        tail.dwell_ns += next.dwell_ns;
        if let Some(sample) = sample {
            tail.right = sample.rows;
            tail.piece = number;
            tail.s = next.from;
            tail.hard = tail.hard.min(sample.hard);
            tail.feed = tail.feed.min(sample.feed);
            tail.rapid |= next.rapid;
            self.grid.last = Some(sample);
        }
        self.grid.piece = number;
        self.grid.s = next.from;
        Ok(true)
    }

    /// One interval further along a piece.
    fn march(&mut self, piece: &Piece) -> Result<(), PlanError> {
        let remaining = piece.to - self.grid.s;
        let last = match self.grid.last {
            Some(last) => last,
            None => self.sample(piece, self.grid.s)?,
        };
        let guess = self.grid.step;
        let mut step = even(remaining, guess);
        let period = self.settings.servo_period_s;
        let mut sample = self.sample(piece, self.grid.s + step)?;
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
            sample = self.sample(piece, self.grid.s + step)?;
        }
        let at_end = step >= remaining;
        let between = self.limits.between(&last, &sample, step, piece, self.grid.s)?;
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

    /// The backward pass. `known` nodes were planned before; the pass ends where nothing changes any more.
    pub(crate) fn look_ahead(&mut self, known: usize) {
        let rows = self.limits.rows();
        let (feed, rapid) = self.executor.overrides();
        if let Some(tail) = self.nodes.back_mut() {
            tail.entry = 0.0;
        }
        self.grid.pending = 0;
        self.grid.depth = 0;
        self.grid.settled = f64::NEG_INFINITY;
        for i in (1..self.nodes.len().saturating_sub(1)).rev() {
            let (Some(node), Some(next)) = (self.nodes.get(i), self.nodes.get(i + 1)) else { return };
            let cap = node.cap(feed, rapid).min(FASTEST);
            let entry = if cap > 0.0 {
                fastest_entry(&node.right, &next.left, rows, node.length, cap, next.entry)
            } else {
                0.0
            };
            self.work.planned += 1;
            self.grid.depth += 1;
            let Some(node) = self.nodes.get_mut(i) else { return };
            let same = entry == node.entry && i + 1 < known;
            node.entry = entry;
            // At its cap a node asks nothing of what follows; and one that a longer queue leaves as it is, no longer
            // queue will change (the entry is a concave function of the next one).
            if (same || entry >= cap) && node.distance > self.grid.settled {
                self.grid.settled = node.distance;
            }
            if same {
                return;
            }
        }
    }
}

/// The largest step ≤ `step` that divides `remaining` evenly.
fn even(remaining: f64, step: f64) -> f64 {
    if step >= remaining { remaining } else { remaining / pkm_kins::maths::ceil(remaining / step) }
}
