//! From the program's coordinates to the machine's: units, offsets, rotation, tool length, feed, path mode.
//!
//! machine = R(rotation) · (program + G92) + G5x + tool length, XY rotated, everything else added (RS274/NGC 3.2,
//! as LinuxCNC's canon layer applies it). Lengths become mm, angles radians.

use crate::limits::Feed;
use crate::path::{Arc, FeedGroup, Geometry, Line, Tolerance, Vector, combine, feed_group};
use crate::planner::{Move, PathMode};
use pkm_canon::{Canon, LengthUnit, MotionControlMode, Plane, Position, Span};
use pkm_kins::maths::radians;

/// What a canonical command asks of the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// Nothing moves and nothing stops: a state change.
    None,
    /// A move.
    Move(Move),
    /// Stop and wait.
    Dwell {
        /// Nanoseconds.
        ns: u64,
    },
    /// Stop and let the operator or the end of the program have its turn.
    Stop,
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
    spindle_rpm: f64,
    mode: PathMode,
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
            spindle_rpm: 0.0,
            mode: PathMode::Blend(default_tolerance),
            default_tolerance,
            position,
        }
    }

    /// Where the program's moves end so far, machine coordinates.
    pub fn position(&self) -> &Vector {
        &self.position
    }

    /// Takes one command.
    pub fn apply(&mut self, command: &Canon<'_>, span: Span) -> Event {
        match *command {
            Canon::StraightTraverse(to) => self.line(to, true, span),
            Canon::StraightFeed(to) => self.line(to, false, span),
            Canon::ArcFeed { end, first_centre, second_centre, turns } => {
                self.arc(end, first_centre, second_centre, turns, span)
            }
            Canon::Dwell(seconds) => {
                let ns = seconds.clamp(0.0, 1e9) * 1e9;
                Event::Dwell { ns: pkm_kins::maths::round(ns) as u64 }
            }
            Canon::ProgramStop | Canon::ProgramEnd | Canon::Finish => Event::Stop,
            Canon::SetFeedRate(rate) => self.set(|f| f.feed_rate = rate),
            Canon::SetFeedMode { mode, .. } => self.set(|f| f.per_turn = mode == 1),
            Canon::SetSpindleSpeed { speed, .. } => self.set(|f| f.spindle_rpm = speed.abs()),
            Canon::UseLengthUnits(unit) => self.set(|f| f.unit_mm = LengthUnit::mm(unit)),
            Canon::SelectPlane(plane) => self.set(|f| f.plane = plane),
            Canon::SetG5xOffset { offset, .. } => {
                let offset = self.scaled(offset);
                self.set(|f| f.g5x = offset)
            }
            Canon::SetG92Offset(offset) => {
                let offset = self.scaled(offset);
                self.set(|f| f.g92 = offset)
            }
            Canon::UseToolLengthOffset(offset) => {
                let offset = self.scaled(offset);
                self.set(|f| f.tool = offset)
            }
            Canon::SetXyRotation(degrees) => {
                let (c, s) = pkm_kins::maths::cos_sin_deg(degrees);
                self.set(|f| f.rotation = (c, s))
            }
            Canon::SetMotionControlMode(mode) => {
                let p = self.default_tolerance;
                let mode = match mode {
                    MotionControlMode::ExactStop => PathMode::ExactStop,
                    MotionControlMode::ExactPath => PathMode::ExactPath,
                    MotionControlMode::Continuous { tolerance } if tolerance > 0.0 => {
                        PathMode::Blend(Tolerance { length_mm: tolerance * self.unit_mm, ..p })
                    }
                    _ => PathMode::Blend(p),
                };
                self.set(|f| f.mode = mode)
            }
            _ => Event::None,
        }
    }

    fn set(&mut self, change: impl FnOnce(&mut Self)) -> Event {
        change(self);
        Event::None
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
        let per_second = if self.per_turn { self.spindle_rpm / 60.0 } else { 1.0 / 60.0 };
        let unit = match group {
            FeedGroup::Abc => radians(1.0),
            _ => self.unit_mm,
        };
        Feed { speed: self.feed_rate * unit * per_second, group }
    }

    fn line(&mut self, to: Position, rapid: bool, span: Span) -> Event {
        let end = self.machine(self.scaled(to));
        let start = self.position;
        self.position = end;
        let Some(line) = Line::new(start, end) else { return Event::None };
        let group = feed_group(&combine(&end, &start, |b, a| b - a));
        let feed = if rapid { Feed { speed: f64::INFINITY, group } } else { self.feed(group) };
        Event::Move(Move { geometry: Geometry::Line(line), feed, rapid, mode: self.mode, span })
    }

    fn arc(&mut self, end: Position, first: f64, second: f64, turns: i32, span: Span) -> Event {
        let program_end = self.scaled(end);
        let (first, second) = (first * self.unit_mm, second * self.unit_mm);
        // The centre lies in the plane of the end point; only its axis matters.
        let mut centre = program_end;
        let normal = match self.plane {
            Plane::Xy | Plane::Uv => {
                (centre[0], centre[1]) = (first, second);
                [0.0, 0.0, 1.0]
            }
            Plane::Xz | Plane::Uw => {
                (centre[2], centre[0]) = (first, second);
                [0.0, 1.0, 0.0]
            }
            Plane::Yz | Plane::Vw => {
                (centre[1], centre[2]) = (first, second);
                [1.0, 0.0, 0.0]
            }
        };
        let centre = self.machine(centre);
        let normal = self.rotate(normal);
        let end = self.machine(program_end);
        let start = self.position;
        self.position = end;
        let feed = self.feed(FeedGroup::Xyz);
        let geometry = match Arc::new(start, end, [centre[0], centre[1], centre[2]], normal, turns) {
            Some(arc) => Geometry::Arc(arc),
            None => match Line::new(start, end) {
                Some(line) => Geometry::Line(line),
                None => return Event::None,
            },
        };
        Event::Move(Move { geometry, feed, rapid: false, mode: self.mode, span })
    }
}
