//! `pkm workspace`, `pkm configure`, `pkm plot`: the files and numbers they leave, and every bad input that must end in a message.

use crate::support::{pkm, pkm_with_input, write};
use serde_json::Value;
use std::path::Path;

/// A file with this text; its path.
fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    write(&path, text);
    path.to_str().unwrap().to_owned()
}

fn json(run: &crate::support::Run) -> Value {
    let [value] = &run.json_lines()[..] else { panic!("{:?}\n{}", run.stdout, run.stderr) };
    assert_eq!(value["schema"], 1);
    value.clone()
}

/// A PNG that is one, and an SVG below 100 kB.
fn pictures(folder: &Path, name: &str) {
    let png = std::fs::read(folder.join(format!("{name}.png"))).unwrap();
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n") && png.len() > 10_000, "{name}.png: {} bytes", png.len());
    let svg = std::fs::read_to_string(folder.join(format!("{name}.svg"))).unwrap();
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    assert!(svg.contains("(mm)") && svg.len() < 100_000, "{name}.svg: {} bytes", svg.len());
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}.svg");
}

#[test]
fn every_kind_of_machine_has_a_workspace() {
    let folder = tempfile::tempdir().unwrap();
    let areas =
        [("moma-a", 19_315.63), ("ox-glide-x", 753.33), ("moma-w", 31_550.70), ("hv-mill-v3", 31_550.70)];
    for (machine, area) in areas {
        let out = folder.path().join(machine);
        let run = pkm(&[
            "workspace",
            "--machine",
            machine,
            "--out",
            out.to_str().unwrap(),
            "--resolution",
            "4",
            "--format",
            "json",
        ]);
        assert_eq!(run.status, 0, "{}", run.stderr);
        let answer = json(&run);
        assert!(
            (answer["area_mm2"].as_f64().unwrap() - area).abs() < 0.01,
            "{machine}: {}",
            answer["area_mm2"]
        );
        assert!(answer["area_error_bound_mm2"].as_f64().unwrap() < 0.01);
        assert!(
            answer["bounding_box_mm"]["X"][0].is_number() && answer["parameters"]["resolution_mm"] == 4.0
        );
        let kept = std::fs::read_to_string(out.join("workspace.json")).unwrap();
        assert_eq!(kept, run.stdout);
        pictures(&out, "workspace");
        let table = std::fs::read_to_string(out.join("workspace.csv")).unwrap();
        assert!(table.starts_with("view,") && table.lines().count() > 40, "{machine}");
    }
}

#[test]
fn lambda_has_volumes_and_solids() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let run =
        pkm(&["workspace", "--machine", "lambda6", "--out", out, "--resolution", "40", "--format", "json"]);
    let answer = json(&run);
    let volume = |name: &str| answer["volume_mm3"][name].as_f64().unwrap();
    assert!(
        volume("total_orientation") < volume("zero_orientation")
            && volume("zero_orientation") < volume("achievable")
    );
    assert!((volume("zero_orientation") / 174.56e6 - 1.0).abs() < 0.05);
    assert!(answer["volume_step_estimate_mm3"]["achievable"].as_f64().unwrap() > 0.0);
    pictures(folder.path(), "workspace");
    let solid = std::fs::read_to_string(folder.path().join("total_orientation.obj")).unwrap();
    assert!(solid.lines().filter(|line| line.starts_with("v ")).count() % 72 == 0);
}

/// The machine file with its two sliders in places from which the links cannot meet.
#[test]
fn an_empty_workspace_and_a_degenerate_configuration_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    // Home must be reachable, so a machine file alone cannot have an empty workspace; a limited axis can leave nothing.
    let run = pkm(&["workspace", "--machine", "moma-a", "--out", out, "--set", "kinematics.l_mm=[20, 20]"]);
    assert_eq!(run.status, 2);
    assert!(run.stderr.contains("home"), "{}", run.stderr);
    let set = ["kinematics.reference_mm=[[0, 0], [0, 0]]", "kinematics.guide_angle_deg=[270, 270]"];
    let run = pkm(&["workspace", "--machine", "moma-a", "--out", out, "--set", set[0], "--set", set[1]]);
    assert_eq!(run.status, 2);
    assert!(run.stderr.contains("machine-geometry"), "{}", run.stderr);
    assert!(!Path::new(out).exists(), "nothing is written");
}

#[test]
fn a_resolution_that_is_none_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for machine in ["moma-a", "lambda6"] {
        for (resolution, says) in
            [("0", "not a length"), ("-1", "not a length"), ("nan", "not a length"), ("1e-9", "or coarser")]
        {
            let arguments = [
                "workspace",
                "--machine",
                machine,
                "--out",
                out.to_str().unwrap(),
                "--resolution",
                resolution,
            ];
            let run = pkm(&arguments);
            assert_eq!(run.status, 2, "{machine} {resolution}");
            assert!(run.stderr.contains(says), "{machine} {resolution}: {}", run.stderr);
            let json = pkm(&[&arguments[..], &["--format", "json"]].concat());
            assert_eq!(json.json_lines()[0]["diagnostics"][0]["code"], "workspace-resolution");
        }
    }
    let run = pkm(&["workspace", "--machine", "moma-w", "--out", out.to_str().unwrap(), "--z", "400"]);
    assert!(run.status == 2 && run.stderr.contains("travel 0 to 100 mm"), "{}", run.stderr);
    assert!(!out.exists());
}

const LINES: &str = "G21 G90 G94 F600\nG1 X20 Y-265\nG1 X20 Y-300\nG1 X-20 Y-300\nM2\n";

#[test]
fn configure_ranks_and_does_not_depend_on_threads() {
    let ask = |threads: &str, rank: &str| {
        let arguments = [
            "configure",
            "-",
            "--machine",
            "moma",
            "--threads",
            threads,
            "--rank-by",
            rank,
            "--format",
            "json",
        ];
        pkm_with_input(&arguments, LINES.as_bytes())
    };
    let one = ask("1", "time");
    assert_eq!(one.status, 0, "{}", one.stderr);
    assert_eq!(one.stdout, ask("5", "time").stdout);
    let answer = json(&one);
    let all = answer["configurations"].as_array().unwrap();
    assert_eq!((all.len(), answer["runs"].as_u64().unwrap()), (12, 6), "{answer}");
    let values = |answer: &Value, key: &str| -> Vec<f64> {
        answer["configurations"].as_array().unwrap().iter().filter_map(|c| c[key].as_f64()).collect()
    };
    assert!(values(&answer, "duration_s").is_sorted());
    let by_singularity = json(&ask("2", "singularity"));
    assert!(values(&by_singularity, "min_singularity_distance").is_sorted_by(|a, b| a >= b));
    let by_travel = json(&ask("2", "travel"));
    assert!(values(&by_travel, "travel_mm").is_sorted());
    // c and d work elsewhere: the first block that leads out defeats them.
    let defeated = all.iter().find(|c| c["name"] == "drives c, links 195").unwrap();
    assert_eq!(
        (defeated["verdict"].as_str(), defeated["line"].as_u64()),
        (Some("fails"), Some(2)),
        "{defeated}"
    );
}

/// What the search says of a configuration is what the machine does: the winner's time is that of `pkm plan`.
#[test]
fn the_best_configuration_keeps_its_word() {
    let folder = tempfile::tempdir().unwrap();
    let program = file(folder.path(), "part.ngc", LINES);
    let found = json(&pkm(&["configure", &program, "--machine", "moma-4s", "--format", "json"]));
    let best = &found["configurations"][0];
    let set: Vec<&str> =
        best["set"].as_array().unwrap().iter().flat_map(|text| ["--set", text.as_str().unwrap()]).collect();
    let plan =
        json(&pkm(&[&["plan", &program, "--machine", "moma-4s", "--format", "json"], &set[..]].concat()));
    assert_eq!(plan["duration_s"], best["duration_s"]);
    assert_eq!(plan["min_singularity_distance"], best["min_singularity_distance"]);
}

#[test]
fn configure_says_why_none_can() {
    let far = pkm_with_input(
        &["configure", "-", "--machine", "ox-glide"],
        b"G21 G90 G94 F600\nG1 X60\nG1 X500\nM2\n",
    );
    assert_eq!(far.status, 1);
    assert!(far.stdout.contains("none of 2 configurations"), "{}", far.stdout);
    assert!(
        far.stdout.contains("no  form O: line 3:") && far.stdout.contains("no  form X: line 3:"),
        "{}",
        far.stdout
    );
    let no_family = pkm_with_input(&["configure", "-", "--machine", "moma-a"], LINES.as_bytes());
    assert!(no_family.status == 2 && no_family.stderr.contains("[configure]"), "{}", no_family.stderr);
    let still = pkm_with_input(&["configure", "-", "--machine", "ox-glide"], b"M2\n");
    assert_eq!(still.status, 0);
    assert!(still.stdout.contains("nothing moves"), "{}", still.stdout);
}

#[test]
fn plot_draws_a_trace_and_a_program_alike() {
    let folder = tempfile::tempdir().unwrap();
    let program = file(folder.path(), "part.ngc", LINES);
    let (ran, drawn) = (folder.path().join("ran"), folder.path().join("drawn"));
    let run = pkm(&["run", &program, "--machine", "moma-a", "--out", ran.to_str().unwrap()]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let trace = ran.join("trace.csv");
    let mut told = Vec::new();
    for input in [trace.to_str().unwrap(), &program] {
        let run = pkm(&["plot", input, "--machine", "moma-a", "--out", drawn.to_str().unwrap()]);
        assert_eq!(run.status, 0, "{}", run.stderr);
        told.push(run.stdout);
        pictures(&drawn, "path");
        assert!(std::fs::read_to_string(drawn.join("joints.svg")).unwrap().contains("% of limit"));
    }
    assert_eq!(told[0], told[1], "the same rows");
    // Without a machine: units of the trace.
    let run = pkm(&["plot", trace.to_str().unwrap(), "--out", drawn.to_str().unwrap()]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert!(std::fs::read_to_string(drawn.join("joints.svg")).unwrap().contains("velocity (mm/s)"));
}

#[test]
fn plot_tells_what_it_cannot_draw() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let still = file(folder.path(), "still.ngc", "M2\n");
    let run = pkm(&["plot", &still, "--machine", "moma-a", "--out", out]);
    assert!(run.status == 1 && run.stderr.contains("nothing moves"), "{} {}", run.status, run.stderr);
    let run = pkm(&["plot", &still, "--out", out]);
    assert!(run.status == 2 && run.stderr.contains("needs a machine"), "{}", run.stderr);
    let broken = file(folder.path(), "broken.csv", "tick,time_s,line,joint.0.pos-cmd_mm\n0,0,1,x\n");
    let run = pkm(&["plot", &broken, "--out", out]);
    assert!(run.status == 2 && run.stderr.contains("row 1, column joint.0.pos-cmd_mm"), "{}", run.stderr);
    let run = pkm(&["plot", "missing.csv", "--out", out]);
    assert!(run.status == 2 && run.stderr.contains("cannot read missing.csv"), "{}", run.stderr);
    assert!(!Path::new(out).exists());
}
