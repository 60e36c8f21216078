//! The planar core: two P-R-R chains carry a platform that does not turn.
//!
//! MOMA and MOMA 4S are parameter sets of it; MOMA-W and the HV-Mill are built from those.
//!
//! Source: \[MOMA\] G. Vasilić, S. Živanović, Tehnika 71(1), 2016, 57–63, doi 10.5937/tehnika1601057V;
//! \[HV\] G. Vasilić, S. Živanović, M. Milutinović, Z. Dimić, "Kinematika kompleksne višeosne i viševretene mašine
//! alatke namenjene za proces obrade glodanjem". Several printed equations err; each correction is named where it stands.
//! Frame: fixed, right-handed, mm. Joint i = travel of slider i along its guide from its reference point.
//!
//! | here               | \[MOMA\]    | meaning                                              |
//! |--------------------|-----------|------------------------------------------------------|
//! | `direction`        | aᵢ        | unit vector of guide i                               |
//! | `reference_mm`     | Rᵢ        | place of the slider joint at pᵢ = 0                  |
//! | `offset_mm`        | –         | platform joint minus controlled point T (0 for MOMA) |
//! | `l_mm`             | lᵢ        | length of link i                                     |
//! | `working_mode`     | ± in (7)  | σᵢ, sign of the root of the inverse                  |
//! | `assembly`         | ± in (10) | s, side of T seen from the line of centres           |
//!
//! With the *virtual centre* Cᵢ = Rᵢ − oᵢ + pᵢ aᵢ, T is an intersection of two circles about C₁ and C₂.
//!
//! Inverse: closed form, \[MOMA\] (4), (7)–(9) with the root's sign as a parameter (the printed minus is wrong for
//!   configurations c and d) and without the cancelling difference B² − C.
//! Forward: intersection of two circles. \[MOMA\] (10)–(12) and \[HV\] (8), (9) divide by the difference of the centres' x,
//!   which vanishes at regular poses (sliders above each other); the circle form does not, so we depart from them.
//! Singular: link i at a right angle to guide i (type 1, wᵢ = 0); links parallel (type 2, X = 0).
//! Accuracy: forward(inverse(T)) within 1e-9 mm away from singularities; at wᵢ = 0 the square root leaves
//!   about l·√ε ≈ 3e-6 mm. Budget in `tests/budget.rs`.
//! Not modelled: collisions, the thickness of bodies (but see `one_sided`), elasticity.

mod machine;

pub(crate) use machine::planar_kinematics;

use crate::errors::{self, ForwardError, GeometryError, InverseError, Key, NoIntersection};
use crate::kinematics::{Branches, Singularity};
use crate::maths::{cos_sin_deg, fabs, sqrt, sqrt_2};
use crate::pair::{minus, plus, times};

/// A point or vector in the plane, mm.
pub type Vec2 = [f64; 2];

/// Velocity functions answer `Singular` where μᵢ or ν is below this.
pub const SINGULAR_GUARD: f64 = 1e-9;

/// Slack at the edge of reach, relative to l² or l₁ + l₂.
const EDGE: f64 = 1e-12;

/// The planar mechanism as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct PlanarParameters {
    /// Rᵢ: place of slider joint i at pᵢ = 0, mm.
    pub reference_mm: [Vec2; 2],
    /// αᵢ: direction of guide i, degrees from x.
    pub guide_angle_deg: [f64; 2],
    /// lᵢ: length of link i, mm.
    pub l_mm: [f64; 2],
    /// oᵢ: platform joint minus controlled point, mm.
    #[cfg_attr(feature = "serde", serde(default))]
    pub offset_mm: [Vec2; 2],
    /// σᵢ = ±1: sign of the root of the inverse.
    pub working_mode: [i8; 2],
    /// s = ±1: the sign of cross(C₂ − C₁, T − C₁).
    pub assembly: i8,
    /// Links may lie only on the inner side of their guides (\[MOMA\] figs 6b, 6d).
    #[cfg_attr(feature = "serde", serde(default))]
    pub one_sided: bool,
}

/// One chain, ready to run.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Chain {
    /// Virtual centre at p = 0: R − o.
    origin: Vec2,
    /// a
    direction: Vec2,
    /// l
    link: f64,
    /// σ
    mode: f64,
    /// m: the inner side of the guide.
    inward: f64,
    /// Slack at the edge of reach, −EDGE l².
    edge: f64,
}

/// A valid planar mechanism.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planar {
    chains: [Chain; 2],
    assembly: f64,
    /// s sin, s cos of the angle from guide 1 to guide 2.
    guides: Vec2,
    /// Slack of the assembly's side, −1e-9 l₁ l₂.
    edge: f64,
    /// l₁ + l₂ and l₁ − l₂.
    far: f64,
    fold: f64,
    /// Slack of d² at stretched links, at folded links; at most this: coincident centres. All mm².
    far_edge: f64,
    fold_edge: f64,
    near: f64,
    /// Platform joints minus T, which only pictures need.
    offsets: [Vec2; 2],
    one_sided: bool,
}

/// One chain as pictures and maps need it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarChain {
    /// Rᵢ: the slider's joint at pᵢ = 0, mm.
    pub reference_mm: Vec2,
    /// aᵢ: unit vector along the guide.
    pub direction: Vec2,
    /// oᵢ: platform joint minus controlled point, mm.
    pub offset_mm: Vec2,
    /// lᵢ, mm.
    pub link_mm: f64,
    /// σᵢ = ±1.
    pub working_mode: f64,
    /// mᵢ = ±1: the inner side of the guide is where mᵢ cross(aᵢ, T + oᵢ − Rᵢ) ≥ 0; 0 if it has none.
    pub inward: f64,
}

/// The solved inverse: everything the derivatives need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarState {
    /// p₁, p₂, mm.
    pub joints: [f64; 2],
    /// L₁, L₂: from virtual centre to T, mm.
    pub links: [Vec2; 2],
    /// wᵢ = aᵢ·Lᵢ, mm.
    pub along: [f64; 2],
}

#[inline]
fn cross(u: Vec2, v: Vec2) -> f64 {
    u[0] * v[1] - u[1] * v[0]
}

#[inline]
fn dot(u: Vec2, v: Vec2) -> f64 {
    u[0] * v[0] + u[1] * v[1]
}

#[inline]
fn sub(u: Vec2, v: Vec2) -> Vec2 {
    [u[0] - v[0], u[1] - v[1]]
}

/// u + k v
#[inline]
fn along(u: Vec2, k: f64, v: Vec2) -> Vec2 {
    [u[0] + k * v[0], u[1] + k * v[1]]
}

/// Not below zero; NaN becomes 0 as well.
#[inline]
fn clamp(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

impl Chain {
    /// B, N and d = l² − N²: T along the guide, off it, and what is left for the link. Out of reach unless d ≥ `edge`
    /// (NaN is out of reach, too).
    #[inline(always)]
    fn project(&self, t: Vec2) -> (f64, f64, f64) {
        let k = sub(t, self.origin);
        let n = cross(self.direction, k);
        (dot(self.direction, k), n, (self.link - fabs(n)) * (self.link + fabs(n)))
    }

    /// L = k − p a = N perp(a) − σ√d a
    #[inline(always)]
    fn link(&self, n: f64, root: f64) -> Vec2 {
        let a = self.direction;
        [-n * a[1] - root * a[0], n * a[0] - root * a[1]]
    }

    #[inline]
    fn distance(&self, t: Vec2) -> f64 {
        cross(self.direction, sub(t, self.origin))
    }
}

impl Planar {
    /// A mechanism from its parameters.
    ///
    /// # Errors
    /// `NotFinite`, `OutOfRange` (lengths beyond ±1e6 mm), `NotPositive` and `NotASign` name the parameter;
    /// `CoincidentRails` if both sliders run on one line in the same mode with equal links (or are one slider).
    pub fn new(p: &PlanarParameters) -> Result<Self, GeometryError> {
        let chain = |i: usize,
                     reference: Vec2,
                     angle: f64,
                     link: f64,
                     offset: Vec2,
                     mode: i8|
         -> Result<Chain, GeometryError> {
            let key = Key::at("reference_mm", i);
            let reference = [errors::coordinate(key, reference[0])?, errors::coordinate(key, reference[1])?];
            let key = Key::at("offset_mm", i);
            let offset = [errors::coordinate(key, offset[0])?, errors::coordinate(key, offset[1])?];
            let (c, s) = cos_sin_deg(errors::angle_deg(Key::at("guide_angle_deg", i), angle)?);
            Ok(Chain {
                origin: sub(reference, offset),
                direction: [c, s],
                link: errors::length(Key::at("l_mm", i), link)?,
                mode: errors::sign(Key::at("working_mode", i), mode)?,
                inward: 0.0,
                edge: 0.0,
            })
        };
        let [r1, r2] = p.reference_mm;
        let [a1, a2] = p.guide_angle_deg;
        let [l1, l2] = p.l_mm;
        let [o1, o2] = p.offset_mm;
        let [m1, m2] = p.working_mode;
        let mut first = chain(0, r1, a1, l1, o1, m1)?;
        let mut second = chain(1, r2, a2, l2, o2, m2)?;
        let assembly = errors::sign(Key::of("assembly"), p.assembly)?;

        // One rail: same line, both sliders on the same side of the platform.
        let between = sub(second.origin, first.origin);
        let facing = dot(first.direction, second.direction);
        let one_line = fabs(cross(first.direction, second.direction)) < 1e-9
            && fabs(cross(first.direction, between)) < 1e-6;
        let same_side = first.mode * second.mode * facing > 0.0;
        let one_place = fabs(between[0]) < 1e-6 && fabs(between[1]) < 1e-6 && facing > 0.0;
        if one_line && same_side && (one_place || fabs(l1 - l2) < 1e-6) {
            return Err(GeometryError::CoincidentRails);
        }

        // mᵢ = sign (nᵢ · (Rⱼ − Rᵢ)), from the true reference points.
        let inward = |c: &Chain, from: Vec2, to: Vec2| {
            let side = cross(c.direction, sub(to, from));
            if side > 0.0 {
                1.0
            } else if side < 0.0 {
                -1.0
            } else {
                0.0
            }
        };
        first.inward = inward(&first, r1, r2);
        second.inward = inward(&second, r2, r1);
        first.edge = -EDGE * l1 * l1;
        second.edge = -EDGE * l2 * l2;
        let (a1, a2) = (first.direction, second.direction);
        let guides = [assembly * cross(a1, a2), assembly * dot(a1, a2)];
        let (far, fold) = (l1 + l2, l1 - l2);
        Ok(Self {
            chains: [first, second],
            assembly,
            guides,
            edge: -1e-9 * l1 * l2,
            far,
            fold,
            far_edge: -2.0 * EDGE * far * far,
            fold_edge: -2.0 * EDGE * far * fabs(fold),
            near: EDGE * far * (EDGE * far),
            offsets: [o1, o2],
            one_sided: p.one_sided,
        })
    }

    /// The links' lengths, mm.
    pub fn links_mm(&self) -> [f64; 2] {
        [self.chains[0].link, self.chains[1].link]
    }

    /// Both chains.
    pub fn chains(&self) -> [PlanarChain; 2] {
        let ([c1, c2], [o1, o2]) = (&self.chains, self.offsets);
        [(c1, o1), (c2, o2)].map(|(c, offset)| PlanarChain {
            reference_mm: along(c.origin, 1.0, offset),
            direction: c.direction,
            offset_mm: offset,
            link_mm: c.link,
            working_mode: c.mode,
            inward: c.inward,
        })
    }

    /// s = ±1.
    pub fn assembly(&self) -> f64 {
        self.assembly
    }

    /// Links may lie only on the inner side of their guides.
    pub fn is_one_sided(&self) -> bool {
        self.one_sided
    }

    /// T (mm) → p₁, p₂ (mm).
    ///
    /// # Errors
    /// `NotFinite`; `OutOfReach` if T + oᵢ is farther than lᵢ from guide line i; `WrongAssembly`; `GuideSide` if
    /// the guides are one-sided. Travel is not checked.
    #[inline(always)]
    pub fn inverse(&self, t: Vec2) -> Result<[f64; 2], InverseError> {
        Ok(self.solve(t)?.joints)
    }

    /// The inverse with the links' vectors, for derivatives.
    ///
    /// # Errors
    /// As [`Self::inverse`].
    #[inline(always)]
    pub fn solve(&self, t: Vec2) -> Result<PlanarState, InverseError> {
        let [c1, c2] = &self.chains;
        // Both chains side by side: two roots take the time of one.
        let ((b1, n1, d1), (b2, n2, d2)) = (c1.project(t), c2.project(t));
        if !(d1 >= c1.edge && d2 >= c2.edge) {
            return Err(self.out_of_reach(t));
        }
        let [root1, root2] = sqrt_2([clamp(d1), clamp(d2)]);
        let (root1, root2) = (c1.mode * root1, c2.mode * root2);
        // s cross(C₂ − C₁, T − C₁) = s cross(L₁ − L₂, L₁) = s cross(L₁, L₂), L by L in the frame of its guide
        let [sine, cosine] = self.guides;
        let side = sine * (n1 * n2 + root1 * root2) + cosine * (n1 * root2 - n2 * root1);
        if !(side >= self.edge) {
            return Err(InverseError::WrongAssembly { mechanism: None });
        }
        let (l1, l2) = (c1.link(n1, root1), c2.link(n2, root2));
        if self.one_sided
            && let Some((chain, excess_mm)) = self.guide_side([n1, n2])
        {
            return Err(InverseError::GuideSide { mechanism: None, chain, excess_mm });
        }
        Ok(PlanarState { joints: [b1 + root1, b2 + root2], links: [l1, l2], along: [-root1, -root2] })
    }

    #[cold]
    fn out_of_reach(&self, t: Vec2) -> InverseError {
        if !(t[0].is_finite() && t[1].is_finite()) {
            return InverseError::NotFinite;
        }
        let [c1, c2] = &self.chains;
        let (chain, c) = if c1.project(t).2 >= c1.edge { (1, c2) } else { (0, c1) };
        let deficit = fabs(c.distance(t)) - c.link;
        // Far beyond 1e154 mm the distance itself overflows.
        InverseError::OutOfReach { mechanism: None, chain, deficit_mm: deficit.min(f64::MAX) }
    }

    /// One-sided guides want mᵢ Nᵢ ≥ 0: the first chain on the outer side, and how far (mm).
    #[inline]
    fn guide_side(&self, [n1, n2]: Vec2) -> Option<(u8, f64)> {
        let [side1, side2] = [self.chains[0].inward * n1, self.chains[1].inward * n2];
        if side1 < -1e-9 {
            Some((0, -side1))
        } else if side2 < -1e-9 {
            Some((1, -side2))
        } else {
            None
        }
    }

    /// p₁, p₂ (mm) → T (mm), in the configured assembly mode.
    ///
    /// # Errors
    /// `NotFinite`; `NoIntersection`; `WrongWorkingMode` if the pose found has the other root in the inverse;
    /// `GuideSide` if the guides are one-sided. Travel is not checked.
    #[inline(always)]
    pub fn forward(&self, p: [f64; 2]) -> Result<Vec2, ForwardError> {
        let (t, links) = self.intersect(p, self.assembly)?;
        for ((c, l), chain) in self.chains.iter().zip(links).zip(0u8..) {
            if !(c.mode * dot(c.direction, l) <= 1e-9 * c.link) {
                return Err(ForwardError::WrongWorkingMode { mechanism: None, chain });
            }
        }
        if self.one_sided
            && let [c1, c2] = &self.chains
            && let Some((chain, excess_mm)) = self.guide_side([c1.distance(t), c2.distance(t)])
        {
            return Err(ForwardError::GuideSide { mechanism: None, chain, excess_mm });
        }
        Ok(t)
    }

    /// The circles' intersection on one side of the line of centres, and the two link vectors.
    #[inline(always)]
    fn intersect(&self, p: [f64; 2], side: f64) -> Result<(Vec2, [Vec2; 2]), ForwardError> {
        let [a, b] = &self.chains;
        let c1 = along(a.origin, p[0], a.direction);
        let span = sub(along(b.origin, p[1], b.direction), c1);
        // d², and what it is short of stretched and past folded links. All NaN and infinities end in the error.
        let d2 = dot(span, span);
        let (stretched, folded) = (self.far * self.far - d2, d2 - self.fold * self.fold);
        if !(stretched >= self.far_edge && folded >= self.fold_edge && d2 > self.near) {
            return Err(self.no_intersection(p, d2));
        }
        // L₁ = f e + h perp(e) with e = span/d; f/d and h/d need no root of d².
        let f = 0.5 + 0.5 * (self.fold * self.far) / d2;
        let h = side * sqrt(clamp(stretched) * clamp(folded)) / (2.0 * d2);
        let link1 = [f * span[0] - h * span[1], f * span[1] + h * span[0]];
        Ok((along(c1, 1.0, link1), [link1, sub(link1, span)]))
    }

    #[cold]
    fn no_intersection(&self, p: [f64; 2], d2: f64) -> ForwardError {
        if !(p[0].is_finite() && p[1].is_finite()) {
            return ForwardError::NotFinite;
        }
        let reason = if d2 <= self.near {
            NoIntersection::Coincident
        } else if d2 < self.far * self.far {
            NoIntersection::TooClose
        } else {
            NoIntersection::TooFar
        };
        ForwardError::NoIntersection { mechanism: None, reason }
    }

    /// K = ∂p/∂T at a solved state: rows joints, dimensionless.
    ///
    /// # Errors
    /// `Singular` where a link is perpendicular to its guide (μᵢ below [`SINGULAR_GUARD`]).
    pub fn rates(&self, state: &PlanarState) -> Result<[Vec2; 2], InverseError> {
        self.guard(state)?;
        let [l1, l2] = state.links;
        let [w1, w2] = state.along;
        Ok([[l1[0] / w1, l1[1] / w1], [l2[0] / w2, l2[1] / w2]])
    }

    /// G = ∂T/∂p at a solved state: rows x, y. \[MOMA\] (17)–(21) with the sign put right: ṗ = +K Ṫ, G = K⁻¹.
    ///
    /// # Errors
    /// `Singular` where the links are parallel (ν below [`SINGULAR_GUARD`]).
    pub fn forward_rates(&self, state: &PlanarState) -> Result<[Vec2; 2], InverseError> {
        let [l1, l2] = state.links;
        let [w1, w2] = state.along;
        let x = cross(l1, l2);
        let nu = fabs(x) / (self.chains[0].link * self.chains[1].link);
        if !(nu >= SINGULAR_GUARD) {
            return Err(InverseError::Singular { measure: nu });
        }
        Ok([[l2[1] * w1 / x, -l1[1] * w2 / x], [-l2[0] * w1 / x, l1[0] * w2 / x]])
    }

    #[inline]
    fn guard(&self, state: &PlanarState) -> Result<(), InverseError> {
        let [w1, w2] = state.along;
        let [c1, c2] = &self.chains;
        if fabs(w1) >= SINGULAR_GUARD * c1.link && fabs(w2) >= SINGULAR_GUARD * c2.link {
            return Ok(());
        }
        Err(InverseError::Singular { measure: (fabs(w1) / c1.link).min(fabs(w2) / c2.link) })
    }

    /// p, ṗ, p̈ for T moving with `velocity` and `acceleration`, the planner's call: ṗᵢ = Lᵢ·Ṫ / wᵢ and
    /// p̈ᵢ = (Lᵢ·T̈ + |Ṫ − aᵢ ṗᵢ|²) / wᵢ.
    ///
    /// # Errors
    /// As [`Self::inverse`] and [`Self::rates`]; `NotFinite` if a rate is not finite.
    #[inline]
    pub fn motion_2(
        &self,
        t: Vec2,
        velocity: Vec2,
        acceleration: Vec2,
    ) -> Result<[[f64; 2]; 3], InverseError> {
        let state = self.solve(t)?;
        self.guard(&state)?;
        // Both chains side by side: x of both, y of both.
        let ([l1, l2], [c1, c2]) = (state.links, &self.chains);
        let (lx, ly) = ([l1[0], l2[0]], [l1[1], l2[1]]);
        let (gx, gy) = ([c1.direction[0], c2.direction[0]], [c1.direction[1], c2.direction[1]]);
        let ([vx, vy], [ax, ay]) = (velocity.map(|v| [v, v]), acceleration.map(|a| [a, a]));
        let part = state.along.map(|w| 1.0 / w);
        let rate = times(plus(times(lx, vx), times(ly, vy)), part);
        let (turn_x, turn_y) = (minus(vx, times(rate, gx)), minus(vy, times(rate, gy)));
        let pull = plus(times(lx, ax), times(ly, ay));
        let second = times(plus(pull, plus(times(turn_x, turn_x), times(turn_y, turn_y))), part);
        let size = second.map(fabs);
        if !(size[0] < f64::INFINITY && size[1] < f64::INFINITY) {
            return Err(InverseError::NotFinite);
        }
        Ok([state.joints, rate, second])
    }

    /// μᵢ = |wᵢ|/lᵢ and ν = |X|/(l₁ l₂).
    pub fn measures(&self, state: &PlanarState) -> Singularity {
        let [c1, c2] = &self.chains;
        let mu1 = fabs(state.along[0]) / c1.link;
        let mu2 = fabs(state.along[1]) / c2.link;
        let forward = fabs(cross(state.links[0], state.links[1])) / (c1.link * c2.link);
        let (inverse, inverse_joint) = if mu2 < mu1 { (mu2, 1) } else { (mu1, 0) };
        Singularity { inverse, inverse_joint, forward }
    }

    /// p₁, p₂ of every working mode that reaches T, the configured one first; empty out of reach.
    pub fn inverse_all(&self, t: Vec2) -> Branches<[f64; 2]> {
        let mut all = Branches::new();
        let [c1, c2] = &self.chains;
        let ((b1, _, d1), (b2, _, d2)) = (c1.project(t), c2.project(t));
        if d1 >= c1.edge && d2 >= c2.edge {
            let (root1, root2) = (c1.mode * sqrt(clamp(d1)), c2.mode * sqrt(clamp(d2)));
            for (m1, m2) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                all.push([b1 + m1 * root1, b2 + m2 * root2]);
            }
        }
        all
    }

    /// T of both assembly modes, the configured one first; empty where the circles do not meet.
    pub fn forward_all(&self, p: [f64; 2]) -> Branches<Vec2> {
        let mut all = Branches::new();
        for side in [self.assembly, -self.assembly] {
            if let Ok((t, _)) = self.intersect(p, side) {
                all.push(t);
            }
        }
        all
    }
}
