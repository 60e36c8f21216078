//! Crossings against the path itself, sampled finely.

mod common;

use common::{Random, cases};
use pkm_stepgen::edges::{Crossings, EdgeError, TURN_TOLERANCE};
use pkm_stepgen::{Edge, Line, Period, PulseTimingNs, StepGenerator};

const TICKS: u64 = 1_000_000;

/// One period of a random motion: start, end, slopes in steps per period.
#[derive(Debug, Clone, Copy)]
struct Motion {
    p0: f64,
    p1: f64,
    m0: f64,
    m1: f64,
}

impl Motion {
    /// The cubic Hermite, in another form than the code under test (basis functions).
    fn at(&self, u: f64) -> f64 {
        let (w, d) = (1.0 - u, u);
        self.p0 * w * w * (1.0 + 2.0 * d) + self.p1 * d * d * (3.0 - 2.0 * d) + self.m0 * w * w * d
            - self.m1 * d * d * w
    }
}

/// Prefers trouble: exact half steps, equal ends, reversals, rest, a few last bits apart, many steps.
fn motion(random: &mut Random) -> Motion {
    let position = |random: &mut Random| {
        let whole = (random.below(2001) as f64) - 1000.0;
        match random.below(5) {
            0 => whole + 0.5,
            1 => whole,
            2 => whole + 0.5 + random.between(-1e-9, 1e-9),
            _ => whole + random.between(-0.5, 0.5),
        }
    };
    let p0 = position(random);
    let p1 = match random.below(6) {
        0 => p0,
        1 => p0 + random.between(-1e-8, 1e-8),
        2 => p0 + (random.below(7) as f64) - 3.0,
        3 => p0 + random.between(-40.0, 40.0),
        _ => p0 + random.between(-3.0, 3.0),
    };
    let slope = |random: &mut Random| match random.below(5) {
        0 => 0.0,
        1 => p1 - p0,
        2 => (p1 - p0) * random.between(0.5, 1.5),
        3 => random.between(-1e-6, 1e-6),
        _ => random.between(-12.0, 12.0),
    };
    let (m0, m1) = (slope(random), slope(random));
    Motion { p0, p1, m0, m1 }
}

/// Count at the start, crossings (time, forward), count at the end.
type Found = (i64, Vec<(u64, bool)>, i64);

/// The crossings of one period that begins with slope m0.
fn crossings(motion: &Motion, period: &Period, max: u64) -> Result<Found, EdgeError> {
    // a slope at the start is reached by a period before, whose edges do not matter
    let seconds = period.seconds();
    let mut joint = Crossings::new(motion.p0)?;
    let before = Period::new(0, TICKS, 1).unwrap();
    joint.advance(motion.p0, motion.m0 / seconds, &before, u64::MAX >> 20, &mut |_, _| {})?;
    let start = joint.count();
    let mut found = Vec::new();
    joint.advance(motion.p1, motion.m1 / seconds, period, max, &mut |time, forward| {
        found.push((time, forward));
    })?;
    Ok((start, found, joint.count()))
}

#[test]
fn the_count_follows_the_path_at_all_times() {
    for seed in 0..cases(20_000) {
        let mut random = Random::new(seed);
        let motion = motion(&mut random);
        let timer = [1, 100, 1000][random.below(3) as usize];
        let start = TICKS / timer;
        let period = Period::new(start, TICKS, timer).unwrap();
        let ticks = f64::from(period.ticks());
        let (mut count, found, end) = crossings(&motion, &period, 1000).unwrap();
        let context = || format!("seed {seed}: {motion:?} timer {timer}");

        assert!((count as f64 - motion.p0).abs() <= 0.5 + 1e-8, "{}", context());
        assert!((end as f64 - motion.p1).abs() <= 0.5 + 1e-8, "{}", context());
        let mut last = period.start() + 1;
        let (samples, mut next) = (400, 0);
        // largest slope: bounds what happens between a crossing and its rounded time
        let slope = (0..=100)
            .map(|i| f64::from(i) / 100.0)
            .map(|u| (motion.at(u + 1e-6) - motion.at(u - 1e-6)).abs() / 2e-6)
            .fold(0.0, f64::max);
        // rounded to the nearest tick, but never to the start itself
        let slack = TURN_TOLERANCE + 1e-6 + slope * 1.02 / ticks;
        for i in 0..=samples {
            let u = f64::from(i) / f64::from(samples);
            let now = period.start() as f64 + u * ticks;
            while let Some(&(time, forward)) = found.get(next).filter(|(time, _)| *time as f64 <= now) {
                assert!(time >= last && time <= period.end(), "{}", context());
                // the half-step position between the two counts is where the path is now
                let level = count as f64 + if forward { 0.5 } else { -0.5 };
                let here = motion.at((time - period.start()) as f64 / ticks);
                assert!((here - level).abs() <= slack, "{} at {time}: {here} {level}", context());
                count += if forward { 1 } else { -1 };
                (last, next) = (time, next + 1);
            }
            let error = (count as f64 - motion.at(u)).abs();
            assert!(error <= 0.5 + slack, "{} u {u}: {error}", context());
        }
        assert_eq!((next, count), (found.len(), end), "{}", context());
    }
}

#[test]
fn no_step_pair_is_made_for_a_last_bit() {
    // resting on, and moving along, exact half steps with noise in the last bits
    let period = Period::new(0, TICKS, 1).unwrap();
    for half in [0.5, -0.5, 1234.5, -80_000.5] {
        let mut joint = Crossings::new(half).unwrap();
        let mut random = Random::new(1);
        let mut period = period;
        for _ in 0..1000 {
            let noise = random.between(-1e-9, 1e-9);
            joint
                .advance(half + noise, noise * 1e3, &period, 10, &mut |_, _| panic!("a step at {half}"))
                .unwrap();
            assert_eq!(joint.count(), (half + 0.5) as i64);
            period = period.next();
        }
    }
}

#[test]
fn a_turn_just_beyond_a_half_step_makes_no_pair() {
    // from 0.4 up by a parabola and back; the top at 0.4 + m/4
    let period = Period::new(TICKS, TICKS, 1).unwrap();
    for (top, steps) in [(0.495, 0), (0.505, 0), (0.52, 2), (1.505, 2), (1.52, 4)] {
        let m0 = 4.0 * (top - 0.4);
        let motion = Motion { p0: 0.4, p1: 0.4, m0, m1: -m0 };
        let (_, found, _) = crossings(&motion, &period, 10).unwrap();
        assert_eq!(found.len(), steps, "top {top}");
    }
    // beyond by little and still beyond at the end: the step comes at the turning point
    let motion = Motion { p0: 0.4, p1: 0.501, m0: 0.4, m1: -0.02 };
    let (_, found, end) = crossings(&motion, &period, 10).unwrap();
    assert_eq!((found.len(), end), (1, 1));
    // 0.4 − 0.954 u + 0.534 u² = 0 at u = 0.6723
    assert!(found[0].0.abs_diff(TICKS + 672_300) < 100, "{found:?}");
}

#[test]
fn uniform_motion_is_evenly_spaced() {
    let period = Period::new(0, TICKS, 1).unwrap();
    let mut joint = Crossings::new(0.0).unwrap();
    joint.advance(0.0, 40_000.0, &period, 100, &mut |_, _| {}).unwrap();
    let mut times = Vec::new();
    joint.advance(40.0, 40_000.0, &period, 100, &mut |time, _| times.push(time)).unwrap();
    assert_eq!(times.len(), 40);
    assert_eq!(times[0], 12_500);
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 25_000), "{times:?}");
}

#[test]
fn a_parabola_crosses_where_it_must() {
    // p = 50 u²: from rest; crossing of k + ½ at u = √((k + ½) / 50), to the nearest tick
    let period = Period::new(0, TICKS, 1).unwrap();
    let mut joint = Crossings::new(0.0).unwrap();
    let mut times = Vec::new();
    joint.advance(50.0, 100_000.0, &period, 100, &mut |time, _| times.push(time)).unwrap();
    assert_eq!(times.len(), 50);
    for (k, time) in times.iter().enumerate() {
        let exact = ((k as f64 + 0.5) / 50.0).sqrt() * TICKS as f64;
        assert!((*time as f64 - exact).abs() <= 0.52, "{k}: {time} {exact}");
    }
}

#[test]
fn nonsense_is_refused_and_changes_nothing() {
    let period = Period::new(0, TICKS, 1).unwrap();
    let timing = PulseTimingNs { step_length: 2000, step_space: 2000, dir_setup: 0, dir_hold: 0 };
    let joint = StepGenerator::new(0, 400.0, timing.ticks(1).unwrap(), 1.0).unwrap();
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1e12, 1000.0, f64::MAX];
    for value in bad {
        for (position, velocity) in [(value, 0.0), (1.0, value * 1e6), (value, value)] {
            let mut tried = joint.clone();
            let result = tried.advance(position, velocity, &period, |_| panic!("an edge"));
            assert!(result.is_err(), "{position} {velocity}");
            assert_eq!(tried, joint);
        }
    }
    assert_eq!(
        joint.clone().advance(2.0, 0.0, &period, |_| {}),
        Err(EdgeError::TooFast { steps: 400, max: 251 })
    );
    // the smallest numbers are no trouble
    for value in [f64::MIN_POSITIVE, 5e-324, -5e-324, -0.0] {
        let mut tried = joint.clone();
        tried.advance(1.0 + value, value, &period, |_| panic!("an edge")).unwrap();
    }
}

#[test]
fn every_input_ends() {
    // any bit patterns at all: an answer, at most `max` crossings, all inside the period
    for seed in 0..cases(20_000) {
        let mut random = Random::new(seed);
        let mut number = || {
            if random.below(3) == 0 { f64::from_bits(random.bits()) } else { random.between(-300.0, 300.0) }
        };
        let (p0, p1, v0, v1) = (number(), number(), number() * 1e3, number() * 1e3);
        let Ok(mut joint) = Crossings::new(p0) else { continue };
        let period = Period::new(7, TICKS, 1).unwrap();
        let mut found = 0;
        for (position, velocity) in [(p0, v0), (p1, v1), (p0, v0)] {
            let before = joint;
            let mut net = 0;
            let result = joint.advance(position, velocity, &period, 200, &mut |time, forward| {
                assert!(time > 7 && time <= 7 + TICKS, "seed {seed}");
                net += if forward { 1 } else { -1 };
                found += 1;
            });
            match result {
                Ok(()) => assert_eq!(joint.count() - before.count(), net, "seed {seed}"),
                Err(_) => assert_eq!((joint.count(), net), (before.count(), 0), "seed {seed}"),
            }
        }
        assert!(found <= 600, "seed {seed}");
    }
}

#[test]
fn regress_the_edges_are_the_same_everywhere() {
    // FNV-1a over a long random stream; the same number on every platform, debug or release
    let timing = PulseTimingNs { step_length: 2000, step_space: 2000, dir_setup: 5000, dir_hold: 5000 };
    let mut joint = StepGenerator::new(3, 400.0, timing.ticks(100).unwrap(), 0.0).unwrap();
    let mut random = Random::new(42);
    let (mut period, mut position, mut velocity) = (Period::new(0, TICKS, 100).unwrap(), 0.0, 0.0);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for _ in 0..20_000 {
        let next = velocity * 0.95 + random.between(-8.0, 8.0);
        position += 0.5 * (velocity + next) * 1e-3;
        velocity = next;
        joint
            .advance(position, velocity, &period, |edge: Edge| {
                let line = u64::from(edge.line == Line::Step);
                for byte in (edge.time * 4 + line * 2 + u64::from(edge.level)).to_le_bytes() {
                    hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
                }
            })
            .unwrap();
        period = period.next();
    }
    assert!(joint.report().steps > 20_000 && joint.report().reversals > 100, "{:?}", joint.report());
    assert_eq!(hash, 0x7ca1_c86c_ce98_cf9d, "{hash:#x}");
}
