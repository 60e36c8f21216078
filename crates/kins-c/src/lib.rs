//! The kinematics for C.
//!
//! Two faces on the same code: `kinematicsForward` and `kinematicsInverse` in LinuxCNC's manner, for one machine chosen with
//! `pkm_use`; and functions that take a machine as their first argument. Nothing allocates: a `PkmMachine` lives where the
//! caller puts it and may be copied. Units: mm and **degrees** (also for rotary joints and their rates), as in G-code and in
//! LinuxCNC's `EmcPose`. Every function accepts NULL and answers with a status; none panics.
//!
//! Safety of every function: pointers are NULL or point to a valid object of their type (arrays of the stated length) that
//! nothing else writes during the call.
#![no_std]
#![allow(unsafe_code)] // the C face: raw pointers from the caller
#![allow(clippy::missing_safety_doc)] // stated once, above

#[cfg(feature = "std")]
extern crate std;

mod parameters;

use core::fmt::{self, Write};
use core::sync::atomic::{AtomicPtr, Ordering};
pub use parameters::*;
use pkm_kins::maths::{degrees, radians};
use pkm_kins::*;

/// Joints of the largest machine. Every joint array given to a function has this many places; of those a function fills it
/// touches only the machine's joints.
pub const PKM_MAX_JOINTS: usize = 9;

/// Words in a machine's storage.
pub const PKM_MACHINE_WORDS: usize = 128;

const _: () = assert!(PKM_MAX_JOINTS == MAX_JOINTS);
const _: () = assert!(size_of::<Mechanism>() <= 8 * PKM_MACHINE_WORDS && align_of::<Mechanism>() <= 8);

/// The bit of `PkmMachine::degrees` for angles in the pose.
const ROTARY_AXIS: u32 = 1 << 31;

/// Marks a machine that one of the constructors made.
const MADE: u64 = 0x706b_6d2d_6b69_6e73;

/// A pose: mm and degrees, laid out as LinuxCNC's `EmcPose`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub struct PkmPose {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub u: f64,
    pub v: f64,
    pub w: f64,
}

/// A machine, ready to run. Opaque: made by a constructor such as `pkm_moma`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct PkmMachine {
    made: u64,
    /// Bit i: joint i is rotary; `ROTARY_AXIS`: the pose has angles. 0: nothing of the machine is in degrees.
    degrees: u32,
    joint_count: u32,
    words: [u64; PKM_MACHINE_WORDS],
}

/// What a call came to.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PkmStatus {
    /// Done.
    Ok = 0,
    /// A pointer is NULL, or the machine was not made by a constructor.
    Usage = -1,
    /// The parameters make no mechanism.
    Geometry = -2,
    /// The pose has no joints, or the joints no pose.
    Kinematics = -3,
}

/// Why a call failed: a code such as `unreachable:1` and a sentence, both ending in 0.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmError {
    pub code: [core::ffi::c_char; 32],
    pub message: [core::ffi::c_char; 224],
}

/// How near a pose is to a singularity: 1 far, 0 there.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PkmSingularity {
    /// Smallest over the joints, type 1.
    pub inverse: f64,
    /// That joint, from 0.
    pub inverse_joint: usize,
    /// Type 2.
    pub forward: f64,
}

/// Travel of a joint (mm, degrees), both ends included.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub struct PkmRange {
    pub min: f64,
    pub max: f64,
}

/// A text of bounded length for C; what does not fit is left out.
struct Text<'a> {
    left: core::slice::IterMut<'a, core::ffi::c_char>,
}

impl Write for Text<'_> {
    fn write_str(&mut self, s: &str) -> fmt::Result {
        for byte in s.bytes() {
            if self.left.len() > 1
                && let Some(place) = self.left.next()
            {
                *place = byte.cast_signed() as core::ffi::c_char;
            }
        }
        Ok(())
    }
}

fn put(place: &mut [core::ffi::c_char], text: impl fmt::Display) {
    let mut buffer = Text { left: place.iter_mut() };
    let _ = write!(buffer, "{text}");
    if let Some(end) = buffer.left.next() {
        *end = 0;
    }
}

#[cold]
#[inline(never)]
unsafe fn refuse(
    error: *mut PkmError,
    status: PkmStatus,
    code: impl fmt::Display,
    message: impl fmt::Display,
) -> PkmStatus {
    // SAFETY: NULL or valid for writing, by the contract of every function here.
    if let Some(error) = unsafe { error.as_mut() } {
        put(&mut error.code, code);
        put(&mut error.message, message);
    }
    status
}

unsafe fn usage(error: *mut PkmError) -> PkmStatus {
    // SAFETY: as above.
    unsafe { refuse(error, PkmStatus::Usage, "usage", "a pointer is NULL or the machine was never made") }
}

/// A machine that a constructor made.
#[inline]
unsafe fn made<'a>(machine: *const PkmMachine) -> Option<&'a PkmMachine> {
    // SAFETY: NULL or valid.
    unsafe { machine.as_ref() }.filter(|machine| machine.made == MADE)
}

impl PkmMachine {
    /// The mechanism in a machine's storage.
    #[inline(always)]
    fn mechanism(&self) -> &Mechanism {
        // SAFETY: only a reference from `made` gets here, so a constructor wrote a `Mechanism` into the words (size and
        // alignment are asserted).
        unsafe { &*self.words.as_ptr().cast::<Mechanism>() }
    }
}

unsafe fn make(
    machine: *mut PkmMachine,
    error: *mut PkmError,
    made: Result<Mechanism, GeometryError>,
) -> PkmStatus {
    match made {
        // SAFETY: `machine` is not NULL (checked by the callers) and has room for a `Mechanism`.
        Ok(mechanism) => unsafe {
            let joint_count = mechanism.joint_count();
            let mut degrees = 0;
            for joint in 0..joint_count {
                degrees |= u32::from(mechanism.joint_kind(joint) == JointKind::Rotary) << joint;
            }
            if mechanism.axes().iter().any(Axis::is_rotary) {
                degrees |= ROTARY_AXIS;
            }
            let joint_count = joint_count as u32;
            machine.write(PkmMachine { made: MADE, degrees, joint_count, words: [0; PKM_MACHINE_WORDS] });
            (&raw mut (*machine).words).cast::<Mechanism>().write(mechanism);
            PkmStatus::Ok
        },
        // SAFETY: as for `refuse`.
        Err(why) => unsafe { refuse(error, PkmStatus::Geometry, "geometry", why) },
    }
}

#[inline]
fn to_pose(p: &PkmPose) -> Pose {
    let [a, b, c] = [p.a, p.b, p.c].map(radians);
    Pose { x: p.x, y: p.y, z: p.z, a, b, c, u: p.u, v: p.v, w: p.w }
}

#[inline]
fn from_pose(p: &Pose) -> PkmPose {
    let [a, b, c] = [p.a, p.b, p.c].map(degrees);
    PkmPose { x: p.x, y: p.y, z: p.z, a, b, c, u: p.u, v: p.v, w: p.w }
}

/// Turns the rotary ones among a machine's joints into degrees.
#[inline]
fn to_degrees(machine: &PkmMachine, joints: &mut Joints) {
    let mut rotary = machine.degrees & !ROTARY_AXIS;
    while let Some(joint) = joints.get_mut(rotary.trailing_zeros() as usize) {
        *joint = degrees(*joint);
        rotary &= rotary.wrapping_sub(1);
    }
}

/// Joints in radians.
fn joints_from(machine: &PkmMachine, given: &Joints) -> Joints {
    let mut all = *given;
    for (i, q) in all.iter_mut().enumerate() {
        if machine.degrees >> i & 1 == 1 {
            *q = radians(*q);
        }
    }
    all
}

/// Writes the machine's joints in degrees.
fn joints_to(machine: &PkmMachine, all: &Joints, joints: &mut Joints) {
    for (place, q) in joints.iter_mut().zip(all).take(machine.joint_count as usize) {
        *place = *q;
    }
    to_degrees(machine, joints);
}

/// Pose → joints, with the caller's own numbers where nothing of the machine is in degrees.
#[inline(always)]
fn inverse(machine: &PkmMachine, pose: &PkmPose, joints: &mut Joints) -> Result<(), InverseError> {
    // SAFETY: `PkmPose` and `Pose` are both nine f64 in the same order (`repr(C)`).
    let same = unsafe { &*core::ptr::from_ref(pose).cast::<Pose>() };
    if machine.degrees == 0 {
        return machine.mechanism().inverse_into(same, joints);
    }
    inverse_in_degrees(machine, pose, joints)
}

#[inline(never)]
fn inverse_in_degrees(machine: &PkmMachine, pose: &PkmPose, joints: &mut Joints) -> Result<(), InverseError> {
    machine.mechanism().inverse_into(&to_pose(pose), joints)?;
    to_degrees(machine, joints);
    Ok(())
}

/// Joints → pose; the old pose is the seed.
#[inline(always)]
fn forward(machine: &PkmMachine, joints: &Joints, pose: &mut PkmPose) -> Result<(), ForwardError> {
    if machine.degrees == 0 {
        // SAFETY: as in `inverse`.
        let same = unsafe { &mut *core::ptr::from_mut(pose).cast::<Pose>() };
        return machine.mechanism().forward_into(joints, same);
    }
    forward_in_degrees(machine, joints, pose)
}

#[inline(never)]
fn forward_in_degrees(machine: &PkmMachine, joints: &Joints, pose: &mut PkmPose) -> Result<(), ForwardError> {
    let mechanism = machine.mechanism();
    let seed = to_pose(pose);
    *pose = from_pose(&if machine.degrees == ROTARY_AXIS {
        mechanism.forward(joints, &seed)?
    } else {
        mechanism.forward(&joints_from(machine, joints), &seed)?
    });
    Ok(())
}

/// What every constructor does; `None` from `new` is a usage error.
unsafe fn construct<P>(
    machine: *mut PkmMachine,
    parameters: *const P,
    error: *mut PkmError,
    new: impl FnOnce(&P) -> Option<Result<Mechanism, GeometryError>>,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe {
        match parameters.as_ref().and_then(new) {
            Some(made) if !machine.is_null() => make(machine, error, made),
            _ => usage(error),
        }
    }
}

/// Makes a general planar mechanism. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_planar(
    machine: *mut PkmMachine,
    parameters: *const PkmPlanar,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(Planar::new(&p.into()).map(Into::into))) }
}

/// Makes a MOMA. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_moma(
    machine: *mut PkmMachine,
    parameters: *const PkmMoma,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(Moma::new(&p.into()).map(Into::into))) }
}

/// Makes a MOMA 4S. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_moma_4s(
    machine: *mut PkmMachine,
    parameters: *const PkmMoma4s,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(Moma4s::new(&p.into()).map(Into::into))) }
}

/// Makes a MOMA-W. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_moma_w(
    machine: *mut PkmMachine,
    parameters: *const PkmMomaW,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(MomaW::new(&p.into()).map(Into::into))) }
}

/// Makes one mechanism of the HV-Mill with carriage, table and head. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_hv_mill(
    machine: *mut PkmMachine,
    parameters: *const PkmHvMill,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(HvMill::new(&p.checked()?).map(Into::into))) }
}

/// Makes an HV-Mill with both mechanisms. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_hv_machine(
    machine: *mut PkmMachine,
    parameters: *const PkmHvMachine,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(HvMachine::new(&p.checked()?).map(Into::into))) }
}

/// Makes an O-X glide. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_ox_glide(
    machine: *mut PkmMachine,
    parameters: *const PkmOxGlide,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(OxGlide::new(&p.checked()?).map(Into::into))) }
}

/// Makes a Lambda. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_lambda6(
    machine: *mut PkmMachine,
    parameters: *const PkmLambda6,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(Lambda6::new(&p.into()).map(Into::into))) }
}

/// Makes a linear delta. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_linear_delta(
    machine: *mut PkmMachine,
    parameters: *const PkmLinearDelta,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(LinearDelta::new(&p.into()).map(Into::into))) }
}

/// Makes a hexapod. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_hexapod(
    machine: *mut PkmMachine,
    parameters: *const PkmHexapod,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { construct(machine, parameters, error, |p| Some(Hexapod::new(&p.into()).map(Into::into))) }
}

/// Makes a Cartesian machine with the axes of `letters` (a subset of "XYZABCUVW").
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_cartesian(
    machine: *mut PkmMachine,
    letters: *const core::ffi::c_char,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file; `letters` ends in 0.
    unsafe {
        if machine.is_null() || letters.is_null() {
            return usage(error);
        }
        let mut set = AxisSet::default();
        for letter in core::ffi::CStr::from_ptr(letters).to_bytes() {
            match Axis::ALL.into_iter().find(|axis| axis.letter() == char::from(*letter)) {
                Some(axis) => set = set.with(axis),
                None => {
                    return refuse(
                        error,
                        PkmStatus::Geometry,
                        "geometry",
                        "an axis letter is none of XYZABCUVW",
                    );
                }
            }
        }
        make(machine, error, Cartesian::new(set).map(Mechanism::from))
    }
}

/// Parameters of MOMA's configuration `'a'`, `'b'`, `'c'` or `'d'`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_moma_parameters(parameters: *mut PkmMoma, name: u8) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { give(parameters, PkmMoma::named(name)) }
}

/// Parameters of MOMA 4S: 0 is P, 5 and 10 are S5 and S10, −5 and −10 U5 and U10. Inferred dimensions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_moma_4s_parameters(parameters: *mut PkmMoma4s, outward_deg: i32) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { give(parameters, PkmMoma4s::named(outward_deg)) }
}

/// Default parameters of MOMA-W. Inferred dimensions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_moma_w_parameters(parameters: *mut PkmMomaW) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { give(parameters, Some(PkmMomaW::default())) }
}

/// Default parameters of one mechanism of the HV-Mill: `'H'` with 3 or 4 axes, `'V'` with 3, 4 or 5. Inferred dimensions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_hv_mill_parameters(
    parameters: *mut PkmHvMill,
    spindle: u8,
    controlled_axes: u8,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { give(parameters, PkmHvMill::named(spindle, controlled_axes)) }
}

/// Default parameters of the HV-Mill with head (fig 2b). Inferred dimensions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_hv_machine_parameters(parameters: *mut PkmHvMachine) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { give(parameters, Some(PkmHvMachine::seven())) }
}

/// Default parameters of Lambda (set yaw45). Inferred dimensions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_lambda6_parameters(parameters: *mut PkmLambda6) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe { give(parameters, Some(PkmLambda6::yaw45())) }
}

unsafe fn give<T>(place: *mut T, value: Option<T>) -> PkmStatus {
    match value {
        // SAFETY: not NULL, and valid for writing by contract.
        Some(value) if !place.is_null() => unsafe {
            place.write(value);
            PkmStatus::Ok
        },
        _ => PkmStatus::Usage,
    }
}

/// Number of joints; 0 for a machine that was never made.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_joint_count(machine: *const PkmMachine) -> usize {
    // SAFETY: the contract at the head of this file.
    unsafe { made(machine) }.map_or(0, |m| m.joint_count as usize)
}

/// Pose → joints. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_inverse(
    machine: *const PkmMachine,
    pose: *const PkmPose,
    joints: *mut f64,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (Some(m), Some(pose), Some(q)) = (made(machine), pose.as_ref(), joints.cast::<Joints>().as_mut())
        else {
            return usage(error);
        };
        match inverse(m, pose, q) {
            Ok(()) => PkmStatus::Ok,
            Err(why) => refuse(error, PkmStatus::Kinematics, why.code(), why),
        }
    }
}

/// Joints → pose. `pose` holds a pose nearby (the seed; all zeros: none) and receives the answer. `error` may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_forward(
    machine: *const PkmMachine,
    joints: *const f64,
    pose: *mut PkmPose,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (Some(m), Some(pose), Some(q)) = (made(machine), pose.as_mut(), joints.cast::<Joints>().as_ref())
        else {
            return usage(error);
        };
        match forward(m, q, pose) {
            Ok(()) => PkmStatus::Ok,
            Err(why) => refuse(error, PkmStatus::Kinematics, why.code(), why),
        }
    }
}

/// ∂joints/∂pose: 9 × 9 numbers, rows joints, columns X Y Z A B C U V W; angular columns per degree, rotary rows in degrees.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_jacobian(
    machine: *const PkmMachine,
    pose: *const PkmPose,
    rows: *mut [f64; PKM_MAX_JOINTS],
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (Some(machine), Some(pose), false) = (made(machine), pose.as_ref(), rows.is_null()) else {
            return usage(error);
        };
        let rows = core::slice::from_raw_parts_mut(rows, PKM_MAX_JOINTS);
        match machine.mechanism().jacobian(&to_pose(pose)) {
            Ok(jacobian) => {
                for ((row, found), joint) in rows.iter_mut().zip(jacobian).zip(0..PKM_MAX_JOINTS) {
                    let rotary = machine.degrees >> joint & 1 == 1;
                    for ((place, entry), axis) in row.iter_mut().zip(found).zip(Axis::ALL) {
                        let per_degree = if axis.is_rotary() { radians(entry) } else { entry };
                        *place = if rotary { degrees(per_degree) } else { per_degree };
                    }
                }
                PkmStatus::Ok
            }
            Err(why) => refuse(error, PkmStatus::Kinematics, why.code(), why),
        }
    }
}

/// Joint rates and accelerations (degrees for rotary joints) of a pose moving with `velocity` and `acceleration`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_motion(
    machine: *const PkmMachine,
    pose: *const PkmPose,
    velocity: *const PkmPose,
    acceleration: *const PkmPose,
    joint_velocity: *mut f64,
    joint_acceleration: *mut f64,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (Some(machine), Some(p), Some(v), Some(a)) =
            (made(machine), pose.as_ref(), velocity.as_ref(), acceleration.as_ref())
        else {
            return usage(error);
        };
        let joints = |place: *mut f64| place.cast::<Joints>().as_mut();
        let (Some(rates), Some(second)) = (joints(joint_velocity), joints(joint_acceleration)) else {
            return usage(error);
        };
        match machine.mechanism().motion(&to_pose(p), &to_pose(v), &to_pose(a)) {
            Ok(motion) => {
                joints_to(machine, &motion.velocity, rates);
                joints_to(machine, &motion.acceleration, second);
                PkmStatus::Ok
            }
            Err(why) => refuse(error, PkmStatus::Kinematics, why.code(), why),
        }
    }
}

/// Distance from singularities.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_singularity(
    machine: *const PkmMachine,
    pose: *const PkmPose,
    measures: *mut PkmSingularity,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (Some(machine), Some(pose), Some(measures)) = (made(machine), pose.as_ref(), measures.as_mut())
        else {
            return usage(error);
        };
        match machine.mechanism().singularity(&to_pose(pose)) {
            Ok(Singularity { inverse, inverse_joint, forward }) => {
                *measures = PkmSingularity { inverse, inverse_joint, forward };
                PkmStatus::Ok
            }
            Err(why) => refuse(error, PkmStatus::Kinematics, why.code(), why),
        }
    }
}

/// HV-Mill: makes `'H'` or `'V'` the active mechanism while the machine stands at `joints`; `pose` is updated. Nothing moves.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_switch(
    machine: *mut PkmMachine,
    to: u8,
    joints: *const f64,
    pose: *mut PkmPose,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let (Some(made), Some(to)) = (made(machine), spindle(to)) else { return usage(error) };
        let Mechanism::HvMachine(mill) = made.mechanism() else { return usage(error) };
        let (Some(pose), Some(q)) = (pose.as_mut(), joints.cast::<Joints>().as_ref()) else {
            return usage(error);
        };
        match mill.switch(to, &joints_from(made, q), &to_pose(pose)) {
            Ok((switched, found)) => {
                *pose = from_pose(&found);
                make(machine, error, Ok(Mechanism::HvMachine(switched)))
            }
            Err(why) => refuse(error, PkmStatus::Kinematics, why.code(), why),
        }
    }
}

/// O-X glide: the joint move that takes the machine, standing at `joints`, from its form to the other one. Checked: both ends of the
/// move outside the guard and within `travel` (three: AB, CD, Z; NULL: no limits). `end` may be `joints`. Written: `end`, where to drive the sliders linearly and
/// together; `pose`, where the platform is before and after; `after`, the machine once the move is done (may be `machine` itself).
/// Nothing moves, and after an error nothing is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_form_switch(
    machine: *const PkmMachine,
    joints: *const f64,
    travel: *const PkmRange,
    end: *mut f64,
    pose: *mut PkmPose,
    after: *mut PkmMachine,
    error: *mut PkmError,
) -> PkmStatus {
    // SAFETY: the contract at the head of this file.
    unsafe {
        let Some(Mechanism::OxGlide(glide)) = made(machine).map(PkmMachine::mechanism) else {
            return usage(error);
        };
        let glide = *glide;
        let (Some(now), Some(end), Some(pose), false) = (
            joints.cast::<Joints>().as_ref().copied(),
            end.cast::<Joints>().as_mut(),
            pose.as_mut(),
            after.is_null(),
        ) else {
            return usage(error);
        };
        let travel = travel
            .cast::<[PkmRange; 3]>()
            .as_ref()
            .map(|all| all.map(|PkmRange { min, max }| JointRange { min, max }));
        match glide.form_switch(&now, travel.as_ref().map_or(&[], |all| all.as_slice())) {
            Ok(switch) => {
                [end[0], end[1], end[2]] = [switch.joints[0], switch.joints[1], switch.joints[2]];
                *pose = from_pose(&switch.pose);
                make(after, error, Ok(Mechanism::OxGlide(switch.machine)))
            }
            Err(why) => match why {
                FormSwitchError::State(state) => refuse(error, PkmStatus::Kinematics, state.code(), why),
                FormSwitchError::TooNear { .. } => {
                    refuse(error, PkmStatus::Kinematics, "singular:form_switch", why)
                }
                FormSwitchError::Travel(limit) => {
                    refuse(error, PkmStatus::Kinematics, glide.limit_code(&limit), why)
                }
            },
        }
    }
}

/// The machine `kinematicsForward` and `kinematicsInverse` work on.
static IN_USE: AtomicPtr<PkmMachine> = AtomicPtr::new(core::ptr::null_mut());

/// Chooses the machine of `kinematicsForward` and `kinematicsInverse`; it must outlive their use. NULL chooses none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pkm_use(machine: *mut PkmMachine) {
    IN_USE.store(machine, Ordering::Release);
}

/// As LinuxCNC's: joints → world, with the world's old value as seed. 0, or −1 if there is no answer. The flags are not used.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn kinematicsForward(
    joint: *const f64,
    world: *mut PkmPose,
    _fflags: *const core::ffi::c_ulong,
    _iflags: *mut core::ffi::c_ulong,
) -> core::ffi::c_int {
    // SAFETY: the contract at the head of this file.
    let given =
        unsafe { (made(IN_USE.load(Ordering::Acquire)), joint.cast::<Joints>().as_ref(), world.as_mut()) };
    let (Some(m), Some(q), Some(pose)) = given else { return -1 };
    if forward(m, q, pose).is_ok() { 0 } else { -1 }
}

/// As LinuxCNC's: world → joints. 0, or −1 if there is no answer. The flags are not used.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn kinematicsInverse(
    world: *const PkmPose,
    joint: *mut f64,
    _iflags: *const core::ffi::c_ulong,
    _fflags: *mut core::ffi::c_ulong,
) -> core::ffi::c_int {
    // SAFETY: the contract at the head of this file.
    let given =
        unsafe { (made(IN_USE.load(Ordering::Acquire)), world.as_ref(), joint.cast::<Joints>().as_mut()) };
    let (Some(m), Some(pose), Some(q)) = given else { return -1 };
    if inverse(m, pose, q).is_ok() { 0 } else { -1 }
}

/// As LinuxCNC's: 4, `KINEMATICS_BOTH`.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub extern "C" fn kinematicsType() -> core::ffi::c_int {
    4
}

#[cfg(not(feature = "std"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
