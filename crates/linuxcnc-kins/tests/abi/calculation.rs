//! The modules calculate what the crate calculates.

use crate::stub::{HAL, Hal, Module, hal, messages, pin};
use pkm_kins::*;
use pkm_linuxcnc_kins::mechanism;
use pkm_linuxcnc_kins::switchable::OxGlideKins;
use std::ffi::c_int;

/// A Rust mechanism in LinuxCNC's units.
fn own_inverse(mechanism: &Mechanism, pose: &[f64; 9]) -> Result<Joints, InverseError> {
    let mut inner = Pose::from_array(*pose);
    [inner.a, inner.b, inner.c] = [inner.a, inner.b, inner.c].map(maths::radians);
    let mut joints = mechanism.inverse(&inner)?;
    for (joint, value) in joints.iter_mut().enumerate() {
        if mechanism.joint_kind(joint) == JointKind::Rotary && joint < mechanism.joint_count() {
            *value = maths::degrees(*value);
        }
    }
    Ok(joints)
}

/// Loads a shipped machine and compares the module with the mechanism, bit for bit, in a box about a pose.
fn same_as<M: mechanism::Mechanism>(module: &str, names: usize, own: impl Fn(&M::Parameters) -> Mechanism) {
    let loaded = Module::open(module);
    for (name, parameters) in M::SHIPPED {
        *HAL.lock().unwrap() = Some(Hal::default());
        assert_eq!(loaded.load(name), 0, "{module} {name}");
        assert!(hal(|hal| hal.ready && !hal.exited));
        assert_eq!(
            hal(|hal| hal.names.len()),
            names,
            "{:?}",
            hal(|hal| hal.names.keys().cloned().collect::<Vec<_>>())
        );
        assert!(hal(|hal| hal.names.keys().all(|name| name.starts_with(&format!("{}.", M::PREFIX)))));
        assert_eq!(unsafe { (loaded.kind)() }, 4);
        assert_eq!(unsafe { (loaded.switchable)() }, c_int::from(M::TYPES > 1));
        let mechanism = own(&parameters());
        let count = mechanism.joint_count();
        let mut random = 1_u64;
        let mut unit = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let (mut reached, mut refused) = (0, 0);
        for _ in 0..4000 {
            let mut pose = [0.0; 9];
            for axis in mechanism.axes().iter() {
                // Some modes of the HV-Mill have their angles locked at 0.
                let angle = if unit() < 0.0 { 0.0 } else { 30.0 };
                pose[axis as usize] = unit() * if axis.is_rotary() { angle } else { 400.0 };
            }
            if module == "lambda_kins" {
                pose[2] = -1500.0 + 0.5 * pose[2];
            }
            match (loaded.inverse(&pose), own_inverse(&mechanism, &pose)) {
                (Ok(theirs), Ok(ours)) => {
                    reached += 1;
                    let bits = |joints: &Joints| joints.map(|joint| joint.to_bits())[..count].to_vec();
                    assert_eq!(bits(&theirs), bits(&ours), "{module} {name} {pose:?}");
                    if let Ok(back) = loaded.forward(&ours, &pose) {
                        let most = (0..9).map(|i| (back[i] - pose[i]).abs()).fold(0.0, f64::max);
                        let Ok(s) = mechanism.singularity(&Pose::from_array(pose)) else { continue };
                        assert!(
                            most < 1e-5 || s.forward < 0.05 || s.inverse < 0.01,
                            "{module} {name} {pose:?}: {back:?}"
                        );
                    }
                }
                (Err(-1), Err(_)) => refused += 1,
                (theirs, ours) => panic!("{module} {name} {pose:?}: {theirs:?} {ours:?}"),
            }
            let _ = messages();
        }
        // A hexapod without limits reaches everything.
        assert!(
            reached > 30 && (refused > 0 || module == "hexapod_kins"),
            "{module} {name}: {reached} reached, {refused} refused"
        );
        unsafe { (loaded.exit)() };
        assert!(hal(|hal| hal.exited));
    }
}

#[test]
fn every_module_calculates_as_the_crate() {
    same_as::<Moma>("moma_kins", 13, |p| Moma::new(p).unwrap().into());
    same_as::<Moma4s>("moma_4s_kins", 21, |p| Moma4s::new(p).unwrap().into());
    same_as::<MomaW>("moma_w_kins", 50, |p| MomaW::new(p).unwrap().into());
    same_as::<Planar>("planar_kins", 17, |p| Planar::new(p).unwrap().into());
    same_as::<Lambda6>("lambda_kins", 20, |p| Lambda6::new(p).unwrap().into());
    same_as::<LinearDelta>("delta_kins", 3, |p| LinearDelta::new(p).unwrap().into());
    same_as::<Hexapod>("hexapod_kins", 38, |p| Hexapod::new(p).unwrap().into());
    same_as::<HvMill>("hv_mill_kins", 34, |p| HvMill::new(p).unwrap().into());
}

#[test]
fn o_x_glide_keeps_away_from_the_form_switch() {
    let glide = Module::open("ox_glide_kins");
    assert_eq!(glide.load("ox-glide-o"), 0);
    let own = OxGlide::new(&OxForm::O.into()).unwrap();
    let pose = [65.0, 66.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let joints = glide.inverse(&pose).unwrap();
    assert_eq!(joints, own.inverse(&Pose::from_array(pose)).unwrap());
    // c = √(80² − 79.99²) = 1.26 mm: nearer than 2 mm.
    assert_eq!(glide.inverse(&[65.0, 79.99, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Err(-1));
    assert!(messages()[0].contains("form switch"));
    assert!(
        mechanism::Mechanism::inverse(
            &mut <OxGlideKins as mechanism::Mechanism>::new(&OxForm::O.into(), None).unwrap(),
            &Pose { y: 79.99, ..Pose::ZERO },
            &mut [0.0; MAX_JOINTS]
        )
        .is_err()
    );
}

#[test]
fn lambda_counts_its_iterations() {
    let lambda = Module::open("lambda_kins");
    assert_eq!(lambda.load("lambda6"), 0);
    let pose = [20.0, -30.0, -1480.0, 3.0, -4.0, 5.0, 0.0, 0.0, 0.0];
    let joints = lambda.inverse(&pose).unwrap();
    let mut near = pose;
    near[0] += 0.1;
    let found = lambda.forward(&joints, &near).unwrap();
    assert!((0..6).all(|i| (found[i] - pose[i]).abs() < 1e-6), "{found:?}");
    let warm = pin("lambda.last-iterations");
    assert!((1..=3).contains(&warm), "{warm}");
    let mut far = pose;
    far[0] -= 90.0;
    far[5] += 20.0;
    lambda.forward(&joints, &far).unwrap();
    let cold = pin("lambda.last-iterations");
    assert!(cold > warm, "{cold}");
    lambda.forward(&joints, &pose).unwrap();
    assert_eq!(pin("lambda.max-iterations"), cold);
    assert!(pin("lambda.last-iterations") <= 1);
    // Joints at which no mechanism stands, before anything is known, are not told.
    assert_eq!(lambda.forward(&[0.0; MAX_JOINTS], &pose), Err(-1));
    assert_eq!(messages(), [""; 0]);
}
