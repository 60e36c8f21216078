//! `[program]` of a machine file, from an INI file: remapped codes, where subs are, the tool changer; and what of the interpreter's
//! settings a machine file has no word for.

use super::Import;
use pkm_gcode::{Remap, Settings};
use std::fmt::Write as _;

impl Import<'_> {
    /// `[program]`: remapped codes, where subs are, the tool changer.
    pub(super) fn program(&mut self, t: &mut String) {
        let ini = self.ini;
        let ours = ini.has("PKM");
        let mut lines = String::new();
        let mut remaps: Vec<Remap> = Vec::new();
        for text in ini.all("RS274NGC", "REMAP") {
            let words = text.split('#').next().unwrap_or_default().split_whitespace();
            let text = words.collect::<Vec<_>>().join(" ");
            let code = text.split_whitespace().next().unwrap_or_default();
            let switches = ini.all("PKM", "SWITCH").filter_map(|switch| switch.split_once(' '));
            if switches.into_iter().any(|(number, _)| code.strip_prefix('M') == Some(number)) {
                continue;
            }
            let why = match Remap::parse(&text, &Settings::default()) {
                Ok(remap) if remaps.iter().any(|known| known.is_of_the_code_of(&remap)) => {
                    "this code is remapped already".to_owned()
                }
                Ok(remap) => {
                    let _ = writeln!(lines, "    {},", quoted(&text));
                    remaps.push(remap);
                    continue;
                }
                Err(error) => format!("{} ({})", error.message, error.help),
            };
            let text = text.replace(char::is_control, " ");
            let _ = writeln!(lines, "    # left out: {}", quoted(&text));
            self.remark(format!(
                "REMAP = {text} is left out, so that {code} is the built-in code or none: {why}"
            ));
        }
        if !lines.is_empty() {
            lines = format!("remap = [\n{lines}]\n");
        }
        // What `pkm linuxcnc` writes has its own codes in remap/.
        let mut folders = if ours { vec![] } else { ini.folders("DISPLAY", "PROGRAM_PREFIX", self.folder) };
        let path = ini.folders("RS274NGC", "SUBROUTINE_PATH", self.folder);
        folders.extend(path.into_iter().filter(|folder| !(ours && *folder == self.folder.join("remap"))));
        if !folders.is_empty() {
            let folders: Vec<String> =
                folders.iter().map(|folder| quoted(&folder.display().to_string())).collect();
            let _ = writeln!(lines, "subroutine_path = [{}]", folders.join(", "));
        }
        match ini.get("EMCIO", "RANDOM_TOOLCHANGER").map(str::to_ascii_lowercase).as_deref() {
            None | Some("0" | "no" | "false" | "off" | "") => {}
            Some("1" | "yes" | "true" | "on") => lines.push_str("random_tool_changer = true\n"),
            Some(value) => self
                .remark(format!("[EMCIO]RANDOM_TOOLCHANGER = {value} is neither 0 nor 1: 0 stands for it")),
        }
        for (section, key) in NOT_CARRIED {
            let value = ini.get(section, key).unwrap_or("0").to_ascii_lowercase();
            if !matches!(value.as_str(), "" | "no" | "false" | "off") && value.parse() != Ok(0.0) {
                let text =
                    format!("[{section}]{key} = {value} is left out: a machine file has no word for it");
                self.remark(text);
            }
        }
        if !lines.is_empty() {
            let _ = write!(t, "\n[program]\n{lines}");
        }
    }
}

/// What an INI file tells the interpreter, and a machine file has no word for: `pkm canon --ini` knows it.
const NOT_CARRIED: [(&str, &str); 15] = [
    ("EMCIO", "TOOL_CHANGE_AT_G30"),
    ("EMCIO", "TOOL_CHANGE_QUILL_UP"),
    ("EMCIO", "TOOL_CHANGE_WITH_SPINDLE_ON"),
    ("AXIS_A", "WRAPPED_ROTARY"),
    ("AXIS_B", "WRAPPED_ROTARY"),
    ("AXIS_C", "WRAPPED_ROTARY"),
    ("RS274NGC", "RETAIN_G43"),
    ("RS274NGC", "OWORD_NARGS"),
    ("RS274NGC", "ORIENT_OFFSET"),
    ("RS274NGC", "DISABLE_AUTO_G54"),
    ("RS274NGC", "DISABLE_G92_PERSISTENCE"),
    ("RS274NGC", "G64_DEFAULT_TOLERANCE"),
    ("RS274NGC", "G64_DEFAULT_NAIVETOLERANCE"),
    ("RS274NGC", "G73_PECK_CLEARANCE"),
    ("RS274NGC", "G83_PECK_CLEARANCE"),
];

/// A text as TOML has it.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}
