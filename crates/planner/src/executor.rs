//! The servo tick: the forward pass. At every node it takes the fastest exit that the strips allow and the
//! look-ahead permits, and keeps that acceleration until the next node. Feed hold, overrides and abort only change
//! what is permitted; the strips hold in every one of them, on the path.

use crate::grid::Node;
use crate::interval::{SLACK, accelerations, allows, exits};
use crate::limits::{Rows, Sample, Spot};
use crate::operator::Panel;
use crate::pair::{each, higher, highest, lower, with};
use crate::path::Place;
use crate::planner::{PathMode, Planner, Setpoint, State};
use crate::{PlanError, PlanErrorKind};
use pkm_kins::{JointMotion, Kinematics, Pose, maths::sqrt};

/// Nodes passed in one tick at the very most (the grid holds the speed down to about 128).
const MOST_NODES: usize = 1024;

/// A stretch of an interval driven at constant acceleration: where it ends (distance from the node) and with which x.
#[derive(Debug, Clone, Copy, Default)]
struct Leg {
    end: f64,
    x: f64,
    /// √x
    v: f64,
}

impl Leg {
    fn to(end: f64, x: f64) -> Self {
        Self { end, x, v: sqrt(x) }
    }
}

/// Down, along, up: the one driven now is the last.
type Legs = heapless::Vec<Leg, 3>;

/// Where the machine is between the two nodes at the front, and what it is doing there.
#[derive(Debug, Clone)]
pub(crate) struct Executor {
    /// Distance from the front node.
    sigma: f64,
    /// ṡ² here, and ṡ.
    x: f64,
    v: f64,
    /// The legs still to be driven to the next node.
    legs: Legs,
    planned: bool,
    /// Number of the next setpoint within its servo period, from 0.
    substep: u32,
    /// Nothing moves until the next servo period: the machine came to a stop, or dwells.
    waits: bool,
    dwells: bool,
    /// Servo periods still to rest at a stop.
    settle: u32,
    pub(crate) hold: bool,
    pub(crate) abort: bool,
    pub(crate) panel: Panel,
    /// Single block: on the way, until the next node.
    pub(crate) stepped: bool,
    /// Nodes passed ([`crate::Work`]) when the last servo period began.
    passed_before: u64,
    /// What was published last.
    place: Place,
    motion: JointMotion,
}

impl Executor {
    pub(crate) fn new() -> Self {
        Self {
            sigma: 0.0,
            x: 0.0,
            v: 0.0,
            legs: Legs::default(),
            planned: false,
            substep: 0,
            waits: false,
            dwells: false,
            settle: 0,
            hold: false,
            abort: false,
            panel: Panel::NEUTRAL,
            stepped: false,
            passed_before: 0,
            place: Place::ZERO,
            motion: JointMotion::default(),
        }
    }

    pub(crate) fn at_rest(&self) -> bool {
        self.x == 0.0
    }

    pub(crate) fn has_settled(&self) -> bool {
        self.x == 0.0 && self.settle == 0
    }

    pub(crate) fn rest(&mut self) {
        self.sigma = 0.0;
        (self.x, self.v) = (0.0, 0.0);
        self.planned = false;
        self.abort = false;
        self.stepped = false;
    }

    /// At rest at the front node.
    pub(crate) fn is_at_node(&self) -> bool {
        self.x == 0.0 && self.sigma == 0.0
    }

    /// The next leg, alone.
    fn take(&mut self, leg: Leg) {
        self.planned = true;
        self.legs.clear();
        let _ = self.legs.push(leg);
    }

    /// What is permitted has changed: the rest of the interval is planned again.
    pub(crate) fn replan(&mut self) {
        self.planned = false;
    }
}

impl<K: Kinematics, const R: usize, const PIECES: usize, const NODES: usize> Planner<K, R, PIECES, NODES> {
    /// One servo period (or one of its `substeps`). The result is where the machine has to be at its end.
    ///
    /// # Errors
    /// None in a machine whose path was accepted; an error of the kinematics here is a defect of the mechanism and
    /// leaves the machine at the last setpoint.
    pub fn tick(&mut self) -> Result<Setpoint, PlanError> {
        let held = self.executor.hold || self.executor.abort;
        if self.executor.substep == 0 {
            // A fault only ends the queue: what is known is still driven to its end, at rest.
            let passed = (self.work.passed - self.executor.passed_before) as usize;
            self.executor.passed_before = self.work.passed;
            let _ = self.refill(passed);
            // Who is held up does not starve.
            if !held && !self.waits_for_step() {
                self.release_if_starving();
            }
            self.begin_period(held);
        }
        let substeps = self.settings.substeps.max(1);
        self.executor.substep = (self.executor.substep + 1) % substeps;
        if !self.executor.waits {
            let moved = !self.executor.at_rest();
            self.executor.waits = self.advance(self.settings.servo_period_s / f64::from(substeps), held);
            if moved && self.executor.at_rest() {
                self.executor.settle = self.settings.settle_periods;
            }
        }
        let mut state = if self.executor.dwells { State::Dwell } else { State::Moving };
        let rests = self.executor.has_settled();
        let over = self.executor.abort && rests;
        if over {
            state = State::Idle;
        } else if held && rests {
            state = State::Held;
        } else if self.is_idle() {
            state = State::Idle;
        } else if rests && !self.executor.dwells && self.waits_for_step() {
            state = State::BlockEnd;
        }
        let published = self.publish(state);
        if over {
            // Only now: the last of the way is in this setpoint.
            self.clear();
        }
        published.map(|()| self.setpoint)
    }

    /// A dwell takes whole servo periods; the last one may be cut short.
    fn begin_period(&mut self, held: bool) {
        let at_node = self.executor.is_at_node();
        // Held or not: what averages the setpoints goes on.
        let settles = self.executor.settle > 0;
        self.executor.settle = self.executor.settle.saturating_sub(1);
        let waits = settles || self.waits_for_step();
        let dwells = match self.nodes.front_mut() {
            Some(node) if at_node && !waits && node.dwell_ns > 0 => {
                if !held {
                    let period_ns = pkm_kins::maths::round(self.settings.servo_period_s * 1e9) as u64;
                    node.dwell_ns = node.dwell_ns.saturating_sub(period_ns);
                    // The dwell was a block of its own.
                    self.executor.stepped &= node.dwell_ns > 0;
                }
                true
            }
            _ => false,
        };
        self.executor.dwells = dwells;
        self.executor.waits = dwells || waits;
    }

    /// The open end of the last move is released when the machine would have to brake for want of it.
    fn release_if_starving(&mut self) {
        let last = self.first_piece + (self.pieces.len() as u64).saturating_sub(1);
        let all_known =
            self.grid.piece == last && self.pieces.back().is_some_and(|p| p.open && self.grid.s >= p.to);
        let all_planned = self.grid.planned >= self.nodes.len() && !self.grid.is_planning();
        if all_known && all_planned && self.brakes_now() {
            self.starved = self.pieces.back().is_some_and(|last| last.mode != PathMode::ExactStop);
            self.release();
            let _ = self.refill(0);
        }
    }

    /// True when within two servo periods, at the fastest, the machine would brake for the end of the queue.
    fn brakes_now(&self) -> bool {
        let (rows, panel) = (self.limits.rows(), self.executor.panel);
        let Some(front) = self.nodes.front() else { return false };
        // The interval being driven counts as driven.
        let mut x = self.executor.legs.first().map_or(self.executor.x, |leg| leg.x);
        let here = front.distance + self.executor.sigma;
        let share = self.grid.share(1, panel);
        let known = self.nodes.iter().skip(1);
        for (from, to) in known.zip(self.nodes.iter().skip(2)) {
            if from.distance > here + 2.0 * sqrt(x) * self.settings.servo_period_s {
                return false;
            }
            let entry = from.entry * share;
            if x >= entry {
                if from.distance > self.grid.settled {
                    return true;
                }
                x = entry;
            }
            x = exits(&from.right, &to.left, rows, from.length, x).1.min(to.cap(panel));
        }
        true
    }

    /// Drives along the nodes for `time` seconds, or to the next stop. True at a stop: the machine rests there until the
    /// next servo period, so that the servo sees the corner itself.
    fn advance(&mut self, time: f64, held: bool) -> bool {
        let mut remaining = time;
        for _ in 0..MOST_NODES {
            let (Some(node), Some(next)) = (self.nodes.front(), self.nodes.get(1)) else {
                (self.executor.x, self.executor.v) = (0.0, 0.0);
                return true;
            };
            let length = node.length;
            if !self.executor.planned {
                if !held && let Some(x_end) = self.brief_exit(node, next) {
                    let v_end = sqrt(x_end);
                    let duration = 2.0 * length / (self.executor.v + v_end);
                    if duration <= remaining {
                        remaining -= duration;
                        (self.executor.x, self.executor.v) = (x_end, v_end);
                        self.pass_node();
                        if self.stops_here() {
                            return true;
                        }
                        continue;
                    }
                    self.executor.take(Leg { end: length, x: x_end, v: v_end });
                } else if !self.plan_leg(held) {
                    return true;
                }
            }
            let e = &mut self.executor;
            let Some(&leg) = e.legs.last() else { return true };
            let distance = leg.end - e.sigma;
            // Twice the mean speed of the leg: it takes `way` over that.
            let (way, pace) = (2.0 * distance, e.v + leg.v);
            if !(pace > 0.0 && way <= remaining * pace) {
                let speed = e.v + (leg.x - e.x) / way * remaining;
                // Braking to rest may seem to end just before the leg does; that is rounding, and the leg is over.
                let arrived = leg.x == 0.0 && e.v > 0.0 && !(speed > 0.0);
                if !arrived {
                    if distance > 0.0 && pace > 0.0 {
                        e.sigma = (e.sigma + 0.5 * (e.v + speed) * remaining).min(leg.end);
                        (e.x, e.v) = (speed * speed, speed);
                    }
                    return false;
                }
            }
            remaining = (remaining - way / pace).max(0.0);
            (e.x, e.v) = (leg.x, leg.v);
            e.legs.pop();
            if leg.end < length {
                e.sigma = leg.end;
                if e.x == 0.0 && held {
                    e.planned = false;
                    return true;
                }
                continue;
            }
            e.planned = false;
            e.sigma = 0.0;
            self.pass_node();
            if self.stops_here() {
                return true;
            }
        }
        false
    }

    /// True at rest at the front node. Where the plan says rest, what is left of the speed is rounding: of every joint less than it
    /// gains in a nanosecond.
    fn stops_here(&mut self) -> bool {
        const REST_S: f64 = 1e-9;
        let (v, single) = (self.executor.v, self.executor.panel.single_block);
        let rests = |node: &Node<R>| node.left.first.iter().all(|p| p.abs() * v <= REST_S);
        let stops =
            self.nodes.front().is_some_and(|node| node.stop || single && node.blocks > 0 && rests(node));
        if stops {
            (self.executor.x, self.executor.v) = (0.0, 0.0);
        }
        self.executor.x == 0.0
    }

    fn pass_node(&mut self) {
        self.nodes.pop_front();
        self.work.passed += 1;
        self.executor.stepped = false;
        self.grid.shift();
        let Some(front) = self.nodes.front() else { return };
        // The piece before stays: the setpoint of a stop at its end is still on it.
        while self.first_piece < front.piece && self.pieces.len() > 1 {
            self.pieces.pop_front();
            self.first_piece += 1;
        }
    }

    /// Chooses the acceleration from here to the next node. False if there is nothing to drive.
    fn plan_leg(&mut self, held: bool) -> bool {
        let rows = self.limits.rows();
        let (Some(node), Some(next)) = (self.nodes.front(), self.nodes.get(1)) else { return false };
        let (sigma, x) = (self.executor.sigma, self.executor.x);
        let length = node.length - sigma;
        let anew = if sigma > 0.0 { self.strips_at(node.piece, node.s + sigma) } else { None };
        let here = anew.as_ref().unwrap_or(&node.right);
        let panel = self.executor.panel;
        // What is being driven, if it leads to the node (a braking leg may end before).
        let running =
            self.executor.legs.first().filter(|leg| sigma > 0.0 && leg.end >= node.length).map(|leg| leg.x);
        // What is driven first comes last.
        let mut shape = None;
        let (end, x_end);
        if held {
            if x == 0.0 {
                return false;
            }
            (end, x_end) = braking(here, &next.left, rows, length, x, running);
        } else {
            let entry = self.permitted(1, next);
            // As a rule what is permitted can be reached, and nothing faster is allowed on the way.
            if sigma == 0.0
                && node.cap_until(next, panel) <= lower(x, entry)
                && allows(here, &next.left, rows, length, (x, entry), SLACK)
                && entry > 0.0
            {
                self.executor.take(Leg::to(length, entry));
                return true;
            }
            let (low, high) = exits(here, &next.left, rows, length, x);
            // From the middle of an interval the strips, taken there anew, may exclude by a hair what is being driven;
            // that stays admissible.
            let (low, high) = running.map_or((low, high), |running| (low.min(running), high.max(running)));
            (end, x_end) = (length, if low <= high { entry.clamp(low, high) } else { 0.5 * (low + high) });
            if x == 0.0 && self.nodes.len() == 2 && self.pieces.back().is_some_and(|last| last.open) {
                // At rest with one interval known and more to come.
                return false;
            }
            // A peak in between gains something only where the exit is held down by what follows, not by the strips,
            // and where the interval takes more than a quarter of a period.
            let slowest = lower(x, x_end);
            let edge = 1e-3 * (high - low);
            let free = (low <= 0.0 || x_end - low > edge) && high - x_end > edge;
            if free && !self.is_brief(length, slowest) {
                let cap = node.cap_until(next, panel);
                if cap > slowest {
                    shape = faster(here, &next.left, rows, length, x, x_end, cap);
                }
            }
            if shape.is_none() && x == 0.0 && x_end == 0.0 {
                return false;
            }
        }
        let e = &mut self.executor;
        e.planned = true;
        e.legs.clear();
        let mut add = |end: f64, x: f64| {
            // The end of the interval is the node itself, not a sum.
            let end = if end < length { sigma + end } else { node.length };
            let _ = e.legs.push(Leg::to(end, higher(0.0, x)));
        };
        match shape {
            Some((up, along, peak)) => {
                if along < length {
                    add(length, x_end);
                }
                if along > up {
                    add(along, peak);
                }
                if up > 0.0 {
                    add(up, peak);
                }
            }
            None => add(end, x_end),
        }
        true
    }

    /// The strips at a place between two nodes.
    #[inline(never)]
    fn strips_at(&self, piece: u64, s: f64) -> Option<Rows<R>> {
        let (mut sample, mut spot) = (Sample::EMPTY, Spot::NONE);
        let piece = self.piece(piece)?;
        spot.look(piece, s);
        self.limits.sample(&self.kinematics, piece, &mut spot, &mut sample).ok()?;
        Some(sample.rows)
    }

    /// The x at which node `index` may be passed under the overrides of now.
    #[inline]
    fn permitted(&self, index: usize, node: &Node<R>) -> f64 {
        let panel = self.executor.panel;
        // As a rule it was planned with these, and its cap went into that.
        if self.grid.is_planned_with(panel) {
            return node.entry;
        }
        (node.entry * self.grid.share(index, panel)).min(node.cap(panel))
    }

    /// True if `length` takes less than a quarter of a servo period at √x.
    fn is_brief(&self, length: f64, x: f64) -> bool {
        let quarter = 0.25 * self.settings.servo_period_s;
        length * length <= x * quarter * quarter
    }

    /// The x at the end of the front interval, if that is brief, entered at its start and not a start from rest: one
    /// acceleration serves it, as in [`Self::plan_leg`].
    fn brief_exit(&self, node: &Node<R>, next: &Node<R>) -> Option<f64> {
        let x = self.executor.x;
        if self.executor.sigma != 0.0 || !self.is_brief(node.length, x) {
            return None;
        }
        let (rows, length, entry) = (self.limits.rows(), node.length, self.permitted(1, next));
        let x_end = if allows(&node.right, &next.left, rows, length, (x, entry), SLACK) {
            entry
        } else {
            let (low, high) = exits(&node.right, &next.left, rows, length, x);
            if low <= high { entry.clamp(low, high) } else { 0.5 * (low + high) }
        };
        self.is_brief(node.length, x_end).then_some(x_end)
    }

    fn publish(&mut self, state: State) -> Result<(), PlanError> {
        let at_rest = self.executor.at_rest();
        self.setpoint.state = state;
        self.setpoint.starved = self.starved;
        let Some(node) = self.nodes.front() else {
            self.setpoint.joint_velocity = Default::default();
            return Ok(());
        };
        let Some(piece) = self.pieces.get(self.index_of(node.piece)) else { return Ok(()) };
        let Executor { sigma, v: speed, place, motion, .. } = &mut self.executor;
        let s = node.s + *sigma;
        piece.geometry.look(s, place);
        let first = place.first.to_array();
        let velocity = Pose::from_array(first.map(|d| d * *speed));
        self.kinematics.motion_into(&place.pose, &velocity, &Pose::ZERO, motion).map_err(|error| {
            PlanError { kind: PlanErrorKind::Unreachable(error), span: piece.span, pose: place.pose }
        })?;
        self.setpoint = Setpoint {
            pose: place.pose,
            joints: motion.position,
            joint_velocity: if at_rest { Default::default() } else { motion.velocity },
            motion: piece.motion,
            s,
            blending: piece.corner,
            feed_use: piece.feed_use(&first, *speed),
            span: piece.span,
            state,
            starved: self.starved,
        };
        Ok(())
    }
}

/// Hardest braking: (distance, x at its end). Stops inside the interval if it can.
/// `running` is the x at which the leg driven so far would end.
fn braking<const R: usize>(
    here: &Rows<R>,
    next: &Rows<R>,
    rows: usize,
    length: f64,
    x: f64,
    running: Option<f64>,
) -> (f64, f64) {
    let (low, high) = exits(here, next, rows, length, x);
    let low = running.map_or(low, |running| low.min(running));
    if low > high {
        return (length, 0.5 * (low + high));
    }
    if low > 0.0 {
        return (length, low);
    }
    let hardest = -accelerations(here, next, rows, 0.0, x).0;
    let needed = x / (2.0 * length);
    if hardest > needed { (x / (2.0 * hardest), 0.0) } else { (length, 0.0) }
}

/// The fastest way through an interval entered with `x` and left with `x_end`: up to a peak (or the cap), along it, down
/// again. Returns where the first two legs end and the peak, or `None` where one acceleration throughout is as fast.
fn faster<const R: usize>(
    here: &Rows<R>,
    next: &Rows<R>,
    rows: usize,
    length: f64,
    x: f64,
    x_end: f64,
    cap: f64,
) -> Option<(f64, f64, f64)> {
    let (bottom, top) = (x.min(x_end), x.max(x_end));
    // At half the x that bends as hard as allowed there is still room to speed up and to brake.
    let cap = cap.min(0.5 * hardest_bend(here, next, rows)).max(top);
    // What the strips allow depends on the highest x there will be, and that on what they allow. A lower guess gives
    // a higher peak and the other way round, so the third is safe: its peak does not exceed what it was computed for.
    let meet = |highest: f64| {
        let (down, up) = accelerations(here, next, rows, bottom, highest);
        let peak = (2.0 * length + x / up - x_end / down) / (1.0 / up - 1.0 / down);
        (down < 0.0 && up > 0.0).then_some((peak.min(cap), up, -down))
    };
    let (mut peak, mut up, mut down) = meet(cap)?;
    // At the cap it is what it was computed for.
    if peak < cap {
        let (second, ..) = meet(higher(peak, top))?;
        (peak, up, down) = meet(higher(second, top))?;
    }
    // Not worth a change of acceleration.
    if !(peak >= top) || !(peak - bottom > 1e-9 * peak) {
        return None;
    }
    let ramp = (peak - x) / (2.0 * up);
    let brake = (peak - x_end) / (2.0 * down);
    (ramp < length && brake < length).then(|| (ramp, (length - brake).max(ramp), peak))
}

/// The x at which holding the speed alone takes some joint to its acceleration limit.
fn hardest_bend<const R: usize>(here: &Rows<R>, next: &Rows<R>, rows: usize) -> f64 {
    let bends = here.pairs(rows).chain(next.pairs(rows)).map(|(_, q)| q);
    1.0 / highest(bends.fold([0.0; 2], |worst, q| with(worst, each(q, f64::abs), higher)))
}
