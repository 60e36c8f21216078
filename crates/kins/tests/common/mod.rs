//! Reading the example vectors, and the checks every mechanism's vectors share.
#![allow(dead_code, missing_docs, unreachable_pub)]

use pkm_kins::{JointRange, Kinematics, Pose};
use serde_json::Value;

/// A data file of this crate's tests.
pub fn data(name: &str) -> Value {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect(&path);
    serde_json::from_str(&text).expect(&path)
}

pub fn rows(value: &Value) -> &[Value] {
    value.as_array().expect("an array")
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// Leading numbers of a row (what follows them, lists of codes, is left out).
pub fn numbers(value: &Value) -> Vec<f64> {
    rows(value).iter().map_while(Value::as_f64).collect()
}

pub fn array<const N: usize>(value: &Value) -> [f64; N] {
    numbers(value).try_into().expect("the right count of numbers")
}

pub fn pairs(value: &Value) -> [[f64; 2]; 2] {
    [array(&value[0]), array(&value[1])]
}

pub fn codes(value: &Value) -> Vec<String> {
    rows(value).iter().map(|v| v.as_str().expect("a code").to_owned()).collect()
}

pub fn close(actual: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((actual - expected).abs() <= tolerance, "{what}: {actual} instead of {expected}");
}

/// Relative to `scale`, the largest entry of a matrix, but never finer than 1.
pub fn close_rel(actual: f64, expected: f64, scale: f64, tolerance: f64, what: &str) {
    close(actual, expected, tolerance * scale.abs().max(1.0), what);
}

pub fn range([min, max]: [f64; 2]) -> JointRange {
    JointRange { min, max }
}

/// What a machine answers for a pose: inverse, then travel.
pub fn inverse_code(k: &impl Kinematics, ranges: &[JointRange], pose: &Pose) -> Option<String> {
    match k.inverse(pose) {
        Err(error) => Some(error.code().to_string()),
        Ok(joints) => JointRange::check(ranges, &joints).err().map(|limit| k.limit_code(&limit).to_string()),
    }
}

/// What a machine answers for joints: forward, then travel.
pub fn forward_code(k: &impl Kinematics, ranges: &[JointRange], joints: &[f64]) -> Option<String> {
    let mut all = [0.0; pkm_kins::MAX_JOINTS];
    all[..joints.len()].copy_from_slice(joints);
    match k.forward(&all, &Pose::ZERO) {
        Err(error) => Some(error.code().to_string()),
        Ok(_) => JointRange::check(ranges, &all).err().map(|limit| k.limit_code(&limit).to_string()),
    }
}

pub fn one_of(found: Option<String>, listed: &[String], what: &str) {
    match found {
        None => panic!("{what}: accepted, but {listed:?} hold"),
        Some(code) => assert!(listed.contains(&code), "{what}: {code} is none of {listed:?}"),
    }
}

pub fn joints(values: &[f64]) -> pkm_kins::Joints {
    let mut all = [0.0; pkm_kins::MAX_JOINTS];
    all[..values.len()].copy_from_slice(values);
    all
}

pub fn xy(x: f64, y: f64) -> Pose {
    Pose { x, y, ..Pose::ZERO }
}

/// Gauss with row pivots.
pub fn determinant(mut m: Vec<Vec<f64>>) -> f64 {
    let mut det = 1.0;
    while !m.is_empty() {
        let pivot = (0..m.len()).max_by(|a, b| m[*a][0].abs().total_cmp(&m[*b][0].abs())).unwrap();
        if pivot % 2 == 1 {
            det = -det;
        }
        let first = m.remove(pivot);
        det *= first[0];
        for row in &mut m {
            let factor = row[0] / first[0];
            *row = row.iter().zip(&first).skip(1).map(|(x, p)| x - factor * p).collect();
        }
    }
    det
}
