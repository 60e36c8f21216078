//! Areas, boxes and corners of the planar workspaces against published or independently computed numbers.

use pkm_analysis::workspace::{Region, Section, View, views};
use pkm_kins::maths::hypot;
use pkm_machine::Machine;

fn view(name: &str, index: usize) -> View {
    let machine = Machine::load(name, &[]).unwrap();
    views(&machine, &Section::default()).unwrap().swap_remove(index)
}

/// Machine, reachable and one-sided area, mm². Independently computed: intersections of polygons with 40,000 corners on the
/// swept half circles (Shapely), good to 0.001 mm²; a to d and the one-sided ones by another integration, to 0.1 mm².
const AREAS: [(&str, f64, f64); 9] = [
    ("moma-a", 19_315.6, 19_315.6),
    ("moma-b", 31_258.1, 25_716.6),
    ("moma-c", 2_140.4, 2_140.4),
    ("moma-d", 39_804.7, 18_583.6),
    ("moma-4s-p", 31_550.70, 25_824.1),
    ("moma-4s-s5", 24_538.01, 24_538.01),
    ("moma-4s-s10", 17_872.01, 17_872.01),
    ("moma-4s-u5", 38_617.64, 20_047.6),
    ("moma-4s-u10", 45_469.06, 10_637.7),
];

#[test]
fn val_areas_of_moma_and_4s() {
    for (name, reachable, usable) in AREAS {
        let view = view(name, 0);
        for (what, region, expected) in
            [("reachable", &view.reachable, reachable), ("usable", &view.usable, usable)]
        {
            let boundary = region.boundary();
            assert!(boundary.error_bound_mm2 < 0.01, "{name} {what}: bound {}", boundary.error_bound_mm2);
            assert!(
                (boundary.area_mm2 - expected).abs() < 0.06,
                "{name} {what}: {} for {expected}",
                boundary.area_mm2
            );
        }
    }
}

/// \[OX\]: exact integrals of the strip widths; the two boxes; O lies inside X.
#[test]
fn val_ox_glide_forms() {
    let boxes = [
        ("O", 0, 753.33, [[10.0, 58.095], [120.0, 80.0]]),
        ("X", 1, 2125.33, [[0.0, 27.839], [130.0, 80.0]]),
    ];
    for (name, index, area, [low, high]) in boxes {
        let boundary = view("ox-glide-o", index).reachable.boundary();
        assert!((boundary.area_mm2 - area).abs() < 0.006, "{name}: {}", boundary.area_mm2);
        let found = boundary.bounding_box().unwrap();
        for axis in 0..2 {
            assert!((found[0][axis] - low[axis]).abs() < 1e-3, "{name}: {found:?}");
            assert!((found[1][axis] - high[axis]).abs() < 1e-3, "{name}: {found:?}");
        }
    }
}

/// Corners that the sources and the kinematics name: the apexes of a and b, the darts of c, the pentagon of d.
#[test]
fn val_corners() {
    let cases: [(&str, &[[f64; 2]]); 4] = [
        ("moma-a", &[[0.0, -167.41], [0.0, -354.91]]),
        ("moma-b", &[[0.0, -167.41], [112.38, -194.61], [-112.38, -194.61], [0.0, -375.90]]),
        ("moma-c", &[[195.0, 195.0], [195.0, 130.39], [160.60, 160.60], [130.39, 195.0]]),
        ("moma-d", &[[-66.36, -66.36], [124.79, -32.85], [158.5, 113.59], [113.59, 158.5], [-32.85, 124.79]]),
    ];
    for (name, corners) in cases {
        let polygons = view(name, 0).reachable.boundary().polygons(0.01);
        for corner in corners {
            let nearest = polygons
                .iter()
                .flatten()
                .map(|p| hypot(p[0] - corner[0], p[1] - corner[1]))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.012, "{name}: no corner within {nearest} mm of {corner:?}");
        }
    }
}

/// d ends at the arc x² + y² = 195², where the links are parallel; its piece says so.
#[test]
fn val_type_2_bounds_d() {
    use pkm_analysis::workspace::Cause;
    let boundary = view("moma-d", 0).reachable.boundary();
    let arc: Vec<_> = boundary.loops.iter().flatten().filter(|piece| piece.cause == Cause::Type2).collect();
    assert_eq!(arc.len(), 1);
    for share in [0.0, 0.3, 1.0] {
        let [x, y] = arc[0].curve.at(share);
        assert!((hypot(x, y) - 195.0).abs() < 1e-9);
    }
}

/// Exact areas against counting a grid, over random mechanisms: skew guides, unequal links, offsets, all modes.
#[test]
fn random_mechanisms_agree_with_a_grid() {
    use pkm_kins::{JointRange, Planar, PlanarParameters};
    let seed = 20_261_122_u64;
    let mut state = seed;
    let mut random = |low: f64, high: f64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((state >> 11) as f64 / (1_u64 << 53) as f64)
    };
    let mut looked_at = 0;
    for case in 0..400 {
        let mut sign = || if random(-1.0, 1.0) < 0.0 { -1 } else { 1 };
        let (working_mode, assembly) = ([sign(), sign()], sign());
        let parallel = sign() > 0 && sign() > 0;
        let first = random(0.0, 360.0);
        let parameters = PlanarParameters {
            reference_mm: [
                [random(-200.0, 0.0), random(-60.0, 60.0)],
                [random(0.0, 200.0), random(-60.0, 60.0)],
            ],
            guide_angle_deg: [first, if parallel { first } else { random(0.0, 360.0) }],
            l_mm: [random(120.0, 260.0), random(120.0, 260.0)],
            offset_mm: [[random(-40.0, 0.0), random(-20.0, 20.0)], [random(0.0, 40.0), random(-20.0, 20.0)]],
            working_mode,
            assembly,
            one_sided: case % 3 == 0,
        };
        let Ok(planar) = Planar::new(&parameters) else { continue };
        let ranges = [JointRange { min: random(-50.0, 20.0), max: random(60.0, 200.0) }; 2];
        let region = Region::of_planar(&planar, &ranges);
        let boundary = region.boundary();
        let Some([low, high]) = boundary.bounding_box() else { continue };
        // A workspace thinner than rounding is not counted.
        if high[0] - low[0] < 0.1 || high[1] - low[1] < 0.1 {
            assert!(boundary.area_mm2 < 1.0, "seed {seed} case {case}");
            continue;
        }
        let n = 500;
        let cell = [(high[0] - low[0]) / f64::from(n), (high[1] - low[1]) / f64::from(n)];
        let mut count = 0_u32;
        for i in 0..n {
            for j in 0..n {
                // Anywhere in its cell: a boundary along the grid's diagonal would bias the cells' middles.
                let place = |k: i32, share: f64, axis: usize| low[axis] + (f64::from(k) + share) * cell[axis];
                let t = [place(i, random(0.0, 1.0), 0), place(j, random(0.0, 1.0), 1)];
                let inside = planar.inverse(t).is_ok_and(|p| (0..2).all(|k| ranges[k].contains(p[k])));
                count += u32::from(inside);
                assert!(
                    inside == region.contains(t),
                    "seed {seed} case {case}: at {t:?} the mechanism says {inside}, {:?}\n{parameters:?}",
                    planar.inverse(t)
                );
            }
        }
        let counted = f64::from(count) * cell[0] * cell[1];
        // Only cells on the boundary are left to chance: about 4 n of them, so the root of that, some σ wide.
        let slack = 6.0 * f64::from(n).sqrt() * cell[0] * cell[1] + boundary.error_bound_mm2;
        assert!(
            (boundary.area_mm2 - counted).abs() < slack,
            "seed {seed} case {case}: exact {} counted {counted} ± {slack}\n{parameters:?}",
            boundary.area_mm2
        );
        assert!(
            boundary.error_bound_mm2 < 0.05,
            "seed {seed} case {case}: bound {}",
            boundary.error_bound_mm2
        );
        looked_at += 1;
    }
    assert!(looked_at > 150, "only {looked_at} mechanisms had a workspace");
}
