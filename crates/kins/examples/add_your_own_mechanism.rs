//! Add your own mechanism in one file: a polar machine (turntable and arm), the smallest one that has a singularity.
//!
//! Follow the order of every mechanism in `src/`: header, parameters as written, validated type, inverse, forward, Jacobian.
//! Implement [`Kinematics`] and everything else (planner, simulated HAL, command line) works with it. To ship it, move the
//! file to `src/`; `docs/add-a-mechanism.md` names every other place.
//!
//! Frame: X Y in mm, origin on the turntable's axis. Joints: 1 = arm (mm), 2 = turntable (rad).
//! Inverse: r = √(x² + y²), φ = atan2(y, x). Forward: x = r cos φ, y = r sin φ.
//! Singular: r = 0, where the turntable's rate is not defined (inverse); never forward.

#![allow(clippy::print_stdout)]

use pkm_kins::maths::{atan2, cos, sin, sqrt};
use pkm_kins::*;

/// Polar machine as written in a machine file.
struct PolarParameters {
    /// Where the turntable stands at φ = 0, degrees from x.
    zero_deg: f64,
}

/// A valid polar machine.
struct Polar {
    zero: f64,
}

impl Polar {
    fn new(p: &PolarParameters) -> Result<Self, GeometryError> {
        if !p.zero_deg.is_finite() {
            return Err(GeometryError::NotFinite { key: Key::of("zero_deg") });
        }
        Ok(Self { zero: maths::radians(p.zero_deg) })
    }
}

/// A pair among the nine places of a machine's joints.
fn joints(arm: f64, table: f64) -> Joints {
    let mut joints = [0.0; MAX_JOINTS];
    [joints[0], joints[1]] = [arm, table];
    joints
}

impl Kinematics for Polar {
    fn joint_count(&self) -> usize {
        2
    }

    fn axes(&self) -> AxisSet {
        AxisSet::new(&[Axis::X, Axis::Y])
    }

    fn joint_kind(&self, joint: usize) -> JointKind {
        if joint == 0 { JointKind::Linear } else { JointKind::Rotary }
    }

    fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
        ("", if joint == 0 { "1" } else { "2" })
    }

    fn inverse(&self, p: &Pose) -> Result<Joints, InverseError> {
        if !p.is_finite() {
            return Err(InverseError::NotFinite);
        }
        Ok(joints(sqrt(p.x * p.x + p.y * p.y), atan2(p.y, p.x) - self.zero))
    }

    fn forward(&self, q: &Joints, _: &Pose) -> Result<Pose, ForwardError> {
        if !(q[0].is_finite() && q[1].is_finite()) {
            return Err(ForwardError::NotFinite);
        }
        let angle = q[1] + self.zero;
        Ok(Pose { x: q[0] * cos(angle), y: q[0] * sin(angle), ..Pose::ZERO })
    }

    /// ∂r/∂(x, y) = (x, y)/r, ∂φ/∂(x, y) = (−y, x)/r².
    fn jacobian(&self, p: &Pose) -> Result<Jacobian, InverseError> {
        let r = self.inverse(p)?[0];
        if r < 1e-9 {
            return Err(InverseError::Singular { measure: r });
        }
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        jacobian[0][..2].copy_from_slice(&[p.x / r, p.y / r]);
        jacobian[1][..2].copy_from_slice(&[-p.y / (r * r), p.x / (r * r)]);
        Ok(jacobian)
    }

    /// r̈ = e·a + r φ̇², φ̈ = (n·a − 2 ṙ φ̇)/r.
    fn motion(&self, p: &Pose, v: &Pose, a: &Pose) -> Result<JointMotion, InverseError> {
        let k = self.jacobian(p)?;
        let position = self.inverse(p)?;
        let rate = [k[0][0] * v.x + k[0][1] * v.y, k[1][0] * v.x + k[1][1] * v.y];
        let second = [
            k[0][0] * a.x + k[0][1] * a.y + position[0] * rate[1] * rate[1],
            k[1][0] * a.x + k[1][1] * a.y - 2.0 * rate[0] * rate[1] / position[0],
        ];
        if !(second[0].is_finite() && second[1].is_finite()) {
            return Err(InverseError::NotFinite);
        }
        Ok(JointMotion {
            position,
            velocity: joints(rate[0], rate[1]),
            acceleration: joints(second[0], second[1]),
        })
    }

    fn singularity(&self, p: &Pose) -> Result<Singularity, InverseError> {
        let r = self.inverse(p)?[0];
        Ok(Singularity { inverse: r / (1.0 + r), inverse_joint: 1, forward: 1.0 })
    }
}

fn main() {
    let polar = Polar::new(&PolarParameters { zero_deg: 90.0 }).expect("valid parameters");
    let pose = Pose { x: 30.0, y: 40.0, ..Pose::ZERO };
    let q = polar.inverse(&pose).expect("in reach");
    println!("arm {:.3} mm, turntable {:.3}°", q[0], maths::degrees(q[1]));
    let back = polar.forward(&q, &pose).expect("always");
    assert!((back.x - 30.0).abs() < 1e-12 && (back.y - 40.0).abs() < 1e-12);
    // Speed along y: the arm feels 0.8 of it, the turntable the rest.
    let motion = polar.motion(&pose, &Pose { y: 10.0, ..Pose::ZERO }, &Pose::ZERO).expect("regular");
    println!("arm {:.3} mm/s, turntable {:.3}°/s", motion.velocity[0], maths::degrees(motion.velocity[1]));
    assert!((motion.velocity[0] - 8.0).abs() < 1e-12);
    let centre = polar.jacobian(&Pose::ZERO).expect_err("singular");
    println!("at the centre: {centre}");
}
