//! The command line: one definition, from which help, man page and completions come.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Motion control for parallel-kinematic machines: G-code in, verified motion and step pulses out.
///
/// Exit status: 0 done, nothing to object to; 1 the answer is "no" (an error in the program, a pose out of reach, a limit
/// exceeded); 2 the question could not be asked (bad usage, unreadable file, invalid machine file); 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "pkm", version, propagate_version = true, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// When to colour messages; NO_COLOR and TERM=dumb are honoured
    #[arg(long, global = true, value_enum, default_value_t = Color::Auto, value_name = "WHEN", display_order = 900)]
    pub color: Color,
    #[command(subcommand)]
    pub command: Command,
}

/// When to colour messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Color {
    /// On a terminal
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

/// How the result is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For a person
    Text,
    /// For a script; carries "schema": 1
    Json,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a program on the simulated machine: summary, trace, step pulses
    Run(Run),
    /// Everything that can be said before cutting, without producing pulses; without --machine: the language alone
    Check(Check),
    /// How long every block takes and what limits it: feed, which joint, corners
    Plan(Plan),
    /// Interpret without a machine and print canonical commands in LinuxCNC's text format
    Canon(Canon),
    /// What a machine can reach: exact areas and volumes, singular loci, pictures
    Workspace(Workspace),
    /// Which configuration of a reconfigurable machine runs a program, best first
    Configure(Configure),
    /// Pictures of a trace or of a program's run: the path and the joints over time
    Plot(Plot),
    /// Pose to joints and back, JSON lines in and out
    #[command(subcommand)]
    Kins(Kins),
    /// Play a compact step stream (steps.pkms): its steps as CSV, or its sums
    Steps(Steps),
    /// Jog the simulated machine: joints or coordinates, within soft limits and singularity guards
    Jog(Jog),
    /// Run a HAL file, or show what a HAL has
    Hal(Hal),
    /// List the machines that ship, or print one annotated machine file
    Machines(Machines),
    /// Write a complete LinuxCNC configuration for a machine: INI, HAL, geometry, tool table, example program, README
    Linuxcnc(Linuxcnc),
    /// Read limits, scales, periods, step timing and geometry of a LinuxCNC configuration into a machine file
    ImportLinuxcnc(ImportLinuxcnc),
    /// Write the man page or shell completions to standard output
    Generate(Generate),
}

impl Command {
    /// The `--set` texts of this command.
    pub(crate) fn overrides(&self) -> &[String] {
        match self {
            Self::Kins(Kins::Inverse(arguments) | Kins::Forward(arguments) | Kins::Jacobian(arguments)) => {
                &arguments.machine.set
            }
            Self::Run(arguments) => &arguments.program.machine.set,
            Self::Check(arguments) => &arguments.program.machine.set,
            Self::Plan(arguments) => &arguments.program.machine.set,
            Self::Jog(arguments) => &arguments.machine.set,
            Self::Workspace(arguments) => &arguments.machine.set,
            Self::Configure(arguments) => &arguments.program.machine.set,
            Self::Plot(arguments) => &arguments.set,
            Self::Hal(arguments) => match &arguments.command {
                Some(HalCommand::Show(arguments)) => &arguments.set,
                None => &arguments.set,
            },
            Self::Linuxcnc(arguments) => &arguments.machine.set,
            Self::Canon(_)
            | Self::Steps(_)
            | Self::Machines(_)
            | Self::ImportLinuxcnc(_)
            | Self::Generate(_) => &[],
        }
    }
}

/// The machine, wherever one is needed.
#[derive(Debug, Args)]
pub(crate) struct MachineArgs {
    /// Machine file, or the name of a shipped machine (see `pkm machines`)
    #[arg(long, value_name = "FILE")]
    pub machine: String,
    /// Override a key of the machine file, e.g. 'joint.*.max_velocity_mm_s=100'; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// The machine that a program is for; only `check` can do without.
#[derive(Debug, Args)]
pub(crate) struct ProgramMachineArgs {
    /// Machine file, or the name of a shipped machine (see `pkm machines`)
    #[arg(long, value_name = "FILE")]
    pub machine: Option<String>,
    /// Override a key of the machine file, e.g. 'joint.*.max_velocity_mm_s=100'; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "machine")]
    pub set: Vec<String>,
}

/// A program on a machine.
#[derive(Debug, Args)]
pub(crate) struct ProgramArgs {
    /// G-code program; `-` is standard input
    pub program: PathBuf,
    #[command(flatten)]
    pub machine: ProgramMachineArgs,
    /// Where the machine stands when the program begins, e.g. "X0 Y-260" (mm, degrees); default: its home pose
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    pub start: Option<String>,
    /// Tool table in LinuxCNC's format, lengths in mm
    #[arg(long, value_name = "FILE")]
    pub tool_table: Option<PathBuf>,
    /// Parameter file in LinuxCNC's format, lengths in mm: read at the start; `run` saves it after a completed program
    /// and keeps the old one as FILE.bak
    #[arg(long, value_name = "FILE")]
    pub parameters: Option<PathBuf>,
    /// What the probe can touch, machine coordinates in mm: "Z-5" (all below) or "X10..40 Y0..20 Z..8" (a box); repeatable;
    /// in place of probe.workpiece in the machine file
    #[arg(long, value_name = "BOX", allow_hyphen_values = true, value_parser = pkm_machine::workpiece::solid)]
    pub probe_surface: Vec<pkm_machine::workpiece::Solid>,
    /// Skip the lines that begin with `/`
    #[arg(long)]
    pub block_delete: bool,
    #[command(flatten)]
    pub bounds: Bounds,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Where a program begins and when it has run for too long.
#[derive(Debug, Args)]
pub(crate) struct Bounds {
    /// Begin at this line: the lines before it set modes, offsets, tool and parameters, but move nothing
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub start_line: Option<u32>,
    /// A program whose loops and subs execute more blocks than this counts as endless; 0 = no limit
    #[arg(long, value_name = "N", default_value_t = 10_000_000)]
    pub max_blocks: u64,
}

#[derive(Debug, Args)]
#[command(mut_arg("machine", |machine| machine.required(true)))]
pub(crate) struct Run {
    #[command(flatten)]
    pub program: ProgramArgs,
    /// Write steps.vcd, trace.csv, summary.json and report.html into this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Do not write trace.csv
    #[arg(long)]
    pub no_trace: bool,
    /// Also write steps.pkms, a compact stream for a microcontroller's timer, into the folder; its steps may be NS nanoseconds off
    #[arg(long, value_name = "NS", requires = "out", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    pub step_stream: Option<u64>,
    /// Do not write report.html
    #[arg(long)]
    pub no_report: bool,
    /// Rows of trace.csv per servo period
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub trace_substeps: u32,
    /// Feed override, percent of the programmed feed
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0, value_parser = percent, allow_negative_numbers = true)]
    pub feed_override: f64,
    /// The machine begins without knowing where it is: it homes first, to the machine file's home pose
    #[arg(long)]
    pub home: bool,
    /// A fault on an input pin, repeatable: TICK,PIN,KIND or TICK+TICKS,PIN,KIND; kinds are set=VALUE, freeze, invert,
    /// offset=VALUE, nan, inf. `pkm hal show --machine FILE pin` lists the pins
    #[arg(long = "fault", value_name = "FAULT", conflicts_with = "faults")]
    pub fault: Vec<pkm_hal_sim::PinFault>,
    /// Rehearse the program with N random faults, one at a time; each is judged and printed so that it can be replayed
    #[arg(long, value_name = "N", conflicts_with_all = ["out", "trace_substeps", "feed_override"])]
    pub faults: Option<u64>,
    /// Of the random faults
    #[arg(long, value_name = "S", default_value_t = 0, requires = "faults")]
    pub seed: u64,
    /// End the run, not completed, after so many servo periods
    #[arg(long, value_name = "N", default_value_t = 100_000_000)]
    pub max_ticks: u64,
}

/// A feed override: above 0, at most 200 %.
fn percent(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(percent) if percent > 0.0 && percent <= 200.0 => Ok(percent),
        _ => Err("a number above 0, at most 200".into()),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Check {
    #[command(flatten)]
    pub program: ProgramArgs,
}

#[derive(Debug, Args)]
#[command(mut_arg("machine", |machine| machine.required(true)))]
pub(crate) struct Plan {
    #[command(flatten)]
    pub program: ProgramArgs,
    /// How many of the longest blocks the text lists
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub longest: usize,
}

#[derive(Debug, Args)]
pub(crate) struct Workspace {
    #[command(flatten)]
    pub machine: MachineArgs,
    /// Write workspace.svg, .png, .csv and .json into this folder (and .obj of a spatial machine)
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Distance of the poses of the det K map, or of the planes of a spatial machine, mm; boundaries of planar mechanisms are
    /// exact and do not depend on it
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    pub resolution: Option<f64>,
    /// MOMA-W: position of the table, mm; default: home
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    pub z: Option<f64>,
    /// MOMA-W: angle of the wire towards x, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    pub tilt_x: f64,
    /// MOMA-W: angle of the wire towards y, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    pub tilt_y: f64,
    /// How the summary is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// What is best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum RankBy {
    /// The shortest cycle time, then the farthest from singularities, then the shortest travel
    Time,
    /// The farthest from singularities
    Singularity,
    /// The shortest travel of the joint that needs most
    Travel,
}

#[derive(Debug, Args)]
#[command(mut_arg("machine", |machine| machine.required(true)))]
pub(crate) struct Configure {
    #[command(flatten)]
    pub program: ProgramArgs,
    /// What ranks the configurations
    #[arg(long, value_enum, default_value_t = RankBy::Time)]
    pub rank_by: RankBy,
    /// Threads; the answer does not depend on them. Default: all cores
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
}

/// 1 to 1024.
fn threads(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|threads| (1..=1024).contains(threads)).ok_or_else(|| "1 to 1024".into())
}

#[derive(Debug, Args)]
pub(crate) struct Plot {
    /// A trace.csv of `pkm run`, or a G-code program, which is run
    pub input: PathBuf,
    /// Machine file or name: needed for a program; with a trace it adds limits, names and the workspace
    #[arg(long, value_name = "FILE")]
    pub machine: Option<String>,
    /// Override a key of the machine file; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Write path.svg, path.png, joints.svg and joints.png into this folder
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Canon {
    /// G-code program; `-` is standard input
    pub program: PathBuf,
    /// How the commands are printed
    #[arg(long, value_enum, default_value_t = CanonFormat::Rs274)]
    pub format: CanonFormat,
    /// Write the commands to this file instead of standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Tool table in LinuxCNC's format
    #[arg(long, value_name = "FILE")]
    pub tool_table: Option<PathBuf>,
    /// Parameter file in LinuxCNC's format, lengths in machine units: read at the start, saved at the end (also after an
    /// error), the old one kept as FILE.bak
    #[arg(long, value_name = "FILE")]
    pub parameters: Option<PathBuf>,
    /// LinuxCNC's INI file: settings of the interpreter, as for `rs274 -i`
    #[arg(long, value_name = "FILE")]
    pub ini: Option<PathBuf>,
    /// The machine's length unit is the inch, as in LinuxCNC's rs274 (the default)
    #[arg(long, conflicts_with = "mm")]
    pub inch: bool,
    /// The machine's length unit is the millimetre
    #[arg(long)]
    pub mm: bool,
    /// Axes of the machine
    #[arg(long, value_name = "LETTERS", default_value = "XYZABC", value_parser = axes)]
    pub axes: pkm_kins::AxisSet,
    /// Whose rules decide where versions differ
    #[arg(long, value_enum, default_value_t = Dialect::LinuxCnc29)]
    pub dialect: Dialect,
    /// Skip the lines that begin with `/`
    #[arg(long)]
    pub block_delete: bool,
    #[command(flatten)]
    pub bounds: Bounds,
    /// What to do after an error
    #[arg(long, value_enum, default_value_t = OnError::Stop)]
    pub on_error: OnError,
}

/// How canonical commands are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CanonFormat {
    /// LinuxCNC's text
    Rs274,
    /// Motion alone: line, command, nine axes, six decimals, mm; a metric machine
    Motion9,
    /// One JSON object a line, diagnostics included
    Json,
}

/// Whose rules decide where versions differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Dialect {
    /// LinuxCNC 2.9, as Debian ships it
    #[value(name = "linuxcnc-2.9")]
    LinuxCnc29,
    /// LinuxCNC 2.10
    #[value(name = "linuxcnc-2.10")]
    LinuxCnc210,
    /// LinuxCNC's language with its dangerous quirks corrected or refused
    Pkm,
}

/// What to do after an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum OnError {
    /// End the program
    Stop,
    /// Go on with the next block
    Continue,
}

/// Axis letters, each once.
fn axes(text: &str) -> Result<pkm_kins::AxisSet, String> {
    let mut axes = Vec::new();
    for letter in text.to_ascii_uppercase().chars() {
        match pkm_kins::Axis::ALL.into_iter().find(|axis| axis.letter() == letter) {
            Some(axis) if !axes.contains(&axis) => axes.push(axis),
            _ => return Err("letters of XYZABCUVW, each once".into()),
        }
    }
    if axes.is_empty() {
        return Err("at least one axis".into());
    }
    Ok(pkm_kins::AxisSet::new(&axes))
}

#[derive(Debug, Subcommand)]
pub(crate) enum Kins {
    /// {"x":..,"y":..,...} (mm, degrees; absent = 0) → {"joints":[..]}
    Inverse(KinsArgs),
    /// {"joints":[..]} (optional "seed":{pose}) → {"pose":{"x":..,...}}
    Forward(KinsArgs),
    /// A pose → {"joints":[..],"inverse_jacobian":[[..]],"determinant":..,"condition":..}; rotary columns per radian
    Jacobian(KinsArgs),
}

#[derive(Debug, Args)]
pub(crate) struct KinsArgs {
    #[command(flatten)]
    pub machine: MachineArgs,
    /// Ask for geometry alone: joint travel and other limits do not apply
    #[arg(long)]
    pub no_limits: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Steps {
    /// The stream, as `pkm run --step-stream` writes it
    pub stream: PathBuf,
    /// How it is printed
    #[arg(long, value_enum, default_value_t = StepsFormat::Text)]
    pub format: StepsFormat,
}

/// How a step stream is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum StepsFormat {
    /// Its size and sums, for a person
    Text,
    /// The same for a script; carries "schema": 1
    Json,
    /// Every step: time_ns, joint (from 0), step (1 or -1), count since the start
    Csv,
}

#[derive(Debug, Args)]
pub(crate) struct Jog {
    #[command(flatten)]
    pub machine: MachineArgs,
    /// Where the machine stands, e.g. "X0 Y-260" (mm, degrees); default: its home pose
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    pub start: Option<String>,
    /// mm/s or degrees/s
    #[arg(long, value_name = "V", default_value_t = 10.0)]
    pub velocity: f64,
    /// Jogs, one after the other: an axis or a joint's name, + or -, and how far (nothing: to the limit): x+10 y- p1+2.5
    #[arg(required = true)]
    pub moves: Vec<String>,
}

/// A HAL file as LinuxCNC's halcmd reads it: loadrt, addf, net, setp, sets, linkpp, show, ...
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Hal {
    #[command(subcommand)]
    pub command: Option<HalCommand>,
    /// HAL file; `-` is standard input
    pub file: Option<PathBuf>,
    /// Run so many periods of the slowest thread
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub ticks: u64,
    /// Print this pin, parameter or signal after each period; repeatable
    #[arg(long, value_name = "NAME")]
    pub pin: Vec<String>,
    /// Rows for the streamer, one a line
    #[arg(long, value_name = "FILE")]
    pub stream: Option<PathBuf>,
    /// A fault on an input pin, as for `pkm run`; repeatable
    #[arg(long, value_name = "FAULT")]
    pub fault: Vec<pkm_hal_sim::PinFault>,
    /// Begin with the wired HAL of this machine (see `pkm machines`)
    #[arg(long, value_name = "FILE")]
    pub machine: Option<String>,
    /// Override a key of the machine file; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "machine")]
    pub set: Vec<String>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum HalCommand {
    /// What a HAL has, as halcmd shows it; without file and machine: what can be loaded
    Show(HalShow),
}

#[derive(Debug, Args)]
pub(crate) struct HalShow {
    /// Optional: a HAL file; which of comp, pin, param, sig, funct, thread, all; the beginning of the names
    #[arg(num_args = 0..=3)]
    pub words: Vec<String>,
    /// The wired HAL of this machine
    #[arg(long, value_name = "FILE")]
    pub machine: Option<String>,
    /// Override a key of the machine file; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "machine")]
    pub set: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct Machines {
    /// Print this machine's file
    pub name: Option<String>,
    /// How the list is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

#[derive(Debug, Args)]
pub(crate) struct Linuxcnc {
    #[command(flatten)]
    pub machine: MachineArgs,
    /// Write the configuration into this folder
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The built kinematics module, to be copied into the folder; default: where cargo leaves it, if it is there
    #[arg(long, value_name = "FILE")]
    pub module: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ImportLinuxcnc {
    /// INI file of the configuration; its HAL files are read too
    pub ini: PathBuf,
    /// Write the machine file here instead of to standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Generate {
    /// What to write
    #[arg(value_enum)]
    pub what: What,
    /// Write the man page of this subcommand, e.g. `run`
    #[arg(long, value_name = "NAME")]
    pub subcommand: Option<String>,
}

/// What `pkm generate` writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum What {
    /// Man page (roff)
    Man,
    /// Completions for bash
    CompleteBash,
    /// Completions for zsh
    CompleteZsh,
    /// Completions for fish
    CompleteFish,
}
