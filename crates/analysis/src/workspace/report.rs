//! Everything about a machine's workspace at once: numbers with their errors, tables, pictures.

use super::map::{self, Map};
use super::polar::{self, Kind, Solid, Steps};
use super::region::Chain;
use super::{Boundary, Cause, Curve, Section, View, WorkspaceError, views};
use crate::figure::{label, nice_step, planar, spatial};
use pkm_kins::machine::Mechanism;
use pkm_kins::maths::{degrees, hypot};
use pkm_kins::{Axis, Kinematics, Vec2};
use pkm_machine::Machine;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{self, Write};

/// Version of the summary.
pub const SCHEMA: u32 = 1;

/// What is asked.
#[derive(Debug, Clone, Copy, Default)]
pub struct Question {
    /// Distance of the nodes of a map or of the planes of a scan, mm; chosen without.
    pub resolution_mm: Option<f64>,
    /// Where a machine with more axes is cut.
    pub section: Section,
    /// Threads; the answer does not depend on them.
    pub threads: usize,
}

/// The answer: a summary, and what tables and pictures are made of.
#[derive(Debug, Clone)]
pub struct Answer {
    /// For scripts and people.
    pub summary: Summary,
    planes: Vec<PlaneAnswer>,
    solids: Vec<Solid>,
    machine: Machine,
}

#[derive(Debug, Clone)]
struct PlaneAnswer {
    view: View,
    reachable: Boundary,
    usable: Boundary,
    map: Map,
}

/// The summary that scripts rely on; mm, mm², mm³.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Version of this format.
    pub schema: u32,
    /// The machine's name.
    pub machine: String,
    /// `kinematics.type`
    pub mechanism: String,
    /// Reachable area of the first view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_mm2: Option<f64>,
    /// How far off it may be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_error_bound_mm2: Option<f64>,
    /// Volumes by name: `achievable`, `zero_orientation`, `total_orientation`, or one per view that sweeps a volume.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub volume_mm3: BTreeMap<String, f64>,
    /// How far off each may be from what its definition (boundary, or the steps of the scan) says.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub volume_error_bound_mm3: BTreeMap<String, f64>,
    /// For scans: how far the steps may leave it from the continuous volume; an estimate.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub volume_step_estimate_mm3: BTreeMap<String, f64>,
    /// Lowest and highest coordinate of everything reachable, by axis letter.
    pub bounding_box_mm: BTreeMap<String, [f64; 2]>,
    /// What it was computed with.
    pub parameters: Parameters,
    /// The planes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<ViewSummary>,
    /// The scans.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub solids: Vec<SolidSummary>,
}

/// What it was computed with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameters {
    /// Distance of the nodes or planes, mm.
    pub resolution_mm: f64,
    /// Travel of every joint: name, lowest, highest (mm or degrees).
    pub joints: Vec<(String, f64, f64)>,
    /// MOMA-W: table position, mm, and tilt of the wire, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub section: Option<(f64, [f64; 2])>,
    /// Scans: rays per plane and step along a ray, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rays: Option<(usize, f64)>,
}

/// One plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViewSummary {
    /// What it is.
    pub name: String,
    /// The machine's axes to the right and up.
    pub axes: [String; 2],
    /// Everything that can be reached.
    pub area_mm2: f64,
    /// How far off that may be.
    pub area_error_bound_mm2: f64,
    /// Within one-sided guides; for the O-X glide within the guard of the form switch.
    pub usable_area_mm2: f64,
    /// How far off that may be.
    pub usable_area_error_bound_mm2: f64,
    /// Lowest and highest coordinate along the two axes.
    pub bounding_box_mm: [[f64; 2]; 2],
    /// Smallest and largest det K over the nodes of the map and the boundary; `null` where it has no bound (type 1).
    pub det_k: [Option<f64>; 2],
    /// Singularities within the stroke.
    pub type_1_in_stroke: bool,
    /// The same.
    pub type_2_in_stroke: bool,
    /// What moves the plane: axis, from, to, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep: Option<(String, f64, f64)>,
    /// The exact boundary of the reachable set: loops of pieces, the set on the left.
    pub boundary: Vec<Vec<PieceSummary>>,
}

/// One piece of a boundary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PieceSummary {
    /// What makes it.
    pub cause: Cause,
    /// `line`, `circle` or `ellipse`.
    pub shape: &'static str,
    /// Where it begins and ends, mm.
    pub from_mm: Vec2,
    /// mm
    pub to_mm: Vec2,
    /// Centre and half axes of an arc: points are centre + u cos φ + v sin φ, φ from and to in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arc: Option<ArcSummary>,
}

/// An arc.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct ArcSummary {
    pub centre_mm: Vec2,
    pub u_mm: Vec2,
    pub v_mm: Vec2,
    pub from_deg: f64,
    pub to_deg: f64,
}

/// One scan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SolidSummary {
    /// `zero_orientation`, `achievable`, `total_orientation`.
    pub name: &'static str,
    /// A, B, C from − to + this, degrees.
    pub angle_deg: f64,
    /// So many values each.
    pub values: usize,
    /// All of them or at least one.
    pub every: bool,
    /// dz ∑ areas.
    pub volume_mm3: f64,
    /// What bisection may have left.
    pub error_bound_mm3: f64,
    /// What the steps may have left; an estimate.
    pub step_estimate_mm3: f64,
    /// Lowest and highest plane.
    pub planes_mm: [f64; 2],
    /// The longest ray.
    pub largest_radius_mm: f64,
    /// Smallest measure of a direct singularity (|σ|) at the middle, half and end of every ray.
    pub sampled_singularity: f64,
}

/// Works out the workspace of a machine.
///
/// # Errors
/// See [`WorkspaceError`].
pub fn answer(machine: &Machine, question: &Question) -> Result<Answer, WorkspaceError> {
    if let Some(value_mm) = question.resolution_mm
        && !(value_mm > 0.0 && value_mm.is_finite())
    {
        return Err(WorkspaceError::Resolution { value_mm });
    }
    let views = views(machine, &question.section)?;
    let joints = machine
        .joints
        .iter()
        .map(|joint| (joint.name.clone(), joint.to_face(joint.range.min), joint.to_face(joint.range.max)));
    let section = matches!(machine.mechanism, Mechanism::MomaW(_))
        .then(|| (question.section.z_mm.unwrap_or(machine.home.z), question.section.tilt_deg));
    let parameters = Parameters { resolution_mm: 0.0, joints: joints.collect(), section, rays: None };
    let mut answer = Answer {
        summary: Summary {
            schema: SCHEMA,
            machine: machine.name.clone(),
            mechanism: machine.mechanism_type.clone(),
            area_mm2: None,
            area_error_bound_mm2: None,
            volume_mm3: BTreeMap::new(),
            volume_error_bound_mm3: BTreeMap::new(),
            volume_step_estimate_mm3: BTreeMap::new(),
            bounding_box_mm: BTreeMap::new(),
            parameters,
            views: Vec::new(),
            solids: Vec::new(),
        },
        planes: Vec::new(),
        solids: Vec::new(),
        machine: machine.clone(),
    };
    if views.is_empty() {
        answer.spatial(question)?
    } else {
        answer.planar(views, question)?
    }
    Ok(answer)
}

/// Loads of an axis range into the summary's box.
fn widen(all: &mut BTreeMap<String, [f64; 2]>, axis: Axis, low: f64, high: f64) {
    let entry = all.entry(axis.letter().to_string()).or_insert([low, high]);
    *entry = [entry[0].min(low), entry[1].max(high)];
}

impl Answer {
    fn planar(&mut self, views: Vec<View>, question: &Question) -> Result<(), WorkspaceError> {
        for view in views {
            let (reachable, usable) = (view.reachable.boundary(), view.usable.boundary());
            let Some([low, high]) = reachable.bounding_box() else {
                return Err(WorkspaceError::Empty { view: view.name });
            };
            let step = question
                .resolution_mm
                .unwrap_or_else(|| nice_step((high[0] - low[0]).max(high[1] - low[1]), 250.0));
            let mut map = map::grid([low, high], step)?;
            view.fill(&mut map, question.threads.max(1));
            let summary = summarise(&view, &reachable, &usable, &map, [low, high]);
            let all = &mut self.summary;
            all.parameters.resolution_mm = step;
            all.area_mm2.get_or_insert(reachable.area_mm2);
            all.area_error_bound_mm2.get_or_insert(reachable.error_bound_mm2);
            for (index, &axis) in view.axes.iter().enumerate() {
                widen(&mut all.bounding_box_mm, axis, low[index], high[index]);
            }
            if let Some((axis, range)) = view.sweep {
                widen(&mut all.bounding_box_mm, axis, range.min, range.max);
                let (name, length) = (key(&view.name), range.max - range.min);
                all.volume_mm3.insert(name.clone(), reachable.area_mm2 * length);
                all.volume_error_bound_mm3.insert(name, reachable.error_bound_mm2 * length);
            }
            all.views.push(summary);
            self.planes.push(PlaneAnswer { view, reachable, usable, map });
        }
        Ok(())
    }

    fn spatial(&mut self, question: &Question) -> Result<(), WorkspaceError> {
        if matches!(self.machine.mechanism, Mechanism::Cartesian(_)) {
            return self.cartesian();
        }
        let dz_mm = question.resolution_mm.unwrap_or(Steps::default().dz_mm);
        let steps = Steps { dz_mm, d_rho_mm: 0.5 * dz_mm, ..Steps::default() };
        let turns =
            [Axis::A, Axis::B, Axis::C].iter().any(|axis| self.machine.mechanism.axes().contains(*axis));
        let kinds: &[Kind] = if turns {
            &[polar::TOTAL_ORIENTATION, polar::ZERO_ORIENTATION, polar::ACHIEVABLE]
        } else {
            &[polar::ZERO_ORIENTATION]
        };
        let threads = question.threads.max(1);
        let all = &mut self.summary;
        all.parameters.resolution_mm = dz_mm;
        all.parameters.rays = Some((steps.rays, steps.d_rho_mm));
        for &kind in kinds {
            let solid = match polar::scan(&self.machine, kind, steps, threads) {
                // No orientation may be possible everywhere; the machine still has a workspace.
                Err(WorkspaceError::Empty { .. }) if kind == polar::TOTAL_ORIENTATION => continue,
                other => other?,
            };
            let volume = solid.volume_mm3();
            all.volume_mm3.insert(kind.name.to_owned(), volume);
            all.volume_error_bound_mm3.insert(kind.name.to_owned(), solid.bisection_bound_mm3());
            all.volume_step_estimate_mm3.insert(kind.name.to_owned(), solid.step_estimate_mm3());
            if let Some([low, high]) = solid.bounding_box_mm() {
                for (index, axis) in [Axis::X, Axis::Y, Axis::Z].into_iter().enumerate() {
                    widen(&mut all.bounding_box_mm, axis, low[index], high[index]);
                }
                all.solids.push(SolidSummary {
                    name: kind.name,
                    angle_deg: kind.angle_deg,
                    values: kind.values,
                    every: kind.every,
                    volume_mm3: volume,
                    error_bound_mm3: solid.bisection_bound_mm3(),
                    step_estimate_mm3: solid.step_estimate_mm3(),
                    planes_mm: [low[2], high[2]],
                    largest_radius_mm: solid.largest_radius_mm(),
                    sampled_singularity: solid.nearest_singularity(&self.machine, threads),
                });
            }
            self.solids.push(solid);
        }
        Ok(())
    }

    /// Joint = coordinate: a box.
    fn cartesian(&mut self) -> Result<(), WorkspaceError> {
        let axes: Vec<Axis> = self.machine.mechanism.axes().iter().collect();
        let mut size = 1.0;
        let mut lengths = 0;
        for (axis, joint) in axes.into_iter().zip(&self.machine.joints) {
            let limits = self.machine.axis(axis).and_then(|limits| limits.range);
            let low = limits.map_or(joint.range.min, |r| r.min.max(joint.range.min));
            let high = limits.map_or(joint.range.max, |r| r.max.min(joint.range.max));
            if !(low <= high) {
                return Err(WorkspaceError::Empty { view: format!("axis {}", axis.letter()) });
            }
            if !axis.is_rotary() {
                widen(&mut self.summary.bounding_box_mm, axis, low, high);
                size *= high - low;
                lengths += 1;
            }
        }
        let all = &mut self.summary;
        if lengths == 2 {
            (all.area_mm2, all.area_error_bound_mm2) = (Some(size), Some(0.0));
        } else if lengths == 3 {
            all.volume_mm3.insert("achievable".to_owned(), size);
            all.volume_error_bound_mm3.insert("achievable".to_owned(), 0.0);
        }
        Ok(())
    }

    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let machine = &self.machine;
        if !self.solids.is_empty() {
            return spatial::figure(machine, &self.solids);
        }
        if self.planes.is_empty() {
            return spatial::boxed(machine, &self.summary.bounding_box_mm);
        }
        let notes: Vec<Vec<String>> =
            self.summary.views.iter().zip(&self.planes).map(|(view, plane)| notes(view, plane)).collect();
        let drawn: Vec<planar::Drawn<'_>> = self
            .planes
            .iter()
            .zip(&notes)
            .map(|(plane, notes)| planar::Drawn {
                view: &plane.view,
                reachable: &plane.reachable,
                usable: &plane.usable,
                map: &plane.map,
                notes,
            })
            .collect();
        let title = format!("Workspace of {}", machine.name);
        let subtitle = match self.summary.parameters.section {
            Some((z, [x, y])) => {
                format!(
                    "contour plane 1, table at z = {z} mm, wire tilted {x}° towards x and {y}° towards y, seen along the wire"
                )
            }
            None => machine.description.clone(),
        };
        planar::figure(&title, &subtitle, &drawn)
    }

    /// The table: every reachable node of the maps, or every ray of the scans.
    ///
    /// # Errors
    /// What writing says.
    pub fn csv(&self, out: &mut impl Write) -> io::Result<()> {
        if !self.solids.is_empty() {
            writeln!(out, "kind,z_mm,ray_deg,radius_mm,x_mm,y_mm")?;
            for solid in &self.solids {
                for plane in &solid.planes {
                    for (m, ([x, y], rho)) in plane.points().into_iter().zip(&plane.radii_mm).enumerate() {
                        let angle = 360.0 * m as f64 / solid.steps.rays as f64;
                        writeln!(out, "{},{},{angle},{rho:.3},{x:.3},{y:.3}", solid.kind.name, plane.z_mm)?;
                    }
                }
            }
            return Ok(());
        }
        if self.planes.is_empty() {
            writeln!(out, "axis,min_mm,max_mm")?;
            for (axis, [low, high]) in &self.summary.bounding_box_mm {
                writeln!(out, "{axis},{low},{high}")?;
            }
            return Ok(());
        }
        for (index, plane) in self.planes.iter().enumerate() {
            let chains: Vec<&Chain> = plane.view.mechanisms.iter().flat_map(|pair| &pair.chains).collect();
            if index == 0 {
                let [right, up] = plane.view.axes.map(|axis| axis.letter().to_ascii_lowercase());
                write!(out, "view,{right}_mm,{up}_mm")?;
                for number in 1..=chains.len() {
                    write!(out, ",p{number}_mm")?;
                }
                writeln!(out, ",det_k,usable")?;
            }
            for row in 0..plane.map.size[1] {
                for column in 0..plane.map.size[0] {
                    let value = plane.map.determinant[row * plane.map.size[0] + column];
                    if value.is_nan() {
                        continue;
                    }
                    let t = plane.map.node(column, row);
                    write!(out, "{},{:.4},{:.4}", key(&plane.view.name), t[0], t[1])?;
                    for chain in &chains {
                        write!(out, ",{:.4}", chain.solve(t).map_or(f64::NAN, |(p, _)| p))?;
                    }
                    writeln!(out, ",{value:.6},{}", u8::from(plane.view.usable.contains(t)))?;
                }
            }
        }
        Ok(())
    }

    /// Solids as OBJ files: name and text.
    pub fn objects(&self) -> Vec<(String, String)> {
        self.solids.iter().map(|solid| (format!("{}.obj", solid.kind.name), solid.obj())).collect()
    }
}

/// A view's name for files: its first word.
fn key(name: &str) -> String {
    name.split([' ', ',']).next().unwrap_or_default().to_owned()
}

/// Lines under a panel.
fn notes(view: &ViewSummary, plane: &PlaneAnswer) -> Vec<String> {
    let mut notes = vec![format!("reachable {:.1} mm² (± {:.3})", view.area_mm2, view.area_error_bound_mm2)];
    if view.area_mm2 - view.usable_area_mm2 > 1e-3 + view.area_error_bound_mm2 {
        let what =
            if plane.view.is_glide() { "outside the form switch's guard" } else { "with one-sided guides" };
        notes.push(format!("{what} {:.1} mm²", view.usable_area_mm2));
    }
    let bound = |value: Option<f64>, none: &str| value.map_or(none.to_owned(), |v| label(v, 0.001));
    notes.push(format!(
        "det K from {} to {}",
        bound(view.det_k[0], "\u{2212}\u{221e}"),
        bound(view.det_k[1], "\u{221e}")
    ));
    if let Some((axis, low, high)) = &view.sweep {
        let volume = view.area_mm2 * (high - low);
        let (low, high) = (label(*low, 0.1), label(*high, 0.1));
        notes.push(format!("swept along {axis} from {low} to {high} mm: {volume:.0} mm³"));
    }
    notes
}

fn summarise(
    view: &View,
    reachable: &Boundary,
    usable: &Boundary,
    map: &Map,
    [low, high]: [Vec2; 2],
) -> ViewSummary {
    let pieces = || reachable.loops.iter().flatten();
    let type_1 = pieces().any(|piece| matches!(piece.cause, Cause::Type1(_)));
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    let edge =
        pieces().flat_map(|piece| (1..32).map(|k| view.determinant(piece.curve.at(f64::from(k) / 32.0))));
    let corners = pieces().map(|piece| view.determinant(piece.curve.at(0.0)));
    for value in map.determinant.iter().copied().chain(edge).chain(corners) {
        if value.is_finite() {
            range = [range[0].min(value), range[1].max(value)];
        }
    }
    // Next to a link square to its guide det K has no bound.
    let bounded = |value: f64| (!type_1 || value.abs() < 1e3).then_some(value);
    ViewSummary {
        name: view.name.clone(),
        axes: view.axes.map(|axis| axis.letter().to_string()),
        area_mm2: reachable.area_mm2,
        area_error_bound_mm2: reachable.error_bound_mm2,
        usable_area_mm2: usable.area_mm2,
        usable_area_error_bound_mm2: usable.error_bound_mm2,
        bounding_box_mm: [[low[0], high[0]], [low[1], high[1]]],
        det_k: range.map(bounded),
        type_1_in_stroke: type_1,
        type_2_in_stroke: pieces().any(|piece| piece.cause == Cause::Type2),
        sweep: view.sweep.map(|(axis, range)| (axis.letter().to_string(), range.min, range.max)),
        boundary: reachable.loops.iter().map(|chain| chain.iter().map(piece).collect()).collect(),
    }
}

fn piece(piece: &super::Piece) -> PieceSummary {
    let curve = &piece.curve;
    let (shape, arc) = match *curve {
        Curve::Segment { .. } => ("line", None),
        Curve::Arc { centre, u, v, start, end } => {
            let (a, b) = (hypot(u[0], u[1]), hypot(v[0], v[1]));
            let round = (a - b).abs() < 1e-9 * a && (u[0] * v[0] + u[1] * v[1]).abs() < 1e-9 * a * b;
            let arc = ArcSummary {
                centre_mm: centre,
                u_mm: u,
                v_mm: v,
                from_deg: degrees(start),
                to_deg: degrees(end),
            };
            (if round { "circle" } else { "ellipse" }, Some(arc))
        }
    };
    PieceSummary { cause: piece.cause, shape, from_mm: curve.at(0.0), to_mm: curve.at(1.0), arc }
}
