//! Simulated hardware: encoder, switch, motor.

mod common;

use common::machine;
use pkm_hal_sim::Value;
use pkm_hal_sim::hal_file::Session;

fn run(text: &str) -> Session {
    let mut session = Session::new(100).unwrap();
    if let Err(error) = session.run_file(text, &mut String::new()) {
        panic!("{error}");
    }
    session
}

fn ticks(session: &mut Session, count: usize) {
    for _ in 0..count {
        session.hal_mut().run(None).unwrap();
    }
}

fn float(session: &Session, pin: &str) -> f64 {
    match session.hal().getp(pin).unwrap() {
        Value::Float(value) => value,
        other => panic!("{pin} is {other}"),
    }
}

fn s32(session: &Session, pin: &str) -> i32 {
    match session.hal().getp(pin).unwrap() {
        Value::S32(value) => value,
        other => panic!("{pin} is {other}"),
    }
}

fn set(session: &mut Session, pin: &str, value: Value) {
    session.hal_mut().setp(pin, value).unwrap();
}

const ENCODER: &str = "
loadrt threads name1=servo-thread period1=1000000
loadrt siggen
loadrt shaft_encoder
loadrt encoder num_chan=1
addf siggen.0.update servo-thread
addf shaft-encoder.0 servo-thread
addf encoder.update-counters servo-thread
addf encoder.capture-position servo-thread
net shaft siggen.0.sine => shaft-encoder.0.position
net a shaft-encoder.0.phase-a => encoder.0.phase-A
net b shaft-encoder.0.phase-b => encoder.0.phase-B
net z shaft-encoder.0.phase-z => encoder.0.phase-Z
setp shaft-encoder.0.scale 1000
setp encoder.0.position-scale 1000
setp siggen.0.amplitude 2
setp siggen.0.frequency 3
";

#[test]
fn an_encoder_follows_its_shaft() {
    let mut session = run(ENCODER);
    for tick in 0..2000 {
        ticks(&mut session, 1);
        let (shaft, read) = (float(&session, "siggen.0.sine"), float(&session, "encoder.0.position"));
        assert!((shaft - read).abs() <= 0.000_501, "tick {tick}: {shaft} {read}");
    }
    // one count a line, and one way only
    set(&mut session, "encoder.0.x4-mode", Value::Bit(false));
    ticks(&mut session, 1);
    let counts = (float(&session, "siggen.0.sine") * 250.0).floor();
    assert!((f64::from(s32(&session, "encoder.0.counts")) - counts).abs() <= 1.0);
    set(&mut session, "encoder.0.counter-mode", Value::Bit(true));
    ticks(&mut session, 1);
    // 6 turns of the sine, each 4 units up and 4 down, 250 lines a unit
    let rises = s32(&session, "encoder.0.counts");
    assert!((rises - 6 * 8 * 250).abs() < 30, "{rises}");
}

#[test]
fn the_index_sets_the_counts_to_zero() {
    let mut session = run(&format!("{ENCODER}\nsetp shaft-encoder.0.counts-per-turn 700\n"));
    set(&mut session, "encoder.0.index-enable", Value::Bit(true));
    // the sine starts at 0, where the index is: enabled, it is found again at 0.7
    ticks(&mut session, 1);
    set(&mut session, "encoder.0.index-enable", Value::Bit(true));
    while session.hal().getp("encoder.0.index-enable") == Ok(Value::Bit(true)) {
        ticks(&mut session, 1);
    }
    let (shaft, read) = (float(&session, "siggen.0.sine"), float(&session, "encoder.0.position"));
    assert!((shaft - 0.7 - read).abs() < 0.0011, "{shaft} {read}");
    set(&mut session, "encoder.0.reset", Value::Bit(true));
    ticks(&mut session, 1);
    assert_eq!(s32(&session, "encoder.0.counts"), 0);
}

#[test]
fn encoder_faults_show() {
    for (fault, value) in [
        ("lost", Value::Bit(true)),
        ("frozen", Value::Bit(true)),
        ("reversed", Value::Bit(true)),
        ("offset", Value::Float(0.75)),
    ] {
        let mut session = run(ENCODER);
        ticks(&mut session, 20);
        set(&mut session, &format!("shaft-encoder.0.{fault}"), value);
        let mut worst = 0.0_f64;
        for _ in 0..400 {
            ticks(&mut session, 1);
            let (shaft, read) = (float(&session, "siggen.0.sine"), float(&session, "encoder.0.position"));
            worst = worst.max((shaft - read).abs());
        }
        assert!(worst > 0.7, "{fault}: {worst}");
    }
}

const SWITCH: &str = "
loadrt threads name1=servo-thread period1=1000000
loadrt siggen
loadrt shaft_switch
loadrt dbounce
loadrt encoder
addf siggen.0.update servo-thread
addf shaft-switch.0 servo-thread
addf dbounce.0 servo-thread
addf encoder.update-counters servo-thread
addf encoder.capture-position servo-thread
net x siggen.0.sine => shaft-switch.0.position
net contact shaft-switch.0.out => dbounce.0.in encoder.0.phase-a
setp siggen.0.amplitude 10
setp siggen.0.frequency 1
setp shaft-switch.0.at 5
setp shaft-switch.0.hysteresis 0.5
setp encoder.0.counter-mode 1
";

#[test]
fn a_switch_bounces_as_long_as_it_may_and_is_debounced() {
    for (bounce_ns, seed) in [(0, 0), (20_000_000, 1), (20_000_000, 2), (500_000, 3), (5_000_000, 4)] {
        let mut session = run(SWITCH);
        set(&mut session, "shaft-switch.0.bounce-ns", Value::U32(bounce_ns));
        set(&mut session, "shaft-switch.0.seed", Value::U32(seed));
        // as long as the contact may bounce
        let delay = 3 + bounce_ns / 1_000_000;
        set(&mut session, "dbounce.0.delay", Value::U32(delay));
        let mut changes = Vec::new();
        let mut was = Value::Bit(false);
        for tick in 1..=1000 {
            ticks(&mut session, 1);
            let now = session.hal().getp("dbounce.0.out").unwrap();
            if now != was {
                changes.push(tick);
                was = now;
            }
        }
        // 10 sin(2πt) passes 5 at 83.3 ms and comes back below 4.5 at 425.7 ms
        assert_eq!(changes.len(), 2, "bounce {bounce_ns} seed {seed}: {changes:?}");
        let late = 2 + delay as usize + bounce_ns as usize / 1_000_000;
        for (change, expected) in changes.iter().zip([84, 426]) {
            assert!((expected..=expected + late).contains(change), "bounce {bounce_ns}: {changes:?}");
        }
        // rising edges of the contact itself
        let rises = s32(&session, "encoder.0.counts");
        let expected = if bounce_ns == 0 { 1..=1 } else { 5..=13 };
        assert!(expected.contains(&rises), "bounce {bounce_ns} seed {seed}: {rises}");
    }
}

#[test]
fn a_switch_can_be_stuck() {
    for (pin, level) in [("stuck-on", true), ("stuck-off", false)] {
        let mut session = run(SWITCH);
        set(&mut session, &format!("shaft-switch.0.{pin}"), Value::Bit(true));
        for _ in 0..500 {
            ticks(&mut session, 1);
            assert_eq!(session.hal().getp("shaft-switch.0.out"), Ok(Value::Bit(level)));
        }
        set(&mut session, &format!("shaft-switch.0.{pin}"), Value::Bit(false));
        ticks(&mut session, 700);
        // 10 sin(2π · 1.2) = 9.5
        assert_eq!(session.hal().getp("shaft-switch.0.out"), Ok(Value::Bit(true)));
    }
}

#[test]
fn a_whole_axis_from_a_hal_file() {
    let mut session = run("
loadrt threads name1=servo-thread period1=1000000
loadrt siggen
loadrt stepgen step_type=0
loadrt driver model=drv8825
loadrt motor
addf siggen.0.update servo-thread
addf stepgen.update-freq servo-thread
addf driver.update servo-thread
addf motor.update servo-thread
addf stepgen.capture-position servo-thread
net cmd siggen.0.sine => stepgen.0.position-cmd
net step stepgen.0.step => driver.0.step
net dir stepgen.0.dir => driver.0.dir
net counts driver.0.counts => motor.0.counts
setp stepgen.0.enable 1
setp stepgen.0.position-scale 400
setp stepgen.0.steplen 1900
setp stepgen.0.stepspace 1900
setp stepgen.0.dirsetup 650
setp stepgen.0.dirhold 650
setp motor.0.scale 400
setp siggen.0.amplitude 3
");
    for tick in 0..2000 {
        ticks(&mut session, 1);
        let (command, position) = (float(&session, "siggen.0.sine"), float(&session, "motor.0.position"));
        assert!((command - position).abs() <= 0.5 / 400.0 + 1e-9, "tick {tick}: {command} {position}");
    }
    assert_eq!(session.hal().getp("driver.0.violations"), Ok(Value::U32(0)));
    // with play the joint is half of it behind, either way
    set(&mut session, "motor.0.backlash", Value::Float(0.1));
    ticks(&mut session, 1000);
    let mut worst = 0.0_f64;
    for _ in 0..1000 {
        ticks(&mut session, 1);
        let behind = float(&session, "siggen.0.sine") - float(&session, "motor.0.position");
        worst = worst.max(behind.abs());
    }
    assert!((worst - 0.05).abs() < 0.0013, "{worst}");
}

#[test]
fn a_motor_loses_steps_only_when_asked_too_much() {
    // the waves of the test machine: joint 1 runs at 20 mm/s with 80 mm/s²
    for (acceleration, speed, loses) in
        [(2000.0, 100.0, false), (120.0, 70.0, false), (20.0, 100.0, true), (2000.0, 15.0, true)]
    {
        let (mut simulation, mut source) = machine(2);
        let hal = simulation.hal_mut();
        hal.setp("motor.1.microsteps", Value::U32(16)).unwrap();
        hal.setp("motor.1.max-acceleration", Value::Float(acceleration)).unwrap();
        hal.setp("motor.1.max-speed", Value::Float(speed)).unwrap();
        hal.setp("joint.1.f-error-lim", Value::Float(0.05)).unwrap();
        let fault = (0..3000).find_map(|_| simulation.tick(&mut source, &mut []).err());
        let lost = simulation.hal().getp("motor.1.lost").unwrap();
        assert_eq!(fault.is_some(), loses, "{acceleration} {speed}: {fault:?}");
        if let Some(fault) = fault {
            assert!(fault.to_string().starts_with("joint.1.f-error is"), "{fault}");
        } else {
            assert_eq!(lost, Value::S32(0));
        }
        // the other joint stands as well
        let stands = simulation.feedback();
        if loses {
            for _ in 0..10 {
                simulation.idle(&mut []).unwrap();
            }
            assert_eq!(simulation.feedback(), stands);
        }
    }
}
