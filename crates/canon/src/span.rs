//! Where in the source text something came from.

/// Which source file: 0 is the program, others are subroutine files in the order they were opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, PartialOrd, Ord)]
pub struct FileId(pub u16);

/// A stretch of one line of source text. Travels with every canonical command, path piece and error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// Line, counted from 1; 0 = nowhere (start-up).
    pub line: u32,
    /// First byte of the stretch within the line, counted from 0.
    pub start: u32,
    /// One past its last byte; `start == end` points between two bytes.
    pub end: u32,
}

impl Span {
    /// A stretch of a line.
    pub const fn new(file: FileId, line: u32, start: u32, end: u32) -> Self {
        Self { file, line, start, end }
    }
}
