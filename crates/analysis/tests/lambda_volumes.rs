//! Volumes of Lambda's workspaces against published definitions and independently computed numbers.

use pkm_analysis::workspace::polar::{ACHIEVABLE, Kind, Steps, TOTAL_ORIENTATION, ZERO_ORIENTATION, scan};
use pkm_machine::Machine;

/// Machine, kind, volume mm³ and how near it must come, planes from and to, longest ray mm.
type Row = (&'static str, Kind, f64, f64, [f64; 2], f64);
const VOLUMES: [Row; 6] = [
    ("lambda6-paper", ZERO_ORIENTATION, 150_994_573.378_06, 1e-6, [-1770.0, -1320.0], 474.7009),
    ("lambda6", ZERO_ORIENTATION, 174_562_391.799_79, 1e-6, [-1800.0, -1240.0], 407.0953),
    // Two significant digits are known.
    ("lambda6-paper", ACHIEVABLE, 0.29e9, 0.02, [-1780.0, -1280.0], 489.0),
    ("lambda6-paper", TOTAL_ORIENTATION, 0.062e9, 0.01, [-1670.0, -1410.0], 437.0),
    ("lambda6", ACHIEVABLE, 0.37e9, 0.015, [-1850.0, -1120.0], 488.0),
    ("lambda6", TOTAL_ORIENTATION, 0.052e9, 0.01, [-1680.0, -1380.0], 335.0),
];

#[test]
fn val_volumes_at_the_default_steps() {
    for (name, kind, volume, near, planes, radius) in VOLUMES {
        let machine = Machine::load(name, &[]).unwrap();
        let solid = scan(&machine, kind, Steps::default(), 2).unwrap();
        let found = solid.volume_mm3();
        assert!((found / volume - 1.0).abs() < near, "{name} {}: {found} for {volume}", kind.name);
        let ends = [solid.planes[0].z_mm, solid.planes[solid.planes.len() - 1].z_mm];
        assert_eq!(ends, planes, "{name} {}", kind.name);
        assert!(
            (solid.largest_radius_mm() - radius).abs() < 0.51,
            "{name} {}: {}",
            kind.name,
            solid.largest_radius_mm()
        );
        assert!(solid.bisection_bound_mm3() < 1e-5 * found);
    }
}

/// Ray by ray: every orientation ⊂ zero orientation ⊂ at least one; the paper's layout is symmetric in y; any number of
/// threads gives the same bits.
#[test]
fn kinds_are_nested_and_the_paper_layout_is_symmetric() {
    let machine = Machine::load("lambda6-paper", &[]).unwrap();
    let [total, zero, any] = [TOTAL_ORIENTATION, ZERO_ORIENTATION, ACHIEVABLE]
        .map(|kind| scan(&machine, kind, Steps::default(), 2).unwrap());
    for (inner, outer) in [(&total, &zero), (&zero, &any)] {
        for plane in &inner.planes {
            let around = outer.planes.iter().find(|p| p.z_mm == plane.z_mm).expect("the outer one is taller");
            for (a, b) in plane.radii_mm.iter().zip(&around.radii_mm) {
                assert!(*a <= *b + 0.0011, "{} {a} {b}", plane.z_mm);
            }
        }
    }
    for solid in [&total, &zero, &any] {
        for plane in &solid.planes {
            for m in 1..36 {
                assert!(
                    (plane.radii_mm[m] - plane.radii_mm[72 - m]).abs() < 0.0021,
                    "z {} ray {m}",
                    plane.z_mm
                );
            }
        }
    }
    let alone = scan(&machine, TOTAL_ORIENTATION, Steps::default(), 1).unwrap();
    assert_eq!(alone, total);
}
