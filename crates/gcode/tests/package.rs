//! pkm against LinuxCNC's own interpreter: every program of the package `linuxcnc-uspace`, with the package's tool table.
//! Skipped, and said so, where the package is not installed.

mod support;

use std::path::{Path, PathBuf};
use std::process::Command;
use support::{Outcome, difference, has_rs274, pkm_file, rs274_file};

/// The package's tool table, which `rs274` uses by itself.
const TOOL_TABLE: &str = "/usr/share/doc/linuxcnc/examples/sample-configs/common/tool.tbl";

/// The programs that may differ, by the end of their path, and how pkm's message must end: each uses the lathe's roughing
/// and finishing cycles G70 to G72.2, which pkm does not have yet (tier T2) and refuses by name. Up to there pkm must
/// print what `rs274` prints.
const ALLOWED: [(&str, &str); 3] = [
    ("/ncfiles/lathe_g70_71_demo.ngc", "G71.1 is not supported yet"),
    ("/ncfiles/lathe_g7x_face_boring.ngc", "G72 is not supported yet"),
    ("/ncfiles/lathe_g7x_quadrants.ngc", "G70 is not supported yet"),
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

/// True if what `ours` printed before it stopped is how `oracle` begins.
fn agrees_up_to_the_end_of(ours: &Outcome, oracle: &Outcome) -> bool {
    let begin =
        Outcome { lines: oracle.lines.iter().take(ours.lines.len()).cloned().collect(), ..ours.clone() };
    difference(&begin, ours).is_none()
}

#[test]
fn programs_of_the_package_agree_with_rs274() {
    let programs = programs();
    if !has_rs274() || programs.is_empty() {
        eprintln!("skipped: linuxcnc-uspace is not installed");
        return;
    }
    let tools = std::fs::read(TOOL_TABLE).expect("the package's tool table");
    let (mut unexplained, mut explained, mut endless) = (Vec::new(), Vec::new(), Vec::new());
    for program in &programs {
        let name = program.display().to_string();
        let reason = ALLOWED.iter().find(|(end, _)| name.ends_with(end));
        let beside = program.parent().expect("a folder");
        let Some(oracle) = rs274_file(program, Path::new(TOOL_TABLE), beside) else {
            endless.push(name);
            continue;
        };
        let ours = pkm_file(program, &tools);
        match (difference(&oracle, &ours), reason) {
            (None, None) => {}
            (None, Some((end, _))) => unexplained.push(format!("{end} agrees now: take it off the list")),
            (Some(difference), None) => unexplained.push(format!("{name}: {difference}")),
            (Some(difference), Some((end, message))) => {
                let known = ours.message.contains(message);
                match known && agrees_up_to_the_end_of(&ours, &oracle) {
                    true => explained.push(*end),
                    false => unexplained.push(format!("{name}, for another reason than known: {difference}")),
                }
            }
        }
    }
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
