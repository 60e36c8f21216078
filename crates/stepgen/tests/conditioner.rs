//! The conditioner's edges judged by a checker of its own.

mod common;

use common::{Random, cases};
use pkm_stepgen::{Conditioner, Edge, Line, Period, PulseTimingNs, StepGenerator, StepType};

/// Judges one joint's edges in ticks; shares nothing with the conditioner.
fn judge(edges: &[Edge], timing: &PulseTimingNs) -> Result<i64, String> {
    let (mut count, mut forward, mut high) = (0_i64, false, false);
    let (mut rise, mut fall, mut turn) = (None::<u64>, None::<u64>, None::<u64>);
    let mut last = 0;
    for edge in edges {
        let since = |time: Option<u64>| time.map_or(u64::MAX, |time| edge.time - time);
        if edge.time < last {
            return Err(format!("time runs backwards at {edge:?}"));
        }
        last = edge.time;
        match (edge.line, edge.level) {
            (Line::Step, true) => {
                if high || since(fall) < timing.step_space || since(turn) < timing.dir_setup {
                    return Err(format!("step space or setup at {edge:?}"));
                }
                count += if forward { 1 } else { -1 };
                (rise, high) = (Some(edge.time), true);
            }
            (Line::Step, false) => {
                if !high || since(rise) != timing.step_length {
                    return Err(format!("step length at {edge:?}"));
                }
                (fall, high) = (Some(edge.time), false);
            }
            (Line::Up | Line::Down | Line::Phase(_), _) => {
                return Err(format!("another step type: {edge:?}"));
            }
            (Line::Dir, level) => {
                if high || level == forward || since(fall) < timing.dir_hold {
                    return Err(format!("direction hold at {edge:?}"));
                }
                (turn, forward) = (Some(edge.time), level);
            }
        }
    }
    Ok(count)
}

fn timing(random: &mut Random) -> PulseTimingNs {
    let mut time = |least| least + random.below(20_000);
    PulseTimingNs { step_length: time(1), step_space: time(1), dir_setup: time(0), dir_hold: time(0) }
}

#[test]
fn any_wanted_steps_become_legal_ones_and_none_is_lost() {
    for seed in 0..cases(2000) {
        let mut random = Random::new(seed);
        let timing = timing(&mut random);
        let mut conditioner = Conditioner::new(0, timing.ticks(1).unwrap());
        let (mut edges, mut wanted) = (Vec::new(), Vec::new());
        let (mut time, mut net) = (1, 0);
        for _ in 0..200 {
            time += random.below(60_000);
            let forward = random.below(4) > 0;
            net += if forward { 1 } else { -1 };
            wanted.push(time);
            conditioner
                .step(time, forward, time - random.below(time.min(40_000)), &mut |edge| edges.push(edge));
        }
        assert_eq!(judge(&edges, &timing), Ok(net), "seed {seed}");
        let rises: Vec<u64> =
            edges.iter().filter(|edge| edge.line == Line::Step && edge.level).map(|edge| edge.time).collect();
        assert_eq!(rises.len(), wanted.len(), "seed {seed}");
        let delays =
            rises.iter().zip(&wanted).map(|(rise, wanted)| rise.checked_sub(*wanted).expect("early"));
        assert_eq!(delays.clone().max(), Some(conditioner.report().max_delay), "seed {seed}");
        assert_eq!(delays.filter(|delay| *delay > 0).count() as u64, conditioner.report().delayed_steps);
    }
}

#[test]
fn the_judge_can_object() {
    let timing = PulseTimingNs { step_length: 10, step_space: 10, dir_setup: 20, dir_hold: 30 };
    let edge = |time, line, level| Edge { time, joint: 0, line, level };
    let good = [
        edge(100, Line::Dir, true),
        edge(120, Line::Step, true),
        edge(130, Line::Step, false),
        edge(140, Line::Step, true),
        edge(150, Line::Step, false),
        edge(180, Line::Dir, false),
    ];
    assert_eq!(judge(&good, &timing), Ok(2));
    for (place, time) in [(1, 119), (2, 129), (3, 139), (5, 179)] {
        let mut bad = good;
        bad[place].time = time;
        assert!(judge(&bad, &timing).is_err(), "edge {place} at {time}");
    }
}

#[test]
fn a_reversal_is_announced_as_early_as_the_hold_allows() {
    let timing = PulseTimingNs { step_length: 10, step_space: 10, dir_setup: 20, dir_hold: 30 };
    let mut conditioner = Conditioner::new(2, timing.ticks(1).unwrap());
    let mut edges = Vec::new();
    conditioner.step(1000, false, 1, &mut |edge| edges.push(edge));
    conditioner.step(1800, true, 1, &mut |edge| edges.push(edge));
    conditioner.step(5000, false, 4001, &mut |edge| edges.push(edge));
    let edge = |time, line, level| Edge { time, joint: 2, line, level };
    let expected = [
        edge(1000, Line::Step, true),
        edge(1010, Line::Step, false),
        edge(1040, Line::Dir, true), // pulse end + hold
        edge(1800, Line::Step, true),
        edge(1810, Line::Step, false),
        edge(4001, Line::Dir, false), // not before the period that needs it
        edge(5000, Line::Step, true),
        edge(5010, Line::Step, false),
    ];
    assert_eq!(edges, expected);
    assert_eq!(conditioner.report().max_delay, 0);
}

#[test]
fn a_motion_in_its_limits_is_legal_and_hardly_delayed() {
    for seed in 0..cases(200) {
        let mut random = Random::new(seed);
        let timing = PulseTimingNs { step_length: 2500, step_space: 2500, dir_setup: 5000, dir_hold: 5000 };
        let mut joint = StepGenerator::new(0, 400.0, timing.ticks(1).unwrap(), 0.0).unwrap();
        let mut period = Period::new(0, 1_000_000, 1).unwrap();
        let (mut position, mut velocity) = (0.0_f64, 0.0_f64);
        let mut edges = Vec::new();
        for tick in 0..1000 {
            // accelerations to 1000 mm/s², often about rest
            let next = (velocity + random.between(-1.0, 1.0)).clamp(-100.0, 100.0);
            position += 0.5 * (velocity + next) * 1e-3;
            velocity = next;
            joint.advance(position, velocity, &period, |edge| edges.push(edge)).unwrap();
            assert!(joint.offset(joint.count()).abs() <= 0.5, "seed {seed} tick {tick}");
            period = period.next();
        }
        assert_eq!(judge(&edges, &timing), Ok(joint.count()), "seed {seed}");
        assert!(joint.report().max_delay <= 15_000, "seed {seed}: {:?}", joint.report());
    }
}

#[test]
fn a_backlog_ends_in_an_error() {
    // the fastest legal rate, and a reversal every period with a setup of most of the period
    let timing = PulseTimingNs { step_length: 1000, step_space: 1000, dir_setup: 900_000, dir_hold: 0 };
    let mut joint = StepGenerator::new(0, 1.0, timing.ticks(1).unwrap(), 0.0).unwrap();
    let mut period = Period::new(0, 1_000_000, 1).unwrap();
    let mut result = Ok(());
    for tick in 0..100 {
        let position = if tick % 2 == 0 { 400.0 } else { 0.0 };
        result = joint.advance(position, 0.0, &period, |_| {});
        if result.is_err() {
            break;
        }
        period = period.next();
    }
    assert!(matches!(result, Err(pkm_stepgen::EdgeError::Late { .. })), "{result:?}");
}

/// Random steps through a conditioner of some type: its edges, and steps forward less steps back.
fn random_steps(seed: u64, timing: &PulseTimingNs, step_type: StepType) -> (Vec<Edge>, i64) {
    let mut random = Random::new(seed);
    let mut conditioner = Conditioner::with_type(0, timing.ticks(1).unwrap(), step_type);
    let (mut edges, mut time, mut net) = (Vec::new(), 1, 0);
    for _ in 0..300 {
        time += random.below(50_000);
        let forward = random.below(4) > 0;
        net += if forward { 1 } else { -1 };
        conditioner.step(time, forward, time - random.below(time.min(40_000)), &mut |edge| edges.push(edge));
    }
    (edges, net)
}

#[test]
fn up_and_down_pulses_count_back() {
    for seed in 0..cases(200) {
        let timing = timing(&mut Random::new(seed + 1000));
        let (edges, net) = random_steps(seed, &timing, StepType::UpDown);
        let (mut count, mut last_fall, mut last_line) = (0, None::<u64>, None);
        for pair in edges.chunks(2) {
            let [rise, fall] = pair else { panic!("seed {seed}: half a pulse") };
            assert!(rise.line == fall.line && rise.level && !fall.level, "seed {seed}");
            assert_eq!(fall.time - rise.time, timing.step_length, "seed {seed}");
            let gap = last_fall.map_or(u64::MAX, |last| rise.time - last);
            assert!(gap >= timing.step_space, "seed {seed}");
            if last_line.is_some_and(|line| line != rise.line) {
                assert!(gap >= timing.dir_hold + timing.dir_setup, "seed {seed}");
            }
            count += match rise.line {
                Line::Up => 1,
                Line::Down => -1,
                _ => panic!("seed {seed}: {rise:?}"),
            };
            (last_fall, last_line) = (Some(fall.time), Some(rise.line));
        }
        assert_eq!(count, net, "seed {seed}");
    }
}

#[test]
fn phases_follow_their_tables_and_count_back() {
    for number in 2..=14 {
        let step_type = StepType::from_number(number).unwrap();
        let StepType::Phases(phases) = step_type else { panic!() };
        for seed in 0..cases(20) {
            let timing = timing(&mut Random::new(seed + 2000));
            let (edges, net) = random_steps(seed, &timing, step_type);
            let (mut count, mut levels, mut last) = (0_i64, 0_u8, None::<u64>);
            let mut rest = edges.as_slice();
            while let Some(first) = rest.first() {
                let changes = rest.iter().take_while(|edge| edge.time == first.time).count();
                for edge in &rest[..changes] {
                    let Line::Phase(line) = edge.line else { panic!("{edge:?}") };
                    assert_ne!(levels >> line & 1 == 1, edge.level, "no change: {edge:?}");
                    levels ^= 1 << line;
                }
                rest = &rest[changes..];
                assert!(last.is_none_or(|last| first.time >= last + timing.step_length), "type {number}");
                last = Some(first.time);
                let step = [1, -1].into_iter().find(|step| phases.state(count + step) == levels);
                count += step.unwrap_or_else(|| panic!("type {number}: {levels:b} after step {count}"));
            }
            assert_eq!(count, net, "type {number} seed {seed}");
        }
    }
}
