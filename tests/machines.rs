//! `pkm machines`, `pkm generate`, usage, and machine files that must be refused.

use crate::support::{pkm, pkm_with_input, write};
use std::process::{Command, Stdio};

#[test]
fn machines_lists_every_file_of_the_folder() {
    let list: serde_json::Value =
        serde_json::from_str(&pkm(&["machines", "--format", "json"]).stdout).unwrap();
    assert_eq!(list["schema"], 1);
    let mut listed: Vec<&str> =
        list["machines"].as_array().unwrap().iter().map(|row| row["name"].as_str().unwrap()).collect();
    listed.sort_unstable();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../machines");
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .filter_map(|entry| {
            entry.unwrap().file_name().to_str().unwrap().strip_suffix(".toml").map(str::to_owned)
        })
        .collect();
    files.sort_unstable();
    assert_eq!(listed, files);
    let text = pkm(&["machines"]);
    assert_eq!(text.status, 0);
    assert!(files.iter().all(|name| text.stdout.contains(name.as_str())));
}

#[test]
fn machines_prints_a_file_that_can_be_read_back() {
    let printed = pkm(&["machines", "moma-a"]);
    assert_eq!(printed.status, 0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    write(&path, &printed.stdout);
    let machine = path.to_str().unwrap();
    let run = pkm_with_input(&["kins", "inverse", "--machine", machine], b"{\"x\":0,\"y\":-265}\n");
    assert_eq!(run.status, 0, "{}", run.stderr);
    let unknown = pkm(&["machines", "moma-z"]);
    assert_eq!(unknown.status, 2);
    assert!(unknown.stderr.contains("moma-z"), "{}", unknown.stderr);
}

#[test]
fn bad_machine_files_end_with_status_2_and_a_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.toml");
    let good = pkm(&["machines", "moma-a"]).stdout;
    let place = |key: &str, below: usize, column: usize| {
        let line = good.lines().position(|line| line.starts_with(key)).unwrap() + 1 + below;
        format!("bad.toml:{line}:{column}")
    };
    let cases: [(&str, Vec<u8>, &str, String); 7] = [
        (
            "NaN",
            good.replacen("max_mm = 200", "max_mm = nan", 1).into(),
            "machine-not-finite",
            place("max_mm", 0, 10),
        ),
        (
            "unknown key",
            good.replacen("max_mm", "maxmm", 1).into(),
            "machine-unknown-key",
            place("max_mm", 0, 1),
        ),
        (
            "repeated key",
            good.replacen("max_mm = 200", "max_mm = 200\nmax_mm = 200", 1).into(),
            "machine-repeated-key",
            place("max_mm", 1, 1),
        ),
        (
            "link of length zero",
            good.replacen("l_mm = [195, 195]", "l_mm = [195, 0]", 1).into(),
            "machine-geometry",
            place("l_mm", 0, 14),
        ),
        ("empty", Vec::new(), "machine-missing-key", "bad.toml".into()),
        ("binary", vec![0, 159, 146, 150, 255], "machine-not-text", "bad.toml".into()),
        ("zeros", vec![0; 4096], "machine-not-text", "bad.toml".into()),
    ];
    for (name, bytes, code, place) in cases {
        write(&path, bytes);
        let run = pkm(&["kins", "inverse", "--machine", path.to_str().unwrap()]);
        assert_eq!(run.status, 2, "{name}");
        assert!(run.stdout.is_empty(), "{name}");
        assert!(run.stderr.contains(code) && run.stderr.contains(&place), "{name}:\n{}", run.stderr);
        assert!(run.stderr.contains("help: "), "{name}:\n{}", run.stderr);
    }
    let missing = pkm(&["kins", "inverse", "--machine", "no-such-file.toml"]);
    assert_eq!(missing.status, 2);
    assert!(
        missing.stderr.contains("no-such-file.toml") && missing.stderr.contains("moma-a"),
        "{}",
        missing.stderr
    );
}

#[test]
fn usage_errors_end_with_status_2() {
    for arguments in [&["nonsense"][..], &["kins"], &["kins", "inverse"], &["machines", "--format", "xml"]] {
        let run = pkm(arguments);
        assert_eq!(run.status, 2, "{arguments:?}");
        assert!(run.stdout.is_empty() && !run.stderr.is_empty(), "{arguments:?}");
    }
    let help = pkm(&["--help"]);
    assert_eq!(help.status, 0);
    assert!(help.stdout.contains("kins") && help.stdout.contains("Exit status"));
}

#[test]
fn man_page_and_completions_come_from_the_definition() {
    for (what, word) in [
        ("man", ".TH pkm"),
        ("complete-bash", "complete"),
        ("complete-zsh", "#compdef pkm"),
        ("complete-fish", "complete -c pkm"),
    ] {
        let run = pkm(&["generate", what]);
        assert_eq!(run.status, 0, "{what}");
        assert!(run.stdout.contains(word) && run.stdout.contains("machines"), "{what}");
    }
}

#[test]
fn colours_only_where_they_are_wanted() {
    let colour =
        |when: &str| pkm(&["--color", when, "kins", "inverse", "--machine", "none"]).stderr.contains('\x1b');
    assert!(colour("always"));
    assert!(!colour("never"));
    assert!(!colour("auto")); // standard error is no terminal here
}

#[test]
fn a_closed_pipe_is_success_and_a_full_disk_is_not() {
    // Standard output whose reader has gone.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = Command::new(env!("CARGO_BIN_EXE_pkm")).arg("machines").stdout(writer).status().unwrap();
    assert_eq!(status.code(), Some(0));
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_pkm"))
        .arg("machines")
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot write"), "{output:?}");
}

#[test]
fn the_reference_of_the_keys_is_complete() {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../machines/README.md")).unwrap();
    for kind in pkm_machine::kinematics::TYPES {
        assert!(text.contains(&format!("`{kind}`")), "kinematics.type {kind} is not in machines/README.md");
    }
    for (model, _) in pkm_machine::drivers::DRIVERS {
        assert!(text.contains(model), "driver {model} is not in machines/README.md");
    }
}
