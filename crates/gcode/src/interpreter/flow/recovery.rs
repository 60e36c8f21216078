//! Going on after an error in an o-word.

use super::branches::{Construct, Kind};
use super::{Style, Sub};
use crate::error::{Error, ErrorKind};
use crate::interpreter::Interpreter;
use crate::lexer::Keyword;
use crate::source::{LineSource, Place};
use pkm_canon::CanonSink;

impl Interpreter {
    /// True if the error only follows from one in an o-word of the same label.
    pub(in crate::interpreter) fn follows_o_word(&self, error: &Error) -> bool {
        matches!(error.kind, ErrorKind::OLabelUnknown | ErrorKind::OLabelDuplicate | ErrorKind::ONotInSub)
            && self.flow.current.is_some_and(|(name, ..)| self.flow.wrong.contains(&name.label))
    }

    /// True if the line is the head of a branch or loop.
    pub(in crate::interpreter) fn is_branch(&self) -> bool {
        let Some((_, Some(keyword), _)) = self.flow.current else { return false };
        matches!(keyword, Keyword::If | Keyword::Elseif | Keyword::While | Keyword::Repeat)
    }

    /// A construct whose test or head is wrong is passed over as a whole; a sub that is wrong is not executed.
    pub(in crate::interpreter) fn recover_o_word(
        &mut self,
        error: &Error,
        here: Place,
        source: &mut dyn LineSource,
    ) {
        let Some((name, Some(keyword), span)) = self.flow.current else { return };
        if self.flow.skip.is_some_and(|skip| skip != name) {
            return;
        }
        let known = self.flow.constructs.get(&name).map(|construct| construct.kind);
        let kind = match keyword {
            Keyword::If => Kind::If,
            Keyword::While if known == Some(Kind::Do) => {
                self.flow.constructs.remove(&name);
                self.flow.skip = None;
                return;
            }
            Keyword::While => Kind::While,
            Keyword::Repeat => Kind::Repeat,
            Keyword::Elseif | Keyword::Else if known == Some(Kind::If) => {
                self.flow.branch_taken = true;
                self.flow.skip = Some(name);
                return;
            }
            Keyword::Sub => {
                let sub = Sub { span, line: here, body: source.place(), style: Style::OWord };
                self.flow.subs.entry(name.label).or_insert(sub);
                self.flow.defining = Some(name.label);
                self.flow.skip = Some(name);
                return;
            }
            Keyword::Endsub | Keyword::Return => {
                if self.flow.frames.last().is_some_and(|frame| frame.style == Style::OWord) {
                    let _ = self.leave(source);
                }
                return;
            }
            Keyword::Call => return self.state.set_return_value(Some(0.0)),
            Keyword::Endif | Keyword::Endwhile | Keyword::Endrepeat => {
                // The end itself is right where only too much follows it; the loop is not run again.
                self.flow.skip = None;
                return self.flow.wrong.push(name.label);
            }
            _ => return self.flow.wrong.push(name.label),
        };
        // Where the label was that of another construct, its end is now the end of this one.
        if known != Some(kind) {
            let construct = Construct { kind, line: here, span, left: None };
            self.flow.constructs.insert(name, construct);
        }
        self.flow.branch_taken = true;
        // The test itself is right where only too much follows it.
        if keyword != Keyword::If || error.kind != ErrorKind::OTrailing {
            self.flow.skip = Some(name);
        }
    }

    /// The end of the file was reached in search of a sub: goes back behind its call. False if that was not so.
    pub(in crate::interpreter) fn return_from_search(&mut self, source: &mut dyn LineSource) -> bool {
        if self.flow.pending.take().is_none() {
            return false;
        }
        self.flow.skip = None;
        let _ = self.leave(source);
        self.state.set_return_value(Some(0.0));
        true
    }

    /// M99 of a block at fault.
    pub(in crate::interpreter) fn recover_return(
        &mut self,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> bool {
        self.flow.depth() > 0 && matches!(self.fanuc_return(source, sink), Ok(true))
    }
}
