//! `stepgen`: position commands to step and direction edges ([`pkm_stepgen`]).
//!
//! | pin or parameter             | type      | meaning                                                        |
//! |------------------------------|-----------|----------------------------------------------------------------|
//! | `stepgen.N.position-cmd`     | float in  | position at the end of the period, mm or degrees               |
//! | `stepgen.N.velocity-cmd`     | float in  | velocity there, mm/s or degrees/s; not linked: straight lines  |
//! | `stepgen.N.enable`           | bit in    | false: no step begins; the generator stands where the steps stand |
//! | `stepgen.N.step`, `.dir`     | bit out   | the lines, with their edges inside the period; dir high = positive |
//! | `.up`, `.down`, `.phase-a` … | bit out   | in their place, for other step types                           |
//! | `stepgen.N.counts`           | s32 out   | steps so far (wraps)                                           |
//! | `stepgen.N.position-fb`      | float out | counts / scale                                                 |
//! | `stepgen.N.position-scale`   | float rw  | steps per mm or degree, not 0                                  |
//! | `stepgen.N.steplen`, `.stepspace`, `.dirsetup`, `.dirhold` | u32 rw | ns; kept rounded up to the timer |
//! | `stepgen.N.max-delay`        | u32 ro    | largest delay of a step for these times, ns                    |
//!
//! Functions: `stepgen.update-freq` makes the edges of the period, `stepgen.capture-position` shows counts and position;
//! `stepgen.make-pulses` has nothing to do (edges have exact times without a base thread), kept for HAL files.
//!
//! Unlike LinuxCNC's, whose position lags by 1.5 servo periods, this one reaches the command at the period's end.

use crate::component::{Component, Fault, PinIndex, PinName, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, EdgeQueue, FloatPin, LineEdge, S32Pin, U32Pin, Values};
use pkm_stepgen::step_types::MAX_PHASES;
use pkm_stepgen::{Edge, EdgeError, Line, PulseTimingNs, StepGenerator, StepType};

/// One channel as configured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepgenChannel {
    /// Steps per mm or degree.
    pub position_scale: f64,
    /// Times of its pulses.
    pub timing: PulseTimingNs,
    /// Where the joint stands at the start, mm or degrees.
    pub start: f64,
    /// Whether the generator is enabled while `enable` is not linked.
    pub enabled: bool,
    /// What a step does to the lines.
    pub step_type: StepType,
}

#[derive(Debug, Clone)]
struct Pins {
    position_cmd: FloatPin,
    velocity_cmd: FloatPin,
    enable: BitPin,
    step_type: StepType,
    /// step and dir, up and down, or phases; the rest repeats the first.
    lines: [BitPin; MAX_PHASES],
    counts: S32Pin,
    position_fb: FloatPin,
    max_delay: U32Pin,
    position_scale: FloatPin,
    /// steplen, stepspace, dirsetup, dirhold
    times: [U32Pin; 4],
    /// What the generator was configured with.
    configured: (f64, [u32; 4]),
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Stepgen {
    channels: Vec<(StepGenerator, Pins)>,
    timer_period_ns: u64,
}

/// Why it cannot be loaded.
#[derive(Debug, Clone, PartialEq)]
pub enum StepgenError {
    /// A pin.
    Hal(HalError),
    /// Scale or start position of a channel.
    Channel(usize, EdgeError),
}

impl From<HalError> for StepgenError {
    fn from(error: HalError) -> Self {
        Self::Hal(error)
    }
}

impl Stepgen {
    /// Loads the component: pins and functions.
    ///
    /// # Errors
    /// `Hal`: loaded already, or a pulse time too long. `Channel`: scale 0, not finite, or a start beyond 2³² steps.
    pub fn load(hal: &mut Hal, channels: &[StepgenChannel]) -> Result<(), StepgenError> {
        let timer_period_ns = hal.timer_period_ns();
        let mut with_pins = Vec::new();
        for (n, channel) in channels.iter().enumerate() {
            let timing = channel.timing.ticks(timer_period_ns).map_err(HalError::from)?;
            let generator = StepGenerator::with_type(
                n as u8,
                channel.position_scale,
                timing,
                channel.start,
                channel.step_type,
            )
            .map_err(|error| StepgenError::Channel(n, error))?;
            let name = |pin: &str| format!("stepgen.{n}.{pin}");
            let owner = "stepgen";
            let counts = generator.count() as i32;
            let position = generator.position_of(generator.count());
            let scale = channel.position_scale;
            let PulseTimingNs { step_length, step_space, dir_setup, dir_hold } = channel.timing;
            let times = [step_length, step_space, dir_setup, dir_hold]
                .map(|time| u32::try_from(time).unwrap_or(u32::MAX));
            let line_names = match channel.step_type {
                StepType::StepDir => ["step", "dir"].as_slice(),
                StepType::UpDown => &["up", "down"],
                StepType::Phases(phases) => &PHASES[..phases.lines()],
            };
            let mut lines = [hal.new_bit(owner, &name(line_names[0]), Role::Out, false)?; MAX_PHASES];
            for (line, line_name) in lines.iter_mut().zip(line_names).skip(1) {
                *line = hal.new_bit(owner, &name(line_name), Role::Out, false)?;
            }
            let pins = Pins {
                position_cmd: hal.new_float(owner, &name("position-cmd"), Role::In, channel.start)?,
                velocity_cmd: hal.new_float(owner, &name("velocity-cmd"), Role::In, 0.0)?,
                enable: hal.new_bit(owner, &name("enable"), Role::In, channel.enabled)?,
                step_type: channel.step_type,
                lines,
                counts: hal.new_s32(owner, &name("counts"), Role::Out, counts)?,
                position_fb: hal.new_float(owner, &name("position-fb"), Role::Out, position)?,
                max_delay: hal.new_u32(owner, &name("max-delay"), Role::ReadOnly, 0)?,
                position_scale: hal.new_float(owner, &name("position-scale"), Role::Parameter, scale)?,
                times: [
                    hal.new_u32(owner, &name("steplen"), Role::Parameter, times[0])?,
                    hal.new_u32(owner, &name("stepspace"), Role::Parameter, times[1])?,
                    hal.new_u32(owner, &name("dirsetup"), Role::Parameter, times[2])?,
                    hal.new_u32(owner, &name("dirhold"), Role::Parameter, times[3])?,
                ],
                configured: (scale, times),
            };
            with_pins.push((generator, pins));
        }
        let functions = ["make-pulses", "update-freq", "capture-position"].map(|f| format!("stepgen.{f}"));
        hal.add_component(Box::new(Self { channels: with_pins, timer_period_ns }), &functions)?;
        Ok(())
    }

    /// The generators, in channel order.
    pub fn generators(&self) -> impl Iterator<Item = &StepGenerator> {
        self.channels.iter().map(|(generator, _)| generator)
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        let (start, end) = (tick.period.start(), tick.period.end());
        let mut refused = Ok(());
        for (n, (generator, pins)) in self.channels.iter_mut().enumerate() {
            let enabled = values.bit(pins.enable);
            if let Err(pin) = configure(generator, pins, values, self.timer_period_ns) {
                refused = refused.and(Err(Fault::Parameter { tick: tick.number, pin: parameter(n, pin) }));
                continue;
            }
            let lines = &pins.lines[..pins.step_type.lines()];
            for line in lines {
                values.edges_mut(*line).retire(start);
            }
            let result = if enabled {
                let position = values.float(pins.position_cmd);
                let linked = values.float_is_linked(pins.velocity_cmd);
                let velocity = linked.then(|| values.float(pins.velocity_cmd));
                let sink =
                    |edge: Edge| values.edges_mut(lines[line_index(edge.line)]).push(edge.time, edge.level);
                match velocity {
                    Some(velocity) => generator.advance(position, velocity, &tick.period, sink),
                    None => generator.advance_straight(position, &tick.period, sink),
                }
            } else if pins.step_type == StepType::StepDir {
                // steps that were to come late do not come; a pulse that has begun ends
                let (step, dir) = (lines[0], lines[1]);
                let missing = net_steps(values.edges(step), values.edges(dir), values.bit(dir));
                let level = values.bit(step);
                values.edges_mut(step).cut_after(start, level);
                generator.stand_at(generator.count() - missing)
            } else {
                // of the other types, late steps still come
                generator.stand_at(generator.count())
            };
            for line in lines {
                values.show_edges(*line, end);
            }
            // the other channels go on: all of them stop together in the next period
            if let Err(error) = result {
                refused = refused.and(Err(Fault::Steps { tick: tick.number, joint: n as u8, error }));
            }
        }
        refused
    }

    fn capture(&self, values: &mut Values) {
        for (generator, pins) in &self.channels {
            values.set_s32(pins.counts, generator.count() as i32);
            values.set_float(pins.position_fb, generator.position_of(generator.count()));
            let delay = nanoseconds(generator.report().max_delay, self.timer_period_ns);
            values.set_u32(pins.max_delay, delay);
        }
    }
}

const PHASES: [&str; MAX_PHASES] = ["phase-a", "phase-b", "phase-c", "phase-d", "phase-e"];

/// Place of a line among the channel's.
const fn line_index(line: Line) -> usize {
    match line {
        Line::Step | Line::Up => 0,
        Line::Dir | Line::Down => 1,
        Line::Phase(n) => n as usize,
    }
}

/// Takes up parameters that were set; the name of one that cannot be used.
fn configure(
    generator: &mut StepGenerator,
    pins: &mut Pins,
    values: &Values,
    timer_period_ns: u64,
) -> Result<(), &'static str> {
    let wanted = (values.float(pins.position_scale), pins.times.map(|pin| values.u32(pin)));
    if wanted == pins.configured {
        return Ok(());
    }
    let (scale, [step_length, step_space, dir_setup, dir_hold]) = (wanted.0, wanted.1.map(u64::from));
    let timing = PulseTimingNs { step_length, step_space, dir_setup, dir_hold };
    let ticks = timing.ticks(timer_period_ns).map_err(|_| "steplen")?;
    generator.configure(scale, ticks).map_err(|_| "position-scale")?;
    pins.configured = wanted;
    Ok(())
}

const fn parameter(n: usize, pin: &'static str) -> PinName {
    PinName { owner: "stepgen", index: PinIndex::Number(n as u8), pin }
}

/// Steps forward less steps back on lines of which `dir` is the direction's level before the first edge.
fn net_steps(steps: &EdgeQueue, turns: &EdgeQueue, dir: bool) -> i64 {
    let step = |edge: &LineEdge| if turns.level_at(edge.time).unwrap_or(dir) { 1 } else { -1 };
    steps.edges().iter().filter(|edge| edge.level).map(step).sum()
}

fn nanoseconds(ticks: u64, timer_period_ns: u64) -> u32 {
    u32::try_from(ticks.saturating_mul(timer_period_ns)).unwrap_or(u32::MAX)
}

impl Component for Stepgen {
    fn name(&self) -> &'static str {
        "stepgen"
    }

    fn run(&mut self, function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        match function {
            1 => self.update(values, tick)?,
            2 => self.capture(values),
            _ => {}
        }
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
