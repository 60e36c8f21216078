//! Plain Cartesian machine: the tool under three slides.

use super::{Kind, Pen, X, Z, along};
use pkm_kins::{Axis, Cartesian, Joints, Kinematics, Pose};

pub(super) fn draw(m: &Cartesian, _: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["X", "Y", "Z"]);
    pen.view("space", true, X, Z);
    let joint = |axis: Axis| m.axes().iter().position(|other| other == axis);
    let range = |axis: Axis| {
        let range = pen.machine.joints.get(joint(axis)?)?.range;
        Some((range.min, range.max))
    };
    let [x, y, z] = [Axis::X, Axis::Y, Axis::Z].map(|axis| range(axis).unwrap_or((0.0, 0.0)));
    // A bridge above the travel: it runs along Y, the slide on it along X, the quill down it along Z.
    let top = z.1;
    for side in [x.0, x.1] {
        let ends = [[side, y.0, top], [side, y.1, top]].map(|point| pen.fixed(point));
        pen.part(Kind::Rail, "", &ends, joint(Axis::Y));
    }
    let feet =
        [[x.0, y.0, z.0], [x.1, y.0, z.0], [x.1, y.1, z.0], [x.0, y.1, z.0]].map(|point| pen.fixed(point));
    pen.part(Kind::Body, "travel", &feet, None);
    let bridge = [[x.0, pose.y, top], [x.1, pose.y, top]].map(|point| pen.moving(point));
    pen.part(Kind::Link, "bridge", &bridge, joint(Axis::Y));
    let slide = pen.moving([pose.x, pose.y, top]);
    pen.part(Kind::Slider, "x", &[slide, bridge[0], bridge[1]], joint(Axis::X));
    let tip = pen.moving([pose.x, pose.y, pose.z]);
    pen.part(Kind::Tool, "quill", &[slide, tip], None);
    pen.path("tool", [0, 1, 2], [0.0; 3], &[], tip);
}

/// The tool alone.
pub(super) fn draw_tool(pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["X", "Y", "Z"]);
    pen.view("space", true, X, Z);
    let tip = [pose.x, pose.y, pose.z];
    let points = [tip, along(tip, 50.0, Z)].map(|point| pen.moving(point));
    pen.part(Kind::Tool, "tool", &points, None);
    pen.path("tool", [0, 1, 2], [0.0; 3], &[], points[0]);
}
