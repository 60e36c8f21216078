//! Workspaces of spatial machines: the stacked planes of each scan, a plan and a vertical section.

use super::{Anchor, Figure, Swatch, ink};
use crate::workspace::polar::{Plane, Solid};
use pkm_kins::machine::Mechanism;
use pkm_kins::maths::sincos;
use pkm_kins::{Axis, Vec2};
use pkm_machine::Machine;
use std::collections::BTreeMap;

/// Colours of the three kinds, from inside out.
const KINDS: [(&str, &str, &str); 3] = [
    ("total_orientation", "#0072b2", "total orientation (all of the grid)"),
    ("zero_orientation", "#e69f00", "zero orientation"),
    ("achievable", "#009e73", "achievable (at least one)"),
];

fn colour(name: &str) -> &'static str {
    KINDS.iter().find(|(kind, ..)| *kind == name).map_or(ink::TEXT, |(_, colour, _)| colour)
}

/// Oblique view: x to the right, y into the picture, z up.
fn oblique(x: f64, y: f64, z: f64) -> Vec2 {
    [x + 0.42 * y, z + 0.26 * y]
}

/// The picture of a machine's scans, as SVG.
pub fn figure(machine: &Machine, solids: &[Solid]) -> String {
    let radius = solids.iter().map(Solid::largest_radius_mm).fold(1.0, f64::max) * 1.12;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for plane in solids.iter().flat_map(|solid| &solid.planes) {
        (low, high) = (low.min(plane.z_mm), high.max(plane.z_mm));
    }
    let (low, high) = (low - 60.0, high + 60.0);
    let shafts = match &machine.mechanism {
        Mechanism::Lambda6(lambda) => lambda.legs().map(|leg| leg.shaft_mm).to_vec(),
        _ => Vec::new(),
    };
    let subtitle = "Polar scan in planes of constant z; what lies behind a first failure is not counted. Numbers belong to these steps and orientation grids.";
    let mut figure = Figure::new(1150.0, 800.0, &format!("Workspace of {}", machine.name), subtitle);

    // Stacks of planes, one panel each.
    let mut below = 100.0_f64;
    let wide = radius * 1.42;
    let bounds = [[-wide, low - 0.26 * radius], [wide, high + 0.26 * radius]];
    let scale = 350.0 / (bounds[1][1] - bounds[0][1]);
    let width = (bounds[1][0] - bounds[0][0]) * scale;
    for (index, solid) in solids.iter().enumerate() {
        let left = 78.0 + index as f64 * (width.min(290.0) + 66.0);
        let panel = figure.panel(
            [left, 100.0, width.min(290.0), 350.0],
            bounds,
            true,
            ["oblique: x, and y into the page (mm)", "z (mm)"],
        );
        let colour = colour(solid.kind.name);
        // From below, so that what is above covers it; the slabs between are hinted at by their edges.
        let every = (solid.planes.len() / 26).max(1);
        for plane in solid.planes.iter().step_by(every) {
            let ring: Vec<Vec2> = plane.points().iter().map(|p| oblique(p[0], p[1], plane.z_mm)).collect();
            let style = format!(
                "fill=\"#ffffff\" fill-opacity=\"0.72\" stroke=\"{colour}\" stroke-width=\"1.1\" stroke-linejoin=\"round\""
            );
            figure.polygons(&panel, &[ring], &style);
        }
        figure.frame(&panel);
        below = below.max(panel.bottom() + 118.0);
        let name = KINDS
            .iter()
            .find(|(kind, ..)| *kind == solid.kind.name)
            .map_or(solid.kind.name, |(_, _, text)| text);
        figure.text([left - 40.0, 90.0], 12.5, Anchor::Start, name, " font-weight=\"bold\"");
        let grid = if solid.kind.values > 1 {
            format!("{0}×{0}×{0} angles within ±{1}°", solid.kind.values, solid.kind.angle_deg)
        } else {
            "A = B = C = 0".to_owned()
        };
        let volume = format!(
            "{:.4} m³ at these steps (± {:.4} m³ from the steps)",
            solid.volume_mm3() * 1e-9,
            solid.step_estimate_mm3() * 1e-9
        );
        figure.text([left - 40.0, panel.bottom() + 52.0], 11.0, Anchor::Start, &grid, "");
        figure.text([left - 40.0, panel.bottom() + 68.0], 11.0, Anchor::Start, &volume, "");
    }

    // A plan at the plane where the innermost set is widest, with the shafts.
    let widest = solids
        .first()
        .and_then(|solid| solid.planes.iter().max_by(|a, b| a.area_mm2().total_cmp(&b.area_mm2())))
        .map_or(0.0, |plane| plane.z_mm);
    let reach = shafts.iter().fold(radius, |most, p| most.max(1.08 * p[0].abs()).max(1.08 * p[1].abs()));
    let panel = figure.panel(
        [78.0, below, 290.0, 290.0],
        [[-reach, -reach], [reach, reach]],
        true,
        ["x (mm)", "y (mm)"],
    );
    for solid in solids.iter().rev() {
        if let Some(plane) = solid.planes.iter().find(|plane| plane.z_mm == widest) {
            let colour = colour(solid.kind.name);
            figure.polygons(
                &panel,
                &[plane.points()],
                &format!("fill=\"{colour}\" fill-opacity=\"0.25\" stroke=\"{colour}\" stroke-width=\"1.6\""),
            );
        }
    }
    for shaft in &shafts {
        figure.disc(&panel, *shaft, 6.0, "fill=\"#666666\" stroke=\"#ffffff\" stroke-width=\"1\"");
    }
    if let Mechanism::Lambda6(lambda) = &machine.mechanism {
        // The home pose from above: platform triangle and long chains.
        let ((s, c), home) = (sincos(machine.home.c), machine.home);
        let corner = |p: Vec2| [home.x + c * p[0] - s * p[1], home.y + s * p[0] + c * p[1]];
        let corners: Vec<Vec2> = lambda.legs().iter().map(|leg| corner(leg.joint_mm)).collect();
        let legs: Vec<Vec<Vec2>> = shafts.iter().zip(&corners).map(|(a, b)| vec![*a, *b]).collect();
        figure.lines(&panel, &legs, "stroke=\"#111111\" stroke-width=\"2\"");
        figure.polygons(
            &panel,
            &[corners],
            "fill=\"none\" stroke=\"#111111\" stroke-width=\"2\" stroke-linejoin=\"round\"",
        );
    }
    figure.frame(&panel);
    figure.text(
        [38.0, below - 10.0],
        12.5,
        Anchor::Start,
        &format!("plan at z = {widest} mm").replace('-', "\u{2212}"),
        " font-weight=\"bold\"",
    );

    // Vertical section through the x axis: rays 0 and 180°.
    let panel = figure.panel(
        [434.0, below, 290.0, 290.0],
        [[-radius, low], [radius, high]],
        false,
        ["x at y = 0 (mm)", "z (mm)"],
    );
    for solid in solids.iter().rev() {
        let colour = colour(solid.kind.name);
        let section = section(&solid.planes);
        figure.polygons(
            &panel,
            &[section],
            &format!("fill=\"{colour}\" fill-opacity=\"0.25\" stroke=\"{colour}\" stroke-width=\"1.6\""),
        );
    }
    figure.frame(&panel);
    figure.text([394.0, below - 10.0], 12.5, Anchor::Start, "section through y = 0", " font-weight=\"bold\"");

    let mut y = below + 20.0;
    for solid in solids {
        if let Some((_, colour, text)) = KINDS.iter().find(|(kind, ..)| *kind == solid.kind.name) {
            y = figure.legend(
                [780.0, y],
                &Swatch::Line(&format!("stroke=\"{colour}\" stroke-width=\"4\"")),
                text,
            );
        }
    }
    if !shafts.is_empty() {
        y = figure.legend(
            [780.0, y],
            &Swatch::Line("stroke=\"#666666\" stroke-width=\"10\" stroke-linecap=\"round\""),
            "shafts",
        );
        y = figure.legend(
            [780.0, y],
            &Swatch::Line("stroke=\"#111111\" stroke-width=\"2\""),
            "platform and long chains at home",
        );
    }
    if let Some(solid) = solids.first() {
        let steps = solid.steps;
        for text in [
            format!("planes every {} mm, {} rays,", steps.dz_mm, steps.rays),
            format!("{} mm along a ray, bisected to 0.001 mm", steps.d_rho_mm),
        ] {
            y = figure.legend([780.0, y + 4.0], &Swatch::None, &text);
        }
    }
    figure.finish()
}

/// Outline in the plane y = 0, from the rays at 0 and 180°.
fn section(planes: &[Plane]) -> Vec<Vec2> {
    let right = planes.iter().map(|plane| [plane.radii_mm.first().copied().unwrap_or(0.0), plane.z_mm]);
    let left = planes.iter().rev().map(|plane| {
        let half = plane.radii_mm.len() / 2;
        [-plane.radii_mm.get(half).copied().unwrap_or(0.0), plane.z_mm]
    });
    right.chain(left).collect()
}

/// A Cartesian machine: its box from above.
pub fn boxed(machine: &Machine, bounds: &BTreeMap<String, [f64; 2]>) -> String {
    let range = |axis: Axis| bounds.get(&axis.letter().to_string()).copied().unwrap_or([0.0, 0.0]);
    let (x, y, z) = (range(Axis::X), range(Axis::Y), range(Axis::Z));
    let mut figure =
        Figure::new(720.0, 720.0, &format!("Workspace of {}", machine.name), &machine.description);
    let margin = 0.06 * (x[1] - x[0]).max(y[1] - y[0]).max(1.0);
    let bounds = [[x[0] - margin, y[0] - margin], [x[1] + margin, y[1] + margin]];
    let panel = figure.panel([78.0, 80.0, 560.0, 560.0], bounds, true, ["X (mm)", "Y (mm)"]);
    let corners = vec![[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    figure.polygons(&panel, &[corners], "fill=\"#b5e2b6\" stroke=\"#000000\" stroke-width=\"1.6\"");
    figure.disc(
        &panel,
        [machine.home.x, machine.home.y],
        5.0,
        "fill=\"#e69f00\" stroke=\"#111111\" stroke-width=\"1.4\"",
    );
    figure.frame(&panel);
    let text =
        format!("Z from {} to {} mm; every joint is a coordinate, det K = 1; the mark is home", z[0], z[1]);
    figure.text([38.0, panel.bottom() + 56.0], 11.5, Anchor::Start, &text, "");
    figure.finish()
}
