//! The judge of a LinuxCNC session (`.ci/judge-linuxcnc` calls it):
//!
//! * `judge record MACHINE [steps]`: the HAL file that records every servo period (and the counts of LinuxCNC's `stepgen`);
//! * `judge refuse MACHINE INI`: a program whose third line is out of reach, inside the axes' limits;
//! * `judge rows MACHINE FOLDER`: whether `rows.csv` and `end.txt` of the session are what the machine file and `example.ngc` say;
//! * `judge sabotage MACHINE FOLDER`: whether it would say so of a session that is a little different. It must not.
//!
//! It knows the machine file and the program, and nothing of the module.
#![allow(clippy::print_stdout)] // a command-line tool

use pkm_kins::*;
use pkm_linuxcnc::{Ini, modes};
use pkm_machine::{Machine, SwitchTarget};
use std::fmt::Write as _;

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let machine = |name: &str| Machine::load(name, &[]).map_err(|findings| format!("{findings:?}"));
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["record", name] => {
            println!("{}", record(&machine(name)?, false));
            Ok(())
        }
        ["record", name, "steps"] => {
            println!("{}", record(&machine(name)?, true));
            Ok(())
        }
        ["refuse", name, ini] => {
            let text = std::fs::read_to_string(ini).map_err(|error| error.to_string())?;
            println!("{}", refuse(&machine(name)?, &Ini::parse(&text)));
            Ok(())
        }
        ["rows", name, folder] => {
            let machine = machine(name)?;
            println!("{name}: {}", judge(&machine, &Session::read(&machine, folder)?)?);
            Ok(())
        }
        ["sabotage", name, folder] => {
            let machine = machine(name)?;
            println!("{name}: {}", sabotage(&machine, &Session::read(&machine, folder)?)?);
            Ok(())
        }
        _ => Err("judge record MACHINE [steps] | refuse MACHINE INI | rows MACHINE FOLDER | sabotage MACHINE FOLDER".into()),
    }
}

/// Joints, axes, line; the kinematics' type where it can be switched; the counts of stepgen.
fn record(machine: &Machine, steps: bool) -> String {
    let joints = machine.joints.len();
    let axes: Vec<Axis> = machine.mechanism.axes().iter().collect();
    let mut pins: Vec<(char, String, String)> = (0..joints)
        .map(|joint| ('f', format!("record-joint-{joint}"), format!("joint.{joint}.pos-cmd")))
        .collect();
    for axis in &axes {
        let letter = axis.letter().to_ascii_lowercase();
        pins.push(('f', format!("record-{letter}"), format!("axis.{letter}.pos-cmd")));
    }
    pins.push(('s', "record-line".into(), "motion.program-line".into()));
    // The signal is the configuration's own.
    pins.push(('f', "kinematics-type".into(), String::new()));
    if machine.switches.is_empty() {
        pins.pop();
    }
    if steps {
        pins.extend(
            (0..joints)
                .map(|joint| ('s', format!("record-counts-{joint}"), format!("stepgen.{joint}.counts"))),
        );
    }
    let types: String = pins.iter().map(|(kind, ..)| *kind).collect();
    let mut t = format!(
        "loadrt sampler depth=16000 cfg={types}\naddf sampler.0 servo-thread\nsetp sampler.0.enable 0\n"
    );
    for (index, (_, signal, pin)) in pins.iter().enumerate() {
        let _ = writeln!(t, "net {signal} {pin} => sampler.0.pin.{index}");
    }
    t
}

fn word(axis: Axis, value: f64) -> String {
    let face = if axis.is_rotary() { maths::degrees(value) } else { value };
    format!("{}{:.3}", axis.letter(), face)
}

/// A pose that the axes' limits allow and the kinematics does not, by way of one it can be at.
fn refuse(machine: &Machine, ini: &Ini) -> String {
    let mode = modes(machine)[0];
    let axes: Vec<Axis> = mode.mechanism.axes().iter().collect();
    let limits = |axis: Axis| {
        let section = format!("AXIS_{}", axis.letter());
        let of = |key| ini.number(&section, key).unwrap_or(0.0);
        (of("MIN_LIMIT"), of("MAX_LIMIT"))
    };
    let moving: Vec<Axis> = axes
        .iter()
        .copied()
        .filter(|&axis| {
            mode.mechanism.jacobian(&mode.pose).is_ok_and(|j| j.iter().any(|row| row[axis as usize] != 0.0))
        })
        .collect();
    // Corners of the box, then its sides: the kinematics should refuse, not a joint's travel.
    let mut candidates = Vec::new();
    for (i, &first) in moving.iter().enumerate() {
        for &second in &moving[i..] {
            for (low, high) in [(true, true), (true, false), (false, true), (false, false)] {
                let mut pose = mode.pose;
                for (axis, low) in [(first, low), (second, high)] {
                    let (min, max) = limits(axis);
                    let end = if low { min + 0.5 } else { max - 0.5 };
                    pose.set(axis, if axis.is_rotary() { maths::radians(end) } else { end });
                }
                candidates.push(pose);
            }
        }
    }
    let unreachable = |pose: &&Pose| mode.mechanism.inverse(pose).is_err();
    let beyond = |pose: &&Pose| machine.inverse(pose).is_err();
    let bad = candidates.iter().find(unreachable).or_else(|| candidates.iter().find(beyond)).copied();
    // Nothing in the box is out of reach: a step over its side, which LinuxCNC itself refuses.
    let bad = bad.unwrap_or_else(|| {
        let mut pose = mode.pose;
        pose.set(moving[0], limits(moving[0]).1 + 5.0);
        pose
    });
    let words =
        |pose: &Pose| moving.iter().map(|&axis| word(axis, pose.get(axis))).collect::<Vec<_>>().join(" ");
    format!("G21 G90 G94 G61 F900\nG1 {}\nG1 {}\nM2", words(&mode.pose), words(&bad))
}

/// One row of the record, in LinuxCNC's units.
#[derive(Clone)]
struct Row {
    joints: Joints,
    pose: [f64; 9],
    line: usize,
    kind: i32,
    /// Of stepgen, if it ran.
    counts: Option<Joints>,
}

/// What a session leaves.
#[derive(Clone)]
struct Session {
    rows: Vec<Row>,
    /// Where LinuxCNC's forward says that the machine rests.
    end: [f64; 9],
    program: String,
}

impl Session {
    fn read(machine: &Machine, folder: &str) -> Result<Self, String> {
        let read = |file: &str| {
            std::fs::read_to_string(format!("{folder}/{file}")).map_err(|error| format!("{file}: {error}"))
        };
        let end: Vec<f64> =
            read("end.txt")?.split_whitespace().filter_map(|number| number.parse().ok()).collect();
        Ok(Self {
            rows: read("rows.csv")?.lines().map(|line| row(machine, line)).collect::<Result<_, _>>()?,
            end: end.try_into().map_err(|_| "end.txt is no pose")?,
            program: read("example.ngc")?,
        })
    }
}

fn row(machine: &Machine, line: &str) -> Result<Row, String> {
    let numbers: Vec<f64> =
        line.split(',').map(str::parse).collect::<Result<_, _>>().map_err(|_| line.to_owned())?;
    let mut numbers = numbers.into_iter();
    let mut next = || numbers.next().ok_or("a short row");
    let mut row = Row { joints: [0.0; MAX_JOINTS], pose: [0.0; 9], line: 0, kind: 0, counts: None };
    let count = machine.joints.len();
    for joint in &mut row.joints[..count] {
        *joint = next()?;
    }
    for axis in machine.mechanism.axes().iter() {
        row.pose[axis as usize] = next()?;
    }
    row.line = next()? as usize;
    if !machine.switches.is_empty() {
        row.kind = next()? as i32;
    }
    if let Ok(first) = next() {
        let counts = row.counts.insert([first; MAX_JOINTS]);
        for joint in &mut counts[1..count] {
            *joint = next()?;
        }
    }
    Ok(row)
}

/// The kinematics of each type, as LinuxCNC switches it.
struct Switching<'a> {
    machine: &'a Machine,
    now: Mechanism,
    kind: i32,
}

impl Switching<'_> {
    fn inner(&self, face: &Joints) -> Joints {
        let mut joints = *face;
        for (joint, value) in self.machine.joints.iter().zip(&mut joints) {
            *value = joint.from_face(*value);
        }
        joints
    }

    /// `motion.switchkins-type` is `kind` from here on; the joints stand at `joints`.
    fn switch(&mut self, kind: i32, joints: &Joints) {
        self.kind = kind;
        let held = self.inner(joints);
        self.now = match (self.machine.mechanism, kind) {
            (Mechanism::HvMachine(m), _) => {
                let start = m.active();
                let other = if start == Spindle::H { Spindle::V } else { Spindle::H };
                m.holding(if kind == 0 { start } else { other }, &held).into()
            }
            (Mechanism::OxGlide(_), 1) => {
                let other =
                    modes(self.machine).into_iter().find(|m| matches!(m.target, Some(SwitchTarget::Form(_))));
                other.map_or(self.machine.mechanism, |mode| mode.mechanism)
            }
            (mechanism, _) => mechanism,
        };
    }

    fn inverse(&self, pose: &[f64; 9]) -> Result<Joints, String> {
        if self.kind == 2 {
            let mut joints = [0.0; MAX_JOINTS];
            joints[..3].copy_from_slice(&pose[..3]);
            return Ok(joints);
        }
        if let Mechanism::Cartesian(machine) = self.now {
            // LinuxCNC's trivkins: nothing is converted.
            let mut joints = [0.0; MAX_JOINTS];
            for (joint, axis) in joints.iter_mut().zip(Kinematics::axes(&machine).iter()) {
                *joint = pose[axis as usize];
            }
            return Ok(joints);
        }
        let mut inner = Pose::from_array(*pose);
        [inner.a, inner.b, inner.c] = [inner.a, inner.b, inner.c].map(maths::radians);
        let mut joints = self.now.inverse(&inner).map_err(|error| format!("{error} at {pose:?}"))?;
        for (joint, value) in self.machine.joints.iter().zip(&mut joints) {
            *value = joint.to_face(*value);
        }
        Ok(joints)
    }

    fn forward(&self, joints: &Joints, seed: &[f64; 9]) -> Result<[f64; 9], String> {
        if self.kind == 2 {
            let mut pose = *seed;
            pose[..3].copy_from_slice(&joints[..3]);
            return Ok(pose);
        }
        let mut inner = Pose::from_array(*seed);
        [inner.a, inner.b, inner.c] = [inner.a, inner.b, inner.c].map(maths::radians);
        let found = self.now.forward(&self.inner(joints), &inner).map_err(|error| error.to_string())?;
        let mut pose = found.to_array();
        for angle in &mut pose[3..6] {
            *angle = maths::degrees(*angle);
        }
        Ok(pose)
    }
}

fn distance(a: &[f64; 9], b: &[f64; 9]) -> f64 {
    maths::sqrt(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum())
}

/// A block of the example: where it ends, and the centre of an arc.
#[derive(Debug)]
struct Block {
    line: usize,
    words: Vec<(char, f64)>,
}

/// The example's own small part of the language: G1 with absolute words, G3 with I and J.
fn blocks(program: &str) -> Vec<Block> {
    let number = |word: &str| word.get(1..).and_then(|number| number.parse::<f64>().ok());
    let block = |(index, text): (usize, &str)| {
        let mut words = text.split_whitespace();
        matches!(words.next()?, "G1" | "G3").then(|| Block {
            line: index + 1,
            words: words.filter_map(|word| Some((word.chars().next()?, number(word)?))).collect(),
        })
    };
    program.lines().enumerate().filter_map(block).collect()
}

/// Off the path by at most so much, mm (degrees).
const ON_PATH: f64 = 1e-6;
/// A block's ends are passed at most so far away: half a servo period's way.
const AT_END: f64 = 0.06;
/// LinuxCNC's forward of the joints at rest is at most so far from the axes, mm (degrees); where stepgen has the joints, so far.
const AT_REST: f64 = 1e-6;
const ONE_STEP: f64 = 0.02;
/// So many servo periods without a motion are a rest, at whose end stepgen has arrived.
const LONG: usize = 100;

fn judge(machine: &Machine, session: &Session) -> Result<String, String> {
    let Session { rows, end, program } = session;
    let (first, last) = (rows.first().ok_or("no rows")?, rows.last().ok_or("no rows")?);
    let count = machine.joints.len();
    let mut kinematics = Switching { machine, now: machine.mechanism, kind: 0 };
    kinematics.switch(first.kind, &first.joints);
    let blocks = blocks(program);

    let mut solved: Vec<Joints> = Vec::with_capacity(rows.len());
    let mut exact = 0_u64;
    let (mut most_back, mut most_off) = (0.0_f64, 0.0_f64);
    // Where the program has come: the start and the end of the block that is being run.
    let (mut start, mut here, mut block, mut last_row) = (first.pose, first.pose, None::<usize>, first.pose);
    let mut done = 0;
    for (k, row) in rows.iter().enumerate() {
        if row.kind != kinematics.kind {
            let joints = solved.last().copied().unwrap_or(first.joints);
            kinematics.switch(row.kind, &joints);
            (here, block) = (row.pose, None);
        }
        // (a) the filtered inverse, bit for bit
        let joints = kinematics.inverse(&row.pose).map_err(|error| format!("row {k}: {error}"))?;
        solved.push(joints);
        if k >= 3 {
            let (p, q, r) = (&solved[k - 3], &solved[k - 2], &solved[k - 1]);
            for joint in 0..count {
                let expected = (p[joint] + 4.0 * q[joint] + r[joint]) / 6.0;
                let seen = row.joints[joint];
                if seen.to_bits() == expected.to_bits() || (seen == 0.0 && expected == 0.0) {
                    exact += 1;
                } else {
                    return Err(format!("row {k}: joint {joint} is at {seen}, our inverse says {expected}"));
                }
            }
        }
        // (b) forward of the joints gives the axes
        let back = kinematics.forward(&joints, &row.pose).map_err(|error| format!("row {k}: {error}"))?;
        most_back = most_back.max(distance(&back, &row.pose));
        // (c) the path is the programmed one
        if row.kind != 2 {
            // motion.program-line follows the position by one period.
            let line =
                rows.get(k + 1).filter(|next| next.kind == row.kind).map_or(row.line, |next| next.line);
            let running = blocks.iter().position(|candidate| candidate.line == line);
            let before = block.map(|now| (now, start, here));
            if let Some(now) = running.filter(|&now| Some(now) != block) {
                if block.is_some() && distance(&last_row, &here) > AT_END {
                    return Err(format!("row {k}: line {} begins at {last_row:?} before {here:?}", row.line));
                }
                if now < done {
                    return Err(format!("row {k}: line {} again", row.line));
                }
                done = now + 1;
                (start, block) = (here, Some(now));
                for &(letter, value) in &blocks[now].words {
                    if let Some(axis) = Axis::ALL.into_iter().find(|axis| axis.letter() == letter) {
                        here[axis as usize] = value;
                    }
                }
            }
            let off = match block {
                Some(now) => off_path(&row.pose, &start, &here, &blocks[now]),
                None => distance(&row.pose, &here),
            };
            // The period in which one block ends and the next begins belongs to either.
            let off = before
                .map_or(off, |(now, start, end)| off.min(off_path(&row.pose, &start, &end, &blocks[now])));
            most_off = most_off.max(off);
            if !(off <= ON_PATH) {
                return Err(format!("row {k}: line {}: {off} mm off the path, at {:?}", row.line, row.pose));
            }
        }
        last_row = row.pose;
    }
    if done != blocks.len() {
        return Err(format!("the program ended after {done} of {} blocks", blocks.len()));
    }
    if !(distance(&last.pose, &here) <= 1e-9) {
        return Err(format!("the program ended at {:?}, not at {here:?}", last.pose));
    }
    if most_back > 1e-6 {
        return Err(format!("forward of the joints is {most_back} mm from the axes"));
    }
    let (steps, rest) = match rows.iter().any(|row| row.counts.is_some()) {
        true => (steps(machine, rows)?, ONE_STEP),
        false => (String::new(), AT_REST),
    };
    if !(distance(end, &last.pose) <= rest) {
        return Err(format!("LinuxCNC's forward says {end:?}, the axes are at {:?}", last.pose));
    }
    Ok(format!(
        "{} rows, {exact} joint positions bit for bit, forward within {most_back:.0e} mm; \
         {} blocks, path within {most_off:.0e} mm{steps}",
        rows.len(),
        blocks.len()
    ))
}

/// (e) Wherever the joints have rested a while, stepgen's counts are their ways in steps, to the half of one.
fn steps(machine: &Machine, rows: &[Row]) -> Result<String, String> {
    let Some(Row { joints: home, counts: Some(zero), .. }) = rows.first() else {
        return Err("no counts".into());
    };
    let (mut places, mut most, mut farthest) = (0, 0.0_f64, 0.0_f64);
    for rest in rows.chunk_by(|a, b| a.joints == b.joints).filter(|rest| rest.len() > LONG) {
        let Some(Row { joints, counts: Some(counts), .. }) = rest.last() else {
            return Err("no counts".into());
        };
        places += 1;
        for (number, joint) in machine.joints.iter().enumerate() {
            let scale = joint.steps_per_unit / joint.to_face(1.0);
            let way = (joints[number] - home[number]) * scale;
            let off = (counts[number] - zero[number] - way).abs();
            (most, farthest) = (most.max(off), farthest.max(way.abs()));
            if !(off <= 0.5 + 1e-3) {
                return Err(format!(
                    "rest {places}: joint {number} has made {} steps, not {way:.3}",
                    counts[number]
                ));
            }
        }
    }
    if places < 10 || farthest < 1000.0 {
        return Err(format!("{places} rests, {farthest:.0} steps: too little to count"));
    }
    Ok(format!("; stepgen within {most:.2} steps at {places} rests, up to {farthest:.0} steps away"))
}

/// The judge must be able to convict: each of these sessions is a little different from the one that happened.
fn sabotage(machine: &Machine, session: &Session) -> Result<String, String> {
    judge(machine, session)?;
    let middle = session.rows.len() / 2;
    // In the middle of a move, away from a switch.
    let moving = (middle..session.rows.len())
        .find(|&k| {
            session.rows[k - 8..k + 8]
                .windows(2)
                .all(|pair| pair[0].pose != pair[1].pose && pair[0].kind == pair[1].kind)
        })
        .ok_or("nothing moves")?;
    let row = &session.rows[moving];
    let axis =
        (0..9).find(|&axis| row.pose[axis] != session.rows[moving - 1].pose[axis]).ok_or("nothing moves")?;
    let mut convicted = 0;
    let mut convict = |what: &str, because: &str, change: &dyn Fn(&mut Session)| {
        let mut other = session.clone();
        change(&mut other);
        match judge(machine, &other) {
            Err(why) if why.contains(because) => convicted += 1,
            verdict => return Err(format!("{what}: should be convicted because \"{because}\": {verdict:?}")),
        }
        Ok(())
    };
    for joint in 0..machine.joints.len() {
        convict("a joint is moved by 1e-9 in one period", "our inverse says", &|s| {
            s.rows[moving].joints[joint] += 1e-9
        })?;
    }
    convict("the axes are moved by 1e-5 in one period", "row", &|s| s.rows[moving].pose[axis] += 1e-5)?;
    convict("the axes are nowhere in one period", "row", &|s| s.rows[moving].pose[axis] = f64::NAN)?;
    convict("one period is missing", "our inverse says", &|s| {
        s.rows.remove(moving);
    })?;
    convict("two periods are the wrong way round", "our inverse says", &|s| s.rows.swap(moving, moving + 1))?;
    convict("the record ends too early", "the program ended", &|s| s.rows.truncate(moving))?;
    convict("a block is not run", "of", &|s| s.program.push_str("G1 X0.001\n"))?;
    convict("the program says another place", "line", &|s| {
        s.program = s.program.replace("\nG1 X", "\nG1 X1")
    })?;
    if session.program.contains(" I-") {
        convict("an arc has another centre", "line", &|s| s.program = s.program.replace(" I-", " I-1"))?;
    }
    convict("a block is run again", "line", &|s| {
        let line = blocks(&s.program)[0].line;
        s.rows[moving..].iter_mut().for_each(|row| row.line = line);
    })?;
    convict("the machine rests elsewhere", "LinuxCNC's forward", &|s| {
        s.end[axis] += 1.5 * if s.rows[0].counts.is_some() { ONE_STEP } else { AT_REST }
    })?;
    convict("nobody knows where it rests", "LinuxCNC's forward", &|s| s.end[axis] = f64::NAN)?;
    if row.counts.is_some() {
        convict("one step is lost", "steps, not", &|s| {
            s.rows[moving..]
                .iter_mut()
                .filter_map(|row| row.counts.as_mut())
                .for_each(|counts| counts[0] += 1.0)
        })?;
    }
    Ok(format!("{convicted} falsified records convicted"))
}

/// Distance from the straight line or arc of a block.
fn off_path(pose: &[f64; 9], start: &[f64; 9], end: &[f64; 9], block: &Block) -> f64 {
    let of = |letter| block.words.iter().find(|(l, _)| *l == letter).map(|(_, value)| *value);
    if let (Some(i), Some(j)) = (of('I'), of('J')) {
        let centre = [start[0] + i, start[1] + j];
        let radius = |p: &[f64; 9]| {
            let (x, y) = (p[0] - centre[0], p[1] - centre[1]);
            maths::sqrt(x * x + y * y)
        };
        let others: f64 = (2..9).map(|axis| (pose[axis] - end[axis]).abs()).fold(0.0, f64::max);
        return (radius(pose) - radius(start)).abs().max(others);
    }
    let along: f64 = (0..9).map(|axis| (end[axis] - start[axis]) * (pose[axis] - start[axis])).sum();
    let square: f64 = (0..9).map(|axis| (end[axis] - start[axis]) * (end[axis] - start[axis])).sum();
    let s = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
    let mut nearest = *start;
    for (axis, place) in nearest.iter_mut().enumerate() {
        *place += s * (end[axis] - start[axis]);
    }
    distance(pose, &nearest)
}
