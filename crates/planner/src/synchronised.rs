//! Motion in step with the spindle: threads (G33, G76) and rigid taps (G33.1).
//!
//! A *chain* is what the program moves in step without a break: the tool waits at its start until the spindle is at speed
//! and then for its index, sets off as fast as the joints may, catches up, and from then on
//! `place = travel per turn × turns since the index`. (LinuxCNC keeps the lag of the start and shifts the thread by it; here the
//! thread begins at the index whatever the speed.) The next chain starts at the index again, so passes meet.
//!
//! All along a chain one speed (of each stretch) and one acceleration keep every joint within its limits: with q′ and q″ along
//! the path, |q′| v ≤ v_max and |q″| v² ≤ a_max / 2, and what that leaves of a_max over |q′| is the acceleration. The tool may
//! always still stop before the end of the chain; the stretch on which it brakes for it is not in step.
//!
//! A rigid tap turns the spindle round so early that it comes to rest at the bottom, follows its real turns throughout, and
//! likewise at the top. Feed hold and overrides do not reach a chain; an abort does.
//!
//! The law that catches up and brakes: with A the acceleration and T the period, the states that whole periods at ±A bring to
//! rest on the target are n² A T²/2 away with speed n A T; between them the border is straight. Each period the speed is chosen
//! that is on that border at its end. No limit is exceeded, nothing overshoots, and rest is met exactly.

use crate::limits::{Feed, Limits, Sample, Spot};
use crate::path::{Blend, FeedGroup, Geometry, combine};
use crate::planner::{PathMode, Piece, Setpoint, State};
use crate::{PlanError, PlanErrorKind};
use pkm_canon::Span;
use pkm_kins::maths::{floor, sqrt};
use pkm_kins::{Kinematics, Pose};

/// Share of what the joints can do that a spindle may ask for; the rest is for catching up.
pub const RESERVE: f64 = 0.9;
/// Share of the acceleration that the tool approaches the spindle with; the rest is for a spindle that itself speeds up or slows down.
const APPROACH: f64 = 0.8;
/// Nearer than this the tool is in step, mm or rad.
const IN_STEP: f64 = 1e-5;
/// Nearer than this it has arrived.
const ARRIVED: f64 = 1e-9;
/// Distance between the places where the joints are asked, and bounds for their number.
const SPACING: f64 = 0.25;
const SAMPLES: (f64, f64) = (16.0, 4000.0);
/// For what happens between them.
const GUARD: f64 = 0.995;

/// A move in step with the spindle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SynchronisedMove {
    /// Its shape; it must start where the one before ended.
    pub geometry: Geometry,
    /// Travel for each turn, mm (rad where only angles move), above 0.
    pub per_turn: f64,
    /// How it joins the next one of its chain: at rest, or blended.
    pub mode: PathMode,
    /// Turns a second asked for when it was programmed.
    pub turns_s: f64,
    /// The move's number, for setpoints.
    pub motion: u32,
    /// The block.
    pub span: Span,
}

/// What makes a chain a rigid tap: one move, in and out again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tap {
    /// Speed of the spindle on the way out over that on the way in.
    pub retract_scale: f64,
    /// How fast the spindle speeds up and slows down, turns/s².
    pub spindle_rate: f64,
}

/// What the spindle tells at the beginning of a servo period. Turns count in the direction in which it turns for the chain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpindleReading {
    /// Turns since the index that was waited for.
    pub turns: f64,
    /// Turns a second.
    pub turns_s: f64,
    /// As fast as commanded.
    pub at_speed: bool,
    /// Still waiting for the index.
    pub index_enable: bool,
}

/// How far a chain is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// At its start, waiting for the spindle to be at speed.
    AtSpeed,
    /// At its start, waiting for the index.
    Index,
    /// Following the spindle: along the thread, or into the hole.
    Inward,
    /// A tap's way out: the spindle slows down, turns the other way.
    Outward,
    /// It slows down again at the top.
    Top,
    /// Out of step: the last hundredths back to the start of a tap, or an abort.
    Settling,
    /// At rest for good.
    Over,
}

/// How fast a path may be followed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pace {
    speed: f64,
    acceleration: f64,
}

/// A move of the chain or a blend between two, as far as it is driven.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    geometry: Geometry,
    /// Where on the geometry it begins.
    from: f64,
    /// Where on the chain it begins and ends.
    start: f64,
    end: f64,
    /// Turns at its start, and travel for each.
    turns: f64,
    per_turn: f64,
    /// Largest speed on it; largest speed² at its end.
    speed: f64,
    exit: f64,
    /// At rest at its end.
    stop: bool,
    corner: bool,
    motion: u32,
    span: Span,
}

/// A chain under way; at most `N` moves and blends.
#[derive(Debug, Clone)]
pub struct Synchronised<const N: usize> {
    stretches: heapless::Vec<Stretch, N>,
    acceleration: f64,
    period_s: f64,
    tap: Option<Tap>,
    stage: Stage,
    /// Place on the chain and speed at the beginning and at the end of the period.
    before: (f64, f64),
    now: (f64, f64),
    /// Stretch of `now`, and that of the target.
    here: usize,
    target: usize,
    turns_s_before: Option<f64>,
    in_step: bool,
    was_in_step: bool,
    abort: bool,
}

impl<const N: usize> Synchronised<N> {
    /// A chain, the tool at rest at its start. `Ok(None)`: more moves and blends than `N`.
    ///
    /// # Errors
    /// A place on the path cannot be run, or the travel per turn is not above 0.
    pub fn new<K: Kinematics, const R: usize>(
        limits: &Limits<R>,
        kinematics: &K,
        period_s: f64,
        moves: &[SynchronisedMove],
        tap: Option<Tap>,
    ) -> Result<Option<Self>, PlanError> {
        let mut stretches: heapless::Vec<Stretch, N> = heapless::Vec::new();
        let mut acceleration = f64::INFINITY;
        // Where the next stretch begins, on its geometry, on the chain and in turns.
        let (mut from, mut start, mut turns) = (0.0, 0.0, 0.0);
        for (i, step) in moves.iter().enumerate() {
            if !(step.per_turn > 0.0 && step.per_turn.is_finite()) {
                let pose = Pose::from_array(step.geometry.at(0.0).position);
                return Err(PlanError { kind: PlanErrorKind::NoPitch, span: step.span, pose });
            }
            let length = step.geometry.length();
            let seam = moves.get(i + 1).map_or(Seam::Stop, |next| seam(step, next));
            let cut = if let Seam::Blend(cut, _) = &seam { *cut } else { 0.0 };
            let corner = match (&seam, moves.get(i + 1)) {
                (Seam::Blend(cut, blend), Some(next)) => {
                    let turns = cut / step.per_turn + cut / next.per_turn;
                    Some((Geometry::Blend(*blend), blend.length, turns))
                }
                _ => None,
            };
            let line = (step.geometry, length - cut - from, (length - cut - from) / step.per_turn);
            for (corner, (geometry, long, takes)) in
                [(false, line)].into_iter().chain(corner.map(|corner| (true, corner)))
            {
                // Between short moves nothing of the line itself is left.
                if !(long > 1e-12) {
                    continue;
                }
                let from = if corner { 0.0 } else { from };
                let pace = pace(limits, kinematics, &geometry, (from, from + long), step)?;
                acceleration = acceleration.min(pace.acceleration);
                let stretch = Stretch {
                    geometry,
                    from,
                    start,
                    end: start + long,
                    turns,
                    per_turn: long / takes,
                    speed: pace.speed,
                    exit: 0.0,
                    stop: matches!(seam, Seam::Stop),
                    corner,
                    motion: step.motion,
                    span: step.span,
                };
                if stretches.push(stretch).is_err() {
                    return Ok(None);
                }
                start += long;
                turns += takes;
            }
            from = cut;
        }
        // Backwards: from where the tool can still stop.
        let mut entry = 0.0_f64;
        for stretch in stretches.iter_mut().rev() {
            stretch.exit = if stretch.stop { 0.0 } else { entry };
            let long = stretch.end - stretch.start;
            entry = (stretch.exit + 2.0 * acceleration * long).min(stretch.speed * stretch.speed);
        }
        let stage = if stretches.is_empty() { Stage::Over } else { Stage::AtSpeed };
        Ok(Some(Self {
            stretches,
            acceleration,
            period_s,
            tap,
            stage,
            before: (0.0, 0.0),
            now: (0.0, 0.0),
            here: 0,
            target: 0,
            turns_s_before: None,
            in_step: false,
            was_in_step: false,
            abort: false,
        }))
    }

    /// The fastest spindle that the joints can follow everywhere on the moves and still catch up with, turns/s. At blends
    /// the tool may fall behind. A tap's spindle must also come to rest within its depth.
    pub fn fastest_turns_s(&self) -> f64 {
        let moves = self.stretches.iter().filter(|stretch| !stretch.corner);
        let fastest =
            moves.map(|stretch| RESERVE * stretch.speed / stretch.per_turn).fold(f64::INFINITY, f64::min);
        let (Some(tap), Some(last)) = (self.tap, self.stretches.last()) else { return fastest };
        // ω²/2α turns, and those of the period in which it passes the index.
        let rate = tap.spindle_rate;
        let lost = rate * self.period_s;
        let rests = sqrt(lost * lost + 2.0 * rate * last.end / last.per_turn) - lost;
        rests.min(fastest / tap.retract_scale)
    }

    /// The fastest change of speed of a spindle that the joints can follow, turns/s².
    pub fn fastest_rate(&self) -> f64 {
        let rates = self.stretches.iter().map(|stretch| APPROACH * self.acceleration / stretch.per_turn);
        rates.fold(f64::INFINITY, f64::min)
    }

    /// How far it is.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// The speed of the spindle as a multiple of that programmed: 1, or on a tap's way out minus its retract scale.
    pub fn spindle_factor(&self) -> f64 {
        match (self.stage, &self.tap) {
            (Stage::Outward, Some(tap)) => -tap.retract_scale,
            _ => 1.0,
        }
    }

    /// True while `spindle.0.index-enable` is to be set.
    pub fn wants_index(&self) -> bool {
        self.stage == Stage::Index
    }

    /// True once the tool was in step.
    pub fn was_in_step(&self) -> bool {
        self.was_in_step
    }

    /// Travel per turn × turns less the place of the tool at the end of the period, while it is in step, mm or rad; `turns` are
    /// those at that time.
    pub fn error(&self, turns: f64) -> Option<f64> {
        let stretch = self.stretches.get(self.stretch_at_turns(turns))?;
        let place = stretch.start + (turns - stretch.turns) * stretch.per_turn;
        self.in_step.then_some(place - self.now.0)
    }

    /// Brakes to rest on the path.
    pub fn abort(&mut self) {
        self.abort = true;
    }

    /// The next servo period.
    pub fn tick(&mut self, spindle: &SpindleReading) {
        let period = self.period_s;
        let rate = self.turns_s_before.map_or(0.0, |before| (spindle.turns_s - before) / period);
        self.turns_s_before = Some(spindle.turns_s);
        self.before = self.now;
        if self.abort && self.stage != Stage::Over {
            self.stage = Stage::Settling;
        }
        match self.stage {
            Stage::Over => return,
            Stage::AtSpeed => {
                if spindle.at_speed {
                    self.stage = Stage::Index;
                }
                return;
            }
            Stage::Index if spindle.index_enable => return,
            Stage::Index => self.stage = Stage::Inward,
            _ => {}
        }
        self.turn_round(spindle);
        if self.stage == Stage::Settling {
            self.in_step = false;
            self.settle();
            return;
        }
        // Where the spindle will be at the end of the period if it goes on as it does.
        let turns_s = spindle.turns_s + rate * period;
        let turns = spindle.turns + 0.5 * (spindle.turns_s + turns_s) * period;
        self.follow(turns, turns_s);
    }

    /// A tap's spindle is turned round so early that it rests at the bottom, and at the top.
    fn turn_round(&mut self, spindle: &SpindleReading) {
        let (Some(tap), Some(last)) = (self.tap, self.stretches.last()) else { return };
        let bottom = last.end / last.per_turn;
        // Where it would come to rest if it were told a period from now.
        let rests = spindle.turns
            + spindle.turns_s * self.period_s
            + 0.5 * spindle.turns_s * spindle.turns_s.abs() / tap.spindle_rate;
        match self.stage {
            Stage::Inward if rests > bottom => self.stage = Stage::Outward,
            Stage::Outward if spindle.turns_s < 0.0 && rests < 0.0 => self.stage = Stage::Top,
            Stage::Top if spindle.turns_s >= 0.0 => self.stage = Stage::Settling,
            _ => {}
        }
    }

    /// One period after the spindle, which will be at `turns` and as fast as `turns_s` at its end.
    fn follow(&mut self, turns: f64, turns_s: f64) {
        let (period, (s, v)) = (self.period_s, self.now);
        self.target = self.stretch_at_turns(turns);
        let Some(stretch) = self.stretches.get(self.target) else { return };
        let target = stretch.start + (turns - stretch.turns) * stretch.per_turn;
        let target_speed = turns_s * stretch.per_turn;
        let behind = target - s - 0.5 * (v + target_speed) * period;
        let gain = closing_speed(behind.abs(), APPROACH * self.acceleration, period);
        let most = self.acceleration * period;
        let wanted = (target_speed + if behind < 0.0 { -gain } else { gain }).clamp(v - most, v + most);
        let (low, high) = match self.tap {
            None => (0.0, self.highest()),
            Some(_) => {
                let up = closing_speed((s + 0.5 * v * period).max(0.0), self.acceleration, period);
                (-stretch.speed.min(up), stretch.speed)
            }
        };
        let speed = wanted.min(high).max(low);
        let limited = speed != wanted;
        self.go(speed);
        let error = (target - self.now.0).abs();
        self.in_step = !limited && (self.in_step || error <= IN_STEP);
        self.was_in_step |= self.in_step;
        if self.tap.is_none() && self.stretches.last().is_some_and(|last| self.now == (last.end, 0.0)) {
            self.in_step = false;
            self.stage = Stage::Over;
        }
    }

    /// Out of step: an abort brakes where it is, a tap goes back to where it began.
    fn settle(&mut self) {
        let (period, (s, v)) = (self.period_s, self.now);
        let most = self.acceleration * period;
        let wanted = if self.abort {
            0.0
        } else {
            let behind = -s - 0.5 * v * period;
            let gain = closing_speed(behind.abs(), self.acceleration, period);
            if behind < 0.0 { -gain } else { gain }
        };
        self.go(wanted.clamp(v - most, v + most));
        if !self.abort && self.now.0.abs() <= ARRIVED && self.now.1.abs() <= ARRIVED / period {
            self.now = (0.0, 0.0);
        }
        if self.now.1 == 0.0 {
            self.stage = Stage::Over;
        }
    }

    /// Changes the speed evenly within the period.
    fn go(&mut self, speed: f64) {
        let (s, v) = self.now;
        self.now = (s + 0.5 * (v + speed) * self.period_s, speed);
        // Every turn passes a stretch.
        for _ in 0..N {
            let Some(stretch) = self.stretches.get(self.here) else { return };
            let last = self.here + 1 == self.stretches.len();
            if stretch.exit == 0.0 && self.tap.is_none() && self.now.0 >= stretch.end - ARRIVED {
                if speed > ARRIVED / self.period_s {
                    return;
                }
                self.now = (stretch.end, 0.0);
            } else if self.now.0 < stretch.end {
                return;
            }
            if last {
                return;
            }
            self.here += 1;
        }
    }

    /// The highest speed at the end of the period from which the tool can keep to all that lies ahead.
    fn highest(&self) -> f64 {
        let (period, a, (s, v)) = (self.period_s, self.acceleration, self.now);
        let mut highest = f64::INFINITY;
        for stretch in self.stretches.iter().skip(self.here) {
            highest = highest.min(stretch.speed);
            let left = stretch.end - s;
            if stretch.exit == 0.0 {
                return highest.min(closing_speed((left - 0.5 * v * period).max(0.0), a, period));
            }
            // v₁² = exit + 2 a (left − (v + v₁) T / 2)
            let half = 0.5 * a * period;
            let square = half * half + stretch.exit + 2.0 * a * (left - 0.5 * v * period);
            let at_end = sqrt(square.max(0.0)) - half;
            if left - 0.5 * (v + at_end) * period >= 0.0 {
                return highest.min(at_end);
            }
            // The end is passed within the period.
            if left > 0.0 {
                highest = highest.min(v + (stretch.exit - v * v) / (2.0 * left) * period);
            }
        }
        highest
    }

    /// The stretch on which the spindle is; before the first and behind the last these go on.
    fn stretch_at_turns(&self, turns: f64) -> usize {
        let mut at = self.target;
        while at > 0 && self.stretches.get(at).is_some_and(|stretch| turns < stretch.turns) {
            at -= 1;
        }
        while self.stretches.get(at + 1).is_some_and(|next| turns >= next.turns) {
            at += 1;
        }
        at
    }

    /// Where the machine has to be at a share (0 to 1) of the period.
    ///
    /// # Errors
    /// An error of the kinematics here is a defect of the mechanism, or a spindle that runs on far beyond a tap's bottom.
    pub fn setpoint<K: Kinematics>(
        &self,
        kinematics: &K,
        share: f64,
        now: &Setpoint,
    ) -> Result<Setpoint, PlanError> {
        let ((s0, v0), (s1, v1)) = (self.before, self.now);
        let time = share * self.period_s;
        let speed = v0 + (v1 - v0) * share;
        let s = if share >= 1.0 { s1 } else { s0 + 0.5 * (v0 + speed) * time };
        // Within the period the place may still be on a stretch before.
        let at =
            (0..=self.here).rev().find(|i| self.stretches.get(*i).is_some_and(|stretch| s >= stretch.start));
        let Some(stretch) = self.stretches.get(at.unwrap_or(0)) else { return Ok(*now) };
        let place = stretch.from + (s - stretch.start);
        let point = stretch.geometry.at(place);
        let pose = Pose::from_array(point.position);
        let velocity = Pose::from_array(point.first.map(|d| d * speed));
        let motion = kinematics.motion(&pose, &velocity, &Pose::ZERO);
        let fail = |e| PlanError { kind: PlanErrorKind::Unreachable(e), span: stretch.span, pose };
        let motion = motion.map_err(fail)?;
        Ok(Setpoint {
            pose,
            joints: motion.position,
            joint_velocity: motion.velocity,
            motion: stretch.motion,
            s: place,
            blending: stretch.corner,
            feed_use: 0.0,
            span: stretch.span,
            state: State::Moving,
            starved: false,
        })
    }
}

/// How a move of a chain goes over into the next.
enum Seam {
    Smooth,
    Blend(f64, Blend),
    Stop,
}

fn seam(step: &SynchronisedMove, next: &SynchronisedMove) -> Seam {
    let (e1, e2) = (step.geometry.at(step.geometry.length()).first, next.geometry.at(0.0).first);
    let turn = combine(&e2, &e1, |b, a| (b - a).abs()).into_iter().fold(0.0, f64::max);
    match step.mode {
        _ if turn <= 1e-9 => Seam::Smooth,
        PathMode::Blend(tolerance) => match Blend::new(&step.geometry, &next.geometry, tolerance) {
            Some((cut, blend)) => Seam::Blend(cut, blend),
            None => Seam::Stop,
        },
        PathMode::ExactStop | PathMode::ExactPath => Seam::Stop,
    }
}

/// Speed towards a target that brings the machine to rest on it in whole periods at `a`, to be reached at the end of this period;
/// `left` is what would be left then if the speed were that of the target. See the module.
fn closing_speed(left: f64, a: f64, period: f64) -> f64 {
    let k = left / (a * period * period);
    let n = floor(0.5 * (sqrt(1.0 + 8.0 * k) - 1.0));
    (0.5 * n + k / (n + 1.0)) * a * period
}

/// How fast a stretch of a geometry may be followed.
fn pace<K: Kinematics, const R: usize>(
    limits: &Limits<R>,
    kinematics: &K,
    geometry: &Geometry,
    (from, to): (f64, f64),
    step: &SynchronisedMove,
) -> Result<Pace, PlanError> {
    let feed = Feed { speed: f64::INFINITY, group: FeedGroup::Xyz };
    let piece = Piece {
        onto: None,
        geometry: *geometry,
        from,
        to,
        feed,
        rapid: true,
        open: false,
        stop: true,
        corner: false,
        dwell_ns: 0,
        mode: PathMode::ExactStop,
        motion: step.motion,
        span: step.span,
    };
    let (mut sample, mut spot) = (Sample::EMPTY, Spot::NONE);
    let mut pace = Pace { speed: f64::INFINITY, acceleration: f64::INFINITY };
    let count = ((to - from) / SPACING).clamp(SAMPLES.0, SAMPLES.1) as u32;
    for i in 0..=count {
        let s = if i == count { to } else { from + (to - from) * f64::from(i) / f64::from(count) };
        spot.look(&piece, s);
        limits.sample(kinematics, &piece, &mut spot, &mut sample)?;
        let bend = sample.rows.second.iter().fold(0.0_f64, |most, q| most.max(q.abs()));
        // Half of every acceleration is kept for the bends.
        let x = if bend * sample.hard > 0.5 { 0.5 / bend } else { sample.hard };
        pace.speed = pace.speed.min(GUARD * sqrt(x));
        for (first, second) in sample.rows.first.iter().zip(&sample.rows.second) {
            if *first != 0.0 {
                pace.acceleration = pace.acceleration.min(GUARD * (1.0 - second.abs() * x) / first.abs());
            }
        }
    }
    // What nothing limits still has a finite acceleration.
    pace.acceleration = pace.acceleration.min(1e9);
    Ok(pace)
}
