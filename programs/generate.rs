//! Writes the shipped MOMA-W programs: `cargo run --example generate-programs -- aerofoil|moulding`.
//!
//! `moma-w-aerofoil.ngc`: a tapered wing panel. Sections by the published NACA four-digit formulas (E. N. Jacobs,
//! K. E. Ward, R. M. Pinkerton, NACA Report 460, 1933), equations numbered here as there in section "airfoil":
//!   thickness ±y_t = 5 t (0.2969 √x − 0.1260 x − 0.3516 x² + 0.2843 x³ − 0.1015 x⁴), x in chords;
//!   mean line y_c = m/p² (2 p x − x²) before x = p, m/(1−p)² (1 − 2 p + 2 p x − x²) behind.
//! `moma-w-moulding.ngc`: a cornice whose profile shrinks along its length (arcs as chords).
//!
//! Both ends of the wire pass corresponding points at the same time, so that the surface is ruled.

use pkm_kins::maths::{PI, atan, atan2, ceil, cos, sin, sqrt};
use std::fmt::Write as _;
use std::io::Write as _;

/// A point of one contour plane, mm.
type Point = [f64; 2];

/// A NACA four-digit section placed in a contour plane.
struct Section {
    /// m: largest camber, chords.
    camber: f64,
    /// p: where it lies, chords.
    camber_at: f64,
    /// t: thickness, chords.
    thickness: f64,
    /// mm
    chord_mm: f64,
}

impl Section {
    /// The point of the upper or lower surface at x chords from the leading edge; mid-chord at the origin.
    fn point(&self, x: f64, upper: bool) -> Point {
        let (m, p) = (self.camber, self.camber_at);
        let polynomial = 0.2969 * sqrt(x) - x * (0.1260 + x * (0.3516 - x * (0.2843 - x * 0.1015)));
        let half = 5.0 * self.thickness * polynomial;
        let (mean, slope) = if m == 0.0 {
            (0.0, 0.0)
        } else if x < p {
            (m / (p * p) * (2.0 * p * x - x * x), 2.0 * m / (p * p) * (p - x))
        } else {
            let q = m / ((1.0 - p) * (1.0 - p));
            (q * (1.0 - 2.0 * p + 2.0 * p * x - x * x), 2.0 * q * (p - x))
        };
        let angle = atan(slope);
        let side = if upper { half } else { -half };
        [(x - side * sin(angle) - 0.5) * self.chord_mm, (mean + side * cos(angle)) * self.chord_mm]
    }
}

/// Points per surface.
const STATIONS: u32 = 160;

/// The text of `moma-w-aerofoil.ngc`.
pub(crate) fn aerofoil() -> String {
    let root = Section { camber: 0.02, camber_at: 0.4, thickness: 0.12, chord_mm: 100.0 };
    let tip = Section { camber: 0.0, camber_at: 0.0, thickness: 0.10, chord_mm: 72.0 };
    let mut text = String::from(
        "%\n(Tapered wing panel for MOMA-W: root NACA 2412, chord 100 mm, in x y; tip NACA 0010, chord 72 mm, in u v)\n\
         (Generated: cargo run --example generate-programs -- aerofoil)\n\
         (Panel 200 mm; over the upper surface to the leading edge, back along the lower one; no kerf)\n",
    );
    // Closely spaced where the section is round: x = (1 + cos β)/2 from the trailing edge (1) to the leading edge (0).
    let station = |i: u32| 0.5 * (1.0 + cos(PI * f64::from(i) / f64::from(STATIONS)));
    let mut path = Vec::new();
    for i in 0..=STATIONS {
        path.push((root.point(station(i), true), tip.point(station(i), true)));
    }
    for i in (0..STATIONS).rev() {
        path.push((root.point(station(i), false), tip.point(station(i), false)));
    }
    // The wire enters and leaves through the trailing edge, 8 mm behind it.
    program(&mut text, &path, ([58.0, 0.0], [44.0, 0.0]), ([58.0, 0.0], [44.0, 0.0]));
    text
}

/// A piece of the cornice's profile.
enum Piece {
    /// Straight line to a point.
    Line(Point),
    /// Arc to a point; tangent of a quarter of its angle, positive counter-clockwise.
    Arc(Point, f64),
}

/// Quarter circle and half circle as tangents of a quarter of their angle.
const QUARTER: f64 = 0.414_213_562_373_095_03;
const HALF: f64 = 1.0;

/// How far a chord may lie from its arc, mm.
const SAGITTA_MM: f64 = 0.001;

/// The text of `moma-w-moulding.ngc`.
pub(crate) fn moulding() -> String {
    use Piece::{Arc, Line};
    let start = [-45.0, -15.0];
    let profile = [
        Line([-39.0, -15.0]),
        Line([-39.0, -12.0]),
        Arc([-27.0, 0.0], QUARTER), // cove
        Line([-27.0, 2.5]),
        Line([-23.0, 2.5]),
        Arc([-12.0, 5.5], 0.25), // cyma recta: hollow, then round
        Arc([-1.0, 8.5], -0.25),
        Line([-1.0, 10.0]),
        Line([2.0, 10.0]),
        Arc([10.0, 10.0], -HALF), // astragal
        Line([13.0, 10.0]),
        Line([13.0, 7.0]),
        Arc([23.0, -3.0], -QUARTER), // ovolo
        Line([23.0, -5.5]),
        Line([27.0, -5.5]),
        Arc([36.5, -15.0], QUARTER), // scotia
        Line([45.0, -15.0]),
    ];
    let mut contour = vec![start];
    let mut from = start;
    for piece in profile {
        match piece {
            Line(to) => contour.push(to),
            Arc(to, bulge) => chords(&mut contour, from, to, bulge),
        }
        from = contour[contour.len() - 1];
    }
    const SMALL: f64 = 0.8;
    let path: Vec<(Point, Point)> = contour.iter().map(|&[x, y]| ([x, y], [SMALL * x, SMALL * y])).collect();
    let mut text = String::from(
        "%\n(Cornice for MOMA-W: profile 90 mm wide in x y, the same at 80 percent in u v)\n\
         (Generated: cargo run --example generate-programs -- moulding)\n\
         (Fillet, cove, cyma recta, astragal, ovolo, scotia; arcs as chords within 0.001 mm; no kerf)\n",
    );
    program(&mut text, &path, ([-50.0, -15.0], [-41.0, -12.0]), ([50.0, -15.0], [41.0, -12.0]));
    text
}

/// Chords of an arc, without its first point.
fn chords(contour: &mut Vec<Point>, from: Point, to: Point, bulge: f64) {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let angle = 4.0 * atan(bulge);
    // Centre: from the chord's middle to the left by (chord/2)/tan(angle/2).
    let offset = (1.0 - bulge * bulge) / (4.0 * bulge);
    let centre = [0.5 * (from[0] + to[0]) - offset * dy, 0.5 * (from[1] + to[1]) + offset * dx];
    let radius =
        sqrt((from[0] - centre[0]) * (from[0] - centre[0]) + (from[1] - centre[1]) * (from[1] - centre[1]));
    let first = atan2(from[1] - centre[1], from[0] - centre[0]);
    // Sagitta r (1 − cos φ/2) ≈ r φ²/8
    let widest = sqrt(8.0 * SAGITTA_MM / radius);
    let count = ceil(angle.abs() / widest) as u32;
    for i in 1..count {
        let at = first + angle * f64::from(i) / f64::from(count);
        contour.push([centre[0] + radius * cos(at), centre[1] + radius * sin(at)]);
    }
    contour.push(to);
}

/// Where the wire clears the block, mm.
const ABOVE_MM: f64 = 18.0;

/// Frame, lead-in, one block per point, lead-out.
fn program(text: &mut String, path: &[(Point, Point)], lead_in: (Point, Point), lead_out: (Point, Point)) {
    text.push_str("G21 G90 G94 G17 G64 P0.0005\n(above the block to the lead-in)\nG0 Z50\n");
    let block = |text: &mut String, word: &str, (a, b): (Point, Point)| {
        let _ = writeln!(text, "{word} X{} Y{} U{} V{}", fixed(a[0]), fixed(a[1]), fixed(b[0]), fixed(b[1]));
    };
    let above = |(a, b): (Point, Point)| ([a[0], ABOVE_MM], [b[0], ABOVE_MM]);
    block(text, "G0", ([0.0, ABOVE_MM], [0.0, ABOVE_MM]));
    block(text, "G0", above(lead_in));
    block(text, "G0", lead_in);
    text.push_str("(cut)\nF240\n");
    for &points in path {
        block(text, "G1", points);
    }
    block(text, "G1", lead_out);
    text.push_str("(above the block back to the middle)\n");
    block(text, "G0", above(lead_out));
    block(text, "G0", ([0.0, ABOVE_MM], [0.0, ABOVE_MM]));
    text.push_str("M2\n%\n");
}

/// Four decimals, without the sign of a zero.
fn fixed(value: f64) -> String {
    let text = format!("{value:.4}");
    if text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.')) {
        text.replace('-', "")
    } else {
        text
    }
}

/// Prints one program.
#[allow(dead_code)] // the tests use the functions above
fn main() -> std::io::Result<()> {
    let text = match std::env::args().nth(1).as_deref() {
        Some("aerofoil") => aerofoil(),
        Some("moulding") => moulding(),
        _ => return Err(std::io::Error::other("say which: aerofoil or moulding")),
    };
    std::io::stdout().lock().write_all(text.as_bytes())
}
