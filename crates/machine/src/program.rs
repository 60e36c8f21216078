//! `[program]`: what programs of a machine mean beyond the language: remapped codes, where subs are, the tool changer.

use crate::file::MachineFile;
use crate::source::Findings;
use crate::switch::Switch;
use pkm_canon::diagnostic::Diagnostic;
use pkm_gcode::{MachineCodes, Remap, Settings};
use std::path::{Path, PathBuf};

/// What programs of a machine mean beyond the language.
#[derive(Debug, Clone, Default)]
pub struct ProgramSettings {
    /// Codes that subs stand for, each code once.
    pub remaps: Vec<RemappedCode>,
    /// Folders of subroutine files, looked into behind the program's own.
    pub subroutine_path: Vec<PathBuf>,
    /// M6 exchanges the tool with the one in the spindle; each has a pocket of its own.
    pub random_tool_changer: bool,
}

/// A code that a sub stands for.
#[derive(Debug, Clone)]
pub struct RemappedCode {
    /// The code, its words and its sub.
    pub remap: Remap,
    /// As it was written.
    pub written: String,
    /// What is to be told where the sub has no file: that depends on the program's folder, too.
    pub missing: Diagnostic,
}

/// The table; `None` after noting what is wrong with it.
pub(crate) fn program(
    file: &MachineFile,
    switches: &[Switch],
    findings: &mut Findings<'_>,
) -> Option<ProgramSettings> {
    let written = &file.tables.program;
    let codes: Vec<i32> = switches.iter().map(|switch| switch.code).collect();
    let machine_codes = MachineCodes::new(&codes).unwrap_or_default();
    let settings = Settings { machine_codes, ..Settings::default() };
    let mut remaps: Vec<RemappedCode> = Vec::new();
    for text in &written.remap {
        let line = text.get_ref().trim();
        let said = |what: &str| format!("program.remap \"{line}\": {what}");
        let mut refuse =
            |what: &str, help: &str| findings.error("machine-remap", text.span(), said(what), help);
        match Remap::parse(line, &settings) {
            Err(error) => refuse(&error.message, error.help),
            Ok(remap) if remaps.iter().any(|known| known.remap.is_of_the_code_of(&remap)) => {
                refuse("this code is remapped already", "remove one of the two");
            }
            Ok(remap) => {
                let message = said(&format!("there is no file {}.ngc", remap.sub()));
                let help = "put it beside the program or into a folder of program.subroutine_path";
                let span = Some(text.span());
                let missing = file.source.diagnostic("machine-remap", span, message, Some(help.to_owned()));
                remaps.push(RemappedCode { remap, written: line.to_owned(), missing });
            }
        }
    }
    let beside = Path::new(file.source.file()).parent().unwrap_or(Path::new(""));
    let folders = written.subroutine_path.iter();
    let subroutine_path = folders.map(|folder| beside.join(folder.get_ref())).collect();
    let random_tool_changer = written.random_tool_changer;
    (remaps.len() == written.remap.len()).then_some(ProgramSettings {
        remaps,
        subroutine_path,
        random_tool_changer,
    })
}
