//! A block: the words of one line, read and checked but not yet executed.

use crate::error::{Code, Error, ErrorKind};
use crate::expression::{self, Reference, Scope, Tolerance, UNKNOWN};
use crate::lexer::{self, Fault, Rest, fault, fault_here, into_fault};
use crate::line::Line;
use crate::modal::*;
use crate::settings::MachineCodes;
use heapless::Vec;
use pkm_canon::{FileId, Span};
use pkm_kins::{Axis, AxisSet};

/// Number of words: the letters, `$`, `@`, `^`.
const WORDS: usize = 29;
/// Most M words in a block.
const MAX_M: u8 = 4;
/// Most parameter settings in a block; a line has room for fewer.
const MAX_SETTINGS: usize = 64;
/// Most comments in a block; a line has room for fewer.
const MAX_COMMENTS: usize = 128;

/// Place of a word: by letter, then `$ @ ^`.
#[inline]
const fn place(letter: u8) -> usize {
    match letter {
        b'B'..=b'Z' => (letter - b'A') as usize,
        b'$' => 26,
        b'@' => 27,
        b'^' => 28,
        _ => 0,
    }
}

/// A stretch of the raw line.
type Stretch = (u8, u8);

/// `#1=2` or `#<a>=2`, to be stored after the whole block was read.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Setting {
    Number {
        index: i32,
        value: f64,
    },
    /// The name as a stretch of [`Line::code`].
    Name {
        start: u8,
        end: u8,
        value: f64,
        at: Stretch,
    },
}

/// One block.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    words: [f64; WORDS],
    present: u32,
    stretches: [Stretch; WORDS],
    g: [GCode; G_GROUPS],
    g_stretches: [Stretch; G_GROUPS],
    m: [i16; M_GROUPS],
    m_stretches: [Stretch; M_GROUPS],
    m_count: u8,
    /// S is executed by a part of the block that follows (remapped codes).
    pub(crate) speed_follows: bool,
    pub(crate) settings: Vec<Setting, MAX_SETTINGS>,
    /// Stretches of [`Line::code`] between the parentheses.
    pub(crate) comments: Vec<Stretch, MAX_COMMENTS>,
    /// The group-1 code in force for this block.
    pub(crate) motion: Option<GCode>,
    file: FileId,
    line: u32,
    whole: Span,
}

impl Block {
    pub(crate) const fn new() -> Self {
        Self {
            words: [0.0; WORDS],
            present: 0,
            stretches: [(0, 0); WORDS],
            g: [-1; G_GROUPS],
            g_stretches: [(0, 0); G_GROUPS],
            m: [-1; M_GROUPS],
            m_stretches: [(0, 0); M_GROUPS],
            m_count: 0,
            speed_follows: false,
            settings: Vec::new(),
            comments: Vec::new(),
            motion: None,
            file: FileId(0),
            line: 0,
            whole: Span::new(FileId(0), 0, 0, 0),
        }
    }

    fn clear(&mut self, line: &Line) {
        self.present = 0;
        self.g = [-1; G_GROUPS];
        self.m = [-1; M_GROUPS];
        self.m_count = 0;
        self.speed_follows = false;
        self.settings.clear();
        self.comments.clear();
        self.motion = None;
        (self.file, self.line) = (line.file, line.number);
        self.whole = line.code_span(0, line.code().len());
    }

    pub(crate) fn has(&self, letter: u8) -> bool {
        self.present & (1 << place(letter)) != 0
    }

    /// The value of a word, if it is there.
    pub(crate) fn get(&self, letter: u8) -> Option<f64> {
        self.has(letter).then(|| self.words[place(letter)])
    }

    /// The value of an axis word.
    pub(crate) fn axis(&self, axis: usize) -> Option<f64> {
        self.get(AXIS_LETTERS[axis])
    }

    /// This block without its settings, comments and codes; errors still find its motion code.
    #[cfg(feature = "alloc")]
    pub(crate) fn bare(&self) -> Self {
        let mut block = Self::new();
        (block.words, block.present, block.stretches) = (self.words, self.present, self.stretches);
        block.g[GGroup::Motion as usize] = self.g[GGroup::Motion as usize];
        block.g_stretches = self.g_stretches;
        (block.file, block.line, block.whole) = (self.file, self.line, self.whole);
        block
    }

    /// Keeps what is executed in some steps (dialect section 7), from the first to before the last. In inverse time F belongs to the motion.
    #[cfg(feature = "alloc")]
    pub(crate) fn keep_steps(&mut self, from: u8, until: u8, inverse_time: bool) {
        let kept = |step: u8| (from..until).contains(&step);
        for group in GGroup::ALL {
            let dwells = group == GGroup::NonModal && self.g(group) == Some(G4);
            if !kept(if dwells { 13 } else { group.step() }) {
                self.g[group as usize] = -1;
            }
        }
        for group in MGroup::REMAPPED {
            if !kept(group.step()) {
                self.m[group as usize] = -1;
            }
        }
        self.speed_follows = kept(2) && !kept(5) && self.has(b'S');
        for (letter, step) in [(b'F', 4), (b'S', 5), (b'T', 6)] {
            if !(kept(step) || letter == b'F' && inverse_time && kept(26)) {
                self.set(letter, None);
            }
        }
        if !kept(1) {
            self.comments.clear();
        }
        if !kept(26) {
            self.motion = None;
        }
    }

    /// Takes over the values of the words that another block has too.
    #[cfg(feature = "alloc")]
    pub(crate) fn take_words(&mut self, other: &Self) {
        for (place, value) in self.words.iter_mut().enumerate() {
            if other.present & (1 << place) != 0 {
                *value = other.words[place];
            }
        }
    }

    /// Sets a word or takes it away; where it stands is where it stood.
    #[cfg(feature = "alloc")]
    pub(crate) fn set(&mut self, letter: u8, value: Option<f64>) {
        let bit = 1 << place(letter);
        self.present = if value.is_some() { self.present | bit } else { self.present & !bit };
        self.words[place(letter)] = value.unwrap_or(0.0);
    }

    /// Rescales a word that is there (G7, G8 and units on the switching block).
    pub(crate) fn scale(&mut self, letter: u8, factor: f64) {
        self.words[place(letter)] *= factor;
    }

    pub(crate) fn has_any(&self, letters: &[u8]) -> bool {
        letters.iter().any(|&letter| self.has(letter))
    }

    /// True if one of X to W is there.
    pub(crate) fn has_axis(&self) -> bool {
        self.has_any(&AXIS_LETTERS)
    }

    pub(crate) fn has_polar(&self) -> bool {
        self.has(b'@') || self.has(b'^')
    }

    /// The code of a group.
    pub(crate) fn g(&self, group: GGroup) -> Option<GCode> {
        let code = self.g[group as usize];
        (code >= 0).then_some(code)
    }

    /// The code of a group.
    pub(crate) fn m(&self, group: MGroup) -> Option<i32> {
        let number = self.m[group as usize];
        (number >= 0).then_some(number.into())
    }

    /// True if the block holds an M code at all.
    pub(crate) fn has_m(&self, number: i32) -> bool {
        MGroup::of(number).is_some_and(|group| self.m(group) == Some(number))
    }

    /// True if the block waits for time, a person or an input.
    pub(crate) fn has_pause(&self) -> bool {
        self.g(GGroup::NonModal) == Some(G4)
            || self.m(MGroup::Stop).is_some()
            || self.m(MGroup::Tool).is_some()
            || self.has_m(66)
    }

    /// The whole block.
    pub(crate) fn span(&self) -> Span {
        self.whole
    }

    fn stretch(&self, (start, end): Stretch) -> Span {
        Span::new(self.file, self.line, start.into(), end.into())
    }

    /// The word of a letter; the whole block if it is not there.
    pub(crate) fn word_span(&self, letter: u8) -> Span {
        if self.has(letter) { self.stretch(self.stretches[place(letter)]) } else { self.whole }
    }

    /// The G word of a group; the whole block if it is not there.
    pub(crate) fn g_span(&self, group: GGroup) -> Span {
        if self.g(group).is_some() { self.stretch(self.g_stretches[group as usize]) } else { self.whole }
    }

    /// The M word of a group; the whole block if it is not there.
    pub(crate) fn m_span(&self, group: MGroup) -> Span {
        if self.m(group).is_some() { self.stretch(self.m_stretches[group as usize]) } else { self.whole }
    }

    /// An error that underlines a word.
    pub(crate) fn word_error(&self, letter: u8, kind: ErrorKind) -> Error {
        Error { kind, span: self.word_span(letter) }
    }

    /// An error that underlines the motion code, or the whole block where it is implied.
    pub(crate) fn motion_error(&self, kind: ErrorKind) -> Error {
        self.g_error(GGroup::Motion, kind)
    }

    /// An error that underlines the G word of a group.
    pub(crate) fn g_error(&self, group: GGroup, kind: ErrorKind) -> Error {
        Error { kind, span: self.g_span(group) }
    }

    /// An error that underlines the M word of a group.
    pub(crate) fn m_error(&self, group: MGroup, kind: ErrorKind) -> Error {
        Error { kind, span: self.m_span(group) }
    }

    /// Reads the words of a prepared line from byte `start` on.
    pub(crate) fn read(
        &mut self,
        line: &Line,
        start: usize,
        scope: &impl Scope,
        reader: &Reader<'_>,
    ) -> Result<(), Error> {
        self.clear(line);
        let code = line.code();
        let mut rest = &code[start.min(code.len())..];
        while let Some(&letter) = rest.first() {
            rest = self
                .item(line, letter, rest, scope, reader)
                .map_err(|error| fault_error(line, into_fault(error)))?;
        }
        Ok(())
    }

    /// Reads what can be read of a line that is wrong: a word at fault is passed over. `lost` gets the prepared text from
    /// the begin of each parameter setting that cannot be read.
    #[cfg(feature = "alloc")]
    pub(crate) fn salvage(
        &mut self,
        line: &Line,
        start: usize,
        scope: &impl Scope,
        reader: &Reader<'_>,
        mut lost: impl FnMut(&[u8]),
    ) {
        self.clear(line);
        let code = line.code();
        let mut rest = &code[start.min(code.len())..];
        while let Some(&letter) = rest.first() {
            if let Ok(after) = self.item(line, letter, rest, scope, reader) {
                rest = after;
                continue;
            }
            if letter == b'#' {
                lost(rest);
            }
            let mut depth = 0_u32;
            let word = |byte: &u8| {
                match byte {
                    b'[' => depth += 1,
                    b']' => depth = depth.saturating_sub(1),
                    _ => {}
                }
                depth == 0 && (byte.is_ascii_lowercase() || *byte == b'(')
            };
            rest = rest[1..].iter().position(word).map_or(&[], |at| &rest[1 + at..]);
        }
    }

    /// One word, parameter setting or comment.
    fn item<'a>(
        &mut self,
        line: &Line,
        letter: u8,
        input: Rest<'a>,
        scope: &impl Scope,
        reader: &Reader<'_>,
    ) -> Result<Rest<'a>, nom::Err<Fault>> {
        let offset = |rest: Rest<'_>| line.code().len() - rest.len();
        match letter {
            b'(' => {
                let (rest, text) = lexer::comment(input)?;
                let begin = offset(input) + 1;
                let _ = self.comments.push((begin as u8, (begin + text.len()) as u8));
                return Ok(rest);
            }
            b'#' => return self.setting(line, input, scope),
            _ => {}
        }
        let after = &input[1..];
        let scope = &Created { scope, line, settings: &self.settings, name: None };
        let upper = letter.to_ascii_uppercase();
        match letter {
            b'g' => {
                let (rest, value) = expression::value(after, scope)?;
                if value.is_nan() {
                    return Ok(rest); // only a run can tell
                }
                let code = g_code(value).map_err(|kind| fault(kind, input, rest))?;
                self.add_g(line, code, reader, input, rest)?;
                Ok(rest)
            }
            b'm' => {
                let (rest, number) = expression::integer(after, scope)?;
                if number == UNKNOWN {
                    return Ok(rest);
                }
                let group = reader.m_group(number);
                let group = group.ok_or_else(|| fault(ErrorKind::MUnknown { number }, input, rest))?;
                let both =
                    reader.both_coolants && matches!((self.m(group), number), (Some(7), 8) | (Some(8), 7));
                if both {
                    self.m[group as usize] = MIST_AND_FLOOD;
                    self.count_m(input, rest)?;
                } else {
                    self.add_m(line, number, group, input, rest)?;
                }
                Ok(rest)
            }
            b'n' | b'o' => Err(fault_here(ErrorKind::BadLetter { letter: upper.into() }, input)),
            b'a'..=b'z' | b'$' | b'@' | b'^' => {
                if let Some(axis) = AXIS_LETTERS.iter().position(|&l| l == upper)
                    && !reader.axes.contains(Axis::ALL[axis])
                    && !(matches!(letter, b'u' | b'w') && matches!(self.g(GGroup::Motion), Some(700..=722)))
                {
                    return Err(fault_here(ErrorKind::AxisUnavailable { letter: upper.into() }, input));
                }
                if self.has(upper) {
                    return Err(fault_here(ErrorKind::WordRepeated { letter: upper.into() }, input));
                }
                let (rest, value) = match letter {
                    b'h' | b'l' | b't' | b'$' => {
                        let (rest, value) = expression::integer(after, scope)?;
                        (rest, if value == UNKNOWN { f64::NAN } else { value.into() })
                    }
                    _ => expression::value(after, scope)?,
                };
                let value = reader.check(upper, value).map_err(|kind| fault(kind, input, rest))?;
                self.present |= 1 << place(upper);
                self.words[place(upper)] = value;
                self.stretches[place(upper)] = stretch(line, input, rest);
                Ok(rest)
            }
            33..=126 => Err(fault_here(ErrorKind::BadLetter { letter: letter.into() }, input)),
            byte => Err(fault_here(ErrorKind::BadChar { byte }, input)),
        }
    }

    fn setting<'a>(
        &mut self,
        line: &Line,
        input: Rest<'a>,
        scope: &impl Scope,
    ) -> Result<Rest<'a>, nom::Err<Fault>> {
        let (rest, reference) = expression::reference(input, scope, 0)?;
        let target_end = rest;
        let (rest, ()) =
            lexer::byte(b'=')(rest).map_err(|_| fault(ErrorKind::EqualMissing, input, target_end))?;
        let name = match reference {
            Reference::Name(name) => Some(name),
            Reference::Number(_) => None,
        };
        let (rest, value) =
            expression::value(rest, &Created { scope, line, settings: &self.settings, name })?;
        let setting = match reference {
            Reference::Number(index) if crate::parameters::is_readonly(index) => {
                return Err(fault(ErrorKind::ParamReadonly { index }, input, target_end));
            }
            Reference::Number(index) => Setting::Number { index, value },
            Reference::Name(name) => {
                let end = line.code().len() - target_end.len() - 1;
                Setting::Name {
                    start: (end - name.len()) as u8,
                    end: end as u8,
                    value,
                    at: stretch(line, input, target_end),
                }
            }
        };
        let limit = MAX_SETTINGS as u8;
        self.settings
            .push(setting)
            .map_err(|_| fault(ErrorKind::TooManySettings { limit }, input, target_end))?;
        Ok(rest)
    }

    fn add_g(
        &mut self,
        line: &Line,
        code: GCode,
        reader: &Reader<'_>,
        from: Rest<'_>,
        to: Rest<'_>,
    ) -> Result<(), nom::Err<Fault>> {
        let group = GGroup::of(code).filter(|_| reader.newer || !matches!(code, G6..=G6_2));
        #[cfg(feature = "alloc")]
        let group = group.or_else(|| reader.remaps.has_g(code).then_some(GGroup::Motion));
        let group = group.ok_or_else(|| {
            let kind = match code {
                // LinuxCNC 2.10's second form of NURBS; it reserves G6.3.
                60..=63 => ErrorKind::GUnsupported { code: Code(code) },
                _ => ErrorKind::GUnknown { code: Code(code) },
            };
            fault(kind, from, to)
        })?;
        let slot = &mut self.g[group as usize];
        // G80 may share a block with another motion code and loses.
        if *slot >= 0 && code == G80 {
            return Ok(());
        }
        if *slot >= 0 && *slot != G80 {
            let kind = ErrorKind::ModalClashG { first: Code(*slot), second: Code(code), group: group.name() };
            return Err(fault(kind, from, to));
        }
        *slot = code;
        self.g_stretches[group as usize] = stretch(line, from, to);
        Ok(())
    }

    fn add_m(
        &mut self,
        line: &Line,
        number: i32,
        group: MGroup,
        from: Rest<'_>,
        to: Rest<'_>,
    ) -> Result<(), nom::Err<Fault>> {
        let slot = &mut self.m[group as usize];
        if *slot >= 0 {
            let first = if *slot == MIST_AND_FLOOD { 7 } else { (*slot).into() };
            let kind = ErrorKind::ModalClashM { first, second: number, group: group.name() };
            return Err(fault(kind, from, to));
        }
        *slot = number as i16;
        self.m_stretches[group as usize] = stretch(line, from, to);
        self.count_m(from, to)
    }

    fn count_m(&mut self, from: Rest<'_>, to: Rest<'_>) -> Result<(), nom::Err<Fault>> {
        self.m_count += 1;
        if self.m_count > MAX_M {
            return Err(fault(ErrorKind::MTooMany { limit: MAX_M }, from, to));
        }
        Ok(())
    }

    /// The span of a parameter setting's target.
    pub(crate) fn setting_span(&self, at: Stretch) -> Span {
        self.stretch(at)
    }
}

/// What expressions see: in LinuxCNC a name on the left of a setting exists from there on, with value 0, so that
/// `#<n>=[#<n>+1]` needs no first value (checked with rs274 2.9). pkm's own dialect refuses that.
struct Created<'a, S> {
    scope: &'a S,
    line: &'a Line,
    settings: &'a [Setting],
    name: Option<&'a [u8]>,
}

impl<S: Scope> Created<'_, S> {
    fn is_created(&self, name: &[u8]) -> bool {
        let is_set = |setting: &Setting| match *setting {
            Setting::Name { start, end, .. } => {
                self.line.code().get(start.into()..end.into()).is_some_and(|set| set == name)
            }
            Setting::Number { .. } => false,
        };
        !self.scope.strict() && (self.name == Some(name) || self.settings.iter().any(is_set))
    }
}

impl<S: Scope> Scope for Created<'_, S> {
    fn numbered(&self, index: i32) -> Result<f64, ErrorKind> {
        self.scope.numbered(index)
    }

    fn named(&self, name: &[u8]) -> Option<f64> {
        self.scope.named(name).or_else(|| self.is_created(name).then_some(0.0))
    }

    fn tolerance(&self) -> Tolerance {
        self.scope.tolerance()
    }

    fn strict(&self) -> bool {
        self.scope.strict()
    }

    fn exists(&self, name: &[u8]) -> bool {
        self.scope.exists(name) || self.is_created(name)
    }

    fn is_static(&self) -> bool {
        self.scope.is_static()
    }
}

/// The axis letters in order.
pub(crate) const AXIS_LETTERS: [u8; 9] = *b"XYZABCUVW";

/// What reading a block depends on besides parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reader<'a> {
    /// Codes that a sub stands for.
    #[cfg(feature = "alloc")]
    pub(crate) remaps: &'a crate::remap::Remaps,
    #[cfg(not(feature = "alloc"))]
    pub(crate) remaps: core::marker::PhantomData<&'a ()>,
    pub(crate) axes: AxisSet,
    /// X words are diameters (G7).
    pub(crate) diameter: bool,
    pub(crate) spindles: u8,
    pub(crate) machine_codes: MachineCodes,
    /// LinuxCNC 2.10's codes are known.
    pub(crate) newer: bool,
    /// M7 and M8 may share a block (pkm).
    pub(crate) both_coolants: bool,
    /// The largest number of an axis word (promise P5).
    pub(crate) largest: f64,
}

impl Reader<'_> {
    /// The modal group of an M code; the machine's own are user codes.
    fn m_group(&self, number: i32) -> Option<MGroup> {
        if self.machine_codes.contains(number) {
            return Some(MGroup::User);
        }
        let group = MGroup::of(number);
        #[cfg(feature = "alloc")]
        let group = group.or_else(|| self.remaps.m_group(number));
        group
    }

    /// Range checks that hold for a letter wherever it is used.
    fn check(&self, letter: u8, value: f64) -> Result<f64, ErrorKind> {
        match letter {
            b'F' if value < 0.0 => Err(ErrorKind::NegativeF { value }),
            b'S' if value < 0.0 => Err(ErrorKind::NegativeS { value }),
            b'$' if value < -1.0 || value >= self.spindles.into() => {
                Err(ErrorKind::SpindleNumber { value, last: self.spindles.saturating_sub(1) })
            }
            b'L' if value < 0.0 => Err(ErrorKind::NegativeWord { letter: letter.into(), value }),
            b'H' if value < -1.0 => Err(ErrorKind::NegativeWord { letter: letter.into(), value }),
            _ if value.abs() > self.largest && AXIS_LETTERS.contains(&letter) => {
                Err(ErrorKind::NumberTooLarge { value, limit: self.largest })
            }
            b'X' if self.diameter => Ok(value / 2.0),
            _ => Ok(value),
        }
    }
}

/// A G word's value as code: within 0.001 of a tenth.
fn g_code(value: f64) -> Result<GCode, ErrorKind> {
    let tenths = value * 10.0;
    let mut code = pkm_kins::maths::floor(tenths);
    let rest = tenths - code;
    if rest > 0.999 {
        code += 1.0;
    } else if rest > 0.001 {
        return Err(ErrorKind::GRange { value });
    }
    if (0.0..=999.0).contains(&code) { Ok(code as GCode) } else { Err(ErrorKind::GRange { value }) }
}

fn stretch(line: &Line, from: Rest<'_>, to: Rest<'_>) -> Stretch {
    let length = line.code().len();
    let span = line.code_span(length - from.len(), length - to.len());
    (span.start as u8, span.end as u8)
}

/// The error of a fault in a prepared line.
pub(crate) fn fault_error(line: &Line, fault: Fault) -> Error {
    let length = line.code().len();
    let (start, end) = (length.saturating_sub(fault.begin), length.saturating_sub(fault.end));
    Error { kind: fault.kind, span: line.code_span(start, end) }
}
