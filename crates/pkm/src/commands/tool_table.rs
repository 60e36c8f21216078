//! Tool tables in LinuxCNC's format.

use crate::outcome::Failure;
use crate::render::diagnostics::Messages;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_gcode::ToolTable;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The largest tool table that is read.
const MOST_TABLE_BYTES: u64 = 1 << 20;

/// A tool table; lines that are no tool are skipped with a warning.
pub(crate) fn read(path: &Path, messages: &Messages) -> Result<ToolTable, Failure> {
    let name = path.display().to_string();
    let refuse = |message: String, help| Failure::could_not("tool-table", &name, message, help);
    let mut text = Vec::new();
    File::open(path).and_then(|file| file.take(MOST_TABLE_BYTES + 1).read_to_end(&mut text)).map_err(
        |error| refuse(format!("cannot read {name}: {error}"), "check the path and its permissions"),
    )?;
    if text.len() as u64 > MOST_TABLE_BYTES {
        return Err(refuse(format!("larger than {MOST_TABLE_BYTES} bytes"), "give a tool table"));
    }
    let mut skipped = Vec::new();
    let table = ToolTable::parse(&text, |line, _| skipped.push(line))
        .map_err(|error| refuse(error.to_string(), "give a shorter table"))?;
    let warnings: Vec<_> = skipped
        .into_iter()
        .map(|line| Diagnostic {
            code: "tool-table".into(),
            severity: Severity::Warning,
            message: "this line is no tool and is skipped".into(),
            help: Some("write for example: T1 P1 D6 Z12.5 ;end mill".into()),
            file: name.clone(),
            line,
            column: 1,
            end_column: 1,
            notes: Vec::new(),
        })
        .collect();
    messages.print(&warnings);
    Ok(table)
}
