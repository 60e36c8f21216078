//! The head of an o-word line: label and keyword, for the interpreter and for the static check.

use crate::block::fault_error;
use crate::error::{Error, ErrorKind};
use crate::expression::{self, Scope, UNKNOWN};
use crate::lexer::{self, Keyword, into_fault};
use crate::line::Line;

/// A label as written: decimal digits or the name between the brackets.
pub(crate) type LabelText = heapless::Vec<u8, 256>;

/// What follows a label.
pub(crate) struct Head {
    /// `None`: a Fanuc program begins.
    pub(crate) keyword: Option<Keyword>,
    /// Offset of what follows in the prepared line.
    pub(crate) operands: usize,
    /// What stands behind the label is no keyword.
    pub(crate) wrong: Option<Error>,
}

/// Reads label and keyword behind the `o` at `start`. The label is empty if only a run can tell it (the static check).
pub(crate) fn head(
    line: &Line,
    start: usize,
    scope: &impl Scope,
    label: &mut LabelText,
) -> Result<Head, Error> {
    let code = line.code();
    let fail = |kind, from, to| Error { kind, span: line.code_span(from, to) };
    let input = &code[start + 1..];
    label.clear();
    let rest = if input.first() == Some(&b'<') {
        let (rest, name) =
            lexer::name(input).map_err(|_| fail(ErrorKind::ParamNameOpen, start, code.len()))?;
        let _ = label.extend_from_slice(name);
        rest
    } else {
        if input.is_empty() {
            return Err(fail(ErrorKind::OLabel, start, start + 1));
        }
        let (rest, number) =
            expression::integer(input, scope).map_err(|error| fault_error(line, into_fault(error)))?;
        if number != UNKNOWN {
            push_integer(label, number);
        }
        rest
    };
    let at = code.len() - rest.len();
    let (keyword, operands) = match lexer::keyword(rest) {
        Ok((after, keyword)) => (Some(keyword), code.len() - after.len()),
        Err(_) if rest.is_empty() || rest[0] == b'(' => (None, at),
        Err(_) => {
            let length = rest.iter().take_while(|b| b.is_ascii_alphabetic()).count().max(1);
            let wrong = Some(fail(ErrorKind::OUnknown, at, at + length));
            return Ok(Head { keyword: None, operands: at, wrong });
        }
    };
    Ok(Head { keyword, operands, wrong: None })
}

/// Appends a number in decimal digits.
pub(crate) fn push_integer(text: &mut LabelText, number: i32) {
    let (mut rest, mut digits, mut start) = (number.unsigned_abs(), [0; 10], 10);
    while start > 0 && (rest > 0 || start == 10) {
        start -= 1;
        digits[start] = b'0' + (rest % 10) as u8;
        rest /= 10;
    }
    let sign: &[u8] = if number < 0 { b"-" } else { b"" };
    let _ = text.extend_from_slice(sign);
    let _ = text.extend_from_slice(&digits[start..]);
}
