//! From an error to what a person reads: the file it is in, the calls that led there, and which word may have been meant.

use crate::error::{Code, Error, ErrorKind};
use crate::interpreter::Interpreter;
use crate::modal::GGroup;
use crate::source::LineSource;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use pkm_canon::Span;
use pkm_canon::diagnostic::{Diagnostic, Note};

const FUNCTIONS: [&str; 14] = [
    "ABS", "ACOS", "ASIN", "ATAN", "COS", "EXISTS", "EXP", "FIX", "FUP", "LN", "ROUND", "SIN", "SQRT", "TAN",
];
const OPERATORS: [&str; 10] = ["MOD", "AND", "OR", "XOR", "EQ", "NE", "GT", "GE", "LT", "LE"];
const KEYWORDS: [&str; 15] = [
    "sub",
    "endsub",
    "call",
    "return",
    "if",
    "elseif",
    "else",
    "endif",
    "while",
    "endwhile",
    "do",
    "repeat",
    "endrepeat",
    "break",
    "continue",
];

/// The names that a program has given: what a mistyped one may have meant.
#[derive(Debug, Default)]
pub(crate) struct Names {
    pub(crate) parameters: Vec<String>,
    pub(crate) labels: Vec<String>,
    /// The sub that was called and not found.
    pub(crate) missing: Option<String>,
}

/// A name as text.
pub(crate) fn text(name: &[u8]) -> String {
    String::from_utf8_lossy(name).into_owned()
}

impl Interpreter {
    /// The diagnostic of an error that the last step returned: its own file and line, the calls that led there, and the
    /// word that may have been meant. `program` is the path of the program as the person gave it.
    pub fn diagnose(&self, error: &Error, source: &dyn LineSource, program: &str) -> Diagnostic {
        let mut names = Names::default();
        if matches!(error.kind, ErrorKind::ParamUndefined | ErrorKind::ONotFound) {
            let (labels, missing) = self.labels();
            names = Names {
                parameters: self.parameters().names().map(text).collect(),
                labels: labels.map(text).collect(),
                missing: missing.map(text),
            };
        }
        let mut diagnostic = diagnostic(error, self.source_line_of(error.span), source, program, &names);
        if let (ErrorKind::FeedZero { .. } | ErrorKind::ProbeFeed, Some(span)) =
            (error.kind, self.feed_unset())
        {
            diagnostic.notes.push(note("F was unset here", span, source, program));
        }
        let calls = self.calls().filter(|call| *call != error.span);
        diagnostic.notes.extend(calls.map(|call| note("called from here", call, source, program)));
        diagnostic
    }

    /// Notes that say where the block being executed was called from; none in the main program.
    pub fn call_notes(&self, source: &dyn LineSource, program: &str) -> Vec<Note> {
        self.calls().map(|call| note("called from here", call, source, program)).collect()
    }
}

/// The path of a file: that of the program itself is as the person gave it.
pub(crate) fn file_name(span: Span, source: &dyn LineSource, program: &str) -> String {
    let own = if span.file.0 == 0 { None } else { source.file_name(span.file) };
    own.unwrap_or_else(|| program.to_string())
}

/// Another place.
pub(crate) fn note(message: &str, span: Span, source: &dyn LineSource, program: &str) -> Note {
    Note {
        message: message.to_string(),
        file: file_name(span, source, program),
        line: span.line,
        column: span.start + 1,
        end_column: span.end + 1,
    }
}

/// The diagnostic of an error in a line, without the calls that led there.
pub(crate) fn diagnostic(
    error: &Error,
    line: &[u8],
    source: &dyn LineSource,
    program: &str,
    names: &Names,
) -> Diagnostic {
    let mut diagnostic = error.to_diagnostic(&file_name(error.span, source, program), line);
    if let Some(meant) = meant(error, line, names) {
        diagnostic.help = Some(meant);
    }
    diagnostic
}

/// Advice that depends on the word itself.
fn meant(error: &Error, line: &[u8], names: &Names) -> Option<String> {
    let (start, end) = (error.span.start as usize, error.span.end as usize);
    let word = text(line.get(start..end).unwrap_or_default());
    let help = error.kind.help();
    let did_you_mean = |found: Option<String>| found.map(|found| format!("did you mean {found}? ({help})"));
    match error.kind {
        // GO for G0.
        ErrorKind::ExprFunction if word.starts_with(['o', 'O']) && ends_with_letter(&line[..start]) => {
            Some("did you mean the digit 0? this is the letter O".to_string())
        }
        ErrorKind::ExprFunction => did_you_mean(nearest(&word, FUNCTIONS)),
        ErrorKind::ExprOperator if word.eq_ignore_ascii_case("e") && ends_with_digit(&line[..start]) => {
            Some(NO_EXPONENT.to_string())
        }
        ErrorKind::ExprOperator => {
            let letters: String =
                text(&line[start..]).chars().take_while(char::is_ascii_alphabetic).collect();
            did_you_mean(nearest(&letters, OPERATORS))
        }
        ErrorKind::OUnknown => did_you_mean(nearest(&word, KEYWORDS)),
        ErrorKind::ParamUndefined | ErrorKind::ParamNever => {
            let name = word.strip_prefix("#<")?.strip_suffix('>')?;
            if names.parameters.contains(&name.to_ascii_lowercase()) {
                return Some(format!(
                    "#<{name}> belongs to another sub or to the main program: pass its value as an argument, or name it \
                     #<_{name}>, which all see"
                ));
            }
            did_you_mean(nearest(name, &names.parameters).map(|name| format!("#<{name}>")))
        }
        ErrorKind::ONotFound => {
            let label = names.missing.as_ref()?;
            // One number is as near as another.
            let named = names.labels.iter().filter(|label| !label.bytes().all(|b| b.is_ascii_digit()));
            did_you_mean(nearest(label, named).map(|name| format!("o<{name}>")))
        }
        ErrorKind::GUnknown { code: Code(code) } => {
            let base = code - code % 10;
            let known: Vec<String> = (base..base + 10)
                .filter(|code| GGroup::of(*code).is_some())
                .map(|code| format!("G{}", Code(code)))
                .collect();
            (!known.is_empty()).then(|| format!("there is {}", known.join(", ")))
        }
        ErrorKind::MUnknown { number } | ErrorKind::MUnsupported { number }
            if pkm_canon::MACHINE_CODES.contains(&number) =>
        {
            Some(format!(
                "only a machine file can give M{number} a meaning: by [[switch]] or program.remap (--machine)"
            ))
        }
        // An exponent: the E was read as a word of its own, or left without a number.
        ErrorKind::WordUnused { letter: 'E', .. } if ends_with_digit(&line[..start]) => {
            Some(NO_EXPONENT.to_string())
        }
        ErrorKind::BadLetter { letter: 'O' | 'o' } if ends_with_digit(&line[..start]) => {
            Some("did you mean the digit 0? this is the letter O".to_string())
        }
        ErrorKind::NumberMissing => {
            let digit = match line.get(start)? {
                b'o' | b'O' => '0',
                b'l' | b'I' if start > 0 => '1',
                _ => return None,
            };
            let letter = char::from(*line.get(start)?);
            Some(format!("did you mean the digit {digit}? this is the letter {letter}"))
        }
        _ => None,
    }
}

const NO_EXPONENT: &str = "numbers have no exponent: write 1000 for 1e3";

fn ends_with_digit(text: &[u8]) -> bool {
    text.last().is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.')
}

fn ends_with_letter(text: &[u8]) -> bool {
    text.last().is_some_and(u8::is_ascii_alphabetic)
}

/// The known word that is nearest, if few letters differ: one in a word of up to four, else two.
pub(crate) fn nearest(word: &str, known: impl IntoIterator<Item = impl AsRef<str>>) -> Option<String> {
    let typed: String = word.to_ascii_lowercase().split_ascii_whitespace().collect();
    let most = if typed.len() <= 4 { 1 } else { 2 };
    known
        .into_iter()
        .map(|candidate| {
            let candidate = candidate.as_ref().to_string();
            (strsim::osa_distance(&typed, &candidate.to_ascii_lowercase()), candidate)
        })
        .filter(|(distance, _)| (1..=most).contains(distance))
        .min()
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_words_are_found_and_far_ones_not() {
        assert_eq!(nearest("sqr", FUNCTIONS).as_deref(), Some("SQRT"));
        assert_eq!(nearest("sine", FUNCTIONS).as_deref(), Some("SIN"));
        assert_eq!(nearest("ednif", KEYWORDS).as_deref(), Some("endif"));
        assert_eq!(nearest("whille", KEYWORDS).as_deref(), Some("while"));
        assert_eq!(nearest("x", FUNCTIONS), None);
        assert_eq!(nearest("banana", FUNCTIONS), None);
    }
}
