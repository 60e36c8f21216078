//! MOMA-W: two MOMA 4S in parallel planes, the wire between their platforms, the contours it cuts; in {B1}.

use super::planar::{Plane, platform};
use super::{Kind, Pen, X, Y, along};
use pkm_kins::{Joints, MomaW, Pose, Vec3};

pub(super) fn draw(m: &MomaW, joints: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["x", "y", "z"]);
    let first = pen.view("plane 1: X Y", false, X, Y);
    let second = pen.view("plane 2: U V", false, X, Y);
    let space = pen.view("space", true, X, Y);
    let [m1, m2] = m.mechanisms();
    let (b, w, d) = m.frames_mm();
    let z1 = w[2] + pose.z;
    // The wire's ends, from the contours: [W] (3), (4).
    let c1 = [pose.x + w[0], pose.y + w[1], z1];
    let c2 = [pose.u + w[0], pose.v + w[1], z1 + d];
    let lean: Vec3 = [c2[0] - c1[0], c2[1] - c1[1], d];
    let p1 = along(c1, -z1 / d, lean);
    let p2 = along(c1, (b[2] - z1) / d, lean);

    pen.views = first | space;
    let end1 = platform(m1, [0, 1], joints, [p1[0], p1[1]], Plane::XY, pen);
    pen.views = second | space;
    let plane = Plane { origin: b, ..Plane::XY };
    let end2 = platform(m2, [2, 3], joints, [p2[0] - b[0], p2[1] - b[1]], plane, pen);

    pen.views = space;
    pen.part(Kind::Wire, "wire", &[end1, end2], None);
    // The block of foam between the contour planes, as drawn.
    let corners = [(-75.0, -25.0), (75.0, -25.0), (75.0, 25.0), (-75.0, 25.0)];
    let near = corners.map(|(x, y)| pen.moving([w[0] + x, w[1] + y, z1]));
    let far = corners.map(|(x, y)| pen.moving([w[0] + x, w[1] + y, z1 + d]));
    pen.part(Kind::Body, "contour plane 1", &near, Some(4));
    pen.part(Kind::Body, "contour plane 2", &far, Some(4));
    pen.slider(4, [w[0] - 110.0, w[1] - 40.0, w[2]], [0.0, 0.0, 1.0], joints[4]);

    let origin = pen.moving([w[0], w[1], z1]);
    let (tip1, tip2) = (pen.moving(c1), pen.moving(c2));
    pen.views = first | space;
    pen.path("contour 1", [0, 1, -1], [0.0; 3], &[origin], tip1);
    pen.views = second | space;
    pen.path("contour 2", [6, 7, -1], [0.0, 0.0, d], &[origin], tip2);
}
