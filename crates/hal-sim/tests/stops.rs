//! Emergency stop at any tick: what must hold after it, and that the machine can go on.

mod common;

use common::{config, machine};
use pkm_hal_sim::components::spindle::SpindleCommand;
use pkm_hal_sim::{Edge, Line, Observer, Setpoint, SetpointSource, Simulation, TickReport, Value};

/// Steps after a tick.
struct Late {
    after: u64,
    steps: u64,
}

impl Observer for Late {
    fn edge(&mut self, edge: &Edge) {
        self.steps += u64::from(edge.line == Line::Step && edge.level && edge.time > self.after);
    }
    fn tick(&mut self, _report: &TickReport<'_>) {}
}

fn stop_and_check(mut simulation: Simulation, tick: u64) {
    let joints = simulation.report().joints.len();
    let stands = simulation.feedback();
    let mut late = Late { after: tick * 10_000, steps: 0 };
    simulation.emergency_stop();
    for _ in 0..5 {
        simulation.idle(&mut [&mut late]).unwrap();
        for n in 0..joints {
            for pin in ["joint.N.amp-enable-out", "stepgen.N.enable", "driver.N.enable"] {
                let pin = pin.replace('N', &n.to_string());
                assert_eq!(simulation.hal().getp(&pin), Ok(Value::Bit(false)), "{pin}");
            }
        }
    }
    assert_eq!(late.steps, 0, "tick {tick}");
    assert_eq!(simulation.feedback(), stands, "tick {tick}");
    let report = simulation.report();
    for (n, joint) in report.joints.iter().enumerate() {
        assert_eq!(joint.commanded, joint.position, "tick {tick}");
        assert_eq!(joint.step_error, 0.0, "tick {tick}");
        let counts = Ok(Value::S32(joint.count as i32));
        assert_eq!(simulation.hal().getp(&format!("driver.{n}.counts")), counts, "tick {tick}");
        assert_eq!(simulation.hal().getp(&format!("stepgen.{n}.counts")), counts, "tick {tick}");
        assert_eq!(simulation.hal().getp(&format!("stepgen.{n}.step")), Ok(Value::Bit(false)));
    }
    // reset, then drive on from there: 5 µm in one period and rest
    simulation.reset();
    let mut setpoint = Setpoint { joints: simulation.feedback(), ..Setpoint::default() };
    simulation.tick_to(&setpoint, &mut []).unwrap();
    for joint in &mut setpoint.joints[..joints] {
        *joint += 0.005;
    }
    simulation.tick_to(&setpoint, &mut []).unwrap();
    simulation.tick_to(&setpoint, &mut []).unwrap();
    for joint in simulation.report().joints {
        assert!(joint.step_error.abs() <= 0.5, "tick {tick}");
    }
    for statistics in simulation.statistics() {
        assert_eq!(statistics.violations.total(), 0, "tick {tick}: {statistics:?}");
    }
}

#[test]
fn an_emergency_stop_at_any_tick_leaves_the_machine_where_it_says() {
    let (mut simulation, mut source) = machine(3);
    for tick in 1..=1500 {
        simulation.tick(&mut source, &mut []).unwrap();
        stop_and_check(simulation.clone(), tick);
    }
}

#[test]
fn late_steps_are_dropped_and_not_counted() {
    // a slow driver and a motion that turns about a half-step position: some steps are late over the period's end
    let mut config = config(1, 100);
    config.joints[0].timing.dir_setup = 550_000;
    config.joints[0].timing.dir_hold = 600_000;
    config.joints[0].driver_minimum = config.joints[0].timing;
    let mut simulation = Simulation::new(&config).unwrap();
    let mut dropped = 0;
    for tick in 1..=2000_u64 {
        let mut setpoint = Setpoint::default();
        setpoint.joints[0] = if tick % 12 < 7 && tick % 2 == 1 { 0.002 } else { 0.0 };
        simulation.tick_to(&setpoint, &mut []).unwrap();
        let behind = simulation.report().joints[0].step_error.abs() > 0.5;
        dropped += u64::from(behind);
        stop_and_check(simulation.clone(), tick);
    }
    assert!(dropped > 10, "{dropped}: the test does not test");
    // it says how late they were, and how far off
    let statistics = simulation.statistics()[0];
    assert!(statistics.delayed_steps >= dropped && statistics.max_delay_ns > 500_000, "{statistics:?}");
    assert!(statistics.max_step_error > 0.7 && statistics.max_edge_error > 0.7, "{statistics:?}");
}

#[test]
fn after_any_fault_the_machine_stands_and_can_go_on() {
    let (simulation, mut source) = machine(3);
    let bad = |change: &dyn Fn(&mut Simulation, &mut Setpoint), message: &str| {
        for tick in [1, 2, 40, 523] {
            let mut simulation = simulation.clone();
            for _ in 1..tick {
                simulation.tick(&mut common::Waves { joints: 3 }, &mut []).unwrap();
            }
            let mut setpoint = common::Waves { joints: 3 }.next(tick).unwrap();
            change(&mut simulation, &mut setpoint);
            let fault = simulation.tick_to(&setpoint, &mut []).unwrap_err().to_string();
            assert_eq!(fault.split(" at tick").next(), Some(message), "tick {tick}: {fault}");
            assert_eq!(simulation.tick_number(), tick);
            let stands = simulation.feedback();
            for name in ["joint.0.pos-lim-sw-in", "joint.2.neg-lim-sw-in"] {
                simulation.hal_mut().setp(name, Value::Bit(false)).unwrap();
            }
            simulation.hal_mut().setp("joint.1.f-error-lim", Value::Float(0.0)).unwrap();
            simulation.idle(&mut []).unwrap();
            assert_eq!(simulation.feedback(), stands, "tick {tick}");
            stop_and_check(simulation, tick + 1);
        }
    };
    let set =
        |simulation: &mut Simulation, name: &str, value| simulation.hal_mut().setp(name, value).unwrap();
    bad(&|_, s| s.joints[1] = f64::NAN, "joint.1.pos-cmd was given NaN");
    bad(&|_, s| s.velocities[2] = f64::NEG_INFINITY, "joint.2.vel-cmd was given -inf");
    bad(&|_, s| s.velocities[2] = 1e9, "stepgen.2");
    bad(&|s, _| set(s, "joint.0.pos-lim-sw-in", Value::Bit(true)), "joint.0.pos-lim-sw-in is on");
    bad(&|s, _| set(s, "joint.2.neg-lim-sw-in", Value::Bit(true)), "joint.2.neg-lim-sw-in is on");
    // a following error that is not there cannot be provoked by the stepper itself: half a step is legal
    source.joints = 3;
    let mut simulation = simulation;
    set(&mut simulation, "joint.1.f-error-lim", Value::Float(0.5 / 400.0 + 1e-9));
    for _ in 0..1000 {
        simulation.tick(&mut source, &mut []).unwrap();
    }
    set(&mut simulation, "joint.1.f-error-lim", Value::Float(1e-7));
    let fault = (0..10).find_map(|_| simulation.tick(&mut source, &mut []).err()).unwrap();
    assert!(fault.to_string().starts_with("joint.1.f-error is "), "{fault}");
}

#[test]
fn a_limit_switch_can_only_be_left() {
    let mut config = config(2, 100);
    for joint in &mut config.joints {
        (joint.start, joint.max_acceleration) = (0.0, 1000.0);
    }
    for (pin, forbidden) in [("joint.0.pos-lim-sw-in", 1.0), ("joint.0.neg-lim-sw-in", -1.0)] {
        let mut simulation = Simulation::new(&config).unwrap();
        let on = |simulation: &mut Simulation, on| simulation.hal_mut().setp(pin, Value::Bit(on)).unwrap();
        simulation.tick_to(&Setpoint::default(), &mut []).unwrap();
        on(&mut simulation, true);
        let fault = simulation.tick_to(&Setpoint::default(), &mut []).unwrap_err();
        assert!(fault.to_string().starts_with(pin), "{fault}");
        while simulation.drives_on() {
            simulation.idle(&mut []).unwrap();
        }
        simulation.reset();
        // it stands on the switch, and may
        let mut setpoint = Setpoint::default();
        simulation.tick_to(&setpoint, &mut []).unwrap();
        let mut towards = simulation.clone();
        setpoint.joints[0] = 0.0005 * forbidden;
        let fault = towards.tick_to(&setpoint, &mut []).unwrap_err();
        assert!(fault.to_string().starts_with(pin), "{fault}");
        // away, the contact bouncing when it opens
        let mut speed = 0.0;
        setpoint.joints[0] = 0.0;
        for tick in 0..200 {
            speed = f64::min(speed + 0.0005, 0.01);
            setpoint.joints[0] -= speed * forbidden;
            setpoint.velocities[0] = -speed * forbidden * 1000.0;
            on(&mut simulation, tick < 100 || [103, 104, 110].contains(&tick));
            simulation.tick_to(&setpoint, &mut []).unwrap_or_else(|fault| panic!("tick {tick}: {fault}"));
        }
        // and then it is a limit switch again
        on(&mut simulation, true);
        assert!(simulation.tick_to(&setpoint, &mut []).is_err());
    }
}

#[test]
fn a_stall_without_encoder_shows_at_the_next_homing() {
    use pkm_hal_sim::{HomeJoint, Homing, HomingConfig, Switches};
    use pkm_kins::JointRange;
    let mut config = config(1, 100);
    let limits = JointRange { min: -900.0, max: 900.0 };
    let joint = &mut config.joints[0];
    (joint.start, joint.max_acceleration, joint.following_error) = (0.0, 1000.0, 0.0075);
    joint.switches = Some(Switches {
        home: 2.0,
        home_below: true,
        limits,
        bounce_ns: 3_000_000,
        seed: 3,
        index_pitch: 0.0,
    });
    let mut simulation = Simulation::new(&config).unwrap();
    // no encoder: what is fed back are the steps
    let hal = simulation.hal_mut();
    hal.unlink("joint.0.motor-pos-fb").unwrap();
    hal.net("j0-stepped", &["joint.0.motor-pos-fb"]).unwrap();
    let (mut setpoint, mut speed) = (Setpoint::default(), 0.0);
    for tick in 1..=300 {
        if tick == 100 {
            simulation.hal_mut().inject(&"100+20,driver.0.step,freeze".parse().unwrap()).unwrap();
        }
        speed = f64::min(speed + 0.001, 0.02);
        setpoint.joints[0] += speed;
        setpoint.velocities[0] = speed * 1000.0;
        simulation.tick_to(&setpoint, &mut []).unwrap_or_else(|fault| panic!("noticed: {fault}"));
    }
    while speed > 0.0 {
        speed = f64::max(speed - 0.001, 0.0);
        setpoint.joints[0] += speed;
        setpoint.velocities[0] = speed * 1000.0;
        simulation.tick_to(&setpoint, &mut []).unwrap();
    }
    let lost = simulation.feedback()[0] - simulation.true_joints()[0];
    assert!(lost > 0.3, "{lost}: nothing was lost");
    let home = HomeJoint {
        name: "p1".to_owned(),
        search_velocity: -20.0,
        latch_velocity: 2.0,
        switch: 2.0,
        home: 3.0,
        sequence: 0,
        use_index: false,
        repeat: 2.0 / 400.0,
        travel: 100.0,
        velocity: 20.0,
        acceleration: 1000.0,
    };
    let at = simulation.feedback()[0];
    simulation.forget_home();
    let mut homing = Homing::new(HomingConfig { period_s: 0.001, debounce_s: 0.025 }, vec![home], &[at]);
    while !homing.is_done() {
        simulation.home(&mut homing, &mut []).unwrap();
    }
    assert!(simulation.is_homed());
    let (reported, real) = (simulation.feedback()[0], simulation.true_joints()[0]);
    assert!((reported - real).abs() <= 1.0 / 400.0, "{reported} {real}");
    let shown = simulation.home_offsets()[0];
    assert!((shown - lost).abs() <= 1.0 / 400.0, "homing found {shown}, {lost} were lost");
}

#[test]
fn after_a_loss_of_power_the_machine_does_not_know_where_it_is() {
    let (mut simulation, mut source) = machine(2);
    for _ in 0..100 {
        simulation.tick(&mut source, &mut []).unwrap();
    }
    assert!(simulation.is_homed());
    simulation.forget_home();
    assert!(!simulation.is_homed());
    // begun anew: unknown, every joint at 0 wherever it stands
    let mut config = config(2, 100);
    (config.joints[0].start, config.joints[1].start, config.homed) = (12.5, -3.0, false);
    let simulation = Simulation::new(&config).unwrap();
    assert!(!simulation.is_homed());
    assert_eq!(simulation.hal().getp("joint.0.homed"), Ok(Value::Bit(false)));
    assert_eq!(simulation.feedback(), [0.0; 9]);
    assert_eq!(simulation.true_joints()[..2], [12.5, -3.0]);
}

#[test]
fn an_emergency_stop_turns_the_spindle_off() {
    let mut config = config(1, 100);
    config.spindle = Some(pkm_hal_sim::SpindleConfig { max_speed_rpm: 3000.0, acceleration_rpm_s: 1000.0 });
    let mut simulation = Simulation::new(&config).unwrap();
    let turning = SpindleCommand { on: true, speed_rpm: 600.0, ..SpindleCommand::default() };
    let joints = simulation.report().setpoint.joints;
    let setpoint = Setpoint { spindle: turning, joints, ..Setpoint::default() };
    for _ in 0..50 {
        simulation.tick_to(&setpoint, &mut []).unwrap();
    }
    assert_eq!(simulation.hal().getp("spindle.0.on"), Ok(Value::Bit(true)));
    simulation.emergency_stop();
    simulation.idle(&mut []).unwrap();
    assert_eq!(simulation.hal().getp("spindle.0.on"), Ok(Value::Bit(false)));
}
