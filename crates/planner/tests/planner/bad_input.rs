//! Paths, limits and feeds that no program should have: an error with its place, or a correct run. Never NaN, never a
//! stop that is not the program's.

use crate::catalogue::{Case, blend, identity, moma, on_delta, on_moma, polyline, xyz};
use crate::harness::{Disturbance, Rig, Sampling, TestPlanner, drive, limits, start, to_move, with_stack};
use pkm_canon::Span;
use pkm_kins::moma::{Moma, MomaConfiguration};
use pkm_kins::{Axis, InverseError, JointRange, Kinematics, OxForm, OxGlide, Pose};
use pkm_planner::path::{Arc, Geometry, Line, Vector};
use pkm_planner::{
    AxisLimits, JointLimits, Limits, LimitsError, PathMode, PlanErrorKind, PushError, Settings, State,
};

const SETTINGS: Settings = Settings { servo_period_s: 1e-3, substeps: 1, settle_periods: 0 };
const MODES: [PathMode; 3] = [PathMode::ExactStop, PathMode::ExactPath, PathMode::Blend(TOLERANCE)];
const TOLERANCE: pkm_planner::path::Tolerance =
    pkm_planner::path::Tolerance { length_mm: 0.01, angle_rad: 1e-3 };

fn lines(points: &[Vector], mode: PathMode, feed_mm_s: f64) -> Case {
    Case { feed_mm_s, ..on_moma(polyline(points, mode)) }
}

/// Runs to the end of the path within all limits; returns the seconds taken.
fn clean(what: &str, case: &Case) -> f64 {
    let trace = drive(case, Sampling::SERVO, Disturbance::None, false);
    let goal = case.moves.last().unwrap().0;
    let goal = goal.at(goal.length()).position;
    assert!(trace.velocity <= 1.0 + 1e-6, "{what}: velocity {}", trace.velocity);
    assert!(trace.acceleration <= 1.0 + 1e-6, "{what}: acceleration {}", trace.acceleration);
    assert!(trace.end.iter().zip(goal).all(|(a, b)| (a - b).abs() < 1e-9), "{what}: ends at {:?}", trace.end);
    trace.duration_s
}

#[test]
fn limits_that_make_no_machine_are_refused() {
    let range = JointRange { min: 0.0, max: 200.0 };
    let good = JointLimits { range, max_velocity: 100.0, max_acceleration: 1000.0 };
    assert!(Limits::<2>::new(&[good, good], &[], 0.0).is_ok());
    for bad in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        for joint in
            [JointLimits { max_velocity: bad, ..good }, JointLimits { max_acceleration: bad, ..good }]
        {
            assert_eq!(Limits::<2>::new(&[good, joint], &[], 0.0).unwrap_err(), LimitsError::Joint(1));
        }
    }
    for (min, max) in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN)] {
        let joint = JointLimits { range: JointRange { min, max }, ..good };
        assert_eq!(Limits::<2>::new(&[joint, good], &[], 0.0).unwrap_err(), LimitsError::Joint(0));
    }
    let axis = |max_velocity, max_acceleration| AxisLimits {
        axis: Axis::Y,
        range: None,
        max_velocity,
        max_acceleration,
    };
    assert!(Limits::<2>::new(&[good], &[axis(f64::INFINITY, 5.0)], 0.0).is_ok());
    for bad in [axis(0.0, 5.0), axis(5.0, -1.0), axis(f64::NAN, 5.0)] {
        assert_eq!(Limits::<2>::new(&[good], &[bad], 0.0).unwrap_err(), LimitsError::Axis(Axis::Y));
    }
    let room = Limits::<2>::new(&[good, good], &[axis(1.0, 1.0)], 0.0);
    assert_eq!(room.unwrap_err(), LimitsError::TooMany { rows: 3, room: 2 });
}

#[test]
fn a_million_identical_points_are_no_motion() {
    with_stack(|| {
        let (a, b) = (xyz(0.0, -265.0, 0.0), xyz(10.0, -265.0, 0.0));
        let case = lines(&[a, b], blend(0.01), 50.0);
        let mut rig = Rig::new(&case, Sampling::SERVO);
        let point = Geometry::Line(Line { start: a, direction: [0.0; 9], length: 0.0 });
        for _ in 0..1_000_000 {
            rig.planner.push(to_move(&case, (point, blend(0.01)))).unwrap();
        }
        assert!(rig.planner.is_idle());
        assert!(Line::new(a, a).is_none());
        let number = rig.planner.push(to_move(&case, case.moves[0])).unwrap();
        assert_eq!(number, 1_000_000);
        rig.planner.finish();
        let mut ticks = 0;
        while rig.planner.tick().unwrap().state != State::Idle && ticks < 1000 {
            ticks += 1;
        }
        assert_eq!(rig.planner.setpoint().pose.to_array(), b);
    });
}

#[test]
fn a_feed_of_nothing_is_refused_with_its_place_and_a_boundless_one_is_held_by_the_joints() {
    with_stack(|| {
        let points = [xyz(-50.0, -270.0, 0.0), xyz(50.0, -270.0, 0.0)];
        for speed in [0.0, -1.0, f64::NAN] {
            let case = lines(&points, PathMode::ExactPath, speed);
            let mut rig = Rig::new(&case, Sampling::SERVO);
            let span = Span { line: 7, ..Span::default() };
            let mut step = to_move(&case, case.moves[0]);
            step.span = span;
            match rig.planner.push(step) {
                Err(PushError::Plan(error)) => {
                    assert_eq!((error.kind, error.span), (PlanErrorKind::NoFeed, span));
                }
                other => panic!("F {speed}: {other:?}"),
            }
            assert!(rig.planner.is_idle());
        }
        let fast = clean("F1e9", &lines(&points, PathMode::ExactPath, 1e9));
        let rapid = clean("rapid", &lines(&points, PathMode::ExactPath, f64::INFINITY));
        assert!((fast - rapid).abs() <= 1e-3, "{fast} s and {rapid} s");
    });
}

#[test]
fn blocks_of_a_ten_millionth_of_a_millimetre_run() {
    with_stack(|| {
        for mode in MODES {
            let points: Vec<Vector> = (0..=500)
                .map(|k| {
                    let t = 1e-7 * f64::from(k);
                    // A millimetre before and after, so that they come at speed.
                    let along = if k == 0 {
                        -1.0
                    } else if k == 500 {
                        1.0
                    } else {
                        t
                    };
                    xyz(along, -265.0 + 3e-8 * f64::from(k % 2), 0.0)
                })
                .collect();
            let seconds = clean("1e-7 mm", &lines(&points, mode, 20.0));
            println!("{mode:?}: {seconds} s");
            // Every block takes at least the servo period it stops in; blended ones take no time to speak of.
            assert!(
                seconds < if matches!(mode, PathMode::Blend(_)) { 0.4 } else { 2.0 },
                "{mode:?}: {seconds} s"
            );
        }
    });
}

/// On this line the link of slider 1 is at a right angle to its rail.
fn singular(t: f64) -> Vector {
    let (sin, cos) = (libm::sin(265.0_f64.to_radians()), libm::cos(265.0_f64.to_radians()));
    xyz(-100.0 - 195.0 * sin + t * cos, 195.0 * cos + t * sin, 0.0)
}

#[test]
fn a_path_along_a_singular_locus_ends_in_an_error_with_its_place() {
    with_stack(|| {
        for guard in [0.0, 1e-6, 0.05] {
            for mode in MODES {
                // From well inside up to the locus, then along it, then back.
                let points = [xyz(0.0, -265.0, 0.0), singular(120.0), singular(90.0), xyz(0.0, -265.0, 0.0)];
                let case = lines(&points, mode, f64::INFINITY);
                let joints = [JointLimits {
                    range: JointRange { min: -1000.0, max: 1000.0 },
                    max_velocity: 100.0,
                    max_acceleration: 1000.0,
                }; 2];
                let limits = Limits::new(&joints, &[], guard).unwrap();
                let mut planner =
                    Box::new(TestPlanner::new(case.mechanism, limits, SETTINGS, start(&case)).unwrap());
                for (line, piece) in (1..).zip(&case.moves) {
                    let mut step = to_move(&case, *piece);
                    step.span = Span { line, ..Span::default() };
                    let _ = planner.push(step);
                }
                planner.finish();
                let mut ticks = 0;
                let mut last = *planner.setpoint();
                loop {
                    let setpoint = planner.tick().unwrap();
                    let numbers = setpoint.joints.iter().chain(&setpoint.joint_velocity);
                    assert!(numbers.chain(&setpoint.pose.to_array()).all(|x| x.is_finite()), "{setpoint:?}");
                    let rests = setpoint.joints == last.joints && ticks > 0;
                    last = setpoint;
                    if rests && planner.fault().is_some() {
                        break;
                    }
                    ticks += 1;
                    assert!(ticks < 20_000, "guard {guard}, {mode:?}: no error and no end: {planner:?}");
                }
                let fault = planner.fault().unwrap();
                assert!(matches!(fault.kind, PlanErrorKind::Unreachable(_)), "{fault:?}");
                assert!((1..=2).contains(&fault.span.line), "{fault:?}");
                let place = fault.pose.to_array();
                let goal = singular(120.0);
                let far = pkm_kins::maths::hypot(place[0] - goal[0], place[1] - goal[1]);
                assert!(far < 10.0, "guard {guard}, {mode:?}: {fault:?} is {far} mm away");
            }
        }
    });
}

#[test]
fn rotary_and_mixed_moves_hold_every_limit() {
    with_stack(|| {
        let axes = [Axis::X, Axis::Y, Axis::Z, Axis::A, Axis::B, Axis::C];
        let pose = |x: f64, y: f64, z: f64, deg: [f64; 3]| {
            let [a, b, c] = deg.map(f64::to_radians);
            [x, y, z, a, b, c, 0.0, 0.0, 0.0]
        };
        let points = [
            pose(0.0, 0.0, 0.0, [0.0, 0.0, 0.0]),
            pose(0.0, 0.0, 0.0, [90.0, 0.0, 0.0]),
            pose(0.0, 0.0, 0.0, [90.0, -45.0, 10.0]),
            pose(30.0, 5.0, 0.0, [60.0, -45.0, 200.0]),
            pose(30.0, 35.0, -5.0, [60.0, -45.0, 200.0]),
            pose(30.0, 35.1, -5.0, [0.0, 0.0, 0.0]),
            pose(0.0, 0.0, 0.0, [0.0, 0.0, 0.0]),
        ];
        let case = |mode, feed_mm_s| Case {
            mechanism: identity(&axes),
            velocity: vec![100.0, 100.0, 50.0, 3.0, 2.0, 6.0],
            acceleration: vec![1000.0, 800.0, 300.0, 30.0, 20.0, 50.0],
            moves: polyline(&points, mode),
            feed_mm_s,
        };
        for feed in [f64::INFINITY, 20.0, 1.0] {
            let [stop, path, blended] = MODES.map(|mode| clean("mixed", &case(mode, feed)));
            println!("F {feed}: {stop} s, {path} s, {blended} s");
            assert!(blended < stop && path <= stop + 1e-3, "{stop} s, {path} s, {blended} s");
        }
        // A quarter turn of A at 1 rad/s: 90° in π/2 s and 1/30 s to get there and as much to stop, in whole ticks.
        let mut quarter = case(PathMode::ExactStop, 1.0);
        quarter.moves.truncate(1);
        let seconds = clean("quarter turn", &quarter);
        let want = core::f64::consts::FRAC_PI_2 + 1.0 / 30.0;
        assert!((seconds - want).abs() <= 1.1e-3, "{seconds} s, want {want} s");
    });
}

#[test]
fn a_start_out_of_reach_or_travel_is_refused() {
    let case = lines(&[xyz(0.0, -265.0, 0.0), xyz(1.0, -265.0, 0.0)], PathMode::ExactStop, 1.0);
    let far = Pose::from_array(xyz(900.0, -265.0, 0.0));
    with_stack(move || {
        let refused = TestPlanner::new(case.mechanism, limits(&case), SETTINGS, far);
        assert!(matches!(refused.map(|_| ()).unwrap_err().kind, PlanErrorKind::Unreachable(_)));
    });
}

/// The push itself says it, before anything of the move is driven, and names joint, value, limit, place and block.
#[test]
fn a_move_that_leaves_the_travel_between_its_ends_is_refused_by_the_push() {
    with_stack(|| {
        // A line to where a half circle begins that bulges downwards.
        let points = [xyz(30.0, -265.0, 0.0), xyz(40.0, -265.0, 0.0), xyz(-40.0, -265.0, 0.0)];
        let arc = Arc::new(points[1], points[2], [0.0, -265.0, 0.0], [0.0, 0.0, 1.0], -1).unwrap();
        let mut case = lines(&points, blend(0.1), 50.0);
        case.moves[1] = (Geometry::Arc(arc), blend(0.1));
        let joint_1 = |place: &Vector| case.mechanism.inverse(&Pose::from_array(*place)).unwrap()[0];
        let ends = points.iter().map(joint_1).fold(f64::MIN, f64::max);
        let along = |k: u32| Geometry::Arc(arc).at(arc.length * f64::from(k) / 10_000.0).position;
        let top = (0..=10_000).map(|k| joint_1(&along(k))).fold(f64::MIN, f64::max);
        assert!(top > ends + 1.0, "{top} {ends}: no bulge");
        // A micrometre too little.
        let range = JointRange { min: -1000.0, max: top - 1e-3 };
        let wide = JointRange { min: -1000.0, max: 1000.0 };
        let limits = |range| {
            let joint = JointLimits { range, max_velocity: 100.0, max_acceleration: 1000.0 };
            Limits::new(&[joint, JointLimits { range: wide, ..joint }], &[], 0.0).unwrap()
        };
        let mut planner =
            Box::new(TestPlanner::new(case.mechanism, limits(range), SETTINGS, start(&case)).unwrap());
        let step = |line: u32| {
            let mut step = to_move(&case, case.moves[line as usize - 1]);
            step.span = Span { line, ..Span::default() };
            step
        };
        planner.push(step(1)).unwrap();
        let refused = planner.push(step(2));
        let Err(PushError::Plan(error)) = refused else { panic!("{refused:?}") };
        assert_eq!(error.span.line, 2);
        let PlanErrorKind::JointTravel { joint: 0, value, range: named } = error.kind else {
            panic!("{error:?}")
        };
        assert!(named == range && !range.contains(value), "{error:?}");
        let there = joint_1(&error.pose.to_array());
        assert!((there - value).abs() < 0.01, "{error:?}: at that place it is {there}");
        assert!(planner.push(step(2)).is_err(), "nothing more is taken");
        // The move before is driven to its end, at rest.
        planner.finish();
        let arrives = (0..10_000).any(|_| planner.tick().unwrap().state == State::Idle);
        assert!(arrives, "stops short of the refused move: {:?}", planner.setpoint());
        assert_eq!(planner.setpoint().pose.to_array(), points[1]);
    });
}

/// A line is not looked at again where the one before has ended; what it does from there on is.
#[test]
fn a_joint_that_turns_back_outside_its_travel_just_after_the_start_of_a_line_is_refused_by_the_push() {
    with_stack(|| {
        // Along this line joint 1 is lowest at `turn_mm`, where its link is at a right angle to the line.
        let at = |s: f64| {
            let k = 1.0 / libm::hypot(165.0, 105.0);
            xyz(165.0 * k * s, -265.0 + 105.0 * k * s, 0.0)
        };
        let joint_1 = |s: f64| moma().inverse(&Pose::from_array(at(s))).unwrap()[0];
        let (mut low, mut high) = (-30.0, 30.0);
        for _ in 0..100 {
            let third = (high - low) / 3.0;
            if joint_1(low + third) > joint_1(high - third) { low += third } else { high -= third }
        }
        let turn_mm = low;
        // The second line begins 0.6 mm before that; a place every millimetre finds the joint within its travel.
        let points = [-40.0, -0.6, 20.4].map(|s| at(turn_mm + s));
        let lowest = joint_1(turn_mm);
        let range = JointRange { min: lowest + 1e-4, max: 1000.0 };
        for s in [-0.6, 0.4, 1.4] {
            assert!(range.contains(joint_1(turn_mm + s)), "{} {lowest}", joint_1(turn_mm + s));
        }
        let case = lines(&points, blend(0.01), 50.0);
        let joint = JointLimits { range, max_velocity: 100.0, max_acceleration: 1000.0 };
        let wide = JointRange { min: -1000.0, max: 1000.0 };
        let limits = Limits::new(&[joint, JointLimits { range: wide, ..joint }], &[], 0.0).unwrap();
        let mut planner = Box::new(TestPlanner::new(case.mechanism, limits, SETTINGS, start(&case)).unwrap());
        planner.push(to_move(&case, case.moves[0])).unwrap();
        let before = planner.work();
        let refused = planner.push(to_move(&case, case.moves[1]));
        let Err(PushError::Plan(error)) = refused else { panic!("{refused:?}") };
        let PlanErrorKind::JointTravel { joint: 0, value, .. } = error.kind else { panic!("{error:?}") };
        assert!((value - lowest).abs() < 1e-5, "{error:?}: it turns at {lowest}");
        assert_eq!(planner.work(), before, "found before anything was cut into nodes");
    });
}

/// At full speed they turn by a radian a period: between the nodes, too, the limits hold.
#[test]
fn circles_of_some_micrometres_keep_the_limits() {
    with_stack(|| {
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        let mut random = |low: f64, high: f64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        for case in 0..60 {
            let at = xyz(random(-8.0, 8.0), random(-8.0, 8.0), 20.0);
            let (radius, angle) = (libm::exp10(random(-3.0, -1.5)), random(-3.0, 3.0));
            let centre = [at[0] + radius * libm::cos(angle), at[1] + radius * libm::sin(angle), at[2]];
            let arc = Arc::new(at, at, centre, [0.0, 0.0, 1.0], [1, -2, 5][case % 3]).unwrap();
            let circle = on_delta(vec![(Geometry::Arc(arc), PathMode::ExactStop)]);
            for sampling in [Sampling::SERVO, Sampling::TENTH] {
                let trace = drive(&circle, sampling, Disturbance::None, false);
                let most = trace.velocity.max(trace.acceleration);
                assert!(most <= 1.0, "case {case}, radius {radius} at {at:?}: {most}");
            }
        }
    });
}

/// Out of a slow arc into a line, through a corner of micrometres in which the speed rises from next to nothing to its most.
#[test]
fn a_small_corner_between_a_slow_and_a_fast_move_keeps_the_limits() {
    with_stack(|| {
        let centre = [57.714944, 57.41926, 0.0];
        let on_circle =
            |angle: f64| xyz(centre[0] + 0.373 * libm::cos(angle), centre[1] + 0.373 * libm::sin(angle), 0.0);
        let (from, to) = (on_circle(-2.6688), on_circle(-0.6594));
        let arc = Geometry::Arc(Arc::new(from, to, centre, [0.0, 0.0, 1.0], 1).unwrap());
        let line = Geometry::Line(Line::new(to, xyz(58.035963, 57.221886, 0.0)).unwrap());
        let mechanism = Moma::new(&MomaConfiguration::D.into()).unwrap().into();
        let case = Case { mechanism, ..on_moma(vec![(arc, blend(0.001)), (line, PathMode::ExactStop)]) };
        let mut rig = Rig::new(&case, Sampling::TENTH);
        for (step, speed) in case.moves.iter().zip([1.0, 1000.0]) {
            let mut step = to_move(&case, *step);
            step.feed.speed = speed;
            rig.planner.push(step).unwrap();
        }
        rig.planner.finish();
        while rig.tick().state != State::Idle {}
        let [_, acceleration, _] = rig.worst();
        assert!(acceleration <= 1.0, "{acceleration}");
    });
}

/// Places evenly along an arc of 64 or 32 turns could all be on its good side.
#[test]
fn an_arc_of_many_turns_that_leaves_the_travel_is_refused_by_the_push() {
    with_stack(|| {
        let from = xyz(0.0, 0.0, 0.0);
        for turns in [2, 16, 32, 64, -64, 128] {
            let arc = Arc::new(from, from, [12.0, 0.0, 0.0], [0.0, 0.0, 1.0], turns).unwrap();
            let moves = vec![(Geometry::Arc(arc), PathMode::ExactStop)];
            let case = Case { mechanism: identity(&[Axis::X, Axis::Y]), ..on_moma(moves) };
            let range = JointRange { min: -20.0, max: 23.5 };
            let joint = JointLimits { range, max_velocity: 100.0, max_acceleration: 1000.0 };
            let limits = Limits::new(&[joint; 2], &[], 0.0).unwrap();
            let mut planner =
                Box::new(TestPlanner::new(case.mechanism, limits, SETTINGS, start(&case)).unwrap());
            let refused = planner.push(to_move(&case, case.moves[0]));
            let Err(PushError::Plan(error)) = refused else { panic!("{turns} turns: {refused:?}") };
            assert!(matches!(error.kind, PlanErrorKind::JointTravel { joint: 0, .. }), "{turns}: {error:?}");
            assert_eq!(planner.work().nodes, 0, "found before anything was cut into nodes");
        }
    });
}

/// Far ahead of the machine and of the nodes, at the first place looked at that is outside.
#[test]
fn a_long_line_that_ends_out_of_travel_or_reach_is_refused_by_the_push() {
    with_stack(|| {
        let points = [xyz(-50.0, -270.0, 0.0), xyz(49.5, -270.0, 0.0)];
        let joint_1 = |x: f64| moma().inverse(&Pose::from_array(xyz(x, -270.0, 0.0))).unwrap()[0];
        let all = JointRange { min: -1000.0, max: 1000.0 };
        let tight = if joint_1(49.5) > joint_1(40.0) {
            JointRange { max: joint_1(40.0), ..all }
        } else {
            JointRange { min: joint_1(40.0), ..all }
        };
        for (range, far, expected_mm) in [(tight, 49.5, 40.0), (all, 149.5, f64::NAN)] {
            let case = lines(&[points[0], xyz(far, -270.0, 0.0)], blend(0.01), 50.0);
            let joint = JointLimits { range, max_velocity: 100.0, max_acceleration: 1000.0 };
            let limits = Limits::new(&[joint, JointLimits { range: all, ..joint }], &[], 0.0).unwrap();
            let mut planner =
                Box::new(TestPlanner::new(case.mechanism, limits, SETTINGS, start(&case)).unwrap());
            let refused = planner.push(to_move(&case, case.moves[0]));
            let Err(PushError::Plan(error)) = refused else { panic!("{refused:?}") };
            match error.kind {
                // 100 places, but no more than 67 are looked at: one every 1.49 mm.
                PlanErrorKind::JointTravel { joint: 0, .. } => {
                    let past = error.pose.x - expected_mm;
                    assert!((0.0..1.5).contains(&past), "{error:?}");
                }
                PlanErrorKind::Unreachable(_) => assert!(expected_mm.is_nan(), "{error:?}"),
                other => panic!("{other:?}"),
            }
            assert_eq!(planner.work().nodes, 0, "found before anything was cut into nodes");
        }
    });
}

/// Its places can be reached, but no path may lead there: what a motion is refused, the push refuses.
#[test]
fn a_line_too_near_to_the_form_switch_is_refused_by_the_push() {
    with_stack(|| {
        let glide = OxGlide::new(&OxForm::O.into()).unwrap();
        // With links of 80 mm, c is 1.26 mm at the end, less than the 2 mm that are asked for.
        let points = [xyz(0.0, 50.0, 0.0), xyz(0.0, 79.99, 0.0)];
        assert!(glide.inverse(&Pose::from_array(points[1])).is_ok());
        let case = Case {
            mechanism: glide.into(),
            velocity: vec![100.0; 3],
            acceleration: vec![1000.0; 3],
            moves: polyline(&points, PathMode::ExactStop),
            feed_mm_s: 50.0,
        };
        let mut planner =
            Box::new(TestPlanner::new(case.mechanism, limits(&case), SETTINGS, start(&case)).unwrap());
        let refused = planner.push(to_move(&case, case.moves[0]));
        let Err(PushError::Plan(error)) = refused else { panic!("{refused:?}") };
        let near = matches!(error.kind, PlanErrorKind::Unreachable(InverseError::FormSwitch { .. }));
        assert!(near && planner.work().nodes == 0, "{error:?} {:?}", planner.work());
    });
}

/// Zero length, straight back, tolerances of nothing and of a kilometre: to the end, within all limits.
#[test]
fn reversals_and_absurd_tolerances_run() {
    with_stack(|| {
        let there = [
            xyz(0.0, -265.0, 0.0),
            xyz(10.0, -265.0, 0.0),
            xyz(0.0, -265.0, 0.0),
            xyz(0.0, -265.0, 0.0),
            xyz(10.0, -265.0, 0.0),
            xyz(10.0, -275.0, 0.0),
        ];
        let stop = clean("exact stop", &lines(&there, PathMode::ExactStop, f64::INFINITY));
        for p in [1e-12, 1e-6, 0.01, 1e9] {
            let blended = clean("reversal", &lines(&there, blend(p), f64::INFINITY));
            println!("P {p}: {blended} s, exact stop {stop} s");
            // There is no blend of a reversal: it stops there, and only there.
            assert!(blended <= stop + 1e-3, "P {p}: {blended} s of {stop} s");
            assert!(p > 1e-6 || stop - blended < 0.02, "P {p}: {blended} s of {stop} s");
        }
    });
}
