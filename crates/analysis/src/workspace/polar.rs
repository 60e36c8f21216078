//! The polar scan of spatial machines, \[L6\] section V: planes of constant z, rays from the z axis, outwards to the first pose
//! that fails, then bisection.
//!
//! What lies behind a first failure is ignored, also when it is reachable: the scan accepts star-shaped sets only (the paper
//! does not say so). With a grid of orientations a point belongs to the set if one of them (achievable) or all of them (total
//! orientation) can be taken there; numbers depend on that grid and are quoted with it.
//!
//! Lambda is fast here: at fixed height and orientation every limit of a leg is a limit of ρ², the squared distance of its
//! platform joint from its shaft, so a plane is worked off with comparisons alone.

use super::WorkspaceError;
use crate::parallel;
use pkm_kins::machine::Mechanism;
use pkm_kins::maths::{TAU, ceil, floor, hypot, radians, sincos};
use pkm_kins::{Axis, JointRange, Kinematics, Lambda6, Lambda6Leg, Pose, Vec2};
use pkm_machine::Machine;
use std::cell::RefCell;

/// How a scan steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Distance of the planes, mm.
    pub dz_mm: f64,
    /// Rays per plane.
    pub rays: usize,
    /// Step along a ray, mm.
    pub d_rho_mm: f64,
}

/// As the specification of the scan has them: 10 mm, 72 rays, 5 mm.
impl Default for Steps {
    fn default() -> Self {
        Self { dz_mm: 10.0, rays: 72, d_rho_mm: 5.0 }
    }
}

/// Bisection ends here, mm.
const BISECTION_MM: f64 = 0.001;

/// The most steps along one ray of every plane together.
const MOST_STEPS: f64 = 2e7;

/// Which orientations a point must allow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kind {
    /// For files: `zero_orientation`, `achievable`, `total_orientation`.
    pub name: &'static str,
    /// A, B and C take values from −`angle_deg` to `angle_deg`, independently.
    pub angle_deg: f64,
    /// So many each.
    pub values: usize,
    /// All of them, or at least one.
    pub every: bool,
}

/// All angles zero.
pub const ZERO_ORIENTATION: Kind = Kind { name: "zero_orientation", angle_deg: 0.0, values: 1, every: true };
/// At least one of 125 orientations within ±30°.
pub const ACHIEVABLE: Kind = Kind { name: "achievable", angle_deg: 30.0, values: 5, every: false };
/// All of 27 orientations within ±15°.
pub const TOTAL_ORIENTATION: Kind =
    Kind { name: "total_orientation", angle_deg: 15.0, values: 3, every: true };

impl Kind {
    /// The orientations (A, B, C), rad. Axes that the machine has not stay 0.
    fn orientations(&self, machine: &Machine) -> Vec<[f64; 3]> {
        let values = |axis: Axis| -> Vec<f64> {
            if self.values < 2 || !machine.mechanism.axes().contains(axis) {
                return vec![0.0];
            }
            let step = 2.0 * self.angle_deg / (self.values - 1) as f64;
            (0..self.values).map(|k| radians(k as f64 * step - self.angle_deg)).collect()
        };
        let mut all = Vec::new();
        for &a in &values(Axis::A) {
            for &b in &values(Axis::B) {
                all.extend(values(Axis::C).iter().map(|&c| [a, b, c]));
            }
        }
        all
    }
}

/// One plane of a solid.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    /// mm
    pub z_mm: f64,
    /// Where each ray ends, mm; ray m at the angle 2π m/rays from x.
    pub radii_mm: Vec<f64>,
}

impl Plane {
    /// ½ ∑ ρ² Δβ, mm².
    pub fn area_mm2(&self) -> f64 {
        let squares: f64 = self.radii_mm.iter().map(|rho| rho * rho).sum();
        0.5 * squares * TAU / self.radii_mm.len() as f64
    }

    /// The ends of the rays, mm.
    pub fn points(&self) -> Vec<Vec2> {
        let count = self.radii_mm.len() as f64;
        let point = |(m, rho): (usize, &f64)| {
            let (s, c) = sincos(TAU * m as f64 / count);
            [rho * c, rho * s]
        };
        self.radii_mm.iter().enumerate().map(point).collect()
    }
}

/// A workspace, plane by plane from below.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Which orientations.
    pub kind: Kind,
    /// How it was scanned.
    pub steps: Steps,
    /// The planes that are not empty.
    pub planes: Vec<Plane>,
}

impl Solid {
    /// dz ∑ areas, mm³: the number that the steps define.
    pub fn volume_mm3(&self) -> f64 {
        self.steps.dz_mm * self.planes.iter().map(Plane::area_mm2).sum::<f64>()
    }

    /// How far bisection may have left that number from what the steps define, mm³.
    pub fn bisection_bound_mm3(&self) -> f64 {
        let edge: f64 = self.planes.iter().flat_map(|plane| &plane.radii_mm).sum();
        self.steps.dz_mm * edge * BISECTION_MM * TAU / self.steps.rays as f64
    }

    /// How far the steps may have left it from the continuous volume, mm³: the difference to the same scan with every
    /// second plane and every second ray. An estimate, not a bound.
    pub fn step_estimate_mm3(&self) -> f64 {
        let Some(first) = self.planes.first() else { return 0.0 };
        let number = |plane: &Plane| ((plane.z_mm - first.z_mm) / self.steps.dz_mm + 0.5) as usize;
        let sparse = |plane: &Plane| {
            let squares: f64 = plane.radii_mm.iter().step_by(2).map(|rho| rho * rho).sum();
            0.5 * squares * TAU / plane.radii_mm.len().div_ceil(2) as f64
        };
        let half: f64 = self.planes.iter().filter(|plane| number(plane).is_multiple_of(2)).map(sparse).sum();
        (self.volume_mm3() - 2.0 * self.steps.dz_mm * half).abs()
    }

    /// The longest ray, mm.
    pub fn largest_radius_mm(&self) -> f64 {
        self.planes.iter().flat_map(|plane| &plane.radii_mm).fold(0.0, |most, &rho| most.max(rho))
    }

    /// The smallest box around all rays, mm; `None` if it is empty.
    pub fn bounding_box_mm(&self) -> Option<[[f64; 3]; 2]> {
        let (first, last) = (self.planes.first()?, self.planes.last()?);
        let mut low = [0.0, 0.0, first.z_mm];
        let mut high = [0.0, 0.0, last.z_mm];
        for point in self.planes.iter().flat_map(Plane::points) {
            for axis in 0..2 {
                low[axis] = f64::min(low[axis], point[axis]);
                high[axis] = f64::max(high[axis], point[axis]);
            }
        }
        Some([low, high])
    }

    /// The smallest measure of a direct singularity (|σ| for Lambda) over the middle, the half and the end of every ray in
    /// every orientation that can be taken there.
    pub fn nearest_singularity(&self, machine: &Machine, threads: usize) -> f64 {
        let orientations = self.kind.orientations(machine);
        let test = Point { machine, ranges: machine.joint_ranges() };
        let nearest = |plane: &Plane| {
            let mut least = f64::INFINITY;
            for [x, y] in plane.points() {
                for share in [0.0, 0.5, 0.999] {
                    for &[a, b, c] in &orientations {
                        let pose = Pose { x: x * share, y: y * share, z: plane.z_mm, a, b, c, ..Pose::ZERO };
                        if test.can(&pose)
                            && let Ok(measure) = machine.mechanism.singularity(&pose)
                        {
                            least = least.min(measure.forward);
                        }
                    }
                }
            }
            least
        };
        let all = parallel::map(self.planes.len(), threads, |index| nearest(&self.planes[index]));
        all.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The solid as a Wavefront OBJ: rings of the planes, joined by triangles, closed at both ends. Between two planes it is
    /// a loft, while the volume counts each plane as a slab.
    pub fn obj(&self) -> String {
        use std::fmt::Write as _;
        let rays = self.steps.rays;
        let mut text = format!(
            "# {} workspace, mm, z up; {} planes of {rays} rays\no {}\n",
            self.kind.name,
            self.planes.len(),
            self.kind.name
        );
        for plane in &self.planes {
            for [x, y] in plane.points() {
                let _ = writeln!(text, "v {x:.2} {y:.2} {:.2}", plane.z_mm);
            }
        }
        let vertex = |ring: usize, ray: usize| ring * rays + ray % rays + 1;
        for ring in 1..self.planes.len() {
            for ray in 0..rays {
                let (a, b) = (vertex(ring - 1, ray), vertex(ring - 1, ray + 1));
                let (c, d) = (vertex(ring, ray + 1), vertex(ring, ray));
                let _ = writeln!(text, "f {a} {b} {c} {d}");
            }
        }
        if let Some(top) = self.planes.len().checked_sub(1) {
            let ring = |at: usize| (0..rays).map(move |ray| vertex(at, ray).to_string());
            let _ = writeln!(text, "f {}", ring(top).collect::<Vec<_>>().join(" "));
            let _ = writeln!(text, "f {}", ring(0).rev().collect::<Vec<_>>().join(" "));
        }
        text
    }
}

/// Scans one kind of workspace of a spatial machine.
///
/// # Errors
/// `Resolution` for steps that are no lengths, `TooFine` for more than can be worked off, `Unsupported` for a machine that is
/// not spatial, `Empty`.
pub fn scan(machine: &Machine, kind: Kind, steps: Steps, threads: usize) -> Result<Solid, WorkspaceError> {
    for value_mm in [steps.dz_mm, steps.d_rho_mm] {
        if !(value_mm > 0.0 && value_mm.is_finite()) {
            return Err(WorkspaceError::Resolution { value_mm });
        }
    }
    let (heights, radius) = extent(machine)?;
    let (low, high) = (floor(heights[0] / steps.dz_mm), ceil(heights[1] / steps.dz_mm));
    let count = (high - low + 1.0) * (radius / steps.d_rho_mm);
    if !(count <= MOST_STEPS) {
        let finest_mm = steps.dz_mm * (count / MOST_STEPS).sqrt() * 1.01;
        return Err(WorkspaceError::TooFine {
            value_mm: steps.dz_mm,
            poses: count * steps.rays as f64,
            most: MOST_STEPS * steps.rays as f64,
            finest_mm,
        });
    }
    let orientations = kind.orientations(machine);
    let ranges = machine.joint_ranges();
    let planes = (high - low) as usize + 1;
    let most_steps = (radius / steps.d_rho_mm) as usize + 1;
    let scanned = parallel::map(planes, threads, |index| {
        let z_mm = (low + index as f64) * steps.dz_mm;
        let test = Point { machine, ranges: ranges.clone() };
        let plain = |[x, y]: Vec2| {
            let can = |&[a, b, c]: &[f64; 3]| test.can(&Pose { x, y, z: z_mm, a, b, c, ..Pose::ZERO });
            if kind.every { orientations.iter().all(can) } else { orientations.iter().any(can) }
        };
        let radii_mm = match &machine.mechanism {
            // Most planes are empty: their middle says so.
            _ if !plain([0.0, 0.0]) => vec![0.0; steps.rays],
            Mechanism::Lambda6(lambda) if !lambda.has_cone() => {
                let rings = RefCell::new(Annuli::new(lambda, &ranges, &orientations, z_mm, kind.every));
                let jump = |direction: Vec2| rings.borrow().first_failure(direction, steps.d_rho_mm);
                rays(&steps, most_steps, jump, |p| rings.borrow_mut().can(p))
            }
            _ => rays(&steps, most_steps, |_| None, plain),
        };
        Plane { z_mm, radii_mm }
    });
    let planes: Vec<Plane> =
        scanned.into_iter().filter(|plane| plane.radii_mm.iter().any(|&rho| rho > 0.0)).collect();
    if planes.is_empty() {
        return Err(WorkspaceError::Empty { view: kind.name.replace('_', " ") });
    }
    Ok(Solid { kind, steps, planes })
}

/// The rays of one plane, each to its first failure. `jump` may know the number of the first step that fails.
fn rays(
    steps: &Steps,
    most_steps: usize,
    jump: impl Fn(Vec2) -> Option<usize>,
    mut can: impl FnMut(Vec2) -> bool,
) -> Vec<f64> {
    let mut ray = |m: usize| {
        let (s, c) = sincos(TAU * m as f64 / steps.rays as f64);
        let mut at = |rho: f64| can([rho * c, rho * s]);
        let first = jump([c, s]).filter(|&k| k <= most_steps);
        let Some(fails) = first.or_else(|| (1..=most_steps).find(|&k| !at(k as f64 * steps.d_rho_mm))) else {
            return most_steps as f64 * steps.d_rho_mm;
        };
        let (mut pass, mut fail) = ((fails - 1) as f64 * steps.d_rho_mm, fails as f64 * steps.d_rho_mm);
        while fail - pass > BISECTION_MM {
            let middle = 0.5 * (pass + fail);
            if at(middle) { pass = middle } else { fail = middle }
        }
        pass
    };
    (0..steps.rays).map(&mut ray).collect()
}

/// Heights that can matter, and a radius that no pose exceeds, mm.
fn extent(machine: &Machine) -> Result<([f64; 2], f64), WorkspaceError> {
    let ranges = machine.joint_ranges();
    match &machine.mechanism {
        Mechanism::Lambda6(lambda) => {
            // N_z = −l − h with 0 < h < c, and N is at most D from the platform's origin.
            let legs = lambda.legs();
            let long = legs.iter().fold(0.0, |most: f64, leg| most.max(leg.long_mm));
            let shaft =
                legs.iter().fold(0.0, |most: f64, leg| most.max(hypot(leg.shaft_mm[0], leg.shaft_mm[1])));
            let d = lambda.platform_radius_mm();
            let (least, most) = ranges
                .iter()
                .take(3)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), r| (low.min(r.min), high.max(r.max)));
            Ok(([-most - long - d, -least + d], shaft + long + d))
        }
        // Struts and carriages reach no farther than their longest travel and their base together; home is inside.
        Mechanism::LinearDelta(_) | Mechanism::Hexapod(_) => {
            let most = ranges.iter().fold(0.0, |most: f64, r| most.max(r.max.abs()).max(r.min.abs()));
            let z = machine.home.z;
            Ok(([z - 2.0 * most, z + 2.0 * most], 2.0 * most))
        }
        _ => Err(WorkspaceError::Unsupported { mechanism: machine.mechanism_type.clone() }),
    }
}

/// The plain test of one pose.
struct Point<'a> {
    machine: &'a Machine,
    ranges: Vec<JointRange>,
}

impl Point<'_> {
    fn can(&self, pose: &Pose) -> bool {
        let mechanism = &self.machine.mechanism;
        mechanism.inverse(pose).is_ok_and(|q| {
            JointRange::check(&self.ranges, &q).is_ok() && mechanism.coupled_limits(&q).is_ok()
        })
    }
}

/// Lambda at one height: for every orientation and leg, where its shaft is as seen from the platform's origin, and the ranges
/// of ρ² that all its limits leave (at most two: the lower slider's position has one extremum over ρ²).
struct Annuli {
    rings: Vec<[Ring; 3]>,
    every: bool,
    /// The orientation that decided last, tried first.
    last: usize,
}

#[derive(Clone, Copy)]
struct Ring {
    centre: Vec2,
    first: [f64; 2],
    second: [f64; 2],
}

const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

impl Annuli {
    fn new(lambda: &Lambda6, ranges: &[JointRange], orientations: &[[f64; 3]], z: f64, every: bool) -> Self {
        let legs = lambda.legs();
        let spacing = lambda.spacing_mm();
        let rings = orientations.iter().map(|&[psi, theta, phi]| {
            let ((ss, cs), (st, ct), (sp, cp)) = (sincos(psi), sincos(theta), sincos(phi));
            [0, 1, 2].map(|i| {
                let leg = &legs[i];
                let [bx, by] = leg.joint_mm;
                let (qx, qy, qz) = (ct * bx + st * ss * by, cs * by, ct * ss * by - st * bx);
                let arm = [cp * qx - sp * qy, sp * qx + cp * qy];
                let [first, second] = allowed(leg, [ranges[i], ranges[i + 3]], spacing, z + qz);
                Ring { centre: [leg.shaft_mm[0] - arm[0], leg.shaft_mm[1] - arm[1]], first, second }
            })
        });
        Self { rings: rings.collect(), every, last: 0 }
    }

    /// The number of the first step along a ray (unit vector) at which one orientation fails, if all are asked for, each leg
    /// has one ring, and the middle can be taken: a ring is left for good through its outer circle, or entered through its inner.
    fn first_failure(&self, direction: Vec2, step: f64) -> Option<usize> {
        if !self.every {
            return None;
        }
        let mut first = f64::INFINITY;
        for ring in self.rings.iter().flatten() {
            if ring.second[0] <= ring.second[1] {
                return None;
            }
            // q(ρ) = ρ² − 2 m ρ + |centre|²
            let m = direction[0] * ring.centre[0] + direction[1] * ring.centre[1];
            let rest = m * m - ring.centre[0] * ring.centre[0] - ring.centre[1] * ring.centre[1];
            let (inner, outer) = (rest + ring.first[0], rest + ring.first[1]);
            first = first.min(floor((m + outer.sqrt()) / step) + 1.0);
            if inner > 0.0 && m > 0.0 {
                let root = inner.sqrt();
                let enters = floor((m - root) / step) + 1.0;
                // A hole between two steps is not seen.
                if enters * step < m + root {
                    first = first.min(enters);
                }
            }
        }
        (1.0..1e9).contains(&first).then_some(first as usize)
    }

    /// True if the orientations asked for can be taken at `p`.
    fn can(&mut self, [x, y]: Vec2) -> bool {
        let one = |rings: &[Ring; 3]| {
            rings.iter().all(|ring| {
                let (dx, dy) = (x - ring.centre[0], y - ring.centre[1]);
                let q = dx * dx + dy * dy;
                let inside = |[low, high]: [f64; 2]| (q >= low) & (q <= high);
                inside(ring.first) || inside(ring.second)
            })
        };
        // For every: one that fails decides; for at least one: one that can.
        let decides = |rings: &[Ring; 3]| one(rings) != self.every;
        if self.rings.get(self.last).is_some_and(decides) {
            return !self.every;
        }
        match self.rings.iter().position(decides) {
            Some(index) => {
                self.last = index;
                !self.every
            }
            None => self.every,
        }
    }
}

/// The ranges of q = ρ² in which a leg whose platform joint is at height `n_z` keeps all limits.
///
/// With h = √(c² − q), g = √(u² − k² q): l = −N_z − h, l' = l + k h + g, spacing k h + g. Every limit is tight at the roots of
/// an equation that is at most quadratic in h; between two neighbouring roots nothing changes.
fn allowed(leg: &Lambda6Leg, [upper, lower]: [JointRange; 2], spacing: [f64; 2], n_z: f64) -> [[f64; 2]; 2] {
    let (c, u, k) = (leg.long_mm, leg.short_mm, leg.ratio);
    let reach = c.min(u / k);
    let (smallest, largest) = (1e-12, reach * reach);
    let slack = JointRange::TOLERANCE;
    let keeps = |q: f64| {
        let (h, g) = ((c * c - q).max(0.0).sqrt(), (u * u - k * k * q).max(0.0).sqrt());
        let l = -n_z - h;
        let d = k * h + g;
        upper.contains(l) && lower.contains(l + d) && d >= spacing[0] - slack && d <= spacing[1] + slack
    };
    let mut edges = vec![smallest, largest];
    // Every limit is g = offset + slope h.
    let mut tight = |offset: f64, slope: f64| {
        if !offset.is_finite() {
            return;
        }
        // u² − k²c² + k²h² = (offset + slope h)²
        let (a, b) = (slope * slope - k * k, 2.0 * offset * slope);
        let rest = offset * offset - u * u + k * k * c * c;
        let roots = if a.abs() < 1e-12 {
            [if b == 0.0 { f64::NAN } else { -rest / b }, f64::NAN]
        } else {
            let root = (b * b - 4.0 * a * rest).sqrt();
            [(-b + root) / (2.0 * a), (-b - root) / (2.0 * a)]
        };
        edges.extend(roots.into_iter().filter(|h| *h >= 0.0).map(|h| c * c - h * h));
    };
    for d in spacing {
        tight(d, -k);
    }
    for end in [lower.min, lower.max] {
        tight(end + n_z, 1.0 - k);
    }
    for end in [upper.min, upper.max] {
        let h = -n_z - end;
        if h > 0.0 {
            edges.push(c * c - h * h);
        }
    }
    edges.retain(|q| *q >= smallest && *q <= largest);
    edges.sort_by(f64::total_cmp);
    let mut found = [NOTHING; 2];
    let mut count = 0;
    let mut open = false;
    for pair in edges.windows(2) {
        let inside = keeps(0.5 * (pair[0] + pair[1]));
        match (inside, open) {
            (true, false) if count < 2 => found[count] = [pair[0], pair[1]],
            (true, true) if count < 2 => found[count][1] = pair[1],
            (false, true) => count += 1,
            _ => {}
        }
        open = inside;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rings say what the kinematics says, at random poses of random orientation.
    #[test]
    fn rings_are_the_mechanism() {
        let seed = 7_u64;
        let mut state = seed;
        let mut random = |low: f64, high: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * ((state >> 11) as f64 / (1_u64 << 53) as f64)
        };
        let sets: [&[&str]; 3] = [
            &[],
            &[
                "kinematics.u_mm=[900,900,900]",
                "kinematics.r_mm=[300,300,300]",
                "kinematics.c_mm=[1100,1100,1100]",
                "kinematics.spacing_mm=[600,1620]",
                "kinematics.base_radius_mm=900",
                "home.z=-1200",
            ],
            &[
                "kinematics.c_mm=[1400,1380,1420]",
                "kinematics.r_mm=[500,490,520]",
                "kinematics.u_mm=[800,810,790]",
            ],
        ];
        for set in sets {
            let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
            let machine = Machine::load("lambda6", &set).unwrap();
            let Mechanism::Lambda6(lambda) = &machine.mechanism else { panic!() };
            let ranges = machine.joint_ranges();
            let test = Point { machine: &machine, ranges: ranges.clone() };
            let mut counts = [0, 0];
            for _ in 0..20_000 {
                let orientation = [random(-0.6, 0.6), random(-0.6, 0.6), random(-0.6, 0.6)];
                let [x, y, z] = [random(-600.0, 600.0), random(-600.0, 600.0), random(-2100.0, -800.0)];
                let rings = Annuli::new(lambda, &ranges, &[orientation], z, true).can([x, y]);
                let [a, b, c] = orientation;
                let can = test.can(&Pose { x, y, z, a, b, c, ..Pose::ZERO });
                assert_eq!(rings, can, "seed {seed}: {x} {y} {z} {orientation:?}");
                counts[usize::from(can)] += 1;
            }
            assert!(counts[0] > 1000 && counts[1] > 500, "{counts:?}");
        }
    }
}
