//! Random paths that prefer trouble: reversals, tiny blocks, repeated points, arcs into lines, every path mode, extreme
//! tolerances. Whatever the path, no joint exceeds its limits at any tick, the machine arrives, and it never stalls.

use crate::catalogue::{Case, identity, on_moma, xyz};
use crate::harness::{Disturbance, Sampling, drive, random, with_stack};
use pkm_kins::Axis;
use pkm_planner::PathMode;
use pkm_planner::path::{Arc, Geometry, Line, Tolerance, Vector};

/// Paths per test, times `PKM_TEST_SCALE`.
const PATHS: u64 = 500;

fn unit(seed: &mut u64) -> f64 {
    (random(seed) >> 11) as f64 / (1_u64 << 53) as f64
}

fn mode(seed: &mut u64) -> PathMode {
    let p = [1e-12, 1e-4, 0.01, 0.1, 1.0, 1e9][(random(seed) % 6) as usize];
    match random(seed) % 4 {
        0 => PathMode::ExactStop,
        1 => PathMode::ExactPath,
        _ => PathMode::Blend(Tolerance { length_mm: p, angle_rad: 1e-3 }),
    }
}

/// Moves inside the box |x − cx|, |y − cy| ≤ r.
fn path(seed: &mut u64, centre: [f64; 2], r: f64) -> Vec<(Geometry, PathMode)> {
    let mut at = xyz(centre[0], centre[1], 0.0);
    let mut moves = Vec::new();
    let mut mode_now = mode(seed);
    let inside = |p: &Vector| (p[0] - centre[0]).abs() <= r && (p[1] - centre[1]).abs() <= r;
    let blocks = 1 + random(seed) % 40;
    let mut last = [1.0, 0.0];
    for _ in 0..blocks {
        if random(seed).is_multiple_of(8) {
            mode_now = mode(seed);
        }
        let length = [1e-7, 1e-3, 0.02, 0.3, 3.0, 20.0][(random(seed) % 6) as usize] * (0.5 + unit(seed));
        let turn = [0.0, 1e-9, 1e-5, 0.01, 0.3, core::f64::consts::FRAC_PI_2, core::f64::consts::PI, 3.0]
            [(random(seed) % 8) as usize];
        let (c, s) =
            (libm::cos(turn), libm::sin(turn) * if random(seed).is_multiple_of(2) { 1.0 } else { -1.0 });
        let direction = [last[0] * c - last[1] * s, last[0] * s + last[1] * c];
        let next = xyz(at[0] + length * direction[0], at[1] + length * direction[1], 0.0);
        if !inside(&next) {
            last = [-last[1], last[0]];
            continue;
        }
        last = direction;
        let arc = (random(seed).is_multiple_of(4) && length > 1e-3).then(|| {
            // A half circle over the chord.
            let middle = [0.5 * (at[0] + next[0]), 0.5 * (at[1] + next[1]), 0.0];
            Arc::new(at, next, middle, [0.0, 0.0, 1.0], if random(seed).is_multiple_of(2) { 1 } else { -1 })
        });
        let geometry = match (arc.flatten(), Line::new(at, next)) {
            (Some(arc), _) if length <= 0.5 * r => Geometry::Arc(arc),
            (_, Some(line)) => Geometry::Line(line),
            _ => continue,
        };
        at = next;
        moves.push((geometry, mode_now));
    }
    moves
}

fn hold(mut make: impl FnMut(&mut u64) -> Case + Send) {
    let scale: u64 = std::env::var("PKM_TEST_SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1);
    with_stack(move || {
        for number in 0..PATHS * scale {
            let mut seed = 0x2545_f491_4f6c_dd1d_u64.wrapping_mul(2 * number + 1);
            let seed_was = seed;
            let case = make(&mut seed);
            if case.moves.is_empty() {
                continue;
            }
            let disturbance = match number % 4 {
                0 => Disturbance::RandomOverride,
                1 => Disturbance::HoldThirds,
                _ => Disturbance::None,
            };
            let trace = drive(&case, Sampling::SERVO, disturbance, number.is_multiple_of(5));
            let goal = case.moves.last().expect("not empty").0;
            let goal = goal.at(goal.length()).position;
            let ends_there = trace.end.iter().zip(goal).all(|(got, want)| (got - want).abs() < 1e-9);
            assert!(
                ends_there && trace.velocity <= 1.0 + 1e-6 && trace.acceleration <= 1.0 + 1e-6,
                "path {number} (seed {seed_was:#x}): velocity {}, acceleration {}, ends at {:?} of {goal:?}",
                trace.velocity,
                trace.acceleration,
                trace.end
            );
        }
    });
}

#[test]
fn random_paths_on_moma() {
    hold(|seed| {
        let feed_mm_s = [f64::INFINITY, 1e9, 60.0, 5.0][(random(seed) % 4) as usize];
        let moves = path(seed, [0.0, -265.0], 35.0);
        Case { feed_mm_s, ..on_moma(moves) }
    });
}

#[test]
fn random_paths_on_identity() {
    hold(|seed| {
        let moves = path(seed, [0.0, 0.0], 100.0);
        Case {
            mechanism: identity(&[Axis::X, Axis::Y]),
            velocity: vec![100.0, 40.0],
            acceleration: vec![1000.0, 300.0],
            moves,
            feed_mm_s: f64::INFINITY,
        }
    });
}
