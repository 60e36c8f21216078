//! Remapped codes at work: a block is executed up to the code, the sub is called, and when it returns the rest of the block follows
//! (dialect section 7 gives the order).

use super::{Interpreter, Status, state::State};
use crate::block::{AXIS_LETTERS, Block};
use crate::error::{Error, ErrorKind};
use crate::modal::*;
use crate::parameters::ARGUMENTS;
use crate::remap::{Remap, Remapped};
use crate::settings::Dialect;
use crate::source::LineSource;
use alloc::{boxed::Box, vec::Vec};
use pkm_canon::{CanonSink, Span};
use pkm_kins::maths;

/// Steps of a block's execution, as dialect section 7 numbers them.
pub(crate) mod step {
    pub(crate) const FEED: u8 = 4;
    pub(crate) const SPEED: u8 = 5;
    pub(crate) const TOOL: u8 = 6;
    pub(crate) const MOTION: u8 = 26;
    pub(crate) const END: u8 = 28;
}

/// A block that waits for the sub of its remapped code.
#[derive(Debug, Clone)]
struct Held {
    block: Box<Block>,
    /// Where it goes on.
    next: u8,
    remap: usize,
    /// Calls that were open before.
    depth: usize,
}

/// The blocks whose remapped codes are being executed, the innermost last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Remapping {
    held: Vec<Held>,
}

impl Interpreter {
    /// Adds a remapped code; false if it is there already. The file of its sub must be found by the source.
    pub fn add_remap(&mut self, remap: Remap) -> bool {
        self.state.remaps.add(remap)
    }

    /// The first remapped code of a block from a step on, and its step. Within its own sub a built-in code is the built-in one; a free
    /// one calls the sub again (checked with rs274 2.9).
    fn remap_of(&self, block: &Block, from: u8) -> Option<(u8, usize)> {
        let of = |(index, remap): (usize, &Remap)| {
            let (step, built_in) = self.state.step_of(remap.code, block)?;
            let inside = built_in && self.remapping.held.iter().any(|held| held.remap == index);
            (step >= from && !inside).then_some((step, index))
        };
        self.state.remaps.iter().filter_map(of).min()
    }

    /// True if the block just read holds a remapped code.
    pub(super) fn holds_remap(&self) -> bool {
        self.remap_of(&self.block, 0).is_some()
    }

    /// Executes the block just read up to its first remapped code, whose sub begins.
    pub(super) fn begin_remapped(
        &mut self,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<Status, Error> {
        let block = Box::new(self.block.clone());
        self.go_on_remapped(block, 0, source, sink)
    }

    /// Behind an o-word: the sub of a remapped code may have returned to its block.
    pub(super) fn end_remapped(
        &mut self,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<Status, Error> {
        let depth = self.flow.depth();
        let Some(held) = self.remapping.held.pop_if(|held| held.depth >= depth) else {
            return Ok(Status::Running);
        };
        self.state.remap_level = self.remapping.held.len() as u32;
        self.go_on_remapped(held.block, held.next, source, sink)
    }

    /// Blocks whose sub was not found do not go on.
    pub(super) fn forget_remapped(&mut self) {
        let depth = self.flow.depth();
        self.remapping.held.retain(|held| held.depth < depth);
        self.state.remap_level = self.remapping.held.len() as u32;
    }

    fn go_on_remapped(
        &mut self,
        mut block: Box<Block>,
        from: u8,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<Status, Error> {
        let next = self.remap_of(&block, from);
        let until = next.map_or(step::END, |(step, _)| step);
        self.block = (*block).clone();
        let inverse = self.state.modal.feed_mode == FeedMode::InverseTime;
        self.block.keep_steps(from, until, inverse);
        let status = self.execute_block(source, sink)?;
        // G7 and G8 rescale the words of their block.
        block.take_words(&self.block);
        let Some((step, remap)) = next else {
            return Ok(status);
        };
        if status == Status::Ended {
            return Ok(status);
        }
        self.call_remap(block, step, remap, source)?;
        Ok(status)
    }

    fn call_remap(
        &mut self,
        block: Box<Block>,
        step: u8,
        index: usize,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        let Some(remap) = self.state.remaps.get(index) else { return Ok(()) };
        let span = remap.code.place_in(&block).unwrap_or_default();
        let words = self.words_for(remap, &block, span)?;
        let (sub, positional) = (remap.sub.clone(), remap.arguments.contains('@'));
        let mut arguments = [0.0; ARGUMENTS];
        if positional {
            for (place, (_, value)) in arguments.iter_mut().zip(&words) {
                // LinuxCNC writes them with four decimals into a call (checked with rs274 2.9).
                let written = self.state.settings.dialect != Dialect::Pkm;
                *place = if written { maths::round(value * 1e4) / 1e4 } else { *value };
            }
        }
        let depth = self.flow.depth();
        let count = if positional { words.len() } else { 0 };
        self.enter_remap(&sub, span, arguments, count, source)?;
        if !positional {
            for (name, value) in words {
                self.state.parameters.set_named(&[name], value).map_err(|kind| Error { kind, span })?;
            }
        }
        self.remapping.held.push(Held { block, next: step + 1, remap: index, depth });
        self.state.remap_level = self.remapping.held.len() as u32;
        Ok(())
    }

    /// The words that a sub gets, as its argspec says.
    fn words_for(&self, remap: &Remap, block: &Block, span: Span) -> Result<Vec<(u8, f64)>, Error> {
        let mut words: Vec<(u8, f64)> = Vec::new();
        let mut put = |name: u8, value: f64| match words.iter_mut().find(|(known, _)| *known == name) {
            Some(place) => place.1 = value,
            None => words.push((name, value)),
        };
        for letter in remap.arguments.bytes().filter(|letter| letter.is_ascii_alphabetic()) {
            let upper = letter.to_ascii_uppercase();
            match block.get(upper) {
                _ if upper == b'N' => {}
                Some(value) => put(upper.to_ascii_lowercase(), value),
                None if letter == upper => {
                    return Err(Error { kind: ErrorKind::RemapWord { letter: upper.into() }, span });
                }
                None => {}
            }
        }
        if remap.takes(b'N') {
            put(b'n', span.line.into());
        }
        let state = &self.state.modal;
        for (mark, letter, value) in [('>', 'F', state.feed), ('^', 'S', state.spindles[0].speed)] {
            if !remap.arguments.contains(mark) {
                continue;
            }
            if value <= 0.0 {
                return Err(Error { kind: ErrorKind::RemapZero { letter }, span });
            }
            put((letter as u8).to_ascii_lowercase(), value);
        }
        Ok(words)
    }
}

impl State {
    /// The step in which a block executes a code, and whether it is a built-in one; `None` if it does not hold it.
    fn step_of(&self, code: Remapped, block: &Block) -> Option<(u8, bool)> {
        if code == Remapped::Word(b'F') {
            let mode = block.g(GGroup::FeedMode);
            if mode.map_or(self.modal.feed_mode == FeedMode::InverseTime, |code| code == 930) {
                return None;
            }
        }
        code.place_in(block)?;
        let built_in = match code {
            Remapped::M(number, _) => MGroup::of(number).is_some(),
            Remapped::G(_) => false,
            Remapped::Word(_) => true,
        };
        let step = match code {
            Remapped::M(_, group) => group.step(),
            Remapped::G(_) => step::MOTION,
            Remapped::Word(b'F') => step::FEED,
            Remapped::Word(b'S') => step::SPEED,
            Remapped::Word(_) => step::TOOL,
        };
        Some((step, built_in))
    }

    /// True if a block holds an M code or a free G code that a sub stands for, also within that sub.
    pub(super) fn has_remapped_code(&self, block: &Block) -> bool {
        let has = |(_, remap): (usize, &Remap)| match remap.code {
            Remapped::Word(_) => false,
            code => self.step_of(code, block).is_some(),
        };
        self.remaps.iter().any(has)
    }

    /// Such a block without the words that the subs get; in pkm every other one has a use.
    pub(super) fn rest_of_remapped(&self, block: &Block) -> Result<Box<Block>, Error> {
        let mut rest = Box::new(block.clone());
        let mut moves = false;
        for (_, remap) in self.remaps.iter().filter(|(_, remap)| self.step_of(remap.code, block).is_some()) {
            moves |= matches!(remap.code, Remapped::G(_));
            for letter in remap.arguments.bytes().filter(u8::is_ascii_alphabetic) {
                rest.set(letter.to_ascii_uppercase(), None);
            }
        }
        let unused = AXIS_LETTERS.iter().copied().find(|letter| moves && rest.has(*letter));
        if let Some(letter) = unused.filter(|_| self.settings.dialect == Dialect::Pkm) {
            let users = "motion codes and remapped codes whose argspec names it";
            return Err(block.word_error(letter, ErrorKind::WordUnused { letter: letter.into(), users }));
        }
        Ok(rest)
    }
}
