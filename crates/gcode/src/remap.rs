//! Remapped codes: `REMAP = M400 modalgroup=10 argspec=Pq ngc=probe` of LinuxCNC's INI file (dialect section 17). A sub of the
//! program's own language does what the code means; Python is refused by name.

use crate::block::Block;
use crate::modal::{GCode, GGroup, MGroup};
use crate::settings::{Dialect, Settings};
use alloc::{borrow::ToOwned, boxed::Box, format, string::String, vec::Vec};
use pkm_canon::Span;

/// The code that a sub is called for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Remapped {
    /// An M code and the group in which it is executed.
    M(i32, MGroup),
    /// A G code, times ten, of the motion group.
    G(GCode),
    /// T, S or F.
    Word(u8),
}

/// One remapped code.
#[derive(Debug, Clone, PartialEq)]
pub struct Remap {
    pub(crate) code: Remapped,
    /// The sub, as its label is written in a file of that name.
    pub(crate) sub: Box<str>,
    /// Which words the sub gets, in order: upper case = it must be there; `>` F and `^` S above 0, `N` the line.
    pub(crate) arguments: Box<str>,
}

/// Why a REMAP line is refused.
#[derive(Debug, Clone, PartialEq)]
pub struct RemapError {
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: &'static str,
}

impl Remapped {
    /// Where a block holds the code.
    pub(crate) fn place_in(self, block: &Block) -> Option<Span> {
        match self {
            Self::M(number, group) => (block.m(group) == Some(number)).then(|| block.m_span(group)),
            Self::G(number) => {
                (block.g(GGroup::Motion) == Some(number)).then(|| block.g_span(GGroup::Motion))
            }
            Self::Word(letter) => block.has(letter).then(|| block.word_span(letter)),
        }
    }
}

fn refuse<T>(message: String, help: &'static str) -> Result<T, RemapError> {
    Err(RemapError { message, help })
}

/// A line has no room for a longer label.
const LONGEST_NAME: usize = 240;

/// What stands before `=`.
const KEYS: [&str; 6] = ["modalgroup", "argspec", "prolog", "epilog", "ngc", "python"];

/// The built-in M codes that LinuxCNC lets a program remap.
const BUILT_IN: [i32; 15] = [0, 1, 6, 7, 8, 9, 60, 61, 62, 63, 64, 65, 66, 67, 68];

impl Remap {
    /// Reads what stands behind `REMAP =`.
    ///
    /// # Errors
    /// What LinuxCNC would refuse, or do something else with than it says; Python.
    pub fn parse(text: &str, settings: &Settings) -> Result<Self, RemapError> {
        let text = text.split('#').next().unwrap_or_default();
        let mut words = text.split_ascii_whitespace();
        let Some(code) = words.next() else {
            return refuse("nothing is remapped".to_owned(), "write CODE modalgroup=10 argspec=Pq ngc=NAME");
        };
        let (mut group, mut arguments, mut sub) = (None, "", None);
        for word in words {
            let Some((key, value)) = word.split_once('=').filter(|(_, value)| !value.is_empty()) else {
                return refuse(format!("'{word}' has no value"), "write modalgroup=10 argspec=Pq ngc=NAME");
            };
            // LinuxCNC takes the begin of a key for it.
            let key = key.to_ascii_lowercase();
            match KEYS.iter().find(|known| known.starts_with(&key)).copied().unwrap_or_default() {
                "modalgroup" => group = Some(value),
                "argspec" => arguments = value,
                "ngc" => sub = Some(value.strip_suffix(".ngc").unwrap_or(value)),
                "python" | "prolog" | "epilog" => {
                    let help = "there is no Python here: do it in the sub that ngc= names";
                    return refuse(format!("{word} needs Python"), help);
                }
                _ => {
                    let help = "there are modalgroup=, argspec= and ngc=";
                    return refuse(format!("'{key}=' is not known"), help);
                }
            }
        }
        if let Some(wrong) = arguments
            .chars()
            .find(|c| !(c.is_ascii_alphabetic() && !matches!(c, 'O' | 'o') || ">^@".contains(*c)))
        {
            return refuse(
                format!("argspec={arguments}: {wrong:?}"),
                "write letters of words, >, ^, N and @",
            );
        }
        let Some(sub) = sub else {
            return refuse(
                format!("{code} has no ngc="),
                "name the sub, which is in a file of that name: ngc=NAME",
            );
        };
        if sub.len() > LONGEST_NAME {
            return refuse(
                format!("the name of the sub is longer than {LONGEST_NAME} bytes"),
                "choose a shorter one",
            );
        }
        let code = code_of(code, group, settings)?;
        Ok(Self { code, sub: sub.to_ascii_lowercase().into(), arguments: arguments.into() })
    }

    /// The name of the sub, and of its file without `.ngc`.
    pub fn sub(&self) -> &str {
        &self.sub
    }

    /// True if both remap the same code.
    pub fn is_of_the_code_of(&self, other: &Self) -> bool {
        match (self.code, other.code) {
            (Remapped::M(a, _), Remapped::M(b, _)) => a == b,
            (a, b) => a == b,
        }
    }

    /// The names that its words have in the sub.
    #[cfg(feature = "std")]
    pub(crate) fn names(&self) -> impl Iterator<Item = u8> {
        self.arguments.bytes().filter_map(|c| match c {
            b'>' => Some(b'f'),
            b'^' => Some(b's'),
            _ => c.is_ascii_alphabetic().then(|| c.to_ascii_lowercase()),
        })
    }

    /// True if a word is handed to the sub.
    pub(crate) fn takes(&self, letter: u8) -> bool {
        self.arguments.bytes().any(|known| known.eq_ignore_ascii_case(&letter))
    }
}

fn code_of(code: &str, group: Option<&str>, settings: &Settings) -> Result<Remapped, RemapError> {
    let upper = code.to_ascii_uppercase();
    let free = "codes that are free can be remapped, and M0 M1 M6 to M9 M60 to M68 T S F";
    match upper.as_bytes() {
        [letter @ (b'T' | b'S' | b'F')] if group.is_none() => Ok(Remapped::Word(*letter)),
        [b'T' | b'S' | b'F'] => {
            refuse(format!("{code} with modalgroup="), "remove it: T, S and F have their own place")
        }
        [b'M', digits @ ..] => {
            let number = core::str::from_utf8(digits).ok().and_then(|digits| digits.parse::<i32>().ok());
            let Some(number) = number.filter(|number| (0..1000).contains(number)) else {
                return refuse(format!("{code} is no M code"), "M codes are whole numbers up to 999");
            };
            let own = MGroup::of(number);
            let group = match group {
                None => own.unwrap_or(MGroup::User),
                Some(text) => {
                    match text.parse::<usize>().ok().and_then(|n| MGroup::REMAPPED.get(n.wrapping_sub(4))) {
                        Some(group) => *group,
                        None => {
                            return refuse(
                                format!("modalgroup={text}"),
                                "M codes are executed in one of the groups 4 to 10",
                            );
                        }
                    }
                }
            };
            match own {
                Some(_) if !BUILT_IN.contains(&number) => refuse(format!("{code} cannot be remapped"), free),
                Some(own) if own != group => {
                    refuse(format!("{code} in another modal group than its own"), "leave modalgroup= out")
                }
                Some(MGroup::Coolant) if settings.dialect == Dialect::LinuxCnc29 => {
                    let help = "choose --dialect linuxcnc-2.10 or pkm";
                    refuse(format!("LinuxCNC 2.9 does not remap {code}"), help)
                }
                _ if settings.machine_codes.contains(number) => {
                    refuse(format!("{code} is a code of the machine's own"), "choose another number")
                }
                _ => Ok(Remapped::M(number, group)),
            }
        }
        [b'G', ..] => {
            if !matches!(group, None | Some("1")) {
                return refuse(
                    format!("modalgroup={}", group.unwrap_or_default()),
                    "G codes are executed in group 1",
                );
            }
            match tenths(&upper[1..]) {
                None => refuse(format!("{code} is no G code"), "G codes go up to 99.9, by tenths"),
                Some(code_number) if is_known(code_number, settings) => {
                    refuse(format!("{code} cannot be remapped"), free)
                }
                Some(code_number) => Ok(Remapped::G(code_number)),
            }
        }
        _ => refuse(format!("'{code}' is no code"), free),
    }
}

/// `88.1` as 881.
fn tenths(text: &str) -> Option<GCode> {
    let (whole, tenth) = text.split_once('.').unwrap_or((text, "0"));
    let whole: GCode = whole.parse().ok().filter(|whole| (0..100).contains(whole))?;
    let tenth: GCode = tenth.parse().ok().filter(|tenth| (0..10).contains(tenth))?;
    Some(whole * 10 + tenth)
}

fn is_known(code: GCode, settings: &Settings) -> bool {
    let newer = matches!(code, 60..=63);
    GGroup::of(code).is_some_and(|_| !newer || settings.is_newer())
}

/// All remapped codes of a machine.
#[derive(Debug, Clone, Default)]
pub(crate) struct Remaps(Vec<Remap>);

impl Remaps {
    /// These; of one code the first.
    #[cfg(feature = "std")]
    pub(crate) fn of(list: &[Remap]) -> Self {
        let mut remaps = Self::default();
        for remap in list {
            remaps.add(remap.clone());
        }
        remaps
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds one; false if its code is there already.
    pub(crate) fn add(&mut self, remap: Remap) -> bool {
        let known = self.0.iter().any(|known| known.is_of_the_code_of(&remap));
        if !known {
            self.0.push(remap);
        }
        !known
    }

    pub(crate) fn get(&self, index: usize) -> Option<&Remap> {
        self.0.get(index)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, &Remap)> {
        self.0.iter().enumerate()
    }

    /// The group of a free M code.
    pub(crate) fn m_group(&self, number: i32) -> Option<MGroup> {
        self.0.iter().find_map(|remap| match remap.code {
            Remapped::M(code, group) if code == number => Some(group),
            _ => None,
        })
    }

    /// True for a free G code.
    pub(crate) fn has_g(&self, code: GCode) -> bool {
        self.0.iter().any(|remap| remap.code == Remapped::G(code))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_remapped_is_refused_by_name() {
        let settings = Settings::default();
        for good in [
            "M400 ngc=a",
            "g88.1 modalgroup=1 argspec=XYzp ngc=a.ngc",
            "T ngc=a # t",
            "M6 ngc=a",
            "M7 modalgroup=8 ngc=a",
        ] {
            assert!(Remap::parse(good, &settings).is_ok(), "{good}");
        }
        for (bad, said) in [
            ("M400 python=f", "python=f needs Python"),
            ("M400 py=f", "py=f needs Python"),
            ("M400 ngc=a prolog=p", "prolog=p needs Python"),
            ("M400 ngc=a epilog=e", "epilog=e needs Python"),
            ("", "nothing is remapped"),
            ("M400", "M400 has no ngc="),
            ("M400 ngc", "'ngc' has no value"),
            ("M400 ngc=a foo=1", "'foo=' is not known"),
            ("M400 ngc=a argspec=P-", "argspec=P-: '-'"),
            ("M400 ngc=a modalgroup=3", "modalgroup=3"),
            ("M400 ngc=a modalgroup=11", "modalgroup=11"),
            ("M3 ngc=a", "M3 cannot be remapped"),
            ("M100 ngc=a", "M100 cannot be remapped"),
            ("M2 ngc=a", "M2 cannot be remapped"),
            ("M6 modalgroup=10 ngc=a", "M6 in another modal group than its own"),
            ("M1000 ngc=a", "M1000 is no M code"),
            ("G1 ngc=a", "G1 cannot be remapped"),
            ("G88.25 ngc=a", "G88.25 is no G code"),
            ("G88.1 modalgroup=2 ngc=a", "modalgroup=2"),
            ("F modalgroup=3 ngc=a", "F with modalgroup="),
            ("X ngc=a", "'X' is no code"),
        ] {
            assert_eq!(Remap::parse(bad, &settings).unwrap_err().message, said);
        }
        let older = Settings { dialect: Dialect::LinuxCnc29, ..settings };
        assert!(Remap::parse("M7 ngc=a", &older).is_err());
    }
}
