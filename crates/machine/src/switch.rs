//! `[[switch]]`: M codes that make the other mechanism of an HV-Mill the active one, or take an O-X glide into its other
//! form. A switch is a command of its own, with checks of its own; no move ever does it by the way.

use crate::file;
use crate::machine::Machine;
use crate::refusal::Refusal;
use crate::source::Findings;
use pkm_canon::{MACHINE_CODES, MOST_MACHINE_CODES};
use pkm_kins::{
    FormSwitchError, InverseError, JointLimit, Joints, Kinematics, Mechanism, OxForm, Pose, Spindle, maths,
};
use std::fmt;

/// An M code and what it switches to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Switch {
    /// Number of the M code, of [`MACHINE_CODES`].
    pub code: i32,
    /// What it switches to.
    pub to: SwitchTarget,
}

/// What can be switched to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SwitchTarget {
    /// A mechanism of the HV-Mill.
    Mechanism(Spindle),
    /// A form of the O-X glide.
    Form(OxForm),
}

impl fmt::Display for SwitchTarget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mechanism(spindle) => write!(f, "mechanism {spindle:?}"),
            Self::Form(form) => write!(f, "form {form:?}"),
        }
    }
}

/// A checked switch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switched {
    /// The mechanism from now on.
    pub mechanism: Mechanism,
    /// Where the program stands then: coordinates that the mechanism does not move are as they were, mm and rad.
    pub pose: Pose,
    /// Where the joints stand then, mm or rad. Where that is elsewhere than now, they are to be driven there linearly
    /// and together, on a straight line in joint space.
    pub joints: Joints,
}

/// How far the joints of the pose after a switch may be from where the joints stand, mm or rad.
const JOINT_TOLERANCE: f64 = 1e-6;

impl Machine {
    /// What an M code switches to, if it is one of this machine's.
    pub fn switch_of(&self, code: i32) -> Option<SwitchTarget> {
        self.switches.iter().find(|switch| switch.code == code).map(|switch| switch.to)
    }

    /// Checks a switch of the machine that stands at `joints` and, in the coordinates of its `active` mechanism, at
    /// `pose`. Switching to what is active already changes nothing.
    ///
    /// # Errors
    /// The state after it is no valid one of the mechanism, belongs to another working mode, is outside travel or axis
    /// range or nearer to a singularity than the guard; or, for a form switch: it begins nearer to c = 0 than the guard,
    /// a slider would leave its rail, y would leave its range on the way.
    pub fn switch(
        &self,
        active: &Mechanism,
        to: SwitchTarget,
        joints: &Joints,
        pose: &Pose,
    ) -> Result<Switched, Refusal> {
        let switched = match (active, to) {
            (Mechanism::HvMachine(machine), SwitchTarget::Mechanism(spindle)) => {
                if machine.active() == spindle {
                    return Ok(Switched { mechanism: *active, pose: *pose, joints: *joints });
                }
                let (machine, pose) =
                    machine.switch(spindle, joints, pose).map_err(|error| self.refused_joints(&error))?;
                Switched { mechanism: machine.into(), pose, joints: *joints }
            }
            (Mechanism::OxGlide(machine), SwitchTarget::Form(form)) => {
                if machine.form() == form {
                    return Ok(Switched { mechanism: *active, pose: *pose, joints: *joints });
                }
                let switch = machine
                    .form_switch(joints, &self.joint_ranges())
                    .map_err(|error| self.refused_form_switch(&error))?;
                // Halfway c = 0: the links stand at right angles to the rails, and y is their length.
                let c = (switch.joints[0] - joints[0]) / 2.0;
                let y = maths::sqrt(switch.pose.y * switch.pose.y + c * c);
                self.check_axes(&Pose { y, ..switch.pose })?;
                Switched { mechanism: switch.machine.into(), pose: switch.pose, joints: switch.joints }
            }
            _ => return Err(refusal("switch", format!("this machine has no {to}"))),
        };
        self.check_switched(&switched, to)?;
        Ok(switched)
    }

    /// The program must be able to go on from the state after a switch.
    fn check_switched(&self, after: &Switched, to: SwitchTarget) -> Result<(), Refusal> {
        let joints = after.mechanism.inverse(&after.pose).map_err(|error| self.refused_pose(&error))?;
        if !joints.iter().zip(&after.joints).all(|(a, b)| (a - b).abs() <= JOINT_TOLERANCE) {
            let message = format!("the joints stand in another working or assembly mode of {to}");
            return Err(refusal("working_mode", message));
        }
        self.check_travel(&joints)?;
        self.check_axes(&after.pose)?;
        let measure = after.mechanism.singularity(&after.pose).map_err(|error| self.refused_pose(&error))?;
        let measure = measure.inverse.min(measure.forward);
        if !(measure >= self.singularity.guard) {
            return Err(self.refused_pose(&InverseError::Singular { measure }));
        }
        Ok(())
    }

    /// Checks a pose against the ranges of the axes.
    ///
    /// # Errors
    /// The first axis outside its range.
    pub fn check_axes(&self, pose: &Pose) -> Result<(), Refusal> {
        for limits in &self.axes {
            let Some(range) = limits.range else { continue };
            let value = pose.get(limits.axis);
            let within = range.contains(value);
            if !within {
                let letter = limits.axis.letter();
                let (unit, face): (_, fn(f64) -> f64) =
                    if limits.axis.is_rotary() { ("°", maths::degrees) } else { ("mm", |v| v) };
                let side = if value < range.min { "low" } else { "high" };
                let message = format!(
                    "{letter} would come to {:.4} {unit}, outside the axis' range of {} to {} {unit}",
                    face(value),
                    face(range.min),
                    face(range.max)
                );
                return Err(refusal(&format!("axis_limit_{side}:{letter}"), message));
            }
        }
        Ok(())
    }

    fn refused_form_switch(&self, error: &FormSwitchError) -> Refusal {
        match error {
            FormSwitchError::State(error) => self.refused_joints(error),
            FormSwitchError::TooNear { .. } => refusal("singular:form_switch", error.to_string()),
            FormSwitchError::Travel(limit) => {
                let JointLimit { joint, .. } = *limit;
                let name = self.joints.get(joint).map(|joint| joint.name.clone());
                let code = self.mechanism.limit_code(limit).to_string();
                Refusal { code, joint: name, message: error.to_string() }
            }
        }
    }
}

fn refusal(code: &str, message: String) -> Refusal {
    Refusal { code: code.to_owned(), joint: None, message }
}

/// All `[[switch]]` tables; `None` after noting what is wrong with any of them.
pub(crate) fn switches(
    tables: &file::Tables,
    mechanism: &Mechanism,
    findings: &mut Findings<'_>,
) -> Option<Vec<Switch>> {
    let written = &tables.switch;
    let mut list: Vec<Switch> = Vec::new();
    for table in written {
        let file::Switch { code, to } = table.get_ref();
        let mut refuse =
            |span, message: String, help: &str| findings.error("machine-switch", span, message, help);
        let (target, known) = match mechanism {
            Mechanism::HvMachine(_) => (
                match to.get_ref().as_str() {
                    "H" | "h" => Some(SwitchTarget::Mechanism(Spindle::H)),
                    "V" | "v" => Some(SwitchTarget::Mechanism(Spindle::V)),
                    _ => None,
                },
                "the mechanisms are \"H\" and \"V\"",
            ),
            Mechanism::OxGlide(_) => (
                match to.get_ref().as_str() {
                    "O" | "o" => Some(SwitchTarget::Form(OxForm::O)),
                    "X" | "x" => Some(SwitchTarget::Form(OxForm::X)),
                    _ => None,
                },
                "the forms are \"O\" and \"X\"",
            ),
            _ => {
                let message = "this mechanism has nothing to switch".to_owned();
                refuse(
                    table.span(),
                    message,
                    "only the types hv-machine and ox-glide have; remove the table",
                );
                continue;
            }
        };
        if target.is_none() {
            refuse(to.span(), format!("to = {:?} cannot be switched to", to.get_ref()), known);
        }
        let number = i32::try_from(*code.get_ref()).ok().filter(|number| MACHINE_CODES.contains(number));
        match number {
            None => {
                let (first, last) = (MACHINE_CODES.start(), MACHINE_CODES.end());
                let message = format!("code = {} is outside {first} to {last}", code.get_ref());
                refuse(code.span(), message, "M codes below belong to the language");
            }
            Some(number) if list.iter().any(|known| known.code == number) => {
                let message = format!("M{number} would switch to two things");
                refuse(code.span(), message, "give every [[switch]] a code of its own");
            }
            Some(code) => list.extend(target.map(|to| Switch { code, to })),
        }
    }
    if let Some(table) = written.get(MOST_MACHINE_CODES) {
        let message = format!("more than {MOST_MACHINE_CODES} [[switch]] tables");
        findings.error("machine-switch", table.span(), message, "one for each state is enough");
    }
    (list.len() == written.len() && written.len() <= MOST_MACHINE_CODES).then_some(list)
}
