//! `pkm run` and `pkm check`: the shipped programs, and every bad input that must end in a diagnostic.

use crate::support::{Run, pkm, pkm_with_input, write};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn shipped(program: &str) -> String {
    format!("{}/../../programs/{program}", env!("CARGO_MANIFEST_DIR"))
}

impl Run {
    /// Standard output as one JSON object of schema 1.
    #[track_caller]
    fn json(&self) -> Value {
        let [value] = &self.json_lines()[..] else {
            panic!("not one line: {:?}\n{}", self.stdout, self.stderr)
        };
        assert_eq!(value["schema"], 1);
        value.clone()
    }
}

/// File names of a folder.
fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort_unstable();
    names
}

#[test]
fn the_aerofoil_runs_on_moma_w_within_every_limit() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/out");
    let program = shipped("moma-w-aerofoil.ngc");
    let arguments =
        ["run", &program, "--machine", "moma-w", "--format", "json", "--out", out.to_str().unwrap()];
    let run = pkm(&arguments);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let summary = run.json();
    assert_eq!(summary["completed"], true);
    assert_eq!(summary["program"], program.as_str());
    assert_eq!(summary["machine"], "moma-w");
    assert!(summary["max_step_error_steps"].as_f64().unwrap() <= 0.5);
    assert_eq!(summary["driver_timing_violations"], 0);
    assert_eq!(summary["diagnostics"], serde_json::json!([]));
    let joints = summary["joints"].as_array().unwrap();
    assert_eq!(joints.len(), 5);
    for joint in joints {
        for (peak, limit) in
            [("peak_velocity", "velocity_limit"), ("peak_acceleration", "acceleration_limit")]
        {
            assert!(joint[peak].as_f64().unwrap() <= joint[limit].as_f64().unwrap(), "{joint}");
        }
    }
    for key in [
        "blocks",
        "duration_s",
        "path_length_mm",
        "servo_ticks",
        "max_path_deviation_mm",
        "min_singularity_distance",
    ] {
        assert!(summary[key].as_f64().unwrap() > 0.0, "{key}");
    }
    assert!(summary["closest_approach"]["line"].as_u64().unwrap() > 0);
    assert!(summary["closest_approach"]["joint"].as_str().unwrap().starts_with('p'));

    assert_eq!(listing(&out), ["report.html", "steps.vcd", "summary.json", "trace.csv"]);
    let kept: Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(kept, summary);
    let trace = std::fs::read_to_string(out.join("trace.csv")).unwrap();
    let header = trace.lines().next().unwrap();
    assert!(header.starts_with("tick,time_s,line,axis.x.pos-cmd_mm,"), "{header}");
    assert!(header.contains(",joint.0.pos-cmd_mm,joint.0.pos-fb_mm,joint.1."), "{header}");
    assert_eq!(trace.lines().count() as u64, summary["servo_ticks"].as_u64().unwrap() + 2);
    let steps = std::fs::read_to_string(out.join("steps.vcd")).unwrap();
    assert!(steps.contains("joint0_step") && steps.contains("joint4_dir"));

    // The same again: the same bytes (promise P8).
    assert_eq!(pkm(&arguments).stdout, run.stdout);
    assert_eq!(std::fs::read_to_string(out.join("trace.csv")).unwrap(), trace);
    assert_eq!(std::fs::read_to_string(out.join("steps.vcd")).unwrap(), steps);
}

#[test]
fn check_accepts_the_shipped_programs() {
    for (program, machine) in [
        ("moma-w-aerofoil.ngc", "moma-w"),
        ("moma-w-moulding.ngc", "moma-w"),
        ("moma-arcs.ngc", "moma-a"),
        ("hv-mill-both.ngc", "hv-mill-7"),
    ] {
        let check = pkm(&["check", &shipped(program), "--machine", machine, "--format", "json"]);
        assert_eq!(check.status, 0, "{program}: {}{}", check.stdout, check.stderr);
        let answer = check.json();
        assert_eq!((&answer["ok"], answer["diagnostics"].as_array().unwrap().len()), (&Value::from(true), 0));
    }
}

#[test]
fn text_is_for_people() {
    let run = pkm(&["run", &shipped("moma-arcs.ngc"), "--machine", "moma-a"]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert!(
        run.stdout.contains("moma-arcs.ngc on moma-a: completed") && run.stdout.contains("p2"),
        "{}",
        run.stdout
    );
    assert!(run.stderr.is_empty(), "{}", run.stderr); // no progress where there is no terminal
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let run = pkm(&["run", &shipped("moma-arcs.ngc"), "--machine", "moma-a", "--no-trace", "--out", out]);
    let files = format!("  in {out}: steps.vcd, summary.json, report.html\n");
    assert!(run.stdout.ends_with(&files), "{}", run.stdout);
}

#[test]
fn a_program_may_come_through_a_pipe() {
    let program = b"G21 G90 F600\nG1 X5 Y-260\nM2\n";
    let run = pkm_with_input(&["run", "-", "--machine", "moma-a", "--format", "json"], program);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert_eq!(run.json()["program"], "-");
    let check = pkm_with_input(&["check", "/dev/stdin", "--machine", "moma-a"], program);
    assert_eq!(check.status, 0, "{}", check.stderr);
}

#[test]
fn start_and_overrides_are_honoured() {
    let program = b"G21 G90 F600\nG1 X5 Y-260\nM2\n";
    let run = |more: &[&str]| {
        let arguments = [&["run", "-", "--machine", "moma-a", "--format", "json"], more].concat();
        pkm_with_input(&arguments, program)
    };
    let length = |run: &Run| run.json()["path_length_mm"].as_f64().unwrap();
    assert!((length(&run(&["--start", "X5 Y-250"])) - 10.0).abs() < 1e-9);
    assert!((length(&run(&["--start", "y=-259,x5"])) - 1.0).abs() < 1e-9);
    let slow = run(&["--set", "joint.*.max_velocity_mm_s=5"]).json();
    assert_eq!(slow["joints"][1]["velocity_limit"], 5.0);
    assert!(slow["joints"][1]["peak_velocity"].as_f64().unwrap() <= 5.0);
    let half = run(&["--feed-override", "50"]).json();
    assert!(half["duration_s"].as_f64().unwrap() > 1.8 * run(&[]).json()["duration_s"].as_f64().unwrap());
    for bad in [
        &["--start", "Z5"][..],
        &["--start", "X"],
        &["--start", "X1 X2"],
        &["--start", "Xnan"],
        &["--start", "é"],
        &["--set", "joint.9.min_mm=0"],
        &["--feed-override", "0"],
        &["--feed-override", "nan"],
        &["--trace-substeps", "0"],
        &["--max-ticks", "-1"],
    ] {
        let refused = run(bad);
        assert_eq!(refused.status, 2, "{bad:?}: {}", refused.stdout);
    }
    let ended = run(&["--max-ticks", "100"]);
    assert_eq!((ended.status, &ended.json()["completed"]), (1, &Value::from(false)));
    assert_eq!(ended.json()["diagnostics"][0]["code"], "max-ticks");
}

/// A bad program, and where and how it must be refused: exit status, code, line, column.
struct Bad {
    name: &'static str,
    text: &'static [u8],
    status: i32,
    code: &'static str,
    line: u64,
    column: u64,
}

const BAD: &[Bad] = &[
    Bad {
        name: "out of reach in the middle of an arc",
        // Both ends can be reached, the bulge to the right between them cannot.
        text: b"G21 G90 F600\nG1 X40 Y-225\nG2 X40 Y-305 I0 J-40\nM2\n",
        status: 1,
        code: "limit_high:1",
        line: 3,
        column: 1,
    },
    Bad { name: "unknown code", text: b"G21\nG77\nM2\n", status: 1, code: "g-unknown", line: 2, column: 1 },
    Bad {
        name: "unclosed bracket",
        text: b"F100\nG1 Y-265 X[1+2\nM2\n",
        status: 1,
        code: "expr-unclosed",
        line: 2,
        column: 11,
    },
    Bad { name: "empty file", text: b"", status: 1, code: "file-empty", line: 0, column: 0 },
    Bad { name: "no feed", text: b"G21\nG1 X1\nM2\n", status: 1, code: "", line: 2, column: 0 },
    Bad {
        name: "binary",
        text: b"\x7fELF\x02\x01\x01\0\0\0\0\0\xff\xfe\n\0\0",
        status: 1,
        code: "",
        line: 1,
        column: 0,
    },
    Bad {
        name: "an axis the machine lacks",
        text: b"F100\nG1 Z5\nM2\n",
        status: 1,
        code: "",
        line: 2,
        column: 0,
    },
    Bad { name: "beyond the travel", text: b"G0 X0 Y-360\nM2\n", status: 1, code: "", line: 1, column: 1 },
];

#[test]
fn bad_programs_are_refused_at_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.ngc");
    let file = path.to_str().unwrap();
    for bad in BAD {
        write(&path, bad.text);
        for command in ["check", "run"] {
            let run = pkm(&[command, file, "--machine", "moma-a", "--format", "json"]);
            let context = format!("{} ({command}): {}", bad.name, run.stdout);
            assert_eq!(run.status, bad.status, "{context}");
            let answer = run.json();
            let finding = &answer["diagnostics"][0];
            assert_eq!(finding["severity"], "error", "{context}");
            assert_eq!(finding["file"], file, "{context}");
            assert_eq!(finding["line"], bad.line, "{context}");
            assert!(bad.code.is_empty() || finding["code"] == bad.code, "{context}");
            assert!(bad.column == 0 || finding["column"] == bad.column, "{context}");
            for key in ["code", "message", "help"] {
                assert!(!finding[key].as_str().unwrap_or("").is_empty(), "{key}: {context}");
            }
            let text = pkm(&[command, file, "--machine", "moma-a"]);
            assert_eq!(text.status, bad.status, "{context}");
            assert!(text.stderr.contains("bad.ngc") && text.stderr.contains("help"), "{}", text.stderr);
        }
    }
}

#[test]
fn check_needs_no_machine() {
    let text = b"#<size> = 5\no1 if [0]\n G99.5\no1 endif\nG0 X#<sise>\nM2\n";
    let run = pkm_with_input(&["check", "-", "--format", "json"], text);
    assert_eq!(run.status, 1);
    let answer = run.json();
    assert!(answer["machine"].is_null());
    let found = answer["diagnostics"].as_array().unwrap();
    let codes: Vec<_> =
        found.iter().map(|d| (d["code"].as_str().unwrap(), d["line"].as_u64().unwrap())).collect();
    assert_eq!(codes, [("g-unknown", 3), ("param-undefined", 5)]);
    assert!(found[1]["help"].as_str().unwrap().contains("did you mean #<size>"), "{}", found[1]);
    assert_eq!(pkm(&["check", &shipped("moma-arcs.ngc")]).status, 0);
    assert_eq!(pkm(&["run", &shipped("moma-arcs.ngc")]).status, 2);
}

#[test]
fn a_run_may_begin_at_a_line_and_an_endless_one_ends() {
    let text = b"F500\nG1 X10\nG1 Y5\nG1 X3\nM2\n";
    let run =
        pkm_with_input(&["run", "-", "--machine", "xyz", "--start-line", "4", "--format", "json"], text);
    let answer = run.json();
    assert_eq!((run.status, &answer["completed"]), (0, &true.into()));
    assert_eq!(
        (answer["joints"][0]["max"].as_f64(), answer["joints"][1]["max"].as_f64()),
        (Some(3.0), Some(0.0))
    );
    assert_eq!(answer["diagnostics"][0]["code"], "start-line");
    let endless = b"G0 X1\n#1=1\no1 while [#1 gt 0]\n G0 X#1\no1 endwhile\nM2\n";
    let run = pkm_with_input(&["check", "-", "--max-blocks", "100", "--format", "json"], endless);
    let answer = run.json();
    let found = &answer["diagnostics"][0];
    assert_eq!((run.status, found["line"].as_u64()), (1, Some(3)), "{found}");
}

#[test]
fn a_start_outside_the_workspace_is_refused() {
    let program = shipped("moma-arcs.ngc");
    let run = pkm(&["run", &program, "--machine", "moma-a", "--start", "X300 Y0", "--format", "json"]);
    assert_eq!(run.status, 1);
    let finding = &run.json()["diagnostics"][0];
    assert_eq!(finding["code"], "unreachable:1");
    assert!(finding["message"].as_str().unwrap().contains("X300"), "{finding}");
}

#[test]
fn questions_that_cannot_be_asked_end_with_status_2() {
    let program = shipped("moma-arcs.ngc");
    for command in ["check", "run"] {
        for (arguments, code) in [
            (["no-such-program.ngc", "--machine", "moma-a"], "file-open"),
            (["/", "--machine", "moma-a"], "file-open"),
            ([&program, "--machine", "no-such-machine"], "machine-unreadable"),
            ([&program, "--machine", &program], "machine-syntax"),
        ] {
            let run = pkm(&[&[command][..], &arguments, &["--format", "json"]].concat());
            assert_eq!(run.status, 2, "{arguments:?}");
            assert_eq!(run.json()["diagnostics"][0]["code"], code, "{arguments:?}");
        }
    }
}

#[test]
fn refused_programs_leave_old_files_alone() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["steps.vcd", "trace.csv", "summary.json"] {
        write(&folder.path().join(name), "old");
    }
    let out = folder.path().to_str().unwrap();
    let run = pkm_with_input(&["run", "-", "--machine", "moma-a", "--out", out], b"G0 X300\nM2\n");
    assert_eq!(run.status, 1);
    assert_eq!(listing(folder.path()), ["report.html", "steps.vcd", "summary.json", "trace.csv"]);
    for name in ["steps.vcd", "trace.csv", "summary.json"] {
        assert_eq!(std::fs::read_to_string(folder.path().join(name)).unwrap(), "old");
    }
    // Only the report tells what was refused, and where.
    let report = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(report.contains("refused, nothing moved") && report.contains("line 1: at X72.500"), "{report}");
}

/// Runs a shell command line; `$0` is pkm, `$1` the folder, `$2` a program.
fn shell(script: &str, folder: &Path) -> (Option<i32>, String) {
    let output = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_pkm")])
        .arg(folder)
        .arg(shipped("moma-arcs.ngc"))
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn a_full_disk_leaves_old_files_alone() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["steps.vcd", "trace.csv"] {
        write(&folder.path().join(name), "old");
    }
    // A limit on file size stands for the full disk: writing fails in the middle.
    let script = "trap '' XFSZ; ulimit -f 1000; exec \"$0\" run \"$2\" --machine moma-a --out \"$1\"";
    let (status, stderr) = shell(script, folder.path());
    assert_eq!(status, Some(2), "{stderr}");
    assert!(stderr.contains("cannot write") && stderr.contains("help"), "{stderr}");
    assert_eq!(listing(folder.path()), ["steps.vcd", "trace.csv"]);
    for name in listing(folder.path()) {
        assert_eq!(std::fs::read_to_string(folder.path().join(name)).unwrap(), "old");
    }
    // An output folder that cannot be made.
    write(&folder.path().join("file"), "old");
    let (status, stderr) =
        shell("exec \"$0\" run \"$2\" --machine moma-a --out \"$1/file/out\"", folder.path());
    assert_eq!(status, Some(2), "{stderr}");
    assert!(stderr.contains("cannot write"), "{stderr}");
}

/// Which of the two kinds of singularity, and which way a joint would have to go.
#[test]
fn refusals_say_what_is_wrong_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.ngc");
    let told = |text: &str, machine: &str| {
        write(&path, text);
        let run = pkm(&["check", path.to_str().unwrap(), "--machine", machine]);
        (run.status, run.stderr)
    };
    let (status, message) = told("G21 F600\nG1 X137 Y137\nG1 X137.88 Y137.88\nM2\n", "moma-d");
    assert_eq!(status, 1, "{message}");
    assert!(message.contains("(type 2, between the links): measure 8.44e-5, guard 0.001"), "{message}");
    assert!(
        message.contains("moves the tool far") && message.contains("warning[near-singular]"),
        "{message}"
    );
    let (status, message) = told("G21 F600\nG1 X78.7 Y-194\nM2\n", "moma-a");
    assert_eq!(status, 0, "{message}");
    assert!(message.contains("(type 1, at joint p1)") && message.contains("go fast"), "{message}");
    let (status, message) = told("G21 F600\nG1 X0 Y-100\nM2\n", "moma-a");
    assert_eq!(status, 1, "{message}");
    assert!(message.contains("p1 comes 71.2334 mm higher"), "{message}");
    let (_, message) = told("G20 F60\nG1 X0 Y-265\nM2\n", "moma-a");
    assert!(message.contains("lengths are in inches here (G20)"), "{message}");
    let (_, message) = told("G21 F600\nG1 X0 Y-400\nM2\n", "moma-a");
    assert!(!message.contains("inches"), "{message}");
    assert!(message.contains("mm lower, or choose"), "{message}");
}

/// A part that lies wrong on the machine fails in every block; a person reads three of them and where the others are.
#[test]
fn many_findings_of_one_kind_are_folded_for_people_only() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.ngc");
    let out_of_reach = |moves: usize| {
        let blocks: String = (0..moves).map(|k| format!("G1 X{k} Y-600\n")).collect();
        write(&path, format!("G21 F600\n{blocks}M2\n"));
        let text = pkm(&["check", path.to_str().unwrap(), "--machine", "moma-a"]);
        let json = pkm(&["check", path.to_str().unwrap(), "--machine", "moma-a", "--format", "json"]);
        let findings = json.json()["diagnostics"].as_array().unwrap().len();
        (text.stdout.clone(), text.stderr.matches("help").count(), findings, text.stderr)
    };
    let (summary, told, findings, text) = out_of_reach(100);
    assert!(summary.contains("100 errors") && findings == 100, "{summary}");
    assert!(told < 20 && text.contains(" more, in lines "), "{text}");
    let (_, told, findings, text) = out_of_reach(6);
    assert_eq!((told, findings), (6, 6), "{text}");
}

/// Sends Ctrl-C and waits for the clean end.
fn interrupted(child: std::process::Child) -> std::process::Output {
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    output
}

#[test]
fn interrupted_canon_leaves_no_file_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("endless.ngc");
    write(&path, "o1 while [1]\nG0 X1\nG0 X0\no1 endwhile\nM2\n");
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_pkm"))
        .args(["canon", path.to_str().unwrap(), "--max-blocks", "0", "-o"])
        .arg(out.join("part.canon"))
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    while !std::fs::read_dir(&out).unwrap().any(|file| file.unwrap().metadata().unwrap().len() > 10_000) {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was interrupted");
        std::thread::yield_now();
    }
    let output = interrupted(child);
    assert!(String::from_utf8(output.stderr).unwrap().contains("interrupted"));
    assert!(listing(&out).is_empty(), "{:?}", listing(&out));
}

#[test]
fn an_interrupted_run_says_how_far_it_came() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.ngc");
    let out = folder.path().join("out");
    let mut text = String::from("G21 G90 F60\n");
    for _ in 0..2000 {
        text.push_str("G1 X30 Y-265\nX-30\n");
    }
    text.push_str("M2\n");
    write(&path, text);
    let mut child = Command::new(env!("CARGO_BIN_EXE_pkm"))
        .args([
            "run",
            path.to_str().unwrap(),
            "--machine",
            "moma-a",
            "--format",
            "json",
            "--no-trace",
            "--out",
        ])
        .arg(&out)
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // Wait until it writes: then the check is over and the machine moves.
    while !std::fs::read_dir(&out).is_ok_and(|mut files| {
        files.any(|file| file.unwrap().metadata().is_ok_and(|metadata| metadata.len() > 100_000))
    }) {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was interrupted");
        std::thread::yield_now();
    }
    let output = interrupted(child);
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["completed"], false);
    let finding = &summary["diagnostics"][0];
    assert_eq!(finding["code"], "interrupted");
    assert!(
        finding["line"].as_u64().unwrap() > 0 && summary["servo_ticks"].as_u64().unwrap() > 0,
        "{summary}"
    );
    assert_eq!(listing(&out), ["report.html", "steps.vcd", "summary.json"]);
}

#[test]
fn tools_come_from_the_tool_table() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("tool.tbl");
    write(&table, "T1 P1 Z12.5 D6 ;mill\n");
    let program = b"G21 G90\nT1 M6\nG43 H1\nG1 Z0 F600\nM2\n";
    let arguments = ["run", "-", "--machine", "xyz", "--format", "json"];
    let without = pkm_with_input(&arguments, program);
    assert_eq!(
        (without.status, &without.json()["diagnostics"][0]["code"]),
        (1, &Value::from("tool-unknown"))
    );
    let with = [&arguments[..], &["--tool-table", table.to_str().unwrap()]].concat();
    let run = pkm_with_input(&with, program);
    assert_eq!(run.status, 0, "{}{}", run.stdout, run.stderr);
    // The tip is at Z0: the carriage stands a tool's length above.
    assert!((run.json()["joints"][2]["max"].as_f64().unwrap() - 12.5).abs() < 1e-9, "{}", run.stdout);
    let missing = pkm_with_input(&[&arguments[..], &["--tool-table", "none.tbl"]].concat(), program);
    assert_eq!((missing.status, &missing.json()["diagnostics"][0]["code"]), (2, &Value::from("tool-table")));
}

#[test]
fn parameters_reach_the_machine_and_are_saved_after_a_completed_program_only() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("pkm.var");
    let name = file.to_str().unwrap();
    let with = |command: &str, program: &[u8]| {
        pkm_with_input(&[command, "-", "--machine", "xyz", "--format", "json", "--parameters", name], program)
    };
    write(&file, "100 1.5\n5221 20\n");
    let before = std::fs::read(&file).unwrap();
    let checked = with("check", b"G10 L2 P1 X1e\nM2\n");
    assert_eq!(checked.status, 1, "{}", checked.stdout);
    assert_eq!(with("check", b"#100=2\nM2\n").status, 0);
    assert_eq!(with("run", b"#100=2\nG77\nM2\n").status, 1);
    assert_eq!(std::fs::read(&file).unwrap(), before, "nothing ran to its end");

    let run = with("run", b"F600\n#100=[#100+1]\nG1 X1\nM2\n");
    assert_eq!(run.status, 0, "{}", run.stdout);
    assert_eq!(run.json()["joints"][0]["max"], 21.0, "the offset of the file counts");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("\n100\t2.500000\n"), "{text}");
    assert_eq!(std::fs::read(folder.path().join("pkm.var.bak")).unwrap(), before);

    write(&file, &text[..text.len() / 2]);
    for command in ["run", "check"] {
        let refused = with(command, b"M2\n");
        assert_eq!(refused.status, 2);
        assert_eq!(refused.json()["diagnostics"][0]["code"], "param-file");
    }
}

#[test]
fn the_step_stream_plays_the_steps_of_the_summary() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let program = shipped("moma-arcs.ngc");
    let mut sizes = Vec::new();
    for stream in ["--step-stream", "--step-stream=500"] {
        let run = pkm(&[
            "run",
            &program,
            "--machine",
            "moma-a",
            "--format",
            "json",
            "--no-trace",
            "--out",
            out,
            stream,
        ]);
        assert_eq!(run.status, 0, "{}", run.stderr);
        let summary = run.json();
        let file = folder.path().join("steps.pkms");
        let file = file.to_str().unwrap();
        let played = pkm(&["steps", file, "--format", "json"]).json();
        for (n, joint) in summary["joints"].as_array().unwrap().iter().enumerate() {
            assert_eq!(played["joints"][n]["steps"], joint["steps"]);
        }
        let rows = pkm(&["steps", file, "--format", "csv"]).stdout;
        let last = rows.lines().rfind(|row| row.split(',').nth(1) == Some("0")).unwrap();
        assert_eq!(last.split(',').nth(3).unwrap(), played["joints"][0]["count"].to_string());
        sizes.push(played["bytes"].as_u64().unwrap());
    }
    assert!(sizes[1] * 2 < sizes[0], "{sizes:?}");
    let file = folder.path().join("steps.pkms");
    let bytes = std::fs::read(&file).unwrap();
    write(&file, &bytes[..bytes.len() / 2]);
    let cut = pkm(&["steps", file.to_str().unwrap()]);
    assert_eq!(cut.status, 2);
    assert!(cut.stderr.contains("not a whole step stream"), "{}", cut.stderr);
}
