//! One source line: as it was read, and as the interpreter reads it.
//!
//! RS274 deletes every blank and tab outside comments and ignores case *before* it reads words, so `X 1 0 . 5` is
//! X10.5. The prepared text keeps for every byte the column it came from, so that errors underline the source.

use crate::error::{Error, ErrorKind};
use crate::lexer;
use crate::source::MAX_LINE;
use pkm_canon::{FileId, Span};

/// One line, raw and prepared.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    raw: [u8; MAX_LINE],
    raw_length: usize,
    /// Lower case, no blanks outside comments, comments verbatim, no `;` comment.
    code: [u8; MAX_LINE],
    code_length: usize,
    /// Source column of every byte of `code`.
    column: [u8; MAX_LINE],
    pub(crate) file: FileId,
    /// Counted from 1.
    pub(crate) number: u32,
}

impl Line {
    pub(crate) const fn new() -> Self {
        Self {
            raw: [0; MAX_LINE],
            raw_length: 0,
            code: [0; MAX_LINE],
            code_length: 0,
            column: [0; MAX_LINE],
            file: FileId(0),
            number: 0,
        }
    }

    /// Takes over a line as read: trailing blanks (a CR too) are cut.
    pub(crate) fn load(&mut self, text: &[u8], file: FileId, number: u32) -> Result<(), Error> {
        (self.file, self.number, self.code_length) = (file, number, 0);
        let text = text.trim_ascii_end();
        self.raw_length = text.len().min(MAX_LINE);
        self.raw[..self.raw_length].copy_from_slice(&text[..self.raw_length]);
        if text.len() > MAX_LINE {
            let kind = ErrorKind::LineTooLong { limit: MAX_LINE as u16 };
            return Err(Error { kind, span: self.span(MAX_LINE - 1, MAX_LINE) });
        }
        Ok(())
    }

    /// The line as read, trailing blanks cut.
    pub(crate) fn raw(&self) -> &[u8] {
        &self.raw[..self.raw_length]
    }

    /// The text to interpret, after [`Line::prepare`].
    pub(crate) fn code(&self) -> &[u8] {
        &self.code[..self.code_length]
    }

    /// A stretch of the raw line.
    pub(crate) fn span(&self, start: usize, end: usize) -> Span {
        Span::new(self.file, self.number, start as u32, end as u32)
    }

    /// The whole line without leading blanks.
    pub(crate) fn whole(&self) -> Span {
        let blanks = self.raw_length - self.raw().trim_ascii_start().len();
        self.span(blanks, self.raw_length)
    }

    /// The source stretch of bytes `start..end` of [`Line::code`].
    pub(crate) fn code_span(&self, start: usize, end: usize) -> Span {
        let column = |i: usize| self.column.get(i).map_or(self.raw_length, |&c| usize::from(c));
        if start >= self.code_length {
            return self.span(self.raw_length, self.raw_length);
        }
        let first = column(start);
        let last = if end > start { column(end.min(self.code_length) - 1) + 1 } else { first };
        self.span(first, last)
    }

    /// Deletes blanks, lowers case, checks comments.
    pub(crate) fn prepare(&mut self) -> Result<(), Error> {
        self.code_length = 0;
        let mut comment_start = None;
        for i in 0..self.raw_length {
            let byte = self.raw[i];
            match (comment_start, byte) {
                (Some(_), b')') => comment_start = None,
                (Some(_), b'(') => {
                    return Err(Error { kind: ErrorKind::NestedComment, span: self.span(i, i + 1) });
                }
                (Some(_), _) => {}
                (None, b'(') => comment_start = Some(i),
                (None, b';') => return Ok(()),
                (None, b' ' | b'\t' | b'\r' | 0x0b | 0x0c) => continue,
                (None, _) => {}
            }
            let byte = if comment_start.is_some() { byte } else { byte.to_ascii_lowercase() };
            self.code[self.code_length] = byte;
            self.column[self.code_length] = i as u8;
            self.code_length += 1;
        }
        match comment_start {
            Some(start) => {
                Err(Error { kind: ErrorKind::UnclosedComment, span: self.span(start, self.raw_length) })
            }
            None => Ok(()),
        }
    }

    /// Passes `/` and the line number; the result is where the words begin in [`Line::code`].
    pub(crate) fn skip_number(&self) -> Result<usize, Error> {
        let code = self.code();
        let start = usize::from(code.first() == Some(&b'/'));
        let [b'n', digits @ ..] = &code[start..] else { return Ok(start) };
        match lexer::line_number(digits) {
            // A point that is left over had no digits behind it.
            Ok((rest, ())) if rest.first() != Some(&b'.') => Ok(code.len() - rest.len()),
            _ => Err(Error { kind: ErrorKind::BadLineNumber, span: self.code_span(start, start + 1) }),
        }
    }
}
