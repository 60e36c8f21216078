//! Lambda: a platform on three long chains, each braced by a short one; six sliders on three vertical shafts, six
//! degrees of freedom.
//!
//! Source: \[L6\] Nešovanović and Živanović, "Workspace and kinematic structure analysis of a 6-DOF Lambda parallel kinematic
//! machine", IJEEC 6(1), 2022, doi 10.7251/IJEEC2206001N.
//! Frame: base, origin in the middle of the shaft circle in the plane where all sliders are 0, Z up (z of the platform is
//! negative), mm and rad. Machine axes X Y Z A B C = x y z ψ θ φ, R = Rz(φ) Ry(θ) Rx(ψ). Joints l1..l6, **downwards**;
//! l1..l3 the upper sliders (long chains), l4..l6 the lower ones (short chains) of the same legs.
//!
//! | here              | \[L6\]   | meaning                                                        |
//! |-------------------|--------|----------------------------------------------------------------|
//! | `base_radius_mm`  | C      | radius of the shaft circle                                     |
//! | `platform_radius_mm` | D   | radius (not a side) of the circle of the platform joints       |
//! | `c_mm`, `r_mm`, `u_mm` | c, r, u | long chain, its part from J to N, short chain             |
//! | e, k              | –      | c − r; e/c                                                     |
//! | `yaw_offset_deg`  | –      | δ: turns the platform joints against the shafts; 0 in \[L6\]     |
//! | ρ, h, g           | –      | distance of N from its shaft; drops of long and short chain    |
//! | σ                 | –      | measure of the direct singularity; its sign is the assembly    |
//!
//! Inverse: \[L6\] P(6)–P(11), closed form, evaluated with ρ² (the printed form subtracts numbers of order z²).
//!   l_i = −N_z − h, l_{i+3} = l_i + k h + g. Working mode of the paper, the only one: slider above N, lower slider below J.
//! Forward: each leg's triangle gives ρ and the height of N; z, ψ, θ follow in closed form; x, y, φ by Newton on the planar
//!   three-circle problem: quadratic, at most 16 solves of 3×3 (2 with a warm start a servo period old). If it fails or ends
//!   in the other assembly: all real solutions (at most six) from a trigonometric polynomial of degree 3, bounded.
//! Singular: chain horizontal (h or g = 0, inverse); N on its shaft, or the three vertical planes through shaft and N
//!   with a common line (σ = 0, forward). \[L6\] does not mention that with δ = 0 every pose with zero angles has σ = 0.
//! Accuracy: forward(inverse(p)) within 1e-6 mm, 1e-9 rad where |σ| ≥ 0.1 (typically 1e-10 mm).
//! Not modelled: collisions, joint cones at the sliders. All default dimensions are **inferred**, the paper prints none.

mod three_circles;

use self::three_circles::{Circles, Planar3, wrap};
use crate::attitude::{Attitude, yawed};
use crate::errors::{self, ForwardError, GeometryError, InverseError, Key};
use crate::kinematics::{
    Branches, Jacobian, JointKind, JointLimit, JointMotion, Joints, Kinematics, LimitCode, MAX_JOINTS, Side,
    Singularity,
};
use crate::maths::{PI, acos, atan2, cos, cos_sin_deg, fabs, radians, sincos, sqrt};
use crate::pose::{Axis, AxisSet, Pose};
use crate::vector::{Vec3, add, cross, dot, is_finite};

/// Lambda as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct Lambda6Parameters {
    /// C, mm.
    pub base_radius_mm: f64,
    /// D, mm.
    pub platform_radius_mm: f64,
    /// cᵢ: long chains, mm.
    pub c_mm: [f64; 3],
    /// rᵢ: from the rotary joint to the platform joint, mm.
    pub r_mm: [f64; 3],
    /// uᵢ: short chains, mm.
    pub u_mm: [f64; 3],
    /// δ, degrees.
    #[cfg_attr(feature = "serde", serde(default))]
    pub yaw_offset_deg: f64,
    /// Assembly: the sign of σ, ±1.
    #[cfg_attr(feature = "serde", serde(default = "plus"))]
    pub assembly: i8,
    /// Smallest and largest distance of the two sliders of a shaft, mm; absent: no limit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub spacing_mm: Option<[f64; 2]>,
    /// Largest angle between a long chain and the platform's normal, degrees; absent: no limit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub platform_cone_deg: Option<f64>,
    /// Forward answers `Singular` where |σ| is smaller.
    #[cfg_attr(feature = "serde", serde(default = "default_sigma_min"))]
    pub sigma_min: f64,
}

#[cfg(feature = "serde")]
fn plus() -> i8 {
    1
}

#[cfg(feature = "serde")]
fn default_sigma_min() -> f64 {
    0.05
}

/// Sets of dimensions: all **inferred**, consistent with Table I of \[L6\], not published.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lambda6Set {
    /// The paper's literal layout; singular at yaw 0.
    Paper,
    /// The default machine: platform joints turned 45° against the shafts.
    Yaw45,
    /// All legs different (for tests).
    Asym45,
    /// A second family of dimensions, u > e.
    Alt45,
    /// Up to six assemblies (for tests).
    Wide,
}

impl Lambda6Set {
    /// All five.
    pub const ALL: [Self; 5] = [Self::Paper, Self::Yaw45, Self::Asym45, Self::Alt45, Self::Wide];
}

impl From<Lambda6Set> for Lambda6Parameters {
    fn from(set: Lambda6Set) -> Self {
        let yaw45 = Self {
            base_radius_mm: 1000.0,
            platform_radius_mm: 300.0,
            c_mm: [1400.0; 3],
            r_mm: [500.0; 3],
            u_mm: [800.0; 3],
            yaw_offset_deg: 45.0,
            assembly: 1,
            spacing_mm: Some([800.0, 1600.0]),
            platform_cone_deg: None,
            sigma_min: 0.05,
        };
        match set {
            Lambda6Set::Paper => Self { yaw_offset_deg: 0.0, ..yaw45 },
            Lambda6Set::Yaw45 => yaw45,
            Lambda6Set::Asym45 => Self {
                c_mm: [1400.0, 1380.0, 1420.0],
                r_mm: [500.0, 490.0, 520.0],
                u_mm: [800.0, 810.0, 790.0],
                ..yaw45
            },
            Lambda6Set::Alt45 => Self {
                base_radius_mm: 900.0,
                c_mm: [1100.0; 3],
                r_mm: [300.0; 3],
                u_mm: [900.0; 3],
                spacing_mm: Some([600.0, 1620.0]),
                ..yaw45
            },
            Lambda6Set::Wide => Self {
                base_radius_mm: 700.0,
                platform_radius_mm: 500.0,
                c_mm: [1500.0; 3],
                r_mm: [600.0; 3],
                u_mm: [850.0; 3],
                yaw_offset_deg: 0.0,
                spacing_mm: None,
                sigma_min: 0.0,
                ..yaw45
            },
        }
    }
}

/// One leg, ready to run.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    /// Shaft in the base plane.
    shaft: [f64; 2],
    /// Platform joint in the platform frame.
    joint: [f64; 2],
    c: f64,
    u: f64,
    /// e
    elbow: f64,
    /// k = e/c
    k: f64,
    /// Largest allowed ρ² (exclusive): the shorter of both chains decides.
    reach2: f64,
}

/// A valid Lambda machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lambda6 {
    legs: [Leg; 3],
    platform_radius: f64,
    base_radius: f64,
    yaw_offset: f64,
    assembly: f64,
    spacing: [f64; 2],
    cone_cos: f64,
    cone_rad: f64,
    sigma_min: f64,
}

/// One leg as pictures and maps need it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lambda6Leg {
    /// Its shaft in the base plane, mm.
    pub shaft_mm: [f64; 2],
    /// Its platform joint in the platform's frame, mm.
    pub joint_mm: [f64; 2],
    /// c, mm.
    pub long_mm: f64,
    /// u, mm.
    pub short_mm: f64,
    /// k = e/c: where the short chain meets the long one, as a share of c from the upper slider.
    pub ratio: f64,
}

/// One solved leg of the inverse.
#[derive(Debug, Clone, Copy, Default)]
struct LegState {
    /// N − p in the base frame.
    arm: Vec3,
    /// Shaft → N, horizontal.
    w: [f64; 2],
    rho2: f64,
    h: f64,
    g: f64,
    upper: f64,
    lower: f64,
}

/// Determinant of three rows.
#[inline]
fn determinant(a: Vec3, b: Vec3, c: Vec3) -> f64 {
    dot(a, cross(b, c))
}

impl Lambda6 {
    /// A machine from its parameters.
    ///
    /// # Errors
    /// Each names its parameter: `NotFinite`, `NotPositive`, `OutOfRange`, `NotASign`; `NotLess` for D ≥ C, r ≥ c, spacing_min ≥
    /// spacing_max, spacing_max ≥ e + u, or spacing_min ≤ √|e² − u²| (the sliders could leave the working mode).
    pub fn new(p: &Lambda6Parameters) -> Result<Self, GeometryError> {
        let base_radius = errors::length(Key::of("base_radius_mm"), p.base_radius_mm)?;
        let platform_radius = errors::length(Key::of("platform_radius_mm"), p.platform_radius_mm)?;
        if platform_radius >= base_radius {
            return Err(GeometryError::NotLess {
                key: Key::of("platform_radius_mm"),
                value: platform_radius,
                than: Key::of("base_radius_mm"),
                limit: base_radius,
            });
        }
        let yaw_offset_deg = errors::angle_deg(Key::of("yaw_offset_deg"), p.yaw_offset_deg)?;
        let assembly = errors::sign(Key::of("assembly"), p.assembly)?;
        let key = Key::of("sigma_min");
        if !p.sigma_min.is_finite() {
            return Err(GeometryError::NotFinite { key });
        }
        if !(0.0..=2.0).contains(&p.sigma_min) {
            return Err(GeometryError::OutOfRange { key, value: p.sigma_min, low: 0.0, high: 2.0 });
        }

        let leg = |i: usize, azimuth: f64, c: f64, r: f64, u: f64| -> Result<Leg, GeometryError> {
            let c = errors::length(Key::at("c_mm", i), c)?;
            let r = errors::length(Key::at("r_mm", i), r)?;
            let u = errors::length(Key::at("u_mm", i), u)?;
            if r >= c {
                let (key, than) = (Key::at("r_mm", i), Key::at("c_mm", i));
                return Err(GeometryError::NotLess { key, value: r, than, limit: c });
            }
            let elbow = c - r;
            let k = elbow / c;
            let (cb, sb) = cos_sin_deg(azimuth);
            let (cj, sj) = cos_sin_deg(azimuth + yaw_offset_deg);
            let reach = c.min(u / k);
            Ok(Leg {
                shaft: [base_radius * cb, base_radius * sb],
                joint: [platform_radius * cj, platform_radius * sj],
                c,
                u,
                elbow,
                k,
                reach2: reach * reach,
            })
        };
        // Note the order of the azimuths: 0°, 240°, 120°.
        let [c1, c2, c3] = p.c_mm;
        let [r1, r2, r3] = p.r_mm;
        let [u1, u2, u3] = p.u_mm;
        let legs = [leg(0, 0.0, c1, r1, u1)?, leg(1, 240.0, c2, r2, u2)?, leg(2, 120.0, c3, r3, u3)?];

        let mut spacing = [f64::NEG_INFINITY, f64::INFINITY];
        if let Some([low, high]) = p.spacing_mm {
            let (low_key, high_key) = (Key::at("spacing_mm", 0), Key::at("spacing_mm", 1));
            let low = errors::coordinate(low_key, low)?;
            let high = errors::coordinate(high_key, high)?;
            if low < 0.0 {
                return Err(GeometryError::OutOfRange { key: low_key, value: low, low: 0.0, high });
            }
            if low >= high {
                return Err(GeometryError::NotLess { key: low_key, value: low, than: high_key, limit: high });
            }
            for (i, leg) in legs.iter().enumerate() {
                let most = leg.elbow + leg.u;
                if high >= most {
                    let than = Key::at("u_mm", i);
                    return Err(GeometryError::NotLess { key: high_key, value: high, than, limit: most });
                }
                let least = sqrt(fabs(leg.elbow * leg.elbow - leg.u * leg.u));
                if low <= least {
                    return Err(GeometryError::OutOfRange { key: low_key, value: low, low: least, high });
                }
            }
            spacing = [low, high];
        }
        let mut cone_rad = PI;
        if let Some(value) = p.platform_cone_deg {
            let key = Key::of("platform_cone_deg");
            if !(value > 0.0 && value <= 180.0) {
                return Err(GeometryError::OutOfRange { key, value, low: 0.0, high: 180.0 });
            }
            cone_rad = radians(value);
        }
        Ok(Self {
            legs,
            platform_radius,
            base_radius,
            yaw_offset: radians(yaw_offset_deg),
            assembly,
            spacing,
            cone_cos: if p.platform_cone_deg.is_some() { cos(cone_rad) } else { -2.0 },
            cone_rad,
            sigma_min: p.sigma_min,
        })
    }

    /// The same machine without limits of spacing and cone: geometry alone.
    pub fn without_limits(mut self) -> Self {
        self.spacing = [f64::NEG_INFINITY, f64::INFINITY];
        self.cone_cos = -2.0;
        self
    }

    /// The three legs.
    pub fn legs(&self) -> [Lambda6Leg; 3] {
        self.legs.map(|leg| Lambda6Leg {
            shaft_mm: leg.shaft,
            joint_mm: leg.joint,
            long_mm: leg.c,
            short_mm: leg.u,
            ratio: leg.k,
        })
    }

    /// Smallest and largest distance of the two sliders of a shaft, mm (infinite without limit).
    pub fn spacing_mm(&self) -> [f64; 2] {
        self.spacing
    }

    /// True if the angle between long chain and platform normal is limited.
    pub fn has_cone(&self) -> bool {
        self.cone_cos > -1.5
    }

    /// Radius of the platform joints, mm: what makes angular columns of the Jacobian comparable with the linear ones.
    pub fn platform_radius_mm(&self) -> f64 {
        self.platform_radius
    }

    /// The points of the three legs at a pose whose joints are `l`: upper slider S, rotary joint J, platform joint N, lower slider
    /// (base frame, mm). J lies on S–N, so nothing is solved and no pose is refused.
    pub fn leg_points(&self, pose: &Pose, l: &Joints) -> [[Vec3; 4]; 3] {
        let at = Attitude::of(pose);
        let [l1, l2, l3, l4, l5, l6, ..] = *l;
        let [a, b, c] = &self.legs;
        let points = |leg: &Leg, upper: f64, lower: f64| {
            let [sx, sy] = leg.shaft;
            let slider = [sx, sy, -upper];
            let joint = add([pose.x, pose.y, pose.z], yawed(at.phi, at.tilted(leg.joint)));
            let reach = [joint[0] - sx, joint[1] - sy, joint[2] + upper];
            let elbow = add(slider, [leg.k * reach[0], leg.k * reach[1], leg.k * reach[2]]);
            [slider, elbow, joint, [sx, sy, -lower]]
        };
        [points(a, l1, l4), points(b, l2, l5), points(c, l3, l6)]
    }

    #[inline]
    fn solve(&self, pose: &Pose, at: &Attitude) -> Result<[LegState; 3], InverseError> {
        let mut solved = [LegState::default(); 3];
        for ((state, leg), number) in solved.iter_mut().zip(&self.legs).zip(0u8..) {
            let arm = yawed(at.phi, at.tilted(leg.joint));
            let w = [pose.x + arm[0] - leg.shaft[0], pose.y + arm[1] - leg.shaft[1]];
            let rho2 = w[0] * w[0] + w[1] * w[1];
            if !(rho2 > 1e-12 && rho2 < leg.reach2) {
                return Err(Self::leg_error(pose, leg, number, rho2));
            }
            let h = sqrt(leg.c * leg.c - rho2);
            let g = sqrt(leg.u * leg.u - leg.k * leg.k * rho2);
            let upper = -(pose.z + arm[2]) - h;
            *state = LegState { arm, w, rho2, h, g, upper, lower: upper + leg.k * h + g };
        }
        Ok(solved)
    }

    #[cold]
    fn leg_error(pose: &Pose, leg: &Leg, number: u8, rho2: f64) -> InverseError {
        let rho_mm = sqrt(rho2).min(f64::MAX);
        if !pose.is_finite() {
            InverseError::NotFinite
        } else if rho2 <= 1e-12 {
            InverseError::OnShaft { leg: number }
        } else if !(rho_mm < leg.c) {
            InverseError::LongChainReach { leg: number, rho_mm, limit_mm: leg.c }
        } else {
            InverseError::ShortChainReach { leg: number, rho_mm: leg.k * rho_mm, limit_mm: leg.u }
        }
    }

    /// The distances of the sliders on each shaft, which single travels do not bound. Forward does not apply them: homing and
    /// jogging outside limits must still show a position.
    ///
    /// # Errors
    /// `Spacing`.
    pub fn check_spacing(&self, l: &Joints) -> Result<(), InverseError> {
        let [l1, l2, l3, l4, l5, l6, ..] = *l;
        self.within(0, l4 - l1)?;
        self.within(1, l5 - l2)?;
        self.within(2, l6 - l3)
    }

    #[inline]
    fn within(&self, leg: u8, value_mm: f64) -> Result<(), InverseError> {
        let [low, high] = self.spacing;
        if !(value_mm >= low - 1e-9) {
            return Err(InverseError::Spacing { leg, side: Side::Low, value_mm, limit_mm: low });
        }
        if !(value_mm <= high + 1e-9) {
            return Err(InverseError::Spacing { leg, side: Side::High, value_mm, limit_mm: high });
        }
        Ok(())
    }

    #[inline]
    fn check(&self, legs: &[LegState; 3], at: &Attitude) -> Result<(), InverseError> {
        for (leg, number) in legs.iter().zip(0u8..) {
            self.within(number, leg.lower - leg.upper)?;
        }
        if self.has_cone() {
            return self.check_cone(legs, at);
        }
        Ok(())
    }

    /// Angle between N → S and the platform's normal +Z_P.
    fn check_cone(&self, legs: &[LegState; 3], at: &Attitude) -> Result<(), InverseError> {
        let ((ss, cs), (st, ct), (sp, cp)) = (at.psi, at.theta, at.phi);
        let normal = [cp * st * cs + sp * ss, sp * st * cs - cp * ss, ct * cs];
        for ((state, leg), number) in legs.iter().zip(&self.legs).zip(0u8..) {
            let cosine = dot([-state.w[0], -state.w[1], state.h], normal) / leg.c;
            if cosine < self.cone_cos - 1e-12 {
                let angle_rad = acos(cosine.clamp(-1.0, 1.0));
                return Err(InverseError::PlatformCone { leg: number, angle_rad, limit_rad: self.cone_rad });
            }
        }
        Ok(())
    }

    #[inline]
    fn reach(&self, pose: &Pose) -> Result<(Attitude, [LegState; 3]), InverseError> {
        let at = Attitude::of(pose);
        let legs = self.solve(pose, &at)?;
        // A NaN in z or in the angles ends in the spacing check or here.
        if !(legs[0].upper + legs[1].upper + legs[2].upper).is_finite() {
            return Err(InverseError::NotFinite);
        }
        self.check(&legs, &at)?;
        Ok((at, legs))
    }

    /// σ of a pose, from the horizontal vectors of its legs.
    fn sigma_of(&self, legs: &[LegState; 3]) -> f64 {
        let row = |leg: &LegState| {
            let [wx, wy] = leg.w;
            let rho = sqrt(leg.rho2);
            [wx / rho, wy / rho, (leg.arm[0] * wy - leg.arm[1] * wx) / (rho * self.platform_radius)]
        };
        let [a, b, c] = legs;
        determinant(row(a), row(c), row(b))
    }

    /// σ: dimensionless, |σ| at most about 2.6; 0 at a direct singularity, its sign is the assembly. Limits do not matter.
    ///
    /// # Errors
    /// Those of the inverse that are geometry.
    pub fn sigma(&self, pose: &Pose) -> Result<f64, InverseError> {
        if !pose.is_finite() {
            return Err(InverseError::NotFinite);
        }
        Ok(self.sigma_of(&self.solve(pose, &Attitude::of(pose))?))
    }

    /// The rows of ∂l/∂(v, ω) (twist form): f and arm × f for each joint.
    fn twist_rows(&self, legs: &[LegState; 3]) -> Result<[[f64; 6]; 6], InverseError> {
        let mut rows = [[0.0; 6]; 6];
        let (upper, lower) = rows.split_at_mut(3);
        for (((state, leg), up), low) in legs.iter().zip(&self.legs).zip(upper).zip(lower) {
            self.guard(state, leg)?;
            let [wx, wy] = state.w;
            let stiff = leg.k / state.h + leg.k * leg.k / state.g;
            let f = [wx / state.h, wy / state.h, -1.0];
            let f_low = [f[0] - stiff * wx, f[1] - stiff * wy, -1.0];
            for (row, f) in [(up, f), (low, f_low)] {
                let moment = cross(state.arm, f);
                *row = [f[0], f[1], f[2], moment[0], moment[1], moment[2]];
            }
        }
        Ok(rows)
    }

    #[inline]
    fn guard(&self, state: &LegState, leg: &Leg) -> Result<(), InverseError> {
        let measure = (state.h / leg.c).min(state.g / leg.u);
        if measure >= 1e-9 { Ok(()) } else { Err(InverseError::Singular { measure }) }
    }

    /// ∂l/∂(v, ω): rows l1..l6, columns v and ω in base axes; mm/mm and mm/rad.
    ///
    /// # Errors
    /// As [`Kinematics::jacobian`].
    pub fn twist_jacobian(&self, pose: &Pose) -> Result<[[f64; 6]; 6], InverseError> {
        let (_, legs) = self.reach(pose)?;
        self.twist_rows(&legs)
    }

    /// The legs' triangles, then height and tilt: all that is known in closed form.
    fn circles(&self, l: &Joints) -> Result<Circles, ForwardError> {
        let mut rho = [0.0; 3];
        let mut heights = [0.0; 3];
        let uppers = [l[0], l[1], l[2]];
        let lowers = [l[3], l[4], l[5]];
        if !(is_finite(uppers) && is_finite(lowers)) {
            return Err(ForwardError::NotFinite);
        }
        let each = self.legs.iter().zip(uppers).zip(lowers).zip(rho.iter_mut()).zip(heights.iter_mut());
        for (((((leg, upper), lower), rho), height), number) in each.zip(0u8..) {
            let (e, u) = (leg.elbow, leg.u);
            let d = lower - upper;
            if !(d > fabs(e - u) && d < e + u) {
                return Err(ForwardError::LegTriangle {
                    leg: number,
                    spacing_mm: d,
                    low_mm: fabs(e - u),
                    high_mm: e + u,
                });
            }
            let t = (d * d + (e - u) * (e + u)) / (2.0 * d);
            if !(t > 0.0 && t < d) {
                return Err(ForwardError::WrongWorkingMode { mechanism: None, chain: number });
            }
            // 16 × squared area, as a product: accurate near the stretched position.
            let area = (e + u + d) * (e + u - d) * (d + e - u) * (d - e + u);
            *rho = sqrt(area) / (2.0 * d * leg.k);
            *height = -(upper + t / leg.k);
        }
        // Equilateral platform: Σ bᵢ = 0, Σ bᵢ bᵢᵀ = (3/2) D² 1.
        let d2 = 2.0 / (3.0 * self.platform_radius * self.platform_radius);
        let (mut r31, mut r32) = (0.0, 0.0);
        for (leg, z) in self.legs.iter().zip(heights) {
            r31 += d2 * z * leg.joint[0];
            r32 += d2 * z * leg.joint[1];
        }
        let square = 1.0 - r31 * r31 - r32 * r32;
        if !(square > 0.0) {
            return Err(ForwardError::TiltOutOfRange);
        }
        let r33 = sqrt(square);
        let level = sqrt(r32 * r32 + r33 * r33);
        // sin θ = −r31, cos θ = level, sin ψ = r32/level, cos ψ = r33/level: no need of the angles themselves yet.
        let at = Attitude { psi: (r32 / level, r33 / level), theta: (-r31, level), phi: (0.0, 1.0) };
        let [a, b, c] = &self.legs;
        Ok(Circles {
            rho,
            arms: [at.tilted(a.joint), at.tilted(b.joint), at.tilted(c.joint)],
            z: (heights[0] + heights[1] + heights[2]) / 3.0,
            psi: atan2(r32, r33),
            theta: atan2(-r31, level),
        })
    }

    fn pose_of(circles: &Circles, at: Planar3) -> Pose {
        Pose {
            x: at.x,
            y: at.y,
            z: circles.z,
            a: circles.psi,
            b: circles.theta,
            c: wrap(at.phi),
            ..Pose::ZERO
        }
    }

    /// Every real upright pose of these joints with its σ, whatever the assembly: at most six.
    ///
    /// # Errors
    /// Those of the legs' triangles and the tilt; `NoAssembly` if no pose is real.
    pub fn forward_all(&self, joints: &Joints) -> Result<Branches<(Pose, f64)>, ForwardError> {
        let circles = self.circles(joints)?;
        let mut all = Branches::new();
        for &(found, sigma) in self.all_solutions(&circles, &mut 0).as_slice() {
            all.push((Self::pose_of(&circles, found), sigma));
        }
        if all.as_slice().is_empty() { Err(ForwardError::NoAssembly) } else { Ok(all) }
    }

    /// Warm start from the seed's x, y, φ, in the seed's assembly, if |σ(seed)| ≥ `sigma_min`. A seed of all zeros means none:
    /// then from x = y = 0, φ = ±45° − δ in the configured assembly. Adds the 3×3 solves it took to `solves`.
    ///
    /// # Errors
    /// As [`Kinematics::forward`].
    #[inline]
    pub fn forward_counting(
        &self,
        joints: &Joints,
        seed: &Pose,
        solves: &mut u32,
    ) -> Result<Pose, ForwardError> {
        let circles = self.circles(joints)?;
        let mut assembly = self.assembly;
        let mut start = Planar3 { x: 0.0, y: 0.0, phi: assembly * (PI / 4.0) - self.yaw_offset };
        if *seed != Pose::ZERO && seed.is_finite() {
            // The seed's tilt is near the one just found; σ depends on x, y, φ and the horizontal arms.
            let yaw = sincos(seed.c);
            let mut legs = [LegState::default(); 3];
            for ((state, leg), arm) in legs.iter_mut().zip(&self.legs).zip(circles.arms) {
                state.arm = yawed(yaw, arm);
                state.w = [seed.x + state.arm[0] - leg.shaft[0], seed.y + state.arm[1] - leg.shaft[1]];
                state.rho2 = state.w[0] * state.w[0] + state.w[1] * state.w[1];
            }
            let sigma = self.sigma_of(&legs);
            if fabs(sigma) >= self.sigma_min.max(1e-12) {
                assembly = if sigma > 0.0 { 1.0 } else { -1.0 };
                start = Planar3 { x: seed.x, y: seed.y, phi: seed.c };
            }
        }
        if let Some((found, sigma)) = self.newton(&circles, start, solves)
            && sigma * assembly > 0.0
            && fabs(sigma) >= self.sigma_min
        {
            return Ok(Self::pose_of(&circles, found));
        }
        let mut best: Option<(Planar3, f64)> = None;
        for &(found, sigma) in self.all_solutions(&circles, solves).as_slice() {
            let nearer = |(other, _): (Planar3, f64)| {
                fabs(wrap(found.phi - start.phi)) < fabs(wrap(other.phi - start.phi))
            };
            if sigma * assembly > 0.0 && best.is_none_or(nearer) {
                best = Some((found, sigma));
            }
        }
        match best {
            None => Err(ForwardError::NoAssembly),
            Some((_, sigma)) if fabs(sigma) < self.sigma_min => {
                Err(ForwardError::Singular { measure: fabs(sigma) })
            }
            Some((found, _)) => Ok(Self::pose_of(&circles, found)),
        }
    }
}

impl TryFrom<Lambda6Parameters> for Lambda6 {
    type Error = GeometryError;
    fn try_from(parameters: Lambda6Parameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

fn pack(legs: &[LegState; 3]) -> Joints {
    let [a, b, c] = legs;
    let mut joints = [0.0; MAX_JOINTS];
    [joints[0], joints[1], joints[2]] = [a.upper, b.upper, c.upper];
    [joints[3], joints[4], joints[5]] = [a.lower, b.lower, c.lower];
    joints
}

impl Kinematics for Lambda6 {
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

    fn limit_code(&self, limit: &JointLimit) -> LimitCode {
        let word = match limit.side {
            Side::Low => "slider_min",
            Side::High => "slider_max",
        };
        LimitCode::new("", word, crate::machine::number(limit.joint))
    }

    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        let (_, legs) = self.reach(pose)?;
        Ok(pack(&legs))
    }

    fn forward(&self, joints: &Joints, seed: &Pose) -> Result<Pose, ForwardError> {
        self.forward_counting(joints, seed, &mut 0)
    }

    /// J_q = J · diag(1, E): the twist form times the axes of ψ̇, θ̇, φ̇.
    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        let (at, legs) = self.reach(pose)?;
        let axes = at.axes();
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        for (row, [vx, vy, vz, wx, wy, wz]) in jacobian.iter_mut().zip(self.twist_rows(&legs)?) {
            let moment = [wx, wy, wz];
            let [a, b, c] = [dot(moment, axes[0]), dot(moment, axes[1]), dot(moment, axes[2])];
            *row = [vx, vy, vz, a, b, c, 0.0, 0.0, 0.0];
        }
        Ok(jacobian)
    }

    /// N̈ = p̈ + α × arm + ω × (ω × arm); h ḣ = −w·ẇ and h ḧ + ḣ² = −(ẇ² + w·ẅ), likewise g with k².
    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        let (at, legs) = self.reach(pose)?;
        let (v, a) = (velocity, acceleration);
        if !(v.is_finite() && a.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        let (omega, alpha) = at.spin(v, a);
        let mut rates = [LegState::default(); 3];
        let mut accelerations = [LegState::default(); 3];
        let each = legs.iter().zip(&self.legs).zip(rates.iter_mut()).zip(accelerations.iter_mut());
        for (((state, leg), rate), second) in each {
            self.guard(state, leg)?;
            let turn = cross(omega, state.arm);
            let n_v = add([v.x, v.y, v.z], turn);
            let n_a = add([a.x, a.y, a.z], add(cross(alpha, state.arm), cross(omega, turn)));
            let radial = state.w[0] * n_v[0] + state.w[1] * n_v[1];
            let radial_2 = n_v[0] * n_v[0] + n_v[1] * n_v[1] + state.w[0] * n_a[0] + state.w[1] * n_a[1];
            let k2 = leg.k * leg.k;
            let h_v = -radial / state.h;
            let h_a = -(radial_2 + h_v * h_v) / state.h;
            let g_v = -k2 * radial / state.g;
            let g_a = -(k2 * radial_2 + g_v * g_v) / state.g;
            rate.upper = -n_v[2] - h_v;
            rate.lower = rate.upper + leg.k * h_v + g_v;
            second.upper = -n_a[2] - h_a;
            second.lower = second.upper + leg.k * h_a + g_a;
        }
        Ok(JointMotion { position: pack(&legs), velocity: pack(&rates), acceleration: pack(&accelerations) })
    }

    /// Inverse: the smaller of h/c and g/u; forward: |σ| (may exceed 1).
    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        let (_, legs) = self.reach(pose)?;
        let mut worst =
            Singularity { inverse: f64::MAX, inverse_joint: 0, forward: fabs(self.sigma_of(&legs)) };
        for ((state, leg), joint) in legs.iter().zip(&self.legs).zip(0..) {
            for (measure, joint) in [(state.h / leg.c, joint), (state.g / leg.u, joint + 3)] {
                if measure < worst.inverse {
                    (worst.inverse, worst.inverse_joint) = (measure, joint);
                }
            }
        }
        Ok(worst)
    }

    fn forward_branches(&self, joints: &Joints, seed: &Pose) -> Result<Branches<Pose>, ForwardError> {
        let mut all = Branches::new();
        if let Ok(pose) = self.forward(joints, seed) {
            all.push(pose);
        }
        for &(pose, _) in self.forward_all(joints)?.as_slice() {
            let same = |p: &Pose| fabs(p.c - pose.c) < 1e-7 && fabs(p.x - pose.x) < 1e-4;
            if !all.as_slice().iter().any(same) {
                all.push(pose);
            }
        }
        Ok(all)
    }
}
