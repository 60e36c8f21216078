//! `steps.vcd`: the lines to the drivers as a value change dump (IEEE 1364), and a reader that counts them back.
//!
//! Leaf names are unique (`joint0_step`, `joint0_dir`), because some readers drop the scope. The timescale is the timer's
//! period where VCD can say it (1, 10 or 100 ns, µs, ms), else 1 ns.

use crate::report::{Observer, TickReport};
use crate::simulation::Simulation;
use crate::trace::Output;
use pkm_kins::MAX_JOINTS;
use pkm_stepgen::{Edge, Line};
use std::io::{self, BufRead, Write};
use vcd::{Command, IdCode, TimescaleUnit};

/// Writes `steps.vcd`. An error of the writer is kept; [`Self::finish`] returns it.
#[derive(Debug)]
pub struct VcdWriter<W: Write> {
    out: Output<W>,
    /// Text of a falling and a rising edge, per joint: direction, step.
    changes: Vec<[[[u8; 3]; 2]; 2]>,
    /// VCD time units per timer tick.
    per_tick: u64,
    servo_ticks: u64,
    stamp: Stamp,
    time: Option<u64>,
    end: u64,
}

/// The text of times, `#123456789\n`. Times come in order, so all but the last four digits are mostly those of before.
#[derive(Debug)]
struct Stamp {
    /// `#` and the digits of `high`.
    head: [u8; 24],
    length: usize,
    /// Time / 10⁴ that is in the head; 0: none.
    high: u64,
}

impl Stamp {
    const fn new() -> Self {
        Self { head: [b'#'; 24], length: 1, high: 0 }
    }

    /// Appends a time and the three bytes of a change. The last digits, the line's end and the change make one word: what
    /// is stored in pieces cannot be loaded as a whole without a stall.
    #[inline]
    fn append(&mut self, out: &mut Vec<u8>, time: u64, change: [u8; 3]) {
        let (high, low) = (time / 10_000, time % 10_000);
        if high == 0 {
            out.push(b'#');
            out.extend_from_slice(itoa::Buffer::new().format(time).as_bytes());
            out.push(b'\n');
            out.extend_from_slice(&change);
            return;
        }
        if high != self.high {
            let mut digits = itoa::Buffer::new();
            let digits = digits.format(high).as_bytes();
            self.high = high;
            self.length = 1 + digits.len();
            self.head[1..self.length].copy_from_slice(digits);
        }
        let end = out.len() + self.length;
        out.extend_from_slice(&self.head); // a copy of fixed length is cheaper than one of the right length
        out.truncate(end);
        let digit = |value: u64| u64::from(b'0') + value % 10;
        let [a, b, c] = change.map(u64::from);
        let word = digit(low / 1000)
            | digit(low / 100) << 8
            | digit(low / 10) << 16
            | digit(low) << 24
            | u64::from(b'\n') << 32
            | a << 40
            | b << 48
            | c << 56;
        out.extend_from_slice(&word.to_le_bytes());
    }
}

/// VCD's unit for a timer period, and timer ticks in it.
fn timescale(timer_period_ns: u64) -> (u32, TimescaleUnit, u64) {
    for (unit_ns, unit) in [(1, TimescaleUnit::NS), (1000, TimescaleUnit::US), (1_000_000, TimescaleUnit::MS)]
    {
        for magnitude in [1, 10, 100] {
            if timer_period_ns == unit_ns * u64::from(magnitude) {
                return (magnitude, unit, 1);
            }
        }
    }
    (1, TimescaleUnit::NS, timer_period_ns)
}

impl<W: Write> VcdWriter<W> {
    /// Writes the header; all lines are low at time 0.
    pub fn new(writer: W, simulation: &Simulation) -> Self {
        let mut out = Output::new(writer);
        let (magnitude, unit, per_tick) = timescale(simulation.hal().timer_period_ns());
        let joints = simulation.report().joints.len();
        let ids = header(&mut out.text, joints, magnitude, unit).expect("a Vec<u8> takes every byte");
        let line = |id: IdCode| {
            // the first 94 identifiers have one character; there are at most two for each of MAX_JOINTS
            let id = id.to_string().as_bytes()[0];
            [[b'0', id, b'\n'], [b'1', id, b'\n']]
        };
        let changes = ids.into_iter().map(|(dir, step)| [line(dir), line(step)]).collect();
        let servo_ticks = simulation.servo_period_ns() / simulation.hal().timer_period_ns();
        Self { out, changes, per_tick, servo_ticks, stamp: Stamp::new(), time: None, end: 0 }
    }

    /// The first error of the writer, if there was one; nothing was written after it.
    pub const fn error(&self) -> Option<&io::Error> {
        self.out.error()
    }

    /// Writes the time of the last period's end and what is left, and returns the writer.
    ///
    /// # Errors
    /// The first error of the writer.
    pub fn finish(mut self) -> io::Result<W> {
        if self.time != Some(self.end) {
            let text = format!("#{}\n", self.end * self.per_tick);
            self.out.text.extend_from_slice(text.as_bytes());
        }
        self.out.finish()
    }
}

fn header(
    text: &mut Vec<u8>,
    joints: usize,
    magnitude: u32,
    unit: TimescaleUnit,
) -> io::Result<Vec<(IdCode, IdCode)>> {
    let mut vcd = vcd::Writer::new(text);
    vcd.comment(
        "step and direction lines of every joint; a rising step edge is one step, positive while dir is 1",
    )?;
    vcd.timescale(magnitude, unit)?;
    vcd.add_module("machine")?;
    let mut ids = Vec::new();
    for n in 0..joints {
        let step = vcd.add_wire(1, &format!("joint{n}_step"))?;
        let dir = vcd.add_wire(1, &format!("joint{n}_dir"))?;
        ids.push((dir, step));
    }
    vcd.upscope()?;
    vcd.enddefinitions()?;
    vcd.timestamp(0)?;
    vcd.begin(vcd::SimulationCommand::Dumpvars)?;
    for &(dir, step) in &ids {
        vcd.change_scalar(step, vcd::Value::V0)?;
        vcd.change_scalar(dir, vcd::Value::V0)?;
    }
    vcd.end()?;
    Ok(ids)
}

impl<W: Write> Observer for VcdWriter<W> {
    fn edge(&mut self, edge: &Edge) {
        let Some(joint) = self.changes.get(usize::from(edge.joint)) else { return };
        let change = joint[usize::from(edge.line == Line::Step)][usize::from(edge.level)];
        if self.time == Some(edge.time) {
            self.out.text.extend_from_slice(&change);
        } else {
            self.stamp.append(&mut self.out.text, edge.time * self.per_tick, change);
            self.time = Some(edge.time);
        }
        self.out.spill();
    }

    fn tick(&mut self, report: &TickReport<'_>) {
        self.end = report.tick * self.servo_ticks;
    }
}

/// Counts the steps of a `steps.vcd` back to positions.
pub struct VcdSteps<R: BufRead> {
    parser: vcd::Parser<R>,
    timescale_ns: u64,
    /// Direction and step line of each joint.
    lines: Vec<(IdCode, IdCode)>,
    positive: Vec<bool>,
    counts: Vec<i64>,
    time: u64,
}

fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.to_owned())
}

impl<R: BufRead> VcdSteps<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// The reader's, and `InvalidData` if it is no such file.
    pub fn new(reader: R) -> io::Result<Self> {
        let mut parser = vcd::Parser::new(reader);
        let header = parser.parse_header()?;
        let (magnitude, unit) = header.timescale.ok_or_else(|| damaged("no timescale"))?;
        let unit_ns = match unit {
            TimescaleUnit::NS => 1,
            TimescaleUnit::US => 1000,
            TimescaleUnit::MS => 1_000_000,
            _ => return Err(damaged("a timescale that no timer has")),
        };
        let find = |name: String| header.find_var(&["machine", &name]).map(|variable| variable.code);
        let mut lines = Vec::new();
        for n in 0..MAX_JOINTS {
            match (find(format!("joint{n}_dir")), find(format!("joint{n}_step"))) {
                (Some(dir), Some(step)) => lines.push((dir, step)),
                (None, None) => break,
                _ => return Err(damaged("a joint with one line only")),
            }
        }
        let count = lines.len();
        Ok(Self {
            parser,
            timescale_ns: u64::from(magnitude) * unit_ns,
            lines,
            positive: vec![false; count],
            counts: vec![0; count],
            time: 0,
        })
    }

    /// Counts all edges up to and including `time_ns`; the sums since time 0, in joint order.
    ///
    /// # Errors
    /// The reader's, and `InvalidData`.
    pub fn counts_at(&mut self, time_ns: u64) -> io::Result<&[i64]> {
        // `self.time` is that of the edges that come next
        while self.time.saturating_mul(self.timescale_ns) <= time_ns {
            match self.parser.next() {
                None => break,
                Some(Err(error)) => return Err(error),
                Some(Ok(Command::Timestamp(time))) if time < self.time => {
                    return Err(damaged("time runs backwards"));
                }
                Some(Ok(Command::Timestamp(time))) => self.time = time,
                Some(Ok(Command::ChangeScalar(id, value))) => self.change(id, value == vcd::Value::V1),
                Some(Ok(_)) => {}
            }
        }
        Ok(&self.counts)
    }

    fn change(&mut self, id: IdCode, level: bool) {
        for (n, &(dir, step)) in self.lines.iter().enumerate() {
            if id == dir {
                self.positive[n] = level;
            } else if id == step && level {
                self.counts[n] += if self.positive[n] { 1 } else { -1 };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_decimal_numbers() {
        let mut stamp = Stamp::new();
        let times = [0, 7, 42, 9999, 10_000, 10_001, 19_999, 20_000, 123_456_789, 123_459_999, 5, 99_990_000];
        for time in times.into_iter().chain([u64::MAX, u64::MAX - 9999]) {
            let mut text = b"x".to_vec();
            stamp.append(&mut text, time, *b"1!\n");
            assert_eq!(String::from_utf8_lossy(&text), format!("x#{time}\n1!\n"));
        }
    }
}
