//! `pkm canon`: LinuxCNC's text on standard output, errors as its `rs274` shows them.

use crate::support::{pkm, pkm_with_input, write};

#[test]
fn commands_come_in_the_text_format_of_linuxcnc() {
    let run = pkm_with_input(&["canon", "-"], b"N10 G1 X10 F100\nG2 X20 I5\n(note)\nM2\n");
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    let expected = "    1 N..... USE_LENGTH_UNITS(CANON_UNITS_MM)\n";
    assert!(run.stdout.starts_with(expected), "{}", run.stdout);
    for line in [
        " N10    SET_FEED_RATE(100.0000)\n",
        " N10    STRAIGHT_FEED(10.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\n",
        " N..... ARC_FEED(20.0000, 0.0000, 15.0000, 0.0000, -1, 0.0000, 0.0000, 0.0000, 0.0000)\n",
        " N..... COMMENT(\"note\")\n",
        " N..... PROGRAM_END()\n",
        " N..... ON_RESET()\n",
    ] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
}

#[test]
fn errors_end_with_message_and_source_line() {
    let run = pkm_with_input(&["canon", "-"], b"G21\nG1 X10 F100 \nG77 (what)\nG0 X0\nM2\n");
    assert_eq!(run.status, 1);
    let lines: Vec<&str> = run.stderr.lines().collect();
    assert_eq!(lines.len(), 2, "{}", run.stderr);
    assert!(lines[0].starts_with("-:3:1: error[g-unknown]: "), "{}", run.stderr);
    assert_eq!(lines[1], "G77 (what)");
    assert!(run.stdout.contains("STRAIGHT_FEED") && !run.stdout.contains("STRAIGHT_TRAVERSE"));
    let all = pkm_with_input(&["canon", "-", "--on-error", "continue"], b"G77\nG0 X1\nG78\nM2\n");
    assert_eq!(all.status, 1);
    assert_eq!(all.stderr.lines().count(), 4, "{}", all.stderr);
    assert!(all.stdout.contains("STRAIGHT_TRAVERSE"), "{}", all.stdout);
}

#[test]
fn settings_and_files() {
    let uvw = b"G0 U1\nM2\n";
    assert_eq!(pkm_with_input(&["canon", "-"], uvw).status, 1);
    assert_eq!(pkm_with_input(&["canon", "-", "--axes", "XYUV"], uvw).status, 0);
    assert_eq!(pkm_with_input(&["canon", "-", "--axes", "XX"], uvw).status, 2);
    assert_eq!(pkm(&["canon", "no-such-file.ngc"]).status, 2);
    assert_eq!(pkm_with_input(&["canon", "-"], b"").status, 1);

    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("canon.txt");
    let to_file = pkm_with_input(&["canon", "-", "-o", out.to_str().unwrap()], b"G0 X1\nM2\n");
    assert_eq!((to_file.status, to_file.stdout.as_str()), (0, ""));
    let text = std::fs::read_to_string(&out).unwrap();
    assert_eq!(text, pkm_with_input(&["canon", "-"], b"G0 X1\nM2\n").stdout);
    let nowhere = folder.path().join("none/canon.txt");
    assert_eq!(pkm_with_input(&["canon", "-", "-o", nowhere.to_str().unwrap()], b"M2\n").status, 2);

    let table = folder.path().join("tool.tbl");
    write(&table, "T3 P1 Z12.5 D6 ;mill\nnonsense\n");
    let program = b"G21\nT3 M6\nG43 H3\nM2\n";
    let run = pkm_with_input(&["canon", "-", "--mm", "--tool-table", table.to_str().unwrap()], program);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert!(run.stdout.contains("USE_TOOL_LENGTH_OFFSET(0.0000 0.0000 12.5000"), "{}", run.stdout);
    assert!(run.stderr.contains("tool.tbl:2"), "{}", run.stderr);
}

#[test]
fn a_closed_pipe_ends_an_endless_program() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("endless.ngc");
    write(&path, "o1 while [1]\nG0 X1\nG0 X0\no1 endwhile\nM2\n");
    let (reader, writer) = std::io::pipe().unwrap();
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_pkm"))
        .arg("canon")
        .arg(&path)
        .stdout(writer)
        .spawn()
        .unwrap();
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(reader));
    assert!(lines.by_ref().take(1000).all(|line| line.is_ok()));
    drop(lines);
    assert_eq!(child.wait().unwrap().code(), Some(0));
}
