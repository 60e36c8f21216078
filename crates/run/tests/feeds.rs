//! A change of the feed from move to move costs no time beyond its own moves, and no feed is exceeded where two moves blend.

use pkm_hal_sim::{Observer, TickReport};
use pkm_kins::{Axis, maths};
use pkm_machine::Machine;
use pkm_run::{Options, Program, run};
use std::ops::ControlFlow;

/// Distance of X Y Z and turn of A from period to period, mm and degrees.
#[derive(Default)]
struct Speeds {
    last: Option<[f64; 4]>,
    most: [f64; 2],
}

impl Observer for Speeds {
    fn wants_edges(&self) -> bool {
        false
    }
    fn edge(&mut self, _: &pkm_stepgen::Edge) {}
    fn tick(&mut self, report: &TickReport<'_>) {
        let now = [Axis::X, Axis::Y, Axis::Z, Axis::A].map(|axis| report.setpoint.pose.get(axis));
        if let Some(last) = self.last.replace(now) {
            let [x, y, z, a] = std::array::from_fn(|i| now[i] - last[i]);
            let by = [maths::sqrt(x * x + y * y + z * z), maths::degrees(a).abs()];
            self.most = std::array::from_fn(|i| self.most[i].max(by[i]));
        }
    }
}

/// Runs the moves on a Cartesian machine (100 mm/s, 1000 mm/s²; 90 degrees/s, 900 degrees/s²): duration in s, and the highest
/// speeds in mm/s and degrees/s.
fn driven(moves: &str) -> (f64, [f64; 2]) {
    driven_in("G64 P0.02", moves)
}

/// The same in this path mode; no joint is over its limits.
fn driven_in(mode: &str, moves: &str) -> (f64, [f64; 2]) {
    driven_on("xyzabc", mode, moves)
}

fn driven_on(machine: &str, mode: &str, moves: &str) -> (f64, [f64; 2]) {
    let machine = Machine::load(machine, &[]).expect("a shipped machine");
    let text = format!("G21 G91 G94 {mode}\n{moves}\nM2\n").into_bytes();
    let program = Program::Memory { name: "feeds".to_owned(), text };
    let looks_on = |_: &_| Speeds::default();
    let (summary, seen) =
        run(&program, &machine, &Options::default(), looks_on, |_| ControlFlow::Continue(()))
            .expect("readable");
    assert!(summary.completed, "{:?}", summary.diagnostics);
    for joint in &summary.joints {
        assert!(joint.peak_velocity <= joint.velocity_limit, "{mode}\n{moves}\n{joint:?}");
        assert!(joint.peak_acceleration <= joint.acceleration_limit, "{mode}\n{moves}\n{joint:?}");
    }
    (summary.duration_s, seen.expect("it ran").most.map(|by| by * 1000.0))
}

fn takes(moves: &str, expected_s: f64) {
    let (duration_s, _) = driven(moves);
    assert!((duration_s / expected_s - 1.0).abs() < 0.01, "{duration_s} s, not {expected_s} s: {moves}");
}

#[test]
fn a_slow_move_does_not_hold_back_its_neighbours() {
    // 100 mm up to 100 mm/s and down to 1 mm/s.
    let fast_s = 0.1 + (100.0 - 5.0 - 4.9995) / 100.0 + 0.099;
    takes("G1 X100 F6000\nG1 X1 F60", fast_s + 1.0);
    takes("G1 X1 F60\nG1 X100 F6000", 1.0 + fast_s);
    takes("G0 X100\nG1 X1 F60", fast_s + 1.0);
    takes("G1 X100 F6000\nG1 Y1 F60", fast_s + 1.0);
    // A gentle corner is long: P allows it half of either line.
    takes("G1 X10 F600\nG1 X10 Y0.005 F60", 1.0 + 10.0);
    takes("G1 X10 F60\nG1 X10 Y0.005 F600", 10.0 + 1.0);
}

/// Hundreds of nodes within a tenth of a micrometre, and behind them a line of two micrometres with two.
#[test]
fn what_a_slow_move_is_cut_into_does_not_hold_back_the_next() {
    let moves = "G1 X0.000091 F0.1\nG1 X-0.0002638 Y-0.00214 F3000";
    let (duration_s, _) = driven_on("moma-a", "G64 P0.05", moves);
    // 48.7 ms up to the middle of the corner, then 3.2 ms.
    assert!(duration_s <= 0.055, "{duration_s} s");
}

#[test]
fn from_a_line_to_a_turn_no_feed_is_exceeded_and_no_time_lost() {
    // Each of 0.2 s or 2 s, and what the corners cost.
    takes("F600\nG1 Y-2\nG1 Y2\nG1 Z-2\nG1 Z2\nG1 A-2", 1.04);
    takes("F600\nG1 X20\nG1 A20\nG1 Y20", 6.03);
    let (_, [mm_s, degrees_s]) = driven("F600\nG1 X2\nG1 A2\nG1 Y2\nG1 A-2 F1200\nG1 X-2");
    assert!(mm_s > 19.9 && mm_s < 20.000_1, "{mm_s}");
    assert!(degrees_s > 19.9 && degrees_s < 20.000_1, "{degrees_s}");
    let (_, [mm_s, degrees_s]) = driven("F600\nG1 X2\nG1 A2\nG1 Y2\nG1 A-2\nG1 X-2");
    assert!(mm_s > 9.99 && mm_s < 10.000_1, "{mm_s}");
    assert!(degrees_s > 9.99 && degrees_s < 10.000_1, "{degrees_s}");
}

/// Moves of all sizes, along one axis or several, at feeds from 60 to 6000 a minute or as rapids.
fn random_moves(seed: u64) -> String {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut below = |n: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % n) as usize
    };
    let mut places = [0.0_f64; 6];
    let mut moves = String::from("F600");
    for _ in 0..2 + below(20) {
        moves.push_str(["\nG1", "\nG1", "\nG1", "\nG0"][below(4)]);
        let rapid = moves.ends_with('0');
        for (axis, place) in places.iter_mut().enumerate() {
            if below(3) > 0 && axis != 0 {
                continue;
            }
            let by = [0.01, 0.1, 1.0, 5.0, 20.0][below(5)] * [1.0, -1.0][below(2)];
            let by = if (*place + by).abs() > 40.0 { -by } else { by };
            *place += by;
            moves.push_str(&format!(" {}{by}", char::from(b"XYZABC"[axis])));
        }
        if !rapid {
            moves.push_str(&format!(" F{}", [60, 600, 3000, 6000][below(4)]));
        }
    }
    moves
}

#[test]
fn blending_is_not_slower_than_stopping() {
    for seed in 0..30 {
        let moves = random_moves(seed);
        let stopping = driven_in("G61.1", &moves).0;
        let blending = driven_in("G64 P0.02", &moves).0;
        assert!(blending <= 1.05 * stopping, "seed {seed}: {blending} s, with stops {stopping} s\n{moves}");
    }
}
