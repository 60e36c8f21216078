//! O-words: subroutines, branches and loops; Fanuc's M98 and M99 (dialect section 5).
//!
//! The source is read line by line and sought back for loops and calls, so a program of any length needs no memory
//! of its own. What is remembered: the places of subs already passed, and for every open call its flow labels.

use super::saved::Saved;
use super::{Interpreter, Out, Status};
use crate::error::{Error, ErrorKind};
use crate::expression::{self, Scope};
use crate::lexer::{self, Keyword, Rest, into_fault};
use crate::parameters::ARGUMENTS;
use crate::settings::Dialect;
use crate::source::{LineSource, Place, SourceError};
use alloc::{boxed::Box, collections::BTreeMap, vec::Vec};
use pkm_canon::{CanonSink, Span};
use pkm_kins::maths;

/// Deepest nesting of calls (LinuxCNC: ten levels with the main program).
const MAX_CALLS: usize = 9;

/// A label, numbered in the order of first appearance.
type Label = u32;

/// A label as written: decimal digits or the name between the brackets.
type LabelText = heapless::Vec<u8, 256>;

/// Subroutines in LinuxCNC's or in Fanuc's manner; they do not mix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    OWord,
    Fanuc,
}

/// A definition that was passed: the place behind its first line.
#[derive(Debug, Clone, Copy)]
struct Sub {
    line: Place,
    body: Place,
    style: Style,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    If,
    /// The place of the `while` line itself.
    While(Place),
    /// The place behind the `do` line.
    Do(Place),
    /// The place behind the `repeat` line, how often it is still to run, and whether this is the second of two
    /// runs that count as one (see [`Flow::stale_continue`]).
    Repeat(Place, i64, bool),
}

/// A branch or loop of the present call level; `line` tells uses of one label apart.
#[derive(Debug, Clone, Copy)]
struct Construct {
    label: Label,
    kind: Kind,
    line: Place,
    span: Span,
}

/// What ends the skipping of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Until {
    /// A branch that was false: the next elseif, else or endif.
    Branch,
    /// A branch that was taken has ended.
    Endif,
    Endwhile,
    Endrepeat,
    /// The while of a do; `test` after continue, not after break.
    DoWhile {
        test: bool,
    },
    /// The end of a definition passed at the main level.
    Endsub,
    /// The definition of a called sub.
    Sub(Style),
}

#[derive(Debug, Clone, Copy)]
struct Skip {
    label: Label,
    until: Until,
}

/// One open call.
#[derive(Debug, Clone)]
struct Frame {
    style: Style,
    return_to: Place,
    /// The place a Fanuc program starts again for its next repetition.
    body: Place,
    repeats_left: i64,
    arguments: [f64; ARGUMENTS],
    first_construct: usize,
}

/// Labels, open constructs and calls.
#[derive(Debug, Clone, Default)]
pub(crate) struct Flow {
    labels: BTreeMap<Box<[u8]>, Label>,
    subs: BTreeMap<Label, Sub>,
    constructs: Vec<Construct>,
    frames: Vec<Frame>,
    skip: Option<Skip>,
    /// The call that a forward search or a sub file has not answered yet.
    pending: Option<Span>,
    /// A definition is being passed.
    defining: bool,
    /// LinuxCNC forgets to end a `break` out of a while: the next do then runs only once.
    stale_break: bool,
    /// LinuxCNC forgets to end a `continue` of a do: the next repeat then runs twice as often,
    /// and the next `break` out of a while only goes on with it.
    stale_continue: bool,
    text: LabelText,
}

impl Flow {
    fn intern(&mut self, text: &[u8]) -> Label {
        if let Some(label) = self.labels.get(text) {
            return *label;
        }
        let label = self.labels.len() as Label;
        self.labels.insert(text.into(), label);
        label
    }

    pub(crate) fn is_skipping(&self) -> bool {
        self.skip.is_some()
    }

    /// Open calls.
    pub(crate) fn depth(&self) -> usize {
        self.frames.len()
    }

    /// At the end of the file: the call without a sub.
    pub(crate) fn unanswered(&self) -> Option<Error> {
        match (self.skip?.until, self.pending) {
            (Until::Sub(_), Some(span)) => Some(Error { kind: ErrorKind::ONotFound, span }),
            _ => None,
        }
    }

    /// At the closing `%`: the call without a sub, or the construct without an end.
    pub(crate) fn unclosed(&self) -> Option<Error> {
        let skip = self.skip?;
        self.unanswered().or_else(|| {
            let open = self.constructs.iter().rev().find(|construct| construct.label == skip.label)?;
            Some(Error { kind: ErrorKind::OUnclosed, span: open.span })
        })
    }

    fn find(&mut self, label: Label) -> Option<&mut Construct> {
        let first = self.frames.last().map_or(0, |frame| frame.first_construct);
        self.constructs.iter_mut().skip(first).find(|construct| construct.label == label)
    }
}

/// An o-word as read: where its label, keyword and operands are.
struct OWord {
    label: Label,
    keyword: Option<Keyword>,
    /// Offset of the operands in the prepared line.
    operands: usize,
    span: Span,
}

impl Interpreter {
    fn flow_error(&self, kind: ErrorKind, span: Span) -> Error {
        Error { kind, span }
    }

    fn seek(&self, source: &mut dyn LineSource, place: Place) -> Result<(), Error> {
        source.seek(place).map_err(|cause| self.source_error(cause))
    }

    fn source_error(&self, cause: SourceError) -> Error {
        Error { kind: ErrorKind::FileOpen { cause }, span: self.line.whole() }
    }

    /// Reads label and keyword behind the `o` at `start`.
    fn read_o_word(&mut self, start: usize) -> Result<OWord, Error> {
        let code = self.line.code();
        let fail = |fault| crate::block::fault_error(&self.line, fault);
        let input = &code[start + 1..];
        let mut text = LabelText::new();
        let rest = if input.first() == Some(&b'<') {
            let (rest, name) = lexer::name(input).map_err(|_| {
                let kind = ErrorKind::ParamNameOpen;
                self.flow_error(kind, self.line.code_span(start, code.len()))
            })?;
            let _ = text.extend_from_slice(name);
            rest
        } else {
            if input.is_empty() {
                return Err(self.flow_error(ErrorKind::OLabel, self.line.code_span(start, start + 1)));
            }
            let (rest, number) = expression::integer(input, &self.state).map_err(|e| fail(into_fault(e)))?;
            push_integer(&mut text, number);
            rest
        };
        let at = code.len() - rest.len();
        let keyword = match lexer::keyword(rest) {
            Ok((after, keyword)) => Some((keyword, code.len() - after.len())),
            Err(_) if rest.is_empty() || rest[0] == b'(' => None,
            Err(_) => {
                let length = rest.iter().take_while(|b| b.is_ascii_alphanumeric()).count().max(1);
                return Err(self.flow_error(ErrorKind::OUnknown, self.line.code_span(at, at + length)));
            }
        };
        let end = keyword.map_or(at, |(_, end)| end);
        let span = self.line.code_span(start, end);
        self.flow.text.clear();
        let _ = self.flow.text.extend_from_slice(&text);
        let label = self.flow.intern(&text);
        Ok(OWord { label, keyword: keyword.map(|(keyword, _)| keyword), operands: end, span })
    }

    /// The operand of a test: `[expression]`, required.
    fn test(&self, word: &OWord) -> Result<f64, Error> {
        let (value, rest) =
            self.operand(word.operands)?.ok_or_else(|| self.flow_error(ErrorKind::ExprBracket, word.span))?;
        self.nothing_more(rest)?;
        Ok(value)
    }

    /// `[expression]` at an offset of the prepared line, if it is there, and the offset behind it.
    fn operand(&self, at: usize) -> Result<Option<(f64, usize)>, Error> {
        let code = self.line.code();
        let input: Rest<'_> = &code[at..];
        if input.first() != Some(&b'[') {
            return Ok(None);
        }
        let (rest, value) = expression::bracketed(input, &self.state)
            .map_err(|error| crate::block::fault_error(&self.line, into_fault(error)))?;
        Ok(Some((value, code.len() - rest.len())))
    }

    /// Behind an o-word only a comment may follow.
    fn nothing_more(&self, at: usize) -> Result<(), Error> {
        let code = self.line.code();
        match code.get(at) {
            None | Some(b'(') => Ok(()),
            Some(_) => Err(self.flow_error(ErrorKind::OTrailing, self.line.code_span(at, code.len()))),
        }
    }

    /// An o-word line. `here` is the place of the line itself. The result is the state that M73 wants back.
    pub(super) fn o_word(
        &mut self,
        start: usize,
        here: Place,
        source: &mut dyn LineSource,
    ) -> Result<Option<Saved>, Error> {
        let word = self.read_o_word(start)?;
        if self.flow.defining && word.keyword == Some(Keyword::Sub) {
            return Err(self.flow_error(ErrorKind::ONestedSub, word.span));
        }
        if self.flow.skip.is_some() {
            return self.skipped_o_word(&word, here, source).map(|()| None);
        }
        match word.keyword {
            None => self.fanuc_program(&word, here, source)?,
            Some(Keyword::Sub) => self.define(&word, here, source)?,
            Some(Keyword::Endsub | Keyword::Return) => return self.return_from(&word, source),
            Some(Keyword::Call) => self.call(&word, source)?,
            Some(keyword) => self.branch_or_loop(keyword, &word, here, source)?,
        }
        Ok(None)
    }

    /// While lines are skipped only the o-word that ends the skipping counts.
    fn skipped_o_word(
        &mut self,
        word: &OWord,
        here: Place,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        let Some(skip) = self.flow.skip else { return Ok(()) };
        if word.label != skip.label {
            return Ok(());
        }
        let found = match (skip.until, word.keyword) {
            (Until::Branch, Some(Keyword::Elseif)) => self.test(word)? != 0.0,
            (Until::Endif, Some(Keyword::Elseif)) => {
                // LinuxCNC reads the test of every elseif of this label.
                self.test(word)?;
                false
            }
            (Until::Branch, Some(Keyword::Else | Keyword::Endif)) | (Until::Endif, Some(Keyword::Endif)) => {
                true
            }
            (Until::Endwhile, Some(Keyword::Endwhile)) => {
                if core::mem::take(&mut self.flow.stale_continue)
                    && let Some(Kind::While(begin)) =
                        self.flow.find(skip.label).map(|construct| construct.kind)
                {
                    self.seek(source, begin)?;
                }
                true
            }
            (Until::Endrepeat, Some(Keyword::Endrepeat)) => {
                self.flow.stale_continue = false;
                true
            }
            (Until::Endsub, Some(Keyword::Endsub)) => {
                self.flow.defining = false;
                // LinuxCNC sets the result already where the definition is passed.
                if self.state.settings.dialect != Dialect::Pkm {
                    self.state.unknown_names_are_zero = true;
                    let operand = self.operand(word.operands);
                    self.state.unknown_names_are_zero = false;
                    self.state.set_return_value(operand?.map(|(value, _)| value));
                }
                true
            }
            (Until::DoWhile { test }, Some(Keyword::While)) => {
                self.flow.skip = None;
                if !test {
                    self.flow.stale_break = false;
                }
                if test {
                    self.branch_or_loop(Keyword::While, word, here, source)?;
                }
                return Ok(());
            }
            (Until::Sub(Style::OWord), Some(Keyword::Sub)) => {
                self.remember(word, here, source.place(), Style::OWord);
                self.flow.pending = None;
                true
            }
            (Until::Sub(Style::Fanuc), None) => {
                let body = source.place();
                self.remember(word, here, body, Style::Fanuc);
                if let Some(frame) = self.flow.frames.last_mut() {
                    frame.body = body;
                }
                self.flow.pending = None;
                true
            }
            (Until::Sub(_), Some(Keyword::Sub) | None) => {
                return Err(self.flow_error(ErrorKind::OStyle, word.span));
            }
            _ => false,
        };
        if found {
            self.flow.skip = None;
        }
        Ok(())
    }

    fn remember(&mut self, word: &OWord, line: Place, body: Place, style: Style) {
        self.flow.subs.insert(word.label, Sub { line, body, style });
    }

    /// `O5` alone: a Fanuc program begins. Reached in order it simply runs.
    fn fanuc_program(&mut self, word: &OWord, here: Place, source: &mut dyn LineSource) -> Result<(), Error> {
        self.nothing_more(word.operands)?;
        self.remember(word, here, source.place(), Style::Fanuc);
        Ok(())
    }

    /// `sub` reached in order: its body is passed over.
    fn define(&mut self, word: &OWord, here: Place, source: &mut dyn LineSource) -> Result<(), Error> {
        self.nothing_more(word.operands)?;
        if let Some(known) = self.flow.subs.get(&word.label) {
            // LinuxCNC refuses even the same definition once a call has run it.
            if known.line != here || self.state.settings.dialect != Dialect::Pkm {
                return Err(self.flow_error(ErrorKind::ORedefinedSub, word.span));
            }
        }
        self.remember(word, here, source.place(), Style::OWord);
        self.flow.defining = true;
        self.flow.skip = Some(Skip { label: word.label, until: Until::Endsub });
        Ok(())
    }

    /// `call [..] [..]`.
    fn call(&mut self, word: &OWord, source: &mut dyn LineSource) -> Result<(), Error> {
        let mut arguments = [0.0; ARGUMENTS];
        let (mut at, mut count) = (word.operands, 0);
        while let Some((value, next)) = self.operand(at)? {
            let Some(argument) = arguments.get_mut(count) else {
                let kind = ErrorKind::OArgs { limit: ARGUMENTS as u8 };
                return Err(self.flow_error(kind, self.line.code_span(at, next)));
            };
            *argument = value;
            (at, count) = (next, count + 1);
        }
        self.nothing_more(at)?;
        self.state.set_return_value(None);
        self.enter(word.label, Style::OWord, word.span, 1, Some(arguments), source)
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
            self.flow.skip = Some(Skip { label, until: Until::Sub(style) });
            self.flow.pending = Some(span);
        }
        self.flow.frames.push(Frame {
            style,
            return_to,
            body: target.unwrap_or(return_to),
            repeats_left: repeats - 1,
            arguments: self.state.parameters.arguments(),
            first_construct: self.flow.constructs.len(),
        });
        self.state.enter_sub(arguments);
        if let Some(target) = target {
            self.seek(source, target)?;
        }
        Ok(())
    }

    /// `endsub [e]`, `return [e]`.
    fn return_from(&mut self, word: &OWord, source: &mut dyn LineSource) -> Result<Option<Saved>, Error> {
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

    fn leave(&mut self, source: &mut dyn LineSource) -> Result<Option<Saved>, Error> {
        let Some(frame) = self.flow.frames.pop() else { return Ok(None) };
        let saved = self.state.forget_saved();
        self.flow.constructs.truncate(frame.first_construct);
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
            return Ok(());
        }
        let mut text = LabelText::new();
        push_integer(&mut text, number as i32);
        let label = self.flow.intern(&text);
        self.flow.text = text;
        self.enter(label, Style::Fanuc, span, repeats, None, source)
    }

    /// M99: returns from a Fanuc program. False at the main level, where it ends the program.
    fn fanuc_return(&mut self, source: &mut dyn LineSource, sink: &mut dyn CanonSink) -> Result<bool, Error> {
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

    fn branch_or_loop(
        &mut self,
        keyword: Keyword,
        word: &OWord,
        here: Place,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        let label = word.label;
        let unknown = Err(self.flow_error(ErrorKind::OLabelUnknown, word.span));
        let open = self.flow.find(label).map(|construct| construct.kind);
        let skip = |until| Some(Skip { label, until });
        match keyword {
            Keyword::If => {
                let taken = self.test(word)? != 0.0;
                self.open(word, here, Kind::If)?;
                if !taken {
                    self.flow.skip = skip(Until::Branch);
                }
            }
            Keyword::Elseif | Keyword::Else | Keyword::Endif => {
                if keyword == Keyword::Elseif {
                    self.test(word)?;
                } else if keyword == Keyword::Endif || self.state.settings.dialect == Dialect::Pkm {
                    self.nothing_more(word.operands)?;
                }
                if open != Some(Kind::If) {
                    return unknown;
                }
                if keyword != Keyword::Endif {
                    self.flow.skip = skip(Until::Endif);
                }
            }
            Keyword::While => {
                let go_on = self.test(word)? != 0.0;
                if let Some(Kind::Do(body)) = open {
                    let stale = core::mem::take(&mut self.flow.stale_break);
                    if go_on && !stale {
                        self.seek(source, body)?;
                    }
                    return Ok(());
                }
                self.open(word, here, Kind::While(here))?;
                if !go_on {
                    self.flow.skip = skip(Until::Endwhile);
                }
            }
            Keyword::Endwhile => {
                self.nothing_more(word.operands)?;
                let Some(Kind::While(begin)) = open else { return unknown };
                self.flow.stale_continue = false;
                self.seek(source, begin)?;
            }
            Keyword::Do => {
                self.nothing_more(word.operands)?;
                self.open(word, here, Kind::Do(source.place()))?;
            }
            Keyword::Repeat => {
                let count = self.repeat_count(self.test(word)?, word)?;
                self.open(word, here, Kind::Repeat(source.place(), count, false))?;
                if count <= 0 {
                    self.flow.skip = skip(Until::Endrepeat);
                }
            }
            Keyword::Endrepeat => {
                self.nothing_more(word.operands)?;
                let Some(Kind::Repeat(body, left, second)) = open else { return unknown };
                let (left, second) = match self.flow.stale_continue && !second {
                    true => (left, true),
                    false => (left - 1, false),
                };
                if left > 0 {
                    if let Some(construct) = self.flow.find(label) {
                        construct.kind = Kind::Repeat(body, left, second);
                    }
                    self.seek(source, body)?;
                } else {
                    self.flow.stale_continue = false;
                }
            }
            Keyword::Break | Keyword::Continue => {
                self.nothing_more(word.operands)?;
                let goes_on = keyword == Keyword::Continue;
                match open {
                    Some(Kind::While(begin)) if goes_on => self.seek(source, begin)?,
                    Some(Kind::While(_)) => {
                        self.flow.skip = skip(Until::Endwhile);
                        self.flow.stale_break = self.state.settings.dialect != Dialect::Pkm;
                    }
                    Some(Kind::Do(_)) => {
                        self.flow.skip = skip(Until::DoWhile { test: goes_on });
                        if goes_on {
                            self.flow.stale_continue = self.state.settings.dialect != Dialect::Pkm;
                        }
                    }
                    _ => return unknown,
                }
            }
            Keyword::Sub | Keyword::Endsub | Keyword::Call | Keyword::Return => {}
        }
        Ok(())
    }

    /// LinuxCNC rounds to the nearest even number at a half; pkm wants a whole number.
    fn repeat_count(&self, value: f64, word: &OWord) -> Result<i64, Error> {
        if self.state.strict() && value != maths::floor(value) {
            return Err(self.flow_error(ErrorKind::NotInteger { value }, word.span));
        }
        Ok(value.round_ties_even() as i64)
    }

    /// Opens a construct, or opens it again at the same line.
    fn open(&mut self, word: &OWord, line: Place, kind: Kind) -> Result<(), Error> {
        match self.flow.find(word.label) {
            Some(construct) if construct.line != line => {
                Err(self.flow_error(ErrorKind::OLabelDuplicate, word.span))
            }
            Some(construct) => {
                construct.kind = kind;
                Ok(())
            }
            None => {
                self.flow.constructs.push(Construct { label: word.label, kind, line, span: word.span });
                Ok(())
            }
        }
    }

    /// Executes M98 and M99 of the block just read. `None` if it has neither.
    pub(super) fn program_call(
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

fn push_integer(text: &mut LabelText, number: i32) {
    use core::fmt::Write;
    struct Digits<'a>(&'a mut LabelText);
    impl Write for Digits<'_> {
        fn write_str(&mut self, s: &str) -> core::fmt::Result {
            self.0.extend_from_slice(s.as_bytes()).map_err(|_| core::fmt::Error)
        }
    }
    let _ = write!(Digits(text), "{number}");
}
