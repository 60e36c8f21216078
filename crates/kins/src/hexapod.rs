//! Hexapod (Stewart-Gough platform): six struts of variable length between base and platform points.
//!
//! Source: geometry and conventions of LinuxCNC's `genhexkins` (manual page: base and platform coordinates per strut, A B C as
//! roll, pitch, yaw), so that results compare like for like; the solver here is our own.
//! Frame: base, mm and rad. Machine axes X Y Z A B C, R = Rz(C) Ry(B) Rx(A). Joints 1..6 = strut lengths, mm.
//!
//! | here          | genhexkins | meaning                                     |
//! |---------------|------------|---------------------------------------------|
//! | `base_mm`     | base       | strut ends on the base                      |
//! | `platform_mm` | platform   | strut ends on the platform, platform frame  |
//!
//! Inverse: Lᵢ = |p + R aᵢ − bᵢ|, closed form.
//! Forward: Newton on the six lengths from the seed (at most 32 steps, each a 6×6 elimination with pivoting, steps limited);
//!   up to 40 poses fit six lengths, the one found is that of the seed's assembly (the sign of det J is kept). A seed of all
//!   zeros means none: then the start is (0, 0, `start_z_mm`) level.
//! Singular: no inverse singularity while no strut has length 0; forward where det J = 0, measured by the reciprocal
//!   condition number of J with angles times the platform's radius.
//! Accuracy: forward(inverse(p)) within 1e-8 mm, 1e-10 rad where the measure is above 1e-3.
//! Not modelled: the lead screws' own turn when universal joints twist (genhexkins' screw lead), strut collisions.

use crate::attitude::Attitude;
use crate::errors::{self, ForwardError, GeometryError, InverseError, Key};
use crate::kinematics::{
    Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Singularity, motion_of,
};
use crate::maths::{PI, TAU, cos, fabs, floor, sin, sqrt, sqrt_2};
use crate::pair;
use crate::pose::{Axis, AxisSet, Pose};
use crate::vector::{Vec3, add, cross, dot, norm, scale, sub};

/// Hexapod as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct HexapodParameters {
    /// bᵢ, mm.
    pub base_mm: [Vec3; 6],
    /// aᵢ in the platform frame, mm.
    pub platform_mm: [Vec3; 6],
    /// Height at which forward starts without a seed, mm.
    pub start_z_mm: f64,
}

impl HexapodParameters {
    /// A symmetric 6-6 hexapod: joints in three pairs on each circle, pairs `base_spread_rad` and `platform_spread_rad` wide
    /// (between the two joints of a pair), the platform's pairs turned by 60° against the base's.
    pub fn symmetric(
        base_radius_mm: f64,
        base_spread_rad: f64,
        platform_radius_mm: f64,
        platform_spread_rad: f64,
        start_z_mm: f64,
    ) -> Self {
        let mut p = Self { base_mm: [[0.0; 3]; 6], platform_mm: [[0.0; 3]; 6], start_z_mm };
        let mut number = 0.0;
        for (base, platform) in p.base_mm.iter_mut().zip(p.platform_mm.iter_mut()) {
            // Struts 0, 2, 4 leave a base pair to the left, 1, 3, 5 to the right.
            let pair = floor(number / 2.0);
            let hand = number - 2.0 * pair - 0.5;
            let base_at = pair * TAU / 3.0 + hand * base_spread_rad;
            let platform_at = pair * TAU / 3.0 + hand * (TAU / 3.0 - platform_spread_rad);
            *base = [base_radius_mm * cos(base_at), base_radius_mm * sin(base_at), 0.0];
            *platform = [platform_radius_mm * cos(platform_at), platform_radius_mm * sin(platform_at), 0.0];
            number += 1.0;
        }
        p
    }
}

/// A valid hexapod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hexapod {
    /// Ends of the struts, two and two.
    base: [pair::Pair; 3],
    platform: [pair::Pair; 3],
    /// Radius of the platform points: makes angles comparable with lengths.
    radius: f64,
    start_z: f64,
}

/// One strut: R a, direction base → platform, length.
#[derive(Debug, Clone, Copy, Default)]
struct Strut {
    arm: Vec3,
    unit: Vec3,
    length: f64,
}

impl Hexapod {
    /// A hexapod from its parameters.
    ///
    /// # Errors
    /// `NotFinite`, `OutOfRange` name the parameter; `DegeneratePoints` if base or platform points all lie in one line.
    pub fn new(p: &HexapodParameters) -> Result<Self, GeometryError> {
        for (name, points) in [("base_mm", &p.base_mm), ("platform_mm", &p.platform_mm)] {
            for (i, point) in points.iter().enumerate() {
                for &value in point {
                    errors::coordinate(Key::at(name, i), value)?;
                }
            }
            let mut area = 0.0_f64;
            let [first, rest @ ..] = points;
            for u in rest {
                for v in rest {
                    area = area.max(norm(cross(sub(*u, *first), sub(*v, *first))));
                }
            }
            if area < 1e-6 {
                return Err(GeometryError::DegeneratePoints { key: Key::of(name) });
            }
        }
        let mut radius = 0.0_f64;
        for point in &p.platform_mm {
            radius = radius.max(norm(*point));
        }
        let start_z = errors::coordinate(Key::of("start_z_mm"), p.start_z_mm)?;
        Ok(Self { base: pair::all(&p.base_mm), platform: pair::all(&p.platform_mm), radius, start_z })
    }

    /// Radius of the platform points, mm.
    pub fn platform_radius_mm(&self) -> f64 {
        self.radius
    }

    /// Ends of the struts at a pose: on the base, on the platform (base frame, mm).
    pub fn strut_points(&self, pose: &Pose) -> [[Vec3; 2]; 6] {
        let at = Attitude::of(pose);
        let mut ends = [[[0.0; 3]; 2]; 6];
        for ((end, a), b) in ends.iter_mut().zip(pair::apart(&self.platform)).zip(pair::apart(&self.base)) {
            *end = [b, add([pose.x, pose.y, pose.z], at.rotate(a))];
        }
        ends
    }

    #[inline]
    fn struts(&self, pose: &Pose, at: &Attitude) -> Result<[Strut; 6], InverseError> {
        let mut struts = [Strut::default(); 6];
        let ends = pair::apart(&self.platform).into_iter().zip(pair::apart(&self.base));
        for ((strut, (a, b)), joint) in struts.iter_mut().zip(ends).zip(0u8..) {
            let arm = at.rotate(a);
            let d = sub(add([pose.x, pose.y, pose.z], arm), b);
            let length = norm(d);
            if !(length > 1e-9) {
                return Err(InverseError::ZeroStrut { joint });
            }
            *strut = Strut { arm, unit: scale(1.0 / length, d), length };
        }
        Ok(struts)
    }

    /// 1e12 mm: far beyond any machine, near enough that squares stay finite.
    #[inline]
    fn finite(pose: &Pose) -> Result<(), InverseError> {
        let near = fabs(pose.x) < 1e12 && fabs(pose.y) < 1e12 && fabs(pose.z) < 1e12;
        if near && pose.a.is_finite() && pose.b.is_finite() && pose.c.is_finite() {
            Ok(())
        } else {
            Err(InverseError::NotFinite)
        }
    }

    fn reach(&self, pose: &Pose) -> Result<(Attitude, [Strut; 6]), InverseError> {
        Self::finite(pose)?;
        let at = Attitude::of(pose);
        let struts = self.struts(pose, &at)?;
        Ok((at, struts))
    }

    /// ∂L/∂(v, ω r): rows (u, (R a × u)/r), dimensionless.
    fn scaled_rows(&self, struts: &[Strut; 6]) -> [[f64; 6]; 6] {
        let mut rows = [[0.0; 6]; 6];
        for (row, strut) in rows.iter_mut().zip(struts) {
            let [mx, my, mz] = scale(1.0 / self.radius, cross(strut.arm, strut.unit));
            let [ux, uy, uz] = strut.unit;
            *row = [ux, uy, uz, mx, my, mz];
        }
        rows
    }

    /// ∂L/∂(v, ω): rows struts, columns v and ω in base axes; mm/mm and mm/rad.
    ///
    /// # Errors
    /// As [`Kinematics::inverse`].
    pub fn twist_jacobian(&self, pose: &Pose) -> Result<[[f64; 6]; 6], InverseError> {
        let (_, struts) = self.reach(pose)?;
        let mut rows = [[0.0; 6]; 6];
        for (row, strut) in rows.iter_mut().zip(&struts) {
            let [mx, my, mz] = cross(strut.arm, strut.unit);
            let [ux, uy, uz] = strut.unit;
            *row = [ux, uy, uz, mx, my, mz];
        }
        Ok(rows)
    }
}

impl TryFrom<HexapodParameters> for Hexapod {
    type Error = GeometryError;
    fn try_from(parameters: HexapodParameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

/// Linear systems with six unknowns and one matrix, solved by elimination with row pivoting. By hand: nalgebra's
/// `lu().solve()` can panic.
struct Solved<const N: usize> {
    /// The unknowns of every system, unknown by unknown.
    x: [[f64; N]; 6],
    determinant: f64,
}

/// Solves rows · x = right for N right sides; `None` if a pivot is below 1e-14 (the rows here have entries of order 1).
fn solve<const N: usize>(rows: &[[f64; 6]; 6], right: &[[f64; N]; 6]) -> Option<Solved<N>> {
    let (mut m, mut sides) = (*rows, *right);
    let mut determinant = 1.0;
    for column in 0..6 {
        let mut best = column;
        let mut size = 0.0;
        for (i, row) in (column..6).zip(m.iter().skip(column)) {
            let entry = fabs(*row.get(column)?);
            if entry > size {
                (best, size) = (i, entry);
            }
        }
        if !(size > 1e-14) {
            return None;
        }
        if best != column {
            exchange(&mut m, column, best)?;
            exchange(&mut sides, column, best)?;
            determinant = -determinant;
        }
        let (pivot, below) = m.get_mut(column..)?.split_first_mut()?;
        let (side, sides_below) = sides.get_mut(column..)?.split_first_mut()?;
        let head = *pivot.get(column)?;
        determinant *= head;
        for (row, side_below) in below.iter_mut().zip(sides_below) {
            let factor = *row.get(column)? / head;
            for (entry, p) in row.iter_mut().zip(pivot.iter()).skip(column) {
                *entry -= factor * p;
            }
            for (entry, p) in side_below.iter_mut().zip(side.iter()) {
                *entry -= factor * p;
            }
        }
    }
    let mut x = [[0.0; N]; 6];
    for column in (0..6).rev() {
        let (row, mut sums) = (m.get(column)?, *sides.get(column)?);
        for (entry, known) in row.iter().zip(&x).skip(column).skip(1) {
            for (sum, known) in sums.iter_mut().zip(known) {
                *sum -= entry * known;
            }
        }
        let head = *row.get(column)?;
        *x.get_mut(column)? = sums.map(|sum| sum / head);
    }
    Some(Solved { x, determinant })
}

/// `swap` without an index that could be out of range; `above` < `below`.
fn exchange<T>(rows: &mut [T; 6], above: usize, below: usize) -> Option<()> {
    let (head, tail) = rows.split_at_mut_checked(below)?;
    core::mem::swap(head.get_mut(above)?, tail.first_mut()?);
    Some(())
}

/// 1/(‖A‖∞ ‖A⁻¹‖∞); 0 for a singular matrix.
fn reciprocal_condition(rows: &[[f64; 6]; 6]) -> f64 {
    let mut unit = [[0.0; 6]; 6];
    for (i, row) in unit.iter_mut().enumerate() {
        if let Some(one) = row.get_mut(i) {
            *one = 1.0;
        }
    }
    let Some(inverse) = solve(rows, &unit) else { return 0.0 };
    let mut largest = 0.0_f64;
    for row in rows {
        let mut sum = 0.0;
        for entry in row {
            sum += fabs(*entry);
        }
        largest = largest.max(sum);
    }
    let mut largest_inverse = 0.0_f64;
    for row in inverse.x {
        let mut sum = 0.0;
        for entry in row {
            sum += fabs(entry);
        }
        largest_inverse = largest_inverse.max(sum);
    }
    1.0 / (largest * largest_inverse)
}

impl Kinematics for Hexapod {
    fn joint_count(&self) -> usize {
        6
    }

    fn axes(&self) -> AxisSet {
        AxisSet::new(&[Axis::X, Axis::Y, Axis::Z, Axis::A, Axis::B, Axis::C])
    }

    fn joint_kind(&self, _: usize) -> JointKind {
        JointKind::Linear
    }

    fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
        ("", crate::machine::number(joint))
    }

    /// Two struts at a time, as [`Self::motion`].
    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        Self::finite(pose)?;
        let at = Attitude::of(pose);
        let mut all = [0.0; MAX_JOINTS];
        let ends = self.platform.iter().zip(&self.base);
        for (((points, bases), lengths), joints) in
            ends.zip(all.as_chunks_mut().0).zip([[0, 1], [2, 3], [4, 5]])
        {
            let (_, d) = pair::strut(&at, pose, points, bases);
            *lengths = sqrt_2(pair::dot(d, d));
            positive(*lengths, joints)?;
        }
        Ok(all)
    }

    /// Newton. Assumes the seed lies in the assembly wanted; guarantees residuals below 1e-10 mm (plus rounding of the lengths)
    /// and the seed's sign of det J.
    fn forward(&self, joints: &Joints, seed: &Pose) -> Result<Pose, ForwardError> {
        let mut size = 0.0_f64;
        for joint in joints.iter().take(6) {
            if !joint.is_finite() {
                return Err(ForwardError::NotFinite);
            }
            size = size.max(fabs(*joint));
        }
        if size > 1e7 {
            return Err(ForwardError::NoAssembly);
        }
        let mut pose = if *seed == Pose::ZERO || !seed.is_finite() {
            Pose { z: self.start_z, ..Pose::ZERO }
        } else {
            *seed
        };
        let tolerance = 1e-10 + 1e-14 * size;
        let mut side = 0.0;
        let mut residual_mm = f64::MAX;
        for iterations in 0..32 {
            let at = Attitude::of(&pose);
            let struts = self.struts(&pose, &at).map_err(|_| ForwardError::Singular { measure: 0.0 })?;
            let mut right = [[0.0]; 6];
            residual_mm = 0.0;
            for (([r], joint), strut) in right.iter_mut().zip(joints).zip(&struts) {
                *r = joint - strut.length;
                residual_mm = residual_mm.max(fabs(*r));
            }
            let Some(solved) = solve(&self.scaled_rows(&struts), &right) else {
                return Err(ForwardError::Singular { measure: 0.0 });
            };
            if iterations == 0 {
                side = solved.determinant;
            }
            if residual_mm < tolerance {
                if side * solved.determinant < 0.0 {
                    return Err(ForwardError::NoAssembly);
                }
                let wrap = |angle: f64| angle - TAU * floor((angle + PI) / TAU);
                let turned = |found: f64, wanted: f64| wanted + wrap(found - wanted);
                // Angles stay on the seed's turn.
                let [a, b, c] = [turned(pose.a, seed.a), turned(pose.b, seed.b), turned(pose.c, seed.c)];
                return Ok(Pose { x: pose.x, y: pose.y, z: pose.z, a, b, c, ..Pose::ZERO });
            }
            let [[dx], [dy], [dz], [ox], [oy], [oz]] = solved.x;
            // ω → (Ȧ, Ḃ, Ċ): the inverse of E, regular where cos B ≠ 0.
            let ((st, ct), (sp, cp)) = (at.theta, at.phi);
            if !(fabs(ct) > 1e-9) {
                return Err(ForwardError::Singular { measure: fabs(ct) });
            }
            let omega = scale(1.0 / self.radius, [ox, oy, oz]);
            let da = (cp * omega[0] + sp * omega[1]) / ct;
            let db = cp * omega[1] - sp * omega[0];
            let dc = omega[2] + st * da;
            let far = sqrt(dx * dx + dy * dy + dz * dz) / (0.5 * size);
            let wide = fabs(da).max(fabs(db)).max(fabs(dc)) / 0.5;
            let shrink = 1.0 / far.max(wide).max(1.0);
            pose.x += shrink * dx;
            pose.y += shrink * dy;
            pose.z += shrink * dz;
            pose.a += shrink * da;
            pose.b += shrink * db;
            pose.c += shrink * dc;
            if !pose.is_finite() {
                break;
            }
        }
        Err(ForwardError::NotConverged { iterations: 32, residual_mm })
    }

    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        let (at, struts) = self.reach(pose)?;
        let axes = at.axes();
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        for (row, strut) in jacobian.iter_mut().zip(&struts) {
            let moment = cross(strut.arm, strut.unit);
            let [ux, uy, uz] = strut.unit;
            let [a, b, c] = [dot(moment, axes[0]), dot(moment, axes[1]), dot(moment, axes[2])];
            *row = [ux, uy, uz, a, b, c, 0.0, 0.0, 0.0];
        }
        Ok(jacobian)
    }

    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        motion_of(self, pose, velocity, acceleration)
    }

    /// L L̇ = d·ḋ, L L̈ + L̇² = ḋ² + d·d̈, with d̈ = p̈ + (`[α]× + [ω]×²`) R a. Two struts at a time, the lengths with the operations of
    /// `struts` in their order.
    fn motion_into(
        &self,
        pose: &Pose,
        velocity: &Pose,
        acceleration: &Pose,
        motion: &mut JointMotion,
    ) -> Result<(), InverseError> {
        Self::finite(pose)?;
        let at = Attitude::of(pose);
        let (v, a) = (velocity, acceleration);
        let (omega, alpha) = at.spin(v, a);
        let bend = bend(omega, alpha);
        let lengths = motion.position.as_chunks_mut().0.iter_mut();
        let rates = motion.velocity.as_chunks_mut().0.iter_mut();
        let seconds = motion.acceleration.as_chunks_mut().0.iter_mut();
        let struts = self.platform.iter().zip(&self.base).zip(lengths).zip(rates).zip(seconds);
        for (((((points, bases), length), rate), second), joints) in struts.zip([[0, 1], [2, 3], [4, 5]]) {
            let (arm, d) = pair::strut(&at, pose, points, bases);
            *length = sqrt_2(pair::dot(d, d));
            positive(*length, joints)?;
            let part = length.map(|length| 1.0 / length);
            let d_v = pair::add(pair::both([v.x, v.y, v.z]), pair::cross(pair::both(omega), arm));
            let d_a = pair::add(pair::both([a.x, a.y, a.z]), bend.map(|row| pair::dot(pair::both(row), arm)));
            let (along, square) = (pair::dot(d, d_a), pair::dot(d_v, d_v));
            *rate = pair::times(pair::dot(d, d_v), part);
            let rest = pair::minus(square, pair::times(*rate, *rate));
            *second = pair::times(pair::plus(along, rest), part);
        }
        if v.is_finite() && a.is_finite() { Ok(()) } else { Err(InverseError::NotFinite) }
    }

    fn passage(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<Joints, InverseError> {
        let joints = self.inverse(pose)?;
        if velocity.is_finite() && acceleration.is_finite() {
            Ok(joints)
        } else {
            Err(InverseError::NotFinite)
        }
    }

    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        let (_, struts) = self.reach(pose)?;
        let forward = reciprocal_condition(&self.scaled_rows(&struts));
        Ok(Singularity { inverse: 1.0, inverse_joint: 0, forward })
    }
}

/// The rows of [α]× + [ω]×² = [α]× + ω ωᵀ − |ω|² 1: what turns an arm into its acceleration.
fn bend([x, y, z]: Vec3, [ax, ay, az]: Vec3) -> [Vec3; 3] {
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let (xy, xz, yz) = (x * y, x * z, y * z);
    [[-yy - zz, xy - az, xz + ay], [xy + az, -xx - zz, yz - ax], [xz - ay, yz + ax, -xx - yy]]
}

/// Two struts with a length.
#[inline]
fn positive(lengths: [f64; 2], joints: [u8; 2]) -> Result<(), InverseError> {
    for (length, joint) in lengths.iter().zip(joints) {
        if !(*length > 1e-9) {
            return Err(InverseError::ZeroStrut { joint });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One strut at a time, without pairs.
    fn plainly(hexapod: &Hexapod, pose: &Pose, v: &Pose, a: &Pose) -> JointMotion {
        let (at, struts) = hexapod.reach(pose).unwrap();
        let (omega, alpha) = at.spin(v, a);
        let mut motion = JointMotion::default();
        for (i, strut) in struts.iter().enumerate() {
            motion.position[i] = strut.length;
            let d = sub(add([pose.x, pose.y, pose.z], strut.arm), pair::apart(&hexapod.base)[i]);
            let d_v = add([v.x, v.y, v.z], cross(omega, strut.arm));
            let d_a = add([a.x, a.y, a.z], bend(omega, alpha).map(|row| dot(row, strut.arm)));
            let part = 1.0 / strut.length;
            let rate = dot(d, d_v) * part;
            motion.velocity[i] = rate;
            motion.acceleration[i] = (dot(d, d_a) + (dot(d_v, d_v) - rate * rate)) * part;
        }
        motion
    }

    #[test]
    fn pairs_of_struts_have_the_bits_of_single_ones() {
        let mut parameters = HexapodParameters::symmetric(400.0, 0.3, 150.0, 0.4, 500.0);
        // platform points off their plane too
        for (i, point) in parameters.platform_mm.iter_mut().enumerate() {
            point[2] = 7.0 * i as f64 - 11.0;
        }
        let hexapod = Hexapod::new(&parameters).unwrap();
        let mut state = 7_u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let mut pose = |mm: f64, rad: f64| {
            let [x, y, z] = [unit(), unit(), unit()].map(|u| u * mm);
            let [a, b, c] = [unit(), unit(), unit()].map(|u| u * rad);
            Pose { x, y, z, a, b, c, ..Pose::ZERO }
        };
        for _ in 0..5000 {
            let (mut place, v, a) = (pose(120.0, 0.6), pose(300.0, 2.0), pose(3000.0, 20.0));
            place.z += 500.0;
            let (pairs, plain) = (hexapod.motion(&place, &v, &a).unwrap(), plainly(&hexapod, &place, &v, &a));
            let bits = |motion: &JointMotion| {
                [motion.position, motion.velocity, motion.acceleration].map(|q| q.map(f64::to_bits))
            };
            assert_eq!(bits(&pairs), bits(&plain), "{place:?} {v:?} {a:?}");
        }
        // The errors name the strut: the platform's end of strut 3 (from 0) on its base.
        let [p, b] = [parameters.platform_mm[3], parameters.base_mm[3]];
        let at = Pose { x: b[0] - p[0], y: b[1] - p[1], z: b[2] - p[2], ..Pose::ZERO };
        let error = hexapod.motion(&at, &Pose::ZERO, &Pose::ZERO).unwrap_err();
        assert_eq!(error, InverseError::ZeroStrut { joint: 3 });
        let fast = Pose { x: f64::NAN, ..Pose::ZERO };
        assert_eq!(
            hexapod.motion(&Pose { z: 500.0, ..at }, &fast, &at).unwrap_err(),
            InverseError::NotFinite
        );
    }
}
