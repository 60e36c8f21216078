//! `pkm kins` against the published example vectors.

use crate::support::{pkm_with_input, write};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

const VECTORS: &str = include_str!("../crates/kins/tests/data/planar-examples.json");
/// mm, and relative for Jacobian entries.
const TOLERANCE: f64 = 1e-9;

fn vectors() -> Value {
    serde_json::from_str(VECTORS).unwrap()
}

fn array(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// Asks one question per line; the answers, and the exit status.
fn ask(what: &str, machine: &str, flags: &[&str], questions: &[Value]) -> (Vec<Value>, i32) {
    let input: String = questions.iter().map(|question| format!("{question}\n")).collect();
    let arguments = [&["kins", what, "--machine", machine], flags].concat();
    let run = pkm_with_input(&arguments, input.as_bytes());
    let answers = run.json_lines();
    assert_eq!(answers.len(), questions.len(), "{machine}: {}", run.stderr);
    (answers, run.status)
}

#[track_caller]
fn assert_near(found: &Value, expected: &Value, context: &str) {
    let (found, expected) = (number(found), number(expected));
    assert!(
        (found - expected).abs() <= TOLERANCE * expected.abs().max(1.0),
        "{context}: {found} is not {expected}"
    );
}

/// Asks for every good row t1 t2 p1 p2 k11 k12 k21 k22 det_k in all directions.
fn check_planar_rows(machine: &str, rows: &[Value]) {
    let poses: Vec<Value> = rows.iter().map(|row| json!({ "x": row[0], "y": row[1] })).collect();
    let joints: Vec<Value> = rows.iter().map(|row| json!({ "joints": [row[2], row[3]] })).collect();
    let (inverse, status) = ask("inverse", machine, &[], &poses);
    assert_eq!(status, 0, "{machine}: {inverse:?}");
    let (forward, status) = ask("forward", machine, &[], &joints);
    assert_eq!(status, 0, "{machine}: {forward:?}");
    let (jacobian, status) = ask("jacobian", machine, &[], &poses);
    assert_eq!(status, 0, "{machine}: {jacobian:?}");
    for (i, row) in rows.iter().enumerate() {
        let context = format!("{machine} row {i}");
        for j in 0..2 {
            assert_near(&inverse[i]["joints"][j], &row[2 + j], &context);
            assert_near(&forward[i]["pose"][["x", "y"][j]], &row[j], &context);
            for k in 0..2 {
                assert_near(&jacobian[i]["inverse_jacobian"][j][k], &row[4 + 2 * j + k], &context);
            }
        }
        assert_near(&jacobian[i]["determinant"], &row[8], &context);
    }
}

/// Each refused row must name one of the violations that hold.
fn check_refused(what: &str, machine: &str, questions: &[Value], violations: &[&Value]) {
    let (answers, status) = ask(what, machine, &[], questions);
    assert_eq!(status, 1, "{machine}");
    for ((answer, question), violations) in answers.iter().zip(questions).zip(violations) {
        let code = &answer["error"]["code"];
        assert!(array(violations).contains(code), "{machine} {question}: {code} is not among {violations}");
        assert!(!answer["error"]["message"].as_str().unwrap().is_empty());
    }
}

fn check_bad_rows(machine: &str, configuration: &Value) {
    for (what, key) in [("inverse", "ik_bad"), ("forward", "fk_bad")] {
        let Some(rows) = configuration[key].as_array() else { continue };
        let questions: Vec<Value> = rows
            .iter()
            .map(|row| match what {
                "inverse" => json!({ "x": row[0], "y": row[1] }),
                _ => json!({ "joints": [row[0], row[1]] }),
            })
            .collect();
        let violations: Vec<&Value> = rows.iter().map(|row| &row[2]).collect();
        check_refused(what, machine, &questions, &violations);
    }
}

#[test]
fn moma_configurations_match_the_vectors() {
    let vectors = vectors();
    for (name, configuration) in vectors["moma"]["configs"].as_object().unwrap() {
        let machine = format!("moma-{name}");
        check_planar_rows(&machine, array(&configuration["rows"]));
        check_bad_rows(&machine, configuration);
    }
}

#[test]
fn moma_4s_configurations_match_the_vectors() {
    let vectors = vectors();
    for (name, configuration) in vectors["moma_4s"]["configs"].as_object().unwrap() {
        let machine = name.to_lowercase().replace(' ', "-");
        check_planar_rows(&machine, array(&configuration["rows"]));
        check_bad_rows(&machine, configuration);
    }
}

/// moma-a with other geometry and wide home checks: a machine file of a general planar mechanism.
fn planar_machine(folder: &Path, parameters: &Value, home: [f64; 2]) -> String {
    let text = format!(
        "name = \"general\"\n[servo]\nperiod_ns = 1000000\n[driver]\nmodel = \"TMC2209\"\n[kinematics]\n\
         type = \"planar\"\nreference_mm = {}\nguide_angle_deg = {}\nl_mm = {}\noffset_mm = {}\n\
         working_mode = {}\nassembly = {}\n{}{}[home]\nx = {}\ny = {}\n",
        parameters["R"],
        parameters["alpha_deg"],
        parameters["l"],
        parameters["off"],
        parameters["sigma"],
        parameters["side"],
        joint("p1", &parameters["stroke"][0]),
        joint("p2", &parameters["stroke"][1]),
        home[0],
        home[1]
    );
    let path = folder.join("general.toml");
    write(&path, text);
    path.to_str().unwrap().to_owned()
}

fn joint(name: &str, stroke: &Value) -> String {
    format!(
        "[[joint]]\nname = \"{name}\"\nmin_mm = {}\nmax_mm = {}\nmax_velocity_mm_s = 100\n\
         max_acceleration_mm_s2 = 1000\nsteps_per_mm = 400\n",
        stroke[0], stroke[1]
    )
}

#[test]
fn general_planar_mechanisms_match_the_vectors() {
    let vectors = vectors();
    let folder = tempfile::tempdir().unwrap();
    for mechanism in array(&vectors["planar_general"]["mechanisms"]) {
        let rows = array(&mechanism["rows"]);
        // Any regular row may be the home pose.
        let home =
            rows.iter().max_by(|a, b| number(&a[8]).abs().min(1.0).total_cmp(&number(&b[8]).abs().min(1.0)));
        let home = home.unwrap();
        let machine =
            planar_machine(folder.path(), &mechanism["params"], [number(&home[0]), number(&home[1])]);
        check_planar_rows(&machine, rows);
    }
}

#[test]
fn moma_w_matches_the_vectors() {
    let vectors = vectors();
    let rows = array(&vectors["moma_w"]["rows"]);
    let pose = |row: &Value| json!({ "x": row[0], "y": row[1], "u": row[2], "v": row[3], "z": row[4] });
    let poses: Vec<Value> = rows.iter().map(pose).collect();
    let joints: Vec<Value> =
        rows.iter().map(|row| json!({ "joints": [row[9], row[10], row[11], row[12], row[4]] })).collect();
    let (inverse, _) = ask("inverse", "moma-w", &[], &poses);
    let (forward, _) = ask("forward", "moma-w", &[], &joints);
    let (jacobian, _) = ask("jacobian", "moma-w", &[], &poses);
    for (i, row) in rows.iter().enumerate() {
        let context = format!("moma-w row {i}");
        for j in 0..4 {
            assert_near(&inverse[i]["joints"][j], &row[9 + j], &context);
        }
        for (column, letter) in ["x", "y", "u", "v", "z"].into_iter().enumerate() {
            assert_near(&forward[i]["pose"][letter], &row[column], &context);
        }
        // The table's row and column leave the determinant of the wire's four joints, but for the order x y z u v:
        // two columns change places, which keeps the sign.
        assert_near(&jacobian[i]["determinant"], &row[14], &context);
    }
    let bad = array(&vectors["moma_w"]["bad"]);
    let questions: Vec<Value> = bad.iter().map(pose).collect();
    check_refused("inverse", "moma-w", &questions, &bad.iter().map(|row| &row[5]).collect::<Vec<_>>());
}

#[test]
fn hv_mill_matches_the_vectors() {
    let vectors = vectors();
    for (mode, data) in vectors["hv_mill"]["modes"].as_object().unwrap() {
        let name = mode.split('_').next().unwrap().to_lowercase();
        let machine = format!("hv-mill-{name}");
        let vertical = name.starts_with('v');
        let flags: &[&str] = match data.get("override") {
            None => &[],
            Some(_) => &["--set", "kinematics.table_sense=-1", "--set", "kinematics.head.head_sense=-1"],
        };
        let pose = |row: &Value| match vertical {
            true => json!({ "x": row[0], "y": row[1], "z": row[2], "c": row[3], "b": row[4] }),
            false => json!({ "x": row[0], "y": row[1], "z": row[2], "b": row[3] }),
        };
        let rows = array(&data["rows"]);
        let poses: Vec<Value> = rows.iter().map(pose).collect();
        let joints: Vec<Value> = rows
            .iter()
            .map(|row| match vertical {
                true => json!({ "joints": [row[5], row[6], row[7], row[3], row[4]] }),
                false => json!({ "joints": [row[5], row[6], row[7], row[3]] }),
            })
            .collect();
        let (inverse, status) = ask("inverse", &machine, flags, &poses);
        assert_eq!(status, 0, "{machine}: {inverse:?}");
        let (forward, status) = ask("forward", &machine, flags, &joints);
        assert_eq!(status, 0, "{machine}: {forward:?}");
        for (i, row) in rows.iter().enumerate() {
            let context = format!("{mode} row {i}");
            for j in 0..3 {
                assert_near(&inverse[i]["joints"][j], &row[5 + j], &context);
                assert_near(&forward[i]["pose"][["x", "y", "z"][j]], &row[j], &context);
            }
            // Rotary joints and axes are degrees on both sides.
            let rotary = if vertical { &["c", "b"][..] } else { &["b"] };
            for (j, letter) in rotary.iter().enumerate() {
                assert_near(&inverse[i]["joints"][3 + j], &row[3 + j], &context);
                assert_near(&forward[i]["pose"][letter], &row[3 + j], &context);
            }
        }
        // Columns of the machine in letter order X Y Z B (C); of the vectors w1 w2 w3 table head.
        let columns: &[usize] = if vertical { &[0, 1, 2, 4, 3] } else { &[0, 1, 2, 3] };
        let jacobians = array(&data["jac_of_first_rows"]);
        let (answers, _) = ask("jacobian", &machine, flags, &poses[..jacobians.len()]);
        for (answer, expected) in answers.iter().zip(jacobians) {
            for row in 0..3 {
                for (column, &theirs) in columns.iter().enumerate() {
                    // In the three-axis mode the rotary axes are locked: their columns are 0 here.
                    if mode.ends_with('3') && theirs > 2 {
                        continue;
                    }
                    assert_near(&answer["inverse_jacobian"][row][column], &expected[row][theirs], mode);
                }
            }
        }
        if let Some(bad) = data["bad"].as_array() {
            let questions: Vec<Value> = bad.iter().map(pose).collect();
            check_refused(
                "inverse",
                &machine,
                &questions,
                &bad.iter().map(|row| &row[5]).collect::<Vec<_>>(),
            );
        }
    }
}

#[test]
fn ox_glide_matches_the_vectors() {
    let vectors = vectors();
    for (form, data) in vectors["ox_glide"]["forms"].as_object().unwrap() {
        let machine = format!("ox-glide-{}", form.to_lowercase());
        let rows = array(&data["rows"]);
        let pose = |row: &Value| json!({ "x": row[0], "y": row[1], "z": row[2] });
        let (inverse, status) = ask("inverse", &machine, &[], &rows.iter().map(pose).collect::<Vec<_>>());
        assert_eq!(status, 0, "{inverse:?}");
        let joints: Vec<Value> =
            rows.iter().map(|row| json!({ "joints": [row[3], row[4], row[5]] })).collect();
        let (forward, _) = ask("forward", &machine, &[], &joints);
        let (jacobian, _) = ask("jacobian", &machine, &[], &rows.iter().map(pose).collect::<Vec<_>>());
        for (i, row) in rows.iter().enumerate() {
            let context = format!("{form} row {i}");
            for j in 0..3 {
                assert_near(&inverse[i]["joints"][j], &row[3 + j], &context);
                assert_near(&forward[i]["pose"][["x", "y", "z"][j]], &row[j], &context);
            }
            assert_near(&jacobian[i]["inverse_jacobian"][0][1], &row[6], &context);
            assert_near(&jacobian[i]["inverse_jacobian"][1][1], &row[7], &context);
            assert_near(&jacobian[i]["determinant"], &row[8], &context);
        }
        for (what, key) in [("inverse", "ik_bad"), ("forward", "fk_bad")] {
            let bad = array(&data[key]);
            let last = bad[0].as_array().unwrap().len() - 1;
            let questions: Vec<Value> = bad
                .iter()
                .map(|row| match what {
                    "inverse" => pose(row),
                    _ => json!({ "joints": [row[0], row[1], if last > 2 { row[2].clone() } else { json!(100) }] }),
                })
                .collect();
            check_refused(what, &machine, &questions, &bad.iter().map(|row| &row[last]).collect::<Vec<_>>());
        }
    }
}

/// A pose of the Lambda vectors (mm, rad) as the command line takes it (degrees).
fn lambda_pose(pose: &Value) -> Value {
    let degrees = |i: usize| number(&pose[i]).to_degrees();
    json!({ "x": pose[0], "y": pose[1], "z": pose[2], "a": degrees(3), "b": degrees(4), "c": degrees(5) })
}

#[test]
fn lambda_matches_the_vectors() {
    let vectors: Value =
        serde_json::from_str(include_str!("../crates/kins/tests/data/lambda-examples.json")).unwrap();
    let machine = |set: &str| match set {
        "yaw45" => Some("lambda6"),
        "paper" => Some("lambda6-paper"),
        _ => None, // sets that do not ship are tested in pkm-kins
    };
    let mut seen = 0;
    for row in array(&vectors["poses"]) {
        let Some(machine) = machine(row["set"].as_str().unwrap()) else { continue };
        let context = row["id"].as_str().unwrap();
        let pose = lambda_pose(&row["pose"]);
        let (inverse, _) = ask("inverse", machine, &["--no-limits"], std::slice::from_ref(&pose));
        for j in 0..6 {
            assert_near(&inverse[0]["joints"][j], &row["joints"][j], context);
        }
        let violations = array(&row["violations"]);
        let (limited, status) = ask("inverse", machine, &[], std::slice::from_ref(&pose));
        assert_eq!(status, i32::from(!violations.is_empty()), "{context}: {limited:?}");
        assert!(
            violations.is_empty() || violations.contains(&limited[0]["error"]["code"]),
            "{context}: {limited:?}"
        );
        let (jacobian, _) = ask("jacobian", machine, &["--no-limits"], std::slice::from_ref(&pose));
        let relative = |key: &str, theirs: &str| {
            let (found, expected) = (number(&jacobian[0][key]), number(&row[theirs]));
            assert!(
                (found - expected).abs() <= 1e-8 * expected.abs(),
                "{context} {key}: {found} is not {expected}"
            );
        };
        relative("determinant", "det_pose_mm3");
        relative("condition", "cond");
        if number(&row["sigma"]).abs() > 0.1 {
            let question = json!({ "joints": row["joints"], "seed": pose });
            let (forward, status) = ask("forward", machine, &["--no-limits"], &[question]);
            assert_eq!(status, 0, "{context}: {forward:?}");
            for letter in ["x", "y", "z", "a", "b", "c"] {
                let (found, expected) = (number(&forward[0]["pose"][letter]), number(&pose[letter]));
                assert!((found - expected).abs() < 1e-6, "{context} {letter}: {found} is not {expected}");
            }
        }
        seen += 1;
    }
    assert!(seen >= 8, "{seen} rows");
    for row in array(&vectors["fk_from_joints"]) {
        let Some(machine) = machine(row["set"].as_str().unwrap()) else { continue };
        let question = json!({ "joints": row["joints"], "branches": true });
        let (answers, _) = ask("forward", machine, &["--no-limits"], &[question]);
        assert_eq!(array(&answers[0]["branches"]).len(), array(&row["all_poses"]).len(), "{}", row["id"]);
    }
    for row in array(&vectors["fk_invalid"]) {
        let Some(machine) = machine(row["set"].as_str().unwrap()) else { continue };
        let (answers, status) =
            ask("forward", machine, &["--no-limits"], &[json!({ "joints": row["joints"] })]);
        assert_eq!((&answers[0]["error"]["code"], status), (&row["error"], 1), "{}", row["id"]);
    }
}

#[test]
fn no_limits_asks_for_geometry_alone() {
    let question = [json!({ "joints": [-10, -10] })];
    let (answers, status) = ask("forward", "moma-a", &[], &question);
    assert_eq!((&answers[0]["error"]["code"], status), (&json!("limit_low:1"), 1));
    assert_eq!(answers[0]["error"]["joint"], "p1");
    let (answers, status) = ask("forward", "moma-a", &["--no-limits"], &question);
    assert_eq!(status, 0);
    let (back, status) = ask("inverse", "moma-a", &["--no-limits"], &[answers[0]["pose"].clone()]);
    assert_eq!(status, 0);
    assert_near(&back[0]["joints"][0], &json!(-10), "joint 1");
}

#[test]
fn branches_lists_every_mode() {
    let (answers, status) = ask("inverse", "moma-d", &[], &[json!({ "x": 75, "y": 117, "branches": true })]);
    assert_eq!(status, 0);
    let branches = array(&answers[0]["branches"]);
    assert_eq!(branches.len(), 4);
    assert_eq!(branches.iter().filter(|branch| branch["error"].is_null()).count(), 1, "{branches:?}");
    assert_eq!(branches.iter().filter(|branch| branch["joints"] == json!([114.0, 180.0])).count(), 1);
    let (answers, _) = ask("forward", "moma-d", &[], &[json!({ "joints": [114, 180], "branches": true })]);
    let branches = array(&answers[0]["branches"]);
    assert_eq!(branches.len(), 2);
    assert!(branches.iter().any(|branch| (number(&branch["pose"]["x"]) - 75.0).abs() < 1e-9), "{branches:?}");
}

#[test]
fn refused_lines_keep_their_place() {
    let lines = "{\"x\":0,\"y\":-265}\nnot json\n{\"x\":1e999}\n{\"q\":1}\n{\"z\":1}\n{\"x\":0,\"y\":-266}\n[1]\n\"\u{fffd}\"";
    let run = pkm_with_input(&["kins", "inverse", "--machine", "moma-a"], lines.as_bytes());
    let answers = run.json_lines();
    assert_eq!(run.status, 1);
    assert_eq!(answers.len(), 8);
    for (index, answer) in answers.iter().enumerate() {
        assert_eq!(answer["error"].is_null(), matches!(index, 0 | 5), "{index}: {answer}");
    }
    let (answers, status) = ask(
        "forward",
        "moma-a",
        &[],
        &[json!({ "joints": [1, 2, 3] }), json!({ "joints": [100, 100], "seed": {} })],
    );
    assert_eq!((answers[0]["error"]["code"].as_str(), status), (Some("bad_input"), 1));
    assert_eq!(answers[0]["error"]["message"], "joints: 3 given, the machine has 2");
    assert!(answers[1]["pose"]["y"].is_number() && answers[1]["pose"]["z"].is_null());
}

#[test]
fn each_answer_comes_before_the_next_question() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_pkm"))
        .args(["kins", "inverse", "--machine", "moma-a"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut questions = child.stdin.take().unwrap();
    let mut answers = BufReader::new(child.stdout.take().unwrap()).lines();
    for x in 0..3 {
        writeln!(questions, "{{\"x\":{x},\"y\":-265}}").unwrap();
        let answer: Value = serde_json::from_str(&answers.next().unwrap().unwrap()).unwrap();
        assert!(answer["joints"][0].is_number(), "{answer}");
    }
    drop(questions);
    assert!(answers.next().is_none());
    assert!(child.wait().unwrap().success());
}
