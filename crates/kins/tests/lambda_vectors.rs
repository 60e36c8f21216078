//! The example vectors of the Lambda machine (`tests/data/lambda-examples.json`).

mod common;
use common::*;
use pkm_kins::maths::radians;
use pkm_kins::{JointRange, Kinematics, Lambda6, Lambda6Parameters, Lambda6Set, Mechanism, Pose};
use serde_json::Value;

fn set(name: &Value) -> Lambda6Parameters {
    let index = ["paper", "yaw45", "asym45", "alt45", "wide"].iter().position(|n| name == n).unwrap();
    Lambda6Set::ALL[index].into()
}

fn machine(name: &Value) -> Lambda6 {
    Lambda6::new(&set(name)).unwrap()
}

fn pose(value: &Value) -> Pose {
    let [x, y, z, a, b, c] = array(value);
    Pose { x, y, z, a, b, c, ..Pose::ZERO }
}

fn ranges(name: &Value) -> [JointRange; 6] {
    [if name == "wide" { range([-1e6, 1e6]) } else { range([100.0, 2000.0]) }; 6]
}

fn matrix(value: &Value) -> Vec<[f64; 6]> {
    rows(value).iter().map(array).collect()
}

#[test]
fn the_sets_are_those_of_the_vectors() {
    let data = data("lambda-examples.json");
    for (name, expected) in data["meta"]["sets"].as_object().unwrap() {
        let p = set(&Value::from(name.as_str()));
        assert_eq!(p.base_radius_mm, number(&expected["C"]));
        assert_eq!(p.platform_radius_mm, number(&expected["D"]));
        assert_eq!(p.c_mm, array::<3>(&expected["c"]));
        assert_eq!(p.r_mm, array::<3>(&expected["r"]));
        assert_eq!(p.u_mm, array::<3>(&expected["u"]));
        assert_eq!(p.yaw_offset_deg, number(&expected["yaw_offset_deg"]));
        assert_eq!(p.sigma_min, number(&expected["sigma_min"]));
        if let Some(spacing) = p.spacing_mm {
            let limits = &expected["limits"];
            assert_eq!(spacing, [number(&limits["spacing_min"]), number(&limits["spacing_max"])]);
        }
    }
}

#[test]
fn val_poses() {
    let data = data("lambda-examples.json");
    for row in rows(&data["poses"]) {
        let what = row["id"].as_str().unwrap();
        let limited = machine(&row["set"]);
        let free = limited.without_limits();
        let p = pose(&row["pose"]);
        let expected: [f64; 6] = array(&row["joints"]);
        let found = free.inverse(&p).unwrap_or_else(|e| panic!("{what}: {e}"));
        for (a, e) in found.iter().zip(expected) {
            close(*a, e, 1e-9, what);
        }
        let violations = codes(&row["violations"]);
        let spacing = Mechanism::from(limited).coupled_limits(&joints(&expected)).err();
        let listed = violations.iter().find(|code| code.starts_with("spacing")).cloned();
        assert_eq!(spacing.map(|error| error.code().to_string()), listed, "{what}");
        let code = inverse_code(&limited, &ranges(&row["set"]), &p);
        match violations.is_empty() {
            true => assert_eq!(code, None, "{what}"),
            false => one_of(code, &violations, what),
        }
        let sigma = number(&row["sigma"]);
        close(free.sigma(&p).unwrap(), sigma, 1e-10, what);
        close(free.singularity(&p).unwrap().forward, sigma.abs(), 1e-10, what);

        let twist = free.twist_jacobian(&p).unwrap();
        let full = free.jacobian(&p).unwrap();
        let compare = |found: &dyn Fn(usize, usize) -> f64, expected: &Value| {
            if expected.is_null() {
                return;
            }
            let expected = matrix(expected);
            let scale = expected.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (r, row) in expected.iter().enumerate() {
                for (c, e) in row.iter().enumerate() {
                    close_rel(found(r, c), *e, scale, 1e-9, what);
                }
            }
        };
        compare(&|r, c| twist[r][c], &row["jac_twist"]);
        compare(&|r, c| full[r][c], &row["jac_pose"]);
        let det = determinant(twist.iter().map(|r| r.to_vec()).collect());
        close_rel(det, number(&row["det_twist_mm3"]), det, 1e-8, what);
        let det = determinant(full[..6].iter().map(|r| r[..6].to_vec()).collect());
        close_rel(det, number(&row["det_pose_mm3"]), det, 1e-8, what);

        let dexterity = Mechanism::from(free).dexterity(&p).unwrap();
        close_rel(dexterity.determinant, det, det, 1e-9, what);
        close_rel(dexterity.condition, number(&row["cond"]), dexterity.condition, 1e-7, what);

        // Forward: every assembly, and the one a seed on the right side asks for.
        let all = free.forward_all(&joints(&expected)).unwrap();
        assert_eq!(all.as_slice().len() as f64, number(&row["fk_real_count"]), "{what}");
        if sigma.abs() >= 0.1 {
            let seed = Pose { x: p.x + 0.02, y: p.y - 0.02, c: p.c + 2e-4, ..p };
            same_pose(&free.forward(&joints(&expected), &seed).unwrap(), &p, what);
            let branches = free.forward_branches(&joints(&expected), &seed).unwrap();
            assert_eq!(branches.as_slice().len(), all.as_slice().len(), "{what}");
        }
    }
}

fn same_pose(found: &Pose, expected: &Pose, what: &str) {
    for (i, (a, e)) in found.to_array().iter().zip(expected.to_array()).enumerate() {
        close(*a, e, if (3..6).contains(&i) { 1e-9 } else { 1e-6 }, what);
    }
}

#[test]
fn val_forward_from_joints() {
    let data = data("lambda-examples.json");
    for row in rows(&data["fk_from_joints"]) {
        let what = row["id"].as_str().unwrap();
        let p = Lambda6Parameters { assembly: number(&row["assembly"]) as i8, ..set(&row["set"]) };
        let machine = Lambda6::new(&p).unwrap();
        let q = joints(&numbers(&row["joints"]));
        same_pose(&machine.forward(&q, &Pose::ZERO).unwrap(), &pose(&row["pose"]), what);
        let all = machine.forward_all(&q).unwrap();
        let expected = rows(&row["all_poses"]);
        assert_eq!(all.as_slice().len(), expected.len(), "{what}");
        for ((found, sigma), (e, s)) in
            all.as_slice().iter().zip(expected.iter().zip(rows(&row["all_sigma"])))
        {
            same_pose(found, &pose(e), what);
            close(*sigma, number(s), 1e-8, what);
        }
    }
}

#[test]
fn val_unreachable_singular_and_invalid() {
    let data = data("lambda-examples.json");
    for row in rows(&data["unreachable"]) {
        let code = inverse_code(&machine(&row["set"]), &ranges(&row["set"]), &pose(&row["pose"]));
        one_of(code, &codes(&row["violations"]), row["id"].as_str().unwrap());
    }
    for row in rows(&data["singular"]) {
        let machine = machine(&row["set"]);
        let q = machine.inverse(&pose(&row["pose"])).unwrap();
        let expected: [f64; 6] = array(&row["joints"]);
        for (a, e) in q.iter().zip(expected) {
            close(*a, e, 1e-9, "singular");
        }
        close(machine.sigma(&pose(&row["pose"])).unwrap(), 0.0, 1e-10, "singular");
        let code = machine.forward(&q, &pose(&row["pose"])).unwrap_err().code().to_string();
        assert!(code == "singular" || code == "no_assembly", "{code}");
    }
    for row in rows(&data["fk_invalid"]) {
        let error = machine(&row["set"]).forward(&joints(&numbers(&row["joints"])), &Pose::ZERO).unwrap_err();
        assert_eq!(error.code().to_string(), row["error"].as_str().unwrap());
    }
}

#[test]
fn val_home_of_yaw45_and_table_1() {
    let yaw45 = machine(&"yaw45".into());
    let q = yaw45.inverse(&Pose { z: -1500.0, ..Pose::ZERO }).unwrap();
    for (i, a) in q[..6].iter().enumerate() {
        close(*a, if i < 3 { 362.342728 } else { 1697.742204 }, 1e-6, "home");
    }
    close(yaw45.sigma(&Pose { z: -1500.0, ..Pose::ZERO }).unwrap(), 2.251572, 1e-6, "home");
    // The same joints belong to the paper's layout turned by 45°.
    let turned = Pose { z: -1500.0, c: radians(45.0), ..Pose::ZERO };
    let same = machine(&"paper".into()).inverse(&turned).unwrap();
    for (a, e) in q.iter().zip(same) {
        close(*a, e, 1e-9, "paper");
    }
    // Table I of [L6]: both real poses of each set reproduce the published joints.
    let data = data("lambda-examples.json");
    for (experiment, table) in data["table1"].as_object().unwrap() {
        let published = joints(&numbers(&table["joints_published_mm"]));
        for (name, both) in table["poses"].as_object().unwrap() {
            let machine = machine(&name.as_str().into()).without_limits();
            let all = machine.forward_all(&published).unwrap();
            assert_eq!(all.as_slice().len(), rows(both).len());
            for row in rows(both) {
                let expected = pose(&row["pose_mm_rad"]);
                let q = machine.inverse(&expected).unwrap();
                for (a, e) in q.iter().zip(published) {
                    close(*a, e, 1e-8, experiment);
                }
                let near = |(p, _): &&(Pose, f64)| (p.c - expected.c).abs() < 1e-3;
                let (found, sigma) = all.as_slice().iter().find(near).unwrap();
                same_pose(found, &expected, experiment);
                close(*sigma, number(&row["sigma"]), 1e-8, experiment);
            }
        }
    }
}
