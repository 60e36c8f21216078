//! The two machines whose kinematics can be switched by `motion.switchkins-type`.
//!
//! LinuxCNC switches between two servo periods: it calls `kinematicsSwitch`, then forward for the joints where they stand. The
//! task must be brought to rest first (`M66 E0 L0`); `pkm linuxcnc` writes M codes that do it.

use crate::mechanism::{Mechanism, Shipped, SwitchError};
use crate::module::QUIET;
use pkm_kins::*;

/// HV-Mill with both mechanisms. Type 0: the one that the parameter `vertical` names; type 1: the other.
///
/// The idle mechanism holds its joints: where LinuxCNC drives the joints one by one (before homing, in joint mode), forward
/// is called without inverse, and what is held follows the joints.
#[derive(Debug, Clone, Copy)]
pub struct HvMachineKins {
    machine: HvMachine,
    /// The mechanism of type 0.
    first: Spindle,
    /// Where inverse last put the joints, or where forward was told they are.
    joints: Joints,
    last: Pose,
    moving: bool,
    /// Calls of forward since the last one of inverse.
    quiet: u32,
    /// Coordinates when LinuxCNC began to drive the pose: those of the idle mechanism must stay.
    anchor: Option<Pose>,
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
        let Some(before) = before else {
            return Ok(Self {
                machine,
                first: parameters.active,
                joints: [0.0; MAX_JOINTS],
                last: Pose::ZERO,
                moving: false,
                quiet: QUIET,
                anchor: None,
            });
        };
        // Which mechanism is active is not geometry: it stays, with the joints it holds.
        let machine = machine.holding(before.machine.active(), &before.joints);
        Ok(Self { machine, ..*before })
    }

    #[inline(always)]
    fn inverse(&mut self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        let anchor = self.anchor.get_or_insert(*pose);
        let moved = |axis: Axis| {
            let by = pose.get(axis) - anchor.get(axis);
            if maths::fabs(by) <= IDLE_TOLERANCE { 0.0 } else { by }
        };
        let mut displacement = Pose::ZERO;
        for axis in Axis::ALL {
            displacement.set(axis, moved(axis));
        }
        if let Some(axis) = self.machine.idle_axis(&displacement) {
            return Err(InverseError::AxisLocked { axis });
        }
        self.machine.inverse_into(pose, &mut self.joints)?;
        for (place, joint) in joints.iter_mut().zip(&self.joints).take(self.machine.joint_count()) {
            *place = *joint;
        }
        self.moving = *pose != self.last;
        self.last = *pose;
        self.quiet = 0;
        Ok(())
    }

    #[inline(always)]
    fn forward(&mut self, joints: &Joints, pose: &mut Pose, _: &mut u32) -> Result<(), ForwardError> {
        self.quiet = self.quiet.saturating_add(1);
        if self.quiet >= QUIET {
            self.joints = *joints;
            self.machine = self.machine.holding(self.machine.active(), joints);
            self.moving = false;
            self.anchor = None;
        }
        self.machine.forward_into(joints, pose)
    }

    fn switch(&mut self, to: i32) -> Result<(), SwitchError> {
        let spindle = match (to, self.first) {
            (0, first) => first,
            (1, Spindle::H) => Spindle::V,
            (1, Spindle::V) => Spindle::H,
            _ => return Err(SwitchError::NoSuchType),
        };
        if self.moving {
            return Err(SwitchError::Moving);
        }
        let machine = self.machine.holding(spindle, &self.joints);
        if self.quiet < QUIET {
            machine.forward(&self.joints, &self.last).map_err(SwitchError::State)?;
        }
        self.machine = machine;
        self.anchor = None;
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
    joints: [f64; 3],
    last: [f64; 3],
    moving: bool,
    quiet: u32,
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
                joints: [0.0; 3],
                last: [0.0; 3],
                moving: false,
                quiet: QUIET,
            });
        };
        // The form the machine is in is not geometry.
        let parameters = OxGlideParameters { form: before.machine.form(), ..*parameters };
        Ok(Self { machine: OxGlide::new(&parameters)?, parameters, ..*before })
    }

    #[inline(always)]
    fn inverse(&mut self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        if self.joint_mode {
            if !(pose.x.is_finite() && pose.y.is_finite() && pose.z.is_finite()) {
                return Err(InverseError::NotFinite);
            }
            [joints[0], joints[1], joints[2]] = [pose.x, pose.y, pose.z];
        } else {
            let mut found = [0.0; MAX_JOINTS];
            self.machine.inverse_into(pose, &mut found)?;
            let c = (found[1] - found[0] - self.parameters.s_mm) / 2.0;
            if maths::fabs(c) < self.parameters.c_min_mm {
                return Err(InverseError::FormSwitch { c_mm: c, guard_mm: self.parameters.c_min_mm });
            }
            [joints[0], joints[1], joints[2]] = [found[0], found[1], found[2]];
        }
        self.joints = [joints[0], joints[1], joints[2]];
        let now = [pose.x, pose.y, pose.z];
        self.moving = now != self.last;
        self.last = now;
        self.quiet = 0;
        Ok(())
    }

    #[inline(always)]
    fn forward(&mut self, joints: &Joints, pose: &mut Pose, _: &mut u32) -> Result<(), ForwardError> {
        self.quiet = self.quiet.saturating_add(1);
        if self.quiet >= QUIET {
            self.joints = [joints[0], joints[1], joints[2]];
            self.moving = false;
        }
        if self.joint_mode {
            *pose = Pose { x: joints[0], y: joints[1], z: joints[2], ..Pose::ZERO };
            return Ok(());
        }
        self.machine.forward_into(joints, pose)
    }

    fn switch(&mut self, to: i32) -> Result<(), SwitchError> {
        let form = match to {
            0 => self.first,
            1 => self.first.other(),
            2 => self.machine.form(),
            _ => return Err(SwitchError::NoSuchType),
        };
        if self.moving {
            return Err(SwitchError::Moving);
        }
        let parameters = OxGlideParameters { form, ..self.parameters };
        let Ok(machine) = OxGlide::new(&parameters) else { return Err(SwitchError::NoSuchType) };
        if to != 2 && self.quiet < QUIET {
            let mut joints = [0.0; MAX_JOINTS];
            [joints[0], joints[1], joints[2]] = self.joints;
            machine.forward(&joints, &Pose::ZERO).map_err(SwitchError::State)?;
        }
        self.joint_mode = to == 2;
        self.machine = machine;
        self.parameters = parameters;
        Ok(())
    }
}
