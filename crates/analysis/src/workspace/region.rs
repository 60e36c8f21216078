//! Sets of the plane bounded by what bounds a planar mechanism, with their exact boundary.
//!
//! A region is a list of constraints that all hold. Every constraint names the curves on which it may become tight; the
//! boundary is what is left of them after they have cut each other: pieces with the region on one side only. Areas follow
//! from the pieces in closed form, without a grid.

use super::curve::{Curve, SAME_MM, cross, distance, dot, plus, sub};
use pkm_kins::maths::{PI, TAU, atan2, cos, fabs, floor, sin};
use pkm_kins::{JointRange, PlanarChain, Vec2};
use serde::Serialize;

/// What makes a piece of a boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// A joint, counted from 0, at the low end of its travel.
    TravelLow(usize),
    /// At its high end.
    TravelHigh(usize),
    /// Type 1: the link of this chain is square to its guide.
    Type1(usize),
    /// Type 2: the links are parallel.
    Type2,
    /// The prolonged guide line of this chain: a link may lie on one side only.
    GuideLine(usize),
    /// The rails of an O-X glide.
    Rails,
    /// The guard around its form switch.
    FormSwitch,
    /// A limit of an axis of the machine.
    Limit,
}

/// One slider with its link, moved so that the region's point is the controlled point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chain {
    /// Joint number in the machine.
    pub joint: usize,
    /// Virtual centre at p = 0, mm.
    pub origin: Vec2,
    /// Platform joint minus T, mm.
    pub offset: Vec2,
    pub direction: Vec2,
    pub link: f64,
    /// σ
    pub mode: f64,
    /// m
    pub inward: f64,
    pub range: JointRange,
}

impl Chain {
    pub(crate) fn new(joint: usize, chain: &PlanarChain, range: JointRange, moved: Vec2) -> Self {
        Self {
            joint,
            origin: plus(sub(chain.reference_mm, chain.offset_mm), 1.0, moved),
            offset: chain.offset_mm,
            direction: chain.direction,
            link: chain.link_mm,
            mode: chain.working_mode,
            inward: chain.inward,
            range,
        }
    }

    /// The same chain seen with the first coordinate reversed, then moved.
    pub(crate) fn mirrored(self, moved: Vec2) -> Self {
        let flip = |v: Vec2| [-v[0], v[1]];
        Self {
            origin: plus(flip(sub(self.origin, moved)), 1.0, moved),
            offset: flip(self.offset),
            direction: flip(self.direction),
            inward: -self.inward,
            ..self
        }
    }

    /// Where the slider is, mm.
    pub(crate) fn slider(&self, p: f64) -> Vec2 {
        plus(plus(self.origin, 1.0, self.offset), p, self.direction)
    }

    /// The inner side of the guide; `None` if it has none.
    pub(crate) fn inner_side(&self) -> Option<Constraint> {
        let n = self.normal();
        (self.inward != 0.0).then(|| Constraint::HalfPlane {
            point: self.origin,
            normal: [self.inward * n[0], self.inward * n[1]],
            cause: Cause::GuideLine(self.joint),
        })
    }

    fn normal(&self) -> Vec2 {
        [-self.direction[1], self.direction[0]]
    }

    /// B and N of T.
    fn project(&self, t: Vec2) -> (f64, f64) {
        let k = sub(t, self.origin);
        (dot(self.direction, k), cross(self.direction, k))
    }

    /// p and L; `None` out of reach.
    pub(crate) fn solve(&self, t: Vec2) -> Option<(f64, Vec2)> {
        let (b, n) = self.project(t);
        let d = (self.link - fabs(n)) * (self.link + fabs(n));
        if !(d >= 0.0) {
            return None;
        }
        let root = self.mode * d.sqrt();
        let a = self.direction;
        Some((b + root, [-n * a[1] - root * a[0], n * a[0] - root * a[1]]))
    }

    /// The link's vector at T, the guide taken without ends; beyond reach as at the edge of it.
    pub(crate) fn link_at(&self, t: Vec2) -> Vec2 {
        let edge = self.link * (1.0 - 1e-12);
        let n = self.project(t).1.clamp(-edge, edge);
        let root = self.mode * ((self.link - n) * (self.link + n)).sqrt();
        let a = self.direction;
        [-n * a[1] - root * a[0], n * a[0] - root * a[1]]
    }

    fn place(&self, along: f64, off: f64) -> Vec2 {
        plus(plus(self.origin, along, self.direction), off, self.normal())
    }

    /// The half circle on which T lies with the slider at p.
    fn half_circle(&self, p: f64) -> Curve {
        let n = self.normal();
        Curve::Arc {
            centre: self.place(p, 0.0),
            u: [self.link * n[0], self.link * n[1]],
            v: [-self.mode * self.link * self.direction[0], -self.mode * self.link * self.direction[1]],
            start: 0.0,
            end: PI,
        }
    }

    /// The two lines on which the link is square to the guide, `half` mm to both sides of what is nearest to `middle`.
    pub(crate) fn square_around(&self, middle: Vec2, half: f64) -> [Curve; 2] {
        let (along, _) = self.project(middle);
        self.square(along - half, along + half)
    }

    /// The same for sliders from `low` to `high`.
    fn square(&self, low: f64, high: f64) -> [Curve; 2] {
        [self.link, -self.link]
            .map(|off| Curve::Segment { from: self.place(low, off), to: self.place(high, off) })
    }
}

/// One condition on T.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Constraint {
    /// Reach and travel of one chain.
    Travel(Chain),
    /// s cross(L₁, L₂) ≥ 0
    Assembly { chains: [Chain; 2], side: f64 },
    /// (T − point)·normal ≥ 0, `normal` of unit length.
    HalfPlane { point: Vec2, normal: Vec2, cause: Cause },
}

impl Constraint {
    pub(crate) fn holds(&self, t: Vec2) -> bool {
        match self {
            Self::Travel(chain) => chain.solve(t).is_some_and(|(p, _)| chain.range.contains(p)),
            Self::Assembly { chains: [first, second], side } => match (first.solve(t), second.solve(t)) {
                (Some((_, l1)), Some((_, l2))) => side * cross(l1, l2) >= -1e-9 * first.link * second.link,
                _ => false,
            },
            Self::HalfPlane { point, normal, .. } => dot(sub(t, *point), *normal) >= 0.0,
        }
    }

    /// The curves on which it may be tight; `extent` bounds the infinite ones.
    fn curves(&self, [low, high]: [Vec2; 2]) -> Vec<(Curve, Cause)> {
        match self {
            Self::Travel(chain) => {
                let (j, range) = (chain.joint, chain.range);
                let mut curves = vec![
                    (chain.half_circle(range.min), Cause::TravelLow(j)),
                    (chain.half_circle(range.max), Cause::TravelHigh(j)),
                ];
                curves.extend(chain.square(range.min, range.max).map(|line| (line, Cause::Type1(j))));
                curves
            }
            Self::Assembly { chains, .. } => {
                let half = distance(low, high);
                let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
                parallel_links(chains, middle, half).into_iter().map(|curve| (curve, Cause::Type2)).collect()
            }
            Self::HalfPlane { point, normal, cause } => {
                let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
                let off = dot(sub(middle, *point), *normal);
                let foot = plus(middle, -off, *normal);
                let (along, half) = ([-normal[1], normal[0]], distance(low, high));
                vec![(Curve::Segment { from: plus(foot, -half, along), to: plus(foot, half, along) }, *cause)]
            }
        }
    }
}

/// Where the links are parallel in the chains' working modes.
///
/// With the first link at φ and the second along or against it (k = ±1), Nᵢ = lᵢ sin(φ − αᵢ) (times k for the second): two
/// linear equations for T, so T runs on an ellipse. For parallel guides φ is fixed and T runs along the guides.
pub(crate) fn parallel_links(chains: &[Chain; 2], middle: Vec2, half: f64) -> Vec<Curve> {
    let [first, second] = chains;
    let (a1, a2, l1, l2) = (first.direction, second.direction, first.link, second.link);
    let det = cross(a1, a2);
    let mut curves = Vec::new();
    for k in [1.0, -1.0] {
        if fabs(det) > 1e-9 {
            // Rows n₁, n₂ of the linear system; solve for a right-hand side (r₁, r₂).
            let (n1, n2) = (first.normal(), second.normal());
            let solve = |r1: f64, r2: f64| [(r1 * n2[1] - r2 * n1[1]) / det, (n1[0] * r2 - n2[0] * r1) / det];
            let centre = solve(dot(n1, first.origin), dot(n2, second.origin));
            let u = solve(-l1 * a1[1], -k * l2 * a2[1]);
            let v = solve(l1 * a1[0], k * l2 * a2[0]);
            // The mode of each chain leaves half a turn of φ.
            let half_turn = |a: Vec2, sign: f64| atan2(-sign * a[1], -sign * a[0]);
            let (m1, m2) = (half_turn(a1, first.mode), half_turn(a2, k * second.mode));
            let turn = (m2 - m1) / TAU;
            let apart = (turn - floor(turn + 0.5)) * TAU;
            let (start, end) = (m1 - PI / 2.0 + apart.max(0.0), m1 + PI / 2.0 + apart.min(0.0));
            if end - start > 1e-9 {
                curves.push(Curve::Arc { centre, u, v, start, end });
            }
        } else {
            let facing = if dot(a1, a2) > 0.0 { 1.0 } else { -1.0 };
            let gap = cross(a1, sub(first.origin, second.origin));
            let sine = gap / (k * l2 - l1);
            // Both roots on the side that their modes ask for.
            let same_mode = k * facing * first.mode * second.mode > 0.0;
            if same_mode && fabs(sine) <= 1.0 {
                let foot = first.place(0.0, l1 * sine);
                let along = dot(sub(middle, foot), a1);
                let at = |off: f64| plus(foot, along + off, a1);
                curves.push(Curve::Segment { from: at(-half), to: at(half) });
            }
        }
    }
    curves
}

/// A set of the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    pub(crate) constraints: Vec<Constraint>,
}

/// A piece of a boundary with the region on its left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Where it runs.
    pub curve: Curve,
    /// What makes it.
    pub cause: Cause,
}

/// The boundary of a region: loops of pieces, the region on the left of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// Closed loops; outer ones counter-clockwise, holes clockwise.
    pub loops: Vec<Vec<Piece>>,
    /// Enclosed area, mm².
    pub area_mm2: f64,
    /// How far off the area may be, mm²: the perimeter times what two neighbouring pieces miss each other by.
    pub error_bound_mm2: f64,
}

/// How far from a curve its two sides are looked at, mm.
const LOOK_MM: f64 = 2e-6;

impl Region {
    /// True if T (mm) is in the set.
    pub fn contains(&self, t: Vec2) -> bool {
        self.constraints.iter().all(|constraint| constraint.holds(t))
    }

    /// The conditions that no mechanism's reach, travel or mode makes.
    pub(crate) fn walls(&self) -> impl Iterator<Item = &Constraint> {
        self.constraints.iter().filter(|constraint| matches!(constraint, Constraint::HalfPlane { .. }))
    }

    /// A box around the set (not the smallest), mm.
    pub(crate) fn extent(&self) -> [Vec2; 2] {
        let mut low = [f64::NEG_INFINITY; 2];
        let mut high = [f64::INFINITY; 2];
        for constraint in &self.constraints {
            let Constraint::Travel(chain) = constraint else { continue };
            let ends = [chain.place(chain.range.min, 0.0), chain.place(chain.range.max, 0.0)];
            for axis in 0..2 {
                low[axis] = low[axis].max(ends[0][axis].min(ends[1][axis]) - chain.link);
                high[axis] = high[axis].min(ends[0][axis].max(ends[1][axis]) + chain.link);
            }
        }
        for axis in 0..2 {
            // Chains that reach nowhere together.
            if !(low[axis] < high[axis]) {
                high[axis] = low[axis];
            }
        }
        [low, high]
    }

    /// The exact boundary.
    pub fn boundary(&self) -> Boundary {
        let extent = self.extent();
        let curves: Vec<(Curve, Cause)> = self
            .constraints
            .iter()
            .flat_map(|constraint| constraint.curves(extent))
            .filter(|(curve, _)| curve.length() > SAME_MM)
            .collect();
        let mut pieces: Vec<Piece> = Vec::new();
        for (index, (curve, cause)) in curves.iter().enumerate() {
            for part in cut(curve, index, &curves) {
                if let Some(curve) = self.facing(part)
                    && !pieces.iter().any(|known| same(&known.curve, &curve))
                {
                    pieces.push(Piece { curve, cause: *cause });
                }
            }
        }
        let area_mm2: f64 = pieces.iter().map(|piece| piece.curve.area()).sum();
        let perimeter: f64 = pieces.iter().map(|piece| piece.curve.length()).sum();
        let (loops, gap) = chain_up(pieces);
        Boundary { loops, area_mm2: area_mm2.max(0.0), error_bound_mm2: perimeter * (gap + 2.0 * LOOK_MM) }
    }

    /// The piece in the direction that has the region on its left; `None` if both sides are in it or neither.
    fn facing(&self, part: Curve) -> Option<Curve> {
        let (middle, left) = (part.at(0.5), part.left(0.5)?);
        let inside = |side: f64| self.contains(plus(middle, side * LOOK_MM, left));
        match (inside(1.0), inside(-1.0)) {
            (true, false) => Some(part),
            (false, true) => Some(part.reversed()),
            _ => None,
        }
    }
}

/// The parts of a curve between the places where the others meet it or end on it.
fn cut(curve: &Curve, index: usize, all: &[(Curve, Cause)]) -> Vec<Curve> {
    let mut shares = vec![0.0, 1.0];
    for (number, (other, _)) in all.iter().enumerate() {
        if number == index {
            continue;
        }
        let ends = [other.at(0.0), other.at(1.0)];
        for point in curve.meet(other).into_iter().chain(ends) {
            shares.extend(curve.share_of(point));
        }
    }
    shares.sort_by(f64::total_cmp);
    let length = curve.length();
    shares.dedup_by(|a, b| (*a - *b) * length < SAME_MM);
    if let Some(last) = shares.last_mut() {
        *last = 1.0;
    }
    shares.windows(2).map(|pair| curve.part(pair[0], pair[1])).collect()
}

/// Two pieces of one line or circle that two constraints share.
fn same(a: &Curve, b: &Curve) -> bool {
    [0.0, 0.5, 1.0].iter().all(|&share| distance(a.at(share), b.at(share)) < 2.0 * SAME_MM)
}

/// Pieces end to end, and the widest gap between two of them.
fn chain_up(mut pieces: Vec<Piece>) -> (Vec<Vec<Piece>>, f64) {
    let mut loops = Vec::new();
    let mut widest = 0.0_f64;
    while let Some(first) = pieces.first().copied() {
        pieces.remove(0);
        let start = first.curve.at(0.0);
        let mut chain = vec![first];
        let mut end = first.curve.at(1.0);
        loop {
            let home = distance(end, start);
            let next = pieces
                .iter()
                .enumerate()
                .map(|(index, piece)| (index, distance(end, piece.curve.at(0.0))))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            match next {
                Some((index, gap)) if gap < home => {
                    widest = widest.max(gap);
                    let piece = pieces.remove(index);
                    end = piece.curve.at(1.0);
                    chain.push(piece);
                }
                _ => {
                    widest = widest.max(home);
                    break;
                }
            }
        }
        loops.push(chain);
    }
    (loops, widest)
}

impl Boundary {
    /// The loops as polygons whose chords are at most `tolerance_mm` off the boundary.
    pub fn polygons(&self, tolerance_mm: f64) -> Vec<Vec<Vec2>> {
        let polygon = |chain: &Vec<Piece>| {
            let mut points = Vec::new();
            for piece in chain {
                piece.curve.points(tolerance_mm, &mut points);
            }
            points
        };
        self.loops.iter().map(polygon).collect()
    }

    /// The smallest box around it, mm; `None` if the set is empty.
    pub fn bounding_box(&self) -> Option<[Vec2; 2]> {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for point in self.loops.iter().flatten().flat_map(|piece| extremes(&piece.curve)) {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        (low[0] <= high[0]).then_some([low, high])
    }
}

/// The ends of a piece and the points at which it runs along an axis.
fn extremes(curve: &Curve) -> Vec<Vec2> {
    let mut points = vec![curve.at(0.0), curve.at(1.0)];
    if let Curve::Arc { centre, u, v, .. } = *curve {
        for axis in 0..2 {
            let angle = atan2(v[axis], u[axis]);
            for phi in [angle, angle + PI] {
                let point = plus(plus(centre, cos(phi), u), sin(phi), v);
                points.extend(curve.share_of(point).map(|_| point));
            }
        }
    }
    points
}
