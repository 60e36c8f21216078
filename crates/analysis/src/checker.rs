//! The independent judge of a run: reads `trace.csv` and the machine's limits, nothing else, and confirms at every row
//! that no joint is outside its travel, too fast or accelerated too much, and that the steps follow the command.
//!
//! Velocity and acceleration are first and second differences of the commanded positions over the time between rows.
//! The machine rests before the first and after the last row, and the judge looks there too.

use pkm_machine::Machine;
use std::fmt;
use std::io::Read;

/// Relative slack for rounding in the differences, and the absolute slack of travel (mm or degrees).
const SLACK: f64 = 1e-6;
const TRAVEL_SLACK: f64 = 1e-9;
/// A step error beyond this is a lost step or a wrong edge.
const STEP_ERROR: f64 = 0.5 + 1e-9;
/// Violations kept; the rest is only counted.
const KEPT: usize = 100;

/// What the judge found wrong with a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Commanded position outside the travel.
    Travel,
    /// First difference above the velocity limit.
    Velocity,
    /// Second difference above the acceleration limit.
    Acceleration,
    /// The position counted from the edges is more than half a step from the commanded one.
    StepError,
    /// A number that is NaN or infinite.
    NotFinite,
}

/// One violation; mm or degrees and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// Which rule.
    pub rule: Rule,
    /// The joint, from 0.
    pub joint: usize,
    /// `tick` of the row.
    pub tick: u64,
    /// What was found.
    pub value: f64,
    /// What is allowed.
    pub limit: f64,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rule, joint, tick, value, limit } = self;
        write!(f, "tick {tick}, joint {joint}: {rule:?} {value} (limit {limit})")
    }
}

/// Peaks of one joint, mm or degrees and seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peaks {
    /// Largest |first difference|.
    pub velocity: f64,
    /// Largest |second difference|.
    pub acceleration: f64,
    /// Largest |counted − commanded|, steps.
    pub step_error: f64,
}

/// The verdict on a trace.
#[derive(Debug, Clone, Default)]
pub struct Verdict {
    /// Rows judged.
    pub rows: u64,
    /// In joint order.
    pub joints: Vec<Peaks>,
    /// The first violations.
    pub violations: Vec<Violation>,
    /// How many there were.
    pub violation_count: u64,
}

/// Why a trace cannot be judged.
#[derive(Debug)]
pub enum TraceError {
    /// Not readable, or not CSV.
    Csv(csv::Error),
    /// The header lacks a column.
    Column(String),
    /// A field that is no number.
    Number {
        /// Row, from 1 after the header.
        row: u64,
        /// Column name.
        column: String,
    },
    /// Rows that do not follow each other in time.
    Time {
        /// Row, from 1 after the header.
        row: u64,
    },
    /// A header and no rows: there is nothing to judge, and silence would read as success.
    Empty,
}

impl fmt::Display for TraceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Csv(error) => error.fmt(f),
            Self::Column(name) => {
                write!(f, "the trace has no column `{name}`; was it written for another machine?")
            }
            Self::Number { row, column } => write!(f, "row {row}: `{column}` is not a number"),
            Self::Time { row } => write!(f, "row {row}: time does not go on evenly from the row before"),
            Self::Empty => write!(f, "the trace has no rows"),
        }
    }
}

impl std::error::Error for TraceError {}

impl From<csv::Error> for TraceError {
    fn from(error: csv::Error) -> Self {
        Self::Csv(error)
    }
}

/// Limits of one joint as a person states them: mm or degrees, per second.
struct Bounds {
    min: f64,
    max: f64,
    velocity: f64,
    acceleration: f64,
    steps_per_unit: f64,
    command: usize,
    counted: usize,
}

/// Judges a whole trace.
///
/// # Errors
/// See [`TraceError`].
pub fn judge(trace: impl Read, machine: &Machine) -> Result<Verdict, TraceError> {
    let mut reader = csv::ReaderBuilder::new().from_reader(trace);
    let header = reader.headers()?.clone();
    let column =
        |name: &str| header.iter().position(|h| h == name).ok_or_else(|| TraceError::Column(name.to_owned()));
    let (tick_column, time_column) = (column("tick")?, column("time_s")?);
    let mut bounds = Vec::new();
    for (n, joint) in machine.joints.iter().enumerate() {
        let unit = match joint.to_face(1.0) {
            1.0 => "mm",
            _ => "deg",
        };
        bounds.push(Bounds {
            min: joint.to_face(joint.range.min),
            max: joint.to_face(joint.range.max),
            velocity: joint.to_face(joint.max_velocity),
            acceleration: joint.to_face(joint.max_acceleration),
            steps_per_unit: joint.steps_per_unit / joint.to_face(1.0),
            command: column(&format!("joint.{n}.pos-cmd_{unit}"))?,
            counted: column(&format!("joint.{n}.pos-fb_{unit}"))?,
        });
    }

    let mut judge =
        Judge { verdict: Verdict { joints: vec![Peaks::default(); bounds.len()], ..Verdict::default() } };
    let mut history: Vec<[f64; 2]> = Vec::new();
    let mut last_time: Option<f64> = None;
    let mut interval: Option<f64> = None;
    let mut last_tick = 0;
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record)? {
        judge.verdict.rows += 1;
        let row = judge.verdict.rows;
        let number = |column: usize| -> Result<f64, TraceError> {
            record.get(column).and_then(|field| field.parse().ok()).ok_or_else(|| TraceError::Number {
                row,
                column: header.get(column).unwrap_or("?").to_owned(),
            })
        };
        let (tick, time) = (number(tick_column)? as u64, number(time_column)?);
        if let Some(last) = last_time {
            let step = time - last;
            // Times are printed from integers: they differ from an even grid by rounding only.
            let even = interval.is_none_or(|first| (step - first).abs() <= 1e-9 + 1e-6 * first);
            if !(step > 0.0) || !even {
                return Err(TraceError::Time { row });
            }
            interval.get_or_insert(step);
        }
        last_time = Some(time);
        last_tick = tick;
        for (joint, bound) in bounds.iter().enumerate() {
            let (command, counted) = (number(bound.command)?, number(bound.counted)?);
            judge.position(joint, bound, tick, command, counted);
            // Before the first row the machine rested there.
            if history.len() <= joint {
                history.push([command; 2]);
            } else if let Some(dt) = interval {
                judge.motion(joint, bound, tick, history[joint], command, dt);
                history[joint] = [history[joint][1], command];
            }
        }
    }
    let Some(dt) = interval else {
        return if judge.verdict.rows == 0 { Err(TraceError::Empty) } else { Ok(judge.verdict) };
    };
    // After the last row it rests.
    for (joint, bound) in bounds.iter().enumerate() {
        let at_end = history[joint][1];
        judge.motion(joint, bound, last_tick + 1, history[joint], at_end, dt);
    }
    Ok(judge.verdict)
}

struct Judge {
    verdict: Verdict,
}

impl Judge {
    fn position(&mut self, joint: usize, bound: &Bounds, tick: u64, command: f64, counted: f64) {
        if !command.is_finite() || !counted.is_finite() {
            self.violation(Rule::NotFinite, joint, tick, command + counted, 0.0);
            return;
        }
        if command < bound.min - TRAVEL_SLACK {
            self.violation(Rule::Travel, joint, tick, command, bound.min);
        } else if command > bound.max + TRAVEL_SLACK {
            self.violation(Rule::Travel, joint, tick, command, bound.max);
        }
        let error = ((counted - command) * bound.steps_per_unit).abs();
        let peaks = &mut self.verdict.joints[joint];
        peaks.step_error = peaks.step_error.max(error);
        if error > STEP_ERROR {
            self.violation(Rule::StepError, joint, tick, error, 0.5);
        }
    }

    fn motion(
        &mut self,
        joint: usize,
        bound: &Bounds,
        tick: u64,
        [before, last]: [f64; 2],
        now: f64,
        dt: f64,
    ) {
        let velocity = ((now - last) / dt).abs();
        let acceleration = ((now - 2.0 * last + before) / (dt * dt)).abs();
        let peaks = &mut self.verdict.joints[joint];
        peaks.velocity = peaks.velocity.max(velocity);
        peaks.acceleration = peaks.acceleration.max(acceleration);
        // A difference of two positions near 1000 mm carries 1e-13 mm of rounding.
        let rounding = 1e-12;
        if velocity > bound.velocity * (1.0 + SLACK) + rounding / dt {
            self.violation(Rule::Velocity, joint, tick, velocity, bound.velocity);
        }
        if acceleration > bound.acceleration * (1.0 + SLACK) + rounding / (dt * dt) {
            self.violation(Rule::Acceleration, joint, tick, acceleration, bound.acceleration);
        }
    }

    fn violation(&mut self, rule: Rule, joint: usize, tick: u64, value: f64, limit: f64) {
        self.verdict.violation_count += 1;
        if self.verdict.violations.len() < KEPT {
            self.verdict.violations.push(Violation { rule, joint, tick, value, limit });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine() -> Machine {
        Machine::load("xyz", &[]).expect("the shipped machine is valid")
    }

    /// A trace on `xyz` where X follows `x` and the steps follow exactly.
    fn trace(x: &[f64]) -> String {
        let mut text = String::from(
            "tick,time_s,line,axis.x.pos-cmd_mm,joint.0.pos-cmd_mm,joint.0.pos-fb_mm,\
             joint.1.pos-cmd_mm,joint.1.pos-fb_mm,joint.2.pos-cmd_mm,joint.2.pos-fb_mm\n",
        );
        for (tick, x) in x.iter().enumerate() {
            let t = tick as f64 / 1000.0;
            text.push_str(&format!("{tick},{t},1,{x},{x},{x},0,0,0,0\n"));
        }
        text
    }

    fn rules(x: &[f64]) -> Vec<Rule> {
        let verdict = judge(trace(x).as_bytes(), &machine()).unwrap();
        let mut rules: Vec<Rule> = verdict.violations.iter().map(|v| v.rule).collect();
        rules.dedup();
        rules
    }

    #[test]
    fn a_slow_move_is_innocent() {
        let machine = machine();
        let a = machine.joints[0].max_acceleration;
        // Half the limit up and down again.
        let x: Vec<f64> = (0..200)
            .map(|k| {
                let t = f64::from(k.min(99)) / 1000.0;
                let u = f64::from((k - 99).max(0)) / 1000.0;
                0.25 * a * (t * t + 2.0 * 0.099 * u - u * u) + 0.0
            })
            .collect();
        assert_eq!(rules(&x[..199]), vec![]);
    }

    #[test]
    fn every_rule_can_convict() {
        let machine = machine();
        let joint = &machine.joints[0];
        let dt = 1e-3;
        let fast = joint.max_velocity * 1.01 * dt;
        assert!(rules(&[0.0, fast]).contains(&Rule::Velocity));
        let jerky = joint.max_acceleration * 1.01 * dt * dt;
        assert_eq!(rules(&[0.0, jerky, 2.0 * jerky]), vec![Rule::Acceleration]);
        let far = joint.range.max + 0.001;
        assert_eq!(rules(&[far, far]), vec![Rule::Travel]);
        assert_eq!(rules(&[f64::NAN, 0.0])[0], Rule::NotFinite);
        let off = format!("{}1,0.001,1,0,0,{},0,0,0,0\n", trace(&[0.0]), 0.51 / joint.steps_per_unit);
        assert_eq!(judge(off.as_bytes(), &machine).unwrap().violations[0].rule, Rule::StepError);
    }

    #[test]
    fn a_stop_in_the_last_row_is_seen() {
        let a = machine().joints[0].max_acceleration;
        let ramp: Vec<f64> = (0..50).map(|k| 0.25 * a * f64::from(k * k) * 1e-6).collect();
        let verdict = judge(trace(&ramp).as_bytes(), &machine()).unwrap();
        assert!(verdict.violations.iter().all(|v| v.tick == 50), "{:?}", verdict.violations);
        assert!(verdict.violation_count > 0);
    }

    #[test]
    fn what_cannot_be_judged_is_not_acquitted() {
        let header = trace(&[]);
        assert!(matches!(judge(header.as_bytes(), &machine()), Err(TraceError::Empty)));
        let other = "tick,time_s,line\n0,0,1\n";
        assert!(matches!(judge(other.as_bytes(), &machine()), Err(TraceError::Column(_))));
        let gap = format!("{}7,0.007,1,0,0,0,0,0,0,0\n", trace(&[0.0, 0.0]));
        assert!(matches!(judge(gap.as_bytes(), &machine()), Err(TraceError::Time { row: 3 })));
    }
}
