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
    Branches, Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Singularity, motion_of,
};
use crate::maths::{fabs, sqrt, sqrt_2};
use crate::pose::{Axis, AxisSet, Pose};
use crate::vector::{Vec3, cross, dot, is_finite};

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
    /// |u|² of level carriages, 3 R².
    side2: f64,
    /// Slack at the edge of reach, −1e-12 L².
    edge: f64,
    /// Slack of a horizontal rod, −1e-9 L.
    below: f64,
    /// Slack at the plane of the carriages, −1e-9 L³.
    plane: f64,
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
        Ok(Self {
            columns: [[0.0, radius], [-side, -0.5 * radius], [side, -0.5 * radius]],
            rod,
            side2: 3.0 * radius * radius,
            edge: -1e-12 * rod * rod,
            below: -1e-9 * rod,
            plane: -1e-9 * rod * rod * rod,
        })
    }

    /// The columns, moved inwards by the platform's radius: where the rods hinge when all meet in the platform's centre, mm.
    pub fn columns_mm(&self) -> [[f64; 2]; 3] {
        self.columns
    }

    #[inline(always)]
    fn rods(&self, pose: &Pose) -> Result<[Rod; 3], InverseError> {
        let [wa, wb, wc] = self.columns.map(|column| [pose.x - column[0], pose.y - column[1]]);
        let square = |w: [f64; 2]| self.rod * self.rod - (w[0] * w[0] + w[1] * w[1]);
        let (a, b, c) = (square(wa), square(wb), square(wc));
        // NaN in x or y fails here, too.
        if !(a >= self.edge && b >= self.edge && c >= self.edge && pose.z.is_finite()) {
            return Err(self.out_of_reach(pose));
        }
        let clamp = |square: f64| if square > 0.0 { square } else { 0.0 };
        let [a, b] = sqrt_2([clamp(a), clamp(b)]);
        let rods = [(wa, a), (wb, b), (wc, sqrt(clamp(c)))];
        // P must lie below the plane of the carriages, where forward will look for it.
        if Self::volume(&rods) < self.plane {
            return Err(InverseError::WrongAssembly { mechanism: None });
        }
        Ok(rods)
    }

    #[cold]
    fn out_of_reach(&self, pose: &Pose) -> InverseError {
        if !is_finite([pose.x, pose.y, pose.z]) {
            return InverseError::NotFinite;
        }
        let mut first = (0, 0.0);
        for (column, chain) in self.columns.iter().zip(0u8..) {
            let w = [pose.x - column[0], pose.y - column[1]];
            let square = w[0] * w[0] + w[1] * w[1];
            if !(self.rod * self.rod - square >= self.edge) {
                first = (chain, (sqrt(square) - self.rod).min(f64::MAX));
                break;
            }
        }
        InverseError::OutOfReach { mechanism: None, chain: first.0, deficit_mm: first.1 }
    }

    /// Triple product of the rods, mm³: positive with P below the carriages' plane, 0 at a type 2 singularity.
    #[inline(always)]
    fn volume([a, b, c]: &[Rod; 3]) -> f64 {
        let up = |(w, h): &Rod| [-w[0], -w[1], *h];
        dot(up(a), cross(up(b), up(c)))
    }

    fn guard(&self, rods: &[Rod; 3]) -> Result<(), InverseError> {
        let [(_, a), (_, b), (_, c)] = rods;
        let measure = a.min(*b).min(*c) / self.rod;
        if measure >= 1e-9 { Ok(()) } else { Err(InverseError::Singular { measure }) }
    }

    /// P below (−1) or above (+1) the plane of the carriages. With u, v from carriage 1 to 2 and 3, n = u × v: circumcentre
    /// (|v|² u·(u − v) u + |u|² v·(v − u) v)/2n², circumradius |u| |v| |u − v|/2|n|. The columns stand in an equilateral
    /// triangle, so only the heights vary.
    #[inline(always)]
    fn intersect(&self, q: &Joints, side: f64) -> Result<Vec3, ForwardError> {
        let (u, v) = (q[1] - q[0], q[2] - q[0]);
        // Beyond two rods the spheres cannot meet. NaN and infinities fail here, too.
        if !(fabs(u) <= 2.0 * self.rod && fabs(v) <= 2.0 * self.rod) {
            return Err(Self::too_far(q));
        }
        let [[_, r], _, [s, _]] = self.columns;
        let (uu, vv, ww) = (self.side2 + u * u, self.side2 + v * v, self.side2 + (u - v) * (u - v));
        let uv = 0.5 * self.side2 + u * v;
        let n = [1.5 * r * (u - v), s * (u + v), 3.0 * r * s];
        let inverse = 0.5 / dot(n, n);
        let square = self.rod * self.rod - 0.5 * inverse * (uu * vv * ww);
        if !(square >= self.edge) {
            return Err(Self::too_far(q));
        }
        let drop = side * sqrt(2.0 * inverse * if square > 0.0 { square } else { 0.0 });
        let (f, g) = (inverse * vv * (uu - uv), inverse * uu * (vv - uv));
        let (x, y) = (s * (g - f), r - 1.5 * r * (f + g));
        Ok([x + drop * n[0], y + drop * n[1], q[0] + (f * u + g * v) + drop * n[2]])
    }

    #[cold]
    fn too_far(q: &Joints) -> ForwardError {
        if !is_finite([q[0], q[1], q[2]]) {
            return ForwardError::NotFinite;
        }
        ForwardError::NoIntersection { mechanism: None, reason: NoIntersection::TooFar }
    }

    /// P below the plane of the carriages, each carriage above P.
    #[inline(always)]
    fn platform(&self, q: &Joints) -> Result<Vec3, ForwardError> {
        // The columns run counter-clockwise, so n points up.
        let p = self.intersect(q, -1.0)?;
        for (&q, chain) in q.iter().zip(0u8..3) {
            if q - p[2] < self.below {
                return Err(ForwardError::WrongWorkingMode { mechanism: None, chain });
            }
        }
        Ok(p)
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

    #[inline(always)]
    fn inverse_into(&self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        let [(_, a), (_, b), (_, c)] = self.rods(pose)?;
        [joints[0], joints[1], joints[2]] = [pose.z + a, pose.z + b, pose.z + c];
        Ok(())
    }

    #[inline]
    fn forward(&self, joints: &Joints, _: &Pose) -> Result<Pose, ForwardError> {
        let [x, y, z] = self.platform(joints)?;
        Ok(Pose { x, y, z, ..Pose::ZERO })
    }

    #[inline(always)]
    fn forward_into(&self, joints: &Joints, pose: &mut Pose) -> Result<(), ForwardError> {
        let [x, y, z] = self.platform(joints)?;
        *pose = Pose { x, y, z, ..Pose::ZERO };
        Ok(())
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

    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        motion_of(self, pose, velocity, acceleration)
    }

    /// h ḣ = −w·ẇ, h ḧ + ḣ² = −(ẇ² + w·ẅ).
    #[inline]
    fn motion_into(
        &self,
        pose: &Pose,
        velocity: &Pose,
        acceleration: &Pose,
        motion: &mut JointMotion,
    ) -> Result<(), InverseError> {
        let rods = self.rods(pose)?;
        self.guard(&rods)?;
        let (v, a) = (velocity, acceleration);
        if !(v.is_finite() && a.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        for (joint, (w, h)) in rods.iter().enumerate() {
            let part = 1.0 / h;
            let h_v = -(w[0] * v.x + w[1] * v.y) * part;
            let h_a = -(v.x * v.x + v.y * v.y + w[0] * a.x + w[1] * a.y + h_v * h_v) * part;
            motion.position[joint] = pose.z + h;
            motion.velocity[joint] = v.z + h_v;
            motion.acceleration[joint] = a.z + h_a;
        }
        Ok(())
    }

    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        let rods = self.rods(pose)?;
        let volume = Self::volume(&rods) / (self.rod * self.rod * self.rod);
        let mut worst = Singularity { inverse: 1.0, inverse_joint: 0, forward: fabs(volume) };
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
    use crate::vector::{norm, sub};

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
