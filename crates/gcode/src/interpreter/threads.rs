//! Moves in step with the spindle: G33, G33.1; the threading cycle G76.

use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use crate::settings::Dialect;
use pkm_canon::{Canon, Plane, Position};
use pkm_kins::maths;

impl State {
    fn spindle_of(&self, block: &Block) -> i32 {
        block.get(b'$').map_or(0, |n| (n as i32).max(0))
    }

    fn needs_turning_spindle(&self, code: GCode, block: &Block) -> Result<i32, Error> {
        let spindle = self.spindle_of(block);
        match self.modal.spindles[(spindle & 7) as usize].turning {
            Some(_) => Ok(spindle),
            None => Err(block.motion_error(ErrorKind::SpindleNotTurning { code: Code(code) })),
        }
    }

    /// G33 K: a line with K units per turn.
    pub(crate) fn synchronized(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let spindle = self.needs_turning_spindle(G33, block)?;
        let pitch = block.get(b'K').unwrap_or(0.0);
        let end = self.end_point(block)?;
        out.emit(Canon::StartSpeedFeedSync { spindle, feed_per_turn: pitch, velocity_mode: 0 });
        out.emit(Canon::StraightFeed(Position::from_array(end)));
        out.emit(Canon::StopSpeedFeedSync);
        self.modal.motion = G33;
        self.position = end;
        Ok(())
    }

    /// G33.1 K [I]: rigid tap to the point and back.
    pub(crate) fn rigid_tap(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let spindle = self.needs_turning_spindle(G33_1, block)?;
        let pitch = block.get(b'K').unwrap_or(0.0);
        let end = self.end_point(block)?;
        let retract_scale = block.get(b'I').unwrap_or(1.0);
        // LinuxCNC 2.9 takes any (checked with rs274 2.9).
        if retract_scale < 1.0 && self.settings.dialect != Dialect::LinuxCnc29 {
            return Err(block.word_error(b'I', ErrorKind::NegativeWord { letter: 'I', value: retract_scale }));
        }
        out.emit(Canon::StartSpeedFeedSync { spindle, feed_per_turn: pitch, velocity_mode: 0 });
        out.emit(Canon::RigidTap { end: Position::from_array(end), retract_scale });
        out.emit(Canon::StopSpeedFeedSync);
        self.modal.motion = G33_1;
        // Back at the start; LinuxCNC believes that the other axes stay (checked with rs274 2.9).
        if self.settings.dialect != Dialect::Pkm {
            self.position[3..].copy_from_slice(&end[3..]);
        }
        Ok(())
    }

    /// G76: threading along X and Z, in passes of falling depth. LinuxCNC looks neither at the plane nor at Y, and takes
    /// an R below 1 for 1 (checked with rs274 2.9).
    pub(crate) fn thread(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let pkm = self.settings.dialect == Dialect::Pkm;
        if pkm && self.modal.plane != Plane::Xz {
            return Err(block.motion_error(ErrorKind::ThreadPlane));
        }
        if self.modal.compensation.is_some() {
            return Err(block.motion_error(ErrorKind::CcOn { what: "G76" }));
        }
        let spindle = self.needs_turning_spindle(G76, block)?;
        let [pitch, mut i, mut j, mut k] = b"PIJK".map(|letter| block.get(letter).unwrap_or(0.0));
        if self.modal.diameter {
            (i, j, k) = (i / 2.0, j / 2.0, k / 2.0);
        }
        for (letter, wrong) in [(b'I', i == 0.0), (b'J', j <= 0.0), (b'K', k <= j)] {
            if wrong {
                return Err(block.word_error(letter, ErrorKind::ThreadIjk { letter: letter.into() }));
            }
        }
        let degression = block.get(b'R').unwrap_or(1.0);
        if pkm && degression < 1.0 {
            return Err(block.word_error(b'R', ErrorKind::ThreadIjk { letter: 'R' }));
        }
        let end = self.end_point(block)?;
        if (3..9).chain(pkm.then_some(1)).any(|axis| end[axis] != self.position[axis]) {
            return Err(block.motion_error(ErrorKind::ThreadAxes));
        }
        let taper_length = block.get(b'E').unwrap_or(0.0);
        // Without a length there is no taper (checked with rs274 2.9).
        let taper = if taper_length == 0.0 { 0 } else { block.get(b'L').unwrap_or(0.0) as i32 };
        let thread = Thread {
            pitch,
            taper_in: matches!(taper, 1 | 3),
            taper_out: matches!(taper, 2 | 3),
            taper_length,
            peak: i.abs(),
            height: k,
            tangent: maths::tan(block.get(b'Q').unwrap_or(0.0) * maths::PI / 180.0),
            start: self.position,
            end_z: end[2],
            inside: i > 0.0,
            spindle,
        };
        // n-th pass at depth J n^(1/R) below the peak while above the full depth; then 1 + H passes at full depth.
        // Compared from the drive line, as LinuxCNC does: the rounding decides whether a last thin pass is cut.
        let full = i.abs() + k;
        let (mut pass, mut depth) = (1.0, i.abs() + j);
        while depth < full {
            thread.pass(depth - i.abs(), self.modal.feed_override, out);
            pass += 1.0;
            depth = i.abs() + j * maths::pow(pass, 1.0 / degression.max(1.0));
        }
        let spring = block.get(b'H').map_or(0, |h| h as i64).max(0);
        for _ in 0..=spring {
            thread.pass(k, self.modal.feed_override, out);
        }
        out.emit(Canon::StraightTraverse(Position::from_array(end)));
        self.modal.motion = G76;
        self.position = end;
        Ok(())
    }
}

/// One G76. Depths are measured below the thread's peak, which lies `peak` off the drive line (the start's X).
struct Thread {
    pitch: f64,
    taper_in: bool,
    taper_out: bool,
    taper_length: f64,
    peak: f64,
    height: f64,
    tangent: f64,
    start: [f64; 9],
    end_z: f64,
    /// An inside thread: the material is at larger X.
    inside: bool,
    spindle: i32,
}

impl Thread {
    /// A point so far from the drive line towards the material.
    fn at(&self, offset: f64, z: f64) -> Position {
        let mut point = self.start;
        point[0] += if self.inside { offset } else { -offset };
        point[2] = z;
        Position::from_array(point)
    }

    fn pass(&self, depth: f64, override_was_on: bool, out: &mut Out<'_>) {
        let forward = if self.end_z > self.start[2] { 1.0 } else { -1.0 };
        // Along the flank: the deeper, the further ahead.
        let z_start = self.start[2] + forward * depth * self.tangent;
        let z_end = self.end_z - forward * (self.height - depth) * self.tangent;
        // The tool backs off a little further while the thread is shallow.
        let back_off = depth - self.height;
        let (cut, taper) = (self.peak + depth, self.peak + depth - self.height);
        let taper_pitch = self.pitch * maths::hypot(self.taper_length, self.height) / self.taper_length;
        let spindle = self.spindle;
        let sync = |feed_per_turn| Canon::StartSpeedFeedSync { spindle, feed_per_turn, velocity_mode: 0 };
        let feed = |offset, z| Canon::StraightFeed(self.at(offset, z));
        out.emit(Canon::StraightTraverse(self.at(back_off, z_start)));
        if !self.taper_in {
            out.emit(Canon::StraightTraverse(self.at(cut, z_start)));
        }
        if override_was_on {
            out.emit(Canon::FeedOverride(false));
        }
        if self.taper_in {
            out.emit(sync(taper_pitch));
            out.emit(feed(taper, z_start));
            out.emit(feed(cut, z_start + forward * self.taper_length));
        }
        out.emit(sync(self.pitch));
        if self.taper_out {
            out.emit(feed(cut, z_end - forward * self.taper_length));
            out.emit(sync(taper_pitch));
            out.emit(feed(taper, z_end));
        } else {
            out.emit(feed(cut, z_end));
        }
        out.emit(Canon::StopSpeedFeedSync);
        out.emit(Canon::StraightTraverse(self.at(back_off, z_end)));
        if override_was_on {
            out.emit(Canon::FeedOverride(true));
        }
    }
}
