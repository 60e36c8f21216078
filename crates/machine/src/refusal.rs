//! A machine's answer to a pose or to joint positions: the mechanism's answer, within the joints' travel.

use crate::machine::{Joint, Machine};
use pkm_kins::{ForwardError, InverseError, JointKind, JointLimit, JointRange, Joints, Kinematics, Pose};

/// Why a machine refuses a pose or joint positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// Code of the kinematics specification, e.g. `unreachable:1`, `limit_high:2`, `m2:assembly`.
    pub code: String,
    /// Name of the joint at fault, where one is.
    pub joint: Option<String>,
    /// One sentence: value, limit and, where there is one, the remedy.
    pub message: String,
}

impl Machine {
    /// Pose → joints, within the travel of the joints.
    ///
    /// # Errors
    /// The mechanism's own, then the first joint outside its travel.
    pub fn inverse(&self, pose: &Pose) -> Result<Joints, Refusal> {
        let joints = self.mechanism.inverse(pose).map_err(|error| self.refused_pose(&error))?;
        self.check_travel(&joints)?;
        Ok(joints)
    }

    /// Joints → pose, the joints within their travel.
    ///
    /// # Errors
    /// The first joint outside its travel, then the mechanism's own.
    pub fn forward(&self, joints: &Joints, seed: &Pose) -> Result<Pose, Refusal> {
        self.check_travel(joints)?;
        self.mechanism.forward(joints, seed).map_err(|error| self.refused_joints(&error))
    }

    /// Checks the joints against their travel.
    ///
    /// # Errors
    /// The first joint outside it.
    pub fn check_travel(&self, joints: &Joints) -> Result<(), Refusal> {
        JointRange::check(&self.joint_ranges(), joints).map_err(|limit| self.refused_travel(&limit))
    }

    /// A joint outside its travel, for a person.
    pub fn refused_travel(&self, limit: &JointLimit) -> Refusal {
        Refusal {
            code: self.mechanism.limit_code(limit).to_string(),
            joint: self.joint_name(limit.joint),
            message: travel(limit, &self.joints),
        }
    }

    /// A pose that has no joints, for a person.
    pub fn refused_pose(&self, error: &InverseError) -> Refusal {
        let joint = match *error {
            InverseError::OutOfReach { mechanism, chain, .. }
            | InverseError::GuideSide { mechanism, chain, .. } => {
                self.joint_name(2 * usize::from(mechanism.unwrap_or(0)) + usize::from(chain))
            }
            InverseError::OnShaft { leg }
            | InverseError::LongChainReach { leg, .. }
            | InverseError::PlatformCone { leg, .. } => self.joint_name(usize::from(leg)),
            InverseError::ShortChainReach { leg, .. } | InverseError::Spacing { leg, .. } => {
                self.joint_name(3 + usize::from(leg))
            }
            InverseError::ZeroStrut { joint } => self.joint_name(usize::from(joint)),
            _ => None,
        };
        Refusal { code: error.code().to_string(), joint, message: error.to_string() }
    }

    /// Joints that have no pose, for a person.
    pub fn refused_joints(&self, error: &ForwardError) -> Refusal {
        let joint = match *error {
            ForwardError::WrongWorkingMode { mechanism, chain }
            | ForwardError::GuideSide { mechanism, chain, .. } => {
                self.joint_name(2 * usize::from(mechanism.unwrap_or(0)) + usize::from(chain))
            }
            ForwardError::LegTriangle { leg, .. } => self.joint_name(usize::from(leg)),
            ForwardError::JointLocked { joint } => self.joint_name(usize::from(joint)),
            _ => None,
        };
        Refusal { code: error.code().to_string(), joint, message: error.to_string() }
    }

    fn joint_name(&self, joint: usize) -> Option<String> {
        self.joints.get(joint).map(|joint| joint.name.clone())
    }
}

/// `joint p2 would need -3.100 mm (travel 0 to 200 mm)`; degrees for a rotary joint.
pub(crate) fn travel(limit: &JointLimit, joints: &[Joint]) -> String {
    let Some(joint) = joints.get(limit.joint) else { return format!("joint {} has no travel", limit.joint) };
    let unit = match joint.kind {
        JointKind::Linear => "mm",
        JointKind::Rotary => "°",
    };
    format!(
        "joint {} would need {:.3} {unit} (travel {} to {} {unit})",
        joint.name,
        joint.to_face(limit.value),
        joint.to_face(joint.range.min),
        joint.to_face(joint.range.max)
    )
}
