//! What is drawn of a machine: points and parts, from the mechanism's own geometry.
//!
//! One function per mechanism draws it at given joints and pose, in the frame its file states. The same function names the
//! parts once and gives the moving points for every frame, so that the two cannot part.

mod cartesian;
mod hexapod;
mod hv_mill;
mod lambda6;
mod linear_delta;
mod moma_w;
mod ox_glide;
mod planar;

pub(crate) use hv_mill::plane as hv_plane;

use pkm_kins::{Joints, Mechanism, Pose, Vec3};
use pkm_machine::Machine;
use serde::{Serialize, Serializer};

/// A point of the drawing: a fixed one, or one that moves with the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Point {
    Fixed(u16),
    Moving(u16),
}

/// Moving points count from 0, fixed ones from −1 downwards.
impl Serialize for Point {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_i32(match *self {
            Self::Fixed(n) => -1 - i32::from(n),
            Self::Moving(n) => i32::from(n),
        })
    }
}

/// What a part is, and which points it has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Kind {
    /// Both ends of a joint's travel.
    Rail,
    /// A slider on a rail: its place, both ends of the rail.
    Slider,
    /// Constant length.
    Link,
    /// Variable length.
    Strut,
    /// A rigid body: its outline, closed.
    Platform,
    /// A body that only carries: its outline, closed.
    Body,
    /// From the platform to the tip.
    Tool,
    /// The hot wire.
    Wire,
    /// A disc: centre and two points on the rim, a quarter apart.
    Disc,
    /// Hinges.
    Hinge,
    /// The controlled point of a path.
    Tip,
}

/// One part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Part {
    pub kind: Kind,
    pub name: String,
    pub points: Vec<Point>,
    /// The joint that moves it; the path that a tip is on.
    pub of: Option<usize>,
    /// One bit for each view that shows it.
    pub views: u8,
}

/// How one of the tool's paths comes from poses: three letters of the pose (mm) in a frame that may move.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct PathFrame {
    pub name: String,
    /// Places in the pose of x, y, z; −1: constant.
    pub letters: [i8; 3],
    /// The constant part, mm.
    pub offset: Vec3,
    /// Empty: the scene itself. One point: an origin that moves. Four: origin and the ends of its axes, [`AXIS_MM`] long.
    pub frame: Vec<Point>,
    pub views: u8,
}

/// Length of the axes of a moving frame: long, so that single precision does not tell.
pub(crate) const AXIS_MM: f64 = 100.0;

/// One look at the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct View {
    pub name: String,
    /// False: flat, seen along the normal. True: can be turned.
    pub space: bool,
    /// Unit vectors of the scene that point right and up on the screen (in space: at the front view).
    pub right: Vec3,
    pub up: Vec3,
}

/// The whole drawing.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct Drawing {
    pub views: Vec<View>,
    /// What x, y and z of the scene are called.
    pub axes: [&'static str; 3],
    pub fixed: Vec<Vec3>,
    pub parts: Vec<Part>,
    pub paths: Vec<PathFrame>,
    pub moving: usize,
}

pub(crate) const X: Vec3 = [1.0, 0.0, 0.0];
pub(crate) const Y: Vec3 = [0.0, 1.0, 0.0];
pub(crate) const Z: Vec3 = [0.0, 0.0, 1.0];

/// Draws: either names all parts, or only collects the moving points.
pub(crate) struct Pen<'a> {
    pub machine: &'a Machine,
    drawing: Option<&'a mut Drawing>,
    moving: &'a mut Vec<Vec3>,
    /// Views that show what is drawn from now on.
    pub views: u8,
}

impl Pen<'_> {
    /// A point that never moves.
    pub(crate) fn fixed(&mut self, point: Vec3) -> Point {
        let Some(drawing) = &mut self.drawing else { return Point::Fixed(0) };
        drawing.fixed.push(point);
        Point::Fixed((drawing.fixed.len() - 1) as u16)
    }

    /// A point that moves.
    pub(crate) fn moving(&mut self, point: Vec3) -> Point {
        self.moving.push(point);
        Point::Moving((self.moving.len() - 1) as u16)
    }

    /// A part between points that are there already.
    pub(crate) fn part(&mut self, kind: Kind, name: &str, points: &[Point], of: Option<usize>) {
        let views = self.views;
        if let Some(drawing) = &mut self.drawing {
            drawing.parts.push(Part { kind, name: name.to_owned(), points: points.to_vec(), of, views });
        }
    }

    /// A view; returns its bit.
    pub(crate) fn view(&mut self, name: &str, space: bool, right: Vec3, up: Vec3) -> u8 {
        match &mut self.drawing {
            Some(drawing) => {
                drawing.views.push(View { name: name.to_owned(), space, right, up });
                1 << (drawing.views.len() - 1)
            }
            None => 0,
        }
    }

    pub(crate) fn axes(&mut self, names: [&'static str; 3]) {
        if let Some(drawing) = &mut self.drawing {
            drawing.axes = names;
        }
    }

    /// A path, with the point of the machine that follows it.
    pub(crate) fn path(&mut self, name: &str, letters: [i8; 3], offset: Vec3, frame: &[Point], tip: Point) {
        let views = self.views;
        if let Some(drawing) = &mut self.drawing {
            let frame = frame.to_vec();
            drawing.paths.push(PathFrame { name: name.to_owned(), letters, offset, frame, views });
            let of = Some(drawing.paths.len() - 1);
            self.part(Kind::Tip, name, &[tip], of);
        }
    }

    /// A moving frame: origin and axes.
    pub(crate) fn frame(&mut self, origin: Vec3, axes: [Vec3; 3]) -> [Point; 4] {
        let [x, y, z] = axes.map(|axis| self.moving(along(origin, AXIS_MM, axis)));
        let origin = self.moving(origin);
        [origin, x, y, z]
    }

    /// A guide with its slider: both ends of the travel of `joint` along `direction` from `reference`, and the place at
    /// `value`. Returns the slider's point.
    pub(crate) fn slider(&mut self, joint: usize, reference: Vec3, direction: Vec3, value: f64) -> Point {
        let machine = self.machine;
        let Some(limits) = machine.joints.get(joint) else { return self.moving(reference) };
        let ends = [limits.range.min, limits.range.max].map(|p| self.fixed(along(reference, p, direction)));
        self.part(Kind::Rail, "", &ends, Some(joint));
        self.on_rail(joint, ends, along(reference, value, direction))
    }

    /// The slider of a joint on a rail that is drawn already.
    pub(crate) fn on_rail(&mut self, joint: usize, ends: [Point; 2], at: Vec3) -> Point {
        let machine = self.machine;
        let at = self.moving(at);
        if let Some(limits) = machine.joints.get(joint) {
            self.part(Kind::Slider, &limits.name, &[at, ends[0], ends[1]], Some(joint));
        }
        at
    }
}

/// u + k v
pub(crate) fn along(u: Vec3, k: f64, v: Vec3) -> Vec3 {
    [u[0] + k * v[0], u[1] + k * v[1], u[2] + k * v[2]]
}

fn draw(mechanism: &Mechanism, joints: &Joints, pose: &Pose, pen: &mut Pen<'_>) {
    match mechanism {
        Mechanism::Cartesian(m) => cartesian::draw(m, joints, pose, pen),
        Mechanism::Planar(m) => planar::draw(m, joints, pose, pen),
        Mechanism::Moma(m) => planar::draw(&m.planar, joints, pose, pen),
        Mechanism::Moma4s(m) => planar::draw_4s(m, joints, pose, pen),
        Mechanism::MomaW(m) => moma_w::draw(m, joints, pose, pen),
        Mechanism::HvMill(m) => hv_mill::draw(m, joints, pen),
        Mechanism::HvMachine(m) => hv_mill::draw_both(m, joints, pen),
        Mechanism::OxGlide(m) => ox_glide::draw(m, joints, pose, pen),
        Mechanism::Lambda6(m) => lambda6::draw(m, joints, pose, pen),
        Mechanism::LinearDelta(m) => linear_delta::draw(m, joints, pose, pen),
        Mechanism::Hexapod(m) => hexapod::draw(m, joints, pose, pen),
        // A mechanism without a drawing: its tool alone.
        _ => cartesian::draw_tool(pose, pen),
    }
}

impl Drawing {
    /// The parts of a machine.
    pub(crate) fn new(machine: &Machine, joints: &Joints, pose: &Pose) -> Self {
        let (mut drawing, mut moving) = (Self::default(), Vec::new());
        let mut pen = Pen { machine, drawing: Some(&mut drawing), moving: &mut moving, views: 0xff };
        draw(&machine.mechanism, joints, pose, &mut pen);
        drawing.moving = moving.len();
        drawing
    }
}

/// The moving points at these joints and this pose, mm; `points` is emptied first.
pub(crate) fn frame(
    machine: &Machine,
    mechanism: &Mechanism,
    joints: &Joints,
    pose: &Pose,
    points: &mut Vec<Vec3>,
) {
    points.clear();
    let mut pen = Pen { machine, drawing: None, moving: points, views: 0 };
    draw(mechanism, joints, pose, &mut pen);
}
