//! How a command ends: the exit status, and failures on the way.

use crate::render::diagnostics::Messages;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use std::io;
use std::process::ExitCode;

/// What the exit status says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Done, nothing to object to.
    Clean,
    /// The answer is "no".
    No,
    /// The question could not be asked.
    CouldNot,
    /// Ended by Ctrl-C.
    Interrupted,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        Self::from(match outcome {
            Outcome::Clean => 0,
            Outcome::No => 1,
            Outcome::CouldNot => 2,
            Outcome::Interrupted => crate::interrupt::STATUS,
        })
    }
}

/// Why a command ended early.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Nobody reads the output any more: that is success.
    BrokenPipe,
    /// Exit 2, with these messages.
    CouldNot(Vec<Diagnostic>),
}

/// A message about a file as a whole.
fn about(severity: Severity, code: &str, file: &str, message: String, help: &str) -> Diagnostic {
    Diagnostic {
        code: code.into(),
        severity,
        message,
        help: (!help.is_empty()).then(|| help.into()),
        file: file.into(),
        line: 0,
        column: 0,
        end_column: 0,
        notes: Vec::new(),
    }
}

/// A warning about a file as a whole.
pub(crate) fn warning(code: &str, file: &str, message: String, help: &str) -> Diagnostic {
    about(Severity::Warning, code, file, message, help)
}

impl Failure {
    /// Exit 2 with one message.
    pub(crate) fn could_not(code: &str, file: &str, message: String, help: &str) -> Self {
        Self::CouldNot(vec![about(Severity::Error, code, file, message, help)])
    }

    /// Prints the messages to standard error.
    pub(crate) fn report(self, messages: &Messages) -> Outcome {
        match self {
            Self::BrokenPipe => Outcome::Clean,
            Self::CouldNot(diagnostics) => {
                messages.print(&diagnostics);
                Outcome::CouldNot
            }
        }
    }
}

/// Writing to standard output failed.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::BrokenPipe,
            _ => Self::could_not(
                "output",
                "<stdout>",
                format!("cannot write to standard output: {error}"),
                "free space or choose another place",
            ),
        }
    }
}

impl From<Diagnostic> for Failure {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::CouldNot(vec![diagnostic])
    }
}

impl From<Vec<Diagnostic>> for Failure {
    fn from(diagnostics: Vec<Diagnostic>) -> Self {
        Self::CouldNot(diagnostics)
    }
}
