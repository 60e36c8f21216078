//! Canonical commands as JSON, one object a line: full precision, all nine axes, program units.

use pkm_canon::text::LineOutput;
use pkm_canon::{Canon, CanonSink, LengthUnit, MotionControlMode, Position, Span};
use serde_json::{Value, json};

/// Writes one object per command.
pub(crate) struct JsonWriter<'a, O> {
    output: O,
    program: &'a str,
    sequence: u64,
    /// The N word of the latest line read.
    number: Option<String>,
}

impl<'a, O: LineOutput> JsonWriter<'a, O> {
    pub(crate) fn new(output: O, program: &'a str) -> Self {
        Self { output, program, sequence: 0, number: None }
    }
}

impl<O: LineOutput> CanonSink for JsonWriter<'_, O> {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        self.sequence += 1;
        let (name, arguments) = name_and_arguments(command);
        let object = json!({
            "schema": pkm_run::SCHEMA,
            "sequence": self.sequence,
            // Subroutine files are told apart by number: their names are known to the source alone.
            "file": if span.file.0 == 0 { json!(self.program) } else { Value::Null },
            "file_number": span.file.0,
            "line": span.line,
            "column": span.start + 1,
            "n": self.number,
            "command": name,
            "arguments": arguments,
        });
        self.output.line(format!("{object}\n").as_bytes());
    }

    fn line_read(&mut self, text: &[u8], _span: Span) {
        let text = String::from_utf8_lossy(text);
        let text = text.trim_start_matches([' ', '\t', '/']);
        self.number =
            text.strip_prefix(['N', 'n']).map(|rest| rest.chars().take_while(char::is_ascii_digit).collect());
    }
}

fn nine(position: &Position) -> Value {
    let Position { x, y, z, a, b, c, u, v, w } = *position;
    json!({ "x": x, "y": y, "z": z, "a": a, "b": b, "c": c, "u": u, "v": v, "w": w })
}

/// LinuxCNC's name of a command, and its arguments by name.
fn name_and_arguments(command: &Canon<'_>) -> (&'static str, Value) {
    let nothing = || json!({});
    let switch = |on: bool, yes, no| (if on { yes } else { no }, json!({}));
    match command {
        Canon::StraightTraverse(end) => ("STRAIGHT_TRAVERSE", nine(end)),
        Canon::StraightFeed(end) => ("STRAIGHT_FEED", nine(end)),
        Canon::ArcFeed { end, first_centre, second_centre, turns } => (
            "ARC_FEED",
            json!({ "end": nine(end), "first_centre": first_centre, "second_centre": second_centre, "turns": turns }),
        ),
        Canon::NurbsFeed { plane, points, knots, order } => {
            let points: Vec<Value> = points
                .iter()
                .map(|p| json!({ "first": p.first, "second": p.second, "weight": p.weight }))
                .collect();
            let plane = format!("{plane:?}").to_ascii_uppercase();
            ("NURBS_FEED", json!({ "plane": plane, "points": points, "knots": knots, "order": order }))
        }
        Canon::StraightProbe { end, probe } => {
            ("STRAIGHT_PROBE", json!({ "end": nine(end), "away": probe.away, "must_trip": probe.must_trip }))
        }
        Canon::RigidTap { end, retract_scale } => {
            ("RIGID_TAP", json!({ "end": nine(end), "retract_scale": retract_scale }))
        }
        Canon::TurnProbe(on) => switch(*on, "TURN_PROBE_ON", "TURN_PROBE_OFF"),
        Canon::StartSpeedFeedSync { spindle, feed_per_turn, velocity_mode } => (
            "START_SPEED_FEED_SYNC",
            json!({ "spindle": spindle, "feed_per_turn": feed_per_turn, "velocity_mode": velocity_mode }),
        ),
        Canon::StopSpeedFeedSync => ("STOP_SPEED_FEED_SYNCH", nothing()),
        Canon::Dwell(seconds) => ("DWELL", json!({ "seconds": seconds })),
        Canon::SetFeedRate(rate) => ("SET_FEED_RATE", json!({ "rate": rate })),
        Canon::SetFeedMode { spindle, mode } => {
            ("SET_FEED_MODE", json!({ "spindle": spindle, "mode": mode }))
        }
        Canon::UseLengthUnits(unit) => {
            ("USE_LENGTH_UNITS", json!({ "unit": if *unit == LengthUnit::Inch { "inch" } else { "mm" } }))
        }
        Canon::SelectPlane(plane) => {
            ("SELECT_PLANE", json!({ "plane": format!("{plane:?}").to_ascii_uppercase() }))
        }
        Canon::SetMotionControlMode(mode) => (
            "SET_MOTION_CONTROL_MODE",
            match mode {
                MotionControlMode::ExactPath => json!({ "mode": "exact_path" }),
                MotionControlMode::ExactStop => json!({ "mode": "exact_stop" }),
                MotionControlMode::Continuous { tolerance } => {
                    json!({ "mode": "continuous", "tolerance": tolerance })
                }
                MotionControlMode::Unset => json!({ "mode": null }),
            },
        ),
        Canon::SetNaivecamTolerance(tolerance) => {
            ("SET_NAIVECAM_TOLERANCE", json!({ "tolerance": tolerance }))
        }
        Canon::SetPlannerMode { kind, peak_scale } => {
            ("SET_PLANNER_MODE", json!({ "type": kind, "peak_scale": peak_scale }))
        }
        Canon::SetG5xOffset { system, offset } => {
            ("SET_G5X_OFFSET", json!({ "system": system, "offset": nine(offset) }))
        }
        Canon::SetG92Offset(offset) => ("SET_G92_OFFSET", nine(offset)),
        Canon::SetXyRotation(degrees) => ("SET_XY_ROTATION", json!({ "degrees": degrees })),
        Canon::UseToolLengthOffset(offset) => ("USE_TOOL_LENGTH_OFFSET", nine(offset)),
        Canon::SetFeedReference => ("SET_FEED_REFERENCE", nothing()),
        other => state_command(other),
    }
}

/// Spindle, tools, coolant, overrides, outputs, texts, program flow.
fn state_command(command: &Canon<'_>) -> (&'static str, Value) {
    let nothing = || json!({});
    let switch = |on: bool, yes, no| (if on { yes } else { no }, json!({}));
    match command {
        Canon::SetSpindleMode { spindle, css_limit } => {
            ("SET_SPINDLE_MODE", json!({ "spindle": spindle, "css_limit": css_limit }))
        }
        Canon::SetSpindleSpeed { spindle, speed } => {
            ("SET_SPINDLE_SPEED", json!({ "spindle": spindle, "speed": speed }))
        }
        Canon::StartSpindle { spindle, direction } => (
            match direction {
                pkm_canon::Direction::Clockwise => "START_SPINDLE_CLOCKWISE",
                pkm_canon::Direction::Counterclockwise => "START_SPINDLE_COUNTERCLOCKWISE",
            },
            json!({ "spindle": spindle }),
        ),
        Canon::StopSpindle { spindle } => ("STOP_SPINDLE_TURNING", json!({ "spindle": spindle })),
        Canon::OrientSpindle { spindle, angle, mode } => {
            ("ORIENT_SPINDLE", json!({ "spindle": spindle, "angle": angle, "mode": mode }))
        }
        Canon::WaitOrientComplete { spindle, timeout } => {
            ("WAIT_ORIENT_COMPLETE", json!({ "spindle": spindle, "timeout": timeout }))
        }
        Canon::SelectTool(tool) => ("SELECT_TOOL", json!({ "tool": tool })),
        Canon::StartChange => ("START_CHANGE", nothing()),
        Canon::ChangeTool { slot, tool } => ("CHANGE_TOOL", json!({ "slot": slot, "tool": tool })),
        Canon::ChangeToolNumber { slot, tool } => {
            ("CHANGE_TOOL_NUMBER", json!({ "slot": slot, "tool": tool }))
        }
        Canon::ReloadTooldata => ("RELOAD_TOOLDATA", nothing()),
        Canon::SetToolTableEntry { slot, tool } => (
            "SET_TOOL_TABLE_ENTRY",
            json!({ "slot": slot, "tool": tool.number, "pocket": tool.pocket, "offset": nine(&tool.offset),
                    "diameter": tool.diameter, "front_angle": tool.front_angle, "back_angle": tool.back_angle,
                    "orientation": tool.orientation }),
        ),
        Canon::Mist(on) => switch(*on, "MIST_ON", "MIST_OFF"),
        Canon::Flood(on) => switch(*on, "FLOOD_ON", "FLOOD_OFF"),
        Canon::FeedOverride(on) => switch(*on, "ENABLE_FEED_OVERRIDE", "DISABLE_FEED_OVERRIDE"),
        Canon::SpeedOverride { spindle, on } => (
            if *on { "ENABLE_SPEED_OVERRIDE" } else { "DISABLE_SPEED_OVERRIDE" },
            json!({ "spindle": spindle }),
        ),
        Canon::AdaptiveFeed(on) => switch(*on, "ENABLE_ADAPTIVE_FEED", "DISABLE_ADAPTIVE_FEED"),
        Canon::FeedHold(on) => switch(*on, "ENABLE_FEED_HOLD", "DISABLE_FEED_HOLD"),
        Canon::MotionOutputBit { index, on } => {
            (if *on { "SET_MOTION_OUTPUT_BIT" } else { "CLEAR_MOTION_OUTPUT_BIT" }, json!({ "index": index }))
        }
        Canon::AuxOutputBit { index, on } => {
            (if *on { "SET_AUX_OUTPUT_BIT" } else { "CLEAR_AUX_OUTPUT_BIT" }, json!({ "index": index }))
        }
        Canon::MotionOutputValue { index, value } => {
            ("SET_MOTION_OUTPUT_VALUE", json!({ "index": index, "value": value }))
        }
        Canon::AuxOutputValue { index, value } => {
            ("SET_AUX_OUTPUT_VALUE", json!({ "index": index, "value": value }))
        }
        Canon::WaitInput { index, analog, wait, timeout } => (
            "WAIT",
            json!({ "index": index, "analog": analog, "wait": format!("{wait:?}").to_ascii_lowercase(),
                    "timeout": timeout }),
        ),
        Canon::UserM { number, p, q } => ("USER_M", json!({ "number": number, "p": p, "q": q })),
        Canon::MachineCode(number) => ("MACHINE_CODE", json!({ "number": number })),
        Canon::Comment(text) => ("COMMENT", json!({ "text": text.to_string() })),
        Canon::Message(text) => ("MESSAGE", json!({ "text": text.to_string() })),
        Canon::Print(text) => ("PRINT", json!({ "text": text.to_string() })),
        Canon::Log(text) => ("LOG", json!({ "text": text.to_string() })),
        Canon::LogOpen(text) => ("LOGOPEN", json!({ "text": text.to_string() })),
        Canon::LogAppend(text) => ("LOGAPPEND", json!({ "text": text.to_string() })),
        Canon::LogClose => ("LOGCLOSE", nothing()),
        Canon::ProgramStop => ("PROGRAM_STOP", nothing()),
        Canon::OptionalProgramStop => ("OPTIONAL_PROGRAM_STOP", nothing()),
        Canon::PalletShuttle => ("PALLET_SHUTTLE", nothing()),
        Canon::ProgramEnd => ("PROGRAM_END", nothing()),
        Canon::Finish => ("FINISH", nothing()),
        Canon::OnReset => ("ON_RESET", nothing()),
        // The list of commands may grow; those above are all there are now.
        other => ("OTHER", json!({ "text": format!("{other:?}") })),
    }
}
