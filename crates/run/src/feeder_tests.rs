//! The controller between interpreter and planner: aborts, blocks that move nothing, feeds.

use super::*;
use crate::on_a_large_stack;
use crate::setup::{BLEND_RAD, inside, prepared, settings};
use pkm_kins::maths;
use pkm_planner::path::{FeedGroup, Tolerance};

fn program(text: &str) -> Program {
    Program::Memory { name: "tested.ngc".to_owned(), text: text.as_bytes().to_vec() }
}

fn machine(name: &str) -> Machine {
    Machine::load(name, &[]).unwrap_or_else(|errors| panic!("{name}: {errors:?}"))
}

/// Drives to the end, aborted after so many ticks; gives every setpoint to `seen` and the controller back to `end`.
fn drive<T>(
    machine: &Machine,
    text: &str,
    abort_at: u64,
    mut seen: impl FnMut(&pkm_planner::Setpoint),
    end: impl FnOnce(&Feeder<'_>) -> T,
) -> T {
    let program = program(text);
    let mut feeder = Feeder::new(&program, machine, &Options::default()).unwrap();
    let mut ticks = 0;
    while !feeder.is_done() {
        let operator = Operator { abort: ticks >= abort_at, ..Operator::default() };
        feeder.feedback(&Feedback { operator, ..Feedback::default() });
        feeder.next(ticks).unwrap();
        seen(feeder.setpoint());
        ticks += 1;
        assert!(ticks < 1_000_000, "it does not end");
    }
    end(&feeder)
}

const SHAPE: &str = "G21 G64 P0.1\nG1 X6 Y-262 F3000\nG2 X9 Y-265 I0 J-3\nG4 P0.05\nG20\nG92 X1\nG1 X0.6 F90\nG1 Y-10.5\nM2\n";

#[test]
fn after_an_abort_the_program_stands_where_the_machine_stands() {
    on_a_large_stack(|| {
        let machine = machine("moma-a");
        let mut ticks = 0;
        drive(&machine, SHAPE, u64::MAX, |_| ticks += 1, |feeder| assert!(feeder.failure().is_none()));
        let mut before_the_end = 0;
        for at in (0..ticks).step_by(17) {
            drive(
                &machine,
                SHAPE,
                at,
                |_| {},
                |feeder| {
                    let last = *feeder.setpoint();
                    assert_eq!(feeder.failure().unwrap().code, "aborted", "tick {at}");
                    assert_eq!(last.joint_velocity, [0.0; 9], "tick {at}");
                    let stands = last.pose.to_array();
                    assert_eq!(*feeder.frame.position(), stands, "tick {at}: the frame");
                    let believed = inside(&feeder.interpreter.machine_position_mm());
                    for (believed, stands) in believed.iter().zip(stands) {
                        // inches and an offset of an inch lie between them
                        assert!((believed - stands).abs() < 1e-9, "tick {at}: {believed}, really {stands}");
                    }
                    before_the_end += u32::from(last.span.line < 7);
                },
            );
        }
        assert!(before_the_end > 10, "{before_the_end}: nothing was interrupted");
    });
}

/// What LinuxCNC's issue 1813 complains of: an S word on every line makes the motion stutter there.
#[test]
fn blocks_that_move_nothing_never_stop_the_motion() {
    on_a_large_stack(|| {
        let machine = machine("moma-a");
        let moves: Vec<String> = (1..=60)
            .map(|n| {
                let angle = f64::from(n) * 0.05;
                let (y, x) = (maths::sin(angle), maths::cos(angle));
                format!("X{:.4} Y{:.4}", 6.0 - 6.0 * x, -265.0 + 6.0 * y)
            })
            .collect();
        let run = |mode: &str, words: &str, between: &mut dyn FnMut() -> String| {
            let mut text = format!("G21 {mode} F2000\nS1000 M3\n");
            for block in &moves {
                text += &format!("G1 {block} {words}\n{}", between());
            }
            text += "M2\n";
            let mut joints = Vec::new();
            drive(
                &machine,
                &text,
                u64::MAX,
                |setpoint| joints.push(setpoint.joints),
                |feeder| {
                    assert!(feeder.failure().is_none(), "{text}: {:?}", feeder.failure());
                    assert_eq!(feeder.starved_stops(), 0, "{text}");
                },
            );
            joints
        };
        for mode in ["G64 P0.02", "G64 P0.02 Q0.01", "G61"] {
            let plain = run(mode, "", &mut String::new);
            for (words, between) in [
                ("S1000", ""),
                ("F2000", ""),
                ("M8", ""),
                ("(a remark)", ""),
                ("", "S1000\n"),
                ("", "F2000\n"),
                ("", "M7\nM8\nM9\n"),
                ("", "(a remark)\n; another\n\n(MSG, a message)\n"),
                ("", "#1=5\nG90 G17 G94\nF2000\n"),
            ] {
                // to the bit, tick by tick
                let run = run(mode, words, &mut || between.to_owned());
                let at = run.iter().zip(&plain).position(|(a, b)| a != b);
                assert!(
                    run == plain,
                    "{mode}: '{words}', '{between}' changes the motion: {} ticks for {}, from tick {at:?} on",
                    run.len(),
                    plain.len()
                );
            }
            // A speed that changes is ordered where it stands, so chords are not joined across it; nothing stops for it.
            let mut speeds = (0..).map(|n| format!("S{}\n", 900 + n % 7 * 10));
            let changing = run(mode, "", &mut || speeds.next().unwrap());
            let stands = changing.windows(2).filter(|pair| pair[0] == pair[1]).count();
            assert!(mode == "G61" || stands < 3, "{mode}: at rest in {stands} ticks");
            assert!(changing.len() <= plain.len() + plain.len() / 50, "{mode}: {} ticks", changing.len());
            // A dwell stops, if only for no time; in G61 every corner does.
            assert!(
                mode == "G61" || run(mode, "", &mut || "G4 P0\n".to_owned()).len() > plain.len(),
                "{mode}: G4 P0"
            );
        }
    });
}

/// F counts XYZ where XYZ moves, else UVW, else the angle of ABC; in G93 and G95 as in G94.
#[test]
fn every_feed_mode_uses_the_one_feed_length() {
    // the move, its feed length in mm or degrees, and what that counts
    let cases = [
        ("X3 Y4 A90", 5.0, FeedGroup::Xyz),
        ("Z2 U9 C30", 2.0, FeedGroup::Xyz),
        ("U6 V8 B45", 10.0, FeedGroup::Uvw),
        ("A30 B40", 50.0, FeedGroup::Abc),
    ];
    for (words, length, group) in cases {
        // units per minute
        for (feed, speed) in
            [("G94 F120", 120.0), ("G95 S600 F0.5", 300.0), ("G93", length * 4.0), ("G20 G93", length * 4.0)]
        {
            let inch = feed.starts_with("G20");
            let per_move = if feed.ends_with("G93") { "F4" } else { "" };
            let text = format!("{feed}\nG1 {words} {per_move}\nM2\n");
            let program = program(&text);
            let mut source = program.open(&[]).unwrap();
            let mut interpreter = prepared(settings(None, &Options::default()), &Options::default());
            let mut frame = Frame::new([0.0; 9], Tolerance { length_mm: 0.01, angle_rad: BLEND_RAD });
            let mut queue = VecDeque::new();
            let mut sink = Events { frame: &mut frame, queue: &mut queue };
            while interpreter.step(&mut source, &mut sink).unwrap() != Status::Ended {}
            let found: Vec<Move> = queue
                .iter()
                .filter_map(|(event, _)| if let Event::Move(step) = event { Some(*step) } else { None })
                .collect();
            let [step] = found.as_slice() else { panic!("{text}: {found:?}") };
            assert_eq!(step.feed.group, group, "{text}");
            let unit = match group {
                FeedGroup::Abc => maths::radians(1.0),
                _ if inch => 25.4,
                _ => 1.0,
            };
            let speed = speed * unit / 60.0;
            assert!(
                (step.feed.speed - speed).abs() < 1e-9 * speed,
                "{text}: {} for {speed}",
                step.feed.speed
            );
            let counted = step.geometry.length() * feed_length(&step.geometry.at(0.0).first, group);
            assert!((counted - length * unit).abs() < 1e-9 * counted, "{text}: {counted}");
        }
    }
}

/// A point of a NURBS by the basis functions of Cox and de Boor; the planner climbs de Boor's triangle instead.
fn nurbs(points: &[[f64; 3]], knots: &[f64], order: usize, t: f64) -> [f64; 2] {
    fn basis(i: usize, k: usize, t: f64, knots: &[f64]) -> f64 {
        if k == 1 {
            let last = t == knots[knots.len() - 1] && knots[i] < t && knots[i + 1] == t;
            return f64::from(knots[i] <= t && t < knots[i + 1] || last);
        }
        let part = |over: f64, under: f64, of: f64| if under > 0.0 { over / under * of } else { 0.0 };
        part(t - knots[i], knots[i + k - 1] - knots[i], basis(i, k - 1, t, knots))
            + part(knots[i + k] - t, knots[i + k] - knots[i + 1], basis(i + 1, k - 1, t, knots))
    }
    let mut sums = [0.0; 3];
    for (i, [a, b, weight]) in points.iter().enumerate() {
        let share = weight * basis(i, order, t, knots);
        sums = [sums[0] + share * a, sums[1] + share * b, sums[2] + share];
    }
    [sums[0] / sums[2], sums[1] / sums[2]]
}

/// Begin, middle and end of the curve and everything between, in the plane that was selected.
#[test]
fn splines_are_driven_in_their_plane() {
    const CUBIC: [[f64; 3]; 4] = [[0.0, 0.0, 1.0], [9.0, 2.0, 1.0], [17.0, 16.0, 1.0], [20.0, 10.0, 1.0]];
    const RATIONAL: [[f64; 3]; 4] = [[5.0, 3.0, 1.0], [10.0, 20.0, 3.0], [25.0, 20.0, 0.5], [30.0, 0.0, 1.0]];
    let (cubic_knots, own_knots) =
        ([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 2.0, 3.0, 3.0, 3.0]);
    // The plane, its two letters in the order of I and J, and the axes of those letters and of the third.
    let planes = [("G17", "XY", [0, 1, 2]), ("G18", "XZ", [0, 2, 1]), ("G19", "YZ", [1, 2, 0])];
    on_a_large_stack(|| {
        let machine = machine("xyz");
        for (plane, letters, [a_axis, b_axis, third]) in planes {
            let [a, b] = letters.chars().collect::<Vec<_>>()[..] else { panic!("two letters") };
            let third_letter = ["X", "Y", "Z"][third];
            let point = |p: &[f64; 3]| format!("{a}{} {b}{}", p[0], p[1]);
            let cubic = format!("G5 {} I9 J2 P-3 Q6", point(&CUBIC[3]));
            let mut own = format!("G6.2 P3 Q1 {} R1 K0\n", point(&RATIONAL[0]));
            for (p, knot) in RATIONAL[1..].iter().zip(&own_knots[1..]) {
                own += &format!("{} R{} K{knot}\n", point(p), p[2]);
            }
            own += "K3\nK3\nK3";
            let cases = [(&cubic, CUBIC, &cubic_knots[..], 4), (&own, RATIONAL, &own_knots[..], 3)];
            for (block, points, knots, order) in cases {
                let text = format!("G61 {plane} F2000\nG0 {third_letter}7\n{block}\nM2\n");
                let mut driven: Vec<[f64; 3]> = Vec::new();
                drive(
                    &machine,
                    &text,
                    u64::MAX,
                    |setpoint| {
                        if setpoint.span.line >= 3 {
                            driven.push([setpoint.pose.x, setpoint.pose.y, setpoint.pose.z]);
                        }
                    },
                    |feeder| assert!(feeder.failure().is_none(), "{text}{:?}", feeder.failure()),
                );
                assert!(driven.iter().all(|p| (p[third] - 7.0).abs() < 1e-9), "{text}: it leaves its plane");
                let driven: Vec<[f64; 2]> = driven.iter().map(|p| [p[a_axis], p[b_axis]]).collect();
                let last = knots[knots.len() - 1];
                let distance = |p: &[f64; 2], q: &[f64; 2]| maths::hypot(p[0] - q[0], p[1] - q[1]);
                let curve: Vec<[f64; 2]> = (0..=20_000)
                    .map(|k| nurbs(&points, knots, order, last * f64::from(k) / 20_000.0))
                    .collect();
                // One period at 2000 mm/min is 0.034 mm.
                for (name, place) in [("begin", 0), ("middle", 10_000), ("end", 20_000)] {
                    let nearest = driven.iter().map(|p| distance(p, &curve[place])).fold(f64::MAX, f64::min);
                    assert!(nearest < 0.02, "{text}: {nearest} mm from the {name} {:?}", curve[place]);
                }
                assert!(distance(driven.last().unwrap(), &curve[20_000]) < 1e-9, "{text}: it ends elsewhere");
                // From where the spline begins on every setpoint lies on it.
                let begin = driven.iter().position(|p| distance(p, &curve[0]) < 0.02).unwrap();
                for p in &driven[begin..] {
                    let nearest = curve.iter().map(|q| distance(p, q)).fold(f64::MAX, f64::min);
                    assert!(nearest < 0.02, "{text}: {p:?} is {nearest} mm off");
                }
            }
        }
    });
}
