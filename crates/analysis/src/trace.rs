//! What a run was, small enough to draw: every column of a trace as an envelope of at most a few hundred pieces, the path with the
//! extremes of every piece kept. Memory does not grow with the rows.

use pkm_kins::Vec2;
use std::fmt;
use std::io::Read;

/// Pieces of an envelope, and of a path, when they are joined in pairs.
const MOST_PIECES: usize = 512;
const MOST_PATH_PIECES: usize = 2048;

/// Smallest and largest value of a column over pieces of equally many rows, each with its time.
#[derive(Debug, Clone, Default)]
pub struct Envelope {
    /// [time, value] of the smallest and of the largest.
    pieces: Vec<[Vec2; 2]>,
    stride: u64,
    rows: u64,
}

/// The extremes of both; of equal ones the earlier.
fn joined(first: &[Vec2; 2], second: &[Vec2; 2]) -> [Vec2; 2] {
    let low = if second[0][1] < first[0][1] { second[0] } else { first[0] };
    let high = if second[1][1] > first[1][1] { second[1] } else { first[1] };
    [low, high]
}

impl Envelope {
    fn push(&mut self, time_s: f64, value: f64) {
        self.stride = self.stride.max(1);
        let row = [[time_s, value]; 2];
        if self.rows.is_multiple_of(self.stride) && self.pieces.len() == MOST_PIECES {
            let pairs = self.pieces.chunks(2);
            self.pieces = pairs.map(|pair| joined(&pair[0], &pair[pair.len() - 1])).collect();
            self.stride *= 2;
        }
        match self.pieces.last_mut() {
            Some(last) if !self.rows.is_multiple_of(self.stride) => *last = joined(last, &row),
            _ => self.pieces.push(row),
        }
        self.rows += 1;
    }

    /// A line through both extremes of every piece, each at its time.
    pub fn line(&self) -> Vec<Vec2> {
        let mut line: Vec<Vec2> = Vec::new();
        for &[low, high] in &self.pieces {
            line.extend(if low[0] <= high[0] { [low, high] } else { [high, low] });
        }
        line.dedup();
        line
    }

    /// Smallest and largest value.
    pub fn range(&self) -> Option<[f64; 2]> {
        let mut pieces = self.pieces.iter();
        let first = pieces.next()?;
        let all = pieces.fold(*first, |all, piece| joined(&all, piece));
        Some(all.map(|[_, value]| value))
    }
}

/// A path in two coordinates: of every piece the first point and the four extremes.
#[derive(Debug, Clone, Default)]
pub struct Path {
    pieces: Vec<Vec<Vec2>>,
    stride: u64,
    rows: u64,
}

/// The first point and the extremes, in their order.
fn reduced(points: &[Vec2]) -> Vec<Vec2> {
    let best = |key: fn(&Vec2) -> f64| {
        (0..points.len()).min_by(|&a, &b| key(&points[a]).total_cmp(&key(&points[b]))).unwrap_or(0)
    };
    let mut keep = vec![0, best(|p| p[0]), best(|p| -p[0]), best(|p| p[1]), best(|p| -p[1])];
    keep.sort_unstable();
    keep.dedup();
    keep.into_iter().filter_map(|index| points.get(index).copied()).collect()
}

impl Path {
    fn push(&mut self, point: Vec2) {
        self.stride = self.stride.max(1);
        if self.rows.is_multiple_of(self.stride) && self.pieces.len() == MOST_PATH_PIECES {
            self.pieces = self.pieces.chunks(2).map(|pair| reduced(&pair.concat())).collect();
            self.stride *= 2;
        }
        if self.rows.is_multiple_of(self.stride) {
            self.pieces.push(vec![point]);
        } else if let Some(piece) = self.pieces.last_mut() {
            piece.push(point);
            if piece.len() > 64 {
                *piece = reduced(piece);
            }
        }
        self.rows += 1;
    }

    /// Its points; those that repeat are left out.
    pub fn line(&self) -> Vec<Vec2> {
        let mut line: Vec<Vec2> = self.pieces.iter().flat_map(|piece| reduced(piece)).collect();
        line.dedup();
        line
    }
}

/// One joint over time; mm or degrees, and seconds.
#[derive(Debug, Clone, Default)]
pub struct JointCurves {
    /// For a legend.
    pub name: String,
    /// `mm` or `deg`
    pub unit: String,
    /// Commanded position.
    pub position: Envelope,
    /// First difference over the time between rows.
    pub velocity: Envelope,
    /// Second difference.
    pub acceleration: Envelope,
    last: Option<(f64, f64, Option<f64>)>,
}

/// A trace, reduced.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Rows seen.
    pub rows: u64,
    /// From the first to the last row.
    pub duration_s: f64,
    /// Coordinates by letter and unit.
    pub axes: Vec<(char, String)>,
    /// In joint order.
    pub joints: Vec<JointCurves>,
    /// Pairs of axes (numbers in `axes`) with the path in them.
    pub paths: Vec<([usize; 2], Path)>,
    moved: bool,
    start: Vec<f64>,
    first_s: f64,
}

/// Why a trace cannot be drawn.
#[derive(Debug)]
pub enum TraceError {
    /// It cannot be read as CSV.
    Csv(csv::Error),
    /// No columns of a trace.
    Header {
        /// What is missing.
        missing: &'static str,
    },
    /// A field that is no number.
    Field {
        /// Row, 1 for the first after the header.
        row: u64,
        /// Name of the column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// Time stands still or runs back.
    Time {
        /// Row, 1 for the first after the header.
        row: u64,
    },
    /// No row.
    Empty,
}

impl fmt::Display for TraceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Csv(error) => write!(f, "not a table: {error}"),
            Self::Header { missing } => write!(f, "not a trace: the header has no column {missing}"),
            Self::Field { row, column, text } => {
                write!(f, "row {row}, column {column}: `{text}` is not a number")
            }
            Self::Time { row } => write!(f, "row {row}: time_s is not later than in the row before"),
            Self::Empty => f.write_str("the trace has no rows"),
        }
    }
}

impl std::error::Error for TraceError {}

impl Trace {
    /// An empty trace; letters with units, joint names with units.
    pub fn new(axes: Vec<(char, String)>, joints: Vec<(String, String)>) -> Self {
        let find = |letter: char| axes.iter().position(|(axis, _)| *axis == letter);
        let pairs = [('X', 'Y'), ('U', 'V'), ('X', 'Z'), ('U', 'W')];
        let paths =
            pairs.into_iter().filter_map(|(a, b)| Some(([find(a)?, find(b)?], Path::default()))).collect();
        let joints = joints
            .into_iter()
            .map(|(name, unit)| JointCurves { name, unit, ..JointCurves::default() })
            .collect();
        Self { axes, joints, paths, ..Self::default() }
    }

    /// True if any coordinate or joint changed.
    pub fn moved(&self) -> bool {
        self.moved
    }

    /// Adds a row: time, coordinates and joints in the order of [`Trace::new`]; mm or degrees.
    pub fn push(&mut self, time_s: f64, axes: &[f64], joints: &[f64]) {
        if self.rows == 0 {
            self.start = axes.iter().chain(joints).copied().collect();
            self.first_s = time_s;
        }
        self.moved |= axes.iter().chain(joints).zip(&self.start).any(|(now, start)| now != start);
        self.rows += 1;
        self.duration_s = time_s - self.first_s;
        for ([a, b], path) in &mut self.paths {
            if let (Some(&x), Some(&y)) = (axes.get(*a), axes.get(*b)) {
                path.push([x, y]);
            }
        }
        for (curves, &q) in self.joints.iter_mut().zip(joints) {
            curves.position.push(time_s, q);
            let mut velocity = None;
            if let Some((before_s, before, rate)) = curves.last {
                let dt = time_s - before_s;
                let now = (q - before) / dt;
                curves.velocity.push(time_s, now);
                if let Some(rate) = rate {
                    curves.acceleration.push(time_s, (now - rate) / dt);
                }
                velocity = Some(now);
            }
            curves.last = Some((time_s, q, velocity));
        }
    }

    /// Reads a `trace.csv` as a stream.
    ///
    /// # Errors
    /// See [`TraceError`].
    pub fn read(input: impl Read) -> Result<Self, TraceError> {
        let mut reader = csv::ReaderBuilder::new().from_reader(input);
        let header = reader.headers().map_err(TraceError::Csv)?.clone();
        let mut axes = Vec::new();
        let mut joints = Vec::new();
        let (mut axis_columns, mut joint_columns, mut time) = (Vec::new(), Vec::new(), None);
        for (column, name) in header.iter().enumerate() {
            let parts: Vec<&str> = name.split('.').collect();
            let unit = |last: &str| last.strip_prefix("pos-cmd_").map(str::to_owned);
            match parts[..] {
                ["time_s"] => time = Some(column),
                ["axis", letter, last] => {
                    if let (Some(unit), Some(letter)) = (unit(last), letter.chars().next()) {
                        axes.push((letter.to_ascii_uppercase(), unit));
                        axis_columns.push(column);
                    }
                }
                ["joint", number, last] => {
                    if let Some(unit) = unit(last) {
                        joints.push((format!("joint {number}"), unit));
                        joint_columns.push(column);
                    }
                }
                _ => {}
            }
        }
        let time = time.ok_or(TraceError::Header { missing: "time_s" })?;
        if joints.is_empty() {
            return Err(TraceError::Header { missing: "joint.0.pos-cmd_mm" });
        }
        let mut trace = Self::new(axes, joints);
        let mut record = csv::StringRecord::new();
        let (mut poses, mut positions) = (Vec::new(), Vec::new());
        let mut before_s = f64::NEG_INFINITY;
        while reader.read_record(&mut record).map_err(TraceError::Csv)? {
            let row = trace.rows + 1;
            let number = |column: usize| {
                let text = record.get(column).unwrap_or("");
                match text.parse::<f64>() {
                    Ok(value) if value.is_finite() => Ok(value),
                    _ => {
                        let column = header.get(column).unwrap_or("").to_owned();
                        Err(TraceError::Field { row, column, text: text.chars().take(40).collect() })
                    }
                }
            };
            let time_s = number(time)?;
            if !(time_s > before_s) {
                return Err(TraceError::Time { row });
            }
            before_s = time_s;
            poses.clear();
            positions.clear();
            for &column in &axis_columns {
                poses.push(number(column)?);
            }
            for &column in &joint_columns {
                positions.push(number(column)?);
            }
            trace.push(time_s, &poses, &positions);
        }
        if trace.rows == 0 { Err(TraceError::Empty) } else { Ok(trace) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A million rows with one spike: few pieces, the spike and the ends are kept.
    #[test]
    fn extremes_survive_and_memory_does_not_grow() {
        let mut trace =
            Trace::new(vec![('X', "mm".into()), ('Y', "mm".into())], vec![("p1".into(), "mm".into())]);
        for k in 0..1_000_000_u32 {
            let x = f64::from(k % 1000);
            let spike = if k == 777_777 { 5e3 } else { 0.0 };
            trace.push(f64::from(k) * 1e-3, &[x, spike], &[x * 0.5 + spike]);
        }
        let joint = &trace.joints[0];
        assert!(joint.position.pieces.len() <= MOST_PIECES);
        assert_eq!(joint.position.range().unwrap()[1], 5e3 + 777.0 * 0.5);
        let line = joint.position.line();
        assert!(line.len() <= 2 * MOST_PIECES && line.iter().any(|p| p[1] > 5e3));
        assert!(line.is_sorted_by(|a, b| a[0] <= b[0]));
        let path = trace.paths[0].1.line();
        assert!(path.len() <= 5 * MOST_PATH_PIECES && path.contains(&[777.0, 5e3]));
        let stored: usize = trace.paths[0].1.pieces.iter().map(Vec::len).sum();
        assert!(stored <= 64 * MOST_PATH_PIECES, "{stored}");
    }

    /// However many rows are joined, a steady motion is a straight line and not a staircase.
    #[test]
    fn a_straight_line_stays_straight() {
        let mut trace = Trace::new(vec![('X', "mm".into())], vec![("p1".into(), "mm".into())]);
        for k in 0..10_000_u32 {
            let t = f64::from(k) * 1e-3;
            trace.push(t, &[t], &[5.0 - 2.0 * t]);
        }
        let line = trace.joints[0].position.line();
        assert!(line.len() > MOST_PIECES && line[0] == [0.0, 5.0]);
        assert_eq!(line.last(), Some(&[9.999, 5.0 - 2.0 * 9.999]));
        for [t, q] in line {
            assert!((q - (5.0 - 2.0 * t)).abs() < 1e-12, "{t}: {q}");
        }
    }

    #[test]
    fn what_is_no_trace_is_told_so() {
        let read = |text: &str| Trace::read(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(read("a,b\n1,2\n"), "not a trace: the header has no column time_s");
        let header = "tick,time_s,line,axis.x.pos-cmd_mm,joint.0.pos-cmd_mm,joint.0.pos-fb_mm\n";
        assert_eq!(read(header), "the trace has no rows");
        let row = format!("{header}0,0,1,0,nan,0\n");
        assert_eq!(read(&row), "row 1, column joint.0.pos-cmd_mm: `nan` is not a number");
        let row = format!("{header}0,0,1,0,0,0\n1,0,1,0,0,0\n");
        assert_eq!(read(&row), "row 2: time_s is not later than in the row before");
        assert!(read(&format!("{header}0,0\n")).starts_with("not a table"));
    }
}
