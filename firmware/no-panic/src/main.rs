//! Calls every entry point of the kinematics on every mechanism with values the compiler cannot know.
//!
//! The panic handler is `panic-never`: it refers to a symbol that exists nowhere, so the link fails if one panicking branch
//! is left after optimisation. `no_std` without `alloc` shows that nothing allocates. The binary is not meant to run.
#![no_std]
#![no_main]

use core::hint::black_box;
use panic_never as _;
use pkm_kins::*;

/// A value of unknown content.
fn unknown<T>(value: T) -> T {
    black_box(value)
}

/// Every function a real-time thread or a reader of machine files may call.
#[inline(never)]
fn exercise(mechanism: &Mechanism) {
    let pose = unknown(Pose::ZERO);
    let joints = unknown([0.0; MAX_JOINTS]);
    let _ = black_box(mechanism.inverse(&pose));
    let _ = black_box(mechanism.forward(&joints, &pose));
    let (mut place, mut found) = (unknown(joints), unknown(pose));
    let _ = black_box(mechanism.inverse_into(&pose, &mut place));
    let _ = black_box(mechanism.forward_into(&joints, &mut found));
    black_box((place, found));
    let _ = black_box(mechanism.jacobian(&pose));
    let _ = black_box(mechanism.motion(&pose, &unknown(pose), &unknown(pose)));
    let _ = black_box(mechanism.passage(&pose, &unknown(pose), &unknown(pose)));
    let _ = black_box(mechanism.singularity(&pose));
    let _ = black_box(mechanism.inverse_branches(&pose));
    let _ = black_box(mechanism.forward_branches(&joints, &pose));
    let _ = black_box(mechanism.axes());
    let _ = black_box(mechanism.joint_count());
    let _ = black_box(mechanism.joint_kind(unknown(0)));
    let _ = black_box(mechanism.joint_code(unknown(0)));
    let travel = unknown([JointRange { min: 0.0, max: 1.0 }; MAX_JOINTS]);
    if let Err(limit) = JointRange::check(&travel, &joints) {
        let _ = black_box(mechanism.limit_code(&limit));
    }
    match mechanism {
        Mechanism::HvMachine(machine) => {
            let _ = black_box(machine.switch(unknown(Spindle::V), &joints, &pose));
        }
        Mechanism::OxGlide(glide) => {
            let _ = black_box(glide.form_switch(&joints, &travel));
        }
        Mechanism::Lambda6(lambda) => {
            let _ = black_box(lambda.forward_all(&joints));
            let _ = black_box(lambda.sigma(&pose));
            let _ = black_box(lambda.twist_jacobian(&pose));
        }
        _ => {}
    }
}

/// Entry of the image; nothing calls it.
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> ! {
    let moma: MomaParameters = MomaConfiguration::A.into();
    let moma_4s: Moma4sParameters = Moma4sConfiguration::P.into();
    let general = PlanarParameters {
        reference_mm: moma.reference_mm,
        guide_angle_deg: moma.guide_angle_deg,
        l_mm: moma.l_mm,
        offset_mm: [[0.0; 2]; 2],
        working_mode: moma.working_mode,
        assembly: moma.assembly,
        one_sided: true,
    };
    // Construction from any parameters must not panic either.
    let all: [Option<Mechanism>; 11] = [
        Cartesian::new(unknown(AxisSet::new(&Axis::ALL))).ok().map(Into::into),
        Planar::new(&unknown(general)).ok().map(Into::into),
        Moma::new(&unknown(moma)).ok().map(Into::into),
        Moma4s::new(&unknown(moma_4s)).ok().map(Into::into),
        MomaW::new(&unknown(MomaWParameters::default())).ok().map(Into::into),
        HvMill::new(&unknown(HvMillParameters::v(5))).ok().map(Into::into),
        HvMachine::new(&unknown(HvMachineParameters::seven())).ok().map(Into::into),
        OxGlide::new(&unknown(OxForm::O.into())).ok().map(Into::into),
        Lambda6::new(&unknown(Lambda6Set::Yaw45.into())).ok().map(Into::into),
        LinearDelta::new(&unknown(LinearDeltaParameters { joint_radius_mm: 140.0, joint_length_mm: 270.0 }))
            .ok()
            .map(Into::into),
        Hexapod::new(&unknown(HexapodParameters::symmetric(300.0, 0.4, 150.0, 0.4, 400.0)))
            .ok()
            .map(Into::into),
    ];
    for mechanism in all.iter().flatten() {
        exercise(mechanism);
    }
    #[cfg(feature = "sabotage")]
    if unknown(false) {
        panic!("left in on purpose");
    }
    loop {}
}
