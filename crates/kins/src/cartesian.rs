//! Plain Cartesian machine: joint = coordinate, for any set of axes. LinuxCNC's `trivkins`.
//!
//! Source: none needed. Frame: the machine's own, mm and rad. Joints in axis letter order XYZABCUVW.
//! Inverse, forward and Jacobian: identity. Singular: never. Accuracy: exact.

use crate::errors::{ForwardError, GeometryError, InverseError};
use crate::kinematics::{Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Singularity};
use crate::pose::{Axis, AxisSet, Pose};

/// A valid Cartesian machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cartesian {
    axes: AxisSet,
    joints: usize,
    /// The coordinate of each joint, as its place in letter order.
    order: [u8; MAX_JOINTS],
}

impl Cartesian {
    /// A machine with these axes.
    ///
    /// # Errors
    /// `NoAxis` if the set is empty.
    pub fn new(axes: AxisSet) -> Result<Self, GeometryError> {
        match axes.iter().count() {
            0 => Err(GeometryError::NoAxis),
            joints => {
                let mut order = [0; MAX_JOINTS];
                for (place, axis) in order.iter_mut().zip(axes.iter()) {
                    *place = axis as u8;
                }
                Ok(Self { axes, joints, order })
            }
        }
    }

    /// The coordinates of the set, packed in letter order.
    fn pack(&self, pose: &Pose) -> Joints {
        let mut joints = [0.0; MAX_JOINTS];
        self.write(pose, &mut joints);
        joints
    }

    #[inline]
    fn write(&self, pose: &Pose, joints: &mut Joints) {
        let all = pose.to_array();
        for (joint, &place) in joints.iter_mut().zip(&self.order).take(self.joints) {
            if let Some(value) = all.get(usize::from(place)) {
                *joint = *value;
            }
        }
    }

    fn axis(&self, joint: usize) -> Axis {
        self.axes.iter().nth(joint).unwrap_or(Axis::X)
    }
}

impl Kinematics for Cartesian {
    fn joint_count(&self) -> usize {
        self.joints
    }

    fn axes(&self) -> AxisSet {
        self.axes
    }

    fn joint_kind(&self, joint: usize) -> JointKind {
        if self.axis(joint).is_rotary() { JointKind::Rotary } else { JointKind::Linear }
    }

    fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
        ("", crate::machine::number(joint))
    }

    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        if !pose.is_finite() {
            return Err(InverseError::NotFinite);
        }
        Ok(self.pack(pose))
    }

    fn inverse_into(&self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        if !pose.is_finite() {
            return Err(InverseError::NotFinite);
        }
        self.write(pose, joints);
        Ok(())
    }

    fn forward(&self, joints: &Joints, _: &Pose) -> Result<Pose, ForwardError> {
        let mut pose = Pose::ZERO;
        for (&joint, axis) in joints.iter().zip(self.axes.iter()) {
            if !joint.is_finite() {
                return Err(ForwardError::NotFinite);
            }
            pose.set(axis, joint);
        }
        Ok(pose)
    }

    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        if !pose.is_finite() {
            return Err(InverseError::NotFinite);
        }
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        for (row, axis) in jacobian.iter_mut().zip(self.axes.iter()) {
            for (entry, column) in row.iter_mut().zip(Axis::ALL) {
                if column == axis {
                    *entry = 1.0;
                }
            }
        }
        Ok(jacobian)
    }

    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        if !(pose.is_finite() && velocity.is_finite() && acceleration.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        Ok(JointMotion {
            position: self.pack(pose),
            velocity: self.pack(velocity),
            acceleration: self.pack(acceleration),
        })
    }

    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        self.inverse(pose)?;
        Ok(Singularity { inverse: 1.0, inverse_joint: 0, forward: 1.0 })
    }
}
