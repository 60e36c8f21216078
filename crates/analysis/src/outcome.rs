//! The judge of a machine with a fault: reads what the machine did, period by period, and says how it ended, or what must
//! never happen.
//!
//! It sees positions and whether the drives were on, no pins and no planner; it takes differences itself. A run ends
//!
//! * **equal**: the program was finished where the fault-free one was, on the same path;
//! * **stopped**: it was told why, and the machine stopped as it must (IEC 60204-1): category 0 (drives off, not a step
//!   more), 1 (all joints brake together within v²/2a, then drives off) or 2 (at rest on the path, drives on);
//! * **refused**: it was told why, and nothing moved.
//!
//! In every case: every number finite, every joint within velocity, acceleration and travel while the drives are on, steps
//! within a step and a half of the command, real positions within the configured following error of it (or the drives off in the
//! next period), and what is reported at the end is where the machine is, or it says that it does not know.

use pkm_machine::Machine;
use std::fmt;

/// Joints in a row.
pub const JOINTS: usize = 9;

/// The machine at the end of a servo period; mm or rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Servo period; 0 is the start.
    pub tick: u64,
    /// All drives on.
    pub on: bool,
    /// The machine says that it knows where it is.
    pub homed: bool,
    /// Homing has moved a joint's zero in this period.
    pub zeroed: bool,
    /// No setpoint came for this period; the machine went on as it did.
    pub missed: bool,
    /// Commanded.
    pub commanded: [f64; JOINTS],
    /// Counted from the edges: what is reported.
    pub counted: [f64; JOINTS],
    /// Where the motors really hold the joints.
    pub actual: [f64; JOINTS],
}

/// How the controller says that a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End<'a> {
    /// The program was finished.
    Finished,
    /// It stopped in this servo period, and says why.
    Stopped(u64, &'a str),
    /// It came to rest on the path in this servo period (an abort), and says why. The power may go off after it.
    AtRest(u64, &'a str),
    /// It refused to begin, and says why.
    Refused(&'a str),
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Finished and equal to the fault-free run.
    Equal,
    /// Category 0.
    Off,
    /// Category 1.
    BrakedAndOff,
    /// Category 2.
    AtRest,
    /// Nothing moved.
    Refused,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Equal => "finished and equal to the fault-free run",
            Self::Off => "stopped, category 0: drives off at once",
            Self::BrakedAndOff => "stopped, category 1: all joints braked together, then drives off",
            Self::AtRest => "stopped, category 2: at rest on the path",
            Self::Refused => "refused before anything moved",
        })
    }
}

/// What must never happen.
#[derive(Debug, Clone, PartialEq)]
pub struct Objection {
    /// Servo period.
    pub tick: u64,
    /// What was seen.
    pub what: String,
}

impl fmt::Display for Objection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tick {}: {}", self.tick, self.what)
    }
}

/// Relative slack of velocity, and of acceleration (the controller's own tolerance is 1 %).
const SLACK: (f64, f64) = (1e-6, 0.02);
/// Steps between count and command: half a step of rounding, one step delayed for the driver's sake.
const STEPS: f64 = 1.5 + 1e-6;
/// Steps by which homing and rounding may displace a joint.
const HOME_STEPS: f64 = 2.0;
/// How far off the path a machine may be without setpoints, as a share of what it may be with them: (1 + 3)², since it is
/// aT²/2 for one period that did not come, and three may.
const MISSED: f64 = 16.0;
/// mm or rad
const TINY: f64 = 1e-9;

/// Judges a run. `rows` begin at rest or with two rows of the fault-free run; `reference` is all of that.
///
/// # Errors
/// The first thing that must never happen.
pub fn judge(machine: &Machine, reference: &[Row], rows: &[Row], end: End<'_>) -> Result<Outcome, Objection> {
    let judge = Judge { machine, period_s: machine.servo_period_ns as f64 / 1e9, reference, rows };
    judge.limits()?;
    judge.off()?;
    judge.following()?;
    judge.report()?;
    let last = rows.last().map_or(0, |row| row.tick);
    let told = |why: &str| match why.trim() {
        "" => Err(Objection { tick: last, what: "it stopped without saying why".to_owned() }),
        _ => Ok(()),
    };
    match end {
        End::Finished => judge.finished().map(|()| Outcome::Equal),
        End::Stopped(tick, why) => told(why).and_then(|()| judge.stopped(tick)),
        End::AtRest(tick, why) => told(why).and_then(|()| judge.at_rest(tick)),
        End::Refused(why) => told(why).and_then(|()| judge.still(0)).map(|()| Outcome::Refused),
    }
}

struct Judge<'a> {
    machine: &'a Machine,
    period_s: f64,
    reference: &'a [Row],
    rows: &'a [Row],
}

impl Judge<'_> {
    fn joints(&self) -> usize {
        self.machine.joints.len().min(JOINTS)
    }

    fn object<T>(&self, row: usize, what: String) -> Result<T, Objection> {
        Err(Objection { tick: self.rows.get(row).map_or(0, |row| row.tick), what })
    }

    fn name(&self, j: usize) -> &str {
        &self.machine.joints[j].name
    }

    /// mm or rad in one step.
    fn step(&self, j: usize) -> f64 {
        1.0 / self.machine.joints[j].steps_per_unit
    }

    /// Change of speed in a period at the limit, mm or rad a period.
    fn change(&self, j: usize) -> f64 {
        self.machine.joints[j].max_acceleration * self.period_s * self.period_s
    }

    /// How far a joint goes at most while it brakes from its greatest speed.
    fn braking(&self, j: usize) -> f64 {
        let joint = &self.machine.joints[j];
        joint.max_velocity * joint.max_velocity / (2.0 * joint.max_acceleration)
    }

    fn limits(&self) -> Result<(), Objection> {
        for (i, row) in self.rows.iter().enumerate() {
            for j in 0..self.joints() {
                let (joint, name) = (&self.machine.joints[j], self.name(j));
                let all = [row.commanded[j], row.counted[j], row.actual[j]];
                if !all.iter().all(|value| value.is_finite()) {
                    return self.object(i, format!("joint {name} is at {all:?}"));
                }
                if !row.on {
                    continue;
                }
                let beyond = self.braking(j) + self.step(j);
                let q = row.commanded[j];
                if row.homed && (q < joint.range.min - beyond || q > joint.range.max + beyond) {
                    return self.object(i, format!("joint {name} is at {q}, beyond its travel"));
                }
                if i < 2 || self.rows[i - 2..=i].iter().any(|row| row.zeroed || !row.on) {
                    continue;
                }
                let at = |k: usize| self.rows[i - k].commanded[j];
                let (travel, before) = (at(0) - at(1), at(1) - at(2));
                if travel.abs() > joint.max_velocity * self.period_s * (1.0 + SLACK.0) + TINY {
                    let velocity = travel / self.period_s;
                    return self.object(i, format!("joint {name} moves at {velocity}"));
                }
                if (travel - before).abs() > self.change(j) * (1.0 + SLACK.1) + TINY {
                    let acceleration = (travel - before) / (self.period_s * self.period_s);
                    return self.object(i, format!("joint {name} accelerates at {acceleration}"));
                }
            }
        }
        Ok(())
    }

    /// Once the drives are off no step is made.
    fn off(&self) -> Result<(), Objection> {
        for (i, pair) in self.rows.windows(2).enumerate() {
            if pair[0].on || pair[1].on || pair[1].zeroed {
                continue;
            }
            for j in 0..self.joints() {
                if (pair[1].counted[j] - pair[0].counted[j]).abs() > 0.5 * self.step(j) {
                    return self.object(i + 1, format!("joint {} steps with its drive off", self.name(j)));
                }
            }
        }
        Ok(())
    }

    /// Steps follow the command, and a machine that knows where it is is within its following error of it; or its drives go off.
    fn following(&self) -> Result<(), Objection> {
        for (i, pair) in self.rows.windows(2).enumerate() {
            if !(pair[0].on && pair[1].on) || pair[1].zeroed {
                continue;
            }
            for j in 0..self.joints() {
                let steps = (pair[0].counted[j] - pair[0].commanded[j]).abs() / self.step(j);
                // within the following error nothing is noticed
                if steps > STEPS.max(self.machine.joints[j].following_error / self.step(j)) {
                    let name = self.name(j);
                    return self.object(
                        i + 1,
                        format!("joint {name} is {steps} steps from its command, and goes on"),
                    );
                }
                if !(pair[0].homed && pair[1].homed) {
                    continue;
                }
                let away = (pair[0].actual[j] - pair[0].commanded[j]).abs();
                if away > self.machine.joints[j].following_error + HOME_STEPS * self.step(j) {
                    let name = self.name(j);
                    return self
                        .object(i + 1, format!("joint {name} is {away} from its command, and goes on"));
                }
            }
        }
        Ok(())
    }

    /// What is reported at the end is true, or known to be unknown.
    fn report(&self) -> Result<(), Objection> {
        let Some(last) = self.rows.last().filter(|row| row.homed) else { return Ok(()) };
        for j in 0..self.joints() {
            let away = (last.actual[j] - last.counted[j]).abs();
            if away > self.machine.joints[j].following_error + HOME_STEPS * self.step(j) {
                let name = self.name(j);
                return self.object(
                    self.rows.len() - 1,
                    format!("joint {name} is {away} from where it is reported"),
                );
            }
        }
        Ok(())
    }

    /// No step from row `from` on.
    fn still(&self, from: usize) -> Result<(), Objection> {
        for (i, pair) in self.rows.windows(2).enumerate().skip(from) {
            for j in 0..self.joints() {
                if (pair[1].counted[j] - pair[0].counted[j]).abs() > 0.5 * self.step(j) && !pair[1].zeroed {
                    return self.object(i + 1, format!("joint {} still moves", self.name(j)));
                }
            }
        }
        Ok(())
    }

    /// Ends where the fault-free run ends, at rest, all the way on its path.
    fn finished(&self) -> Result<(), Objection> {
        let end = self.rows.len() - 1;
        let (Some(last), Some(reference)) = (self.rows.last(), self.reference.last()) else { return Ok(()) };
        if !last.on || !last.homed {
            return self
                .object(end, "it finished with its drives off or without knowing where it is".to_owned());
        }
        for j in 0..self.joints() {
            if last.commanded[j] != reference.commanded[j] {
                let (name, here, there) = (self.name(j), last.commanded[j], reference.commanded[j]);
                return self.object(end, format!("joint {name} ends at {here}, fault-free at {there}"));
            }
        }
        self.on_path(self.rows.len())
    }

    /// The rows before `until` lie on the path of the fault-free run, in its order.
    fn on_path(&self, until: usize) -> Result<(), Objection> {
        let Some(first) = self.rows.first() else { return Ok(()) };
        // from where it was forked, or from the beginning
        let mut at = self.reference.iter().position(|row| row == first).unwrap_or(0);
        for (i, row) in self.rows[..until].iter().enumerate() {
            // while homing, positions are relative
            if !row.homed {
                continue;
            }
            let most = if row.missed { MISSED } else { 1.0 };
            let mut near = self.away(row, at);
            let mut ahead = at;
            while near > most && ahead + 1 < self.reference.len() {
                ahead += 1;
                near = self.away(row, ahead);
            }
            if near > most {
                return self.object(i, "it is off the path of the fault-free run".to_owned());
            }
            at = ahead;
        }
        Ok(())
    }

    /// Largest distance over the joints from the chord of the fault-free path that ends at `at`, as a share of what its
    /// sagitta can be, aT²/8, on either path, and rounding.
    fn away(&self, row: &Row, at: usize) -> f64 {
        let (a, b) = (&self.reference[at.saturating_sub(1)], &self.reference[at]);
        let chord = |j: usize| b.commanded[j] - a.commanded[j];
        let square: f64 = (0..self.joints()).map(|j| chord(j) * chord(j)).sum();
        let along: f64 = (0..self.joints()).map(|j| chord(j) * (row.commanded[j] - a.commanded[j])).sum();
        let u = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 1.0 };
        let away = |j: usize| {
            let allowed = 0.5 * self.change(j) + TINY;
            (row.commanded[j] - (a.commanded[j] + u * chord(j))).abs() / allowed
        };
        (0..self.joints()).map(away).fold(0.0, f64::max)
    }

    /// What a joint went in the period of a row.
    fn travel(&self, i: usize, j: usize) -> f64 {
        match i {
            0 => 0.0,
            _ if self.rows[i].zeroed => 0.0,
            _ => self.rows[i].commanded[j] - self.rows[i - 1].commanded[j],
        }
    }

    fn row_of(&self, tick: u64) -> usize {
        self.rows.iter().position(|row| row.tick == tick).unwrap_or(0)
    }

    /// The machine stands on the path from the end of that period on, until its drives go off or for good.
    fn at_rest(&self, tick: u64) -> Result<Outcome, Objection> {
        let (told, end) = (self.row_of(tick), self.rows.len());
        let off = (told..end).find(|i| !self.rows[*i].on).unwrap_or(end);
        self.on_path(off)?;
        for i in told + 1..off {
            if let Some(j) = (0..self.joints()).find(|j| self.travel(i, *j).abs() > TINY) {
                return self.object(i, format!("joint {} moves after it came to rest", self.name(j)));
            }
        }
        self.still(end.saturating_sub(2))?;
        Ok(if off < end { Outcome::Off } else { Outcome::AtRest })
    }

    /// Everything that happened after the period in which the controller says that it stopped.
    fn stopped(&self, tick: u64) -> Result<Outcome, Objection> {
        let (told, end) = (self.row_of(tick), self.rows.len());
        self.still(end.saturating_sub(2))?;
        self.on_path(told)?;
        let Some(off) = (told..end).find(|i| !self.rows[*i].on) else {
            self.on_path(end)?;
            return Ok(Outcome::AtRest);
        };
        if off <= told + 1 {
            return Ok(Outcome::Off);
        }
        // from the speeds in the period before, all joints lose the same share in each
        let before = told.saturating_sub(1);
        // periods that the slowest to stop needs
        let slowest =
            (0..self.joints()).map(|j| self.travel(before, j).abs() / self.change(j)).fold(0.0, f64::max);
        if (off - told) as f64 > slowest + 3.0 {
            return self
                .object(off, format!("it took {} periods to stop, {slowest:.1} are enough", off - told));
        }
        // a zero that moved hides how far its joint went
        if self.rows[before..off].iter().any(|row| row.zeroed) {
            return Ok(Outcome::BrakedAndOff);
        }
        for j in 0..self.joints() {
            let way: f64 = (told..off).map(|i| self.travel(i, j)).sum();
            if way.abs() > 0.5 * self.travel(before, j).abs() * slowest + TINY {
                return self.object(off, format!("joint {} braked over {way}", self.name(j)));
            }
            for i in told..off {
                let share = 1.0 - (i - told + 1) as f64 / slowest.max(1e-9);
                let expected = self.travel(before, j) * share.max(0.0);
                if (self.travel(i, j) - expected).abs() > TINY {
                    return self.object(i, format!("joint {} does not brake with the others", self.name(j)));
                }
            }
        }
        Ok(Outcome::BrakedAndOff)
    }
}
