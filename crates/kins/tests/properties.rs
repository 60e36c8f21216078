//! Properties of every mechanism over 100,000 random poses each, shared by its configurations (PKM_TEST_SCALE scales the
//! count, PKM_TEST_SEED sets the seed): half of them anywhere, a quarter at or near the edge of reach, a quarter at the joints' ends of travel.

mod common;
#[path = "common/zoo.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod zoo;

use pkm_kins::{
    Axis, ForwardError, InverseError, Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Pose,
    Singularity,
};
use zoo::{Case, Rng, cases, count, seed};

/// Runs `check` on every case, in parallel by mechanism, and names case, seed and pose when it fails.
fn for_all(what: &str, check: impl Fn(&Case, &mut Rng, usize) + Sync) {
    let cases = cases();
    let next = std::sync::atomic::AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
                    // The configurations of one mechanism share its poses.
                    let kin = cases.iter().filter(|c| c.mechanism.kind() == case.mechanism.kind()).count();
                    let poses = count().div_ceil(kin);
                    let run = std::panic::AssertUnwindSafe(|| check(case, &mut Rng::new(seed()), poses));
                    if let Err(cause) = std::panic::catch_unwind(run) {
                        eprintln!("{what}: {} failed with PKM_TEST_SEED={}", case.name, seed());
                        std::panic::resume_unwind(cause);
                    }
                }
            });
        }
    });
}

fn moved(pose: &Pose, by: f64, along: &Pose) -> Pose {
    let mut all = pose.to_array();
    for (x, d) in all.iter_mut().zip(along.to_array()) {
        *x += by * d;
    }
    Pose::from_array(all)
}

fn unit(axis: Axis) -> Pose {
    let mut pose = Pose::ZERO;
    pose.set(axis, 1.0);
    pose
}

/// A seed as a servo period or two would leave it.
fn near(case: &Case, pose: &Pose, rng: &mut Rng) -> Pose {
    let mut seed = *pose;
    for axis in case.mechanism.axes().iter() {
        let size = if axis.is_rotary() { 2e-4 } else { 0.02 };
        if case.low[axis as usize] != case.high[axis as usize] {
            seed.set(axis, pose.get(axis) + rng.between(-size, size));
        }
    }
    seed
}

/// How far a pose may be off after a round trip: 1e-9 where regular. Rounding grows with 1/ν, up to its root; at the edge of reach
/// the slack of 1e-12 l² in d grows likewise.
fn round_trip_tolerance(case: &Case, measure: &Singularity) -> f64 {
    let (regular, growth) = match case.mechanism.kind() {
        "Lambda6" => (1e-7, 1e-11),
        "Hexapod" => (1e-8, 1e-11),
        _ if measure.inverse < 1e-5 => (1e-9, 1e-12),
        _ => (1e-9, 1e-14),
    };
    (regular + growth * case.size_mm / measure.forward.max(1e-300)).min(1e-7 * case.size_mm)
}

#[test]
fn round_trip_from_poses() {
    for_all("round trip", |case, rng, count| {
        let m = &case.mechanism;
        let (mut good, mut worst) = (0, 0.0_f64);
        for _ in 0..count {
            let pose = case.any_pose(rng);
            let Ok(joints) = m.inverse(&pose) else { continue };
            assert!(joints.iter().all(|q| q.is_finite()), "{pose:?}");
            let measure = m.singularity(&pose).unwrap();
            let back = match m.forward(&joints, &near(case, &pose, rng)) {
                Ok(back) => back,
                // Inverse and forward give the guide's line the same slack; rounding decides beyond it.
                Err(ForwardError::GuideSide { excess_mm, .. }) if excess_mm < 1.1e-9 => continue,
                Err(error) => {
                    // Allowed only where the platform is not held (Lambda: within its σ guard).
                    // A hexapod's seed may lie beyond a singularity this near.
                    let guard = match m.kind() {
                        "Lambda6" => 0.06,
                        "Hexapod" => 1e-3,
                        _ => 1e-6,
                    };
                    assert!(measure.forward < guard, "{pose:?}: {error} at {measure:?}");
                    continue;
                }
            };
            good += 1;
            if measure.forward < 0.06 && m.kind() == "Lambda6"
                || measure.forward < 1e-3 && m.kind() == "Hexapod"
            {
                continue; // two assemblies meet here; within Lambda's guard the seed does not choose
            }
            if measure.forward < 1e-7 {
                // The platform is hardly held, its place is a matter of rounding; its joints are not.
                let again = m.inverse(&back).unwrap_or_else(|e| panic!("{pose:?} -> {back:?}: {e}"));
                let slack =
                    (1e-9 + 1e-14 * case.size_mm / measure.inverse.max(1e-300)).min(1e-7 * case.size_mm);
                for (a, e) in again.iter().zip(joints) {
                    assert!((a - e).abs() <= slack, "{a} instead of {e}: {pose:?} {measure:?}");
                }
                continue;
            }
            let tolerance = round_trip_tolerance(case, &measure);
            for axis in m.axes().iter() {
                let off = (back.get(axis) - pose.get(axis)).abs();
                let tolerance = if axis.is_rotary() { tolerance.min(1e-9) } else { tolerance };
                assert!(off <= tolerance, "{axis:?} off by {off:e} > {tolerance:e}: {pose:?} {measure:?}");
                worst = worst.max(off / tolerance);
            }
        }
        assert!(good > count / 50, "{} good poses of {count}", good);
        assert!(worst > 0.0 || m.kind() == "Cartesian", "nothing was compared");
    });
}

/// The calls of a servo thread write the same bits as the others, touch no other place, and nothing at all after an error.
#[test]
fn writing_in_place_is_the_same() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    let (unreachable, impossible) = (AtomicUsize::new(0), AtomicUsize::new(0));
    for_all("in place", |case, rng, count| {
        let m = &case.mechanism;
        for _ in 0..count {
            let pose = case.any_pose(rng);
            let untouched = [f64::MAX; MAX_JOINTS];
            let mut joints = untouched;
            let written = m.inverse_into(&pose, &mut joints);
            let found = m.inverse(&pose);
            assert_eq!(written, found.map(|_| ()), "{pose:?}");
            unreachable.fetch_add(usize::from(found.is_err()), Ordering::Relaxed);
            let expected = match found {
                Ok(all) => std::array::from_fn(|i| if i < m.joint_count() { all[i] } else { f64::MAX }),
                Err(_) => untouched,
            };
            assert_eq!(joints.map(f64::to_bits), expected.map(f64::to_bits), "{pose:?}");

            let mut q = found.unwrap_or([100.0; MAX_JOINTS]);
            if rng.below(4) == 0 {
                q = q.map(|joint| joint + rng.between(-300.0, 300.0));
            }
            let seed = near(case, &pose, rng);
            let mut place = seed;
            let written = m.forward_into(&q, &mut place);
            let found = m.forward(&q, &seed);
            assert_eq!(written, found.map(|_| ()), "{q:?}");
            impossible.fetch_add(usize::from(found.is_err()), Ordering::Relaxed);
            assert_eq!(
                place.to_array().map(f64::to_bits),
                found.unwrap_or(seed).to_array().map(f64::to_bits)
            );
        }
    });
    assert!(unreachable.into_inner() > 0 && impossible.into_inner() > 0, "nothing was refused");
}

/// Looking along a path asks for the joints only, and is refused what a motion is refused, for the same reason; so is a motion straight
/// into place.
#[test]
fn a_passage_answers_and_refuses_what_a_motion_does() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    let (passed, refused) = (AtomicUsize::new(0), AtomicUsize::new(0));
    for_all("passage", |case, rng, count| {
        let m = &case.mechanism;
        for _ in 0..count {
            let pose = case.any_pose(rng);
            // Any axis may move, locked ones too; now and then one that has no speed.
            let mut any = || {
                Pose::from_array(std::array::from_fn(|_| match rng.below(40) {
                    0 => f64::NAN,
                    1..20 => 0.0,
                    _ => rng.between(-1.0, 1.0),
                }))
            };
            let (velocity, acceleration) = (any(), any());
            let bits = |joints: Joints| joints.map(f64::to_bits);
            let expected = m.motion(&pose, &velocity, &acceleration).map(|motion| bits(motion.position));
            let found = m.passage(&pose, &velocity, &acceleration).map(bits);
            assert_eq!(found, expected, "{pose:?} {velocity:?} {acceleration:?}");
            // The same straight into place, where other joints of the machine's controller keep their value.
            let whole = m.motion(&pose, &velocity, &acceleration);
            let mut own = JointMotion { position: [7.0; 9], velocity: [7.0; 9], acceleration: [7.0; 9] };
            let answer = m.motion_into(&pose, &velocity, &acceleration, &mut own);
            assert_eq!(answer.err(), whole.err());
            if let Ok(whole) = whole {
                for joint in 0..m.joint_count() {
                    let of = |m: &JointMotion| [m.position[joint], m.velocity[joint], m.acceleration[joint]];
                    assert_eq!(of(&own).map(f64::to_bits), of(&whole).map(f64::to_bits), "joint {joint}");
                }
            }
            let counter = if found.is_ok() { &passed } else { &refused };
            counter.fetch_add(1, Ordering::Relaxed);
        }
    });
    assert!(passed.into_inner() > 0 && refused.into_inner() > 0);
}

#[test]
fn round_trip_from_joints() {
    for_all("joints", |case, rng, count| {
        let m = &case.mechanism;
        let n = m.joint_count();
        let mut good = 0;
        for _ in 0..count / 4 {
            let mut joints = [0.0; MAX_JOINTS];
            for (q, [low, high]) in joints.iter_mut().zip(&case.travel) {
                *q = if rng.below(8) == 0 { *high } else { rng.between(*low, *high) };
            }
            if case.name.starts_with("hv-mill-7") {
                // The idle mechanism's joints are held where they are.
                let held = m.inverse(&Pose::ZERO).or_else(|_| m.inverse(&case.centre())).unwrap();
                let idle = if case.name.ends_with("(H)") { 2..4 } else { 0..2 };
                joints[idle.clone()].copy_from_slice(&held[idle]);
            }
            let Ok(pose) = m.forward(&joints, &case.centre()) else { continue };
            assert!(pose.is_finite(), "{joints:?}");
            let again = match m.inverse(&pose) {
                Ok(again) => again,
                // Coupled limits (spacing, wire) are the inverse's business; so are edges where rounding decides.
                Err(
                    InverseError::Spacing { .. }
                    | InverseError::WireLength { .. }
                    | InverseError::WireTilt { .. },
                ) => continue,
                Err(error) => panic!("{joints:?} -> {pose:?}: {error}"),
            };
            good += 1;
            let measure = m.singularity(&pose).unwrap();
            let tolerance =
                (1e-9 + 1e-14 * case.size_mm / measure.inverse.max(1e-300)).min(4e-8 * case.size_mm);
            let tolerance = if m.kind() == "Lambda6" { tolerance + 1e-7 } else { tolerance };
            for (q, expected) in again[..n].iter().zip(&joints) {
                let off = (q - expected).abs();
                assert!(
                    off <= tolerance,
                    "off by {off:e} > {tolerance:e}: {joints:?} -> {pose:?} {measure:?}"
                );
            }
        }
        assert!(good > count / 4 / 50, "{good} good joints of {}", count / 4);
    });
}

/// Central differences with one Richardson step: error O(h⁴).
fn difference(case: &Case, pose: &Pose, along: &Pose, h: f64) -> Option<(Joints, Joints)> {
    let m = &case.mechanism;
    let at = |t: f64| m.inverse(&moved(pose, t, along)).ok();
    let (q0, a, b, c, d) = (at(0.0)?, at(-h)?, at(-h / 2.0)?, at(h / 2.0)?, at(h)?);
    let (mut first, mut second) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
    for j in 0..m.joint_count() {
        first[j] = (4.0 * (c[j] - b[j]) / h - (d[j] - a[j]) / (2.0 * h)) / 3.0;
        let (near, far) =
            (4.0 * (c[j] - 2.0 * q0[j] + b[j]) / (h * h), (d[j] - 2.0 * q0[j] + a[j]) / (h * h));
        second[j] = (4.0 * near - far) / 3.0;
    }
    Some((first, second))
}

#[test]
fn jacobian_is_the_derivative() {
    for_all("jacobian", |case, rng, count| {
        let m = &case.mechanism;
        let mut compared = 0;
        for _ in 0..count {
            let pose = case.any_pose(rng);
            let Ok(measure) = m.singularity(&pose) else { continue };
            let jacobian: Jacobian = match m.jacobian(&pose) {
                Ok(jacobian) => jacobian,
                Err(InverseError::Singular { measure: found }) => {
                    assert!(found < 1e-9 && measure.inverse < 1.1e-9, "{pose:?}");
                    continue;
                }
                Err(InverseError::FormSwitch { c_mm, guard_mm }) => {
                    assert!(c_mm.abs() < guard_mm, "{pose:?}");
                    continue;
                }
                Err(error) => panic!("{pose:?}: {error}, but its singularity measure is known"),
            };
            assert!(jacobian.as_flattened().iter().all(|x| x.is_finite()), "{pose:?}");
            if measure.inverse < 0.02 {
                continue;
            }
            for axis in m.axes().iter() {
                if case.low[axis as usize] == case.high[axis as usize] {
                    continue; // locked in this mode
                }
                let h = 1e-3 * case.size_mm * measure.inverse * measure.inverse;
                let h = if axis.is_rotary() { h / case.size_mm } else { h };
                let Some((first, _)) = difference(case, &pose, &unit(axis), h) else { continue };
                compared += 1;
                for (row, found) in jacobian.iter().zip(first).take(m.joint_count()) {
                    let exact = row[axis as usize];
                    let scale = if axis.is_rotary() { case.size_mm } else { 1.0 };
                    let tolerance = 1e-7 * scale / measure.inverse.min(1.0);
                    assert!(
                        (exact - found).abs() <= tolerance,
                        "{axis:?}: {exact} but {found}: {pose:?} {measure:?}"
                    );
                }
            }
        }
        assert!(compared > count / 50, "{compared} of {count}");
    });
}

#[test]
fn accelerations_are_the_second_derivative() {
    for_all("acceleration", |case, rng, count| {
        let m = &case.mechanism;
        let mut compared = 0;
        for _ in 0..count {
            let pose = case.any_pose(rng);
            let (mut velocity, mut acceleration) = (Pose::ZERO, Pose::ZERO);
            for axis in m.axes().iter() {
                if case.low[axis as usize] != case.high[axis as usize] {
                    let size = if axis.is_rotary() { 1.0 / case.size_mm } else { 1.0 };
                    velocity.set(axis, rng.between(-size, size));
                    acceleration.set(axis, rng.between(-size, size) / case.size_mm);
                }
            }
            let Ok(motion) = m.motion(&pose, &velocity, &acceleration) else { continue };
            let position = m.inverse(&pose).unwrap();
            assert_eq!(motion.position, position, "{pose:?}");
            let jacobian = m.jacobian(&pose).unwrap();
            let measure = m.singularity(&pose).unwrap();
            // Velocity: J ẋ to rounding.
            for (row, rate) in jacobian.iter().zip(motion.velocity).take(m.joint_count()) {
                let sum: f64 = row.iter().zip(velocity.to_array()).map(|(j, v)| j * v).sum();
                let scale: f64 = row.iter().zip(velocity.to_array()).map(|(j, v)| (j * v).abs()).sum();
                assert!((sum - rate).abs() <= 1e-12 * (1.0 + scale), "{sum} but {rate}: {pose:?}");
            }
            if measure.inverse < 0.02 {
                continue;
            }
            // Acceleration: along pose + t ẋ + t²/2 ẍ.
            let h = 2e-3 * case.size_mm * measure.inverse * measure.inverse;
            let at = |t: f64| m.inverse(&moved(&moved(&pose, t, &velocity), 0.5 * t * t, &acceleration)).ok();
            let (Some(a), Some(b), Some(c), Some(d)) = (at(-h), at(-h / 2.0), at(h / 2.0), at(h)) else {
                continue;
            };
            compared += 1;
            for j in 0..m.joint_count() {
                let q = position[j];
                let near = 4.0 * ((c[j] - q) - (q - b[j])) / (h * h);
                let far = ((d[j] - q) - (q - a[j])) / (h * h);
                let found = (4.0 * near - far) / 3.0;
                let natural = 1.0 / (case.size_mm * measure.inverse * measure.inverse * measure.inverse);
                let rounding = 1e-14 * case.size_mm / (h * h);
                let off = (found - motion.acceleration[j]).abs();
                assert!(
                    off <= 1e-4 * natural + rounding,
                    "joint {j}: {} but {found}: {pose:?} {measure:?}",
                    motion.acceleration[j]
                );
            }
        }
        assert!(compared > count / 50, "{compared} of {count}");
    });
}

#[test]
fn mirror_images_have_mirrored_joints() {
    for_all("symmetry", |case, rng, count| {
        let Some(mirror) = case.mirror else { return };
        let m = &case.mechanism;
        let mut compared = 0;
        for _ in 0..count {
            let pose = case.any_pose(rng);
            let found = m.inverse(&pose);
            let (image, _) = mirror(&pose, &[0.0; MAX_JOINTS]);
            match (found, m.inverse(&image)) {
                (Ok(joints), Ok(other)) => {
                    compared += 1;
                    let (_, expected) = mirror(&pose, &joints);
                    let measure = m.singularity(&pose).unwrap().inverse.max(1e-300);
                    let tolerance = (1e-9 + 1e-14 * case.size_mm / measure).min(4e-8 * case.size_mm);
                    for (a, e) in other.iter().zip(expected) {
                        assert!((a - e).abs() <= tolerance, "{a} instead of {e}: {pose:?}");
                    }
                }
                (Err(_), Err(_)) => {}
                // Only rounding at an edge may decide differently.
                (Ok(_), Err(error)) | (Err(error), Ok(_)) => {
                    let by = match error {
                        InverseError::OutOfReach { deficit_mm, .. } => deficit_mm,
                        InverseError::LongChainReach { rho_mm, limit_mm, .. }
                        | InverseError::ShortChainReach { rho_mm, limit_mm, .. } => rho_mm - limit_mm,
                        InverseError::Spacing { value_mm, limit_mm, .. } => (value_mm - limit_mm).abs(),
                        InverseError::GuideSide { excess_mm, .. } => excess_mm,
                        InverseError::WrongAssembly { .. } => 0.0,
                        other => panic!("{other}: {pose:?}"),
                    };
                    assert!(by <= 1e-8, "{error} on one side only: {pose:?}");
                }
            }
        }
        assert!(compared > count / 50, "{compared} of {count}");
    });
}

#[test]
fn refusals_carry_finite_numbers_and_a_code() {
    for_all("errors", |case, rng, count| {
        let m = &case.mechanism;
        for _ in 0..count / 10 {
            let mut pose = case.any_pose(rng);
            let axes: Vec<Axis> = m.axes().iter().collect();
            let axis = axes[rng.below(axes.len() as u64) as usize];
            let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -f64::MAX, 1e200];
            let value = bad[rng.below(6) as usize];
            pose.set(axis, value);
            match m.inverse(&pose) {
                Ok(joints) => {
                    assert!(joints.iter().all(|q| !q.is_nan()), "{pose:?} -> {joints:?}");
                    let idle = case.low[axis as usize] == case.high[axis as usize];
                    assert!(value.is_finite() || idle, "{axis:?} = {value} accepted: {pose:?}");
                }
                Err(error) => {
                    let text = format!("{} {error} {error:?}", error.code());
                    assert!(!text.contains("NaN"), "{text}");
                    assert!(!error.code().to_string().is_empty());
                }
            }
            for result in [m.jacobian(&pose).map(|_| ()), m.singularity(&pose).map(|_| ())] {
                if let Err(error) = result {
                    assert!(!format!("{error:?}").contains("NaN"), "{error:?}");
                }
            }
            let mut joints = [0.0; MAX_JOINTS];
            for q in joints.iter_mut().take(m.joint_count()) {
                *q = if rng.below(3) == 0 { bad[rng.below(6) as usize] } else { rng.between(-2e3, 2e3) };
            }
            match m.forward(&joints, &case.centre()) {
                Ok(pose) => assert!(!pose.to_array().iter().any(|x| x.is_nan()), "{joints:?} -> {pose:?}"),
                Err(error) => assert!(!format!("{error} {error:?}").contains("NaN"), "{error:?}"),
            }
        }
    });
}

/// Straight paths that begin and end near the edge of reach: neighbouring poses have neighbouring joints (no jump of branch),
/// and forward with the previous pose as seed stays on the path.
#[test]
fn joints_are_continuous_along_paths_near_singularities() {
    for_all("continuity", |case, rng, count| {
        let m = &case.mechanism;
        let (mut steps, mut nearest) = (0, 1.0_f64);
        for _ in 0..count / 200 {
            let mut edge = || (0..40).find_map(|_| case.edge_pose(rng));
            let (Some(a), Some(b)) = (edge(), edge()) else { break };
            let mut before: Option<(Pose, Joints)> = None;
            const N: usize = 200;
            for k in 0..=N {
                let pose = moved(&a, k as f64 / N as f64, &moved(&b, -1.0, &a));
                let Ok(joints) = m.inverse(&pose) else {
                    before = None;
                    continue;
                };
                if let Some((last, last_joints)) = before {
                    let mut step_mm = 0.0;
                    for axis in m.axes().iter() {
                        let d = (pose.get(axis) - last.get(axis)).abs();
                        step_mm += if axis.is_rotary() { d * case.size_mm } else { d };
                    }
                    // A square root moves at most by √(2 l step) when its argument moves by 2 l step; MOMA-W levers by 5.
                    let lever = if m.kind() == "MomaW" { 5.0 } else { 2.0 };
                    let bound = lever * step_mm + (2.0 * case.size_mm * lever * step_mm).sqrt();
                    for (j, (q, p)) in joints.iter().zip(last_joints).enumerate() {
                        assert!(
                            (q - p).abs() <= bound,
                            "joint {j} jumps from {p} to {q}: {last:?} -> {pose:?}"
                        );
                    }
                    let measure = m.singularity(&pose).unwrap();
                    nearest = nearest.min(measure.inverse);
                    steps += 1;
                    if measure.forward > 0.1 {
                        let seed = if last == Pose::ZERO { pose } else { last };
                        let back = match m.forward(&joints, &seed) {
                            Err(ForwardError::GuideSide { excess_mm, .. }) if excess_mm < 1.1e-9 => continue,
                            other => other.unwrap_or_else(|e| panic!("{e}: {pose:?}")),
                        };
                        for axis in m.axes().iter() {
                            let off = (back.get(axis) - pose.get(axis)).abs();
                            assert!(off < 1e-6, "{axis:?} leaves the path by {off}: {pose:?} {measure:?}");
                        }
                    }
                }
                before = Some((pose, joints));
            }
        }
        if (0..40).any(|_| case.edge_pose(rng).is_some()) {
            assert!(steps > count / 100, "{steps} steps");
            // Those whose edge is a singularity came near it (Lambda's edge is its spacing limit).
            if matches!(m.kind(), "Moma4s" | "OxGlide" | "LinearDelta") {
                assert!(nearest < 0.2, "nearest {nearest}");
            }
        }
    });
}

#[test]
fn branches_contain_the_configured_solution_and_are_solutions() {
    for_all("branches", |case, rng, count| {
        let m = &case.mechanism;
        let mut most = 0;
        for _ in 0..count / 20 {
            let pose = case.any_pose(rng);
            let Ok(joints) = m.inverse(&pose) else { continue };
            let all = m.inverse_branches(&pose).unwrap();
            most = most.max(all.as_slice().len());
            assert_eq!(all.as_slice()[0], joints, "{pose:?}");
            let Ok(back) = m.forward(&joints, &pose) else { continue };
            let poses = m.forward_branches(&joints, &pose).unwrap();
            assert_eq!(poses.as_slice()[0], back, "{pose:?}");
        }
        let expected = match m.kind() {
            "Planar" | "Moma" | "Moma4s" | "HvMill" | "HvMachine" => 4,
            "MomaW" => 16,
            "OxGlide" => 2,
            "LinearDelta" => 8,
            _ => 1,
        };
        assert_eq!(most, expected, "{}", case.name);
    });
}

#[test]
fn joint_kinds_codes_and_counts_agree() {
    for case in cases() {
        let m = &case.mechanism;
        assert!(m.joint_count() <= MAX_JOINTS && m.joint_count() > 0);
        let mut codes: Vec<_> = (0..m.joint_count()).map(|j| m.joint_code(j)).collect();
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), m.joint_count(), "{}", case.name);
        let rotary = (0..m.joint_count()).filter(|j| m.joint_kind(*j) == JointKind::Rotary).count();
        assert!(rotary <= 3);
    }
}
