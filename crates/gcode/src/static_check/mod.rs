//! What can be said of a program without running it: every line is read, those of branches not taken and of subs never
//! called too. Values that only a run can know count as unknown; nothing is reported that depends on them.
//!
//! The program is read once, line by line; what is kept grows with its labels and names, not with its length.

mod flow;
mod names;
mod profiles;
mod quirks;

use crate::advice::{self, Names, note, text};
use crate::block::Block;
use crate::error::{Error, ErrorKind};
use crate::interpreter::BYTE_ORDER_MARK;
use crate::line::Line;
use crate::modal::{GGroup, MGroup};
use crate::parameters::Parameters;
use crate::remap::{Remap, Remaps};
use crate::settings::{Dialect, Settings};
use crate::source::LineSource;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::string::String;
use alloc::vec::Vec;
use flow::{Definition, Open};
use names::{Reads, Unknowns};
use pkm_canon::Span;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use profiles::Profiles;

/// Findings kept.
const MOST_FINDINGS: usize = 1000;
/// Subroutine files looked into.
const MOST_FILES: usize = 1000;

/// A label or name as written.
type Name = Vec<u8>;

/// Reads the whole program without running it. `remaps`: the codes that subs stand for. `parameters`: those the program
/// starts with, if any. `program` is its path as the person gave it.
pub fn static_check(
    source: &mut dyn LineSource,
    settings: &Settings,
    remaps: &[Remap],
    parameters: Option<&Parameters>,
    program: &str,
) -> Vec<Diagnostic> {
    let remaps = Remaps::of(remaps);
    let mut check = StaticCheck::new(settings, &remaps);
    check.read_file(source, true);
    check.read_called_files(source);
    check.finish(parameters);
    check.diagnostics(source, program)
}

/// How deep in the program a line stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Nesting {
    /// Executed in order.
    Top,
    /// In a branch or loop.
    Construct,
    /// In a sub.
    Sub,
    /// There is no such line, or no run comes to it.
    Nowhere,
}

/// How deep a line of the program stands; the source stands at its begin.
pub(crate) fn nesting_at(
    source: &mut dyn LineSource,
    settings: &Settings,
    remaps: &Remaps,
    line: u32,
) -> Nesting {
    let mut check = StaticCheck::new(settings, remaps);
    check.wanted_line = line;
    check.read_file(source, true);
    check.nesting
}

/// Something found.
struct Finding {
    error: Error,
    severity: Severity,
    /// The source line, for the word underlined.
    line: Vec<u8>,
    /// Another place that belongs to it.
    other: Option<(&'static str, Span)>,
}

/// Where a line stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Region {
    /// Executed in order.
    Main,
    /// Behind the program's end, or outside the subs of a subroutine file: never read by a run.
    #[default]
    Dead,
    /// Inside `sub`, or a Fanuc program.
    Sub,
}

struct StaticCheck<'a> {
    settings: &'a Settings,
    remaps: &'a Remaps,
    line: Line,
    block: Block,
    findings: Vec<Finding>,
    region: Region,
    /// Open constructs of the present sub or of the main program.
    open: Vec<Open>,
    /// First use of each label in the present sub or in the main program.
    labels: BTreeMap<Name, Span>,
    /// The main program's, while a sub is read.
    outside: (Vec<Open>, BTreeMap<Name, Span>, Region),
    /// The sub being read, and where it begins.
    sub: Option<(Name, Span, Vec<u8>)>,
    definitions: BTreeMap<Name, Definition>,
    /// Called labels: the first call, its line, and the subs it is called from (empty = main program).
    calls: BTreeMap<Name, (Span, Vec<u8>, BTreeSet<Name>)>,
    /// A call whose label only a run knows.
    calls_unknown: bool,
    /// Some sub ends the program.
    sub_ends_program: bool,
    /// Endless loops that call subs: certain only if no sub ends the program.
    endless_with_calls: Vec<Finding>,
    /// Labels of o-words that were wrong.
    wrong: BTreeSet<Name>,
    reads: Reads,
    profiles: Profiles,
    /// A line whose nesting is wanted; 0 = none.
    wanted_line: u32,
    nesting: Nesting,
}

impl<'a> StaticCheck<'a> {
    fn new(settings: &'a Settings, remaps: &'a Remaps) -> Self {
        Self {
            settings,
            remaps,
            line: Line::new(),
            block: Block::new(),
            findings: Vec::new(),
            region: Region::Main,
            open: Vec::new(),
            labels: BTreeMap::new(),
            outside: (Vec::new(), BTreeMap::new(), Region::Main),
            sub: None,
            definitions: BTreeMap::new(),
            calls: BTreeMap::new(),
            calls_unknown: false,
            sub_ends_program: false,
            endless_with_calls: Vec::new(),
            wrong: BTreeSet::new(),
            reads: Reads::default(),
            profiles: Profiles::default(),
            wanted_line: 0,
            nesting: Nesting::Nowhere,
        }
    }

    fn strict(&self) -> bool {
        self.settings.dialect == Dialect::Pkm
    }

    fn add(&mut self, kind: ErrorKind, span: Span, severity: Severity) {
        self.add_with(kind, span, severity, None);
    }

    fn add_with(
        &mut self,
        kind: ErrorKind,
        span: Span,
        severity: Severity,
        other: Option<(&'static str, Span)>,
    ) {
        if self.findings.len() < MOST_FINDINGS {
            let line = match (span.file, span.line) == (self.line.file, self.line.number) {
                true => self.line.raw().to_vec(),
                false => Vec::new(),
            };
            self.findings.push(Finding { error: Error { kind, span }, severity, line, other });
        }
    }

    /// Reads the file at which the source stands, from its first line to its end.
    fn read_file(&mut self, source: &mut dyn LineSource, main: bool) {
        self.region = if main { Region::Main } else { Region::Dead };
        let (mut begun, mut framed) = (false, false);
        let mut number = source.place().line;
        let file = source.place().file;
        // What cannot be read is reported by the run.
        while let Ok(Some(bytes)) = source.next_line() {
            number += 1;
            let bytes = match number {
                1 if self.strict() => bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes),
                _ => bytes,
            };
            let loaded = self.line.load(bytes, file, number);
            if number == self.wanted_line {
                self.nesting = match self.region {
                    Region::Dead => Nesting::Nowhere,
                    Region::Sub => Nesting::Sub,
                    Region::Main if self.open.is_empty() => Nesting::Top,
                    Region::Main => Nesting::Construct,
                };
                return;
            }
            let trimmed = self.line.raw().trim_ascii();
            if trimmed.is_empty() {
                continue;
            }
            if !begun {
                begun = true;
                framed = trimmed == b"%";
                if framed {
                    continue;
                }
            } else if framed && trimmed == b"%" {
                break;
            }
            if self.settings.block_delete && trimmed.first() == Some(&b'/') {
                continue;
            }
            if let Err(error) = loaded.and_then(|()| self.line.prepare()) {
                self.fail(error);
                continue;
            }
            self.read_line();
        }
        self.end_of_file();
    }

    fn fail(&mut self, error: Error) {
        if self.region != Region::Dead {
            self.add(error.kind, error.span, Severity::Error);
            // What the line sets counts as set: what reads it must not be blamed.
            let scope = self.scope();
            self.reads.sets_of_text(self.line.code(), &scope);
        }
    }

    /// Whose local names are seen: the present sub's.
    fn scope(&self) -> Name {
        self.sub.as_ref().map(|(label, ..)| label.clone()).unwrap_or_default()
    }

    fn read_line(&mut self) {
        let start = match self.line.skip_number() {
            Ok(start) => start,
            Err(error) => return self.fail(error),
        };
        if self.line.code().get(start) == Some(&b'o') {
            self.o_word(start);
            return;
        }
        if self.region == Region::Dead {
            return;
        }
        if self.strict() {
            self.quirks();
        }
        let reader = crate::block::Reader {
            remaps: self.remaps,
            axes: self.axes_here(),
            diameter: false,
            spindles: self.settings.spindles.min(8),
            machine_codes: self.settings.machine_codes,
            newer: self.settings.is_newer(),
            both_coolants: self.settings.dialect == Dialect::Pkm,
            largest: self.settings.largest_number(),
        };
        let seen = Unknowns::new(self.strict());
        let read = self.block.read(&self.line, start, &seen, &reader);
        self.take_reads(&seen);
        if let Err(error) = read {
            return self.fail(error);
        }
        self.take_profile_words();
        self.take_settings();
        self.take_ends();
        if let Some(number) = self.block.m(MGroup::User)
            && !self.settings.machine_codes.contains(number)
            && self.remaps.m_group(number).is_none()
        {
            let span = self.block.m_span(MGroup::User);
            self.add(ErrorKind::MUnsupported { number }, span, Severity::Error);
        }
        self.take_remapped();
        if let Some(700 | 710..=712 | 720..=722) = self.block.g(GGroup::Motion)
            && self.block.has(b'Q')
        {
            let label = self.number_label(b'Q');
            self.takes_profile(label.as_ref());
            self.calls_sub(label, self.block.word_span(b'Q'));
        }
    }

    /// Remapped codes call their subs, which get the words as names.
    fn take_remapped(&mut self) {
        for (_, remap) in self.remaps.iter() {
            let Some(span) = remap.code.place_in(&self.block) else { continue };
            let sub = remap.sub().as_bytes().to_vec();
            for name in remap.names() {
                self.reads.set(&sub, &names::Parameter::Name([name].into()));
            }
            self.calls_sub(Some(sub), span);
        }
    }

    /// The label that a word's number names.
    fn number_label(&self, letter: u8) -> Option<Vec<u8>> {
        self.block.get(letter).filter(|number| !number.is_nan()).map(|number| {
            let mut text = crate::o_word::LabelText::new();
            crate::o_word::push_integer(&mut text, pkm_kins::maths::round(number) as i32);
            text.to_vec()
        })
    }

    /// M2, M30, M98, M99 and (abort,) of a block.
    fn take_ends(&mut self) {
        let abort = self.block.comments.iter().any(|&(from, to)| {
            let comment = &self.line.code()[from.into()..to.into()];
            comment.trim_ascii_start().get(..6).is_some_and(|text| text.eq_ignore_ascii_case(b"abort,"))
        });
        match self.block.m(MGroup::Stop) {
            Some(2 | 30) => self.program_ends(),
            Some(99) => self.fanuc_ends(),
            _ if abort => self.exits_all(),
            _ => {}
        }
        if self.block.has_m(98) {
            let label = self.number_label(b'P');
            let span = self.block.m_span(MGroup::Call);
            self.calls_sub(label, span);
        }
    }

    fn diagnostics(mut self, source: &dyn LineSource, program: &str) -> Vec<Diagnostic> {
        self.findings.sort_by_key(|finding| {
            let Span { file, line, start, .. } = finding.error.span;
            (file, line, start)
        });
        let mut names = Names {
            parameters: self.reads.set_names().map(text).collect(),
            labels: self.definitions.keys().map(|name| text(name)).collect(),
            missing: None,
        };
        let mut diagnostics = Vec::new();
        for finding in &self.findings {
            if finding.error.kind == ErrorKind::ONotFound {
                let span = finding.error.span;
                let call = self.calls.iter().find(|(_, (call, ..))| *call == span);
                names.missing = call.map(|(label, _)| text(label));
            }
            let mut diagnostic = advice::diagnostic(&finding.error, &finding.line, source, program, &names);
            diagnostic.severity = finding.severity;
            diagnostic.notes.extend(finding.other.map(|(what, span)| note(what, span, source, program)));
            diagnostics.push(diagnostic);
        }
        let key = |d: &Diagnostic| (d.file.clone(), d.line, d.column, d.code.clone());
        let mut known: BTreeSet<(String, u32, u32, String)> = BTreeSet::new();
        diagnostics.retain(|diagnostic| known.insert(key(diagnostic)));
        diagnostics
    }
}
