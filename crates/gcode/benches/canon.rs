//! The speed table: this interpreter, its text written to a file, against LinuxCNC's `rs274 -g FILE OUT`, same machine,
//! same run, CPU time (user and system), and the largest resident memory.
//!
//! `cargo bench -p pkm-gcode --bench canon`; with `-- --small` a tenth of every program. Without `rs274` its columns stay
//! empty. Needs `/usr/bin/time` (GNU) and Linux.
#![allow(clippy::print_stdout, clippy::disallowed_methods, missing_docs)]

use pkm_canon::text::{Spelling, TextWriter};
use pkm_gcode::{FileSource, Settings, ToolTable, canon_text};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::Command;

/// Interprets one program; the bench runs itself with these arguments, so that time and memory are of one program alone.
fn interpret(program: &Path, output: &Path) {
    let mut source = FileSource::open(program, Vec::new()).expect("the program");
    let mut file = BufWriter::with_capacity(1 << 16, File::create(output).expect("a writable folder"));
    let mut write = |bytes: &[u8]| file.write_all(bytes).expect("room for the output");
    let mut writer = TextWriter::new(&mut write, Spelling::V2_9);
    canon_text(Settings::rs274(), ToolTable::default(), &mut source, &mut writer, |error, line| {
        panic!("{error}: {}", String::from_utf8_lossy(line))
    });
    file.flush().expect("room for the output");
}

/// CPU seconds and KiB of a command.
fn measure(command: &[&str], directory: &Path) -> Option<(f64, u64)> {
    let figures = directory.join("time.txt");
    let status = Command::new("timeout")
        .args(["120", "/usr/bin/time", "-o", figures.to_str()?, "-f", "%U %S %M"])
        .args(command)
        .current_dir(directory)
        // Where rs274 keeps its map of the tools.
        .env("HOME", directory)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .status();
    if !status.is_ok_and(|status| status.success()) {
        return None;
    }
    let text = std::fs::read_to_string(figures).ok()?;
    let mut figures = text.split_whitespace();
    let mut next = || figures.next()?.parse::<f64>().ok();
    let (user, system, kib) = (next()?, next()?, next()?);
    Some((user + system, kib as u64))
}

fn programs(scale: u32) -> [(&'static str, String); 4] {
    let mut lines = String::from("G21 F1000\n");
    for i in 0..1_000_000 / scale {
        let _ = writeln!(lines, "G1 X{}.{:03} Y{}.{:03}", i % 300, i % 1000, i % 170, (i * 7) % 1000);
    }
    let mut arcs = String::from("G21 F1000\nG0 X0 Y0\n");
    for i in 0..200_000 / scale {
        let _ = writeln!(arcs, "{} X{} Y0 I5 J0", if i % 2 == 0 { "G2" } else { "G3" }, 10 * ((i + 1) % 2));
        if i % 2 == 1 {
            arcs.truncate(arcs.rfind(" X").unwrap_or(arcs.len()));
            arcs.push_str(" X0 Y0 I-5 J0\n");
        }
    }
    let count = 300_000 / scale;
    let while_loop = format!(
        "G21 F1000\n#1=0\no1 while [#1 lt {count}]\n#1=[#1+1]\nG1 X[SIN[#1]*10] Y[#1 mod 100]\no1 endwhile\n"
    );
    let calls = format!(
        "G21 F1000\no100 sub\nG1 X#1 Y[#2*2]\no100 endsub\n#31=0\no2 repeat [{}]\n#31=[#31+1]\n\
         o100 call [#31 mod 90] [2]\no2 endrepeat\n",
        100_000 / scale
    );
    [("1 M G1 blocks", lines), ("200 k arcs", arcs), ("while loop", while_loop), ("100 k sub calls", calls)]
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, program, output] = arguments.as_slice()
        && flag == "--interpret"
    {
        return interpret(Path::new(program), Path::new(output));
    }
    let scale = if arguments.iter().any(|argument| argument == "--small") { 10 } else { 1 };
    let directory = std::env::temp_dir().join(format!("pkm-bench-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a scratch folder");
    let this = std::env::current_exe().expect("this program");
    let this = this.to_str().expect("a readable path");
    println!(
        "{:<18} {:>9} {:>9} {:>7} {:>10} {:>10}",
        "program", "pkm s", "rs274 s", "ratio", "pkm KiB", "rs274 KiB"
    );
    for (name, mut text) in programs(scale) {
        text.push_str("M2\n");
        std::fs::write(directory.join("program.ngc"), text).expect("room for the program");
        let ours = measure(&[this, "--interpret", "program.ngc", "ours.txt"], &directory);
        let theirs = measure(&["rs274", "-v", "variables", "-g", "program.ngc", "theirs.txt"], &directory);
        let Some((seconds, kib)) = ours else {
            println!("{name:<18} not measured: is /usr/bin/time there?");
            continue;
        };
        match theirs {
            Some((other, other_kib)) => println!(
                "{name:<18} {seconds:>9.2} {other:>9.2} {:>7.1} {kib:>10} {other_kib:>10}",
                other / seconds.max(0.005)
            ),
            None => println!("{name:<18} {seconds:>9.2} {:>9} {:>7} {kib:>10} {:>10}", "-", "-", "-"),
        }
    }
    let _ = std::fs::remove_dir_all(&directory);
}
