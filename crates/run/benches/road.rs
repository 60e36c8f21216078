//! `cargo bench --package pkm-run`: how much faster than real time a run is, and how much memory a long program takes.
//!
//! Each figure is the median of several runs in one process; the ratio to real time is what counts.
#![allow(clippy::print_stdout, clippy::disallowed_methods)]

use pkm_hal_sim::{Observer, Simulation, TickReport, TraceWriter, VcdWriter};
use pkm_machine::Machine;
use pkm_run::{Options, Program, Summary, check, run};
use std::fmt::Write as _;
use std::io::sink;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

struct Files {
    trace: TraceWriter<std::io::Sink>,
    vcd: VcdWriter<std::io::Sink>,
}

impl Observer for Files {
    fn edge(&mut self, edge: &pkm_stepgen::Edge) {
        self.vcd.edge(edge);
    }
    fn tick(&mut self, report: &TickReport<'_>) {
        self.trace.tick(report);
        self.vcd.tick(report);
    }
}

fn shipped(name: &str) -> Program {
    Program::File(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../programs").join(name))
}

fn timed<O: Observer + Send>(
    program: &Program,
    machine: &Machine,
    outputs: impl Fn(&Simulation) -> O + Send + Sync,
) -> (f64, Summary) {
    let begin = Instant::now();
    let (summary, _) = run(program, machine, &Options::default(), &outputs, |_| ControlFlow::Continue(()))
        .expect("readable");
    assert!(summary.completed, "{:?}", summary.diagnostics);
    (begin.elapsed().as_secs_f64(), summary)
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn row(name: &str, machine: &str) {
    let machine = Machine::load(machine, &[]).expect("a shipped machine");
    let program = shipped(name);
    let simulated = timed(&program, &machine, |_| ()).1;
    let simulated_s = simulated.servo_ticks as f64 * machine.servo_period_ns as f64 / 1e9;
    let bare = median((0..5).map(|_| timed(&program, &machine, |_| ()).0).collect());
    let files = |simulation: &Simulation| Files {
        trace: TraceWriter::new(sink(), simulation),
        vcd: VcdWriter::new(sink(), simulation),
    };
    let full = median((0..5).map(|_| timed(&program, &machine, files).0).collect());
    let checked = median(
        (0..5)
            .map(|_| {
                let begin = Instant::now();
                check(&program, &machine, &Options::default()).expect("readable");
                begin.elapsed().as_secs_f64()
            })
            .collect(),
    );
    println!(
        "{name:24} {:8.1} s  {:9.0} x  {:16.0} x  {:9.0} x",
        simulated_s,
        simulated_s / bare,
        simulated_s / full,
        simulated_s / checked
    );
}

/// Peak resident memory of this process so far, MiB (Linux).
fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| kib / 1024.0)
}

fn main() {
    println!(
        "{:24} {:>10}  {:>11}  {:>18}  {:>11}",
        "program", "simulated", "run", "run with files", "check"
    );
    row("moma-w-aerofoil.ngc", "moma-w");
    row("moma-w-moulding.ngc", "moma-w");
    row("moma-arcs.ngc", "moma-a");

    // A million blocks of 0.02 mm on the MOMA-W, streamed from a file.
    let machine = Machine::load("moma-w", &[]).expect("a shipped machine");
    let mut text = String::from("G21 G90 G94 G17 G64 P0.001\nG0 X0 Y0 U0 V0 Z50\nF2400\n");
    for k in 0..1_000_000_u32 {
        let x = f64::from(k % 2000) * 0.01;
        let x = if k / 2000 % 2 == 0 { x } else { 20.0 - x };
        let _ = writeln!(text, "G1 X{x:.3} Y{:.3} U{:.3} V0", f64::from(k % 2) * 0.001, x * 0.9);
    }
    text.push_str("M2\n");
    let path = std::env::temp_dir().join(format!("pkm-million-{}.ngc", std::process::id()));
    std::fs::File::create(&path)
        .and_then(|mut file| std::io::Write::write_all(&mut file, text.as_bytes()))
        .expect("a temporary file");
    let before = peak_mib();
    drop(text);
    let program = Program::File(path.clone());
    let begin = Instant::now();
    let summary =
        run(&program, &machine, &Options::default(), |_: &Simulation| (), |_| ControlFlow::Continue(()));
    let seconds = begin.elapsed().as_secs_f64();
    let _ = std::fs::remove_file(&path);
    let (summary, _) = summary.expect("readable");
    assert!(summary.completed, "{:?}", summary.diagnostics);
    println!(
        "1,000,000 blocks: {:.0} s simulated in {seconds:.1} s; peak memory {:.0} MiB, of which the text and its file cost {:.0}",
        summary.servo_ticks as f64 * 1e-3,
        peak_mib().unwrap_or(f64::NAN),
        before.unwrap_or(f64::NAN)
    );
}
