//! What a servo period of the simulated machine costs, with and without writers, and steps per second of the
//! generator alone.
#![allow(clippy::disallowed_methods, clippy::print_stdout)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Waves, config};
use pkm_hal_sim::{Observer, PulseTimingNs, Setpoint, SetpointSource, Simulation, TraceWriter, VcdWriter};
use pkm_stepgen::{Period, StepGenerator};
use std::hint::black_box;
use std::io::sink;
use std::time::Instant;

const TICKS: usize = 100_000;

fn setpoints() -> Vec<Setpoint> {
    let mut source = Waves { joints: 5 };
    (1..=TICKS as u64).map(|tick| source.next(tick).unwrap_or_default()).collect()
}

/// `cargo bench ... -- WORD` measures what has the word in its name.
fn wanted(name: &str) -> bool {
    std::env::args().nth(1).is_none_or(|word| word.starts_with('-') || name.contains(&word))
}

fn run(name: &str, setpoints: &[Setpoint], observe: impl Fn(&Simulation) -> Vec<Box<dyn Observer>>) {
    if !wanted(name) {
        return;
    }
    let mut best = f64::INFINITY;
    let mut steps = 0;
    for _ in 0..5 {
        let Ok(mut simulation) = Simulation::new(&config(5, 100)) else { return };
        let mut boxes = observe(&simulation);
        let start = Instant::now();
        for setpoint in setpoints {
            let mut observers: Vec<&mut dyn Observer> =
                boxes.iter_mut().map(|observer| observer.as_mut() as &mut dyn Observer).collect();
            let _ = black_box(simulation.tick_to(setpoint, &mut observers));
        }
        best = best.min(start.elapsed().as_secs_f64());
        steps = simulation.statistics().iter().map(|joint| joint.steps).sum();
    }
    let ns = best * 1e9 / TICKS as f64;
    println!(
        "{name:<28} {ns:7.0} ns a tick, {:6.0} x real time, {:.1} steps a tick",
        1e6 / ns,
        steps as f64 / TICKS as f64
    );
}

fn generator(name: &str, amplitude: f64) {
    if !wanted(name) {
        return;
    }
    let timing = PulseTimingNs { step_length: 50, step_space: 50, dir_setup: 50, dir_hold: 50 };
    let motion: Vec<(f64, f64)> = (1..=TICKS as u64)
        .map(|tick| {
            let (position, velocity) = common::wave(0, tick as f64 * 1e-3);
            (position * amplitude, velocity * amplitude)
        })
        .collect();
    let mut best = f64::INFINITY;
    let mut steps = 0;
    for _ in 0..5 {
        let (Ok(timing), Ok(mut period)) = (timing.ticks(1), Period::new(0, 1_000_000, 1)) else { return };
        let Ok(mut joint) = StepGenerator::new(0, 400.0, timing, 0.0) else { return };
        let start = Instant::now();
        for &(position, velocity) in &motion {
            let _ = joint.advance(position, velocity, &period, |edge| {
                black_box(edge);
            });
            period = period.next();
        }
        best = best.min(start.elapsed().as_secs_f64());
        steps = joint.report().steps;
    }
    println!(
        "{name:<28} {:7.0} ns a tick, {:6.1} steps a tick, {:6.1} Msteps/s",
        best * 1e9 / TICKS as f64,
        steps as f64 / TICKS as f64,
        steps as f64 / best / 1e6
    );
}

fn main() {
    let setpoints = setpoints();
    run("machine, no observer", &setpoints, |_| Vec::new());
    run("machine, trace.csv", &setpoints, |s| vec![Box::new(TraceWriter::new(sink(), s))]);
    run("machine, steps.vcd", &setpoints, |s| vec![Box::new(VcdWriter::new(sink(), s))]);
    run("machine, both", &setpoints, |s| {
        vec![Box::new(VcdWriter::new(sink(), s)), Box::new(TraceWriter::new(sink(), s))]
    });
    generator("generator, 20 mm/s", 1.0);
    generator("generator, 100 mm/s", 5.0);
    generator("generator, 2000 mm/s", 100.0);
}
