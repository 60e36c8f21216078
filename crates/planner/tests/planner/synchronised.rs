//! In step with the spindle: limits at every tick, the place against the turns, taps, aborts, spindles that do not run evenly.

use crate::catalogue::{Case, blend, hexapod, identity, moma, polyline, xyz};
use crate::harness::{Differences, limits, random};
use pkm_kins::{Axis, Kinematics, Pose};
use pkm_planner::path::{Geometry, Vector};
use pkm_planner::{
    PathMode, PlanErrorKind, Setpoint, SpindleReading, Stage, State, Synchronised, SynchronisedMove, Tap,
};

const PERIOD_S: f64 = 1e-3;
/// Setpoints looked at in a period.
const SUBSTEPS: u32 = 10;

type Chain = Synchronised<64>;

/// A spindle: ramps to its speed, wobbles, has an index.
struct Spindle {
    /// Turns since the start, turns/s.
    turns: f64,
    speed: f64,
    target: f64,
    rate: f64,
    /// Share and frequency of a variation of speed.
    wobble: (f64, f64),
    time_s: f64,
    zero: f64,
    index_enable: bool,
    asked: bool,
}

impl Spindle {
    fn new(speed: f64, rate: f64) -> Self {
        let (turns, zero, time_s) = (0.37, 0.0, 0.0);
        Self {
            turns,
            speed: 0.0,
            target: speed,
            rate,
            wobble: (0.0, 0.0),
            time_s,
            zero,
            index_enable: false,
            asked: false,
        }
    }

    fn reading(&self) -> SpindleReading {
        SpindleReading {
            turns: self.turns - self.zero,
            turns_s: self.speed,
            at_speed: (self.speed - self.target).abs() <= 1.1 * self.wobble.0 * self.target.abs(),
            index_enable: self.index_enable,
        }
    }

    /// A period with finely cut time, so that the mean of the speeds at its ends is not the truth.
    fn step(&mut self, factor: f64, wants_index: bool) {
        self.index_enable |= wants_index && !self.asked;
        self.asked = wants_index;
        for _ in 0..20 {
            let dt = PERIOD_S / 20.0;
            self.time_s += dt;
            let (share, hz) = self.wobble;
            let now = factor
                * self.target
                * (1.0 + share * libm::sin(2.0 * core::f64::consts::PI * hz * self.time_s));
            let change = (now - self.speed).clamp(-self.rate * dt, self.rate * dt);
            let before = self.turns;
            self.turns += (self.speed + 0.5 * change) * dt;
            self.speed += change;
            if self.index_enable && self.turns.floor() > before.floor() {
                (self.zero, self.index_enable) = (self.turns.floor(), false);
            }
        }
    }
}

/// What a chain did.
#[derive(Debug, Default)]
struct Seen {
    velocity: f64,
    acceleration: f64,
    off_path_mm: f64,
    /// Largest error while in step, and periods in step.
    error_mm: f64,
    in_step: u32,
    /// Share of the chain at which it was in step first.
    deepest: f64,
    ticks: u32,
    end: Vector,
}

fn case(mechanism: pkm_kins::machine::Mechanism, joints: usize, points: &[Vector], mode: PathMode) -> Case {
    Case {
        mechanism,
        velocity: vec![100.0; joints],
        acceleration: vec![1000.0; joints],
        moves: polyline(points, mode),
        feed_mm_s: f64::INFINITY,
    }
}

fn moves(case: &Case, per_turn: f64, turns_s: f64) -> Vec<SynchronisedMove> {
    let numbered = case.moves.iter().enumerate();
    let step = |(motion, (geometry, mode)): (usize, &(Geometry, PathMode))| SynchronisedMove {
        geometry: *geometry,
        per_turn,
        mode: *mode,
        turns_s,
        motion: motion as u32,
        span: Default::default(),
    };
    numbered.map(step).collect()
}

fn off(moves: &[SynchronisedMove], setpoint: &Setpoint) -> f64 {
    let pose = setpoint.pose.to_array();
    let distance = |step: &SynchronisedMove| {
        let Geometry::Line(line) = step.geometry else { unreachable!("lines only") };
        let d: [f64; 3] = core::array::from_fn(|i| pose[i] - line.start[i]);
        let along: f64 = (0..3).map(|i| d[i] * line.direction[i]).sum::<f64>().clamp(0.0, line.length);
        let square: f64 = (0..3).map(|i| d[i] - line.direction[i] * along).map(|d| d * d).sum();
        square.sqrt()
    };
    moves.iter().map(distance).fold(f64::INFINITY, f64::min)
}

fn drive(
    case: &Case,
    chain: &mut Chain,
    moves: &[SynchronisedMove],
    spindle: &mut Spindle,
    abort: Option<u32>,
) -> Seen {
    let start = Pose::from_array(moves[0].geometry.at(0.0).position);
    let joints = case.mechanism.inverse(&start).unwrap();
    let (mut at_period, mut between) = (
        Differences::new(case, PERIOD_S, joints),
        Differences::new(case, PERIOD_S / f64::from(SUBSTEPS), joints),
    );
    let mut seen = Seen { end: start.to_array(), ..Seen::default() };
    let mut setpoint = Setpoint {
        pose: start,
        joints,
        joint_velocity: Default::default(),
        motion: 0,
        s: 0.0,
        blending: false,
        feed_use: 0.0,
        span: Default::default(),
        state: State::Idle,
        starved: false,
    };
    let at_start = start.to_array();
    while chain.stage() != Stage::Over {
        seen.ticks += 1;
        assert!(seen.ticks < 200_000, "stalls: {:?} at {setpoint:?}", chain.stage());
        if abort == Some(seen.ticks) {
            chain.abort();
        }
        chain.tick(&spindle.reading());
        for k in 1..=SUBSTEPS {
            let share = f64::from(k) / f64::from(SUBSTEPS);
            setpoint = chain.setpoint(&case.mechanism, share, &setpoint).unwrap();
            between.push(setpoint.joints);
            seen.off_path_mm = seen.off_path_mm.max(off(moves, &setpoint));
        }
        at_period.push(setpoint.joints);
        spindle.step(chain.spindle_factor(), chain.wants_index());
        if let Some(error) = chain.error(spindle.reading().turns) {
            seen.error_mm = seen.error_mm.max(error.abs());
            seen.in_step += 1;
        }
        seen.end = setpoint.pose.to_array();
        let square: f64 = (0..3).map(|i| seen.end[i] - at_start[i]).map(|d| d * d).sum();
        seen.deepest = seen.deepest.max(square.sqrt());
    }
    between.push(setpoint.joints);
    at_period.push(setpoint.joints);
    seen.velocity = at_period.velocity.max(between.velocity);
    seen.acceleration = at_period.acceleration.max(between.acceleration);
    seen
}

fn chain(case: &Case, moves: &[SynchronisedMove], tap: Option<Tap>) -> Chain {
    let limits = limits::<6>(case);
    Chain::new(&limits, &case.mechanism, PERIOD_S, moves, tap).unwrap().expect("room")
}

fn holds(seen: &Seen, off_mm: f64, what: &str) {
    assert!(seen.velocity <= 1.0, "{what}: {seen:?}");
    assert!(seen.acceleration <= 1.0 + 1e-5, "{what}: {seen:?}");
    assert!(seen.off_path_mm <= off_mm + 1e-9, "{what}: {seen:?}");
}

#[test]
fn a_thread_begins_at_the_index_and_keeps_step_to_the_end() {
    let xyz_machine = || identity(&[Axis::X, Axis::Y, Axis::Z]);
    let along_z = [xyz(10.0, 0.0, 2.0), xyz(10.0, 0.0, -40.0)];
    let on_moma = [xyz(30.0, -260.0, 0.0), xyz(-20.0, -280.0, 0.0)];
    for (case, per_turn, turns_s) in [
        (case(xyz_machine(), 3, &along_z, PathMode::ExactPath), 1.5, 10.0),
        (case(xyz_machine(), 3, &along_z, PathMode::ExactPath), 0.4, 3.0),
        // Nearly as fast as the joints can.
        (case(xyz_machine(), 3, &along_z, PathMode::ExactPath), 4.0, 20.0),
        (case(moma(), 2, &on_moma, PathMode::ExactPath), 1.0, 12.0),
    ] {
        let moves = moves(&case, per_turn, turns_s);
        let mut chain = chain(&case, &moves, None);
        assert!(chain.fastest_turns_s() > turns_s, "{}", chain.fastest_turns_s());
        let mut spindle = Spindle::new(turns_s, 50.0);
        let seen = drive(&case, &mut chain, &moves, &mut spindle, None);
        println!("{per_turn} mm, {turns_s} turns/s: {seen:?}");
        holds(&seen, 0.0, "thread");
        assert!(seen.in_step > 100, "{seen:?}");
        assert!(seen.error_mm <= 1e-5, "{seen:?}");
        let end = moves[0].geometry.at(moves[0].geometry.length()).position;
        let miss = seen.end.iter().zip(end).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
        assert!(miss <= 1e-12, "{miss}");
    }
}

#[test]
fn a_tap_goes_in_and_out_with_the_spindle() {
    for (depth, turns_s, rate, retract_scale) in
        [(20.0, 10.0, 50.0, 1.0), (12.0, 15.0, 100.0, 2.0), (7.0, 20.0, 40.0, 1.0), (30.0, 5.0, 8.0, 1.3)]
    {
        let points = [xyz(0.0, 0.0, 5.0), xyz(0.0, 0.0, 5.0 - depth)];
        let case = case(identity(&[Axis::X, Axis::Y, Axis::Z]), 3, &points, PathMode::ExactPath);
        let moves = moves(&case, 1.25, turns_s);
        let mut chain = chain(&case, &moves, Some(Tap { retract_scale, spindle_rate: rate }));
        assert!(chain.fastest_rate() > rate && chain.fastest_turns_s() > turns_s);
        let mut spindle = Spindle::new(turns_s, rate);
        let seen = drive(&case, &mut chain, &moves, &mut spindle, None);
        println!("depth {depth}: {seen:?}");
        holds(&seen, 0.0, "tap");
        // Never deeper than programmed, and short of it by what the spindle turns in two periods at the most.
        assert!(seen.deepest <= depth && seen.deepest >= depth - 2.0 * 1.25 * turns_s * PERIOD_S, "{seen:?}");
        assert!(seen.error_mm <= 2e-3 && seen.in_step > 100, "{seen:?}");
        assert_eq!(seen.end, points[0]);
    }
}

/// A spindle that turns round more slowly than the machine file says: the tap goes with it, deeper than programmed.
#[test]
fn a_tap_follows_a_spindle_that_brakes_late() {
    let points = [xyz(0.0, 0.0, 0.0), xyz(0.0, 0.0, -10.0)];
    let case = case(identity(&[Axis::X, Axis::Y, Axis::Z]), 3, &points, PathMode::ExactPath);
    let moves = moves(&case, 1.0, 10.0);
    let mut chain = chain(&case, &moves, Some(Tap { retract_scale: 1.0, spindle_rate: 50.0 }));
    let mut spindle = Spindle::new(10.0, 25.0);
    let seen = drive(&case, &mut chain, &moves, &mut spindle, None);
    // 10²/50 turns in place of 10²/100
    assert!((seen.deepest - 11.0).abs() < 0.03, "{seen:?}");
    assert!(seen.error_mm <= 1e-3 && seen.velocity <= 1.0 && seen.acceleration <= 1.0 + 1e-5, "{seen:?}");
    assert_eq!(seen.end, points[0]);
}

#[test]
fn random_chains_keep_the_limits_with_any_spindle_and_when_aborted() {
    let scale: u64 = std::env::var("PKM_TEST_SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1);
    let mut aborted = 0;
    for seed in 1..=150 * scale {
        let mut state = 0x9e37_79b9_7f4a_7c15 ^ seed.wrapping_mul(0x2545_f491_4f6c_dd1d);
        let mut unit = || (random(&mut state) >> 11) as f64 / (1u64 << 53) as f64;
        let (mechanism, joints, middle, size) = match seed % 3 {
            0 => (identity(&[Axis::X, Axis::Y, Axis::Z]), 3, xyz(0.0, 0.0, 0.0), 30.0),
            1 => (moma(), 2, xyz(0.0, -265.0, 0.0), 30.0),
            _ => (hexapod(), 6, xyz(0.0, 0.0, 160.0), 20.0),
        };
        let count = 2 + (unit() * 6.0) as usize;
        let p_mm = if unit() < 0.4 { 0.0 } else { 0.2 * unit() };
        let mode = if p_mm > 0.0 { blend(p_mm) } else { PathMode::ExactPath };
        let points: Vec<Vector> = (0..count)
            .map(|_| {
                let z = if seed % 3 == 1 { 0.0 } else { size * (unit() - 0.5) };
                let off = xyz(size * (unit() - 0.5), size * (unit() - 0.5), z);
                core::array::from_fn(|i| middle[i] + off[i])
            })
            .collect();
        let case = case(mechanism, joints, &points, mode);
        let mut moves = moves(&case, 0.5, 1.0);
        // Travel per turn that changes from move to move: the tool needs a while for each change.
        let changes = unit() < 0.3;
        let per_turn = 0.2 + 2.0 * unit();
        for step in &mut moves {
            step.per_turn = if changes { 0.2 + 2.0 * unit() } else { per_turn };
        }
        let mut chain = chain(&case, &moves, None);
        // Now and then faster than the joints can: then the tool falls behind, and the limits still hold.
        let turns_s = chain.fastest_turns_s().min(100.0) * (0.1 + 1.2 * unit());
        let mut spindle = Spindle::new(turns_s, 20.0 + 80.0 * unit());
        if unit() < 0.5 {
            spindle.wobble = (0.05 * unit(), 10.0 * unit());
        }
        let abort = (unit() < 0.3).then(|| (4000.0 * unit()) as u32);
        let seen = drive(&case, &mut chain, &moves, &mut spindle, abort);
        holds(&seen, p_mm, &format!("seed {seed}"));
        let end = points[count - 1];
        let miss = (0..3).map(|i| (seen.end[i] - end[i]).abs()).fold(0.0, f64::max);
        match abort {
            Some(tick) if tick <= seen.ticks => aborted += 1,
            _ => assert!(miss <= 1e-9, "seed {seed}: {miss}"),
        }
        assert!(changes || seen.error_mm <= 0.01, "seed {seed}: {seen:?}");
    }
    assert!(aborted > 10 * scale, "{aborted}");
}

#[test]
fn a_wobbling_spindle_is_followed() {
    let points = [xyz(0.0, 0.0, 0.0), xyz(0.0, 0.0, -30.0)];
    let case = case(identity(&[Axis::X, Axis::Y, Axis::Z]), 3, &points, PathMode::ExactPath);
    let moves = moves(&case, 1.5, 10.0);
    let mut chain = chain(&case, &moves, None);
    let mut spindle = Spindle::new(10.0, 200.0);
    spindle.wobble = (0.05, 4.0);
    let seen = drive(&case, &mut chain, &moves, &mut spindle, None);
    println!("5 % at 4 Hz: {seen:?}");
    holds(&seen, 0.0, "wobble");
    // The wobble itself is 0.05 · 10 / (2π · 4) turns, 30 µm of travel; the rest is that the next period is foretold.
    assert!(seen.error_mm <= 1e-3 && seen.in_step > 1000, "{seen:?}");
}

#[test]
fn bad_input() {
    let points: Vec<Vector> = (0..80).map(|i| xyz(f64::from(i), f64::from(i % 2), 0.0)).collect();
    let case = case(identity(&[Axis::X, Axis::Y]), 2, &points, PathMode::ExactPath);
    let limits = limits::<6>(&case);
    let new = |moves: &[SynchronisedMove]| Chain::new(&limits, &case.mechanism, PERIOD_S, moves, None);
    assert!(new(&moves(&case, 1.0, 1.0)).unwrap().is_none(), "79 moves, room for 64");
    for per_turn in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = new(&moves(&case, per_turn, 1.0)[..1]).unwrap_err();
        assert_eq!(error.kind, PlanErrorKind::NoPitch, "{per_turn}");
    }
    assert_eq!(new(&[]).unwrap().unwrap().stage(), Stage::Over);
    // A spindle that never reaches its speed: the tool waits where it is.
    let mut chain = new(&moves(&case, 1.0, 1.0)[..3]).unwrap().unwrap();
    for _ in 0..1000 {
        chain.tick(&SpindleReading { turns_s: 3.0, ..SpindleReading::default() });
    }
    assert_eq!(chain.stage(), Stage::AtSpeed);
}
