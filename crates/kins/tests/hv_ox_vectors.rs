//! The example vectors of the HV-Mill and the O-X glide, the switch of the active mechanism and of the form.

mod common;
use common::*;
use pkm_kins::maths::radians;
use pkm_kins::{
    FormSwitchError, HvMachine, HvMachineParameters, HvMill, HvMillParameters, HvState, JointRange,
    Kinematics, OxForm, OxGlide, OxGlideParameters, Pose, Spindle, Turn, delta_t_workpiece,
};
use serde_json::Value;

fn state(row: &[f64]) -> HvState {
    HvState { w: [row[0], row[1], row[2]], table: radians(row[3]), head: radians(row[4]) }
}

fn pose(spindle: Spindle, s: &HvState) -> Pose {
    let [x, y, z] = s.w;
    match spindle {
        Spindle::H => Pose { x, y, z, b: s.table, ..Pose::ZERO },
        Spindle::V => Pose { x, y, z, c: s.table, b: s.head, ..Pose::ZERO },
    }
}

fn mode(name: &str) -> HvMillParameters {
    match name {
        "H3" => HvMillParameters::h(3),
        "H4" => HvMillParameters::h(4),
        "V3" => HvMillParameters::v(3),
        "V4" => HvMillParameters::v(4),
        "V5" => HvMillParameters::v(5),
        _ => {
            let mut p = HvMillParameters::v(5);
            p.table_sense = -1;
            p.head.as_mut().unwrap().head_sense = -1;
            p
        }
    }
}

#[test]
fn val_hv_mill_modes() {
    let data = data("planar-examples.json");
    let table = &data["hv_mill"];
    let ranges =
        [[0.0, 200.0], [0.0, 200.0], [0.0, 400.0], [-1e9, 1e9], [-radians(45.0), radians(45.0)]].map(range);
    for (name, vectors) in table["modes"].as_object().unwrap() {
        let p = mode(name);
        let mill = HvMill::new(&p).unwrap();
        for (i, row) in rows(&vectors["rows"]).iter().enumerate() {
            let row: [f64; 16] = array(row);
            let s = state(&row);
            let what = format!("{name} {row:?}");
            let pose = pose(p.spindle, &s);
            let q = mill.inverse(&pose).unwrap_or_else(|e| panic!("{what}: {e}"));
            let head = if p.spindle == Spindle::V { s.head } else { 0.0 };
            for (actual, expected) in q.iter().zip([row[5], row[6], row[7], s.table, head]) {
                close(*actual, expected, 1e-9, &what);
            }
            let dt = mill.delta_t(&s).unwrap();
            let axis = mill.tool_axis(&s).unwrap();
            for (actual, expected) in dt.iter().chain(&axis).zip(&row[10..16]) {
                close(*actual, *expected, 1e-9, &what);
            }
            // The planar mechanism's own tip.
            let tip = mill.mechanism().planar.forward([row[5], row[6]]).unwrap();
            close(tip[0], row[8], 1e-9, &what);
            close(tip[1], row[9], 1e-9, &what);
            let back = mill.forward(&joints(&[row[5], row[6], row[7], s.table, head]), &Pose::ZERO).unwrap();
            for (actual, expected) in back.to_array().iter().zip(pose.to_array()) {
                close(*actual, expected, 1e-9, &what);
            }
            if let Some(expected) = vectors["jac_of_first_rows"].get(i) {
                let jacobian = mill.jacobian_3x5(&s).unwrap();
                for (actual, expected) in jacobian.iter().zip(rows(expected)) {
                    let expected: [f64; 5] = array(expected);
                    let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                    for (a, e) in actual.iter().zip(expected) {
                        close_rel(*a, e, scale, 1e-9, &what);
                    }
                }
            }
        }
        for row in vectors["bad"].as_array().unwrap_or(&Vec::new()) {
            let pose = pose(p.spindle, &state(&numbers(row)));
            one_of(inverse_code(&mill, &ranges, &pose), &codes(&row[5]), &format!("{name} bad {row}"));
        }
    }
}

#[test]
fn val_both_axes_on_the_workpiece() {
    let data = data("planar-examples.json");
    let turn = |v: &Value| match v.as_str().unwrap() {
        "x" => Turn::X,
        "y" => Turn::Y,
        _ => Turn::Z,
    };
    for row in rows(&data["hv_mill"]["delta_t_both_on_workpiece"]["rows"]) {
        let (w0, w, c): ([f64; 3], [f64; 3], [f64; 3]) = (array(&row[4]), array(&row[5]), array(&row[6]));
        let a = [w0[0] + w[0], w0[1] + w[1], w0[2] + w[2]];
        let found = delta_t_workpiece(
            (turn(&row[0]), radians(number(&row[1]))),
            (turn(&row[2]), radians(number(&row[3]))),
            a,
            c,
        );
        for (a, e) in found.iter().zip(array::<3>(&row[7])) {
            close(*a, e, 1e-9, "delta_t");
        }
    }
}

#[test]
fn t_rot_both_ways() {
    let data = data("planar-examples.json");
    for (spindle, name) in [(Spindle::V, "V"), (Spindle::H, "H")] {
        let matrix = &data["hv_mill"]["T_rot"][name];
        let q = [1.5, -2.5, 4.0];
        let b = spindle.from_q(q);
        for (i, row) in rows(matrix).iter().enumerate() {
            let row: [f64; 3] = array(row);
            assert_eq!(b[i], row[0] * q[0] + row[1] * q[1] + row[2] * q[2]);
        }
        assert_eq!(spindle.to_q(b), q);
    }
}

#[test]
fn locked_axes_are_refused() {
    let h3 = HvMill::new(&HvMillParameters::h(3)).unwrap();
    let turned = Pose { b: 0.1, ..Pose::ZERO };
    assert_eq!(h3.inverse(&turned).unwrap_err().code().to_string(), "axis_locked:B");
    let p = h3.inverse(&Pose::ZERO).unwrap();
    let turned = joints(&[p[0], p[1], p[2], 0.1]);
    assert_eq!(h3.forward(&turned, &Pose::ZERO).unwrap_err().code().to_string(), "joint_locked:4");
    HvMill::new(&HvMillParameters::h(5)).unwrap_err();
}

#[test]
fn switching_the_active_mechanism_holds_the_idle_one() {
    for (p, count) in [(HvMachineParameters::six(), 6), (HvMachineParameters::seven(), 7)] {
        let machine = HvMachine::new(&p).unwrap();
        assert_eq!((machine.joint_count(), machine.active()), (count, Spindle::H));
        let h4 = HvMill::new(&HvMillParameters::h(4)).unwrap();
        let start = Pose { x: 20.0, y: -10.0, z: 30.0, b: 0.2, ..Pose::ZERO };
        let q = machine.inverse(&start).unwrap();
        let alone = h4.inverse(&start).unwrap();
        assert_eq!([q[0], q[1], q[4], q[5]], [alone[0], alone[1], alone[2], alone[3]]);
        assert_eq!([q[2], q[3]], p.v.rest_mm);

        let (vertical, pose) = machine.switch(Spindle::V, &q, &start).unwrap();
        // Nothing moves, and the new pose belongs to the same joints.
        assert_eq!(vertical.active(), Spindle::V);
        let again = vertical.inverse(&pose).unwrap();
        for (a, e) in again.iter().zip(q) {
            close(*a, e, 1e-9, "joints after the switch");
        }
        assert_eq!((pose.x, pose.y, pose.z), (start.x, start.y, start.z));
        // Moving V holds H.
        let moved = vertical.inverse(&Pose { u: pose.u + 1.0, ..pose }).unwrap();
        assert_eq!([moved[0], moved[1]], [q[0], q[1]]);
        assert_ne!(moved[2], q[2]);
        let idle = Pose { x: 1.0, ..Pose::ZERO };
        let error = vertical.motion(&pose, &idle, &Pose::ZERO).unwrap_err();
        assert_eq!(error.to_string(), "axis X does not move in this mode of the machine; it must be 0");
        // An impossible rest position of the other mechanism refuses the switch.
        let mut far = q;
        far[2] = 1e4;
        vertical.switch(Spindle::H, &far, &pose).unwrap();
        machine.switch(Spindle::V, &far, &start).unwrap_err();
    }
}

fn ox(form: OxForm) -> (OxGlide, [JointRange; 3]) {
    (OxGlide::new(&form.into()).unwrap(), [[0.0, 130.0], [0.0, 130.0], [0.0, 200.0]].map(range))
}

#[test]
fn val_ox_glide() {
    let data = data("planar-examples.json");
    for (name, form) in [("O", OxForm::O), ("X", OxForm::X)] {
        let (glide, ranges) = ox(form);
        let vectors = &data["ox_glide"]["forms"][name];
        for row in rows(&vectors["rows"]) {
            let row: [f64; 9] = array(row);
            let what = format!("{name} {row:?}");
            let pose = Pose { x: row[0], y: row[1], z: row[2], ..Pose::ZERO };
            let q = glide.inverse(&pose).unwrap();
            for (a, e) in q.iter().zip(&row[3..6]) {
                close(*a, *e, 1e-9, &what);
            }
            let back = glide.forward(&joints(&row[3..6]), &Pose::ZERO).unwrap();
            for (a, e) in back.to_array().iter().zip(pose.to_array()) {
                close(*a, e, 1e-9, &what);
            }
            let j = glide.jacobian(&pose).unwrap();
            assert_eq!((j[0][0], j[1][0], j[2][2]), (1.0, 1.0, 1.0));
            close_rel(j[0][1], row[6], row[6], 1e-9, &what);
            close_rel(j[1][1], row[7], row[7], 1e-9, &what);
            close_rel(j[1][1] - j[0][1], row[8], row[8], 1e-9, &what);
        }
        for row in rows(&vectors["ik_bad"]) {
            let [x, y, z] = [&row[0], &row[1], &row[2]].map(number);
            let pose = Pose { x, y, z, ..Pose::ZERO };
            one_of(inverse_code(&glide, &ranges, &pose), &codes(&row[3]), &format!("{name} {row}"));
        }
        for row in rows(&vectors["fk_bad"]) {
            let q = [number(&row[0]), number(&row[1])];
            one_of(forward_code(&glide, &ranges, &q), &codes(&row[2]), &format!("{name} {row}"));
        }
        for row in rows(&data["ox_glide"]["singular"]) {
            let Some(ab) = row["xAB"].as_f64() else { continue };
            let q = joints(&[ab, number(&row["xCD"])]);
            assert_eq!(glide.forward(&q, &Pose::ZERO).unwrap_err().code().to_string(), "singular");
            let pose = xy(number(&row["xT"]), number(&row["yT"]));
            let found = glide.inverse(&pose).unwrap();
            close(found[0], q[0], 1e-5, name);
            close(found[1], q[1], 1e-5, name);
            assert_eq!(glide.jacobian(&pose).unwrap_err().code().to_string(), "singular:form_switch");
            let unguarded = glide.without_limits();
            assert_eq!(unguarded.jacobian(&pose).unwrap_err().code().to_string(), "singular");
        }
    }
}

#[test]
fn the_form_switch_is_a_checked_joint_move() {
    let (o, ranges) = ox(OxForm::O);
    let pose = Pose { x: 65.0, y: 64.0, z: 10.0, ..Pose::ZERO };
    let q = o.inverse(&pose).unwrap();
    let switch = o.form_switch(&q, &ranges).unwrap();
    assert_eq!(switch.machine.form(), OxForm::X);
    assert_eq!(switch.joints[..3], [103.0, 27.0, 10.0]);
    let after = switch.machine.forward(&switch.joints, &pose).unwrap();
    close(after.x, 65.0, 1e-9, "x");
    close(after.y, 64.0, 1e-9, "y");
    // And back again.
    let back = switch.machine.form_switch(&switch.joints, &ranges).unwrap();
    for (a, e) in back.joints.iter().zip(q) {
        close(*a, e, 1e-12, "there and back");
    }
    // Too near to c = 0 to begin with.
    let near = o.inverse(&Pose { y: 79.99, ..pose }).unwrap();
    assert!(matches!(o.form_switch(&near, &ranges), Err(FormSwitchError::TooNear { .. })));
    // X has no room for the O form near the rail's end: x ± (s/2 + c0).
    let (x, _) = ox(OxForm::X);
    let edge = x.inverse(&Pose { x: 40.0, ..pose }).unwrap();
    JointRange::check(&ranges, &edge).unwrap();
    let refused = x.form_switch(&edge, &ranges).unwrap_err();
    assert!(matches!(refused, FormSwitchError::Travel(limit) if limit.joint == 0), "{refused}");
    // Joints of the other form.
    assert!(matches!(x.form_switch(&q, &ranges), Err(FormSwitchError::State(_))));
    let big_guard = OxGlideParameters { c_min_mm: 80.0, ..OxForm::O.into() };
    OxGlide::new(&big_guard).unwrap_err();
}
