//! `pkm steps`: a compact step stream, played.

use crate::cli::{Steps, StepsFormat};
use crate::outcome::{Failure, Outcome};
use crate::output;
use pkm_hal_sim::StreamSteps;
use serde::Serialize;
use std::fs::read;
use std::io::{BufWriter, Write, stdout};

/// What is in a stream.
#[derive(Serialize)]
struct Sums {
    schema: u32,
    bytes: usize,
    timer_period_ns: u64,
    runs: usize,
    /// From the start to the last step.
    duration_s: f64,
    joints: Vec<Joint>,
}

/// Steps of one joint, and forward less backward.
#[derive(Clone, Copy, Default, Serialize)]
struct Joint {
    steps: u64,
    count: i64,
}

pub(crate) fn run(arguments: &Steps) -> Result<Outcome, Failure> {
    let name = arguments.stream.display().to_string();
    let could_not = |error: std::io::Error| {
        let message = format!("cannot read {name}: {error}");
        Failure::could_not(
            "step-stream",
            &name,
            message,
            "`pkm run PROGRAM --step-stream --out DIR` writes one",
        )
    };
    let bytes = read(&arguments.stream).map_err(could_not)?;
    let mut stream = StreamSteps::new(&bytes).map_err(could_not)?;
    let mut out = BufWriter::new(stdout().lock());
    let mut sums = Sums {
        schema: 1,
        bytes: bytes.len(),
        timer_period_ns: stream.timer_period_ns(),
        runs: stream.runs(),
        duration_s: 0.0,
        joints: vec![Joint::default(); stream.counts().len()],
    };
    let csv = arguments.format == StepsFormat::Csv;
    if csv {
        writeln!(out, "time_ns,joint,step,count")?;
    }
    while let Some((time_ns, joint, forward)) = stream.next_step() {
        let step = if forward { 1 } else { -1 };
        let sum = &mut sums.joints[joint];
        sum.steps += 1;
        sum.count += step;
        sums.duration_s = time_ns as f64 / 1e9;
        if csv {
            writeln!(out, "{time_ns},{joint},{step},{}", sum.count)?;
        }
    }
    match arguments.format {
        StepsFormat::Csv => {}
        StepsFormat::Json => {
            output::json_line(&sums)?;
        }
        StepsFormat::Text => {
            let steps: u64 = sums.joints.iter().map(|joint| joint.steps).sum();
            let each = sums.bytes as f64 / (steps as f64).max(1.0);
            writeln!(
                out,
                "{name}: {steps} steps in {} runs, {} bytes ({each:.2} a step)",
                sums.runs, sums.bytes
            )?;
            writeln!(
                out,
                "last step {} s after the start, timer {} ns",
                sums.duration_s, sums.timer_period_ns
            )?;
            for (n, joint) in sums.joints.iter().enumerate() {
                writeln!(
                    out,
                    "joint {n}: {} steps, ends {:+} from where it stood",
                    joint.steps, joint.count
                )?;
            }
        }
    }
    out.flush()?;
    Ok(Outcome::Clean)
}
