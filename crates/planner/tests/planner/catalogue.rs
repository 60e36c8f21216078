//! The planning cases whose shortest possible durations are known, as toppra 0.6.10 finds them on a grid of 4000
//! intervals (many pieces: 4 per piece). Shared by the tests and by `benches/cases.rs`.

use pkm_kins::hexapod::{Hexapod, HexapodParameters};
use pkm_kins::linear_delta::{LinearDelta, LinearDeltaParameters};
use pkm_kins::machine::Mechanism;
use pkm_kins::moma::{Moma, MomaConfiguration};
use pkm_kins::{Axis, AxisSet};
use pkm_planner::PathMode;
use pkm_planner::path::{Arc, Geometry, Line, Tolerance, Vector};

const PI: f64 = core::f64::consts::PI;

/// A path on a machine.
#[derive(Clone)]
pub(crate) struct Case {
    pub(crate) mechanism: Mechanism,
    /// Limits of the joints, mm/s and mm/s².
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
    pub(crate) moves: Vec<(Geometry, PathMode)>,
    /// Infinite: rapids.
    pub(crate) feed_mm_s: f64,
}

/// A case with what is known of it.
pub(crate) struct Known {
    pub(crate) id: &'static str,
    pub(crate) case: Case,
    /// Shortest possible duration.
    pub(crate) t_ref_s: f64,
    /// Blend tolerance; 0 where nothing is blended.
    pub(crate) p_mm: f64,
}

pub(crate) fn xyz(x: f64, y: f64, z: f64) -> Vector {
    [x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

pub(crate) fn moma() -> Mechanism {
    Mechanism::Moma(Moma::new(&MomaConfiguration::A.into()).unwrap())
}

pub(crate) fn identity(axes: &[Axis]) -> Mechanism {
    Mechanism::Cartesian(pkm_kins::cartesian::Cartesian::new(AxisSet::new(axes)).unwrap())
}

/// Struts between rings of radius 120 and 60.
pub(crate) fn hexapod() -> Mechanism {
    let ring = |radius: f64, half_gap_deg: f64| {
        core::array::from_fn(|i| {
            let side = if i % 2 == 0 { -1.0 } else { 1.0 };
            let angle = (120.0 * (i / 2) as f64 + side * half_gap_deg) * PI / 180.0;
            [radius * libm::cos(angle), radius * libm::sin(angle), 0.0]
        })
    };
    let parameters =
        HexapodParameters { base_mm: ring(120.0, 10.0), platform_mm: ring(60.0, 50.0), start_z_mm: 150.0 };
    Mechanism::Hexapod(Hexapod::new(&parameters).unwrap())
}

pub(crate) fn blend(p_mm: f64) -> PathMode {
    PathMode::Blend(Tolerance { length_mm: p_mm, angle_rad: 1e-3 })
}

pub(crate) fn polyline(points: &[Vector], mode: PathMode) -> Vec<(Geometry, PathMode)> {
    points.windows(2).filter_map(|p| Line::new(p[0], p[1])).map(|line| (Geometry::Line(line), mode)).collect()
}

fn line(a: Vector, b: Vector) -> Vec<(Geometry, PathMode)> {
    polyline(&[a, b], PathMode::ExactPath)
}

/// A full circle about the point (x, y) in the plane of z.
fn circle([x, y, z]: [f64; 3], radius: f64) -> Vec<(Geometry, PathMode)> {
    let start = xyz(x + radius, y, z);
    let arc = Arc::new(start, start, [x, y, z], [0.0, 0.0, 1.0], 1).unwrap();
    vec![(Geometry::Arc(arc), PathMode::ExactPath)]
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

pub(crate) fn on_moma(moves: Vec<(Geometry, PathMode)>) -> Case {
    Case {
        mechanism: moma(),
        velocity: vec![100.0; 2],
        acceleration: vec![1000.0; 2],
        moves,
        feed_mm_s: f64::INFINITY,
    }
}

pub(crate) fn on_delta(moves: Vec<(Geometry, PathMode)>) -> Case {
    let parameters = LinearDeltaParameters { joint_radius_mm: 105.0, joint_length_mm: 217.0 };
    Case {
        mechanism: Mechanism::LinearDelta(LinearDelta::new(&parameters).unwrap()),
        velocity: vec![200.0; 3],
        acceleration: vec![3000.0; 3],
        ..on_moma(moves)
    }
}

/// The flower of P04 in so many chords, blended within 0.01 mm.
pub(crate) fn flower_on_moma(chords: u32) -> Case {
    on_moma(polyline(&flower(chords), blend(0.01)))
}

/// P01 to P17.
pub(crate) fn all() -> Vec<Known> {
    let known = |id, case, t_ref_s, p_mm| Known { id, case, t_ref_s, p_mm };
    let horizontal = on_moma(line(xyz(-50.0, -270.0, 0.0), xyz(50.0, -270.0, 0.0)));
    let rounded: Vec<Vector> =
        flower(3000).iter().map(|p| p.map(|x| (x * 1000.0).round_ties_even() / 1000.0)).collect();
    let helix: Vec<Vector> = (0..=1000)
        .map(|k| {
            let f = f64::from(k) / 1000.0;
            let r = 60.0 * (0.4 + 0.6 * f);
            xyz(r * libm::cos(6.0 * PI * f), r * libm::sin(6.0 * PI * f), 5.0 + 40.0 * f)
        })
        .collect();
    let pose = |p: [f64; 3], deg: [f64; 3]| {
        let [a, b, c] = deg.map(|d| d * PI / 180.0);
        [p[0], p[1], p[2], a, b, c, 0.0, 0.0, 0.0]
    };
    let at_30_degrees = xyz(100.0 * libm::cos(PI / 6.0), 100.0 * libm::sin(PI / 6.0), 0.0);
    let plane = || identity(&[Axis::X, Axis::Y]);
    vec![
        known("P01", horizontal.clone(), 1.235716, 0.0),
        known("P02", on_moma(line(xyz(-40.0, -310.0, 0.0), xyz(45.0, -235.0, 0.0))), 1.556699, 0.0),
        known("P03", on_moma(circle([0.0, -265.0, 0.0], 40.0)), 3.047725, 0.0),
        known("P04", flower_on_moma(1000), 4.688393, 0.01),
        known("P05", on_moma(polyline(&zigzag(), blend(0.1))), 3.040093, 0.1),
        known("P06", on_moma(line(xyz(-70.0, -250.0, 0.0), xyz(70.0, -250.0, 0.0))), 2.258514, 0.0),
        known("P07", Case { feed_mm_s: 40.0, ..horizontal }, 2.571705, 0.0),
        known(
            "P08",
            Case { mechanism: plane(), ..on_moma(line(xyz(0.0, 0.0, 0.0), at_30_degrees)) },
            0.966025,
            0.0,
        ),
        known("P09", Case { mechanism: plane(), ..on_moma(polyline(&zigzag(), blend(0.1))) }, 2.46899, 0.1),
        known("P10", on_delta(circle([0.0, 0.0, 20.0], 80.0)), 1.545056, 0.0),
        known("P11", on_delta(polyline(&helix, blend(0.02))), 2.265327, 0.02),
        known(
            "P12",
            Case {
                mechanism: hexapod(),
                velocity: vec![100.0; 6],
                acceleration: vec![1000.0; 6],
                ..on_moma(line(
                    pose([-30.0, -20.0, 150.0], [-5.0, 3.0, 0.0]),
                    pose([30.0, 20.0, 170.0], [5.0, -3.0, 10.0]),
                ))
            },
            0.595388,
            0.0,
        ),
        known("P13", flower_on_moma(10_000), 4.674384, 0.01),
        known("P14", Case { feed_mm_s: 50.0, ..flower_on_moma(1000) }, 6.76232, 0.01),
        known("P15", on_moma(polyline(&rounded, blend(0.01))), 5.065943, 0.01),
        known("P16", on_moma(polyline(&zigzag(), PathMode::ExactStop)), 3.447631, 0.0),
        known(
            "P17",
            Case {
                mechanism: identity(&[Axis::X, Axis::Y, Axis::Z]),
                velocity: vec![100.0, 80.0, 40.0],
                acceleration: vec![1000.0, 800.0, 300.0],
                ..on_moma(line(xyz(0.0, 0.0, 0.0), xyz(30.0, -40.0, 120.0)))
            },
            3.1333,
            0.0,
        ),
    ]
}
