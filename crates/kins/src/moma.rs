//! MOMA: two sliders on fixed guides, two links of constant length; their common hinge is the platform P.
//!
//! Source: \[MOMA\] G. Vasilić, S. Živanović, "Modeliranje i analiza rekonfigurabilnog dvoosnog paralelnog mehanizma MOMA
//! sa osnaženim translatornim zglobovima", Tehnika 71(1), 2016, 57–63, doi 10.5937/tehnika1601057V.
//! Frame: base {B}, right-handed, mm: machine axes X Y are P. Joints p1 p2.
//!
//! | here              | \[MOMA\] | meaning                             |
//! |-------------------|--------|-------------------------------------|
//! | `reference_mm`    | Rᵢ     | pivot of drive i, slider at pᵢ = 0  |
//! | `guide_angle_deg` | αᵢ     | direction of drive i (270° + γᵢ)    |
//! | `l_mm`            | lᵢ     | length of link i                    |
//!
//! Kinematics: [`Planar`] with no offsets. Reconfiguration is another set of parameters, never other code.
//! Corrected: (7), (8) print the minus root for every configuration; c and d need plus (with minus, c would shrink
//!   to 90 mm² and d would be empty). (15) and (16) are exchanged; the guide directions stated in the text hold.
//!   The singularity the paper sees at the origin in d is none (K = 1 there); the stretched locus |P| = l₁ is one.
//! Not offered: types M1–M5 of fig 1 by name; the text gives numbers only for the configurations a–d of fig 3.

use crate::errors::GeometryError;
use crate::planar::{Planar, PlanarParameters, Vec2, planar_kinematics};

/// MOMA as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct MomaParameters {
    /// Rᵢ, mm.
    pub reference_mm: [Vec2; 2],
    /// αᵢ, degrees from x.
    pub guide_angle_deg: [f64; 2],
    /// lᵢ, mm.
    pub l_mm: [f64; 2],
    /// σᵢ = ±1: sign of the root of the inverse.
    pub working_mode: [i8; 2],
    /// s = ±1: side of P, the sign of cross(S₂ − S₁, P − S₁).
    pub assembly: i8,
    /// Links may lie only on the inner side of their guides (figs 6b, 6d).
    #[cfg_attr(feature = "serde", serde(default))]
    pub one_sided: bool,
}

/// The configurations of \[MOMA\] fig 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum MomaConfiguration {
    A,
    B,
    C,
    D,
}

impl MomaConfiguration {
    /// All four.
    pub const ALL: [Self; 4] = [Self::A, Self::B, Self::C, Self::D];
}

impl From<MomaConfiguration> for MomaParameters {
    fn from(configuration: MomaConfiguration) -> Self {
        let (reference_mm, guide_angle_deg, mode, assembly) = match configuration {
            MomaConfiguration::A => ([[-100.0, 0.0], [100.0, 0.0]], [265.0, 275.0], -1, -1),
            MomaConfiguration::B => ([[-100.0, 0.0], [100.0, 0.0]], [275.0, 265.0], -1, -1),
            MomaConfiguration::C => ([[250.0, 0.0], [0.0, 250.0]], [180.0, 270.0], 1, -1),
            MomaConfiguration::D => ([[117.0, 0.0], [0.0, 117.0]], [0.0, 90.0], 1, 1),
        };
        Self {
            reference_mm,
            guide_angle_deg,
            l_mm: [195.0; 2],
            working_mode: [mode; 2],
            assembly,
            one_sided: false,
        }
    }
}

/// A valid MOMA.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moma {
    /// The mechanism.
    pub planar: Planar,
}

impl Moma {
    /// A MOMA from its parameters.
    ///
    /// # Errors
    /// As [`Planar::new`].
    ///
    /// # Examples
    /// ```
    /// use pkm_kins::{Kinematics, Moma, MomaConfiguration, Pose};
    /// let moma = Moma::new(&MomaConfiguration::D.into()).unwrap();
    /// let joints = moma.inverse(&Pose { x: 75.0, y: 117.0, ..Pose::ZERO }).unwrap();
    /// assert_eq!(joints[..2], [114.0, 180.0]);
    /// ```
    pub fn new(p: &MomaParameters) -> Result<Self, GeometryError> {
        let planar = Planar::new(&PlanarParameters {
            reference_mm: p.reference_mm,
            guide_angle_deg: p.guide_angle_deg,
            l_mm: p.l_mm,
            offset_mm: [[0.0; 2]; 2],
            working_mode: p.working_mode,
            assembly: p.assembly,
            one_sided: p.one_sided,
        })?;
        Ok(Self { planar })
    }
}

impl TryFrom<MomaParameters> for Moma {
    type Error = GeometryError;
    fn try_from(parameters: MomaParameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

planar_kinematics!(Moma);
