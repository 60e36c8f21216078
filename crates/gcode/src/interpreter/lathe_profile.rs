//! Geometry of a lathe profile (G70 to G72.2): what must stay, as a height over the cutting direction.
//!
//! A point is `[t, v]`: `t` rises in the cutting direction, `v` away from the material. What a tool point may not enter is
//! the profile widened by the stock to leave: each segment gives the upper side of its widened shape, a straight piece or
//! an arc, and each corner a circle. The highest of all of them is where the tool may go, exactly: a [`Height`].

use alloc::vec::Vec;
use pkm_kins::maths;

/// `[t, v]`.
pub(super) type Point = [f64; 2];

/// Lengths below this are nothing (mm or inches).
pub(super) const TINY: f64 = 1e-6;
/// Stretches of `t` shorter than this are dropped.
const SLIVER: f64 = 1e-9;

/// One move of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub(super) from: Point,
    pub(super) to: Point,
    /// Centre, and true if counter-clockwise.
    pub(super) arc: Option<(Point, bool)>,
}

impl Segment {
    /// True if `t` never falls on the way.
    pub(super) fn rises(&self) -> bool {
        let goes_on = self.to[0] >= self.from[0] - TINY;
        match self.arc {
            None => goes_on,
            // The half of the circle that goes on: the upper one clockwise, the lower one counter-clockwise.
            Some((centre, ccw)) => {
                let side = if ccw { -1.0 } else { 1.0 };
                let above = |point: Point| side * (point[1] - centre[1]) >= -TINY;
                goes_on && self.to[0] - self.from[0] > TINY && above(self.from) && above(self.to)
            }
        }
    }

    /// The direction away from the material, at the begin or the end; length 1, or 0 for a move without length.
    pub(super) fn normal(&self, at_end: bool) -> Point {
        let [dt, dv] = match self.arc {
            None => [self.to[0] - self.from[0], self.to[1] - self.from[1]],
            Some((centre, ccw)) => {
                let at = if at_end { self.to } else { self.from };
                let radius = [at[0] - centre[0], at[1] - centre[1]];
                if ccw { [-radius[1], radius[0]] } else { [radius[1], -radius[0]] }
            }
        };
        let length = maths::hypot(dt, dv);
        if length > 0.0 { [-dv / length, dt / length] } else { [0.0; 2] }
    }
}

/// A point moved along a direction.
pub(super) fn moved(point: Point, direction: Point, distance: f64) -> Point {
    [point[0] + direction[0] * distance, point[1] + direction[1] * distance]
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Curve {
    Line { through: Point, slope: f64 },
    Arc { centre: Point, radius: f64, upper: bool },
}

impl Curve {
    fn at(&self, t: f64) -> f64 {
        match *self {
            Self::Line { through, slope } => through[1] + slope * (t - through[0]),
            Self::Arc { centre, radius, upper } => {
                let off = t - centre[0];
                let rise = maths::sqrt((radius * radius - off * off).max(0.0));
                if upper { centre[1] + rise } else { centre[1] - rise }
            }
        }
    }

    /// Where two curves may cross: of these, some may be on the other half of a circle.
    fn crossings(&self, other: &Self) -> [f64; 2] {
        const NONE: [f64; 2] = [f64::NAN; 2];
        match (*self, *other) {
            (Self::Line { through: a, slope: m }, Self::Line { through: b, slope: n }) => {
                let t = (b[1] - a[1] - n * b[0] + m * a[0]) / (m - n);
                if t.is_finite() { [t, f64::NAN] } else { NONE }
            }
            (Self::Line { through, slope }, Self::Arc { centre, radius, .. })
            | (Self::Arc { centre, radius, .. }, Self::Line { through, slope }) => {
                // The foot of the perpendicular from the centre, and half the chord to either side.
                let height = through[1] + slope * (centre[0] - through[0]) - centre[1];
                let scale = 1.0 + slope * slope;
                let foot = centre[0] - slope * height / scale;
                let rest = radius * radius - height * height / scale;
                let half = maths::sqrt(rest / scale);
                if rest >= 0.0 { [foot - half, foot + half] } else { NONE }
            }
            (Self::Arc { centre: a, radius: r, .. }, Self::Arc { centre: b, radius: s, .. }) => {
                let apart = maths::hypot(b[0] - a[0], b[1] - a[1]);
                if apart < SLIVER {
                    return NONE;
                }
                let along = (apart * apart + r * r - s * s) / (2.0 * apart);
                let rest = r * r - along * along;
                if rest < 0.0 {
                    return NONE;
                }
                let [dt, dv] = [(b[0] - a[0]) / apart, (b[1] - a[1]) / apart];
                let across = maths::sqrt(rest);
                [a[0] + along * dt - across * dv, a[0] + along * dt + across * dv]
            }
        }
    }
}

/// A curve over a stretch of `t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    from: f64,
    to: f64,
    curve: Curve,
}

impl Piece {
    fn flat(from: f64, to: f64, v: f64) -> Self {
        Self { from, to, curve: Curve::Line { through: [from, v], slope: 0.0 } }
    }

    pub(super) fn begin(&self) -> Point {
        [self.from, self.curve.at(self.from)]
    }

    pub(super) fn end(&self) -> Point {
        [self.to, self.curve.at(self.to)]
    }

    /// Centre of an arc, and true if it is counter-clockwise on the way.
    pub(super) fn arc(&self) -> Option<(Point, bool)> {
        match self.curve {
            Curve::Line { .. } => None,
            Curve::Arc { centre, upper, .. } => Some((centre, !upper)),
        }
    }

    /// Where a piece that only rises or only falls has a height.
    fn reach(&self, v: f64) -> f64 {
        let t = match self.curve {
            Curve::Line { through, slope } => through[0] + (v - through[1]) / slope,
            Curve::Arc { centre, radius, .. } => {
                let rise = v - centre[1];
                let off = maths::sqrt((radius * radius - rise * rise).max(0.0));
                if self.from + self.to < 2.0 * centre[0] { centre[0] - off } else { centre[0] + off }
            }
        };
        if t.is_finite() { t.max(self.from).min(self.to) } else { self.from }
    }

    fn part(&self, from: f64, to: f64) -> Self {
        Self { from, to, curve: self.curve }
    }
}

/// A pocket: where the profile lies below what a tool that only climbs can reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pocket {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) rim: f64,
}

/// The height that stays, over `t`: pieces from left to right without gaps; each only rises or only falls.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Height {
    pieces: Vec<Piece>,
}

impl Height {
    /// The height of a profile widened by `stock`, between two places.
    pub(super) fn of(profile: &[Segment], stock: f64, from: f64, to: f64) -> Self {
        let mut pieces = Vec::new();
        let mut add = |from: f64, to: f64, curve: Curve| {
            if to - from > SLIVER {
                pieces.push(Piece { from, to, curve });
            }
        };
        let Some(first) = profile.first() else { return Self::default() };
        let corners = core::iter::once(first.from).chain(profile.iter().map(|segment| segment.to));
        if stock > 0.0 {
            for corner in corners {
                let circle = Curve::Arc { centre: corner, radius: stock, upper: true };
                add(corner[0] - stock, corner[0] + stock, circle);
            }
        }
        for segment in profile {
            let (a, b) = (segment.from, segment.to);
            match segment.arc {
                None if b[0] - a[0] > SLIVER => {
                    let normal = segment.normal(false);
                    let (a, b) = (moved(a, normal, stock), moved(b, normal, stock));
                    let slope = (b[1] - a[1]) / (b[0] - a[0]);
                    add(a[0], b[0], Curve::Line { through: a, slope });
                }
                None => {}
                Some((centre, ccw)) => {
                    let old = maths::hypot(a[0] - centre[0], a[1] - centre[1]);
                    let radius = if ccw { old - stock } else { old + stock };
                    if radius > TINY && old > TINY {
                        let scaled = |t: f64| centre[0] + ((t - centre[0]) / old).clamp(-1.0, 1.0) * radius;
                        add(scaled(a[0]), scaled(b[0]), Curve::Arc { centre, radius, upper: !ccw });
                    }
                }
            }
        }
        // Before the profile nothing below its begin is cut.
        add(from, first.from[0], Curve::Line { through: first.from, slope: 0.0 });
        let mut height = Self { pieces: highest(&pieces) };
        height.trim(from, to);
        height
    }

    /// Keeps what lies between two places, split where it turns from rising to falling.
    fn trim(&mut self, from: f64, to: f64) {
        let mut kept = Vec::with_capacity(self.pieces.len());
        for piece in &self.pieces {
            let (a, b) = (piece.from.max(from), piece.to.min(to));
            if b - a <= SLIVER {
                continue;
            }
            match piece.curve {
                Curve::Arc { centre, .. } if a < centre[0] && centre[0] < b => {
                    kept.push(piece.part(a, centre[0]));
                    kept.push(piece.part(centre[0], b));
                }
                _ => kept.push(piece.part(a, b)),
            }
        }
        self.pieces = kept;
    }

    pub(super) fn lowest(&self) -> f64 {
        self.ends().fold(f64::INFINITY, f64::min)
    }

    pub(super) fn highest(&self) -> f64 {
        self.ends().fold(f64::NEG_INFINITY, f64::max)
    }

    fn ends(&self) -> impl Iterator<Item = f64> {
        self.pieces.iter().flat_map(|piece| [piece.begin()[1], piece.end()[1]])
    }

    /// The highest point between two places: its `t`.
    pub(super) fn peak(&self, from: f64, to: f64) -> f64 {
        let mut best = [from, f64::NEG_INFINITY];
        for piece in self.between(from, to) {
            for point in [piece.begin(), piece.end()] {
                if point[1] > best[1] {
                    best = point;
                }
            }
        }
        best[0]
    }

    /// The pieces between two places.
    pub(super) fn between(&self, from: f64, to: f64) -> impl Iterator<Item = Piece> {
        self.pieces
            .iter()
            .map(move |piece| piece.part(piece.from.max(from), piece.to.min(to)))
            .filter(|piece| piece.to - piece.from > SLIVER)
    }

    /// What a tool that only climbs leaves, and the pockets below it.
    pub(super) fn climb(&self) -> (Self, Vec<Pocket>) {
        let mut pieces: Vec<Piece> = Vec::with_capacity(self.pieces.len());
        let mut pockets: Vec<Pocket> = Vec::new();
        let mut rim = f64::NEG_INFINITY;
        for piece in &self.pieces {
            let (begin, end) = (piece.begin()[1], piece.end()[1]);
            rim = rim.max(begin);
            let climbs_at = match end > rim {
                false => piece.to,
                true if begin >= rim => piece.from,
                true => piece.reach(rim),
            };
            if climbs_at - piece.from > SLIVER {
                match pieces.last_mut() {
                    Some(last) if matches!(last.curve, Curve::Line { through, slope: 0.0 } if through[1] == rim) =>
                    {
                        last.to = climbs_at;
                    }
                    _ => pieces.push(Piece::flat(piece.from, climbs_at, rim)),
                }
                match pockets.last_mut() {
                    _ if begin.min(end) >= rim - SLIVER => {}
                    Some(pocket) if pocket.to >= piece.from - SLIVER && pocket.rim == rim => {
                        pocket.to = climbs_at;
                    }
                    _ => pockets.push(Pocket { from: piece.from, to: climbs_at, rim }),
                }
            }
            if piece.to - climbs_at > SLIVER {
                pieces.push(piece.part(climbs_at, piece.to));
            }
            rim = rim.max(end);
        }
        pockets.retain(|pocket| {
            let deepest = self.between(pocket.from, pocket.to).map(|p| p.begin()[1].min(p.end()[1]));
            deepest.fold(f64::INFINITY, f64::min) < pocket.rim - TINY
        });
        (Self { pieces }, pockets)
    }

    /// The stretches at a height where the tool may go.
    pub(super) fn free(&self, v: f64, from: f64, to: f64) -> Vec<[f64; 2]> {
        let mut free: Vec<[f64; 2]> = Vec::new();
        for piece in self.between(from, to) {
            let (begin, end) = (piece.begin()[1] <= v + SLIVER, piece.end()[1] <= v + SLIVER);
            let [a, b] = match (begin, end) {
                (true, true) => [piece.from, piece.to],
                (true, false) => [piece.from, piece.reach(v)],
                (false, true) => [piece.reach(v), piece.to],
                (false, false) => continue,
            };
            match free.last_mut() {
                Some(last) if a - last[1] <= SLIVER => last[1] = b,
                _ => free.push([a, b]),
            }
        }
        free.retain(|[a, b]| b - a > TINY);
        free
    }
}

/// The upper envelope of pieces: two halves, each its own envelope, then the higher of the two.
fn highest(pieces: &[Piece]) -> Vec<Piece> {
    if pieces.len() <= 1 {
        return pieces.to_vec();
    }
    let (left, right) = pieces.split_at(pieces.len() / 2);
    higher(&highest(left), &highest(right))
}

fn higher(a: &[Piece], b: &[Piece]) -> Vec<Piece> {
    let mut marks: Vec<f64> = a.iter().chain(b).flat_map(|piece| [piece.from, piece.to]).collect();
    marks.sort_unstable_by(f64::total_cmp);
    let mut found: Vec<Piece> = Vec::with_capacity(a.len() + b.len());
    let mut push = |from: f64, to: f64, curve: Curve| match found.last_mut() {
        Some(last) if last.curve == curve && last.to >= from - SLIVER => last.to = to,
        _ => found.push(Piece { from, to, curve }),
    };
    let (mut next_a, mut next_b) = (0, 0);
    for pair in marks.windows(2) {
        let &[from, to] = pair else { continue };
        if to <= from {
            continue;
        }
        let middle = from + (to - from) / 2.0;
        let over = |pieces: &[Piece], next: &mut usize| {
            while pieces.get(*next).is_some_and(|piece| piece.to <= middle) {
                *next += 1;
            }
            pieces.get(*next).filter(|piece| piece.from <= middle).map(|piece| piece.curve)
        };
        match (over(a, &mut next_a), over(b, &mut next_b)) {
            (None, None) => {}
            (Some(curve), None) | (None, Some(curve)) => push(from, to, curve),
            (Some(first), Some(second)) => {
                let mut cuts = first.crossings(&second);
                cuts.sort_unstable_by(f64::total_cmp);
                let mut begin = from;
                for end in cuts.into_iter().filter(|cut| *cut > from && *cut < to).chain([to]) {
                    let middle = begin + (end - begin) / 2.0;
                    let curve = if first.at(middle) >= second.at(middle) { first } else { second };
                    push(begin, end, curve);
                    begin = end;
                }
            }
        }
    }
    found
}
