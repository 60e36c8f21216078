//! `pkm hal`, and `pkm run` with faults and homing.

use crate::support::{pkm, pkm_with_input};

const STEPPER: &str = "
loadrt threads name1=servo-thread period1=1000000
loadrt siggen
loadrt stepgen step_type=0
loadrt driver model=DRV8825
loadrt motor
addf siggen.0.update servo-thread
addf stepgen.update-freq servo-thread
addf driver.update servo-thread
addf motor.update servo-thread
addf stepgen.capture-position servo-thread
net pos siggen.0.sine => stepgen.0.position-cmd
net step stepgen.0.step => driver.0.step
net dir stepgen.0.dir => driver.0.dir
net counts driver.0.counts => motor.0.counts
setp siggen.0.frequency 2
setp stepgen.0.position-scale 400
setp stepgen.0.steplen 2000
setp stepgen.0.stepspace 2000
setp stepgen.0.dirsetup 700
setp stepgen.0.dirhold 700
setp stepgen.0.enable 1
setp motor.0.scale 400
";

#[test]
fn a_hal_file_runs_and_its_motor_follows() {
    let arguments = [
        "hal",
        "-",
        "--ticks",
        "600",
        "--pin",
        "pos",
        "--pin",
        "motor.0.position",
        "--pin",
        "driver.0.violations",
    ];
    let run = pkm_with_input(&arguments, STEPPER.as_bytes());
    assert_eq!((run.status, run.stderr.as_str()), (0, ""));
    let mut lines = run.stdout.lines();
    assert_eq!(lines.next(), Some("tick,pos,motor.0.position,driver.0.violations"));
    let mut largest = 0.0_f64;
    for (tick, line) in (1..).zip(lines) {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        assert_eq!((fields[0], fields[3]), (f64::from(tick), 0.0));
        assert!((fields[1] - fields[2]).abs() <= 0.5 / 400.0 + 1e-9, "{line}");
        largest = largest.max(fields[2]);
    }
    assert_eq!(largest, 1.0);
}

#[test]
fn what_cannot_be_is_told_with_its_line() {
    for (file, status, told) in [
        ("loadrt threads name1=a period1=0", 2, "a period in ns, from 1"),
        (
            "loadrt motmod servo_period_nsec=1000 base_period_nsec=50000",
            2,
            "not a multiple of the first thread's",
        ),
        ("\nloadrt nonsense", 2, "-:2:8"),
        ("loadrt and2 count=2\nnet x and2.0.out and2.1.out", 2, "written by 'and2.0.out' already"),
        ("loadrt and2\nloadrt and2", 2, "is taken"),
        ("frobnicate", 2, "there is no command 'frobnicate'"),
        ("loadrt and2\nsetp and2.0.in0 2", 2, "'2' is no value of type bit"),
        ("", 2, "no thread: nothing can run"),
        (
            "loadrt threads name1=t period1=1000000\nloadrt and2\nnet x and2.0.in0",
            0,
            "signal 'x' has no writer",
        ),
        ("loadrt threads name1=t period1=1000000\nloadrt and2", 0, "'and2.0' is on no thread"),
        (
            "loadrt threads name1=t period1=1000\nloadrt stepgen step_type=0\naddf stepgen.update-freq t\n\
             setp stepgen.0.enable 1\nsetp stepgen.0.position-cmd 1e6",
            1,
            "stepgen.0 at tick 1: 1000000 steps in one servo period",
        ),
    ] {
        let run = pkm_with_input(&["hal", "-", "--ticks", "2"], file.as_bytes());
        assert_eq!(run.status, status, "{file}: {}", run.stderr);
        assert!(run.stderr.contains(told), "{file}: {}", run.stderr);
    }
    assert_eq!(pkm(&["hal", "/does/not/exist"]).status, 2);
    assert_eq!(pkm(&["hal"]).status, 2);
}

#[test]
fn show_shows_a_machine_as_halcmd_does() {
    let run = pkm(&["hal", "show", "--machine", "moma-a", "pin", "joint.0.motor-pos-fb"]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert!(
        run.stdout.contains("motion       float IN          103.73  joint.0.motor-pos-fb <== j0-motor-pos"),
        "{}",
        run.stdout
    );
    let run = pkm(&["hal", "show", "--machine", "moma-a", "thread"]);
    for function in ["motion-controller", "stepgen.update-freq", "home-switch.1", "kinematics.forward"] {
        assert!(run.stdout.contains(function), "{function}: {}", run.stdout);
    }
    assert!(pkm(&["hal", "show"]).stdout.contains("streamer"));
    assert_eq!(pkm(&["hal", "show", "nothing"]).status, 2);
}

#[test]
fn faults_of_a_run_are_told_and_judged() {
    let program = "G21\nG1 X6 Y-262 F3000\nX0 Y-265\nM2\n";
    let run = |more: &[&str]| {
        let mut arguments = vec!["run", "-", "--machine", "moma-a"];
        arguments.extend(more);
        pkm_with_input(&arguments, program.as_bytes())
    };
    let stopped = run(&["--fault", "100,motion.enable,set=false"]);
    assert_eq!(stopped.status, 1);
    assert!(stopped.stdout.contains("outcome: stopped, category 0"), "{}", stopped.stdout);
    assert!(stopped.stderr.contains("emergency stop in line 2 at tick 100"), "{}", stopped.stderr);
    let held = run(&["--fault", "50+20,motion.feed-hold,set=true"]);
    assert_eq!(held.status, 0, "{}", held.stderr);
    assert!(held.stdout.contains("outcome: finished and equal"), "{}", held.stdout);
    for bad in ["1,joint.7.pos-cmd,nan", "nonsense", "0,motion.enable,nan", "1,motion.enable,explode"] {
        assert_eq!(run(&["--fault", bad]).status, 2, "{bad}");
    }
    let homed = run(&["--home", "--start", "X2 Y-263"]);
    assert_eq!(homed.status, 0, "{}", homed.stderr);
    // the list of a seed is the same every time, and can be replayed
    let random = run(&["--faults", "5", "--seed", "7"]);
    assert_eq!((random.status, &random.stdout), (0, &run(&["--faults", "5", "--seed", "7"]).stdout));
    let first = random.stdout.lines().next().unwrap();
    let (fault, rest) = first.strip_prefix("--fault ").unwrap().split_once("  ").unwrap();
    let again = run(&["--fault", fault]).stdout;
    let outcome = again.lines().find_map(|line| line.strip_prefix("  outcome: ")).unwrap();
    assert!(rest.starts_with(outcome), "{rest}: {outcome}");
}
