//! O-X glide: two pairs of sliders on cross rails, four links, the platform; the rails travel along z.

use super::{Kind, Pen, X, Y, Z};
use pkm_kins::{Joints, OxGlide, Pose};

/// Half the distance of the two sliders of a pair across the rails, as drawn: the paper's pairs are rigid.
const PAIR_MM: f64 = 12.0;

pub(super) fn draw(m: &OxGlide, joints: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    pen.axes(["X", "Y", "Z"]);
    let plane = pen.view("plane: X Y", false, X, Y);
    let space = pen.view("space", true, X, Y);
    let [ab, cd, z, ..] = *joints;
    let [_, width, _] = m.dimensions_mm();
    let half = width / 2.0;
    let [r_ab, r_cd] =
        [0, 1].map(|j| pen.machine.joints.get(j).map_or((0.0, 0.0), |l| (l.range.min, l.range.max)));
    let (low, high) = (r_ab.0.min(r_cd.0), r_ab.1.max(r_cd.1));
    for (side, views) in [(-PAIR_MM, plane | space), (PAIR_MM, space)] {
        pen.views = views;
        let at = |x: f64, y: f64| [x, y, z + side];
        // The rails move along z with everything else.
        let rail = [low, high].map(|x| pen.moving(at(x, 0.0)));
        pen.part(Kind::Rail, "", &rail, None);
        let hinge_ab = pen.moving(at(pose.x - half, pose.y));
        let hinge_cd = pen.moving(at(pose.x + half, pose.y));
        for (joint, x, hinge, name) in [(0, ab, hinge_ab, "AB"), (1, cd, hinge_cd, "CD")] {
            let slider = pen.moving(at(x, 0.0));
            let label = if side < 0.0 { name } else { "" };
            pen.part(Kind::Slider, label, &[slider, rail[0], rail[1]], Some(joint));
            pen.part(Kind::Link, name, &[slider, hinge], Some(joint));
            pen.part(Kind::Hinge, name, &[slider, hinge], Some(joint));
        }
        pen.part(Kind::Platform, "platform", &[hinge_ab, hinge_cd], None);
    }
    pen.views = space;
    let ends = [low, high].map(|x| [-PAIR_MM, PAIR_MM].map(|side| pen.moving([x, 0.0, z + side])));
    pen.part(Kind::Body, "bridge", &[ends[0][0], ends[1][0], ends[1][1], ends[0][1]], Some(2));
    for (n, x) in [low, high].into_iter().enumerate() {
        if n == 0 {
            pen.slider(2, [x, 0.0, 0.0], Z, z);
        } else if let Some(limits) = pen.machine.joints.get(2) {
            let twin = [limits.range.min, limits.range.max].map(|z| pen.fixed([x, 0.0, z]));
            pen.part(Kind::Rail, "", &twin, None);
        }
    }
    pen.views = plane | space;
    let tip = pen.moving([pose.x, pose.y, pose.z]);
    pen.path("platform", [0, 1, 2], [0.0; 3], &[], tip);
}
