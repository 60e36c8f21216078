//! What the fuzz targets run, shared with `tests/fuzz_corpus.rs`, which replays the committed corpus everywhere.
//!
//! Each entry takes any bytes and must return: no panic, no hang (blocks are bounded), bounded memory, and every place it
//! reports lies inside the text.

#[path = "finite.rs"]
mod finite;

use finite::Finite;
use pkm_canon::diagnostic::Diagnostic;
use pkm_canon::{FileId, Span};
use pkm_gcode::{
    Dialect, Interpreter, LineSource, MAX_LINE, MachineCodes, MemorySource, ParameterFile, Parameters, Place,
    Settings, SourceError, Status, ToolTable, static_check,
};

/// A fuzz target: its name, which is that of its corpus folder, and what it runs.
pub type Entry = (&'static str, fn(&[u8]));

/// All of them.
pub const ENTRIES: [Entry; 5] = [
    ("lexer", lexer),
    ("expressions", expressions),
    ("interpreter", interpreter),
    ("tool_table", tool_table),
    ("parameter_file", parameter_file),
];

/// Blocks that loops and subs may execute.
const MOST_BLOCKS: u64 = 2000;

/// A program and the files of its subs, all in memory.
struct Files<'a> {
    names: Vec<String>,
    sources: Vec<MemorySource<'a>>,
    /// The lines of each file.
    lines: Vec<Vec<&'a [u8]>>,
    current: usize,
}

impl<'a> Files<'a> {
    /// The first is the program; the others are called `a`, `b`, ...
    fn new(texts: &[&'a [u8]]) -> Self {
        let name = |i: usize| String::from(["program", "a", "b", "c"][i.min(3)]);
        Self {
            names: (0..texts.len()).map(name).collect(),
            sources: texts.iter().map(|text| MemorySource::new(text)).collect(),
            lines: texts.iter().map(|text| text.split(|b| *b == b'\n').collect()).collect(),
            current: 0,
        }
    }

    /// A line of a file, counted from 1.
    fn line(&self, file: FileId, line: u32) -> Option<&'a [u8]> {
        self.lines.get(usize::from(file.0))?.get(line.checked_sub(1)? as usize).copied()
    }

    /// A place lies inside the text.
    fn assert_inside(&self, span: Span) {
        assert!(span.start <= span.end, "{span:?}");
        let longest = self.line(span.file, span.line).map_or(0, <[u8]>::len);
        assert!(span.end as usize <= longest.min(MAX_LINE), "{span:?} in a line of {longest}");
    }

    fn assert_placed(&self, diagnostic: &Diagnostic) {
        let file = self.names.iter().position(|name| *name == diagnostic.file).expect("a known file");
        let (column, end) = (diagnostic.column, diagnostic.end_column);
        assert!(column >= 1 && column <= end, "{diagnostic:?}");
        let span = Span::new(FileId(file as u16), diagnostic.line, column - 1, end - 1);
        self.assert_inside(span);
        assert!(!diagnostic.message.is_empty());
    }
}

impl LineSource for Files<'_> {
    fn place(&self) -> Place {
        let place = self.sources[self.current].place();
        Place { file: FileId(self.current as u16), ..place }
    }

    fn next_line(&mut self) -> Result<Option<&[u8]>, SourceError> {
        self.sources[self.current].next_line()
    }

    fn seek(&mut self, place: Place) -> Result<(), SourceError> {
        self.current = usize::from(place.file.0);
        self.sources[self.current].seek(place)
    }

    fn find_subroutine(&mut self, name: &str) -> Result<Option<Place>, SourceError> {
        let found = self.names.iter().skip(1).position(|known| known == name);
        Ok(found.map(|i| Place { file: FileId(i as u16 + 1), line: 0, offset: 0 }))
    }

    fn file_name(&self, file: FileId) -> Option<String> {
        Some(self.names[usize::from(file.0)].clone())
    }
}

fn settings(choice: u8) -> Settings {
    let base = if choice & 4 == 0 { Settings::default() } else { Settings::rs274() };
    Settings {
        dialect: [Dialect::Pkm, Dialect::LinuxCnc29, Dialect::LinuxCnc210][usize::from(choice % 3)],
        block_delete: choice & 8 != 0,
        spindles: 1 + (choice >> 5),
        machine_codes: MachineCodes::new(&[100, 428]).expect("codes in range"),
        max_blocks: MOST_BLOCKS,
        max_idle_blocks: MOST_BLOCKS,
        ..base
    }
}

/// Runs a program to its end, whatever it is, and judges every error.
fn run(files: &mut Files<'_>, settings: Settings, start_line: Option<u32>) {
    let diagnostics = static_check(files, &settings, &[], None, "program");
    diagnostics.iter().for_each(|diagnostic| files.assert_placed(diagnostic));
    files.seek(Place::default()).expect("memory can be sought");
    let mut interpreter = Interpreter::new(settings);
    *interpreter.tools_mut() =
        ToolTable::parse(b"T1 P1 D6 Z10\nT2 P2 D3 Q2 I1 J2\n", |_, _| {}).expect("two tools");
    if let Some(line) = start_line
        && let Err(error) = interpreter.skip_to_line(line, files, &mut Finite)
    {
        let diagnostic = interpreter.diagnose(&error, files, "program");
        assert!(!diagnostic.code.is_empty());
        return;
    }
    let lines: usize = files.lines.iter().map(Vec::len).sum();
    // Every line once, and what may be executed again; each may begin a search that meets the end of the file.
    for _ in 0..2 * (lines + MOST_BLOCKS as usize + 1) {
        match interpreter.step(files, &mut Finite) {
            Ok(Status::Ended) => return,
            Ok(_) => {}
            Err(error) => {
                files.assert_inside(error.span);
                files.assert_placed(&interpreter.diagnose(&error, files, "program"));
                if interpreter.has_ended() {
                    return;
                }
            }
        }
    }
    panic!("the program does not end");
}

/// Any bytes as the lines of a program.
pub fn lexer(bytes: &[u8]) {
    for dialect in [Dialect::Pkm, Dialect::LinuxCnc29] {
        let settings = Settings { dialect, ..settings(0) };
        let diagnostics = static_check(&mut Files::new(&[bytes]), &settings, &[], None, "program");
        let files = Files::new(&[bytes]);
        diagnostics.iter().for_each(|diagnostic| files.assert_placed(diagnostic));
    }
}

/// Any bytes as an expression; what it gives is finite.
pub fn expressions(bytes: &[u8]) {
    let bytes = &bytes[..bytes.len().min(MAX_LINE - 10)];
    let line: Vec<u8> = bytes.iter().copied().filter(|b| *b != b'\n').collect();
    let text = [b"#<a>=3 #31=0.5\n#32=[", &line[..], b"]\nM2\n"].concat();
    let mut source = MemorySource::new(&text);
    let mut interpreter = Interpreter::new(settings(0));
    let mut failed = false;
    for _ in 0..3 {
        failed |= interpreter.step(&mut source, &mut Finite).is_err();
    }
    assert!(interpreter.parameters().get(32).is_finite());
    // What is wrong however the values turn out is wrong when it runs.
    let found = static_check(&mut MemorySource::new(&text), &settings(0), &[], None, "program");
    let wrong = found.iter().any(|d| d.severity == pkm_canon::diagnostic::Severity::Error && d.line == 2);
    assert!(failed || !wrong || found.iter().any(|d| d.code == "param-undefined"), "{found:?}");
}

/// A byte of settings, then a program and up to three files of its subs, separated by `\0\0`.
pub fn interpreter(bytes: &[u8]) {
    let Some((choice, text)) = bytes.split_first() else { return };
    let mut texts: Vec<&[u8]> = Vec::new();
    let mut rest = text;
    while let Some(at) = rest.windows(2).position(|pair| pair == b"\0\0").filter(|_| texts.len() < 3) {
        texts.push(&rest[..at]);
        rest = &rest[at + 2..];
    }
    texts.push(rest);
    let start_line =
        (choice & 16 != 0).then(|| text.iter().take(40).filter(|b| **b == b'\n').count() as u32 + 1);
    run(&mut Files::new(&texts), settings(*choice), start_line);
}

/// Any bytes as a tool table.
pub fn tool_table(bytes: &[u8]) {
    let lines = bytes.split(|b| *b == b'\n').count() as u32;
    let _ = ToolTable::parse(bytes, |line, _| assert!((1..=lines).contains(&line)));
}

/// Any bytes as a parameter file: refused, or what was read is written and read again alike.
pub fn parameter_file(bytes: &[u8]) {
    let lines = bytes.split(|b| *b == b'\n').count() as u32;
    let mut parameters = Parameters::default();
    match ParameterFile::read(bytes, &mut parameters) {
        Err((line, _)) => {
            assert!(line <= lines);
            assert_eq!(parameters, Parameters::default(), "half read");
        }
        Ok(file) => {
            let text = file.text(&parameters);
            let mut again = Parameters::default();
            let file = ParameterFile::read(&text, &mut again).expect("what was written can be read");
            assert_eq!(again, parameters);
            assert_eq!(file.text(&again), text);
        }
    }
}
