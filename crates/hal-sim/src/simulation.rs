//! The machine ready-wired: motion → stepgen → driver → motor on one servo thread, judged while it runs.
//!
//! Everything goes through the HAL's pins; [`Simulation::hal`] shows them. What is *reported* comes from the edges: the
//! simulation counts them itself, apart from generator and driver.

use crate::component::{Fault, Feedback, Setpoint, SetpointSource};
use crate::components::driver::{Driver, DriverChannel, Drivers};
use crate::components::motion::{Motion, MotionJoint};
use crate::components::motor::{MotorChannel, Motors};
use crate::components::spindle::Spindle;
use crate::components::stepgen::{Stepgen, StepgenChannel, StepgenError};
use crate::config::{
    ConfigError, JointConfig, SimulationConfig, THREAD, shown_scale, wire, wire_all_switches,
    wire_spindle_and_probe,
};
use crate::hal::Hal;
use crate::hal_error::HalError;
use crate::report::{JointState, JointStatistics, Observer, TickReport};
use crate::values::{BitPin, FloatPin, Value};
use pkm_kins::maths::radians;
use pkm_kins::{AxisSet, ForwardError, JointKind, Joints, Kinematics, MAX_JOINTS, Pose};
use pkm_stepgen::{Edge, Line, Period, PulseTiming, StepGenerator, StepType};
use std::any::Any;
use std::fmt;

mod homing;

/// Why a period did not go as wanted. After a fault the machine is stopped as by [`Simulation::emergency_stop`].
#[derive(Debug, Clone, PartialEq)]
pub enum TickError<E> {
    /// The source has no setpoint.
    Source(E),
    /// A component refused.
    Fault(Fault),
}

impl<E: fmt::Display> fmt::Display for TickError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Source(error) => error.fmt(f),
            Self::Fault(fault) => fault.fmt(f),
        }
    }
}

impl<E: fmt::Debug + fmt::Display> std::error::Error for TickError<E> {}

/// Where the joint's lines stand as the simulation has seen them.
#[derive(Debug, Clone)]
struct Lines {
    step: BitPin,
    dir: BitPin,
    step_cursor: u64,
    dir_cursor: u64,
    positive: bool,
    kind: JointKind,
    steps_per_unit: f64,
    motor_position: FloatPin,
    home_switch: BitPin,
    home_cursor: u64,
    home_on: bool,
    index: BitPin,
    index_cursor: u64,
    /// Where the joint is when its motor stands at 0, mm or rad: what only the simulation knows.
    origin: f64,
    /// Motor position less joint position, as homing found it, mm or rad.
    offset: f64,
}

/// Places of the components in the HAL, in order of loading.
const MOTION: usize = 0;
const STEPGEN: usize = 1;
const DRIVER: usize = 2;

/// The simulated machine. `Clone` forks it.
#[derive(Clone)]
pub struct Simulation {
    hal: Hal,
    lines: Vec<Lines>,
    states: Vec<JointState>,
    statistics: Vec<JointStatistics>,
    setpoint: Setpoint,
    period: Period,
    servo_period_ns: u64,
    axes: AxisSet,
    enable: BitPin,
    probe_input: BitPin,
    /// Its place among the components, if there is one.
    spindle: Option<usize>,
    tick: u64,
    /// Edges of the period in order of time, per joint and of all.
    joint_edges: Vec<Vec<Edge>>,
}

impl Simulation {
    /// Wires the machine; it stands at its start, lines low.
    ///
    /// # Errors
    /// See [`ConfigError`].
    pub fn new(config: &SimulationConfig) -> Result<Self, ConfigError> {
        let count = config.joints.len();
        if count == 0 || count > MAX_JOINTS {
            return Err(ConfigError::JointCount(count));
        }
        let mut hal = Hal::new(config.timer_period_ns)?;
        hal.new_thread(THREAD, config.servo_period_ns)?;
        let period =
            Period::new(0, config.servo_period_ns, config.timer_period_ns).map_err(HalError::from)?;

        let mut setpoint = Setpoint { pose: config.start, in_position: true, ..Setpoint::default() };
        let (mut motion, mut stepgen, mut drivers, mut motors) = (vec![], vec![], vec![], vec![]);
        let mut origins = vec![];
        for (n, joint) in config.joints.iter().enumerate() {
            let (origin, start) = if config.homed { (0.0, joint.start) } else { (joint.start, 0.0) };
            origins.push(origin);
            setpoint.joints[n] = start;
            let ticks = joint.timing.ticks(config.timer_period_ns).map_err(HalError::from)?;
            let at_start = StepGenerator::new(n as u8, joint.steps_per_unit, ticks, start)
                .map_err(|error| ConfigError::Joint { joint: n, error })?;
            motion.push(MotionJoint {
                kind: joint.kind,
                range: joint.range,
                start,
                step: 1.0 / joint.steps_per_unit,
                max_steps: ticks.max_steps(&period),
                max_acceleration: joint.max_acceleration,
                following_error: joint.following_error,
                homed: config.homed,
            });
            let scale = shown_scale(joint.kind, joint.steps_per_unit);
            let start = start * (joint.steps_per_unit / scale);
            stepgen.push(StepgenChannel {
                position_scale: scale,
                timing: joint.timing,
                start,
                enabled: true,
                step_type: StepType::StepDir,
            });
            let start = at_start.count();
            drivers.push(DriverChannel { minimum: joint.driver_minimum, start });
            motors.push(MotorChannel { scale, start });
        }
        Motion::load(&mut hal, &motion, config.axes)?;
        Stepgen::load(&mut hal, &stepgen).map_err(|error| match error {
            StepgenError::Hal(error) => ConfigError::Hal(error),
            StepgenError::Channel(joint, error) => ConfigError::Joint { joint, error },
        })?;
        Drivers::load(&mut hal, &drivers)?;
        Motors::load(&mut hal, &motors)?;
        wire(&mut hal, count)?;
        let spindle = wire_spindle_and_probe(&mut hal, config)?;
        wire_all_switches(&mut hal, &config.joints, &origins)?;

        let mut simulation = Self {
            lines: lines(&hal, config, &origins)?,
            enable: hal.bit_pin("motion.enable")?,
            probe_input: hal.bit_pin("motion.probe-input")?,
            spindle,
            hal,
            states: vec![JointState::default(); count],
            statistics: vec![JointStatistics::default(); count],
            setpoint,
            period,
            servo_period_ns: config.servo_period_ns,
            axes: config.axes,
            tick: 0,
            joint_edges: vec![Vec::new(); count],
        };
        simulation.start(&drivers);
        Ok(simulation)
    }

    fn start(&mut self, drivers: &[DriverChannel]) {
        for (n, driver) in drivers.iter().enumerate() {
            let position = driver.start as f64 / self.lines[n].steps_per_unit;
            let commanded = self.setpoint.joints[n];
            let offset = self.generators().nth(n).map_or(0.0, |generator| generator.offset(driver.start));
            self.states[n] = JointState { commanded, position, count: driver.start, step_error: -offset };
            let statistics = &mut self.statistics[n];
            (statistics.min_position, statistics.max_position) = (position, position);
        }
    }

    /// Runs one servo period with the next setpoint of `source`.
    ///
    /// # Errors
    /// `Source`: nothing has run. `Fault`: as after [`Self::emergency_stop`].
    pub fn tick<S: SetpointSource + ?Sized>(
        &mut self,
        source: &mut S,
        observers: &mut [&mut dyn Observer],
    ) -> Result<TickReport<'_>, TickError<S::Error>> {
        source.feedback(&self.feedback_now());
        let setpoint = source.next(self.tick + 1).map_err(TickError::Source)?;
        self.tick_to(&setpoint, observers).map_err(TickError::Fault)
    }

    /// Runs one servo period to a given setpoint.
    ///
    /// # Errors
    /// The fault of a component. The period has run. The machine stops: as [`crate::components::motion`] says for its own
    /// faults, as by [`Self::emergency_stop`] for those of others. Drive it with [`Self::idle`] until [`Self::drives_on`] is false.
    pub fn tick_to(
        &mut self,
        setpoint: &Setpoint,
        observers: &mut [&mut dyn Observer],
    ) -> Result<TickReport<'_>, Fault> {
        let result = self.hal.run(Some(setpoint));
        self.setpoint = *setpoint;
        self.end(result, observers)
    }

    /// Emergency stop (category 0): from the next period on the drives are off and no step begins. The simulation must
    /// then be driven with [`Self::idle`]; [`Self::reset`] ends it.
    pub fn emergency_stop(&mut self) {
        self.enable(false);
    }

    /// Sets the pin itself, whatever fault stands before its reader.
    fn enable(&mut self, on: bool) {
        if self.hal.setp("motion.enable", Value::Bit(on)).is_err() {
            self.hal.values_mut().set_bit(self.enable, on);
        }
    }

    /// Ends the emergency stop. The machine stands where the steps stand: [`Self::feedback`]; setpoints start there.
    pub fn reset(&mut self) {
        self.hal.with_component(MOTION, |motion: &mut Motion, _| motion.release());
        self.enable(true);
    }

    /// Runs one servo period without a setpoint: after an emergency stop, or at rest.
    ///
    /// # Errors
    /// The fault of a component, as in [`Self::tick_to`].
    pub fn idle(&mut self, observers: &mut [&mut dyn Observer]) -> Result<TickReport<'_>, Fault> {
        let result = self.hal.run(None);
        self.end(result, observers)
    }

    /// The period comes to its end.
    fn end(
        &mut self,
        result: Result<(), Fault>,
        observers: &mut [&mut dyn Observer],
    ) -> Result<TickReport<'_>, Fault> {
        if result.as_ref().is_err_and(|fault| !fault.is_of_motion()) || !self.drives_on() {
            self.emergency_stop();
        }
        self.commanded();
        let report = self.conclude(observers);
        result.map(|()| report)
    }

    /// The drives were on in the last period. Once they are off, [`Self::reset`] must come first.
    pub fn drives_on(&self) -> bool {
        self.motion().drives_on()
    }

    /// The setpoint is what motion made of it.
    fn commanded(&mut self) {
        let period_s = self.period.seconds();
        let motion = part::<Motion>(&self.hal, MOTION);
        if !motion.drives_on() {
            self.stands();
            return;
        }
        for n in 0..self.lines.len() {
            let asked = self.setpoint.joints[n];
            self.setpoint.joints[n] = motion.commanded(n);
            if asked != self.setpoint.joints[n] {
                self.setpoint.velocities[n] = motion.travelled(n) / period_s;
            }
        }
    }

    /// The command is where the steps stand.
    fn stands(&mut self) {
        self.setpoint.velocities = [0.0; MAX_JOINTS];
        self.setpoint.in_position = false;
        for (n, generator) in part::<Stepgen>(&self.hal, STEPGEN).generators().enumerate() {
            let line = &self.lines[n];
            self.setpoint.joints[n] = generator.count() as f64 / line.steps_per_unit - line.offset;
        }
    }

    fn conclude(&mut self, observers: &mut [&mut dyn Observer]) -> TickReport<'_> {
        self.tick += 1;
        let ordered = observers.iter().any(|observer| observer.wants_edges());
        self.judge(ordered);
        if ordered {
            self.deliver(observers);
        }
        self.period = self.period.next();
        let report = TickReport {
            tick: self.tick,
            time_ns: self.tick * self.servo_period_ns,
            setpoint: &self.setpoint,
            joints: &self.states,
            feedback: self.feedback_now(),
        };
        for observer in observers {
            observer.tick(&report);
        }
        report
    }

    /// Counts the edges of the period and compares them with the command.
    fn judge(&mut self, collect: bool) {
        let Self { hal, lines, states, statistics, setpoint, period, joint_edges, .. } = self;
        let stepgen = part::<Stepgen>(hal, STEPGEN);
        let per_tick = 1.0 / f64::from(period.ticks());
        for (n, (line, generator)) in lines.iter_mut().zip(stepgen.generators()).enumerate() {
            let (state, statistics) = (&mut states[n], &mut statistics[n]);
            let steps = hal.values().edges(line.step).read(&mut line.step_cursor, period.end());
            let mut turns = hal.values().edges(line.dir).read(&mut line.dir_cursor, period.end());
            joint_edges[n].clear();
            let cubic = generator.cubic();
            for step in steps {
                while let [turn, later @ ..] = turns
                    && turn.time <= step.time
                {
                    line.positive = turn.level;
                    statistics.reversals += 1;
                    if collect {
                        joint_edges[n].push(edge(n, Line::Dir, turn));
                    }
                    turns = later;
                }
                if step.level {
                    let before = (state.count - cubic.base) as f64;
                    let after = if line.positive { before + 1.0 } else { before - 1.0 };
                    state.count += if line.positive { 1 } else { -1 };
                    statistics.steps += 1;
                    let at = cubic.at(step.time.saturating_sub(period.start()) as f64 * per_tick);
                    let error = (before - at).abs().max((after - at).abs());
                    statistics.max_edge_error = statistics.max_edge_error.max(error);
                }
                if collect {
                    joint_edges[n].push(edge(n, Line::Step, step));
                }
            }
            for turn in turns {
                line.positive = turn.level;
                statistics.reversals += 1;
                if collect {
                    joint_edges[n].push(edge(n, Line::Dir, turn));
                }
            }
            state.commanded = setpoint.joints[n];
            state.position = state.count as f64 / line.steps_per_unit - line.offset;
            state.step_error = -generator.offset(state.count);
            statistics.max_step_error = statistics.max_step_error.max(state.step_error.abs());
            statistics.min_position = statistics.min_position.min(state.position);
            statistics.max_position = statistics.max_position.max(state.position);
        }
    }

    /// Hands the edges of all joints to the observers in order of time; at the same time in joint order.
    fn deliver(&mut self, observers: &mut [&mut dyn Observer]) {
        let mut next = [0_usize; MAX_JOINTS];
        loop {
            let mut first: Option<(usize, &Edge)> = None;
            for (n, edges) in self.joint_edges.iter().enumerate() {
                if let Some(edge) = edges.get(next[n])
                    && first.is_none_or(|(_, other)| edge.time < other.time)
                {
                    first = Some((n, edge));
                }
            }
            let Some((n, edge)) = first else { return };
            next[n] += 1;
            for observer in observers.iter_mut() {
                observer.edge(edge);
            }
        }
    }

    /// Number of the last period; 0 before the first.
    pub const fn tick_number(&self) -> u64 {
        self.tick
    }

    /// The machine as it stands.
    pub fn report(&self) -> TickReport<'_> {
        TickReport {
            tick: self.tick,
            time_ns: self.tick * self.servo_period_ns,
            setpoint: &self.setpoint,
            joints: &self.states,
            feedback: self.feedback_now(),
        }
    }

    /// Joint positions as the edges have them, mm or rad.
    pub fn feedback(&self) -> Joints {
        let mut joints = [0.0; MAX_JOINTS];
        for (joint, state) in joints.iter_mut().zip(&self.states) {
            *joint = state.position;
        }
        joints
    }

    /// Where the motors really hold the joints, mm or rad, whatever is known of it.
    pub fn true_joints(&self) -> Joints {
        let mut joints = [0.0; MAX_JOINTS];
        for (joint, line) in joints.iter_mut().zip(&self.lines) {
            let position = self.hal.values().float(line.motor_position);
            let position = if line.kind == JointKind::Rotary { radians(position) } else { position };
            *joint = position + line.origin;
        }
        joints
    }

    /// The pose at which the motors hold the mechanism.
    ///
    /// # Errors
    /// The mechanism's own, if the motors stand where it cannot be.
    pub fn feedback_pose(&self, kinematics: &(impl Kinematics + ?Sized)) -> Result<Pose, ForwardError> {
        let joints = self.true_joints();
        kinematics.forward(&joints, &self.setpoint.pose)
    }

    /// What spindle and probe tell.
    fn feedback_now(&self) -> Feedback {
        let spindle =
            self.spindle.map_or_else(Default::default, |place| part::<Spindle>(&self.hal, place).feedback());
        let operator = self.motion().operator();
        Feedback { spindle, probe: self.hal.values().bit(self.probe_input), operator }
    }

    /// True if the machine has a spindle.
    pub const fn has_spindle(&self) -> bool {
        self.spindle.is_some()
    }

    /// What the joints did so far.
    pub fn statistics(&self) -> Vec<JointStatistics> {
        let timer_period_ns = self.hal.timer_period_ns();
        let judged = self.statistics.iter().zip(self.generators()).zip(self.drivers());
        judged
            .map(|((statistics, generator), driver)| JointStatistics {
                min_pulse_interval_ns: driver.min_interval_ns(),
                delayed_steps: generator.report().delayed_steps,
                max_delay_ns: generator.report().max_delay.saturating_mul(timer_period_ns),
                violations: *driver.violations(),
                ..*statistics
            })
            .collect()
    }

    fn motion(&self) -> &Motion {
        part::<Motion>(&self.hal, MOTION)
    }

    /// Motor positions at which the joints are at 0, as homing found them, mm or rad.
    pub fn home_offsets(&self) -> Joints {
        let mut offsets = [0.0; MAX_JOINTS];
        for (offset, line) in offsets.iter_mut().zip(&self.lines) {
            *offset = line.offset;
        }
        offsets
    }

    /// Setpoints that are missing now, in a row.
    pub fn missed_periods(&self) -> u32 {
        self.motion().missed()
    }

    /// Every joint knows where it is.
    pub fn is_homed(&self) -> bool {
        self.motion().is_homed()
    }

    fn generators(&self) -> impl Iterator<Item = &StepGenerator> {
        part::<Stepgen>(&self.hal, STEPGEN).generators()
    }

    fn drivers(&self) -> impl Iterator<Item = &Driver> {
        part::<Drivers>(&self.hal, DRIVER).drivers()
    }

    /// The HAL underneath.
    pub const fn hal(&self) -> &Hal {
        &self.hal
    }

    /// The HAL underneath, to set pins or wire more.
    pub const fn hal_mut(&mut self) -> &mut Hal {
        &mut self.hal
    }

    /// The coordinates of the machine.
    pub const fn axes(&self) -> AxisSet {
        self.axes
    }

    /// Length or angle, in joint order.
    pub fn joint_kinds(&self) -> impl Iterator<Item = JointKind> {
        self.lines.iter().map(|line| line.kind)
    }

    /// Steps per mm or rad, in joint order.
    pub fn steps_per_unit(&self) -> impl Iterator<Item = f64> {
        self.lines.iter().map(|line| line.steps_per_unit)
    }

    /// Pulse times as the edges keep them, in joint order.
    pub fn pulse_timings(&self) -> impl Iterator<Item = &PulseTiming> {
        self.generators().map(StepGenerator::timing)
    }

    /// Servo period, ns.
    pub const fn servo_period_ns(&self) -> u64 {
        self.servo_period_ns
    }
}

/// The component that `Simulation::new` loaded at this place.
fn part<T: Any>(hal: &Hal, place: usize) -> &T {
    let component: Option<&dyn Any> = hal.component(place).map(|component| component as &dyn Any);
    component.and_then(<dyn Any>::downcast_ref).expect("Simulation::new loads the components in this order")
}

fn edge(joint: usize, line: Line, edge: &crate::values::LineEdge) -> Edge {
    Edge { time: edge.time, joint: joint as u8, line, level: edge.level }
}

fn lines(hal: &Hal, config: &SimulationConfig, origins: &[f64]) -> Result<Vec<Lines>, HalError> {
    let line = |(n, (joint, origin)): (usize, (&JointConfig, &f64))| {
        Ok(Lines {
            step: hal.bit_pin(&format!("stepgen.{n}.step"))?,
            dir: hal.bit_pin(&format!("stepgen.{n}.dir"))?,
            step_cursor: 0,
            dir_cursor: 0,
            positive: false,
            kind: joint.kind,
            steps_per_unit: joint.steps_per_unit,
            motor_position: hal.float_pin(&format!("motor.{n}.position"))?,
            home_switch: hal.bit_pin(&format!("joint.{n}.home-sw-in"))?,
            home_cursor: 0,
            home_on: false,
            index: hal.bit_pin(&format!("joint.{n}.index-in"))?,
            index_cursor: 0,
            origin: *origin,
            offset: 0.0,
        })
    };
    config.joints.iter().zip(origins).enumerate().map(line).collect()
}
