//! `pkm run`: a program on the simulated machine, with its files.

use crate::cli::{Format, Run};
use crate::commands::faults;
use crate::commands::program::{Job, answered};
use crate::interrupt;
use crate::outcome::{Failure, Outcome};
use crate::output::{Folder, Pending};
use crate::render::diagnostics::Messages;
use crate::render::summary;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pkm_hal_sim::{Observer, Simulation, StreamWriter, TickReport, TraceWriter, VcdWriter};
use pkm_report::Recorder;
use pkm_run::{Judged, Options, Program, Programmed, Progress, Summary};
use pkm_stepgen::Edge;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

/// The files that see the run.
#[derive(Default)]
struct Files {
    vcd: Option<VcdWriter<Pending>>,
    trace: Option<TraceWriter<Pending>>,
    stream: Option<StreamWriter<Pending>>,
}

impl Observer for Files {
    fn wants_edges(&self) -> bool {
        self.vcd.is_some() || self.stream.is_some()
    }

    fn edge(&mut self, edge: &Edge) {
        if let Some(vcd) = &mut self.vcd {
            vcd.edge(edge);
        }
        if let Some(stream) = &mut self.stream {
            stream.edge(edge);
        }
    }

    fn tick(&mut self, report: &TickReport<'_>) {
        if let Some(vcd) = &mut self.vcd {
            vcd.tick(report);
        }
        if let Some(trace) = &mut self.trace {
            trace.tick(report);
        }
        if let Some(stream) = &mut self.stream {
            stream.tick(report);
        }
    }
}

pub(crate) fn run(arguments: &Run, messages: &Messages) -> Result<Outcome, Failure> {
    let result = match arguments.faults {
        Some(count) => faults::random(arguments, count, messages),
        None => drive(arguments, messages),
    };
    answered(&arguments.program, result)
}

fn drive(arguments: &Run, messages: &Messages) -> Result<Outcome, Failure> {
    let Job { program, machine, options, kept } = Job::new(&arguments.program, messages)?;
    let options = Options {
        feed_override: arguments.feed_override / 100.0,
        substeps: arguments.trace_substeps,
        max_ticks: arguments.max_ticks,
        home: arguments.home,
        // The job lasts as long as the process.
        faults: Vec::leak(arguments.fault.clone()),
        ..options
    };
    // The files are begun first: a folder that cannot be written to is told before the work.
    let folder = arguments.out.as_deref().map(Folder::new).transpose()?;
    let create = |name| folder.as_ref().map(|folder| folder.create(name)).transpose();
    let steps = create("steps.vcd")?;
    let rows = if arguments.no_trace { None } else { create("trace.csv")? };
    let stream = match arguments.step_stream {
        Some(tolerance_ns) => create("steps.pkms")?.map(|file| (file, tolerance_ns)),
        None => None,
    };
    let summary_file = create("summary.json")?;
    let report_file = if arguments.no_report { None } else { create("report.html")? };
    let start = options.start.unwrap_or(machine.home);
    let mut report = report_file.is_some().then(|| Recorder::new(&machine, start));

    let interrupted = interrupt::flag();
    let write_failed = folder.as_ref().map(Folder::failed);
    let bar = progress_bar(arguments);
    let period_s = machine.servo_period_ns as f64 / 1e9;
    let outputs = |simulation: &Simulation| Files {
        vcd: steps.map(|file| VcdWriter::new(file, simulation)),
        trace: rows.map(|file| TraceWriter::new(file, simulation)),
        stream: stream.map(|(file, tolerance_ns)| {
            let tolerance = tolerance_ns / simulation.hal().timer_period_ns();
            StreamWriter::new(file, simulation, tolerance)
        }),
    };
    let progress = |progress: &Progress| {
        bar.set_position(u64::from(progress.line));
        bar.set_message(format!("{:.1} s", progress.ticks as f64 * period_s));
        let stop = interrupted.load(Ordering::Relaxed)
            || write_failed.as_ref().is_some_and(|failed| failed.load(Ordering::Relaxed));
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let checked = pkm_run::check_with(&program, &machine, &options, |step: &Programmed<'_>| {
        if let Some(report) = &mut report {
            report.programmed(step);
        }
    })?;
    let judged = report.as_mut().map(|report| |_: &mut Files, judged: &Judged| report.judged(judged));
    let result = pkm_run::run_checked(&program, &machine, &options, checked, outputs, progress, judged);
    bar.finish_and_clear();
    let (summary, files) = result?;
    let written = match (folder, summary_file) {
        (Some(folder), Some(summary_file)) => {
            let page = report.zip(report_file);
            save(folder, files, page, summary_file, &program, &summary)?
        }
        _ => Vec::new(),
    };
    if let (Some(kept), Some(parameters)) = (&kept, &summary.parameters) {
        kept.save(parameters)?;
    }
    let verdict = match arguments.fault.as_slice() {
        [] => None,
        faults => faults::verdict(&program, &machine, &options, faults),
    };
    let mut out = stdout().lock();
    match arguments.program.format {
        Format::Json => writeln!(out, "{}", summary::json(&summary)?)?,
        Format::Text => {
            messages.print(&summary.diagnostics);
            out.write_all(summary::text(&summary).as_bytes())?;
            if let Some((_, sentence)) = &verdict {
                writeln!(out, "  outcome: {sentence}")?;
            }
            if let (Some(folder), false) = (&arguments.out, written.is_empty()) {
                writeln!(out, "  in {}: {}", folder.display(), written.join(", "))?;
            }
        }
    }
    Ok(if interrupted.load(Ordering::Relaxed) && !summary.completed {
        Outcome::Interrupted
    } else if summary.completed && verdict.is_none_or(|(good, _)| good) {
        Outcome::Clean
    } else {
        Outcome::No
    })
}

/// Ends all files and puts them in place; the first error of any of them is the answer.
/// Nothing moved: then only the report is new, and says why. The names of the new files.
fn save(
    folder: Folder,
    files: Option<Files>,
    page: Option<(Recorder<'_>, Pending)>,
    mut summary_file: Pending,
    program: &Program,
    summary: &Summary,
) -> Result<Vec<String>, Failure> {
    let mut done = Vec::new();
    let told = |name: &str, error: &std::io::Error| folder.failure(name, error);
    if let Some(files) = files {
        if let Some(vcd) = files.vcd {
            done.push(vcd.finish().map_err(|error| told("steps.vcd", &error))?);
        }
        if let Some(trace) = files.trace {
            done.push(trace.finish().map_err(|error| told("trace.csv", &error))?);
        }
        if let Some(stream) = files.stream {
            done.push(stream.finish().map_err(|error| told("steps.pkms", &error))?);
        }
        writeln!(summary_file, "{}", summary::json(summary)?)
            .map_err(|error| told("summary.json", &error))?;
        done.push(summary_file);
    }
    if let Some((report, mut file)) = page {
        let text = program.read().map_err(|error| told("report.html", &error))?;
        report.write(summary, text, &mut file).map_err(|error| told("report.html", &error))?;
        done.push(file);
    }
    let names = done.iter().map(Pending::name).collect();
    folder.commit(done)?;
    Ok(names)
}

/// Lines of the program, on a terminal; nothing elsewhere.
fn progress_bar(arguments: &Run) -> ProgressBar {
    if !stderr().is_terminal() {
        return ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
    }
    let bar = ProgressBar::new_spinner();
    let style = ProgressStyle::with_template("{spinner} {prefix} line {pos}, {msg} of machine time")
        .unwrap_or_else(|_| ProgressStyle::default_spinner());
    bar.set_style(style);
    bar.set_prefix(arguments.program.program.display().to_string());
    bar
}
