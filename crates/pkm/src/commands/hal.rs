//! `pkm hal FILE` and `pkm hal show`: a HAL of one's own, or that of a machine.

use crate::cli::{Hal as Arguments, HalCommand, HalShow};
use crate::outcome::{Failure, Outcome};
use crate::render::diagnostics::Messages;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_hal_sim::components::streamer::Streamer;
use pkm_hal_sim::hal_file::{FileError, MODULES, Session, parse_value};
use pkm_hal_sim::{Hal, PinType, Role, Value};
use pkm_machine::Machine;
use std::fmt::Write as _;
use std::io::{Write, stdout};
use std::path::Path;

/// Unit of edge times where no machine says otherwise, ns.
const TIMER_PERIOD_NS: u64 = 100;
/// What `show` can show.
const WHAT: [&str; 9] = ["comp", "pin", "param", "sig", "signal", "funct", "function", "thread", "all"];

pub(crate) fn run(arguments: &Arguments, messages: &Messages) -> Result<Outcome, Failure> {
    match &arguments.command {
        Some(HalCommand::Show(arguments)) => show(arguments),
        None => file(arguments, messages),
    }
}

/// An empty HAL, or that of a machine as it is wired for `pkm run --home`.
fn session(machine: Option<&String>, set: &[String]) -> Result<Session, Failure> {
    let hal = match machine {
        Some(name) => pkm_run::machine_hal(&Machine::load(name, set)?)
            .map_err(|error| Failure::could_not("hal", name, error.to_string(), "check the machine file"))?,
        None => Hal::new(TIMER_PERIOD_NS).map_err(|error| {
            Failure::could_not("hal", "", error.to_string(), "please report this message")
        })?,
    };
    Ok(Session::with_hal(hal))
}

fn read(path: &Path) -> Result<String, Failure> {
    let name = path.display().to_string();
    let refuse = |why: String| {
        let message = format!("cannot read {name}: {why}");
        Failure::could_not(
            "file-open",
            &name,
            message,
            "give the path of a HAL file, or - for standard input",
        )
    };
    if name == "-" {
        return std::io::read_to_string(std::io::stdin().lock()).map_err(|error| refuse(error.to_string()));
    }
    std::fs::read_to_string(path).map_err(|error| refuse(error.to_string()))
}

fn about(path: &Path, code: &str, severity: Severity, message: String) -> Diagnostic {
    Diagnostic {
        code: code.to_owned(),
        severity,
        message,
        help: None,
        file: path.display().to_string(),
        line: 0,
        column: 0,
        end_column: 0,
        notes: Vec::new(),
    }
}

fn at(path: &Path, error: &FileError) -> Diagnostic {
    let FileError { line, column, end_column, .. } = *error;
    let message = error.problem.to_string();
    Diagnostic { line, column, end_column, ..about(path, "hal-file", Severity::Error, message) }
}

/// Runs the commands of a file; false after an error, which is told.
fn set_up(session: &mut Session, path: &Path, text: &str) -> Result<(), Failure> {
    let mut out = String::new();
    let result = session.run_file(text, &mut out);
    stdout().lock().write_all(out.as_bytes())?;
    result.map_err(|error| Failure::from(at(path, &error)))
}

fn show(arguments: &HalShow) -> Result<Outcome, Failure> {
    let mut words = arguments.words.iter().map(String::as_str).peekable();
    let mut session = session(arguments.machine.as_ref(), &arguments.set)?;
    let path = words.next_if(|word| !WHAT.contains(word));
    if let Some(path) = path {
        let path = Path::new(path);
        set_up(&mut session, path, &read(path)?)?;
    } else if arguments.machine.is_none() {
        let mut text = "Components that `loadrt` can load, with their options:\n".to_owned();
        for (name, options) in MODULES {
            let _ = writeln!(text, "  {name}\n      {options}");
        }
        stdout().lock().write_all(text.as_bytes())?;
        return Ok(Outcome::Clean);
    }
    let command = format!("show {}", words.collect::<Vec<_>>().join(" "));
    set_up(&mut session, Path::new("show"), &command)?;
    Ok(Outcome::Clean)
}

fn file(arguments: &Arguments, messages: &Messages) -> Result<Outcome, Failure> {
    let Some(path) = &arguments.file else {
        return Err(Failure::could_not(
            "usage",
            "",
            "no HAL file is given".to_owned(),
            "see `pkm hal --help`",
        ));
    };
    let mut session = session(arguments.machine.as_ref(), &arguments.set)?;
    set_up(&mut session, path, &read(path)?)?;
    messages.print(&warnings(session.hal(), path));
    for fault in &arguments.fault {
        let told = |error: pkm_hal_sim::HalError| {
            let message = format!("the fault {fault} cannot be: {error}");
            Failure::could_not(
                "fault-pin",
                "--fault",
                message,
                "`show pin` lists the pins; it needs one with direction IN",
            )
        };
        session.hal_mut().inject(fault).map_err(told)?;
    }
    if let Some(rows) = &arguments.stream {
        stream(session.hal_mut(), rows)?;
    }
    if arguments.ticks == 0 {
        return Ok(Outcome::Clean);
    }
    // the slowest thread is the servo thread
    let periods = session.hal().threads().fold(None, |range: Option<(u64, u64)>, (_, period_ns, _)| {
        Some(range.map_or((period_ns, period_ns), |(fast, slow)| (fast.min(period_ns), slow.max(period_ns))))
    });
    let Some((base_ns, servo_ns)) = periods else {
        let help = "add `loadrt threads name1=servo-thread period1=1000000`";
        return Err(Failure::could_not(
            "hal",
            &path.display().to_string(),
            "no thread: nothing can run".to_owned(),
            help,
        ));
    };
    for pin in &arguments.pin {
        value(session.hal(), pin)?;
    }
    let mut text = String::new();
    if !arguments.pin.is_empty() {
        let _ = writeln!(text, "tick,{}", arguments.pin.join(","));
    }
    let mut outcome = Outcome::Clean;
    'run: for tick in 1..=arguments.ticks {
        for _ in 0..servo_ns / base_ns {
            if let Err(fault) = session.hal_mut().run(None) {
                messages.print(&[about(path, "hal-fault", Severity::Error, fault.to_string())]);
                outcome = Outcome::No;
                break 'run;
            }
        }
        if !arguments.pin.is_empty() {
            let _ = write!(text, "{tick}");
            for pin in &arguments.pin {
                let _ = write!(text, ",{}", value(session.hal(), pin)?);
            }
            text.push('\n');
        }
        if text.len() > 1 << 16 {
            stdout().lock().write_all(text.as_bytes())?;
            text.clear();
        }
    }
    stdout().lock().write_all(text.as_bytes())?;
    Ok(outcome)
}

/// Value of a pin, a parameter or a signal.
fn value(hal: &Hal, name: &str) -> Result<Value, Failure> {
    hal.getp(name).or_else(|_| hal.gets(name)).map_err(|_| {
        let message = format!("there is no pin, parameter or signal '{name}'");
        Failure::could_not("hal-pin", "--pin", message, "`pkm hal show FILE pin` lists them")
    })
}

/// What is allowed, but seldom meant.
fn warnings(hal: &Hal, path: &Path) -> Vec<Diagnostic> {
    let mut texts = Vec::new();
    for (name, _, _, pins) in hal.signals() {
        let written = pins.iter().any(|(_, role)| *role != Role::In);
        if !written {
            texts.push(format!("signal '{name}' has no writer: only `sets` changes it"));
        }
    }
    for (name, thread) in hal.functions() {
        if thread.is_none() && !name.ends_with("make-pulses") {
            texts.push(format!("function '{name}' is on no thread: it never runs"));
        }
    }
    let told = |message| about(path, "hal-wiring", Severity::Warning, message);
    texts.into_iter().map(told).collect()
}

/// Rows for the streamer: values parted by spaces or commas, a row a line.
fn stream(hal: &mut Hal, path: &Path) -> Result<(), Failure> {
    let (text, name) = (read(path)?, path.display().to_string());
    let Some(streamer) = hal.component_mut::<Streamer>() else {
        let help = "add `loadrt streamer cfg=... depth=...`";
        return Err(Failure::could_not("hal", &name, "the HAL has no streamer".to_owned(), help));
    };
    let types: Vec<PinType> = streamer.types().collect();
    for (number, line) in (1_u32..).zip(text.lines()) {
        let words: Vec<&str> = line.split([' ', ',', '\t']).filter(|word| !word.is_empty()).collect();
        if words.is_empty() || line.starts_with('#') {
            continue;
        }
        let row: Option<Vec<Value>> =
            words.iter().zip(&types).map(|(word, pin_type)| parse_value(word, *pin_type)).collect();
        let fits = row.filter(|_| words.len() == types.len()).is_some_and(|row| streamer.put(&row));
        if !fits {
            let message =
                format!("no row for the streamer (its pins: {types:?}), or more rows than its depth");
            let help = Some("one value for each pin, parted by spaces or commas".to_owned());
            let error =
                Diagnostic { help, line: number, ..about(path, "hal-stream", Severity::Error, message) };
            return Err(error.into());
        }
    }
    Ok(())
}
