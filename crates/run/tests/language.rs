//! What the check of a whole program says when reading and running both find something in one line.

use pkm_canon::diagnostic::Severity;
use pkm_machine::Machine;
use pkm_run::{Options, Program, check, check_language};

fn codes(text: &str) -> Vec<(u32, String)> {
    let program = Program::Memory { name: "program".to_owned(), text: text.as_bytes().to_vec() };
    let checked = check_language(&program, &Options::default()).expect("readable");
    checked.diagnostics.into_iter().map(|found| (found.line, found.code)).collect()
}

fn expect(text: &str, wanted: &[(u32, &str)]) {
    let wanted: Vec<(u32, String)> = wanted.iter().map(|(line, code)| (*line, (*code).to_owned())).collect();
    assert_eq!(codes(text), wanted, "{text}");
}

#[test]
fn a_branch_without_an_end_is_told_beside_its_wrong_condition() {
    expect(
        "G21 G90\nG1 X10 F100\no100 if [#<foo> GT 1]\nG1 X1\nM2\n",
        &[(3, "o-unclosed"), (3, "param-undefined")],
    );
}

#[test]
fn a_branch_that_runs_without_an_end_is_told_beside_what_follows_its_head() {
    expect("o1 if [1] junk\nG0 X1\nM2\n", &[(1, "o-unclosed"), (1, "o-trailing")]);
}

#[test]
fn what_has_no_end_has_swallowed_m2() {
    for head in ["o1 if [0]", "o1 if [1]", "o1 while [0]", "o1 repeat [0]", "o1 do"] {
        expect(&format!("G0 X1\n{head}\nG0 X2\nM2\n"), &[(2, "o-unclosed")]);
    }
    expect("o1 call\nM2\no1 sub\nG0 X2\n", &[(3, "o-unclosed")]);
}

#[test]
fn an_endless_loop_has_no_end_to_miss() {
    expect("o1 while [1]\no1 endwhile\nG0 X1\n", &[(1, "endless-loop")]);
}

#[test]
fn a_machine_says_the_same_and_notes_the_spiral() {
    let machine = Machine::load("xyz", &[]).expect("a shipped machine");
    let said = |text: &str| {
        let program = Program::Memory { name: "program".to_owned(), text: text.as_bytes().to_vec() };
        check(&program, &machine, &Options::default()).expect("readable").diagnostics
    };
    let found = said("G21 G90\nG1 X10 F100\no100 if [#<foo> GT 1]\nG1 X1\nM2\n");
    let codes: Vec<_> = found.iter().map(|found| (found.line, found.code.as_str())).collect();
    assert_eq!(codes, [(3, "o-unclosed"), (3, "param-undefined")]);
    let found = said("G21 G91\nF100\nG2 X2 I1\nG2 X2.01 I1\nM2\n");
    let spirals: Vec<_> = found.iter().filter(|found| found.code == "arc-spiral").collect();
    assert!(spirals.iter().all(|found| found.severity == Severity::Note), "{spirals:?}");
    assert_eq!(spirals.iter().map(|found| found.line).collect::<Vec<_>>(), [4], "{found:?}");
}
