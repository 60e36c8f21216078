//! One diagnostic type for G-code, machine files and motion: code, severity, place, message, help.
//! Text and JSON are renderings of it (`pkm/src/render`).

use alloc::string::String;
use alloc::vec::Vec;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Severity {
    Note,
    Warning,
    Error,
}

/// Something a person should know, with its place in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Stable identifier, e.g. `arc-radius-mismatch`, `limit_low`.
    pub code: String,
    /// How bad.
    pub severity: Severity,
    /// One sentence: what is wrong, the value and the limit.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// Path of the file as the person gave it.
    pub file: String,
    /// Line, counted from 1; 0 = the file as a whole.
    pub line: u32,
    /// First column, counted from 1 in bytes; 0 = the line as a whole.
    pub column: u32,
    /// One past the last column.
    pub end_column: u32,
    /// Other places that belong to it, nearest first: where the sub was called, where the loop begins.
    pub notes: Vec<Note>,
}

/// Another place that belongs to a diagnostic.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// What this place has to do with it, e.g. `called from here`.
    pub message: String,
    /// Path of the file.
    pub file: String,
    /// Line, counted from 1.
    pub line: u32,
    /// First column, counted from 1 in bytes.
    pub column: u32,
    /// One past the last column.
    pub end_column: u32,
}
