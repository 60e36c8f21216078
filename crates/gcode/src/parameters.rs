//! Numbered and named parameters (RS274/NGC 3.2.1; LinuxCNC's named and predefined ones).

use crate::error::ErrorKind;
use crate::expression::LAST_PARAMETER;
#[cfg(feature = "alloc")]
use alloc::{boxed::Box, collections::BTreeMap, vec::Vec};

const COUNT: usize = LAST_PARAMETER as usize + 1;

/// First of the nine coordinates of the last probe trip.
pub(crate) const PROBE_POINT: i32 = 5061;
/// 1 if the probe tripped.
pub(crate) const PROBE_TRIPPED: i32 = 5070;
/// First of the nine G28 coordinates, machine units.
pub(crate) const G28_HOME: i32 = 5161;
/// First of the nine G30 coordinates, machine units.
pub(crate) const G30_HOME: i32 = 5181;
/// 1 while a G52 or G92 offset is applied.
pub(crate) const G92_APPLIED: i32 = 5210;
/// First of the nine G52/G92 offsets, machine units.
pub(crate) const G92_OFFSET: i32 = 5211;
/// Active coordinate system, 1 to 9.
pub(crate) const SYSTEM: i32 = 5220;
/// Result of M66.
pub(crate) const INPUT: i32 = 5399;

/// First of the nine offsets of coordinate system 1 to 9; the rotation follows them.
pub(crate) const fn system_offset(system: i32) -> i32 {
    5201 + 20 * system
}

/// Parameters with a meaning that only the interpreter may set.
pub(crate) const fn is_readonly(index: i32) -> bool {
    matches!(index, 5021..=5029 | 5081..=5089 | 5400..=5413 | 5420..=5428)
}

/// Parameters that the parameter file keeps.
#[cfg(feature = "alloc")]
pub(crate) const fn is_persistent(index: i32) -> bool {
    matches!(index, 5161..=5169 | 5181..=5189 | 5210..=5230)
        || (index >= 5241 && index <= 5390 && matches!((index - 5221) % 20, 0..=9))
}

/// Arguments of a sub: #1 to #30.
#[cfg(feature = "alloc")]
pub(crate) const ARGUMENTS: usize = 30;

/// Most different names of parameters (promise P5).
#[cfg(feature = "alloc")]
const MOST_NAMES: u32 = 100_000;

/// All parameters of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    numbered: [f64; COUNT],
    #[cfg(feature = "alloc")]
    named: Named,
}

/// Named parameters. A name is stored once, so that using it again allocates nothing.
#[cfg(feature = "alloc")]
#[derive(Debug, Clone, Default, PartialEq)]
struct Named {
    names: BTreeMap<Box<[u8]>, u32>,
    /// Names that begin with `_`.
    globals: BTreeMap<u32, f64>,
    /// Names of all open calls, the present one's last.
    locals: Vec<(u32, f64)>,
    /// Where the names of each call begin in `locals`; the main program's begin at 0.
    frames: Vec<usize>,
}

#[cfg(feature = "alloc")]
impl Named {
    fn present(&self) -> &[(u32, f64)] {
        &self.locals[self.frames.last().copied().unwrap_or(0)..]
    }

    fn get(&self, name: &[u8]) -> Option<f64> {
        let id = self.names.get(name)?;
        if name.first() == Some(&b'_') {
            return self.globals.get(id).copied();
        }
        self.present().iter().find(|(known, _)| known == id).map(|(_, value)| *value)
    }

    fn set(&mut self, name: &[u8], value: f64) -> Result<(), ErrorKind> {
        let id = match self.names.get(name) {
            Some(id) => *id,
            None => {
                let id = self.names.len() as u32;
                if id >= MOST_NAMES {
                    return Err(ErrorKind::ParamNames { limit: MOST_NAMES });
                }
                self.names.insert(name.into(), id);
                id
            }
        };
        if name.first() == Some(&b'_') {
            self.globals.insert(id, value);
            return Ok(());
        }
        let first = self.frames.last().copied().unwrap_or(0);
        match self.locals[first..].iter_mut().find(|(known, _)| *known == id) {
            Some(place) => place.1 = value,
            None => self.locals.push((id, value)),
        }
        Ok(())
    }
}

impl Default for Parameters {
    fn default() -> Self {
        let mut numbered = [0.0; COUNT];
        numbered[SYSTEM as usize] = 1.0;
        numbered[5599] = 1.0;
        Self {
            numbered,
            #[cfg(feature = "alloc")]
            named: Named::default(),
        }
    }
}

impl Parameters {
    /// `#index`; 0 outside 1 to 5601.
    pub fn get(&self, index: i32) -> f64 {
        usize::try_from(index).ok().and_then(|i| self.numbered.get(i)).copied().unwrap_or(0.0)
    }

    /// Sets `#index`, read-only ones too; nothing happens outside 1 to 5601.
    pub fn set(&mut self, index: i32, value: f64) {
        if let Some(place) = usize::try_from(index).ok().and_then(|i| self.numbered.get_mut(i)) {
            *place = value;
        }
    }

    /// Nine values in a row.
    pub(crate) fn nine(&self, first: i32) -> [f64; 9] {
        core::array::from_fn(|i| self.get(first + i as i32))
    }

    pub(crate) fn set_nine(&mut self, first: i32, values: &[f64; 9]) {
        for (i, value) in values.iter().enumerate() {
            self.set(first + i as i32, *value);
        }
    }

    /// `#<name>` as the program sees it: names that begin with `_` are global, others belong to the present sub.
    #[cfg(feature = "alloc")]
    pub fn named(&self, name: &[u8]) -> Option<f64> {
        self.named.get(name)
    }

    #[cfg(not(feature = "alloc"))]
    pub(crate) fn named(&self, _: &[u8]) -> Option<f64> {
        None
    }

    /// The named parameters that were ever set, by whatever sub.
    #[cfg(feature = "std")]
    pub(crate) fn names(&self) -> impl Iterator<Item = &[u8]> {
        self.named.names.keys().map(|name| &**name)
    }

    /// Sets or creates `#<name>`.
    #[cfg(feature = "alloc")]
    pub(crate) fn set_named(&mut self, name: &[u8], value: f64) -> Result<(), ErrorKind> {
        self.named.set(name, value)
    }

    #[cfg(not(feature = "alloc"))]
    pub(crate) fn set_named(&mut self, _: &[u8], _: f64) -> Result<(), ErrorKind> {
        Err(ErrorKind::ParamNoMemory)
    }
}

#[cfg(feature = "alloc")]
impl Parameters {
    /// #1 to #30.
    pub(crate) fn arguments(&self) -> [f64; ARGUMENTS] {
        core::array::from_fn(|i| self.numbered[i + 1])
    }

    pub(crate) fn set_arguments(&mut self, values: &[f64; ARGUMENTS]) {
        self.numbered[1..=ARGUMENTS].copy_from_slice(values);
    }

    /// A sub begins: its own names.
    pub(crate) fn enter(&mut self) {
        self.named.frames.push(self.named.locals.len());
    }

    /// A sub ends: its names are forgotten.
    pub(crate) fn leave(&mut self) {
        if let Some(first) = self.named.frames.pop() {
            self.named.locals.truncate(first);
        }
    }
}
