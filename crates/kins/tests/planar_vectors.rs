//! The example vectors of MOMA, the general planar mechanism, MOMA 4S and MOMA-W (`tests/data/planar-examples.json`,
//! computed with an independent 50-digit solver).

mod common;
use common::*;
use pkm_kins::{
    JointRange, Kinematics, Moma, Moma4s, Moma4sConfiguration, Moma4sParameters, MomaConfiguration,
    MomaParameters, MomaW, MomaWParameters, Planar, PlanarParameters, Pose,
};
use serde_json::Value;

fn modes(value: &Value) -> [i8; 2] {
    let [a, b]: [f64; 2] = array(value);
    [a as i8, b as i8]
}

fn strokes(value: &Value) -> [JointRange; 2] {
    pairs(value).map(range)
}

/// Good poses in both directions, with Jacobian and its determinant.
fn good_rows(k: &impl Kinematics, planar: &Planar, table: &Value, ranges: &[JointRange], what: &str) {
    assert!(!rows(table).is_empty());
    for row in rows(table) {
        let row = numbers(row);
        let pose = xy(row[0], row[1]);
        let p = k.inverse(&pose).unwrap_or_else(|e| panic!("{what} {row:?}: {e}"));
        close(p[0], row[2], 1e-9, what);
        close(p[1], row[3], 1e-9, what);
        JointRange::check(ranges, &p).unwrap();
        let back = k.forward(&joints(&row[2..4]), &Pose::ZERO).unwrap();
        close(back.x, pose.x, 1e-9, what);
        close(back.y, pose.y, 1e-9, what);
        let scale = row[4..8].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let j = k.jacobian(&pose).unwrap();
        for (entry, expected) in [j[0][0], j[0][1], j[1][0], j[1][1]].iter().zip(&row[4..8]) {
            close_rel(*entry, *expected, scale, 1e-9, what);
        }
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        close_rel(det, row[8], row[8], 1e-9, what);
        // G is the inverse of K.
        let g = planar.forward_rates(&planar.solve([pose.x, pose.y]).unwrap()).unwrap();
        let unit = g[0][0] * j[0][0] + g[0][1] * j[1][0];
        close(unit, 1.0, 1e-9, what);
        close(g[0][0] * j[0][1] + g[0][1] * j[1][1], 0.0, 1e-9 * scale.max(1.0), what);
    }
}

fn bad_rows(k: &impl Kinematics, table: &Value, ranges: &[JointRange], what: &str) {
    for row in rows(&table["ik_bad"]) {
        let what = format!("{what} ik_bad {row}");
        let code = inverse_code(k, ranges, &xy(number(&row[0]), number(&row[1])));
        one_of(code, &codes(&row[2]), &what);
    }
    for row in rows(&table["fk_bad"]) {
        let what = format!("{what} fk_bad {row}");
        let code = forward_code(k, ranges, &[number(&row[0]), number(&row[1])]);
        one_of(code, &codes(&row[2]), &what);
    }
}

/// Exactly or nearly singular states: positions still answer, derivatives say `Singular`.
fn singular_rows(k: &impl Kinematics, planar: &Planar, table: &Value, ranges: &[JointRange], what: &str) {
    for row in rows(&table["singular"]) {
        let what = format!("{what} singular {row}");
        let p: [f64; 2] = array(&row["p"]);
        let kind = row["type"].as_str().unwrap();
        let in_stroke = JointRange::check(ranges, &joints(&p)).is_ok();
        assert_eq!(in_stroke, row["in_stroke"].as_bool().unwrap(), "{what}");
        let Some(_) = row["t"].as_array() else {
            // Coincident centres: forward has no answer.
            assert_eq!(
                k.forward(&joints(&p), &Pose::ZERO).unwrap_err().code().to_string(),
                "no_intersection:coincident",
                "{what}"
            );
            continue;
        };
        let [x, y] = array(&row["t"]);
        let pose = xy(x, y);
        let found = k.inverse(&pose).unwrap();
        let tolerance = if kind == "none" { 1e-9 } else { 1e-5 };
        close(found[0], p[0], tolerance, &what);
        close(found[1], p[1], tolerance, &what);
        let measure = k.singularity(&pose).unwrap();
        let state = planar.solve([x, y]).unwrap();
        match kind {
            "1" => {
                assert!(measure.inverse < 1e-6, "{what}: {measure:?}");
                let axis = row["axis"].as_str().unwrap();
                assert!(axis.contains(&(measure.inverse_joint + 1).to_string()), "{what}");
                if measure.inverse < 1e-9 {
                    assert_eq!(k.jacobian(&pose).unwrap_err().code().to_string(), "singular", "{what}");
                }
            }
            "2" => {
                assert!(measure.forward < 1e-6, "{what}: {measure:?}");
                k.jacobian(&pose).unwrap();
                if measure.forward < 1e-9 {
                    planar.forward_rates(&state).unwrap_err();
                }
                let back = k.forward(&joints(&p), &Pose::ZERO).unwrap();
                close(back.x, x, 1e-5, &what);
                close(back.y, y, 1e-5, &what);
            }
            _ => {
                let j = k.jacobian(&pose).unwrap();
                close(j[0][0] * j[1][1] - j[0][1] * j[1][0], number(&row["det_k"]), 1e-12, &what);
            }
        }
    }
}

#[test]
fn val_moma_configurations() {
    let data = data("planar-examples.json");
    for (name, configuration) in ["a", "b", "c", "d"].into_iter().zip(MomaConfiguration::ALL) {
        let table = &data["moma"]["configs"][name];
        let parameters: MomaParameters = configuration.into();
        // The constructors are the table's parameters.
        let p = &table["params"];
        assert_eq!(parameters.reference_mm, pairs(&p["R"]));
        assert_eq!(parameters.guide_angle_deg, array::<2>(&p["alpha_deg"]));
        assert_eq!(parameters.l_mm, array::<2>(&p["l"]));
        assert_eq!(parameters.working_mode, modes(&p["sigma"]));
        assert_eq!(f64::from(parameters.assembly), number(&p["side"]));
        let ranges = strokes(&p["stroke"]);

        let moma = Moma::new(&parameters).unwrap();
        let one_sided = Moma::new(&MomaParameters { one_sided: true, ..parameters }).unwrap();
        good_rows(&moma, &moma.planar, &table["rows"], &ranges, name);
        bad_rows(&moma, table, &ranges, name);
        singular_rows(&moma, &moma.planar, table, &ranges, name);
        for row in rows(&table["rows"]) {
            let row = numbers(row);
            assert_eq!(one_sided.inverse(&xy(row[0], row[1])).is_ok(), row[9] == 1.0, "{name} {row:?}");
            assert_eq!(one_sided.forward(&joints(&row[2..4]), &Pose::ZERO).is_ok(), row[9] == 1.0, "{name}");
        }
        for row in rows(&table["motion"]) {
            let [x, y, vx, vy, ax, ay, pd1, pd2, pdd1, pdd2] = array(row);
            let motion = moma.motion(&xy(x, y), &xy(vx, vy), &xy(ax, ay)).unwrap();
            close_rel(motion.velocity[0], pd1, pd1, 1e-9, name);
            close_rel(motion.velocity[1], pd2, pd2, 1e-9, name);
            close_rel(motion.acceleration[0], pdd1, pdd1, 1e-9, name);
            close_rel(motion.acceleration[1], pdd2, pdd2, 1e-9, name);
        }
    }
}

#[test]
fn val_planar_general() {
    let data = data("planar-examples.json");
    for (i, mechanism) in rows(&data["planar_general"]["mechanisms"]).iter().enumerate() {
        let p = &mechanism["params"];
        let planar = Planar::new(&PlanarParameters {
            reference_mm: pairs(&p["R"]),
            guide_angle_deg: array(&p["alpha_deg"]),
            l_mm: array(&p["l"]),
            offset_mm: pairs(&p["off"]),
            working_mode: modes(&p["sigma"]),
            assembly: number(&p["side"]) as i8,
            one_sided: false,
        })
        .unwrap();
        good_rows(&planar, &planar, &mechanism["rows"], &strokes(&p["stroke"]), &format!("general {i}"));
    }
    // Sliders above each other, where [MOMA] (12) divides by zero.
    let last = rows(&data["planar_general"]["mechanisms"]).last().unwrap();
    assert_eq!(pairs(&last["params"]["R"]), [[0.0, -100.0], [0.0, 100.0]]);
    let stacked = Planar::new(&PlanarParameters {
        reference_mm: [[0.0, -100.0], [0.0, 100.0]],
        guide_angle_deg: [0.0; 2],
        l_mm: [195.0; 2],
        offset_mm: [[0.0; 2]; 2],
        working_mode: [-1; 2],
        assembly: -1,
        one_sided: false,
    })
    .unwrap();
    for row in rows(&data["planar_general"]["stacked_equal_p"]["rows"]) {
        let [p1, p2, t1, t2] = array(row);
        let [x, y] = stacked.forward([p1, p2]).unwrap();
        close(x, t1, 1e-9, "stacked");
        close(y, t2, 1e-9, "stacked");
    }
}

#[test]
fn val_moma_4s_configurations() {
    let data = data("planar-examples.json");
    let base = &data["moma_4s"]["base"];
    for configuration in Moma4sConfiguration::ALL {
        let name = format!("MOMA 4S-{configuration:?}");
        let table = &data["moma_4s"]["configs"][&name];
        let parameters: Moma4sParameters = configuration.into();
        assert_eq!(parameters.gamma_deg, array::<2>(&table["gamma_deg"]));
        assert_eq!(parameters.pivot_mm, pairs(&base["O"]));
        assert_eq!(parameters.rho_mm, pairs(&base["Rlocal"]));
        assert_eq!(parameters.l_h_mm, array::<2>(&base["lH"]));
        let ranges = strokes(&base["stroke"]);
        let machine = Moma4s::new(&parameters).unwrap();
        good_rows(&machine, &machine.planar, &table["rows"], &ranges, &name);
        bad_rows(&machine, table, &ranges, &name);
        singular_rows(&machine, &machine.planar, table, &ranges, &name);
    }
}

#[test]
fn val_moma_4s_asymmetric_with_tool() {
    let data = data("planar-examples.json");
    let table = &data["moma_4s"]["asymmetric_with_tool"];
    let base = &table["base"];
    let machine = Moma4s::new(&Moma4sParameters {
        pivot_mm: pairs(&base["O"]),
        rho_mm: pairs(&base["Rlocal"]),
        gamma_deg: array(&table["gamma_deg"]),
        l_mm: array(&base["l"]),
        l_h_mm: array(&base["lH"]),
        l_t_mm: 72.5,
        alpha_t_deg: 0.0,
        working_mode: [-1; 2],
        assembly: -1,
        one_sided: false,
    })
    .unwrap();
    assert_eq!(machine.tool_mm()[..2], array::<2>(&table["tool_q"]));
    good_rows(&machine, &machine.planar, &table["rows"], &strokes(&base["stroke"]), "4S with tool");
}

#[test]
fn val_moma_w() {
    let data = data("planar-examples.json");
    let table = &data["moma_w"];
    let parameters = MomaWParameters::default();
    assert_eq!(parameters.b_mm, array::<3>(&table["params"]["B1_p_B2"]));
    assert_eq!(parameters.w_mm, array::<3>(&table["params"]["B1_p_W"]));
    assert_eq!(parameters.contour_distance_mm, number(&table["params"]["D"]));
    let machine = MomaW::new(&parameters).unwrap();
    let pose = |row: &[f64]| Pose { x: row[0], y: row[1], z: row[4], u: row[2], v: row[3], ..Pose::ZERO };
    for row in rows(&table["rows"]) {
        let row = numbers(row);
        let pose = pose(&row);
        let ends = machine.wire_ends(&pose).unwrap();
        for (actual, expected) in ends.as_flattened().iter().zip(&row[5..9]) {
            close(*actual, *expected, 1e-9, "wire end");
        }
        let p = machine.inverse(&pose).unwrap();
        for (actual, expected) in p.iter().zip(&row[9..13]) {
            close(*actual, *expected, 1e-9, "moma-w joints");
        }
        assert_eq!(p[4], row[4]);
        close(machine.wire_length_mm(&pose).unwrap(), row[13], 1e-9, "wire length");
        let back =
            machine.forward(&joints(&[row[9], row[10], row[11], row[12], row[4]]), &Pose::ZERO).unwrap();
        for (actual, expected) in [back.x, back.y, back.u, back.v, back.z].iter().zip(&row[..5]) {
            close(*actual, *expected, 1e-9, "moma-w pose");
        }
        let j = machine.jacobian(&pose).unwrap();
        // det ∂(p1..p4)/∂(x,y,u,v): the columns 0, 1, 6, 7.
        let m: Vec<Vec<f64>> = j[..4].iter().map(|r| vec![r[0], r[1], r[6], r[7]]).collect();
        close_rel(determinant(m), row[14], row[14], 1e-9, "det J4");
        let dexterity = pkm_kins::Mechanism::from(machine).dexterity(&pose).unwrap();
        close_rel(dexterity.determinant, row[14], row[14], 1e-9, "det J5 = det J4");
    }
    let ranges = [[0.0, 200.0], [0.0, 200.0], [0.0, 200.0], [0.0, 200.0], [0.0, 100.0]].map(range);
    for row in rows(&table["bad"]) {
        let code = inverse_code(&machine, &ranges, &pose(&numbers(row)));
        one_of(code, &codes(&row[5]), &format!("moma-w bad {row}"));
    }
}
