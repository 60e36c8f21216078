//! A machine file as it was written: the shape is right, the numbers may be nonsense.
//!
//! [`crate::Machine`] is what can run; its `try_from` is the only bridge. Lengths in mm, angles in degrees, as the keys say.

use crate::kinematics::KinematicsFile;
use crate::source::{Findings, MAX_BYTES, Source};
use pkm_canon::diagnostic::Diagnostic;
use pkm_kins::Axis;
use serde::Deserialize;
use toml::Spanned;
use toml::de::DeTable;

/// A file that is not TOML at all is not told so on every line.
const MOST_SYNTAX_ERRORS: usize = 5;

/// A number with its place in the text.
pub type Number = Spanned<f64>;

/// A whole number of nanoseconds with its place in the text.
pub type Nanoseconds = Spanned<i64>;

/// The whole file.
#[derive(Debug, Clone)]
pub struct MachineFile {
    /// Where it came from.
    pub source: Source,
    /// All tables but `[kinematics]`.
    pub tables: Tables,
    /// `[kinematics]`
    pub kinematics: Spanned<KinematicsFile>,
}

/// All tables but `[kinematics]`, whose keys depend on its `type`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tables {
    /// Name of the machine: letters, digits, `-`, `_`, `.`.
    pub name: Spanned<String>,
    /// One line for a person.
    #[serde(default)]
    pub description: String,
    /// Where the geometry comes from.
    #[serde(default)]
    pub source: String,
    /// `[servo]`
    pub servo: Servo,
    /// `[stepgen]`
    #[serde(default)]
    pub stepgen: Stepgen,
    /// `[path]`
    #[serde(default)]
    pub path: Path,
    /// `[singularity]`
    #[serde(default)]
    pub singularity: Singularity,
    /// `[homing]`
    #[serde(default)]
    pub homing: Homing,
    /// `[spindle]`
    #[serde(default)]
    pub spindle: Spindle,
    /// `[probe]`
    #[serde(default)]
    pub probe: Probe,
    /// `[program]`
    #[serde(default)]
    pub program: Program,
    /// `[driver]`: for every joint that has none of its own.
    pub driver: Option<Spanned<Driver>>,
    /// `[[joint]]`, in joint order.
    pub joint: Spanned<Vec<Spanned<Joint>>>,
    /// `[axis.x]` ...
    #[serde(default)]
    pub axis: Axes,
    /// `[home]`
    pub home: Spanned<Pose>,
    /// `[[switch]]`: M codes that switch the mechanism.
    #[serde(default)]
    pub switch: Vec<Spanned<Switch>>,
    /// `[configure]`: the configurations of a reconfigurable machine.
    pub configure: Option<crate::family::ConfigureFile>,
}

/// One `[[switch]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// Number of the M code.
    pub code: Spanned<i64>,
    /// What it switches to: `H` or `V` of an HV-Mill, `O` or `X` of an O-X glide.
    pub to: Spanned<String>,
}

/// `[servo]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Servo {
    pub period_ns: Nanoseconds,
}

/// `[stepgen]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stepgen {
    /// Grid of all step and direction edges; 100 if absent.
    pub timer_period_ns: Option<Nanoseconds>,
}

/// `[path]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Path {
    /// Tolerance of G64 without P; 0 if absent.
    pub blend_tolerance_mm: Option<Number>,
    /// Window of the moving average over every joint that limits jerk; 0 = none.
    pub joint_smoothing_ms: Option<Number>,
}

/// `[singularity]`: bounds for the measures of [`pkm_kins::Singularity`], dimensionless.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Singularity {
    /// A pose nearer than this is refused; 0.001 if absent.
    pub guard: Option<Number>,
    /// A program that comes nearer than this is warned about; 0.05 if absent.
    pub warn: Option<Number>,
}

/// `[spindle]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spindle {
    /// Faster it does not turn; 6000 if absent.
    pub max_speed_rpm: Option<Number>,
    /// How fast it speeds up and slows down; 3000 if absent.
    pub acceleration_rpm_s: Option<Number>,
    /// Longest wait for its speed and its index; 30 if absent.
    pub timeout_s: Option<Number>,
}

/// `[probe]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// What the probe can touch; see [`crate::workpiece`].
    #[serde(default)]
    pub workpiece: Vec<Spanned<String>>,
}

/// `[program]`: what programs of this machine mean; see [`crate::ProgramSettings`].
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// Codes that subs stand for, each as LinuxCNC's INI file has it behind `REMAP =`.
    #[serde(default)]
    pub remap: Vec<Spanned<String>>,
    /// Folders of subroutine files; relative ones begin where the machine file is.
    #[serde(default)]
    pub subroutine_path: Vec<Spanned<String>>,
    /// M6 exchanges the tool with the one in the spindle; no if absent.
    #[serde(default)]
    pub random_tool_changer: bool,
}

/// `[driver]` or a joint's `driver`: a known model or own minima, and the times to use (the minima if absent).
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Driver {
    /// One of [`crate::drivers::DRIVERS`].
    pub model: Option<Spanned<String>>,
    /// Minima of a driver that has no name here.
    pub minimum: Option<Spanned<Minimum>>,
    pub step_length_ns: Option<Nanoseconds>,
    pub step_space_ns: Option<Nanoseconds>,
    pub direction_setup_ns: Option<Nanoseconds>,
    pub direction_hold_ns: Option<Nanoseconds>,
}

/// Own minima of a driver.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Minimum {
    pub step_length_ns: Nanoseconds,
    pub step_space_ns: Nanoseconds,
    pub direction_setup_ns: Nanoseconds,
    pub direction_hold_ns: Nanoseconds,
}

/// One `[[joint]]`: the `_mm` keys for a linear joint, the `_deg` keys for a rotary one.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Joint {
    pub name: Spanned<String>,
    pub min_mm: Option<Number>,
    pub max_mm: Option<Number>,
    pub max_velocity_mm_s: Option<Number>,
    pub max_acceleration_mm_s2: Option<Number>,
    pub steps_per_mm: Option<Number>,
    pub min_deg: Option<Number>,
    pub max_deg: Option<Number>,
    pub max_velocity_deg_s: Option<Number>,
    pub max_acceleration_deg_s2: Option<Number>,
    pub steps_per_deg: Option<Number>,
    pub driver: Option<Spanned<Driver>>,
    /// Largest difference of command and feedback; 3 steps if absent.
    pub following_error_mm: Option<Number>,
    pub following_error_deg: Option<Number>,
    pub home: Option<Spanned<JointHome>>,
}

/// A joint's `home`: see [`crate::JointHoming`]. All keys optional; `_deg` for a rotary joint.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct JointHome {
    /// At the home pose if absent.
    pub switch_mm: Option<Number>,
    /// With sign; a fifth of the joint's velocity, downwards, if absent.
    pub search_velocity_mm_s: Option<Number>,
    /// A tenth of the search if absent.
    pub latch_velocity_mm_s: Option<Number>,
    /// Use the index of the encoder.
    pub index_pitch_mm: Option<Number>,
    pub switch_deg: Option<Number>,
    pub search_velocity_deg_s: Option<Number>,
    pub latch_velocity_deg_s: Option<Number>,
    pub index_pitch_deg: Option<Number>,
    /// 0 if absent.
    pub sequence: Option<Spanned<i64>>,
}

/// `[homing]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Homing {
    /// How long a contact must have been off to count as off; 25 if absent.
    pub debounce_ms: Option<Number>,
    /// How long the simulated contacts bounce; 2 if absent.
    pub switch_bounce_ms: Option<Number>,
}

/// `[axis.*]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Axes {
    pub x: Option<Spanned<AxisLimits>>,
    pub y: Option<Spanned<AxisLimits>>,
    pub z: Option<Spanned<AxisLimits>>,
    pub a: Option<Spanned<AxisLimits>>,
    pub b: Option<Spanned<AxisLimits>>,
    pub c: Option<Spanned<AxisLimits>>,
    pub u: Option<Spanned<AxisLimits>>,
    pub v: Option<Spanned<AxisLimits>>,
    pub w: Option<Spanned<AxisLimits>>,
}

impl Axes {
    /// The tables in letter order.
    pub fn iter(&self) -> impl Iterator<Item = (Axis, Option<&Spanned<AxisLimits>>)> {
        let tables = [&self.x, &self.y, &self.z, &self.a, &self.b, &self.c, &self.u, &self.v, &self.w]
            .map(Option::as_ref);
        Axis::ALL.into_iter().zip(tables)
    }
}

/// One `[axis.x]`: all keys optional; `_deg` for A, B, C.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct AxisLimits {
    pub min_mm: Option<Number>,
    pub max_mm: Option<Number>,
    pub max_velocity_mm_s: Option<Number>,
    pub max_acceleration_mm_s2: Option<Number>,
    pub min_deg: Option<Number>,
    pub max_deg: Option<Number>,
    pub max_velocity_deg_s: Option<Number>,
    pub max_acceleration_deg_s2: Option<Number>,
}

/// `[home]`: a pose, mm and degrees; what is absent is 0.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Pose {
    pub x: Option<Number>,
    pub y: Option<Number>,
    pub z: Option<Number>,
    pub a: Option<Number>,
    pub b: Option<Number>,
    pub c: Option<Number>,
    pub u: Option<Number>,
    pub v: Option<Number>,
    pub w: Option<Number>,
}

impl Pose {
    /// The coordinates in letter order.
    pub fn iter(&self) -> impl Iterator<Item = (Axis, Option<&Number>)> {
        let numbers = [&self.x, &self.y, &self.z, &self.a, &self.b, &self.c, &self.u, &self.v, &self.w]
            .map(Option::as_ref);
        Axis::ALL.into_iter().zip(numbers)
    }
}

impl MachineFile {
    /// Reads the text of a machine file and applies `--set KEY=VALUE` overrides to it.
    ///
    /// # Errors
    /// Diagnostics: more than [`MAX_BYTES`], not TOML, an override that matches nothing, an unknown, repeated or missing
    /// key, a value of the wrong type. Numbers are not judged here.
    pub fn parse(file: &str, text: &str, overrides: &[String]) -> Result<Self, Vec<Diagnostic>> {
        let source = Source::new(file, text, overrides);
        if text.len() > MAX_BYTES {
            let message = format!("{} bytes; a machine file has at most {MAX_BYTES}", text.len());
            let help = "give a machine file (TOML) or the name of a shipped machine".to_owned();
            return Err(vec![source.diagnostic("machine-too-large", None, message, Some(help))]);
        }
        let mut findings = Findings::new(&source);
        let (mut root, errors) = DeTable::parse_recoverable(text);
        // The parser goes on after an error; what follows on the same line is seldom news.
        let mut last_line = None;
        for error in &errors {
            let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count());
            if line.is_none() || line != last_line {
                findings.syntax(error);
            }
            last_line = line;
            if findings.len() == MOST_SYNTAX_ERRORS {
                break;
            }
        }
        if !findings.is_empty() {
            return Err(findings.into_list());
        }
        crate::overrides::apply(root.get_mut(), overrides, &source, &mut findings);
        let kinematics = KinematicsFile::take(root.get_mut(), &mut findings);
        let tables =
            Tables::deserialize(toml::Deserializer::from(root)).map_err(|error| findings.shape(&error)).ok();
        match (tables, kinematics) {
            (Some(tables), Some(kinematics)) if findings.is_empty() => {
                Ok(Self { source, tables, kinematics })
            }
            _ => Err(findings.into_list()),
        }
    }
}
