//! Emergency stop at any tick: what must hold after it, and that the machine can go on.

mod common;

use common::{config, machine};
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
