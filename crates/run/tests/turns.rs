//! Moves that go round: what looks the same a turn later is not the same in between, and a long arc is planned as far ahead as a
//! stop from its speed needs.

use pkm_hal_sim::{Observer, TickReport};
use pkm_kins::{
    Pose,
    maths::{TAU, sqrt},
};
use pkm_machine::Machine;
use pkm_run::{Options, Program, Summary, check, run};
use std::ops::ControlFlow;

struct Nobody;

impl Observer for Nobody {
    fn wants_edges(&self) -> bool {
        false
    }
    fn edge(&mut self, _: &pkm_stepgen::Edge) {}
    fn tick(&mut self, _: &TickReport<'_>) {}
}

fn program(text: &str) -> Program {
    Program::Memory { name: "turns".to_owned(), text: format!("G21 G61\n{text}\nM2\n").into_bytes() }
}

fn machine(name: &str, set: &[&str]) -> Machine {
    Machine::load(name, &set.iter().map(|&key| key.to_owned()).collect::<Vec<_>>())
        .expect("a shipped machine")
}

fn at(x: f64, y: f64) -> Options {
    Options { start: Some(Pose { x, y, ..Pose::ZERO }), ..Options::default() }
}

/// Run to its end, with every joint within its limits.
fn driven(machine: &Machine, options: &Options, text: &str) -> Summary {
    let nobody = |_: &_| Nobody;
    let (summary, _) = run(&program(text), machine, options, nobody, |_| ControlFlow::Continue(())).unwrap();
    assert!(summary.completed, "{text}: {:?}", summary.diagnostics);
    for joint in &summary.joints {
        assert!(joint.peak_velocity <= joint.velocity_limit, "{text}: {joint:?}");
        assert!(joint.peak_acceleration <= joint.acceleration_limit, "{text}: {joint:?}");
    }
    summary
}

#[test]
fn joints_keep_their_limits_between_places_that_look_alike() {
    let moma = machine("moma-a", &[]);
    for turns in [2, 4, 6, 10] {
        driven(&moma, &at(0.0, -265.0), &format!("G2 X0 Y-265 I20 J0 P{turns} F60000"));
    }
    // The table takes the place of the tool round with it.
    let mill = machine("hv-mill-v5", &["joint.3.max_velocity_deg_s=180"]);
    driven(&mill, &at(45.0, 45.0), "G0 C720");
    driven(&mill, &at(45.0, 45.0), "G1 X45.001 C-1440 F1000");
}

#[test]
fn a_circle_of_many_turns_is_not_slower_than_at_one_speed() {
    let xyz = machine("xyz", &[]);
    for radius in [0.02, 0.1, 1.0, 10.0] {
        for turns in [1, 2, 3, 10] {
            let duration_s =
                driven(&xyz, &at(0.0, 0.0), &format!("G3 X0 Y0 I{radius} J0 P{turns} F60000")).duration_s;
            // v²/r = a all the way, and v/a to come to that speed and to rest; here a is 1000 mm/s².
            let slow_s = sqrt(radius / 1000.0) * (TAU * f64::from(turns) + 1.0);
            assert!(
                duration_s <= slow_s + 0.001,
                "radius {radius}, {turns} turns: {duration_s} of {slow_s} s"
            );
        }
    }
}

/// From rest into a blend and an arc of some hundred nodes, with nothing behind them: a pause before it gains nothing.
#[test]
fn the_first_move_knows_as_much_of_the_way_as_one_after_a_pause() {
    let moma = machine("moma-a", &["servo.period_ns=100000"]);
    let moves = "G0 X0.394 Y-264.9\nG2 X4.045842 Y-266.148052 I1.367 J-1.967 F3000";
    let [at_once, later] = ["", "G4 P0.1\n"]
        .map(|pause| driven(&moma, &at(0.0, -265.0), &format!("G64 P0.05\n{pause}{moves}")).duration_s);
    assert!((later - at_once).abs() < 0.001, "{at_once} s at once, {later} s after a pause");
}

#[test]
fn a_turn_is_looked_at_as_closely_as_a_way() {
    // p3 moves by ±63.6 mm in a turn of the table, wherever the turn begins and ends.
    let mill = machine("hv-mill-v5", &["joint.2.min_mm=150"]);
    for text in ["G0 C720", "G0 X45.01 C720", "G0 X45.01 C-360"] {
        let found = check(&program(text), &mill, &at(45.0, 45.0)).unwrap().diagnostics;
        assert!(found.iter().any(|finding| finding.code == "limit_low:3"), "{text}: {found:?}");
    }
}
