//! Another mechanism: a machine at rest goes on with other kinematics (switchable kinematics, a form switch).

use crate::planner::{Planner, PushError, State};
use crate::{PlanError, PlanErrorKind};
use pkm_canon::Span;
use pkm_kins::{Kinematics, Pose};

impl<K: Kinematics, const R: usize, const PIECES: usize, const NODES: usize> Planner<K, R, PIECES, NODES> {
    /// Goes on with other kinematics of the same joints, from the pose of theirs at which the joints stand now. The
    /// limits, the overrides and the numbers of the moves stay.
    ///
    /// # Errors
    /// [`PushError::Full`]: not idle yet, see [`Self::finish`] and [`Self::is_idle`]. [`PushError::Plan`]: the pose is
    /// out of reach or out of travel. In either case nothing has changed.
    pub fn switch(&mut self, kinematics: K, pose: Pose, span: Span) -> Result<(), PushError> {
        if !self.is_idle() {
            return Err(PushError::Full);
        }
        let fail = |kind| PushError::Plan(PlanError { kind, span, pose });
        let joints = kinematics.inverse(&pose).map_err(|e| fail(PlanErrorKind::Unreachable(e)))?;
        self.limits.check_travel(&pose, &joints).map_err(fail)?;
        self.kinematics = kinematics;
        self.setpoint.pose = pose;
        self.setpoint.joints = joints;
        self.setpoint.joint_velocity = Default::default();
        self.setpoint.span = span;
        self.setpoint.state = State::Idle;
        self.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{FeedGroup, Geometry, Line};
    use crate::{Feed, JointLimits, Limits, Move, PathMode, Settings};
    use pkm_kins::{Axis, HvMachine, HvMachineParameters, InverseError, JointRange, Spindle};

    type Small = Planner<HvMachine, 8, 16, 64>;

    fn planner() -> Small {
        let linear = JointLimits {
            range: JointRange { min: 0.0, max: 400.0 },
            max_velocity: 100.0,
            max_acceleration: 1e3,
        };
        let rotary = JointLimits {
            range: JointRange { min: -9.0, max: 9.0 },
            max_velocity: 2.0,
            max_acceleration: 20.0,
        };
        let limits =
            Limits::new(&[linear, linear, linear, linear, linear, rotary, rotary], &[], 1e-3).unwrap();
        let machine = HvMachine::new(&HvMachineParameters::seven()).unwrap();
        let settings = Settings { servo_period_s: 1e-3, substeps: 1, settle_periods: 0 };
        Planner::new(machine, limits, settings, Pose::ZERO).unwrap()
    }

    fn line(planner: &Small, to: Pose) -> Move {
        let geometry = Geometry::Line(Line::new(*planner.end(), to.to_array()).unwrap());
        let feed = Feed { speed: 50.0, group: FeedGroup::Xyz };
        Move { geometry, feed, rapid: false, mode: PathMode::ExactStop, span: Span::default() }
    }

    /// Every place of such a line can be reached; that the axis moves is what is refused, before anything is cut.
    #[test]
    fn a_line_along_the_axis_of_the_idle_mechanism_is_refused_by_the_push() {
        let mut planner = planner();
        let refused = planner.push(line(&planner, Pose { x: 10.0, u: 3.0, ..Pose::ZERO }));
        let Err(PushError::Plan(error)) = refused else { panic!("{refused:?}") };
        let locked = PlanErrorKind::Unreachable(InverseError::AxisLocked { axis: Axis::U });
        assert_eq!((error.kind, planner.work().nodes), (locked, 0));
    }

    #[test]
    fn goes_on_with_the_other_mechanism_and_the_idle_one_holds() {
        let mut planner = planner();
        planner.push(line(&planner, Pose { x: 10.0, z: 5.0, b: 0.2, ..Pose::ZERO })).unwrap();
        planner.finish();
        planner.tick().unwrap();
        let machine = *planner.kinematics();
        let early = planner.switch(machine, Pose::ZERO, Span::default());
        assert_eq!(early, Err(PushError::Full), "it moves");
        for _ in 0..2000 {
            planner.tick().unwrap();
        }
        assert!(planner.is_idle());
        let stands = *planner.setpoint();
        // A place that V cannot be at: refused, and nothing changes.
        let (v, pose) = machine.switch(Spindle::V, &stands.joints, &stands.pose).unwrap();
        let far = planner.switch(v, Pose { u: 999.0, ..pose }, Span::default());
        assert!(matches!(far, Err(PushError::Plan(_))), "{far:?}");
        assert_eq!((*planner.setpoint(), *planner.kinematics()), (stands, machine));

        planner.switch(v, pose, Span::default()).unwrap();
        assert!(planner.is_idle());
        assert_eq!(*planner.end(), pose.to_array());
        let to = Pose { u: pose.u + 9.0, w: pose.w - 4.0, c: pose.c + 0.3, b: 0.1, ..pose };
        planner.push(line(&planner, to)).unwrap();
        planner.finish();
        let mut before = stands.joints;
        for _ in 0..3000 {
            let joints = planner.tick().unwrap().joints;
            assert_eq!(joints[..2], stands.joints[..2], "H holds");
            // No jump at the switch: at most a millionth of what the limits allow in a period.
            let jump = joints.iter().zip(&before).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
            assert!(jump <= 0.1 + 1e-7, "{jump}");
            before = joints;
        }
        assert!(planner.is_idle());
        assert_eq!(planner.setpoint().pose, to);
    }
}
