//! The servo tick: the forward pass. At every node it takes the fastest exit that the strips allow and the
//! look-ahead permits, and keeps that acceleration until the next node. Feed hold, overrides and abort only change
//! what is permitted; the strips hold in every one of them, on the path.

use crate::PlanError;
use crate::interval::exits;
use crate::limits::Rows;
use crate::planner::{Planner, Setpoint, State};
use pkm_kins::{Kinematics, Pose, maths::sqrt};

/// Nodes passed in one tick at the very most (the grid holds the speed down to about 128).
const MOST_NODES: usize = 1024;

/// Where the machine is between the two nodes at the front, and what it is doing there.
#[derive(Debug, Clone)]
pub(crate) struct Executor {
    /// Distance from the front node.
    sigma: f64,
    /// ṡ² here.
    x: f64,
    /// The leg being driven at constant acceleration: it ends at `leg_end` (distance from the node) with `x_end`.
    leg_end: f64,
    x_end: f64,
    planned: bool,
    /// Number of the next setpoint within its servo period, from 0.
    substep: u32,
    /// Nothing moves until the next servo period: the machine came to a stop, or dwells.
    waits: bool,
    dwells: bool,
    hold: bool,
    abort: bool,
    feed_override: f64,
    rapid_override: f64,
}

impl Executor {
    pub(crate) fn new() -> Self {
        Self {
            sigma: 0.0,
            x: 0.0,
            leg_end: 0.0,
            x_end: 0.0,
            planned: false,
            substep: 0,
            waits: false,
            dwells: false,
            hold: false,
            abort: false,
            feed_override: 1.0,
            rapid_override: 1.0,
        }
    }

    pub(crate) fn at_rest(&self) -> bool {
        self.x == 0.0
    }

    pub(crate) fn rest(&mut self) {
        self.sigma = 0.0;
        self.x = 0.0;
        self.planned = false;
        self.abort = false;
    }

    pub(crate) fn overrides(&self) -> (f64, f64) {
        (self.feed_override, self.rapid_override)
    }
}

impl<K: Kinematics, const R: usize, const PIECES: usize, const NODES: usize> Planner<K, R, PIECES, NODES> {
    /// Feed override, 1 = 100 %, clamped to 0 to 2. NaN is refused: false, and nothing changes.
    pub fn set_feed_override(&mut self, factor: f64) -> bool {
        let rapid = self.executor.rapid_override;
        self.set_overrides(factor, rapid)
    }

    /// Rapid override, 1 = 100 %, clamped to 0 to 1. NaN is refused: false, and nothing changes.
    pub fn set_rapid_override(&mut self, factor: f64) -> bool {
        let feed = self.executor.feed_override;
        self.set_overrides(feed, factor)
    }

    fn set_overrides(&mut self, feed: f64, rapid: f64) -> bool {
        if feed.is_nan() || rapid.is_nan() {
            return false;
        }
        let (feed, rapid) = (feed.clamp(0.0, 2.0), rapid.clamp(0.0, 1.0));
        if (feed, rapid) != self.executor.overrides() {
            self.executor.feed_override = feed;
            self.executor.rapid_override = rapid;
            self.executor.planned = false;
            self.look_ahead(0);
        }
        true
    }

    /// Feed hold: brakes to rest on the path as fast as the limits allow; false resumes.
    pub fn hold(&mut self, hold: bool) {
        if self.executor.hold != hold {
            self.executor.hold = hold;
            self.executor.planned = false;
        }
    }

    /// Brakes to rest on the path, then empties the queue: the program is over, the machine stays where it is.
    pub fn abort(&mut self) {
        self.executor.abort = true;
        self.executor.planned = false;
    }

    /// One servo period (or one of its `substeps`). The result is where the machine has to be at its end.
    ///
    /// # Errors
    /// None in a machine whose path was accepted; an error of the kinematics here is a defect of the mechanism and
    /// leaves the machine at the last setpoint.
    pub fn tick(&mut self) -> Result<Setpoint, PlanError> {
        let held = self.executor.hold || self.executor.abort;
        if self.executor.substep == 0 {
            // A fault only ends the queue: what is known is still driven to its end, at rest.
            let _ = self.refill();
            self.release_if_starving();
            self.begin_period(held);
        }
        let substeps = self.settings.substeps.max(1);
        self.executor.substep = (self.executor.substep + 1) % substeps;
        if !self.executor.waits {
            self.executor.waits = self.advance(self.settings.servo_period_s / f64::from(substeps), held);
        }
        let mut state = if self.executor.dwells { State::Dwell } else { State::Moving };
        if self.executor.at_rest() {
            if self.executor.abort {
                self.clear();
                state = State::Idle;
            } else if held {
                state = State::Held;
            } else if self.is_idle() {
                state = State::Idle;
            }
        }
        self.publish(state)
    }

    /// A dwell takes whole servo periods; the last one may be cut short.
    fn begin_period(&mut self, held: bool) {
        let at_rest = self.executor.at_rest() && self.executor.sigma == 0.0;
        let period_ns = pkm_kins::maths::round(self.settings.servo_period_s * 1e9) as u64;
        let dwells = match self.nodes.front_mut() {
            Some(node) if at_rest && node.dwell_ns > 0 => {
                if !held {
                    node.dwell_ns = node.dwell_ns.saturating_sub(period_ns);
                }
                true
            }
            _ => false,
        };
        self.executor.dwells = dwells;
        self.executor.waits = dwells;
    }

    /// The open end of the last move is released when the machine would have to brake for want of it.
    fn release_if_starving(&mut self) {
        let last = self.first_piece + (self.pieces.len() as u64).saturating_sub(1);
        let all_known =
            self.grid.piece == last && self.pieces.back().is_some_and(|p| p.open && self.grid.s >= p.to);
        if all_known && self.brakes_now() {
            self.finish();
            let _ = self.refill();
        }
    }

    /// True when hardest braking from here ends less than two servo periods before the end of what is known.
    fn brakes_now(&self) -> bool {
        let rows = self.limits.rows();
        let mut x = self.executor.x;
        let margin = 2.0 * sqrt(x) * self.settings.servo_period_s;
        let mut rest = 0.0;
        let mut previous: Option<&crate::grid::Node<R>> = None;
        // The interval being driven counts as driven.
        for node in self.nodes.iter().skip(1) {
            if let Some(from) = previous {
                x = if x > 0.0 { exits(&from.right, &node.left, rows, from.length, x).0 } else { 0.0 };
                rest += if x > 0.0 { 0.0 } else { from.length };
            }
            previous = Some(node);
        }
        rest <= margin
    }

    /// Drives along the nodes for `time` seconds, or to the next stop. True at a stop: the machine rests there until the
    /// next servo period, so that the servo sees the corner itself.
    fn advance(&mut self, time: f64, held: bool) -> bool {
        let mut remaining = time;
        for _ in 0..MOST_NODES {
            let Some(node) = self.nodes.front() else { return true };
            let length = node.length;
            if self.nodes.len() < 2 {
                self.executor.x = 0.0;
                return true;
            }
            if !self.executor.planned && !self.plan_leg(held) {
                return true;
            }
            let e = &mut self.executor;
            let leg = e.leg_end - e.sigma;
            let (v, v_end) = (sqrt(e.x), sqrt(e.x_end));
            let duration = if v + v_end > 0.0 { 2.0 * leg / (v + v_end) } else { f64::INFINITY };
            if !(duration <= remaining) {
                if leg > 0.0 && duration.is_finite() {
                    let acceleration = (e.x_end - e.x) / (2.0 * leg);
                    let speed = (v + acceleration * remaining).max(0.0);
                    e.sigma = (e.sigma + 0.5 * (v + speed) * remaining).min(e.leg_end);
                    e.x = speed * speed;
                }
                return false;
            }
            remaining -= duration;
            e.x = e.x_end;
            e.planned = false;
            if e.leg_end < length {
                e.sigma = e.leg_end;
                if e.x == 0.0 && held {
                    return true;
                }
                continue;
            }
            e.sigma = 0.0;
            self.pass_node();
            if self.nodes.front().is_some_and(|node| node.stop) || self.executor.x == 0.0 {
                self.executor.x = 0.0;
                return true;
            }
        }
        false
    }

    fn pass_node(&mut self) {
        self.nodes.pop_front();
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
        let mut here = node.right;
        if sigma > 0.0
            && let Some(piece) = self.piece(node.piece)
            && let Ok(sample) =
                self.limits.sample(&self.kinematics, &piece.geometry, node.s + sigma, piece.feed, piece.span)
        {
            here = sample.rows;
        }
        let (feed, rapid) = self.executor.overrides();
        let (mut leg_end, mut x_end);
        if held {
            if x == 0.0 {
                return false;
            }
            (leg_end, x_end) = braking(&here, &next.left, rows, length, x, self.executor.x_end);
        } else {
            let (low, high) = exits(&here, &next.left, rows, length, x);
            // From the middle of an interval the strips may miss each other by what changes within it; the leg being
            // driven stays admissible.
            x_end = match low <= high {
                true => next.entry.clamp(low, high),
                false if sigma > 0.0 => self.executor.x_end,
                false => 0.5 * (low + high),
            };
            leg_end = length;
            if x == 0.0 && x_end == 0.0 && length > 0.0 {
                // From rest to rest within one interval (resumed after a hold): up to the middle, then down.
                let cap = node.cap(feed, rapid).max(next.cap(feed, rapid));
                x_end =
                    halfway(&here, &next.left, rows, length).min(if node.stop { f64::INFINITY } else { cap });
                leg_end = 0.5 * length;
                if !(x_end > 0.0)
                    || self.nodes.len() == 2 && !next.stop && self.pieces.back().is_some_and(|p| p.open)
                {
                    return false;
                }
            }
        }
        let e = &mut self.executor;
        e.leg_end = if leg_end < length { sigma + leg_end } else { sigma + length };
        e.x_end = x_end.max(0.0);
        e.planned = true;
        true
    }

    fn publish(&mut self, state: State) -> Result<Setpoint, PlanError> {
        let at_rest = self.executor.at_rest();
        self.setpoint.state = state;
        let Some(node) = self.nodes.front() else {
            self.setpoint.joint_velocity = Default::default();
            return Ok(self.setpoint);
        };
        let (piece, s) = (node.piece, node.s + self.executor.sigma);
        let Some((point, piece)) = self.pose_at(piece, s) else { return Ok(self.setpoint) };
        let speed = sqrt(self.executor.x);
        let pose = Pose::from_array(point.position);
        let velocity = Pose::from_array(point.first.map(|d| d * speed));
        let motion = self.kinematics.motion(&pose, &velocity, &Pose::ZERO);
        let motion = motion.map_err(|e| PlanError {
            kind: crate::PlanErrorKind::Unreachable(e),
            span: piece.span,
            pose,
        })?;
        self.setpoint = Setpoint {
            pose,
            joints: motion.position,
            joint_velocity: if at_rest { Default::default() } else { motion.velocity },
            motion: piece.motion,
            s,
            blending: matches!(piece.geometry, crate::path::Geometry::Blend(_)),
            span: piece.span,
            state,
        };
        Ok(self.setpoint)
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
    running: f64,
) -> (f64, f64) {
    let (low, high) = exits(here, next, rows, length, x);
    if low > high {
        return (length, running);
    }
    if low > 0.0 {
        return (length, low);
    }
    // The strips must hold from x down to rest at both ends: |d₁ a + d₂ x| ≤ 1 and |d₁ a| ≤ 1.
    let mut hardest = f64::INFINITY;
    for side in [here, next] {
        for (first, second) in side.first.iter().zip(&side.second).take(rows) {
            let (first, bend) = if *first > 0.0 { (*first, *second) } else { (-first, -second) };
            // a = −b: −first·b + bend·x ≥ −1, and the same at x = 0
            let room = (1.0 + bend * x).min(1.0);
            if first > 0.0 {
                hardest = hardest.min(room / first);
            }
        }
    }
    let needed = x / (2.0 * length);
    if hardest > needed { (x / (2.0 * hardest), 0.0) } else { (length, 0.0) }
}

/// The x reached in the middle of an interval entered and left at rest.
fn halfway<const R: usize>(here: &Rows<R>, next: &Rows<R>, rows: usize, length: f64) -> f64 {
    let mut steepest = 0.0_f64;
    for side in [here, next] {
        for (first, second) in side.first.iter().zip(&side.second).take(rows) {
            steepest = steepest.max(first.abs() + second.abs() * length);
        }
    }
    if steepest > 0.0 { length / steepest } else { 0.0 }
}
