//! LinuxCNC's INI files: sections and keys are case-sensitive, `#` and `;` begin a comment only at the start of a line, a key may
//! be repeated, a `\` at the end continues the line.

use std::path::{Path, PathBuf};

/// An INI file as read.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ini {
    entries: Vec<(String, String, String)>,
}

impl Ini {
    /// Reads the text of an INI file. What is neither section, entry nor comment is skipped, as LinuxCNC does.
    pub fn parse(text: &str) -> Self {
        let mut entries = Vec::new();
        let mut section = String::new();
        let mut rest = String::new();
        for line in text.lines() {
            let line = line.trim();
            if rest.is_empty() && (line.starts_with(['#', ';']) || line.is_empty()) {
                continue;
            }
            if let Some(begun) = line.strip_suffix('\\') {
                rest.push_str(begun.trim_end());
                rest.push(' ');
                continue;
            }
            let line = std::mem::take(&mut rest) + line;
            if let Some(name) = line.strip_prefix('[').and_then(|line| line.split(']').next()) {
                section = name.trim().to_owned();
            } else if let Some((key, value)) = line.split_once('=') {
                entries.push((section.clone(), key.trim().to_owned(), value.trim().to_owned()));
            }
        }
        Self { entries }
    }

    /// The text with its `#INCLUDE FILE` lines replaced by those files, one level deep as LinuxCNC's start script does it, and
    /// the files that `read` does not give.
    pub fn included(text: &str, read: &dyn Fn(&str) -> Option<String>) -> (String, Vec<String>) {
        let (mut whole, mut missing) = (String::new(), Vec::new());
        for line in text.lines() {
            match line
                .trim_start()
                .strip_prefix("#INCLUDE")
                .filter(|rest| rest.starts_with(char::is_whitespace))
            {
                None => whole.push_str(line),
                Some(name) => match read(name.trim()) {
                    Some(file) => whole.push_str(&file),
                    None => missing.push(name.trim().to_owned()),
                },
            }
            whole.push('\n');
        }
        (whole, missing)
    }

    /// All values of a key, in order.
    pub fn all<'a>(&'a self, section: &'a str, key: &'a str) -> impl Iterator<Item = &'a str> {
        self.entries
            .iter()
            .filter(move |(s, k, _)| s == section && k == key)
            .map(|(_, _, value)| value.as_str())
    }

    /// The first value of a key: the one LinuxCNC uses.
    pub fn get(&self, section: &str, key: &str) -> Option<&str> {
        self.entries.iter().find(|(s, k, _)| s == section && k == key).map(|(_, _, value)| value.as_str())
    }

    /// The first value of a key as a number: up to the first blank, as `sscanf` reads it.
    pub fn number(&self, section: &str, key: &str) -> Option<f64> {
        self.get(section, key)?.split_whitespace().next()?.parse().ok()
    }

    /// True if the section has any entry.
    pub fn has(&self, section: &str) -> bool {
        self.entries.iter().any(|(s, _, _)| s == section)
    }

    /// The folders of a key, separated by colons; relative ones begin at `beside`, the INI file's folder, `~` at home.
    pub fn folders(&self, section: &str, key: &str, beside: &Path) -> Vec<PathBuf> {
        let folders = self.get(section, key).unwrap_or_default().split(':').map(str::trim);
        let folder = |folder: &str| match folder.strip_prefix('~').filter(|rest| rest.starts_with('/')) {
            Some(rest) => std::env::home_dir().unwrap_or_default().join(&rest[1..]),
            None => beside.join(folder.trim_start_matches("./")),
        };
        folders.filter(|folder| !folder.is_empty()).map(folder).collect()
    }

    /// `[SECTION]KEY` and `[SECTION](KEY)` in a word of a HAL file replaced by their values, as halcmd does; unknown ones stay.
    pub fn expand(&self, word: &str) -> String {
        let mut done = String::new();
        let mut rest = word;
        while let Some(start) = rest.find('[') {
            let (before, from) = rest.split_at(start);
            done.push_str(before);
            let parsed = from[1..].split_once(']').and_then(|(section, after)| {
                let (key, after) = match after.strip_prefix('(') {
                    Some(inner) => inner.split_once(')')?,
                    None => {
                        let end = after
                            .find(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '-'))
                            .unwrap_or(after.len());
                        after.split_at(end)
                    }
                };
                Some((self.get(section, key)?, after))
            });
            match parsed {
                Some((value, after)) => {
                    done.push_str(value);
                    rest = after;
                }
                None => {
                    done.push('[');
                    rest = &from[1..];
                }
            }
        }
        done + rest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_linuxcnc_reads() {
        let text = "; c\n[A]\nX = 1 # not a comment\n x = 2\nX = 3\nL = a \\\n  b\n[B]\nX=4\njunk\n";
        let ini = Ini::parse(text);
        assert_eq!(ini.get("A", "X"), Some("1 # not a comment"));
        assert_eq!(ini.number("A", "X"), Some(1.0));
        assert_eq!(ini.get("A", "x"), Some("2"));
        assert_eq!(ini.all("A", "X").count(), 2);
        assert_eq!(ini.get("A", "L"), Some("a b"));
        assert_eq!(ini.get("B", "X"), Some("4"));
        assert_eq!(ini.expand("p.[B]X.q[A](x)"), "p.4.q2");
        assert_eq!(ini.expand("[B]Y[C"), "[B]Y[C");
        assert!(ini.has("B") && !ini.has("C"));
    }

    #[test]
    fn folders_begin_beside_the_file_or_at_home() {
        let ini = Ini::parse("[A]\nX = ./a: b/../c::/d:~/e:~f\n");
        let home = std::env::home_dir().unwrap_or_default();
        let beside = |folder: &str| Path::new("lc").join(folder);
        let wanted = [beside("a"), beside("b/../c"), PathBuf::from("/d"), home.join("e"), beside("~f")];
        assert_eq!(ini.folders("A", "X", Path::new("lc")), wanted);
        assert!(ini.folders("A", "Y", Path::new("lc")).is_empty());
    }

    #[test]
    fn includes_are_one_level_deep() {
        let read = |name: &str| match name {
            "b.inc" => Some("[B]\nX = 1\n#INCLUDE c.inc\n".to_owned()),
            _ => None,
        };
        let text = "#INCLUDE b.inc\nY = 2\n#INCLUDED\n  #INCLUDE  d.inc \n";
        let (whole, missing) = Ini::included(text, &read);
        let ini = Ini::parse(&whole);
        assert_eq!((ini.number("B", "X"), ini.number("B", "Y")), (Some(1.0), Some(2.0)));
        assert_eq!(missing, ["d.inc"]);
    }
}
