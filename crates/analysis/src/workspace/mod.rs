//! Workspaces: what a machine can reach, with exact boundaries where the mechanism is planar.
//!
//! [`views`] takes a machine apart into the planes in which its workspace is a [`Region`] of the plane: one for a planar
//! mechanism, both forms of an O-X glide, the wire of a MOMA-W at a table position and tilt, both spindles of an HV-Mill.
//! What moves along the plane's normal makes a volume of the area. [`polar`] scans spatial machines plane by plane.

pub(crate) mod contour;
mod curve;
pub mod map;
pub mod polar;
mod region;
pub mod report;

pub use curve::Curve;
pub use region::{Boundary, Cause, Piece, Region};

use curve::{cross, distance};
use region::{Chain, Constraint, parallel_links};

use pkm_kins::machine::Mechanism;
use pkm_kins::maths::{radians, tan};
use pkm_kins::{
    Axis, HvMill, JointRange, Kinematics, OxForm, OxGlide, OxGlideParameters, Planar, Pose, Spindle, Vec2,
};
use pkm_machine::Machine;
use std::fmt;

/// Where a workspace of a machine with more than two axes is cut.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Section {
    /// MOMA-W: the table's position, mm; its home without.
    pub z_mm: Option<f64>,
    /// MOMA-W: angle of the wire to the planes' normal, in the x-z and in the y-z plane, degrees: u − x = D tan, v − y = D tan.
    pub tilt_deg: [f64; 2],
}

/// One plane of a machine.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// What it is, for a title: "O form", "H".
    pub name: String,
    /// The machine's axes to the right and up.
    pub axes: [Axis; 2],
    /// Everything that can be reached.
    pub reachable: Region,
    /// What is left if every link stays on the inner side of its guide (\[MOMA\] figs 6b, 6d), or, for the O-X glide, of
    /// the guard around the form switch.
    pub usable: Region,
    /// How far the plane itself can move along its normal, and along which axis: it sweeps a volume.
    pub sweep: Option<(Axis, JointRange)>,
    /// A pose to draw the mechanism in, mm.
    pub pose: Vec2,
    /// The mechanisms that carry the point: one, or two for a wire.
    pub(crate) mechanisms: Vec<Pair>,
    /// What det ∂p/∂(plane) is multiplied with: (b_z/D)² for a wire.
    pub(crate) factor: f64,
}

/// One chain of a mechanism in a pose, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limb {
    /// Joint number in the machine.
    pub joint: usize,
    /// Ends of the slider's travel.
    pub guide: [Vec2; 2],
    /// The slider.
    pub slider: Vec2,
    /// The platform's joint, at the other end of the link.
    pub platform: Vec2,
}

/// A planar mechanism in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    pub chains: [Chain; 2],
    /// s
    pub side: f64,
}

/// The reachable set of one view as polygons.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// As [`View::name`].
    pub name: String,
    /// The machine's axes to the right and up.
    pub axes: [Axis; 2],
    /// Closed polygons, mm: outer ones counter-clockwise, holes clockwise.
    pub polygons: Vec<Vec<Vec2>>,
    /// Exact area, mm².
    pub area_mm2: f64,
}

/// Why there is no workspace to show.
#[derive(Debug, Clone, PartialEq)]
pub enum WorkspaceError {
    /// Nothing can be reached.
    Empty {
        /// Which view.
        view: String,
    },
    /// A resolution that is not a length, mm.
    Resolution {
        /// What was asked.
        value_mm: f64,
    },
    /// A resolution that asks for more than can be worked off.
    TooFine {
        /// What was asked, mm.
        value_mm: f64,
        /// Poses it would take.
        poses: f64,
        /// The most.
        most: f64,
        /// The finest that is possible, mm.
        finest_mm: f64,
    },
    /// The table position puts a contour plane outside the span of the wire.
    Section {
        /// What is wrong.
        message: String,
    },
    /// There is no picture of this mechanism's workspace.
    Unsupported {
        /// `kinematics.type`
        mechanism: String,
    },
}

impl fmt::Display for WorkspaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { view } => {
                write!(f, "the workspace is empty ({view}): no pose has all joints within their travel")
            }
            Self::Resolution { value_mm } => {
                write!(f, "a resolution of {value_mm} mm is not a length above 0")
            }
            Self::TooFine { value_mm, poses, most, finest_mm } => write!(
                f,
                "a resolution of {value_mm} mm asks for {poses:.3e} poses, at most {most:.0e} are worked off; use {finest_mm:.2} mm or coarser"
            ),
            Self::Section { message } => f.write_str(message),
            Self::Unsupported { mechanism } => write!(f, "there is no workspace picture for `{mechanism}`"),
        }
    }
}

impl std::error::Error for WorkspaceError {}

impl Pair {
    fn new(planar: &Planar, first_joint: usize, ranges: &[JointRange], moved: Vec2) -> Self {
        let [c1, c2] = planar.chains();
        let chain = |at: usize, c| Chain::new(first_joint + at, c, ranges[first_joint + at], moved);
        Self { chains: [chain(0, &c1), chain(1, &c2)], side: planar.assembly() }
    }

    fn constraints(&self) -> [Constraint; 3] {
        let [c1, c2] = self.chains;
        [
            Constraint::Travel(c1),
            Constraint::Travel(c2),
            Constraint::Assembly { chains: self.chains, side: self.side },
        ]
    }

    fn inner_sides(&self) -> impl Iterator<Item = Constraint> + use<> {
        self.chains.into_iter().filter_map(|chain| chain.inner_side())
    }

    /// det ∂(p₁, p₂)/∂T with guides that have no ends; at a singularity of type 1 and beyond it the last finite value.
    pub(crate) fn determinant(&self, t: Vec2) -> f64 {
        let [l1, l2] = self.chains.map(|chain| chain.link_at(t));
        let w = |l: Vec2, chain: &Chain| l[0] * chain.direction[0] + l[1] * chain.direction[1];
        cross(l1, l2) / (w(l1, &self.chains[0]) * w(l2, &self.chains[1]))
    }
}

impl Region {
    /// What a planar mechanism reaches with its sliders in `ranges` (mm).
    pub fn of_planar(planar: &Planar, ranges: &[JointRange; 2]) -> Self {
        let pair = Pair::new(planar, 0, ranges, [0.0; 2]);
        let mut constraints: Vec<Constraint> = pair.constraints().into();
        if planar.is_one_sided() {
            constraints.extend(pair.inner_sides());
        }
        Self { constraints }
    }
}

impl View {
    /// det ∂p/∂(plane), dimensionless, continued beyond the reachable set: past a singularity of type 1 it keeps the last
    /// finite value.
    pub fn determinant(&self, t: Vec2) -> f64 {
        self.mechanisms.iter().map(|pair| pair.determinant(t)).product::<f64>() * self.factor
    }

    /// Singular loci in the working modes, with guides that have no ends, within a box: type 1 and type 2.
    pub fn loci(&self, [low, high]: [Vec2; 2]) -> [Vec<Curve>; 2] {
        let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
        let half = distance(low, high);
        let mut loci = [Vec::new(), Vec::new()];
        for pair in &self.mechanisms {
            for chain in &pair.chains {
                loci[0].extend(chain.square_around(middle, half));
            }
            loci[1].extend(parallel_links(&pair.chains, middle, half));
        }
        loci
    }

    /// Both sliders on one rail: an O-X glide.
    pub fn is_glide(&self) -> bool {
        self.reachable.walls().any(|wall| matches!(wall, Constraint::HalfPlane { cause: Cause::Rails, .. }))
    }

    /// The mechanism in the pose T (mm), chain by chain; `None` out of reach.
    pub fn linkage(&self, t: Vec2) -> Option<Vec<Limb>> {
        let limb = |chain: &Chain| {
            let (p, _) = chain.solve(t)?;
            let range = chain.range;
            Some(Limb {
                joint: chain.joint,
                guide: [chain.slider(range.min), chain.slider(range.max)],
                slider: chain.slider(p),
                platform: [t[0] + chain.offset[0], t[1] + chain.offset[1]],
            })
        };
        self.mechanisms.iter().flat_map(|pair| &pair.chains).map(limb).collect()
    }

    /// A view of one planar mechanism.
    fn planar(name: &str, machine: &Machine, axes: [Axis; 2], pair: Pair, one_sided: bool) -> Self {
        let mut view = Self {
            name: name.to_owned(),
            axes,
            reachable: Region { constraints: pair.constraints().into() },
            usable: Region {
                constraints: pair.constraints().into_iter().chain(pair.inner_sides()).collect(),
            },
            sweep: None,
            pose: axes.map(|axis| machine.home.get(axis)),
            mechanisms: vec![pair],
            factor: 1.0,
        };
        if one_sided {
            view.reachable = view.usable.clone();
        }
        view.limit(machine);
        view
    }

    /// The machine's own limits of the axes shown.
    fn limit(&mut self, machine: &Machine) {
        for (index, &axis) in self.axes.iter().enumerate() {
            let Some(range) = machine.axis(axis).and_then(|limits| limits.range) else { continue };
            for (value, sign) in [(range.min, 1.0), (range.max, -1.0)] {
                let (mut point, mut normal) = ([0.0; 2], [0.0; 2]);
                (point[index], normal[index]) = (value, sign);
                let limit = Constraint::HalfPlane { point, normal, cause: Cause::Limit };
                self.reachable.constraints.push(limit);
                self.usable.constraints.push(limit);
            }
        }
        let overlap =
            |a: JointRange, b: JointRange| JointRange { min: a.min.max(b.min), max: a.max.min(b.max) };
        if let Some((axis, range)) = &mut self.sweep
            && let Some(limit) = machine.axis(*axis).and_then(|limits| limits.range)
        {
            *range = overlap(*range, limit);
        }
    }
}

/// The planes of a machine in which its workspace is exact; none for a spatial machine.
///
/// # Errors
/// `Section` if the wire cannot be cut there.
pub fn views(machine: &Machine, section: &Section) -> Result<Vec<View>, WorkspaceError> {
    let ranges = machine.joint_ranges();
    let plane = |planar: &Planar| {
        let pair = Pair::new(planar, 0, &ranges, [0.0; 2]);
        let name = "reachable by the tool point";
        vec![View::planar(name, machine, [Axis::X, Axis::Y], pair, planar.is_one_sided())]
    };
    Ok(match &machine.mechanism {
        Mechanism::Planar(planar) => plane(planar),
        Mechanism::Moma(moma) => plane(&moma.planar),
        Mechanism::Moma4s(moma) => plane(&moma.planar),
        Mechanism::OxGlide(glide) => ox_glide(machine, glide, &ranges),
        Mechanism::HvMill(mill) => vec![hv_mill(machine, mill, false, 0, ranges[2])],
        Mechanism::HvMachine(both) => {
            let [h, v] = both.mechanisms();
            vec![hv_mill(machine, h, true, 0, ranges[4]), hv_mill(machine, v, true, 2, ranges[4])]
        }
        Mechanism::MomaW(wire) => vec![moma_w(machine, wire, section, &ranges)?],
        // Cartesian and spatial machines.
        _ => Vec::new(),
    })
}

/// The reachable sets of a machine's planes as polygons with chords at most `tolerance_mm` off the exact boundary; none for a
/// spatial machine. The wire of a MOMA-W is taken upright, at the table's home.
pub fn outline(machine: &Machine, tolerance_mm: f64) -> Vec<Outline> {
    let views = views(machine, &Section::default()).unwrap_or_default();
    let outline = |view: View| {
        let boundary = view.reachable.boundary();
        Outline {
            name: view.name,
            axes: view.axes,
            polygons: boundary.polygons(tolerance_mm.max(1e-4)),
            area_mm2: boundary.area_mm2,
        }
    };
    views.into_iter().map(outline).collect()
}

/// O-X glide: both forms. As chains: both guides on the rail y = 0, offsets ∓s/2, modes ∓form.
fn ox_glide(machine: &Machine, glide: &OxGlide, ranges: &[JointRange]) -> Vec<View> {
    let [l, s, c_min] = glide.dimensions_mm();
    let rail = Constraint::HalfPlane { point: [0.0; 2], normal: [0.0, 1.0], cause: Cause::Rails };
    // |c| ≥ c_min is y ≤ √(l² − c_min²).
    let highest = ((l - c_min) * (l + c_min)).sqrt();
    let guard =
        Constraint::HalfPlane { point: [0.0, highest], normal: [0.0, -1.0], cause: Cause::FormSwitch };
    let form = |form: OxForm, sign: f64, name: &str| {
        let chain = |joint: usize, offset: f64, mode: f64| Chain {
            joint,
            origin: [-offset, 0.0],
            offset: [offset, 0.0],
            direction: [1.0, 0.0],
            link: l,
            mode,
            inward: 0.0,
            range: ranges[joint],
        };
        let pair = Pair { chains: [chain(0, -s / 2.0, -sign), chain(1, s / 2.0, sign)], side: sign };
        let [first, second, _] = pair.constraints();
        let reachable = Region { constraints: vec![first, second, rail] };
        let usable = Region { constraints: vec![first, second, rail, guard] };
        // The home pose belongs to the form the machine starts in; the other one is drawn at the same place, if it can be.
        let home = [machine.home.x, machine.home.y];
        let other = OxGlide::new(&OxGlideParameters { l_mm: l, s_mm: s, form, c_min_mm: c_min });
        let fits = other.is_ok_and(|other| {
            let pose = Pose { x: home[0], y: home[1], ..Pose::ZERO };
            other.inverse(&pose).is_ok_and(|q| JointRange::check(&ranges[..2], &q).is_ok())
        });
        let mut view = View {
            name: name.to_owned(),
            axes: [Axis::X, Axis::Y],
            reachable,
            usable,
            sweep: Some((Axis::Z, ranges[2])),
            pose: if fits { home } else { [home[0], 0.8 * l] },
            mechanisms: vec![pair],
            factor: 1.0,
        };
        view.limit(machine);
        view
    };
    vec![form(OxForm::O, 1.0, "O form (extended)"), form(OxForm::X, -1.0, "X form (crossed)")]
}

/// One spindle of the HV-Mill with table and head at 0: the tip in {W}.
fn hv_mill(machine: &Machine, mill: &HvMill, both: bool, first: usize, carriage: JointRange) -> View {
    let (spindle, planar) = (mill.spindle(), &mill.mechanism().planar);
    let (axes, third, name) = match (spindle, both) {
        (Spindle::H, _) => ([Axis::X, Axis::Y], Axis::Z, "H, horizontal spindle"),
        (Spindle::V, false) => ([Axis::X, Axis::Z], Axis::Y, "V, vertical spindle"),
        (Spindle::V, true) => ([Axis::U, Axis::W], Axis::V, "V, vertical spindle"),
    };
    // Where the plane's origin and the carriage's zero are in {W}: (x, y) + (−q1, q2) for H, (x, z) + (q1, q2) for V.
    let [x, y, z] = mill.place([0.0; 2], 0.0, 0.0, 0.0).w;
    let (origin, zero) = match spindle {
        Spindle::H => ([x, y], z),
        Spindle::V => ([x, z], y),
    };
    let ranges: Vec<JointRange> = machine.joint_ranges();
    let mut pair = Pair::new(planar, first, &ranges, origin);
    if spindle == Spindle::H {
        pair = Pair { chains: pair.chains.map(|chain| chain.mirrored(origin)), side: -pair.side };
    }
    let mut view = View::planar(name, machine, axes, pair, planar.is_one_sided());
    view.sweep = Some((third, JointRange { min: zero + carriage.min, max: zero + carriage.max }));
    view.limit(machine);
    view
}

/// The wire of a MOMA-W at one table position and lean, in contour plane 1. Seen along the wire both platforms are one point,
/// so both mechanisms bound it: Pᵢ = (x, y) + w + weightᵢ lean (− b for the second).
fn moma_w(
    machine: &Machine,
    wire: &pkm_kins::MomaW,
    section: &Section,
    ranges: &[JointRange],
) -> Result<View, WorkspaceError> {
    let (b, _, d) = wire.frames_mm();
    let z = section.z_mm.unwrap_or(machine.home.z);
    let [tilt_x, tilt_y] = section.tilt_deg;
    if !(tilt_x.abs() < 89.0 && tilt_y.abs() < 89.0) {
        let message = format!("a wire cannot be tilted by {tilt_x}° and {tilt_y}°: less than 89° each");
        return Err(WorkspaceError::Section { message });
    }
    let lean = [d * tan(radians(tilt_x)), d * tan(radians(tilt_y))];
    if !ranges[4].contains(z) {
        let (min, max) = (ranges[4].min, ranges[4].max);
        let message = format!("the table cannot be at z = {z} mm (travel {min} to {max} mm)");
        return Err(WorkspaceError::Section { message });
    }
    let pose = Pose { z, u: lean[0], v: lean[1], ..Pose::ZERO };
    let [p1, p2] =
        wire.wire_ends(&pose).map_err(|error| WorkspaceError::Section { message: error.to_string() })?;
    let [m1, m2] = wire.mechanisms();
    let pairs = vec![
        Pair::new(&m1.planar, 0, ranges, [-p1[0], -p1[1]]),
        Pair::new(&m2.planar, 2, ranges, [-p2[0], -p2[1]]),
    ];
    let reachable: Vec<Constraint> = pairs.iter().flat_map(Pair::constraints).collect();
    let mut usable = reachable.clone();
    usable.extend(pairs.iter().flat_map(Pair::inner_sides));
    let one_sided = m1.planar.is_one_sided() || m2.planar.is_one_sided();
    let home = [machine.home.x, machine.home.y];
    let mut view = View {
        name: format!("wire at z = {z} mm, tilted {tilt_x}° and {tilt_y}°"),
        axes: [Axis::X, Axis::Y],
        reachable: Region { constraints: if one_sided { usable.clone() } else { reachable } },
        usable: Region { constraints: usable },
        sweep: None,
        pose: home,
        mechanisms: pairs,
        factor: (b[2] / d) * (b[2] / d),
    };
    view.limit(machine);
    Ok(view)
}
