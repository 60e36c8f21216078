//! Why a pose has no joints, or joints have no pose. (Why parameters make no mechanism: [`crate::geometry`].)
//!
//! Chains, legs, joints and mechanisms are counted from 0 in the values, from 1 in text and codes.
//! `code()` gives the codes of the kinematics specification (`unreachable:1`, `m2:assembly`, ...); `Display`
//! a sentence with value, limit and remedy.

use crate::maths::degrees;
use crate::pose::Axis;
use core::fmt;

pub use crate::geometry::{GeometryError, Key};
pub use crate::kinematics::Side;

pub(crate) use crate::geometry::{MAX_LENGTH_MM, angle_deg, coordinate, length, sign};

/// Why a pose has no joints.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum InverseError {
    /// A coordinate or a rate is NaN or infinite.
    NotFinite,
    /// The link of this chain is too short to reach the platform: `deficit_mm` are missing.
    OutOfReach {
        /// For two mechanisms: which one; `None` where there is one.
        mechanism: Option<u8>,
        /// Chain (equals the joint within the mechanism).
        chain: u8,
        /// How much longer the link would have to be, mm.
        deficit_mm: f64,
    },
    /// The inverse lies in the other assembly mode: forward would give another point.
    WrongAssembly {
        /// For two mechanisms: which one.
        mechanism: Option<u8>,
    },
    /// One-sided guides: the link would lie on the outer side of its guide.
    GuideSide {
        /// For two mechanisms: which one.
        mechanism: Option<u8>,
        /// Chain.
        chain: u8,
        /// Distance of the platform joint beyond the guide line, mm.
        excess_mm: f64,
    },
    /// A derivative was asked for where it does not exist.
    Singular {
        /// The measure of [`crate::Singularity`] that is too small.
        measure: f64,
    },
    /// O-X glide: a Cartesian motion within the guard around the form switch c = 0.
    FormSwitch {
        /// Half the distance of the virtual centres, signed, mm.
        c_mm: f64,
        /// The guard, mm.
        guard_mm: f64,
    },
    /// O-X glide: the links are too short to reach this far from the rails.
    TooFarFromRails {
        /// y of the platform, mm.
        y_mm: f64,
        /// Length of the links, mm.
        limit_mm: f64,
    },
    /// O-X glide: the platform would be behind the rails.
    BelowRails {
        /// y of the platform, mm; must be ≥ 0.
        y_mm: f64,
    },
    /// MOMA-W: a contour plane is not strictly between the platform planes.
    OutsideWireSpan {
        /// Height of the contour plane above the first platform plane, mm.
        plane_mm: f64,
        /// Distance of the platform planes, mm (signed).
        span_mm: f64,
    },
    /// MOMA-W: the wire would be longer than allowed.
    WireLength {
        /// mm
        length_mm: f64,
        /// mm
        limit_mm: f64,
    },
    /// MOMA-W: the wire would be tilted more than allowed.
    WireTilt {
        /// Tangent of the angle to the plane normal.
        tangent: f64,
        /// The largest allowed.
        limit: f64,
    },
    /// Lambda: a platform joint lies on its shaft.
    OnShaft {
        /// Leg.
        leg: u8,
    },
    /// Lambda: the long chain is too short.
    LongChainReach {
        /// Leg.
        leg: u8,
        /// Distance of the platform joint from the shaft, mm.
        rho_mm: f64,
        /// Must stay below this, mm.
        limit_mm: f64,
    },
    /// Lambda: the short chain is too short.
    ShortChainReach {
        /// Leg.
        leg: u8,
        /// Distance of the joint between the chains from the shaft, mm.
        rho_mm: f64,
        /// Must stay below this, mm.
        limit_mm: f64,
    },
    /// Lambda: the sliders of one shaft are too near or too far from each other.
    Spacing {
        /// Leg.
        leg: u8,
        /// Which end.
        side: Side,
        /// mm
        value_mm: f64,
        /// mm
        limit_mm: f64,
    },
    /// Lambda: the chain leans too far from the platform's normal.
    PlatformCone {
        /// Leg.
        leg: u8,
        /// rad
        angle_rad: f64,
        /// rad
        limit_rad: f64,
    },
    /// A strut or link has no direction: its two ends coincide.
    ZeroStrut {
        /// Strut.
        joint: u8,
    },
    /// This mode of the machine does not move the axis; it must be 0.
    AxisLocked {
        /// The axis.
        axis: Axis,
    },
}

/// Why joint positions have no pose.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ForwardError {
    /// A joint is NaN or infinite.
    NotFinite,
    /// The joints' circles (or spheres) do not meet.
    NoIntersection {
        /// For two mechanisms: which one.
        mechanism: Option<u8>,
        /// `too_far`, `too_close` or `coincident`.
        reason: NoIntersection,
    },
    /// The pose belongs to the other working mode of this chain.
    WrongWorkingMode {
        /// For two mechanisms: which one.
        mechanism: Option<u8>,
        /// Chain.
        chain: u8,
    },
    /// One-sided guides: the link would lie on the outer side of its guide.
    GuideSide {
        /// For two mechanisms: which one.
        mechanism: Option<u8>,
        /// Chain.
        chain: u8,
        /// Distance of the platform joint beyond the guide line, mm.
        excess_mm: f64,
    },
    /// The platform is not held: the pose cannot be known.
    Singular {
        /// The measure of [`crate::Singularity`] that is too small.
        measure: f64,
    },
    /// O-X glide: the sliders belong to the other form.
    WrongForm {
        /// Half the distance of the virtual centres, mm: positive in O, negative in X.
        c_mm: f64,
    },
    /// MOMA-W: a contour plane is not strictly between the platform planes.
    OutsideWireSpan {
        /// Height of the contour plane above the first platform plane, mm.
        plane_mm: f64,
        /// Distance of the platform planes, mm (signed).
        span_mm: f64,
    },
    /// Lambda: the sliders of this leg and its two chains make no triangle.
    LegTriangle {
        /// Leg.
        leg: u8,
        /// Distance of the two sliders, mm.
        spacing_mm: f64,
        /// Must lie strictly between these, mm.
        low_mm: f64,
        /// Upper end, mm.
        high_mm: f64,
    },
    /// Lambda: the heights of the platform joints ask for a platform tilted by 90° or more.
    TiltOutOfRange,
    /// No pose with these joints exists in the configured assembly mode.
    NoAssembly,
    /// The iteration ended without meeting its tolerance.
    NotConverged {
        /// Steps taken.
        iterations: u32,
        /// Largest remaining joint error, mm.
        residual_mm: f64,
    },
    /// This mode of the machine does not move the joint; it must be 0.
    JointLocked {
        /// The joint.
        joint: u8,
    },
}

/// How two circles fail to meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum NoIntersection {
    TooFar,
    TooClose,
    Coincident,
}

/// A code of the kinematics specification, e.g. `unreachable:1`, `m2:assembly`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Code {
    mechanism: Option<u8>,
    word: &'static str,
    number: Option<u8>,
}

impl Code {
    const fn plain(word: &'static str) -> Self {
        Self { mechanism: None, word, number: None }
    }

    const fn of(mechanism: Option<u8>, word: &'static str) -> Self {
        Self { mechanism, word, number: None }
    }

    const fn chain(mechanism: Option<u8>, word: &'static str, chain: u8) -> Self {
        Self { mechanism, word, number: Some(chain) }
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(mechanism) = self.mechanism {
            write!(f, "m{}:", u16::from(mechanism) + 1)?;
        }
        f.write_str(self.word)?;
        match self.number {
            Some(number) => write!(f, ":{}", u16::from(number) + 1),
            None => Ok(()),
        }
    }
}

/// "mechanism 2: " or nothing, for sentences.
struct Of(Option<u8>);

impl fmt::Display for Of {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(mechanism) => write!(f, "mechanism {}: ", u16::from(mechanism) + 1),
            None => Ok(()),
        }
    }
}

/// From 0 inside to 1 in text.
fn nth(index: u8) -> u16 {
    u16::from(index) + 1
}

impl InverseError {
    /// The code of the kinematics specification, e.g. `unreachable:1`, `m2:assembly`.
    pub fn code(&self) -> impl fmt::Display + use<> {
        match *self {
            Self::NotFinite => Code::plain("not_finite"),
            Self::OutOfReach { mechanism, chain, .. } => Code::chain(mechanism, "unreachable", chain),
            Self::WrongAssembly { mechanism } => Code::of(mechanism, "assembly"),
            Self::GuideSide { mechanism, chain, .. } => Code::chain(mechanism, "guide_side", chain),
            Self::Singular { .. } => Code::plain("singular"),
            Self::FormSwitch { .. } => Code::plain("singular:form_switch"),
            Self::TooFarFromRails { .. } => Code::plain("unreachable"),
            Self::BelowRails { .. } => Code::plain("below_rails"),
            Self::OutsideWireSpan { .. } => Code::plain("outside_wire_span"),
            Self::WireLength { .. } => Code::plain("wire_length"),
            Self::WireTilt { .. } => Code::plain("wire_tilt"),
            Self::OnShaft { leg } => Code::chain(None, "on_shaft", leg),
            Self::LongChainReach { leg, .. } => Code::chain(None, "long_chain_reach", leg),
            Self::ShortChainReach { leg, .. } => Code::chain(None, "short_chain_reach", leg),
            Self::Spacing { leg, side: Side::Low, .. } => Code::chain(None, "spacing_min", leg),
            Self::Spacing { leg, side: Side::High, .. } => Code::chain(None, "spacing_max", leg),
            Self::PlatformCone { leg, .. } => Code::chain(None, "platform_cone", leg),
            Self::ZeroStrut { joint } => Code::chain(None, "zero_strut", joint),
            Self::AxisLocked { axis } => Code::plain(match axis {
                Axis::A => "axis_locked:A",
                Axis::B => "axis_locked:B",
                Axis::C => "axis_locked:C",
                _ => "axis_locked",
            }),
        }
    }

    /// The same error, told of one of two mechanisms.
    pub(crate) fn of_mechanism(self, number: u8) -> Self {
        match self {
            Self::OutOfReach { chain, deficit_mm, .. } => {
                Self::OutOfReach { mechanism: Some(number), chain, deficit_mm }
            }
            Self::WrongAssembly { .. } => Self::WrongAssembly { mechanism: Some(number) },
            Self::GuideSide { chain, excess_mm, .. } => {
                Self::GuideSide { mechanism: Some(number), chain, excess_mm }
            }
            other => other,
        }
    }
}

impl fmt::Display for InverseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite => f.write_str("a coordinate or rate is not a finite number"),
            Self::OutOfReach { mechanism, chain, deficit_mm } => write!(
                f,
                "{}link {} is {deficit_mm:.3} mm too short to reach this point; move it nearer to guide {1}",
                Of(mechanism),
                nth(chain),
            ),
            Self::WrongAssembly { mechanism } => write!(
                f,
                "{}this point belongs to the other assembly mode, which lies behind a singularity; \
                 stay on the configured side of the line through both sliders",
                Of(mechanism),
            ),
            Self::GuideSide { mechanism, chain, excess_mm } => write!(
                f,
                "{}link {} would have to pass through its guide: the joint is {excess_mm:.3} mm on the outer side",
                Of(mechanism),
                nth(chain),
            ),
            Self::Singular { measure } => write!(
                f,
                "singular pose (measure {measure:.2e}): joints and tool do not determine each other's speed here",
            ),
            Self::FormSwitch { c_mm, guard_mm } => write!(
                f,
                "{c_mm:.3} mm from the form switch, where the platform is not held (guard {guard_mm} mm); \
                 lower y, or use the form-switch command",
            ),
            Self::TooFarFromRails { y_mm, limit_mm } => {
                write!(f, "y = {y_mm:.3} mm is out of the links' reach (0 to {limit_mm:.3} mm)")
            }
            Self::BelowRails { y_mm } => {
                write!(f, "y = {y_mm:.3} mm is behind the rails; y must be 0 or more")
            }
            Self::OutsideWireSpan { plane_mm, span_mm } => write!(
                f,
                "a contour plane is {plane_mm:.3} mm from platform plane 1; \
                 it must lie between the platform planes (0 to {span_mm:.3} mm): move the table",
            ),
            Self::WireLength { length_mm, limit_mm } => {
                write!(f, "the wire would be {length_mm:.3} mm long (limit {limit_mm:.3} mm)")
            }
            Self::WireTilt { tangent, limit } => write!(
                f,
                "the wire would lean {:.3}° (limit {:.3}°)",
                degrees(crate::maths::atan(tangent)),
                degrees(crate::maths::atan(limit)),
            ),
            Self::OnShaft { leg } => write!(f, "platform joint {} lies on its shaft", nth(leg)),
            Self::LongChainReach { leg, rho_mm, limit_mm } => write!(
                f,
                "platform joint {} is {rho_mm:.3} mm from its shaft; the long chain reaches less than {limit_mm:.3} mm",
                nth(leg),
            ),
            Self::ShortChainReach { leg, rho_mm, limit_mm } => write!(
                f,
                "the rotary joint of leg {} is {rho_mm:.3} mm from its shaft; \
                 the short chain reaches less than {limit_mm:.3} mm",
                nth(leg),
            ),
            Self::Spacing { leg, side, value_mm, limit_mm } => write!(
                f,
                "the sliders of leg {} would be {value_mm:.3} mm apart ({} {limit_mm:.3} mm)",
                nth(leg),
                match side {
                    Side::Low => "least",
                    Side::High => "most",
                },
            ),
            Self::PlatformCone { leg, angle_rad, limit_rad } => write!(
                f,
                "chain {} leans {:.3}° from the platform normal (limit {:.3}°)",
                nth(leg),
                degrees(angle_rad),
                degrees(limit_rad),
            ),
            Self::ZeroStrut { joint } => write!(f, "the ends of strut {} coincide", nth(joint)),
            Self::AxisLocked { axis } => {
                write!(f, "axis {} does not move in this mode of the machine; it must be 0", axis.letter())
            }
        }
    }
}

impl core::error::Error for InverseError {}

impl ForwardError {
    /// The code of the kinematics specification, e.g. `no_intersection:too_far`, `m1:working_mode:2`.
    pub fn code(&self) -> impl fmt::Display + use<> {
        match *self {
            Self::NotFinite => Code::plain("not_finite"),
            Self::NoIntersection { mechanism, reason } => Code::of(
                mechanism,
                match reason {
                    NoIntersection::TooFar => "no_intersection:too_far",
                    NoIntersection::TooClose => "no_intersection:too_close",
                    NoIntersection::Coincident => "no_intersection:coincident",
                },
            ),
            Self::WrongWorkingMode { mechanism, chain } => Code::chain(mechanism, "working_mode", chain),
            Self::GuideSide { mechanism, chain, .. } => Code::chain(mechanism, "guide_side", chain),
            Self::Singular { .. } => Code::plain("singular"),
            Self::WrongForm { .. } => Code::plain("wrong_form"),
            Self::OutsideWireSpan { .. } => Code::plain("outside_wire_span"),
            Self::LegTriangle { leg, .. } => Code::chain(None, "leg_triangle", leg),
            Self::TiltOutOfRange => Code::plain("tilt_out_of_range"),
            Self::NoAssembly => Code::plain("no_assembly"),
            Self::NotConverged { .. } => Code::plain("not_converged"),
            Self::JointLocked { joint } => Code::chain(None, "joint_locked", joint),
        }
    }

    /// The same error, told of one of two mechanisms.
    pub(crate) fn of_mechanism(self, number: u8) -> Self {
        match self {
            Self::NoIntersection { reason, .. } => Self::NoIntersection { mechanism: Some(number), reason },
            Self::WrongWorkingMode { chain, .. } => Self::WrongWorkingMode { mechanism: Some(number), chain },
            Self::GuideSide { chain, excess_mm, .. } => {
                Self::GuideSide { mechanism: Some(number), chain, excess_mm }
            }
            other => other,
        }
    }
}

impl fmt::Display for ForwardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite => f.write_str("a joint position is not a finite number"),
            Self::NoIntersection { mechanism, reason } => write!(
                f,
                "{}the links do not meet: the sliders are {}",
                Of(mechanism),
                match reason {
                    NoIntersection::TooFar => "too far apart; bring them nearer to each other",
                    NoIntersection::TooClose => "too close to each other; move them apart",
                    NoIntersection::Coincident => "at one place, the platform is not held; move them apart",
                },
            ),
            Self::WrongWorkingMode { mechanism, chain } => write!(
                f,
                "{}these joints put chain {} beyond its fold, in the other working mode; move slider {1} back",
                Of(mechanism),
                nth(chain),
            ),
            Self::GuideSide { mechanism, chain, excess_mm } => write!(
                f,
                "{}link {} would have to pass through its guide: the joint is {excess_mm:.3} mm on the outer side",
                Of(mechanism),
                nth(chain),
            ),
            Self::Singular { measure } => {
                write!(f, "singular (measure {measure:.2e}): these joints do not hold the platform")
            }
            Self::WrongForm { c_mm } => write!(
                f,
                "the sliders stand in the {} form (c = {c_mm:.3} mm); use the form-switch command first",
                if c_mm > 0.0 { "O" } else { "X" },
            ),
            Self::OutsideWireSpan { plane_mm, span_mm } => write!(
                f,
                "a contour plane is {plane_mm:.3} mm from platform plane 1; \
                 it must lie between the platform planes (0 to {span_mm:.3} mm): move the table",
            ),
            Self::LegTriangle { leg, spacing_mm, low_mm, high_mm } => write!(
                f,
                "the sliders of leg {} are {spacing_mm:.3} mm apart; its chains close only between \
                 {low_mm:.3} and {high_mm:.3} mm",
                nth(leg),
            ),
            Self::TiltOutOfRange => {
                f.write_str("the platform joints' heights differ too much: no platform fits them")
            }
            Self::NoAssembly => {
                f.write_str("no pose with these joints exists in the configured assembly mode")
            }
            Self::NotConverged { iterations, residual_mm } => write!(
                f,
                "no pose found in {iterations} steps (joint error {residual_mm:.2e} mm left); \
                 give a seed pose nearer to the machine's",
            ),
            Self::JointLocked { joint } => {
                write!(f, "joint {} does not move in this mode of the machine; it must be 0", nth(joint))
            }
        }
    }
}

impl core::error::Error for ForwardError {}
