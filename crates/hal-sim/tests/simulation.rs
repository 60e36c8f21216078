//! The ready-wired machine: steps follow the command, files agree with each other, nonsense is refused.

mod common;

use common::{SERVO_NS, Waves, config, machine, wave};
use pkm_hal_sim::{
    Edge, Fault, Line, Observer, Setpoint, Simulation, SimulationConfig, TickReport, TraceWriter, Value,
    VcdSteps, VcdWriter, Violations,
};
use pkm_kins::cartesian::Cartesian;
use pkm_kins::maths::{cos, sin};
use pkm_kins::{Axis, AxisSet, JointKind};

#[test]
fn the_count_is_within_half_a_step_at_every_tick() {
    let (mut simulation, mut source) = machine(5);
    for tick in 1..=4000 {
        let report = simulation.tick(&mut source, &mut []).unwrap();
        for (n, joint) in report.joints.iter().enumerate() {
            let (commanded, _) = wave(n, (tick * SERVO_NS) as f64 / 1e9);
            assert_eq!(joint.commanded, commanded);
            let scale = if n == 4 { 100.0 * 180.0 / std::f64::consts::PI } else { 400.0 };
            assert!((joint.position - commanded).abs() * scale <= 0.5 + 1e-8, "tick {tick} joint {n}");
            assert!(joint.step_error.abs() <= 0.5, "tick {tick} joint {n}: {joint:?}");
        }
    }
    for statistics in simulation.statistics() {
        assert_eq!(statistics.violations, Violations::default());
        assert!((0.5..0.55).contains(&statistics.max_edge_error), "{statistics:?}");
        assert!(statistics.steps > 5000 && statistics.reversals > 3, "{statistics:?}");
    }
}

#[test]
fn vcd_and_trace_count_to_the_same_positions() {
    let (mut simulation, mut source) = machine(5);
    let starts: Vec<i64> = simulation.report().joints.iter().map(|joint| joint.count).collect();
    let mut vcd = VcdWriter::new(Vec::new(), &simulation);
    let mut trace = TraceWriter::new(Vec::new(), &simulation);
    for _ in 0..2000 {
        simulation.tick(&mut source, &mut [&mut vcd, &mut trace]).unwrap();
    }
    let vcd = vcd.finish().unwrap();
    let trace = String::from_utf8(trace.finish().unwrap()).unwrap();
    let mut lines = trace.lines();
    assert_eq!(
        lines.next().unwrap(),
        "tick,time_s,line,axis.x.pos-cmd_mm,axis.y.pos-cmd_mm,axis.b.pos-cmd_deg,\
         joint.0.pos-cmd_mm,joint.0.pos-fb_mm,joint.1.pos-cmd_mm,joint.1.pos-fb_mm,\
         joint.2.pos-cmd_mm,joint.2.pos-fb_mm,joint.3.pos-cmd_mm,joint.3.pos-fb_mm,\
         joint.4.pos-cmd_deg,joint.4.pos-fb_deg"
    );
    let mut steps = VcdSteps::new(vcd.as_slice()).unwrap();
    let mut rows = 0;
    for (tick, line) in lines.enumerate() {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        assert_eq!(fields[0], tick as f64);
        assert_eq!(fields[1], tick as f64 / 1000.0);
        let counts = steps.counts_at(tick as u64 * SERVO_NS).unwrap();
        for (n, (count, start)) in counts.iter().zip(&starts).enumerate() {
            let scale = if n == 4 { 100.0 } else { 400.0 };
            let position = (start + count) as f64 / scale;
            assert!((position - fields[7 + 2 * n]).abs() < 1e-9, "tick {tick} joint {n}: {line}");
        }
        rows += 1;
    }
    assert_eq!(rows, 2001);
}

#[test]
fn edges_come_in_order_and_inside_their_period() {
    struct Order {
        last: u64,
        start: u64,
        step_edges: u64,
    }
    impl Observer for Order {
        fn edge(&mut self, edge: &Edge) {
            assert!(edge.time >= self.last && edge.time > self.start && edge.time <= self.start + 10_000);
            self.last = edge.time;
            self.step_edges += u64::from(edge.line == Line::Step && edge.level);
        }
        fn tick(&mut self, report: &TickReport<'_>) {
            self.start = report.tick * 10_000;
        }
    }
    let (mut simulation, mut source) = machine(5);
    let mut order = Order { last: 0, start: 0, step_edges: 0 };
    for _ in 0..3000 {
        simulation.tick(&mut source, &mut [&mut order]).unwrap();
    }
    let steps: u64 = simulation.statistics().iter().map(|joint| joint.steps).sum();
    assert_eq!(order.step_edges, steps);
}

#[test]
fn a_fork_goes_on_as_the_original() {
    let (mut simulation, mut source) = machine(3);
    for _ in 0..500 {
        simulation.tick(&mut source, &mut []).unwrap();
    }
    let mut fork = simulation.clone();
    let trace = |simulation: &mut Simulation| {
        let mut trace = TraceWriter::new(Vec::new(), simulation);
        for _ in 0..500 {
            simulation.tick(&mut Waves { joints: 3 }, &mut [&mut trace]).unwrap();
        }
        trace.finish().unwrap()
    };
    assert_eq!(trace(&mut simulation), trace(&mut fork));
    assert_eq!(simulation.statistics(), fork.statistics());
}

#[test]
fn what_no_machine_can_follow_is_refused_with_pin_and_tick() {
    let good = Setpoint::default();
    let refused = |change: fn(&mut Setpoint)| {
        let mut config = config(2, 100);
        for joint in &mut config.joints {
            joint.start = 0.0;
        }
        let mut simulation = Simulation::new(&config).unwrap();
        simulation.tick_to(&good, &mut []).unwrap();
        let mut bad = good;
        change(&mut bad);
        let before = simulation.feedback();
        let fault = simulation.tick_to(&bad, &mut []).unwrap_err();
        assert_eq!(simulation.feedback(), before);
        fault.to_string()
    };
    assert_eq!(refused(|s| s.joints[1] = f64::NAN), "joint.1.pos-cmd was given NaN at tick 2");
    assert_eq!(refused(|s| s.velocities[0] = f64::INFINITY), "joint.0.vel-cmd was given inf at tick 2");
    assert_eq!(refused(|s| s.pose.b = f64::NAN), "axis.b.pos-cmd was given NaN at tick 2");
    assert_eq!(
        refused(|s| s.joints[0] = 999.0),
        "joint.0.pos-cmd jumps by 399600 steps at tick 2; the pulse timing allows 251 in a servo period"
    );
    assert_eq!(
        refused(|s| s.joints[0] = 1000.5),
        "joint.0.pos-cmd is 1000.5 at tick 2, beyond the end of travel at 1000"
    );
    // an overshoot between the ends is the step generator's to refuse
    let mut simulation = Simulation::new(&config(1, 100)).unwrap();
    let mut setpoint = Setpoint::default();
    setpoint.velocities[0] = 1e6;
    assert!(matches!(simulation.tick_to(&setpoint, &mut []), Err(Fault::Steps { tick: 1, joint: 0, .. })));
}

#[test]
fn the_driver_sees_what_the_conditioner_was_not_told() {
    // configured faster than the data sheet allows: the driver must notice
    let mut config = config(1, 100);
    config.joints[0].timing.step_length = 1000;
    config.joints[0].timing.dir_setup = 100;
    let mut simulation = Simulation::new(&config).unwrap();
    for _ in 0..3000 {
        simulation.tick(&mut Waves { joints: 1 }, &mut []).unwrap();
    }
    let statistics = simulation.statistics()[0];
    assert_eq!(statistics.violations.step_length, statistics.steps);
}

#[test]
fn rotary_joints_are_rad_outside_and_degrees_at_the_pins() {
    let mut config = config(3, 100);
    config.joints[2].kind = JointKind::Rotary;
    config.joints[2].steps_per_unit = -80.0 * 180.0 / std::f64::consts::PI;
    for joint in &mut config.joints {
        joint.start = 0.25;
    }
    let mut simulation = Simulation::new(&config).unwrap();
    let kinematics = Cartesian::new(AxisSet::new(&[Axis::X, Axis::Y, Axis::B])).unwrap();
    let at = |simulation: &Simulation, name: &str| match simulation.hal().getp(name).unwrap() {
        Value::Float(value) => value,
        other => panic!("{name} is {other}"),
    };
    // at the start half a step off at most: 0.25 rad are 14.32°, 80 steps a degree
    assert!((at(&simulation, "joint.2.motor-pos-fb") - 14.3239).abs() < 0.5 / 80.0 + 1e-4);
    let mut setpoint = Setpoint::default();
    for tick in 0..=200 {
        // from 0.25 to 0.5 and to rest, quarter turn of a cosine
        let phase = f64::from(tick) * std::f64::consts::PI / 200.0;
        for n in 0..3 {
            setpoint.joints[n] = 0.25 + 0.125 * (1.0 - cos(phase));
            setpoint.velocities[n] = 0.125 * sin(phase) * std::f64::consts::PI / 0.2;
        }
        simulation.tick_to(&setpoint, &mut []).unwrap();
    }
    assert!((at(&simulation, "joint.2.pos-cmd") - 0.5_f64.to_degrees()).abs() < 1e-12);
    assert!((at(&simulation, "joint.2.motor-pos-fb") - 0.5_f64.to_degrees()).abs() <= 0.5 / 80.0);
    assert!((at(&simulation, "stepgen.2.position-scale") + 80.0).abs() < 1e-9);
    assert!(simulation.report().joints[2].count < -2000);
    let pose = simulation.feedback_pose(&kinematics).unwrap();
    assert!((pose.x - 0.5).abs() <= 0.5 / 400.0 + 1e-12 && (pose.y - 0.5).abs() <= 0.5 / 400.0 + 1e-12);
    assert!((pose.b - 0.5).abs() <= (0.5_f64 / 80.0).to_radians() + 1e-12, "{pose:?}");
    assert!((pose.b - simulation.feedback()[2]).abs() < 1e-12);
}

#[test]
fn a_machine_that_cannot_be_is_refused() {
    let refused = |change: fn(&mut SimulationConfig)| {
        let mut config = config(2, 100);
        change(&mut config);
        Simulation::new(&config).err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert_eq!(refused(|c| c.joints.clear()), "0 joints; a machine has 1 to 9");
    assert_eq!(refused(|c| c.timer_period_ns = 0), "the timer period is 0 ns");
    assert!(refused(|c| c.servo_period_ns = 0).contains("0 ns"));
    assert!(
        refused(|c| c.servo_period_ns = 1_000_050).contains("not a whole number of timer periods of 100 ns")
    );
    assert!(refused(|c| c.joints[1].steps_per_unit = 0.0).starts_with("joint 1"));
    assert!(refused(|c| c.joints[1].steps_per_unit = f64::NAN).starts_with("joint 1"));
    assert!(refused(|c| c.joints[0].start = f64::INFINITY).starts_with("joint 0"));
    assert!(refused(|c| c.joints[0].start = 1e9).starts_with("joint 0"));
    assert!(refused(|c| c.joints[0].timing.step_length = u64::MAX).contains("2^31 timer ticks"));
}
