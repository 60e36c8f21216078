//! G70 to G72.2: the passes never come closer to the profile than the stock to leave, layers are no deeper than I, nothing
//! stays above the profile but the stock; pockets as the variant says. Profiles are random, the seed is printed.

mod support;

use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::{Interpreter, MemorySource, Settings, Status, static_check};
use pkm_kins::{Axis, AxisSet, maths};
use support::generator::Random;

type Point = [f64; 2];

/// One move, `[z, x]`: points at most 0.05 apart.
struct Cut {
    rapid: bool,
    points: Vec<Point>,
}

#[derive(Default)]
struct Cuts {
    at: Point,
    cuts: Vec<Cut>,
}

impl CanonSink for Cuts {
    fn command(&mut self, command: &Canon<'_>, _: Span) {
        let from = self.at;
        let (rapid, points) = match *command {
            Canon::StraightTraverse(end) => (true, line(from, [end.z, end.x])),
            Canon::StraightFeed(end) => (false, line(from, [end.z, end.x])),
            Canon::ArcFeed { end, first_centre, second_centre, turns } => {
                (false, arc(from, [end.z, end.x], [first_centre, second_centre], turns > 0))
            }
            _ => return,
        };
        self.at = *points.last().expect("a move has an end");
        self.cuts.push(Cut { rapid, points });
    }
}

fn distance(a: Point, b: Point) -> f64 {
    maths::hypot(a[0] - b[0], a[1] - b[1])
}

fn line(from: Point, to: Point) -> Vec<Point> {
    let steps = (distance(from, to) / 0.05).ceil().max(1.0) as usize;
    let part = |i: usize| i as f64 / steps as f64;
    (0..=steps).map(|i| [0, 1].map(|k| from[k] + (to[k] - from[k]) * part(i))).collect()
}

fn arc(from: Point, to: Point, centre: Point, ccw: bool) -> Vec<Point> {
    let angle = |p: Point| maths::atan2(p[1] - centre[1], p[0] - centre[0]);
    let radius = distance(from, centre);
    assert!((radius - distance(to, centre)).abs() < 1e-4, "{from:?} {to:?} {centre:?}");
    let turn = std::f64::consts::TAU;
    let mut sweep = (angle(to) - angle(from)).rem_euclid(turn);
    if !ccw {
        sweep -= turn;
    }
    let steps = (radius * sweep.abs() / 0.05).ceil().max(1.0) as usize;
    let at = |i: usize| angle(from) + sweep * i as f64 / steps as f64;
    (0..=steps)
        .map(|i| [centre[0] + radius * maths::cos(at(i)), centre[1] + radius * maths::sin(at(i))])
        .collect()
}

/// The moves of a program; the first error by its identifier and line.
fn run(program: &str) -> Result<Vec<Cut>, (&'static str, u32)> {
    let mut source = MemorySource::new(program.as_bytes());
    let mut interpreter = Interpreter::new(Settings::default());
    let mut cuts = Cuts::default();
    while interpreter.step(&mut source, &mut cuts).map_err(|error| (error.kind.code(), error.span.line))?
        != Status::Ended
    {}
    Ok(cuts.cuts)
}

fn cuts(program: &str) -> Vec<Cut> {
    run(program).unwrap_or_else(|error| panic!("{error:?}\n{program}"))
}

/// A profile as its sub and as points, as G71 sees it: towards -Z, from outside.
struct Profile {
    sub: String,
    points: Vec<Point>,
}

/// Moves towards -Z with X going up and down; straight ones, walls and arcs. `mirror` = for G72, Z and X exchanged.
fn random_profile(random: &mut Random, across: bool, pockets: bool) -> Profile {
    let mut at = [0.0, 1.0 + random.below(40) as f64 / 10.0];
    let name = |p: Point| {
        if across { format!("Z{:.6} X{:.6}", p[1], p[0]) } else { format!("Z{:.6} X{:.6}", p[0], p[1]) }
    };
    let mut sub = format!("o100 sub\nG0 {}\n", name(at));
    let mut points = vec![at];
    for _ in 0..3 + random.below(8) {
        let along = random.below(60) as f64 / 10.0;
        let rise = random.below(60) as f64 / 10.0 - if pockets { 3.0 } else { 0.0 };
        let to = [at[0] - along, (at[1] + rise).clamp(0.2, 18.0)];
        let curved = random.chance(40) && along > 0.5 && (to[1] - at[1]).abs() > 0.2;
        if distance(at, to) < 1e-3 {
            continue;
        }
        if curved {
            // A centre beside one end and on the perpendicular bisector gives a curve without a turn back.
            let (dz, dx) = (to[0] - at[0], to[1] - at[1]);
            let chord = dz * dz + dx * dx;
            let level = random.chance(50);
            // At the begin (level) or at the end the tangent is along Z: centre straight above or below it.
            let radius = chord / (2.0 * dx.abs());
            if radius >= dx.abs() && radius < 200.0 {
                let side = if level { dx.signum() } else { -dx.signum() };
                let centre =
                    if level { [at[0], at[1] + side * radius] } else { [to[0], to[1] + side * radius] };
                // Towards -Z: below the centre is clockwise in (z, x).
                let ccw = side < 0.0;
                let (i, k) = match across {
                    false => (centre[1] - at[1], centre[0] - at[0]),
                    true => (centre[0] - at[0], centre[1] - at[1]),
                };
                let code = if ccw != across { "G3" } else { "G2" };
                sub += &format!("{code} {} I{i:.6} K{k:.6}\n", name(to));
                points.extend(arc(at, to, centre, ccw));
                at = to;
                continue;
            }
        }
        sub += &format!("G1 {}\n", name(to));
        points.extend(line(at, to));
        at = to;
    }
    let to = [at[0] - 2.0, at[1]];
    sub += &format!("G1 {}\no100 endsub\n", name(to));
    points.extend(line(at, to));
    Profile { sub, points }
}

fn away(point: Point, points: &[Point]) -> f64 {
    points.iter().map(|p| distance(point, *p)).fold(f64::INFINITY, f64::min)
}

/// Height of the profile at z; at a wall its top.
fn height(points: &[Point], z: f64) -> f64 {
    let over = points.windows(2).filter(|w| (w[1][0]..=w[0][0]).contains(&z));
    let at = |w: &[Point]| match w[0][0] - w[1][0] {
        run if run > 1e-9 => w[0][1] + (w[1][1] - w[0][1]) * (w[0][0] - z) / run,
        _ => w[0][1].max(w[1][1]),
    };
    over.map(at).fold(f64::NEG_INFINITY, f64::max)
}

const START: Point = [2.0, 20.0];

fn exchange(cuts: &mut [Cut], across: bool) {
    if across {
        cuts.iter_mut().flat_map(|cut| &mut cut.points).for_each(|p| p.swap(0, 1));
    }
}

fn program(profile: &Profile, cycle: &str, across: bool) -> String {
    let start = if across { "X2 Z20" } else { "Z2 X20" };
    format!("G18 G21 G90 F100\n{}G0 {start}\n{cycle} Q100\nM2\n", profile.sub)
}

/// What is left over each z after the cuts: feeds remove what lies above them.
fn remains(cuts: &[Cut], z: f64) -> f64 {
    let points = cuts.iter().flat_map(|cut| &cut.points);
    points.filter(|p| (p[0] - z).abs() < 0.026).map(|p| p[1]).fold(START[1], f64::min)
}

/// What a tool that only climbs would leave.
fn climbed(points: &[Point], z: f64) -> f64 {
    points.iter().filter(|p| p[0] > z - 0.026).map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn roughing_keeps_the_stock_and_leaves_nothing_else() {
    for seed in 0..24 {
        let mut random = Random(seed * 7919 + 1);
        let across = seed % 2 == 1;
        let profile = random_profile(&mut random, across, true);
        let points = &profile.points;
        let stock = [0.0, 0.3, 0.75][(seed % 3) as usize];
        let depth = 0.5 + random.below(20) as f64 / 10.0;
        let code = if across { "G72" } else { "G71" };
        for variant in ["", ".1", ".2"] {
            let cycle = format!("{code}{variant} D{stock} I{depth} R0.4");
            let text = program(&profile, &cycle, across);
            let mut moves = cuts(&text);
            exchange(&mut moves, across);
            // Nothing comes nearer than the stock, nor below the profile; the move to the start does not count.
            for cut in &moves[1..] {
                for &p in &cut.points {
                    let near = away(p, points);
                    assert!(near > stock - 0.012, "seed {seed}: {p:?} is {near} from the profile\n{text}");
                    let beside = [-0.002, 0.0, 0.002].map(|d| height(points, p[0] + d));
                    let low = beside.into_iter().fold(f64::INFINITY, f64::min);
                    assert!(p[1] > low - 0.02, "seed {seed}: {p:?} is inside\n{text}");
                }
            }
            check_layers(&moves, depth, seed, &text, variant == ".2", points);
            let (first, last) = (points[0][0], points[points.len() - 1][0]);
            let mut z = last + 0.05;
            while z < first - 0.05 {
                let left = remains(&moves, z);
                let climb = climbed(points, z);
                let in_pocket = height(points, z) < climb - 0.05;
                // The nearest point of the profile is the stock away; in a pocket of .1 the rim is.
                match variant {
                    "" => assert!(
                        away([z, left], points) < stock + 0.05 || steep_at(points, z),
                        "seed {seed}: {left} stays at z {z}\n{text}"
                    ),
                    ".1" if in_pocket => assert!(
                        left > climbed(points, z + 0.06) + stock - 0.05,
                        "seed {seed}: .1 cuts a pocket to {left} at z {z}\n{text}"
                    ),
                    _ => {}
                }
                z += 0.373;
            }
        }
    }
}

fn steep_at(points: &[Point], z: f64) -> bool {
    points
        .windows(2)
        .any(|w| (w[0][0] - z).abs() < 0.05 && (w[0][1] - w[1][1]).abs() > 2.0 * (w[0][0] - w[1][0]).abs())
}

/// Straight cuts along the axis take at most I; rapids go only where everything was removed.
fn check_layers(moves: &[Cut], depth: f64, seed: u64, text: &str, pockets_only: bool, points: &[Point]) {
    // Height left, over cells of 0.05 in z.
    let cell = |z: f64| ((4.0 - z) / 0.05).round().max(0.0) as usize;
    let mut left = vec![START[1]; 4000];
    if pockets_only {
        for (index, left) in left.iter_mut().enumerate() {
            let z = 4.0 - index as f64 * 0.05;
            *left = (climbed(points, z - 0.05) + 1.6).min(START[1]);
        }
    }
    for cut in &moves[1..] {
        let (from, to) = (cut.points[0], cut.points[cut.points.len() - 1]);
        let along = !cut.rapid && (from[1] - to[1]).abs() < 1e-9 && (from[0] - to[0]).abs() > 0.3;
        for p in &cut.points {
            let (left, inner) =
                (&mut left[cell(p[0])], (p[0] - from[0]).abs() > 0.2 && (p[0] - to[0]).abs() > 0.2);
            if along && inner && !pockets_only {
                assert!(*left - p[1] < depth + 0.02, "seed {seed}: {} deep at {p:?}\n{text}", *left - p[1]);
            }
            if cut.rapid && p[0] < points[0][0] - 0.2 && inner {
                assert!(
                    p[1] > *left - 1e-3,
                    "seed {seed}: rapid through material at {p:?}, {left} stays\n{text}"
                );
            }
        }
        for p in &cut.points {
            let left = &mut left[cell(p[0])];
            *left = left.min(p[1]);
        }
    }
}

const STEPS: &str =
    "o100 sub\nG0 X2 Z0\nG1 Z-4\nX6 A1\nZ-8 C1\nX10 Z-10\nX4 Z-12\nZ-14\nX12 Z-16\no100 endsub\n";

/// All the ends of moves, as `[z, x]`.
fn ends(cuts: &[Cut]) -> Vec<Point> {
    cuts.iter().map(|cut| cut.points[cut.points.len() - 1]).collect()
}

#[test]
fn finishing_runs_at_falling_distances() {
    let moves = cuts(&format!("G18 G21 F100\n{STEPS}G0 X20 Z1\nG70 Q100 D0.9 E0.1 P2\nM2\n"));
    let ends = ends(&moves);
    // Distances (P-1)(D-E)/P + E = 0.5 and then E = 0.1, each from the start.
    let begins: Vec<Point> =
        ends.windows(2).filter(|w| w[0] == [1.0, 20.0] && w[1] != w[0]).map(|w| w[1]).collect();
    assert!(
        begins.len() == 2 && distance(begins[0], [0.0, 2.5]) + distance(begins[1], [0.0, 2.1]) < 1e-9,
        "{begins:?}"
    );
    let near = |point: Point| ends.iter().any(|end| distance(*end, point) < 1e-6);
    // Fillet A1 at (-4, 6): the wall ends where it begins, the distance outside of both.
    assert!(near([-3.9, 2.1]) && near([-3.9, 5.0]) && near([-5.0, 6.1]), "{ends:?}");
    assert!(ends.last().is_some_and(|end| distance(*end, [1.0, 20.0]) < 1e-9));
    // Increments U and W give the same as X and Z.
    let increments = STEPS.replace("G1 Z-4", "G1 W-4").replace("X4 Z-12", "U-6 W-2");
    let same = cuts(&format!("G18 G21 F100\n{increments}G0 X20 Z1\nG70 Q100 D0.9 E0.1 P2\nM2\n"));
    assert_eq!(self::ends(&same), ends);
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let run = |profile: &str, cycle: &str| {
        run(&format!("G18 G21 F100\no100 sub\n{profile}\no100 endsub\nG0 X20 Z1\n{cycle}\nM2\n")).err()
    };
    let good = "G0 X2 Z0\nG1 Z-4\nX6 Z-5";
    assert_eq!(run(good, "G71 Q100"), None);
    // The place: a line of the profile, or 0 for the last line of the cycle.
    for (profile, cycle, code, place) in [
        (good, "G71 Q7", "lathe-profile", 0),
        (good, "G71", "word-missing", 0),
        (good, "G17 G71 Q100", "lathe-cycle", 0),
        (good, "G91 G71 Q100", "lathe-cycle", 0),
        (good, "G71 Q100 I0", "lathe-cycle", 0),
        (good, "G71 Q100 I0.0001", "lathe-cycle", 0),
        (good, "G71 Q100 D-1", "negative-word", 0),
        (good, "G71 Q100 X2 Z0", "lathe-cycle", 0),
        (good, "G71 Q100 Y1", "lathe-cycle", 0),
        (good, "G70 Q100 P0", "lathe-cycle", 0),
        (good, "G41.1 D1\nG71 Q100", "cycle-cc", 0),
        ("G0 X2", "G71 Q100", "lathe-profile", 0),
        ("G0 X2 Z0\nG1 Z-4\nX6 Z-2\nX8 Z-9", "G71 Q100", "lathe-profile", 3),
        ("G0 X2 Z0\nG1 Z-4\nX6 Z-2\nX1 Z-9", "G70 Q100", "lathe-profile", 3),
        ("G0 X2 Z0\nG1 X8", "G71 Q100", "lathe-profile", 0),
        ("G0 X2 Z0\nG1 Z-4\nG2 X8 Z-8 I9 K0", "G71 Q100", "arc-radius-mismatch", 3),
        ("G0 X2 Z0\nG1 Z-4\nG81 X6 Y-5 R9", "G71 Q100", "lathe-profile", 3),
        ("G0 X2 Z0\nG1 Z-4 A9\nX6 Z-5", "G71 Q100", "lathe-profile", 2),
        ("G3 X2 Z0 R20\nG1 Z-4\nX6 Z-5", "G71 Q100", "lathe-profile", 1),
        ("G0 X2 Z0\no1 repeat [2000]\nG1 W-1\no1 endrepeat", "G71 Q100", "lathe-profile", 3),
    ] {
        let lines = 5 + profile.matches('\n').count() + cycle.matches('\n').count() + 1;
        let line = if place == 0 { lines } else { 2 + place };
        assert_eq!(run(profile, cycle), Some((code, line as u32)), "{profile}\n{cycle}");
    }
}

/// In a profile A and C are corners, U and W increments: words of axes that the machine lacks are wrong only elsewhere.
#[test]
fn profile_words_need_no_axes() {
    let settings = Settings { axes: AxisSet::new(&[Axis::X, Axis::Y, Axis::Z]), ..Settings::default() };
    let found = |words: &str, use_of_subs: &str| -> Vec<(String, u32, u32, u32)> {
        let text = format!(
            "G18 G21 F100\no7 sub\nG1 Z-9\no7 endsub\no100 sub\nG0 X2 Z0\nG1 Z-4 {words}\nX6 Z-5\no7 call\n\
             o100 endsub\nG0 X20 Z1\n{use_of_subs}\nM2\n"
        );
        let said = static_check(&mut MemorySource::new(text.as_bytes()), &settings, &[], None, "program");
        said.into_iter().map(|d| (d.code, d.line, d.column, d.end_column)).collect()
    };
    let wrong = |code: &str, column: u32| (code.to_string(), 7, column, column + 1);
    assert_eq!(found("C1", "G71 Q100"), []);
    assert_eq!(found("U1 W-1", "G70 Q100"), []);
    assert_eq!(found("A1", "#1=100\nG72 Q#1"), []);
    assert_eq!(found("B1", "G71 Q100"), [wrong("axis-unavailable", 8)]);
    assert_eq!(found("C1", "o100 call"), [wrong("axis-unavailable", 8)]);
    assert_eq!(found("U1 W1", "o100 call\nG71 Q7"), [8, 11].map(|column| wrong("axis-unavailable", column)));
    // Subs of a profile's sub belong to it.
    let nested = "o101 sub\nG0 X2\no100 call\no101 endsub\nG71 Q101";
    assert_eq!(found("C1", nested), []);
}
