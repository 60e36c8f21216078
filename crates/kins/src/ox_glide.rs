//! O-X glide: a platform on four links between two rigid pairs of sliders on parallel cross rails; O (extended) and X
//! (crossed) form; the rails travel along the longitudinal guides.
//!
//! Source: \[OX\] C. Mladenović, S. Tabaković, M. Zeljković, "Radni prostor O-X glide hibridnog mehanizma".
//! Frame: x along the cross rails from the rail end, y away from the rails, z longitudinal, mm. T = centre of the platform,
//! which does not turn (assumed by \[OX\]). Joints AB CD Z.
//!
//! | here   | \[OX\]       | meaning                                                         |
//! |--------|------------|-----------------------------------------------------------------|
//! | `l_mm` | l          | length of the links                                             |
//! | `s_mm` | s          | width of the platform                                           |
//! | `form` | fig 3, 4   | O: c > 0, X: c < 0                                              |
//! | c      | –          | half the distance of the virtual centres, (x_CD − x_AB − s)/2   |
//!
//! Inverse: c = f √((l − y)(l + y)), x_AB = x − s/2 − c, x_CD = x + s/2 + c (correct in the paper).
//! Forward: x = (x_AB + x_CD)/2, y = √((l − c)(l + c)); one formula for both forms. Corrected: for the X form the paper prints
//!   (x_CD − x_AB + s)², which gives links 93.66 mm long instead of 80 at T = (65, 40); it is − s as in the O form.
//! Singular: c = 0 (y = l), the form switch, type 1 and 2 at once: with fixed sliders the platform swings freely. y = 0, type 2.
//!   Cartesian motion with |c| below `c_min_mm` is refused; the switch itself is a joint move, see [`OxGlide::form_switch`].
//! Accuracy: forward(inverse(p)) within 1e-9 mm for |c| > 0.1 mm; at c = 0 about 3e-6 mm.

use crate::errors::{self, ForwardError, GeometryError, InverseError, Key, NoIntersection};
use crate::kinematics::{
    Branches, Jacobian, JointKind, JointLimit, JointMotion, JointRange, Joints, Kinematics, MAX_JOINTS,
    Singularity,
};
use crate::maths::{fabs, sqrt};
use crate::pose::{Axis, AxisSet, Pose};

/// The two forms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize))]
pub enum OxForm {
    /// Extended.
    #[cfg_attr(feature = "serde", serde(alias = "o"))]
    O,
    /// Crossed.
    #[cfg_attr(feature = "serde", serde(alias = "x"))]
    X,
}

impl OxForm {
    /// The other one.
    pub const fn other(self) -> Self {
        match self {
            Self::O => Self::X,
            Self::X => Self::O,
        }
    }

    const fn sign(self) -> f64 {
        match self {
            Self::O => 1.0,
            Self::X => -1.0,
        }
    }
}

/// O-X glide as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct OxGlideParameters {
    /// l, mm.
    pub l_mm: f64,
    /// s, mm.
    pub s_mm: f64,
    /// The form the machine is in.
    pub form: OxForm,
    /// Cartesian motion is refused where |c| is smaller, mm.
    #[cfg_attr(feature = "serde", serde(default = "default_c_min"))]
    pub c_min_mm: f64,
}

#[cfg(feature = "serde")]
fn default_c_min() -> f64 {
    2.0
}

impl From<OxForm> for OxGlideParameters {
    /// The paper's dimensions; the guard of 2 mm is ours.
    fn from(form: OxForm) -> Self {
        Self { l_mm: 80.0, s_mm: 20.0, form, c_min_mm: 2.0 }
    }
}

/// A valid O-X glide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OxGlide {
    l: f64,
    s: f64,
    form: OxForm,
    c_min: f64,
}

/// A checked switch of the form: drive both sliders linearly and together from where they are to `joints`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FormSwitch {
    /// Where the joint move ends.
    pub joints: Joints,
    /// The machine after the move.
    pub machine: OxGlide,
    /// Where the platform is before and after the move (x and z do not change; y passes l on the way).
    pub pose: Pose,
}

/// Why the form cannot be switched here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FormSwitchError {
    /// The sliders are in no valid state to begin with.
    State(ForwardError),
    /// The switch must begin and end outside the guard, or no Cartesian move could follow.
    TooNear {
        /// |c| now, mm.
        c_mm: f64,
        /// The guard, mm.
        guard_mm: f64,
    },
    /// A slider would leave its rail at the end of the move.
    Travel(JointLimit),
}

impl core::fmt::Display for FormSwitchError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::State(error) => write!(f, "cannot switch the form: {error}"),
            Self::TooNear { c_mm, guard_mm } => write!(
                f,
                "cannot switch the form {c_mm:.3} mm from c = 0; move away from the rails' full reach until |c| ≥ {guard_mm} mm"
            ),
            Self::Travel(limit) => write!(
                f,
                "cannot switch the form here: slider {} would have to go to {:.3} mm (limit {:.3} mm); move x towards the middle",
                if limit.joint == 0 { "AB" } else { "CD" },
                limit.value,
                limit.limit
            ),
        }
    }
}

impl core::error::Error for FormSwitchError {}

impl OxGlide {
    /// An O-X glide from its parameters.
    ///
    /// # Errors
    /// `NotFinite`, `NotPositive`, `OutOfRange` name the parameter; `NotLess` if c_min is not less than l.
    pub fn new(p: &OxGlideParameters) -> Result<Self, GeometryError> {
        let l = errors::length(Key::of("l_mm"), p.l_mm)?;
        let s = errors::length(Key::of("s_mm"), p.s_mm)?;
        let key = Key::of("c_min_mm");
        let c_min = errors::coordinate(key, p.c_min_mm)?;
        if c_min < 0.0 {
            return Err(GeometryError::OutOfRange { key, value: c_min, low: 0.0, high: l });
        }
        if c_min >= l {
            return Err(GeometryError::NotLess { key, value: c_min, than: Key::of("l_mm"), limit: l });
        }
        Ok(Self { l, s, form: p.form, c_min })
    }

    /// The form the machine is in.
    pub fn form(&self) -> OxForm {
        self.form
    }

    /// l, s and c_min, mm.
    pub fn dimensions_mm(&self) -> [f64; 3] {
        [self.l, self.s, self.c_min]
    }

    /// The same machine without the guard around the form switch (derivatives still end at c = 0).
    pub fn without_limits(mut self) -> Self {
        self.c_min = 0.0;
        self
    }

    /// c for this y in the configured form, mm.
    #[inline]
    fn half_span(&self, y: f64) -> Result<f64, InverseError> {
        let d = (self.l - y) * (self.l + y);
        if !(d >= -1e-12 * self.l * self.l) {
            return Err(if y.is_finite() {
                InverseError::TooFarFromRails { y_mm: y, limit_mm: self.l }
            } else {
                InverseError::NotFinite
            });
        }
        if y < 0.0 {
            return Err(InverseError::BelowRails { y_mm: y });
        }
        Ok(self.form.sign() * sqrt(if d > 0.0 { d } else { 0.0 }))
    }

    /// As [`Self::half_span`], refused within the guard.
    #[inline]
    fn guarded(&self, y: f64) -> Result<f64, InverseError> {
        let c = self.half_span(y)?;
        if fabs(c) < self.c_min {
            return Err(InverseError::FormSwitch { c_mm: c, guard_mm: self.c_min });
        }
        if fabs(c) < 1e-9 * self.l {
            return Err(InverseError::Singular { measure: fabs(c) / self.l });
        }
        Ok(c)
    }

    /// The move that takes the machine from the form it is in to the other one: x and z stay, c goes linearly to −c.
    /// In between the platform passes c = 0, where only its inertia or an external stop holds it: a command of its own,
    /// never part of another move. `travel` are the ranges of AB, CD and Z.
    ///
    /// # Errors
    /// See [`FormSwitchError`].
    pub fn form_switch(&self, now: &Joints, travel: &[JointRange]) -> Result<FormSwitch, FormSwitchError> {
        let pose = self.forward(now, &Pose::ZERO).map_err(FormSwitchError::State)?;
        let c = (now[1] - now[0] - self.s) / 2.0;
        if fabs(c) < self.c_min {
            return Err(FormSwitchError::TooNear { c_mm: c, guard_mm: self.c_min });
        }
        let mut joints = *now;
        joints[0] = pose.x - self.s / 2.0 + c;
        joints[1] = pose.x + self.s / 2.0 - c;
        // Joints move linearly, so both ends in travel keep the whole move in travel.
        JointRange::check(travel, now).map_err(FormSwitchError::Travel)?;
        JointRange::check(travel, &joints).map_err(FormSwitchError::Travel)?;
        Ok(FormSwitch { joints, machine: Self { form: self.form.other(), ..*self }, pose })
    }

    fn pack(&self, x: f64, c: f64, z: f64) -> Joints {
        let mut joints = [0.0; MAX_JOINTS];
        [joints[0], joints[1], joints[2]] = self.sliders(x, c, z);
        joints
    }

    #[inline]
    fn sliders(&self, x: f64, c: f64, z: f64) -> [f64; 3] {
        [x - self.s / 2.0 - c, x + self.s / 2.0 + c, z]
    }
}

impl TryFrom<OxGlideParameters> for OxGlide {
    type Error = GeometryError;
    fn try_from(parameters: OxGlideParameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

impl Kinematics for OxGlide {
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
        match joint {
            0 => ("", "AB"),
            1 => ("", "CD"),
            _ => ("", "Z"),
        }
    }

    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        if !(pose.x.is_finite() && pose.z.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        Ok(self.pack(pose.x, self.half_span(pose.y)?, pose.z))
    }

    #[inline(always)]
    fn inverse_into(&self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        if !(pose.x.is_finite() && pose.z.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        let c = self.half_span(pose.y)?;
        [joints[0], joints[1], joints[2]] = self.sliders(pose.x, c, pose.z);
        Ok(())
    }

    #[inline]
    fn forward(&self, joints: &Joints, _: &Pose) -> Result<Pose, ForwardError> {
        let [ab, cd, z] = [joints[0], joints[1], joints[2]];
        if !(ab.is_finite() && cd.is_finite() && z.is_finite()) {
            return Err(ForwardError::NotFinite);
        }
        let c = (cd - ab - self.s) / 2.0;
        let d = (self.l - c) * (self.l + c);
        if !(d >= -1e-12 * self.l * self.l) {
            return Err(ForwardError::NoIntersection { mechanism: None, reason: NoIntersection::TooFar });
        }
        if fabs(c) <= 1e-9 {
            return Err(ForwardError::Singular { measure: fabs(c) / self.l });
        }
        if c * self.form.sign() < 0.0 {
            return Err(ForwardError::WrongForm { c_mm: c });
        }
        Ok(Pose { x: (ab + cd) / 2.0, y: sqrt(if d > 0.0 { d } else { 0.0 }), z, ..Pose::ZERO })
    }

    /// K = [[1, y/c], [1, −y/c]], det K = −2y/c.
    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        let slope = pose.y / self.guarded(pose.y)?;
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        jacobian[0][..2].copy_from_slice(&[1.0, slope]);
        jacobian[1][..2].copy_from_slice(&[1.0, -slope]);
        jacobian[2][2] = 1.0;
        Ok(jacobian)
    }

    /// From c² + y² = l²: ċ = −y ẏ/c, c̈ = −(ẏ² + y ÿ + ċ²)/c.
    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        let (v, a) = (velocity, acceleration);
        let c = self.guarded(pose.y)?;
        let c_v = -pose.y * v.y / c;
        let c_a = -(v.y * v.y + pose.y * a.y + c_v * c_v) / c;
        if !(c_a.is_finite()
            && pose.x.is_finite()
            && pose.z.is_finite()
            && (v.x + v.z).is_finite()
            && (a.x + a.z).is_finite())
        {
            return Err(InverseError::NotFinite);
        }
        let rate = |x: f64, c: f64, z: f64| {
            let mut joints = [0.0; MAX_JOINTS];
            [joints[0], joints[1], joints[2]] = [x - c, x + c, z];
            joints
        };
        Ok(JointMotion {
            position: self.pack(pose.x, c, pose.z),
            velocity: rate(v.x, c_v, v.z),
            acceleration: rate(a.x, c_a, a.z),
        })
    }

    /// μ = |c|/l for both links; ν = 2|c|y/l², the sine between them.
    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        let c = fabs(self.half_span(pose.y)?);
        Ok(Singularity {
            inverse: c / self.l,
            inverse_joint: 0,
            forward: 2.0 * c * pose.y / (self.l * self.l),
        })
    }

    fn inverse_branches(&self, pose: &Pose) -> Result<Branches<Joints>, InverseError> {
        let mut all = Branches::new();
        all.push(self.inverse(pose)?);
        all.push(Self { form: self.form.other(), ..*self }.inverse(pose)?);
        Ok(all)
    }
}
