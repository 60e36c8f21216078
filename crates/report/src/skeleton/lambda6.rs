//! Lambda: three shafts with two sliders each, long and short chains, the platform.

use super::{Kind, Pen, X, Z};
use pkm_kins::{Joints, Lambda6, Pose};

pub(super) fn draw(m: &Lambda6, joints: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["X", "Y", "Z"]);
    pen.view("space", true, X, Z);
    let legs = m.leg_points(pose, joints);
    let mut corners = Vec::new();
    for (i, [upper, elbow, platform, lower]) in legs.into_iter().enumerate() {
        // One shaft for both; joints count downwards.
        let travel = [i, i + 3]
            .map(|joint| pen.machine.joints.get(joint).map_or((0.0, 0.0), |j| (j.range.min, j.range.max)));
        let ends = [travel[0].0.min(travel[1].0), travel[0].1.max(travel[1].1)];
        let ends = ends.map(|down| pen.fixed([upper[0], upper[1], -down]));
        pen.part(Kind::Rail, "", &ends, None);
        let high = pen.on_rail(i, ends, upper);
        let low = pen.on_rail(i + 3, ends, lower);
        let [elbow, platform] = [elbow, platform].map(|point| pen.moving(point));
        pen.part(Kind::Link, &format!("long chain {}", i + 1), &[high, platform], Some(i));
        pen.part(Kind::Link, &format!("short chain {}", i + 1), &[low, elbow], Some(i + 3));
        pen.part(Kind::Hinge, "joints", &[high, low, elbow, platform], None);
        corners.push(platform);
    }
    pen.part(Kind::Platform, "platform", &corners, None);
    let tip = pen.moving([pose.x, pose.y, pose.z]);
    pen.path("platform", [0, 1, 2], [0.0; 3], &[], tip);
}
