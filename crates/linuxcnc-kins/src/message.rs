//! Errors as texts for LinuxCNC: a C format and its numbers, so that LinuxCNC's own `printf` writes them. Rust's formatting is
//! not used: it contains panics.

use crate::mechanism::SwitchError;
use core::ffi::CStr;
use pkm_kins::{Axis, ForwardError, GeometryError, InverseError, NoIntersection, Side, maths};

/// A message. Every format begins with `%s: `, the module's name; then come the arguments named here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Message {
    /// Two numbers.
    Plain(&'static CStr, f64, f64),
    /// Joint (counted from 0, as LinuxCNC does), then two numbers.
    Joint(&'static CStr, i32, f64, f64),
    /// A text, then two numbers.
    Named(&'static CStr, &'static str, f64, f64),
}

use Message::{Joint, Named, Plain};

/// First joint of a mechanism of two.
fn planar_joint(mechanism: Option<u8>, chain: u8) -> i32 {
    i32::from(mechanism.unwrap_or(0)).saturating_mul(2).saturating_add(i32::from(chain))
}

impl From<&InverseError> for Message {
    fn from(error: &InverseError) -> Self {
        match *error {
            InverseError::NotFinite => Plain(c"%s: a coordinate is not a finite number\n", 0.0, 0.0),
            InverseError::OutOfReach { mechanism, chain, deficit_mm } => Joint(
                c"%s: joint %d: its link is %.3f mm too short to reach this point\n",
                planar_joint(mechanism, chain),
                deficit_mm,
                0.0,
            ),
            InverseError::WrongAssembly { mechanism } => Joint(
                c"%s: joint %d and the next: this point lies behind a singularity, in the other assembly mode\n",
                planar_joint(mechanism, 0),
                0.0,
                0.0,
            ),
            InverseError::GuideSide { mechanism, chain, excess_mm } => Joint(
                c"%s: joint %d: its link would have to pass through its rail (%.3f mm)\n",
                planar_joint(mechanism, chain),
                excess_mm,
                0.0,
            ),
            InverseError::Singular { measure } => Plain(c"%s: singular pose (measure %.2e)\n", measure, 0.0),
            InverseError::FormSwitch { c_mm, guard_mm } => Plain(
                c"%s: %.3f mm from the form switch (guard %.3f mm); lower Y, or switch the form\n",
                c_mm,
                guard_mm,
            ),
            InverseError::TooFarFromRails { y_mm, limit_mm } => {
                Plain(c"%s: Y %.3f mm is out of the links' reach (0 to %.3f mm)\n", y_mm, limit_mm)
            }
            InverseError::BelowRails { y_mm } => Plain(c"%s: Y %.3f mm is behind the rails\n", y_mm, 0.0),
            InverseError::OutsideWireSpan { plane_mm, span_mm } => Plain(
                c"%s: a contour plane is %.3f mm from platform plane 1, outside 0 to %.3f mm; move Z\n",
                plane_mm,
                span_mm,
            ),
            InverseError::WireLength { length_mm, limit_mm } => {
                Plain(c"%s: the wire would be %.3f mm long (limit %.3f mm)\n", length_mm, limit_mm)
            }
            InverseError::WireTilt { tangent, limit } => Plain(
                c"%s: the wire would lean by a tangent of %.4f (limit %.4f)\n",
                tangent,
                limit,
            ),
            InverseError::OnShaft { leg } => Joint(
                c"%s: joint %d: its platform joint lies on the shaft\n",
                i32::from(leg),
                0.0,
                0.0,
            ),
            InverseError::LongChainReach { leg, rho_mm, limit_mm } => Joint(
                c"%s: joint %d: its platform joint is %.3f mm from the shaft; the long chain reaches %.3f mm\n",
                i32::from(leg),
                rho_mm,
                limit_mm,
            ),
            InverseError::ShortChainReach { leg, rho_mm, limit_mm } => Joint(
                c"%s: joint %d: its rotary joint is %.3f mm from the shaft; the short chain reaches %.3f mm\n",
                i32::from(leg).saturating_add(3),
                rho_mm,
                limit_mm,
            ),
            InverseError::Spacing { leg, side, value_mm, limit_mm } => Joint(
                match side {
                    Side::Low => c"%s: joint %d would be %.3f mm from the slider above it (least %.3f mm)\n",
                    Side::High => c"%s: joint %d would be %.3f mm from the slider above it (most %.3f mm)\n",
                },
                i32::from(leg).saturating_add(3),
                value_mm,
                limit_mm,
            ),
            InverseError::PlatformCone { leg, angle_rad, limit_rad } => Joint(
                c"%s: joint %d: its chain leans %.3f degrees from the platform's normal (limit %.3f)\n",
                i32::from(leg),
                maths::degrees(angle_rad),
                maths::degrees(limit_rad),
            ),
            InverseError::ZeroStrut { joint } => {
                Joint(c"%s: joint %d: the ends of the strut coincide\n", i32::from(joint), 0.0, 0.0)
            }
            InverseError::AxisLocked { axis } => Named(
                c"%s: axis %s does not move with the mechanism that is active now\n",
                letter(axis),
                0.0,
                0.0,
            ),
            _ => Plain(c"%s: this pose has no joints\n", 0.0, 0.0),
        }
    }
}

fn letter(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "X",
        Axis::Y => "Y",
        Axis::Z => "Z",
        Axis::A => "A",
        Axis::B => "B",
        Axis::C => "C",
        Axis::U => "U",
        Axis::V => "V",
        Axis::W => "W",
    }
}

impl From<&ForwardError> for Message {
    fn from(error: &ForwardError) -> Self {
        match *error {
            ForwardError::NotFinite => Plain(c"%s: a joint position is not a finite number\n", 0.0, 0.0),
            ForwardError::NoIntersection { mechanism, reason } => Joint(
                match reason {
                    NoIntersection::TooFar => c"%s: joint %d and the next are too far apart: their links do not meet\n",
                    NoIntersection::TooClose => c"%s: joint %d and the next are too close: their links do not meet\n",
                    NoIntersection::Coincident => c"%s: joint %d and the next are at one place\n",
                },
                planar_joint(mechanism, 0),
                0.0,
                0.0,
            ),
            ForwardError::WrongWorkingMode { mechanism, chain } => Joint(
                c"%s: joint %d stands beyond its link's fold, in the other working mode; move it back\n",
                planar_joint(mechanism, chain),
                0.0,
                0.0,
            ),
            ForwardError::GuideSide { mechanism, chain, excess_mm } => Joint(
                c"%s: joint %d: its link would have to pass through its rail (%.3f mm)\n",
                planar_joint(mechanism, chain),
                excess_mm,
                0.0,
            ),
            ForwardError::Singular { measure } => {
                Plain(c"%s: singular (measure %.2e): these joints do not hold the platform\n", measure, 0.0)
            }
            ForwardError::WrongForm { c_mm } => Plain(
                c"%s: the sliders stand in the other form (c = %.3f mm); switch the form\n",
                c_mm,
                0.0,
            ),
            ForwardError::OutsideWireSpan { plane_mm, span_mm } => Plain(
                c"%s: a contour plane is %.3f mm from platform plane 1, outside 0 to %.3f mm\n",
                plane_mm,
                span_mm,
            ),
            ForwardError::LegTriangle { leg, spacing_mm, high_mm, .. } => Joint(
                c"%s: joint %d is %.3f mm from the slider below it; their chains do not close (most %.3f mm)\n",
                i32::from(leg),
                spacing_mm,
                high_mm,
            ),
            ForwardError::TiltOutOfRange => {
                Plain(c"%s: the joints' heights differ too much: no platform fits them\n", 0.0, 0.0)
            }
            ForwardError::NoAssembly => {
                Plain(c"%s: no pose has these joints in the configured assembly mode\n", 0.0, 0.0)
            }
            ForwardError::NotConverged { iterations, residual_mm } => Plain(
                c"%s: no pose found in %.0f steps (%.2e mm left)\n",
                f64::from(iterations),
                residual_mm,
            ),
            ForwardError::JointLocked { joint } => {
                Joint(c"%s: joint %d does not move in this mode; it must be 0\n", i32::from(joint), 0.0, 0.0)
            }
            _ => Plain(c"%s: these joints have no pose\n", 0.0, 0.0),
        }
    }
}

impl From<&GeometryError> for Message {
    fn from(error: &GeometryError) -> Self {
        let named = |key: pkm_kins::Key, value, limit| {
            Named(
                c"%s: the geometry makes no mechanism: %s = %g (limit %g); machine not moved\n",
                key.name,
                value,
                limit,
            )
        };
        match *error {
            GeometryError::OutOfRange { key, value, low, high } => {
                named(key, value, if value < low { low } else { high })
            }
            GeometryError::NotPositive { key, value } => named(key, value, 0.0),
            GeometryError::NotASign { key, value } => Named(
                c"%s: the geometry makes no mechanism: %s = %g must be 1 or -1\n",
                key.name,
                f64::from(value),
                0.0,
            ),
            GeometryError::NotLess { key, value, limit, .. } => named(key, value, limit),
            GeometryError::DegeneratePlanes { key } => named(key, 0.0, 0.0),
            GeometryError::NotFinite { key } => named(key, f64::NAN, 0.0),
            _ => Plain(c"%s: the geometry makes no mechanism: rails or points coincide\n", 0.0, 0.0),
        }
    }
}

impl From<&SwitchError> for Message {
    fn from(error: &SwitchError) -> Self {
        match error {
            SwitchError::NoSuchType => Plain(c"%s: motion.switchkins-type has no meaning here\n", 0.0, 0.0),
            SwitchError::Moving => Plain(c"%s: kinematics can be switched only at rest\n", 0.0, 0.0),
            SwitchError::State(error) => error.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    /// motmod reads formats itself: `%`, digits and a point, one of the plain conversions; nothing else.
    #[test]
    fn formats_are_plain_and_match_their_arguments() {
        let (own, _) = include_str!("message.rs").split_once("#[cfg(test)]").unwrap();
        let source = [own, include_str!("module.rs"), include_str!("ffi.rs")].concat();
        let mut formats = 0;
        for format in source.split("c\"%s: ").skip(1).filter_map(|rest| rest.split('"').next()) {
            formats += 1;
            for conversion in format.split('%').skip(1) {
                let letter =
                    conversion.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.').chars().next();
                assert!(matches!(letter, Some('s' | 'd' | 'f' | 'g' | 'e')), "{format}");
            }
            assert!(format.ends_with("\\n"), "{format}");
        }
        assert!(formats > 40, "{formats}");
    }
}
