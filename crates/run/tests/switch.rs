//! Programs that switch the mechanism: what moves, what holds, what is refused before anything moves.

use pkm_analysis::checker;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_hal_sim::{Observer, Simulation, TickReport, TraceWriter};
use pkm_kins::Joints;
use pkm_machine::Machine;
use pkm_run::{Options, Program, Summary, check, plan, run};
use std::ops::ControlFlow;

fn load(name: &str, overrides: &[&str]) -> Machine {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Machine::load(name, &overrides).unwrap_or_else(|findings| panic!("{name}: {findings:?}"))
}

fn program(text: &str) -> Program {
    Program::Memory { name: "test.ngc".to_owned(), text: text.as_bytes().to_vec() }
}

/// One row of a run: line, commanded joints, x y z.
struct Row {
    line: u32,
    joints: Joints,
    place: [f64; 3],
}

struct Rows {
    rows: Vec<Row>,
    trace: TraceWriter<Vec<u8>>,
}

impl Observer for Rows {
    fn edge(&mut self, _: &pkm_stepgen::Edge) {}

    fn tick(&mut self, report: &TickReport<'_>) {
        self.trace.tick(report);
        let setpoint = report.setpoint;
        let pose = setpoint.pose;
        self.rows.push(Row { line: setpoint.line, joints: setpoint.joints, place: [pose.x, pose.y, pose.z] });
    }
}

/// Runs a program to its end; the judge must find nothing.
fn drive(text: &str, machine: &Machine, options: &Options) -> (Vec<Row>, Summary) {
    let outputs =
        |simulation: &Simulation| Rows { rows: Vec::new(), trace: TraceWriter::new(Vec::new(), simulation) };
    let (summary, rows) =
        run(&program(text), machine, options, outputs, |_| ControlFlow::Continue(())).expect("readable");
    let rows = rows.unwrap_or_else(|| panic!("refused: {:?}", summary.diagnostics));
    assert!(summary.completed, "{:?}", summary.diagnostics);
    let trace = rows.trace.finish().unwrap();
    if options.substeps == 1 {
        let verdict = checker::judge(trace.as_slice(), machine).unwrap();
        assert_eq!(verdict.violations, vec![]);
    }
    (rows.rows, summary)
}

/// The errors of a program: code and line. Check, run and plan must refuse it alike.
fn errors(text: &str, machine: &Machine) -> Vec<(String, u32)> {
    let of = |diagnostics: &[Diagnostic]| -> Vec<(String, u32)> {
        let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error);
        errors.map(|d| (d.code.clone(), d.line)).collect()
    };
    let options = Options::default();
    let checked = check(&program(text), machine, &options).unwrap();
    let found = of(&checked.diagnostics);
    let nothing = |_: &Simulation| -> Rows { panic!("something moves") };
    if !found.is_empty() {
        let (summary, outputs) =
            run(&program(text), machine, &options, nothing, |_| ControlFlow::Continue(())).unwrap();
        assert!(outputs.is_none() && !summary.completed);
        assert_eq!(of(&summary.diagnostics), found);
    }
    let plan = plan(&program(text), machine, &options).unwrap();
    assert_eq!(plan.completed, found.is_empty(), "{:?}", plan.diagnostics);
    found
}

fn error(code: &str, line: u32) -> Vec<(String, u32)> {
    vec![(code.to_owned(), line)]
}

#[test]
fn idle_joints_hold_exactly() {
    let text = "F3000\nG0 X20 Y-10 Z40 B15\nM429\nG1 U10 V20 W5 C40 B12\nG0 W20\nM428\nG1 X-5 Y7 B0\nM2\n";
    let machine = load("hv-mill-7", &[]);
    let (rows, _) = drive(text, &machine, &Options::default());
    let joints_in = |lines: &[u32]| -> Vec<Joints> {
        rows.iter().filter(|row| lines.contains(&row.line)).map(|row| row.joints).collect()
    };
    let moves = |all: &[Joints], joint: usize| all.iter().any(|joints| joints[joint] != all[0][joint]);
    let (first, v, last) = (joints_in(&[2]), joints_in(&[4, 5]), joints_in(&[7]));
    for (all, moving, held) in [
        (&first, vec![0, 1, 4, 5], [2, 3, 6].as_slice()),
        (&v, vec![2, 3, 4, 5, 6], &[0, 1]),
        (&last, vec![0, 1, 5], &[2, 3, 6]),
    ] {
        assert!(moving.iter().all(|&joint| moves(all, joint)), "{moving:?} move");
        for &joint in held {
            assert!(!moves(all, joint), "joint {joint} holds to the last bit");
        }
    }
    // From where one mechanism leaves off the other goes on.
    assert_eq!(first.last().unwrap()[..2], v[0][..2]);
    assert_eq!(v.last().unwrap()[2..4], last[0][2..4]);
    assert_eq!(v.last().unwrap()[6], last[0][6]);
}

#[test]
fn the_interpreter_is_told_where_the_machine_stands() {
    // V at rest is not at W0: an incremental move of 1 mm must be 1 mm long, and so with G92 and back in H.
    let machine = load("hv-mill-7", &[]);
    let text = "F600\nG1 Z5\nM429\nG91 G1 W1\nG90 G92 W0\nW2\nM428\nG91 X3\nM2\n";
    let (_, summary) = drive(text, &machine, &Options::default());
    assert!((summary.path_length_mm - (5.0 + 1.0 + 2.0 + 3.0)).abs() < 1e-9, "{}", summary.path_length_mm);
    // The same with the switch in a subroutine and other words in its block.
    let text = "F600\no1 sub\nM3 S100 M429 G4 P0.1\no1 endsub\nG1 Z5\no1 call\nG91 G1 W1\nM2\n";
    let (_, summary) = drive(text, &machine, &Options::default());
    assert!((summary.path_length_mm - 6.0).abs() < 1e-9, "{}", summary.path_length_mm);
    // What H did is no path of V's.
    let (_, summary) = drive("F600\nG1 Z5\nM429 G4 P0.1\nM2\n", &machine, &Options::default());
    let (_, without) = drive("F600\nG1 Z5\nM429\nM2\n", &machine, &Options::default());
    assert_eq!(summary.servo_ticks, without.servo_ticks + 100, "the dwell after a switch is no less a dwell");
    let deviation = summary.max_path_deviation_mm;
    assert!(deviation <= summary.half_step_reach_mm, "{deviation}");
}

#[test]
fn a_switch_without_reach_is_refused_with_its_line() {
    // W is too high when V comes alive.
    let machine =
        load("hv-mill-7", &["axis.w.min_mm=-60", "axis.w.max_mm=0", "kinematics.v.rest_mm=[50, 50]"]);
    assert_eq!(errors("G0 X1\nG0 X2\n  M429\nG0 U1\nM2\n", &machine), error("axis_limit_high:W", 3));
    // V's joints at rest are no state of V at all.
    let machine =
        load("hv-mill-7", &["kinematics.v.rest_mm=[0, 200]", "kinematics.v.mechanism.l_mm=[195, 90]"]);
    assert_eq!(errors("G0 X1\nM429\nM2\n", &machine), error("working_mode:2", 2));
}

#[test]
fn each_block_is_checked_with_the_mechanism_in_force() {
    let machine = load("hv-mill-7", &[]);
    assert_eq!(errors("G0 X70 Y50\nM429\nG0 U20\nM428\nG0 X0\nM2\n", &machine), []);
    // Coordinates of the other mechanism do not move.
    assert_eq!(errors("G0 X70\nM429\nG0 X0\nM2\n", &machine), error("axis_locked", 3));
    assert_eq!(errors("G0 U1\nM2\n", &machine), error("axis_locked", 1));
    // W500 is far out of V's reach; H does not see it.
    let found = errors("M429\nG0 U0 V0 W500\nM2\n", &machine);
    assert_eq!(found[0].1, 2, "{found:?}");
}

#[test]
fn codes_that_the_machine_does_not_have_are_unknown() {
    for (machine, code) in
        [("moma-a", "M428"), ("hv-mill-7", "M430"), ("hv-mill-7", "M450"), ("ox-glide-o", "M428")]
    {
        let text = format!("G4 P0\n{code}\nM2\n");
        assert_eq!(errors(&text, &load(machine, &[])), error("m-unknown", 2), "{machine} {code}");
    }
    // The machine file says which they are.
    let machine = load("hv-mill-7", &["switch.1.code=177"]);
    assert_eq!(errors("M177\nG91 G0 U1\nM428\nM2\n", &machine), []);
    assert_eq!(errors("M429\nM2\n", &machine), error("m-unknown", 1));
    assert_eq!(errors("G0 X1\nM177 X2\nM2\n", &machine), error("axis-clash", 2));
}

#[test]
fn the_form_switch_is_a_joint_move_at_constant_x_and_z() {
    let machine = load("ox-glide-o", &[]);
    let text = "F1200\nG1 X66 Y66\nM451\nG1 X64 Y60\nM451\nG1 X65\nM450\nG1 Y70\nM2\n";
    for smoothing in ["0", "10"] {
        let machine = load("ox-glide-o", &[&format!("path.joint_smoothing_ms={smoothing}")]);
        for substeps in [1, 4] {
            let (rows, summary) = drive(text, &machine, &Options { substeps, ..Options::default() });
            let on: Vec<&Row> = rows.iter().filter(|row| row.line == 3).collect();
            let x = on.iter().fold(0.0_f64, |worst, row| worst.max((row.place[0] - 66.0).abs()));
            let z = on.iter().fold(0.0_f64, |worst, row| worst.max((row.place[2] - 100.0).abs()));
            if smoothing == "0" {
                // Begins with a servo period, so that the servo sees the stop before it.
                let first = rows.iter().position(|row| row.line == 3).unwrap();
                assert_eq!(first % substeps as usize, 0);
            }
            // An average is half a window late: its last rows already hold a little of the next move.
            let slack = if smoothing == "0" { 1e-9 } else { 2e-3 };
            assert!(x < slack && z < slack, "{smoothing} {substeps}: {x} {z}");
            let y: Vec<f64> = on.iter().map(|row| row.place[1]).collect();
            let top = y.iter().fold(0.0_f64, |top, &y| top.max(y));
            assert!((79.99..=80.0 + 1e-9).contains(&top), "{smoothing} {substeps}: {top}");
            assert!((y.last().unwrap() - 66.0).abs() < 1e-6 + slack, "comes back to y: {:?}", y.last());
            // No jump of the pose shown: dy/dt = c ċ/y is at most 55 · 100/58 mm/s.
            let jump = y.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
            assert!(jump < 0.1, "{smoothing} {substeps}: {jump}");
            // c = (CD − AB − s)/2 changes its sign.
            let c = |row: &Row| (row.joints[1] - row.joints[0] - 20.0) / 2.0;
            assert!(c(on[0]) > 40.0 && c(on[on.len() - 1]) < -40.0);
            // Path length: of the programmed moves alone.
            assert!((summary.max_path_deviation_mm) < 0.06, "{}", summary.max_path_deviation_mm);
        }
    }
    // The second M451 is in force already: nothing moves. Check says what a switch means, and where.
    let checked = check(&program(text), &machine, &Options::default()).unwrap();
    let notes: Vec<(&str, u32)> = checked.diagnostics.iter().map(|d| (d.code.as_str(), d.line)).collect();
    assert_eq!(notes, [("form-switch", 3), ("form-switch", 7)]);
    // The plan books its time under its line: 90.4 mm with 100 mm/s and 1000 mm/s² take 1.004 s.
    let plan = plan(&program(text), &machine, &Options::default()).unwrap();
    let block = plan.blocks.iter().find(|block| block.line == 3).expect("line 3 takes time");
    assert!((block.duration_s - 1.005).abs() < 0.002, "{}", block.duration_s);
}

#[test]
fn a_form_switch_without_room_is_refused_with_its_line() {
    let o = load("ox-glide-o", &[]);
    // In X there is room at x = 45, in O there is not.
    let text = "M451\nG0 Y60\nG0 X45\nM450\nG0 X1\nM2\n";
    assert_eq!(errors(text, &o), error("limit_low:AB", 4));
    // Nearer to c = 0 than the guard no move may go, and so no switch begins there.
    let x = load("ox-glide-x", &[]);
    assert_eq!(errors("G0 Y79.99\nM2\n", &x), error("singular:form_switch", 1));
    assert_eq!(errors("G0 Y79.97\nM450\nM451\nM2\n", &x), []);
    let start = pkm_kins::Pose { x: 65.0, y: 79.99, z: 100.0, ..pkm_kins::Pose::ZERO };
    let options = Options { start: Some(start), ..Options::default() };
    let checked = check(&program("M450\nM2\n"), &x, &options).unwrap();
    let found: Vec<(&str, u32)> = checked.diagnostics.iter().map(|d| (d.code.as_str(), d.line)).collect();
    assert_eq!(found, [("singular:form_switch", 1), ("not-checked", 1)]);
}

/// An error in the block of a switch does not mislead the check behind it: the switch counts as done, and the blocks behind it
/// are judged on the mechanism it leads to.
#[test]
fn an_error_in_the_block_of_a_switch_does_not_mislead_the_check() {
    let machine = load("hv-mill-6", &[]);
    let right = "F500\nM429\nG0 U1\nM2\n";
    assert_eq!(errors(right, &machine), []);
    // Without the switch the axes of the other mechanism are locked.
    let locked = errors("F500\nG0 U1\nM2\n", &machine);
    assert_eq!(locked.iter().map(|(_, line)| *line).collect::<Vec<_>>(), [2], "{locked:?}");
    let wrong = errors("F500\nM429 G0 Q3\nG0 U1\nM2\n", &machine);
    assert_eq!(wrong, [("word-unused".to_owned(), 2)]);
}
