//! `[homing]` and a joint's `home`: how the machine finds its zero, and whether it may.
//!
//! While joints home, they stand at their switches or at home; the mechanism must be able to be there.

use crate::checks::{finite, not_negative, positive};
use crate::file::{self, Number};
use crate::machine::{Joint, SingularityGuard};
use crate::source::Findings;
use pkm_kins::machine::Mechanism;
use pkm_kins::{JointKind, JointRange, Joints, Kinematics, Pose, maths};
use std::ops::RangeInclusive;

/// How one joint homes; mm or rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointHoming {
    /// Place of the home switch. It is on from there to the end of the travel that the search goes to.
    pub switch: f64,
    /// Towards the switch, with sign.
    pub search_velocity: f64,
    /// Towards the switch, above 0.
    pub latch_velocity: f64,
    /// Order of homing; negative: the last move is made together.
    pub sequence: i32,
    /// Distance of the encoder's index pulses, the first after the switch being the reference; 0: the switch is.
    pub index_pitch: f64,
}

impl JointHoming {
    /// The place that is found: the switch, or the first index pulse after it.
    pub fn reference(&self) -> f64 {
        if self.index_pitch == 0.0 {
            return self.switch;
        }
        let pulses = self.switch / self.index_pitch;
        let next =
            if self.search_velocity < 0.0 { maths::ceil(pulses) - 1.0 } else { maths::floor(pulses) + 1.0 };
        next * self.index_pitch
    }
}

/// What all joints have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homing {
    /// How long a contact must have been off to count as off, s.
    pub debounce_s: f64,
    /// How long the simulated contacts bounce, ns.
    pub bounce_ns: u32,
}

const DEFAULT_DEBOUNCE_MS: f64 = 25.0;
const DEFAULT_BOUNCE_MS: f64 = 2.0;
const MOST_MS: f64 = 1000.0;
const SEQUENCES: RangeInclusive<i64> = -100..=100;

/// `[homing]`
pub(crate) fn common(tables: &file::Tables, findings: &mut Findings<'_>) -> Option<Homing> {
    let mut ms = |key: &str, number: &Option<Number>, default: f64| {
        let Some(number) = number else { return Some(default) };
        let value = not_negative(key, number, findings)?;
        if value > MOST_MS {
            let message = format!("{key} = {value} is longer than {MOST_MS} ms");
            findings.error("machine-range", number.span(), message, "contacts bounce for some 5 ms");
            return None;
        }
        Some(value)
    };
    let debounce = ms("homing.debounce_ms", &tables.homing.debounce_ms, DEFAULT_DEBOUNCE_MS);
    let bounce = ms("homing.switch_bounce_ms", &tables.homing.switch_bounce_ms, DEFAULT_BOUNCE_MS);
    Some(Homing { debounce_s: debounce? / 1e3, bounce_ns: maths::round(bounce? * 1e6) as u32 })
}

/// A joint's `home`; its switch is at the joint's place in the home pose if none is given.
pub(crate) fn joint(
    label: &str,
    written: Option<&file::JointHome>,
    kind: JointKind,
    range: JointRange,
    max_velocity: f64,
    findings: &mut Findings<'_>,
) -> Option<JointHoming> {
    let none = file::JointHome::default();
    let written = written.unwrap_or(&none);
    let linear = [
        ("switch_mm", &written.switch_mm),
        ("search_velocity_mm_s", &written.search_velocity_mm_s),
        ("latch_velocity_mm_s", &written.latch_velocity_mm_s),
        ("index_pitch_mm", &written.index_pitch_mm),
    ];
    let rotary = [
        ("switch_deg", &written.switch_deg),
        ("search_velocity_deg_s", &written.search_velocity_deg_s),
        ("latch_velocity_deg_s", &written.latch_velocity_deg_s),
        ("index_pitch_deg", &written.index_pitch_deg),
    ];
    let (fields, foreign) = match kind {
        JointKind::Linear => (linear, rotary),
        JointKind::Rotary => (rotary, linear),
    };
    for (key, number) in foreign {
        if let Some(number) = number {
            let message = format!("{label}`home.{key}` has the unit of the other kind of joint");
            findings.error(
                "machine-unit",
                number.span(),
                message,
                "_mm for linear joints, _deg for rotary ones",
            );
        }
    }
    let kept = |value: f64| if kind == JointKind::Rotary { maths::radians(value) } else { value };
    let name = |key: &str| format!("{label}home.{key}");
    let [(switch_key, switch), (search_key, search), (latch_key, latch), (pitch_key, pitch)] = fields;
    let switch = match switch {
        Some(number) => {
            let value = kept(finite(&name(switch_key), number, findings)?);
            if !range.contains(value) {
                let message = format!("{} is outside the joint's travel", name(switch_key));
                findings.error("machine-homing", number.span(), message, "put the switch inside the travel");
                return None;
            }
            value
        }
        None => f64::NAN, // at home, which is not known yet
    };
    let mut within = |key: &str, number: &Option<Number>, default: f64, signed: bool| {
        let Some(number) = number else { return Some(default) };
        let value = if signed {
            finite(&name(key), number, findings)?
        } else {
            positive(&name(key), number, findings)?
        };
        let value = kept(value);
        if value == 0.0 || value.abs() > max_velocity {
            let message = format!("{} is 0 or beyond the joint's velocity limit", name(key));
            findings.error("machine-homing", number.span(), message, "a tenth of the limit is a usual value");
            return None;
        }
        Some(value)
    };
    let search_velocity = within(search_key, search, -0.2 * max_velocity, true)?;
    let latch_velocity = within(latch_key, latch, 0.1 * search_velocity.abs(), false)?;
    let sequence = match &written.sequence {
        Some(number) if !SEQUENCES.contains(number.get_ref()) => {
            let message = format!("{}home.sequence = {} is outside -100 to 100", label, number.get_ref());
            findings.error(
                "machine-homing",
                number.span(),
                message,
                "0, 1, 2 ...; negative: the last move together",
            );
            return None;
        }
        Some(number) => *number.get_ref() as i32,
        None => 0,
    };
    let index_pitch = match pitch {
        Some(number) => kept(positive(&name(pitch_key), number, findings)?),
        None => 0.0,
    };
    Some(JointHoming { switch, search_velocity, latch_velocity, sequence, index_pitch })
}

/// Puts switches that are not stated at home, and refuses places where the mechanism cannot stand: after each sequence
/// the joints homed so far are at home and the others at their switches.
pub(crate) fn check(
    tables: &file::Tables,
    mechanism: &Mechanism,
    joints: &mut [Joint],
    home: &Pose,
    singularity: SingularityGuard,
    findings: &mut Findings<'_>,
) -> Option<()> {
    let at_home = mechanism.inverse(home).ok()?;
    for (joint, home) in joints.iter_mut().zip(&at_home) {
        if joint.homing.switch.is_nan() {
            joint.homing.switch = *home;
        }
    }
    let mut sequences: Vec<u32> = joints.iter().map(|joint| joint.homing.sequence.unsigned_abs()).collect();
    sequences.sort_unstable();
    sequences.dedup();
    for sequence in sequences {
        let mut places: Joints = at_home;
        for (joint, place) in joints.iter().zip(&mut places) {
            if joint.homing.sequence.unsigned_abs() >= sequence {
                *place = joint.homing.reference();
            }
        }
        if let Err(why) = safe(mechanism, &places, home, singularity.guard) {
            let span = joints.iter().zip(tables.joint.get_ref()).find_map(|(joint, table)| {
                let there = joint.homing.sequence.unsigned_abs() == sequence;
                table.get_ref().home.as_ref().filter(|_| there).map(toml::Spanned::span)
            });
            let message = format!(
                "homing is not safe: with the joints of sequence {sequence} and later at their switches, {why}"
            );
            let help = "move the switches nearer to the home pose, or home the joints in another sequence";
            findings.error("machine-homing", span.unwrap_or_else(|| tables.home.span()), message, help);
            return None;
        }
    }
    Some(())
}

/// Whether the mechanism can stand at these joints, in its working and assembly mode, away from singularities.
fn safe(mechanism: &Mechanism, joints: &Joints, seed: &Pose, guard: f64) -> Result<(), String> {
    let pose =
        mechanism.forward(joints, seed).map_err(|error| format!("the mechanism has no pose: {error}"))?;
    let back = mechanism.inverse(&pose).map_err(|error| format!("the mechanism cannot be there: {error}"))?;
    if back.iter().zip(joints).any(|(back, joint)| (back - joint).abs() > 1e-6) {
        return Err("the mechanism is in another working or assembly mode".to_owned());
    }
    match mechanism.singularity(&pose) {
        Ok(measure) if measure.inverse.min(measure.forward) >= guard => Ok(()),
        Ok(measure) => {
            let nearest = measure.inverse.min(measure.forward);
            Err(format!("the mechanism is singular: measure {nearest:.6}, guard {guard}"))
        }
        Err(error) => Err(format!("the mechanism is singular: {error}")),
    }
}
