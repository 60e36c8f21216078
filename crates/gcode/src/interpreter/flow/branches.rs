//! Branches and loops: if, while, do, repeat, break, continue (dialect section 5).

use super::{Name, OWord};
use crate::error::{Error, ErrorKind};
use crate::expression::Scope;
use crate::interpreter::Interpreter;
use crate::lexer::Keyword;
use crate::settings::Dialect;
use crate::source::{LineSource, Place};
use pkm_canon::Span;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    If,
    While,
    Do,
    Repeat,
}

/// What a label stands for, and the line that first said so.
#[derive(Debug, Clone, Copy)]
pub(super) struct Construct {
    pub(super) kind: Kind,
    pub(super) line: Place,
    pub(super) span: Span,
    /// How often a repeat is still to run; `None` = its count is read when it is met next.
    pub(super) left: Option<i64>,
}

impl Interpreter {
    /// An o-word of a branch or loop: not skipped, or the one with whose label skipping may end.
    pub(super) fn branch_or_loop(
        &mut self,
        keyword: Keyword,
        word: &OWord,
        here: Place,
        source: &mut dyn LineSource,
    ) -> Result<(), Error> {
        let pkm = self.state.settings.dialect == Dialect::Pkm;
        let skipping = self.flow.skip.is_some();
        let skip = Some(word.name);
        match keyword {
            Keyword::If => {
                let taken = self.test(word)? != 0.0;
                self.open(word, here, Kind::If)?;
                self.flow.skip = if taken { None } else { skip };
                self.flow.branch_taken = taken;
            }
            Keyword::Elseif => {
                // The test of every elseif is read, also behind a branch that has run (checked with rs274 2.9).
                let taken = self.test(word)? != 0.0;
                self.known(word, &[Kind::If])?;
                if self.flow.branch_taken {
                    self.flow.skip = skip;
                } else if taken {
                    self.flow.skip = None;
                    self.flow.branch_taken = true;
                }
            }
            Keyword::Else => {
                self.nothing_more(word.operands)?;
                self.known(word, &[Kind::If])?;
                if self.flow.branch_taken {
                    self.flow.skip = skip;
                } else {
                    self.flow.skip = None;
                    self.flow.branch_taken = true;
                }
            }
            Keyword::Endif => {
                self.nothing_more(word.operands)?;
                self.known(word, &[Kind::If])?;
                self.flow.skip = None;
                // What encloses it must have run, or this would not have been met.
                self.flow.branch_taken = true;
            }
            Keyword::While => {
                let go_on = self.test(word)? != 0.0;
                if let Some(Construct { kind: Kind::Do, line, span, .. }) = self.construct(word.name) {
                    self.flow.skip = None;
                    if pkm {
                        self.flow.continuing = false;
                    }
                    if go_on && !self.flow.breaking {
                        self.flow.last_loop = Some(span);
                        return self.seek(source, line);
                    }
                    self.flow.breaking = false;
                    if pkm {
                        self.flow.constructs.remove(&word.name);
                    }
                    return Ok(());
                }
                self.open(word, here, Kind::While)?;
                self.flow.skip = if go_on { None } else { skip };
            }
            Keyword::Do => {
                self.nothing_more(word.operands)?;
                // LinuxCNC goes back to the first `do` of a label, wherever the second stands (checked with rs274 2.9).
                if pkm || self.construct(word.name).is_none() {
                    self.open(word, here, Kind::Do)?;
                }
                self.flow.skip = None;
            }
            Keyword::Repeat => {
                let count = self.repeat_count(self.test(word)?, word)?;
                self.open(word, here, Kind::Repeat)?;
                if let Some(repeat) = self.flow.constructs.get_mut(&word.name) {
                    let left = repeat.left.unwrap_or(count);
                    (repeat.left, self.flow.skip) =
                        if left > 0 { (Some(left - 1), None) } else { (None, skip) };
                }
            }
            Keyword::Endwhile | Keyword::Endrepeat => {
                self.nothing_more(word.operands)?;
                let kind = if keyword == Keyword::Endwhile { Kind::While } else { Kind::Repeat };
                let Construct { line: begin, span, .. } = self.known(word, &[kind])?;
                self.flow.last_loop = Some(span);
                self.flow.skip = None;
                if pkm {
                    self.flow.breaking = false;
                }
                if !skipping || core::mem::take(&mut self.flow.continuing) {
                    self.seek(source, begin)?;
                }
            }
            Keyword::Break => {
                self.nothing_more(word.operands)?;
                self.known(word, &[Kind::While, Kind::Do])?;
                if !(pkm && skipping) {
                    self.flow.skip = skip;
                    self.flow.breaking = true;
                }
            }
            Keyword::Continue => {
                self.nothing_more(word.operands)?;
                self.known(word, &[Kind::While, Kind::Do])?;
                if !skipping {
                    self.flow.skip = skip;
                    self.flow.continuing = true;
                }
            }
            Keyword::Sub | Keyword::Endsub | Keyword::Call | Keyword::Return => {}
        }
        Ok(())
    }

    fn construct(&self, name: Name) -> Option<Construct> {
        self.flow.constructs.get(&name).copied()
    }

    /// The construct of a label, which must be of one of these kinds.
    fn known(&self, word: &OWord, kinds: &[Kind]) -> Result<Construct, Error> {
        match self.construct(word.name) {
            Some(construct) if kinds.contains(&construct.kind) => Ok(construct),
            _ => Err(self.flow_error(ErrorKind::OLabelUnknown, word.span)),
        }
    }

    /// LinuxCNC rounds to the nearest even number at a half; pkm wants a whole number.
    fn repeat_count(&self, value: f64, word: &OWord) -> Result<i64, Error> {
        if self.state.strict() && value != pkm_kins::maths::floor(value) {
            return Err(self.flow_error(ErrorKind::NotInteger { value }, word.span));
        }
        Ok(pkm_kins::maths::rint(value) as i64)
    }

    /// Opens a construct, or opens it again at the same line.
    fn open(&mut self, word: &OWord, line: Place, kind: Kind) -> Result<(), Error> {
        match self.construct(word.name) {
            Some(construct) if construct.line != line => {
                Err(self.flow_error(ErrorKind::OLabelDuplicate, word.span))
            }
            Some(_) => Ok(()),
            None => {
                let construct = Construct { kind, line, span: word.span, left: None };
                self.flow.constructs.insert(word.name, construct);
                Ok(())
            }
        }
    }
}
