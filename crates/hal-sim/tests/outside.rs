//! Judges from outside: sigrok's stepper decoder counts our steps, GTKWave's converter reads our file. Where a tool is not
//! installed, the test says so and passes (Debian: `sigrok-cli`, `gtkwave`).

mod common;

use common::{Waves, config};
use pkm_hal_sim::{Simulation, VcdWriter};
use std::fs::File;
use std::path::PathBuf;
use std::process::Command;

/// Two joints for two seconds with a timer of 1 µs; the file and the machine at the end.
fn recording(name: &str) -> (PathBuf, Simulation) {
    let mut simulation = Simulation::new(&config(2, 1000)).unwrap();
    let path = std::env::temp_dir().join(format!("pkm-{name}-{}.vcd", std::process::id()));
    let mut vcd = VcdWriter::new(File::create(&path).unwrap(), &simulation);
    for _ in 0..2000 {
        simulation.tick(&mut Waves { joints: 2 }, &mut [&mut vcd]).unwrap();
    }
    vcd.finish().unwrap();
    (path, simulation)
}

fn output(program: &str, arguments: &[&str]) -> Option<String> {
    match Command::new(program).args(arguments).output() {
        Ok(output) => {
            assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
            Some(String::from_utf8_lossy(&output.stdout).into_owned())
        }
        Err(error) => {
            eprintln!("left out, no {program}: {error}");
            None
        }
    }
}

#[test]
fn sigrok_counts_the_same_steps() {
    let (path, simulation) = recording("sigrok");
    let path_text = path.to_str().unwrap();
    for (n, (state, statistics)) in simulation.report().joints.iter().zip(simulation.statistics()).enumerate()
    {
        let decoder = format!("stepper_motor:step=joint{n}_step:dir=joint{n}_dir");
        let arguments = ["-i", path_text, "-I", "vcd", "-P", &decoder, "-A", "stepper_motor=position"];
        let Some(text) = output("sigrok-cli", &arguments) else { break };
        let positions: Vec<i64> = text
            .lines()
            .map(|line| line.split_whitespace().nth(1).and_then(|word| word.parse().ok()).unwrap())
            .collect();
        // it says nothing for the first pulse or two, and speaks of each when the next has come
        let silent = statistics.steps - positions.len() as u64;
        assert!((1..=2).contains(&silent), "joint {n}: {} of {}", positions.len(), statistics.steps);
        let start = (common::wave(n, 0.0).0 * 400.0 + 0.5).floor() as i64;
        let difference = state.count - start - positions.last().unwrap();
        assert!(difference.abs() <= 2, "joint {n}: {difference}");
    }
    std::fs::remove_file(path).unwrap();
}

#[test]
fn gtkwave_reads_the_file() {
    let (path, _) = recording("gtkwave");
    let fst = path.with_extension("fst");
    if output("vcd2fst", &[path.to_str().unwrap(), fst.to_str().unwrap()]).is_some() {
        assert!(fst.metadata().unwrap().len() > 1000);
        std::fs::remove_file(fst).unwrap();
    }
    std::fs::remove_file(path).unwrap();
}
