//! Subs that give a lathe cycle its profile: A and C are corners there, U and W increments, whatever axes the machine has.
//! Which subs those are is known at the end only: a cycle names its sub behind it.

use super::{Finding, MOST_FINDINGS, Name, StaticCheck};
use crate::error::{Error, ErrorKind};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;
use pkm_canon::Span;
use pkm_canon::diagnostic::Severity;
use pkm_kins::{Axis, AxisSet};

/// The letters, and the axes they are elsewhere.
const WORDS: [(u8, Axis); 4] = [(b'A', Axis::A), (b'C', Axis::C), (b'U', Axis::U), (b'W', Axis::W)];

/// What was seen of profiles.
#[derive(Default)]
pub(super) struct Profiles {
    /// Subs that a cycle names.
    subs: BTreeSet<Name>,
    /// A cycle names its sub by a number that only a run knows.
    unknown: bool,
    /// Words of axes that the machine does not have: wrong, unless their sub is a profile's.
    words: Vec<(Name, Finding)>,
}

impl StaticCheck<'_> {
    /// The axes whose words may be right where the line stands.
    pub(super) fn axes_here(&self) -> AxisSet {
        match self.sub {
            Some(_) => WORDS.iter().fold(self.settings.axes, |axes, (_, axis)| axes.with(*axis)),
            None => self.settings.axes,
        }
    }

    /// Remembers the block's words that are right in a profile only.
    pub(super) fn take_profile_words(&mut self) {
        let Some((sub, ..)) = &self.sub else { return };
        for (letter, axis) in WORDS {
            if !self.block.has(letter)
                || self.settings.axes.contains(axis)
                || self.profiles.words.len() >= MOST_FINDINGS
            {
                continue;
            }
            // The letter alone, as in a run.
            let word = self.block.word_span(letter);
            let error = Error {
                kind: ErrorKind::AxisUnavailable { letter: letter.into() },
                span: Span { end: word.start + 1, ..word },
            };
            let line = self.line.raw().to_vec();
            let finding = Finding { error, severity: Severity::Error, line, other: None };
            self.profiles.words.push((sub.clone(), finding));
        }
    }

    /// A cycle takes its profile from a sub; `None` = only a run knows from which.
    pub(super) fn takes_profile(&mut self, sub: Option<&Name>) {
        match sub {
            Some(sub) => drop(self.profiles.subs.insert(sub.clone())),
            None => self.profiles.unknown = true,
        }
    }

    /// At the end of the program: the words in subs that belong to no profile are wrong.
    pub(super) fn finish_profiles(&mut self) {
        let Profiles { subs, unknown, words } = core::mem::take(&mut self.profiles);
        if unknown || words.is_empty() {
            return;
        }
        let of_profiles: BTreeSet<Name> = self.reached_from(subs.iter()).into_iter().cloned().collect();
        let wrong = words.into_iter().filter(|(sub, _)| !of_profiles.contains(sub));
        self.findings.extend(wrong.map(|(_, finding)| finding));
    }

    /// These subs and all they call, directly or not; the main program is the empty name.
    pub(super) fn reached_from<'a>(&'a self, from: impl Iterator<Item = &'a Name>) -> BTreeSet<&'a Name> {
        let mut callees: BTreeMap<&Name, Vec<&Name>> = BTreeMap::new();
        for (label, (.., callers)) in &self.calls {
            callers.iter().for_each(|caller| callees.entry(caller).or_default().push(label));
        }
        let mut reached: BTreeSet<&Name> = from.collect();
        let mut waiting: Vec<&Name> = reached.iter().copied().collect();
        while let Some(caller) = waiting.pop() {
            let called = callees.get(caller).into_iter().flatten().copied();
            waiting.extend(called.filter(|label| reached.insert(label)));
        }
        reached
    }
}
