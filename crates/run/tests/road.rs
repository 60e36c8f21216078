//! The whole road on the shipped programs: run, then let the independent judge read the trace, and count the VCD back.

#![allow(clippy::print_stdout)]

use pkm_analysis::checker;
use pkm_hal_sim::{Observer, Simulation, TickReport, TraceWriter, VcdSteps, VcdWriter};
use pkm_machine::Machine;
use pkm_run::{Judged, Options, Program, Summary, check, run, run_checked};
use std::ops::ControlFlow;
use std::path::PathBuf;

struct Outputs {
    trace: TraceWriter<Vec<u8>>,
    vcd: VcdWriter<Vec<u8>>,
    /// Counts per joint at every tick, from the simulation itself.
    counts: Vec<(u64, Vec<i64>)>,
}

impl Observer for Outputs {
    fn edge(&mut self, edge: &pkm_stepgen::Edge) {
        self.vcd.edge(edge);
    }

    fn tick(&mut self, report: &TickReport<'_>) {
        self.trace.tick(report);
        self.vcd.tick(report);
        self.counts.push((report.time_ns, report.joints.iter().map(|j| j.count).collect()));
    }
}

/// What a run leaves behind.
struct Left {
    summary: Summary,
    trace: Vec<u8>,
    vcd: Vec<u8>,
    counts: Vec<(u64, Vec<i64>)>,
    /// Of all periods, each judged by itself.
    largest_deviation_mm: f64,
}

fn shipped(program: &str) -> Program {
    Program::File(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../programs").join(program))
}

fn drive(program: &Program, machine: &Machine) -> Left {
    let options = Options::default();
    let outputs = |simulation: &Simulation| Outputs {
        trace: TraceWriter::new(Vec::new(), simulation),
        vcd: VcdWriter::new(Vec::new(), simulation),
        counts: Vec::new(),
    };
    let mut largest_deviation_mm = 0.0_f64;
    let judged = |_: &mut Outputs, judged: &Judged| {
        largest_deviation_mm = largest_deviation_mm.max(judged.deviation_mm.unwrap_or(0.0));
    };
    let checked = check(program, machine, &options).expect("readable");
    let go_on = |_: &_| ControlFlow::Continue(());
    let (summary, outputs) =
        run_checked(program, machine, &options, checked, outputs, go_on, Some(judged)).expect("readable");
    let outputs = outputs.unwrap_or_else(|| panic!("refused: {:?}", summary.diagnostics));
    Left {
        summary,
        trace: outputs.trace.finish().unwrap(),
        vcd: outputs.vcd.finish().unwrap(),
        counts: outputs.counts,
        largest_deviation_mm,
    }
}

/// `blend_mm`: what the program's G64 P allows beyond half a step of every joint.
fn holds(program: &str, machine: &str, blend_mm: f64) {
    let machine = Machine::load(machine, &[]).expect("a shipped machine");
    let Left { summary, trace, vcd, counts, largest_deviation_mm } = drive(&shipped(program), &machine);
    println!("{summary:#?}");
    assert_eq!(summary.max_path_deviation_mm, largest_deviation_mm, "{program}");
    assert!(summary.completed, "{program}: {:?}", summary.diagnostics);
    assert!(summary.max_step_error_steps <= 0.5, "{program}: {}", summary.max_step_error_steps);
    assert_eq!(summary.driver_timing_violations, 0);
    for joint in &summary.joints {
        assert!(joint.peak_velocity <= joint.velocity_limit, "{program}: {joint:?}");
        assert!(joint.peak_acceleration <= joint.acceleration_limit, "{program}: {joint:?}");
    }
    assert!(
        summary.max_path_deviation_mm <= summary.half_step_reach_mm + blend_mm,
        "{program}: {} > {}",
        summary.max_path_deviation_mm,
        summary.half_step_reach_mm
    );
    let verdict = checker::judge(trace.as_slice(), &machine).unwrap();
    assert_eq!(verdict.violations, vec![], "{program}");
    assert_eq!(verdict.rows, summary.servo_ticks + 1);
    // The judge's own peaks agree with the summary's.
    for (peaks, joint) in verdict.joints.iter().zip(&summary.joints) {
        assert!((peaks.velocity - joint.peak_velocity).abs() <= 1e-6 * joint.velocity_limit);
    }
    let mut steps = VcdSteps::new(vcd.as_slice()).unwrap();
    let start: Vec<i64> = {
        let first = trace_row(&trace, 1);
        machine
            .joints
            .iter()
            .enumerate()
            .map(|(n, j)| (first[n] * j.steps_per_unit / j.to_face(1.0)).round() as i64)
            .collect()
    };
    for (time_ns, counts) in &counts {
        let counted = steps.counts_at(*time_ns).unwrap();
        let expected: Vec<i64> = counts.iter().zip(&start).map(|(count, start)| count - start).collect();
        assert_eq!(counted, expected.as_slice(), "{program} at {time_ns} ns");
    }
}

/// The counted joint positions of a row of the trace, from 1 after the header.
fn trace_row(trace: &[u8], row: usize) -> Vec<f64> {
    let text = std::str::from_utf8(trace).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let fields: Vec<&str> = lines.nth(row - 1).unwrap().split(',').collect();
    let counted = header.iter().zip(&fields).filter(|(name, _)| name.contains(".pos-fb_"));
    counted.map(|(_, value)| value.parse().unwrap()).collect()
}

#[test]
fn aerofoil_on_moma_w() {
    holds("moma-w-aerofoil.ngc", "moma-w", 0.0);
}

#[test]
fn moulding_on_moma_w() {
    holds("moma-w-moulding.ngc", "moma-w", 0.0);
}

#[test]
fn arcs_on_moma_a() {
    holds("moma-arcs.ngc", "moma-a", 0.01);
}

#[test]
fn both_mechanisms_of_the_hv_mill() {
    holds("hv-mill-both.ngc", "hv-mill-7", 0.02);
}

#[test]
fn both_forms_of_the_ox_glide() {
    holds("ox-glide-forms.ngc", "ox-glide-o", 0.02);
}

/// Chords that one move stands for, corners that are blended and corners that are not, lines and arcs.
#[test]
fn the_largest_deviation_is_that_of_all_periods() {
    use std::fmt::Write as _;
    let mut text = String::from("G21 G91 G64 P0.02 Q0.02 F1800\n");
    for n in 0..200 {
        let _ = writeln!(text, "G1 X{:.3} Y{:.3}", 0.1 * (1.0 - f64::from(n) / 100.0), 0.05);
    }
    text.push_str("G64 P0.1\nG1 X3\nG1 Y-4\nG61\nG2 X4 I2\nG1 X-2 Y-3\nG64\nG3 X-3 Y3 R3\nG1 X1\nM2\n");
    let program = Program::Memory { name: "largest".to_owned(), text: text.into_bytes() };
    for machine in ["xyz", "moma-a", "ox-glide"] {
        let machine = Machine::load(machine, &[]).expect("a shipped machine");
        let Left { summary, largest_deviation_mm, .. } = drive(&program, &machine);
        assert!(summary.completed, "{:?}", summary.diagnostics);
        assert!(largest_deviation_mm > summary.half_step_reach_mm, "{largest_deviation_mm}: no corner");
        assert_eq!(summary.max_path_deviation_mm, largest_deviation_mm, "{}", machine.name);
    }
}

#[test]
fn nine_axes_and_nine_joints_all_limited() {
    use std::fmt::Write as _;
    let mut text = String::from(
        "name = \"nine\"\nsource = \"a test\"\n[servo]\nperiod_ns = 1000000\n[kinematics]\ntype = \"cartesian\"\n\
         axes = \"XYZABCUVW\"\n",
    );
    for (letter, unit) in "xyzabcuvw".chars().zip(["mm", "deg", "mm"].iter().flat_map(|unit| [unit; 3])) {
        let limits = format!(
            "min_{unit} = -50\nmax_{unit} = 50\nmax_velocity_{unit}_s = 20\nmax_acceleration_{unit}_s2 = 200\n"
        );
        let _ = write!(
            text,
            "[[joint]]\nname = \"{letter}\"\n{limits}steps_per_{unit} = 400\ndriver = {{ model = \"DRV8825\" }}\n\
             [axis.{letter}]\n{limits}"
        );
    }
    text.push_str("[home]\n");
    let machine = Machine::parse("nine", &text, &[]).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
    let program = Program::Memory {
        name: "nine".to_owned(),
        text: b"G21 G90 G64 P0.01 F600\nG1 X10 Y5 Z2 A10 B20 C-5 U12 V5 W3\nG1 X0 Y0 U0 V0 C20\nM2\n"
            .to_vec(),
    };
    let (summary, _) = run(&program, &machine, &Options::default(), |_| (), |_| ControlFlow::Continue(()))
        .expect("readable");
    assert!(summary.completed, "{:?}", summary.diagnostics);
    assert!(
        summary.joints.iter().all(|joint| joint.steps > 0 && joint.peak_velocity <= joint.velocity_limit)
    );
}
