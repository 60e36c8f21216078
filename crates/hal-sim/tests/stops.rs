//! Emergency stop at any tick: what must hold after it, and that the machine can go on.

mod common;

use common::{config, machine};
use pkm_hal_sim::{Edge, Line, Observer, Setpoint, Simulation, TickReport, Value};

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
}
