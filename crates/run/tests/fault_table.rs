//! The fault table of `docs/hal.md`: one test for each row. Every run is judged by `pkm_analysis::outcome`, and after each
//! stop the machine is reset, homed and runs the program to its end.

mod common;

use common::{moving_ticks, on_each_case, outcome, play};
use pkm_analysis::outcome::{End, Row, judge};
use pkm_run::Outcome;

#[test]
fn estop_at_every_tick() {
    let mut ticks = 0;
    for home in [true, false] {
        on_each_case(home, |machine, rehearsal| {
            for tick in 1..=rehearsal.periods() {
                let fault = format!("{tick},motion.enable,set=false");
                assert_eq!(
                    outcome(machine, rehearsal, &[&fault]).0,
                    Outcome::Off,
                    "{}: {fault}",
                    machine.name
                );
            }
        });
        ticks += 1;
    }
    assert_eq!(ticks, 2);
}

#[test]
fn estop_during_hold_and_during_another_stop() {
    on_each_case(false, |machine, rehearsal| {
        for tick in moving_ticks(machine, rehearsal) {
            for first in
                ["motion.feed-hold,set=true", "halui.abort,set=true", "joint.0.pos-lim-sw-in,set=true"]
            {
                for later in [1, 3, 10] {
                    let first = format!("{tick},{first}");
                    let estop = format!("{},motion.enable,set=false", tick + later);
                    let (outcome, message) = outcome(machine, rehearsal, &[&first, &estop]);
                    assert_ne!(outcome, Outcome::Equal, "{first} {estop}");
                    assert!(!message.is_empty());
                }
            }
        }
    });
}

#[test]
fn abort_stops_on_the_path() {
    on_each_case(false, |machine, rehearsal| {
        for tick in (1..rehearsal.periods() - 1).step_by(13) {
            let fault = format!("{tick},halui.abort,set=true");
            let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
            assert_eq!(outcome, Outcome::AtRest, "{}: {fault}: {message}", machine.name);
            assert!(message.contains("aborted in line"), "{message}");
        }
    });
}

#[test]
fn hold_and_override_end_where_the_undisturbed_run_ends() {
    on_each_case(false, |machine, rehearsal| {
        for tick in (1..rehearsal.periods()).step_by(29) {
            for fault in [
                "feed-hold,set=true",
                "adaptive-feed,set=0",
                "adaptive-feed,set=0.1",
                "adaptive-feed,set=2",
                "adaptive-feed,nan",
            ] {
                let fault = format!("{tick}+100,motion.{fault}");
                assert_eq!(
                    outcome(machine, rehearsal, &[&fault]).0,
                    Outcome::Equal,
                    "{}: {fault}",
                    machine.name
                );
            }
        }
        // up and down all the time
        let faults: Vec<String> =
            (1..40).map(|n| format!("{}+9,motion.adaptive-feed,set={}", n * 20, n as f64 / 20.0)).collect();
        let faults: Vec<&str> = faults.iter().map(String::as_str).collect();
        assert_eq!(outcome(machine, rehearsal, &faults).0, Outcome::Equal);
    });
}

#[test]
fn limit_switches_brake_all_joints_together() {
    on_each_case(false, |machine, rehearsal| {
        for tick in moving_ticks(machine, rehearsal) {
            for n in 0..machine.joints.len() {
                for side in ["pos", "neg"] {
                    let fault = format!("{tick},joint.{n}.{side}-lim-sw-in,set=true");
                    let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
                    assert_eq!(outcome, Outcome::BrakedAndOff, "{}: {fault}", machine.name);
                    assert!(message.contains(&format!("joint.{n}.{side}-lim-sw-in")), "{message}");
                    // the switch itself, not its wire
                    let fault = format!("{tick},{side}-switch.{n}.stuck-on,set=true");
                    assert_eq!(
                        common::outcome(machine, rehearsal, &[&fault]).0,
                        Outcome::BrakedAndOff,
                        "{fault}"
                    );
                }
            }
        }
    });
}

#[test]
fn encoder_faults_trip_the_following_error() {
    on_each_case(false, |machine, rehearsal| {
        for tick in moving_ticks(machine, rehearsal) {
            for n in 0..machine.joints.len() {
                for kind in ["set=0", "freeze", "offset=1", "offset=-0.5", "invert", "nan", "inf"] {
                    let at_zero = rehearsal.rows()[tick as usize].actual[n].abs() < 0.1;
                    if at_zero && ["set=0", "invert"].contains(&kind) {
                        continue; // a small difference, within the following error
                    }
                    let fault = format!("{tick},joint.{n}.motor-pos-fb,{kind}");
                    let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
                    assert_eq!(outcome, Outcome::Off, "{}: {fault}", machine.name);
                    assert!(message.contains(&format!("joint.{n}.")), "{fault}: {message}");
                }
            }
        }
    });
}

#[test]
fn noise_of_one_count_never_trips() {
    on_each_case(false, |machine, rehearsal| {
        for n in 0..machine.joints.len() {
            let step = 1.0 / machine.joints[n].to_face(machine.joints[n].steps_per_unit);
            let noise = |tick: u64| {
                let sign = if tick.is_multiple_of(3) { -1.0 } else { 1.0 };
                format!("{tick}+1,joint.{n}.motor-pos-fb,offset={}", sign * step)
            };
            let faults: Vec<String> = (1..rehearsal.periods()).map(noise).collect();
            let faults: Vec<&str> = faults.iter().map(String::as_str).collect();
            assert_eq!(outcome(machine, rehearsal, &faults).0, Outcome::Equal, "{}", machine.name);
        }
    });
}

#[test]
fn lost_steps_trip_the_following_error_where_there_is_an_encoder() {
    on_each_case(false, |machine, rehearsal| {
        for tick in moving_ticks(machine, rehearsal) {
            for n in 0..machine.joints.len() {
                for fault in [
                    format!("{tick},motor.{n}.counts,freeze"),
                    format!("{tick}+1,motor.{n}.counts,offset=200"),
                    format!("{tick},driver.{n}.step,freeze"),
                    format!("{tick},driver.{n}.dir,invert"),
                ] {
                    let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
                    assert_eq!(outcome, Outcome::Off, "{}: {fault}", machine.name);
                    assert!(message.contains(&format!("joint.{n}.f-error")), "{fault}: {message}");
                }
            }
        }
    });
}

#[test]
fn a_drive_that_fails_stops_all_joints_together() {
    on_each_case(false, |machine, rehearsal| {
        for tick in moving_ticks(machine, rehearsal) {
            for n in 0..machine.joints.len() {
                for pin in ["amp-fault-in,set=true", "enable,set=false"] {
                    let owner = if pin.starts_with("amp") { "joint" } else { "driver" };
                    let fault = format!("{tick},{owner}.{n}.{pin}");
                    let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
                    assert_eq!(outcome, Outcome::Off, "{}: {fault}", machine.name);
                    assert!(message.contains(&format!("joint.{n}.")), "{fault}: {message}");
                }
            }
        }
    });
}

#[test]
fn missed_and_doubled_periods_break_no_limit() {
    on_each_case(false, |machine, rehearsal| {
        let mut bridged = 0;
        for tick in (1..rehearsal.periods() - 10).step_by(7) {
            for periods in [1, 2, 3] {
                let fault = format!("{tick}+{periods},servo.missed,set=true");
                let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
                bridged += u64::from(outcome == Outcome::Equal);
                let accelerates = message.contains("asks for an acceleration");
                assert!(outcome == Outcome::Equal || accelerates, "{}: {fault}: {message}", machine.name);
            }
            let doubled = format!("{tick}+1,servo.doubled,set=true");
            let (outcome, _) = outcome(machine, rehearsal, &[&doubled]);
            // from rest there is nothing to brake
            let known = [Outcome::Equal, Outcome::BrakedAndOff, Outcome::Off];
            assert!(known.contains(&outcome), "{doubled}: {outcome}");
        }
        assert!(bridged > 20, "{}: {bridged} bridged", machine.name);
        for tick in moving_ticks(machine, rehearsal) {
            let fault = format!("{tick},servo.missed,set=true");
            let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
            assert_eq!(outcome, Outcome::BrakedAndOff, "{}: {fault}", machine.name);
            assert!(message.contains("no setpoint came for 4 servo periods"), "{message}");
        }
    });
}

#[test]
fn nonsense_on_a_pin_is_refused_with_pin_and_tick() {
    on_each_case(false, |machine, rehearsal| {
        for tick in moving_ticks(machine, rehearsal) {
            for n in 0..machine.joints.len() {
                for kind in ["nan", "inf", "offset=1000", "set=1e300"] {
                    let fault = format!("{tick},stepgen.{n}.position-cmd,{kind}");
                    let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
                    assert_eq!(outcome, Outcome::Off, "{}: {fault}", machine.name);
                    let told = message.contains(&format!("stepgen.{n} at tick {tick}"));
                    assert!(told, "{fault}: {message}");
                }
                // not a number at all, but as good as 0
                let fault = format!("{tick}+1,stepgen.{n}.velocity-cmd,set=5e-324");
                assert_eq!(outcome(machine, rehearsal, &[&fault]).0, Outcome::Equal, "{fault}");
            }
        }
    });
}

#[test]
fn a_home_switch_that_is_dead_or_stuck_is_named() {
    on_each_case(true, |machine, rehearsal| {
        for (n, joint) in machine.joints.iter().enumerate() {
            for level in ["false", "true"] {
                for pin in [format!("joint.{n}.home-sw-in,set={level}"), stuck(n, level)] {
                    let fault = format!("1,{pin}");
                    let (outcome, message) = outcome(machine, rehearsal, &[&fault]);
                    assert!(
                        [Outcome::AtRest, Outcome::BrakedAndOff].contains(&outcome),
                        "{}: {fault}: {outcome}: {message}",
                        machine.name
                    );
                    let named = message.contains(&format!("joint {n} ({})", joint.name));
                    let at_end = message.contains(&format!("joint.{n}."));
                    assert!(named || at_end, "{}: {fault}: {message}", machine.name);
                }
            }
        }
    });
}

fn stuck(n: usize, level: &str) -> String {
    let pin = if level == "true" { "stuck-on" } else { "stuck-off" };
    format!("home-switch.{n}.{pin},set=true")
}

#[test]
fn a_fault_that_cannot_be_is_refused() {
    on_each_case(false, |_, rehearsal| {
        for fault in ["5,joint.99.motor-pos-fb,nan", "5,motor.0.position,set=1", "5,nothing,nan"] {
            let error = rehearsal.play(&[fault.parse().unwrap()]).unwrap_err();
            assert_eq!(error.code, "fault-pin");
            assert!(error.message.contains(fault), "{}", error.message);
        }
        // beyond the end: nothing happens
        let played = play(rehearsal, &["1000000,motion.enable,set=false"]);
        assert_eq!(played.verdict, Ok(Outcome::Equal));
    });
}

/// The judge can convict: each change of a good run is found.
#[test]
fn the_judge_convicts() {
    on_each_case(false, |machine, rehearsal| {
        let good = rehearsal.rows();
        let tick = moving_ticks(machine, rehearsal)[0] as usize;
        let step = 1.0 / machine.joints[0].steps_per_unit;
        let ended = |change: &dyn Fn(&mut Vec<Row>), end: End<'_>| {
            let mut rows = good.to_vec();
            change(&mut rows);
            judge(machine, good, &rows, end).err().map(|objection| objection.what)
        };
        let objects = |what: &str, change: &dyn Fn(&mut Vec<Row>)| {
            let said = ended(change, End::Finished).unwrap_or_default();
            assert!(said.contains(what), "{}: expected '{what}', got '{said}'", machine.name);
        };
        assert_eq!(ended(&|_| {}, End::Finished), None);
        objects("is at [NaN", &|rows| rows[tick].commanded[0] = f64::NAN);
        objects("accelerates at", &|rows| rows[tick].commanded[0] += 0.5 * step);
        objects("steps from its command, and goes on", &|rows| rows[tick].counted[0] += 9.0 * step);
        objects("from its command, and goes on", &|rows| rows[tick].actual[0] += 9.0 * step);
        objects("finished with its drives off", &|rows| rows.last_mut().unwrap().on = false);
        objects("fault-free at", &|rows| rows.truncate(tick));
        objects("where it is reported", &|rows| rows.last_mut().unwrap().actual[0] += 9.0 * step);
        // a path of its own: all joints a little aside, for long, gently
        objects("off the path", &|rows| {
            let last = rows.len() as f64 - 1.0;
            for (i, row) in rows.iter_mut().enumerate() {
                let phase = i as f64 / last * std::f64::consts::TAU;
                let aside = 2.0 * step * (1.0 - pkm_kins::maths::cos(phase));
                for values in [&mut row.commanded, &mut row.counted, &mut row.actual] {
                    values[0] += aside;
                }
            }
        });
        // stops
        let cut = |rows: &mut Vec<Row>, more: usize| {
            rows.truncate(tick + more);
            let stands = *rows.last().unwrap();
            for n in 0..4 {
                rows.push(Row { on: false, tick: stands.tick + 1 + n, ..stands });
            }
        };
        let at = tick as u64;
        assert_eq!(ended(&|rows| cut(rows, 0), End::Stopped(at, "e-stop")), None);
        let silent = ended(&|rows| cut(rows, 0), End::Stopped(at, " "));
        assert_eq!(silent.as_deref(), Some("it stopped without saying why"));
        let late = ended(&|rows| cut(rows, 5), End::Stopped(at, "e-stop")).unwrap();
        assert!(late.contains("brake"), "{late}");
        let steps_on = |rows: &mut Vec<Row>| {
            cut(rows, 0);
            let n = rows.len() - 3;
            for row in &mut rows[n..] {
                row.counted[0] += step;
                row.commanded[0] += step;
            }
        };
        let said = ended(&steps_on, End::Stopped(at, "e-stop")).unwrap();
        assert!(said.contains("with its drive off"), "{said}");
        // The first period that moves is the last: an abort may end like that, a braking machine may not.
        let first = (1..good.len()).find(|&i| good[i].commanded != good[i - 1].commanded).unwrap();
        let first_tick = good[first].tick;
        let rests = |rows: &mut Vec<Row>, last: usize| {
            rows.truncate(last + 1);
            let stands = *rows.last().unwrap();
            for n in 1..5 {
                rows.push(Row { on: n < 3, tick: stands.tick + n, ..stands });
            }
        };
        let abort = End::AtRest(first_tick, "aborted");
        assert_eq!(ended(&|rows| rests(rows, first), abort), None);
        let brakes = ended(&|rows| rests(rows, first), End::Stopped(first_tick, "switch")).unwrap();
        assert!(brakes.contains("brake"), "{brakes}");
        let coasts = |rows: &mut Vec<Row>| {
            rows.truncate(first + 1);
            let (last, stood) = (rows[first], rows[first - 1]);
            let mut next = Row { tick: last.tick + 1, ..last };
            for j in 0..machine.joints.len() {
                let travel = last.commanded[j] - stood.commanded[j];
                for values in [&mut next.commanded, &mut next.counted, &mut next.actual] {
                    values[j] = last.commanded[j] + travel;
                }
            }
            rows.push(next);
            rests(rows, first + 1);
        };
        let moves = ended(&coasts, abort).unwrap();
        assert!(moves.contains("moves after it came to rest"), "{moves}");
        let aside = |rows: &mut Vec<Row>| {
            let joint = &machine.joints[0];
            let period_s = machine.servo_period_ns as f64 / 1e9;
            let change = joint.max_acceleration * period_s * period_s;
            let row = &mut rows[first];
            let wrong = if row.commanded[0] > good[first - 1].commanded[0] { -0.9 } else { 0.9 };
            for values in [&mut row.commanded, &mut row.counted, &mut row.actual] {
                values[0] = good[first - 1].commanded[0] + wrong * change;
            }
            rests(rows, first);
        };
        let aside = ended(&aside, abort).unwrap();
        assert!(aside.contains("off the path"), "{aside}");
        let moved = ended(&|_| {}, End::Refused("no")).unwrap();
        assert!(moved.contains("still moves"), "{moved}");
    });
}

/// Every test that `docs/hal.md` names exists, and every test here is named there.
#[test]
fn the_table_names_tests_that_exist() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let manual = std::fs::read_to_string(format!("{root}/docs/hal.md")).unwrap();
    let text = |file: &str| {
        ["run", "hal-sim"]
            .iter()
            .find_map(|package| std::fs::read_to_string(format!("{root}/crates/{package}/tests/{file}")).ok())
    };
    let mut named = Vec::new();
    for line in manual.lines().filter(|line| line.starts_with('|')) {
        let Some((file, test)) = line.rsplit('`').nth(1).and_then(|word| word.split_once("::")) else {
            continue;
        };
        let text = text(file).unwrap_or_else(|| panic!("no file {file}"));
        assert!(text.contains(&format!("#[test]\nfn {test}()")), "no test {test} in {file}");
        named.push(test.to_owned());
    }
    assert!(named.len() > 20, "{named:?}");
    for test in include_str!("fault_table.rs").split("#[test]\nfn ").skip(1) {
        let name = test.split('(').next().unwrap();
        let here = name == "the_table_names_tests_that_exist"
            || !name.chars().all(|c| c.is_alphanumeric() || c == '_');
        assert!(here || named.iter().any(|test| test == name), "{name} is not in docs/hal.md");
    }
}
