//! Geometry from HAL, errors, loading.

use crate::stub::{HAL, Hal, Module, hal, messages, pin, setp, wait};
use pkm_kins::*;

/// More calls than it takes to look at all of the geometry.
const ENOUGH: usize = 10;

#[test]
fn geometry_not_set_refuses_every_pose() {
    let moma = Module::open("moma_kins");
    assert_eq!(moma.load(""), 0);
    assert_eq!(messages(), [""; 0], "loading alone is no error");
    let pose = [0.0, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(moma.inverse(&pose), Err(-1));
    let told = messages();
    assert!(told.len() == 1 && told[0].contains("moma_kins: the geometry is not set"), "{told:?}");
    assert_eq!(moma.forward(&[1.0; MAX_JOINTS], &pose), Err(-1));
    // As geometry.hal does: one after the other.
    for (drive, x, angle) in [("1", -100.0, 265.0), ("2", 100.0, 275.0)] {
        for (name, value) in [
            ("reference-x", x),
            ("reference-y", 0.0),
            ("rail-angle", angle),
            ("link-length", 195.0),
            ("working-mode", -1.0),
        ] {
            setp(&format!("moma.{drive}.{name}"), value);
        }
    }
    setp("moma.assembly", -1.0);
    for _ in 0..ENOUGH {
        let _ = moma.inverse(&pose);
    }
    let own = Moma::new(&MomaConfiguration::A.into()).unwrap();
    assert_eq!(moma.inverse(&pose), Ok(own.inverse(&Pose::from_array(pose)).unwrap()));
}

#[test]
fn nonsense_while_running_is_refused_until_it_is_gone() {
    let moma = Module::open("moma_kins");
    assert_eq!(moma.load("moma-a"), 0);
    let pose = [10.0, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let joints = moma.inverse(&pose).unwrap();
    let refused = |name: &str, value: f64, before: f64, why: &str| {
        wait();
        setp(name, value);
        for _ in 0..ENOUGH {
            let _ = moma.inverse(&pose);
        }
        assert_eq!(moma.inverse(&pose), Err(-1), "{name} = {value}");
        assert_eq!(moma.forward(&joints, &pose), Err(-1), "{name} = {value}");
        let told = messages();
        assert!(told.len() == 1 && told[0].contains(why), "{name} = {value}: {told:?}");
        setp(name, before);
        for _ in 0..ENOUGH {
            let _ = moma.inverse(&pose);
        }
        assert_eq!(moma.inverse(&pose), Ok(joints), "{name} is back");
        let _ = messages();
    };
    refused("moma.1.link-length", f64::NAN, 195.0, "is no number");
    refused("moma.1.link-length", f64::INFINITY, 195.0, "is no number");
    refused("moma.1.link-length", -195.0, 195.0, "makes no mechanism");
    refused("moma.1.link-length", 0.0, 195.0, "makes no mechanism");
    refused("moma.1.link-length", 1e300, 195.0, "makes no mechanism");
    refused("moma.2.working-mode", 0.0, -1.0, "must be 1 or -1");
    refused("moma.2.working-mode", 1e9, -1.0, "is too large");
    refused("moma.assembly", 5.0, -1.0, "must be 1 or -1");
    // A mechanism, but another one: the machine would jump.
    refused("moma.1.link-length", 196.0, 195.0, "would jump");
    refused("moma.2.working-mode", 1.0, -1.0, "");
    refused("moma.1.link-length", 20.0, 195.0, "too short");
    // A correction is no jump.
    setp("moma.1.link-length", 195.1);
    for _ in 0..ENOUGH {
        assert!(moma.inverse(&pose).is_ok());
    }
    assert!(moma.inverse(&pose).unwrap()[0] != joints[0]);
    // While LinuxCNC does not drive the pose any geometry may be set.
    for _ in 0..4 {
        moma.forward(&joints, &pose).unwrap();
    }
    setp("moma.1.link-length", 205.0);
    for _ in 0..ENOUGH {
        assert!(moma.forward(&joints, &pose).is_ok());
    }
    assert!(moma.inverse(&pose).is_ok());
    assert_eq!(messages(), [""; 0]);
}

#[test]
fn errors_are_counted_and_told_once_a_second() {
    let moma = Module::open("moma_kins");
    assert_eq!(moma.load("moma-a"), 0);
    let far = [500.0, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut joints = [7.5; 16];
    for _ in 0..1000 {
        let status =
            unsafe { (moma.inverse)(&far, joints.as_mut_ptr(), std::ptr::null(), std::ptr::null_mut()) };
        assert_eq!(status, -1);
    }
    assert_eq!(joints, [7.5; 16], "a refused pose writes nothing");
    assert_eq!(pin("moma.errors"), 1000);
    let told = messages();
    assert!(told.len() == 1 && told[0].contains("joint %d: its link is %.3f mm too short"), "{told:?}");
    wait();
    assert_eq!(moma.inverse(&far), Err(-1));
    assert_eq!(messages().len(), 1);
    for nonsense in [f64::NAN, f64::INFINITY, f64::MAX] {
        assert_eq!(moma.inverse(&[nonsense, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Err(-1));
        assert_eq!(moma.forward(&[nonsense; MAX_JOINTS], &far), Err(-1));
    }
}

#[test]
fn a_module_that_cannot_be_made_says_so_and_leaves() {
    let moma = Module::open("moma_kins");
    assert_eq!(moma.load("no-such-machine"), -22);
    assert!(messages()[0].contains("no machine of the name"));
    assert!(!hal(|hal| hal.ready));
    hal(|hal| hal.refuse_malloc = true);
    assert_eq!(moma.load("moma-a"), -12);
    assert!(hal(|hal| hal.exited && !hal.ready));
    hal(|hal| {
        *hal = Hal { refuse_name: Some("moma.2.rail-angle".into()), ..Hal::default() };
    });
    assert_eq!(moma.load("moma-a"), -22);
    assert!(hal(|hal| hal.exited && !hal.ready));
    // And after all that it can still be loaded.
    *HAL.lock().unwrap() = Some(Hal::default());
    assert_eq!(moma.load("moma-a"), 0);
    assert!(moma.inverse(&[0.0, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).is_ok());
}
