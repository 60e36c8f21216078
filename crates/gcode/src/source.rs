//! Where program lines come from. Memory does not grow with the program: one line at a time.

use pkm_canon::FileId;

/// A place between two lines, to return to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, PartialOrd, Ord)]
pub struct Place {
    /// The file.
    pub file: FileId,
    /// Lines before this place: the line read next is `line + 1`.
    pub line: u32,
    /// Bytes before this place.
    pub offset: u64,
}

/// Why a line could not be had.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceError {
    /// The file could not be read.
    Unreadable,
    /// This source cannot go back (a pipe), so it cannot run loops and subroutines.
    NotSeekable,
    /// More files than [`FileId`] can number, or the host refused to open another.
    TooManyFiles,
}

/// Lines of a program and of the subroutine files it calls.
pub trait LineSource {
    /// Where the next line begins.
    fn place(&self) -> Place;

    /// The next line without its line end (LF; a CR before it may stay), or `None` at the end of the current file.
    /// A line longer than [`MAX_LINE`] may be cut to anything longer than [`MAX_LINE`].
    fn next_line(&mut self) -> Result<Option<&[u8]>, SourceError>;

    /// Continues at a place this source gave earlier.
    fn seek(&mut self, place: Place) -> Result<(), SourceError> {
        let _ = place;
        Err(SourceError::NotSeekable)
    }

    /// Finds the subroutine file of that name (without `.ngc`) and returns its first place, if there is one.
    fn find_subroutine(&mut self, name: &str) -> Result<Option<Place>, SourceError> {
        let _ = name;
        Ok(None)
    }

    /// The path of a file, for messages; `None` where the source does not know it (a program in memory).
    #[cfg(feature = "alloc")]
    fn file_name(&self, file: FileId) -> Option<alloc::string::String> {
        let _ = file;
        None
    }
}

/// Longest accepted line in bytes, without the line end (LinuxCNC's limit is 253; promise P5 asks for a bound).
pub const MAX_LINE: usize = 255;

/// A program in memory.
#[derive(Debug, Clone, Copy)]
pub struct MemorySource<'a> {
    text: &'a [u8],
    place: Place,
}

impl<'a> MemorySource<'a> {
    /// The lines of `text`.
    pub const fn new(text: &'a [u8]) -> Self {
        Self { text, place: Place { file: FileId(0), line: 0, offset: 0 } }
    }
}

impl LineSource for MemorySource<'_> {
    fn place(&self) -> Place {
        self.place
    }

    fn next_line(&mut self) -> Result<Option<&[u8]>, SourceError> {
        let start = usize::try_from(self.place.offset).unwrap_or(usize::MAX);
        let rest = match self.text.get(start..) {
            None | Some([]) => return Ok(None),
            Some(rest) => rest,
        };
        let end = rest.iter().position(|&b| b == b'\n');
        let line = &rest[..end.unwrap_or(rest.len())];
        self.place.offset += line.len() as u64 + u64::from(end.is_some());
        self.place.line += 1;
        Ok(Some(line))
    }

    fn seek(&mut self, place: Place) -> Result<(), SourceError> {
        self.place = place;
        Ok(())
    }
}

#[cfg(feature = "std")]
pub use file::FileSource;

#[cfg(feature = "std")]
mod file {
    use super::{LineSource, MAX_LINE, Place, SourceError};
    use alloc::boxed::Box;
    use alloc::string::{String, ToString};
    use alloc::{format, vec::Vec};
    use pkm_canon::FileId;
    use std::fmt::Debug;
    use std::fs::File;
    use std::io::{self, BufRead, BufReader, Cursor, Seek};
    use std::path::{Path, PathBuf};

    /// A program and, along a search path, the subroutine files it calls.
    #[derive(Debug)]
    pub struct FileSource<'a> {
        files: Vec<Opened<'a>>,
        current: usize,
        search_path: Vec<PathBuf>,
        /// The line last read; never longer than `MAX_LINE + 1`.
        line: Vec<u8>,
    }

    /// A file, or a text in memory.
    trait Input: BufRead + Seek + Debug {}
    impl<T: BufRead + Seek + Debug> Input for T {}

    #[derive(Debug)]
    struct Opened<'a> {
        path: PathBuf,
        reader: Box<dyn Input + 'a>,
        place: Place,
    }

    impl<'a> FileSource<'a> {
        /// Opens the program. Subroutine files are looked for in `search_path`, in order.
        ///
        /// # Errors
        /// What the host says when the file cannot be opened.
        pub fn open(program: &Path, search_path: Vec<PathBuf>) -> io::Result<Self> {
            Ok(Self::new(Opened::open(program.to_path_buf(), FileId(0))?, search_path))
        }

        /// The same of a program in memory, which messages call `name`.
        pub fn of_text(name: &str, text: &'a [u8], search_path: Vec<PathBuf>) -> Self {
            let reader = Box::new(Cursor::new(text));
            Self::new(Opened { path: name.into(), reader, place: Place::default() }, search_path)
        }

        fn new(program: Opened<'a>, search_path: Vec<PathBuf>) -> Self {
            let line = Vec::with_capacity(MAX_LINE + 1);
            Self { files: Vec::from([program]), current: 0, search_path, line }
        }

        /// The path of a file this source has opened.
        pub fn path(&self, file: FileId) -> Option<&Path> {
            self.files.get(usize::from(file.0)).map(|opened| opened.path.as_path())
        }
    }

    impl Opened<'_> {
        fn open(path: PathBuf, file: FileId) -> io::Result<Self> {
            let reader = Box::new(BufReader::with_capacity(1 << 16, File::open(&path)?));
            Ok(Self { path, reader, place: Place { file, line: 0, offset: 0 } })
        }

        fn seek(&mut self, place: Place) -> io::Result<()> {
            // Relative, so that a short jump (a loop) stays in the buffer.
            let distance = place.offset.wrapping_sub(self.place.offset).cast_signed();
            self.reader.seek_relative(distance)?;
            self.place = place;
            Ok(())
        }
    }

    impl LineSource for FileSource<'_> {
        fn place(&self) -> Place {
            self.files[self.current].place
        }

        fn next_line(&mut self) -> Result<Option<&[u8]>, SourceError> {
            let Opened { reader, place, .. } = &mut self.files[self.current];
            self.line.clear();
            let mut read = 0_u64;
            loop {
                let buffer = reader.fill_buf().map_err(|_| SourceError::Unreadable)?;
                if buffer.is_empty() {
                    break;
                }
                let end = buffer.iter().position(|&b| b == b'\n');
                let part = &buffer[..end.unwrap_or(buffer.len())];
                let room = (MAX_LINE + 1).saturating_sub(self.line.len());
                self.line.extend_from_slice(&part[..part.len().min(room)]);
                let count = part.len() + usize::from(end.is_some());
                read += count as u64;
                reader.consume(count);
                if end.is_some() {
                    break;
                }
            }
            if read == 0 {
                return Ok(None);
            }
            place.offset += read;
            place.line += 1;
            Ok(Some(&self.line))
        }

        fn seek(&mut self, place: Place) -> Result<(), SourceError> {
            let index = usize::from(place.file.0);
            let opened = self.files.get_mut(index).ok_or(SourceError::Unreadable)?;
            opened.seek(place).map_err(|_| SourceError::NotSeekable)?;
            self.current = index;
            Ok(())
        }

        fn file_name(&self, file: FileId) -> Option<String> {
            self.path(file).map(|path| path.display().to_string())
        }

        fn find_subroutine(&mut self, name: &str) -> Result<Option<Place>, SourceError> {
            let file_name: String = format!("{name}.ngc");
            for directory in &self.search_path {
                let path = directory.join(&file_name);
                if let Some(index) = self.files.iter().position(|opened| opened.path == path) {
                    let file = FileId(u16::try_from(index).map_err(|_| SourceError::TooManyFiles)?);
                    return Ok(Some(Place { file, line: 0, offset: 0 }));
                }
                if !path.is_file() {
                    continue;
                }
                let file = FileId(u16::try_from(self.files.len()).map_err(|_| SourceError::TooManyFiles)?);
                let opened = Opened::open(path, file).map_err(|_| SourceError::Unreadable)?;
                self.files.push(opened);
                return Ok(Some(Place { file, line: 0, offset: 0 }));
            }
            Ok(None)
        }
    }
}
