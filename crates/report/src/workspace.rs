//! The workspace behind the path: the exact outlines of `pkm-analysis`, put where the drawing has their plane.

use pkm_analysis::workspace::outline;
use pkm_analysis::workspace::polar::{Plane, Steps, ZERO_ORIENTATION, scan};
use pkm_kins::{Mechanism, OxForm, Pose, Vec3};
use pkm_machine::Machine;
use serde::Serialize;

use crate::skeleton::hv_plane;

/// Chords of the outlines are at most so far off, mm.
const TOLERANCE_MM: f64 = 0.05;

/// Spatial machines: a scan in planes so far apart, mm; its outline in each plane is drawn.
const PLANES_MM: f64 = 50.0;

/// One workspace.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Space {
    pub name: String,
    /// One bit for each view that shows it.
    pub views: u8,
    /// False: only its edge is drawn.
    pub filled: bool,
    /// Closed polygons, mm, holes among them.
    pub loops: Vec<Vec<Vec3>>,
}

/// The workspaces of a machine: exact outlines; of a spatial one, what the polar scan finds with all angles 0.
pub(crate) fn spaces(machine: &Machine, start: &Pose) -> Vec<Space> {
    let mut spaces = Vec::new();
    for (n, outline) in outline(machine, TOLERANCE_MM).into_iter().enumerate() {
        let mut add = |views: u8, filled: bool, place: &dyn Fn([f64; 2]) -> Vec3| {
            let scene = |polygon: &Vec<[f64; 2]>| polygon.iter().map(|&point| place(point)).collect();
            let loops = outline.polygons.iter().map(scene).collect();
            spaces.push(Space { name: outline.name.clone(), views, filled, loops });
        };
        match &machine.mechanism {
            Mechanism::MomaW(wire) => {
                let (b, w, _) = wire.frames_mm();
                add(1, true, &|[x, y]| [x + w[0], y + w[1], 0.0]);
                add(2, true, &|[x, y]| [x + w[0], y + w[1], b[2]]);
            }
            Mechanism::OxGlide(glide) => {
                let own = (glide.form() == OxForm::O) == outline.name.contains('O');
                add(0xff, own, &|[x, y]| [x, y, start.z]);
            }
            Mechanism::HvMill(m) => add(0xff, false, &|point| hv_plane(m, None, point)),
            Mechanism::HvMachine(both) => {
                let m = both.mechanisms()[n.min(1)];
                add(0xff, false, &|point| hv_plane(m, Some(both), point));
            }
            _ => add(0xff, true, &|[x, y]| [x, y, 0.0]),
        }
    }
    if spaces.is_empty() && !matches!(machine.mechanism, Mechanism::Cartesian(_)) {
        let steps = Steps { dz_mm: PLANES_MM, ..Steps::default() };
        // A scan that is refused (no travel to scan) leaves the page without one.
        if let Ok(solid) = scan(machine, ZERO_ORIENTATION, steps, 1) {
            let edge = |plane: &Plane| plane.points().iter().map(|&[x, y]| [x, y, plane.z_mm]).collect();
            let loops = solid.planes.iter().filter(|plane| plane.area_mm2() > 0.0).map(edge).collect();
            let name = "reachable with A, B and C at 0".to_owned();
            spaces.push(Space { name, views: 0xff, filled: false, loops });
        }
    }
    spaces
}
