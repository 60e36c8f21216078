//! The page of a run: the same bytes every time, bounded, and nothing in it that a program could have made markup.
//! What it looks like and does is for the browser test, `.ci/judge-report`.

use pkm_kins::{Kinematics, Mechanism, Pose};
use pkm_machine::{Machine, shipped};
use pkm_report::Recorder;
use pkm_run::{Judged, Options, Program, Summary, check_with, run_checked};
use std::ops::ControlFlow;

fn page(machine: &Machine, text: &[u8]) -> (String, Summary) {
    let program = Program::Memory { name: "</title>.ngc".to_owned(), text: text.to_vec() };
    let options = Options::default();
    let mut recorder = Recorder::new(machine, machine.home);
    let checked = check_with(&program, machine, &options, |step| recorder.programmed(step)).unwrap();
    let judged = |_: &mut (), judged: &Judged| recorder.judged(judged);
    let go_on = |_: &_| ControlFlow::Continue(());
    let run = run_checked(&program, machine, &options, checked, |_| (), go_on, Some(judged));
    let summary = run.unwrap().0;
    let mut out = Vec::new();
    recorder.write(&summary, text, &mut out).unwrap();
    (String::from_utf8(out).unwrap(), summary)
}

/// The first period of a run.
fn first_period(machine: &Machine, text: &[u8]) -> Judged {
    let program = Program::Memory { name: "-".to_owned(), text: text.to_vec() };
    let options = Options::default();
    let checked = check_with(&program, machine, &options, |_| {}).unwrap();
    let mut first = None;
    let judged = |_: &mut (), judged: &Judged| {
        first.get_or_insert(*judged);
    };
    let go_on = |_: &_| ControlFlow::Continue(());
    run_checked(&program, machine, &options, checked, |_| (), go_on, Some(judged)).unwrap();
    first.unwrap()
}

/// The data of a page.
fn data(page: &str) -> serde_json::Value {
    let (_, rest) = page.split_once("id=\"data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn the_same_bytes_every_time() {
    let machine = Machine::load("ox-glide-o", &[]).unwrap();
    let text = b"G21 G91 F900\nG1 X3 Y2 Z5\nG1 X-6\nM451\nG1 Y-2\nM2\n";
    let (first, summary) = page(&machine, text);
    assert!(summary.completed, "{:?}", summary.diagnostics);
    assert_eq!(first, page(&machine, text).0);
    assert!(first.len() < 1 << 20, "{} bytes", first.len());
}

#[test]
fn a_program_cannot_become_markup() {
    let machine = Machine::load("moma-a", &[]).unwrap();
    let text = b"(</script><script>alert(1)</script><!--\nG1 X1 F100 (\"'& \xff\xfe \0 \xe2\x80\xa8)\nM2\n";
    let (page, summary) = page(&machine, text);
    assert!(!summary.completed);
    // Ours: two of data, one of scripts; and no comment or element from the program or its name.
    assert_eq!(page.matches("<script").count(), 3);
    assert_eq!(page.matches("</script").count(), 3);
    assert!(!page.contains("<!--") && !page.contains("</title>.ngc") && !page.contains('\0'));
    assert_eq!(data(&page)["findings"][0]["line"], 1);
    let (_, rest) = page.split_once("id=\"program-text\">").unwrap();
    let lines: Vec<String> = serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap();
    assert_eq!(lines[0], "(</script><script>alert(1)</script><!--");
    assert_eq!(lines[1], "G1 X1 F100 (\"'& \u{fffd}\u{fffd} \0 \u{2028})");
    assert_eq!(lines.len(), 3);
}

#[test]
fn a_refused_program_shows_where() {
    let machine = Machine::load("moma-a", &[]).unwrap();
    let (page, summary) = page(&machine, b"G1 X10 Y-260 F900\nG1 X160 Y-200\nM2\n");
    assert!(!summary.completed && page.contains("refused, nothing moved"));
    let data = data(&page);
    assert_eq!(data["timed"], false);
    assert_eq!(data["refused"][0]["line"], 2);
    // The machine is drawn up to the place, and further for as long as it has joints at all.
    assert!(data["rows"]["count"].as_u64().unwrap() > 10);
}

#[test]
fn every_shipped_machine_is_drawn_and_its_workspace_behind_it() {
    for (name, _) in shipped::SHIPPED {
        let machine = Machine::load(name, &[]).unwrap();
        let (page, _) = page(&machine, b"M2\n");
        let data = data(&page);
        let drawing = &data["drawing"];
        let parts = drawing["parts"].as_array().unwrap();
        let kinds = |kind: &str| parts.iter().filter(|part| part["kind"] == kind).count();
        assert_eq!(kinds("tip"), drawing["paths"].as_array().unwrap().len(), "{name}");
        assert!(kinds("rail") >= 1 && kinds("slider") >= 1 && kinds("link") >= 1, "{name}");
        let spaces = data["workspaces"].as_array().unwrap();
        assert_eq!(spaces.is_empty(), matches!(machine.mechanism, Mechanism::Cartesian(_)), "{name}");
        if matches!(machine.mechanism, Mechanism::Lambda6(_)) {
            // a loop in every plane of the scan, the home's height between the first and the last
            let loops = spaces[0]["loops"].as_array().unwrap();
            let height = |n: usize| loops[n][0][2].as_f64().unwrap();
            assert!(
                loops.len() > 5 && height(0) < machine.home.z && machine.home.z < height(loops.len() - 1)
            );
        }
    }
}

/// Three million servo periods that never repeat: neither memory nor the page may grow with them.
#[test]
fn a_long_run_stays_small() {
    let machine = Machine::load("moma-a", &[]).unwrap();
    let first = first_period(&machine, b"G1 X1 F900\nM2\n");
    let mut recorder = Recorder::new(&machine, machine.home);
    for tick in 1..=3_000_000_u64 {
        let (turn, wobble) = (tick as f64 * 1e-3, (tick % 977) as f64 * 1e-3);
        let (s, c) = pkm_kins::maths::sincos(turn);
        let pose = Pose { x: (20.0 + wobble) * c, y: -265.0 + 20.0 * s, ..Pose::ZERO };
        let mut judged = first;
        judged.tick = tick;
        judged.setpoint.pose = pose;
        judged.setpoint.joints = machine.mechanism.inverse(&pose).unwrap();
        judged.setpoint.span.line = (tick / 5) as u32;
        (judged.executed, judged.nearest) = (Some(pose), Some(pose));
        recorder.judged(&judged);
    }
    let (_, mut summary) = page(&machine, b"M2\n");
    summary.servo_ticks = 3_000_000;
    let mut out = Vec::new();
    recorder.write(&summary, &b"M2\n"[..], &mut out).unwrap();
    assert!(out.len() < 5 << 20, "{} bytes", out.len());
    let data = data(std::str::from_utf8(&out).unwrap());
    // What it promises is worth something: the circle is 40 mm wide.
    let error = data["error"].as_f64().unwrap();
    assert!(error < 40.0, "{error}");
}
