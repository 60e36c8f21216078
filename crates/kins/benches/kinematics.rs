//! Medians of inverse, forward and motion of every mechanism, one call per pose out of 256.
//! `cargo bench -p pkm-kins`

use divan::{Bencher, black_box};
use pkm_kins::*;

#[path = "../tests/common/zoo.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod zoo;
use zoo::{Rng, cases};

fn main() {
    divan::main();
}

const POSES: usize = 256;

struct Set {
    mechanism: Mechanism,
    poses: Vec<Pose>,
    joints: Vec<Joints>,
    seeds: Vec<Pose>,
}

/// Reachable poses of a mechanism, their joints, and seeds 0.02 mm and 0.0002 rad away.
fn set(name: &str) -> Set {
    let case = cases().into_iter().find(|case| case.name == name).expect("a case of that name");
    let mut rng = Rng::new(1);
    let (mut poses, mut joints, mut seeds) = (Vec::new(), Vec::new(), Vec::new());
    while poses.len() < POSES {
        let pose = case.pose(&mut rng);
        let Ok(q) = case.mechanism.inverse(&pose) else { continue };
        let seed = Pose { x: pose.x + 0.02, y: pose.y - 0.02, c: pose.c + 2e-4, ..pose };
        if case.mechanism.forward(&q, &seed).is_ok() && case.mechanism.jacobian(&pose).is_ok() {
            poses.push(pose);
            joints.push(q);
            seeds.push(seed);
        }
    }
    Set { mechanism: case.mechanism, poses, joints, seeds }
}

const NAMES: [&str; 9] = [
    "moma-a",
    "moma-4s-p",
    "moma-w",
    "hv-mill-v5",
    "ox-glide-o",
    "lambda6",
    "linear delta",
    "hexapod",
    "xyzabc",
];

#[divan::bench(args = NAMES, sample_count = 200, sample_size = 1)]
fn inverse(bencher: Bencher, name: &str) {
    let set = set(name);
    bencher.counter(divan::counter::ItemsCount::new(POSES)).bench_local(|| {
        for pose in &set.poses {
            black_box(set.mechanism.inverse(black_box(pose))).ok();
        }
    });
}

#[divan::bench(args = NAMES, sample_count = 200, sample_size = 1)]
fn forward(bencher: Bencher, name: &str) {
    let set = set(name);
    bencher.counter(divan::counter::ItemsCount::new(POSES)).bench_local(|| {
        for (q, seed) in set.joints.iter().zip(&set.seeds) {
            black_box(set.mechanism.forward(black_box(q), seed)).ok();
        }
    });
}

#[divan::bench(args = NAMES, sample_count = 200, sample_size = 1)]
fn motion(bencher: Bencher, name: &str) {
    let set = set(name);
    let velocity = Pose { x: 10.0, y: -20.0, ..Pose::ZERO };
    let acceleration = Pose { x: 100.0, y: 50.0, ..Pose::ZERO };
    let mut motion = JointMotion::default();
    bencher.counter(divan::counter::ItemsCount::new(POSES)).bench_local(|| {
        for pose in &set.poses {
            let mechanism = &set.mechanism;
            black_box(mechanism.motion_into(black_box(pose), &velocity, &acceleration, &mut motion)).ok();
            black_box(&motion);
        }
    });
}

/// The planar core on native pairs: what the machines above are built from.
#[divan::bench(sample_count = 200, sample_size = 1)]
fn planar_inverse_native(bencher: Bencher) {
    let set = set("moma-a");
    let Mechanism::Moma(moma) = set.mechanism else { return };
    bencher.counter(divan::counter::ItemsCount::new(POSES)).bench_local(|| {
        for pose in &set.poses {
            black_box(moma.planar.inverse(black_box([pose.x, pose.y]))).ok();
        }
    });
}

#[divan::bench(sample_count = 200, sample_size = 1)]
fn planar_motion_native(bencher: Bencher) {
    let set = set("moma-a");
    let Mechanism::Moma(moma) = set.mechanism else { return };
    bencher.counter(divan::counter::ItemsCount::new(POSES)).bench_local(|| {
        for pose in &set.poses {
            black_box(moma.planar.motion_2(black_box([pose.x, pose.y]), [10.0, -20.0], [100.0, 50.0])).ok();
        }
    });
}

#[divan::bench(sample_count = 200, sample_size = 1)]
fn lambda_forward_cold(bencher: Bencher) {
    let set = set("lambda6");
    bencher.counter(divan::counter::ItemsCount::new(POSES)).bench_local(|| {
        for q in &set.joints {
            black_box(set.mechanism.forward(black_box(q), &Pose::ZERO)).ok();
        }
    });
}
