//! Linear delta: three columns with carriages, rods to the platform's centre (the columns are moved inwards by the
//! platform's radius, as the kinematics has them).

use super::{Kind, Pen, X, Z};
use pkm_kins::{Joints, LinearDelta, Pose};

pub(super) fn draw(m: &LinearDelta, joints: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["X", "Y", "Z"]);
    pen.view("space", true, X, Z);
    let tip = pen.moving([pose.x, pose.y, pose.z]);
    for (i, [x, y]) in m.columns_mm().into_iter().enumerate() {
        let carriage = pen.slider(i, [x, y, 0.0], Z, joints[i]);
        pen.part(Kind::Link, &format!("rod {}", i + 1), &[carriage, tip], Some(i));
        pen.part(Kind::Hinge, "joints", &[carriage, tip], None);
    }
    pen.path("platform", [0, 1, 2], [0.0; 3], &[], tip);
}
