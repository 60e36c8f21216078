//! MOMA, MOMA 4S and any other planar mechanism: two guides, two links, the platform; in the plane of X and Y.

use super::{Kind, Pen, Point, X, Y, along};
use pkm_kins::planar::PlanarChain;
use pkm_kins::{Joints, Moma4s, Planar, Pose, Vec2, Vec3};

/// Where a plane lies in the scene.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    pub origin: Vec3,
    pub right: Vec3,
    pub up: Vec3,
}

impl Plane {
    pub(super) const XY: Self = Self { origin: [0.0; 3], right: X, up: Y };

    pub(super) fn at(&self, [x, y]: Vec2) -> Vec3 {
        along(along(self.origin, x, self.right), y, self.up)
    }

    fn turned(&self, [x, y]: Vec2) -> Vec3 {
        along(along([0.0; 3], x, self.right), y, self.up)
    }
}

pub(super) fn draw(m: &Planar, joints: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["X", "Y", ""]);
    pen.view("plane", false, X, Y);
    let hinges = chains(m, [0, 1], joints, [pose.x, pose.y], Plane::XY, pen);
    let tip = pen.moving([pose.x, pose.y, 0.0]);
    if m.chains().iter().any(|chain| chain.offset_mm != [0.0; 2]) {
        pen.part(Kind::Platform, "platform", &[hinges[0], hinges[1], tip], None);
    }
    pen.part(Kind::Hinge, "platform joints", &hinges, None);
    pen.path("tool", [0, 1, -1], [0.0; 3], &[], tip);
}

pub(super) fn draw_4s(m: &Moma4s, joints: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["X", "Y", ""]);
    pen.view("plane", false, X, Y);
    let tip = pen.moving([pose.x, pose.y, 0.0]);
    platform(m, [0, 1], joints, [pose.x, pose.y], Plane::XY, pen);
    pen.path("tool", [0, 1, -1], [0.0; 3], &[], tip);
}

/// Guides, sliders and links with T at `t`; returns the platform's hinges. `numbers` are the machine's joints.
fn chains(
    m: &Planar,
    numbers: [usize; 2],
    joints: &Joints,
    t: Vec2,
    plane: Plane,
    pen: &mut Pen<'_>,
) -> [Point; 2] {
    let both = m.chains();
    [0, 1].map(|i| {
        let number = numbers[i];
        let value = joints.get(number).copied().unwrap_or_default();
        let PlanarChain { reference_mm, direction, offset_mm, .. } = both[i];
        let slider = pen.slider(number, plane.at(reference_mm), plane.turned(direction), value);
        let hinge = pen.moving(plane.at([t[0] + offset_mm[0], t[1] + offset_mm[1]]));
        pen.part(Kind::Link, if i == 0 { "link 1" } else { "link 2" }, &[slider, hinge], Some(number));
        pen.part(Kind::Hinge, "slider joint", &[slider], Some(number));
        hinge
    })
}

/// Half the distance of the two links of a pair, as drawn: no paper gives it.
const PAIR_MM: f64 = 14.0;

/// A MOMA 4S with T at `t`: the platform on two pairs of links. Only one link of each pair is in the kinematics; the
/// other is drawn beside it, as far away as looks well. Returns P.
pub(super) fn platform(
    m: &Moma4s,
    numbers: [usize; 2],
    joints: &Joints,
    t: Vec2,
    plane: Plane,
    pen: &mut Pen<'_>,
) -> Point {
    let tool = m.tool_mm();
    let p = [t[0] - tool[0], t[1] - tool[1]];
    let mut corners = Vec::new();
    for (number, chain) in numbers.into_iter().zip(m.planar.chains()) {
        let value = joints.get(number).copied().unwrap_or_default();
        let PlanarChain { reference_mm, direction, offset_mm, .. } = chain;
        pen.slider(number, plane.at(reference_mm), plane.turned(direction), value);
        let slider = [reference_mm[0] + value * direction[0], reference_mm[1] + value * direction[1]];
        let hinge = [t[0] + offset_mm[0], t[1] + offset_mm[1]];
        for (side, name) in [(-PAIR_MM, "link"), (PAIR_MM, "its twin")] {
            // Both ends shifted alike, so the pair stays parallel and of one length.
            let from = pen.moving(plane.at([slider[0], slider[1] + side]));
            let to = pen.moving(plane.at([hinge[0], hinge[1] + side]));
            pen.part(Kind::Link, name, &[from, to], Some(number));
            pen.part(Kind::Hinge, "hinges", &[from, to], Some(number));
            corners.push(to);
        }
    }
    let [a, b, c, d] = [corners[0], corners[1], corners[3], corners[2]];
    pen.part(Kind::Platform, "platform", &[a, b, c, d], None);
    pen.moving(plane.at(p))
}
