//! The compact step stream: runs (interval, count, add) of [`pkm_stepgen::runs`] for a microcontroller's timer, and a
//! reader that counts them back.
//!
//! ```text
//! "PKMS"                                                    4 bytes
//! version = 1                                               1
//! joints                                                    1, at most 126
//! timer period, ns                                          8, little-endian like all that follow
//! servo period, timer ticks                                 8
//! per joint: step length, step space, dir setup, dir hold   4 × 4, timer ticks
//! runs                                                      see pkm_stepgen::runs
//! 0x7f                                                      1
//! FNV-1a (64 bit) of everything before                      8
//! ```
//!
//! A step's pulse has the joint's step length; the direction line changes any time between the hold after the last pulse
//! and the setup before the next. Runs are written once a window of [`WINDOW`] servo periods, for one joint after the
//! other, so a player that holds two windows never waits. Steps stay in their servo period and are at most the tolerance
//! off, so positions at the ends of periods are those of the other files.

use crate::report::{Observer, TickReport};
use crate::simulation::Simulation;
use crate::trace::Output;
use pkm_stepgen::runs::MAX_RUN_BYTES;
use pkm_stepgen::{Edge, Line, Run, RunLimits};
use std::io::{self, Write};

/// Servo periods between two writings.
pub const WINDOW: u64 = 64;

const MAGIC: &[u8; 5] = b"PKMS\x01";
const END: u8 = 0x7f;

/// FNV-1a, 64 bit.
#[derive(Debug, Clone, Copy)]
struct Checksum(u64);

impl Checksum {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

#[derive(Debug, Default)]
struct Joint {
    last: u64,
    positive: bool,
    times: Vec<u64>,
    min_interval: u64,
}

/// Writes the stream. An error of the writer is kept; [`Self::finish`] returns it.
#[derive(Debug)]
pub struct StreamWriter<W: Write> {
    out: Output<W>,
    checksum: Checksum,
    joints: Vec<Joint>,
    tolerance: u64,
    period: u64,
}

impl<W: Write> StreamWriter<W> {
    /// Writes the header. Steps may be `tolerance` timer ticks off; 0: exact, in more bytes. To be made before the first
    /// period.
    pub fn new(writer: W, simulation: &Simulation, tolerance: u64) -> Self {
        let timer_period_ns = simulation.hal().timer_period_ns();
        let period = simulation.servo_period_ns() / timer_period_ns;
        let mut head = MAGIC.to_vec();
        head.push(simulation.pulse_timings().count() as u8);
        head.extend_from_slice(&timer_period_ns.to_le_bytes());
        head.extend_from_slice(&period.to_le_bytes());
        let mut joints = Vec::new();
        for timing in simulation.pulse_timings() {
            let times = [timing.step_length(), timing.step_space(), timing.dir_setup(), timing.dir_hold()];
            for time in times {
                head.extend_from_slice(&u32::try_from(time).unwrap_or(u32::MAX).to_le_bytes());
            }
            joints.push(Joint { min_interval: timing.step_interval(), ..Joint::default() });
        }
        let mut stream =
            Self { out: Output::new(writer), checksum: Checksum::new(), joints, tolerance, period };
        stream.put(&head);
        stream
    }

    fn put(&mut self, bytes: &[u8]) {
        self.checksum.add(bytes);
        self.out.text.extend_from_slice(bytes);
        self.out.spill();
    }

    /// Writes the steps collected for one joint.
    fn flush(&mut self, n: usize) {
        let mut times = std::mem::take(&mut self.joints[n].times);
        let mut rest = times.as_slice();
        loop {
            let joint = &mut self.joints[n];
            let limits = RunLimits {
                tolerance: self.tolerance,
                min_interval: joint.min_interval,
                period: self.period,
            };
            let Some(run) = Run::longest(n as u8, joint.positive, joint.last, rest, &limits) else { break };
            joint.last = run.time(joint.last, run.count);
            rest = rest.get(run.count as usize..).unwrap_or_default();
            let mut bytes = [0; MAX_RUN_BYTES];
            let length = run.encode(&mut bytes);
            self.put(&bytes[..length]);
        }
        times.clear();
        self.joints[n].times = times;
    }

    /// The first error of the writer, if there was one; nothing was written after it.
    pub const fn error(&self) -> Option<&io::Error> {
        self.out.error()
    }

    /// Writes what is left and returns the writer.
    ///
    /// # Errors
    /// The first error of the writer.
    pub fn finish(mut self) -> io::Result<W> {
        for n in 0..self.joints.len() {
            self.flush(n);
        }
        self.put(&[END]);
        let checksum = self.checksum.0.to_le_bytes();
        self.out.text.extend_from_slice(&checksum);
        self.out.finish()
    }
}

impl<W: Write> Observer for StreamWriter<W> {
    fn edge(&mut self, edge: &Edge) {
        let n = usize::from(edge.joint);
        match edge.line {
            Line::Dir => {
                self.flush(n);
                self.joints[n].positive = edge.level;
            }
            Line::Step if edge.level => self.joints[n].times.push(edge.time),
            _ => {}
        }
    }

    fn tick(&mut self, report: &TickReport<'_>) {
        if report.tick.is_multiple_of(WINDOW) {
            for n in 0..self.joints.len() {
                self.flush(n);
            }
        }
    }
}

/// Counts the steps of a stream back to positions.
#[derive(Debug, Clone)]
pub struct StreamSteps {
    timer_period_ns: u64,
    joints: Vec<Playback>,
    counts: Vec<i64>,
}

#[derive(Debug, Clone, Default)]
struct Playback {
    runs: Vec<Run>,
    /// Run under way, its steps made, and the time at which it began.
    run: usize,
    made: u32,
    last: u64,
}

impl Playback {
    /// Time, in timer ticks, and direction of the next step.
    fn next(&mut self) -> Option<(u64, bool)> {
        while let Some(run) = self.runs.get(self.run) {
            if self.made < run.count {
                return Some((run.time(self.last, self.made + 1), run.forward));
            }
            self.last = run.time(self.last, run.count);
            (self.run, self.made) = (self.run + 1, 0);
        }
        None
    }
}

fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("not a whole step stream: {what}"))
}

impl StreamSteps {
    /// Reads a whole stream.
    ///
    /// # Errors
    /// `InvalidData` if it is none, is cut off, or its checksum does not fit.
    pub fn new(bytes: &[u8]) -> io::Result<Self> {
        let (body, sum) = bytes.split_last_chunk::<8>().ok_or_else(|| damaged("too short"))?;
        let mut checksum = Checksum::new();
        checksum.add(body);
        if checksum.0 != u64::from_le_bytes(*sum) {
            return Err(damaged("the checksum does not fit"));
        }
        let body = body.strip_suffix(&[END]).ok_or_else(|| damaged("no end"))?;
        let body = body.strip_prefix(MAGIC).ok_or_else(|| damaged("another kind or version"))?;
        let (joints, body) = body.split_first().ok_or_else(|| damaged("no header"))?;
        let (timer, body) = body.split_first_chunk::<8>().ok_or_else(|| damaged("no header"))?;
        let (_, body) = body.split_first_chunk::<8>().ok_or_else(|| damaged("no header"))?;
        let timings = usize::from(*joints) * 16;
        let mut runs = body.get(timings..).ok_or_else(|| damaged("no header"))?;
        let joints = usize::from(*joints);
        let mut players = vec![Playback::default(); joints];
        while !runs.is_empty() {
            let (run, rest) = Run::decode(runs).map_err(|_| damaged("a run"))?;
            let player = players.get_mut(usize::from(run.joint)).ok_or_else(|| damaged("a joint"))?;
            player.runs.push(run);
            runs = rest;
        }
        Ok(Self { timer_period_ns: u64::from_le_bytes(*timer), joints: players, counts: vec![0; joints] })
    }

    /// The next step of any joint: its time, ns, its joint, and whether it goes forward. Of steps at one time the first joint's
    /// comes first.
    pub fn next_step(&mut self) -> Option<(u64, usize, bool)> {
        let mut first: Option<(u64, usize, bool)> = None;
        for (n, player) in self.joints.iter_mut().enumerate() {
            if let Some((time, forward)) = player.next()
                && first.is_none_or(|(earliest, ..)| time < earliest)
            {
                first = Some((time, n, forward));
            }
        }
        let (time, joint, forward) = first?;
        self.joints[joint].made += 1;
        self.counts[joint] += if forward { 1 } else { -1 };
        Some((time.saturating_mul(self.timer_period_ns), joint, forward))
    }

    /// Counts all steps up to and including `time_ns`; the sums since time 0, in joint order. Times must not go back.
    pub fn counts_at(&mut self, time_ns: u64) -> &[i64] {
        for (player, count) in self.joints.iter_mut().zip(&mut self.counts) {
            while let Some((time, forward)) = player.next() {
                if time.saturating_mul(self.timer_period_ns) > time_ns {
                    break;
                }
                player.made += 1;
                *count += if forward { 1 } else { -1 };
            }
        }
        &self.counts
    }

    /// Period of the timer that all times are multiples of, ns.
    pub const fn timer_period_ns(&self) -> u64 {
        self.timer_period_ns
    }

    /// Steps so far, forward less backward, in joint order.
    pub fn counts(&self) -> &[i64] {
        &self.counts
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.joints.iter().map(|player| player.runs.len()).sum()
    }
}
