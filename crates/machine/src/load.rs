//! Finding a machine: the name of a shipped one, a path, or `-` for standard input.

use crate::source::{MAX_BYTES, Source};
use crate::{Machine, MachineFile, shipped};
use pkm_canon::diagnostic::Diagnostic;
use std::fs::File;
use std::io::{Read, stdin};

impl Machine {
    /// Reads and validates a machine. `overrides` are `KEY=VALUE` texts as `--set` takes them.
    ///
    /// # Errors
    /// All findings about the file and the overrides.
    pub fn load(name_or_path: &str, overrides: &[String]) -> Result<Self, Vec<Diagnostic>> {
        Self::parse(name_or_path, &read(name_or_path)?, overrides)
    }

    /// Validates the text of a machine file; `file` is its name in diagnostics.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(file: &str, text: &str, overrides: &[String]) -> Result<Self, Vec<Diagnostic>> {
        Self::try_from(MachineFile::parse(file, text, overrides)?)
    }
}

/// The text of a machine file: of a shipped machine, of the file at a path, or of standard input (`-`).
///
/// # Errors
/// One diagnostic: no such file, unreadable, larger than [`MAX_BYTES`], not UTF-8.
pub fn read(name_or_path: &str) -> Result<String, Vec<Diagnostic>> {
    if let Some(text) = shipped::text(name_or_path) {
        return Ok(text.to_owned());
    }
    let refuse = |code: &str, message: String, help: String| {
        vec![Source::new(name_or_path, "", &[]).diagnostic(code, None, message, Some(help))]
    };
    let mut bytes = Vec::new();
    let limit = MAX_BYTES as u64 + 1;
    let result = match name_or_path {
        "-" => stdin().lock().take(limit).read_to_end(&mut bytes),
        path => File::open(path).and_then(|file| file.take(limit).read_to_end(&mut bytes)),
    };
    if let Err(error) = result {
        let names: Vec<&str> = shipped::SHIPPED.iter().map(|(name, _)| *name).collect();
        let help = format!("give the path of a machine file or a shipped name: {}", names.join(", "));
        return Err(refuse(
            "machine-unreadable",
            format!("cannot read machine `{name_or_path}`: {error}"),
            help,
        ));
    }
    if bytes.len() > MAX_BYTES {
        let help = "give a machine file (TOML)".to_owned();
        return Err(refuse("machine-too-large", format!("larger than {MAX_BYTES} bytes"), help));
    }
    let not_text = |at: usize| {
        let message = format!("not a text file (byte {} is neither UTF-8 nor printable)", at + 1);
        refuse("machine-not-text", message, "a machine file is TOML in UTF-8".to_owned())
    };
    if let Some(at) = bytes.iter().position(|&byte| byte == 0) {
        return Err(not_text(at));
    }
    String::from_utf8(bytes).map_err(|error| not_text(error.utf8_error().valid_up_to()))
}
