//! Workspaces of planar mechanisms: exact boundary, bands of |det K|, singular loci, what is lost to one-sided guides, and the
//! mechanism itself in its home pose.

use super::bands::Bands;
use super::{Anchor, Figure, Panel, Swatch, ink};
use crate::workspace::contour::{above, simplified};
use crate::workspace::map::Map;
use crate::workspace::{Boundary, Cause, View};
use pkm_kins::Vec2;

/// One view with what was computed for it.
#[derive(Debug, Clone, Copy)]
pub struct Drawn<'a> {
    /// The view.
    pub view: &'a View,
    /// The boundary of [`View::reachable`].
    pub reachable: &'a Boundary,
    /// The boundary of [`View::usable`].
    pub usable: &'a Boundary,
    /// det K over the reachable set.
    pub map: &'a Map,
    /// Lines under the panel: areas and the like.
    pub notes: &'a [String],
}

/// Cells of the grid that contours are traced on, along the longer side.
const CELLS: f64 = 140.0;
const TOP: f64 = 88.0;
const LEFT: f64 = 78.0;
const LEGEND_WIDTH: f64 = 236.0;

/// The picture of a machine's planar workspaces, side by side, as SVG.
pub fn figure(title: &str, subtitle: &str, drawn: &[Drawn<'_>]) -> String {
    let side = if drawn.len() > 1 { 430.0 } else { 600.0 };
    let boxes: Vec<[Vec2; 2]> = drawn.iter().map(bounds).collect();
    // Panels keep their proportions; the picture is as large as they need.
    let sizes: Vec<Vec2> = boxes
        .iter()
        .map(|[low, high]| {
            let span = [high[0] - low[0], high[1] - low[1]];
            let scale = side / span[0].max(span[1]);
            [span[0] * scale, span[1] * scale]
        })
        .collect();
    let tallest = sizes.iter().fold(0.0, |most: f64, size| most.max(size[1]));
    let notes = drawn.iter().map(|d| d.notes.len()).max().unwrap_or(0) as f64;
    let mut lefts = Vec::new();
    let mut left = LEFT;
    for size in &sizes {
        lefts.push(left);
        left += size[0] + 94.0;
    }
    let legend_left = left - 94.0 + 30.0;
    let bands: Vec<Bands> = drawn
        .iter()
        .map(|d| {
            let sign = if d.map.determinant.iter().any(|v| *v < 0.0) { -1.0 } else { 1.0 };
            Bands::of(&d.map.determinant, sign)
        })
        .collect();
    let lines = 9.0 + bands.iter().map(|b| b.levels.len() as f64 + 2.0).sum::<f64>();
    let height = (TOP + tallest + 62.0 + notes * 17.0).max(TOP + lines * 19.0 + 30.0);
    let mut figure = Figure::new(legend_left + LEGEND_WIDTH, height, title, subtitle);
    for (index, d) in drawn.iter().enumerate() {
        let letters = d.view.axes.map(|axis| format!("{} (mm)", axis.letter()));
        let frame = [lefts[index], TOP, sizes[index][0] + 1e-6, sizes[index][1] + 1e-6];
        let panel = figure.panel(frame, boxes[index], true, [&letters[0], &letters[1]]);
        draw(&mut figure, &panel, d, &bands[index], boxes[index]);
        if drawn.len() > 1 {
            figure.text(
                [lefts[index], TOP - 6.0],
                12.5,
                Anchor::Start,
                &d.view.name,
                " font-weight=\"bold\"",
            );
        }
        for (line, note) in d.notes.iter().enumerate() {
            let y = panel.bottom() + 56.0 + 17.0 * line as f64;
            figure.text([lefts[index] - 50.0, y], 11.5, Anchor::Start, note, "");
        }
    }
    legend(&mut figure, legend_left, drawn, &bands);
    figure.finish()
}

/// The box of a panel: workspace, mechanism, and a margin.
fn bounds(d: &Drawn<'_>) -> [Vec2; 2] {
    let [mut low, mut high] = d.reachable.bounding_box().unwrap_or([[0.0; 2]; 2]);
    for limb in d.view.linkage(d.view.pose).unwrap_or_default() {
        for point in [limb.guide[0], limb.guide[1], limb.slider, limb.platform] {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
    }
    let margin = 0.06 * (high[0] - low[0]).max(high[1] - low[1]).max(1.0);
    [[low[0] - margin, low[1] - margin], [high[0] + margin, high[1] + margin]]
}

fn draw(figure: &mut Figure, panel: &Panel, d: &Drawn<'_>, bands: &Bands, outer: [Vec2; 2]) {
    let fine = 0.05 * panel.pixel();
    let shape = d.reachable.polygons(fine);
    // Bands, from small to large |det K|, one over the other, cut out by the exact boundary.
    if let Some([low, high]) = d.reachable.bounding_box() {
        let clip = figure.clip(panel, &shape);
        figure.open(&clip);
        let cell = (high[0] - low[0]).max(high[1] - low[1]) / CELLS;
        let cells = [0, 1].map(|axis| (((high[axis] - low[axis]) / cell).ceil() as usize).max(1));
        for (band, level) in bands.levels.iter().enumerate() {
            let filled = if band == 0 {
                shape.clone()
            } else {
                let all = above(|t| d.view.determinant(t).abs(), [low, high], cells, *level);
                all.iter().map(|polygon| simplified(polygon, 0.25 * panel.pixel())).collect()
            };
            let style = format!("fill=\"{}\" stroke=\"#5c6b73\" stroke-width=\"0.5\"", bands.colour(band));
            figure.polygons(panel, &filled, &style);
        }
        figure.close();
    }
    // What one-sided guides, or the guard of the form switch, take away.
    if differs(d) {
        let mut lost = shape.clone();
        lost.extend(d.usable.polygons(fine));
        figure.polygons(panel, &lost, "fill=\"url(#hatch)\"");
        figure.lines(
            panel,
            &closed(&d.usable.polygons(fine)),
            "stroke=\"#000000\" stroke-width=\"1\" stroke-dasharray=\"5 3\"",
        );
    }
    // Loci with guides that have no ends: dashed; where they bound the reachable set: solid and wide.
    let [type_1, type_2] = d.view.loci(outer);
    let points = |curves: &[crate::workspace::Curve]| -> Vec<Vec<Vec2>> {
        curves.iter().map(|curve| curve.polyline(fine)).collect()
    };
    let thin = |colour: &str| format!("stroke=\"{colour}\" stroke-width=\"1.2\" stroke-dasharray=\"2 3\"");
    figure.lines(panel, &points(&type_1), &thin(ink::TYPE_1));
    figure.lines(panel, &points(&type_2), &thin(ink::TYPE_2));
    figure.polygons(
        panel,
        &shape,
        "fill=\"none\" stroke=\"#000000\" stroke-width=\"1.6\" stroke-linejoin=\"round\"",
    );
    for (wanted, colour) in [(1, ink::TYPE_1), (2, ink::TYPE_2)] {
        let pieces = d.reachable.loops.iter().flatten().filter(|piece| match piece.cause {
            Cause::Type1(_) => wanted == 1,
            Cause::Type2 => wanted == 2,
            _ => false,
        });
        let lines: Vec<Vec<Vec2>> = pieces.map(|piece| piece.curve.polyline(fine)).collect();
        figure.lines(panel, &lines, &format!("stroke=\"{colour}\" stroke-width=\"4\""));
    }
    mechanism(figure, panel, d.view);
    figure.frame(panel);
}

/// Whether the usable set is smaller than the reachable one.
fn differs(d: &Drawn<'_>) -> bool {
    d.reachable.area_mm2 - d.usable.area_mm2 > 1e-3 + d.reachable.error_bound_mm2
}

fn closed(polygons: &[Vec<Vec2>]) -> Vec<Vec<Vec2>> {
    polygons.iter().map(|polygon| polygon.iter().chain(polygon.first()).copied().collect()).collect()
}

/// Guides with the sliders' travel, sliders, links, platform, tool point.
fn mechanism(figure: &mut Figure, panel: &Panel, view: &View) {
    let Some(limbs) = view.linkage(view.pose) else { return };
    for limb in &limbs {
        figure.lines(
            panel,
            &[limb.guide.to_vec()],
            "stroke=\"#9a9a9a\" stroke-width=\"7\" stroke-linecap=\"round\"",
        );
    }
    for pair in limbs.chunks(2) {
        let bars = [
            pair.iter().map(|limb| limb.platform).collect::<Vec<_>>(),
            pair.iter().map(|_| view.pose).collect(),
        ];
        let mut lines: Vec<Vec<Vec2>> = pair.iter().map(|limb| vec![limb.slider, limb.platform]).collect();
        lines.push(bars[0].clone());
        lines.extend(bars[0].iter().zip(&bars[1]).map(|(a, b)| vec![*a, *b]));
        figure.lines(panel, &lines, "stroke=\"#ffffff\" stroke-width=\"5.5\" stroke-linecap=\"round\"");
        figure.lines(panel, &lines, "stroke=\"#111111\" stroke-width=\"2.6\" stroke-linecap=\"round\"");
        for limb in pair {
            figure.square(panel, limb.slider, 6.0, "fill=\"#111111\" stroke=\"#ffffff\" stroke-width=\"1\"");
            figure.disc(
                panel,
                limb.platform,
                3.6,
                "fill=\"#ffffff\" stroke=\"#111111\" stroke-width=\"1.6\"",
            );
        }
    }
    figure.disc(panel, view.pose, 5.0, "fill=\"#e69f00\" stroke=\"#111111\" stroke-width=\"1.4\"");
}

fn legend(figure: &mut Figure, left: f64, drawn: &[Drawn<'_>], bands: &[Bands]) {
    let mut y = TOP + 6.0;
    for (d, bands) in drawn.iter().zip(bands) {
        let title = if drawn.len() > 1 {
            format!("det K of {}", d.view.name.split([' ', ',']).next().unwrap_or_default())
        } else {
            "det K = det ∂p/∂(x, y)".to_owned()
        };
        figure.text([left, y], 12.0, Anchor::Start, &title, " font-weight=\"bold\"");
        y += 20.0;
        for band in 0..bands.levels.len() {
            y = figure.legend([left, y], &Swatch::Fill(bands.colour(band)), &bands.name(band));
        }
        y += 8.0;
    }
    let causes = |wanted: fn(&Cause) -> bool| {
        drawn.iter().any(|d| d.reachable.loops.iter().flatten().any(|piece| wanted(&piece.cause)))
    };
    y = figure.legend([left, y], &Swatch::Line("stroke=\"#000000\" stroke-width=\"1.6\""), "exact boundary");
    if drawn.iter().any(differs) {
        let text =
            if drawn[0].view.is_glide() { "guard of the form switch" } else { "lost to one-sided guides" };
        y = figure.legend([left, y], &Swatch::Fill("url(#hatch)"), text);
    }
    let type_1 = format!("stroke=\"{}\" stroke-width=\"4\"", ink::TYPE_1);
    let type_2 = format!("stroke=\"{}\" stroke-width=\"4\"", ink::TYPE_2);
    if causes(|cause| matches!(cause, Cause::Type1(_))) {
        y = figure.legend([left, y], &Swatch::Line(&type_1), "type 1 within the stroke");
    }
    let thin = format!("stroke=\"{}\" stroke-width=\"1.4\" stroke-dasharray=\"2 3\"", ink::TYPE_1);
    y = figure.legend([left, y], &Swatch::Line(&thin), "type 1: link square to guide");
    if causes(|cause| matches!(cause, Cause::Type2)) {
        y = figure.legend([left, y], &Swatch::Line(&type_2), "type 2 within the stroke");
    }
    let thin = format!("stroke=\"{}\" stroke-width=\"1.4\" stroke-dasharray=\"2 3\"", ink::TYPE_2);
    y = figure.legend([left, y], &Swatch::Line(&thin), "type 2: links parallel");
    y = figure.legend(
        [left, y],
        &Swatch::Line("stroke=\"#9a9a9a\" stroke-width=\"7\""),
        "guide, travel of the slider",
    );
    figure.legend(
        [left, y],
        &Swatch::Line("stroke=\"#111111\" stroke-width=\"2.6\""),
        "links, in the home pose",
    );
}
