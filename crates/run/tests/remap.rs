//! Remapped codes and the tool changer of a machine file, on the whole road: check, plan, run.

use pkm_canon::diagnostic::Diagnostic;
use pkm_gcode::ToolTable;
use pkm_machine::{Machine, shipped};
use pkm_run::{Options, Program, Summary, check, check_with, on_a_large_stack, plan, run};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// `hop` goes on in the line it was called in, `corner` calls another remapped code.
const REMAPS: &str = "remap = [\n\
    \"M400 modalgroup=10 argspec=Pq ngc=corner\",\n\
    \"G88.1 modalgroup=1 argspec=XYr ngc=hop\",\n\
    \"M401 argspec=@P ngc=hop_by\",\n\
    \"F argspec=f ngc=feed\",\n]\n";
const SUBS: [(&str, &str); 4] = [
    ("corner", "G1 X#<p>\no1 if [EXISTS[#<q>]]\nM401 P#<q>\no1 endif\nG1 Y#<p>"),
    ("hop", "G0 Z[#<_z>+1]\nG0 X#<x> Y#<y>\nG0 Z[#<_z>-1]"),
    ("hop_by", "G91\nG1 Z#1\nG90"),
    ("feed", "F[#<f>*2]"),
];

/// A machine file with `[program]`, and its subs in a folder of their own.
struct Shop(PathBuf);

impl Shop {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("pkm-run-remap-{name}-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("subs")).expect("a scratch folder");
        let shop = Self(folder);
        for (sub, body) in SUBS {
            shop.sub(sub, body);
        }
        shop
    }

    #[allow(clippy::disallowed_methods)] // Tests may; the program itself writes atomically.
    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).expect("a file");
        path
    }

    fn sub(&self, name: &str, body: &str) {
        self.write(&format!("subs/{name}.ngc"), &format!("o<{name}> sub\n{body}\no<{name}> endsub\n"));
    }

    fn machine(&self, program: &str) -> Machine {
        let text = format!("{}\n[program]\n{program}", shipped::text("xyz").expect("it ships"));
        let path = self.0.join("mine.toml").display().to_string();
        Machine::parse(&path, &text, &[]).unwrap_or_else(|findings| panic!("{findings:?}"))
    }

    fn remapped(&self) -> Machine {
        self.machine(&format!("subroutine_path = [\"subs\"]\n{REMAPS}"))
    }

    /// File, line, code, message and where it was called from, without the folder.
    fn said(&self, findings: &[Diagnostic]) -> Vec<String> {
        let folder = format!("{}/", self.0.display());
        let line = |finding: &Diagnostic| {
            let calls: Vec<String> =
                finding.notes.iter().map(|note| format!(" < {}:{}", note.file, note.line)).collect();
            let Diagnostic { file, line, code, .. } = finding;
            format!("{file}:{line} {code}{}", calls.concat()).replace(&folder, "")
        };
        findings.iter().map(line).collect()
    }
}

impl Drop for Shop {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn piped(text: &str) -> Program {
    Program::Memory { name: "piped".to_owned(), text: text.as_bytes().to_vec() }
}

fn driven(program: &Program, machine: &Machine) -> Summary {
    let go = |_: &_| ControlFlow::Continue(());
    let (summary, _) = run(program, machine, &Options::default(), |_| (), go).expect("it can run");
    assert!(summary.completed, "{:?}", summary.diagnostics);
    summary
}

#[test]
fn a_remapped_code_moves_as_what_its_sub_says() {
    let shop = Shop::new("moves");
    let (machine, plain) = (shop.remapped(), Machine::load("xyz", &[]).expect("it ships"));
    let short = "G21 G90 G94\nF300\nM400 P5\nG88.1 X10 Y20\nG1 X2 M400 P4 Q3\nG1 X0 F150\nM2\n";
    let long = "G21 G90 G94\nF600\nG1 X5\nG1 Y5\nG0 Z1\nG0 X10 Y20\nG0 Z0\nG1 X4\nG91\nG1 Z3\n\
                G90\nG1 Y4\nG1 X2\nF300\nG1 X0\nM2\n";
    on_a_large_stack(|| {
        let wanted = driven(&piped(long), &plain);
        let file = Program::File(shop.write("program.ngc", short));
        for program in [piped(short), file] {
            let found = driven(&program, &machine);
            assert_eq!((found.servo_ticks, found.duration_s), (wanted.servo_ticks, wanted.duration_s));
            assert_eq!(found.path_length_mm, wanted.path_length_mm);
            for (found, wanted) in found.joints.iter().zip(&wanted.joints) {
                assert_eq!(
                    (found.min, found.max, found.steps, found.peak_velocity),
                    (wanted.min, wanted.max, wanted.steps, wanted.peak_velocity)
                );
            }
            let ends = |program: &Program, machine: &Machine| {
                let mut ends = Vec::new();
                let seen = |step: &pkm_run::Programmed<'_>| {
                    let end = step.geometry.at(step.geometry.length()).position;
                    ends.push((end, step.rapid));
                };
                let checked = check_with(program, machine, &Options::default(), seen).expect("readable");
                assert!(checked.diagnostics.is_empty(), "{:?}", checked.diagnostics);
                ends
            };
            assert_eq!(ends(&program, &machine), ends(&piped(long), &plain));
            let duration = |program: &Program, machine: &Machine| {
                plan(program, machine, &Options::default()).expect("readable").duration_s
            };
            assert_eq!(duration(&program, &machine), duration(&piped(long), &plain));
            let planned = plan(&program, &machine, &Options::default()).expect("readable");
            let places: Vec<String> = planned.blocks.iter().map(|block| block.place()).collect();
            let sub = |name: &str, line: u32| format!("{}:{line}", shop.0.join("subs").join(name).display());
            assert_eq!(places[..2], ["line 5", "line 6"], "{places:?}");
            assert!(
                places.contains(&sub("corner.ngc", 2)) && places.contains(&sub("hop.ngc", 3)),
                "{places:?}"
            );
        }
    });
}

#[test]
fn errors_point_into_the_sub_and_at_the_remapped_block() {
    let shop = Shop::new("errors");
    let machine = shop.remapped();
    let said = |text: &str| {
        let checked = check(&piped(text), &machine, &Options::default()).expect("readable");
        shop.said(&checked.diagnostics)
    };
    let far = "F100\nM400 P600\nM2\n";
    let beyond = ["subs/corner.ngc:2 limit_high:1 < piped:2", "subs/corner.ngc:6 limit_high:1 < piped:2"];
    assert_eq!(said(far), beyond);
    assert_eq!(
        said("F100\nM400 P1 Q600\nM2\n"),
        [
            "subs/corner.ngc:6 limit_high:3 < piped:2",
            "subs/hop_by.ngc:3 limit_high:3 < subs/corner.ngc:4 < piped:2"
        ]
    );
    assert_eq!(said("F100\nM400 Q3\nM2\n"), ["piped:2 word-missing"]);
    assert_eq!(said("F100\nM400 P3 D2\nM2\n"), ["piped:2 word-unused"]);
    assert_eq!(said("M402 P3\nM2\n"), ["piped:1 m-unknown"]);
    assert_eq!(said("G88.2 X3\nM2\n"), ["piped:1 g-unknown"]);
    // What no run comes to is read too, and knows the codes and the names of their words.
    assert_eq!(said("o1 if [0]\nG88.1 X1 Y2\nM400 P3\no1 endif\nM2\n"), [""; 0]);
    shop.sub("hop", "o7 while [1]\nG0 X#<x>\nG0 Y#<z>\no7 endwhile");
    shop.sub("hop_by", "o1 if [EXISTS[#<_hal[motion.x]>]]\nG1 Z#<_hal[motion.x]>\no1 endif");
    assert_eq!(said("M401 P1\nM2\n"), ["subs/hop_by.ngc:3 param-elsewhere"]);
    assert_eq!(
        said("o1 if [0]\nG88.1 X1 Y2\no1 endif\nM2\n"),
        ["subs/hop.ngc:2 endless-loop", "subs/hop.ngc:4 param-undefined"]
    );
}

#[test]
fn a_sub_that_calls_its_own_code_for_ever_is_stopped() {
    let shop = Shop::new("recursion");
    let machine = shop.remapped();
    shop.sub("corner", "M400 P1");
    let checked = check(&piped("M400 P1\nM2\n"), &machine, &Options::default()).expect("readable");
    assert_eq!(shop.said(&checked.diagnostics), ["subs/corner.ngc:2 o-depth < piped:1"]);
}

#[test]
fn a_sub_without_a_file_is_told_at_its_line_of_the_machine_file() {
    let shop = Shop::new("missing");
    let machine = shop.machine("subroutine_path = [\"none\"]\nremap = [\n  \"M400 ngc=corner\",\n]\n");
    let lines = shipped::text("xyz").expect("it ships").lines().count() as u32;
    let program = Program::File(shop.write("program.ngc", "M2\n"));
    let refused = check(&program, &machine, &Options::default()).expect_err("the sub has no file");
    assert_eq!(shop.said(std::slice::from_ref(&refused)), [format!("mine.toml:{} machine-remap", lines + 5)]);
    assert!(refused.message.contains("no file corner.ngc") && refused.help.is_some(), "{refused:?}");
    // Beside the program it is found, as LinuxCNC finds it.
    shop.write("corner.ngc", "o<corner> sub\nG0 X1\no<corner> endsub\n");
    assert!(check(&program, &machine, &Options::default()).is_ok());
    assert!(check(&piped("M2\n"), &machine, &Options::default()).is_err());
}

#[test]
fn a_program_may_begin_behind_its_remapped_codes() {
    let shop = Shop::new("start");
    let machine = shop.remapped();
    shop.sub("corner", "G1 X#<p>\nG20");
    let options = Options { start_line: Some(3), ..Options::default() };
    let mut ends = Vec::new();
    let text = "G21 G90 G94 F200\nM400 P5\nG1 X1\nM2\n";
    let checked = check_with(&piped(text), &machine, &options, |step| {
        ends.push(step.geometry.at(step.geometry.length()).position[0]);
    });
    assert!(!checked.expect("readable").has_errors());
    // What the sub sets holds, where it goes does not.
    assert_eq!(ends, [25.4]);
}

#[test]
fn a_random_tool_changer_exchanges_tools() {
    let shop = Shop::new("tools");
    let table = ToolTable::parse(b"T5 P1 Z3\nT6 P2 Z4\n", |_, _| {}).expect("a table");
    let options = Options { tools: Some(Box::leak(Box::new(table))), ..Options::default() };
    let ends = |text: &str, random: bool| {
        let machine = shop.machine(&format!("random_tool_changer = {random}\n"));
        let mut ends = Vec::new();
        let checked = check_with(&piped(text), &machine, &options, |step| {
            ends.push(step.geometry.at(step.geometry.length()).position[0]);
        });
        (ends, shop.said(&checked.expect("readable").diagnostics))
    };
    // A spindle without a tool has number -1, or 0.
    let (own, none) = ("G0 X#5400\nT5 M6\nG0 X#5400\nM2\n", Vec::<String>::new());
    assert_eq!(ends(own, true), (vec![-1.0, 5.0], none.clone()));
    assert_eq!(ends(own, false).0.last(), Some(&5.0));
    // Tool 0 is a tool like any other.
    assert_eq!(ends("T0 M6\nM2\n", true).1, ["piped:1 tool-unknown"]);
    assert_eq!(ends("T0 M6\nM2\n", false).1, none);
}
