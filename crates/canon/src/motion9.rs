//! What moves, in nine axes: one command a line, `LINE COMMAND(arguments)`, lengths in mm, angles in degrees, six decimals.
//! Everything that does not move, place or pause the tool is left out; so is all that comes before the first block.

use crate::buffer::Buffer;
use crate::text::LineOutput;
use crate::{Canon, CanonSink, LengthUnit, Plane, Position, Span};

/// Decimals of every number.
const DECIMALS: u32 = 6;

/// Writes the motion commands of a program.
pub struct Motion9Writer<O> {
    output: O,
    line: Buffer,
    plane: Plane,
    units: LengthUnit,
}

impl<O: LineOutput> Motion9Writer<O> {
    /// A writer for a program that begins in mm.
    pub fn new(output: O) -> Self {
        Self { output, line: Buffer::new(), plane: Plane::Xy, units: LengthUnit::Mm }
    }

    /// The coordinates in mm and degrees.
    fn nine(&self, position: &Position) -> [f64; 9] {
        let mm = self.units.mm();
        let Position { x, y, z, a, b, c, u, v, w } = *position;
        [x * mm, y * mm, z * mm, a, b, c, u * mm, v * mm, w * mm]
    }

    fn call(&mut self, name: &str, first: Option<i32>, values: &[f64]) {
        self.line.put(name.as_bytes());
        self.line.put(b"(");
        if let Some(first) = first {
            self.line.integer(first.into());
        }
        for (i, value) in values.iter().enumerate() {
            if i > 0 || first.is_some() {
                self.line.put(b", ");
            }
            self.line.number::<DECIMALS>(*value);
        }
        self.line.put(b")");
    }

    /// End point in the plane, centre, turns, end point along the plane's normal, then the other six axes.
    fn arc(&mut self, end: &Position, centre: [f64; 2], turns: i32) {
        let [x, y, z, others @ ..] = self.nine(end);
        let (first, second, normal) = match self.plane {
            Plane::Xz | Plane::Uw => (z, x, y),
            Plane::Yz | Plane::Vw => (y, z, x),
            Plane::Xy | Plane::Uv => (x, y, z),
        };
        let [first_centre, second_centre] = centre.map(|value| value * self.units.mm());
        self.line.put(b"ARC_FEED(");
        for value in [first, second, first_centre, second_centre] {
            self.line.number::<DECIMALS>(value);
            self.line.put(b", ");
        }
        self.line.integer(turns.into());
        for value in core::iter::once(normal).chain(others) {
            self.line.put(b", ");
            self.line.number::<DECIMALS>(value);
        }
        self.line.put(b")");
    }

    /// False for what is left out.
    fn write(&mut self, command: &Canon<'_>) -> bool {
        match *command {
            Canon::StraightTraverse(end) => self.call("STRAIGHT_TRAVERSE", None, &self.nine(&end)),
            Canon::StraightFeed(end) => self.call("STRAIGHT_FEED", None, &self.nine(&end)),
            Canon::StraightProbe { end, .. } => self.call("STRAIGHT_PROBE", None, &self.nine(&end)),
            Canon::ArcFeed { end, first_centre, second_centre, turns } => {
                self.arc(&end, [first_centre, second_centre], turns);
            }
            Canon::SetG5xOffset { system, offset } => {
                self.call("SET_G5X_OFFSET", Some(system), &self.nine(&offset));
            }
            Canon::SetG92Offset(offset) => self.call("SET_G92_OFFSET", None, &self.nine(&offset)),
            Canon::UseToolLengthOffset(offset) => {
                self.call("USE_TOOL_LENGTH_OFFSET", None, &self.nine(&offset));
            }
            Canon::SetXyRotation(degrees) => self.call("SET_XY_ROTATION", None, &[degrees]),
            Canon::Dwell(seconds) => self.call("DWELL", None, &[seconds]),
            Canon::SetFeedRate(rate) => self.call("SET_FEED_RATE", None, &[rate * self.units.mm()]),
            Canon::SelectPlane(plane) => self.line.put(match plane {
                Plane::Xy => b"SELECT_PLANE(XY)",
                Plane::Yz => b"SELECT_PLANE(YZ)",
                Plane::Xz => b"SELECT_PLANE(XZ)",
                Plane::Uv => b"SELECT_PLANE(UV)",
                Plane::Vw => b"SELECT_PLANE(VW)",
                Plane::Uw => b"SELECT_PLANE(UW)",
            }),
            Canon::ChangeTool { tool, .. } => self.call("CHANGE_TOOL", Some(tool), &[]),
            Canon::RigidTap { end, .. } => {
                let [x, y, z, ..] = self.nine(&end);
                self.call("RIGID_TAP", None, &[x, y, z]);
            }
            Canon::Message(text) => {
                self.line.put(b"MESSAGE(\"");
                self.line.put(text.0);
                self.line.put(b"\")");
            }
            Canon::UserM { number, p, q } => self.call("USER_M", Some(number), &[p, q]),
            _ => return false,
        }
        true
    }
}

impl<O: LineOutput> CanonSink for Motion9Writer<O> {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        match command {
            Canon::SelectPlane(plane) => self.plane = *plane,
            Canon::UseLengthUnits(units) => self.units = *units,
            _ => {}
        }
        if span.line == 0 {
            return;
        }
        self.line.clear();
        self.line.padded(span.line.into(), 1);
        self.line.put(b" ");
        if self.write(command) {
            self.line.put(b"\n");
            self.output.line(self.line.as_bytes());
        }
    }
}
