//! What `loadrt` can load, and its options.

use crate::block::{self, Block};
use crate::components::motion::{Motion, MotionJoint};
use crate::components::stepgen::{Stepgen, StepgenChannel, StepgenError};
use crate::components::*;
use crate::hal::Hal;
use crate::hal_error::HalError;
use crate::values::PinType;
use pkm_kins::{Axis, AxisSet, JointKind, JointRange, MAX_JOINTS};
use pkm_stepgen::{PulseTimingNs, StepType};
use std::fmt;

/// Most instances or channels of one module.
const MAX_COUNT: usize = 16;

type Load = fn(&mut Hal, &[String]) -> Result<(), HalError>;

/// The blocks by name.
const BLOCKS: [(&str, Load); 22] = [
    (and2::And2::NAME, block::load::<and2::And2>),
    (charge_pump::ChargePump::NAME, block::load::<charge_pump::ChargePump>),
    (comp::Comp::NAME, block::load::<comp::Comp>),
    (dbounce::Dbounce::NAME, block::load::<dbounce::Dbounce>),
    (ddt::Ddt::NAME, block::load::<ddt::Ddt>),
    (estop_latch::EstopLatch::NAME, block::load::<estop_latch::EstopLatch>),
    (integ::Integ::NAME, block::load::<integ::Integ>),
    (limit1::Limit1::NAME, block::load::<limit1::Limit1>),
    (limit3::Limit3::NAME, block::load::<limit3::Limit3>),
    (lut5::Lut5::NAME, block::load::<lut5::Lut5>),
    (mult2::Mult2::NAME, block::load::<mult2::Mult2>),
    (mux2::Mux2::NAME, block::load::<mux2::Mux2>),
    (mux4::Mux4::NAME, block::load::<mux4::Mux4>),
    (not::Not::NAME, block::load::<not::Not>),
    (or2::Or2::NAME, block::load::<or2::Or2>),
    (pid::Pid::NAME, block::load::<pid::Pid>),
    (scale::Scale::NAME, block::load::<scale::Scale>),
    (shaft_encoder::ShaftEncoder::NAME, block::load::<shaft_encoder::ShaftEncoder>),
    (shaft_switch::ShaftSwitch::NAME, block::load::<shaft_switch::ShaftSwitch>),
    (siggen::Siggen::NAME, block::load::<siggen::Siggen>),
    (sum2::Sum2::NAME, block::load::<sum2::Sum2>),
    (xor2::Xor2::NAME, block::load::<xor2::Xor2>),
];

/// Modules and their options, for `help` and for messages.
pub const MODULES: [(&str, &str); 10] = [
    ("threads", "name1= period1= (ns) [fp1=] ... name3= period3="),
    ("motmod", "servo_period_nsec= [base_period_nsec=] [num_joints=]"),
    ("stepgen", "step_type=0[,0...] [ctrl_type=p[,p...]]"),
    ("encoder", "[num_chan=]"),
    ("sampler", "cfg=TYPES (b, f, s, u for each pin) depth=ROWS"),
    ("streamer", "cfg=TYPES (b, f, s, u for each pin) depth=ROWS"),
    ("driver", "model=NAME[,NAME...] (simulated: A4988 DRV8825 TMC2209 DM542 TB6600)"),
    ("motor", "[num_chan=] (simulated)"),
    ("trivkins", "[coordinates=]"),
    (
        "and2 charge_pump comp dbounce ddt estop_latch integ limit1 limit3 lut5 mult2 mux2 mux4 not or2 pid scale \
         shaft_encoder shaft_switch siggen sum2 xor2",
        "[count=N | num_chan=N | names=A,B,...]",
    ),
];

/// Why a module cannot be loaded.
#[derive(Debug, Clone, PartialEq)]
pub enum LoadError {
    /// No such module here.
    UnknownModule(String),
    /// The module has no such option.
    UnknownOption {
        /// Its place among the options.
        option: usize,
        /// As written.
        text: String,
    },
    /// The option's value is not one that it may have.
    BadOption {
        /// Its place among the options.
        option: usize,
        /// What it should be.
        expected: &'static str,
    },
    /// An option that must be there.
    Missing(&'static str),
    /// The HAL refuses.
    Hal(HalError),
}

impl LoadError {
    /// The option at fault, by its place.
    pub const fn option(&self) -> Option<usize> {
        match self {
            Self::UnknownOption { option, .. } | Self::BadOption { option, .. } => Some(*option),
            _ => None,
        }
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownModule(name) => write!(f, "there is no module '{name}' here"),
            Self::UnknownOption { text, .. } => write!(f, "the module has no option '{text}'"),
            Self::BadOption { expected, .. } => write!(f, "the option should be {expected}"),
            Self::Missing(option) => write!(f, "the option '{option}' is missing"),
            Self::Hal(error) => error.fmt(f),
        }
    }
}

impl From<HalError> for LoadError {
    fn from(error: HalError) -> Self {
        Self::Hal(error)
    }
}

/// `KEY=VALUE`, with its place.
struct Choice<'a> {
    option: usize,
    key: &'a str,
    value: &'a str,
}

impl Choice<'_> {
    fn bad<T>(&self, expected: &'static str) -> Result<T, LoadError> {
        Err(LoadError::BadOption { option: self.option, expected })
    }

    fn unknown<T>(&self) -> Result<T, LoadError> {
        Err(LoadError::UnknownOption { option: self.option, text: self.key.to_owned() })
    }

    fn number(&self, max: u64, expected: &'static str) -> Result<u64, LoadError> {
        match self.value.parse() {
            Ok(number) if (1..=max).contains(&number) => Ok(number),
            _ => self.bad(expected),
        }
    }
}

/// Loads a module.
///
/// # Errors
/// [`LoadError`].
pub fn load(hal: &mut Hal, module: &str, options: &[&str]) -> Result<(), LoadError> {
    let mut choices = Vec::new();
    for (option, text) in options.iter().enumerate() {
        let (key, value) = text
            .split_once('=')
            .ok_or_else(|| LoadError::UnknownOption { option, text: (*text).to_owned() })?;
        choices.push(Choice { option, key, value });
    }
    match module {
        "threads" => threads(hal, &choices),
        "motmod" => motmod(hal, &choices),
        "stepgen" => stepgen(hal, &choices),
        "encoder" => Ok(encoder::Encoders::load(hal, channel_count(&choices)?)?),
        "motor" => {
            let channel = motor::MotorChannel { scale: 1.0, start: 0 };
            Ok(motor::Motors::load(hal, &vec![channel; channel_count(&choices)?])?)
        }
        "driver" => driver(hal, &choices),
        "sampler" | "streamer" => fifo(hal, module, &choices),
        "trivkins" => match choices.iter().find(|choice| choice.key != "coordinates") {
            Some(choice) => choice.unknown(),
            None => Ok(()), // joints are axes already
        },
        _ => blocks(hal, module, &choices),
    }
}

fn blocks(hal: &mut Hal, module: &str, choices: &[Choice<'_>]) -> Result<(), LoadError> {
    let name = module.replace('_', "-");
    let found = BLOCKS.iter().find(|(block, _)| *block == name);
    let (_, load) = found.ok_or_else(|| LoadError::UnknownModule(module.to_owned()))?;
    // the charge pump is one, as in LinuxCNC
    let mut names: Vec<String> = match name.as_str() {
        "charge-pump" => vec![name.clone()],
        _ => vec![format!("{name}.0")],
    };
    for choice in choices {
        match choice.key {
            "count" | "num_chan" => {
                let count = choice.number(MAX_COUNT as u64, "a number from 1 to 16")?;
                names = (0..count).map(|n| format!("{name}.{n}")).collect();
            }
            "names" => {
                names = choice.value.split(',').map(str::to_owned).collect();
                if names.len() > MAX_COUNT {
                    return choice.bad("at most 16 names");
                }
            }
            _ => return choice.unknown(),
        }
    }
    Ok(load(hal, &names)?)
}

/// `num_chan`, 1 if it is not given.
fn channel_count(choices: &[Choice<'_>]) -> Result<usize, LoadError> {
    let mut count = 1;
    for choice in choices {
        match choice.key {
            "num_chan" => count = choice.number(MAX_COUNT as u64, "a number from 1 to 16")? as usize,
            _ => return choice.unknown(),
        }
    }
    Ok(count)
}

/// Sampler or streamer.
fn fifo(hal: &mut Hal, module: &str, choices: &[Choice<'_>]) -> Result<(), LoadError> {
    let (mut types, mut depth) = (None, None);
    for choice in choices {
        match choice.key {
            "cfg" => {
                let pin_type = |letter: char| match letter.to_ascii_lowercase() {
                    'b' => Some(PinType::Bit),
                    'f' => Some(PinType::Float),
                    's' => Some(PinType::S32),
                    'u' => Some(PinType::U32),
                    _ => None,
                };
                types = choice.value.chars().map(pin_type).collect::<Option<Vec<_>>>();
                if types.as_ref().is_none_or(|types| types.is_empty() || types.len() > 20) {
                    return choice.bad("1 to 20 letters of b, f, s, u");
                }
            }
            "depth" => depth = Some(choice.number(1_000_000, "a number from 1 to 1000000")? as usize),
            _ => return choice.unknown(),
        }
    }
    let types = types.ok_or(LoadError::Missing("cfg"))?;
    let depth = depth.ok_or(LoadError::Missing("depth"))?;
    match module {
        "sampler" => sampler::Sampler::load(hal, &types, depth)?,
        _ => streamer::Streamer::load(hal, &types, depth)?,
    }
    Ok(())
}

fn driver(hal: &mut Hal, choices: &[Choice<'_>]) -> Result<(), LoadError> {
    let mut channels = None;
    for choice in choices {
        if choice.key != "model" {
            return choice.unknown();
        }
        let entries: Vec<&str> = choice.value.split(',').collect();
        let channel =
            |entry: &&str| driver::minimum(entry).map(|minimum| driver::DriverChannel { minimum, start: 0 });
        channels = entries.iter().map(channel).collect::<Option<Vec<_>>>();
        if channels.as_ref().is_none_or(|channels| channels.len() > MAX_COUNT) {
            return choice.bad("at most 16 of A4988, DRV8825, TMC2209, DM542, TB6600");
        }
    }
    Ok(driver::Drivers::load(hal, &channels.ok_or(LoadError::Missing("model"))?)?)
}

fn threads(hal: &mut Hal, choices: &[Choice<'_>]) -> Result<(), LoadError> {
    const KEYS: [(&str, &str, &str); 3] =
        [("name1", "period1", "fp1"), ("name2", "period2", "fp2"), ("name3", "period3", "fp3")];
    let known = |key: &str| KEYS.iter().any(|(name, period, fp)| [*name, *period, *fp].contains(&key));
    if let Some(choice) = choices.iter().find(|choice| !known(choice.key)) {
        return choice.unknown();
    }
    let find = |key: &str| choices.iter().find(|choice| choice.key == key);
    for (n, (name, period, _)) in KEYS.into_iter().enumerate() {
        match (find(name), find(period)) {
            (Some(name), Some(period)) => {
                let period_ns = period.number(1_000_000_000, "a period in ns, from 1 to 1000000000")?;
                hal.new_thread(name.value, period_ns)?;
            }
            (None, None) if n > 0 => {}
            (None, _) => return Err(LoadError::Missing(name)),
            (_, None) => return Err(LoadError::Missing(period)),
        }
    }
    Ok(())
}

fn motmod(hal: &mut Hal, choices: &[Choice<'_>]) -> Result<(), LoadError> {
    let (mut joints, mut servo_ns, mut base_ns) = (3, None, None);
    for choice in choices {
        let period = || choice.number(1_000_000_000, "a period in ns, from 1 to 1000000000");
        match choice.key {
            "num_joints" => joints = choice.number(MAX_JOINTS as u64, "a number from 1 to 9")? as usize,
            "servo_period_nsec" => servo_ns = Some(period()?),
            "base_period_nsec" => base_ns = Some(period()?),
            _ => return choice.unknown(),
        }
    }
    let servo_ns = servo_ns.ok_or(LoadError::Missing("servo_period_nsec"))?;
    if let Some(base_ns) = base_ns {
        hal.new_thread("base-thread", base_ns)?;
    }
    hal.new_thread("servo-thread", servo_ns)?;
    let joint = MotionJoint {
        kind: JointKind::Linear,
        range: JointRange { min: -1e9, max: 1e9 },
        start: 0.0,
        step: 1e-9,
        max_steps: 1 << 40,
        max_acceleration: f64::INFINITY,
        following_error: 0.0,
        homed: true,
    };
    Ok(Motion::load(hal, &vec![joint; joints], AxisSet::new(&Axis::ALL))?)
}

fn stepgen(hal: &mut Hal, choices: &[Choice<'_>]) -> Result<(), LoadError> {
    let mut types = None;
    for choice in choices {
        let entries: Vec<&str> = choice.value.split(',').collect();
        match choice.key {
            "step_type" if entries.len() > MAX_COUNT => return choice.bad("at most 16 channels"),
            "step_type" => {
                let step_type = |entry: &&str| entry.parse().ok().and_then(StepType::from_number);
                types = entries.iter().map(step_type).collect::<Option<Vec<_>>>();
                if types.is_none() {
                    return choice.bad("a number from 0 to 14 for each channel");
                }
            }
            "ctrl_type" if entries.iter().all(|entry| *entry == "p") => {}
            "ctrl_type" => return choice.bad("p (position) for each channel"),
            _ => return choice.unknown(),
        }
    }
    let types = types.ok_or(LoadError::Missing("step_type"))?;
    // LinuxCNC's defaults: scale 1, the shortest times
    let timing = PulseTimingNs { step_length: 1, step_space: 1, dir_setup: 1, dir_hold: 1 };
    let channel =
        |step_type| StepgenChannel { position_scale: 1.0, timing, start: 0.0, enabled: false, step_type };
    let channels: Vec<StepgenChannel> = types.into_iter().map(channel).collect();
    Stepgen::load(hal, &channels).map_err(|error| match error {
        StepgenError::Hal(error) => LoadError::Hal(error),
        StepgenError::Channel(..) => LoadError::Missing("step_type"),
    })
}
