//! MOMA HV-Mill: both mechanisms (or one), carriage, table, workpiece and tools.
//!
//! Scene: q1 to the right (x), q2 up (z), q3 to the front (−y): {Q} of both mechanisms lie alike, so that their third axes,
//! which the one carriage is common to, are parallel. The origin is that of {B_V}, or of the only mechanism; {B_H} then
//! lies where both put the centre of the table at one place.

use super::planar::{Plane, platform};
use super::{Kind, Pen, Point, X, Z, along};
use pkm_kins::{HvMachine, HvMill, Joints, Spindle, Vec3};

/// {B_j} in the scene.
struct Base {
    spindle: Spindle,
    origin: Vec3,
}

impl Base {
    fn turned(&self, v: Vec3) -> Vec3 {
        let [q1, q2, q3] = self.spindle.to_q(v);
        [q1, -q3, q2]
    }

    fn at(&self, v: Vec3) -> Vec3 {
        along(self.origin, 1.0, self.turned(v))
    }
}

/// Places of the joints of one mechanism in the machine.
struct Places {
    chains: [usize; 2],
    carriage: usize,
    table: usize,
    head: usize,
}

pub(super) fn draw(m: &HvMill, joints: &Joints, pen: &mut Pen<'_>) {
    scene(pen);
    let base = Base { spindle: m.spindle(), origin: [0.0; 3] };
    let places = Places { chains: [0, 1], carriage: 2, table: 3, head: 4 };
    let half = largest(m.workpiece_mm(), m.spindle());
    let centre = table(m, &base, &places, joints, half, pen);
    let height = up(m.workpiece_mm(), m.spindle());
    workpiece(m, &base, &places, joints, [half, height], centre, pen);
    mechanism(m, &base, &places, joints, [0, 1, 2], "tool", pen);
}

pub(super) fn draw_both(m: &HvMachine, joints: &Joints, pen: &mut Pen<'_>) {
    scene(pen);
    let [h, v] = m.mechanisms();
    let base_v = Base { spindle: Spindle::V, origin: [0.0; 3] };
    let base_h = base_h(m);
    let places_h = Places { chains: [0, 1], carriage: 4, table: 5, head: 6 };
    let places_v = Places { chains: [2, 3], ..places_h };
    let half = largest(h.workpiece_mm(), Spindle::H).max(largest(v.workpiece_mm(), Spindle::V));
    let centre = table(v, &base_v, &places_v, joints, half, pen);
    let height = up(v.workpiece_mm(), Spindle::V);
    workpiece(v, &base_v, &places_v, joints, [half, height], centre, pen);
    mechanism(h, &base_h, &places_h, joints, [0, 1, 2], "H tool", pen);
    mechanism(v, &base_v, &places_v, joints, [6, 7, 8], "V tool", pen);
}

/// {B_H} of a machine with both: the centre of the table is where {B_V} has it.
fn base_h(both: &HvMachine) -> Base {
    let [h, v] = both.mechanisms();
    let (v_in, h_in) =
        (Base { spindle: Spindle::V, origin: [0.0; 3] }, Base { spindle: Spindle::H, origin: [0.0; 3] });
    let origin = along(v_in.at(v.table_centre_mm(0.0)), -1.0, h_in.turned(h.table_centre_mm(0.0)));
    Base { origin, ..h_in }
}

/// A point of the plane that the tool's tip can be in, in the scene: `point` are the coordinates of {W} to the right and up,
/// with the table at 0.
pub(crate) fn plane(m: &HvMill, both: Option<&HvMachine>, point: [f64; 2]) -> Vec3 {
    let base = match (both, m.spindle()) {
        (Some(both), Spindle::H) => base_h(both),
        (_, spindle) => Base { spindle, origin: [0.0; 3] },
    };
    let (origin, [x, y, z]) = m.workpiece_frame(0.0, 0.0);
    let up = if m.spindle() == Spindle::H { y } else { z };
    let [_, _, tip] = m.tool_points([0.0; 2], 0.0);
    let at = base.at(along(along(origin, point[0], x), point[1], up));
    // Across the plane only the tool counts, not the carriage.
    [at[0], base.at(tip)[1], at[2]]
}

fn scene(pen: &mut Pen<'_>) {
    pen.axes(["q1", "−q3", "q2"]);
    pen.view("space", true, X, Z);
}

/// How far the origin of {W} lies from the table's axis, and how high: what the workpiece is drawn with (at least 60 mm).
fn largest(w0: Vec3, spindle: Spindle) -> f64 {
    let [q1, _, q3] = spindle.to_q(w0);
    q1.abs().max(q3.abs()).max(60.0)
}

fn up(w0: Vec3, spindle: Spindle) -> f64 {
    spindle.to_q(w0)[1].max(20.0)
}

fn value(joints: &Joints, place: usize) -> f64 {
    joints.get(place).copied().unwrap_or_default()
}

/// Carriage and rotary table; returns the table's centre in the scene.
fn table(m: &HvMill, base: &Base, places: &Places, joints: &Joints, half: f64, pen: &mut Pen<'_>) -> Vec3 {
    let carriage = value(joints, places.carriage);
    let reference = base.at(m.table_centre_mm(0.0));
    let centre = base.at(m.table_centre_mm(carriage));
    let direction = along(base.at(m.table_centre_mm(1.0)), -1.0, reference);
    let below = |point: Vec3| along(point, -30.0, Z);
    pen.slider(places.carriage, below(reference), direction, carriage);
    let radius = 1.5 * half;
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let body =
        corners.map(|(x, y)| pen.moving(along(along(below(centre), x * radius, X), y * radius, direction)));
    pen.part(Kind::Body, "carriage", &body, Some(places.carriage));
    let (_, axes) = m.workpiece_frame(carriage, value(joints, places.table));
    // The axes of {W} that lie in the table.
    let flat = match m.spindle() {
        Spindle::H => [axes[0], axes[2]],
        Spindle::V => [axes[0], axes[1]],
    };
    let points =
        [centre, along(centre, radius, base.turned(flat[0])), along(centre, radius, base.turned(flat[1]))]
            .map(|point| pen.moving(point));
    pen.part(Kind::Disc, "table", &points, Some(places.table));
    centre
}

/// A block on the table, as large as the origins of {W} suggest: no paper gives one.
fn workpiece(
    m: &HvMill,
    base: &Base,
    places: &Places,
    joints: &Joints,
    [half, height]: [f64; 2],
    centre: Vec3,
    pen: &mut Pen<'_>,
) {
    let (_, axes) = m.workpiece_frame(value(joints, places.carriage), value(joints, places.table));
    let (u, v) = match m.spindle() {
        Spindle::H => (base.turned(axes[0]), base.turned(axes[2])),
        Spindle::V => (base.turned(axes[0]), base.turned(axes[1])),
    };
    let faces = [0.0, height].map(|z| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| pen.moving(along(along(along(centre, z, Z), x * half, u), y * half, v)))
    });
    for face in &faces {
        pen.part(Kind::Body, "workpiece", face, Some(places.table));
    }
    let [low, high] = &faces;
    for (a, b) in low.iter().zip(high) {
        pen.part(Kind::Body, "workpiece", &[*a, *b], Some(places.table));
    }
}

fn mechanism(
    m: &HvMill,
    base: &Base,
    places: &Places,
    joints: &Joints,
    letters: [i8; 3],
    name: &str,
    pen: &mut Pen<'_>,
) {
    let planar = &m.mechanism().planar;
    let [c1, c2] = places.chains;
    // Joints without a pose do not come here; a frame at the reference points is better than none.
    let q = planar.forward([value(joints, c1), value(joints, c2)]).unwrap_or_default();
    let plane = Plane { origin: base.origin, right: X, up: Z };
    platform(m.mechanism(), places.chains, joints, q, plane, pen);
    let [p, centre, tip] =
        m.tool_points(q, value(joints, places.head)).map(|point| pen.moving(base.at(point)));
    if centre != tip {
        pen.part(Kind::Tool, "head", &[p, centre], None);
    }
    pen.part(Kind::Tool, name, &[centre, tip], None);
    let (origin, axes) = m.workpiece_frame(value(joints, places.carriage), value(joints, places.table));
    let frame: [Point; 4] = pen.frame(base.at(origin), axes.map(|axis| base.turned(axis)));
    pen.path(name, letters, [0.0; 3], &frame, tip);
}
