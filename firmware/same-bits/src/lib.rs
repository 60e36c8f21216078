//! One number for all results of all mechanisms: FNV-1a over the bits of joints, poses, derivatives and error codes' cases,
//! over the edges of a step generator, and over those of a whole controller that runs a G-code program.
#![no_std]

pub mod controller;
pub mod steps;

use pkm_kins::maths::radians;
use pkm_kins::*;

/// FNV-1a, 64 bits.
struct Hash(u64);

impl Hash {
    fn word(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn numbers(&mut self, numbers: &[f64]) {
        for number in numbers {
            // +0 and −0 are one number; no result is NaN.
            self.word((number + 0.0).to_bits());
        }
    }
}

/// xorshift64*.
struct Rng(u64);

impl Rng {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let word = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D);
        low + (high - low) * ((word >> 11) as f64 / (1u64 << 53) as f64)
    }
}

/// Hashes `count` random poses of a box, there and back with derivatives; returns how many were reachable.
fn over(hash: &mut Hash, mechanism: Mechanism, low: Pose, high: Pose, count: u32) -> u32 {
    let mut rng = Rng(20_260_721);
    let mut reachable = 0;
    for _ in 0..count {
        let mut all = [0.0; 9];
        for ((value, low), high) in all.iter_mut().zip(low.to_array()).zip(high.to_array()) {
            *value = rng.between(low, high);
        }
        let pose = Pose::from_array(all);
        let Ok(joints) = mechanism.inverse(&pose) else {
            hash.word(1);
            continue;
        };
        reachable += 1;
        hash.numbers(&joints);
        match mechanism.forward(&joints, &Pose { x: pose.x + 0.02, ..pose }) {
            Ok(back) => hash.numbers(&back.to_array()),
            Err(_) => hash.word(2),
        }
        let mut rate = Pose::ZERO;
        for axis in mechanism.axes().iter() {
            if low.get(axis) != high.get(axis) {
                rate.set(axis, if axis.is_rotary() { 0.1 } else { 3.0 });
            }
        }
        match mechanism.motion(&pose, &rate, &rate) {
            Ok(motion) => {
                hash.numbers(&motion.velocity);
                hash.numbers(&motion.acceleration);
            }
            Err(_) => hash.word(3),
        }
        if let Ok(measure) = mechanism.singularity(&pose) {
            hash.numbers(&[measure.inverse, measure.forward]);
        }
    }
    reachable
}

fn xy(x: f64, y: f64) -> Pose {
    Pose { x, y, ..Pose::ZERO }
}

/// The hash over every mechanism, and how many poses were reachable.
pub fn kinematics(count: u32) -> (u64, u32) {
    let mut hash = Hash(0xcbf2_9ce4_8422_2325);
    let mut reachable = 0;
    let mut add = |mechanism: Option<Mechanism>, low: Pose, high: Pose| {
        if let Some(mechanism) = mechanism {
            reachable += over(&mut hash, mechanism, low, high, count);
        }
    };
    for configuration in MomaConfiguration::ALL {
        let moma = Moma::new(&configuration.into()).ok().map(Into::into);
        let (low, high) = match configuration {
            MomaConfiguration::A | MomaConfiguration::B => (xy(-100.0, -380.0), xy(100.0, -170.0)),
            MomaConfiguration::C => (xy(120.0, 120.0), xy(200.0, 200.0)),
            MomaConfiguration::D => (xy(-60.0, -60.0), xy(160.0, 160.0)),
        };
        add(moma, low, high);
    }
    for configuration in Moma4sConfiguration::ALL {
        let machine = Moma4s::new(&configuration.into()).ok().map(Into::into);
        add(machine, xy(-100.0, -400.0), xy(100.0, -190.0));
    }
    let w = Pose { x: 60.0, y: 40.0, z: 90.0, u: 60.0, v: 40.0, ..Pose::ZERO };
    let w_low = Pose { x: -60.0, y: -40.0, u: -60.0, v: -40.0, ..Pose::ZERO };
    add(MomaW::new(&MomaWParameters::default()).ok().map(Into::into), w_low, w);
    let mill = Pose { x: 70.0, y: 60.0, z: 50.0, b: radians(40.0), c: radians(170.0), ..Pose::ZERO };
    let mill_low = Pose { x: -70.0, y: -60.0, z: -50.0, b: -mill.b, c: -mill.c, ..Pose::ZERO };
    add(HvMill::new(&HvMillParameters::v(5)).ok().map(Into::into), mill_low, mill);
    let h = |p: Pose| Pose { c: 0.0, ..p };
    add(HvMill::new(&HvMillParameters::h(4)).ok().map(Into::into), h(mill_low), h(mill));
    for form in [OxForm::O, OxForm::X] {
        let glide = OxGlide::new(&form.into()).ok().map(Into::into);
        add(glide, xy(20.0, 20.0), Pose { z: 100.0, ..xy(110.0, 82.0) });
    }
    let tilt = radians(25.0);
    for set in Lambda6Set::ALL {
        let lambda = Lambda6::new(&set.into()).ok().map(|m| m.without_limits().into());
        let pose = |side: f64| Pose {
            x: side * 300.0,
            y: side * 300.0,
            z: -1400.0 + side * 150.0,
            a: side * tilt,
            b: side * tilt,
            c: side * tilt,
            ..Pose::ZERO
        };
        add(lambda, pose(-1.0), pose(1.0));
    }
    let delta = LinearDeltaParameters { joint_radius_mm: 140.0, joint_length_mm: 270.0 };
    let delta = LinearDelta::new(&delta).ok().map(Into::into);
    add(delta, Pose { z: -50.0, ..xy(-120.0, -120.0) }, Pose { z: 50.0, ..xy(120.0, 120.0) });
    let hexapod = HexapodParameters::symmetric(300.0, 0.35, 150.0, 0.35, 400.0);
    let pose = |side: f64| Pose {
        x: side * 100.0,
        y: side * 100.0,
        z: 400.0 + side * 60.0,
        a: side * tilt,
        b: side * tilt,
        c: side * tilt,
        ..Pose::ZERO
    };
    add(Hexapod::new(&hexapod).ok().map(Into::into), pose(-1.0), pose(1.0));
    hash.word(steps::hash());
    hash.word(controller::hash().0);
    (hash.0, reachable)
}

/// Poses per mechanism in every run.
pub const COUNT: u32 = 200;

/// What the page or a script calls.
#[cfg(target_arch = "wasm32")]
#[unsafe(no_mangle)]
pub extern "C" fn kinematics_hash() -> u64 {
    kinematics(COUNT).0
}

#[cfg(target_arch = "wasm32")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    core::arch::wasm32::unreachable()
}

// The cdylib of the host needs a handler too; the programs bring their own.
#[cfg(all(not(target_arch = "wasm32"), not(target_os = "none")))]
extern crate std;
