//! The canonical commands as text, exactly as LinuxCNC's `rs274 -g` prints them.

use crate::buffer::Buffer;
use crate::{Canon, CanonSink, Direction, LengthUnit, MotionControlMode, Plane, Position, Span, Tool};

/// Which LinuxCNC's spelling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spelling {
    /// LinuxCNC 2.9 (Debian's `rs274`).
    #[default]
    V2_9,
    /// LinuxCNC 2.10.
    V2_10,
}

/// Where finished lines go. Bytes, because a comment may hold any byte.
pub trait LineOutput {
    /// One line with its line end.
    fn line(&mut self, bytes: &[u8]);
}

#[cfg(feature = "alloc")]
impl LineOutput for alloc::vec::Vec<u8> {
    fn line(&mut self, bytes: &[u8]) {
        self.extend_from_slice(bytes);
    }
}

impl<F: FnMut(&[u8])> LineOutput for F {
    fn line(&mut self, bytes: &[u8]) {
        self(bytes);
    }
}

/// Writes canonical commands in LinuxCNC's text format: sequence number, N column, command.
pub struct TextWriter<O> {
    output: O,
    spelling: Spelling,
    sequence: u64,
    line: Buffer,
    n_column: Buffer<300>,
    plane: Plane,
}

impl<O: LineOutput> TextWriter<O> {
    /// A writer that numbers its lines from 1.
    pub fn new(output: O, spelling: Spelling) -> Self {
        let mut n_column = Buffer::new();
        n_column.put(NO_NUMBER);
        Self { output, spelling, sequence: 0, line: Buffer::new(), n_column, plane: Plane::Xy }
    }

    /// The output back.
    pub fn into_output(self) -> O {
        self.output
    }

    /// The output, to flush or to look at.
    pub fn output_mut(&mut self) -> &mut O {
        &mut self.output
    }

    fn emit(&mut self, command: &Canon<'_>) {
        self.line.clear();
        if let Canon::Print(text) = command {
            self.line.put(text.0);
            self.line.put(b"\n");
            self.output.line(self.line.as_bytes());
            return;
        }
        self.sequence += 1;
        self.line.padded(self.sequence, 5);
        self.line.put(b" ");
        self.line.put(self.n_column.as_bytes());
        write_command(&mut self.line, command, self.spelling, self.plane);
        self.line.put(b"\n");
        self.output.line(self.line.as_bytes());
    }
}

impl<O: LineOutput> CanonSink for TextWriter<O> {
    fn command(&mut self, command: &Canon<'_>, _span: Span) {
        match command {
            Canon::SelectPlane(plane) => self.plane = *plane,
            // Not printed by rs274 (it answers at once, or has none installed).
            Canon::WaitInput { .. } | Canon::UserM { .. } => return,
            _ => {}
        }
        self.emit(command);
    }

    /// The N column shows the latest line read: `N` and its digits, or dots.
    fn line_read(&mut self, text: &[u8], _span: Span) {
        let start = text.iter().position(|b| !matches!(b, b' ' | b'\t' | b'/')).unwrap_or(text.len());
        let text = &text[start..];
        self.n_column.clear();
        match text {
            [b'N' | b'n', rest @ ..] => {
                let digits = rest.iter().take_while(|b| b.is_ascii_digit()).count();
                self.n_column.put(b"N");
                self.n_column.put(&rest[..digits]);
                for _ in digits..6 {
                    self.n_column.put(b" ");
                }
            }
            _ => self.n_column.put(NO_NUMBER),
        }
    }
}

const NO_NUMBER: &[u8] = b"N..... ";

impl Buffer {
    /// Numbers with four decimals and a separator between them.
    fn numbers(&mut self, values: &[f64], separator: &[u8]) {
        for (i, value) in values.iter().enumerate() {
            if i > 0 {
                self.put(separator);
            }
            self.number::<4>(*value);
        }
    }

    fn call(&mut self, name: &str, values: &[f64]) {
        self.put(name.as_bytes());
        self.put(b"(");
        self.numbers(values, b", ");
        self.put(b")");
    }

    fn call_indexed(&mut self, name: &str, index: i32, values: &[f64]) {
        self.put(name.as_bytes());
        self.put(b"(");
        self.integer(index.into());
        for value in values {
            self.put(b", ");
            self.number::<4>(*value);
        }
        self.put(b")");
    }

    fn call_text(&mut self, name: &str, text: &[u8]) {
        self.put(name.as_bytes());
        self.put(b"(\"");
        self.put(text);
        self.put(b"\")");
    }
}

/// X Y Z A B C: what the format prints of a position.
fn six(p: &Position) -> [f64; 6] {
    [p.x, p.y, p.z, p.a, p.b, p.c]
}

fn write_command(out: &mut Buffer, command: &Canon<'_>, spelling: Spelling, plane: Plane) {
    match *command {
        Canon::StraightTraverse(end) => out.call("STRAIGHT_TRAVERSE", &six(&end)),
        Canon::StraightFeed(end) => out.call("STRAIGHT_FEED", &six(&end)),
        Canon::StraightProbe { end, .. } => out.call("STRAIGHT_PROBE", &six(&end)),
        Canon::ArcFeed { end, first_centre, second_centre, turns } => {
            let (first, second, normal) = match plane {
                Plane::Xz | Plane::Uw => (end.z, end.x, end.y),
                Plane::Yz | Plane::Vw => (end.y, end.z, end.x),
                Plane::Xy | Plane::Uv => (end.x, end.y, end.z),
            };
            out.put(b"ARC_FEED(");
            out.numbers(&[first, second, first_centre, second_centre], b", ");
            out.put(b", ");
            out.integer(turns.into());
            out.put(b", ");
            out.numbers(&[normal, end.a, end.b, end.c], b", ");
            out.put(b")");
        }
        Canon::NurbsFeed { points, knots, .. } => {
            out.put(match (spelling, knots) {
                (Spelling::V2_9, []) => b"NURBS_FEED(",
                (Spelling::V2_10, []) => b"NURBS_G5_FEED(",
                _ => b"NURBS_G6_FEED(",
            });
            // LinuxCNC 2.10 counts the blocks of G6.2: one per knot.
            out.padded(points.len().max(knots.len()) as u64, 1);
            out.put(b", ...)");
        }
        Canon::RigidTap { end, .. } => out.call("RIGID_TAP", &[end.x, end.y, end.z]),
        Canon::TurnProbe(on) => out.put(if on { b"TURN_PROBE_ON()" } else { b"TURN_PROBE_OFF()" }),
        Canon::StartSpeedFeedSync { feed_per_turn, velocity_mode, .. } => {
            out.put(b"START_SPEED_FEED_SYNC(");
            out.number::<6>(feed_per_turn);
            out.put(b",");
            out.integer(velocity_mode.into());
            out.put(b")");
        }
        Canon::StopSpeedFeedSync => out.put(b"STOP_SPEED_FEED_SYNCH()"),
        Canon::Dwell(seconds) => out.call("DWELL", &[seconds]),
        Canon::SetFeedRate(rate) => out.call("SET_FEED_RATE", &[rate]),
        Canon::SetFeedMode { spindle, mode } => {
            out.put(b"SET_FEED_MODE(");
            out.integer(spindle.into());
            out.put(b", ");
            out.integer(mode.into());
            out.put(b")");
        }
        Canon::UseLengthUnits(unit) => out.put(match unit {
            LengthUnit::Inch => b"USE_LENGTH_UNITS(CANON_UNITS_INCHES)",
            LengthUnit::Mm => b"USE_LENGTH_UNITS(CANON_UNITS_MM)",
        }),
        Canon::SelectPlane(plane) => out.put(match plane {
            Plane::Xy => b"SELECT_PLANE(CANON_PLANE_XY)",
            Plane::Yz => b"SELECT_PLANE(CANON_PLANE_YZ)",
            Plane::Xz => b"SELECT_PLANE(CANON_PLANE_XZ)",
            Plane::Uv | Plane::Uw | Plane::Vw => b"SELECT_PLANE(CANON_PLANE_UNKNOWN)",
        }),
        Canon::SetMotionControlMode(mode) => {
            out.put(b"SET_MOTION_CONTROL_MODE(");
            match mode {
                MotionControlMode::ExactStop => out.put(b"CANON_EXACT_STOP"),
                MotionControlMode::ExactPath => out.put(b"CANON_EXACT_PATH"),
                MotionControlMode::Continuous { tolerance } => {
                    out.put(b"CANON_CONTINUOUS, ");
                    out.number::<6>(tolerance);
                }
                MotionControlMode::Unset => out.put(b"UNKNOWN"),
            }
            out.put(b")");
        }
        Canon::SetNaivecamTolerance(tolerance) => out.call("SET_NAIVECAM_TOLERANCE", &[tolerance]),
        Canon::SetPlannerMode { kind, peak_scale } => {
            out.put(b"SET_PLANNER_MODE(type=");
            out.integer(kind.into());
            out.put(b", peak_scale=");
            out.number::<6>(peak_scale);
            out.put(b")");
        }
        Canon::SetG5xOffset { system, offset } => out.call_indexed("SET_G5X_OFFSET", system, &six(&offset)),
        Canon::SetG92Offset(offset) => out.call("SET_G92_OFFSET", &six(&offset)),
        Canon::SetXyRotation(degrees) => out.call("SET_XY_ROTATION", &[degrees]),
        Canon::UseToolLengthOffset(o) => {
            out.put(b"USE_TOOL_LENGTH_OFFSET(");
            out.numbers(&[o.x, o.y, o.z], b" ");
            out.put(b", ");
            out.numbers(&[o.a, o.b, o.c], b" ");
            out.put(b", ");
            out.numbers(&[o.u, o.v, o.w], b" ");
            out.put(b")");
        }
        Canon::SetFeedReference => out.put(b"SET_FEED_REFERENCE(CANON_XYZ)"),
        Canon::SetSpindleMode { spindle, css_limit } => {
            out.put(b"SET_SPINDLE_MODE(");
            out.integer(spindle.into());
            out.put(b" ");
            out.number::<4>(css_limit);
            out.put(b")");
        }
        Canon::SetSpindleSpeed { spindle, speed } => {
            out.call_indexed("SET_SPINDLE_SPEED", spindle, &[speed]);
        }
        Canon::StartSpindle { spindle, direction: Direction::Clockwise } => {
            out.call_indexed("START_SPINDLE_CLOCKWISE", spindle, &[]);
        }
        Canon::StartSpindle { spindle, direction: Direction::Counterclockwise } => {
            out.call_indexed("START_SPINDLE_COUNTERCLOCKWISE", spindle, &[]);
        }
        Canon::StopSpindle { spindle } => out.call_indexed("STOP_SPINDLE_TURNING", spindle, &[]),
        Canon::OrientSpindle { spindle, angle, mode } => {
            out.put(b"ORIENT_SPINDLE(");
            out.integer(spindle.into());
            out.put(b", ");
            out.number::<4>(angle);
            out.put(b", ");
            out.integer(mode.into());
            out.put(b")");
        }
        Canon::WaitOrientComplete { spindle, timeout } => {
            out.put(b"SPINDLE.");
            out.integer(spindle.into());
            out.call(".WAIT_ORIENT_COMPLETE", &[timeout]);
        }
        _ => write_state_command(out, command, spelling),
    }
}

/// Tools, coolant, overrides, outputs, texts, program flow.
fn write_state_command(out: &mut Buffer, command: &Canon<'_>, spelling: Spelling) {
    let enabled = |on: bool| if on { "ENABLE_" } else { "DISABLE_" };
    let set = |on: bool| if on { "SET_" } else { "CLEAR_" };
    match *command {
        Canon::SelectTool(tool) => out.call_indexed("SELECT_TOOL", tool, &[]),
        Canon::StartChange => out.put(b"START_CHANGE()"),
        Canon::ChangeTool { slot, .. } if spelling == Spelling::V2_9 => {
            out.call_indexed("CHANGE_TOOL", slot, &[]);
        }
        Canon::ChangeTool { .. } => out.put(b"CHANGE_TOOL()"),
        Canon::ChangeToolNumber { slot, .. } => out.call_indexed("CHANGE_TOOL_NUMBER", slot, &[]),
        Canon::ReloadTooldata => out.put(b"RELOAD_TOOLDATA()"),
        Canon::SetToolTableEntry { slot, tool } => write_tool(out, slot, tool),
        Canon::Mist(on) => out.put(if on { b"MIST_ON()" } else { b"MIST_OFF()" }),
        Canon::Flood(on) => out.put(if on { b"FLOOD_ON()" } else { b"FLOOD_OFF()" }),
        Canon::FeedOverride(on) => {
            out.put(enabled(on).as_bytes());
            out.put(b"FEED_OVERRIDE()");
        }
        Canon::SpeedOverride { spindle, on } => {
            out.put(enabled(on).as_bytes());
            out.call_indexed("SPEED_OVERRIDE", spindle, &[]);
        }
        Canon::AdaptiveFeed(on) => {
            out.put(enabled(on).as_bytes());
            out.put(b"ADAPTIVE_FEED()");
        }
        Canon::FeedHold(on) => {
            out.put(enabled(on).as_bytes());
            out.put(b"FEED_HOLD()");
        }
        Canon::MotionOutputBit { index, on } => {
            out.put(set(on).as_bytes());
            out.call_indexed("MOTION_OUTPUT_BIT", index, &[]);
        }
        Canon::AuxOutputBit { index, on } => {
            out.put(set(on).as_bytes());
            out.call_indexed("AUX_OUTPUT_BIT", index, &[]);
        }
        Canon::MotionOutputValue { index, value } => {
            write_output(out, "SET_MOTION_OUTPUT_VALUE(", index, value)
        }
        Canon::AuxOutputValue { index, value } => write_output(out, "SET_AUX_OUTPUT_VALUE(", index, value),
        Canon::MachineCode(number) => out.call_indexed("MACHINE_CODE", number, &[]),
        Canon::Comment(text) => out.call_text("COMMENT", text.0),
        Canon::Message(text) => out.call_text("MESSAGE", text.0),
        Canon::Log(text) => out.call_text("LOG", text.0),
        Canon::LogOpen(text) => out.call_text("LOGOPEN", text.0),
        Canon::LogAppend(text) => out.call_text("LOGAPPEND", text.0),
        Canon::LogClose => out.put(b"LOGCLOSE()"),
        Canon::ProgramStop => out.put(b"PROGRAM_STOP()"),
        Canon::OptionalProgramStop => out.put(b"OPTIONAL_PROGRAM_STOP()"),
        Canon::PalletShuttle => out.put(b"PALLET_SHUTTLE()"),
        Canon::ProgramEnd => out.put(b"PROGRAM_END()"),
        Canon::Finish => out.put(b"FINISH()"),
        Canon::OnReset => out.put(b"ON_RESET()"),
        _ => out.put(b"UNPRINTED()"),
    }
}

fn write_output(out: &mut Buffer, name: &str, index: i32, value: f64) {
    out.put(name.as_bytes());
    out.integer(index.into());
    out.put(b",");
    out.number::<6>(value);
    out.put(b")");
}

fn write_tool(out: &mut Buffer, slot: i32, tool: &Tool) {
    out.put(b"SET_TOOL_TABLE_ENTRY(");
    out.integer(slot.into());
    out.put(b", ");
    out.integer(tool.number.into());
    out.put(b", ");
    out.numbers(&tool.offset.to_array(), b" ");
    out.put(b", ");
    out.numbers(&[tool.front_angle, tool.back_angle], b", ");
    out.put(b", ");
    out.integer(tool.orientation.into());
    out.put(b")");
}
