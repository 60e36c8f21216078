//! `[configure]`: the configurations of a reconfigurable machine, in one file with the machine itself.
//!
//! Every table below `[configure]` is one choice; a configuration takes one option of each. Options are written as a list of
//! `KEY=VALUE` texts, as `--set` takes them, or as values or a range of one key:
//!
//! ```toml
//! [configure.drives]
//! option = [
//!     { name = "P", set = ["kinematics.gamma_deg=[0, 0]"] },
//!     { name = "S5", set = ["kinematics.gamma_deg=[-5, 5]"] },
//! ]
//! [configure.links]
//! key = "kinematics.l_mm.*"
//! values = [185, 195]
//! [configure.tool]
//! key = "kinematics.l_t_mm"
//! from = 40
//! to = 80
//! step = 20
//! ```

use crate::file::MachineFile;
use crate::source::Findings;
use crate::{Machine, load};
use pkm_canon::diagnostic::Diagnostic;
use pkm_kins::maths::floor;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;

/// The most configurations of a family.
pub const MOST_CONFIGURATIONS: usize = 10_000;

/// `[configure]` as written: choices by name.
pub type ConfigureFile = BTreeMap<String, Spanned<ChoiceFile>>;

/// One choice as written.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChoiceFile {
    /// Named options.
    pub option: Option<Vec<OptionFile>>,
    /// Or one key ...
    pub key: Option<String>,
    /// ... with these values,
    pub values: Option<Vec<toml::Value>>,
    /// or from here
    pub from: Option<f64>,
    /// to here, included
    pub to: Option<f64>,
    /// in steps of this.
    pub step: Option<f64>,
}

/// One named option as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OptionFile {
    /// What it is called.
    pub name: String,
    /// `KEY=VALUE`, as `--set` takes it.
    pub set: Vec<String>,
}

/// A reconfigurable machine with all its configurations.
#[derive(Debug, Clone)]
pub struct Family {
    file: String,
    text: String,
    overrides: Vec<String>,
    choices: Vec<Choice>,
}

#[derive(Debug, Clone)]
struct Choice {
    name: String,
    options: Vec<OptionFile>,
}

/// One configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Configuration {
    /// "drives P, links 195"
    pub name: String,
    /// What `--set` takes to make it of the family's file.
    pub set: Vec<String>,
}

impl Family {
    /// Reads a family by name or path, as [`Machine::load`] does.
    ///
    /// # Errors
    /// All findings; also a file without `[configure]`, and more than [`MOST_CONFIGURATIONS`].
    pub fn load(name_or_path: &str, overrides: &[String]) -> Result<Self, Vec<Diagnostic>> {
        Self::parse(name_or_path, &load::read(name_or_path)?, overrides)
    }

    /// The same from a text; `file` is its name in diagnostics.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(file: &str, text: &str, overrides: &[String]) -> Result<Self, Vec<Diagnostic>> {
        let written = MachineFile::parse(file, text, overrides)?;
        let mut findings = Findings::new(&written.source);
        let Some(tables) = &written.tables.configure else {
            let message = "the machine has no table [configure]: nothing to choose from".to_owned();
            findings.error("machine-configure", 0..0, message, "`pkm machines moma` shows a family");
            return Err(findings.into_list());
        };
        let mut choices = Vec::new();
        for (name, choice) in tables {
            match options(choice.get_ref()) {
                Ok(options) => choices.push(Choice { name: name.clone(), options }),
                Err(message) => {
                    let message = format!("configure.{name}: {message}");
                    findings.error("machine-configure", choice.span(), message, HELP);
                }
            }
        }
        let count = choices.iter().try_fold(1_usize, |n, choice| n.checked_mul(choice.options.len()));
        if count.is_none_or(|count| count > MOST_CONFIGURATIONS) {
            let message = format!("more than {MOST_CONFIGURATIONS} configurations");
            findings.error("machine-configure", 0..0, message, "take coarser steps or fewer choices");
        }
        if !findings.is_empty() {
            return Err(findings.into_list());
        }
        Ok(Self { file: file.to_owned(), text: text.to_owned(), overrides: overrides.to_vec(), choices })
    }

    /// How many configurations there are.
    pub fn count(&self) -> usize {
        self.choices.iter().map(|choice| choice.options.len()).product()
    }

    /// A configuration by number, from 0; the last choice changes fastest.
    pub fn configuration(&self, number: usize) -> Configuration {
        let mut rest = number;
        let mut names = Vec::new();
        let mut sets = Vec::new();
        for choice in self.choices.iter().rev() {
            let option = &choice.options[rest % choice.options.len()];
            rest /= choice.options.len();
            names.push(format!("{} {}", choice.name, option.name));
            sets.push(option.set.clone());
        }
        names.reverse();
        Configuration { name: names.join(", "), set: sets.into_iter().rev().flatten().collect() }
    }

    /// The machine of a configuration. What the caller overrode stays overridden.
    ///
    /// # Errors
    /// As [`Machine::parse`]: not every combination makes a machine.
    pub fn machine(&self, configuration: &Configuration) -> Result<Machine, Vec<Diagnostic>> {
        let all: Vec<String> = configuration.set.iter().chain(&self.overrides).cloned().collect();
        Machine::parse(&self.file, &self.text, &all)
    }
}

const HELP: &str = "write option = [{ name = \"P\", set = [\"KEY=VALUE\"] }], or key with values = [...], or key with from, to and step";

/// The options of a choice, or what is wrong with it.
fn options(choice: &ChoiceFile) -> Result<Vec<OptionFile>, String> {
    let assign =
        |key: &str, value: String| OptionFile { name: value.clone(), set: vec![format!("{key}={value}")] };
    let list = match choice {
        ChoiceFile { option: Some(list), key: None, values: None, from: None, to: None, step: None } => {
            list.clone()
        }
        ChoiceFile {
            option: None,
            key: Some(key),
            values: Some(values),
            from: None,
            to: None,
            step: None,
        } => {
            let option = |value: &toml::Value| {
                let written = assign(key, value.to_string());
                match value.as_str() {
                    Some(name) => OptionFile { name: name.to_owned(), ..written },
                    None => written,
                }
            };
            values.iter().map(option).collect()
        }
        ChoiceFile {
            option: None,
            key: Some(key),
            values: None,
            from: Some(from),
            to: Some(to),
            step: Some(step),
        } => {
            if !(from.is_finite() && to.is_finite() && *step > 0.0 && step.is_finite() && from <= to) {
                return Err(format!("from {from} to {to} in steps of {step} is no range"));
            }
            // A step that meets the end but for rounding includes it.
            let steps = floor((to - from) / step + 1e-9);
            if !(steps < MOST_CONFIGURATIONS as f64) {
                return Err(format!("more than {MOST_CONFIGURATIONS} steps"));
            }
            (0..=steps as u32).map(|k| assign(key, format!("{}", from + f64::from(k) * step))).collect()
        }
        _ => return Err("neither options, nor values of a key, nor a range of a key".to_owned()),
    };
    if list.is_empty() { Err("no option".to_owned()) } else { Ok(list) }
}
