//! The canonical commands. Lengths and angles are in *program* units (the last `UseLengthUnits`; degrees) and in
//! *program* coordinates: the consumer applies tool length, G5x and G92 offsets and rotation, as LinuxCNC's canon layer does.

use crate::{Span, Text};

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

/// What a probing move waits for (G38.2 to G38.5).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Probe {
    /// Moves away from contact (G38.4, G38.5) instead of towards it.
    pub away: bool,
    /// No trip at the end of the move is an error (G38.2, G38.4).
    pub must_trip: bool,
}

/// One control point of a spline in its plane, program units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs)]
pub struct ControlPoint {
    /// Along the plane's first axis (G17 X, G18 Z, G19 Y).
    pub first: f64,
    /// Along the plane's second axis (G17 Y, G18 X, G19 Z).
    pub second: f64,
    /// Weight, greater than 0.
    pub weight: f64,
}

/// One row of the tool table, in machine units and degrees.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tool {
    /// Tool number, T.
    pub number: i32,
    /// Pocket, P.
    pub pocket: i32,
    /// Length offsets X to W.
    pub offset: Position,
    /// Diameter, D.
    pub diameter: f64,
    /// Lathe front angle, I.
    pub front_angle: f64,
    /// Lathe back angle, J.
    pub back_angle: f64,
    /// Lathe orientation, Q: 0 to 9.
    pub orientation: i32,
}

/// What M66 waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum InputWait {
    Immediate,
    Rise,
    Fall,
    High,
    Low,
}

/// Numbers a machine file may give to M codes of its own ([`Canon::MachineCode`]): above all that the language uses but
/// the user's M100 to M199, which a machine may take over.
pub const MACHINE_CODES: core::ops::RangeInclusive<i32> = 100..=999;

/// The most such codes a machine may have.
pub const MOST_MACHINE_CODES: usize = 8;

/// One canonical machining command. Text and points borrow from the interpreter and live until the next block.
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
    /// `NURBS_FEED`: a spline at feed (G5, G5.1, G5.2; G6, G6.1, G6.2), first straight from the present position to its first
    /// point where that is another one (G6.2).
    NurbsFeed {
        /// The plane of the points.
        plane: Plane,
        /// Control points, the start point included.
        points: &'a [ControlPoint],
        /// Knots of G6.2, not falling, the first and the last `order` of them equal: as many as points and order together.
        /// Empty: the same with steps of 1 between.
        knots: &'a [f64],
        /// Order of the spline: degree + 1.
        order: u32,
    },
    /// `STRAIGHT_PROBE`: straight line at feed until the probe answers (G38.2 to G38.5).
    StraightProbe {
        /// End point if nothing is met.
        end: Position,
        /// Direction and strictness.
        probe: Probe,
    },
    /// `RIGID_TAP`: to the end point and back, in step with the spindle (G33.1).
    RigidTap {
        /// Bottom of the hole.
        end: Position,
        /// Speed factor of the way back, at least 1.
        retract_scale: f64,
    },
    /// `TURN_PROBE_ON` / `TURN_PROBE_OFF`.
    TurnProbe(bool),
    /// `START_SPEED_FEED_SYNC`: the following feed moves keep step with the spindle.
    StartSpeedFeedSync {
        /// Spindle number.
        spindle: i32,
        /// Travel per turn, program units.
        feed_per_turn: f64,
        /// 1 = velocity mode, 0 = position mode.
        velocity_mode: i32,
    },
    /// `STOP_SPEED_FEED_SYNCH`.
    StopSpeedFeedSync,
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
    /// `SET_PLANNER_MODE` (G64 R, LinuxCNC 2.10): 0 trapezoidal, 1 S-curve with that corner aggressiveness.
    SetPlannerMode {
        /// 0 or 1.
        kind: i32,
        /// 0.1 to 1.
        peak_scale: f64,
    },
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
        /// rpm limit, 0 in G97, 1e30 = none.
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
    /// `ORIENT_SPINDLE` (M19).
    OrientSpindle {
        /// Spindle number.
        spindle: i32,
        /// Angle, degrees.
        angle: f64,
        /// 0 shortest way, 1 clockwise, 2 counter-clockwise (in G87: 2 and 3).
        mode: i32,
    },
    /// `SPINDLE.n.WAIT_ORIENT_COMPLETE` (M19 Q).
    WaitOrientComplete {
        /// Spindle number.
        spindle: i32,
        /// Longest wait, seconds.
        timeout: f64,
    },
    /// `SELECT_TOOL` (T): tool number, 0 = none.
    SelectTool(i32),
    /// `START_CHANGE` (M6, LinuxCNC 2.9).
    StartChange,
    /// `CHANGE_TOOL` (M6): the selected tool goes into the spindle.
    ChangeTool {
        /// Row of the tool table, from 1; 0 = none.
        slot: i32,
        /// Tool number.
        tool: i32,
    },
    /// `CHANGE_TOOL_NUMBER` (M61): that tool is in the spindle already.
    ChangeToolNumber {
        /// Row of the tool table, from 1; 0 = none.
        slot: i32,
        /// Tool number.
        tool: i32,
    },
    /// `RELOAD_TOOLDATA` (G10 L0).
    ReloadTooldata,
    /// `SET_TOOL_TABLE_ENTRY` (G10 L1, L10, L11).
    SetToolTableEntry {
        /// Row of the tool table, from 1; 0 = the spindle.
        slot: i32,
        /// The new row.
        tool: &'a Tool,
    },
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
    /// `ENABLE_ADAPTIVE_FEED` / `DISABLE_ADAPTIVE_FEED` (M52).
    AdaptiveFeed(bool),
    /// `ENABLE_FEED_HOLD` / `DISABLE_FEED_HOLD` (M53).
    FeedHold(bool),
    /// `SET_MOTION_OUTPUT_BIT` / `CLEAR_MOTION_OUTPUT_BIT` (M62, M63): with the next motion.
    MotionOutputBit {
        /// Output number.
        index: i32,
        /// On or off.
        on: bool,
    },
    /// `SET_AUX_OUTPUT_BIT` / `CLEAR_AUX_OUTPUT_BIT` (M64, M65): at once.
    AuxOutputBit {
        /// Output number.
        index: i32,
        /// On or off.
        on: bool,
    },
    /// `SET_MOTION_OUTPUT_VALUE` (M67): with the next motion.
    MotionOutputValue {
        /// Output number.
        index: i32,
        /// Value.
        value: f64,
    },
    /// `SET_AUX_OUTPUT_VALUE` (M68): at once.
    AuxOutputValue {
        /// Output number.
        index: i32,
        /// Value.
        value: f64,
    },
    /// `WAIT` for an input (M66); not printed by `rs274`.
    WaitInput {
        /// Input number.
        index: i32,
        /// Analog (E) instead of digital (P).
        analog: bool,
        /// What to wait for.
        wait: InputWait,
        /// Longest wait, seconds.
        timeout: f64,
    },
    /// `USER_M`: M100 to M199 with P and Q.
    UserM {
        /// 100 to 199.
        number: i32,
        /// P word, or -1.
        p: f64,
        /// Q word, or -1.
        q: f64,
    },
    /// An M code of the machine's own, of [`MACHINE_CODES`] (pkm's; LinuxCNC remaps such codes): stop, let the machine do
    /// what its file says, go on from where it then stands.
    MachineCode(i32),
    /// `COMMENT`.
    Comment(Text<'a>),
    /// `MESSAGE`.
    Message(Text<'a>),
    /// A `(print,...)` comment: one line for standard output.
    Print(Text<'a>),
    /// `LOG`.
    Log(Text<'a>),
    /// `LOGOPEN`.
    LogOpen(Text<'a>),
    /// `LOGAPPEND`.
    LogAppend(Text<'a>),
    /// `LOGCLOSE`.
    LogClose,
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
    /// One command, with the stretch of source text that caused it.
    fn command(&mut self, command: &Canon<'_>, span: Span);

    /// A source line was read, before it is interpreted. `text` has no line end; `span` covers it.
    /// Only sinks that show source text (the N column of the text format) need it.
    fn line_read(&mut self, text: &[u8], span: Span) {
        let _ = (text, span);
    }
}

impl<S: CanonSink + ?Sized> CanonSink for &mut S {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        (**self).command(command, span);
    }

    fn line_read(&mut self, text: &[u8], span: Span) {
        (**self).line_read(text, span);
    }
}
