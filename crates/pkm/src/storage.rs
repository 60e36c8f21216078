//! Saving small files so that any interruption leaves the old or the new content (promise P7): the parameter file and its
//! `.bak`.
//!
//! Every file is written under another name in the same folder and synced; only then are all renamed, the folder is synced
//! last. The steps go through [`Storage`], so that a test can crash between any two of them.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What saving asks of a disk.
pub(crate) trait Storage {
    /// A new empty file, with the permissions of `like` if that exists; a leftover of that name is replaced.
    fn create(&mut self, path: &Path, like: &Path) -> io::Result<()>;
    /// Writes at the end of the file created last; how many bytes were taken.
    fn append(&mut self, path: &Path, bytes: &[u8]) -> io::Result<usize>;
    /// The content of the file is safe.
    fn sync(&mut self, path: &Path) -> io::Result<()>;
    /// The name `to` now means what `from` meant.
    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()>;
    /// The names in the folder are safe.
    fn sync_folder(&mut self, folder: &Path) -> io::Result<()>;
    /// Deletes a file.
    fn remove(&mut self, path: &Path) -> io::Result<()>;
}

/// Saves files that stand in one folder, in this order.
///
/// # Errors
/// What the disk says, with the path. Up to the first rename nothing has changed then and what was begun is deleted.
pub(crate) fn save(
    storage: &mut impl Storage,
    files: &[(PathBuf, &[u8])],
) -> Result<(), (PathBuf, io::Error)> {
    let begun: Vec<PathBuf> = files.iter().map(|(path, _)| beside(path)).collect();
    for ((path, bytes), new) in files.iter().zip(&begun) {
        if let Err(error) = write(storage, new, path, bytes) {
            for new in &begun {
                // There is nothing more to be done about what cannot be deleted.
                let _ = storage.remove(new);
            }
            return Err((path.clone(), error));
        }
    }
    for ((path, _), new) in files.iter().zip(&begun) {
        if let Err(error) = storage.rename(new, path) {
            for new in &begun {
                let _ = storage.remove(new);
            }
            return Err((path.clone(), error));
        }
    }
    match files.first() {
        Some((path, _)) => storage.sync_folder(folder(path)).map_err(|error| (path.clone(), error)),
        None => Ok(()),
    }
}

/// The name a file is written under: hidden, and no other process uses it.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.new", std::process::id()))
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

fn write(storage: &mut impl Storage, new: &Path, like: &Path, mut bytes: &[u8]) -> io::Result<()> {
    storage.create(new, like)?;
    while !bytes.is_empty() {
        match storage.append(new, bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(taken) => bytes = &bytes[taken..],
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    storage.sync(new)
}

/// The host's disk.
#[derive(Debug, Default)]
pub(crate) struct Disk {
    file: Option<File>,
}

impl Disk {
    fn file(&mut self) -> io::Result<&mut File> {
        self.file.as_mut().ok_or_else(|| ErrorKind::NotFound.into())
    }
}

impl Storage for Disk {
    fn create(&mut self, path: &Path, like: &Path) -> io::Result<()> {
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        if let Ok(known) = std::fs::metadata(like) {
            file.set_permissions(known.permissions())?;
        }
        self.file = Some(file);
        Ok(())
    }

    fn append(&mut self, _: &Path, bytes: &[u8]) -> io::Result<usize> {
        self.file()?.write(bytes)
    }

    fn sync(&mut self, _: &Path) -> io::Result<()> {
        self.file()?.sync_all()
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        std::fs::rename(from, to)
    }

    fn sync_folder(&mut self, folder: &Path) -> io::Result<()> {
        // Windows opens no folders as files; its renames are journalled.
        if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        std::fs::remove_file(path)
    }
}

#[cfg(test)]
mod tests;
