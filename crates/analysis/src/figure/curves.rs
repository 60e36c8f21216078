//! Path and joint curves of a run.

use super::{Anchor, Figure, Swatch, ink};
use crate::trace::{Envelope, Trace};
use crate::workspace::Outline;
use pkm_kins::Vec2;
use pkm_machine::Machine;

/// Grows a box by a share of its longer side.
fn roomy([low, high]: [Vec2; 2], share: f64) -> [Vec2; 2] {
    let margin = share * (high[0] - low[0]).max(high[1] - low[1]).max(1.0);
    [[low[0] - margin, low[1] - margin], [high[0] + margin, high[1] + margin]]
}

fn bounds<'a>(points: impl Iterator<Item = &'a Vec2>) -> Option<[Vec2; 2]> {
    points.fold(None, |found, p| match found {
        None => Some([*p, *p]),
        Some([low, high]) => {
            Some([[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]])
        }
    })
}

/// The path in every pair of axes the machine has, to scale, with the workspace behind it where it is known.
pub fn path(title: &str, trace: &Trace, outlines: &[Outline]) -> String {
    const SIDE: f64 = 420.0;
    // A third coordinate that stands still needs no panel.
    let moves = |line: &[Vec2]| line.iter().any(|p| p[1] != line[0][1]);
    let paths: Vec<([char; 2], Vec<Vec2>)> = trace
        .paths
        .iter()
        .map(|([a, b], path)| ([trace.axes[*a].0, trace.axes[*b].0], path.line()))
        .filter(|([_, b], line)| matches!(b, 'Y' | 'V') || moves(line))
        .collect();
    let count = paths.len().max(1) as f64;
    let subtitle =
        format!("{} rows, {:.3} s; every extreme of the trace is drawn", trace.rows, trace.duration_s);
    let mut figure = Figure::new(60.0 + count * (SIDE + 96.0), 640.0, title, &subtitle);
    let mut left = 78.0;
    let mut behind = false;
    for (letters, line) in &paths {
        let outline = outlines.iter().find(|outline| outline.axes.map(|axis| axis.letter()) == *letters);
        let polygons = outline.map_or(&[][..], |outline| &outline.polygons[..]);
        let Some(around) = bounds(line.iter().chain(polygons.iter().flatten())) else { continue };
        let titles = letters.map(|letter| format!("{letter} (mm)"));
        let panel =
            figure.panel([left, 80.0, SIDE, SIDE], roomy(around, 0.05), true, [&titles[0], &titles[1]]);
        if !polygons.is_empty() {
            behind = true;
            figure.polygons(&panel, polygons, "fill=\"#e8f1f6\" stroke=\"#5c6b73\" stroke-width=\"1.2\"");
        }
        let style = format!("stroke=\"{}\" stroke-width=\"1.4\" stroke-linejoin=\"round\"", ink::SERIES[0]);
        figure.lines(&panel, std::slice::from_ref(line), &style);
        if let (Some(first), Some(last)) = (line.first(), line.last()) {
            // The disc on the square, so that both are seen where a path ends at its start.
            figure.square(&panel, *last, 5.5, "fill=\"#d55e00\" stroke=\"#ffffff\" stroke-width=\"1\"");
            figure.disc(&panel, *first, 3.5, "fill=\"#009e73\" stroke=\"#ffffff\" stroke-width=\"1\"");
        }
        figure.frame(&panel);
        left += SIDE + 96.0;
    }
    let mut y = 570.0;
    let style = format!("stroke=\"{}\" stroke-width=\"2\"", ink::SERIES[0]);
    y = figure.legend(
        [78.0, y],
        &Swatch::Line(&style),
        "commanded path (green disc: start; orange square: end)",
    );
    if behind {
        figure.legend([78.0, y], &Swatch::Fill("#e8f1f6"), "reachable workspace");
    }
    figure.finish()
}

/// Position, velocity and acceleration of every joint over time; the last two as shares of their limits where a machine says
/// what these are.
pub fn joints(title: &str, trace: &Trace, machine: Option<&Machine>) -> String {
    const WIDTH: f64 = 760.0;
    const HEIGHT: f64 = 170.0;
    let machine = machine.filter(|machine| machine.joints.len() == trace.joints.len());
    let unit = |per: &str| {
        let first = trace.joints.first().map_or("", |joint| &joint.unit);
        let same = trace.joints.iter().all(|joint| joint.unit == first);
        let word = |unit: &str| if unit == "deg" { "°".to_owned() } else { unit.to_owned() };
        format!("{}{per}", if same { word(first) } else { "mm, °".to_owned() })
    };
    let subtitle =
        format!("{} rows, {:.3} s; every extreme of the trace is drawn", trace.rows, trace.duration_s);
    let mut figure = Figure::new(WIDTH + 270.0, 3.0 * (HEIGHT + 64.0) + 90.0, title, &subtitle);
    let share = machine.is_some();
    let titles = [
        format!("position ({})", unit("")),
        if share { "velocity (% of limit)".to_owned() } else { format!("velocity ({})", unit("/s")) },
        if share {
            "acceleration (% of limit)".to_owned()
        } else {
            format!("acceleration ({})", unit("/s²"))
        },
    ];
    for (row, name) in titles.iter().enumerate() {
        let curve = |index: usize| -> (&Envelope, f64) {
            let joint = &trace.joints[index];
            let limits = machine.map(|machine| {
                let joint = &machine.joints[index];
                [joint.to_face(joint.max_velocity), joint.to_face(joint.max_acceleration)]
            });
            match row {
                0 => (&joint.position, 1.0),
                1 => (&joint.velocity, limits.map_or(1.0, |l| 100.0 / l[0])),
                _ => (&joint.acceleration, limits.map_or(1.0, |l| 100.0 / l[1])),
            }
        };
        let mut low = f64::INFINITY;
        let mut high = f64::NEG_INFINITY;
        for index in 0..trace.joints.len() {
            let (envelope, scale) = curve(index);
            if let Some([least, most]) = envelope.range() {
                (low, high) = (low.min(least * scale), high.max(most * scale));
            }
        }
        if !(low <= high) {
            (low, high) = (0.0, 1.0);
        }
        if share && row > 0 {
            (low, high) = (low.min(-100.0), high.max(100.0));
        }
        let margin = 0.06 * (high - low).max(1e-6);
        let first = trace
            .joints
            .first()
            .and_then(|joint| joint.position.line().first().copied())
            .map_or(0.0, |p| p[0]);
        let around = [[first, low - margin], [first + trace.duration_s.max(1e-9), high + margin]];
        let top = 84.0 + row as f64 * (HEIGHT + 64.0);
        let time = if row == 2 { "time (s)" } else { "" };
        let panel = figure.panel([88.0, top, WIDTH, HEIGHT], around, false, [time, name]);
        if share && row > 0 {
            let limits = [-100.0, 100.0].map(|at| vec![[around[0][0], at], [around[1][0], at]]);
            figure.lines(&panel, &limits, "stroke=\"#222222\" stroke-width=\"1.4\"");
        }
        for index in 0..trace.joints.len() {
            let (envelope, scale) = curve(index);
            let line: Vec<Vec2> = envelope.line().into_iter().map(|[t, v]| [t, v * scale]).collect();
            let style = format!(
                "stroke=\"{}\" stroke-width=\"1.3\" stroke-linejoin=\"round\"{}",
                ink::SERIES[index % ink::SERIES.len()],
                if index >= ink::SERIES.len() { " stroke-dasharray=\"6 3\"" } else { "" }
            );
            figure.lines(&panel, &[line], &style);
        }
        figure.frame(&panel);
    }
    let mut y = 96.0;
    figure.text([WIDTH + 110.0, y - 6.0], 12.0, Anchor::Start, "joints", " font-weight=\"bold\"");
    y += 14.0;
    for (index, joint) in trace.joints.iter().enumerate() {
        let style = format!("stroke=\"{}\" stroke-width=\"3\"", ink::SERIES[index % ink::SERIES.len()]);
        let name = machine.map_or(&joint.name, |machine| &machine.joints[index].name);
        let text = match joint.position.range() {
            Some([low, high]) => format!("{name}: {low:.2} to {high:.2}").replace('-', "\u{2212}"),
            None => name.clone(),
        };
        y = figure.legend([WIDTH + 110.0, y], &Swatch::Line(&style), &text);
    }
    if share {
        figure.legend([WIDTH + 110.0, y], &Swatch::Line("stroke=\"#222222\" stroke-width=\"1.4\""), "limit");
    }
    figure.finish()
}
