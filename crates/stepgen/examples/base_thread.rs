//! LinuxCNC's `stepgen`, emulated: a row of positions per base period on standard input, one channel a column, and a row
//! `step dir counts` per channel comes out, as `halsampler` prints it. `.ci/judge-stepgen` compares the two.
//!
//! `base_thread STEPS_PER_UNIT BASE_PERIOD_NS STEP_LENGTH_NS STEP_SPACE_NS DIR_SETUP_NS DIR_HOLD_NS < positions`
#![allow(clippy::print_stdout)]

use pkm_stepgen::PulseTimingNs;
use pkm_stepgen::base_thread::BaseThreadStepgen;
use std::io::{BufRead, Write, stdin, stdout};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scale, period, times @ ..] = arguments.as_slice() else {
        return Err("see the example's head".into());
    };
    let times: Vec<u64> = times.iter().map(|time| time.parse()).collect::<Result<_, _>>()?;
    let [step_length, step_space, dir_setup, dir_hold] = times[..] else {
        return Err("four pulse times".into());
    };
    let timing = PulseTimingNs { step_length, step_space, dir_setup, dir_hold };
    let (scale, period) = (scale.parse::<f64>()?, period.parse::<u64>()?);

    let mut channels: Vec<BaseThreadStepgen> = Vec::new();
    let mut out = std::io::BufWriter::new(stdout().lock());
    for line in stdin().lock().lines() {
        let positions: Vec<f64> = line?.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        while channels.len() < positions.len() {
            channels.push(
                BaseThreadStepgen::new(scale, timing, period, period)
                    .map_err(|error| format!("{error:?}"))?,
            );
        }
        for (channel, position) in channels.iter_mut().zip(positions) {
            let counts = channel.count();
            channel.update(position);
            let lines = channel.pulse();
            write!(out, "{} {} {counts} ", u8::from(lines.step), u8::from(lines.dir))?;
        }
        writeln!(out)?;
    }
    Ok(())
}
