//! Orientation by A, B, C: R = Rz(C) Ry(B) Rx(A), fixed-axis roll, pitch, yaw, as LinuxCNC's hexapod uses it.

use crate::maths::sincos;
use crate::pose::Pose;
use crate::vector::{Vec3, add, scale};

/// Sines and cosines of A (ψ), B (θ), C (φ).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attitude {
    pub(crate) psi: (f64, f64),
    pub(crate) theta: (f64, f64),
    pub(crate) phi: (f64, f64),
}

impl Attitude {
    #[inline]
    pub(crate) fn of(pose: &Pose) -> Self {
        Self { psi: sincos(pose.a), theta: sincos(pose.b), phi: sincos(pose.c) }
    }

    /// Ry(θ) Rx(ψ) b for b in the plane z = 0: horizontal part and height, before the yaw.
    #[inline]
    pub(crate) fn tilted(&self, [bx, by]: [f64; 2]) -> Vec3 {
        let ((ss, cs), (st, ct)) = (self.psi, self.theta);
        [ct * bx + st * ss * by, cs * by, ct * ss * by - st * bx]
    }

    /// R b
    #[inline]
    pub(crate) fn rotate(&self, [bx, by, bz]: Vec3) -> Vec3 {
        let ((ss, cs), (st, ct)) = (self.psi, self.theta);
        let (y, z) = (cs * by - ss * bz, ss * by + cs * bz);
        yawed(self.phi, [ct * bx + st * z, y, ct * z - st * bx])
    }

    /// The axes of Ȧ, Ḃ and Ċ in the base frame: the columns of E; ω = E (Ȧ, Ḃ, Ċ), det E = cos θ.
    pub(crate) fn axes(&self) -> [Vec3; 3] {
        let ((st, ct), (sp, cp)) = (self.theta, self.phi);
        [[cp * ct, sp * ct, -st], [-sp, cp, 0.0], [0.0, 0.0, 1.0]]
    }

    /// ω and α = E (Ä, B̈, C̈) + Ė (Ȧ, Ḃ, Ċ).
    pub(crate) fn spin(&self, velocity: &Pose, acceleration: &Pose) -> (Vec3, Vec3) {
        let [e1, e2, e3] = self.axes();
        let ((st, ct), (sp, cp)) = (self.theta, self.phi);
        let (v, a) = (velocity, acceleration);
        let e1_rate = [-sp * v.c * ct - cp * st * v.b, cp * v.c * ct - sp * st * v.b, -ct * v.b];
        let e2_rate = [-cp * v.c, -sp * v.c, 0.0];
        let omega = add(add(scale(v.a, e1), scale(v.b, e2)), scale(v.c, e3));
        let alpha = add(
            add(add(scale(a.a, e1), scale(a.b, e2)), scale(a.c, e3)),
            add(scale(v.a, e1_rate), scale(v.b, e2_rate)),
        );
        (omega, alpha)
    }
}

/// Rz v, with the yaw's sine and cosine.
#[inline]
pub(crate) fn yawed((s, c): (f64, f64), [x, y, z]: Vec3) -> Vec3 {
    [c * x - s * y, s * x + c * y, z]
}
