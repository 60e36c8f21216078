//! The page: markup, style and scripts from `assets`, with the data of a run between them.

use crate::encode::{Bytes, html, script};
use crate::recorder::Recorded;
use crate::sample::{Sample, face};
use crate::skeleton::{Drawing, frame};
use crate::workspace::Space;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_kins::{JointKind, Pose};
use pkm_run::{JointSummary, Summary};
use serde::Serialize;
use std::fmt::Write as _;
use std::io::{self, BufRead, Write};

const PAGE: &str = include_str!("../assets/report.html");
const STYLE: &str = include_str!("../assets/report.css");
/// In the order in which they build on each other.
const SCRIPTS: &[&str] = &[
    include_str!("../assets/data.js"),
    include_str!("../assets/camera.js"),
    include_str!("../assets/scene.js"),
    include_str!("../assets/curves.js"),
    include_str!("../assets/listing.js"),
    include_str!("../assets/player.js"),
    include_str!("../assets/main.js"),
];

/// Bytes shown of a line, and of a program.
const MOST_LINE: usize = 1024;
const MOST_TEXT: usize = 64 << 20;

#[derive(Serialize)]
struct Data<'a> {
    schema: u32,
    program: &'a str,
    machine: &'a str,
    period_s: f64,
    timed: bool,
    completed: bool,
    error: f64,
    axes: Vec<Coordinate>,
    joints: Vec<Coordinate>,
    drawing: &'a Drawing,
    workspaces: &'a [Space],
    rows: Rows,
    curves: Curves,
    blocks: String,
    programmed: Corners,
    peaks: Vec<Peak>,
    findings: Vec<Finding<'a>>,
    refused: Vec<Refused>,
}

/// A joint or an axis.
#[derive(Serialize)]
struct Coordinate {
    name: String,
    unit: &'static str,
    /// Place in the pose or among the joints.
    place: usize,
    range: Option<[f64; 2]>,
    velocity: f64,
    acceleration: f64,
}

/// Little-endian arrays in base64, row after row.
#[derive(Serialize)]
struct Rows {
    count: usize,
    /// Varints: differences.
    tick: String,
    /// u8: what limits; 128 more where no path leads to the row.
    limit: String,
    /// f64: axes, mm or degrees.
    pose: String,
    /// f64: joints, mm or degrees.
    joints: String,
    /// f32: executed, then the programmed place nearest to it, both minus `pose`; NaN: none.
    executed: String,
    /// f32: velocity and acceleration of each joint over their limits; feed; singularity; deviation.
    shares: String,
    /// f32: moving points, x y z.
    points: String,
}

#[derive(Serialize)]
struct Curves {
    /// Servo periods in a stretch.
    width: u64,
    channels: usize,
    /// f32: lowest and highest of every channel, stretch after stretch.
    bounds: String,
}

#[derive(Serialize)]
struct Corners {
    count: usize,
    /// f32: axes.
    pose: String,
    /// u8: 1 begins anew, 2 rapid.
    flags: String,
}

#[derive(Serialize)]
struct Peak {
    what: &'static str,
    joint: Option<usize>,
    value: f64,
    tick: u64,
    line: u32,
}

#[derive(Serialize)]
struct Finding<'a> {
    severity: &'static str,
    code: &'a str,
    message: String,
    help: Option<&'a str>,
    line: u32,
    column: u32,
    end_column: u32,
}

#[derive(Serialize)]
struct Refused {
    line: u32,
    pose: Vec<f64>,
}

/// Writes the page.
pub(crate) fn write(
    recorded: &Recorded<'_>,
    summary: &Summary,
    text: impl BufRead,
    out: &mut impl Write,
) -> io::Result<()> {
    let data = serde_json::to_string(&data(recorded, summary)).map_err(io::Error::from)?;
    let mut rest = PAGE;
    while let Some(at) = rest.find("{{") {
        let (before, marker) = rest.split_at(at);
        let end = marker.find("}}").map_or(marker.len(), |end| end + 2);
        out.write_all(before.as_bytes())?;
        match &marker[..end] {
            "{{title}}" => out.write_all(html(&summary.program).as_bytes())?,
            "{{style}}" => out.write_all(STYLE.as_bytes())?,
            "{{verdict}}" => out.write_all(verdict(recorded, summary).as_bytes())?,
            "{{facts}}" => out.write_all(facts(recorded, summary).as_bytes())?,
            "{{data}}" => out.write_all(script(&data).as_bytes())?,
            "{{program}}" => {}
            "{{scripts}}" => {
                for file in SCRIPTS {
                    out.write_all(file.as_bytes())?;
                }
            }
            other => out.write_all(other.as_bytes())?,
        }
        rest = &marker[end..];
        if &marker[..end] == "{{program}}" {
            break;
        }
    }
    program(text, out)?;
    let (before, after) = rest.split_once("{{scripts}}").unwrap_or((rest, ""));
    out.write_all(before.as_bytes())?;
    for file in SCRIPTS {
        out.write_all(file.as_bytes())?;
    }
    out.write_all(after.as_bytes())?;
    out.flush()
}

/// The program as a JSON array of lines.
fn program(mut text: impl BufRead, out: &mut impl Write) -> io::Result<()> {
    out.write_all(b"[")?;
    let (mut line, mut shown, mut first) = (Vec::new(), 0, true);
    while shown < MOST_TEXT && next_line(&mut text, &mut line)? {
        shown += line.len();
        let json = serde_json::to_string(&*String::from_utf8_lossy(&line)).map_err(io::Error::from)?;
        out.write_all(if first { b"\n" } else { b",\n" })?;
        out.write_all(script(&json).as_bytes())?;
        first = false;
    }
    if shown >= MOST_TEXT {
        out.write_all(b",\n\"(the rest is too long to be shown)\"")?;
    }
    out.write_all(b"]")
}

/// The next line without its end, cut to [`MOST_LINE`] bytes; false at the end of the text.
fn next_line(text: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<bool> {
    line.clear();
    let mut any = false;
    loop {
        let buffer = text.fill_buf()?;
        if buffer.is_empty() {
            break;
        }
        any = true;
        let end = buffer.iter().position(|&byte| byte == b'\n');
        let piece = &buffer[..end.unwrap_or(buffer.len())];
        line.extend_from_slice(&piece[..piece.len().min(MOST_LINE - line.len())]);
        let used = piece.len() + usize::from(end.is_some());
        text.consume(used);
        if end.is_some() {
            break;
        }
    }
    if line.last() == Some(&b'\r') {
        line.pop();
    }
    Ok(any)
}

fn data<'a>(recorded: &'a Recorded<'a>, summary: &'a Summary) -> Data<'a> {
    let recorder = &recorded.recorder;
    let machine = recorder.machine;
    let axes = recorder.axes.iter().map(|&axis| {
        let limits = machine.axis(axis);
        Coordinate {
            name: axis.letter().to_string(),
            unit: if axis.is_rotary() { "°" } else { "mm" },
            place: axis as usize,
            range: limits.and_then(|l| l.range).map(|r| [face(axis, r.min), face(axis, r.max)]),
            velocity: 0.0,
            acceleration: 0.0,
        }
    });
    let joints = machine.joints.iter().enumerate().map(|(place, joint)| Coordinate {
        name: joint.name.clone(),
        unit: if joint.kind == JointKind::Rotary { "°" } else { "mm" },
        place,
        range: Some([joint.to_face(joint.range.min), joint.to_face(joint.range.max)]),
        velocity: joint.to_face(joint.max_velocity),
        acceleration: joint.to_face(joint.max_acceleration),
    });
    let peaks = recorder.peaks.iter().filter_map(|peak| {
        let sample = peak.sample.as_ref()?;
        let value = match (peak.what, peak.joint.and_then(|j| machine.joints.get(j))) {
            ("low end", Some(joint)) => joint.to_face(-peak.value),
            ("high end", Some(joint)) => joint.to_face(peak.value),
            ("singularity", _) => -peak.value,
            _ => peak.value,
        };
        let (what, joint) = (peak.what, peak.joint);
        Some(Peak { what, joint, value, tick: sample.tick, line: sample.line })
    });
    let refused = recorded.refused.iter().map(|&(line, pose)| Refused {
        line,
        pose: recorder.axes.iter().map(|&axis| face(axis, pose.get(axis))).collect(),
    });
    let mut blocks = Bytes::default();
    let mut last = (0, 0);
    for &(line, tick) in &recorder.blocks.entries {
        blocks.signed(i64::from(line) - last.0);
        blocks.varint(tick - last.1);
        last = (i64::from(line), tick);
    }
    Data {
        schema: pkm_run::SCHEMA,
        program: &summary.program,
        machine: &summary.machine,
        period_s: recorder.period_s,
        timed: recorded.timed,
        completed: summary.completed,
        error: recorded.error,
        axes: axes.collect(),
        joints: joints.collect(),
        drawing: &recorder.drawing,
        workspaces: &recorder.workspaces,
        rows: rows(recorded),
        curves: curves(recorded),
        blocks: blocks.base64(),
        programmed: corners(recorded),
        peaks: peaks.collect(),
        findings: summary.diagnostics.iter().map(|finding| shown(finding, &summary.program)).collect(),
        refused: refused.collect(),
    }
}

/// A finding at its line of the program; one in the file of a subroutine at the line that called it.
fn shown<'a>(diagnostic: &'a Diagnostic, program: &str) -> Finding<'a> {
    let own = diagnostic.file == program;
    let call = diagnostic.notes.iter().find(|note| note.file == program);
    let (line, column, end_column) = match call {
        Some(note) if !own => (note.line, note.column, note.end_column),
        _ if own => (diagnostic.line, diagnostic.column, diagnostic.end_column),
        _ => (0, 0, 0),
    };
    let elsewhere = if own { String::new() } else { format!("{}:{}: ", diagnostic.file, diagnostic.line) };
    Finding {
        severity: severity(diagnostic),
        code: &diagnostic.code,
        message: elsewhere + &diagnostic.message,
        help: diagnostic.help.as_deref(),
        line,
        column,
        end_column,
    }
}

fn severity(diagnostic: &Diagnostic) -> &'static str {
    match diagnostic.severity {
        Severity::Note => "note",
        Severity::Warning => "warning",
        Severity::Error => "error",
    }
}

fn rows(recorded: &Recorded<'_>) -> Rows {
    let recorder = &recorded.recorder;
    let machine = recorder.machine;
    let [mut ticks, mut limits, mut poses, mut joints, mut executed, mut shares, mut points] =
        [(); 7].map(|()| Bytes::default());
    let (mut last, mut moving) = (0, Vec::new());
    for row in &recorded.rows {
        ticks.varint(row.tick - last);
        last = row.tick;
        limits.u8(row.limit | if row.jump { 0x80 } else { 0 });
        for &axis in &recorder.axes {
            poses.f64(face(axis, row.pose.get(axis)));
        }
        for (joint, value) in machine.joints.iter().zip(row.joints) {
            joints.f64(joint.to_face(value));
        }
        let off = |pose: Option<Pose>, bytes: &mut Bytes| {
            for &axis in &recorder.axes {
                bytes.f32(pose.map_or(f64::NAN, |p| face(axis, p.get(axis) - row.pose.get(axis))));
            }
        };
        off(row.executed.map(|(executed, _)| executed), &mut executed);
        off(row.executed.map(|(_, nearest)| nearest), &mut executed);
        for share in row.shares.iter().take(machine.joints.len()).flatten() {
            shares.f32(*share);
        }
        for value in [row.feed, row.singularity, row.deviation_mm] {
            shares.f32(value);
        }
        draw(recorded, row, &mut moving);
        for value in moving.iter().flatten() {
            points.f32(*value);
        }
    }
    Rows {
        count: recorded.rows.len(),
        tick: ticks.base64(),
        limit: limits.base64(),
        pose: poses.base64(),
        joints: joints.base64(),
        executed: executed.base64(),
        shares: shares.base64(),
        points: points.base64(),
    }
}

fn draw(recorded: &Recorded<'_>, row: &Sample, moving: &mut Vec<pkm_kins::Vec3>) {
    let machine = recorded.recorder.machine;
    frame(machine, &machine.mechanism, &row.joints, &row.pose, moving);
}

fn curves(recorded: &Recorded<'_>) -> Curves {
    let envelope = &recorded.recorder.envelope;
    let mut bounds = Bytes::default();
    if recorded.timed {
        for (low, high) in envelope.low.iter().zip(&envelope.high) {
            bounds.f32(*low);
            bounds.f32(*high);
        }
    }
    let channels = 3 * recorded.recorder.machine.joints.len() + 3;
    Curves { width: envelope.width, channels, bounds: bounds.base64() }
}

fn corners(recorded: &Recorded<'_>) -> Corners {
    let (mut pose, mut flags) = (Bytes::default(), Bytes::default());
    for corner in &recorded.corners {
        for &axis in &recorded.recorder.axes {
            pose.f32(face(axis, corner.pose.get(axis)));
        }
        flags.u8(u8::from(corner.start) + 2 * u8::from(corner.rapid));
    }
    Corners { count: recorded.corners.len(), pose: pose.base64(), flags: flags.base64() }
}

/// m:ss.s or s
fn duration(seconds: f64) -> String {
    let minutes = (seconds / 60.0).floor();
    match minutes {
        m if m < 1.0 => format!("{seconds:.2} s"),
        m => format!("{m:.0} min {:.1} s", seconds - 60.0 * m),
    }
}

/// One line: did it work, how long, where is it tight.
fn verdict(recorded: &Recorded<'_>, summary: &Summary) -> String {
    let mut parts = Vec::new();
    let count = |n: usize, one: &str| match n {
        1 => format!("1 {one}"),
        n => format!("{n} {one}s"),
    };
    let errors = summary.diagnostics.iter().filter(|d| d.severity == Severity::Error).count();
    parts.push(match (summary.completed, recorded.timed) {
        (true, _) => "<b class=good>✔ runs</b>".to_owned(),
        (false, true) => "<b class=bad>✘ stopped on the way</b>".to_owned(),
        (false, false) => "<b class=bad>✘ refused, nothing moved</b>".to_owned(),
    });
    if recorded.timed {
        parts.push(duration(summary.duration_s));
        let machine = recorded.recorder.machine;
        let tight = recorded.recorder.peaks.iter().filter(|p| matches!(p.what, "velocity" | "acceleration"));
        let tightest = tight.fold(None, |best: Option<&crate::recorder::Peak>, peak| match best {
            Some(known) if known.value >= peak.value => best,
            _ => Some(peak),
        });
        if let Some((peak, sample)) = tightest.and_then(|peak| Some((peak, peak.sample.as_ref()?)))
            && peak.value > 0.0
        {
            let name = peak.joint.and_then(|j| machine.joints.get(j)).map_or("?", |joint| &joint.name);
            parts.push(format!(
                "closest to a limit: <a href=\"#tick={}\">{}, {:.0} % of its {} at line {}</a>",
                sample.tick,
                html(name),
                100.0 * peak.value,
                peak.what,
                sample.line
            ));
        }
    } else if let Some(first) = summary.diagnostics.iter().find(|d| d.severity == Severity::Error) {
        parts.push(format!("line {}: {}", first.line, html(&first.message)));
    }
    parts.push(if errors > 0 {
        format!("{}, {}", count(errors, "error"), count(summary.diagnostics.len(), "finding"))
    } else {
        count(summary.diagnostics.len(), "finding")
    });
    parts.join(" <span aria-hidden=true>·</span> ")
}

/// The table of joints and how the page came about, readable without a script.
fn facts(recorded: &Recorded<'_>, summary: &Summary) -> String {
    let machine = recorded.recorder.machine;
    let mut text = String::from(
        "<table><caption>Joints</caption><thead><tr><th scope=col>joint<th scope=col>from<th scope=col>to\
         <th scope=col>travel<th scope=col>peak velocity<th scope=col>limit<th scope=col>peak acceleration\
         <th scope=col>limit<th scope=col>steps<th scope=col>shortest pulse interval</thead><tbody>\n",
    );
    for (joint, limits) in summary.joints.iter().zip(&machine.joints) {
        let unit = if limits.kind == JointKind::Rotary { "°" } else { "mm" };
        let JointSummary { min, max, peak_velocity, peak_acceleration, .. } = joint;
        let _ = writeln!(
            text,
            "<tr><th scope=row>{}<td>{min:.3} {unit}<td>{max:.3} {unit}<td>{} to {} {unit}<td>{peak_velocity:.3} {unit}/s\
             <td>{}<td>{peak_acceleration:.2} {unit}/s²<td>{}<td>{}<td>{} ns</tr>",
            html(&joint.name),
            limits.to_face(limits.range.min),
            limits.to_face(limits.range.max),
            joint.velocity_limit,
            joint.acceleration_limit,
            joint.steps,
            joint.min_pulse_interval_ns
        );
    }
    text.push_str("</tbody></table>\n<dl>");
    let mut fact = |name: &str, value: String| {
        let _ = writeln!(text, "<div><dt>{name}<dd>{}</div>", html(&value));
    };
    fact("program", format!("{}, {} blocks", summary.program, summary.blocks));
    fact("machine", format!("{}: {}", machine.name, machine.description));
    if !machine.source.is_empty() {
        fact("source", machine.source.clone());
    }
    if recorded.timed {
        fact("path", format!("{:.3} mm in {:.3} s", summary.path_length_mm, summary.duration_s));
        fact(
            "deviation",
            format!(
                "at most {:.6} mm between the path rebuilt from the step edges and the programmed one; half a step of every \
                 joint reaches {:.6} mm",
                summary.max_path_deviation_mm, summary.half_step_reach_mm
            ),
        );
        fact(
            "nearest singularity",
            format!(
                "{:.4} at line {}, joint {}",
                summary.min_singularity_distance,
                summary.closest_approach.line,
                summary.closest_approach.joint
            ),
        );
        fact("driver timing", format!("{} violations", summary.driver_timing_violations));
    }
    fact(
        "how it was computed",
        if recorded.timed {
            format!(
                "every {} ms on the simulated machine, {} periods, of which {} are kept here; between them the machine is within \
                 {} mm (or degrees) of what is drawn, the curves keep every extreme",
                machine.servo_period_ns as f64 / 1e6,
                summary.servo_ticks,
                recorded.rows.len(),
                if recorded.error.is_finite() {
                    format!("{:.3}", recorded.error)
                } else {
                    "an unknown number of".into()
                }
            )
        } else {
            "the program was checked and refused; the machine is drawn along the programmed path, wherever it has a pose".into()
        },
    );
    text.push_str("</dl>");
    text
}
