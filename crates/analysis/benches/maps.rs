//! How long maps and scans take: `cargo bench -p pkm-analysis --bench maps`. With Python 3 and NumPy on the machine it runs `maps.py`
//! beside itself, the same two computations vectorised, and prints both and their ratio; medians of several runs each.
#![allow(clippy::print_stdout, clippy::disallowed_methods)]

use pkm_analysis::parallel::cores;
use pkm_analysis::workspace::map::grid;
use pkm_analysis::workspace::polar::{Steps, TOTAL_ORIENTATION, scan};
use pkm_analysis::workspace::{Section, views};
use pkm_machine::Machine;
use std::process::Command;
use std::time::Instant;

/// Median and best of so many runs, s. On a machine with other work a second thread may wait longer for a core than it works;
/// the best run is the one that did not.
fn timed(runs: usize, mut work: impl FnMut()) -> [f64; 2] {
    work();
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[0]]
}

fn main() {
    let machine = Machine::load("moma-a", &[]).expect("shipped");
    let view = views(&machine, &Section::default()).expect("planar").swap_remove(0);
    // 1000 × 1000 poses over x −80..80, y −360..−160.
    let mut map = grid([[-80.0, -360.0], [79.9, -160.2]], 0.2).expect("not too fine");
    map.size = [1000, 1000];
    map.determinant = vec![0.0; 1_000_000];
    map.step = 0.16;
    let [map_s, map_best_s] = timed(25, || view.fill(&mut map, cores()));
    let [alone_s, alone_best_s] = timed(25, || view.fill(&mut map, 1));
    let reached = map.determinant.iter().filter(|value| !value.is_nan()).count();

    let lambda = Machine::load("lambda6", &[]).expect("shipped");
    let mut volume = 0.0;
    let [scan_s, scan_best_s] = timed(15, || {
        volume = scan(&lambda, TOTAL_ORIENTATION, Steps::default(), cores()).expect("not empty").volume_mm3();
    });
    println!("{} cores", cores());
    println!(
        "determinant and reach, 1,000,000 poses of moma-a ({reached} reached): median {:.2} ms, best {:.2} ms; one thread {:.2}, {:.2}",
        map_s * 1e3,
        map_best_s * 1e3,
        alone_s * 1e3,
        alone_best_s * 1e3
    );
    println!(
        "total orientation of lambda6, 27 orientations ({volume:.0} mm³): median {:.2} ms, best {:.2} ms",
        scan_s * 1e3,
        scan_best_s * 1e3
    );

    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/maps.py");
    let output = match Command::new("python3").arg(script).output() {
        Ok(output) if output.status.success() => String::from_utf8_lossy(&output.stdout).into_owned(),
        _ => {
            println!("no NumPy here: nothing to compare with (pip install numpy)");
            return;
        }
    };
    let numbers: Vec<f64> = output.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [numpy_map_s, numpy_map_best_s, numpy_reached, numpy_scan_s, numpy_scan_best_s, numpy_volume] =
        numbers[..]
    else {
        println!("maps.py answered: {output}");
        return;
    };
    println!(
        "NumPy: map median {:.1} ms, best {:.1} ms; scan median {:.1} ms, best {:.1} ms",
        numpy_map_s * 1e3,
        numpy_map_best_s * 1e3,
        numpy_scan_s * 1e3,
        numpy_scan_best_s * 1e3
    );
    println!(
        "ratios of medians: map {:.1}, scan {:.1}; of best runs: map {:.1}, scan {:.1}",
        numpy_map_s / map_s,
        numpy_scan_s / scan_s,
        numpy_map_best_s / map_best_s,
        numpy_scan_best_s / scan_best_s
    );
    assert!((numpy_reached - reached as f64).abs() <= 2.0, "both count the same poses");
    assert!((numpy_volume / volume - 1.0).abs() < 1e-6, "both find the same volume");
}
