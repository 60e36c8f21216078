//! One mechanism (named by PKM_ONLY at compile time) with inverse, forward and motion; not meant to run.
#![no_std]
#![no_main]

use core::hint::black_box;
use pkm_kins::*;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

/// Keeps what a real-time thread calls.
fn keep<K: Kinematics>(mechanism: Result<K, GeometryError>) {
    let Ok(mechanism) = mechanism else { return };
    let (pose, joints) = (black_box(Pose::ZERO), black_box([0.0; MAX_JOINTS]));
    let _ = black_box(mechanism.inverse(&pose));
    let _ = black_box(mechanism.forward(&joints, &pose));
    let _ = black_box(mechanism.motion(&pose, &pose, &pose));
}

/// True for the mechanism this image is about; known when compiling, so the others leave no code.
const fn only(name: &str) -> bool {
    let Some(wanted) = option_env!("PKM_ONLY") else { return false };
    let (a, b) = (wanted.as_bytes(), name.as_bytes());
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    a.len() == b.len() && i == a.len()
}

/// Entry of the image.
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> ! {
    if const { only("cartesian") } {
        keep(Cartesian::new(black_box(AxisSet::new(&Axis::ALL))));
    }
    if const { only("moma") } {
        keep(Moma::new(&black_box(MomaConfiguration::A.into())));
    }
    if const { only("moma-4s") } {
        keep(Moma4s::new(&black_box(Moma4sConfiguration::P.into())));
    }
    if const { only("moma-w") } {
        keep(MomaW::new(&black_box(MomaWParameters::default())));
    }
    if const { only("hv-mill") } {
        keep(HvMill::new(&black_box(HvMillParameters::v(5))));
    }
    if const { only("hv-machine") } {
        keep(HvMachine::new(&black_box(HvMachineParameters::seven())));
    }
    if const { only("ox-glide") } {
        keep(OxGlide::new(&black_box(OxForm::O.into())));
    }
    if const { only("lambda6") } {
        keep(Lambda6::new(&black_box(Lambda6Set::Yaw45.into())));
    }
    if const { only("linear-delta") } {
        let p = LinearDeltaParameters { joint_radius_mm: 140.0, joint_length_mm: 270.0 };
        keep(LinearDelta::new(&black_box(p)));
    }
    if const { only("hexapod") } {
        let p = HexapodParameters { base_mm: [[0.0; 3]; 6], platform_mm: [[0.0; 3]; 6], start_z_mm: 0.0 };
        keep(Hexapod::new(&black_box(p)));
    }
    loop {}
}
