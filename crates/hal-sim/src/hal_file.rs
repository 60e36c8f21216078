//! HAL files: the commands of LinuxCNC's `halcmd`, as far as the simulated components go.
//!
//! | command                                  | meaning                                                     |
//! |------------------------------------------|-------------------------------------------------------------|
//! | `loadrt MODULE [OPTION=VALUE ...]`       | loads a component; see [`MODULES`]                          |
//! | `addf FUNCTION THREAD`                   | appends a function to a thread                              |
//! | `net SIGNAL PIN ...`                     | links pins to a signal; arrows `=>` `<=` `<=>` are decoration |
//! | `newsig SIGNAL TYPE`                     | a signal (bit, float, s32, u32)                             |
//! | `linkps PIN SIGNAL`, `linksp SIGNAL PIN` | links one pin                                               |
//! | `linkpp PIN PIN`                         | links two pins by a signal named as the first               |
//! | `unlinkp PIN`                            | takes a pin off its signal                                  |
//! | `setp NAME VALUE`, `sets SIGNAL VALUE`   | sets a parameter, a free input pin, a signal without writer |
//! | `getp NAME`, `gets SIGNAL`               | prints a value                                              |
//! | `ptype NAME`                             | prints a type                                               |
//! | `show [WHAT [PATTERN]]`                  | comp, pin, param, sig, funct, thread, all; names that begin with the pattern |
//! | `start`, `stop`                          | lets the threads run, or not                                |
//!
//! `#` begins a comment, `\` at the end of a line joins the next, names of pins may be written in capitals (`pid.0.Pgain`).
//! What is not known is an error with its line and column. INI values (`[SECTION]NAME`) and `source` are not supported.

use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::modules::{self, LoadError};
use crate::values::{PinType, Value};
use std::fmt;
use std::fmt::Write as _;

pub use crate::modules::MODULES;

/// A HAL that is being set up by commands.
#[derive(Clone)]
pub struct Session {
    hal: Hal,
    running: bool,
}

/// What is wrong with a command.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Problem {
    /// No such command.
    UnknownCommand(String),
    /// The command has other words: how it is written.
    Usage(&'static str),
    /// A word is too much.
    Surplus(String),
    /// No value of the type.
    BadValue {
        /// As written.
        text: String,
        /// What it should be.
        expected: PinType,
    },
    /// No such type.
    UnknownType(String),
    /// A quote that does not end.
    OpenQuote,
    /// An INI value.
    IniValue(String),
    /// The HAL refuses.
    Hal(HalError),
    /// A component cannot be loaded.
    Load(LoadError),
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownCommand(word) => write!(f, "there is no command '{word}'"),
            Self::Usage(usage) => write!(f, "the command is written: {usage}"),
            Self::Surplus(word) => write!(f, "'{word}' is too much here"),
            Self::BadValue { text, expected } => write!(f, "'{text}' is no value of type {expected}"),
            Self::UnknownType(word) => write!(f, "'{word}' is no type; types are bit, float, s32, u32"),
            Self::OpenQuote => write!(f, "a quote does not end on this line"),
            Self::IniValue(word) => {
                write!(f, "'{word}': values of an INI file are not supported; write the value")
            }
            Self::Hal(error) => error.fmt(f),
            Self::Load(error) => error.fmt(f),
        }
    }
}

impl From<HalError> for Problem {
    fn from(error: HalError) -> Self {
        Self::Hal(error)
    }
}

/// A problem and its place.
#[derive(Debug, Clone, PartialEq)]
pub struct FileError {
    /// Counted from 1.
    pub line: u32,
    /// First column, counted from 1 in bytes.
    pub column: u32,
    /// One past the last column.
    pub end_column: u32,
    /// What is wrong.
    pub problem: Problem,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, column {}: {}", self.line, self.column, self.problem)
    }
}

impl std::error::Error for FileError {}

/// A word of a command with its place.
#[derive(Debug, Clone, Copy)]
struct Word<'a> {
    text: &'a str,
    line: u32,
    /// Byte offset in its line.
    start: usize,
}

impl Word<'_> {
    fn error(&self, problem: impl Into<Problem>) -> FileError {
        let column = self.start as u32 + 1;
        let end_column = column + self.text.len() as u32;
        FileError { line: self.line, column, end_column, problem: problem.into() }
    }
}

/// Appends the words of one line. Quotes hold a word with spaces together and are dropped.
fn split<'a>(text: &'a str, line: u32, words: &mut Vec<Word<'a>>) -> Result<(), FileError> {
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        let start = text.len() - rest.len();
        let Some(first) = rest.chars().next().filter(|first| *first != '#') else { return Ok(()) };
        let (word, after) = if first == '"' {
            let open = Word { text: rest, line, start };
            rest[1..].split_once('"').ok_or_else(|| open.error(Problem::OpenQuote))?
        } else {
            rest.split_at(rest.find(char::is_whitespace).unwrap_or(rest.len()))
        };
        words.push(Word { text: word, line, start: start + usize::from(first == '"') });
        rest = after;
    }
}

impl Session {
    /// An empty HAL; the unit of edge times as in [`Hal::new`].
    ///
    /// # Errors
    /// As [`Hal::new`].
    pub fn new(timer_period_ns: u64) -> Result<Self, HalError> {
        Ok(Self { hal: Hal::new(timer_period_ns)?, running: false })
    }

    /// A session with a HAL that has components already.
    pub const fn with_hal(hal: Hal) -> Self {
        Self { hal, running: false }
    }

    /// The HAL.
    pub const fn hal(&self) -> &Hal {
        &self.hal
    }

    /// The HAL.
    pub const fn hal_mut(&mut self) -> &mut Hal {
        &mut self.hal
    }

    /// Whether `start` was said (and not `stop` after it).
    pub const fn is_running(&self) -> bool {
        self.running
    }

    /// Runs the commands of a file; what they print is appended to `out`. Stops at the first error: what was done
    /// before it stays done.
    ///
    /// # Errors
    /// [`FileError`] with the place.
    pub fn run_file(&mut self, text: &str, out: &mut String) -> Result<(), FileError> {
        let mut words = Vec::new();
        let mut lines = (1..).zip(text.lines());
        while let Some((number, line)) = lines.next() {
            words.clear();
            let (mut number, mut line) = (number, line);
            while let Some(head) = line.strip_suffix('\\') {
                split(head, number, &mut words)?;
                match lines.next() {
                    Some(next) => (number, line) = next,
                    None => line = "",
                }
            }
            split(line, number, &mut words)?;
            if let Some((command, arguments)) = words.split_first() {
                self.command(command, arguments, out)?;
            }
        }
        Ok(())
    }

    fn command(
        &mut self,
        command: &Word<'_>,
        arguments: &[Word<'_>],
        out: &mut String,
    ) -> Result<(), FileError> {
        if let Some(word) = arguments.iter().find(|word| word.text.starts_with('[')) {
            return Err(word.error(Problem::IniValue(word.text.to_owned())));
        }
        let usage = |usage| command.error(Problem::Usage(usage));
        match command.text {
            "loadrt" => {
                let (module, options) =
                    arguments.split_first().ok_or_else(|| usage("loadrt MODULE [OPTION=VALUE ...]"))?;
                let texts: Vec<&str> = options.iter().map(|word| word.text).collect();
                modules::load(&mut self.hal, module.text, &texts).map_err(|error| {
                    let at = error.option().and_then(|option| options.get(option)).unwrap_or(module);
                    at.error(Problem::Load(error))
                })
            }
            "addf" => {
                let [function, thread] = exactly(arguments, || usage("addf FUNCTION THREAD"))?;
                self.hal.addf(function.text, thread.text).map_err(|error| {
                    let unknown_thread = matches!(&error, HalError::Unknown { what: "thread", .. });
                    if unknown_thread { thread.error(error) } else { function.error(error) }
                })
            }
            "net" => self.net(arguments).ok_or_else(|| usage("net SIGNAL PIN ..."))?,
            "newsig" => {
                let [signal, word] = exactly(arguments, || usage("newsig SIGNAL TYPE"))?;
                let pin_type = type_of(word)?;
                self.hal.new_signal(signal.text, pin_type).map_err(|error| signal.error(error))
            }
            "linkps" | "linksp" => {
                let [first, second] = exactly(arguments, || usage("linkps PIN SIGNAL, linksp SIGNAL PIN"))?;
                let (pin, signal) = if command.text == "linkps" { (first, second) } else { (second, first) };
                let name = self.pin_name(pin.text);
                self.hal.link(&name, signal.text).map_err(|error| pin.error(error))
            }
            "linkpp" => {
                let [first, second] = exactly(arguments, || usage("linkpp PIN PIN"))?;
                let (a, b) = (self.pin_name(first.text), self.pin_name(second.text));
                self.hal.net(&a, &[&a, &b]).map_err(|error| second.error(error))
            }
            "unlinkp" => {
                let [pin] = exactly(arguments, || usage("unlinkp PIN"))?;
                let name = self.pin_name(pin.text);
                self.hal.unlink(&name).map_err(|error| pin.error(error))
            }
            "setp" => {
                let [name, value] = assignment(arguments).ok_or_else(|| usage("setp NAME VALUE"))?;
                let pin = self.pin_name(name.text);
                let pin_type = self.hal.pin_type(&pin).map_err(|error| name.error(error))?;
                let value = value_of(value, pin_type)?;
                self.hal.setp(&pin, value).map_err(|error| name.error(error))
            }
            "sets" => {
                let [name, value] = assignment(arguments).ok_or_else(|| usage("sets SIGNAL VALUE"))?;
                let now = self.hal.gets(name.text).map_err(|error| name.error(error))?;
                let value = value_of(value, now.pin_type())?;
                self.hal.sets(name.text, value).map_err(|error| name.error(error))
            }
            "getp" | "gets" | "ptype" => {
                let [name] = exactly(arguments, || usage("getp NAME, gets SIGNAL, ptype NAME"))?;
                let pin = self.pin_name(name.text);
                let value =
                    if command.text == "gets" { self.hal.gets(name.text) } else { self.hal.getp(&pin) };
                let value = value.map_err(|error| name.error(error))?;
                let _ = match command.text {
                    "ptype" => writeln!(out, "{}", value.pin_type()),
                    _ => writeln!(out, "{value}"),
                };
                Ok(())
            }
            "show" => self.show(arguments, out),
            "start" | "stop" => {
                if let Some(word) = arguments.first() {
                    return Err(word.error(Problem::Surplus(word.text.to_owned())));
                }
                self.running = command.text == "start";
                Ok(())
            }
            _ => Err(command.error(Problem::UnknownCommand(command.text.to_owned()))),
        }
    }

    /// The name as the HAL has it: as written, or in lower case if only that exists.
    fn pin_name(&self, written: &str) -> String {
        let lower = written.to_ascii_lowercase();
        if self.hal.pin_type(written).is_err() && self.hal.pin_type(&lower).is_ok() {
            return lower;
        }
        written.to_owned()
    }

    /// None if it is not written as it should be.
    fn net(&mut self, arguments: &[Word<'_>]) -> Option<Result<(), FileError>> {
        let (signal, pins) = arguments.split_first()?;
        let pins: Vec<&Word<'_>> =
            pins.iter().filter(|word| !matches!(word.text, "=>" | "<=" | "<=>")).collect();
        let names: Vec<String> = pins.iter().map(|word| self.pin_name(word.text)).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        if names.is_empty() {
            return None;
        }
        Some(self.hal.net(signal.text, &names).map_err(|error| {
            let named = |word: &&&Word<'_>| match &error {
                HalError::Unknown { name, .. } | HalError::Linked { pin: name, .. } => {
                    *name == self.pin_name(word.text)
                }
                HalError::SecondWriter { pin, .. } => *pin == self.pin_name(word.text),
                _ => false,
            };
            let word = pins.iter().find(named).map_or(signal, |word| *word);
            word.error(error.clone())
        }))
    }

    fn show(&self, arguments: &[Word<'_>], out: &mut String) -> Result<(), FileError> {
        let what = arguments.first().map_or("all", |word| word.text);
        let pattern = arguments.get(1).map_or("", |word| word.text);
        if let Some(word) = arguments.get(2) {
            return Err(word.error(Problem::Surplus(word.text.to_owned())));
        }
        match what {
            "comp" => show_components(&self.hal, out, pattern),
            "pin" => show_pins(&self.hal, out, pattern, false),
            "param" => show_pins(&self.hal, out, pattern, true),
            "sig" | "signal" => show_signals(&self.hal, out, pattern),
            "funct" | "function" => show_functions(&self.hal, out, pattern),
            "thread" => show_threads(&self.hal, out, pattern),
            "all" => {
                show_components(&self.hal, out, pattern);
                show_pins(&self.hal, out, pattern, false);
                show_pins(&self.hal, out, pattern, true);
                show_signals(&self.hal, out, pattern);
                show_functions(&self.hal, out, pattern);
                show_threads(&self.hal, out, pattern);
            }
            _ => {
                let problem = Problem::Usage("show [comp|pin|param|sig|funct|thread|all [PATTERN]]");
                return Err(arguments[0].error(problem));
            }
        }
        Ok(())
    }
}

fn exactly<'a, 'b, const N: usize>(
    arguments: &'a [Word<'b>],
    error: impl FnOnce() -> FileError,
) -> Result<&'a [Word<'b>; N], FileError> {
    match arguments.get(N) {
        Some(word) => Err(word.error(Problem::Surplus(word.text.to_owned()))),
        None => arguments.try_into().map_err(|_| error()),
    }
}

/// `NAME VALUE` or `NAME = VALUE`.
fn assignment<'a, 'b>(arguments: &'a [Word<'b>]) -> Option<[&'a Word<'b>; 2]> {
    match arguments {
        [name, value] => Some([name, value]),
        [name, equals, value] if equals.text == "=" => Some([name, value]),
        _ => None,
    }
}

fn type_of(word: &Word<'_>) -> Result<PinType, FileError> {
    match word.text {
        "bit" => Ok(PinType::Bit),
        "float" => Ok(PinType::Float),
        "s32" => Ok(PinType::S32),
        "u32" => Ok(PinType::U32),
        _ => Err(word.error(Problem::UnknownType(word.text.to_owned()))),
    }
}

/// A value as people write it: `1`, `true`, `yes`, `on` for a bit; decimal, for u32 also hexadecimal; finite numbers.
pub fn parse_value(text: &str, expected: PinType) -> Option<Value> {
    let hexadecimal = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    match expected {
        PinType::Bit => match text.to_ascii_lowercase().as_str() {
            "1" | "true" | "yes" | "on" => Some(Value::Bit(true)),
            "0" | "false" | "no" | "off" => Some(Value::Bit(false)),
            _ => None,
        },
        PinType::Float => text.parse().ok().filter(|number: &f64| number.is_finite()).map(Value::Float),
        PinType::S32 => text.parse().ok().map(Value::S32),
        PinType::U32 => match hexadecimal {
            Some(digits) => u32::from_str_radix(digits, 16).ok().map(Value::U32),
            None => text.parse().ok().map(Value::U32),
        },
    }
}

fn value_of(word: &Word<'_>, expected: PinType) -> Result<Value, FileError> {
    let bad = || word.error(Problem::BadValue { text: word.text.to_owned(), expected });
    parse_value(word.text, expected).ok_or_else(bad)
}

fn show_components(hal: &Hal, out: &mut String, pattern: &str) {
    out.push_str("Loaded components:\n");
    for name in hal.components().filter(|name| name.starts_with(pattern)) {
        let _ = writeln!(out, "  {name}");
    }
    out.push('\n');
}

fn show_pins(hal: &Hal, out: &mut String, pattern: &str, parameters: bool) {
    out.push_str(if parameters { "Parameters:\n" } else { "Component pins:\n" });
    let _ = writeln!(out, "  {:<12} {:<5} {:<3} {:>14}  Name", "Owner", "Type", "Dir", "Value");
    for (name, pin_type, role, value, signal, owner) in hal.pins() {
        let direction = match role {
            Role::In => "IN",
            Role::Out => "OUT",
            Role::InOut => "I/O",
            Role::Parameter => "RW",
            Role::ReadOnly => "RO",
        };
        if matches!(role, Role::Parameter | Role::ReadOnly) != parameters || !name.starts_with(pattern) {
            continue;
        }
        let _ = write!(out, "  {owner:<12} {pin_type:<5} {direction:<3} {value:>14}  {name}");
        if let Some(signal) = signal {
            let arrow = match role {
                Role::In => "<==",
                Role::Out => "==>",
                _ => "<=>",
            };
            let _ = write!(out, " {arrow} {signal}");
        }
        out.push('\n');
    }
    out.push('\n');
}

fn show_signals(hal: &Hal, out: &mut String, pattern: &str) {
    out.push_str("Signals:\n");
    let _ = writeln!(out, "  {:<5} {:>14}  Name", "Type", "Value");
    for (name, pin_type, value, pins) in hal.signals() {
        if !name.starts_with(pattern) {
            continue;
        }
        let _ = writeln!(out, "  {pin_type:<5} {value:>14}  {name}");
        for (pin, role) in pins {
            let arrow = match role {
                Role::In => "==>",
                Role::Out => "<==",
                _ => "<=>",
            };
            let _ = writeln!(out, "  {:<20}    {arrow} {pin}", "");
        }
    }
    out.push('\n');
}

fn show_functions(hal: &Hal, out: &mut String, pattern: &str) {
    out.push_str("Functions:\n");
    for (name, thread) in hal.functions().filter(|(name, _)| name.starts_with(pattern)) {
        let _ = writeln!(out, "  {name:<30} {}", thread.unwrap_or("-"));
    }
    out.push('\n');
}

fn show_threads(hal: &Hal, out: &mut String, pattern: &str) {
    out.push_str("Threads:\n");
    for (name, period_ns, functions) in hal.threads().filter(|(name, ..)| name.starts_with(pattern)) {
        let _ = writeln!(out, "  {period_ns:>10} ns  {name}");
        for (place, function) in (1..).zip(functions) {
            let _ = writeln!(out, "  {place:>14} {function}");
        }
    }
    out.push('\n');
}
