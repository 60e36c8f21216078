//! What a person can do at any tick: feed hold and resume, abort, overrides.

use crate::catalogue::{Case, all, flower_on_moma};
use crate::harness::{Rig, Sampling, random, to_move, with_stack};
use pkm_planner::path::{Geometry, Line};
use pkm_planner::{PathMode, State};

/// Interventions per path, times `PKM_TEST_SCALE`.
const TRIES: u64 = 25;

fn tries() -> u64 {
    TRIES * std::env::var("PKM_TEST_SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1)
}

/// Blended chords, blended corners, a circle, exact stops, struts.
fn paths() -> Vec<(&'static str, Case, f64)> {
    let mut paths: Vec<_> = all()
        .into_iter()
        .filter(|known| ["P03", "P05", "P12", "P16"].contains(&known.id))
        .map(|known| (known.id, known.case, known.p_mm))
        .collect();
    paths.push(("flower", flower_on_moma(400), 0.01));
    paths
}

fn assert_within(what: &str, rig: &Rig<'_>, p_mm: f64) {
    let [velocity, acceleration, off_mm] = rig.worst();
    assert!(velocity <= 1.0 + 1e-6, "{what}: velocity {velocity}");
    assert!(acceleration <= 1.0 + 1e-6, "{what}: acceleration {acceleration}");
    assert!(off_mm <= p_mm.max(1e-9), "{what}: {off_mm} mm off the path");
}

/// Ticks the undisturbed run takes.
fn undisturbed(case: &Case) -> (u64, Rig<'_>) {
    let mut rig = Rig::new(case, Sampling::SERVO);
    loop {
        rig.feed(false);
        if rig.tick().state == State::Idle && rig.is_fed() {
            return (rig.ticks, rig);
        }
    }
}

#[test]
fn an_abort_at_any_tick_ends_at_rest_on_the_path_and_the_queue_ends_there() {
    with_stack(|| {
        let mut seed = 0x6a09_e667_f3bc_c909;
        for (id, case, p_mm) in &paths() {
            let (ticks, _) = undisturbed(case);
            for _ in 0..tries() {
                let at = random(&mut seed) % ticks;
                let what = format!("{id} aborted at tick {at}");
                let mut rig = Rig::new(case, Sampling::SERVO);
                for _ in 0..at {
                    rig.feed(false);
                    rig.tick();
                }
                rig.feed(false);
                rig.planner.abort();
                let rest = loop {
                    let setpoint = rig.tick();
                    if setpoint.state == State::Idle {
                        break setpoint;
                    }
                    assert!(rig.ticks < at + 1000, "{what}: does not stop");
                };
                assert_within(&what, &rig, *p_mm);
                assert_eq!(rest.joint_velocity, [0.0; 9], "{what}");
                assert!(rig.planner.is_idle(), "{what}");
                assert_eq!(
                    *rig.planner.end(),
                    rest.pose.to_array(),
                    "{what}: program and machine state differ"
                );
                let here = rig.tick();
                assert_eq!((here.pose, here.joints), (rest.pose, rest.joints), "{what}: moves on");
                // And from there a move works: back to where the path began.
                let home = case.moves[0].0.at(0.0).position;
                if let Some(line) = Line::new(*rig.planner.end(), home) {
                    let back = to_move(case, (Geometry::Line(line), PathMode::ExactStop));
                    rig.planner.push(back).unwrap();
                    rig.planner.finish();
                    let mut left = 100_000;
                    while rig.planner.tick().unwrap().state != State::Idle && left > 0 {
                        left -= 1;
                    }
                    let end = rig.planner.setpoint().pose.to_array();
                    assert!(
                        end.iter().zip(home).all(|(a, b)| (a - b).abs() < 1e-9),
                        "{what}: back to {end:?}"
                    );
                }
            }
        }
    });
}

#[test]
fn holds_at_any_tick_leave_the_end_to_the_bit() {
    with_stack(|| {
        let mut seed = 0xbb67_ae85_84ca_a73b;
        for (id, case, p_mm) in &paths() {
            let (ticks, whole) = undisturbed(case);
            for _ in 0..tries() {
                let mut rig = Rig::new(case, Sampling::SERVO);
                let mut next = random(&mut seed) % ticks;
                let what = format!("{id} held from tick {next} on");
                let mut held = false;
                loop {
                    rig.feed(false);
                    if rig.ticks == next {
                        held = !held;
                        rig.planner.hold(held);
                        next += 1 + random(&mut seed) % 400;
                    }
                    let setpoint = rig.tick();
                    if setpoint.state == State::Held {
                        assert!(held && setpoint.joint_velocity == [0.0; 9], "{what}: {setpoint:?}");
                    }
                    if setpoint.state == State::Idle && rig.is_fed() {
                        break;
                    }
                }
                assert_within(&what, &rig, *p_mm);
                let (end, want) = (rig.planner.setpoint(), whole.planner.setpoint());
                assert_eq!((end.pose, end.joints), (want.pose, want.joints), "{what}");
            }
        }
    });
}

#[test]
fn a_hold_rests_and_nothing_moves_until_it_ends() {
    with_stack(|| {
        let case = flower_on_moma(400);
        let mut rig = Rig::new(&case, Sampling::SERVO);
        rig.feed(false);
        for _ in 0..500 {
            rig.tick();
        }
        rig.planner.hold(true);
        let begin = rig.ticks;
        while rig.tick().state != State::Held {}
        // 100 mm/s and 1000 mm/s² at the joints: a tenth of a second, and some for the bends.
        assert!(rig.ticks - begin < 200, "{} ticks to stop", rig.ticks - begin);
        let rest = *rig.planner.setpoint();
        for _ in 0..100 {
            assert_eq!(rig.tick().joints, rest.joints);
        }
        rig.planner.hold(false);
        assert_ne!(rig.tick().joints, rest.joints);
    });
}

#[test]
fn an_override_that_is_no_number_changes_nothing() {
    with_stack(|| {
        let case = flower_on_moma(400);
        let (ticks, _) = undisturbed(&case);
        let mut rig = Rig::new(&case, Sampling::SERVO);
        loop {
            rig.feed(false);
            for factor in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(!rig.planner.set_feed_override(factor) && !rig.planner.set_rapid_override(factor));
            }
            if rig.tick().state == State::Idle && rig.is_fed() {
                break;
            }
        }
        assert_eq!(rig.ticks, ticks);
    });
}

/// The bounds of docs/planner.md: nodes set and planned by a push and by a tick, whatever the queue holds and whoever
/// turns the override.
#[test]
fn the_work_of_a_push_and_of_a_tick_is_bounded() {
    with_stack(|| {
        let case = flower_on_moma(10_000);
        let mut rig = Rig::new(&case, Sampling::SERVO);
        let mut seed = 0x3c6e_f372_fe94_f82b;
        let (mut passed_before, mut most_passed) = (0, 0);
        loop {
            let mut work = rig.planner.work();
            while !rig.is_fed() && rig.planner.has_room() {
                rig.feed(true);
                let now = rig.planner.work();
                assert!(now.nodes - work.nodes <= 64, "a push sets {}", now.nodes - work.nodes);
                assert!(now.planned - work.planned <= 512, "a push plans {}", now.planned - work.planned);
                work = now;
            }
            if random(&mut seed).is_multiple_of(40) {
                let factor = (random(&mut seed) % 201) as f64 / 100.0;
                assert!(rig.planner.set_feed_override(factor) && rig.planner.set_rapid_override(1.0));
            }
            let setpoint = rig.tick();
            let now = rig.planner.work();
            let (set, passed) = (now.nodes - work.nodes, now.passed - work.passed);
            assert!(set <= 16_u64.max(2 * passed_before), "a tick sets {set} after {passed_before}");
            assert!(now.planned - work.planned <= 2 * 64_u64.max(8 * set), "a tick plans too many");
            (passed_before, most_passed) = (passed, most_passed.max(passed));
            if setpoint.state == State::Idle && rig.is_fed() {
                break;
            }
        }
        assert!(most_passed <= 128, "{most_passed} nodes in a tick");
    });
}
