//! `pkm kins`: pose to joints and back, one JSON line out for each JSON line in.

use crate::cli::{Kins, KinsArgs};
use crate::outcome::{Failure, Outcome};
use pkm_kins::{Axis, Joints, Kinematics, MAX_JOINTS, Pose, maths};
use pkm_machine::{Machine, Refusal};
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader, BufWriter, Write, stdin, stdout};

/// A pose as written: mm and degrees.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct PoseJson {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    z: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    a: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    b: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    c: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    u: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    v: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    w: Option<f64>,
    /// Only in queries.
    #[serde(default, skip_serializing_if = "is_false")]
    branches: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde asks for it
fn is_false(flag: &bool) -> bool {
    !*flag
}

/// Joint positions as written: mm and degrees.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointsJson {
    joints: Vec<f64>,
    seed: Option<PoseJson>,
    #[serde(default)]
    branches: bool,
}

/// One line of the answer.
#[derive(Debug, Default, Serialize)]
struct Answer {
    #[serde(skip_serializing_if = "Option::is_none")]
    joints: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<PoseJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    inverse_jacobian: Option<Vec<Vec<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    determinant: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    condition: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    branches: Option<Vec<Answer>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ErrorJson>,
}

#[derive(Debug, Serialize)]
struct ErrorJson {
    code: String,
    joint: Option<String>,
    message: String,
}

/// What may go wrong with one line.
enum Refused {
    /// The machine says no.
    Machine(Refusal),
    /// The line is not a question.
    Line(String),
}

impl From<Refusal> for Refused {
    fn from(refusal: Refusal) -> Self {
        Self::Machine(refusal)
    }
}

impl From<serde_json::Error> for Refused {
    fn from(error: serde_json::Error) -> Self {
        Self::Line(format!("{error}; one JSON object a line, as `pkm kins --help` shows"))
    }
}

impl From<Refused> for ErrorJson {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::Machine(Refusal { code, joint, message }) => Self { code, joint, message },
            Refused::Line(message) => Self { code: "bad_input".into(), joint: None, message },
        }
    }
}

pub(crate) fn run(command: &Kins) -> Result<Outcome, Failure> {
    let (Kins::Inverse(arguments) | Kins::Forward(arguments) | Kins::Jacobian(arguments)) = command;
    let query = Query::new(arguments)?;
    let answer = |line: &str| match command {
        Kins::Inverse(_) => query.inverse(line),
        Kins::Forward(_) => query.forward(line),
        Kins::Jacobian(_) => query.jacobian(line),
    };
    let mut input = BufReader::new(stdin().lock());
    let mut output = BufWriter::new(stdout().lock());
    let mut outcome = Outcome::Clean;
    let mut line = Vec::new();
    loop {
        line.clear();
        let read = input.read_until(b'\n', &mut line).map_err(|error| {
            Failure::could_not("input", "-", format!("cannot read standard input: {error}"), "")
        })?;
        if read == 0 {
            break;
        }
        let text = String::from_utf8_lossy(&line);
        if text.trim().is_empty() {
            continue;
        }
        let answer = answer(text.trim()).unwrap_or_else(|refused| {
            outcome = Outcome::No;
            Answer { error: Some(refused.into()), ..Answer::default() }
        });
        serde_json::to_writer(&mut output, &answer).map_err(std::io::Error::from)?;
        output.write_all(b"\n")?;
        // Whoever waits for an answer gets it before the next question.
        if input.buffer().is_empty() {
            output.flush()?;
        }
    }
    output.flush()?;
    Ok(outcome)
}

/// A machine to be asked.
struct Query {
    machine: Machine,
    no_limits: bool,
}

impl Query {
    fn new(arguments: &KinsArgs) -> Result<Self, Failure> {
        let mut machine = Machine::load(&arguments.machine.machine, &arguments.machine.set)?;
        if arguments.no_limits {
            machine.mechanism = machine.mechanism.without_limits();
        }
        Ok(Self { machine, no_limits: arguments.no_limits })
    }

    fn inverse(&self, line: &str) -> Result<Answer, Refused> {
        let query: PoseJson = serde_json::from_str(line)?;
        let pose = self.pose(&query)?;
        let mechanism = &self.machine.mechanism;
        if query.branches {
            let branches =
                mechanism.inverse_branches(&pose).map_err(|error| self.machine.refused_pose(&error))?;
            let branches = branches.as_slice().iter().map(|joints| Answer {
                joints: Some(self.face(joints)),
                error: self.check(joints).err().map(ErrorJson::from),
                ..Answer::default()
            });
            return Ok(Answer { branches: Some(branches.collect()), ..Answer::default() });
        }
        let joints = mechanism.inverse(&pose).map_err(|error| self.machine.refused_pose(&error))?;
        self.check(&joints)?;
        Ok(Answer { joints: Some(self.face(&joints)), ..Answer::default() })
    }

    fn forward(&self, line: &str) -> Result<Answer, Refused> {
        let query: JointsJson = serde_json::from_str(line)?;
        let joints = self.joints(&query.joints)?;
        let seed = query.seed.map_or(Ok(self.machine.home), |seed| self.pose(&seed))?;
        let mechanism = &self.machine.mechanism;
        if query.branches {
            let branches = mechanism
                .forward_branches(&joints, &seed)
                .map_err(|error| self.machine.refused_joints(&error))?;
            self.check(&joints)?;
            let branches = branches
                .as_slice()
                .iter()
                .map(|pose| Answer { pose: Some(self.pose_json(pose)), ..Answer::default() });
            return Ok(Answer { branches: Some(branches.collect()), ..Answer::default() });
        }
        let pose = mechanism.forward(&joints, &seed).map_err(|error| self.machine.refused_joints(&error))?;
        self.check(&joints)?;
        Ok(Answer { pose: Some(self.pose_json(&pose)), ..Answer::default() })
    }

    fn jacobian(&self, line: &str) -> Result<Answer, Refused> {
        let query: PoseJson = serde_json::from_str(line)?;
        if query.branches {
            return Err(Refused::Line("`branches` has no meaning for a Jacobian".into()));
        }
        let pose = self.pose(&query)?;
        let mechanism = &self.machine.mechanism;
        let refuse = |error| self.machine.refused_pose(&error);
        let joints = mechanism.inverse(&pose).map_err(refuse)?;
        self.check(&joints)?;
        let full = mechanism.jacobian(&pose).map_err(refuse)?;
        let columns: Vec<usize> = mechanism.axes().iter().map(|axis| axis as usize).collect();
        let rows: Vec<Vec<f64>> = full
            .iter()
            .take(mechanism.joint_count())
            .map(|row| columns.iter().map(|&column| row[column]).collect())
            .collect();
        let dexterity = mechanism.dexterity(&pose).map_err(refuse)?;
        Ok(Answer {
            joints: Some(self.face(&joints)),
            determinant: Some(dexterity.determinant),
            // Infinite at a direct singularity: JSON has no number for that, the key is then absent.
            condition: Some(dexterity.condition).filter(|condition| condition.is_finite()),
            inverse_jacobian: Some(rows),
            ..Answer::default()
        })
    }

    /// The travel of the joints, unless geometry alone is asked for.
    fn check(&self, joints: &Joints) -> Result<(), Refused> {
        if self.no_limits { Ok(()) } else { Ok(self.machine.check_travel(joints)?) }
    }

    /// A pose in mm and radians. Coordinates that the machine does not have must be 0.
    fn pose(&self, written: &PoseJson) -> Result<Pose, Refused> {
        let PoseJson { x, y, z, a, b, c, u, v, w, branches: _ } = *written;
        let mut pose = Pose::ZERO;
        for (axis, value) in Axis::ALL.into_iter().zip([x, y, z, a, b, c, u, v, w]) {
            let value = value.unwrap_or(0.0);
            if value != 0.0 && !self.machine.mechanism.axes().contains(axis) {
                return Err(Refused::Line(format!("the machine has no axis {}", axis.letter())));
            }
            pose.set(axis, if axis.is_rotary() { maths::radians(value) } else { value });
        }
        Ok(pose)
    }

    /// A pose in mm and degrees: the coordinates that the machine has.
    fn pose_json(&self, pose: &Pose) -> PoseJson {
        let axes = self.machine.mechanism.axes();
        let [x, y, z, a, b, c, u, v, w] = Axis::ALL.map(|axis| {
            let value = pose.get(axis);
            axes.contains(axis).then(|| if axis.is_rotary() { maths::degrees(value) } else { value })
        });
        PoseJson { x, y, z, a, b, c, u, v, w, branches: false }
    }

    /// Joint positions in mm and radians.
    fn joints(&self, written: &[f64]) -> Result<Joints, Refused> {
        let count = self.machine.joints.len();
        if written.len() != count {
            return Err(Refused::Line(format!("joints: {} given, the machine has {count}", written.len())));
        }
        let mut joints = [0.0; MAX_JOINTS];
        for ((joint, &value), machine) in joints.iter_mut().zip(written).zip(&self.machine.joints) {
            *joint = machine.from_face(value);
        }
        Ok(joints)
    }

    /// Joint positions in mm and degrees.
    fn face(&self, joints: &Joints) -> Vec<f64> {
        self.machine.joints.iter().zip(joints).map(|(machine, &joint)| machine.to_face(joint)).collect()
    }
}
