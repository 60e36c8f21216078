//! `pkm import-linuxcnc`: a machine file from a LinuxCNC configuration.

use crate::cli::ImportLinuxcnc;
use crate::outcome::{Failure, Outcome, warning};
use crate::output::Folder;
use crate::render::diagnostics::Messages;
use pkm_canon::diagnostic::Diagnostic;
use pkm_machine::Machine;
use std::ffi::OsStr;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// The largest INI or HAL file that is read.
const MAX_BYTES: u64 = 1 << 20;

pub(crate) fn run(arguments: &ImportLinuxcnc, messages: &Messages) -> Result<Outcome, Failure> {
    let path = &arguments.ini;
    let shown = path.display().to_string();
    let text = read(path).map_err(|why| {
        let message = format!("cannot read {shown}: {why}");
        Failure::could_not("linuxcnc-ini", &shown, message, "give the INI file of a LinuxCNC configuration")
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    // Where folders of subroutines begin: beside the INI file the machine file finds them by the same words.
    let beside = |output: &Path| {
        let real = |folder: &Path| std::fs::canonicalize(Path::new(".").join(folder)).ok();
        real(output.parent().unwrap_or(Path::new(""))) == real(folder)
    };
    let seen = match &arguments.output {
        Some(output) if beside(output) => PathBuf::new(),
        _ => std::path::absolute(Path::new(".").join(folder)).unwrap_or_default(),
    };
    let imported = pkm_linuxcnc::import(&text, &seen, &|name| read(&folder.join(name)).ok())
        .map_err(|error| Failure::could_not(error.code, &shown, error.message, &error.help))?;
    let remarks: Vec<Diagnostic> = imported
        .remarks
        .iter()
        .map(|remark| warning("linuxcnc-missing", &shown, remark.clone(), ""))
        .collect();
    messages.print(&remarks);
    match &arguments.output {
        None => std::io::stdout().lock().write_all(imported.toml.as_bytes())?,
        Some(output) => {
            let folder =
                Folder::new(output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")))?;
            let name = output.file_name().and_then(OsStr::to_str).ok_or_else(|| {
                Failure::could_not("output", &output.display().to_string(), "no name of a file".into(), "")
            })?;
            let mut file = folder.create(name)?;
            file.write_all(imported.toml.as_bytes()).map_err(|error| folder.failure(name, &error))?;
            folder.commit(vec![file])?;
        }
    }
    // The machine file is written in any case; what is wrong with its numbers is told here.
    match Machine::parse("the imported machine file", &imported.toml, &[]) {
        Ok(_) => Ok(Outcome::Clean),
        Err(diagnostics) => {
            messages.print(&diagnostics);
            Ok(Outcome::No)
        }
    }
}

fn read(path: &Path) -> Result<String, String> {
    let file = std::fs::File::open(path).map_err(|error| error.to_string())?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(format!("it has more than {MAX_BYTES} bytes"));
    }
    // Comments may be in any encoding.
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
