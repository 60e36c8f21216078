//! What limits the machine in one servo period.

use pkm_kins::{Joints, MAX_JOINTS};
use pkm_machine::Machine;
use pkm_planner::{Setpoint, State};

/// A limit that uses at least this share of itself is what limits the motion.
const SATURATED: f64 = 0.97;

/// The limit that is used most in a servo period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Limited {
    /// The programmed feed is got.
    Feed,
    /// A dwell.
    Dwell,
    /// Nothing is at its limit: short moves from stop to stop, rounding to whole servo periods.
    LookAhead,
    /// A joint's velocity (joints counted from 0), on a corner's blend or not.
    #[allow(missing_docs)]
    Velocity { joint: usize, corner: bool },
    /// A joint's acceleration.
    #[allow(missing_docs)]
    Acceleration { joint: usize, corner: bool },
    /// The feed, on a corner's blend.
    Corner,
    /// The spindle, in step with it.
    Spindle,
}

impl Limited {
    /// In words: `feed`, `p1 velocity`, `corner: p1 acceleration`, `dwell`, `look-ahead`, `spindle`.
    pub fn words(self, machine: &Machine) -> String {
        let name = |joint: usize| machine.joints.get(joint).map_or("?", |j| j.name.as_str());
        let at = |corner| if corner { "corner: " } else { "" };
        match self {
            Self::Feed => "feed".to_owned(),
            Self::Corner => "corner: feed".to_owned(),
            Self::Dwell => "dwell".to_owned(),
            Self::LookAhead => "look-ahead".to_owned(),
            Self::Spindle => "spindle".to_owned(),
            Self::Velocity { joint, corner } => format!("{}{} velocity", at(corner), name(joint)),
            Self::Acceleration { joint, corner } => format!("{}{} acceleration", at(corner), name(joint)),
        }
    }

    /// The same limit, wherever it was met.
    pub(crate) fn cause(self) -> Self {
        match self {
            Self::Corner => Self::Feed,
            Self::Velocity { joint, .. } => Self::Velocity { joint, corner: false },
            Self::Acceleration { joint, .. } => Self::Acceleration { joint, corner: false },
            other => other,
        }
    }

    /// As the subject of a sentence: `the programmed feed`, `p1's velocity`, `a dwell`, `stopping and starting`.
    pub(crate) fn subject(self, machine: &Machine) -> String {
        let name = |joint: usize| machine.joints.get(joint).map_or("?", |j| j.name.as_str());
        match self {
            Self::Feed | Self::Corner => "the programmed feed".to_owned(),
            Self::Dwell => "a dwell".to_owned(),
            Self::LookAhead => "stopping and starting".to_owned(),
            Self::Spindle => "the spindle".to_owned(),
            Self::Velocity { joint, .. } => format!("{}'s velocity", name(joint)),
            Self::Acceleration { joint, .. } => format!("{}'s acceleration", name(joint)),
        }
    }
}

/// What limits the period that ends with `setpoint`, and how much every joint's limits are used (velocity, acceleration;
/// signed, 1 = at the limit). `before` are the joints two periods and one period ago.
pub fn limited(
    machine: &Machine,
    setpoint: &Setpoint,
    before: &[Joints; 2],
    period_s: f64,
) -> (Limited, [[f64; 2]; MAX_JOINTS]) {
    let corner = setpoint.blending;
    let mut shares = [[0.0; 2]; MAX_JOINTS];
    let mut most = (setpoint.feed_use, if corner { Limited::Corner } else { Limited::Feed });
    let now = &setpoint.joints;
    for (j, (joint, share)) in machine.joints.iter().zip(&mut shares).enumerate() {
        let change = now[j] - 2.0 * before[1][j] + before[0][j];
        *share = [
            (now[j] - before[1][j]) / period_s / joint.max_velocity,
            change / (period_s * period_s) / joint.max_acceleration,
        ];
        if share[0].abs() > most.0 {
            most = (share[0].abs(), Limited::Velocity { joint: j, corner });
        }
        if share[1].abs() > most.0 {
            most = (share[1].abs(), Limited::Acceleration { joint: j, corner });
        }
    }
    let limit = match most {
        _ if setpoint.state == State::Dwell => Limited::Dwell,
        (share, _) if share < SATURATED => Limited::LookAhead,
        (_, limit) => limit,
    };
    (limit, shares)
}
