//! Drives the planner tick by tick and looks at nothing but the joint positions that come out.

use pkm_kins::machine::Mechanism;
use pkm_kins::{JointRange, Kinematics, Pose};
use pkm_planner::path::{FeedGroup, Geometry, Vector};
use pkm_planner::{Feed, JointLimits, Limits, Move, PathMode, Planner, PushError, Settings, State};

type TestPlanner = Planner<Mechanism, 6, 1024, 2048>;

pub(crate) struct Case {
    pub(crate) mechanism: Mechanism,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
    pub(crate) moves: Vec<(Geometry, PathMode)>,
    pub(crate) feed_mm_s: f64,
}

/// The planner with its queues is larger than a test thread's stack.
pub(crate) fn with_stack(run: impl FnOnce() + Send) {
    std::thread::scope(|scope| {
        let run = std::thread::Builder::new().stack_size(64 << 20).spawn_scoped(scope, run);
        if let Err(panic) = run.expect("a thread").join() {
            std::panic::resume_unwind(panic);
        }
    });
}

/// What happens during a run, by tick.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Disturbance {
    None,
    RandomOverride,
    HoldThirds,
}

pub(crate) struct Trace {
    pub(crate) duration_s: f64,
    /// Worst joint velocity and acceleration, in shares of the limit.
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) end: Vector,
}

pub(crate) fn random(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

pub(crate) fn drive(case: &Case, period_s: f64, disturbance: Disturbance, one_per_tick: bool) -> Trace {
    let joint_limits: Vec<JointLimits> = (0..case.velocity.len())
        .map(|i| JointLimits {
            range: JointRange { min: -1000.0, max: 1000.0 },
            max_velocity: case.velocity[i],
            max_acceleration: case.acceleration[i],
        })
        .collect();
    let start = Pose::from_array(case.moves[0].0.at(0.0).position);
    let limits = Limits::new(&joint_limits, &[], 0.0).unwrap();
    let settings = Settings { servo_period_s: period_s, substeps: 1, settle_periods: 0 };
    let mut planner = TestPlanner::new(case.mechanism, limits, settings, start).unwrap();
    let n = case.mechanism.joint_count();
    let mut rows = vec![planner.setpoint().joints; 3];
    let mut queue = case.moves.iter();
    let mut next = queue.next();
    let (mut ticks, mut velocity, mut acceleration) = (0u64, 0.0_f64, 0.0_f64);
    let mut seed = 0x9e37_79b9_7f4a_7c15;
    let per_ms = (1e-3 / period_s).round() as u64;
    loop {
        while let Some((geometry, mode)) = next {
            let feed = Feed { speed: case.feed_mm_s, group: FeedGroup::Xyz };
            let step = Move {
                geometry: *geometry,
                feed,
                rapid: case.feed_mm_s.is_infinite(),
                mode: *mode,
                span: Default::default(),
            };
            match planner.push(step) {
                Ok(_) => next = queue.next(),
                Err(PushError::Full) => break,
                Err(PushError::Plan(e)) => panic!("{e:?}"),
            }
            if next.is_none() {
                planner.finish();
            }
            if one_per_tick {
                break;
            }
        }
        match disturbance {
            Disturbance::None => {}
            Disturbance::RandomOverride => {
                if random(&mut seed).is_multiple_of(3 * per_ms) {
                    let factor = (random(&mut seed) % 121) as f64 / 100.0;
                    assert!(planner.set_feed_override(factor) && planner.set_rapid_override(factor));
                }
            }
            Disturbance::HoldThirds => planner.hold(ticks / per_ms % 300 >= 200),
        }
        let setpoint = planner.tick().unwrap();
        ticks += 1;
        rows.push(setpoint.joints);
        let k = rows.len();
        let (before, last, now) = (rows[k - 3], rows[k - 2], rows[k - 1]);
        for (j, ((a, b), c)) in before.iter().zip(last).zip(now).enumerate().take(n) {
            velocity = velocity.max(((c - b) / period_s).abs() / case.velocity[j]);
            acceleration =
                acceleration.max(((c - 2.0 * b + a) / (period_s * period_s)).abs() / case.acceleration[j]);
        }
        if setpoint.state == State::Idle && next.is_none() {
            break;
        }
        assert!(ticks < 1_000_000, "stalls: {setpoint:?}\n{planner:?}");
    }
    Trace {
        duration_s: (ticks - 1) as f64 * period_s,
        velocity,
        acceleration,
        end: planner.setpoint().pose.to_array(),
    }
}
