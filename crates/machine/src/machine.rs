//! A machine that can run: every number finite and in range, every joint matched to the mechanism, home inside the travel.

use crate::checks::{finite, identifier, integer, not_negative, positive, range};
use crate::drivers::DriverTiming;
use crate::file::{self, MachineFile, Number};
use crate::homing::{self, Homing, JointHoming};
use crate::joint::joints;
use crate::program::{ProgramSettings, program};
use crate::source::Findings;
use crate::switch::{Switch, switches};
use crate::workpiece::{Solid, solid};
use pkm_canon::diagnostic::Diagnostic;
use pkm_kins::machine::Mechanism;
use pkm_kins::{Axis, JointKind, JointRange, Kinematics, Pose, maths};
use pkm_stepgen::PulseTimingNs;
use std::ops::RangeInclusive;

/// A validated machine. Units: mm, **radians**, seconds, and ns where the name says so.
#[derive(Debug, Clone)]
pub struct Machine {
    /// Name: letters, digits, `-`, `_`, `.`.
    pub name: String,
    /// One line for a person.
    pub description: String,
    /// Where the geometry comes from.
    pub source: String,
    /// `kinematics.type` of the file.
    pub mechanism_type: String,
    /// Pose ⇄ joints.
    pub mechanism: Mechanism,
    /// In joint order; as many as the mechanism has.
    pub joints: Vec<Joint>,
    /// Limits of the axes that have any, in letter order.
    pub axes: Vec<AxisLimits>,
    /// How the machine finds its zero.
    pub homing: Homing,
    /// Where the machine stands at the start: reachable, inside the travel, away from singularities.
    pub home: Pose,
    /// Servo period.
    pub servo_period_ns: u64,
    /// Grid of all step and direction edges; the servo period is a multiple of it.
    pub timer_period_ns: u64,
    /// Path settings.
    pub path: PathSettings,
    /// Bounds for the singularity measures.
    pub singularity: SingularityGuard,
    /// M codes that switch the mechanism, each code once.
    pub switches: Vec<Switch>,
    /// What programs may say beyond the language.
    pub program: ProgramSettings,
    /// What the spindle can do.
    pub spindle: SpindleSettings,
    /// What the probe can touch, machine coordinates, mm; nothing: there is no probe.
    pub workpiece: Vec<Solid>,
}

/// What the spindle can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpindleSettings {
    /// rpm
    pub max_speed_rpm: f64,
    /// rpm/s
    pub acceleration_rpm_s: f64,
    /// Longest wait for its speed and its index, s.
    pub timeout_s: f64,
}

/// One joint: mm or rad, as the mechanism's [`JointKind`] says.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Name, unique in the machine.
    pub name: String,
    /// Length or angle.
    pub kind: JointKind,
    /// Travel, mm or rad.
    pub range: JointRange,
    /// mm/s or rad/s
    pub max_velocity: f64,
    /// mm/s² or rad/s²
    pub max_acceleration: f64,
    /// Largest difference of command and feedback, mm or rad, above 0.
    pub following_error: f64,
    /// How it finds its zero.
    pub homing: JointHoming,
    /// Steps per mm or rad, above 0.
    pub steps_per_unit: f64,
    /// As configured; never shorter than the driver's minima.
    pub timing: PulseTimingNs,
    /// The driver and its minima.
    pub driver: DriverTiming,
}

impl Joint {
    /// mm or rad → mm or degrees, as people and files state it. Also for rates.
    pub fn to_face(&self, value: f64) -> f64 {
        match self.kind {
            JointKind::Linear => value,
            JointKind::Rotary => maths::degrees(value),
        }
    }

    /// mm or degrees → mm or rad. Also for rates.
    #[allow(clippy::wrong_self_convention)] // the opposite of `to_face`
    pub fn from_face(&self, value: f64) -> f64 {
        match self.kind {
            JointKind::Linear => value,
            JointKind::Rotary => maths::radians(value),
        }
    }
}

/// Limits of one axis; what is absent is limited by the joints alone.
#[derive(Debug, Clone, Copy)]
pub struct AxisLimits {
    /// The axis.
    pub axis: Axis,
    /// Soft limits, mm or rad.
    pub range: Option<JointRange>,
    /// mm/s or rad/s
    pub max_velocity: Option<f64>,
    /// mm/s² or rad/s²
    pub max_acceleration: Option<f64>,
}

/// Path settings.
#[derive(Debug, Clone, Copy)]
pub struct PathSettings {
    /// Tolerance of G64 without P, mm; 0 = exact path.
    pub blend_tolerance: f64,
    /// Window of the moving average over every joint that limits jerk, servo periods; 0 = none.
    pub smoothing_periods: u32,
}

/// Bounds for the dimensionless measures of [`pkm_kins::Singularity`].
#[derive(Debug, Clone, Copy)]
pub struct SingularityGuard {
    /// A pose nearer than this is refused.
    pub guard: f64,
    /// A program that comes nearer than this is warned about.
    pub warn: f64,
}

const SERVO_PERIOD_NS: RangeInclusive<i64> = 10_000..=100_000_000;
const TIMER_PERIOD_NS: RangeInclusive<i64> = 1..=1_000_000;
/// Longest average over the joints, servo periods.
pub(crate) const MOST_SMOOTHING_PERIODS: u32 = 64;
const DEFAULT_TIMER_PERIOD_NS: u64 = 100;
const DEFAULT_GUARD: f64 = 0.001;
const DEFAULT_WARN: f64 = 0.05;
/// How far forward(inverse(home)) may be from home, mm or rad.
const HOME_TOLERANCE: f64 = 1e-6;

impl Machine {
    /// Travel of all joints, mm or rad.
    pub fn joint_ranges(&self) -> Vec<JointRange> {
        self.joints.iter().map(|joint| joint.range).collect()
    }

    /// Limits of one axis, if it has any.
    pub fn axis(&self, axis: Axis) -> Option<&AxisLimits> {
        self.axes.iter().find(|limits| limits.axis == axis)
    }
}

impl TryFrom<MachineFile> for Machine {
    type Error = Vec<Diagnostic>;

    /// # Errors
    /// All findings about the file, in file order.
    fn try_from(file: MachineFile) -> Result<Self, Vec<Diagnostic>> {
        let mut findings = Findings::new(&file.source);
        let machine = build(&file, &mut findings);
        match machine {
            Some(machine) if findings.is_empty() => Ok(machine),
            _ => Err(findings.into_list()),
        }
    }
}

/// Builds the machine, noting every finding on the way; `None` if any part is missing.
fn build(file: &MachineFile, findings: &mut Findings<'_>) -> Option<Machine> {
    let tables = &file.tables;
    let name = identifier("name", &tables.name, findings);
    let servo_period_ns = integer("servo.period_ns", &tables.servo.period_ns, SERVO_PERIOD_NS, findings);
    let timer_period_ns = match &tables.stepgen.timer_period_ns {
        Some(period) => integer("stepgen.timer_period_ns", period, TIMER_PERIOD_NS, findings),
        None => Some(DEFAULT_TIMER_PERIOD_NS),
    };
    if let (Some(servo_ns), Some(timer_ns)) = (servo_period_ns, timer_period_ns)
        && servo_ns % timer_ns != 0
    {
        let message =
            format!("servo.period_ns = {servo_ns} is not a multiple of stepgen.timer_period_ns = {timer_ns}");
        let help = "change one of the two, so that every servo tick falls on the grid of the step edges";
        findings.error("machine-range", tables.servo.period_ns.span(), message, help);
    }
    let path = path(tables, servo_period_ns.unwrap_or(1_000_000), findings);
    let singularity = singularity(tables, findings);
    let mechanism = file.kinematics.get_ref().build(file.kinematics.span(), findings);
    let mut joints =
        mechanism.as_ref().and_then(|mechanism| joints(tables, mechanism, timer_period_ns?, findings));
    let axes = mechanism.as_ref().map(|mechanism| axes(tables, mechanism, findings));
    let home = mechanism.as_ref().and_then(|mechanism| {
        home(tables, mechanism, joints.as_deref()?, axes.as_deref()?, singularity?, findings)
    });
    let homing = homing::common(tables, findings);
    if let (Some(mechanism), Some(joints), Some(home), Some(singularity)) =
        (&mechanism, &mut joints, &home, singularity)
    {
        homing::check(tables, mechanism, joints, home, singularity, findings);
    }
    let switches = mechanism.as_ref().and_then(|mechanism| switches(tables, mechanism, findings));
    let program = program(file, switches.as_deref().unwrap_or_default(), findings);
    let spindle = spindle(tables, findings);
    let workpiece = workpiece(tables, findings);
    Some(Machine {
        name: name?,
        description: tables.description.clone(),
        source: tables.source.clone(),
        mechanism_type: file.kinematics.get_ref().kind.clone(),
        mechanism: mechanism?,
        joints: joints?,
        axes: axes?,
        homing: homing?,
        home: home?,
        servo_period_ns: servo_period_ns?,
        timer_period_ns: timer_period_ns?,
        path: path?,
        singularity: singularity?,
        switches: switches?,
        program: program?,
        spindle: spindle?,
        workpiece: workpiece?,
    })
}

fn path(tables: &file::Tables, servo_period_ns: u64, findings: &mut Findings<'_>) -> Option<PathSettings> {
    let blend_tolerance = match &tables.path.blend_tolerance_mm {
        Some(number) => not_negative("path.blend_tolerance_mm", number, findings)?,
        None => 0.0,
    };
    let smoothing_periods = match &tables.path.joint_smoothing_ms {
        Some(number) => {
            let ms = not_negative("path.joint_smoothing_ms", number, findings)?;
            let periods = maths::round(ms * 1e6 / servo_period_ns as f64);
            if periods > f64::from(MOST_SMOOTHING_PERIODS) {
                let most = f64::from(MOST_SMOOTHING_PERIODS) * servo_period_ns as f64 / 1e6;
                let message = format!("path.joint_smoothing_ms = {ms} is longer than {most} ms");
                let help =
                    "a longer average moves the tool far off its path; lower the accelerations instead";
                findings.error("machine-range", number.span(), message, help);
                return None;
            }
            periods as u32
        }
        None => 0,
    };
    Some(PathSettings { blend_tolerance, smoothing_periods })
}

fn spindle(tables: &file::Tables, findings: &mut Findings<'_>) -> Option<SpindleSettings> {
    let mut number = |key: &str, number: &Option<Number>, default: f64| match number {
        Some(number) => positive(key, number, findings),
        None => Some(default),
    };
    let file::Spindle { max_speed_rpm, acceleration_rpm_s, timeout_s } = &tables.spindle;
    let max_speed_rpm = number("spindle.max_speed_rpm", max_speed_rpm, 6000.0);
    let acceleration_rpm_s = number("spindle.acceleration_rpm_s", acceleration_rpm_s, 3000.0);
    let timeout_s = number("spindle.timeout_s", timeout_s, 30.0);
    Some(SpindleSettings {
        max_speed_rpm: max_speed_rpm?,
        acceleration_rpm_s: acceleration_rpm_s?,
        timeout_s: timeout_s?,
    })
}

fn workpiece(tables: &file::Tables, findings: &mut Findings<'_>) -> Option<Vec<Solid>> {
    let mut solids = Vec::new();
    for text in &tables.probe.workpiece {
        match solid(text.get_ref()) {
            Ok(solid) => solids.push(solid),
            Err(why) => {
                let message = format!("probe.workpiece {:?}: {why}", text.get_ref());
                findings.error("machine-workpiece", text.span(), message, crate::workpiece::HELP);
                return None;
            }
        }
    }
    Some(solids)
}

fn singularity(tables: &file::Tables, findings: &mut Findings<'_>) -> Option<SingularityGuard> {
    let mut bound = |key: &str, number: &Option<Number>, default: f64| match number {
        Some(number) => {
            let value = finite(key, number, findings)?;
            if !(0.0..1.0).contains(&value) {
                let message = format!("{key} = {value} is not a measure from 0 to below 1");
                findings.error("machine-range", number.span(), message, "0.05 is a usual value");
                return None;
            }
            Some(value)
        }
        None => Some(default),
    };
    let guard = bound("singularity.guard", &tables.singularity.guard, DEFAULT_GUARD);
    let warn = bound("singularity.warn", &tables.singularity.warn, DEFAULT_WARN);
    Some(SingularityGuard { guard: guard?, warn: warn? })
}

fn axes(tables: &file::Tables, mechanism: &Mechanism, findings: &mut Findings<'_>) -> Vec<AxisLimits> {
    let mut list = Vec::new();
    for (axis, limits) in tables.axis.iter() {
        let Some(limits) = limits else { continue };
        let label = format!("axis.{}.", axis.letter().to_ascii_lowercase());
        if !mechanism.axes().contains(axis) {
            let message = format!("the mechanism has no axis {}", axis.letter());
            findings.error("machine-axis", limits.span(), message, &format!("it has {}", letters(mechanism)));
            continue;
        }
        let limits = limits.get_ref();
        let linear = [
            ("min_mm", &limits.min_mm),
            ("max_mm", &limits.max_mm),
            ("max_velocity_mm_s", &limits.max_velocity_mm_s),
            ("max_acceleration_mm_s2", &limits.max_acceleration_mm_s2),
        ];
        let rotary = [
            ("min_deg", &limits.min_deg),
            ("max_deg", &limits.max_deg),
            ("max_velocity_deg_s", &limits.max_velocity_deg_s),
            ("max_acceleration_deg_s2", &limits.max_acceleration_deg_s2),
        ];
        let (fields, foreign, kind) = match axis.is_rotary() {
            false => (linear, rotary, JointKind::Linear),
            true => (rotary, linear, JointKind::Rotary),
        };
        for (key, number) in foreign {
            if let Some(number) = number {
                let message = format!("`{label}{key}` has the wrong unit for axis {}", axis.letter());
                findings.error("machine-unit", number.span(), message, "X Y Z U V W: _mm; A B C: _deg");
            }
        }
        let [min, max, velocity, acceleration] =
            fields.map(|(key, number)| Some((format!("{label}{key}"), number.as_ref()?)));
        let half = min.as_ref().xor(max.as_ref());
        if let Some((key, number)) = half {
            let message = format!("`{key}` has no counterpart");
            findings.error(
                "machine-missing-key",
                number.span(),
                message,
                "state both ends of the range or none",
            );
        }
        let unit = |value| if kind == JointKind::Rotary { maths::radians(value) } else { value };
        let mut rate = |field: Option<(String, &Number)>| {
            field.and_then(|(key, number)| positive(&key, number, findings)).map(unit)
        };
        let (max_velocity, max_acceleration) = (rate(velocity), rate(acceleration));
        list.push(AxisLimits {
            axis,
            range: range(min, max, kind, findings),
            max_velocity,
            max_acceleration,
        });
    }
    list
}

/// The home pose: it must be reachable, inside the travel, away from singularities, and come back from forward.
fn home(
    tables: &file::Tables,
    mechanism: &Mechanism,
    joints: &[Joint],
    axes: &[AxisLimits],
    singularity: SingularityGuard,
    findings: &mut Findings<'_>,
) -> Option<Pose> {
    let mut home = Pose::ZERO;
    let mut whole = true;
    for (axis, number) in tables.home.get_ref().iter() {
        let Some(number) = number else { continue };
        let key = format!("home.{}", axis.letter().to_ascii_lowercase());
        if !mechanism.axes().contains(axis) {
            let message = format!("`{key}`, but the mechanism has no axis {}", axis.letter());
            findings.error("machine-axis", number.span(), message, &format!("it has {}", letters(mechanism)));
            whole = false;
            continue;
        }
        match finite(&key, number, findings) {
            Some(value) => home.set(axis, if axis.is_rotary() { maths::radians(value) } else { value }),
            None => whole = false,
        }
    }
    if !whole {
        return None;
    }
    let span = tables.home.span();
    let mut refuse = |message: String| {
        findings.error("machine-home", span.clone(), message, "choose a home pose inside the workspace");
    };
    let reached = match mechanism.inverse(&home) {
        Ok(reached) => reached,
        Err(error) => {
            refuse(format!("the home pose is refused: {error}"));
            return None;
        }
    };
    let ranges: Vec<JointRange> = joints.iter().map(|joint| joint.range).collect();
    if let Err(limit) = JointRange::check(&ranges, &reached) {
        refuse(format!("at the home pose {}", crate::refusal::travel(&limit, joints)));
        return None;
    }
    for limits in axes {
        let (value, letter) = (home.get(limits.axis), limits.axis.letter());
        if let Some(range) = limits.range
            && !(range.min..=range.max).contains(&value)
        {
            refuse(format!("home is outside the range of axis {letter}"));
            return None;
        }
    }
    match mechanism.forward(&reached, &home) {
        Ok(back) if distance(&back, &home) <= HOME_TOLERANCE => {}
        Ok(_) => {
            refuse("the home pose belongs to another working or assembly mode".to_owned());
            return None;
        }
        Err(error) => {
            refuse(format!("the joints of the home pose have no pose: {error}"));
            return None;
        }
    }
    match mechanism.singularity(&home) {
        Ok(measure) if measure.inverse.min(measure.forward) >= singularity.guard => Some(home),
        Ok(measure) => {
            let nearest = measure.inverse.min(measure.forward);
            refuse(format!("the home pose is singular: measure {nearest:.6}, guard {}", singularity.guard));
            None
        }
        Err(error) => {
            refuse(format!("the home pose is singular: {error}"));
            None
        }
    }
}

/// Largest difference of two poses in any coordinate.
fn distance(a: &Pose, b: &Pose) -> f64 {
    a.to_array().into_iter().zip(b.to_array()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The mechanism's axes, e.g. `X Y U V`.
fn letters(mechanism: &Mechanism) -> String {
    let letters: Vec<String> = mechanism.axes().iter().map(|axis| axis.letter().to_string()).collect();
    letters.join(" ")
}
