//! The workspace behind the path: the exact outlines of `pkm-analysis`, put where the drawing has their plane.

use pkm_analysis::workspace::outline;
use pkm_kins::{Mechanism, OxForm, Pose, Vec3};
use pkm_machine::Machine;
use serde::Serialize;

use crate::skeleton::hv_plane;

/// Chords of the outlines are at most so far off, mm.
const TOLERANCE_MM: f64 = 0.05;

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

/// The workspaces of a machine; none where only a scan could tell.
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
    spaces
}
