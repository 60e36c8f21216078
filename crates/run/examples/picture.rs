//! Draws the picture of the README from a real run: `cargo run --example picture > docs/moma-w-aerofoil.svg`.
//!
//! The executed path of the wire in both contour planes, and the MOMA-W in one pose of it, in oblique projection.
#![allow(clippy::print_stdout)]

use pkm_hal_sim::{Edge, Observer, Simulation, TickReport};
use pkm_kins::{Kinematics, Pose};
use pkm_machine::Machine;
use pkm_run::{Options, Program, run};
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Keeps one pose in so many ticks.
struct Path(Vec<Pose>);

impl Observer for Path {
    fn wants_edges(&self) -> bool {
        false
    }
    fn edge(&mut self, _: &Edge) {}
    fn tick(&mut self, report: &TickReport<'_>) {
        if report.tick.is_multiple_of(60) {
            self.0.push(report.setpoint.pose);
        }
    }
}

/// {B1} (x right, y up, z away from the reader), mm → picture.
fn project([x, y, z]: [f64; 3]) -> (f64, f64) {
    (330.0 + 1.15 * x + 0.62 * z, 40.0 - 1.15 * y - 0.30 * z + 150.0)
}

fn polyline(svg: &mut String, class: &str, points: impl IntoIterator<Item = [f64; 3]>) {
    let _ = write!(svg, "<polyline class=\"{class}\" points=\"");
    for point in points {
        let (x, y) = project(point);
        let _ = write!(svg, "{x:.1},{y:.1} ");
    }
    svg.push_str("\"/>\n");
}

fn dot(svg: &mut String, class: &str, point: [f64; 3], radius: f64) {
    let (x, y) = project(point);
    let _ = writeln!(svg, "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>");
}

fn main() {
    let machine = Machine::load("moma-w", &[]).expect("a shipped machine");
    let program = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../programs/moma-w-aerofoil.ngc");
    let keep = |_: &Simulation| Path(Vec::new());
    let go = |_: &pkm_run::Progress| ControlFlow::Continue(());
    let (_, path) = run(&Program::File(program), &machine, &Options::default(), keep, go).expect("readable");
    let Path(poses) = path.expect("the program runs");

    // The frames of [W] with the machine file's defaults: {W} in {B1}, the contour planes at z_1 and z_1 + D.
    let (w, span, planes) = ([0.0, -270.0, 100.0], 200.0, 500.0);
    let contour = |p: &Pose, second: bool| {
        let (x, y, z) = if second { (p.u, p.v, span) } else { (p.x, p.y, 0.0) };
        [x + w[0], y + w[1], w[2] + p.z + z]
    };
    // The wire from platform to platform: through both contour points.
    let wire = |p: &Pose| {
        let (a, b) = (contour(p, false), contour(p, true));
        let at = |z: f64| {
            let t = (z - a[2]) / (b[2] - a[2]);
            [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), z]
        };
        [at(0.0), at(planes)]
    };

    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"170 40 640 500\" font-family=\"sans-serif\" font-size=\"15\">\n\
         <style>polyline{fill:none;stroke-linejoin:round;stroke-linecap:round}.rail{stroke:#999;stroke-width:7}\
         .link{stroke:#0072b2;stroke-width:5}.bar{stroke:#0072b2;stroke-width:8}.wire{stroke:#d55e00;stroke-width:2.5}\
         .sheet{stroke:#d55e00;stroke-width:.5;opacity:.35}.path{stroke:#d55e00;stroke-width:1.5}\
         .block{stroke:#777;stroke-width:1;stroke-dasharray:4 4}.joint{fill:#fff;stroke:#0072b2;stroke-width:2.5}\
         .slider{fill:#333}text{fill:#333}</style>\n<rect x=\"170\" y=\"40\" width=\"640\" height=\"500\" fill=\"#fff\"/>\n",
    );
    let here = poses[poses.len() * 3 / 10];
    let joints = machine.mechanism.inverse(&here).expect("the pose was driven");
    // The far mechanism first, the near one last.
    for (mechanism, z) in [(1, planes), (0, 0.0)] {
        let platform = wire(&here)[mechanism];
        for (chain, side) in [(0, -1.0), (1, 1.0)] {
            let slider = [side * 110.0, -20.0 - joints[2 * mechanism + chain], z];
            let joint = [platform[0] + side * 30.0, platform[1], z];
            polyline(&mut svg, "rail", [[side * 110.0, -20.0, z], [side * 110.0, -220.0, z]]);
            polyline(&mut svg, "link", [slider, joint]);
            dot(&mut svg, "slider", slider, 9.0);
        }
        polyline(
            &mut svg,
            "bar",
            [[platform[0] - 30.0, platform[1], z], [platform[0] + 30.0, platform[1], z]],
        );
        for side in [-30.0, 30.0] {
            dot(&mut svg, "joint", [platform[0] + side, platform[1], z], 5.0);
        }
        if mechanism == 1 {
            for pair in poses.iter().step_by(6).map(|p| [contour(p, false), contour(p, true)]) {
                polyline(&mut svg, "sheet", pair);
            }
            for second in [true, false] {
                polyline(&mut svg, "path", poses.iter().map(|p| contour(p, second)));
            }
        }
    }
    let (low, high, near) = ([-56.0, -286.0], [62.0, -252.0], w[2] + here.z);
    for z in [near, near + span] {
        let [x0, y0] = low;
        let [x1, y1] = high;
        polyline(&mut svg, "block", [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z], [x0, y0, z]]);
    }
    polyline(&mut svg, "wire", wire(&here));
    svg.push_str(
        "<text x=\"190\" y=\"526\">MOMA-W cutting a tapered wing panel, drawn from a run of pkm</text>\n</svg>\n",
    );
    print!("{svg}");
}
