//! The machines whose kinematics is switched.

use crate::motmod::{Mode, Motmod};
use crate::stub::{Module, messages, wait};
use pkm_kins::*;

#[test]
fn the_form_is_switched_through_joint_mode() {
    let glide = Module::open("ox_glide_kins");
    assert_eq!(glide.load("ox-glide-o"), 0);
    let pose = [65.0, 65.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let joints = glide.inverse(&pose).unwrap();
    assert_eq!(glide.inverse(&pose), Ok(joints));
    // The sliders stand in the O form: X is refused, joint mode is not.
    assert_eq!(unsafe { (glide.switch)(1) }, -1);
    assert!(messages()[0].contains("other form"));
    assert_eq!(glide.inverse(&pose), Ok(joints), "a refused switch changes nothing");
    assert_eq!(unsafe { (glide.switch)(2) }, 0);
    let here = glide.forward(&joints, &pose).unwrap();
    assert_eq!(here[..3], joints[..3]);
    // AB' = CD − s, CD' = AB + s
    let there = [joints[1] - 20.0, joints[0] + 20.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    glide.inverse(&here).unwrap();
    let moved = glide.inverse(&there).unwrap();
    wait();
    assert_eq!(unsafe { (glide.switch)(1) }, -1, "moving");
    assert!(messages()[0].contains("at rest"));
    assert_eq!(glide.inverse(&there), Ok(moved));
    assert_eq!(unsafe { (glide.switch)(1) }, 0);
    let crossed = glide.forward(&moved, &there).unwrap();
    for (axis, &coordinate) in crossed[..3].iter().zip(&pose[..3]) {
        assert!((axis - coordinate).abs() < 1e-9, "{crossed:?}");
    }
    assert_eq!(unsafe { (glide.switch)(3) }, -1);
}

#[test]
fn hv_mill_switches_and_holds() {
    let mill = Module::open("hv_machine_kins");
    assert_eq!(mill.load("hv-mill-7"), 0);
    assert_eq!(unsafe { (mill.switchable)() }, 1);
    // Joints driven one by one, before the pose is: the idle mechanism holds what it finds.
    let mut joints = [0.0; MAX_JOINTS];
    joints[..7].copy_from_slice(&[101.0, 99.0, 90.0, 95.0, 100.0, 10.0, 5.0]);
    let mut pose = [0.0; 9];
    for _ in 0..5 {
        pose = mill.forward(&joints, &pose).unwrap();
    }
    let back = mill.inverse(&pose).unwrap();
    for (a, b) in back.iter().zip(&joints) {
        assert!((a - b).abs() < 1e-9, "{back:?}");
    }
    assert_eq!(back[2..4], joints[2..4]);
    assert_eq!(back[6], 5.0);
    // C, U, V and W are V's: while H is active they stay.
    let mut idle = pose;
    idle[6] += 1.0;
    assert_eq!(mill.inverse(&idle), Err(-1));
    assert!(messages()[0].contains("does not move with the mechanism"));
    // Nothing moves when V takes over.
    assert_eq!(mill.inverse(&pose), Ok(back));
    assert_eq!(mill.inverse(&pose), Ok(back));
    assert_eq!(unsafe { (mill.switch)(1) }, 0);
    let vertical = mill.forward(&back, &pose).unwrap();
    assert_eq!(vertical[..3], pose[..3], "coordinates of H stay");
    let again = mill.inverse(&vertical).unwrap();
    for (a, b) in again.iter().zip(&back) {
        assert!((a - b).abs() < 1e-9, "{again:?} {back:?}");
    }
    // And V moves without H.
    let mut other = vertical;
    other[6] += 3.0;
    other[8] += 2.0;
    let moved = mill.inverse(&other).unwrap();
    assert_eq!(moved[..2], again[..2]);
    assert!((moved[2] - again[2]).abs() > 0.1);
    wait();
    assert_eq!(unsafe { (mill.switch)(0) }, -1, "moving");
    assert!(messages()[0].contains("at rest"));
    assert_eq!(unsafe { (mill.switch)(2) }, -1);
}

/// A seven-joint mill, homed: H1 H2 V1 V2 carriage table head.
const HOME: [f64; 7] = [101.0, 99.0, 90.0, 95.0, 100.0, 10.0, 5.0];
const C: usize = 5;
const U: usize = 6;
const X: usize = 0;

/// Comes to rest as motion does, the last step no larger than those of real life; then the switch, in the first period in which
/// the axes rest and the joints do not yet.
fn stop_and_switch(mill: &mut Motmod<'_>, axis: usize, by: f64, to: i32) {
    let start = mill.pose[axis];
    for step in 1..=20 {
        let left = 1.0 - f64::from(step) / 20.0;
        mill.pose[axis] = start + by * (1.0 - left * left);
        mill.periods(Mode::Program, 1);
    }
    mill.periods(Mode::Program, 1);
    mill.switch = Some(to);
}

fn near(a: &[f64; 9], b: &[f64; 9]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
}

#[test]
fn a_switch_while_the_interpolation_runs_out_leaves_no_remainder() {
    let module = Module::open("hv_machine_kins");
    assert_eq!(module.load("hv-mill-7"), 0);
    let mut mill = Motmod::homed(&module, &HOME);
    mill.periods(Mode::Program, 5);
    mill.switch = Some(1);
    mill.periods(Mode::Program, 5);
    stop_and_switch(&mut mill, C, -5.0, 0);
    let commanded = mill.pose;
    let sent = mill.coarse;
    assert!((mill.joints[5] - sent[5]).abs() > 1e-3, "the table still moves: {:?}", mill.joints);
    mill.periods(Mode::Program, 6);
    mill.stands(Mode::Program, &sent, 1e-9);
    assert_eq!(mill.pose[C..], commanded[C..], "the axes of V are where they were commanded");
    assert!(near(&mill.feedback, &mill.pose), "{:?} {:?}", mill.feedback, mill.pose);
    // The same with X, whose joints become idle, and back at once.
    stop_and_switch(&mut mill, X, 3.0, 1);
    let sent = mill.coarse;
    assert!(mill.period(Mode::Program));
    mill.switch = Some(0);
    assert!(mill.period(Mode::Program), "{:?}", messages());
    mill.periods(Mode::Program, 6);
    mill.stands(Mode::Program, &sent, 1e-9);
    assert!(near(&mill.feedback, &mill.pose), "{:?} {:?}", mill.feedback, mill.pose);
}

#[test]
fn idle_joints_stay_at_their_commands_and_not_at_their_feedback() {
    let module = Module::open("hv_machine_kins");
    assert_eq!(module.load("hv-mill-7"), 0);
    let mut mill = Motmod::homed(&module, &HOME);
    mill.following_error = [0.01, -0.02, 0.03, -0.04, 0.05, -0.06, 0.07, 0.0, 0.0];
    let stand = mill.joints;
    // In and out of driving the pose: not even a little each time.
    for mode in
        [Mode::Program, Mode::Joint, Mode::World, Mode::Joint, Mode::Program, Mode::World, Mode::Program]
    {
        mill.stands(mode, &stand, 1e-9);
    }
    // With each mechanism, switched in every mode.
    for (mode, to) in [(Mode::Program, 1), (Mode::World, 0), (Mode::Joint, 1)] {
        mill.stands(mode, &stand, 1e-9);
        mill.switch = Some(to);
        mill.stands(mode, &stand, 1e-9);
    }
    mill.stands(Mode::Program, &stand, 1e-9);
    // A switch and a mode at once.
    mill.stands(Mode::Joint, &stand, 1e-9);
    mill.switch = Some(0);
    mill.stands(Mode::Program, &stand, 1e-9);
    mill.stands(Mode::Joint, &stand, 1e-9);
    mill.switch = Some(1);
    mill.stands(Mode::World, &stand, 1e-9);
    // Off: pushed by hand, the feedback is the command.
    mill.period(Mode::Off);
    mill.following_error = [0.0; MAX_JOINTS];
    for joint in &mut mill.joints[..7] {
        *joint += 0.5;
    }
    mill.periods(Mode::Off, 5);
    let pushed = mill.joints;
    mill.switch = Some(0);
    mill.stands(Mode::Off, &pushed, 1e-9);
    mill.stands(Mode::Joint, &pushed, 1e-9);
    mill.stands(Mode::Program, &pushed, 1e-9);
}

#[test]
fn joints_jogged_one_by_one_are_the_truth() {
    let module = Module::open("hv_machine_kins");
    assert_eq!(module.load("hv-mill-7"), 0);
    let mut mill = Motmod::homed(&module, &HOME);
    mill.periods(Mode::Program, 5);
    mill.periods(Mode::Joint, 5);
    // V1 and V2 are idle.
    for _ in 0..50 {
        (mill.joints[2], mill.joints[3]) = (mill.joints[2] + 0.1, mill.joints[3] - 0.05);
        mill.periods(Mode::Joint, 1);
    }
    let jogged = mill.joints;
    mill.stands(Mode::Joint, &jogged, 0.0);
    mill.stands(Mode::Program, &jogged, 1e-9);
    let before = mill.pose[U];
    mill.switch = Some(1);
    mill.stands(Mode::Program, &jogged, 1e-9);
    assert!((mill.pose[U] - before).abs() > 1.0, "V is where its joints were jogged to");
    let own = HvMachine::new(&HvMachineParameters::seven()).unwrap();
    let mut inner = mill.joints;
    (inner[5], inner[6]) = (maths::radians(inner[5]), maths::radians(inner[6]));
    let pose = own.holding(Spindle::V, &inner).forward(&inner, &Pose::ZERO).unwrap();
    assert!((pose.u - mill.pose[U]).abs() < 1e-9);
}

#[test]
fn a_form_switched_while_the_interpolation_runs_out_leaves_no_remainder() {
    let module = Module::open("ox_glide_kins");
    assert_eq!(module.load("ox-glide-o"), 0);
    let own = OxGlide::new(&OxForm::O.into()).unwrap();
    let home = own.inverse(&Pose { x: 65.0, y: 65.0, z: 100.0, ..Pose::ZERO }).unwrap();
    let mut glide = Motmod::homed(&module, &home[..3]);
    glide.periods(Mode::Program, 5);
    for to in [2, 0] {
        stop_and_switch(&mut glide, X, 3.0, to);
        let sent = glide.coarse;
        assert!((glide.joints[0] - sent[0]).abs() > 1e-3);
        glide.periods(Mode::Program, 6);
        glide.stands(Mode::Program, &sent, 1e-9);
    }
    assert!((glide.pose[X] - 71.0).abs() < 3.0 + 1e-9 && near(&glide.feedback, &glide.pose));
}
