//! Crossings: when, within a servo period, a joint passes the half-step positions k + ½.
//!
//! Between two servo ticks the position is the cubic Hermite through position and velocity at both ends. In local
//! units (u from 0 to 1 over the period, r in steps from the step at which the period begins):
//!
//! ```text
//! r(u) = r₀ + m₀ u + (3d − 2m₀ − m₁) u² + (m₀ + m₁ − 2d) u³       d = r₁ − r₀,  mᵢ = velocity × period
//! ```
//!
//! 1. Positions are held on a grid of 2⁻²⁸ step, in an integer: noise of the planner's last bits near a half-step
//!    position causes no steps, and the step that belongs to a position, ⌊p + ½⌋, is exact (an exact half rounds up).
//! 2. The cubic is cut where r' = 0; in each piece the crossings are found in order, each bracketed by the one before
//!    and the piece's end, so every search is bounded.
//! 3. After a period the count **is** ⌊p + ½⌋ of the commanded position: by construction, not by following.
//!
//! A turning point that passes a half-step position by less than [`TURN_TOLERANCE`] and comes back within the same
//! period is not worth two steps and makes none; between servo ticks the count may so be off by ½ + 1/128 step.
//!
//! Cost: four divisions per joint and period, none per step while the speed changes little, one to three near rest.

use crate::timing::Period;

/// Fraction bits of a position in steps.
const FRACTION_BITS: u32 = 28;
const ONE: f64 = (1_i64 << FRACTION_BITS) as f64;
const HALF: i64 = 1 << (FRACTION_BITS - 1);

/// The largest position, in steps, that is accepted: 2³².
pub const MAX_STEPS: f64 = 4_294_967_296.0;

/// How far a turning point must pass a half-step position to be worth two steps.
pub const TURN_TOLERANCE: f64 = 1.0 / 128.0;

/// Why a target is refused. The state is then unchanged and no edge was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EdgeError {
    /// Position or velocity is NaN or infinite.
    NotFinite,
    /// A position beyond ±[`MAX_STEPS`].
    OutOfRange {
        /// Where the joint should go, steps.
        steps: f64,
    },
    /// More steps in one period than the pulse timing allows.
    TooFast {
        /// Steps asked for in this period.
        steps: u64,
        /// Steps the timing allows.
        max: u64,
    },
    /// Earlier delays have piled up to more than a period.
    Late {
        /// Timer ticks between the beginning of the period and the next time at which a step is possible.
        delay: u64,
    },
}

impl core::fmt::Display for EdgeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::NotFinite => write!(f, "position or velocity is not a finite number"),
            Self::OutOfRange { steps } => write!(f, "position of {steps} steps is beyond 2^32 steps"),
            Self::TooFast { steps, max } => {
                write!(f, "{steps} steps in one servo period, the pulse timing allows {max}")
            }
            Self::Late { delay } => write!(f, "steps are {delay} timer ticks late, more than a servo period"),
        }
    }
}

impl core::error::Error for EdgeError {}

/// The commanded path of one joint over one period, steps from `base`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cubic {
    /// The step at which the period begins.
    pub base: i64,
    c0: f64,
    c1: f64,
    c2: f64,
    c3: f64,
}

impl Cubic {
    /// Position at `u` in [0, 1], steps from `base`.
    #[inline]
    pub fn at(&self, u: f64) -> f64 {
        self.c0 + u * (self.c1 + u * (self.c2 + u * self.c3))
    }

    #[inline]
    fn slope(&self, u: f64) -> f64 {
        self.c1 + u * (2.0 * self.c2 + u * (3.0 * self.c3))
    }

    /// The turning points in (0, 1), ascending.
    fn turns(&self) -> [Option<f64>; 2] {
        // a u² + 2 b u + c = 0 in the form without cancellation
        let (a, b, c) = (3.0 * self.c3, self.c2, self.c1);
        let discriminant = b * b - a * c;
        if discriminant.is_nan() || discriminant <= 0.0 {
            return [None, None];
        }
        let root = libm::sqrt(discriminant); // correctly rounded: the same everywhere
        let q = if b > 0.0 { -(b + root) } else { root - b };
        let inside = |numerator: f64, denominator: f64| {
            let u = numerator / denominator; // 0/0 and x/0 fail the comparison
            (u > 0.0 && u < 1.0).then_some(u)
        };
        match (inside(q, a), inside(c, q)) {
            (Some(first), Some(second)) if first > second => [Some(second), Some(first)],
            (Some(first), Some(second)) => [Some(first), Some(second)],
            (first, second) => [first.or(second), None],
        }
    }
}

/// A stretch of a cubic without turning point: from `u0` to `u1`, counts `from` to `to` (relative to the base).
#[derive(Debug, Clone, Copy, Default)]
struct Piece {
    u0: f64,
    u1: f64,
    from: i64,
    to: i64,
    /// All its crossings lie at `u0`: missed for the tolerance at the turning point.
    at_start: bool,
}

/// Where a joint is commanded to be, and the step that belongs to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossings {
    /// Commanded position, 2⁻²⁸ steps.
    position: i64,
    /// steps/s
    velocity: f64,
    cubic: Cubic,
}

/// Position in steps → the grid, rounded half up.
fn on_grid(steps: f64) -> Result<i64, EdgeError> {
    if !steps.is_finite() {
        return Err(EdgeError::NotFinite);
    }
    if !(-MAX_STEPS..=MAX_STEPS).contains(&steps) {
        return Err(EdgeError::OutOfRange { steps });
    }
    Ok(round_half_up(steps * ONE))
}

/// ⌊x + ½⌋ without the rounding of the sum; |x| < 2⁶².
#[inline]
fn round_half_up(x: f64) -> i64 {
    let towards_zero = x as i64;
    let rest = x - towards_zero as f64; // exact: beyond 2⁵³ there is no fraction
    if rest >= 0.5 {
        towards_zero + 1
    } else if rest < -0.5 {
        towards_zero - 1
    } else {
        towards_zero
    }
}

/// The step that belongs to a position on the grid.
#[inline]
const fn step_of(position: i64) -> i64 {
    (position + HALF) >> FRACTION_BITS
}

impl Crossings {
    /// A joint at rest at `position` (steps).
    ///
    /// # Errors
    /// `NotFinite`, `OutOfRange`.
    pub fn new(position: f64) -> Result<Self, EdgeError> {
        let position = on_grid(position)?;
        Ok(Self { position, velocity: 0.0, cubic: Cubic::default() })
    }

    /// The step that belongs to the commanded position: ⌊p + ½⌋.
    pub const fn count(&self) -> i64 {
        step_of(self.position)
    }

    /// The commanded position on the grid of 2⁻²⁸ step, steps.
    pub fn position(&self) -> f64 {
        self.position as f64 / ONE
    }

    /// Commanded position less `count`, steps; exact.
    pub fn offset(&self, count: i64) -> f64 {
        self.position.wrapping_sub(count << FRACTION_BITS) as f64 / ONE
    }

    /// The commanded path of the last period.
    pub const fn cubic(&self) -> &Cubic {
        &self.cubic
    }

    /// Moves to `position` (steps) on a straight line: for commands without velocity. Otherwise as [`Self::advance`].
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn advance_straight(
        &mut self,
        position: f64,
        period: &Period,
        max_steps: u64,
        emit: &mut impl FnMut(u64, bool),
    ) -> Result<(), EdgeError> {
        let before = *self;
        self.velocity = (on_grid(position)? - self.position) as f64 / ONE / period.seconds();
        let result = self.advance(position, self.velocity, period, max_steps, emit);
        if result.is_err() {
            *self = before;
        }
        result
    }

    /// Moves to `position` (steps), reached with `velocity` (steps/s) at the end of `period`; `emit(time, forward)`
    /// receives every crossing in order, times in (start, end].
    ///
    /// # Errors
    /// `NotFinite`, `OutOfRange`, `TooFast` if there would be more than `max_steps` crossings. Nothing is changed then.
    pub fn advance(
        &mut self,
        position: f64,
        velocity: f64,
        period: &Period,
        max_steps: u64,
        emit: &mut impl FnMut(u64, bool),
    ) -> Result<(), EdgeError> {
        let target = on_grid(position)?;
        let (m0, m1) = (self.velocity * period.seconds(), velocity * period.seconds());
        if !m1.is_finite() {
            return Err(EdgeError::NotFinite);
        }
        let base = self.count();
        let r0 = self.offset(base);
        let d = (target - self.position) as f64 / ONE;
        // no cubic with such a slope stays within the steps allowed; also keeps the coefficients finite
        let wildest = m0.abs().max(m1.abs()).max(d.abs());
        if wildest.is_nan() || wildest > 64.0 * (max_steps as f64 + 1.0) {
            return Err(EdgeError::TooFast { steps: wildest as u64, max: max_steps });
        }
        let cubic = Cubic { base, c0: r0, c1: m0, c2: 3.0 * d - 2.0 * m0 - m1, c3: (m0 + m1) - 2.0 * d };
        let end = step_of(target) - base;

        // Monotone if the slopes have d's sign and are at most 3d (the square of de Boor and Swartz).
        let monotone = (d >= 0.0 && m0 >= 0.0 && m1 >= 0.0 && m0 <= 3.0 * d && m1 <= 3.0 * d)
            || (d <= 0.0 && m0 <= 0.0 && m1 <= 0.0 && m0 >= 3.0 * d && m1 >= 3.0 * d);
        if monotone {
            if end.unsigned_abs() > max_steps {
                return Err(EdgeError::TooFast { steps: end.unsigned_abs(), max: max_steps });
            }
            if end != 0 {
                let piece = Piece { u0: 0.0, u1: 1.0, from: 0, to: end, at_start: false };
                // nearly straight: the slopes differ from d by 2⁻²⁰, the crossing by 2⁻²² of the period at most
                if (m0 - d).abs() + (m1 - d).abs() <= d.abs() / 1_048_576.0 {
                    emit_straight(r0, d, &piece, period, emit);
                } else if let Some(inverse) = Inverse::new(d, m0, m1, period) {
                    emit_gentle(&cubic, &inverse, &piece, period, emit);
                } else {
                    emit_piece(&cubic, &piece, period, emit);
                }
            }
        } else if end != 0 || leaves_step(r0, d, m0, m1) {
            let (pieces, steps) = cut(&cubic, end);
            if steps > max_steps {
                return Err(EdgeError::TooFast { steps, max: max_steps });
            }
            for piece in &pieces {
                emit_piece(&cubic, piece, period, emit);
            }
        }
        self.position = target;
        self.velocity = velocity;
        self.cubic = cubic;
        Ok(())
    }
}

/// Whether the hull of the cubic's Bézier points leaves [−½, ½].
fn leaves_step(r0: f64, d: f64, m0: f64, m1: f64) -> bool {
    let (near, far) = (r0 + m0 / 3.0, r0 + d - m1 / 3.0);
    !(near.abs() < 0.5 && far.abs() < 0.5)
}

/// Cuts at the turning points. The last piece ends at count `end` whatever the turning points did.
fn cut(cubic: &Cubic, end: i64) -> ([Piece; 3], u64) {
    let mut pieces = [Piece::default(); 3];
    let (mut u0, mut from) = (0.0, 0);
    let mut steps = 0;
    let turns = cubic.turns();
    for (piece, u1) in pieces.iter_mut().zip([turns[0], turns[1], Some(1.0)]) {
        let Some(u1) = u1 else { continue };
        let last = u1 == 1.0;
        let rising = cubic.slope(0.5 * (u0 + u1)) > 0.0;
        let to = if last {
            end
        } else {
            let short = if rising { -TURN_TOLERANCE } else { TURN_TOLERANCE };
            let reached = round_half_up(cubic.at(u1) + short);
            if rising { reached.max(from) } else { reached.min(from) }
        };
        *piece = Piece { u0, u1, from, to, at_start: last && (to > from) != rising };
        steps += to.abs_diff(from);
        (u0, from) = (u1, to);
    }
    (pieces, steps)
}

/// The inverse of a cubic whose slope changes little, as a cubic Hermite in y = (r − r₀)/d with the slopes d/m₀ and d/m₁.
#[derive(Clone, Copy)]
struct Inverse {
    per_d: f64,
    c1: f64,
    c2: f64,
    c3: f64,
    /// Steps by which the cubic may miss the level for the guess to be good within about 1/64 timer tick.
    tolerance: f64,
}

impl Inverse {
    /// None if the slope changes too much for it to be worth it.
    fn new(d: f64, m0: f64, m1: f64, period: &Period) -> Option<Self> {
        let gentle = |m: f64| m.abs() > 0.5 * d.abs() && m.abs() < 2.0 * d.abs();
        if !(gentle(m0) && gentle(m1)) {
            return None;
        }
        let (per_d, s0, s1) = (1.0 / d, d / m0, d / m1);
        let tolerance = 0.5 * d.abs() * enough(period);
        Some(Self { per_d, c1: s0, c2: 3.0 - 2.0 * s0 - s1, c3: s0 + s1 - 2.0, tolerance })
    }

    #[inline]
    fn at(&self, r: f64) -> f64 {
        let y = r * self.per_d;
        y * (self.c1 + y * (self.c2 + y * self.c3))
    }
}

/// Error of u that does not matter: 1/64 timer tick.
#[inline]
fn enough(period: &Period) -> f64 {
    1.0 / (64.0 * f64::from(period.ticks()))
}

#[inline]
fn time_of(u: f64, period: &Period) -> u64 {
    let ticks = period.ticks();
    // u in [0, 1], ticks < 2³¹: the cast cannot overflow
    let after = ((u * f64::from(ticks) + 0.5) as u32).clamp(1, ticks);
    period.start().saturating_add(u64::from(after))
}

/// The half-step position between `k` and the next step in the direction.
#[inline]
fn level(k: i64, rising: bool) -> f64 {
    if rising { k as f64 + 0.5 } else { k as f64 - 0.5 }
}

fn emit_straight(r0: f64, d: f64, piece: &Piece, period: &Period, emit: &mut impl FnMut(u64, bool)) {
    let rising = piece.to > piece.from;
    let per_d = 1.0 / d;
    let mut k = piece.from;
    while k != piece.to {
        let u = (level(k, rising) - r0) * per_d;
        emit(time_of(u.clamp(0.0, 1.0), period), rising);
        k += if rising { 1 } else { -1 };
    }
}

/// The whole period, monotone and gentle: the inverse where it is good enough, else the search.
fn emit_gentle(
    cubic: &Cubic,
    inverse: &Inverse,
    piece: &Piece,
    period: &Period,
    emit: &mut impl FnMut(u64, bool),
) {
    let rising = piece.to > piece.from;
    let mut k = piece.from;
    while k != piece.to {
        let level = level(k, rising);
        let mut u = inverse.at(level - cubic.c0);
        let off = (cubic.at(u) - level).abs();
        if off.is_nan() || off > inverse.tolerance {
            u = solve(cubic, level, rising, 0.0, 1.0, u, period);
        }
        emit(time_of(u, period), rising);
        k += if rising { 1 } else { -1 };
    }
}

/// Any monotone piece: each crossing lies between the one before and the end.
fn emit_piece(cubic: &Cubic, piece: &Piece, period: &Period, emit: &mut impl FnMut(u64, bool)) {
    let rising = piece.to > piece.from;
    let mut k = piece.from;
    let mut lo = piece.u0;
    let mut at_lo = cubic.at(lo);
    let at_end = cubic.at(piece.u1);
    while k != piece.to {
        if !piece.at_start {
            let level = level(k, rising);
            // on the secant of what is left
            let guess = lo + (piece.u1 - lo) * ((level - at_lo) / (at_end - at_lo));
            lo = solve(cubic, level, rising, lo, piece.u1, guess, period);
            at_lo = level;
        }
        emit(time_of(lo, period), rising);
        k += if rising { 1 } else { -1 };
    }
}

/// Where the cubic, monotone in [lo, hi], passes `level`. Safeguarded Newton: a step that leaves the bracket is
/// replaced by its middle. State: bracket [lo, hi] with the crossing inside, or at the end that rounding left nearer.
/// Ends when the step is below 1/64 timer tick; at most 64 evaluations, for from the ninth on the bracket is halved.
fn solve(
    cubic: &Cubic,
    level: f64,
    rising: bool,
    mut lo: f64,
    mut hi: f64,
    guess: f64,
    period: &Period,
) -> f64 {
    let enough = enough(period);
    let mut u = guess;
    for iteration in 0..64 {
        if iteration >= 8 || !(lo..=hi).contains(&u) {
            u = 0.5 * (lo + hi);
        }
        let residual = cubic.at(u) - level;
        if (residual < 0.0) == rising {
            lo = u;
        } else {
            hi = u;
        }
        let step = residual / cubic.slope(u);
        let next = u - step;
        if step.abs() <= enough {
            return next.clamp(lo, hi);
        }
        if hi - lo <= enough {
            return hi;
        }
        u = next;
    }
    u.clamp(lo, hi)
}
