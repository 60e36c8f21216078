//! Every shipped machine loads; every bad one is refused with a place and a remedy.

use pkm_canon::diagnostic::Diagnostic;
use pkm_kins::{Axis, Kinematics, maths};
use pkm_machine::{Machine, shipped};

fn load(name: &str, overrides: &[&str]) -> Result<Machine, Vec<Diagnostic>> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Machine::load(name, &overrides)
}

/// moma-a with one piece of its text replaced.
fn moma_a(from: &str, to: &str) -> Result<Machine, Vec<Diagnostic>> {
    let text = shipped::text("moma-a").unwrap();
    assert!(text.contains(from), "moma-a.toml has no {from:?}");
    Machine::parse("test.toml", &text.replacen(from, to, 1), &[])
}

/// The first finding of a machine that must be refused, as `code line:column word`, with the word it underlines.
#[track_caller]
fn refusal(result: Result<Machine, Vec<Diagnostic>>) -> Diagnostic {
    let findings = result.expect_err("the machine was accepted");
    for finding in &findings {
        assert!(!finding.message.is_empty() && finding.message.len() < 500, "{finding:?}");
        assert!(finding.column <= finding.end_column, "{finding:?}");
    }
    findings.into_iter().next().expect("refused without a finding")
}

#[test]
fn every_shipped_machine_loads_under_its_own_name() {
    for (name, text) in shipped::SHIPPED {
        let machine = load(name, &[]).unwrap_or_else(|findings| panic!("{name}: {findings:#?}"));
        assert_eq!(machine.name, *name);
        assert!(!machine.description.is_empty() && !machine.source.is_empty(), "{name}");
        assert!(text.starts_with("# "), "{name} explains itself");
        assert_eq!(machine.joints.len(), machine.mechanism.joint_count());
        assert_eq!(machine.servo_period_ns, 1_000_000);
        let joints = machine.inverse(&machine.home).unwrap();
        machine.forward(&joints, &machine.home).unwrap();
        let measure = machine.mechanism.singularity(&machine.home).unwrap();
        assert!(measure.inverse.min(measure.forward) > machine.singularity.warn, "{name}: {measure:?}");
    }
}

#[test]
fn shipped_machines_have_the_coordinates_and_joints_of_the_table() {
    for (name, axes, joints) in [
        ("moma-a", "XY", "p1 p2"),
        ("moma-d", "XY", "p1 p2"),
        ("moma-4s-u10", "XY", "p1 p2"),
        ("moma-w", "XYZUV", "p1 p2 p3 p4 p5"),
        ("hv-mill-h3", "XYZB", "p1 p2 p3 p4"),
        ("hv-mill-h4", "XYZB", "p1 p2 p3 p4"),
        ("hv-mill-v3", "XYZBC", "p1 p2 p3 p4 p5"),
        ("hv-mill-v5", "XYZBC", "p1 p2 p3 p4 p5"),
        ("hv-mill-6", "XYZBCUVW", "H1 H2 V1 V2 carriage table"),
        ("hv-mill-7", "XYZBCUVW", "H1 H2 V1 V2 carriage table head"),
        ("ox-glide-o", "XYZ", "AB CD Z"),
        ("lambda6", "XYZABC", "l1 l2 l3 l4 l5 l6"),
        ("xyz", "XYZ", "x y z"),
        ("xyzabc", "XYZABC", "x y z a b c"),
    ] {
        let machine = load(name, &[]).unwrap();
        let letters: String = machine.mechanism.axes().iter().map(Axis::letter).collect();
        assert_eq!(letters, axes, "{name}");
        let names: Vec<&str> = machine.joints.iter().map(|joint| joint.name.as_str()).collect();
        assert_eq!(names.join(" "), joints, "{name}");
    }
}

#[test]
fn rotary_joints_are_radians_inside() {
    let machine =
        load("xyzabc", &["joint.3.max_deg=180", "joint.3.max_velocity_deg_s=90", "joint.3.steps_per_deg=10"]);
    let a = &machine.unwrap().joints[3];
    assert_eq!(a.range.max, maths::PI);
    assert_eq!(a.max_velocity, maths::PI / 2.0);
    assert!((a.steps_per_unit - 1800.0 / maths::PI).abs() < 1e-9);
}

#[test]
fn overrides_reach_every_index_and_optional_keys() {
    let machine = load(
        "moma-a",
        &[
            "joint.*.max_velocity_mm_s=50",
            "joint.1.max_acceleration_mm_s2 = 250.0",
            "axis.x.max_velocity_mm_s=20",
            "kinematics.l_mm=[196, 197]",
            "kinematics.l_mm.0=198",
            "driver.model=TMC2209",
            "servo.period_ns=500_000",
        ],
    )
    .unwrap();
    assert_eq!(machine.joints[0].max_velocity, 50.0);
    assert_eq!(machine.joints[1].max_velocity, 50.0);
    assert_eq!(machine.joints[0].max_acceleration, 1000.0);
    assert_eq!(machine.joints[1].max_acceleration, 250.0);
    assert_eq!(machine.axis(Axis::X).unwrap().max_velocity, Some(20.0));
    assert_eq!(machine.joints[0].driver.model, "TMC2209");
    assert_eq!(machine.joints[0].timing.step_length, 200);
    assert_eq!(machine.servo_period_ns, 500_000);
}

#[test]
fn overrides_that_match_nothing_are_refused() {
    for text in [
        "joint.7.min_mm=1",
        "joints.*.min_mm=1",
        "nothing.*=1",
        "name.x=1",
        "joint..min_mm=1",
        "=1",
        "novalue",
    ] {
        let finding = refusal(load("moma-a", &[text]));
        assert_eq!((finding.code.as_str(), finding.file.as_str()), ("machine-override", "--set"), "{text}");
    }
    let finding = refusal(load("moma-a", &["servo.period_ns=1000000", "srvo.period_ns=1"]));
    assert_eq!((finding.code.as_str(), finding.line, finding.column), ("machine-unknown-key", 2, 1));
    let finding = refusal(load("moma-a", &["joint.*.max_velocity_mm_s=nan"]));
    assert_eq!((finding.code.as_str(), finding.file.as_str()), ("machine-not-finite", "--set"));
    assert_eq!((finding.column, finding.end_column), (27, 30));
}

#[test]
fn bad_files_are_refused_at_their_place() {
    // (text to replace, replacement, code, word under the marker)
    let cases = [
        ("max_mm = 200", "max_mm = nan", "machine-not-finite", "nan"),
        ("max_mm = 200", "max_mm = inf", "machine-not-finite", "inf"),
        ("max_mm = 200", "max_mm = -1", "machine-range", "-1"),
        ("max_mm = 200", "max_mm = 1e300", "machine-range", "1e300"),
        ("max_mm = 200", "max_mm = 1e400", "machine-wrong-type", "1e400"),
        ("max_mm = 200", "max_mm = \"far\"", "machine-wrong-type", "\"far\""),
        ("max_mm = 200", "max_deg = 200", "machine-missing-key", "[[joint]]"),
        ("max_mm = 200", "max_mm = 200\nmax_deg = 3", "machine-unit", "3"),
        ("max_mm = 200", "max_mm = 200\nmax_mm = 200", "machine-repeated-key", "max_mm"),
        ("max_mm = 200", "maximum_mm = 200", "machine-unknown-key", "maximum_mm"),
        ("max_velocity_mm_s = 100", "max_velocity_mm_s = 0", "machine-not-positive", "0"),
        ("max_velocity_mm_s = 100", "max_velocity_mm_s = 1000", "machine-step-rate", "1000"),
        ("steps_per_mm = 400", "steps_per_mm = -400", "machine-not-positive", "-400"),
        ("name = \"p2\"", "name = \"p1\"", "machine-repeated-name", "\"p1\""),
        ("name = \"p2\"", "name = \"\"", "machine-name", "\"\""),
        ("l_mm = [195, 195]", "l_mm = [195, 0]", "machine-geometry", "0"),
        ("l_mm = [195, 195]", "l_mm = [nan, 195]", "machine-geometry", "nan"),
        ("l_mm = [195, 195]", "l_mm = [195]", "machine-wrong-type", "[195]"),
        ("assembly = -1", "assembly = 0", "machine-geometry", "0"),
        ("[[-100, 0], [100, 0]]", "[[-400, 0], [400, 0]]", "machine-home", "[home]"),
        ("type = \"moma\"", "type = \"mona\"", "machine-mechanism", "\"mona\""),
        ("type = \"moma\"", "", "machine-missing-key", "[kinematics]"),
        ("period_ns = 1_000_000", "period_ns = 0", "machine-range", "0"),
        ("period_ns = 1_000_000", "period_ns = 1_000_001", "machine-range", "1_000_001"),
        ("period_ns = 1_000_000", "period_ns = 1e6", "machine-wrong-type", "1e6"),
        ("timer_period_ns = 100", "timer_period_ns = -1", "machine-range", "-1"),
        ("blend_tolerance_mm = 0.05", "blend_tolerance_mm = -0.05", "machine-range", "-0.05"),
        ("guard = 0.001", "guard = nan", "machine-not-finite", "nan"),
        ("model = \"DRV8825\"", "model = \"DRV9000\"", "machine-driver", "\"DRV9000\""),
        ("model = \"DRV8825\"", "model = \"DRV8825\"\nstep_length_ns = 500", "machine-driver-timing", "500"),
        ("model = \"DRV8825\"", "", "machine-driver", "[driver]"),
        ("y = -265", "y = -100", "machine-home", "[home]"),
        ("y = -265", "y = nan", "machine-not-finite", "nan"),
        ("y = -265", "y = -265\nz = 0", "machine-axis", "0"),
        ("y = -265", "y = -265\n[axis.z]", "machine-axis", "[axis.z]"),
        ("y = -265", "y = -265\n[axis.q]", "machine-unknown-key", "q"),
        ("y = -265", "y = -265\n[axis.x]\nmin_mm = 0", "machine-missing-key", "0"),
        ("y = -265", "y = -265\n[axis.x]\nmin_mm = 1\nmax_mm = 2", "machine-home", "[home]"),
        ("y = -265", "y = -265\n[[joint]]\nname = \"p3\"", "machine-joint-count", "[[joint]]"),
        ("[servo]", "[servo", "machine-syntax", ""),
        ("name = \"moma-a\"", "", "machine-missing-key", ""),
    ];
    for (from, to, code, word) in cases {
        let finding = refusal(moma_a(from, to));
        assert_eq!(finding.code, code, "{to:?}: {finding:?}");
        assert_eq!(finding.file, "test.toml");
        if !word.is_empty() {
            let text = shipped::text("moma-a").unwrap().replacen(from, to, 1);
            let line = text.lines().nth(finding.line as usize - 1).unwrap();
            let marked = &line[finding.column as usize - 1..finding.end_column as usize - 1];
            assert_eq!(marked, word, "{to:?}: {finding:?}");
        }
    }
}

#[test]
fn a_fault_in_the_second_mechanism_is_shown_there() {
    let text = shipped::text("moma-w").unwrap();
    let second = text.rfind("l_mm = [195, 195]").unwrap();
    let text = format!("{}l_mm = [195, -1]{}", &text[..second], &text[second + "l_mm = [195, 195]".len()..]);
    let finding = refusal(Machine::parse("w.toml", &text, &[]));
    let line = text[..second].matches('\n').count() as u32 + 1;
    assert_eq!(
        (finding.code.as_str(), finding.line, finding.column),
        ("machine-geometry", line, 14),
        "{finding:?}"
    );
}

#[test]
fn a_fault_in_a_nested_table_is_shown_there() {
    let text = shipped::text("hv-mill-7").unwrap();
    let vertical = text.find("[kinematics.v.mechanism]").unwrap();
    let at = vertical + text[vertical..].find("l_mm = [195, 195]").unwrap();
    let text = format!("{}l_mm = [0, 195]{}", &text[..at], &text[at + "l_mm = [195, 195]".len()..]);
    let finding = refusal(Machine::parse("hv.toml", &text, &[]));
    let line = text[..at].matches('\n').count() as u32 + 1;
    assert_eq!(
        (finding.code.as_str(), finding.line, finding.column),
        ("machine-geometry", line, 9),
        "{finding:?}"
    );
}

/// moma-a with another mechanism, six joints and another home.
fn with_kinematics(kinematics: &str, joints: usize, home: &str) -> String {
    let text = shipped::text("moma-a").unwrap();
    let head = &text[..text.find("[kinematics]").unwrap()];
    let joints: String = (1..=joints)
        .map(|n| {
            format!(
                "[[joint]]\nname = \"j{n}\"\nmin_mm = -1000\nmax_mm = 1000\nmax_velocity_mm_s = 100\n\
                 max_acceleration_mm_s2 = 1000\nsteps_per_mm = 100\n"
            )
        })
        .collect();
    format!("{head}[kinematics]\n{kinematics}\n{joints}[home]\n{home}\n")
}

#[test]
fn mechanisms_that_do_not_ship_can_be_written() {
    let delta = "type = \"linear-delta\"\njoint_radius_mm = 105\njoint_length_mm = 217";
    let delta = Machine::parse("delta.toml", &with_kinematics(delta, 3, "z = 10"), &[]).unwrap();
    assert_eq!(delta.mechanism.joint_count(), 3);
    let points = |radius: f64, spread: f64| -> Vec<String> {
        let point = |k: i32| {
            let side = if k % 2 == 0 { -spread } else { spread };
            let angle = maths::radians(120.0 * f64::from(k / 2) + side);
            format!("[{}, {}, 0.0]", radius * maths::cos(angle), radius * maths::sin(angle))
        };
        (0..6).map(point).collect()
    };
    let hexapod = format!(
        "type = \"hexapod\"\nbase_mm = [{}]\nplatform_mm = [{}]\nstart_z_mm = 150",
        points(120.0, 10.0).join(", "),
        points(60.0, 50.0).join(", ")
    );
    let hexapod = Machine::parse("hexapod.toml", &with_kinematics(&hexapod, 6, "z = 150"), &[]).unwrap();
    assert_eq!(hexapod.mechanism.joint_count(), 6);
    let flat = "type = \"linear-delta\"\njoint_radius_mm = 217\njoint_length_mm = 105";
    let finding = refusal(Machine::parse("delta.toml", &with_kinematics(flat, 3, "z = 10"), &[]));
    assert_eq!(finding.code, "machine-geometry");
}

#[test]
fn all_findings_are_collected() {
    let text = shipped::text("moma-a")
        .unwrap()
        .replace("max_mm = 200", "max_mm = nan")
        .replace("y = -265", "y = inf");
    let findings = Machine::parse("test.toml", &text, &[]).unwrap_err();
    assert_eq!(findings.len(), 2, "{findings:#?}"); // home is not judged while the joints are unknown
}

#[test]
fn unreadable_files_are_refused() {
    assert_eq!(refusal(load("no/such/file.toml", &[])).code, "machine-unreadable");
    assert_eq!(refusal(load("/", &[])).code, "machine-unreadable");
    assert_eq!(refusal(Machine::parse("big.toml", &"#".repeat(2 << 20), &[])).code, "machine-too-large");
    assert_eq!(refusal(Machine::parse("empty.toml", "", &[])).code, "machine-missing-key");
    assert_eq!(refusal(Machine::parse("deep.toml", &"[".repeat(1 << 20), &[])).code, "machine-syntax");
    let deep = format!("a = {}", "[".repeat(500_000));
    assert_eq!(refusal(Machine::parse("deep.toml", &deep, &[])).code, "machine-syntax");
    let dotted = format!("{}a = 1", "a.".repeat(400_000));
    refusal(Machine::parse("dotted.toml", &dotted, &[]));
}

#[test]
fn program_says_which_codes_are_remapped() {
    let own = |program: &str| moma_a("[home]", &format!("[program]\n{program}\n[home]"));
    let remaps = "remap = [\"M400 modalgroup=6 argspec=Pq ngc=Corner # its own\", \"t ngc=pick\"]";
    let machine = own(&format!("{remaps}\nsubroutine_path = [\"subs\", \"/nc\"]")).unwrap();
    let subs: Vec<&str> = machine.program.remaps.iter().map(|code| code.remap.sub()).collect();
    assert_eq!(subs, ["corner", "pick"]);
    assert!(!machine.program.random_tool_changer);
    assert!(own("random_tool_changer = true").unwrap().program.random_tool_changer);
    // Folders begin where the machine file is.
    let text = shipped::text("moma-a").unwrap().replacen(
        "[home]",
        "[program]\nsubroutine_path = [\"subs\", \"/nc\"]\n[home]",
        1,
    );
    let machine = Machine::parse("shop/mine.toml", &text, &[]).unwrap();
    let folders: Vec<_> = machine.program.subroutine_path.iter().map(|path| path.to_str().unwrap()).collect();
    assert_eq!(folders, ["shop/subs", "/nc"]);

    for (program, code, said) in [
        ("remap = [\"M400 py=f\"]", "machine-remap", "py=f needs Python"),
        ("remap = [\"M6 prolog=a ngc=b\"]", "machine-remap", "prolog=a needs Python"),
        ("remap = [\"M6 ngc=b epilog=c\"]", "machine-remap", "epilog=c needs Python"),
        ("remap = [\"M400 python=f\"]", "machine-remap", "python=f needs Python"),
        ("remap = [\"M3 ngc=a\"]", "machine-remap", "M3 cannot be remapped"),
        ("remap = [\"M400 argspec=P! ngc=a\"]", "machine-remap", "argspec=P!"),
        ("remap = [\"M400 argspec=P\"]", "machine-remap", "has no ngc="),
        ("remap = [\"\"]", "machine-remap", "nothing is remapped"),
        ("remap = [\"M400 ngc=a\", \"m400 ngc=b\"]", "machine-remap", "remapped already"),
        ("remap = \"M400 ngc=a\"", "machine-wrong-type", "invalid type"),
        ("remaps = []", "machine-unknown-key", "unknown field `remaps`"),
        ("random_tool_changer = 1", "machine-wrong-type", "boolean"),
    ] {
        let finding = refusal(own(program));
        assert_eq!(finding.code, code, "{program}");
        assert!(finding.message.contains(said) && finding.help.is_some(), "{program}: {finding:?}");
        assert!(finding.line > 0 && finding.column > 0, "{program}: {finding:?}");
    }
    // A code has one meaning.
    let both = load("ox-glide-o", &["program.remap=[\"M450 ngc=a\"]"]);
    assert!(refusal(both).message.contains("M450 is a code of the machine's own"));
}
