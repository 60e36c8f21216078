//! Parameters: which are read, which are set.

use super::{Name, StaticCheck};
use crate::block::Setting;
use crate::error::ErrorKind;
use crate::expression::{Scope, Tolerance, UNKNOWN};
use crate::parameters::Parameters;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;
use core::cell::RefCell;
use pkm_canon::Span;
use pkm_canon::diagnostic::Severity;

/// Parameters of the program's own: #31 to #5000.
const OWN: core::ops::RangeInclusive<i32> = 31..=5000;

/// A parameter as a construct's condition reads it, or a block sets it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Parameter {
    Number(i32),
    Name(Name),
}

impl Parameter {
    /// True if it may change without being set: what the interpreter or the machine says.
    pub(super) fn is_alive(&self) -> bool {
        match self {
            Self::Number(index) => !(1..=5000).contains(index),
            Self::Name(name) => name.starts_with(b"_") && crate::interpreter::is_predefined(name),
        }
    }

    /// True if a called sub can set it.
    pub(super) fn is_global(&self) -> bool {
        match self {
            Self::Number(index) => *index > 30,
            Self::Name(name) => name.starts_with(b"_"),
        }
    }
}

/// What an expression looks up: nothing is known, everything is noted.
pub(super) struct Unknowns {
    strict: bool,
    pub(super) read: RefCell<Vec<Parameter>>,
    asked: RefCell<Vec<Name>>,
}

impl Unknowns {
    pub(super) fn new(strict: bool) -> Self {
        Self { strict, read: RefCell::default(), asked: RefCell::default() }
    }
}

impl Scope for Unknowns {
    fn numbered(&self, index: i32) -> Result<f64, ErrorKind> {
        self.read.borrow_mut().push(Parameter::Number(index));
        Ok(f64::NAN)
    }

    fn named(&self, name: &[u8]) -> Option<f64> {
        self.read.borrow_mut().push(Parameter::Name(name.into()));
        Some(f64::NAN)
    }

    fn exists(&self, name: &[u8]) -> bool {
        self.asked.borrow_mut().push(name.into());
        true
    }

    fn tolerance(&self) -> Tolerance {
        Tolerance { equal: 1e-6, ordered: true }
    }

    fn strict(&self) -> bool {
        self.strict
    }

    fn is_static(&self) -> bool {
        true
    }
}

/// All reads and settings of the program.
#[derive(Debug, Default)]
pub(super) struct Reads {
    /// First read of a name, by sub (empty = main program; global names too).
    names: BTreeMap<(Name, Name), (Span, Vec<u8>)>,
    names_set: BTreeSet<(Name, Name)>,
    /// Names that EXISTS asks for: the program knows that they may be missing.
    asked: BTreeSet<(Name, Name)>,
    numbers: BTreeMap<i32, (Span, Vec<u8>)>,
    numbers_set: BTreeSet<i32>,
    /// `#[..]=`: any number may be set.
    any_number_set: bool,
}

/// What only LinuxCNC knows: `#<_hal[..]>`, `#<_ini[..]>`.
fn is_elsewhere(name: &[u8]) -> bool {
    name.starts_with(b"_ini[") || name.starts_with(b"_hal[")
}

/// Whose name it is: global names are the main program's.
fn owner(scope: &[u8], name: &[u8]) -> (Name, Name) {
    let scope = if name.starts_with(b"_") { &[][..] } else { scope };
    (scope.into(), name.into())
}

impl Reads {
    /// The names that are set somewhere.
    pub(super) fn set_names(&self) -> impl Iterator<Item = &[u8]> {
        self.names_set.iter().map(|(_, name)| &**name)
    }

    pub(super) fn set(&mut self, scope: &[u8], target: &Parameter) {
        match target {
            Parameter::Number(UNKNOWN) => self.any_number_set = true,
            Parameter::Number(index) => drop(self.numbers_set.insert(*index)),
            Parameter::Name(name) => drop(self.names_set.insert(owner(scope, name))),
        }
    }

    /// Everything a line that cannot be read looks as if it sets.
    pub(super) fn sets_of_text(&mut self, code: &[u8], scope: &[u8]) {
        for target in targets(code) {
            self.set(scope, &target);
        }
    }
}

/// `#31=`, `#<name>=` anywhere in a prepared line.
fn targets(code: &[u8]) -> Vec<Parameter> {
    let mut found = Vec::new();
    for (at, _) in code.iter().enumerate().filter(|(_, byte)| **byte == b'#') {
        let rest = &code[at + 1..];
        if let [b'<', name @ ..] = rest {
            let end = name.iter().position(|byte| *byte == b'>');
            if let Some(end) = end.filter(|end| name.get(end + 1) == Some(&b'=')) {
                found.push(Parameter::Name(name[..end].into()));
            }
        } else {
            let end = rest.iter().position(|byte| !byte.is_ascii_digit()).unwrap_or(rest.len());
            let number = core::str::from_utf8(&rest[..end]).ok().and_then(|digits| digits.parse().ok());
            if let Some(index) = number.filter(|_| rest.get(end) == Some(&b'=')) {
                found.push(Parameter::Number(index));
            }
        }
    }
    found
}

impl StaticCheck<'_> {
    /// Notes what an expression has read.
    pub(super) fn take_reads(&mut self, seen: &Unknowns) {
        if seen.read.borrow().is_empty() && seen.asked.borrow().is_empty() {
            return;
        }
        let scope = self.scope();
        for parameter in &*seen.read.borrow() {
            let text = match parameter {
                Parameter::Number(index) => alloc::format!("#{index}").into_bytes(),
                Parameter::Name(name) => [b"#<", &**name, b">"].concat(),
            };
            let place = (self.place_of(&text), self.line.raw());
            let own = |(span, line): (Span, &[u8])| (span, line.to_vec());
            match parameter {
                Parameter::Number(index) if OWN.contains(index) => {
                    self.reads.numbers.entry(*index).or_insert_with(|| own(place));
                }
                Parameter::Number(_) => {}
                Parameter::Name(name) => {
                    self.reads.names.entry(owner(&scope, name)).or_insert_with(|| own(place));
                }
            }
        }
        for name in &*seen.asked.borrow() {
            self.reads.asked.insert(owner(&scope, name));
        }
    }

    /// The stretch where a parameter is read; the whole line where it is not written out.
    fn place_of(&self, text: &[u8]) -> Span {
        let code = self.line.code();
        let at = code.windows(text.len()).enumerate().find(|(at, window)| {
            let next = code.get(at + text.len());
            *window == text && next != Some(&b'=') && !next.is_some_and(u8::is_ascii_digit)
        });
        at.map_or_else(|| self.line.whole(), |(at, _)| self.line.code_span(at, at + text.len()))
    }

    /// Notes what the block just read sets; loops around it may end by that.
    pub(super) fn take_settings(&mut self) {
        let scope = self.scope();
        for i in 0..self.block.settings.len() {
            let target = match self.block.settings[i] {
                Setting::Number { index, .. } => Parameter::Number(index),
                Setting::Name { start, end, at, .. } => {
                    let name = self.line.code().get(start.into()..end.into()).unwrap_or_default();
                    if crate::interpreter::is_predefined(name) {
                        let span = self.block.setting_span(at);
                        self.add(ErrorKind::ParamReadonlyNamed, span, Severity::Error);
                        continue;
                    }
                    Parameter::Name(name.into())
                }
            };
            self.reads.set(&scope, &target);
            for open in &mut self.open {
                open.changes.insert(target.clone());
            }
        }
    }

    /// What is read and never set.
    pub(super) fn finish_names(&mut self, parameters: Option<&Parameters>) {
        let reads = core::mem::take(&mut self.reads);
        let severity = if self.calls_unknown { Severity::Warning } else { Severity::Error };
        for (key, (span, line)) in &reads.names {
            let (_, name) = key;
            let known = reads.names_set.contains(key)
                || reads.asked.contains(key)
                || name == b"n_args"
                || is_elsewhere(name)
                || crate::interpreter::is_predefined(name);
            if is_elsewhere(name) {
                self.add_line(ErrorKind::ParamElsewhere, *span, Severity::Warning, line);
            }
            if !known {
                self.add_line(ErrorKind::ParamNever, *span, severity, line);
            }
        }
        if !reads.any_number_set {
            for (index, (span, line)) in &reads.numbers {
                let given = parameters.is_some_and(|parameters| parameters.get(*index) != 0.0);
                if !reads.numbers_set.contains(index) && !given {
                    self.add_line(ErrorKind::ParamUnset { index: *index }, *span, Severity::Warning, line);
                }
            }
        }
        self.reads = reads;
    }
}
