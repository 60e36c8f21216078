//! Hexapod: base, six struts, platform.

use super::{Kind, Pen, X, Z};
use pkm_kins::{Hexapod, Joints, Pose};

pub(super) fn draw(m: &Hexapod, _: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["X", "Y", "Z"]);
    pen.view("space", true, X, Z);
    let (mut base, mut platform) = (Vec::new(), Vec::new());
    for (i, [low, high]) in m.strut_points(pose).into_iter().enumerate() {
        let (low, high) = (pen.fixed(low), pen.moving(high));
        let name = pen.machine.joints.get(i).map_or_else(String::new, |joint| joint.name.clone());
        pen.part(Kind::Strut, &name, &[low, high], Some(i));
        pen.part(Kind::Hinge, "joints", &[low, high], None);
        base.push(low);
        platform.push(high);
    }
    pen.part(Kind::Body, "base", &base, None);
    pen.part(Kind::Platform, "platform", &platform, None);
    let tip = pen.moving([pose.x, pose.y, pose.z]);
    pen.path("platform", [0, 1, 2], [0.0; 3], &[], tip);
}
