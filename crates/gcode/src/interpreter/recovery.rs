//! Going on after an error: what can be read of the block takes effect, and what would only follow from an error that was
//! told is not told. One run then names every independent error.

use super::queue::Queue;
use super::{Interpreter, Out, Phase, Status};
use crate::block::{Block, Setting};
use crate::error::{Error, ErrorKind};
use crate::line::Line;
use crate::modal::*;
use crate::source::{LineSource, Place};
use alloc::{boxed::Box, format, vec::Vec};
use pkm_canon::{CanonSink, Plane, Span};

/// What was told already.
#[derive(Debug, Clone, Default)]
pub(crate) struct Recovery {
    /// An error was returned.
    active: bool,
    /// The feed is 0, or the spindle stands; until it is set.
    feed_told: bool,
    spindle_told: bool,
    /// A motion code could not be executed: blocks that only repeat it fail for that reason.
    motion_lost: bool,
    /// Tools that are not in the table.
    tools: Vec<i32>,
    /// Calls whose sub was not found.
    calls: Vec<Span>,
    /// Parameters whose setting failed, as in the prepared line: `#31`, `#<name>`.
    unknown: Vec<Box<[u8]>>,
    /// The error returned last, as long as nothing was done about it, and the place of its line.
    pending: Option<(Error, Place)>,
    /// See [`Interpreter::lost_machine_code`].
    pub(super) lost_code: Option<(i32, Span)>,
}

impl Recovery {
    /// True if a line mentions a parameter that an error left without its value.
    fn mentions_unknown(&self, code: &[u8]) -> bool {
        self.unknown.iter().any(|name| {
            code.windows(name.len()).enumerate().any(|(at, window)| {
                let next = code.get(at + name.len());
                let longer = next.is_some_and(u8::is_ascii_digit) && name.last() != Some(&b'>');
                // In front of `=` it is set, not read.
                *window == **name && !longer && next != Some(&b'=')
            })
        })
    }

    fn lose(&mut self, target: &[u8]) {
        if !self.unknown.iter().any(|known| **known == *target) {
            self.unknown.push(target.into());
        }
    }
}

/// What a setting stores to, as in the prepared line.
fn target_of(code: &[u8]) -> &[u8] {
    let end = match code.get(1) {
        Some(b'<') => code.iter().position(|byte| *byte == b'>').map_or(code.len(), |at| at + 1),
        _ => 1 + code[1..].iter().take_while(|byte| byte.is_ascii_digit()).count(),
    };
    &code[..end]
}

/// What a setting stores to, as it is written.
fn target(setting: &Setting, line: &Line) -> Vec<u8> {
    match setting {
        Setting::Number { index, .. } => format!("#{index}").into_bytes(),
        Setting::Name { start, end, .. } => {
            let name = line.code().get((*start).into()..(*end).into()).unwrap_or_default();
            [b"#<", name, b">"].concat()
        }
    }
}

impl Interpreter {
    /// Looks at the outcome of a step; nothing is done before the first error.
    pub(super) fn recover(
        &mut self,
        stepped: Result<Status, Error>,
        here: Place,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<Status, Error> {
        match stepped {
            Ok(status) => {
                if self.recovery.active {
                    self.succeeded();
                }
                Ok(status)
            }
            Err(error) => {
                let follows = self.recovery.active && self.follows(&error);
                self.recovery.active = true;
                self.recovery.pending = Some((error, here));
                if !follows {
                    return Err(error);
                }
                self.go_on(source, sink);
                Ok(if self.phase == Phase::Ended { Status::Ended } else { Status::Running })
            }
        }
    }

    /// True if the line reads a parameter that an error left without its value: it can neither be judged nor executed.
    pub(super) fn depends_on_an_error(&self) -> bool {
        self.recovery.active && self.recovery.mentions_unknown(self.line.code())
    }

    /// A block without error heals what it sets.
    fn succeeded(&mut self) {
        if self.depends_on_an_error() {
            return;
        }
        let (block, recovery) = (&self.block, &mut self.recovery);
        if block.g(GGroup::Motion).is_some() {
            recovery.motion_lost = false;
        }
        recovery.feed_told &= !block.has(b'F');
        recovery.spindle_told &= !matches!(block.m(MGroup::Spindle), Some(3 | 4));
        for setting in &block.settings {
            let target = target(setting, &self.line);
            recovery.unknown.retain(|known| **known != *target);
        }
    }

    /// True if the error only follows from one that was told.
    fn follows(&self, error: &Error) -> bool {
        let recovery = &self.recovery;
        let repeats_motion = self.block.g(GGroup::Motion).is_none();
        match error.kind {
            ErrorKind::FeedZero { .. } | ErrorKind::ProbeFeed => recovery.feed_told,
            ErrorKind::SpindleNotTurning { .. } | ErrorKind::SpindleZeroG95 { .. } => recovery.spindle_told,
            ErrorKind::AxisWithoutMotion | ErrorKind::WordUnused { .. } | ErrorKind::CycleR { .. }
                if recovery.motion_lost && repeats_motion =>
            {
                true
            }
            ErrorKind::ToolNotSelected => !recovery.tools.is_empty(),
            ErrorKind::ToolUnknown { number } => recovery.tools.contains(&number),
            ErrorKind::ONotFound => recovery.calls.contains(&error.span),
            ErrorKind::OUnclosed => self.flow.misses_a_wrong_end(),
            ErrorKind::FileNoEnd | ErrorKind::FileNoEndPercent | ErrorKind::FileEmpty => false,
            _ if self.follows_o_word(error) => true,
            _ => self.recovery.mentions_unknown(self.line.code()),
        }
    }

    /// After an error: what can be read of its block takes effect, so that what follows is not misjudged. The next step
    /// does it by itself; a caller calls it first where it wants to know where the block should have led.
    pub fn go_on(&mut self, source: &mut dyn LineSource, sink: &mut dyn CanonSink) {
        self.recovery.lost_code = None;
        let Some((error, here)) = self.recovery.pending.take() else { return };
        match error.kind {
            ErrorKind::FeedZero { .. } | ErrorKind::ProbeFeed => self.recovery.feed_told = true,
            ErrorKind::SpindleNotTurning { .. } | ErrorKind::SpindleZeroG95 { .. } => {
                self.recovery.spindle_told = true;
            }
            ErrorKind::AxisWithoutMotion => self.recovery.motion_lost = true,
            ErrorKind::ToolUnknown { number } => self.recovery.tools.push(number),
            ErrorKind::ParamUndefined => {
                let (start, end) = (error.span.start as usize, error.span.end as usize);
                let word = self.line.raw().get(start..end).unwrap_or_default().to_ascii_lowercase();
                let word: Vec<u8> = word.into_iter().filter(|byte| !byte.is_ascii_whitespace()).collect();
                self.recovery.lose(&word);
            }
            ErrorKind::CcEntry { .. } | ErrorKind::CcGouge | ErrorKind::CcConcave | ErrorKind::CcArcAfter => {
                self.queue = Queue::default();
                self.state.cutter = Default::default();
                self.state.modal.compensation = None;
            }
            ErrorKind::ONotFound if self.return_from_search(source) => {
                self.recovery.calls.push(error.span);
                self.forget_remapped();
                return;
            }
            _ => {}
        }
        let reads_on = self.is_branch() || error.kind == ErrorKind::OTrailing;
        if self.phase == Phase::Ended || self.is_skipping() && !reads_on {
            return;
        }
        let Ok(start) = self.line.skip_number() else { return };
        if self.line.code().get(start) == Some(&b'o') {
            self.recover_o_word(&error, here, source);
        } else if !self.is_skipping() {
            self.salvage(start, source, sink);
        }
    }

    /// What can be read of the block takes effect; the position is where it should have led.
    pub(super) fn salvage(&mut self, start: usize, source: &mut dyn LineSource, sink: &mut dyn CanonSink) {
        let mut block = core::mem::replace(&mut self.block, Block::new());
        if !self.executing {
            let recovery = &mut self.recovery;
            let reader = self.state.reader();
            block.salvage(&self.line, start, &self.state, &reader, |rest| recovery.lose(target_of(rest)));
            let _ = self.state.store_settings(&block, &self.line);
            if self.depends_on_an_error() {
                for setting in &block.settings {
                    self.recovery.lose(&target(setting, &self.line));
                }
            }
        }
        if let Some(number) = block.m(MGroup::User).filter(|n| self.state.settings.machine_codes.contains(*n))
        {
            self.recovery.lost_code = Some((number, block.m_span(MGroup::User)));
        }
        let state = &mut self.state;
        let out = &mut Out { sink, span: block.span(), queue: &mut self.queue };
        let _ = state.spindle_mode(&block, out);
        state.feed_mode(&block, out);
        state.feed_rate(&block, out);
        state.spindle_speed(&block, out);
        let _ = state.select_tool(&block, out);
        if !self.executing {
            let _ = state.change_tool(&block, out);
        }
        let _ = state.spindle(&block, out);
        state.coolant(&block, out);
        let _ = state.overrides(&block, out);
        let _ = state.plane(&block, out);
        state.units(&block, out);
        state.lathe_mode(&mut block, out);
        let _ = state.tool_length(&block, out);
        let _ = state.coordinate_system(&block, out);
        let _ = state.path_mode(&block, out);
        state.distance_mode(&block, out);
        state.arc_mode(&block, out);
        let _ = state.retract_mode(&block, out);
        self.lead_to_the_end(&block);
        self.recovery.feed_told &= !block.has(b'F');
        match block.m(MGroup::Stop) {
            Some(2 | 30) => self.phase = Phase::Ended,
            Some(99) if !self.recover_return(source, sink) => self.phase = Phase::Ended,
            _ => {}
        }
        self.block = block;
    }

    /// Motion mode and position as if the block had moved.
    fn lead_to_the_end(&mut self, block: &Block) {
        let state = &mut self.state;
        match block.g(GGroup::Motion) {
            Some(code @ (G0 | G1 | G2 | G3 | G80)) => {
                state.modal.motion = code;
                self.recovery.motion_lost = false;
            }
            Some(_) => self.recovery.motion_lost = true,
            None => {}
        }
        let elsewhere = matches!(block.g(GGroup::NonModal), Some(G10 | G28 | G30 | G52 | G53 | G92))
            || matches!(block.g(GGroup::ToolLength), Some(G43_1 | G43_2));
        if elsewhere {
            return;
        }
        let normal = match state.modal.plane {
            Plane::Xy => 2,
            Plane::Xz => 1,
            Plane::Yz => 0,
            Plane::Uv => 8,
            Plane::Uw => 7,
            Plane::Vw => 6,
        };
        let drills = block.g(GGroup::Motion).or(block.motion).is_some_and(is_cycle);
        for axis in 0..9 {
            if let Some(value) = block.axis(axis).filter(|_| !(drills && axis == normal)) {
                let from = if state.modal.incremental { state.position[axis] } else { 0.0 };
                state.position[axis] = from + value;
            }
        }
    }
}
