//! The two machines whose kinematics can be switched by `motion.switchkins-type`.
//!
//! LinuxCNC switches between two servo periods: it calls `kinematicsSwitch`, then forward for the joints where they stand. The
//! task must be brought to rest first (`M66 E0 L0`); `pkm linuxcnc` writes M codes that do it.

use crate::mechanism::{Mechanism, Shipped, SwitchError};
use crate::module::QUIET;
use pkm_kins::*;

/// How LinuxCNC drives the machine, told from its calls (motmod's control.c):
///
/// * Through the pose (programs, MDI, world mode): each servo period forward of the joints' feedback, then inverse. The joints
///   follow interpolated, two periods later, so that they still move when the pose is at rest. Between periods inverse is also
///   asked for the ends of lines to come: one that differs counts as motion.
/// * Joint by joint (joint mode): forward of the feedback, then forward of the commands. Machine off: forward of the feedback,
///   which is then the command. Not homed: nothing.
/// * A switch: `kinematicsSwitch`, then at once forward of the interpolated commands, for the pose to go on from.
#[derive(Debug, Clone, Copy)]
struct Drive {
    /// Where inverse last sent the joints, or a switch found that it had.
    joints: Joints,
    /// The pose of that.
    pose: Pose,
    moving: bool,
    /// Calls of forward since.
    quiet: u32,
    /// Joints and pose of the last two of them. From one LinuxCNC takes the pose when it begins to drive it: from the command;
    /// the other is feedback, which a servo's following error keeps away from it.
    told: [(Joints, Pose); 2],
    /// A switch was the last call.
    switched: bool,
}

/// Less than this in an axis is none, mm or rad.
const SAME: f64 = 1e-9;

fn same(a: &Pose, b: &Pose) -> bool {
    Axis::ALL.into_iter().all(|axis| maths::fabs(a.get(axis) - b.get(axis)) <= SAME)
}

impl Drive {
    const UNKNOWN: Self = Self {
        joints: [0.0; MAX_JOINTS],
        pose: Pose::ZERO,
        moving: false,
        quiet: QUIET,
        told: [([0.0; MAX_JOINTS], Pose::ZERO); 2],
        switched: false,
    };

    /// Through the pose?
    #[inline(always)]
    fn by_pose(&self) -> bool {
        self.quiet < QUIET
    }

    /// LinuxCNC begins to drive `pose`: where the joints stand.
    fn start(&self, pose: &Pose) -> &Joints {
        let [earlier, last] = &self.told;
        if same(&earlier.1, pose) { &earlier.0 } else { &last.0 }
    }

    /// Inverse has solved.
    #[inline(always)]
    fn sent(&mut self, pose: &Pose, joints: &Joints) {
        self.moving = !same(pose, &self.pose);
        (self.pose, self.joints, self.quiet) = (*pose, *joints, 0);
    }

    /// Forward is called: the joints and the seed to answer for. While the pose is driven, what the joints do not say is where
    /// it was commanded, not where the feedback's seed had it when a switch came.
    #[inline(always)]
    fn asked(&mut self, joints: &Joints, seed: &Pose) -> (Joints, Pose) {
        self.quiet = self.quiet.saturating_add(1);
        let switched = core::mem::take(&mut self.switched);
        match (self.by_pose(), switched) {
            // The interpolation still has the joints a little before where they go.
            (true, true) => (self.joints, self.pose),
            (true, false) => (*joints, self.pose),
            (false, _) => (*joints, *seed),
        }
    }

    /// Forward has answered.
    #[inline(always)]
    fn answered(&mut self, joints: &Joints, pose: &Pose) {
        let [_, last] = self.told;
        self.told = [last, (*joints, *pose)];
    }

    /// Switches at rest only, and while the pose is driven only to a kinematics that has a pose for the joints.
    fn switch(
        &mut self,
        forward: impl FnOnce(&Joints, &mut Pose) -> Result<(), ForwardError>,
    ) -> Result<(), SwitchError> {
        if !self.by_pose() {
            return Ok(());
        }
        if self.moving {
            return Err(SwitchError::Moving);
        }
        forward(&self.joints, &mut self.pose).map_err(SwitchError::State)?;
        self.switched = true;
        Ok(())
    }
}

/// HV-Mill with both mechanisms. Type 0: the one that the parameter `vertical` names; type 1: the other.
///
/// The idle mechanism holds its joints, where inverse last sent them or where they were found when LinuxCNC began to drive the
/// pose; its coordinates stay as commanded.
#[derive(Debug, Clone, Copy)]
pub struct HvMachineKins {
    machine: HvMachine,
    /// The mechanism of type 0.
    first: Spindle,
    drive: Drive,
    /// The pose when LinuxCNC began to drive it: coordinates of the idle mechanism must stay there.
    anchor: Pose,
}

/// More than this of an axis that does not move is an error, mm or rad.
const IDLE_TOLERANCE: f64 = 1e-6;

impl Mechanism for HvMachineKins {
    type Parameters = HvMachineParameters;
    const PREFIX: &'static str = "hv-machine";
    const DEGREES: bool = true;
    const ROTARY_JOINTS: u32 = 0b110_0000;
    const TYPES: i32 = 2;
    const SHIPPED: Shipped<HvMachineParameters> =
        &[("hv-mill-7", HvMachineParameters::seven), ("hv-mill-6", HvMachineParameters::six)];

    fn new(parameters: &HvMachineParameters, before: Option<&Self>) -> Result<Self, GeometryError> {
        let machine = HvMachine::new(parameters)?;
        Ok(match before {
            None => Self { machine, first: parameters.active, drive: Drive::UNKNOWN, anchor: Pose::ZERO },
            // Which mechanism is active is not geometry: it stays, with the joints it holds.
            Some(before) => {
                Self { machine: machine.holding(before.machine.active(), &before.drive.joints), ..*before }
            }
        })
    }

    #[inline(always)]
    fn inverse(&mut self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        if !self.drive.by_pose() {
            self.machine = self.machine.holding(self.machine.active(), self.drive.start(pose));
            self.anchor = *pose;
        }
        let mut displacement = Pose::ZERO;
        for axis in Axis::ALL {
            let by = pose.get(axis) - self.anchor.get(axis);
            displacement.set(axis, if maths::fabs(by) <= IDLE_TOLERANCE { 0.0 } else { by });
        }
        if let Some(axis) = self.machine.idle_axis(&displacement) {
            return Err(InverseError::AxisLocked { axis });
        }
        let mut found = [0.0; MAX_JOINTS];
        self.machine.inverse_into(pose, &mut found)?;
        for (place, joint) in joints.iter_mut().zip(&found).take(self.machine.joint_count()) {
            *place = *joint;
        }
        self.drive.sent(pose, &found);
        Ok(())
    }

    #[inline(always)]
    fn forward(&mut self, joints: &Joints, pose: &mut Pose, _: &mut u32) -> Result<(), ForwardError> {
        // The seed has the coordinates of the idle mechanism.
        let (joints, mut found) = self.drive.asked(joints, pose);
        self.machine.forward_into(&joints, &mut found)?;
        self.drive.answered(&joints, &found);
        *pose = found;
        Ok(())
    }

    fn switch(&mut self, to: i32) -> Result<(), SwitchError> {
        let spindle = match (to, self.first) {
            (0, first) => first,
            (1, Spindle::H) => Spindle::V,
            (1, Spindle::V) => Spindle::H,
            _ => return Err(SwitchError::NoSuchType),
        };
        let machine = self.machine.holding(spindle, &self.drive.joints);
        self.drive.switch(|joints, pose| machine.forward_into(joints, pose))?;
        self.machine = machine;
        self.anchor = self.drive.pose;
        Ok(())
    }
}
/// O-X glide. Type 0: the form that the parameter `crossed` names; type 1: the other; type 2: X Y Z are the joints AB CD Z
/// themselves, for the move from one form to the other.
#[derive(Debug, Clone, Copy)]
pub struct OxGlideKins {
    machine: OxGlide,
    parameters: OxGlideParameters,
    joint_mode: bool,
    /// The form of type 0.
    first: OxForm,
    drive: Drive,
}

impl Mechanism for OxGlideKins {
    type Parameters = OxGlideParameters;
    const PREFIX: &'static str = "ox-glide";
    const DEGREES: bool = false;
    const TYPES: i32 = 3;
    const SHIPPED: Shipped<OxGlideParameters> =
        &[("ox-glide-o", || OxForm::O.into()), ("ox-glide-x", || OxForm::X.into())];

    fn new(parameters: &OxGlideParameters, before: Option<&Self>) -> Result<Self, GeometryError> {
        let Some(before) = before else {
            return Ok(Self {
                machine: OxGlide::new(parameters)?,
                parameters: *parameters,
                joint_mode: false,
                first: parameters.form,
                drive: Drive::UNKNOWN,
            });
        };
        // The form the machine is in is not geometry.
        let parameters = OxGlideParameters { form: before.machine.form(), ..*parameters };
        Ok(Self { machine: OxGlide::new(&parameters)?, parameters, ..*before })
    }

    #[inline(always)]
    fn inverse(&mut self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        let mut found = [0.0; MAX_JOINTS];
        if self.joint_mode {
            if !(pose.x.is_finite() && pose.y.is_finite() && pose.z.is_finite()) {
                return Err(InverseError::NotFinite);
            }
            [found[0], found[1], found[2]] = [pose.x, pose.y, pose.z];
        } else {
            self.machine.inverse_into(pose, &mut found)?;
            let c = (found[1] - found[0] - self.parameters.s_mm) / 2.0;
            if maths::fabs(c) < self.parameters.c_min_mm {
                return Err(InverseError::FormSwitch { c_mm: c, guard_mm: self.parameters.c_min_mm });
            }
        }
        [joints[0], joints[1], joints[2]] = [found[0], found[1], found[2]];
        self.drive.sent(pose, &found);
        Ok(())
    }

    #[inline(always)]
    fn forward(&mut self, joints: &Joints, pose: &mut Pose, _: &mut u32) -> Result<(), ForwardError> {
        let (joints, _) = self.drive.asked(joints, pose);
        self.pose(&joints, pose)
    }

    fn switch(&mut self, to: i32) -> Result<(), SwitchError> {
        let form = match to {
            0 => self.first,
            1 => self.first.other(),
            2 => self.machine.form(),
            _ => return Err(SwitchError::NoSuchType),
        };
        let parameters = OxGlideParameters { form, ..self.parameters };
        let Ok(machine) = OxGlide::new(&parameters) else { return Err(SwitchError::NoSuchType) };
        let mut next = Self { machine, parameters, joint_mode: to == 2, ..*self };
        self.drive.switch(|joints, pose| next.pose(joints, pose))?;
        next.drive = self.drive;
        *self = next;
        Ok(())
    }
}

impl OxGlideKins {
    #[inline(always)]
    fn pose(&self, joints: &Joints, pose: &mut Pose) -> Result<(), ForwardError> {
        if self.joint_mode {
            *pose = Pose { x: joints[0], y: joints[1], z: joints[2], ..Pose::ZERO };
            return Ok(());
        }
        self.machine.forward_into(joints, pose)
    }
}
