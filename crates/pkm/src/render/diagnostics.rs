//! Diagnostics as text (the span underlined) and as JSON objects.

use crate::cli::Color;
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_machine::{shipped, source};
use serde::Serialize;
use std::env;
use std::fs::File;
use std::io::{BufRead, BufReader, IsTerminal, Read, Write, stderr};

/// A diagnostic as scripts read it.
#[derive(Debug, Serialize)]
pub(crate) struct Json<'a> {
    code: &'a str,
    severity: &'static str,
    message: &'a str,
    file: &'a str,
    line: u32,
    column: u32,
    end_column: u32,
    help: Option<&'a str>,
    /// Where the sub was called, where a loop begins; nearest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<JsonNote<'a>>,
}

/// Another place that belongs to a diagnostic.
#[derive(Debug, Serialize)]
struct JsonNote<'a> {
    message: &'a str,
    file: &'a str,
    line: u32,
    column: u32,
}

impl<'a> From<&'a Diagnostic> for Json<'a> {
    fn from(diagnostic: &'a Diagnostic) -> Self {
        let severity = match diagnostic.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        Self {
            code: &diagnostic.code,
            severity,
            message: &diagnostic.message,
            file: &diagnostic.file,
            line: diagnostic.line,
            column: diagnostic.column,
            end_column: diagnostic.end_column,
            help: diagnostic.help.as_deref(),
            notes: diagnostic
                .notes
                .iter()
                .map(|note| JsonNote {
                    message: &note.message,
                    file: &note.file,
                    line: note.line,
                    column: note.column,
                })
                .collect(),
        }
    }
}

/// Prints messages to standard error.
pub(crate) struct Messages {
    renderer: Renderer,
    styled: bool,
    /// The `--set` texts, which diagnostics may point into.
    overrides: String,
}

/// The most bytes of a source line that are shown.
const LONGEST_LINE: usize = 512;

/// The most findings of one kind in a row that are all told in full, and how many of them are if there are more.
const MOST_ALIKE: usize = 6;
const TOLD_ALIKE: usize = 3;

impl Messages {
    /// Coloured or not, as asked and as the terminal allows.
    pub(crate) fn new(color: Color, overrides: &[String]) -> Self {
        let styled = match color {
            Color::Always => true,
            Color::Never => false,
            Color::Auto => {
                stderr().is_terminal()
                    && env::var_os("NO_COLOR").is_none()
                    && env::var_os("TERM").is_none_or(|terminal| terminal != "dumb")
            }
        };
        let renderer = if styled { Renderer::styled() } else { Renderer::plain() };
        Self { renderer, styled, overrides: overrides.join("\n") }
    }

    /// Prints the messages; a standard error that cannot be written to is ignored. Of many of one kind in a row the first
    /// are told in full, of the others where they are.
    pub(crate) fn print(&self, diagnostics: &[Diagnostic]) {
        let mut err = stderr().lock();
        let alike = |a: &Diagnostic, b: &Diagnostic| (&a.code, &a.file) == (&b.code, &b.file);
        for row in diagnostics.chunk_by(alike) {
            let full = if row.len() > MOST_ALIKE { TOLD_ALIKE } else { row.len() };
            let (told, others) = row.split_at(full);
            for diagnostic in told {
                let _ = writeln!(err, "{}\n", self.text(diagnostic));
            }
            if let (Some(first), Some(last)) = (others.first(), others.last()) {
                let message = format!("{} more, in lines {} to {}", others.len(), first.line, last.line);
                let help = Some("`pkm check --format json` tells each".to_owned());
                let folded = Diagnostic { message, help, line: 0, notes: Vec::new(), ..first.clone() };
                let _ = writeln!(err, "{}\n", self.text(&folded));
            }
        }
    }

    /// Prints one message as `rs274` does, so that the last two lines are always message and source line:
    /// `FILE:LINE:COL: error[code]: message`, and the line as it was read. The underlined form comes before, in colour.
    pub(crate) fn print_plainly(&self, diagnostic: &Diagnostic, source_line: &[u8]) {
        let mut err = stderr().lock();
        if self.styled {
            let _ = writeln!(err, "{}", self.text(diagnostic));
        }
        let Diagnostic { code, message, file, line, column, .. } = diagnostic;
        let _ = writeln!(err, "{file}:{line}:{column}: error[{code}]: {message}");
        let _ = err.write_all(source_line.trim_ascii_end());
        let _ = err.write_all(b"\n");
    }

    /// One message: title with code, place, underlined source line where it can be read again, help.
    pub(crate) fn text(&self, diagnostic: &Diagnostic) -> String {
        let level = match diagnostic.severity {
            Severity::Note => Level::NOTE,
            Severity::Warning => Level::WARNING,
            Severity::Error => Level::ERROR,
        };
        let title = level.primary_title(diagnostic.message.as_str()).id(diagnostic.code.as_str());
        let mut group = Group::with_title(title);
        let line = self.source_line(diagnostic);
        let snippet = |line, text, path, columns: (u32, u32)| {
            Snippet::source(text)
                .line_start(line as usize)
                .path(path)
                .annotation(AnnotationKind::Primary.span(span(text, columns)))
        };
        match &line {
            Some(line) => {
                let columns = (diagnostic.column, diagnostic.end_column);
                group = group.element(snippet(diagnostic.line, line, diagnostic.file.as_str(), columns));
            }
            None => {
                let mut origin = Origin::path(diagnostic.file.as_str());
                if diagnostic.line > 0 {
                    origin = origin.line(diagnostic.line as usize);
                    if diagnostic.column > 0 {
                        origin = origin.char_column(diagnostic.column as usize);
                    }
                }
                group = group.element(origin);
            }
        }
        if let Some(help) = &diagnostic.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        let notes: Vec<_> =
            diagnostic.notes.iter().map(|note| (note, line_of(&note.file, note.line))).collect();
        let mut groups = vec![group];
        for (note, line) in &notes {
            let mut group = Group::with_title(Level::NOTE.secondary_title(note.message.as_str()));
            group = match line {
                Some(line) => group.element(snippet(
                    note.line,
                    line,
                    note.file.as_str(),
                    (note.column, note.end_column),
                )),
                None => group.element(Origin::path(note.file.as_str()).line(note.line as usize)),
            };
            groups.push(group);
        }
        self.renderer.render(&groups)
    }

    /// The source line of a diagnostic, if it can be read again.
    fn source_line(&self, diagnostic: &Diagnostic) -> Option<String> {
        let number = (diagnostic.line as usize).checked_sub(1)?;
        let from_text = |text: &str| text.lines().nth(number).map(str::to_owned);
        let line = if diagnostic.file == source::OVERRIDES_FILE {
            from_text(&self.overrides)?
        } else if diagnostic.file == "-" {
            return None;
        } else if let (true, Some(text)) =
            (diagnostic.code.starts_with("machine-"), shipped::text(&diagnostic.file))
        {
            from_text(text)?
        } else {
            line_of(&diagnostic.file, diagnostic.line)?
        };
        Some(line)
    }
}

/// A line of a file (counted from 1), if it can be read again.
fn line_of(path: &str, line: u32) -> Option<String> {
    if path == "-" { None } else { line_of_file(path, (line as usize).checked_sub(1)?) }
}

/// Columns (counted from 1) as a stretch of the line.
fn span(line: &str, (column, end_column): (u32, u32)) -> std::ops::Range<usize> {
    let start = (column as usize).saturating_sub(1).min(line.len());
    let end = (end_column as usize).saturating_sub(1).clamp(start, line.len());
    floor(line, start)..floor(line, end)
}

/// A line of a file (counted from 0), at most [`LONGEST_LINE`] bytes of it.
fn line_of_file(path: &str, number: usize) -> Option<String> {
    let mut reader = BufReader::new(File::open(path).ok()?);
    let mut line = Vec::new();
    for _ in 0..number {
        if reader.skip_until(b'\n').ok()? == 0 {
            return None;
        }
    }
    (&mut reader).take(LONGEST_LINE as u64).read_until(b'\n', &mut line).ok()?;
    let text = String::from_utf8_lossy(&line);
    Some(text.trim_end_matches(['\n', '\r']).to_owned())
}

/// The nearest character boundary at or below a byte offset.
fn floor(text: &str, mut offset: usize) -> usize {
    while !text.is_char_boundary(offset) {
        offset -= 1;
    }
    offset
}
