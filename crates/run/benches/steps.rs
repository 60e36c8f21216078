//! `cargo bench --package pkm-run --bench steps`: millions of steps per second of one thread, from moves to edges:
//! planning, execution, inverse kinematics and step generation together.
//!
//! The motion is the one that Klipper's `itersolve` and `stepcompress` were measured on: a circle of radius 30 mm in
//! chords of 1 mm, 100 mm/s, 20 turns, every joint stepped. Twenty runs together.
#![allow(clippy::print_stdout, clippy::disallowed_methods)]

use pkm_kins::{
    Axis, AxisSet, Cartesian, JointRange, Kinematics, LinearDelta, LinearDeltaParameters, Moma,
    MomaConfiguration, Pose, maths,
};
use pkm_planner::path::{FeedGroup, Geometry, Line, Tolerance, Vector};
use pkm_planner::{Feed, JointLimits, Limits, Move, PathMode, Planner, PushError, Settings};
use pkm_stepgen::{Period, PulseTimingNs, StepGenerator};
use std::hint::black_box;
use std::time::Instant;

const RADIUS_MM: f64 = 30.0;
const TURNS: usize = 20;
const SPEED_MM_S: f64 = 100.0;

fn chords(centre: Pose) -> Vec<Move> {
    let count = maths::round(2.0 * maths::PI * RADIUS_MM) as usize;
    let point = |k: usize| -> Vector {
        let (cos, sin) = maths::cos_sin_deg(360.0 * (k % count) as f64 / count as f64);
        Pose { x: centre.x + RADIUS_MM * cos, y: centre.y + RADIUS_MM * sin, ..centre }.to_array()
    };
    let blend = Tolerance { length_mm: 0.01, angle_rad: 1e-4 };
    (0..count * TURNS)
        .filter_map(|k| {
            Some(Move {
                geometry: Geometry::Line(Line::new(point(k), point(k + 1))?),
                feed: Feed { speed: SPEED_MM_S, group: FeedGroup::Xyz },
                rapid: false,
                mode: PathMode::Blend(blend),
                span: pkm_canon::Span::default(),
            })
        })
        .collect()
}

/// Seconds this thread has computed (Linux), so that the machine's other work does not count; else of the clock.
fn seconds() -> f64 {
    static CLOCK: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split(' ').next()?.parse::<f64>().ok())
        .map_or_else(|| CLOCK.get_or_init(Instant::now).elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Seconds of computing, seconds of motion, steps.
fn drive<K: Kinematics>(mechanism: K, joints: usize, centre: Pose, steps_per_mm: f64) -> (f64, f64, u64) {
    let moves = chords(centre);
    let start = Pose { x: centre.x + RADIUS_MM, ..centre };
    let limit = JointLimits {
        range: JointRange { min: -1e4, max: 1e4 },
        max_velocity: 1000.0,
        max_acceleration: 20_000.0,
    };
    let limits = Limits::<4>::new(&vec![limit; joints], &[], 1e-6).expect("limits");
    let settings = Settings { servo_period_s: 1e-3, substeps: 1, settle_periods: 0 };
    let stands = mechanism.inverse(&start).expect("within reach");
    let mut planner =
        Box::new(Planner::<K, 4, 256, 1024>::new(mechanism, limits, settings, start).expect("a planner"));
    let timing = PulseTimingNs { step_length: 500, step_space: 500, dir_setup: 500, dir_hold: 500 };
    let timing = timing.ticks(1).expect("timing");
    let mut generators: Vec<StepGenerator> = (0..joints)
        .map(|n| StepGenerator::new(n as u8, steps_per_mm, timing, stands[n]).expect("a generator"))
        .collect();
    let mut period = Period::new(0, 1_000_000, 1).expect("a period");
    let (mut next, mut ticks) = (0, 0);
    let begin = seconds();
    loop {
        while planner.has_room() && next < moves.len() {
            match planner.push(moves[next]) {
                Ok(_) => next += 1,
                Err(PushError::Full) => break,
                Err(PushError::Plan(error)) => panic!("{error:?}"),
            }
            if next == moves.len() {
                planner.finish();
            }
        }
        if next == moves.len() && planner.is_idle() {
            break;
        }
        let setpoint = planner.tick().expect("a setpoint");
        for (n, generator) in generators.iter_mut().enumerate() {
            generator
                .advance(setpoint.joints[n], setpoint.joint_velocity[n], &period, |edge| {
                    black_box(edge);
                })
                .expect("edges");
        }
        period = period.next();
        ticks += 1;
    }
    let steps = generators.iter().map(|generator| generator.report().steps).sum();
    (seconds() - begin, f64::from(ticks) * 1e-3, steps)
}

fn row<K: Kinematics + Copy>(name: &str, mechanism: K, joints: usize, centre: Pose) {
    print!("{name:<14}");
    for steps_per_mm in [80.0, 400.0, 2000.0] {
        // Many runs together: the system counts a thread's time in coarse pieces.
        let (mut seconds, mut motion, mut steps) = (0.0, 0.0, 0);
        for _ in 0..20 {
            let run = drive(mechanism, joints, centre, steps_per_mm);
            (seconds, motion, steps) = (seconds + run.0, motion + run.1, steps + run.2);
        }
        print!("{:>8.1} {:>9.0} x", steps as f64 / seconds / 1e6, motion / seconds);
    }
    println!();
}

fn main() {
    println!("Msteps/s and times real time, at    80 steps/mm           400          2000");
    let xy = AxisSet::new(&[Axis::X, Axis::Y]);
    row("cartesian", Cartesian::new(xy).expect("axes"), 2, Pose::ZERO);
    let delta = LinearDeltaParameters { joint_radius_mm: 140.0, joint_length_mm: 270.0 };
    row("linear delta", LinearDelta::new(&delta).expect("geometry"), 3, Pose::ZERO);
    let moma = Moma::new(&MomaConfiguration::A.into()).expect("geometry");
    row("MOMA", moma, 2, Pose { y: -250.0, ..Pose::ZERO });
}
