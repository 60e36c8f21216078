//! `cargo bench --package pkm-planner`: what the planner makes of the cases P01 to P17, and what that costs.
//! `cargo bench --package pkm-planner -- P03 P12` takes these only, `--plain` prints `case nodes ns_per_node s` for
//! `toppra.py`.
//!
//! A run is deterministic, so tick k does the same work every time: its cost is the median over the runs, which are
//! interleaved case by case. What reading the clock costs is measured and taken off.
#![allow(clippy::print_stdout, clippy::disallowed_methods)]

#[path = "../tests/planner/catalogue.rs"]
mod catalogue;
#[path = "../tests/planner/harness.rs"]
mod harness;

use catalogue::{Known, all, flower_on_moma};
use harness::{Disturbance, Sampling, drive, limits, start, to_move, with_stack};
use pkm_kins::Kinematics;
use pkm_kins::machine::Mechanism;
use pkm_planner::{Move, Planner, Settings, State, Work};
use std::time::Instant;

/// The queues of `pkm run`; as many rows as the case has joints.
const PIECES: usize = 2048;
const NODES: usize = 2048;
type Bench<const R: usize> = Planner<Mechanism, R, PIECES, NODES>;

/// Runs of every case: many where one has too few nodes to warm up a processor.
fn runs(known: &Known) -> usize {
    if known.case.moves.len() < 100 { 101 } else { 9 }
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let mut cases = all();
    cases.retain(|known| wanted.is_empty() || wanted.iter().any(|w| w == known.id));
    let plain = std::env::args().any(|a| a == "--plain");
    with_stack(|| {
        if plain {
            return cost(&cases, true);
        }
        outcome(&cases);
        cost(&cases, false);
        if wanted.is_empty() {
            chords();
        }
    });
}

/// Durations, peaks and path errors.
fn outcome(cases: &[Known]) {
    println!(
        "Durations, and worst joint velocity and acceleration as shares of the limits, differenced from the setpoints."
    );
    println!(
        "{:4} {:>8} {:>7}  {:^15}  {:^15}  {:>9} {:>5}  {:^15}  {:^15}  {:^15} {:>8}",
        "case",
        "s",
        "/ T_ref",
        "v, a at 1 ms",
        "v, a at 0.1 ms",
        "path mm",
        "P mm",
        "override",
        "hold",
        "one a tick",
        "s"
    );
    for known in cases {
        let goal = known.case.moves.last().map(|(geometry, _)| geometry.at(geometry.length()).position);
        let run = |sampling, disturbance, one| {
            let trace = drive(&known.case, sampling, disturbance, one);
            let arrives =
                goal.is_some_and(|goal| goal.iter().zip(trace.end).all(|(a, b)| (a - b).abs() < 1e-9));
            assert!(arrives, "{} ends at {:?}", known.id, trace.end);
            trace
        };
        let plain = run(Sampling::SERVO, Disturbance::None, false);
        let tenth = run(Sampling::TENTH, Disturbance::None, false);
        let random = run(Sampling::SERVO, Disturbance::RandomOverride, false);
        let hold = run(Sampling::SERVO, Disturbance::HoldThirds, false);
        let one = run(Sampling::SERVO, Disturbance::None, true);
        let peaks = |t: &harness::Trace| format!("{:.5} {:.5}", t.velocity, t.acceleration);
        let path = plain.path_error_mm.max(random.path_error_mm).max(hold.path_error_mm);
        println!(
            "{:4} {:8.3} {:7.4}  {:15}  {:15}  {:9.1e} {:5}  {:15}  {:15}  {:15} {:8.3}",
            known.id,
            plain.duration_s,
            plain.duration_s / known.t_ref_s,
            peaks(&plain),
            peaks(&tenth),
            path.max(tenth.path_error_mm).max(one.path_error_mm),
            known.p_mm,
            peaks(&random),
            peaks(&hold),
            peaks(&one),
            one.duration_s
        );
    }
}

/// What one tick did.
#[derive(Clone, Copy, Default)]
struct Tick {
    push_ns: f64,
    tick_ns: f64,
    work: Work,
}

/// What one run cost.
struct Run {
    ticks: Vec<Tick>,
    /// A tick at rest with nothing to do: it makes a setpoint.
    setpoint_ns: f64,
    /// Per node set: path, kinematics, spacing.
    grid_ns: f64,
    /// Per node computed by the look-ahead.
    look_ahead_ns: f64,
}

fn minus(a: Work, b: Work) -> Work {
    Work {
        nodes: a.nodes - b.nodes,
        samples: a.samples - b.samples,
        planned: a.planned - b.planned,
        passed: a.passed - b.passed,
        starved: a.starved - b.starved,
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// What it costs to read the clock twice.
fn clock_ns() -> f64 {
    median((0..10_001).map(|_| Instant::now().elapsed().as_nanos() as f64).collect())
}

fn planner<const R: usize>(known: &Known) -> Box<Bench<R>> {
    let settings = Settings { servo_period_s: 1e-3, substeps: 1, settle_periods: 0 };
    let case = &known.case;
    Box::new(Bench::new(case.mechanism, limits(case), settings, start(case)).expect("a start on the path"))
}

/// Pushes while there is room. True when all is pushed.
fn feed<const R: usize>(planner: &mut Bench<R>, moves: &[Move], next: &mut usize) -> bool {
    while let Some(&piece) = moves.get(*next) {
        if planner.push(piece).is_err() {
            return false;
        }
        *next += 1;
        if *next == moves.len() {
            planner.finish();
        }
    }
    true
}

fn run<const R: usize>(known: &Known, clock_ns: f64) -> Run {
    let moves: Vec<Move> = known.case.moves.iter().map(|&piece| to_move(&known.case, piece)).collect();
    let since = |begin: Instant| begin.elapsed().as_nanos() as f64 - clock_ns;
    let mut driven = planner::<R>(known);
    let (mut next, mut ticks) = (0, Vec::new());
    loop {
        let before = driven.work();
        let begin = Instant::now();
        let fed = feed(&mut driven, &moves, &mut next);
        let push_ns = since(begin);
        let begin = Instant::now();
        let setpoint = driven.tick().expect("a path that can be run");
        let tick_ns = since(begin);
        ticks.push(Tick { push_ns, tick_ns, work: minus(driven.work(), before) });
        if fed && setpoint.state == State::Idle {
            break;
        }
    }
    let idle = (0..1001).map(|_| {
        let begin = Instant::now();
        let _ = std::hint::black_box(driven.tick());
        since(begin)
    });
    let setpoint_ns = median(idle.collect());
    // Held at rest the planner only looks ahead, until its queue is full.
    let mut held = planner::<R>(known);
    held.hold(true);
    let (mut next, mut empty, mut empties) = (0, 0, 0);
    let begin = Instant::now();
    loop {
        let before = held.work().nodes;
        feed(&mut held, &moves, &mut next);
        let _ = std::hint::black_box(held.tick());
        empties += 1;
        empty = if held.work().nodes == before { empty + 1 } else { 0 };
        if empty == 2 {
            break;
        }
    }
    let filled_ns = since(begin);
    let filled = held.work();
    // A new override plans the whole queue anew.
    let mut factor = 1.0;
    let passes = (0..101).map(|_| {
        factor = 1.999 - factor;
        let before = held.work().planned;
        held.set_feed_override(factor);
        let (mut spent_ns, mut last) = (0.0, before);
        loop {
            let begin = Instant::now();
            let _ = std::hint::black_box(held.tick());
            spent_ns += since(begin) - setpoint_ns;
            let planned = held.work().planned;
            if planned == last {
                break spent_ns / (planned - before).max(1) as f64;
            }
            last = planned;
        }
    });
    let look_ahead_ns = median(passes.collect());
    let grid_ns = (filled_ns - f64::from(empties) * setpoint_ns - filled.planned as f64 * look_ahead_ns)
        / filled.nodes as f64;
    Run { ticks, setpoint_ns, grid_ns, look_ahead_ns }
}

fn run_any(known: &Known, clock_ns: f64) -> Run {
    match known.case.mechanism.joint_count() {
        2 => run::<2>(known, clock_ns),
        3 => run::<4>(known, clock_ns),
        _ => run::<6>(known, clock_ns),
    }
}

fn cost(cases: &[Known], plain: bool) {
    let clock_ns = clock_ns();
    let mut runs: Vec<Vec<Run>> = cases.iter().map(|_| Vec::new()).collect();
    for turn in 0..cases.iter().map(self::runs).max().unwrap_or(0) {
        for (known, done) in cases.iter().zip(&mut runs) {
            if turn < self::runs(known) {
                done.push(run_any(known, clock_ns));
            }
        }
    }
    if !plain {
        println!(
            "\nCost in ns. A node: grid (path, kinematics, spacing; with the push), look-ahead (x how often a node is planned),"
        );
        println!(
            "drive (the tick's part of planning); together: all pushes and ticks, less what a tick between two nodes costs."
        );
        println!("A tick: between two nodes, median, 99 %, most; the most nodes it set, planned, passed.");
        println!(
            "{:4} {:>7} {:>6} {:>6} {:>12} {:>6} {:>9}  {:>7} {:>7} {:>7} {:>7}  {:>5} {:>5} {:>5}  {:>8}",
            "case",
            "nodes",
            "calls",
            "grid",
            "look-ahead",
            "drive",
            "together",
            "between",
            "median",
            "99 %",
            "max",
            "set",
            "plan",
            "pass",
            "push max"
        );
    }
    for (known, runs) in cases.iter().zip(&runs) {
        let first = &runs[0].ticks;
        let count = |f: fn(&Work) -> u64| first.iter().map(|t| f(&t.work)).sum::<u64>() as f64;
        let most = |f: fn(&Work) -> u64| first.iter().skip(1).map(|t| f(&t.work)).max().unwrap_or(0);
        let of_runs = |f: &dyn Fn(&Run) -> f64| median(runs.iter().map(f).collect());
        let per_tick = |f: &dyn Fn(&Tick) -> f64| -> Vec<f64> {
            (0..first.len()).map(|k| of_runs(&|run| run.ticks.get(k).map_or(f64::NAN, f))).collect()
        };
        let mut tick_ns = per_tick(&|t| t.tick_ns);
        let push_ns = per_tick(&|t| t.push_ns);
        let setpoint_ns = of_runs(&|run| run.setpoint_ns);
        let nodes = count(|w| w.nodes);
        // Ticks between two nodes plan nothing; where there are none, a tick at rest has to serve.
        let between: Vec<f64> =
            (0..first.len()).filter(|&k| first[k].work == Work::default()).map(|k| tick_ns[k]).collect();
        // Their mean: the clock counts in steps of some 10 ns.
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let base_ns = if between.len() > 10 { mean(&between) } else { setpoint_ns };
        let all_ns = tick_ns.iter().chain(&push_ns).sum::<f64>() - base_ns * first.len() as f64;
        let grid_ns = of_runs(&|run| run.grid_ns);
        let look_ahead_ns = of_runs(&|run| run.look_ahead_ns);
        let planned = count(|w| w.planned);
        // Ticks that only drive.
        let driving: Vec<usize> = (0..first.len()).filter(|&k| first[k].work.nodes == 0).collect();
        let passed: u64 = driving.iter().map(|&k| first[k].work.passed).sum();
        let drive_ns = driving.iter().map(|&k| tick_ns[k] - base_ns).sum::<f64>() / (passed as f64).max(1.0);
        if plain {
            println!("{} {nodes} {:.1} {:.4}", known.id, all_ns / nodes, (first.len() - 1) as f64 * 1e-3);
            continue;
        }
        tick_ns.sort_by(f64::total_cmp);
        let share = |p: f64| tick_ns[((tick_ns.len() - 1) as f64 * p) as usize];
        println!(
            "{:4} {:7} {:6.2} {:6.0} {:6.0} x{:4.1} {:6.0} {:9.0}  {:7.0} {:7.0} {:7.0} {:7.0}  {:5} {:5} {:5}  {:8.0}",
            known.id,
            nodes,
            count(|w| w.samples) / nodes,
            grid_ns,
            look_ahead_ns,
            planned / nodes,
            drive_ns,
            all_ns / nodes,
            base_ns,
            share(0.5),
            share(0.99),
            share(1.0),
            most(|w| w.nodes),
            most(|w| w.planned),
            most(|w| w.passed),
            push_ns.iter().skip(1).copied().fold(0.0, f64::max),
        );
    }
    if plain {
        return;
    }
    let kib = |bytes: usize| bytes / 1024;
    println!(
        "Memory with {PIECES} pieces and {NODES} nodes: {} KiB for 2 rows, {} for 3, {} for 6; with 64 and 512: {} KiB for 2, {} for 6",
        kib(size_of::<Bench<2>>()),
        kib(size_of::<Bench<3>>()),
        kib(size_of::<Bench<6>>()),
        kib(size_of::<Planner<Mechanism, 2, 64, 512>>()),
        kib(size_of::<Planner<Mechanism, 6, 64, 512>>()),
    );
    println!(
        "(reading the clock, taken off: {clock_ns:.0} ns; the first push fills the queue and is left out of the maxima)"
    );
}

/// The same path in ever shorter chords.
fn chords() {
    println!("\nThe flower in chords:");
    for chords in [1000, 5000, 10_000, 20_000] {
        let trace = drive(&flower_on_moma(chords), Sampling::SERVO, Disturbance::None, false);
        println!("{chords:6} {:.3} s, v {:.5} a {:.5}", trace.duration_s, trace.velocity, trace.acceleration);
    }
}
