//! Programs with the canonical text that LinuxCNC 2.9's `rs274` gave for them, so that the comparison also runs where
//! `rs274` is not installed. Where it is, the stored text is checked against it too. `PKM_UPDATE_GOLDEN=1` stores anew.

mod support;

use support::{Outcome, difference, has_rs274, pkm, rs274};

fn text_of(outcome: &Outcome) -> String {
    let mut text = outcome.lines.join("\n");
    text.push('\n');
    if let Some(block) = &outcome.failed_block {
        text.push_str(&format!("FAILED {}\n", block.trim()));
    }
    text
}

fn outcome_of(text: &str) -> Outcome {
    let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
    let failed_block = match lines.last().and_then(|line| line.strip_prefix("FAILED ")) {
        Some(block) => {
            let block = block.to_string();
            lines.pop();
            Some(block)
        }
        None => None,
    };
    Outcome { lines, failed_block, message: "(stored)".into(), kept: Vec::new() }
}

#[test]
fn golden_programs_print_what_rs274_printed() {
    let directory = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let scratch = std::env::temp_dir().join(format!("pkm-golden-{}", std::process::id()));
    std::fs::create_dir_all(&scratch).expect("a scratch directory");
    let mut programs: Vec<_> = std::fs::read_dir(&directory)
        .expect("tests/golden")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "ngc"))
        .collect();
    programs.sort();
    assert!(programs.len() >= 8, "the golden programs are there");
    let (mut complaints, oracle) = (Vec::new(), has_rs274());
    if !oracle {
        eprintln!("skipped: rs274 is not installed; only the stored texts are compared");
    }
    for path in &programs {
        let program = std::fs::read(path).expect("a readable program");
        let stored_path = path.with_extension("canon");
        if oracle {
            let fresh = rs274(&program, &scratch, None).expect("golden programs end");
            if std::env::var_os("PKM_UPDATE_GOLDEN").is_some() {
                support::write(&stored_path, text_of(&fresh).as_bytes());
            }
            let stored = std::fs::read_to_string(&stored_path).expect("the stored text");
            if outcome_of(&stored).lines != fresh.lines {
                complaints.push(format!("{}: the stored text is not what rs274 prints", path.display()));
            }
        }
        let stored = std::fs::read_to_string(&stored_path).expect("the stored text");
        if let Some(difference) = difference(&outcome_of(&stored), &pkm(&program)) {
            complaints.push(format!("{}: {difference}", path.display()));
        }
    }
    let _ = std::fs::remove_dir_all(&scratch);
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}
