//! The canonical commands. Lengths and angles are in *program* units (the last `UseLengthUnits`; degrees) and in
//! *program* coordinates: the consumer applies tool length, G5x and G92 offsets and rotation, as LinuxCNC's canon layer does.

use crate::Span;

/// Nine coordinates X Y Z A B C U V W in program units (mm or inch; degrees).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Position {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub u: f64,
    pub v: f64,
    pub w: f64,
}

impl Position {
    /// The coordinates in letter order.
    pub const fn to_array(self) -> [f64; 9] {
        [self.x, self.y, self.z, self.a, self.b, self.c, self.u, self.v, self.w]
    }

    /// From coordinates in letter order.
    pub const fn from_array([x, y, z, a, b, c, u, v, w]: [f64; 9]) -> Self {
        Self { x, y, z, a, b, c, u, v, w }
    }
}

/// Length unit of the program (G20, G21).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(missing_docs)]
pub enum LengthUnit {
    Inch,
    #[default]
    Mm,
}

impl LengthUnit {
    /// Millimetres in one unit.
    pub const fn mm(self) -> f64 {
        match self {
            LengthUnit::Inch => 25.4,
            LengthUnit::Mm => 1.0,
        }
    }
}

/// Working plane (G17, G18, G19 and their UVW partners).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(missing_docs)]
pub enum Plane {
    #[default]
    Xy,
    Xz,
    Yz,
    Uv,
    Uw,
    Vw,
}

/// How the path may leave the programmed one (G61, G61.1, G64).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum MotionControlMode {
    /// G61: on the path; stops only where the direction jumps.
    ExactPath,
    /// G61.1: stops at the end of every move.
    ExactStop,
    /// G64 P: blends within the tolerance, in program units; 0 = the machine's default tolerance.
    Continuous {
        /// Blend tolerance P, program units.
        tolerance: f64,
    },
    /// Not said yet.
    #[default]
    Unset,
}

/// Turning direction of a spindle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Direction {
    Clockwise,
    Counterclockwise,
}

/// One canonical machining command. Text borrows from the interpreter's line and lives until the next block.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Canon<'a> {
    /// `STRAIGHT_TRAVERSE`: rapid straight line to the end point (G0).
    StraightTraverse(Position),
    /// `STRAIGHT_FEED`: straight line at feed (G1).
    StraightFeed(Position),
    /// `ARC_FEED`: arc or helix at feed (G2, G3). First and second axis are those of the active plane
    /// (G17 X Y, G18 Z X, G19 Y Z); `end` holds all nine coordinates of the end point.
    ArcFeed {
        /// End point, all nine coordinates.
        end: Position,
        /// Centre along the plane's first axis.
        first_centre: f64,
        /// Centre along the plane's second axis.
        second_centre: f64,
        /// Turns: sign = direction (positive counter-clockwise), magnitude = full turns, rounded up.
        turns: i32,
    },
    /// `DWELL`, seconds.
    Dwell(f64),
    /// `SET_FEED_RATE`, program units per minute (or per turn).
    SetFeedRate(f64),
    /// `SET_FEED_MODE`: G94 (per minute: mode 0) or G95 (per turn: mode 1) of a spindle.
    SetFeedMode {
        /// Spindle number.
        spindle: i32,
        /// 0 or 1.
        mode: i32,
    },
    /// `USE_LENGTH_UNITS`.
    UseLengthUnits(LengthUnit),
    /// `SELECT_PLANE`.
    SelectPlane(Plane),
    /// `SET_MOTION_CONTROL_MODE`.
    SetMotionControlMode(MotionControlMode),
    /// `SET_NAIVECAM_TOLERANCE` (G64 Q), program units.
    SetNaivecamTolerance(f64),
    /// `SET_G5X_OFFSET`: coordinate system 1 to 9 and its offset.
    SetG5xOffset {
        /// 1 = G54 ... 9 = G59.3.
        system: i32,
        /// Offset, program units.
        offset: Position,
    },
    /// `SET_G92_OFFSET`.
    SetG92Offset(Position),
    /// `SET_XY_ROTATION`, degrees.
    SetXyRotation(f64),
    /// `USE_TOOL_LENGTH_OFFSET`.
    UseToolLengthOffset(Position),
    /// `SET_FEED_REFERENCE(CANON_XYZ)`.
    SetFeedReference,
    /// `SET_SPINDLE_MODE`: spindle, and the rpm limit of constant surface speed (0 = rpm mode).
    SetSpindleMode {
        /// Spindle number.
        spindle: i32,
        /// rpm limit, 0 in G97.
        css_limit: f64,
    },
    /// `SET_SPINDLE_SPEED`.
    SetSpindleSpeed {
        /// Spindle number.
        spindle: i32,
        /// rpm, or surface speed in G96.
        speed: f64,
    },
    /// `START_SPINDLE_CLOCKWISE` / `START_SPINDLE_COUNTERCLOCKWISE`.
    StartSpindle {
        /// Spindle number.
        spindle: i32,
        /// Direction.
        direction: Direction,
    },
    /// `STOP_SPINDLE_TURNING`.
    StopSpindle {
        /// Spindle number.
        spindle: i32,
    },
    /// `SELECT_TOOL`.
    SelectTool(i32),
    /// `MIST_ON` / `MIST_OFF`.
    Mist(bool),
    /// `FLOOD_ON` / `FLOOD_OFF`.
    Flood(bool),
    /// `ENABLE_FEED_OVERRIDE` / `DISABLE_FEED_OVERRIDE`.
    FeedOverride(bool),
    /// `ENABLE_SPEED_OVERRIDE` / `DISABLE_SPEED_OVERRIDE`.
    SpeedOverride {
        /// Spindle number.
        spindle: i32,
        /// On or off.
        on: bool,
    },
    /// `COMMENT`.
    Comment(&'a str),
    /// `MESSAGE`.
    Message(&'a str),
    /// `PROGRAM_STOP` (M0).
    ProgramStop,
    /// `OPTIONAL_PROGRAM_STOP` (M1).
    OptionalProgramStop,
    /// `PALLET_SHUTTLE`.
    PalletShuttle,
    /// `PROGRAM_END` (M2, M30).
    ProgramEnd,
    /// `FINISH`: the closing `%`.
    Finish,
    /// `ON_RESET`.
    OnReset,
}

/// Takes canonical commands in program order.
pub trait CanonSink {
    /// One command, with the stretch of source text that caused it and that block's `N` number, if any.
    fn command(&mut self, command: &Canon<'_>, span: Span);
}
