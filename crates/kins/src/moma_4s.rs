//! MOMA 4S: a platform on four links in two parallel pairs; it translates without turning.
//!
//! Source: \[HV\] G. Vasilić, S. Živanović, M. Milutinović, Z. Dimić, "Kinematika kompleksne višeosne i viševretene mašine
//! alatke namenjene za proces obrade glodanjem"; names of the configurations: \[W\], the same authors, "Mašina alatka sa
//! paralelnim mehanizmima namenjena za sečenje penastih materijala usijanom žicom", section 2, fig 2.
//! Frame: {Q}, q1 horizontal, q2 up, mm: machine axes X Y are the tool tip (q1, q2). Joints p1 p2.
//!
//! | here        | \[HV\]   | meaning                                                    |
//! |-------------|--------|------------------------------------------------------------|
//! | `pivot_mm`  | Oᵢ     | pivot about which drive i is turned when reconfiguring     |
//! | `rho_mm`    | R_q,i  | reference point relative to Oᵢ at γᵢ = 0                   |
//! | `gamma_deg` | γᵢ     | angle of drive i; its guide points along 270° + γᵢ         |
//! | `l_h_mm`    | l_iH   | horizontal distance of point P to the platform joint       |
//! | `l_t_mm`    | l_T    | length of the tool from P                                  |
//! | `alpha_t_deg` | α_T  | 0: tool in the plane, down (V); 90°: normal to it (H)      |
//!
//! One link of each pair is enough: [`Planar`] with R = O + Rot(γ) ρ (\[HV\] (5)), o₁ = −l⃗_T − (l_1H, 0),
//!   o₂ = −l⃗_T + (l_2H, 0), l⃗_T = l_T (0, −cos α_T) in the plane, signed from P to the tip.
//! Corrected in \[HV\] (4), (6)–(9): the linear term is +2p; chain 2 has −l_2H; l_T,q2 has one sign everywhere; no factor 2 in b.
//!   (8), (9) are not used: they divide by a difference that vanishes at regular poses.
//! Not modelled: the pairs' own constraint singularity (a parallelogram that flattens); no paper gives their spacing.

use crate::errors::{self, GeometryError, Key};
use crate::maths::cos_sin_deg;
use crate::planar::{Planar, PlanarParameters, Vec2, planar_kinematics};

/// MOMA 4S as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct Moma4sParameters {
    /// Oᵢ, mm.
    pub pivot_mm: [Vec2; 2],
    /// ρᵢ, mm.
    pub rho_mm: [Vec2; 2],
    /// γᵢ, degrees.
    pub gamma_deg: [f64; 2],
    /// lᵢ, mm.
    pub l_mm: [f64; 2],
    /// l_iH ≥ 0, mm.
    pub l_h_mm: [f64; 2],
    /// l_T ≥ 0, mm.
    #[cfg_attr(feature = "serde", serde(default))]
    pub l_t_mm: f64,
    /// α_T, degrees.
    #[cfg_attr(feature = "serde", serde(default))]
    pub alpha_t_deg: f64,
    /// σᵢ = ±1.
    #[cfg_attr(feature = "serde", serde(default = "minus_modes"))]
    pub working_mode: [i8; 2],
    /// s = ±1.
    #[cfg_attr(feature = "serde", serde(default = "minus"))]
    pub assembly: i8,
    /// Links may lie only on the inner side of their guides.
    #[cfg_attr(feature = "serde", serde(default))]
    pub one_sided: bool,
}

#[cfg(feature = "serde")]
fn minus_modes() -> [i8; 2] {
    [-1, -1]
}

#[cfg(feature = "serde")]
fn minus() -> i8 {
    -1
}

/// The named configurations of \[W\] section 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moma4sConfiguration {
    /// Drives vertical.
    P,
    /// Lower ends 5° outward.
    S5,
    /// Lower ends 10° outward.
    S10,
    /// Lower ends 5° inward.
    U5,
    /// Lower ends 10° inward.
    U10,
}

impl Moma4sConfiguration {
    /// All five.
    pub const ALL: [Self; 5] = [Self::P, Self::S5, Self::S10, Self::U5, Self::U10];

    /// γ₁, γ₂ in degrees.
    pub const fn gamma_deg(self) -> [f64; 2] {
        match self {
            Self::P => [0.0, 0.0],
            Self::S5 => [-5.0, 5.0],
            Self::S10 => [-10.0, 10.0],
            Self::U5 => [5.0, -5.0],
            Self::U10 => [10.0, -10.0],
        }
    }
}

impl From<Moma4sConfiguration> for Moma4sParameters {
    /// The configuration with the default geometry, which is **inferred**: no paper gives 4S dimensions.
    fn from(configuration: Moma4sConfiguration) -> Self {
        Self {
            pivot_mm: [[-150.0, 0.0], [150.0, 0.0]],
            rho_mm: [[40.0, -20.0], [-40.0, -20.0]],
            gamma_deg: configuration.gamma_deg(),
            l_mm: [195.0; 2],
            l_h_mm: [30.0; 2],
            l_t_mm: 0.0,
            alpha_t_deg: 0.0,
            working_mode: [-1; 2],
            assembly: -1,
            one_sided: false,
        }
    }
}

/// A valid MOMA 4S.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moma4s {
    /// The mechanism.
    pub planar: Planar,
    /// Tool tip relative to P: q2 and q3 components, mm.
    tool_mm: Vec2,
}

impl Moma4s {
    /// A MOMA 4S from its parameters.
    ///
    /// # Errors
    /// As [`Planar::new`], `OutOfRange` for l_iH < 0 or l_T < 0.
    pub fn new(p: &Moma4sParameters) -> Result<Self, GeometryError> {
        let not_negative = |key: Key, value: f64| {
            let value = errors::coordinate(key, value)?;
            if value < 0.0 {
                return Err(GeometryError::OutOfRange { key, value, low: 0.0, high: errors::MAX_LENGTH_MM });
            }
            Ok(value)
        };
        let [h1, h2] = p.l_h_mm;
        let h1 = not_negative(Key::at("l_h_mm", 0), h1)?;
        let h2 = not_negative(Key::at("l_h_mm", 1), h2)?;
        let l_t = not_negative(Key::of("l_t_mm"), p.l_t_mm)?;
        let (cos_t, sin_t) = cos_sin_deg(errors::angle_deg(Key::of("alpha_t_deg"), p.alpha_t_deg)?);
        let tool_mm = [-l_t * cos_t, l_t * sin_t];

        // [HV] (5): R = O + Rot(γ) ρ
        let reference = |i: usize, pivot: Vec2, rho: Vec2, gamma: f64| -> Result<Vec2, GeometryError> {
            let (c, s) = cos_sin_deg(errors::angle_deg(Key::at("gamma_deg", i), gamma)?);
            let pivot_key = Key::at("pivot_mm", i);
            let rho_key = Key::at("rho_mm", i);
            let (x, y) = (errors::coordinate(rho_key, rho[0])?, errors::coordinate(rho_key, rho[1])?);
            Ok([
                errors::coordinate(pivot_key, pivot[0])? + (c * x - s * y),
                errors::coordinate(pivot_key, pivot[1])? + (s * x + c * y),
            ])
        };
        let [o1, o2] = p.pivot_mm;
        let [rho1, rho2] = p.rho_mm;
        let [g1, g2] = p.gamma_deg;
        let planar = Planar::new(&PlanarParameters {
            reference_mm: [reference(0, o1, rho1, g1)?, reference(1, o2, rho2, g2)?],
            guide_angle_deg: [270.0 + g1, 270.0 + g2],
            l_mm: p.l_mm,
            offset_mm: [[-h1, -tool_mm[0]], [h2, -tool_mm[0]]],
            working_mode: p.working_mode,
            assembly: p.assembly,
            one_sided: p.one_sided,
        })?;
        Ok(Self { planar, tool_mm })
    }

    /// Tool tip relative to the platform's point P in {Q}: (q1, q2, q3), mm; q3 is the plane's normal.
    pub fn tool_mm(&self) -> [f64; 3] {
        [0.0, self.tool_mm[0], self.tool_mm[1]]
    }
}

impl TryFrom<Moma4sParameters> for Moma4s {
    type Error = GeometryError;
    fn try_from(parameters: Moma4sParameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

planar_kinematics!(Moma4s);
