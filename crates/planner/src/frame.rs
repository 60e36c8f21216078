//! From the program's coordinates to the machine's: units, offsets, rotation, tool length, feed, path mode.
//!
//! machine = R(rotation) · (program + G92) + G5x + tool length, XY rotated, everything else added (RS274/NGC 3.2,
//! as LinuxCNC's canon layer applies it). Lengths become mm, angles radians.

use crate::limits::Feed;
use crate::path::{Arc, FeedGroup, Geometry, Line, Spline, Tolerance, Vector, combine, feed_group, norm3};
use crate::planner::{Move, PathMode};
use crate::synchronised::SynchronisedMove;
use pkm_canon::{Canon, Direction, MotionControlMode, Plane, Position, Probe, Span};
use pkm_kins::maths::radians;

/// A spline begins where the machine stands if it is not farther away than this.
const SAME_PLACE_MM: f64 = 1e-9;

/// What a canonical command asks of the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// A move.
    Move(Move),
    /// A move in step with the spindle; with others directly before and after it a chain.
    Synchronised(SynchronisedMove),
    /// Into a hole and out again in step with the spindle.
    RigidTap {
        /// The way in.
        step: SynchronisedMove,
        /// Speed of the spindle on the way out over that on the way in, at least 1.
        retract_scale: f64,
    },
    /// A move until the probe answers; what follows waits for it.
    Probe(Move, Probe),
    /// The spindle is to turn otherwise; motion does not stop for it.
    Spindle(SpindleOrder),
    /// The spindle is to stop at an angle; what follows waits for it.
    Orient {
        /// Degrees.
        angle_deg: f64,
        /// 0 = the shortest way, 1 clockwise, −1 counter-clockwise.
        direction: i8,
    },
    /// Stop and wait.
    Dwell {
        /// Nanoseconds.
        ns: u64,
    },
    /// Stop and let the operator or the end of the program have its turn.
    Stop,
    /// An M code of the machine's own: stop, then the machine does what its file says (see [`Frame::set_position`]).
    MachineCode(i32),
    /// A motion this planner cannot make: the program must not run.
    Unsupported(&'static str),
}

/// How the spindle is to turn (M3, M4, M5, S).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpindleOrder {
    /// At all.
    pub on: bool,
    /// rpm; negative = counter-clockwise.
    pub speed_rpm: f64,
}

/// The state between program and machine coordinates.
#[derive(Debug, Clone)]
pub struct Frame {
    unit_mm: f64,
    plane: Plane,
    g5x: Vector,
    g92: Vector,
    tool: Vector,
    /// cos, sin of the XY rotation.
    rotation: (f64, f64),
    /// Program units per minute, or per turn.
    feed_rate: f64,
    per_turn: bool,
    spindle: SpindleOrder,
    /// S, and the direction of M3 or M4, of spindle 0.
    spindle_speed: f64,
    spindle_turns: Option<Direction>,
    /// G96: S is a surface speed.
    surface_speed: bool,
    /// Between START_ and STOP_SPEED_FEED_SYNCH: travel per turn, program units; or why that cannot be.
    in_step: Option<Result<f64, &'static str>>,
    mode: PathMode,
    /// G64 Q, mm.
    merge_mm: f64,
    default_tolerance: Tolerance,
    /// Machine coordinates, mm and rad.
    position: Vector,
}

impl Frame {
    /// A frame with no offsets, at a machine position (mm, rad). `default_tolerance` serves G64 without P; the
    /// tolerance of angles is always the one given here.
    pub fn new(position: Vector, default_tolerance: Tolerance) -> Self {
        Self {
            unit_mm: 1.0,
            plane: Plane::Xy,
            g5x: [0.0; 9],
            g92: [0.0; 9],
            tool: [0.0; 9],
            rotation: (1.0, 0.0),
            feed_rate: 0.0,
            per_turn: false,
            spindle: SpindleOrder::default(),
            spindle_speed: 0.0,
            spindle_turns: None,
            surface_speed: false,
            in_step: None,
            mode: PathMode::Blend(default_tolerance),
            merge_mm: 0.0,
            default_tolerance,
            position,
        }
    }

    /// Length of the program's unit now, mm: 1 or, after G20, 25.4.
    pub fn unit_mm(&self) -> f64 {
        self.unit_mm
    }

    /// Where the program's moves end so far, machine coordinates.
    pub fn position(&self) -> &Vector {
        &self.position
    }

    /// The machine stands elsewhere than the program took it: machine coordinates, mm and rad.
    pub fn set_position(&mut self, position: Vector) {
        self.position = position;
    }

    /// Within what chords may be joined to one line: G64 Q, mm; 0 in the exact modes.
    pub fn merge_tolerance_mm(&self) -> f64 {
        if matches!(self.mode, PathMode::Blend(_)) { self.merge_mm } else { 0.0 }
    }

    /// Takes one command and calls `emit` with what it asks of the machine; state changes ask nothing.
    pub fn apply(&mut self, command: &Canon<'_>, span: Span, mut emit: impl FnMut(Event)) {
        match *command {
            Canon::StraightTraverse(to) => self.line(to, true, span, emit),
            Canon::StraightFeed(to) => match self.in_step {
                Some(Ok(per_turn)) => {
                    self.in_step(to, per_turn, span, |step| emit(Event::Synchronised(step)))
                }
                Some(Err(why)) => emit(Event::Unsupported(why)),
                None => self.line(to, false, span, emit),
            },
            Canon::ArcFeed { end, first_centre, second_centre, turns } => {
                self.arc(end, [first_centre, second_centre], turns, span, emit);
            }
            Canon::NurbsFeed { plane, points, knots, order } => {
                self.spline(plane, Spline::new(points, knots, order, self.unit_mm), span, emit);
            }
            Canon::StraightProbe { end, probe } => self.line(end, false, span, |event| {
                emit(if let Event::Move(step) = event { Event::Probe(step, probe) } else { event });
            }),
            Canon::RigidTap { end, retract_scale } => match self.in_step {
                Some(Ok(per_turn)) => {
                    let start = self.position;
                    self.in_step(end, per_turn, span, |step| emit(Event::RigidTap { step, retract_scale }));
                    self.position = start;
                }
                Some(Err(why)) => emit(Event::Unsupported(why)),
                None => emit(Event::Unsupported("a rigid tap without a pitch")),
            },
            Canon::StartSpeedFeedSync { spindle, feed_per_turn, velocity_mode } => {
                self.in_step = Some(match (spindle, velocity_mode, self.surface_speed) {
                    (0, 0, false) => Ok(feed_per_turn),
                    (0, 0, true) => Err("motion in step with a spindle at constant surface speed (G96)"),
                    (0, ..) => Err("motion at a feed per turn of the spindle's actual speed"),
                    _ => Err("motion in step with another spindle than the first ($)"),
                });
            }
            Canon::StopSpeedFeedSync => self.in_step = None,
            Canon::Dwell(seconds) => {
                let ns = seconds.clamp(0.0, 1e9) * 1e9;
                emit(Event::Dwell { ns: pkm_kins::maths::round(ns) as u64 });
            }
            Canon::ProgramStop | Canon::ProgramEnd | Canon::Finish => emit(Event::Stop),
            Canon::MachineCode(number) => emit(Event::MachineCode(number)),
            Canon::SetFeedRate(rate) => self.feed_rate = rate,
            Canon::SetFeedMode { mode, .. } => self.per_turn = mode == 1,
            Canon::SetSpindleSpeed { spindle: 0, speed } => {
                self.spindle_speed = speed;
                self.order_spindle(emit);
            }
            Canon::SetSpindleMode { spindle: 0, css_limit } => self.surface_speed = css_limit != 0.0,
            Canon::StartSpindle { spindle: 0, direction } => {
                self.spindle_turns = Some(direction);
                self.order_spindle(emit);
            }
            Canon::StopSpindle { spindle: 0 } => {
                self.spindle_turns = None;
                self.order_spindle(emit);
            }
            Canon::OrientSpindle { spindle: 0, angle, mode } => {
                self.spindle_turns = None;
                self.order_spindle(&mut emit);
                let direction = match mode {
                    1 => 1,
                    0 => 0,
                    _ => -1,
                };
                emit(Event::Orient { angle_deg: angle, direction });
            }
            Canon::UseLengthUnits(unit) => self.unit_mm = unit.mm(),
            Canon::SelectPlane(plane) => self.plane = plane,
            Canon::SetG5xOffset { offset, .. } => self.g5x = self.scaled(offset),
            Canon::SetG92Offset(offset) => self.g92 = self.scaled(offset),
            Canon::UseToolLengthOffset(offset) => self.tool = self.scaled(offset),
            Canon::SetXyRotation(degrees) => self.rotation = pkm_kins::maths::cos_sin_deg(degrees),
            Canon::SetNaivecamTolerance(q) => self.merge_mm = (q * self.unit_mm).max(0.0),
            Canon::SetMotionControlMode(mode) => {
                let p = self.default_tolerance;
                self.mode = match mode {
                    MotionControlMode::ExactStop => PathMode::ExactStop,
                    MotionControlMode::ExactPath => PathMode::ExactPath,
                    MotionControlMode::Continuous { tolerance } if tolerance > 0.0 => {
                        PathMode::Blend(Tolerance { length_mm: tolerance * self.unit_mm, ..p })
                    }
                    _ => PathMode::Blend(p),
                };
            }
            // Other spindles, coolant, tool, messages: nothing moves, and nothing stops for them.
            _ => {}
        }
    }

    /// mm and rad, still in program coordinates.
    fn scaled(&self, p: Position) -> Vector {
        let mut v = p.to_array();
        for (i, value) in v.iter_mut().enumerate() {
            *value = if (3..6).contains(&i) { radians(*value) } else { *value * self.unit_mm };
        }
        v
    }

    fn rotate(&self, v: [f64; 3]) -> [f64; 3] {
        let (c, s) = self.rotation;
        if s == 0.0 && c == 1.0 { v } else { [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]] }
    }

    /// Program coordinates (mm, rad) to machine coordinates.
    fn machine(&self, program: Vector) -> Vector {
        let mut v = combine(&program, &self.g92, |p, g| p + g);
        let [x, y, z] = self.rotate([v[0], v[1], v[2]]);
        (v[0], v[1], v[2]) = (x, y, z);
        combine(&combine(&v, &self.g5x, |p, g| p + g), &self.tool, |p, t| p + t)
    }

    fn feed(&self, group: FeedGroup) -> Feed {
        // G95: of the commanded speed; under G96, which commands none here, of the last one.
        let rpm = if self.surface_speed { self.spindle.speed_rpm } else { self.spindle_speed };
        let per_second = if self.per_turn { rpm.abs() / 60.0 } else { 1.0 / 60.0 };
        let unit = match group {
            FeedGroup::Abc => radians(1.0),
            _ => self.unit_mm,
        };
        Feed { speed: self.feed_rate * unit * per_second, group }
    }

    fn line(&mut self, to: Position, rapid: bool, span: Span, mut emit: impl FnMut(Event)) {
        let end = self.machine(self.scaled(to));
        let start = self.position;
        self.position = end;
        let Some(line) = Line::new(start, end) else { return };
        let group = feed_group(&combine(&end, &start, |b, a| b - a));
        let feed = if rapid { Feed { speed: f64::INFINITY, group } } else { self.feed(group) };
        emit(Event::Move(Move { geometry: Geometry::Line(line), feed, rapid, mode: self.mode, span }));
    }

    /// A move in step with the spindle.
    fn in_step(&mut self, to: Position, per_turn: f64, span: Span, mut emit: impl FnMut(SynchronisedMove)) {
        let mode = self.mode;
        let turns_s = self.spindle.speed_rpm.abs() / 60.0;
        let unit_mm = self.unit_mm;
        self.line(to, false, span, |event| {
            let Event::Move(Move { geometry, feed, .. }) = event else { return };
            let unit = if feed.group == FeedGroup::Abc { radians(1.0) } else { unit_mm };
            let per_turn = per_turn * unit;
            emit(SynchronisedMove { geometry, per_turn, mode, turns_s, motion: 0, span });
        });
    }

    /// Tells of the spindle if it is to turn otherwise. At constant surface speed (G96) it keeps the speed it has.
    fn order_spindle(&mut self, mut emit: impl FnMut(Event)) {
        let rpm = if self.surface_speed { self.spindle.speed_rpm.abs() } else { self.spindle_speed };
        let order = match self.spindle_turns {
            Some(Direction::Clockwise) => SpindleOrder { on: true, speed_rpm: rpm },
            Some(Direction::Counterclockwise) => SpindleOrder { on: true, speed_rpm: -rpm },
            None => SpindleOrder::default(),
        };
        if order != self.spindle {
            self.spindle = order;
            emit(Event::Spindle(order));
        }
    }

    /// The machine's XYZ indices of the plane's first and second axis and of its normal.
    fn plane_axes(plane: Plane) -> [usize; 3] {
        match plane {
            Plane::Xy | Plane::Uv => [0, 1, 2],
            Plane::Xz | Plane::Uw => [2, 0, 1],
            Plane::Yz | Plane::Vw => [1, 2, 0],
        }
    }

    fn arc(&mut self, end: Position, centre: [f64; 2], turns: i32, span: Span, mut emit: impl FnMut(Event)) {
        let program_end = self.scaled(end);
        let [first, second, normal] = Self::plane_axes(self.plane);
        // The centre lies in the plane of the end point; only its axis matters.
        let mut at_centre = program_end;
        at_centre[first] = centre[0] * self.unit_mm;
        at_centre[second] = centre[1] * self.unit_mm;
        let mut axis = [0.0; 3];
        axis[normal] = 1.0;
        let centre = self.machine(at_centre);
        let axis = self.rotate(axis);
        let end = self.machine(program_end);
        let start = self.position;
        self.position = end;
        let feed = self.feed(FeedGroup::Xyz);
        let geometry = match Arc::new(start, end, [centre[0], centre[1], centre[2]], axis, turns) {
            Some(arc) => Geometry::Arc(arc),
            None => match Line::new(start, end) {
                Some(line) => Geometry::Line(line),
                None => return,
            },
        };
        emit(Event::Move(Move { geometry, feed, rapid: false, mode: self.mode, span }));
    }

    /// A spline leaves the coordinates outside its plane as they are. Where it begins elsewhere the way there is straight.
    fn spline(&mut self, plane: Plane, spline: Option<Spline<'_>>, span: Span, mut emit: impl FnMut(Event)) {
        let Some(spline) = spline else {
            emit(Event::Unsupported("a spline of this order (2 to 12), number of points, weights or knots"));
            return;
        };
        let [first, second, _] = Self::plane_axes(plane);
        let here = self.position;
        let lift = |[a, b]: [f64; 2], direction: bool| {
            let mut p = [0.0; 3];
            (p[first], p[second]) = (a, b);
            let mut v = if direction { [0.0; 9] } else { here };
            let turned = self.rotate(p);
            if direction {
                (v[0], v[1], v[2]) = (turned[0], turned[1], turned[2]);
                return v;
            }
            // Places in the plane, with the offsets; along the normal the tool stays.
            let mut moved = [0.0; 9];
            (moved[first], moved[second]) = (a, b);
            let moved = self.machine(moved);
            let normal = self.rotate({
                let mut n = [0.0; 3];
                n[3 - first - second] = 1.0;
                n
            });
            let height: f64 = (0..3).map(|i| normal[i] * (here[i] - moved[i])).sum();
            for (i, n) in normal.iter().enumerate() {
                v[i] = moved[i] + n * height;
            }
            v
        };
        let (feed, mode) = (self.feed(FeedGroup::Xyz), self.mode);
        let begin = lift(spline.begin(), false);
        if norm3(&combine(&begin, &here, |b, h| b - h), 0) > SAME_PLACE_MM
            && let Some(line) = Line::new(here, begin)
        {
            emit(Event::Move(Move { geometry: Geometry::Line(line), feed, rapid: false, mode, span }));
        }
        let mut end = here;
        spline.cubics(lift, |cubic| {
            end = Geometry::Blend(cubic).at(cubic.length).position;
            emit(Event::Move(Move { geometry: Geometry::Blend(cubic), feed, rapid: false, mode, span }));
        });
        self.position = end;
    }
}
