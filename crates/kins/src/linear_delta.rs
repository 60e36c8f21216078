//! Linear delta: three carriages on vertical columns, three pairs of rods of one length; the platform translates.
//!
//! Source: the geometry and parameter names are those of LinuxCNC's `lineardeltakins` (manual page), so that results compare
//! like for like; the closed forms here are our own.
//! Frame: origin in the middle of the columns, Z up along them, mm. Machine axes X Y Z = platform centre. Joints 1..3 =
//! heights of the carriages' rod joints.
//!
//! | here              | lineardeltakins | meaning                                                              |
//! |-------------------|-----------------|----------------------------------------------------------------------|
//! | `joint_radius_mm` | jointradius (R) | column circle minus platform circle                                  |
//! | `joint_length_mm` | jointlength (L) | length of the rods                                                   |
//! | Aᵢ                | A, B, C         | (0, R), (−√3/2 R, −R/2), (√3/2 R, −R/2)                              |
//!
//! Inverse: qᵢ = z + √(L² − |P − Aᵢ|²), the horizontal distance; carriages above the platform (the only working mode).
//! Forward: P lies below the plane of the three carriages, on the line through their circumcentre. The triangle's horizontal
//!   projection is fixed, so its area never vanishes and no division fails.
//! Singular: rod horizontal (inverse); rods in one plane with the carriages (forward).
//! Accuracy: forward(inverse(p)) within 1e-9 mm away from singularities.

use crate::errors::{self, ForwardError, GeometryError, InverseError, Key, NoIntersection};
use crate::kinematics::{
    Branches, Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Singularity,
};
use crate::maths::{fabs, sqrt};
use crate::pose::{Axis, AxisSet, Pose};
use crate::vector::{Vec3, add, cross, dot, is_finite, norm, scale};

/// Linear delta as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct LinearDeltaParameters {
    /// R, mm.
    pub joint_radius_mm: f64,
    /// L, mm.
    pub joint_length_mm: f64,
}

/// A valid linear delta.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearDelta {
    columns: [[f64; 2]; 3],
    rod: f64,
}

/// One solved rod: horizontal vector column → P, and drop.
type Rod = ([f64; 2], f64);

impl LinearDelta {
    /// A machine from its parameters.
    ///
    /// # Errors
    /// `NotFinite`, `NotPositive`, `OutOfRange`; `NotLess` if R ≥ L: the platform could not be in the middle.
    pub fn new(p: &LinearDeltaParameters) -> Result<Self, GeometryError> {
        let key = Key::of("joint_radius_mm");
        let radius = errors::length(key, p.joint_radius_mm)?;
        let rod = errors::length(Key::of("joint_length_mm"), p.joint_length_mm)?;
        if radius >= rod {
            let than = Key::of("joint_length_mm");
            return Err(GeometryError::NotLess { key, value: radius, than, limit: rod });
        }
        let side = 0.5 * sqrt(3.0) * radius;
        Ok(Self { columns: [[0.0, radius], [-side, -0.5 * radius], [side, -0.5 * radius]], rod })
    }

    #[inline(always)]
    fn rods(&self, pose: &Pose) -> Result<[Rod; 3], InverseError> {
        let mut rods = [([0.0; 2], 0.0); 3];
        for ((rod, column), chain) in rods.iter_mut().zip(&self.columns).zip(0u8..) {
            let w = [pose.x - column[0], pose.y - column[1]];
            let square = self.rod * self.rod - (w[0] * w[0] + w[1] * w[1]);
            if !(square >= -1e-12 * self.rod * self.rod) {
                if !pose.is_finite() {
                    return Err(InverseError::NotFinite);
                }
                let deficit_mm = (sqrt(w[0] * w[0] + w[1] * w[1]) - self.rod).min(f64::MAX);
                return Err(InverseError::OutOfReach { mechanism: None, chain, deficit_mm });
            }
            *rod = (w, sqrt(if square > 0.0 { square } else { 0.0 }));
        }
        // x and y are finite here: a NaN fails the comparison above.
        if !pose.z.is_finite() {
            return Err(InverseError::NotFinite);
        }
        // P must lie below the plane of the carriages, where forward will look for it.
        if self.volume(&rods) < -1e-9 {
            return Err(InverseError::WrongAssembly { mechanism: None });
        }
        Ok(rods)
    }

    /// Triple product of the rods' unit vectors: positive with P below the carriages' plane, 0 at a type 2 singularity.
    #[inline]
    fn volume(&self, [a, b, c]: &[Rod; 3]) -> f64 {
        let up = |(w, h): &Rod| [-w[0], -w[1], *h];
        dot(up(a), cross(up(b), up(c))) / (self.rod * self.rod * self.rod)
    }

    fn guard(&self, rods: &[Rod; 3]) -> Result<(), InverseError> {
        let [(_, a), (_, b), (_, c)] = rods;
        let measure = a.min(*b).min(*c) / self.rod;
        if measure >= 1e-9 { Ok(()) } else { Err(InverseError::Singular { measure }) }
    }

    /// P below (−1) or above (+1) the plane of the carriages.
    fn intersect(&self, q: &Joints, side: f64) -> Result<Vec3, ForwardError> {
        let [q1, q2, q3] = [q[0], q[1], q[2]];
        if !is_finite([q1, q2, q3]) {
            return Err(ForwardError::NotFinite);
        }
        let too_far = ForwardError::NoIntersection { mechanism: None, reason: NoIntersection::TooFar };
        // Relative heights: beyond two rods the spheres cannot meet (and squares stay small).
        if fabs(q2 - q1) > 2.0 * self.rod || fabs(q3 - q1) > 2.0 * self.rod {
            return Err(too_far);
        }
        let [a, b, c] = self.columns;
        let u = [b[0] - a[0], b[1] - a[1], q2 - q1];
        let v = [c[0] - a[0], c[1] - a[1], q3 - q1];
        let n = cross(u, v);
        let n2 = dot(n, n);
        let centre = scale(0.5 / n2, add(scale(dot(v, v), cross(n, u)), scale(dot(u, u), cross(v, n))));
        let radius = norm(centre);
        let square = (self.rod - radius) * (self.rod + radius);
        if !(square >= -1e-12 * self.rod * self.rod) {
            return Err(too_far);
        }
        let drop = side * sqrt(if square > 0.0 { square } else { 0.0 } / n2);
        Ok(add([a[0], a[1], q1], add(centre, scale(drop, n))))
    }

    #[inline]
    fn joints(pose: &Pose, [(_, a), (_, b), (_, c)]: &[Rod; 3]) -> Joints {
        let mut joints = [0.0; MAX_JOINTS];
        [joints[0], joints[1], joints[2]] = [pose.z + a, pose.z + b, pose.z + c];
        joints
    }
}

impl TryFrom<LinearDeltaParameters> for LinearDelta {
    type Error = GeometryError;
    fn try_from(parameters: LinearDeltaParameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

impl Kinematics for LinearDelta {
    fn joint_count(&self) -> usize {
        3
    }

    fn axes(&self) -> AxisSet {
        AxisSet::new(&[Axis::X, Axis::Y, Axis::Z])
    }

    fn joint_kind(&self, _: usize) -> JointKind {
        JointKind::Linear
    }

    fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
        ("", crate::machine::number(joint))
    }

    #[inline]
    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        Ok(Self::joints(pose, &self.rods(pose)?))
    }

    fn forward(&self, joints: &Joints, _: &Pose) -> Result<Pose, ForwardError> {
        // The columns run counter-clockwise, so n points up.
        let [x, y, z] = self.intersect(joints, -1.0)?;
        for (&q, chain) in joints.iter().zip(0u8..3) {
            if q - z < -1e-9 * self.rod {
                return Err(ForwardError::WrongWorkingMode { mechanism: None, chain });
            }
        }
        Ok(Pose { x, y, z, ..Pose::ZERO })
    }

    /// ∂q/∂(x, y, z) = (−w_x/h, −w_y/h, 1).
    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        let rods = self.rods(pose)?;
        self.guard(&rods)?;
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        for (row, (w, h)) in jacobian.iter_mut().zip(rods) {
            row[..3].copy_from_slice(&[-w[0] / h, -w[1] / h, 1.0]);
        }
        Ok(jacobian)
    }

    /// h ḣ = −w·ẇ, h ḧ + ḣ² = −(ẇ² + w·ẅ).
    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        let rods = self.rods(pose)?;
        self.guard(&rods)?;
        let (v, a) = (velocity, acceleration);
        if !(v.is_finite() && a.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        let mut motion = JointMotion { position: Self::joints(pose, &rods), ..JointMotion::default() };
        let each = rods.iter().zip(motion.velocity.iter_mut()).zip(motion.acceleration.iter_mut());
        for (((w, h), rate), second) in each {
            let h_v = -(w[0] * v.x + w[1] * v.y) / h;
            let h_a = -(v.x * v.x + v.y * v.y + w[0] * a.x + w[1] * a.y + h_v * h_v) / h;
            *rate = v.z + h_v;
            *second = a.z + h_a;
        }
        Ok(motion)
    }

    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        let rods = self.rods(pose)?;
        let mut worst = Singularity { inverse: 1.0, inverse_joint: 0, forward: fabs(self.volume(&rods)) };
        for ((_, h), joint) in rods.iter().zip(0..) {
            if h / self.rod < worst.inverse {
                (worst.inverse, worst.inverse_joint) = (h / self.rod, joint);
            }
        }
        Ok(worst)
    }

    fn inverse_branches(&self, pose: &Pose) -> Result<Branches<Joints>, InverseError> {
        let rods = self.rods(pose)?;
        let mut all = Branches::new();
        for mode in 0..8u8 {
            let mut flipped = rods;
            for ((_, h), chain) in flipped.iter_mut().zip(0u8..) {
                if mode >> chain & 1 == 1 {
                    *h = -*h;
                }
            }
            all.push(Self::joints(pose, &flipped));
        }
        Ok(all)
    }

    fn forward_branches(&self, joints: &Joints, _: &Pose) -> Result<Branches<Pose>, ForwardError> {
        let mut all = Branches::new();
        for side in [-1.0, 1.0] {
            let [x, y, z] = self.intersect(joints, side)?;
            all.push(Pose { x, y, z, ..Pose::ZERO });
        }
        Ok(all)
    }
}

/// Rods end where the carriages are: used by the tests to check lengths.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::sub;

    #[test]
    fn rods_have_their_length() {
        let delta =
            LinearDelta::new(&LinearDeltaParameters { joint_radius_mm: 140.0, joint_length_mm: 270.0 })
                .unwrap();
        let pose = Pose { x: 31.0, y: -17.0, z: 55.0, ..Pose::ZERO };
        let q = delta.inverse(&pose).unwrap();
        for ([cx, cy], q) in delta.columns.into_iter().zip(q) {
            let rod = sub([cx, cy, q], [pose.x, pose.y, pose.z]);
            assert!((norm(rod) - 270.0).abs() < 1e-12 && rod[2] > 0.0);
        }
    }
}
