//! One source line: as it was read, and as the interpreter reads it.
//!
//! RS274 deletes every blank and tab outside comments and ignores case *before* it reads words, so `X 1 0 . 5` is
//! X10.5. The prepared text keeps for every byte the column it came from, so that errors underline the source.

use crate::error::{Error, ErrorKind};
use crate::lexer;
use crate::source::MAX_LINE;
use pkm_canon::{FileId, Span};

/// Room for a line; every `u8` is a place in it.
const ROOM: usize = 1 << 8;
const _: () = assert!(MAX_LINE < ROOM);

const BLANK: u8 = b' ';
const LOOK: u8 = 0;

/// What a byte outside comments becomes: lower case, every blank [`BLANK`]; [`LOOK`] = a comment may begin.
const PREPARED: [u8; 256] = {
    let mut prepared = [LOOK; 256];
    let mut byte = 1_u8;
    while byte != 0 {
        prepared[byte as usize] = match byte {
            b' ' | b'\t' | b'\r' | 0x0b | 0x0c => BLANK,
            b'(' | b';' => LOOK,
            _ => byte.to_ascii_lowercase(),
        };
        byte = byte.wrapping_add(1);
    }
    prepared
};

/// One line, raw and prepared.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    raw: [u8; ROOM],
    raw_length: usize,
    /// Lower case, no blanks outside comments, comments verbatim, no `;` comment.
    code: [u8; ROOM],
    code_length: usize,
    /// Source column of every byte of `code`.
    column: [u8; ROOM],
    pub(crate) file: FileId,
    /// Counted from 1.
    pub(crate) number: u32,
}

impl Line {
    pub(crate) const fn new() -> Self {
        Self {
            raw: [0; ROOM],
            raw_length: 0,
            code: [0; ROOM],
            code_length: 0,
            column: [0; ROOM],
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
        let Self { raw, code, column, .. } = self;
        let mut length = 0_u8;
        let mut comment_start = None;
        for at in 0..self.raw_length as u8 {
            let byte = raw[usize::from(at)];
            let prepared = if comment_start.is_none() { PREPARED[usize::from(byte)] } else { LOOK };
            // What is not kept is written over by the next byte.
            column[usize::from(length)] = at;
            if prepared != LOOK {
                code[usize::from(length)] = prepared;
                length = length.wrapping_add(u8::from(prepared != BLANK));
                continue;
            }
            match (byte, comment_start) {
                (b';', None) => break,
                (b'(', None) => comment_start = Some(at),
                (b'(', Some(_)) => {
                    self.code_length = length.into();
                    let span = self.span(at.into(), usize::from(at) + 1);
                    return Err(Error { kind: ErrorKind::NestedComment, span });
                }
                (b')', _) => comment_start = None,
                _ => {}
            }
            code[usize::from(length)] = byte;
            length = length.wrapping_add(1);
        }
        self.code_length = length.into();
        match comment_start {
            Some(start) => {
                let span = self.span(start.into(), self.raw_length);
                Err(Error { kind: ErrorKind::UnclosedComment, span })
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
