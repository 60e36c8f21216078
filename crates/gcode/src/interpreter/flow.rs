//! O-words: subroutines, branches and loops; Fanuc's M98 and M99 (dialect section 5).
//!
//! The source is read line by line and sought back for loops and calls, so a program of any length needs no memory
//! of its own. What is remembered: the places of subs already passed, and the labels of branches and loops.

mod branches;
mod recovery;
mod subs;

use super::Interpreter;
use super::saved::Saved;
use crate::error::{Error, ErrorKind};
use crate::expression;
use crate::lexer::{self, Keyword, Rest, into_fault};
use crate::o_word::{self, Head, LabelText, push_integer};
use crate::parameters::ARGUMENTS;
use crate::settings::Dialect;
use crate::source::{LineSource, Place, SourceError};
use alloc::{boxed::Box, collections::BTreeMap, vec::Vec};
use branches::Construct;
use pkm_canon::Span;

/// Deepest nesting of calls (LinuxCNC: ten levels with the main program).
const MAX_CALLS: usize = 9;

/// Most different labels (promise P5).
const MOST_LABELS: u32 = 100_000;

/// A label, numbered in the order of first appearance.
type Label = u32;

/// Subs are known everywhere (scope 0), branches and loops only within the program (scope 1) or the sub they are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Name {
    scope: u32,
    label: Label,
}

/// Subroutines in LinuxCNC's or in Fanuc's manner; they do not mix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    OWord,
    Fanuc,
}

/// A definition that was passed: the place behind its first line.
#[derive(Debug, Clone, Copy)]
struct Sub {
    span: Span,
    line: Place,
    body: Place,
    style: Style,
}

/// One open call.
#[derive(Debug, Clone)]
struct Frame {
    style: Style,
    sub: Label,
    /// The call, for messages.
    call: Span,
    return_to: Place,
    /// The place a Fanuc program starts again for its next repetition.
    body: Place,
    repeats_left: i64,
    arguments: [f64; ARGUMENTS],
}

/// Labels, open constructs and calls.
#[derive(Debug, Clone, Default)]
pub(crate) struct Flow {
    labels: BTreeMap<Box<[u8]>, Label>,
    subs: BTreeMap<Label, Sub>,
    constructs: BTreeMap<Name, Construct>,
    frames: Vec<Frame>,
    /// Lines are passed over up to an o-word with this name.
    skip: Option<Name>,
    /// The call that a forward search or a sub file has not answered yet, and the manner of the sub it wants.
    pending: Option<(Span, Style)>,
    /// The sub whose definition is being passed.
    defining: Option<Label>,
    /// A `break` or `continue` is on its way to the end of its loop. LinuxCNC has one flag of each kind, and forgets to
    /// clear the first at `endwhile` and the second at the `while` of a `do`: the next loop finds them still set.
    breaking: bool,
    continuing: bool,
    /// A part of the present `if` has run.
    branch_taken: bool,
    /// The label of the o-word or call being executed, as written.
    text: LabelText,
    /// The o-word of the line being executed, for recovery.
    current: Option<(Name, Option<Keyword>, Span)>,
    /// The loop that went round last.
    last_loop: Option<Span>,
    /// Labels of o-words that were wrong: what else is said about them only follows.
    wrong: Vec<Label>,
}

impl Flow {
    /// The label written in `text`.
    fn label(&mut self) -> Label {
        if let Some(label) = self.labels.get(&*self.text) {
            return *label;
        }
        let label = self.labels.len() as Label;
        self.labels.insert((&*self.text).into(), label);
        label
    }

    /// The label that is a number.
    fn number_label(&mut self, number: i32) -> Label {
        self.text.clear();
        push_integer(&mut self.text, number);
        self.label()
    }

    pub(crate) fn is_skipping(&self) -> bool {
        self.skip.is_some()
    }

    /// Open calls.
    pub(crate) fn depth(&self) -> usize {
        self.frames.len()
    }

    /// The loop that went round last, for the message about one that does not end.
    pub(crate) fn last_loop(&self) -> Option<Span> {
        self.last_loop
    }

    /// The open calls, innermost first.
    pub(crate) fn calls(&self) -> impl Iterator<Item = Span> {
        // A call whose sub is still looked for has not led anywhere.
        let begun = usize::from(self.pending.is_some());
        self.frames.iter().rev().skip(begun).map(|frame| frame.call)
    }

    /// All labels read so far, as written.
    #[cfg(feature = "std")]
    pub(crate) fn label_names(&self) -> impl Iterator<Item = &[u8]> {
        self.labels.keys().map(|text| &**text)
    }

    /// The label of the sub that is looked for.
    #[cfg(feature = "std")]
    pub(crate) fn missing(&self) -> Option<&[u8]> {
        self.pending?;
        let wanted = self.skip?.label;
        self.labels.iter().find(|(_, label)| **label == wanted).map(|(text, _)| &**text)
    }

    /// At the end of the file: the call without a sub.
    pub(crate) fn unanswered(&self) -> Option<Error> {
        self.pending.map(|(span, _)| Error { kind: ErrorKind::ONotFound, span })
    }

    /// At the end of the program: the call without a sub, or the construct or sub whose end the lines passed over should
    /// have held.
    pub(crate) fn unclosed(&self) -> Option<Error> {
        let sub = |label: Label| self.subs.get(&label).map(|sub| sub.span);
        self.unanswered().or_else(|| {
            let span = match (self.skip, self.frames.last()) {
                (Some(skip), _) if self.defining == Some(skip.label) => sub(skip.label),
                (Some(skip), _) => self.constructs.get(&skip).map(|open| open.span),
                (None, Some(frame)) if frame.style == Style::OWord => sub(frame.sub),
                (None, _) => None,
            };
            Some(Error { kind: ErrorKind::OUnclosed, span: span? })
        })
    }

    /// True if an error in the o-word that should have ended what is passed over was told.
    pub(crate) fn misses_a_wrong_end(&self) -> bool {
        self.skip.is_some_and(|skip| self.wrong.contains(&skip.label))
    }
}

/// An o-word as read: where its label, keyword and operands are.
struct OWord {
    name: Name,
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
        let Head { mut keyword, operands, wrong } =
            o_word::head(&self.line, start, &self.state, &mut self.flow.text)?;
        if let Some(error) = wrong {
            // Within a definition that is passed LinuxCNC reads no keyword but sub, endsub and return; nor a call.
            if self.flow.defining.is_none() || self.state.settings.dialect == Dialect::Pkm {
                let label = self.flow.label();
                self.flow.wrong.push(label);
                return Err(error);
            }
            keyword = Some(Keyword::Call);
        }
        let span = self.line.code_span(start, operands);
        if self.flow.labels.len() >= MOST_LABELS as usize {
            return Err(self.flow_error(ErrorKind::OTooMany { limit: MOST_LABELS }, span));
        }
        let label = self.flow.label();
        let scope = match keyword {
            None | Some(Keyword::Sub | Keyword::Endsub | Keyword::Call | Keyword::Return) => 0,
            Some(_) => self.scope(),
        };
        Ok(OWord { name: Name { scope, label }, keyword, operands, span })
    }

    /// Where the labels of branches and loops count. In LinuxCNC all calls of one sub share them: a repeat that a
    /// `return` cut short goes on with what is left of its count at the next call (checked with rs274 2.9).
    fn scope(&self) -> u32 {
        match (self.state.settings.dialect, self.flow.frames.last()) {
            (Dialect::Pkm, _) => self.flow.frames.len() as u32 + 1,
            (_, Some(frame)) => frame.sub + 2,
            (_, None) => self.flow.defining.map_or(1, |sub| sub + 2),
        }
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

    /// Behind an o-word only comments may follow. LinuxCNC does not look while it skips lines (checked with rs274 2.9).
    fn nothing_more(&self, at: usize) -> Result<(), Error> {
        if self.flow.skip.is_some() && self.state.settings.dialect != Dialect::Pkm {
            return Ok(());
        }
        let end = self.line.code().len();
        match self.behind_comments(at) {
            at if at >= end => Ok(()),
            at => Err(self.flow_error(ErrorKind::OTrailing, self.line.code_span(at, end))),
        }
    }

    /// The offset behind the comments that stand at an offset.
    fn behind_comments(&self, at: usize) -> usize {
        let code = self.line.code();
        let mut rest: Rest<'_> = code.get(at..).unwrap_or_default();
        while let Ok((after, _)) = lexer::comment(rest) {
            rest = after;
        }
        code.len() - rest.len()
    }

    /// An o-word line. `here` is the place of the line itself. The result is the state that M73 wants back.
    pub(super) fn o_word(
        &mut self,
        start: usize,
        here: Place,
        source: &mut dyn LineSource,
    ) -> Result<Option<Saved>, Error> {
        self.flow.current = None;
        let word = self.read_o_word(start)?;
        self.flow.current = Some((word.name, word.keyword, word.span));
        let begins_sub = matches!(word.keyword, None | Some(Keyword::Sub));
        if self.flow.defining.is_some() && begins_sub {
            return Err(self.flow_error(ErrorKind::ONestedSub, word.span));
        }
        if self.flow.skip.is_some_and(|name| name != word.name) {
            return Ok(None);
        }
        let skipping = self.flow.skip.is_some();
        if self.is_branch() && self.depends_on_an_error() {
            // Recovery passes over it without another word.
            return Err(self.flow_error(ErrorKind::ParamUndefined, word.span));
        }
        let wanted = self.flow.pending.is_some();
        match word.keyword {
            None | Some(Keyword::Sub) if wanted => self.found_sub(&word, here, source)?,
            None => self.fanuc_program(&word, here, source)?,
            Some(Keyword::Sub) => self.define(&word, here, source)?,
            Some(Keyword::Endsub | Keyword::Return) if skipping => self.passed_return(&word)?,
            Some(Keyword::Endsub | Keyword::Return) => return self.return_from(&word, source),
            Some(Keyword::Call) if skipping => {}
            Some(Keyword::Call) => self.call(&word, source)?,
            Some(keyword) => self.branch_or_loop(keyword, &word, here, source)?,
        }
        Ok(None)
    }
}
