//! Nodes along the path, and the look-ahead over them.
//!
//! The grid walks along the pieces and sets a node wherever the strips (see `limits`) have changed by 0.7 %; on a line
//! of a Cartesian machine that is at its ends only. The look-ahead then computes for every node, from the end of what is
//! known backwards, the largest x = ṡ² from which the machine can still follow: the controllable set of TOPP-RA.

use crate::PlanError;
use crate::interval::fastest_entry;
use crate::limits::{BOW, FASTEST, Rows, Sample, Spot};
use crate::operator::Panel;
use crate::pair::{higher, lower};
use crate::path::Geometry;
use crate::planner::{Piece, Planner};
use pkm_canon::Span;
use pkm_kins::{Kinematics, maths::sqrt};

/// Change of the strips from node to node, in shares of the limits.
const CHANGE: f64 = 0.007;
/// However fast the strips change, nodes are no closer than this many to a servo period at full speed.
const NODES_PER_PERIOD: f64 = 16.0;
/// The speed is held so low that no more than about twice this many nodes are passed in a servo period.
const NODES_PER_TICK: usize = 64;
/// Nodes a push sets at most.
pub(crate) const SET_PER_PUSH: usize = 64;
/// So many more nodes than the last tick passed are set in a tick at most, so that the queue grows as long as there is path and
/// room for them; room for fewer waits for more.
const SET_PER_TICK: usize = 8;
/// Nodes the look-ahead plans in a tick at most; a push grants it so many for each node it sets.
const PLANNED_PER_TICK: usize = 64;
const PLANNED_PER_SET: usize = 8;
/// One pass of the look-ahead takes in at least so many new nodes, if there are as many.
const STRETCH: usize = 4 * NODES_PER_TICK;

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
    /// Caps on x in the interval to the left and in the one to the right: here both hold, but where two pieces meet, the slower one
    /// holds the other no further.
    before: Caps,
    after: Caps,
    /// The machine rests here.
    pub(crate) stop: bool,
    /// And for so long.
    pub(crate) dwell_ns: u64,
    /// Blocks that end here: in single block the machine rests here as often.
    pub(crate) blocks: u8,
    /// Strips at the end of the interval to the left and at the start of the one to the right.
    pub(crate) left: Rows<R>,
    pub(crate) right: Rows<R>,
    /// Distance along the path since the queue was empty; only differences count.
    pub(crate) distance: f64,
}

/// Caps on x: velocity limits, feed at 100 %.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Caps {
    hard: f64,
    feed: f64,
    rapid: bool,
}

impl Caps {
    /// With what the operator has set.
    fn under(&self, panel: Panel) -> f64 {
        let hard = if self.rapid { self.hard * panel.rapid * panel.rapid } else { self.hard };
        lower(hard, self.feed * panel.feed * panel.feed)
    }

    fn lower(self, other: Self) -> Self {
        Self {
            hard: lower(self.hard, other.hard),
            feed: lower(self.feed, other.feed),
            rapid: self.rapid || other.rapid,
        }
    }
}

impl<const R: usize> Node<R> {
    /// Cap on x with what the operator has set.
    pub(crate) fn cap(&self, panel: Panel) -> f64 {
        if self.stop || panel.single_block && self.blocks > 0 {
            0.0
        } else {
            self.before.lower(self.after).under(panel)
        }
    }

    /// Cap on x between this node and the next.
    pub(crate) fn cap_until(&self, next: &Self, panel: Panel) -> f64 {
        lower(self.after.under(panel), next.before.under(panel))
    }
}

/// How far the path has been cut into nodes.
#[derive(Debug, Clone)]
pub(crate) struct Grid<const R: usize> {
    pub(crate) piece: u64,
    pub(crate) s: f64,
    /// What is guessed to be right for the next interval, and for the one after it: so the processor need not know how good a
    /// step was before it begins the next.
    step: f64,
    after_step: f64,
    /// No step on this piece is longer: what turns looks the same a turn later.
    longest: f64,
    look: Look<R>,
    /// `distance` of the last nodes set.
    recent: [f64; NODES_PER_TICK],
    /// Nodes from the front on that the look-ahead has planned; the last of them as a stop.
    pub(crate) planned: usize,
    /// How many of them the last pass had to plan again.
    depth: usize,
    /// As far as this (the nodes' `distance`) nothing depends on where the queue ends.
    pub(crate) settled: f64,
    /// So many of them were planned with what the operator has set now, or had when this changed last; the others with
    /// no higher overrides than these.
    fresh: usize,
    current: Panel,
    before: Panel,
    /// The look-ahead under way.
    pass: Option<Pass>,
}

/// Where the path was looked at last.
#[derive(Debug, Clone)]
struct Look<const R: usize> {
    /// At the last node, and at the place that may become the next; the first of them is that of the last node if `swapped` is false.
    samples: [Sample<R>; 2],
    swapped: bool,
    spot: Spot,
}

impl<const R: usize> Look<R> {
    /// At the last node, and at the place that may become the next; and what looks at it.
    #[inline]
    fn samples(&mut self) -> (&mut Sample<R>, &mut Sample<R>, &mut Spot) {
        let [a, b] = &mut self.samples;
        if self.swapped { (b, a, &mut self.spot) } else { (a, b, &mut self.spot) }
    }
}

/// A backward pass: from a stop at the last of `end` nodes to where nothing changes any more. It may rest between any
/// two nodes: those it has not come to keep an older plan, which asks no more of those that follow than the new one
/// grants.
#[derive(Debug, Clone, Copy)]
struct Pass {
    /// Nodes taken in; the index of the one planned last, and of the one before which it ends; how many were planned
    /// before, with the same overrides.
    end: usize,
    next: usize,
    first: usize,
    known: usize,
    /// Of these, planned again.
    depth: usize,
    settled: f64,
    /// The operator has turned something: it plans anew what is planned.
    anew: bool,
    panel: Panel,
}

impl<const R: usize> Grid<R> {
    pub(crate) fn new() -> Self {
        Self {
            piece: 0,
            s: 0.0,
            step: f64::INFINITY,
            after_step: f64::INFINITY,
            longest: f64::INFINITY,
            look: Look { samples: [Sample::EMPTY; 2], swapped: false, spot: Spot::NONE },
            recent: [f64::NEG_INFINITY; NODES_PER_TICK],
            planned: 0,
            depth: 0,
            settled: f64::NEG_INFINITY,
            fresh: 0,
            current: Panel::NEUTRAL,
            before: Panel::NEUTRAL,
            pass: None,
        }
    }

    /// True while the look-ahead has not finished what it began.
    pub(crate) fn is_planning(&self) -> bool {
        self.pass.is_some()
    }

    /// The node at the front is passed.
    pub(crate) fn shift(&mut self) {
        self.planned = self.planned.saturating_sub(1);
        self.fresh = self.fresh.saturating_sub(1);
        if let Some(pass) = &mut self.pass {
            pass.end = pass.end.saturating_sub(1);
            pass.next = pass.next.saturating_sub(1);
            pass.first = pass.first.saturating_sub(1);
            pass.known = pass.known.saturating_sub(1);
        }
    }

    /// True if all that is planned was planned with what is set now.
    #[inline]
    pub(crate) fn is_planned_with(&self, now: Panel) -> bool {
        self.current == now && self.fresh == self.planned && self.pass.is_none()
    }

    /// The share of its planned entry at which node `index` may be passed now.
    #[inline]
    pub(crate) fn share(&self, index: usize, now: Panel) -> f64 {
        if self.is_planned_with(now) {
            return 1.0;
        }
        let planned = match self.pass {
            Some(pass) if pass.anew && (pass.next..pass.end).contains(&index) => pass.panel,
            _ if index < self.fresh || self.fresh == self.planned => self.current,
            _ => self.before,
        };
        now.share(planned)
    }
}

impl<K: Kinematics, const R: usize, const PIECES: usize, const NODES: usize> Planner<K, R, PIECES, NODES> {
    /// A tick's share of the work: what lies ahead is cut into nodes and planned, a little at a time.
    pub(crate) fn refill(&mut self, passed: usize) -> Result<(), PlanError> {
        let budget = passed + SET_PER_TICK;
        let worth = self.nodes.len() + budget <= NODES;
        self.extend(if worth { budget } else { 0 }, PLANNED_PER_TICK)
    }

    /// Sets at most `budget` nodes and plans at most `planned` of all.
    pub(crate) fn extend(&mut self, budget: usize, planned: usize) -> Result<(), PlanError> {
        let before = self.work.nodes;
        if self.fault.is_none() && budget > 0 {
            self.fault = self.cut(budget).err();
        }
        let set = self.work.nodes.wrapping_sub(before) as usize;
        self.look_ahead(planned.max(set * PLANNED_PER_SET));
        self.fault.map_or(Ok(()), Err)
    }

    fn cut(&mut self, budget: usize) -> Result<(), PlanError> {
        let mut room = budget.min(NODES - self.nodes.len());
        // Every turn adds a node or goes on to the next piece.
        for _ in 0..2 * budget {
            if room == 0 {
                break;
            }
            let Some(&Piece { to, open, .. }) = self.piece(self.grid.piece) else { break };
            if self.nodes.is_empty() {
                self.first_node()?;
                room -= 1;
            } else if self.grid.s < to {
                room -= self.march(room)?;
            } else if open || !self.next_piece()? {
                break;
            }
        }
        Ok(())
    }

    fn first_node(&mut self) -> Result<(), PlanError> {
        let Some(piece) = self.pieces.get(self.index_of(self.grid.piece)) else { return Ok(()) };
        let (number, longest) = (self.grid.piece, piece.geometry.longest_step());
        let (sample, _, spot) = self.grid.look.samples();
        spot.look(piece, piece.from);
        self.limits.sample(&self.kinematics, piece, spot, sample)?;
        let caps = Caps { hard: sample.hard, feed: sample.feed, rapid: piece.rapid };
        let node = Node {
            piece: number,
            s: piece.from,
            length: 0.0,
            entry: 0.0,
            before: caps,
            after: caps,
            stop: true,
            dwell_ns: piece.dwell_ns,
            blocks: 1,
            left: sample.rows,
            right: sample.rows,
            distance: 0.0,
        };
        self.grid.s = node.s;
        self.grid.step = f64::INFINITY;
        self.grid.after_step = f64::INFINITY;
        self.grid.longest = longest;
        self.work.samples += 1;
        // `cut` goes on only while there is room.
        let _ = self.nodes.push_back(node);
        self.work.nodes += 1;
        Ok(())
    }

    /// The end of a piece: what begins here joins the last node. False if nothing follows yet.
    fn next_piece(&mut self) -> Result<bool, PlanError> {
        let number = self.grid.piece + 1;
        let Some(next) = self.pieces.get(self.index_of(number)) else { return Ok(false) };
        let (stop, span) = self.piece(self.grid.piece).map_or((false, None), |p| (p.stop, Some(p.span)));
        let (from, rapid, dwell_ns) = (next.from, next.rapid, next.dwell_ns);
        let longest = next.geometry.longest_step();
        let still = matches!(next.geometry, Geometry::Hold(_));
        // A new source line is a new block; a dwell always is.
        let block = still || span.is_some_and(|span| !is_same_block(span, next.span));
        if !still {
            let (sample, _, spot) = self.grid.look.samples();
            spot.look(next, from);
            self.limits.sample(&self.kinematics, next, spot, sample)?;
        }
        let Some(tail) = self.nodes.back_mut() else { return Ok(false) };
        tail.stop |= stop || still;
        tail.dwell_ns += dwell_ns;
        tail.blocks = tail.blocks.saturating_add(u8::from(block));
        if !still {
            let (sample, ..) = self.grid.look.samples();
            tail.right = sample.rows;
            tail.piece = number;
            tail.s = from;
            tail.after = Caps { hard: sample.hard, feed: sample.feed, rapid };
            self.work.samples += 1;
        }
        self.grid.piece = number;
        self.grid.s = from;
        self.grid.longest = longest;
        Ok(true)
    }

    /// At least one interval and at most `room` further along a piece; how many.
    #[inline(never)]
    fn march(&mut self, room: usize) -> Result<usize, PlanError> {
        let number = self.grid.piece;
        let Some(piece) = self.pieces.get(self.index_of(number)) else { return Ok(room) };
        let rows = self.limits.rows();
        let brief = self.settings.servo_period_s / NODES_PER_PERIOD;
        let per_period = 1.0 / self.settings.servo_period_s;
        let mut set = 0;
        while set < room {
            set += 1;
            let start = self.grid.s;
            let remaining = piece.to - start;
            let guess = self.grid.step;
            let mut step = even(remaining, lower(guess, self.grid.longest));
            let mut next_guess = guess;
            let (last, sample, spot) = self.grid.look.samples();
            for shortened in 0..=60 {
                self.work.samples += 1;
                spot.look_on(piece, start + step);
                self.limits.sample(&self.kinematics, piece, spot, sample)?;
                let scales = last.variation(sample, rows);
                let right = CHANGE * scales.unit;
                // Compared as squares: the root is seldom needed.
                let shortest_2 = brief * brief * scales.x;
                let steady = step * step <= shortest_2 || scales.change <= right;
                let bow = if steady { last.bow(sample, rows, step, &scales) } else { 0.0 };
                if steady && bow <= BOW {
                    // What would have been right here is right for the next, or nearly so.
                    next_guess = step * lower(4.0, 0.9 * right / scales.change);
                    if next_guess * next_guess < 0.75 * 0.75 * shortest_2 {
                        next_guess = 0.75 * sqrt(shortest_2);
                    }
                    if bow > 0.25 * BOW {
                        next_guess = lower(next_guess, step);
                    }
                    // A short piece says little of what the path could bear; a straight one nothing.
                    if step >= remaining || scales.change == 0.0 {
                        next_guess = higher(next_guess, guess);
                    }
                    break;
                }
                let bearable = if steady {
                    // The bow grows with the square of the step.
                    step * sqrt(0.9 * BOW / bow).max(0.1)
                } else {
                    // Change grows about linearly with it; never below what is needed.
                    let by_change = step * (0.9 * right / scales.change).clamp(0.1, 1.0);
                    by_change.max(0.5 * sqrt(shortest_2))
                };
                let shorter = even(remaining, bearable.min(0.75 * step));
                if !(shorter < step) || shortened == 60 {
                    break;
                }
                step = shorter;
            }
            let between = self.limits.between(last, sample, step, piece, start)?;
            let s = if step >= remaining { piece.to } else { start + step };
            let Some(tail) = self.nodes.back_mut() else { return Ok(room) };
            tail.length = step;
            tail.after.hard = lower(tail.after.hard, between);
            if start > piece.from {
                // What else it holds is the same on both sides.
                tail.before.hard = lower(tail.before.hard, between);
            }
            let distance = tail.distance + step;
            let recent = &mut self.grid.recent[self.work.nodes as usize % NODES_PER_TICK];
            let most = (distance - core::mem::replace(recent, distance)) * per_period;
            let after = Caps { hard: between, feed: sample.feed, rapid: piece.rapid };
            // That the nodes behind are close holds the interval ahead no further.
            let before = Caps { hard: lower(between, most * most), ..after };
            // `cut` asks for no more than there is room for.
            let _ = self.nodes.push_back(Node {
                piece: number,
                s,
                length: 0.0,
                entry: 0.0,
                before,
                after,
                stop: false,
                dwell_ns: 0,
                blocks: 0,
                left: sample.rows,
                right: sample.rows,
                distance,
            });
            self.work.nodes += 1;
            self.grid.s = s;
            self.grid.step = self.grid.after_step;
            self.grid.after_step = next_guess;
            self.grid.look.swapped = !self.grid.look.swapped;
            if !(s < piece.to) {
                break;
            }
        }
        Ok(set)
    }

    /// Plans at most `budget` nodes, as far ahead as what the machine comes to soon depends on; the rest waits.
    fn look_ahead(&mut self, mut budget: usize) {
        while budget > 0 && (self.grid.pass.is_some() || self.begin_pass()) {
            budget = self.continue_pass(budget);
        }
    }

    /// Begins a pass if one is due: anew over what is planned, if the operator has turned something, else over more.
    fn begin_pass(&mut self) -> bool {
        let panel = self.executor.panel;
        let (known, all) = (self.grid.planned, self.nodes.len());
        if panel != self.grid.current {
            let stale = self.grid.fresh < known;
            let before = if stale { self.grid.current.highest(self.grid.before) } else { self.grid.current };
            self.grid.before = before;
            self.grid.current = panel;
            self.grid.fresh = 0;
            self.grid.settled = f64::NEG_INFINITY;
        }
        if self.grid.fresh < known {
            // As far as the next stop nothing depends on what follows.
            let first = self.grid.fresh.max(1);
            let ends = |node: &Node<R>| node.cap(panel) == 0.0;
            let stop = self.nodes.iter().take(known).skip(first).take(STRETCH).position(ends);
            let end = stop.map_or(known, |offset| first + offset + 1);
            if let Some(node) = self.nodes.get_mut(end - 1).filter(|_| stop.is_some()) {
                node.entry = 0.0;
            }
            self.grid.pass = Some(Pass {
                end,
                next: end - 1,
                first,
                known: 0,
                depth: 0,
                settled: self.grid.settled,
                anew: true,
                panel,
            });
            return true;
        }
        if known >= all {
            return false;
        }
        let soon = self.nodes.get(2 * NODES_PER_TICK).or(self.nodes.back());
        let settled = soon.is_none_or(|node| self.grid.settled >= node.distance);
        // A pass over fewer new nodes than it plans anew is worth it only when no more come.
        let early = all - known < self.grid.depth.min(STRETCH) && self.grows();
        if settled || early {
            return false;
        }
        // Each pass takes in as much more as the last one had to plan again: all in all no more than about three times
        // what the queue holds.
        let end = (known + self.grid.depth.max(STRETCH)).min(all);
        self.grid.pass = Some(Pass {
            end,
            next: end - 1,
            first: 1,
            known,
            depth: 0,
            settled: self.grid.settled,
            anew: false,
            panel,
        });
        true
    }

    /// True if there is more path to be cut into nodes.
    fn grows(&self) -> bool {
        let last = self.first_piece + self.pieces.len() as u64;
        self.fault.is_none()
            && self.nodes.len() < NODES
            && (self.grid.piece + 1 < last || self.piece(self.grid.piece).is_some_and(|p| self.grid.s < p.to))
    }

    /// Goes on with the pass for at most `budget` nodes; returns what is left of them.
    fn continue_pass(&mut self, mut budget: usize) -> usize {
        let rows = self.limits.rows();
        let Some(mut pass) = self.grid.pass.take() else { return budget };
        // From the last node taken in to the front.
        let (first, then) = self.nodes.as_mut_slices();
        let skipped = (first.len() + then.len()).saturating_sub(pass.next + 1);
        let mut nodes = then.iter_mut().rev().chain(first.iter_mut().rev()).skip(skipped);
        let mut after: Option<&Node<R>> = nodes.next().map(|node| &*node);
        while pass.next > pass.first.max(1) {
            if budget == 0 {
                self.grid.pass = Some(pass);
                return 0;
            }
            let (Some(node), Some(next)) = (nodes.next(), after) else { break };
            let cap = lower(node.cap(pass.panel), FASTEST);
            let entry = if cap > 0.0 {
                fastest_entry(&node.right, &next.left, rows, node.length, cap, next.entry)
            } else {
                0.0
            };
            budget -= 1;
            self.work.planned += 1;
            let known = pass.next < pass.known;
            pass.depth += usize::from(known);
            let same = known && entry == node.entry;
            node.entry = entry;
            // At its cap a node asks nothing of what follows; and one that a longer queue leaves as it is, no longer
            // queue will change (the entry is a concave function of the next one).
            if (same || entry >= cap) && node.distance > pass.settled {
                pass.settled = node.distance;
            }
            if same {
                break;
            }
            pass.next -= 1;
            after = Some(node);
        }
        self.grid.settled = pass.settled;
        if pass.anew {
            // The interval being driven was planned with what was set before.
            self.grid.fresh = pass.end.min(self.grid.planned);
            self.executor.replan();
        } else {
            self.grid.planned = pass.end;
            self.grid.fresh = pass.end;
            self.grid.depth = pass.depth;
        }
        budget
    }
}

fn is_same_block(a: Span, b: Span) -> bool {
    (a.file, a.line) == (b.file, b.line)
}

/// `step`, or towards the end of a piece the largest step below it that divides what `remain`s evenly.
#[inline(always)]
fn even(remaining: f64, step: f64) -> f64 {
    const STEPS: f64 = 8.0;
    if step >= remaining {
        return remaining;
    }
    if STEPS * step < remaining {
        return step;
    }
    let steps = remaining / step;
    // Rounded up; what does not fit is not rounded.
    let whole = steps as i64 as f64;
    remaining / if whole < steps { whole + 1.0 } else { whole }
}
