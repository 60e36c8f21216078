//! `[[joint]]` and its driver, from as written to what can run.

use crate::checks::{identifier, integer, positive, range};
use crate::drivers::DriverTiming;
use crate::file::{self, Nanoseconds, Number};
use crate::homing;
use crate::machine::Joint;
use crate::source::Findings;
use pkm_kins::machine::Mechanism;
use pkm_kins::{JointKind, Kinematics, maths};
use pkm_stepgen::{PulseTimingNs, drivers};
use std::ops::{Range, RangeInclusive};
use toml::Spanned;

/// Following error of a joint that states none, steps: half a step of rounding, one step late, one of noise.
const FOLLOWING_ERROR_STEPS: f64 = 3.0;

const DRIVER_TIME_NS: RangeInclusive<i64> = 1..=1_000_000_000;

/// All joints; `None` after noting what is wrong with any of them.
pub(crate) fn joints(
    tables: &file::Tables,
    mechanism: &Mechanism,
    timer_period_ns: u64,
    findings: &mut Findings<'_>,
) -> Option<Vec<Joint>> {
    let written = tables.joint.get_ref();
    let count = mechanism.joint_count();
    if written.len() != count {
        let message = format!("{} [[joint]] tables, but the mechanism has {count} joints", written.len());
        let span = written.get(count).map_or(tables.joint.span(), Spanned::span);
        findings.error(
            "machine-joint-count",
            span,
            message,
            "write one [[joint]] table per joint, in joint order",
        );
        return None;
    }
    for (index, joint) in written.iter().enumerate() {
        let name = &joint.get_ref().name;
        if written[..index].iter().any(|other| other.get_ref().name.get_ref() == name.get_ref()) {
            let message = format!("two joints are named `{}`", name.get_ref());
            findings.error(
                "machine-repeated-name",
                name.span(),
                message,
                "give every joint a name of its own",
            );
        }
    }
    let built: Vec<Option<Joint>> = written
        .iter()
        .enumerate()
        .map(|(index, joint)| {
            let driver = joint.get_ref().driver.as_ref().or(tables.driver.as_ref());
            build_joint(joint, mechanism.joint_kind(index), driver, timer_period_ns, findings)
        })
        .collect();
    built.into_iter().collect()
}

fn build_joint(
    joint: &Spanned<file::Joint>,
    kind: JointKind,
    driver: Option<&Spanned<file::Driver>>,
    timer_period_ns: u64,
    findings: &mut Findings<'_>,
) -> Option<Joint> {
    let span = joint.span();
    let joint = joint.get_ref();
    let name = identifier("joint name", &joint.name, findings);
    let label = format!("joint {}: ", joint.name.get_ref());
    let linear = [
        ("min_mm", &joint.min_mm),
        ("max_mm", &joint.max_mm),
        ("max_velocity_mm_s", &joint.max_velocity_mm_s),
        ("max_acceleration_mm_s2", &joint.max_acceleration_mm_s2),
        ("steps_per_mm", &joint.steps_per_mm),
    ];
    let rotary = [
        ("min_deg", &joint.min_deg),
        ("max_deg", &joint.max_deg),
        ("max_velocity_deg_s", &joint.max_velocity_deg_s),
        ("max_acceleration_deg_s2", &joint.max_acceleration_deg_s2),
        ("steps_per_deg", &joint.steps_per_deg),
    ];
    let (fields, foreign, what) = match kind {
        JointKind::Linear => (linear, rotary, "linear: its keys end in _mm"),
        JointKind::Rotary => (rotary, linear, "rotary: its keys end in _deg"),
    };
    for (key, number) in foreign {
        if let Some(number) = number {
            let message = format!("{label}`{key}`, but the joint is {what}");
            findings.error("machine-unit", number.span(), message, "use the key of the other unit");
        }
    }
    let [min, max, velocity, acceleration, steps] = fields.map(|(key, number)| {
        if number.is_none() {
            let message = format!("{label}`{key}` is missing");
            findings.error("machine-missing-key", span.clone(), message, "add it to this [[joint]] table");
        }
        Some((format!("{label}{key}"), number.as_ref()?))
    });
    let range = range(min, max, kind, findings);
    let mut positive_of =
        |field: Option<(String, &Number)>| field.and_then(|(key, number)| positive(&key, number, findings));
    let (max_velocity, max_acceleration) = (positive_of(velocity.clone()), positive_of(acceleration));
    let steps_per_unit = positive_of(steps);
    let (driver, timing) = build_driver(&label, driver, &span, timer_period_ns, findings).unzip();
    if let (Some(per_second), Some(per_unit), Some(timing), Some((key, number))) =
        (max_velocity, steps_per_unit, &timing, &velocity)
    {
        let shortest_ns = timing.on_grid(timer_period_ns).step_interval();
        let fastest = 1e9 / shortest_ns as f64;
        if per_second * per_unit > fastest {
            let message = format!(
                "{key} = {per_second} needs {} steps/s, but the driver timing allows {fastest:.0} \
                 ({shortest_ns} ns from pulse to pulse)",
                per_second * per_unit
            );
            let help = format!(
                "at most {} at {per_unit} steps per unit; or fewer steps, or a faster driver",
                fastest / per_unit
            );
            findings.error("machine-step-rate", number.span(), message, &help);
        }
    }
    let face = |value: f64, per_unit: bool| match (kind, per_unit) {
        (JointKind::Linear, _) => value,
        (JointKind::Rotary, false) => maths::radians(value),
        (JointKind::Rotary, true) => maths::degrees(value),
    };
    let fields = [
        ("following_error_mm", &joint.following_error_mm, JointKind::Linear),
        ("following_error_deg", &joint.following_error_deg, JointKind::Rotary),
    ];
    let mut following_error = None;
    for (key, number, of) in fields {
        let Some(number) = number else { continue };
        if of != kind {
            let message = format!("{label}`{key}`, but the joint is {what}");
            findings.error("machine-unit", number.span(), message, "use the key of the other unit");
        }
        following_error = Some(positive(&format!("{label}{key}"), number, findings)?);
    }
    let home = joint.home.as_ref().map(Spanned::get_ref);
    let homing = homing::joint(&label, home, kind, range?, face(max_velocity?, false), findings);
    Some(Joint {
        name: name?,
        kind,
        range: range?,
        following_error: face(following_error.unwrap_or(FOLLOWING_ERROR_STEPS / steps_per_unit?), false),
        homing: homing?,
        max_velocity: face(max_velocity?, false),
        max_acceleration: face(max_acceleration?, false),
        steps_per_unit: face(steps_per_unit?, true),
        timing: timing?,
        driver: driver?,
    })
}

/// The driver with its minima, and the times to use: as configured, or the minima; never shorter than these.
fn build_driver(
    label: &str,
    driver: Option<&Spanned<file::Driver>>,
    joint_span: &Range<usize>,
    timer_period_ns: u64,
    findings: &mut Findings<'_>,
) -> Option<(DriverTiming, PulseTimingNs)> {
    let known = || drivers::DRIVERS.map(|(name, _)| name).join(", ");
    let Some(driver) = driver else {
        let help = format!("add [driver] with `model` ({}) or `minimum`", known());
        findings.error("machine-driver", joint_span.clone(), format!("{label}no driver is stated"), &help);
        return None;
    };
    let span = driver.span();
    let driver = driver.get_ref();
    let (model, minimum) = match (&driver.model, &driver.minimum) {
        (Some(model), None) => {
            let Some((model, minimum)) = drivers::find(model.get_ref()) else {
                let message = format!("{label}no data sheet of a driver `{}` is known", model.get_ref());
                let help = format!("known are {}; for others give `minimum` in place of `model`", known());
                findings.error("machine-driver", model.span(), message, &help);
                return None;
            };
            (model, minimum)
        }
        (None, Some(minimum)) => {
            let written = minimum.get_ref();
            let mut time = |key: &str, time: &Nanoseconds| {
                integer(&format!("{label}driver.minimum.{key}"), time, DRIVER_TIME_NS, findings)
            };
            let step_length_ns = time("step_length_ns", &written.step_length_ns);
            let step_space_ns = time("step_space_ns", &written.step_space_ns);
            let direction_setup_ns = time("direction_setup_ns", &written.direction_setup_ns);
            let direction_hold_ns = time("direction_hold_ns", &written.direction_hold_ns);
            let minimum = PulseTimingNs {
                step_length: step_length_ns?,
                step_space: step_space_ns?,
                dir_setup: direction_setup_ns?,
                dir_hold: direction_hold_ns?,
            };
            ("custom", minimum)
        }
        _ => {
            let help = format!("known models are {}", known());
            findings.error(
                "machine-driver",
                span,
                format!("{label}driver needs either `model` or `minimum`"),
                &help,
            );
            return None;
        }
    };
    let usual = minimum.on_grid(timer_period_ns);
    let mut time = |key: &str, written: &Option<Nanoseconds>, minimum_ns: u64, usual_ns: u64| {
        let Some(written) = written else { return Some(usual_ns) };
        let time_ns = integer(&format!("{label}driver.{key}"), written, DRIVER_TIME_NS, findings)?;
        if time_ns < minimum_ns {
            let message = format!(
                "{label}driver.{key} = {time_ns} ns is shorter than the {minimum_ns} ns that {model} needs"
            );
            findings.error(
                "machine-driver-timing",
                written.span(),
                message,
                &format!("write {usual_ns} or more"),
            );
            return None;
        }
        Some(time_ns)
    };
    let step_length_ns =
        time("step_length_ns", &driver.step_length_ns, minimum.step_length, usual.step_length);
    let step_space_ns = time("step_space_ns", &driver.step_space_ns, minimum.step_space, usual.step_space);
    let direction_setup_ns =
        time("direction_setup_ns", &driver.direction_setup_ns, minimum.dir_setup, usual.dir_setup);
    let direction_hold_ns =
        time("direction_hold_ns", &driver.direction_hold_ns, minimum.dir_hold, usual.dir_hold);
    let timing = PulseTimingNs {
        step_length: step_length_ns?,
        step_space: step_space_ns?,
        dir_setup: direction_setup_ns?,
        dir_hold: direction_hold_ns?,
    };
    Some((DriverTiming { model: model.to_owned(), minimum }, timing))
}
