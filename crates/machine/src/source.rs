//! The text a machine file came from, and the findings about it.

use pkm_canon::diagnostic::{Diagnostic, Severity};
use std::ops::Range;

/// The largest machine file that is read.
pub const MAX_BYTES: usize = 1 << 20;

/// Name under which `--set` overrides appear in diagnostics: line n is the n-th override.
pub const OVERRIDES_FILE: &str = "--set";

/// A machine file's text with the overrides behind it, so that one byte range can point into either.
#[derive(Debug, Clone)]
pub struct Source {
    file: String,
    text: String,
    overrides: String,
}

impl Source {
    /// The file's name as the person gave it, its text, and the `--set KEY=VALUE` texts in order.
    pub fn new(file: &str, text: &str, overrides: &[String]) -> Self {
        Self { file: file.into(), text: text.into(), overrides: overrides.join("\n") }
    }

    /// The file's name as the person gave it.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The file's own text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Byte offset, in the joined text, of the override with this index.
    pub(crate) fn override_offset(&self, index: usize) -> usize {
        self.text.len() + self.overrides.split('\n').take(index).map(|line| line.len() + 1).sum::<usize>()
    }

    /// A diagnostic (severity error) that points at `span` of the joined text, or at the file as a whole.
    pub(crate) fn diagnostic(
        &self,
        code: &str,
        span: Option<Range<usize>>,
        message: String,
        help: Option<String>,
    ) -> Diagnostic {
        let mut diagnostic = Diagnostic {
            code: code.into(),
            severity: Severity::Error,
            message,
            help,
            file: self.file.clone(),
            line: 0,
            column: 0,
            end_column: 0,
            notes: Vec::new(),
        };
        let Some(span) = span else { return diagnostic };
        let (text, span) = if span.start >= self.text.len() && !self.overrides.is_empty() {
            diagnostic.file = OVERRIDES_FILE.into();
            (&self.overrides, span.start - self.text.len()..span.end - self.text.len())
        } else {
            (&self.text, span)
        };
        (diagnostic.line, diagnostic.column, diagnostic.end_column) = place(text.as_bytes(), span);
        diagnostic
    }
}

/// Line, first column and one past the last column (all from 1) of a byte range; cut at the end of its first line.
fn place(text: &[u8], span: Range<usize>) -> (u32, u32, u32) {
    let start = span.start.min(text.len());
    let before = &text[..start];
    let line_start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    let line = before.iter().filter(|&&byte| byte == b'\n').count();
    let line_end = text[start..].iter().position(|&byte| byte == b'\n').map_or(text.len(), |at| start + at);
    let end = span.end.clamp(start, line_end);
    let number = |value: usize| u32::try_from(value + 1).unwrap_or(u32::MAX);
    (number(line), number(start - line_start), number(end - line_start))
}

/// Collects findings while a file is read, so that a person sees all of them at once.
pub(crate) struct Findings<'a> {
    source: &'a Source,
    list: Vec<Diagnostic>,
}

impl<'a> Findings<'a> {
    pub(crate) fn new(source: &'a Source) -> Self {
        Self { source, list: Vec::new() }
    }

    /// Notes an error at `span`.
    pub(crate) fn error(&mut self, code: &str, span: Range<usize>, message: String, help: &str) {
        let help = (!help.is_empty()).then(|| help.to_owned());
        self.list.push(self.source.diagnostic(code, Some(span), message, help));
    }

    /// Notes what the TOML parser objected to.
    pub(crate) fn syntax(&mut self, error: &toml::de::Error) {
        self.toml(error, ("machine-syntax", Some("the file must be TOML (https://toml.io)")));
    }

    /// Notes which key or value does not fit.
    pub(crate) fn shape(&mut self, error: &toml::de::Error) {
        self.toml(error, ("machine-wrong-type", Some("`pkm machines NAME` prints a file that works")));
    }

    fn toml(&mut self, error: &toml::de::Error, otherwise: (&str, Option<&str>)) {
        let (code, help) = explain(error.message()).unwrap_or(otherwise);
        let message = error.message().trim_end().replace('\n', "; ");
        self.list.push(self.source.diagnostic(code, error.span(), message, help.map(str::to_owned)));
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    pub(crate) fn into_list(mut self) -> Vec<Diagnostic> {
        self.list.sort_by_key(|finding| (finding.file != self.source.file, finding.line, finding.column));
        self.list
    }
}

/// Code and remedy for the messages that deserve their own.
fn explain(message: &str) -> Option<(&'static str, Option<&'static str>)> {
    if message.contains("unknown field") {
        Some(("machine-unknown-key", Some("correct the spelling or remove it")))
    } else if message.contains("duplicate key") {
        Some(("machine-repeated-key", Some("keep one of the two")))
    } else if message.contains("missing field") {
        Some(("machine-missing-key", Some("add it; `pkm machines NAME` prints a file that works")))
    } else {
        None
    }
}
