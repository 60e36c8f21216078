//! Homing of parallel machines: where it ends, in what order, and what is refused.

mod common;

use common::{machine, pose, program};
use pkm_analysis::outcome::Row;
use pkm_kins::Kinematics;
use pkm_machine::Machine;
use pkm_run::{Options, Rehearsal, on_a_large_stack};

/// Homes and runs an empty program; the rows of it.
fn home(machine: &Machine, start: &str) -> Vec<Row> {
    on_a_large_stack(|| {
        let program = program("G21\nG4 P0.01\nM2\n");
        let options = Options { home: true, start: Some(pose(machine, start)), ..Options::default() };
        Rehearsal::new(&program, machine, &options).unwrap().rows().to_vec()
    })
}

fn steps_from_home(machine: &Machine, rows: &[Row]) -> f64 {
    let at_home = machine.mechanism.inverse(&machine.home).unwrap();
    let last = rows.last().unwrap();
    let steps = |j: usize| (last.actual[j] - at_home[j]).abs() * machine.joints[j].steps_per_unit;
    (0..machine.joints.len()).map(steps).fold(0.0, f64::max)
}

#[test]
fn bounce_does_not_move_home() {
    for start in ["X2 Y-263", "X-3 Y-268"] {
        let mut places = Vec::new();
        for bounce_ms in ["0", "0.2", "1", "3", "7.5", "12", "20"] {
            let bounce = format!("homing.switch_bounce_ms={bounce_ms}");
            let machine = machine("moma-a", &[&bounce]);
            let rows = home(&machine, start);
            assert!(!rows[0].homed && rows.last().unwrap().homed);
            let off = steps_from_home(&machine, &rows);
            assert!(off <= 1.0, "{start}, bounce {bounce_ms} ms: {off} steps from home");
            places.push(rows.last().unwrap().actual[0]);
        }
        let spread = places.iter().fold(0.0, |most: f64, place| most.max((place - places[0]).abs()));
        assert!(spread * 400.0 <= 1.0, "{start}: {places:?}");
    }
}

#[test]
fn every_machine_of_the_fault_tests_finds_home() {
    for (name, start) in
        [("moma-a", "X5 Y-260"), ("moma-c", ""), ("lambda6", "X9 Y-7 Z-1495"), ("xyz", "X9 Z4")]
    {
        let machine = machine(name, &[]);
        let rows = home(&machine, start);
        assert!(steps_from_home(&machine, &rows) <= 1.0, "{name}");
        // the true joints are always where the mechanism can be
        for row in rows.iter().step_by(50) {
            machine.mechanism.forward(&row.actual, &machine.home).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
    }
}

#[test]
fn sequences_come_in_order_and_negative_ones_go_home_together() {
    // switches off home, so that the last move is one
    let with = |sequences: [i32; 2]| {
        let sets = [
            "joint.*.home.switch_mm=100".to_owned(),
            format!("joint.0.home.sequence={}", sequences[0]),
            format!("joint.1.home.sequence={}", sequences[1]),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let machine = machine("moma-a", &sets);
        let rows = home(&machine, "X2 Y-263");
        assert!(steps_from_home(&machine, &rows) <= 1.0);
        let moves = |j: usize| {
            let travel = |i: &usize| (rows[*i].actual[j] - rows[*i - 1].actual[j]).abs() > 1e-9;
            let moving: Vec<usize> = (1..rows.len()).filter(travel).collect();
            (moving[0], *moving.last().unwrap())
        };
        (moves(0), moves(1))
    };
    let ((first_0, last_0), (first_1, last_1)) = with([1, 0]);
    assert!(last_1 < first_0 && first_1 < last_1 && first_0 < last_0, "joint 1 homes before joint 0 begins");
    let ((first_0, last_0), (first_1, last_1)) = with([0, 0]);
    assert!(first_0.abs_diff(first_1) < 50, "together: {first_0} {first_1}");
    let apart = last_0.abs_diff(last_1);
    let ((_, last_0), (_, last_1)) = with([-1, -1]);
    assert!(
        last_0.abs_diff(last_1) < 100.min(apart),
        "the last move together: {last_0} {last_1}; alone {apart}"
    );
}

#[test]
fn the_index_is_used_where_there_is_one() {
    let with = |pitch: &str| {
        let pitch = format!("joint.*.home.index_pitch_mm={pitch}");
        let machine = machine("moma-a", &[&pitch]);
        let rows = home(&machine, "X2 Y-263");
        steps_from_home(&machine, &rows)
    };
    for pitch in ["2", "5", "1.25"] {
        let off = with(pitch);
        assert!(off <= 1.0, "pitch {pitch}: {off} steps from home");
    }
}

#[test]
fn an_unsafe_home_is_refused() {
    for (name, set, told) in [
        ("lambda6", "joint.0.home.switch_mm=2000", "homing is not safe"),
        ("moma-a", "joint.0.home.switch_mm=300", "outside the joint's travel"),
        ("moma-a", "joint.0.home.search_velocity_mm_s=0", "is 0 or beyond"),
        ("moma-a", "joint.0.home.latch_velocity_mm_s=1000", "is 0 or beyond"),
        ("moma-a", "joint.0.home.sequence=1000", "outside -100 to 100"),
        ("moma-a", "joint.0.home.switch_deg=3", "unit of the other kind"),
        ("moma-a", "homing.switch_bounce_ms=5000", "longer than 1000 ms"),
        ("moma-a", "joint.0.following_error_mm=-1", "must be larger than 0"),
        ("moma-a", "home.y=-120", "home"),
    ] {
        let errors = Machine::load(name, &[set.to_owned()]).expect_err(set);
        assert!(errors.iter().any(|error| error.message.contains(told)), "{set}: {errors:?}");
    }
}

#[test]
fn a_switch_that_lies_once_is_found_out() {
    common::on_each_case(true, |machine, rehearsal| {
        for tick in (1..rehearsal.periods()).step_by(31) {
            for kind in [
                "+1,joint.1.home-sw-in,invert",
                "+30,joint.0.home-sw-in,set=true",
                ",home-switch.1.stuck-on,set=true",
            ] {
                common::outcome(machine, rehearsal, &[&format!("{tick}{kind}")]);
            }
        }
        // its wire, not its place: that cannot be noticed, and is not among the random faults
        assert!(rehearsal.pins().all(|pin| !(pin.starts_with("home-switch.") && pin.ends_with(".position"))));
    });
}
