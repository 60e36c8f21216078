//! Parameter files in LinuxCNC's format: read whole or refused, saved so that any interruption leaves the old or the new
//! content (promise P7).

use crate::outcome::Failure;
use crate::output::failure;
use crate::storage::{self, Disk};
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_gcode::{ParameterFile, Parameters};
use std::fs::{File, create_dir_all};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// The largest parameter file that is read.
const MOST_BYTES: u64 = 1 << 20;

/// What to do about a damaged file: the content before it may be there.
fn remedy(path: &Path, kind: pkm_gcode::ErrorKind) -> String {
    let mut bak = path.as_os_str().to_owned();
    bak.push(".bak");
    let bak = PathBuf::from(bak);
    match bak.is_file() {
        true => format!("{}; the content before the last save is in {}", kind.help(), bak.display()),
        false => format!("{}; there is no {}", kind.help(), bak.display()),
    }
}

/// A parameter file that was read, to save it later.
pub(crate) struct Kept {
    path: PathBuf,
    file: ParameterFile,
    /// What was read, for the `.bak`; `None` if there was no file.
    old: Option<Vec<u8>>,
}

impl Kept {
    /// The file and the parameters in it. Where there is no file, all parameters are as in a fresh interpreter.
    ///
    /// # Errors
    /// The file cannot be read, or it is damaged.
    pub(crate) fn read(path: &Path) -> Result<(Self, Parameters), Failure> {
        let mut parameters = Parameters::default();
        let name = path.display().to_string();
        let mut text = Vec::new();
        match File::open(path).and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut text)) {
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::NotFound => {
                let kept = Self { path: path.to_owned(), file: ParameterFile::default(), old: None };
                return Ok((kept, parameters));
            }
            Err(error) => {
                let message = format!("cannot read {name}: {error}");
                let help = "check the path and its permissions";
                return Err(Failure::could_not("param-file", &name, message, help));
            }
        }
        if text.len() as u64 > MOST_BYTES {
            let message = format!("larger than {MOST_BYTES} bytes");
            return Err(Failure::could_not("param-file", &name, message, "give a parameter file"));
        }
        let file = ParameterFile::read(&text, &mut parameters).map_err(|(line, kind)| Diagnostic {
            code: kind.code().into(),
            severity: Severity::Error,
            message: kind.to_string(),
            help: Some(remedy(path, kind)),
            file: name,
            line,
            column: 1,
            end_column: 1,
            notes: Vec::new(),
        })?;
        Ok((Self { path: path.to_owned(), file, old: Some(text) }, parameters))
    }

    /// Saves the parameters; what was read stays beside them as `.bak`.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(crate) fn save(&self, parameters: &Parameters) -> Result<(), Failure> {
        let told = |message: &str| {
            let name = self.path.display().to_string();
            Failure::could_not("output", &name, message.into(), "give the path of a file")
        };
        let name = self.path.file_name().and_then(|name| name.to_str());
        let name = name.ok_or_else(|| told("this is no name of a parameter file"))?;
        if self.path.is_dir() {
            return Err(told("this is a folder"));
        }
        // Behind a link stands the file itself; the link stays.
        let path = self.path.canonicalize().unwrap_or_else(|_| self.path.clone());
        if let Some(folder) = path.parent() {
            create_dir_all(folder).map_err(|error| failure(folder, &error))?;
        }
        let text = self.file.text(parameters);
        let mut files = Vec::new();
        if let Some(old) = &self.old {
            files.push((self.path.with_file_name(format!("{name}.bak")), &old[..]));
        }
        files.push((path, &text[..]));
        storage::save(&mut Disk::default(), &files).map_err(|(path, error)| failure(&path, &error))
    }
}
