//! A planar mechanism as a machine: axes X and Y are T, joints p1 and p2. So is every machine that *is* one with other parameters.

use super::Planar;
use crate::errors::{ForwardError, InverseError};
use crate::kinematics::{
    Branches, Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Singularity, motion_of,
};
use crate::pose::{Axis, AxisSet, Pose};

/// A mechanism's two joints as the first two of a machine.
fn joints([p1, p2]: [f64; 2]) -> Joints {
    let mut joints = [0.0; MAX_JOINTS];
    joints[0] = p1;
    joints[1] = p2;
    joints
}

/// Machine axes X and Y are T; joints p1 and p2.
impl Kinematics for Planar {
    fn joint_count(&self) -> usize {
        2
    }

    fn axes(&self) -> AxisSet {
        AxisSet::new(&[Axis::X, Axis::Y])
    }

    fn joint_kind(&self, _: usize) -> JointKind {
        JointKind::Linear
    }

    fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
        ("", if joint == 0 { "1" } else { "2" })
    }

    #[inline]
    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        Ok(joints(Planar::inverse(self, [pose.x, pose.y])?))
    }

    #[inline(always)]
    fn inverse_into(&self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        [joints[0], joints[1]] = Planar::inverse(self, [pose.x, pose.y])?;
        Ok(())
    }

    #[inline]
    fn forward(&self, p: &Joints, _: &Pose) -> Result<Pose, ForwardError> {
        let [x, y] = Planar::forward(self, [p[0], p[1]])?;
        Ok(Pose { x, y, ..Pose::ZERO })
    }

    #[inline(always)]
    fn forward_into(&self, p: &Joints, pose: &mut Pose) -> Result<(), ForwardError> {
        let [x, y] = Planar::forward(self, [p[0], p[1]])?;
        *pose = Pose { x, y, ..Pose::ZERO };
        Ok(())
    }

    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        let [k1, k2] = self.rates(&self.solve([pose.x, pose.y])?)?;
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        jacobian[0][..2].copy_from_slice(&k1);
        jacobian[1][..2].copy_from_slice(&k2);
        Ok(jacobian)
    }

    #[inline]
    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        motion_of(self, pose, velocity, acceleration)
    }

    #[inline]
    fn motion_into(
        &self,
        pose: &Pose,
        velocity: &Pose,
        acceleration: &Pose,
        motion: &mut JointMotion,
    ) -> Result<(), InverseError> {
        let (t, v, a) = ([pose.x, pose.y], [velocity.x, velocity.y], [acceleration.x, acceleration.y]);
        let [p, rate, second] = self.motion_2(t, v, a)?;
        [motion.position[0], motion.position[1]] = p;
        [motion.velocity[0], motion.velocity[1]] = rate;
        [motion.acceleration[0], motion.acceleration[1]] = second;
        Ok(())
    }

    #[inline]
    fn passage(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<Joints, InverseError> {
        let state = self.solve([pose.x, pose.y])?;
        self.guard(&state)?;
        // 0 times a number that is none is none.
        let still = (velocity.x + velocity.y + acceleration.x + acceleration.y) * 0.0;
        if still == 0.0 { Ok(joints(state.joints)) } else { Err(InverseError::NotFinite) }
    }

    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        Ok(self.measures(&self.solve([pose.x, pose.y])?))
    }

    fn inverse_branches(&self, pose: &Pose) -> Result<Branches<Joints>, InverseError> {
        let t = [pose.x, pose.y];
        let found = self.inverse_all(t);
        if found.as_slice().is_empty() {
            return Err(self.out_of_reach(t));
        }
        let mut all = Branches::new();
        for &p in found.as_slice() {
            all.push(joints(p));
        }
        Ok(all)
    }

    fn forward_branches(&self, p: &Joints, _: &Pose) -> Result<Branches<Pose>, ForwardError> {
        let p = [p[0], p[1]];
        self.intersect(p, self.assembly)?;
        let mut all = Branches::new();
        for &[x, y] in self.forward_all(p).as_slice() {
            all.push(Pose { x, y, ..Pose::ZERO });
        }
        Ok(all)
    }
}

/// Lets a machine that *is* a planar mechanism with other parameters answer through its core.
macro_rules! planar_kinematics {
    ($machine:ty) => {
        impl $crate::Kinematics for $machine {
            fn joint_count(&self) -> usize {
                2
            }
            fn axes(&self) -> $crate::AxisSet {
                $crate::Kinematics::axes(&self.planar)
            }
            fn joint_kind(&self, joint: usize) -> $crate::JointKind {
                self.planar.joint_kind(joint)
            }
            fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
                self.planar.joint_code(joint)
            }
            #[inline]
            fn inverse(&self, pose: &$crate::Pose) -> Result<$crate::Joints, $crate::InverseError> {
                $crate::Kinematics::inverse(&self.planar, pose)
            }
            #[inline(always)]
            fn inverse_into(
                &self,
                pose: &$crate::Pose,
                joints: &mut $crate::Joints,
            ) -> Result<(), $crate::InverseError> {
                self.planar.inverse_into(pose, joints)
            }
            #[inline]
            fn forward(
                &self,
                joints: &$crate::Joints,
                seed: &$crate::Pose,
            ) -> Result<$crate::Pose, $crate::ForwardError> {
                $crate::Kinematics::forward(&self.planar, joints, seed)
            }
            #[inline(always)]
            fn forward_into(
                &self,
                joints: &$crate::Joints,
                pose: &mut $crate::Pose,
            ) -> Result<(), $crate::ForwardError> {
                self.planar.forward_into(joints, pose)
            }
            fn jacobian(&self, pose: &$crate::Pose) -> Result<$crate::Jacobian, $crate::InverseError> {
                self.planar.jacobian(pose)
            }
            #[inline]
            fn motion(
                &self,
                pose: &$crate::Pose,
                velocity: &$crate::Pose,
                acceleration: &$crate::Pose,
            ) -> Result<$crate::JointMotion, $crate::InverseError> {
                self.planar.motion(pose, velocity, acceleration)
            }
            #[inline]
            fn motion_into(
                &self,
                pose: &$crate::Pose,
                velocity: &$crate::Pose,
                acceleration: &$crate::Pose,
                motion: &mut $crate::JointMotion,
            ) -> Result<(), $crate::InverseError> {
                self.planar.motion_into(pose, velocity, acceleration, motion)
            }
            #[inline]
            fn passage(
                &self,
                pose: &$crate::Pose,
                velocity: &$crate::Pose,
                acceleration: &$crate::Pose,
            ) -> Result<$crate::Joints, $crate::InverseError> {
                self.planar.passage(pose, velocity, acceleration)
            }
            fn singularity(&self, pose: &$crate::Pose) -> Result<$crate::Singularity, $crate::InverseError> {
                self.planar.singularity(pose)
            }
            fn inverse_branches(
                &self,
                pose: &$crate::Pose,
            ) -> Result<$crate::kinematics::Branches<$crate::Joints>, $crate::InverseError> {
                self.planar.inverse_branches(pose)
            }
            fn forward_branches(
                &self,
                joints: &$crate::Joints,
                seed: &$crate::Pose,
            ) -> Result<$crate::kinematics::Branches<$crate::Pose>, $crate::ForwardError> {
                self.planar.forward_branches(joints, seed)
            }
        }
    };
}
pub(crate) use planar_kinematics;
