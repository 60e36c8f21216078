//! `spindle`: a simulated spindle with an encoder: it speeds up and slows down at a finite rate, turns, and has an index.
//!
//! | pin or parameter                    | type      | meaning                                                        |
//! |-------------------------------------|-----------|----------------------------------------------------------------|
//! | `spindle.0.speed-out`               | float out | commanded speed, rpm; negative = counter-clockwise             |
//! | `spindle.0.speed-out-rps`, `.speed-out-abs` | float out | the same in turns/s; its magnitude in rpm              |
//! | `spindle.0.on`, `.forward`, `.reverse`, `.brake` | bit out | to turn at all, which way, and held at rest         |
//! | `spindle.0.orient`, `.orient-angle` | bit, float out | to stop at an angle, degrees                              |
//! | `spindle.0.is-oriented`             | bit out   | it stands there                                                |
//! | `spindle.0.speed-in`                | float out | actual speed, turns/s                                          |
//! | `spindle.0.revs`                    | float out | actual turns since the last index that was waited for          |
//! | `spindle.0.index-enable`            | bit out   | waiting for the index: at the next whole turn `revs` becomes 0 there and this false |
//! | `spindle.0.at-speed`                | bit out   | on, and as fast as commanded                                   |
//! | `spindle.0.max-speed`               | float rw  | rpm, above 0: faster it does not turn                          |
//! | `spindle.0.acceleration`            | float rw  | rpm/s, above 0                                                 |
//!
//! Function: `spindle.0.update`. The names are LinuxCNC's; there `speed-in`, `revs`, `at-speed` and `is-oriented` are inputs
//! of motion that an encoder and a drive write: here one component is motion's side, drive, motor and encoder.
//! `motion.enable` false (emergency stop) switches it off in the same period; it then runs out.

use crate::component::{Component, Fault, SpindleFeedback, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};
use pkm_kins::maths::{ceil, floor, round, sqrt};

/// What a spindle can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpindleConfig {
    /// rpm, above 0.
    pub max_speed_rpm: f64,
    /// rpm/s, above 0.
    pub acceleration_rpm_s: f64,
}

/// What the program wants of the spindle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpindleCommand {
    /// To turn: M3 and M4. False: M5.
    pub on: bool,
    /// rpm; negative = counter-clockwise.
    pub speed_rpm: f64,
    /// To stop at this angle, turns (M19).
    pub orient: Option<Orient>,
    /// To set `revs` to 0 at the next index; what counts is the change from false to true.
    pub index_enable: bool,
}

/// M19.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orient {
    /// Degrees.
    pub angle_deg: f64,
    /// 0 = the shortest way, above 0 clockwise, below 0 counter-clockwise; a spindle that turns keeps its direction.
    pub direction: i8,
}

/// Speed at which a spindle at rest turns to an angle, turns/s.
const ORIENT_SPEED: f64 = 1.0;

/// The moving part: turns, speed, index. Turns and seconds throughout.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpindleModel {
    turns: f64,
    speed: f64,
    /// Turns at which `revs` is 0.
    zero: f64,
    index_enable: bool,
    wanted_index: bool,
    at_speed: bool,
    /// M19 under way: what it was asked for, and the turns at which it will stand.
    orient: Option<(Orient, f64)>,
}

impl SpindleModel {
    /// One period of `seconds`.
    pub fn step(&mut self, command: &SpindleCommand, config: &SpindleConfig, seconds: f64) {
        let rate = config.acceleration_rpm_s / 60.0;
        let before = self.turns;
        self.index_enable |= command.index_enable && !self.wanted_index;
        self.wanted_index = command.index_enable;
        self.orient = match (command.orient, self.orient) {
            (Some(wanted), Some((known, goal))) if wanted == known => Some((known, goal)),
            (Some(wanted), _) => Some((wanted, self.goal(&wanted, rate))),
            (None, _) => None,
        };
        self.at_speed = false;
        if let Some((_, goal)) = self.orient {
            self.approach(goal, rate, seconds);
        } else {
            let commanded = if command.on { command.speed_rpm } else { 0.0 };
            let target = commanded.clamp(-config.max_speed_rpm, config.max_speed_rpm) / 60.0;
            // At constant rate to the target, then along it.
            let change = target - self.speed;
            let ramp = (change.abs() / rate).min(seconds);
            let after = if ramp < seconds { target } else { self.speed + rate * seconds * change.signum() };
            self.turns += 0.5 * (self.speed + after) * ramp + after * (seconds - ramp);
            self.speed = after;
            self.at_speed = command.on && after == commanded / 60.0;
        }
        let (from, to) = (before, self.turns);
        let index = if to > from { floor(to) } else { ceil(to) };
        let passed = if to > from { index > from } else { to < from && index < from };
        if self.index_enable && passed {
            self.zero = index;
            self.index_enable = false;
        }
    }

    /// Where a spindle that is to stand at an angle will come to rest, turns.
    fn goal(&self, wanted: &Orient, rate: f64) -> f64 {
        let angle = wanted.angle_deg / 360.0;
        let stands = self.turns + 0.5 * self.speed * self.speed.abs() / rate;
        let direction = if self.speed == 0.0 { f64::from(wanted.direction) } else { self.speed };
        let whole = stands - angle;
        angle
            + match direction {
                d if d > 0.0 => ceil(whole),
                d if d < 0.0 => floor(whole),
                _ => round(whole),
            }
    }

    /// One period towards a goal: braking so that it is met at rest.
    fn approach(&mut self, goal: f64, rate: f64, seconds: f64) {
        let step = rate * seconds;
        let left = goal - self.turns - 0.5 * self.speed * seconds;
        let near = left.abs() <= step * seconds;
        let wanted = if near {
            left.abs() / seconds
        } else {
            0.5 * (sqrt(step * step + 8.0 * rate * left.abs()) - step)
        };
        let most = ORIENT_SPEED.max(self.speed.abs());
        let after = (wanted.min(most) * left.signum()).clamp(self.speed - step, self.speed + step);
        self.turns += 0.5 * (self.speed + after) * seconds;
        self.speed = after;
        if (goal - self.turns).abs() < 1e-9 && after.abs() < 1e-9 {
            (self.turns, self.speed) = (goal, 0.0);
        }
    }

    /// What its encoder and its drive tell.
    pub fn feedback(&self) -> SpindleFeedback {
        SpindleFeedback {
            revs: self.turns - self.zero,
            speed_rps: self.speed,
            at_speed: self.at_speed,
            index_enable: self.index_enable,
            is_oriented: self.orient.is_some_and(|(_, goal)| self.turns == goal && self.speed == 0.0),
        }
    }
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Spindle {
    model: SpindleModel,
    command: SpindleCommand,
    timer_period_s: f64,
    enable: BitPin,
    /// speed-out, -rps, -abs, orient-angle, speed-in, revs
    floats: [FloatPin; 6],
    /// on, forward, reverse, brake, orient, is-oriented, index-enable, at-speed
    bits: [BitPin; 8],
    max_speed: FloatPin,
    acceleration: FloatPin,
}

impl Spindle {
    /// Loads the component; motion must be there.
    ///
    /// # Errors
    /// `Taken` if it is loaded already, `Unknown` without motion.
    pub fn load(hal: &mut Hal, config: &SpindleConfig) -> Result<(), HalError> {
        let mut float = |pin: &str| hal.new_float("spindle", &format!("spindle.0.{pin}"), Role::Out, 0.0);
        let floats = [
            float("speed-out")?,
            float("speed-out-rps")?,
            float("speed-out-abs")?,
            float("orient-angle")?,
            float("speed-in")?,
            float("revs")?,
        ];
        let mut bit = |pin: &str| hal.new_bit("spindle", &format!("spindle.0.{pin}"), Role::Out, false);
        let bits = [
            bit("on")?,
            bit("forward")?,
            bit("reverse")?,
            bit("brake")?,
            bit("orient")?,
            bit("is-oriented")?,
            bit("index-enable")?,
            bit("at-speed")?,
        ];
        let mut limit =
            |pin: &str, value| hal.new_float("spindle", &format!("spindle.0.{pin}"), Role::Parameter, value);
        let (max_speed, acceleration) =
            (limit("max-speed", config.max_speed_rpm)?, limit("acceleration", config.acceleration_rpm_s)?);
        let spindle = Self {
            model: SpindleModel::default(),
            command: SpindleCommand::default(),
            timer_period_s: hal.timer_period_ns() as f64 / 1e9,
            enable: hal.bit_pin("motion.enable")?,
            floats,
            bits,
            max_speed,
            acceleration,
        };
        hal.add_component(Box::new(spindle), &["spindle.0.update".to_owned()])
    }

    /// What its encoder and its drive tell.
    pub fn feedback(&self) -> SpindleFeedback {
        self.model.feedback()
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        if let Some(setpoint) = tick.setpoint {
            self.command = setpoint.spindle;
        }
        if !values.bit(self.enable) || !self.command.speed_rpm.is_finite() {
            self.command = SpindleCommand::default();
        }
        let positive = |value: f64| if value > 0.0 && value.is_finite() { value } else { f64::MIN_POSITIVE };
        let config = SpindleConfig {
            max_speed_rpm: positive(values.float(self.max_speed)),
            acceleration_rpm_s: positive(values.float(self.acceleration)),
        };
        let command = self.command;
        self.model.step(&command, &config, f64::from(tick.period.ticks()) * self.timer_period_s);
        let feedback = self.model.feedback();
        let rpm = if command.on { command.speed_rpm } else { 0.0 };
        let angle_deg = command.orient.map_or(0.0, |orient| orient.angle_deg);
        let floats = [rpm, rpm / 60.0, rpm.abs(), angle_deg, feedback.speed_rps, feedback.revs];
        for (pin, value) in self.floats.into_iter().zip(floats) {
            values.set_float(pin, value);
        }
        let bits = [
            command.on,
            command.on && command.speed_rpm > 0.0,
            command.on && command.speed_rpm < 0.0,
            !command.on && command.orient.is_none(),
            command.orient.is_some(),
            feedback.is_oriented,
            feedback.index_enable,
            feedback.at_speed,
        ];
        for (pin, value) in self.bits.into_iter().zip(bits) {
            values.set_bit(pin, value);
        }
    }
}

impl Component for Spindle {
    fn name(&self) -> &'static str {
        "spindle"
    }

    fn run(&mut self, _function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        self.update(values, tick);
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: SpindleConfig = SpindleConfig { max_speed_rpm: 3000.0, acceleration_rpm_s: 1200.0 };
    const PERIOD_S: f64 = 1e-3;

    fn turning(rpm: f64) -> SpindleCommand {
        SpindleCommand { on: rpm != 0.0, speed_rpm: rpm, ..SpindleCommand::default() }
    }

    #[test]
    fn ramps_to_its_speed_and_no_further() {
        let mut spindle = SpindleModel::default();
        for n in 1..=499 {
            spindle.step(&turning(600.0), &CONFIG, PERIOD_S);
            assert!((spindle.speed - 0.02 * f64::from(n)).abs() < 1e-9 && !spindle.at_speed, "{n}");
        }
        spindle.step(&turning(600.0), &CONFIG, PERIOD_S);
        spindle.step(&turning(600.0), &CONFIG, PERIOD_S);
        assert!(spindle.at_speed && spindle.speed == 10.0);
        // ω²/2α turns on the way, then ω t
        assert!((spindle.turns - (10.0 * 10.0 / 40.0 + 10.0 * 1e-3)).abs() < 1e-9, "{}", spindle.turns);
        for _ in 0..5000 {
            spindle.step(&turning(-9000.0), &CONFIG, PERIOD_S);
        }
        assert_eq!(
            (spindle.speed, spindle.at_speed),
            (-50.0, false),
            "S beyond the maximum is never reached"
        );
    }

    #[test]
    fn the_index_comes_once_a_turn_in_either_direction_when_it_is_waited_for() {
        for rpm in [600.0, -600.0] {
            let mut spindle = SpindleModel::default();
            for _ in 0..777 {
                spindle.step(&turning(rpm), &CONFIG, PERIOD_S);
            }
            let waiting = SpindleCommand { index_enable: true, ..turning(rpm) };
            let mut periods = 0;
            spindle.step(&waiting, &CONFIG, PERIOD_S);
            while spindle.feedback().index_enable {
                spindle.step(&waiting, &CONFIG, PERIOD_S);
                periods += 1;
                assert!(periods <= 100, "10 turns a second");
            }
            let revs = spindle.feedback().revs * rpm.signum();
            assert!((0.0..0.01).contains(&revs), "{revs}: no more than a period ago");
            assert_eq!((spindle.turns - spindle.feedback().revs).fract(), 0.0, "at a whole turn");
            // Still asked for: no second index until it was withdrawn.
            for _ in 0..300 {
                spindle.step(&waiting, &CONFIG, PERIOD_S);
            }
            assert!((spindle.feedback().revs.abs() - revs - 3.0).abs() < 1e-9);
        }
    }

    #[test]
    fn orients_from_rest_and_from_speed() {
        for (rpm, angle_deg, direction) in
            [(0.0, 90.0, 0), (0.0, 270.0, 1), (1500.0, 30.0, 0), (-800.0, 300.0, 0)]
        {
            let mut spindle = SpindleModel::default();
            for _ in 0..2000 {
                spindle.step(&turning(rpm), &CONFIG, PERIOD_S);
            }
            let orient = Some(Orient { angle_deg, direction });
            let command = SpindleCommand { orient, ..SpindleCommand::default() };
            let mut before = spindle.speed;
            for _ in 0..4000 {
                spindle.step(&command, &CONFIG, PERIOD_S);
                assert!((spindle.speed - before).abs() <= 0.02 * (1.0 + 1e-9), "beyond its acceleration");
                before = spindle.speed;
            }
            assert!(spindle.feedback().is_oriented, "{rpm} {angle_deg}: {spindle:?}");
            let off = spindle.turns - angle_deg / 360.0;
            assert!((off - off.round()).abs() < 1e-9, "{rpm} {angle_deg}: {off}");
        }
    }
}
