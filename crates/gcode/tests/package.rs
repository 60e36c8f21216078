//! pkm against LinuxCNC's own interpreter: every program of the package `linuxcnc-uspace`, with the package's tool table.
//! Skipped, and said so, where the package is not installed.

mod support;

use std::path::{Path, PathBuf};
use std::process::Command;
use support::{Outcome, Rs274, difference, has_rs274, pkm_file};

/// The package's tool table, which `rs274` uses by itself.
const TOOL_TABLE: &str = "/usr/share/doc/linuxcnc/examples/sample-configs/common/tool.tbl";

/// The programs whose moves may differ, by the end of their path, and why. Everything but the moves must be the same, and
/// how they end.
const ALLOWED: [(&str, &str); 3] = [
    // G71.1; both refuse T10 of line 29, which the tool table does not hold.
    (
        "/ncfiles/lathe_g70_71_demo.ngc",
        "rs274 cuts a layer at the start's own height and comes back to it after each",
    ),
    ("/ncfiles/lathe_g7x_face_boring.ngc", "rs274 leads its layers along a slanted line from the start"),
    ("/ncfiles/lathe_g7x_quadrants.ngc", "rs274 goes straight back to the start through what stays"),
];

/// The programs of the package that are there.
fn programs() -> Vec<PathBuf> {
    let Ok(listing) = Command::new("dpkg").args(["-L", "linuxcnc-uspace"]).output() else {
        return Vec::new();
    };
    let listing = String::from_utf8_lossy(&listing.stdout).into_owned();
    let mut programs: Vec<PathBuf> =
        listing.lines().filter(|line| line.ends_with(".ngc")).map(PathBuf::from).collect();
    programs.retain(|path| path.is_file());
    programs.sort_unstable();
    programs
}

/// The outcome without its moves and the numbers of its lines.
fn without_moves(outcome: &Outcome) -> Outcome {
    let is_move = |line: &str| line.contains("STRAIGHT_") || line.contains("ARC_FEED(");
    let lines = outcome.lines.iter().filter(|line| !is_move(line));
    let lines = lines
        .map(|line| line.trim_start_matches(|c: char| c == ' ' || c.is_ascii_digit()).to_owned())
        .collect();
    Outcome { lines, ..outcome.clone() }
}

#[test]
fn programs_of_the_package_agree_with_rs274() {
    let programs = programs();
    if !has_rs274() || programs.is_empty() {
        eprintln!("skipped: linuxcnc-uspace is not installed");
        return;
    }
    let tools = std::fs::read(TOOL_TABLE).expect("the package's tool table");
    let scratch = std::env::temp_dir().join(format!("pkm-package-{}", std::process::id()));
    std::fs::create_dir_all(&scratch).expect("a scratch directory");
    let (mut unexplained, mut explained, mut endless) = (Vec::new(), Vec::new(), Vec::new());
    for program in &programs {
        let name = program.display().to_string();
        let reason = ALLOWED.iter().find(|(end, _)| name.ends_with(end));
        let beside = program.parent().expect("a folder");
        let run = Rs274 { program, tools: Path::new(TOOL_TABLE), beside, scratch: &scratch };
        let Some(oracle) = run.outcome(None, &[]) else {
            endless.push(name);
            continue;
        };
        let ours = pkm_file(program, &tools);
        match (difference(&oracle, &ours), reason) {
            (None, None) => {}
            (None, Some((end, _))) => unexplained.push(format!("{end} agrees now: take it off the list")),
            (Some(difference), None) => unexplained.push(format!("{name}: {difference}")),
            (Some(_), Some((end, _))) => match difference(&without_moves(&oracle), &without_moves(&ours)) {
                None => explained.push(*end),
                Some(difference) => unexplained.push(format!("{name}, not only its moves: {difference}")),
            },
        }
    }
    let _ = std::fs::remove_dir_all(&scratch);
    eprintln!(
        "{} programs compared, {} differ for a known reason, {} unexplained, {} without an end in rs274: {endless:?}",
        programs.len() - endless.len(),
        explained.len(),
        unexplained.len(),
        endless.len()
    );
    assert!(unexplained.is_empty(), "{}", unexplained.join("\n"));
    assert_eq!(explained.len(), ALLOWED.len(), "a listed program was not met: only {explained:?}");
}
