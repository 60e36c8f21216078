//! MOMA-W: two MOMA 4S in parallel planes hold the ends of a hot wire; x y and u v are the contours it cuts.
//!
//! Source: \[W\] G. Vasilić, S. Živanović, M. Milutinović, Z. Dimić, "Mašina alatka sa paralelnim mehanizmima namenjena za
//! sečenje penastih materijala usijanom žicom". (1)–(4) are correct as printed; the contours are in fig 3, not fig 2, and
//! the table axis, mentioned in the text, is absent from the equations.
//! Frame: workpiece {W}, x = q1, y = q2, z the planes' normal, mm. Machine axes X Y (contour 1, plane z_W = 0),
//! U V (contour 2, plane z_W = D; absolute, not relative to X Y), Z (table). Joints p1 p2 (mechanism 1), p3 p4
//! (mechanism 2), p5 = Z.
//!
//! | here                   | \[W\]     | meaning                                             |
//! |------------------------|---------|-----------------------------------------------------|
//! | `b_mm`                 | ᴮ¹p_B2  | origin of {B2} in {B1}                              |
//! | `w_mm`                 | ᴮ¹p_W   | origin of {W} in {B1}, table at 0                   |
//! | `contour_distance_mm`  | D       | distance of the contour planes                      |
//!
//! Inverse: with z₁ = w_z + z the height of contour plane 1, C₁ = (x, y) + w, C₂ = (u, v) + w:
//!   P₁ = C₁ − (z₁/D)(C₂ − C₁) in {B1} (\[W\] (3)), P₂ = C₁ − b + ((b_z − z₁)/D)(C₂ − C₁) in {B2} (\[W\] (4)), D ≠ 0;
//!   then each mechanism's own inverse.
//! Forward: both mechanisms, then the wire cut by the planes; divides by b_z ≠ 0.
//! Singular: exactly where one mechanism is. det ∂(p1..p4)/∂(x,y,u,v) = det K₁ det K₂ (b_z/D)².
//! Accuracy: as [`Planar`](crate::planar::Planar), times the ratio of the lever, |b_z/D|.
//! Not modelled: sag and drag of the wire.

use crate::errors::{self, ForwardError, GeometryError, InverseError, Key};
use crate::kinematics::{
    Branches, Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Singularity,
};
use crate::maths::{fabs, sqrt, tan};
use crate::moma_4s::{Moma4s, Moma4sConfiguration, Moma4sParameters};
use crate::planar::Vec2;
use crate::pose::{Axis, AxisSet, Pose};

/// MOMA-W as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct MomaWParameters {
    /// The two mechanisms, each in its own frame {B1}, {B2}.
    pub mechanism: [Moma4sParameters; 2],
    /// b: origin of {B2} in {B1}, mm; b_z ≠ 0.
    pub b_mm: [f64; 3],
    /// w: origin of {W} in {B1} with the table at 0, mm.
    pub w_mm: [f64; 3],
    /// D ≠ 0: distance of the contour planes, mm.
    pub contour_distance_mm: f64,
    /// Longest wire between the platforms, mm; absent: no limit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub max_wire_length_mm: Option<f64>,
    /// Largest angle between wire and the planes' normal, degrees; absent: no limit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub max_wire_tilt_deg: Option<f64>,
}

impl Default for MomaWParameters {
    /// Default dimensions, **inferred**: two MOMA 4S-P; the paper gives none.
    fn default() -> Self {
        Self {
            mechanism: [Moma4sConfiguration::P.into(); 2],
            b_mm: [0.0, 0.0, 500.0],
            w_mm: [0.0, -270.0, 100.0],
            contour_distance_mm: 200.0,
            max_wire_length_mm: None,
            max_wire_tilt_deg: None,
        }
    }
}

/// A valid MOMA-W.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MomaW {
    mechanisms: [Moma4s; 2],
    b: [f64; 3],
    w: [f64; 3],
    d: f64,
    /// Squares of the largest distance of the wire's ends in the plane (length) and of the tilt's tangent.
    max_lean_mm: f64,
    max_length_mm: f64,
    max_tangent: f64,
}

/// The wire's ends and how they depend on the contours.
struct Wire {
    /// P₁ in {B1} and P₂ in {B2}, mm.
    ends: [Vec2; 2],
    /// C₂ − C₁
    lean: Vec2,
    /// Weight of C₂ − C₁ in each end: −z₁/D and (b_z − z₁)/D.
    weights: [f64; 2],
}

impl MomaW {
    /// A MOMA-W from its parameters.
    ///
    /// # Errors
    /// Those of [`Moma4s::new`]; `DegeneratePlanes` for D = 0 or b_z = 0; `NotLess` if the wire may not even be as long
    /// as the planes' distance; `OutOfRange` for a tilt outside 0 to 89°.
    pub fn new(p: &MomaWParameters) -> Result<Self, GeometryError> {
        let vector = |name, [x, y, z]: [f64; 3]| -> Result<[f64; 3], GeometryError> {
            Ok([
                errors::coordinate(Key::at(name, 0), x)?,
                errors::coordinate(Key::at(name, 1), y)?,
                errors::coordinate(Key::at(name, 2), z)?,
            ])
        };
        let b = vector("b_mm", p.b_mm)?;
        let w = vector("w_mm", p.w_mm)?;
        let d = errors::coordinate(Key::of("contour_distance_mm"), p.contour_distance_mm)?;
        if fabs(b[2]) < 1e-3 {
            return Err(GeometryError::DegeneratePlanes { key: Key::at("b_mm", 2) });
        }
        if fabs(d) < 1e-3 {
            return Err(GeometryError::DegeneratePlanes { key: Key::of("contour_distance_mm") });
        }
        let [m1, m2] = &p.mechanism;
        let mechanisms = [Moma4s::new(m1)?, Moma4s::new(m2)?];

        let mut max_lean_mm = f64::INFINITY;
        let mut max_length_mm = f64::INFINITY;
        if let Some(length) = p.max_wire_length_mm {
            let key = Key::of("max_wire_length_mm");
            max_length_mm = errors::length(key, length)?;
            let span = fabs(b[2]);
            if max_length_mm <= span {
                return Err(GeometryError::NotLess {
                    key: Key::at("b_mm", 2),
                    value: b[2],
                    than: key,
                    limit: length,
                });
            }
            max_lean_mm = sqrt((max_length_mm - span) * (max_length_mm + span));
        }
        let mut max_tangent = f64::INFINITY;
        if let Some(value) = p.max_wire_tilt_deg {
            let key = Key::of("max_wire_tilt_deg");
            if !(value > 0.0 && value <= 89.0) {
                return Err(GeometryError::OutOfRange { key, value, low: 0.0, high: 89.0 });
            }
            max_tangent = tan(crate::maths::radians(value));
            max_lean_mm = max_lean_mm.min(max_tangent * fabs(b[2]));
        }
        Ok(Self { mechanisms, b, w, d, max_lean_mm, max_length_mm, max_tangent })
    }

    /// The two mechanisms.
    pub fn mechanisms(&self) -> &[Moma4s; 2] {
        &self.mechanisms
    }

    /// b and w, mm, and D, mm.
    pub fn frames_mm(&self) -> ([f64; 3], [f64; 3], f64) {
        (self.b, self.w, self.d)
    }

    /// The same machine without limits on the wire's length and tilt: geometry alone.
    pub fn without_limits(mut self) -> Self {
        self.max_lean_mm = f64::INFINITY;
        self
    }

    /// Height of the contour plane that is not strictly between the platform planes, if one is not.
    #[inline]
    fn outside_span(&self, z: f64) -> Option<f64> {
        let (z1, z2) = (self.w[2] + z, self.w[2] + z + self.d);
        let inside = |plane: f64| {
            if self.b[2] > 0.0 { plane > 0.0 && plane < self.b[2] } else { plane < 0.0 && plane > self.b[2] }
        };
        if !inside(z1) {
            Some(z1)
        } else if !inside(z2) {
            Some(z2)
        } else {
            None
        }
    }

    /// \[W\] (3), (4) and the checks of the wire.
    #[inline]
    fn wire(&self, pose: &Pose) -> Result<Wire, InverseError> {
        let [bx, by, bz] = self.b;
        let [wx, wy, wz] = self.w;
        if let Some(plane_mm) = self.outside_span(pose.z) {
            return Err(if pose.z.is_finite() {
                InverseError::OutsideWireSpan { plane_mm, span_mm: bz }
            } else {
                InverseError::NotFinite
            });
        }
        let z1 = wz + pose.z;
        let weights = [-z1 / self.d, (bz - z1) / self.d];
        let c1 = [pose.x + wx, pose.y + wy];
        let lean = [pose.u - pose.x, pose.v - pose.y];
        let ends = [
            [c1[0] + weights[0] * lean[0], c1[1] + weights[0] * lean[1]],
            [c1[0] - bx + weights[1] * lean[0], c1[1] - by + weights[1] * lean[1]],
        ];
        // The ends are apart by (b_z/D) lean in the plane.
        let k = bz / self.d;
        let square = k * k * (lean[0] * lean[0] + lean[1] * lean[1]);
        if square > self.max_lean_mm * self.max_lean_mm {
            return Err(self.wire_limit(square));
        }
        Ok(Wire { ends, lean, weights })
    }

    #[cold]
    fn wire_limit(&self, square: f64) -> InverseError {
        let bz = self.b[2];
        let length_mm = sqrt(square + bz * bz).min(f64::MAX);
        if length_mm > self.max_length_mm {
            return InverseError::WireLength { length_mm, limit_mm: self.max_length_mm };
        }
        InverseError::WireTilt { tangent: sqrt(square) / fabs(bz), limit: self.max_tangent }
    }

    /// The joints of both mechanisms, mm.
    #[inline]
    fn pairs(&self, pose: &Pose) -> Result<[[f64; 2]; 2], InverseError> {
        let [p1, p2] = self.wire(pose)?.ends;
        let [m1, m2] = &self.mechanisms;
        let p = m1.planar.inverse(p1).map_err(|e| e.of_mechanism(0))?;
        let q = m2.planar.inverse(p2).map_err(|e| e.of_mechanism(1))?;
        Ok([p, q])
    }

    /// P₁ in {B1} and P₂ in {B2}, mm: where the wire meets the platform planes.
    ///
    /// # Errors
    /// `NotFinite`, `OutsideWireSpan`, `WireLength`, `WireTilt`.
    pub fn wire_ends(&self, pose: &Pose) -> Result<[Vec2; 2], InverseError> {
        Ok(self.wire(pose)?.ends)
    }

    /// Length of the wire between the platforms, mm.
    ///
    /// # Errors
    /// As [`Self::wire_ends`].
    pub fn wire_length_mm(&self, pose: &Pose) -> Result<f64, InverseError> {
        let lean = self.wire(pose)?.lean;
        let k = self.b[2] / self.d;
        Ok(sqrt(k * k * (lean[0] * lean[0] + lean[1] * lean[1]) + self.b[2] * self.b[2]))
    }

    /// The wire cut by the contour planes.
    fn contours(&self, p1: Vec2, p2: Vec2, z: f64) -> Pose {
        let [bx, by, bz] = self.b;
        let [wx, wy, wz] = self.w;
        let lean = [p2[0] + bx - p1[0], p2[1] + by - p1[1]];
        let (k1, k2) = ((wz + z) / bz, (wz + z + self.d) / bz);
        Pose {
            x: p1[0] + k1 * lean[0] - wx,
            y: p1[1] + k1 * lean[1] - wy,
            z,
            u: p1[0] + k2 * lean[0] - wx,
            v: p1[1] + k2 * lean[1] - wy,
            ..Pose::ZERO
        }
    }

    fn table(&self, joints: &Joints) -> Result<f64, ForwardError> {
        let z = joints[4];
        if !z.is_finite() {
            return Err(ForwardError::NotFinite);
        }
        match self.outside_span(z) {
            Some(plane_mm) => Err(ForwardError::OutsideWireSpan { plane_mm, span_mm: self.b[2] }),
            None => Ok(z),
        }
    }
}

impl TryFrom<MomaWParameters> for MomaW {
    type Error = GeometryError;
    fn try_from(parameters: MomaWParameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

fn pack(p: [f64; 2], q: [f64; 2], z: f64) -> Joints {
    let mut joints = [0.0; MAX_JOINTS];
    [joints[0], joints[1], joints[2], joints[3], joints[4]] = [p[0], p[1], q[0], q[1], z];
    joints
}

impl Kinematics for MomaW {
    fn joint_count(&self) -> usize {
        5
    }

    fn axes(&self) -> AxisSet {
        AxisSet::new(&[Axis::X, Axis::Y, Axis::Z, Axis::U, Axis::V])
    }

    fn joint_kind(&self, _: usize) -> JointKind {
        JointKind::Linear
    }

    fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
        match joint {
            0 => ("m1:", "1"),
            1 => ("m1:", "2"),
            2 => ("m2:", "1"),
            3 => ("m2:", "2"),
            _ => ("", "5"),
        }
    }

    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        let [p, q] = self.pairs(pose)?;
        Ok(pack(p, q, pose.z))
    }

    fn inverse_into(&self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        let [[p1, p2], [q1, q2]] = self.pairs(pose)?;
        [joints[0], joints[1], joints[2], joints[3], joints[4]] = [p1, p2, q1, q2, pose.z];
        Ok(())
    }

    fn forward(&self, joints: &Joints, _: &Pose) -> Result<Pose, ForwardError> {
        let [m1, m2] = &self.mechanisms;
        let p1 = m1.planar.forward([joints[0], joints[1]]).map_err(|e| e.of_mechanism(0))?;
        let p2 = m2.planar.forward([joints[2], joints[3]]).map_err(|e| e.of_mechanism(1))?;
        Ok(self.contours(p1, p2, self.table(joints)?))
    }

    /// ∂P/∂(x,y,u,v) = M ⊗ 1, M = [[1 + z₁/D, −z₁/D], [1 − m, m]], m = (b_z − z₁)/D; ∂P/∂z = −(C₂ − C₁)/D for both.
    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        let wire = self.wire(pose)?;
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        let (pairs, table) = jacobian.split_at_mut(4);
        let each = self.mechanisms.iter().zip(wire.ends).zip(wire.weights).zip(0u8..);
        for ((((mechanism, end), m), number), rows) in each.zip(pairs.chunks_exact_mut(2)) {
            let planar = &mechanism.planar;
            let k = planar.solve(end).and_then(|s| planar.rates(&s)).map_err(|e| e.of_mechanism(number))?;
            for (row, [kx, ky]) in rows.iter_mut().zip(k) {
                let dz = -(kx * wire.lean[0] + ky * wire.lean[1]) / self.d;
                *row = [kx * (1.0 - m), ky * (1.0 - m), dz, 0.0, 0.0, 0.0, kx * m, ky * m, 0.0];
            }
        }
        if let Some(row) = table.first_mut() {
            row[2] = 1.0;
        }
        Ok(jacobian)
    }

    /// The ends depend on the contours and on z bilinearly, so the table adds −ż/D (2 d(lean)/dt) to each acceleration.
    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        let wire = self.wire(pose)?;
        let (v, a) = (velocity, acceleration);
        let lean_v = [v.u - v.x, v.v - v.y];
        let lean_a = [a.u - a.x, a.v - a.y];
        let (m_v, m_a) = (-v.z / self.d, -a.z / self.d);
        let solve = |i: u8, mechanism: &Moma4s, end: Vec2, m: f64| {
            let end_v = [v.x + m_v * wire.lean[0] + m * lean_v[0], v.y + m_v * wire.lean[1] + m * lean_v[1]];
            let end_a = [
                a.x + m_a * wire.lean[0] + 2.0 * m_v * lean_v[0] + m * lean_a[0],
                a.y + m_a * wire.lean[1] + 2.0 * m_v * lean_v[1] + m * lean_a[1],
            ];
            mechanism.planar.motion_2(end, end_v, end_a).map_err(|e| e.of_mechanism(i))
        };
        let [m1, m2] = &self.mechanisms;
        let p = solve(0, m1, wire.ends[0], wire.weights[0])?;
        let q = solve(1, m2, wire.ends[1], wire.weights[1])?;
        Ok(JointMotion {
            position: pack(p[0], q[0], pose.z),
            velocity: pack(p[1], q[1], v.z),
            acceleration: pack(p[2], q[2], a.z),
        })
    }

    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        let [p1, p2] = self.wire(pose)?.ends;
        let [m1, m2] = &self.mechanisms;
        let s = m1.planar.measures(&m1.planar.solve(p1).map_err(|e| e.of_mechanism(0))?);
        let t = m2.planar.measures(&m2.planar.solve(p2).map_err(|e| e.of_mechanism(1))?);
        let forward = s.forward.min(t.forward);
        Ok(if t.inverse < s.inverse {
            Singularity { inverse: t.inverse, inverse_joint: t.inverse_joint.saturating_add(2), forward }
        } else {
            Singularity { forward, ..s }
        })
    }

    fn inverse_branches(&self, pose: &Pose) -> Result<Branches<Joints>, InverseError> {
        let [p1, p2] = self.wire(pose)?.ends;
        let [m1, m2] = &self.mechanisms;
        let mut all = Branches::new();
        for &p in m1.planar.inverse_all(p1).as_slice() {
            for &q in m2.planar.inverse_all(p2).as_slice() {
                all.push(pack(p, q, pose.z));
            }
        }
        if all.as_slice().is_empty() {
            all.push(self.inverse(pose)?);
        }
        Ok(all)
    }

    fn forward_branches(&self, joints: &Joints, seed: &Pose) -> Result<Branches<Pose>, ForwardError> {
        let [m1, m2] = &self.mechanisms;
        let z = self.table(joints)?;
        let mut all = Branches::new();
        for &p1 in m1.planar.forward_all([joints[0], joints[1]]).as_slice() {
            for &p2 in m2.planar.forward_all([joints[2], joints[3]]).as_slice() {
                all.push(self.contours(p1, p2, z));
            }
        }
        if all.as_slice().is_empty() {
            all.push(self.forward(joints, seed)?);
        }
        Ok(all)
    }
}
