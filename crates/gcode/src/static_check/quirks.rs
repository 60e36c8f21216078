//! What LinuxCNC reads otherwise than a person does (dialect section 19): accepted, but said.

use super::StaticCheck;
use crate::error::ErrorKind;
use pkm_canon::diagnostic::Severity;

/// How active comments begin.
const ACTIVE: [&[u8]; 10] = [
    b"msg,",
    b"debug,",
    b"print,",
    b"log,",
    b"logopen,",
    b"logappend,",
    b"logclose",
    b"abort,",
    b"probeopen",
    b"probeclose",
];

/// True if a comment's text does something.
fn is_active(text: &[u8]) -> bool {
    let text = text.trim_ascii_start();
    ACTIVE.iter().any(|begin| text.get(..begin.len()).is_some_and(|t| t.eq_ignore_ascii_case(begin)))
}

/// Length of a number, parameter or bracketed expression.
fn operand(code: &[u8]) -> usize {
    let number = |code: &[u8]| code.iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
    match code {
        [b'#', b'<', ..] => code.iter().position(|b| *b == b'>').map_or(code.len(), |at| at + 1),
        [b'#', rest @ ..] => 1 + operand(rest),
        [b'+' | b'-', rest @ ..] => 1 + number(rest),
        [b'[', ..] => {
            let mut depth = 0_i32;
            for (at, byte) in code.iter().enumerate() {
                depth += i32::from(*byte == b'[') - i32::from(*byte == b']');
                if depth == 0 {
                    return at + 1;
                }
            }
            code.len()
        }
        _ => number(code),
    }
}

impl StaticCheck<'_> {
    pub(super) fn quirks(&mut self) {
        self.blanks();
        self.powers();
        self.comments();
    }

    /// `X1 0` is X10, `#<a b>` is #<ab>.
    fn blanks(&mut self) {
        let code = self.line.code();
        let (mut comment, mut name) = (false, false);
        let mut found = None;
        for at in 0..code.len().saturating_sub(1) {
            match code[at] {
                b'(' => comment = true,
                b')' => comment = false,
                b'<' if !comment => name = true,
                b'>' if !comment => name = false,
                _ => {}
            }
            let digit = |byte: u8| byte.is_ascii_digit() || byte == b'.';
            let joins =
                name && code[at] != b'<' && code[at + 1] != b'>' || digit(code[at]) && digit(code[at + 1]);
            let span = self.line.code_span(at, at + 2);
            if joins && !comment && span.end - span.start > 2 {
                found = Some(span);
                break;
            }
        }
        if let Some(span) = found {
            self.add(ErrorKind::BlankInside, span, Severity::Warning);
        }
    }

    /// `-2**2` is 4, `2**3**2` is 64.
    fn powers(&mut self) {
        let code = self.line.code();
        let mut found = None;
        let mut comment = false;
        for at in 0..code.len() {
            match code[at] {
                b'(' => comment = true,
                b')' => comment = false,
                b'*' if !comment && code[at..].starts_with(b"**") => {
                    let digits = code[..at].iter().rev().take_while(|b| b.is_ascii_digit() || **b == b'.');
                    let begin = at - digits.count();
                    let signed = begin < at && begin > 0 && code[begin - 1] == b'-';
                    let unary = signed && (begin < 2 || b"[*/+-".contains(&code[begin - 2]));
                    let after = at + 2 + operand(&code[at + 2..]);
                    if unary {
                        found = Some((ErrorKind::PowerSign, begin - 1, after));
                    } else if code[after.min(code.len())..].starts_with(b"**") {
                        let end = after + 2 + operand(&code[after + 2..]);
                        found = Some((ErrorKind::PowerChain, begin, end));
                    }
                }
                _ => {}
            }
            if found.is_some() {
                break;
            }
        }
        if let Some((kind, from, to)) = found {
            let span = self.line.code_span(from, to);
            self.add(kind, span, Severity::Note);
        }
    }

    /// Active text behind `;`, and several active comments on a line.
    fn comments(&mut self) {
        let raw = self.line.raw();
        let mut inside = false;
        let semicolon = raw.iter().position(|byte| {
            match byte {
                b'(' => inside = true,
                b')' => inside = false,
                _ => {}
            }
            *byte == b';' && !inside
        });
        if let Some(at) = semicolon {
            let text = raw[at + 1..].trim_ascii_start();
            if is_active(text.strip_prefix(b"(").unwrap_or(text)) {
                let span = self.line.span(at, raw.len());
                self.add(ErrorKind::CommentInactive, span, Severity::Warning);
            }
        }
        let code = self.line.code();
        let (mut first, mut count, mut at) = (None, 0, 0);
        while let Some(begin) = code[at..].iter().position(|b| *b == b'(').map(|begin| at + begin) {
            let end = code[begin..].iter().position(|b| *b == b')').map_or(code.len(), |end| begin + end);
            count += 1;
            if first.is_none() && is_active(&code[begin + 1..end]) {
                first = Some((begin, end, count));
            }
            at = (end + 1).min(code.len());
        }
        if let Some((begin, end, number)) = first
            && number < count
        {
            let span = self.line.code_span(begin, end + 1);
            self.add(ErrorKind::CommentSeveral, span, Severity::Warning);
        }
    }
}
