//! Comments that do something: MSG, DEBUG, PRINT, LOG, ABORT; all others pass as they are.

use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Error, ErrorKind};
use crate::expression::Scope;
use crate::line::Line;
use crate::settings::Dialect;
use core::fmt::Write;
use heapless::Vec;
use pkm_canon::{Canon, Text};

/// Room for a text after its substitutions.
type Buffer = Vec<u8, 1024>;

/// Parameter that switches `(debug,)` on.
const DEBUG_ON: i32 = 5599;

impl State {
    /// Executes the comments of a block: LinuxCNC the last one, pkm's own dialect all of them in order.
    pub(crate) fn comments(&self, block: &Block, line: &Line, out: &mut Out<'_>) -> Result<(), Error> {
        let comments = block.comments.as_slice();
        let comments = match self.settings.dialect {
            Dialect::Pkm => comments,
            Dialect::LinuxCnc29 | Dialect::LinuxCnc210 => &comments[comments.len().saturating_sub(1)..],
        };
        for &(start, end) in comments {
            let (start, end) = (usize::from(start), usize::from(end));
            let text = line.code().get(start..end).unwrap_or_default();
            self.comment(text, out).map_err(|kind| Error { kind, span: line.code_span(start, end) })?;
        }
        Ok(())
    }

    fn comment(&self, text: &[u8], out: &mut Out<'_>) -> Result<(), ErrorKind> {
        let text = text.trim_ascii_start();
        let after = |word: &[u8]| {
            let (head, rest) = text.split_at_checked(word.len())?;
            head.eq_ignore_ascii_case(word).then_some(rest)
        };
        if let Some(text) = after(b"msg,") {
            out.emit(Canon::Message(Text(text)));
        } else if let Some(text) = after(b"debug,") {
            let text = self.substitute(text)?;
            if self.parameters.get(DEBUG_ON) > 0.0 {
                out.emit(Canon::Message(Text(&text)));
            }
        } else if let Some(text) = after(b"print,") {
            out.emit(Canon::Print(Text(&self.substitute(text)?)));
        } else if let Some(text) = after(b"log,") {
            out.emit(Canon::Log(Text(&self.substitute(text)?)));
        } else if let Some(name) = after(b"logopen,") {
            out.emit(Canon::LogOpen(Text(name)));
        } else if let Some(name) = after(b"logappend,") {
            out.emit(Canon::LogAppend(Text(name)));
        } else if after(b"logclose").is_some() {
            out.emit(Canon::LogClose);
        } else if let Some(text) = after(b"abort,") {
            let text = self.substitute(text)?;
            out.emit(Canon::Message(Text(&text)));
            return Err(ErrorKind::AbortComment);
        } else if after(b"py,").or(after(b"pyrun,")).or(after(b"pyreload")).is_some() {
            return Err(ErrorKind::Python);
        } else {
            out.emit(Canon::Comment(Text(text)));
        }
        Ok(())
    }

    /// `#1`, `#<name>` become their value; `%d`, `%f`, `%.Nf` switch the format for the rest of the text.
    fn substitute(&self, text: &[u8]) -> Result<Buffer, ErrorKind> {
        let (mut result, mut decimals, mut rest) = (Buffer::new(), 6_usize, text);
        while let [first, after @ ..] = rest {
            match (first, after) {
                (b'%', [b'd', tail @ ..]) => (decimals, rest) = (0, tail),
                (b'%', [b'f', tail @ ..]) => (decimals, rest) = (4, tail),
                (b'%', [b'.', digit @ b'0'..=b'9', b'f', tail @ ..]) => {
                    (decimals, rest) = (usize::from(digit - b'0'), tail);
                }
                (b'#', []) => return Err(ErrorKind::CommentHash),
                (b'#', _) => rest = self.substitute_one(after, decimals, &mut result),
                _ => {
                    let _ = result.push(*first);
                    rest = after;
                }
            }
        }
        Ok(result)
    }

    /// Writes the parameter that `text` (behind its `#`) begins with; the result is the rest.
    fn substitute_one<'a>(&self, text: &'a [u8], decimals: usize, result: &mut Buffer) -> &'a [u8] {
        let (value, rest) = match text {
            [b'<', name @ ..] => {
                let Some(end) = name.iter().position(|b| *b == b'>') else {
                    let _ = result.push(b'#');
                    return text;
                };
                let mut folded: Vec<u8, 256> = Vec::new();
                for byte in name[..end].iter().filter(|b| !b.is_ascii_whitespace()) {
                    let _ = folded.push(byte.to_ascii_lowercase());
                }
                (self.named(&folded), &name[end + 1..])
            }
            _ => {
                let digits = text.iter().take_while(|b| b.is_ascii_digit()).count();
                if digits == 0 {
                    let _ = result.push(b'#');
                    return text;
                }
                let index = core::str::from_utf8(&text[..digits]).ok().and_then(|t| t.parse().ok());
                let known = index.filter(|i| (1..=crate::expression::LAST_PARAMETER).contains(i));
                (known.and_then(|i| self.numbered(i).ok()), &text[digits..])
            }
        };
        let Some(value) = value else {
            let _ = result.extend_from_slice(b"######");
            return rest;
        };
        let value = if value.abs() < self.tolerance().equal { 0.0 } else { value };
        let mut digits: heapless::String<400> = heapless::String::new();
        let _ = write!(digits, "{value:.decimals$}");
        let _ = result.extend_from_slice(digits.as_bytes());
        rest
    }
}
