//! `pkm canon`: LinuxCNC's text on standard output, errors as its `rs274` shows them.

use crate::support::{pkm, pkm_with_input, write};
use std::path::Path;

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

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_written_and_never_replaced() {
    use std::os::unix::fs::FileTypeExt;
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || std::fs::read_to_string(pipe).unwrap()
    });
    let run = pkm_with_input(&["canon", "-", "-o", pipe.to_str().unwrap()], b"G0 X1\nM2\n");
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert!(std::fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo(), "the pipe was replaced");
    assert!(reader.join().unwrap().contains("STRAIGHT_TRAVERSE"));

    let (file, link) = (folder.path().join("file"), folder.path().join("link"));
    write(&file, "old");
    std::os::unix::fs::symlink(&file, &link).unwrap();
    assert_eq!(pkm_with_input(&["canon", "-", "-o", link.to_str().unwrap()], b"G0 X1\nM2\n").status, 0);
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink(), "the link was replaced");
    assert!(std::fs::read_to_string(&file).unwrap().contains("STRAIGHT_TRAVERSE"));
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
fn remapped_codes_come_from_the_ini_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        write(&path, text);
        path.display().to_string()
    };
    std::fs::create_dir(folder.path().join("subs")).unwrap();
    file(
        "subs/change.ngc",
        "o<change> sub\n(print,tool #<_selected_tool>)\nM6\nG0 Z#<p>\no<change> endsub\n",
    );
    let program = file("program.ngc", "T0 M400 P5\nG1 X1 F9 M400 P7\nM2\n");
    let remap = |line: &str, program: &str| {
        let ini = file("machine.ini", &format!("[RS274NGC]\nSUBROUTINE_PATH = subs\nREMAP = {line}\n"));
        pkm(&["canon", program, "--ini", &ini])
    };
    let run = remap("M400 modalgroup=6 argspec=P ngc=change # comment", &program);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let order = [
        "SELECT_TOOL(0)",
        "tool 0.000000",
        "CHANGE_TOOL(0)",
        "0.0000, 5.0000",
        "SET_FEED_RATE(9.0000)",
        "tool 0.0",
        "0.0000, 7.0000",
        "STRAIGHT_FEED(1.0000",
    ];
    let mut rest = run.stdout.as_str();
    for text in order {
        rest = rest.split_once(text).unwrap_or_else(|| panic!("{text}: {}", run.stdout)).1;
    }
    let bad = file("bad.ngc", "G0 X1\nM400 Q5\nM2\n");
    let run = remap("M400 modalgroup=6 argspec=P ngc=change", &bad);
    assert_eq!(run.status, 1);
    assert!(run.stderr.contains(":2:1: error[word-missing]: the remapped code needs P"), "{}", run.stderr);
    for (line, said) in [
        ("M400 python=change", "python=change needs Python"),
        ("M400 ngc=change prolog=before", "prolog=before needs Python"),
        ("M400 ngc=nothing", "there is no file nothing.ngc"),
        ("M3 ngc=change", "M3 cannot be remapped"),
        ("M400 ngc=change\nREMAP = m400 ngc=change", "this code is remapped already"),
    ] {
        let run = remap(line, &program);
        assert_eq!(run.status, 2, "{line}");
        assert!(run.stderr.contains(said) && run.stderr.contains("help"), "{line}: {}", run.stderr);
    }
}

#[test]
fn an_imported_machine_file_knows_the_remapped_codes() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let joint = |n: u8| {
        format!(
            "[JOINT_{n}]\nMIN_LIMIT = -90\nMAX_LIMIT = 90\nMAX_VELOCITY = 50\nMAX_ACCELERATION = 500\nSCALE = 400\n"
        )
    };
    std::fs::create_dir(folder.path().join("lc")).unwrap();
    std::fs::create_dir(folder.path().join("lc/subs")).unwrap();
    let ini = format!(
        "[TRAJ]\nLINEAR_UNITS = mm\n[KINS]\nKINEMATICS = trivkins coordinates=xyz\n{}{}{}\
         [RS274NGC]\nSUBROUTINE_PATH = subs\nREMAP = G88.1 argspec=XZ ngc=dip\n",
        joint(0),
        joint(1),
        joint(2)
    );
    write(Path::new(&path("lc/mine.ini")), ini);
    write(Path::new(&path("lc/subs/dip.ngc")), "o<dip> sub\nG0 X#<x>\nG1 Z#<z> F300\nG0 Z0\no<dip> endsub\n");
    write(Path::new(&path("program.ngc")), "G21 G90\nG88.1 X10 Z-5\nG88.1 X20 Z-500\nM2\n");
    // Beside the INI file folders stay as they are, elsewhere they begin at the root.
    let printed = pkm(&["import-linuxcnc", &path("lc/mine.ini")]);
    assert!(
        printed.stdout.contains(&format!("subroutine_path = [\"{}\"]", path("lc/subs"))),
        "{}",
        printed.stdout
    );
    for (machine, folder) in
        [("lc/mine.toml", "[\"subs\"]".to_owned()), ("mine.toml", format!("[\"{}\"]", path("lc/subs")))]
    {
        let machine = path(machine);
        assert_eq!(pkm(&["import-linuxcnc", &path("lc/mine.ini"), "-o", &machine]).status, 0);
        let text = std::fs::read_to_string(&machine).unwrap();
        assert!(text.contains(&format!("subroutine_path = {folder}\n")), "{text}");
        let checked = pkm(&["check", &path("program.ngc"), "--machine", &machine]);
        assert_eq!(checked.status, 1, "{}", checked.stderr);
        for said in ["lc/subs/dip.ngc:3:1", "program.ngc:3:1", "joint2 would have to be at -500"] {
            assert!(checked.stderr.contains(said), "{said}: {}", checked.stderr);
        }
        assert!(!checked.stderr.contains("program.ngc:2:1"), "{}", checked.stderr);
    }
    // The canonical commands are those of the INI file.
    let canon = pkm(&["canon", &path("program.ngc"), "--mm", "--ini", &path("lc/mine.ini")]);
    assert!(canon.stdout.contains("STRAIGHT_FEED(10.0000, 0.0000, -5.0000"), "{}", canon.stdout);
    let piped = std::fs::read(path("program.ngc")).unwrap();
    let same = pkm_with_input(&["canon", "-", "--mm", "--ini", &path("lc/mine.ini")], &piped);
    assert_eq!(same.stdout, canon.stdout);
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

#[test]
fn parameters_are_kept_from_program_to_program() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("pkm.var");
    let bak = folder.path().join("pkm.var.bak");
    let with = |program: &[u8]| {
        pkm_with_input(&["canon", "-", "--mm", "--parameters", file.to_str().unwrap()], program)
    };
    let first = with(b"G10 L2 P2 X12.5 Y[1/3]\nG55\nM2\n");
    assert_eq!(first.status, 0, "{}", first.stderr);
    assert!(file.is_file() && !bak.exists());
    let saved = std::fs::read(&file).unwrap();
    // Saved after an error too, and the file before it stays.
    let second = with(b"G10 L2 P2 X7\nG0 X#5242\nG77\nM2\n");
    assert_eq!(second.status, 1);
    assert!(second.stdout.contains("STRAIGHT_TRAVERSE(0.3333, "), "{}", second.stdout);
    assert_eq!(std::fs::read(&bak).unwrap(), saved);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("\n5241\t7.000000\n5242\t0.3333333333333333\n"), "{text}");
}

#[test]
fn a_damaged_parameter_file_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("pkm.var");
    let name = file.to_str().unwrap();
    let arguments = ["canon", "-", "--parameters", name];
    assert_eq!(pkm_with_input(&arguments, b"G10 L2 P1 X5\nM2\n").status, 0);
    let whole = std::fs::read(&file).unwrap();
    for (text, place) in [
        (&whole[..whole.len() / 2], "pkm.var:"),
        (b"5221 1\n5161 2\n", "pkm.var:2"),
        (b"5221 1x\n", "pkm.var:1"),
        (b"", "pkm.var"),
    ] {
        write(&file, text);
        let run = pkm_with_input(&arguments, b"G0 X1\nM2\n");
        assert_eq!((run.status, run.stdout.as_str()), (2, ""));
        assert!(run.stderr.contains("param-file") && run.stderr.contains(place), "{}", run.stderr);
        // The first save had nothing to keep: there is no .bak.
        assert!(run.stderr.contains("there is no") && run.stderr.contains("pkm.var.bak"), "{}", run.stderr);
        write(&folder.path().join("pkm.var.bak"), &whole);
        let run = pkm_with_input(&arguments, b"G0 X1\nM2\n");
        assert!(run.stderr.contains("before the last save is in"), "{}", run.stderr);
        std::fs::remove_file(folder.path().join("pkm.var.bak")).unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), text, "a refused file is left as it is");
    }
    assert_eq!(pkm(&["canon", "-", "--parameters", folder.path().to_str().unwrap()]).status, 2);
}

#[test]
fn motion9_is_motion_alone_in_mm() {
    let axes = ["canon", "-", "--format", "motion9", "--axes", "XYZABCUVW"];
    let cases: [(&[u8], &str); 3] = [
        (
            b"G20 (the feed counts from the next block)\nF10\nG1 X1 A90 U-2\nG18 G2 X2 I0.5 P2\nM2\n",
            "2 SET_FEED_RATE(254.000000)\n\
             3 STRAIGHT_FEED(25.400000, 0.000000, 0.000000, 90.000000, 0.000000, 0.000000, -50.800000, 0.000000, 0.000000)\n\
             4 SELECT_PLANE(XZ)\n\
             4 ARC_FEED(0.000000, 50.800000, 0.000000, 38.100000, -2, 0.000000, 90.000000, 0.000000, 0.000000, \
             -50.800000, 0.000000, 0.000000)\n",
        ),
        (
            b"G10 L2 P2 X1 R30\nG55\nG92 Y2\nG4 P0.25\n(MSG,hello)\nM2\n",
            "2 SET_G5X_OFFSET(2, 1.000000, 0.000000, 0.000000, 0.000000, 0.000000, 0.000000, 0.000000, 0.000000, 0.000000)\n\
             2 SET_G92_OFFSET(0.000000, 0.000000, 0.000000, 0.000000, 0.000000, 0.000000, 0.000000, 0.000000, 0.000000)\n\
             2 SET_XY_ROTATION(30.000000)\n\
             3 SET_G92_OFFSET(0.000000, -1.500000, ",
        ),
        (
            b"o1 repeat [2]\nG91 G0 Z1\no1 endrepeat\nG77\n",
            "2 STRAIGHT_TRAVERSE(0.000000, 0.000000, 1.000000, ",
        ),
    ];
    for (program, expected) in cases {
        let run = pkm_with_input(&axes, program);
        assert!(run.stdout.starts_with(expected), "{}\n{expected}", run.stdout);
    }
    let dwell = pkm_with_input(&axes, cases[1].0).stdout;
    assert!(dwell.contains("4 DWELL(0.250000)\n5 MESSAGE(\"hello\")\n"), "{dwell}");
    assert!(!dwell.contains("PROGRAM_END") && !dwell.contains("\n0 "), "{dwell}");
}

#[test]
fn json_holds_every_command_and_the_diagnostics() {
    let run = pkm_with_input(&["canon", "-", "--format", "json"], b"N7 G0 X[1/3]\n(a \"quote\")\nG77\n");
    assert_eq!((run.status, run.stderr.as_str()), (1, ""));
    let lines = run.json_lines();
    let find = |name: &str| lines.iter().find(|line| line["command"] == name).unwrap();
    let traverse = find("STRAIGHT_TRAVERSE");
    assert_eq!(traverse["arguments"]["x"], 1.0 / 3.0);
    assert_eq!((&traverse["line"], &traverse["n"], &traverse["schema"]), (&1.into(), &"7".into(), &1.into()));
    assert_eq!(find("COMMENT")["arguments"]["text"], "a \"quote\"");
    let diagnostic = lines.iter().find_map(|line| line.get("diagnostic")).unwrap();
    assert_eq!((&diagnostic["code"], &diagnostic["line"]), (&"g-unknown".into(), &3.into()));
    assert_eq!(lines[0]["sequence"], 1);
}
