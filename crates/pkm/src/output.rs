//! Output files: each appears whole or not at all (promise P7).
//!
//! A file is written under another name in the same folder, synced, then renamed; the folder is synced after it. Nothing
//! is renamed before everything is written and synced, so a full disk leaves all old files as they were.
//! What is no regular file (a pipe, `/dev/null`) is written straight and never replaced.

use crate::outcome::Failure;
use atomic_write_file::AtomicWriteFile;
use serde::Serialize;
use std::fs::{File, OpenOptions, create_dir_all};
use std::io::{self, BufWriter, Write, stdout};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A folder for output files.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    failed: Arc<AtomicBool>,
}

/// A file that is being written.
#[derive(Debug)]
pub(crate) struct Pending {
    path: PathBuf,
    file: BufWriter<Target>,
    failed: Arc<AtomicBool>,
}

impl Folder {
    /// The folder at `path`, made if it is not there.
    ///
    /// # Errors
    /// It cannot be made.
    pub(crate) fn new(path: &Path) -> Result<Self, Failure> {
        create_dir_all(path).map_err(|error| failure(path, &error))?;
        Ok(Self { path: path.to_owned(), failed: Arc::new(AtomicBool::new(false)) })
    }

    /// Begins a file.
    ///
    /// # Errors
    /// It cannot be made.
    pub(crate) fn create(&self, name: &str) -> Result<Pending, Failure> {
        let path = self.path.join(name);
        let file = Target::open(&path).map_err(|error| failure(&path, &error))?;
        Ok(Pending { path, file: BufWriter::new(file), failed: Arc::clone(&self.failed) })
    }

    /// A failure to write one of its files.
    pub(crate) fn failure(&self, name: &str, error: &io::Error) -> Failure {
        failure(&self.path.join(name), error)
    }

    /// Set as soon as writing to any file of the folder has failed.
    pub(crate) fn failed(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.failed)
    }

    /// Puts all files in place of the old ones.
    ///
    /// # Errors
    /// A file cannot be written to the end or synced: then no file has changed. Or it cannot be renamed.
    pub(crate) fn commit(self, files: Vec<Pending>) -> Result<(), Failure> {
        let mut ready = Vec::new();
        for Pending { path, file, .. } in files {
            let file = file.into_inner().map_err(|error| failure(&path, error.error()))?;
            file.sync_all().map_err(|error| failure(&path, &error))?;
            ready.push((path, file));
        }
        for (path, file) in ready {
            file.commit().map_err(|error| failure(&path, &error))?;
        }
        File::open(&self.path)
            .and_then(|folder| folder.sync_all())
            .map_err(|error| failure(&self.path, &error))
    }
}

impl Pending {
    /// Without its folder.
    pub(crate) fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes);
        if written.is_err() {
            self.failed.store(true, Ordering::Relaxed);
        }
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// One output file.
#[derive(Debug)]
pub(crate) enum Target {
    /// A regular file or none yet: the name means the old content until [`Target::commit`].
    Whole(AtomicWriteFile),
    /// A pipe or a device.
    Straight(File),
}

impl Target {
    /// Begins the file that stands at `path`, behind its links.
    ///
    /// # Errors
    /// It is a folder or cannot be made.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        match path.metadata() {
            Ok(known) if known.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
            Ok(known) if !known.is_file() => OpenOptions::new().write(true).open(path).map(Self::Straight),
            Ok(_) => AtomicWriteFile::open(path.canonicalize()?).map(Self::Whole),
            Err(_) => AtomicWriteFile::open(path).map(Self::Whole),
        }
    }

    /// Waits until the content is safe.
    ///
    /// # Errors
    /// What the disk says.
    pub(crate) fn sync_all(&self) -> io::Result<()> {
        match self {
            Self::Whole(file) => file.sync_all(),
            Self::Straight(_) => Ok(()),
        }
    }

    /// Puts the file in place of the old one.
    ///
    /// # Errors
    /// What the disk says: then the old one is as it was.
    pub(crate) fn commit(self) -> io::Result<()> {
        match self {
            Self::Whole(file) => file.commit(),
            Self::Straight(_) => Ok(()),
        }
    }
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Whole(file) => file.write(bytes),
            Self::Straight(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Whole(file) => file.flush(),
            Self::Straight(file) => file.flush(),
        }
    }
}

/// One JSON value and the end of the line, to standard output.
///
/// # Errors
/// Standard output cannot be written.
pub(crate) fn json_line(value: &impl Serialize) -> Result<(), Failure> {
    Ok(writeln!(stdout(), "{}", json(value)?)?)
}

/// One JSON value.
///
/// # Errors
/// It holds what JSON cannot say.
pub(crate) fn json(value: &impl Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string(value).map_err(io::Error::from)?)
}

/// What the system said about a path.
pub(crate) fn failure(path: &Path, error: &io::Error) -> Failure {
    let help = match error.kind() {
        io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => {
            "a file of that name stands in the way of the folder: choose another folder"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "you may not write there: choose another folder; files that were there are as they were"
        }
        _ => "free space or choose another folder; files that were there are as they were",
    };
    let message = format!("cannot write {}: {error}", path.display());
    Failure::could_not("output", &path.display().to_string(), message, help)
}
