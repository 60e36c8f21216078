//! Threads, taps and probing on the simulated machine, judged by the trace alone: the place of the tool against the
//! turns of the spindle, and the joints by the independent checker.

#![allow(clippy::print_stdout)]

use pkm_analysis::checker;
use pkm_canon::diagnostic::Severity;
use pkm_hal_sim::{Observer, Simulation, TickReport, TraceWriter};
use pkm_machine::{Machine, workpiece::solid};
use pkm_run::{Options, Program, Summary, plan, run};
use std::ops::ControlFlow;

struct Trace(TraceWriter<Vec<u8>>);

impl Observer for Trace {
    fn wants_edges(&self) -> bool {
        false
    }
    fn edge(&mut self, _: &pkm_stepgen::Edge) {}
    fn tick(&mut self, report: &TickReport<'_>) {
        self.0.tick(report);
    }
}

fn machine(name: &str, overrides: &[&str]) -> Machine {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Machine::load(name, &overrides).expect("a shipped machine")
}

fn program(text: &str) -> Program {
    Program::Memory { name: "test".to_owned(), text: text.as_bytes().to_vec() }
}

fn drive(text: &str, machine: &Machine, options: &Options) -> (Summary, Vec<u8>) {
    let outputs = |simulation: &Simulation| Trace(TraceWriter::new(Vec::new(), simulation));
    let (summary, outputs) =
        run(&program(text), machine, options, outputs, |_| ControlFlow::Continue(())).expect("readable");
    (summary, outputs.map_or_else(Vec::new, |trace| trace.0.finish().unwrap()))
}

/// The columns of a trace that are asked for, row by row.
fn columns<const N: usize>(trace: &[u8], names: [&str; N]) -> Vec<[f64; N]> {
    let text = std::str::from_utf8(trace).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let place =
        |name: &str| header.iter().position(|h| *h == name).unwrap_or_else(|| panic!("no column {name}"));
    let places = names.map(place);
    let number = |fields: &[&str], place: usize| fields[place].parse().unwrap();
    text.lines()
        .skip(1)
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            places.map(|place| number(&fields, place))
        })
        .collect()
}

fn limits_hold(trace: &[u8], machine: &Machine) {
    let verdict = checker::judge(trace, machine).unwrap();
    assert_eq!(verdict.violations, vec![]);
}

/// Largest |pitch × turns − way from the start| on a line of the program, from where the tool has caught up to where it has to
/// brake for the end, and the rows that is.
fn out_of_step_mm(rows: &[[f64; 3]], line: f64, (start, end): (f64, f64), pitch: f64) -> (f64, usize) {
    let mut worst = (0.0_f64, 0);
    let mut caught_up = false;
    for [at, z, turns] in rows.iter().filter(|[at, ..]| *at == line) {
        assert_eq!(*at, line);
        let (way, ahead) = ((z - start).abs(), (end - z).abs());
        // Still waiting for the index.
        if way == 0.0 {
            continue;
        }
        // At 15 mm/s and 1000 mm/s² it brakes on the last 0.12 mm.
        if ahead < 0.2 || turns.abs() * pitch > (end - start).abs() - 0.2 {
            break;
        }
        let error = (pitch * turns.abs() - way).abs();
        caught_up |= way > 1.0;
        if caught_up {
            worst = (worst.0.max(error), worst.1 + 1);
        }
    }
    worst
}

#[test]
fn a_thread_keeps_step_in_the_trace_in_both_directions() {
    for (turn, line) in [("M3", 4.0), ("M4", 4.0)] {
        let machine = machine("xyz", &[]);
        let text = format!("G21 G90 G94 G61\nG0 X20 Z5\nS600 {turn}\nG33 Z-30 K1.5\nG0 X25\nM5\nM2\n");
        let (summary, trace) = drive(&text, &machine, &Options::default());
        assert!(summary.completed, "{:?}", summary.diagnostics);
        limits_hold(&trace, &machine);
        let rows = columns(&trace, ["line", "axis.z.pos-cmd_mm", "spindle.0.revs"]);
        let (worst, count) = out_of_step_mm(&rows, line, (5.0, -30.0), 1.5);
        println!("{turn}: {worst:e} mm in {count} rows");
        assert!(worst < 1e-9 && count > 2000, "{turn}: {worst} mm in {count} rows");
        let told = summary.synchronisation.expect("a thread");
        assert!(told.threads == 1 && told.max_error_mm < 1e-9 && told.ticks_in_step > 2000, "{told:?}");
    }
}

/// No override, no smoothing reaches a thread; passes at other speeds begin at the same place of the turn.
#[test]
fn a_thread_does_not_hear_the_override() {
    let smooth = machine("xyz", &["path.joint_smoothing_ms=16"]);
    let text =
        "G21 G90 G94 G61\nG0 X20 Z5\nS600 M3\nG33 Z-30 K1.5\nG0 Z5\nS300\nG33 Z-30 K1.5\nG1 X25 F600\nM2\n";
    for feed_override in [1.0, 0.3, 2.0] {
        let (summary, trace) = drive(text, &smooth, &Options { feed_override, ..Options::default() });
        assert!(summary.completed, "{:?}", summary.diagnostics);
        limits_hold(&trace, &smooth);
        let rows = columns(&trace, ["line", "axis.z.pos-cmd_mm", "spindle.0.revs"]);
        for line in [4.0, 7.0] {
            let (worst, count) = out_of_step_mm(&rows, line, (5.0, -30.0), 1.5);
            assert!(worst < 1e-9 && count > 2000, "{feed_override}, line {line}: {worst} mm in {count} rows");
        }
    }
}

#[test]
fn a_tap_goes_in_and_out_by_the_turns_in_the_trace() {
    let machine = machine("xyz", &[]);
    let text = "G21 G90 G94\nG0 X20 Z5\nS400 M3\nG33.1 Z-15 K1.25 I2\nG0 X0\nM2\n";
    let (summary, trace) = drive(text, &machine, &Options::default());
    assert!(summary.completed, "{:?}", summary.diagnostics);
    limits_hold(&trace, &machine);
    let rows = columns(&trace, ["line", "axis.z.pos-cmd_mm", "spindle.0.revs"]);
    let deepest = rows.iter().fold(f64::INFINITY, |least, row| least.min(row[1]));
    assert!((-15.0..-14.97).contains(&deepest), "{deepest}");
    // From a millimetre below the start, in and out again, the turns and the place belong together.
    let inside: Vec<f64> = rows
        .iter()
        .filter(|[line, z, _]| *line == 4.0 && *z < 4.0)
        .map(|[_, z, turns]| (1.25 * turns - (5.0 - z)).abs())
        .collect();
    let worst = inside.iter().copied().fold(0.0, f64::max);
    println!("{worst:e} mm in {} rows", inside.len());
    assert!(worst < 2e-4 && inside.len() > 2000, "{worst} mm in {} rows", inside.len());
    assert_eq!(rows.last().unwrap()[1], 5.0, "back where it began");
}

#[test]
fn a_whole_threading_cycle_runs() {
    let machine = machine("xyz", &[]);
    let text = "G21 G90 G94 G18 G64 P0.02 G8\nG0 X20 Z5\nS500 M3\n\
                G76 P1.5 Z-25 I-2 J0.3 K0.9 R1.5 Q29.5 H1 E1 L3\nM5\nM2\n";
    let (summary, trace) = drive(text, &machine, &Options::default());
    assert!(summary.completed, "{:?}", summary.diagnostics);
    limits_hold(&trace, &machine);
    let told = summary.synchronisation.clone().expect("threads");
    println!("{told:?}");
    assert!(told.threads >= 6 && told.ticks_in_step > 10_000, "{told:?}");
    // A taper's corner changes the speed along the path by a few percent; the tool needs a while for it.
    assert!(told.max_error_mm < 0.02 && summary.max_path_deviation_mm < 0.0225, "{summary:?}");
    let planned = plan(&program(text), &machine, &Options::default()).unwrap();
    assert!(planned.completed && planned.verdict.starts_with("the spindle limits"), "{}", planned.verdict);
    assert!(
        (planned.duration_s - summary.duration_s).abs() < 0.01,
        "{} {}",
        planned.duration_s,
        summary.duration_s
    );
}

#[test]
fn what_cannot_be_in_step_is_refused_with_its_place() {
    let g33 = |spindle: &str, pitch: &str| format!("G21 G90 G94\n{spindle}\nG33 Z-20 {pitch}\nM2\n");
    for (text, overrides, code, line) in [
        (g33("S0 M3", "K1"), vec![], "spindle-speed-zero", 3),
        (g33("S600 M3", "K0"), vec![], "pitch-zero", 3),
        (g33("S600 M3", "K-1"), vec![], "pitch-zero", 3),
        (g33("S6000 M3", "K1.5"), vec![], "spindle-too-fast", 3),
        (g33("S9000 M3", "K0.1"), vec![], "spindle-speed-limit", 3),
        (
            g33("S600 M3", "K1"),
            vec!["spindle.acceleration_rpm_s=1", "spindle.timeout_s=2"],
            "spindle-not-at-speed",
            3,
        ),
        (g33("S1 M3", "K1"), vec!["spindle.timeout_s=2"], "spindle-no-index", 3),
        (g33("G96 S100 M3", "K1"), vec![], "unsupported-motion", 3),
        ("G21 G90\nS3000 M3\nG33.1 Z-3 K1\nM2\n".to_owned(), vec![], "spindle-too-fast", 3),
        (
            "G21 G90\nS600 M3\nG33.1 Z-30 K2\nM2\n".to_owned(),
            vec!["spindle.acceleration_rpm_s=60000"],
            "spindle-ramp",
            3,
        ),
        ("G21 G90\nG33 Z-20 K1\nM2\n".to_owned(), vec![], "", 2),
    ] {
        let machine = machine("xyz", &overrides);
        let (summary, _) = drive(&text, &machine, &Options::default());
        let error = summary.diagnostics.iter().find(|d| d.severity == Severity::Error);
        let error = error.unwrap_or_else(|| panic!("{text}: no error"));
        println!("{}: {}", error.code, error.message);
        assert!(!summary.completed && error.line == line, "{text}: {error:?}");
        assert!(code.is_empty() || error.code == code, "{text}: {error:?}");
    }
}

/// The speed that the refusal names works, and a little more does not.
#[test]
fn the_highest_speed_that_is_named_works() {
    for (name, text, moves) in [
        ("xyz", "G21 G90 G94\nS9999 M3\nG33 Z-60 K4\nM2\n", "Z-60"),
        ("moma-a", "G21 G91 G94\nS9999 M3\nG33 X-60 Y-5 K2\nM2\n", "X"),
    ] {
        let machine = machine(name, &["spindle.max_speed_rpm=10000", "spindle.timeout_s=90"]);
        let (summary, _) = drive(text, &machine, &Options::default());
        let error = &summary.diagnostics[0];
        assert_eq!(error.code, "spindle-too-fast", "{error:?}");
        let named: f64 =
            error.message.split(" is ").last().unwrap().split(' ').next().unwrap().parse().unwrap();
        let (summary, trace) =
            drive(&text.replace("S9999", &format!("S{named}")), &machine, &Options::default());
        println!("{moves}: {named} rpm, {:?}", summary.synchronisation);
        assert!(summary.completed, "{named}: {:?}", summary.diagnostics);
        assert!(summary.synchronisation.unwrap().ticks_in_step > 10, "{named}");
        limits_hold(&trace, &machine);
        let (summary, _) =
            drive(&text.replace("S9999", &format!("S{}", named + 0.2)), &machine, &Options::default());
        assert!(!summary.completed, "{named}");
    }
}

#[test]
fn the_spindle_stops_at_an_angle() {
    let machine = machine("xyz", &[]);
    let text = "G21 G90 G94\nS600 M3\nG4 P1\nM19 R90\nG1 X5 F600\nM2\n";
    let (summary, trace) = drive(text, &machine, &Options::default());
    assert!(summary.completed, "{:?}", summary.diagnostics);
    let turns = columns(&trace, ["spindle.0.revs"]).last().unwrap()[0];
    assert!((turns.fract() - 0.25).abs() < 1e-9, "{turns}");
}

fn probe(text: &str, surfaces: &[&str]) -> (Summary, Vec<u8>) {
    let solids: Vec<_> = surfaces.iter().map(|text| solid(text).unwrap()).collect();
    let options = Options { workpiece: Some(&*solids.leak()), ..Options::default() };
    drive(text, &machine("xyz", &[]), &options)
}

fn parameter(summary: &Summary, number: i32) -> f64 {
    assert!(summary.completed, "{:?}", summary.diagnostics);
    summary.parameters.as_ref().unwrap().get(number)
}

#[test]
fn a_probe_stops_and_tells_where_it_touched() {
    let text = "G21 G90 G94\nG0 X10 Y10 Z10\nG38.2 Z-20 F300\n#100=#5063\n#101=#5070\nG1 Z[#100+3]\n\
                G38.3 Z0\n#102=#5070\n#103=#5063\nG0 Z-3\nG38.5 Z8 F60\nM2\n";
    let (summary, trace) = probe(text, &["Z-2.5"]);
    limits_hold(&trace, &machine("xyz", &[]));
    // 300 mm/min are 5 µm a period: that much later at the most.
    let touched = parameter(&summary, 100);
    assert!((-2.505..=-2.5).contains(&touched), "{touched}");
    assert_eq!(parameter(&summary, 101), 1.0);
    // Moved away and not that far again.
    assert_eq!((parameter(&summary, 102), parameter(&summary, 103)), (0.0, 0.0));
    // Out of contact again, a micrometre a period.
    let lost = parameter(&summary, 5063);
    assert!(lost > -2.5 && lost <= -2.499 + 1e-12, "{lost}");
    // Where it touched is where the trace has it at the first row at or below the surface, and it stops within v²/2a of it.
    let rows = columns(&trace, ["line", "axis.z.pos-cmd_mm"]);
    let at = rows.iter().find(|row| row[0] == 3.0 && row[1] <= -2.5).expect("it touches");
    assert_eq!(at[1], touched);
    let lowest = rows.iter().filter(|row| row[0] == 3.0).fold(f64::INFINITY, |least, row| least.min(row[1]));
    assert!(touched - lowest <= 5.0 * 5.0 / 2000.0 + 0.011 && lowest < touched, "{touched} {lowest}");
}

#[test]
fn probing_that_fails_is_told_with_its_place() {
    for (text, surfaces, code) in [
        ("G21 G90 G94\nF300\nG38.2 Z-4\nM2\n", vec!["Z-5"], "probe-no-contact"),
        ("G21 G90 G94\nF300\nG38.4 X4\nM2\n", vec!["X-1..9"], "probe-no-contact"),
        ("G21 G90 G94\nF300\nG38.2 Z-4\nM2\n", vec!["Z5"], "probe-at-start"),
        ("G21 G90 G94\nF300\nG38.5 Z-4\nM2\n", vec!["Z-5"], "probe-at-start"),
        ("G21 G90 G94\nF300\nG38.2 Z-4\nM2\n", vec![], "probe-not-wired"),
        ("G21 G90 G94\nF300\nG38.2 Z-900\nM2\n", vec!["Z-5"], "limit_low:Z"),
    ] {
        let (summary, _) = probe(text, &surfaces);
        let error = summary.diagnostics.iter().find(|d| d.severity == Severity::Error).expect("an error");
        println!("{}: {}", error.code, error.message);
        assert!(!summary.completed && error.line == 3, "{text}: {error:?}");
        assert!(error.code == code || code.starts_with("limit"), "{text}: {error:?}");
    }
}
