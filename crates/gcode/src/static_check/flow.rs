//! O-words: constructs without an end, labels used twice or never, subs that are missing or never called, loops that
//! cannot end.

use super::names::{Parameter, Unknowns};
use super::{Finding, MOST_FILES, MOST_FINDINGS, Name, Region, StaticCheck};
use crate::block::fault_error;
use crate::error::{Error, ErrorKind};
use crate::expression::{self, UNKNOWN};
use crate::lexer::{Keyword, into_fault};
use crate::o_word::{self, LabelText};
use crate::parameters::{ARGUMENTS, Parameters};
use crate::source::LineSource;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;
use pkm_canon::Span;
use pkm_canon::diagnostic::Severity;

/// Deepest nesting of branches and loops.
const MAX_NESTING: usize = 100;

/// Where a sub is defined.
pub(super) struct Definition {
    span: Span,
    line: Vec<u8>,
    /// It is the program's own o-word sub, not one of a file and not a Fanuc program.
    own: bool,
}

/// An open branch or loop.
pub(super) struct Open {
    keyword: Keyword,
    /// Empty if only a run can tell.
    label: Name,
    span: Span,
    line: Vec<u8>,
    /// The test of a while: its value where it is constant, what it reads.
    test: Option<(f64, Vec<Parameter>)>,
    /// What the body sets.
    pub(super) changes: BTreeSet<Parameter>,
    /// Something in the body leaves the loop.
    left: bool,
    /// The body calls subs.
    calls: bool,
}

impl StaticCheck<'_> {
    pub(super) fn o_word(&mut self, start: usize) {
        let seen = Unknowns::new(self.strict());
        let mut label = LabelText::new();
        let head = match o_word::head(&self.line, start, &seen, &mut label) {
            Ok(head) => head,
            Err(error) => return self.fail(error),
        };
        if let Some(error) = head.wrong {
            self.wrong.insert(label.to_vec());
            return self.fail(error);
        }
        let span = self.line.code_span(start, head.operands);
        let label = label.to_vec();
        let Some(keyword) = head.keyword else {
            self.take_reads(&seen);
            return self.fanuc_begins(label, span);
        };
        if self.region == Region::Dead && keyword != Keyword::Sub {
            return;
        }
        self.take_reads(&seen);
        let operands = Unknowns::new(self.strict());
        let test = self.operands(keyword, head.operands, &operands);
        self.take_reads(&operands);
        let test = match test {
            Ok(value) => value.map(|value| (value, operands.read.take())),
            Err(error) => {
                self.fail(error);
                None
            }
        };
        match keyword {
            Keyword::Sub => self.sub_begins(label, span),
            Keyword::Endsub => self.sub_ends(&label, span),
            Keyword::Return => {
                if self.sub.is_none() {
                    self.add(ErrorKind::ONotInSub, span, Severity::Error);
                }
                self.exits_all();
            }
            Keyword::Call => self.calls_sub((!label.is_empty()).then_some(label), span),
            Keyword::If | Keyword::Do | Keyword::Repeat => self.opens(keyword, label, span, test),
            Keyword::While => match self.find(&label, &[Keyword::Do]) {
                Some(at) => {
                    self.close_down_to(at);
                    if let Some(mut open) = self.open.pop() {
                        open.test = test;
                        self.judge_loop(open);
                    }
                }
                None => self.opens(keyword, label, span, test),
            },
            Keyword::Elseif | Keyword::Else => drop(self.inside(&label, &[Keyword::If], span)),
            Keyword::Endif => self.closes(&label, &[Keyword::If], span),
            Keyword::Endwhile => self.closes(&label, &[Keyword::While], span),
            Keyword::Endrepeat => self.closes(&label, &[Keyword::Repeat], span),
            Keyword::Break | Keyword::Continue => {
                if let Some(at) = self.inside(&label, &[Keyword::While, Keyword::Do], span) {
                    // A continue of an outer loop leaves the inner ones.
                    let first = at + usize::from(keyword == Keyword::Continue);
                    self.open[first..].iter_mut().for_each(|open| open.left = true);
                }
            }
        }
    }

    /// Reads what stands behind the keyword; the value of a test.
    fn operands(&self, keyword: Keyword, at: usize, seen: &Unknowns) -> Result<Option<f64>, Error> {
        let code = self.line.code();
        let (mut at, mut count, mut value) = (at, 0_usize, None);
        let fail = |kind, from, to| Err(Error { kind, span: self.line.code_span(from, to) });
        let (least, most) = match keyword {
            Keyword::If | Keyword::Elseif | Keyword::While | Keyword::Repeat => (1, 1),
            Keyword::Endsub | Keyword::Return => (0, 1),
            Keyword::Call => (0, ARGUMENTS),
            _ => (0, 0),
        };
        while code.get(at) == Some(&b'[') && count < most {
            let (rest, result) = expression::bracketed(&code[at..], seen)
                .map_err(|error| fault_error(&self.line, into_fault(error)))?;
            value = Some(result);
            (at, count) = (code.len() - rest.len(), count + 1);
        }
        match code.get(at) {
            _ if count < least => fail(ErrorKind::ExprBracket, 0, at),
            Some(b'[') if keyword == Keyword::Call => {
                fail(ErrorKind::OArgs { limit: ARGUMENTS as u8 }, at, code.len())
            }
            None | Some(b'(') => Ok(value),
            Some(_) if keyword == Keyword::Else && !self.strict() => Ok(None),
            Some(_) => fail(ErrorKind::OTrailing, at, code.len()),
        }
    }

    /// The innermost open construct of one of these kinds with this label.
    fn find(&self, label: &[u8], keywords: &[Keyword]) -> Option<usize> {
        let same = |open: &Open| open.label.is_empty() || label.is_empty() || open.label == label;
        self.open.iter().rposition(|open| keywords.contains(&open.keyword) && same(open))
    }

    /// [`StaticCheck::find`], with an error where there is none.
    fn inside(&mut self, label: &[u8], keywords: &[Keyword], span: Span) -> Option<usize> {
        let found = self.find(label, keywords);
        if found.is_none() && !self.wrong.contains(label) {
            self.add(ErrorKind::OLabelUnknown, span, Severity::Error);
        }
        found
    }

    fn opens(&mut self, keyword: Keyword, label: Name, span: Span, test: Option<(f64, Vec<Parameter>)>) {
        match self.labels.get(&label) {
            Some(first) if !label.is_empty() => {
                let other = Some(("the label is used here first", *first));
                self.add_with(ErrorKind::OLabelDuplicate, span, Severity::Error, other);
            }
            _ => drop(self.labels.insert(label.clone(), span)),
        }
        if self.open.len() == MAX_NESTING {
            self.add(ErrorKind::ONesting { limit: MAX_NESTING as u8 }, span, Severity::Error);
        }
        let line = self.line.raw().to_vec();
        let changes = BTreeSet::new();
        self.open.push(Open { keyword, label, span, line, test, changes, left: false, calls: false });
    }

    fn closes(&mut self, label: &[u8], keywords: &[Keyword], span: Span) {
        let Some(at) = self.inside(label, keywords, span) else { return };
        self.close_down_to(at);
        if let Some(open) = self.open.pop() {
            self.judge_loop(open);
        }
    }

    /// Constructs that are still open inside the one that ends now.
    fn close_down_to(&mut self, at: usize) {
        while self.open.len() > at + 1 {
            if let Some(open) = self.open.pop() {
                self.unclosed(&open);
            }
        }
    }

    fn unclosed(&mut self, open: &Open) {
        if !self.wrong.contains(&open.label) {
            self.add_line(ErrorKind::OUnclosed, open.span, Severity::Error, &open.line);
        }
    }

    fn close_all(&mut self) {
        while let Some(open) = self.open.pop() {
            self.unclosed(&open);
        }
    }

    /// A loop has been read to its end: can it end when it runs?
    fn judge_loop(&mut self, open: Open) {
        // What an inner body does, the outer one does.
        let Some((value, reads)) = &open.test else { return };
        if open.left || *value == 0.0 || !matches!(open.keyword, Keyword::While | Keyword::Do) {
            return;
        }
        if reads.is_empty() {
            if value.is_nan() {
                return;
            }
            let finding = Finding {
                error: Error { kind: ErrorKind::LoopAlways, span: open.span },
                severity: Severity::Error,
                line: open.line.clone(),
                other: None,
            };
            match open.calls {
                true => self.endless_with_calls.push(finding),
                false => self.findings.push(finding),
            }
            return;
        }
        let any_number = open.changes.contains(&Parameter::Number(UNKNOWN));
        let changes = |parameter: &Parameter| {
            open.changes.contains(parameter)
                || parameter.is_alive()
                || (open.calls && parameter.is_global())
                || (any_number && matches!(parameter, Parameter::Number(_)))
        };
        if !reads.iter().any(changes) {
            self.add_line(ErrorKind::LoopUnchanged, open.span, Severity::Warning, &open.line);
        }
    }

    /// Something leaves every open loop.
    pub(super) fn exits_all(&mut self) {
        self.open.iter_mut().for_each(|open| open.left = true);
    }

    /// M2, M30.
    pub(super) fn program_ends(&mut self) {
        self.exits_all();
        match self.region {
            Region::Sub => self.sub_ends_program = true,
            _ if self.open.is_empty() => self.region = Region::Dead,
            _ => {}
        }
    }

    /// M99: the end of a Fanuc program, or of the main program.
    pub(super) fn fanuc_ends(&mut self) {
        self.exits_all();
        if self.open.is_empty() && self.sub.is_none() {
            self.region = Region::Dead;
        }
    }

    /// `O5` alone: what follows runs when it is called, and in order too where the program comes to it.
    fn fanuc_begins(&mut self, label: Name, span: Span) {
        if self.sub.is_some() {
            return self.add(ErrorKind::OStyle, span, Severity::Error);
        }
        self.region = Region::Main;
        if !label.is_empty() {
            let line = self.line.raw().to_vec();
            self.definitions.entry(label).or_insert(Definition { span, line, own: false });
        }
    }

    fn sub_begins(&mut self, label: Name, span: Span) {
        if let Some((_, first, _)) = &self.sub {
            let other = Some(("inside this sub", *first));
            self.wrong.insert(label);
            return self.add_with(ErrorKind::ONestedSub, span, Severity::Error, other);
        }
        let own = span.file.0 == 0;
        if let Some(first) = self.definitions.get(&label).filter(|first| first.span.file == span.file) {
            let other = Some(("defined here first", first.span));
            self.add_with(ErrorKind::ORedefinedSub, span, Severity::Error, other);
        }
        let line = self.line.raw().to_vec();
        if !label.is_empty() {
            let definition = Definition { span, line: line.clone(), own };
            self.definitions.entry(label.clone()).or_insert(definition);
        }
        let open = core::mem::take(&mut self.open);
        let labels = core::mem::take(&mut self.labels);
        self.outside = (open, labels, self.region);
        self.region = Region::Sub;
        self.sub = Some((label, span, line));
    }

    fn sub_ends(&mut self, label: &[u8], span: Span) {
        let Some((begun, ..)) = &self.sub else {
            if !self.wrong.contains(label) {
                self.add(ErrorKind::ONotInSub, span, Severity::Error);
            }
            return;
        };
        if begun != label && self.wrong.contains(label) {
            return;
        }
        if !label.is_empty() && begun != label {
            self.add(ErrorKind::OLabelUnknown, span, Severity::Error);
        }
        self.close_sub();
    }

    fn close_sub(&mut self) {
        self.close_all();
        self.sub = None;
        (self.open, self.labels, self.region) = core::mem::take(&mut self.outside);
    }

    /// A call, of a label that only a run knows where it is `None`.
    pub(super) fn calls_sub(&mut self, label: Option<Name>, span: Span) {
        self.open.iter_mut().for_each(|open| open.calls = true);
        let Some(label) = label else {
            self.calls_unknown = true;
            return;
        };
        let line = self.line.raw().to_vec();
        let caller = self.scope();
        let (.., callers) = self.calls.entry(label).or_insert_with(|| (span, line, BTreeSet::new()));
        callers.insert(caller);
    }

    pub(super) fn end_of_file(&mut self) {
        if let Some((label, span, line)) = self.sub.take() {
            if !self.wrong.contains(&label) {
                self.add_line(ErrorKind::OUnclosed, span, Severity::Error, &line);
            }
            self.close_all();
            (self.open, self.labels, self.region) = core::mem::take(&mut self.outside);
        }
        self.close_all();
        self.labels.clear();
    }

    /// Looks into the files of called subs that the program does not define.
    pub(super) fn read_called_files(&mut self, source: &mut dyn LineSource) {
        let mut asked: BTreeSet<Name> = BTreeSet::new();
        loop {
            let unknown = |label: &&Name| !self.definitions.contains_key(*label) && !asked.contains(*label);
            let Some(label) = self.calls.keys().find(unknown).cloned() else { return };
            if asked.len() >= MOST_FILES {
                return;
            }
            asked.insert(label.clone());
            let name = core::str::from_utf8(&label).unwrap_or_default();
            match source.find_subroutine(name) {
                Ok(Some(place)) if source.seek(place).is_ok() => self.read_file(source, false),
                // What cannot be opened is reported by the run.
                Ok(Some(_)) | Err(_) => {}
                Ok(None) => {
                    let (span, line, _) = &self.calls[&label];
                    let (span, line) = (*span, line.clone());
                    self.add_line(ErrorKind::ONotFound, span, Severity::Error, &line);
                    continue;
                }
            }
        }
    }

    /// What only the whole program tells.
    pub(super) fn finish(&mut self, parameters: Option<&Parameters>) {
        let endless = core::mem::take(&mut self.endless_with_calls);
        if !self.sub_ends_program && !self.calls_unknown {
            self.findings.extend(endless);
        }
        self.finish_profiles();
        self.finish_names(parameters);
        if self.calls_unknown {
            return;
        }
        let main = Name::new();
        let reached = self.reached_from(core::iter::once(&main));
        let unused: Vec<(Span, Vec<u8>)> = self
            .definitions
            .iter()
            .filter(|(label, definition)| definition.own && !reached.contains(label))
            .map(|(_, definition)| (definition.span, definition.line.clone()))
            .collect();
        for (span, line) in unused {
            self.add_line(ErrorKind::OUnused, span, Severity::Warning, &line);
        }
    }

    /// A finding about a line read before.
    pub(super) fn add_line(&mut self, kind: ErrorKind, span: Span, severity: Severity, line: &[u8]) {
        let error = Error { kind, span };
        if self.findings.len() >= MOST_FINDINGS {
            return;
        }
        self.findings.push(Finding { error, severity, line: line.to_vec(), other: None });
    }
}
