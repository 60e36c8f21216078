//! Subroutines: definition, call, return; Fanuc's programs with M98 and M99 (dialect section 5).

use super::{Frame, Label, MAX_CALLS, Name, OWord, Style, Sub};
use crate::error::{Error, ErrorKind};
use crate::interpreter::saved::Saved;
use crate::interpreter::{Interpreter, Out, Status};
use crate::lexer::Keyword;
use crate::parameters::ARGUMENTS;
use crate::settings::Dialect;
use crate::source::{LineSource, Place};
use pkm_canon::{CanonSink, Span};
use pkm_kins::maths;

impl Interpreter {
    fn remember(&mut self, word: &OWord, line: Place, body: Place, style: Style) {
        self.flow.subs.insert(word.name.label, Sub { span: word.span, line, body, style });
    }

    /// Within a call only definitions of its own style are met.
    fn check_style(&self, word: &OWord, style: Style) -> Result<(), Error> {
        match self.flow.frames.last() {
            Some(frame) if frame.style != style => Err(self.flow_error(ErrorKind::OStyle, word.span)),
            _ => Ok(()),
        }
    }

    /// The first line of a definition that is reached in order.
    fn check_first_line(&self, word: &OWord, style: Style) -> Result<(), Error> {
        self.nothing_more(word.operands)?;
        self.check_style(word, style)
    }

    /// The definition that a call has searched for.
    pub(super) fn found_sub(
        &mut self,
        word: &OWord,
        here: Place,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        let style = if word.keyword.is_some() { Style::OWord } else { Style::Fanuc };
        self.check_style(word, style)?;
        let body = source.place();
        self.remember(word, here, body, style);
        if let Some(frame) = self.flow.frames.last_mut() {
            frame.body = body;
        }
        (self.flow.pending, self.flow.skip) = (None, None);
        Ok(())
    }

    /// `O5` alone: a Fanuc program begins. Reached in order it simply runs; LinuxCNC does not even remember it
    /// (checked with rs274 2.9).
    pub(super) fn fanuc_program(
        &mut self,
        word: &OWord,
        here: Place,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        self.check_first_line(word, Style::Fanuc)?;
        if self.state.settings.dialect == Dialect::Pkm {
            self.remember(word, here, source.place(), Style::Fanuc);
        }
        Ok(())
    }

    /// `sub` reached in order: its body is passed over. Inside a sub that is being called LinuxCNC 2.9 runs into it,
    /// and its `endsub` ends the call (checked with rs274 2.9).
    pub(super) fn define(
        &mut self,
        word: &OWord,
        here: Place,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        self.check_first_line(word, Style::OWord)?;
        let dialect = self.state.settings.dialect;
        if !self.flow.frames.is_empty() {
            return match dialect {
                Dialect::LinuxCnc29 => Ok(()),
                _ => Err(self.flow_error(ErrorKind::ONestedSub, word.span)),
            };
        }
        if let Some(known) = self.flow.subs.get(&word.name.label) {
            // LinuxCNC refuses even the same definition once a call has run it.
            if known.line != here || dialect != Dialect::Pkm {
                return Err(self.flow_error(ErrorKind::ORedefinedSub, word.span));
            }
        }
        self.remember(word, here, source.place(), Style::OWord);
        self.flow.defining = Some(word.name.label);
        self.flow.skip = Some(word.name);
        Ok(())
    }

    /// `endsub` or `return` of a definition that is passed over. LinuxCNC sets the result already here.
    pub(super) fn passed_return(&mut self, word: &OWord) -> Result<(), Error> {
        if self.state.settings.dialect != Dialect::Pkm {
            self.state.unknown_names_are_zero = true;
            let operand = self.operand(word.operands);
            self.state.unknown_names_are_zero = false;
            self.state.set_return_value(operand?.map(|(value, _)| value));
        }
        if word.keyword == Some(Keyword::Endsub) && self.flow.defining.is_some() {
            (self.flow.defining, self.flow.skip) = (None, None);
        }
        Ok(())
    }

    /// `call [..] [..]`.
    pub(super) fn call(&mut self, word: &OWord, source: &mut dyn LineSource) -> Result<(), Error> {
        let mut arguments = [0.0; ARGUMENTS];
        let (mut at, mut count) = (word.operands, 0);
        while let Some((value, next)) = self.operand(self.behind_comments(at))? {
            let Some(argument) = arguments.get_mut(count) else {
                let kind = ErrorKind::OArgs { limit: ARGUMENTS as u8 };
                return Err(self.flow_error(kind, self.line.code_span(at, next)));
            };
            *argument = value;
            (at, count) = (next, count + 1);
        }
        self.nothing_more(at)?;
        self.state.set_return_value(None);
        self.enter(word.name.label, Style::OWord, word.span, 1, Some(arguments), source)?;
        if self.state.settings.oword_nargs {
            let _ = self.state.parameters.set_named(b"n_args", count as f64);
        }
        Ok(())
    }

    /// Begins a call: from a definition already passed, from a file of that name, or further on in this file.
    fn enter(
        &mut self,
        label: Label,
        style: Style,
        span: Span,
        repeats: i64,
        arguments: Option<[f64; ARGUMENTS]>,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        if self.flow.frames.len() >= MAX_CALLS {
            return Err(self.flow_error(ErrorKind::ODepth { limit: MAX_CALLS as u8 }, span));
        }
        let known = self.flow.subs.get(&label).copied();
        let return_to = source.place();
        let target = match known {
            // The wrong style is refused at the definition.
            Some(sub) if sub.style != style => Some(sub.line),
            Some(sub) => Some(sub.body),
            None => {
                let name = core::str::from_utf8(&self.flow.text).unwrap_or_default();
                source.find_subroutine(name).map_err(|cause| self.source_error(cause))?
            }
        };
        if known.is_none_or(|sub| sub.style != style) {
            self.flow.skip = Some(Name { scope: 0, label });
            self.flow.pending = Some((span, style));
        }
        self.flow.frames.push(Frame {
            style,
            sub: label,
            call: span,
            return_to,
            body: target.unwrap_or(return_to),
            repeats_left: repeats - 1,
            arguments: self.state.parameters.arguments(),
        });
        self.state.enter_sub(arguments);
        if let Some(target) = target {
            self.seek(source, target)?;
        }
        Ok(())
    }

    /// `endsub [e]`, `return [e]`.
    pub(super) fn return_from(
        &mut self,
        word: &OWord,
        source: &mut dyn LineSource,
    ) -> Result<Option<Saved>, Error> {
        let Some(frame) = self.flow.frames.last() else {
            return Err(self.flow_error(ErrorKind::ONotInSub, word.span));
        };
        if frame.style == Style::Fanuc {
            return Err(self.flow_error(ErrorKind::OStyle, word.span));
        }
        let (value, at) = match self.operand(word.operands)? {
            Some((value, at)) => (Some(value), at),
            None => (None, word.operands),
        };
        self.nothing_more(at)?;
        let saved = self.leave(source)?;
        self.state.set_return_value(value);
        Ok(saved)
    }

    pub(super) fn leave(&mut self, source: &mut dyn LineSource) -> Result<Option<Saved>, Error> {
        let Some(frame) = self.flow.frames.pop() else { return Ok(None) };
        let saved = self.state.forget_saved();
        if self.state.settings.dialect == Dialect::Pkm {
            let scope = self.flow.frames.len() as u32 + 2;
            // One by one: splitting the map would allocate.
            while self.flow.constructs.last_key_value().is_some_and(|(name, _)| name.scope >= scope) {
                self.flow.constructs.pop_last();
            }
        }
        let arguments = (frame.style == Style::OWord).then_some(frame.arguments);
        self.state.leave_sub(arguments);
        self.seek(source, frame.return_to)?;
        Ok(saved)
    }

    /// M98 P L: calls a Fanuc program L times.
    fn fanuc_call(&mut self, source: &mut dyn LineSource) -> Result<(), Error> {
        let span = self.block.m_span(crate::modal::MGroup::Call);
        let Some(p) = self.block.get(b'P') else {
            return Err(self.flow_error(ErrorKind::M98NoP, span));
        };
        let number = maths::round(p);
        if (p - number).abs() > 0.0001 || number.abs() > 1e9 {
            return Err(self.block.word_error(b'P', ErrorKind::NotInteger { value: p }));
        }
        let repeats = self.block.get(b'L').map_or(1, |l| l as i64);
        if repeats <= 0 {
            if self.state.settings.dialect != Dialect::Pkm {
                return self.enter_without_running(number as i32, source);
            }
            return Ok(());
        }
        let label = self.flow.number_label(number as i32);
        self.enter(label, Style::Fanuc, span, repeats, None, source)
    }

    /// M98 L0: LinuxCNC opens the call all the same and goes on in it, so that the next M99 returns to here (checked with
    /// rs274 2.9).
    fn enter_without_running(&mut self, number: i32, source: &mut dyn LineSource) -> Result<(), Error> {
        let span = self.block.m_span(crate::modal::MGroup::Call);
        if self.flow.frames.len() >= MAX_CALLS {
            return Err(self.flow_error(ErrorKind::ODepth { limit: MAX_CALLS as u8 }, span));
        }
        let (here, sub) = (source.place(), self.flow.number_label(number));
        self.flow.frames.push(Frame {
            style: Style::Fanuc,
            call: span,
            sub,
            return_to: here,
            body: here,
            repeats_left: 0,
            arguments: self.state.parameters.arguments(),
        });
        self.state.enter_sub(None);
        Ok(())
    }

    /// M99: returns from a Fanuc program. False at the main level, where it ends the program.
    pub(super) fn fanuc_return(
        &mut self,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<bool, Error> {
        let span = self.block.m_span(crate::modal::MGroup::Stop);
        let Some(frame) = self.flow.frames.last_mut() else { return Ok(false) };
        if frame.style == Style::OWord {
            return Err(self.flow_error(ErrorKind::OStyle, span));
        }
        if frame.repeats_left > 0 {
            frame.repeats_left -= 1;
            let body = frame.body;
            self.seek(source, body)?;
        } else {
            if let Some(saved) = self.leave(source)? {
                self.state.restore(&saved, span, &mut Out { sink, span, queue: &mut self.queue })?;
            }
        }
        Ok(true)
    }

    /// Calls the sub that gives a lathe cycle its profile (Q); it must have been passed already. The result is how many
    /// calls are open then.
    pub(in crate::interpreter) fn call_profile(
        &mut self,
        source: &mut dyn LineSource,
    ) -> Result<usize, Error> {
        let number = maths::round(self.block.get(b'Q').unwrap_or(0.0)).clamp(-1e9, 1e9) as i32;
        let label = self.flow.number_label(number);
        if self.flow.subs.get(&label).is_none_or(|sub| sub.style != Style::OWord) {
            return Err(self.block.word_error(b'Q', ErrorKind::LatheNoSub { number }));
        }
        let span = self.block.word_span(b'Q');
        let arguments = Some([0.0; ARGUMENTS]);
        self.enter(label, Style::OWord, span, 1, arguments, source)?;
        Ok(self.flow.frames.len())
    }

    /// Calls the sub of a remapped code, whose name is its label and its file's. The result of the sub before stays (checked with rs274 2.9).
    pub(in crate::interpreter) fn enter_remap(
        &mut self,
        sub: &str,
        span: Span,
        arguments: [f64; ARGUMENTS],
        count: usize,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        self.flow.text.clear();
        let _ = self.flow.text.extend_from_slice(sub.as_bytes());
        let label = self.flow.label();
        self.enter(label, Style::OWord, span, 1, Some(arguments), source)?;
        if self.state.settings.oword_nargs {
            let _ = self.state.parameters.set_named(b"n_args", count as f64);
        }
        Ok(())
    }

    /// The o-word just executed is no part of what follows.
    pub(in crate::interpreter) fn forget_o_word(&mut self) {
        self.flow.current = None;
    }

    /// Open calls.
    pub(in crate::interpreter) fn calls_open(&self) -> usize {
        self.flow.frames.len()
    }

    /// Executes M98 and M99 of the block just read. `None` if it has neither.
    pub(in crate::interpreter) fn program_call(
        &mut self,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<Option<Status>, Error> {
        if self.block.has_m(98) {
            self.fanuc_call(source)?;
            return Ok(Some(Status::Running));
        }
        if self.block.has_m(99) && self.flow.depth() > 0 && self.fanuc_return(source, sink)? {
            return Ok(Some(Status::Running));
        }
        Ok(None)
    }
}
