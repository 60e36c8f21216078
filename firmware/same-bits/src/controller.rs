//! A whole controller without an operating system: G-code text → interpreter → planner → inverse kinematics → step edges.
//!
//! What a firmware does, less the timer: nothing here allocates, and every queue has a fixed size.

use heapless::Deque;
use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::{Interpreter, MemorySource, Settings, Status};
use pkm_kins::maths::PI;
use pkm_kins::{Axis, AxisSet, JointRange, Kinematics, Moma, MomaConfiguration, Pose};
use pkm_planner::path::Tolerance;
use pkm_planner::{Event, Frame, JointLimits, Limits, Planner, PushError, State};
use pkm_stepgen::{Line, Period, PulseTimingNs, StepGenerator};

/// A line, a full circle, a rounded corner, a dwell and a way home, about the home pose.
const PROGRAM: &[u8] = b"G21 G90 G94 G64 P0.05 F3000\n\
    G1 X20 Y-250\n G2 I-20 J0\n G1 Y-240 X-15.5\n X[-10*SQRT[2]] Y-255.25\n G4 P0.01\n G0 X0 Y-250\n M2\n";

const STEPS_PER_MM: f64 = 400.0;

/// Motion events of the blocks read so far.
struct Events<'a> {
    frame: &'a mut Frame,
    queue: Deque<(Event, Span), 16>,
    overflow: bool,
}

impl CanonSink for Events<'_> {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        let Self { frame, queue, overflow } = self;
        frame.apply(command, span, |event| *overflow |= queue.push_back((event, span)).is_err());
    }
}

/// FNV-1a over every edge, and the number of steps; 0 if anything is refused.
pub fn hash() -> (u64, u64) {
    run().unwrap_or((0, 0))
}

fn run() -> Option<(u64, u64)> {
    let moma = Moma::new(&MomaConfiguration::A.into()).ok()?;
    let home = Pose { y: -250.0, ..Pose::ZERO };
    let joint = JointLimits {
        range: JointRange { min: 0.0, max: 250.0 },
        max_velocity: 100.0,
        max_acceleration: 1000.0,
    };
    let limits = Limits::<2>::new(&[joint, joint], &[], 0.05).ok()?;
    let settings = pkm_planner::Settings { servo_period_s: 1e-3, substeps: 1, settle_periods: 0 };
    let mut planner = Planner::<Moma, 2, 16, 256>::new(moma, limits, settings, home).ok()?;

    let axes = AxisSet::new(&[Axis::X, Axis::Y]);
    let mut interpreter = Interpreter::new(Settings { axes, ..Settings::default() });
    interpreter.set_machine_position_mm(pkm_canon::Position::from_array(home.to_array()));
    let mut source = MemorySource::new(PROGRAM);
    let blend = Tolerance { length_mm: 0.05, angle_rad: PI / 18_000.0 };
    let mut frame = Frame::new(home.to_array(), blend);
    let mut events = Events { frame: &mut frame, queue: Deque::new(), overflow: false };

    let timing = PulseTimingNs { step_length: 2000, step_space: 2000, dir_setup: 5000, dir_hold: 5000 };
    let ticks = timing.ticks(100).ok()?;
    let joints = moma.inverse(&home).ok()?;
    let mut generators = [
        StepGenerator::new(0, STEPS_PER_MM, ticks, *joints.first()?).ok()?,
        StepGenerator::new(1, STEPS_PER_MM, ticks, *joints.get(1)?).ok()?,
    ];
    let mut period = Period::new(0, 1_000_000, 100).ok()?;
    let mut hash = super::Hash(0xcbf2_9ce4_8422_2325);
    let mut steps = 0;
    let mut ended = false;
    loop {
        // The background loop: as far ahead as there is room.
        while planner.has_room() {
            match events.queue.front() {
                Some(&(Event::Move(next), _)) => match planner.push(next) {
                    Ok(_) => {}
                    Err(PushError::Full) => break,
                    Err(PushError::Plan(_)) => return None,
                },
                Some(&(Event::Dwell { ns }, span)) => match planner.push_dwell(ns, span) {
                    Ok(()) => {}
                    Err(PushError::Full) => break,
                    Err(PushError::Plan(_)) => return None,
                },
                Some(_) => {}
                None if ended => break,
                None => {
                    ended = interpreter.step(&mut source, &mut events).ok()? == Status::Ended;
                    if ended {
                        planner.finish();
                    }
                    continue;
                }
            }
            events.queue.pop_front();
        }
        // The servo interrupt.
        let setpoint = planner.tick().ok()?;
        for ((generator, position), velocity) in
            generators.iter_mut().zip(setpoint.joints).zip(setpoint.joint_velocity)
        {
            let advanced = generator.advance(position, velocity, &period, |edge| {
                let line = u64::from(edge.line == Line::Step);
                steps += line & u64::from(edge.level);
                hash.word(edge.time * 8 + u64::from(edge.joint) * 4 + line * 2 + u64::from(edge.level));
            });
            if advanced.is_err() {
                return None;
            }
        }
        period = period.next();
        if ended && events.queue.is_empty() && planner.is_idle() {
            return (setpoint.state == State::Idle && !events.overflow).then_some((hash.0, steps));
        }
    }
}
