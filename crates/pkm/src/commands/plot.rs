//! `pkm plot`: path and joint curves of a trace or of a program, as pictures without a browser.

use crate::cli::Plot;
use crate::commands::program;
use crate::commands::workspace::{raster, write_all};
use crate::interrupt;
use crate::outcome::{Failure, Outcome};
use crate::output::Folder;
use crate::render::diagnostics::Messages;
use pkm_analysis::figure::curves;
use pkm_analysis::trace::Trace;
use pkm_analysis::workspace::outline;
use pkm_canon::diagnostic::Severity;
use pkm_hal_sim::{Edge, Observer, Simulation, TickReport};
use pkm_kins::{Axis, JointKind, Kinematics, maths};
use pkm_machine::Machine;
use std::fs::File;
use std::io::{BufReader, Write, stdout};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// Sees a run and keeps what is drawn of it.
struct Recorder {
    trace: Trace,
    machine: Machine,
    axes: Vec<Axis>,
    poses: Vec<f64>,
    joints: Vec<f64>,
}

impl Observer for Recorder {
    fn wants_edges(&self) -> bool {
        false
    }

    fn edge(&mut self, _: &Edge) {}

    fn tick(&mut self, report: &TickReport<'_>) {
        self.poses.clear();
        self.joints.clear();
        for &axis in &self.axes {
            let value = report.setpoint.pose.get(axis);
            self.poses.push(if axis.is_rotary() { maths::degrees(value) } else { value });
        }
        let joints = self.machine.joints.iter().zip(report.setpoint.joints);
        self.joints.extend(joints.map(|(joint, q)| joint.to_face(q)));
        self.trace.push(report.time_ns as f64 / 1e9, &self.poses, &self.joints);
    }
}

impl Recorder {
    /// Begins with the machine as it stands, like `trace.csv`.
    fn new(machine: &Machine, simulation: &Simulation) -> Self {
        let mut recorder = Self::empty(machine);
        recorder.tick(&simulation.report());
        recorder
    }

    fn empty(machine: &Machine) -> Self {
        let axes: Vec<Axis> = machine.mechanism.axes().iter().collect();
        let unit = |rotary: bool| if rotary { "deg" } else { "mm" }.to_owned();
        let letters = axes.iter().map(|axis| (axis.letter(), unit(axis.is_rotary()))).collect();
        let joints =
            machine.joints.iter().map(|joint| (joint.name.clone(), unit(joint.kind == JointKind::Rotary)));
        Self {
            trace: Trace::new(letters, joints.collect()),
            machine: machine.clone(),
            axes,
            poses: Vec::new(),
            joints: Vec::new(),
        }
    }
}

pub(crate) fn run(arguments: &Plot, messages: &Messages) -> Result<Outcome, Failure> {
    let name = arguments.input.display().to_string();
    let is_trace = arguments.input.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    let machine = match &arguments.machine {
        Some(machine) => Some(Machine::load(machine, &arguments.set)?),
        None if is_trace => None,
        None => {
            let message = format!("{name} is not a trace (.csv), and a program needs a machine");
            return Err(Failure::could_not("plot-machine", &name, message, "add --machine NAME"));
        }
    };
    let trace = match &machine {
        Some(machine) if !is_trace => {
            let interrupted = interrupt::flag();
            match drive(arguments, machine, messages, &interrupted)? {
                Some(trace) => trace,
                None if interrupted.load(Ordering::Relaxed) => return Ok(Outcome::Interrupted),
                None => return Ok(Outcome::No),
            }
        }
        _ => {
            let refuse = |message: String| {
                Failure::could_not("plot-trace", &name, message, "give a trace.csv of `pkm run --out`")
            };
            let file = File::open(&arguments.input)
                .map_err(|error| refuse(format!("cannot read {name}: {error}")))?;
            Trace::read(BufReader::with_capacity(1 << 16, file))
                .map_err(|error| refuse(format!("{name}: {error}")))?
        }
    };
    if !trace.moved() {
        let message = format!("{name}: nothing moves, there is nothing to draw ({} rows)", trace.rows);
        if let Failure::CouldNot(diagnostics) = Failure::could_not("plot-still", &name, message, "") {
            messages.print(&diagnostics);
        }
        return Ok(Outcome::No);
    }
    let outlines = machine.as_ref().map(|machine| outline(machine, 0.05)).unwrap_or_default();
    let title = match &machine {
        Some(machine) => format!("{name} on {}", machine.name),
        None => name,
    };
    let pictures = [
        ("path", curves::path(&title, &trace, &outlines)),
        ("joints", curves::joints(&title, &trace, machine.as_ref())),
    ];
    let mut files = Vec::new();
    for (name, svg) in pictures {
        files.push((format!("{name}.png"), raster(&svg)?));
        files.push((format!("{name}.svg"), svg.into_bytes()));
    }
    write_all(Folder::new(&arguments.out)?, &files)?;
    writeln!(
        stdout().lock(),
        "{}: path and joints, {} rows, {:.3} s",
        arguments.out.display(),
        trace.rows,
        trace.duration_s
    )?;
    Ok(Outcome::Clean)
}

/// Runs the program on the simulated machine; `None` after telling why it cannot.
fn drive(
    arguments: &Plot,
    machine: &Machine,
    messages: &Messages,
    interrupted: &AtomicBool,
) -> Result<Option<Trace>, Failure> {
    let program = program::open(&arguments.input)?;
    let outputs = |simulation: &Simulation| Recorder::new(machine, simulation);
    let go = |_: &pkm_run::Progress| {
        if interrupted.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let (summary, recorder) = pkm_run::run(&program, machine, &pkm_run::Options::default(), outputs, go)?;
    messages.print(&summary.diagnostics);
    let failed = summary.diagnostics.iter().any(|finding| finding.severity == Severity::Error);
    Ok(recorder.filter(|_| !failed).map(|recorder| recorder.trace))
}
