//! Splines outside the XY plane and NURBS with knots of their own: what LinuxCNC 2.10 and pkm have and 2.9 lacks. There is no
//! oracle for 2.10 here; the rules are those of its G codes' description.

use pkm_canon::text::{Spelling, TextWriter};
use pkm_canon::{Canon, CanonSink, ControlPoint, Plane, Span};
use pkm_gcode::{Dialect, Interpreter, MemorySource, Settings, Status};

/// A spline as it was commanded.
#[derive(Debug, Clone, PartialEq)]
struct Spline {
    plane: Plane,
    points: Vec<[f64; 3]>,
    knots: Vec<f64>,
    order: u32,
}

#[derive(Default)]
struct Splines {
    splines: Vec<Spline>,
    text: Vec<String>,
}

impl CanonSink for Splines {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        let mut line = Vec::new();
        TextWriter::new(|bytes: &[u8]| line = bytes.to_vec(), Spelling::V2_10).command(command, span);
        self.text.push(String::from_utf8_lossy(&line)[13..].trim_end().to_owned());
        if let Canon::NurbsFeed { plane, points, knots, order } = *command {
            let points = points.iter().map(|p: &ControlPoint| [p.first, p.second, p.weight]).collect();
            self.splines.push(Spline { plane, points, knots: knots.to_vec(), order });
        }
    }
}

/// What a program commands, its errors, and where it ends.
fn run(dialect: Dialect, program: &str) -> (Splines, Vec<String>, [f64; 9]) {
    let text = program.replace('|', "\n");
    let mut source = MemorySource::new(text.as_bytes());
    let mut interpreter = Interpreter::new(Settings { dialect, ..Settings::default() });
    let (mut sink, mut errors) = (Splines::default(), Vec::new());
    loop {
        match interpreter.step(&mut source, &mut sink) {
            Ok(Status::Ended) => break,
            Ok(_) => {}
            Err(error) => {
                errors.push(error.kind.code().to_owned());
                if interpreter.has_ended() {
                    break;
                }
            }
        }
    }
    (sink, errors, interpreter.position().to_array())
}

const NEWER: [Dialect; 2] = [Dialect::LinuxCnc210, Dialect::Pkm];

#[test]
fn control_points_are_in_the_axes_of_the_plane() {
    // First and second axis: G18 Z X, G19 Y Z; I along the first letter of the two, J along the other.
    for dialect in NEWER {
        for code in ["G5.1", "G6.1"] {
            let program = format!("F100|G18|G0 X1 Y2 Z3|{code} X11 Z13 I4 J5|M2");
            let (sink, errors, end) = run(dialect, &program);
            assert!(errors.is_empty(), "{errors:?}");
            let points = vec![[3.0, 1.0, 1.0], [8.0, 5.0, 1.0], [13.0, 11.0, 1.0]];
            assert_eq!(sink.splines, [Spline { plane: Plane::Xz, points, knots: vec![], order: 3 }]);
            assert_eq!(end[..3], [11.0, 2.0, 13.0], "Y stays");
            let program = format!("F100|G19|G0 X1 Y2 Z3|{code} Y11 Z13 I4 J5|M2");
            let (sink, errors, end) = run(dialect, &program);
            assert!(errors.is_empty(), "{errors:?}");
            let points = vec![[2.0, 3.0, 1.0], [6.0, 8.0, 1.0], [11.0, 13.0, 1.0]];
            assert_eq!(sink.splines, [Spline { plane: Plane::Yz, points, knots: vec![], order: 3 }]);
            assert_eq!(end[..3], [1.0, 11.0, 13.0], "X stays");
        }
    }
}

#[test]
fn a_cubic_goes_on_smoothly_in_every_plane() {
    for (code, plane) in [("G17", Plane::Xy), ("G18", Plane::Xz), ("G19", Plane::Yz)] {
        for second in ["G5", "G6"] {
            let [a, b] = match plane {
                Plane::Xy => ["X", "Y"],
                Plane::Xz => ["X", "Z"],
                _ => ["Y", "Z"],
            };
            let program = format!("F100|{code}|G5 {a}10 {b}0 I1 J2 P-3 Q4|{second} {a}20 {b}5 P-1 Q1|M2");
            let (sink, errors, _) = run(Dialect::Pkm, &program);
            assert!(errors.is_empty(), "{code}: {errors:?}");
            assert_eq!(sink.text.iter().filter(|line| *line == "NURBS_G5_FEED(4, ...)").count(), 2);
            let [first, after] = &sink.splines[..] else { panic!("two splines") };
            assert_eq!((first.plane, after.plane), (plane, plane));
            // The end tangent of the one is the start tangent of the other.
            let tangent = |s: &Spline, i: usize| [0, 1].map(|k| s.points[i + 1][k] - s.points[i][k]);
            assert_eq!(tangent(first, 2), tangent(after, 0), "{code}");
            let expected = if plane == Plane::Xz { [-4.0, 3.0] } else { [3.0, -4.0] };
            assert_eq!(tangent(first, 2), expected, "{code}");
        }
    }
}

#[test]
fn linuxcnc_2_10_swaps_the_end_tangent_in_g18() {
    let (sink, errors, _) = run(Dialect::LinuxCnc210, "F100|G18 G5 X10 Z0 I1 J2 P-3 Q4|M2");
    assert!(errors.is_empty(), "{errors:?}");
    assert_eq!(sink.splines[0].points[1..3], [[2.0, 1.0, 1.0], [-3.0, 14.0, 1.0]]);
}

#[test]
fn a_nurbs_block_lies_in_its_plane() {
    for dialect in NEWER {
        let (sink, errors, end) =
            run(dialect, "F100|G18|G0 X1 Y2 Z3|G5.2 P0.5 L3|X4 Z5 P2|X6 Z7 P1|G5.3|G91 G1 Y1|M2");
        assert!(errors.is_empty(), "{errors:?}");
        let points = vec![[3.0, 1.0, 0.5], [5.0, 4.0, 2.0], [7.0, 6.0, 1.0]];
        assert_eq!(sink.splines, [Spline { plane: Plane::Xz, points, knots: vec![], order: 3 }]);
        assert_eq!(end[..3], [6.0, 3.0, 7.0]);
        // A point needs both words of its plane.
        assert_eq!(run(dialect, "F100|G18|G5.2 X1 Y1 P1|M2").1[..1], ["spline-words"]);
    }
}

const KNOTS: &str = "G6.2 P3 Q1 X0 Y0 K0 R1|X0 Y10 K0 R0.5|X10 Y10 K0 R2|X20 Y10 K2 R1|X20 Y0 K3 R1|\
                     G6.2 K5|G6.2 K5|G6.2 K5";

#[test]
fn knots_and_weights_are_those_of_the_blocks() {
    for dialect in NEWER {
        let (sink, errors, end) = run(dialect, &format!("F100|{KNOTS}|G0 X30|M2"));
        assert!(errors.is_empty(), "{errors:?}");
        let points =
            vec![[0.0, 0.0, 1.0], [0.0, 10.0, 0.5], [10.0, 10.0, 2.0], [20.0, 10.0, 1.0], [20.0, 0.0, 1.0]];
        let knots = vec![0.0, 0.0, 0.0, 2.0, 3.0, 5.0, 5.0, 5.0];
        assert_eq!(sink.splines, [Spline { plane: Plane::Xy, points, knots, order: 3 }]);
        assert!(sink.text.contains(&"NURBS_G6_FEED(8, ...)".to_owned()), "{:?}", sink.text);
        assert_eq!(end[..3], [30.0, 0.0, 0.0], "Y is that of the spline's end");
    }
    // pkm takes a knot alone and fractions; LinuxCNC does not.
    let alone = KNOTS.replace("G6.2 K", "K");
    assert!(run(Dialect::Pkm, &format!("F100|{alone}|M2")).1.is_empty());
    assert_eq!(run(Dialect::LinuxCnc210, &format!("F100|{alone}|M2")).1[0], "word-unused");
    let fractions = KNOTS.replace("K3", "K2.5");
    assert!(run(Dialect::Pkm, &format!("F100|{fractions}|M2")).1.is_empty());
    assert_eq!(run(Dialect::LinuxCnc210, &format!("F100|{fractions}|M2")).1[0], "nurbs-knots");
}

#[test]
fn what_is_wrong_with_a_spline_is_named() {
    for (program, code) in [
        ("F100|G6.2 P3 Q4 X0 Y0 K0 R1|M2", "spline-words"),
        ("F100|G6.2 P1 Q1 X0 Y0 K0 R1|M2", "spline-words"),
        ("F100|G6.2 P3 Q1 X0 K0 R1|M2", "spline-words"),
        ("F100|G6.2 P3 Q1 X0 Y0 R1|M2", "spline-words"),
        ("F100|G6.2 P3 Q1 X0 Y0 K0|M2", "spline-words"),
        ("F100|G6.2 P3 Q1 X0 Y0 K0 R0|M2", "spline-words"),
        ("F100|G6.2 P3 Q1 X0 Y0 K0 R1|X1 Y1 P4 K0 R1|M2", "spline-words"),
        ("F100|G6.2 P3 Q1 X0 Y0 K0 R1|X1 Y1 K0 R1|G6.2 K0|X2 Y2 K1 R1|M2", "spline-words"),
        ("F100|G6.2 P2 Q1 X0 Y0 K5 R1|X1 Y1 K4 R1|M2", "nurbs-knots"),
        ("F100|G6.2 P2 Q1 X0 Y0 K0 R1|X1 Y1 K0 R1|X2 Y1 K1 R1|X2 Y1 K1 R1|M2", "nurbs-points"),
        ("F100|G17.1 G5.1 U1 V1 I1 J1|M2", "spline-words"),
        ("F100|G18 G5.1 X1 Z1 A1 I1 J1|M2", "spline-words"),
        ("G18 G5.1 X1 Z1 I1 J1|M2", "feed-zero"),
    ] {
        for dialect in NEWER {
            assert_eq!(
                run(dialect, program).1.first().map(String::as_str),
                Some(code),
                "{dialect:?} {program}"
            );
        }
    }
    // The word of the third axis is refused by pkm; LinuxCNC 2.10 passes over it.
    assert_eq!(run(Dialect::Pkm, "F100|G17 G5.1 X1 Y1 Z1 I1 J1|M2").1, ["spline-words"]);
    assert_eq!(run(Dialect::LinuxCnc210, "F100|G17 G5.1 X1 Y1 Z1 I1 J1|M2").2[..3], [1.0, 1.0, 0.0]);
    assert_eq!(run(Dialect::Pkm, "%|F100|G5.2 X1 Y1 P1|%").1, ["nurbs-points"]);
    assert!(run(Dialect::LinuxCnc210, "%|F100|G5.2 X1 Y1 P1|%").1.is_empty());
    for rest in ["G18", "G20", "G55", "G52 X1", "G0 X1", "M2"] {
        let program = format!("F100|G6.2 P2 Q1 X0 Y0 K0 R1|{rest}|M2");
        assert_eq!(run(Dialect::Pkm, &program).1[0], "nurbs-points", "{rest}");
    }
}

#[test]
fn linuxcnc_2_9_knows_none_of_it() {
    for program in ["F100|G18 G5.1 X1 Z1 I1 J1|M2", "F100|G19 G5 Y1 Z1 I1 J1 P1 Q1|M2"] {
        assert_eq!(run(Dialect::LinuxCnc29, program).1, ["spline-words"], "{program}");
    }
    for code in ["G6", "G6.1", "G6.2"] {
        assert_eq!(run(Dialect::LinuxCnc29, &format!("F100|{code} X1 Y1|M2")).1, ["g-unknown"], "{code}");
    }
}
