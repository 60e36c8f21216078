//! The planner's face and its queue: moves in, path pieces joined by stops, smooth seams or blends.
//!
//! The last move is kept open: its second half is released only when the next move is known (a blend may replace
//! it), or when the machine would have to brake for lack of it.

use crate::executor::Executor;
use crate::grid::{Grid, Node, SET_PER_PUSH};
use crate::limits::{Feed, Limits};
use crate::pair::lower;
use crate::path::{Blend, FeedGroup, Geometry, Tolerance, Vector, combine};
use crate::{PlanError, PlanErrorKind, walk};
use core::ops::ControlFlow;
use heapless::Deque;
use pkm_canon::Span;
use pkm_kins::{JointRange, Joints, Kinematics, Pose};

/// How a move ends where the next one begins (G61, G61.1, G64).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathMode {
    /// G61.1: at rest.
    ExactStop,
    /// G61: on the path to 1e-9 mm; at rest only where the direction jumps.
    ExactPath,
    /// G64: within a tolerance of the path.
    Blend(Tolerance),
}

/// One move in machine coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// Its shape; it must start where the previous move ended.
    pub geometry: Geometry,
    /// Speed asked for.
    pub feed: Feed,
    /// G0: the rapid override applies, not the feed override.
    pub rapid: bool,
    /// How it ends.
    pub mode: PathMode,
    /// The block.
    pub span: Span,
}

/// Settings of a planner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Servo period, s.
    pub servo_period_s: f64,
    /// Setpoints per servo period, evenly spaced: 1 in a controller, more to look between the ticks.
    pub substeps: u32,
    /// Servo periods the machine rests at every stop, for a [`crate::Smoother`] behind the planner to arrive.
    pub settle_periods: u32,
}

/// Why a move was not taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PushError {
    /// No room now: tick, then push again.
    Full,
    /// The path cannot be run; the machine will stop before this place.
    Plan(PlanError),
}

/// What the machine is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum State {
    /// At rest, and everything pushed has been driven.
    Idle,
    Moving,
    Dwell,
    /// Feed hold, at rest.
    Held,
    /// Single block, at rest at the end of a block: [`Planner::step`] goes on.
    BlockEnd,
}

/// Where the machine has to be at the end of a servo period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// mm, rad
    pub pose: Pose,
    /// mm or rad
    pub joints: Joints,
    /// mm/s or rad/s
    pub joint_velocity: Joints,
    /// Number of the move, from 0 in the order of [`Planner::push`]; a blend carries the move before it.
    pub motion: u32,
    /// Place in that move's own geometry (0 to its length).
    pub s: f64,
    /// On the blend after that move; `s` then runs along the blend.
    pub blending: bool,
    /// The feed got, as a share of the feed asked for (before overrides); 0 on rapids.
    pub feed_use: f64,
    /// The block.
    pub span: Span,
    /// Moving, held, ...
    pub state: State,
    /// The queue has run dry: the machine stops, or has stopped, at the end of what is known and not where the program
    /// would. It ends with the next push, and with [`Planner::finish`], which says that this was the end.
    pub starved: bool,
}

/// What the planner has done since it was made: its work is bounded in these.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Nodes set along the path.
    pub nodes: u64,
    /// Places at which the kinematics were asked for them.
    pub samples: u64,
    /// Nodes the look-ahead computed an entry for, again or for the first time.
    pub planned: u64,
    /// Nodes driven past.
    pub passed: u64,
    /// Stops, or all but, that were not the program's: the next move came only after the machine had begun to brake for
    /// want of it.
    pub starved: u64,
}

/// A move, or a blend between two, cut to what is really driven: s from `from` to `to`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    pub(crate) geometry: Geometry,
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) feed: Feed,
    /// A blend onto a move whose feed counts other coordinates: that feed, which holds too.
    pub(crate) onto: Option<Feed>,
    pub(crate) rapid: bool,
    /// More of it will be released later.
    pub(crate) open: bool,
    /// At rest at its end.
    pub(crate) stop: bool,
    /// A corner blend after move `motion`.
    pub(crate) corner: bool,
    pub(crate) dwell_ns: u64,
    pub(crate) mode: PathMode,
    pub(crate) motion: u32,
    pub(crate) span: Span,
}

impl Piece {
    /// Cap on x from the feed at 100 %; infinite for rapids.
    #[inline]
    pub(crate) fn feed_cap(&self, first: &Pose) -> f64 {
        let first = first.to_array();
        let cap = self.feed.cap(&first);
        self.onto.as_ref().map_or(cap, |onto| lower(cap, onto.cap(&first)))
    }

    /// The feed at ṡ = `speed`, as a share of what was asked for.
    pub(crate) fn feed_use(&self, first: &Vector, speed: f64) -> f64 {
        let share = |feed: &Feed| feed.share(first, speed);
        share(&self.feed).max(self.onto.as_ref().map_or(0.0, share))
    }
}

impl<K, const R: usize, const PIECES: usize, const NODES: usize> core::fmt::Debug
    for Planner<K, R, PIECES, NODES>
{
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Planner")
            .field("pieces", &self.pieces.len())
            .field("first_piece", &self.first_piece)
            .field("nodes", &self.nodes.len())
            .field("grid", &(self.grid.piece, self.grid.s))
            .field("front", &self.nodes.front())
            .field("next", &self.nodes.get(1))
            .field("executor", &self.executor)
            .field("fault", &self.fault)
            .finish_non_exhaustive()
    }
}

/// Plans moves on a machine with at most `R` limited joints and axes (an even number: they are worked on in pairs); `PIECES` and `NODES` bound the look-ahead.
pub struct Planner<K, const R: usize, const PIECES: usize, const NODES: usize> {
    pub(crate) kinematics: K,
    pub(crate) limits: Limits<R>,
    pub(crate) settings: Settings,
    pub(crate) pieces: Deque<Piece, PIECES>,
    /// Number of the piece at the front of `pieces`.
    pub(crate) first_piece: u64,
    pub(crate) nodes: Deque<Node<R>, NODES>,
    pub(crate) grid: Grid<R>,
    pub(crate) executor: Executor,
    /// Where the path could not be cut any further.
    pub(crate) fault: Option<PlanError>,
    /// Why a push was refused: nothing more is taken, what was taken is driven to its end.
    pub(crate) refused: Option<PlanError>,
    pub(crate) setpoint: Setpoint,
    pub(crate) work: Work,
    /// The last move was released because the machine had to brake for want of the next.
    pub(crate) starved: bool,
    moves: u32,
    end: Vector,
    /// Joints and limited axes there, once a move that ends there has been looked at.
    end_rows: Option<[f64; R]>,
}

impl<K: Kinematics, const R: usize, const PIECES: usize, const NODES: usize> Planner<K, R, PIECES, NODES> {
    /// A planner with the machine at rest at `start`.
    ///
    /// # Errors
    /// The start pose is out of reach or out of travel.
    pub fn new(kinematics: K, limits: Limits<R>, settings: Settings, start: Pose) -> Result<Self, PlanError> {
        let fail = |kind| PlanError { kind, span: Span::default(), pose: start };
        let joints = kinematics.inverse(&start).map_err(|e| fail(PlanErrorKind::Unreachable(e)))?;
        limits.check_travel(&start, &joints).map_err(fail)?;
        Ok(Self {
            kinematics,
            limits,
            settings,
            pieces: Deque::new(),
            first_piece: 0,
            nodes: Deque::new(),
            grid: Grid::new(),
            executor: Executor::new(),
            fault: None,
            refused: None,
            setpoint: Setpoint {
                pose: start,
                joints,
                joint_velocity: [0.0; pkm_kins::MAX_JOINTS],
                motion: 0,
                s: 0.0,
                blending: false,
                feed_use: 0.0,
                span: Span::default(),
                state: State::Idle,
                starved: false,
            },
            work: Work::default(),
            starved: false,
            moves: 0,
            end: start.to_array(),
            end_rows: None,
        })
    }

    /// The last setpoint.
    pub fn setpoint(&self) -> &Setpoint {
        &self.setpoint
    }

    /// What has been done so far.
    pub fn work(&self) -> Work {
        self.work
    }

    /// The kinematics.
    pub fn kinematics(&self) -> &K {
        &self.kinematics
    }

    /// Where the queue ends: the next move must start here.
    pub fn end(&self) -> &Vector {
        &self.end
    }

    /// Why the queue stopped growing, if it did; the machine stops before that place.
    pub fn fault(&self) -> Option<&PlanError> {
        self.fault.as_ref().or(self.refused.as_ref())
    }

    /// True when a move can be pushed: there is room for it and for the nodes that a push may set.
    pub fn has_room(&self) -> bool {
        self.pieces.len() + 3 <= PIECES && self.nodes.len() + SET_PER_PUSH.min(NODES / 4) <= NODES
    }

    /// Appends a move. Moves of no length are taken and dropped. Returns the move's number.
    ///
    /// # Errors
    /// [`PushError::Full`]: tick first. [`PushError::Plan`]: the move cannot be run, with the first place on it that cannot
    /// (looked at every millimetre or 0.02 rad, at most 67 times, before any of it is driven). Nothing more is taken
    /// then ([`Self::fault`]), and the machine comes to rest before that move.
    pub fn push(&mut self, next: Move) -> Result<u32, PushError> {
        if let Some(&fault) = self.fault() {
            return Err(PushError::Plan(fault));
        }
        if !self.has_room() {
            return Err(PushError::Full);
        }
        let motion = self.moves;
        self.moves = self.moves.wrapping_add(1);
        let length = next.geometry.length();
        if !(length > 0.0) {
            return Ok(motion);
        }
        if !(next.feed.speed > 0.0) {
            let pose = Pose::from_array(next.geometry.at(0.0).position);
            return Err(PushError::Plan(PlanError { kind: PlanErrorKind::NoFeed, span: next.span, pose }));
        }
        let mut found = None;
        // On a line, what is right where the last move ended is right where this one begins.
        let start = match &next.geometry {
            Geometry::Line(line) => self.end_rows.filter(|_| is_near(&line.start, &self.end)),
            _ => None,
        };
        self.end_rows = self.limits.walk(
            &self.kinematics,
            &next.geometry,
            (walk::places(&next.geometry), false),
            start,
            |pose, outcome| {
                found = outcome.err().map(|kind| PlanError { kind, span: next.span, pose: *pose });
                if found.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        if let Some(error) = found {
            self.refused = Some(error);
            return Err(PushError::Plan(error));
        }
        self.work.starved += u64::from(core::mem::take(&mut self.starved));
        let from = self.join(&next);
        self.end = next.geometry.at(length).position;
        self.append(Piece {
            geometry: next.geometry,
            from,
            to: (0.5 * length).max(from),
            feed: next.feed,
            onto: None,
            rapid: next.rapid,
            open: true,
            stop: false,
            corner: false,
            dwell_ns: 0,
            mode: next.mode,
            motion,
            span: next.span,
        });
        self.extend(SET_PER_PUSH, 0).map_err(PushError::Plan)?;
        Ok(motion)
    }

    /// Stops at the end of the queue and waits.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn push_dwell(&mut self, dwell_ns: u64, span: Span) -> Result<(), PushError> {
        if !self.has_room() {
            return Err(PushError::Full);
        }
        self.starved = false;
        self.release();
        self.append(Piece {
            geometry: Geometry::Hold(self.end),
            from: 0.0,
            to: 0.0,
            feed: Feed { speed: f64::INFINITY, group: FeedGroup::Xyz },
            onto: None,
            rapid: false,
            open: false,
            stop: true,
            corner: false,
            dwell_ns,
            mode: PathMode::ExactStop,
            motion: self.moves.wrapping_sub(1),
            span,
        });
        // With nothing before it, it must count as something to do at once.
        self.extend(SET_PER_PUSH, 0).map_err(PushError::Plan)
    }

    /// Nothing follows for now: the last move is released to its end, where the machine comes to rest. Called again while the
    /// machine drives there, it looks farther ahead each time, as a push would.
    pub fn finish(&mut self) {
        self.starved = false;
        self.release();
        // What is wrong there is kept as the fault.
        let _ = self.extend(SET_PER_PUSH, 0);
    }

    pub(crate) fn release(&mut self) {
        if let Some(last) = self.pieces.back_mut()
            && last.open
        {
            last.to = last.geometry.length();
            last.open = false;
            last.stop = true;
        }
    }

    fn append(&mut self, piece: Piece) {
        // `has_room` was checked by the caller: there is always room for both halves of a blend and a move.
        let _ = self.pieces.push_back(piece);
    }

    /// Joins the open last piece to `next`; returns where on `next` the drive along it begins.
    fn join(&mut self, next: &Move) -> f64 {
        let Some(last) = self.pieces.back_mut() else { return 0.0 };
        if !last.open {
            last.stop = true;
            return 0.0;
        }
        let length = last.geometry.length();
        last.open = false;
        last.to = length;
        let (e1, e2) = (last.geometry.tangent(length), next.geometry.tangent(0.0));
        let turn = combine(&e2, &e1, |b, a| (b - a).abs()).into_iter().fold(0.0, f64::max);
        // A seam smoother than this jumps a joint's speed by less than rounding shows.
        const SMOOTH: f64 = 1e-9;
        // G61 passes gentle seams through a blend too small to see: 5e-10 mm.
        const EXACT: Tolerance = Tolerance { length_mm: 5e-10, angle_rad: 1e-11 };
        const GENTLE: f64 = 0.02;
        let tolerance = match last.mode {
            PathMode::ExactStop => None,
            _ if turn <= SMOOTH => return 0.0,
            PathMode::ExactPath if turn <= GENTLE => Some(EXACT),
            PathMode::ExactPath => None,
            PathMode::Blend(tolerance) => Some(tolerance),
        };
        let Some((cut, blend)) = tolerance.and_then(|t| Blend::new(&last.geometry, &next.geometry, t)) else {
            last.stop = true;
            return 0.0;
        };
        last.to = length - cut;
        // Each feed holds on its own half; where they count different coordinates both hold throughout.
        let alike = last.feed.group == next.feed.group;
        let middle = if alike && last.feed != next.feed { 0.5 * blend.length } else { blend.length };
        let first = Piece {
            geometry: Geometry::Blend(blend),
            from: 0.0,
            to: middle,
            onto: (!alike).then_some(next.feed),
            rapid: last.rapid && (alike || next.rapid),
            open: false,
            stop: false,
            corner: true,
            ..*last
        };
        let second = Piece { from: middle, to: blend.length, feed: next.feed, rapid: next.rapid, ..first };
        // Between short chords nothing of the line itself is left.
        let number = self.first_piece + self.pieces.len() as u64 - 1;
        if self.grid.piece < number
            && let Some(last) = self.pieces.back()
            && last.to - last.from <= 1e-12
        {
            self.pieces.pop_back();
        }
        self.append(first);
        if second.from < second.to {
            self.append(second);
        }
        cut
    }

    pub(crate) fn piece(&self, number: u64) -> Option<&Piece> {
        self.pieces.get(self.index_of(number))
    }

    /// Where a piece stands in `pieces`, if it does. (For those who write to other fields while they hold it.)
    pub(crate) fn index_of(&self, number: u64) -> usize {
        number.wrapping_sub(self.first_piece) as usize
    }

    /// True when nothing moves.
    pub fn at_rest(&self) -> bool {
        self.executor.has_settled()
    }

    /// True when everything pushed has been driven and the machine is at rest.
    pub fn is_idle(&self) -> bool {
        if !self.executor.has_settled() || self.nodes.len() > 1 {
            return false;
        }
        let gridded = self.grid.piece + 1 >= self.first_piece + self.pieces.len() as u64;
        let at_end = self.pieces.back().is_none_or(|last| !last.open && (gridded && self.grid.s >= last.to));
        let dwelling = self.nodes.front().is_some_and(|node| node.dwell_ns > 0);
        at_end && !dwelling
    }

    /// Empties the queue; the machine must be at rest. The queue then ends where the machine is.
    pub(crate) fn clear(&mut self) {
        self.first_piece += self.pieces.len() as u64;
        self.pieces.clear();
        self.nodes.clear();
        self.grid = Grid::new();
        self.grid.piece = self.first_piece;
        self.executor.rest();
        (self.fault, self.refused) = (None, None);
        self.starved = false;
        self.end = self.setpoint.pose.to_array();
        self.end_rows = None;
    }
}

/// The same place but for rounding.
fn is_near(a: &Vector, b: &Vector) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= JointRange::TOLERANCE)
}
