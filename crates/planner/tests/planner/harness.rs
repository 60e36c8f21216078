//! Drives the planner tick by tick and looks at nothing but the positions that come out.

use crate::catalogue::Case;
use pkm_kins::{JointRange, Joints, Pose};
use pkm_planner::path::{Arc, FeedGroup, Geometry, Line, Vector, feed_group};
use pkm_planner::{Feed, JointLimits, Limits, Move, PathMode, Planner, PushError, Setpoint, Settings, State};

pub(crate) type TestPlanner = Planner<pkm_kins::machine::Mechanism, 6, 2048, 2048>;

/// The planner with its queues is larger than a test thread's stack.
pub(crate) fn with_stack(run: impl FnOnce() + Send) {
    std::thread::scope(|scope| {
        let run = std::thread::Builder::new().stack_size(64 << 20).spawn_scoped(scope, run);
        if let Err(panic) = run.expect("a thread").join() {
            std::panic::resume_unwind(panic);
        }
    });
}

/// The servo period, and how many setpoints are looked at in each.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Sampling {
    pub(crate) period_s: f64,
    pub(crate) substeps: u32,
}

impl Sampling {
    pub(crate) const SERVO: Self = Self { period_s: 1e-3, substeps: 1 };
    /// The same motion looked at ten times as often.
    pub(crate) const TENTH: Self = Self { period_s: 1e-3, substeps: 10 };
    /// Planned at ten times the rate.
    #[allow(dead_code, reason = "the bench compares one plan at two samplings only")]
    pub(crate) const FAST: Self = Self { period_s: 1e-4, substeps: 1 };

    pub(crate) fn step_s(self) -> f64 {
        self.period_s / f64::from(self.substeps)
    }

    /// Rounding of a second difference of positions of some 300 mm, in shares of the limits here.
    #[allow(dead_code, reason = "the bench prints and does not judge")]
    pub(crate) fn slack(self) -> f64 {
        if self.step_s() < 0.5e-3 { 1e-5 } else { 1e-6 }
    }
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
    /// Largest distance from the given geometry, mm (and rad).
    pub(crate) path_error_mm: f64,
    pub(crate) end: Vector,
}

/// First and second differences of joint positions, worst shares of the limits.
pub(crate) struct Differences<'a> {
    case: &'a Case,
    step_s: f64,
    rows: [Joints; 2],
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
}

impl<'a> Differences<'a> {
    /// At rest at `start`.
    pub(crate) fn new(case: &'a Case, step_s: f64, start: Joints) -> Self {
        Self { case, step_s, rows: [start; 2], velocity: 0.0, acceleration: 0.0 }
    }

    pub(crate) fn push(&mut self, now: Joints) {
        let [before, last] = self.rows;
        for (j, ((a, b), c)) in before.iter().zip(last).zip(now).enumerate() {
            if j >= self.case.velocity.len() {
                break;
            }
            assert!(c.is_finite(), "joint {j}: {c}");
            let velocity = (c - b) / self.step_s;
            let acceleration = (c - 2.0 * b + a) / (self.step_s * self.step_s);
            self.velocity = self.velocity.max(velocity.abs() / self.case.velocity[j]);
            self.acceleration = self.acceleration.max(acceleration.abs() / self.case.acceleration[j]);
        }
        self.rows = [last, now];
    }
}

pub(crate) fn random(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

pub(crate) fn limits<const R: usize>(case: &Case) -> Limits<R> {
    let joints = case.velocity.iter().zip(&case.acceleration).map(|(&max_velocity, &max_acceleration)| {
        JointLimits { range: JointRange { min: -1000.0, max: 1000.0 }, max_velocity, max_acceleration }
    });
    Limits::new(&joints.collect::<Vec<_>>(), &[], 0.0).unwrap()
}

pub(crate) fn start(case: &Case) -> Pose {
    Pose::from_array(case.moves[0].0.at(0.0).position)
}

pub(crate) fn to_move(case: &Case, (geometry, mode): (Geometry, PathMode)) -> Move {
    let (from, to) = (geometry.at(0.0).position, geometry.at(geometry.length()).position);
    let group = match geometry {
        Geometry::Line(_) => feed_group(&std::array::from_fn(|i| to[i] - from[i])),
        _ => FeedGroup::Xyz,
    };
    Move {
        geometry,
        feed: Feed { speed: case.feed_mm_s, group },
        rapid: case.feed_mm_s.is_infinite(),
        mode,
        span: Default::default(),
    }
}

/// A planner, what is fed to it and what is seen of it.
pub(crate) struct Rig<'a> {
    pub(crate) planner: Box<TestPlanner>,
    case: &'a Case,
    /// Moves pushed.
    pushed: usize,
    differences: Differences<'a>,
    path_error_mm: f64,
    pub(crate) ticks: u64,
}

impl<'a> Rig<'a> {
    pub(crate) fn new(case: &'a Case, sampling: Sampling) -> Self {
        let Sampling { period_s, substeps } = sampling;
        let settings = Settings { servo_period_s: period_s, substeps, settle_periods: 0 };
        let planner = TestPlanner::new(case.mechanism, limits(case), settings, start(case)).unwrap();
        let differences = Differences::new(case, sampling.step_s(), planner.setpoint().joints);
        Self { planner: Box::new(planner), case, pushed: 0, differences, path_error_mm: 0.0, ticks: 0 }
    }

    /// Pushes while there is room, or one move only.
    pub(crate) fn feed(&mut self, one: bool) {
        while let Some(piece) = self.case.moves.get(self.pushed) {
            match self.planner.push(to_move(self.case, *piece)) {
                Ok(_) => self.pushed += 1,
                Err(PushError::Full) => break,
                Err(PushError::Plan(e)) => panic!("{e:?}"),
            }
            if self.is_fed() {
                self.planner.finish();
            }
            if one {
                break;
            }
        }
    }

    pub(crate) fn is_fed(&self) -> bool {
        self.pushed == self.case.moves.len()
    }

    pub(crate) fn tick(&mut self) -> Setpoint {
        let setpoint = self.planner.tick().unwrap();
        self.ticks += 1;
        assert!(self.ticks < 1_000_000, "stalls: {setpoint:?}\n{:?}", self.planner);
        self.differences.push(setpoint.joints);
        let off = off_path(self.case, setpoint.motion as usize, &setpoint.pose.to_array());
        self.path_error_mm = self.path_error_mm.max(off);
        setpoint
    }

    /// Worst joint velocity and acceleration in shares of the limits, and distance from the path in mm, so far.
    pub(crate) fn worst(&self) -> [f64; 3] {
        [self.differences.velocity, self.differences.acceleration, self.path_error_mm]
    }
}

pub(crate) fn drive(case: &Case, sampling: Sampling, disturbance: Disturbance, one_per_tick: bool) -> Trace {
    let mut rig = Rig::new(case, sampling);
    let mut seed = 0x9e37_79b9_7f4a_7c15;
    let per_ms = (1e-3 / sampling.step_s()).round() as u64;
    loop {
        rig.feed(one_per_tick);
        match disturbance {
            Disturbance::None => {}
            Disturbance::RandomOverride => {
                if random(&mut seed).is_multiple_of(3 * per_ms) {
                    let factor = (random(&mut seed) % 121) as f64 / 100.0;
                    let planner = &mut rig.planner;
                    assert!(planner.set_feed_override(factor) && planner.set_rapid_override(factor));
                }
            }
            Disturbance::HoldThirds => rig.planner.hold(rig.ticks / per_ms % 300 >= 200),
        }
        if rig.tick().state == State::Idle && rig.is_fed() {
            break;
        }
    }
    let [velocity, acceleration, path_error_mm] = rig.worst();
    Trace {
        duration_s: (rig.ticks - 1) as f64 * sampling.step_s(),
        velocity,
        acceleration,
        path_error_mm,
        end: rig.planner.setpoint().pose.to_array(),
    }
}

/// Distance of a place on move `motion`, or on the blend after it, from what was given.
pub(crate) fn off_path(case: &Case, motion: usize, pose: &Vector) -> f64 {
    let near = case.moves.iter().skip(motion).take(2);
    near.map(|(geometry, _)| distance(geometry, pose)).fold(f64::INFINITY, f64::min)
}

fn distance(geometry: &Geometry, pose: &Vector) -> f64 {
    match geometry {
        Geometry::Line(line) => from_line(line, pose),
        Geometry::Arc(arc) => from_circle(arc, pose),
        _ => panic!("no such move in these tests"),
    }
}

fn norm(v: &Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn from_line(line: &Line, pose: &Vector) -> f64 {
    let off: Vector = std::array::from_fn(|i| pose[i] - line.start[i]);
    let dot: f64 = off.iter().zip(&line.direction).map(|(o, d)| o * d).sum();
    let s = (dot / norm(&line.direction) / norm(&line.direction)).clamp(0.0, line.length);
    norm(&std::array::from_fn(|i| off[i] - s * line.direction[i]))
}

fn from_circle(arc: &Arc, pose: &Vector) -> f64 {
    assert!(arc.radius_rate.abs() < 1e-9 && norm(&arc.rate) < 1e-9, "a helix or spiral");
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let from_centre = [0, 1, 2].map(|i| pose[i] - arc.base[i]);
    let (x, y) = (dot(from_centre, arc.u), dot(from_centre, arc.v));
    let height: Vector = std::array::from_fn(|i| match i {
        0..3 => from_centre[i] - x * arc.u[i] - y * arc.v[i],
        _ => pose[i] - arc.base[i],
    });
    norm(&std::array::from_fn(|i| if i == 0 { (x * x + y * y).sqrt() - arc.radius_mm } else { 0.0 }))
        .max(norm(&height))
}
