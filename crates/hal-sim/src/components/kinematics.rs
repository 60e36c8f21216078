//! `kinematics`: where the tool is, from where the joints are: the forward kinematics of a mechanism.
//!
//! | pin                    | type      | meaning                                                      |
//! |------------------------|-----------|--------------------------------------------------------------|
//! | `kinematics.joint.N`   | float in  | position of the joint, mm or degrees                         |
//! | `kinematics.axis.L`    | float out | the pose, mm or degrees; stays as it was where there is none |
//! | `kinematics.ok`        | bit out   | the mechanism can be where the joints are                    |
//!
//! Function: `kinematics.forward`. The solution is sought near the last pose.

use crate::component::{Component, Fault, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};
use pkm_kins::{Axis, JointKind, Joints, Kinematics, MAX_JOINTS, Pose, maths};

/// See the module.
#[derive(Debug, Clone)]
pub struct Forward<K> {
    mechanism: K,
    joints: Vec<(JointKind, FloatPin)>,
    axes: Vec<(Axis, FloatPin)>,
    ok: BitPin,
    pose: Pose,
}

impl<K: Kinematics + Clone + Send + Sync + 'static> Forward<K> {
    /// Loads the component; the mechanism is at `start` (mm, rad).
    ///
    /// # Errors
    /// `Taken` if it is loaded already.
    pub fn load(hal: &mut Hal, mechanism: K, start: Pose) -> Result<(), HalError> {
        let at_start = mechanism.inverse(&start).unwrap_or_default();
        let mut joints = Vec::new();
        for (n, start) in at_start.into_iter().enumerate().take(mechanism.joint_count()) {
            let kind = mechanism.joint_kind(n);
            let value = if kind == JointKind::Rotary { maths::degrees(start) } else { start };
            joints.push((
                kind,
                hal.new_float("kinematics", &format!("kinematics.joint.{n}"), Role::In, value)?,
            ));
        }
        let mut axes = Vec::new();
        for axis in mechanism.axes().iter() {
            let name = format!("kinematics.axis.{}", axis.letter().to_ascii_lowercase());
            let value = start.get(axis);
            let value = if axis.is_rotary() { maths::degrees(value) } else { value };
            axes.push((axis, hal.new_float("kinematics", &name, Role::Out, value)?));
        }
        let ok = hal.new_bit("kinematics", "kinematics.ok", Role::Out, true)?;
        let component = Self { mechanism, joints, axes, ok, pose: start };
        hal.add_component(Box::new(component), &["kinematics.forward".to_owned()])
    }
}

impl<K: Kinematics + Clone + Send + Sync + 'static> Component for Forward<K> {
    fn name(&self) -> &'static str {
        "kinematics"
    }

    fn run(&mut self, _function: usize, values: &mut Values, _tick: &Tick<'_>) -> Result<(), Fault> {
        let mut joints: Joints = [0.0; MAX_JOINTS];
        for (joint, (kind, pin)) in joints.iter_mut().zip(&self.joints) {
            let value = values.float(*pin);
            *joint = if *kind == JointKind::Rotary { maths::radians(value) } else { value };
        }
        let pose = if joints.iter().all(|joint| joint.is_finite()) {
            self.mechanism.forward(&joints, &self.pose).ok()
        } else {
            None
        };
        values.set_bit(self.ok, pose.is_some());
        if let Some(pose) = pose {
            self.pose = pose;
            for (axis, pin) in &self.axes {
                let value = pose.get(*axis);
                values.set_float(*pin, if axis.is_rotary() { maths::degrees(value) } else { value });
            }
        }
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
