//! Where a program comes from. It is read twice (check, then run), so a pipe is kept in memory; a file is streamed.

use pkm_gcode::FileSource;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::PathBuf;

/// A G-code program.
#[derive(Debug, Clone)]
pub enum Program {
    /// A file, streamed.
    File(PathBuf),
    /// Text in memory, with the name that messages give it.
    Memory {
        /// For messages.
        name: String,
        /// The program.
        text: Vec<u8>,
    },
}

impl Program {
    /// Its name in messages.
    pub fn name(&self) -> String {
        match self {
            Program::File(path) => path.display().to_string(),
            Program::Memory { name, .. } => name.clone(),
        }
    }

    /// Its text, from the first byte.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn read(&self) -> io::Result<Box<dyn BufRead + '_>> {
        Ok(match self {
            Program::File(path) => Box::new(BufReader::new(File::open(path)?)),
            Program::Memory { text, .. } => Box::new(text.as_slice()),
        })
    }

    /// Opens it at its first line. Subroutine files are looked for beside the program, then in these folders.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(&self, subroutine_path: &[PathBuf]) -> io::Result<FileSource<'_>> {
        Ok(match self {
            Program::File(path) => {
                let beside = path.parent().into_iter().map(PathBuf::from);
                FileSource::open(path, beside.chain(subroutine_path.iter().cloned()).collect())?
            }
            Program::Memory { name, text } => FileSource::of_text(name, text, subroutine_path.to_vec()),
        })
    }
}
