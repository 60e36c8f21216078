//! Single block, a queue that runs dry, and what a smoother behind the planner has to wait for.

use crate::catalogue::{Case, all, flower_on_moma, identity, on_moma, polyline, xyz};
use crate::harness::{Differences, Rig, Sampling, TestPlanner, limits, random, start, to_move, with_stack};
use pkm_canon::Span;
use pkm_kins::Axis;
use pkm_planner::path::Vector;
use pkm_planner::{Move, PathMode, Planner, PushError, Setpoint, Settings, Smoother, State};

/// The case's moves, each a block of its own (lines 1, 2, ...).
fn blocks(case: &Case) -> Vec<Move> {
    let numbered =
        |(line, &piece): (u32, _)| Move { span: Span { line, ..Span::default() }, ..to_move(case, piece) };
    (1..).zip(&case.moves).map(numbered).collect()
}

fn planner(case: &Case, settle_periods: u32) -> Box<TestPlanner> {
    let settings = Settings { servo_period_s: 1e-3, substeps: 1, settle_periods };
    Box::new(TestPlanner::new(case.mechanism, limits(case), settings, start(case)).unwrap())
}

fn feed(planner: &mut TestPlanner, moves: &[Move], next: &mut usize) {
    while let Some(&step) = moves.get(*next) {
        match planner.push(step) {
            Ok(_) => *next += 1,
            Err(PushError::Full) => return,
            Err(PushError::Plan(error)) => panic!("{error:?}"),
        }
        if *next == moves.len() {
            planner.finish();
        }
    }
}

fn paths() -> Vec<(&'static str, Case)> {
    let mut paths: Vec<_> = all()
        .into_iter()
        .filter(|known| ["P05", "P09", "P11", "P16"].contains(&known.id))
        .map(|known| (known.id, known.case))
        .collect();
    paths.push(("flower", flower_on_moma(400)));
    paths
}

/// Distance of a place from the end of a move (its blend included).
fn from_end(case: &Case, motion: u32, pose: &Vector) -> f64 {
    let (geometry, _) = case.moves[motion as usize];
    let end = geometry.at(geometry.length()).position;
    end.iter().zip(pose).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[test]
fn single_block_from_the_start_rests_at_the_end_of_every_block() {
    with_stack(|| {
        for (id, case) in &paths() {
            let moves = blocks(case);
            let mut planner = planner(case, 0);
            planner.set_single_block(true);
            let mut seen = Differences::new(case, 1e-3, planner.setpoint().joints);
            let (mut next, mut steps, mut waited) = (0, 0, 0);
            let end = loop {
                feed(&mut planner, &moves, &mut next);
                let setpoint = planner.tick().unwrap();
                seen.push(setpoint.joints);
                match setpoint.state {
                    State::BlockEnd => {
                        assert_eq!(setpoint.joint_velocity, [0.0; 9], "{id}");
                        waited += 1;
                        // Waits as long as it is left alone.
                        if waited == 5 {
                            // The first wait is before the first block; after that, one block a step.
                            // It stands at the start of what the next block leaves of itself.
                            assert_eq!(setpoint.motion, steps, "{id}: {setpoint:?}");
                            assert!(planner.step(), "{id}");
                            assert!(!planner.step(), "{id}: one step, one block");
                            (waited, steps) = (0, steps + 1);
                        }
                    }
                    State::Idle if next == moves.len() => break setpoint,
                    _ => {}
                }
                assert!(!setpoint.starved, "{id}");
            };
            assert_eq!(steps as usize, moves.len(), "{id}");
            assert!(from_end(case, steps - 1, &end.pose.to_array()) < 1e-9, "{id}");
            assert!(
                seen.velocity <= 1.0 + 1e-6 && seen.acceleration <= 1.0 + 1e-6,
                "{id}: {} {}",
                seen.velocity,
                seen.acceleration
            );
        }
    });
}

#[test]
fn single_block_at_any_tick_stops_at_the_end_of_a_block_within_the_limits() {
    with_stack(|| {
        let mut seed = 0xa54f_f53a_5f1d_36f1;
        for (id, case) in &paths() {
            let moves = blocks(case);
            for _ in 0..20 {
                let at = random(&mut seed) % 2000;
                let mut planner = planner(case, 0);
                let mut seen = Differences::new(case, 1e-3, planner.setpoint().joints);
                let (mut next, mut ticks, mut rests, mut line) = (0, 0, 0, 0);
                loop {
                    feed(&mut planner, &moves, &mut next);
                    if ticks == at {
                        line = planner.setpoint().span.line;
                        planner.set_single_block(true);
                    }
                    let setpoint = planner.tick().unwrap();
                    seen.push(setpoint.joints);
                    ticks += 1;
                    assert!(ticks < 100_000, "{id} at {at}: {planner:?}");
                    if setpoint.state == State::BlockEnd {
                        rests += 1;
                        assert!(setpoint.span.line >= line, "{id} at {at}");
                        // A second later, on: the first three rests with a step, then for good.
                        if rests > 3 {
                            planner.set_single_block(false);
                        } else {
                            assert!(planner.step(), "{id} at {at}");
                        }
                    }
                    if setpoint.state == State::Idle && next == moves.len() {
                        break;
                    }
                }
                let left = planner.setpoint();
                assert!(from_end(case, left.motion, &left.pose.to_array()) < 1e-9, "{id} at {at}");
                let [v, a] = [seen.velocity, seen.acceleration];
                assert!(v <= 1.0 + 1e-6 && a <= 1.0 + 1e-6, "{id} at {at}: velocity {v}, acceleration {a}");
            }
        }
    });
}

/// A turn with a ten-millionth of a millimetre beside it is that long in s: at rest is what the joints are, not what s is.
#[test]
fn single_block_at_any_tick_of_a_turn_with_next_to_no_way_keeps_the_limits() {
    with_stack(|| {
        let place = |x: f64, a: f64| [x, 0.0, 0.0, a, 0.0, 0.0, 0.0, 0.0, 0.0];
        let points = [place(0.0, 0.0), place(1e-7, 1.0), place(2e-7, 2.0), place(0.0, 3.0)];
        let case = Case {
            mechanism: identity(&[Axis::X, Axis::A]),
            velocity: vec![100.0, 1.5],
            acceleration: vec![1000.0, 15.0],
            moves: polyline(&points, PathMode::ExactPath),
            feed_mm_s: f64::INFINITY,
        };
        let moves = blocks(&case);
        for at in (0..2500).step_by(3) {
            let mut planner = planner(&case, 0);
            let mut seen = Differences::new(&case, 1e-3, planner.setpoint().joints);
            let mut next = 0;
            for tick in 0..6000 {
                feed(&mut planner, &moves, &mut next);
                if tick == at {
                    planner.set_single_block(true);
                }
                let setpoint = planner.tick().unwrap();
                seen.push(setpoint.joints);
                match setpoint.state {
                    State::BlockEnd => assert!(planner.step()),
                    State::Idle if next == moves.len() => break,
                    _ => {}
                }
            }
            let [v, a] = [seen.velocity, seen.acceleration];
            assert!(v <= 1.0 && a <= 1.0, "at {at}: velocity {v}, acceleration {a}");
        }
    });
}

/// Three lines of 20 mm at 50 mm/s: a stop takes 2.5 mm, so the machine rests at the end of the very block it is in.
#[test]
fn single_block_stops_at_the_end_of_the_block_it_is_in() {
    with_stack(|| {
        for mode in [PathMode::ExactPath, crate::catalogue::blend(0.1)] {
            let points = [-30.0, -10.0, 10.0, 30.0].map(|x| xyz(x, -265.0 + 0.2 * x * x / 30.0, 0.0));
            let case = Case { feed_mm_s: 50.0, ..on_moma(polyline(&points, mode)) };
            let moves = blocks(&case);
            let mut planner = planner(&case, 0);
            let mut next = 0;
            while planner.setpoint().span.line != 2 || planner.setpoint().s < 1.0 {
                feed(&mut planner, &moves, &mut next);
                planner.tick().unwrap();
            }
            planner.set_single_block(true);
            while planner.setpoint().state != State::BlockEnd {
                planner.tick().unwrap();
            }
            let rest = planner.setpoint();
            assert!(from_end(&case, 1, &rest.pose.to_array()) < 4.0, "{rest:?}");
            if mode == PathMode::ExactPath {
                assert!(from_end(&case, 1, &rest.pose.to_array()) < 1e-9, "{rest:?}");
            }
        }
    });
}

#[test]
fn a_dwell_is_a_block_of_its_own() {
    with_stack(|| {
        let points = [0.0, 5.0, 9.0].map(|x| xyz(x, -265.0, 0.0));
        let case = Case { feed_mm_s: 50.0, ..on_moma(polyline(&points, PathMode::ExactPath)) };
        let moves = blocks(&case);
        let mut planner = planner(&case, 0);
        planner.set_single_block(true);
        planner.push(moves[0]).unwrap();
        planner.push_dwell(50_000_000, Span { line: 7, ..Span::default() }).unwrap();
        planner.push(moves[1]).unwrap();
        planner.finish();
        let (mut steps, mut dwelled) = (Vec::new(), 0);
        loop {
            let setpoint = planner.tick().unwrap();
            match setpoint.state {
                State::BlockEnd => {
                    steps.push((setpoint.pose.x, dwelled));
                    assert!(planner.step());
                }
                State::Dwell => dwelled += 1,
                State::Idle => break,
                _ => {}
            }
        }
        assert_eq!(steps, [(0.0, 0), (5.0, 0), (5.0, 50)], "before each of the three blocks");
    });
}

#[test]
fn a_queue_that_runs_dry_stops_on_the_path_and_says_so() {
    with_stack(|| {
        for (id, case) in &paths() {
            let exact = case.moves[0].1 == PathMode::ExactStop;
            for held_back in [1, 7, 15] {
                let mut rig = Rig::new(case, Sampling::SERVO);
                let first = case.moves.len() - held_back;
                for piece in &case.moves[..first] {
                    while rig.planner.push(to_move(case, *piece)).is_err() {
                        rig.tick();
                    }
                }
                // Nobody says that this is the end.
                let rest = loop {
                    let setpoint = rig.tick();
                    if setpoint.state == State::Idle {
                        break setpoint;
                    }
                };
                assert_eq!(rest.starved, !exact, "{id}");
                assert_eq!(rig.planner.work().starved, 0, "{id}: it may be the end yet");
                assert!(from_end(case, first as u32 - 1, &rest.pose.to_array()) < 1e-9, "{id}: {rest:?}");
                for piece in &case.moves[first..] {
                    rig.planner.push(to_move(case, *piece)).unwrap();
                }
                rig.planner.finish();
                while rig.tick().state != State::Idle {}
                assert_eq!(rig.planner.work().starved, u64::from(!exact), "{id}");
                assert!(!rig.planner.setpoint().starved, "{id}: the program's end");
                let [v, a, _] = rig.worst();
                assert!(v <= 1.0 + 1e-6 && a <= 1.0 + 1e-6, "{id}: {v} {a}");
            }
        }
    });
}

/// A hold as long as one likes is no starving: what is known so far stays open.
#[test]
fn a_hold_does_not_starve() {
    with_stack(|| {
        let case = flower_on_moma(400);
        let mut rig = Rig::new(&case, Sampling::SERVO);
        rig.planner.hold(true);
        for piece in &case.moves[..20] {
            rig.planner.push(to_move(&case, *piece)).unwrap();
            assert!(!rig.tick().starved);
        }
        for _ in 0..100 {
            assert!(!rig.tick().starved);
        }
        for piece in &case.moves[20..] {
            while rig.planner.push(to_move(&case, *piece)).is_err() {
                rig.planner.hold(false);
                rig.tick();
            }
        }
        rig.planner.finish();
        rig.planner.hold(false);
        while rig.tick().state != State::Idle {}
        assert_eq!(rig.planner.work().starved, 0);
    });
}

/// Idle, Held and BlockEnd are said only when the average of the setpoints has arrived too.
#[test]
fn with_a_smoother_rest_is_said_when_the_average_rests() {
    const WINDOW: usize = 8;
    with_stack(|| {
        let mut seed = 0x510e_527f_ade6_82d1;
        for (id, case) in &paths() {
            let moves = blocks(case);
            for what in 0..30 {
                let at = random(&mut seed) % 1500;
                let mut planner = planner(case, WINDOW as u32);
                let mut smoother = Smoother::<WINDOW>::new(WINDOW, planner.setpoint().joints);
                let mut step = |planner: &mut Planner<_, 6, 2048, 2048>| -> (Setpoint, [f64; 9], [f64; 9]) {
                    let setpoint = planner.tick().unwrap();
                    let (joints, velocity) = smoother.push(&setpoint.joints, &setpoint.joint_velocity);
                    (setpoint, joints, velocity)
                };
                let mut next = 0;
                for _ in 0..at {
                    feed(&mut planner, &moves, &mut next);
                    step(&mut planner);
                }
                let wanted = match what % 3 {
                    0 => State::Held,
                    1 => State::BlockEnd,
                    _ => State::Idle,
                };
                match wanted {
                    State::Held => planner.hold(true),
                    State::BlockEnd => planner.set_single_block(true),
                    _ => planner.abort(),
                }
                let mut ticks = 0;
                let rest = loop {
                    feed(
                        &mut planner,
                        &moves[..if wanted == State::Idle { next } else { moves.len() }],
                        &mut next,
                    );
                    let now = step(&mut planner);
                    ticks += 1;
                    assert!(ticks < 20_000, "{id} {wanted:?} at {at}");
                    if now.0.state == wanted || now.0.state == State::Idle {
                        break now;
                    }
                };
                assert_eq!(
                    (rest.1, rest.2),
                    (rest.0.joints, [0.0; 9]),
                    "{id} {wanted:?} at {at}: said too early"
                );
                let later = step(&mut planner);
                assert_eq!(later.1, rest.1, "{id} {wanted:?} at {at}: moves on");
            }
        }
    });
}
