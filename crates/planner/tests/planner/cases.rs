//! The planning cases whose shortest possible durations are known (toppra 0.6.10 on the finest grid), judged on
//! the trace alone: first and second differences of the joint positions at the servo period and at a tenth of it.
//!
//! `val_…`: T_ref is from an outside source.

use crate::harness::{Case, Disturbance, drive, with_stack};
use pkm_kins::hexapod::{Hexapod, HexapodParameters};
use pkm_kins::linear_delta::{LinearDelta, LinearDeltaParameters};
use pkm_kins::machine::Mechanism;
use pkm_kins::moma::{Moma, MomaConfiguration};
use pkm_kins::{Axis, AxisSet};
use pkm_planner::PathMode;
use pkm_planner::path::{Geometry, Line, Tolerance, Vector};

const PERIOD_S: f64 = 1e-3;
const PI: f64 = core::f64::consts::PI;

pub(crate) fn xyz(x: f64, y: f64, z: f64) -> Vector {
    [x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

pub(crate) fn moma() -> Mechanism {
    Mechanism::Moma(Moma::new(&MomaConfiguration::A.into()).unwrap())
}

pub(crate) fn identity(axes: &[Axis]) -> Mechanism {
    Mechanism::Cartesian(pkm_kins::cartesian::Cartesian::new(AxisSet::new(axes)).unwrap())
}

pub(crate) fn polyline(points: &[Vector], mode: PathMode) -> Vec<(Geometry, PathMode)> {
    points.windows(2).filter_map(|p| Line::new(p[0], p[1])).map(|line| (Geometry::Line(line), mode)).collect()
}

pub(crate) fn blend(p_mm: f64) -> PathMode {
    PathMode::Blend(Tolerance { length_mm: p_mm, angle_rad: 1e-3 })
}

fn flower(chords: u32) -> Vec<Vector> {
    (0..=chords)
        .map(|k| {
            let t = 2.0 * PI * f64::from(k) / f64::from(chords);
            xyz(
                40.0 * libm::cos(t) + 6.0 * libm::cos(7.0 * t) - 6.0,
                -265.0 + 32.0 * libm::sin(t) + 6.0 * libm::sin(7.0 * t),
                0.0,
            )
        })
        .collect()
}

fn zigzag() -> Vec<Vector> {
    (0..=20).map(|k| xyz(-40.0 + 4.0 * f64::from(k), -265.0 + 4.0 * f64::from(k % 2), 0.0)).collect()
}

fn on_moma(moves: Vec<(Geometry, PathMode)>) -> Case {
    Case {
        mechanism: moma(),
        velocity: vec![100.0; 2],
        acceleration: vec![1000.0; 2],
        moves,
        feed_mm_s: f64::INFINITY,
    }
}

fn line(a: Vector, b: Vector) -> Vec<(Geometry, PathMode)> {
    polyline(&[a, b], PathMode::ExactPath)
}

fn judge(id: &str, case: &Case, t_ref_s: f64) {
    with_stack(|| judge_here(id, case, t_ref_s));
}

fn judge_here(id: &str, case: &Case, t_ref_s: f64) {
    let goal = case.moves.last().unwrap().0;
    let goal = goal.at(goal.length()).position;
    for (period_s, slack) in [(1e-3, 1e-6), (1e-4, 1e-5)] {
        let trace = drive(case, period_s, Disturbance::None, false);
        println!(
            "{id} T={period_s}: {:.4} s = {:.4} T_ref, v {:.5} a {:.5}",
            trace.duration_s,
            trace.duration_s / t_ref_s,
            trace.velocity,
            trace.acceleration
        );
        assert!(trace.duration_s <= 1.01 * t_ref_s, "{id}: {} s > 1.01 * {t_ref_s}", trace.duration_s);
        assert!(trace.duration_s >= 0.995 * t_ref_s, "{id}: faster than possible: {}", trace.duration_s);
        assert!(trace.velocity <= 1.0 + slack, "{id}: velocity {}", trace.velocity);
        assert!(trace.acceleration <= 1.0 + slack, "{id}: acceleration {}", trace.acceleration);
        for (got, want) in trace.end.iter().zip(goal) {
            assert!((got - want).abs() < 1e-9, "{id}: ends at {:?}", trace.end);
        }
    }
    for (name, disturbance, one_per_tick) in [
        ("override", Disturbance::RandomOverride, false),
        ("hold", Disturbance::HoldThirds, false),
        ("one per tick", Disturbance::None, true),
    ] {
        let trace = drive(case, PERIOD_S, disturbance, one_per_tick);
        println!(
            "{id} {name}: {:.4} s, v {:.5} a {:.5}",
            trace.duration_s, trace.velocity, trace.acceleration
        );
        assert!(trace.velocity <= 1.0 + 1e-6, "{id} {name}: velocity {}", trace.velocity);
        assert!(trace.acceleration <= 1.0 + 1e-6, "{id} {name}: acceleration {}", trace.acceleration);
        for (got, want) in trace.end.iter().zip(goal) {
            assert!((got - want).abs() < 1e-9, "{id} {name}: ends at {:?}", trace.end);
        }
    }
}

#[test]
fn val_lines_on_moma() {
    judge("P01", &on_moma(line(xyz(-50.0, -270.0, 0.0), xyz(50.0, -270.0, 0.0))), 1.235716);
    judge("P02", &on_moma(line(xyz(-40.0, -310.0, 0.0), xyz(45.0, -235.0, 0.0))), 1.556699);
    judge("P06", &on_moma(line(xyz(-70.0, -250.0, 0.0), xyz(70.0, -250.0, 0.0))), 2.258514);
    let mut p07 = on_moma(line(xyz(-50.0, -270.0, 0.0), xyz(50.0, -270.0, 0.0)));
    p07.feed_mm_s = 40.0;
    judge("P07", &p07, 2.571705);
}

#[test]
fn val_circle_on_moma() {
    let start = xyz(40.0, -265.0, 0.0);
    let arc = pkm_planner::path::Arc::new(start, start, [0.0, -265.0, 0.0], [0.0, 0.0, 1.0], 1).unwrap();
    judge("P03", &on_moma(vec![(Geometry::Arc(arc), PathMode::ExactPath)]), 3.047725);
}

#[test]
fn val_chords_on_moma() {
    judge("P04", &on_moma(polyline(&flower(1000), blend(0.01))), 4.688393);
    judge("P13", &on_moma(polyline(&flower(10000), blend(0.01))), 4.674384);
    let mut p14 = on_moma(polyline(&flower(1000), blend(0.01)));
    p14.feed_mm_s = 50.0;
    judge("P14", &p14, 6.76232);
    let rounded: Vec<Vector> =
        flower(3000).iter().map(|p| p.map(|x| (x * 1000.0).round_ties_even() / 1000.0)).collect();
    judge("P15", &on_moma(polyline(&rounded, blend(0.01))), 5.065943);
}

#[test]
fn val_zigzag_on_moma() {
    judge("P05", &on_moma(polyline(&zigzag(), blend(0.1))), 3.040093);
    judge("P16", &on_moma(polyline(&zigzag(), PathMode::ExactStop)), 3.447631);
}

#[test]
fn val_trapezoid_on_identity() {
    let to = xyz(100.0 * libm::cos(PI / 6.0), 100.0 * libm::sin(PI / 6.0), 0.0);
    let mut case = on_moma(line(xyz(0.0, 0.0, 0.0), to));
    case.mechanism = identity(&[Axis::X, Axis::Y]);
    judge("P08", &case, 0.966025);
    case.moves = polyline(&zigzag(), blend(0.1));
    judge("P09", &case, 2.46899);
    let p17 = Case {
        mechanism: identity(&[Axis::X, Axis::Y, Axis::Z]),
        velocity: vec![100.0, 80.0, 40.0],
        acceleration: vec![1000.0, 800.0, 300.0],
        moves: line(xyz(0.0, 0.0, 0.0), xyz(30.0, -40.0, 120.0)),
        feed_mm_s: f64::INFINITY,
    };
    judge("P17", &p17, 3.1333);
}

fn delta(moves: Vec<(Geometry, PathMode)>) -> Case {
    let parameters = LinearDeltaParameters { joint_radius_mm: 105.0, joint_length_mm: 217.0 };
    Case {
        mechanism: Mechanism::LinearDelta(LinearDelta::new(&parameters).unwrap()),
        velocity: vec![200.0; 3],
        acceleration: vec![3000.0; 3],
        moves,
        feed_mm_s: f64::INFINITY,
    }
}

#[test]
fn val_linear_delta() {
    let start = xyz(80.0, 0.0, 20.0);
    let circle = pkm_planner::path::Arc::new(start, start, [0.0, 0.0, 20.0], [0.0, 0.0, 1.0], 1).unwrap();
    judge("P10", &delta(vec![(Geometry::Arc(circle), PathMode::ExactPath)]), 1.545056);
    let helix: Vec<Vector> = (0..=1000)
        .map(|k| {
            let f = f64::from(k) / 1000.0;
            let r = 60.0 * (0.4 + 0.6 * f);
            xyz(r * libm::cos(6.0 * PI * f), r * libm::sin(6.0 * PI * f), 5.0 + 40.0 * f)
        })
        .collect();
    judge("P11", &delta(polyline(&helix, blend(0.02))), 2.265327);
}

#[test]
fn val_hexapod() {
    let ring = |radius: f64, half_gap_deg: f64| {
        core::array::from_fn(|i| {
            let side = if i % 2 == 0 { -1.0 } else { 1.0 };
            let angle = (120.0 * (i / 2) as f64 + side * half_gap_deg) * PI / 180.0;
            [radius * libm::cos(angle), radius * libm::sin(angle), 0.0]
        })
    };
    let parameters =
        HexapodParameters { base_mm: ring(120.0, 10.0), platform_mm: ring(60.0, 50.0), start_z_mm: 150.0 };
    let pose = |p: [f64; 3], deg: [f64; 3]| {
        let [a, b, c] = deg.map(|d| d * PI / 180.0);
        [p[0], p[1], p[2], a, b, c, 0.0, 0.0, 0.0]
    };
    let case = Case {
        mechanism: Mechanism::Hexapod(Hexapod::new(&parameters).unwrap()),
        velocity: vec![100.0; 6],
        acceleration: vec![1000.0; 6],
        moves: line(
            pose([-30.0, -20.0, 150.0], [-5.0, 3.0, 0.0]),
            pose([30.0, 20.0, 170.0], [5.0, -3.0, 10.0]),
        ),
        feed_mm_s: f64::INFINITY,
    };
    judge("P12", &case, 0.595388);
}
