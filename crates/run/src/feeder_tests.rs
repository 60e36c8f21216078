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
            let mut source = program.open().unwrap();
            let mut interpreter = prepared(settings(None, &Options::default()), &Options::default());
            let mut frame = Frame::new([0.0; 9], Tolerance { length_mm: 0.01, angle_rad: BLEND_RAD });
            let mut queue = VecDeque::new();
            let mut sink = Events { frame: &mut frame, queue: &mut queue };
            while interpreter.step(&mut *source, &mut sink).unwrap() != Status::Ended {}
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
