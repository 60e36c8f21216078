//! `[[switch]]` tables and the checks of a switch.

use pkm_canon::diagnostic::Diagnostic;
use pkm_kins::{Joints, Kinematics, Mechanism, OxForm, Pose, Spindle};
use pkm_machine::{Machine, SwitchTarget, shipped};

const H: SwitchTarget = SwitchTarget::Mechanism(Spindle::H);
const V: SwitchTarget = SwitchTarget::Mechanism(Spindle::V);
const O: SwitchTarget = SwitchTarget::Form(OxForm::O);
const X: SwitchTarget = SwitchTarget::Form(OxForm::X);

fn load(name: &str, overrides: &[&str]) -> Machine {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Machine::load(name, &overrides).unwrap_or_else(|findings| panic!("{name}: {findings:?}"))
}

fn at(machine: &Machine, pose: &Pose) -> Joints {
    machine.mechanism.inverse(pose).expect("in reach")
}

#[test]
fn shipped_machines_have_their_codes() {
    for name in ["hv-mill-6", "hv-mill-7"] {
        let machine = load(name, &[]);
        assert_eq!([428, 429, 430].map(|code| machine.switch_of(code)), [Some(H), Some(V), None]);
    }
    for name in ["ox-glide-o", "ox-glide-x"] {
        let machine = load(name, &[]);
        assert_eq!([450, 451, 428].map(|code| machine.switch_of(code)), [Some(O), Some(X), None]);
    }
    assert!(load("moma-a", &[]).switches.is_empty());
}

#[test]
fn bad_tables_are_refused_at_their_place() {
    // (machine, text to replace, replacement, code, word under the marker)
    let cases = [
        ("hv-mill-7", "code = 429", "code = 428", "machine-switch", "428"),
        ("hv-mill-7", "code = 429", "code = 99", "machine-switch", "99"),
        ("hv-mill-7", "code = 429", "code = 1000", "machine-switch", "1000"),
        ("hv-mill-7", "code = 429", "code = -9223372036854775808", "machine-switch", "-9223372036854775808"),
        ("hv-mill-7", "code = 429", "code = 4.5", "machine-wrong-type", "4.5"),
        ("hv-mill-7", "code = 429", "kode = 429", "machine-unknown-key", "kode"),
        ("hv-mill-7", "to = \"V\"", "to = \"X\"", "machine-switch", "\"X\""),
        ("hv-mill-7", "to = \"V\"", "", "machine-missing-key", "[[switch]]"),
        ("ox-glide-o", "to = \"X\"", "to = \"V\"", "machine-switch", "\"V\""),
        ("moma-a", "[home]", "[[switch]]\ncode = 428\nto = \"H\"\n[home]", "machine-switch", "[[switch]]"),
    ];
    for (machine, from, to, code, word) in cases {
        let text = shipped::text(machine).unwrap().replacen(from, to, 1);
        let findings: Vec<Diagnostic> = Machine::parse("test.toml", &text, &[]).expect_err("refused");
        let [finding] = findings.as_slice() else { panic!("{to}: {findings:?}") };
        assert_eq!(finding.code, code, "{finding:?}");
        let line = text.lines().nth(finding.line as usize - 1).unwrap();
        assert_eq!(&line[finding.column as usize - 1..finding.end_column as usize - 1], word, "{finding:?}");
    }
    let nine: String = (0..9).map(|n| format!("[[switch]]\ncode = {}\nto = \"H\"\n", 500 + n)).collect();
    let text = shipped::text("hv-mill-7").unwrap();
    let first = text.find("[[switch]]").unwrap();
    let home = text.find("[home]").unwrap();
    let text = format!("{}{nine}{}", &text[..first], &text[home..]);
    let findings = Machine::parse("test.toml", &text, &[]).expect_err("refused");
    assert_eq!(findings[0].code, "machine-switch", "{findings:?}");
}

#[test]
fn the_idle_mechanism_holds() {
    let machine = load("hv-mill-7", &[]);
    let pose = Pose { x: 31.0, y: -17.0, z: 123.0, b: 0.25, ..Pose::ZERO };
    let joints = at(&machine, &pose);
    let to_v = machine.switch(&machine.mechanism, V, &joints, &pose).unwrap();
    assert_eq!(to_v.joints, joints, "nothing moves");
    assert_eq!((to_v.pose.x, to_v.pose.y, to_v.pose.z), (31.0, -17.0, 123.0), "coordinates of H stay");
    // The table's angle is C now, and B the head's, which stands at 0.
    assert!((to_v.pose.c - 0.25).abs() < 1e-12 && to_v.pose.b == 0.0, "{:?}", to_v.pose);
    // However V moves, H1 and H2 stand where they stood.
    let moved = Pose { u: 20.0, v: 30.0, w: -10.0, b: 0.1, c: -0.5, ..to_v.pose };
    let v_joints = to_v.mechanism.inverse(&moved).unwrap();
    assert_eq!(v_joints[..2], joints[..2]);
    assert!(v_joints[2..7].iter().zip(&joints[2..7]).all(|(a, b)| a != b), "the others moved");
    // And back: V1, V2 and the head stand where V left them.
    let to_h = machine.switch(&to_v.mechanism, H, &v_joints, &moved).unwrap();
    assert_eq!(to_h.joints, v_joints);
    let moved = Pose { x: 3.0, y: 4.0, z: 100.0, b: 0.3, ..to_h.pose };
    let h_joints = to_h.mechanism.inverse(&moved).unwrap();
    assert_eq!((h_joints[2], h_joints[3], h_joints[6]), (v_joints[2], v_joints[3], v_joints[6]));
}

#[test]
fn switching_to_the_active_one_changes_nothing() {
    let machine = load("hv-mill-6", &[]);
    let (pose, joints) = (machine.home, at(&machine, &machine.home));
    let same = machine.switch(&machine.mechanism, H, &joints, &pose).unwrap();
    assert_eq!((same.mechanism, same.pose, same.joints), (machine.mechanism, pose, joints));
    let machine = load("ox-glide-x", &[]);
    let joints = at(&machine, &machine.home);
    assert_eq!(machine.switch(&machine.mechanism, X, &joints, &machine.home).unwrap().joints, joints);
    assert_eq!(machine.switch(&machine.mechanism, V, &joints, &machine.home).unwrap_err().code, "switch");
}

#[test]
fn a_switch_without_reach_is_refused() {
    let code = |overrides: &[&str]| {
        let machine = load("hv-mill-7", overrides);
        let joints = at(&machine, &machine.home);
        machine.switch(&machine.mechanism, V, &joints, &machine.home).map(|_| ()).unwrap_err().code
    };
    // V at rest is no state of the working mode that the file asks for.
    assert_eq!(
        code(&["kinematics.v.rest_mm=[0, 200]", "kinematics.v.mechanism.l_mm=[195, 90]"]),
        "working_mode:2"
    );
    // A pose, but outside the range of an axis.
    assert_eq!(code(&["axis.v.min_mm=100", "axis.v.max_mm=150", "home.v=120"]), "axis_limit_low:V");
    // A pose, but nearer to a singularity than the guard.
    assert_eq!(code(&["singularity.guard=0.7", "kinematics.v.rest_mm=[30, 170]"]), "singular");
}

#[test]
fn a_form_switch_needs_room_on_the_rails() {
    let machine = load("ox-glide-o", &[]);
    let switch = |pose: Pose| machine.switch(&machine.mechanism, X, &at(&machine, &pose), &pose);
    let home = machine.home;
    let there = switch(home).unwrap();
    // x and z stay, c changes its sign: AB and CD change places about x ± s/2.
    let joints = at(&machine, &home);
    let c = home.x - 10.0 - joints[0];
    assert!((there.joints[0] - (home.x - 10.0 + c)).abs() < 1e-9, "{there:?}");
    assert!((there.joints[1] - (home.x + 10.0 - c)).abs() < 1e-9, "{there:?}");
    assert_eq!(there.joints[2], joints[2]);
    assert!((there.pose.y - home.y).abs() < 1e-9);
    assert!(matches!(there.mechanism, Mechanism::OxGlide(glide) if glide.form() == OxForm::X));
    // In O the sliders at x ∓ (s/2 + c) need more rail than in X; near its end only X fits, and there is no way back.
    let x_machine = load("ox-glide-x", &[]);
    let edge = Pose { x: 45.0, y: 60.0, z: 100.0, ..Pose::ZERO };
    let joints = at(&x_machine, &edge);
    assert!(x_machine.check_travel(&joints).is_ok());
    let refusal = x_machine.switch(&x_machine.mechanism, O, &joints, &edge).unwrap_err();
    assert_eq!((refusal.code.as_str(), refusal.joint.as_deref()), ("limit_low:AB", Some("AB")));
    // Nearer to c = 0 than the guard of 2 mm.
    let y = (80.0_f64 * 80.0 - 1.9 * 1.9).sqrt();
    assert_eq!(switch(Pose { y, ..home }).unwrap_err().code, "singular:form_switch");
    let y = (80.0_f64 * 80.0 - 2.1 * 2.1).sqrt();
    assert!(switch(Pose { y, ..home }).is_ok());
    // y passes the links' length on the way.
    let machine = load("ox-glide-o", &["axis.y.min_mm=60", "axis.y.max_mm=79.9"]);
    let refusal = machine.switch(&machine.mechanism, X, &at(&machine, &home), &home).unwrap_err();
    assert_eq!(refusal.code, "axis_limit_high:Y");
}
