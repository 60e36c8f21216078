//! The settings of the interpreter from LinuxCNC's INI file, with the meaning they have for `rs274 -i`.

use crate::outcome::Failure;
use pkm_gcode::Settings;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The largest INI file that is read.
const MOST_BYTES: u64 = 1 << 20;

/// An INI file in memory.
pub(crate) struct Ini {
    path: PathBuf,
    text: String,
}

impl Ini {
    /// # Errors
    /// The file cannot be read, or it is no text.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let name = path.display().to_string();
        let refuse = |message: String, help| Failure::could_not("ini-file", &name, message, help);
        let mut text = String::new();
        File::open(path).and_then(|file| file.take(MOST_BYTES + 1).read_to_string(&mut text)).map_err(
            |error| refuse(format!("cannot read {name}: {error}"), "check the path and its permissions"),
        )?;
        if text.len() as u64 > MOST_BYTES {
            return Err(refuse(format!("larger than {MOST_BYTES} bytes"), "give LinuxCNC's INI file"));
        }
        Ok(Self { path: path.to_owned(), text })
    }

    /// The first value of a key in a section, and its line. Lines that begin with `#` or `;` are remarks.
    fn find(&self, section: &str, key: &str) -> Option<(u32, &str)> {
        let mut inside = false;
        for (number, line) in (1..).zip(self.text.lines()) {
            let line = line.trim();
            if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
                inside = name.trim() == section;
            } else if inside
                && !line.starts_with(['#', ';'])
                && let Some((name, value)) = line.split_once('=')
                && name.trim() == key
            {
                return Some((number, value.trim()));
            }
        }
        None
    }

    fn refuse(&self, line: u32, message: String, help: &str) -> Failure {
        let mut failure = Failure::could_not("ini-file", &self.path.display().to_string(), message, help);
        if let Failure::CouldNot(diagnostics) = &mut failure {
            for diagnostic in diagnostics {
                (diagnostic.line, diagnostic.column, diagnostic.end_column) = (line, 1, 1);
            }
        }
        failure
    }

    fn number(&self, section: &str, key: &str) -> Result<Option<f64>, Failure> {
        let Some((line, value)) = self.find(section, key) else { return Ok(None) };
        match value.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(self.refuse(line, format!("{key} = {value} is not a number"), "write a number")),
        }
    }

    fn flag(&self, section: &str, key: &str) -> Result<bool, Failure> {
        let Some((line, value)) = self.find(section, key) else { return Ok(false) };
        match value.to_ascii_lowercase().as_str() {
            "1" | "yes" | "true" | "on" => Ok(true),
            "0" | "no" | "false" | "off" | "" => Ok(false),
            _ => Err(self.refuse(line, format!("{key} = {value} is neither 0 nor 1"), "write 0 or 1")),
        }
    }

    /// What the file says about the interpreter; everything else stays as it is.
    ///
    /// # Errors
    /// A value that is none, or a setting that pkm does not have and without which programs would mean something else.
    pub(crate) fn apply(&self, settings: &mut Settings) -> Result<(), Failure> {
        const NGC: &str = "RS274NGC";
        if let Some((line, value)) = self.find(NGC, "REMAP") {
            let help = "take it out: pkm refuses remapped codes by name";
            return Err(self.refuse(line, format!("REMAP = {value} is not supported"), help));
        }
        if self.flag("EMCIO", "RANDOM_TOOLCHANGER")? {
            let line = self.find("EMCIO", "RANDOM_TOOLCHANGER").map_or(0, |(line, _)| line);
            return Err(self.refuse(line, "RANDOM_TOOLCHANGER is not supported".into(), "set it to 0"));
        }
        for (axis, section) in ["AXIS_A", "AXIS_B", "AXIS_C"].into_iter().enumerate() {
            settings.wrapped_rotary[axis] = self.flag(section, "WRAPPED_ROTARY")?;
            settings.locking_indexer[axis] =
                self.number(section, "LOCKING_INDEXER_JOINT")?.is_some_and(|joint| joint >= 0.0);
        }
        settings.tool_change_at_g30 = self.flag("EMCIO", "TOOL_CHANGE_AT_G30")?;
        settings.tool_change_quill_up = self.flag("EMCIO", "TOOL_CHANGE_QUILL_UP")?;
        settings.tool_change_with_spindle_on = self.flag("EMCIO", "TOOL_CHANGE_WITH_SPINDLE_ON")?;
        settings.retain_g43 = self.flag(NGC, "RETAIN_G43")?;
        settings.oword_nargs = self.flag(NGC, "OWORD_NARGS")?;
        settings.keeps_system_at_end = self.flag(NGC, "DISABLE_AUTO_G54")?;
        settings.forgets_g92_at_end = self.flag(NGC, "DISABLE_G92_PERSISTENCE")?;
        settings.orient_offset_deg = self.number(NGC, "ORIENT_OFFSET")?.unwrap_or(0.0);
        settings.g73_clearance = self.number(NGC, "G73_PECK_CLEARANCE")?;
        settings.g83_clearance = self.number(NGC, "G83_PECK_CLEARANCE")?;
        settings.g64_tolerance = self.number(NGC, "G64_DEFAULT_TOLERANCE")?.unwrap_or(0.0);
        settings.g64_naivecam_tolerance = self.number(NGC, "G64_DEFAULT_NAIVETOLERANCE")?.unwrap_or(0.0);
        if let Some(tolerance) = self.number(NGC, "CENTER_ARC_RADIUS_TOLERANCE_INCH")? {
            settings.arc_radius_tolerance_inch = tolerance;
        }
        if let Some(tolerance) = self.number(NGC, "CENTER_ARC_RADIUS_TOLERANCE_MM")? {
            settings.arc_radius_tolerance_mm = tolerance;
        }
        if let Some((line, value)) = self.find("TRAJ", "SPINDLES") {
            settings.spindles = match value.parse() {
                Ok(count @ 1..=8) => count,
                _ => return Err(self.refuse(line, format!("SPINDLES = {value}"), "write 1 to 8")),
            };
        }
        Ok(())
    }

    /// Machine units per mm, if the file says so. LinuxCNC 2.9's rs274 does not look at it.
    ///
    /// # Errors
    /// A unit that is none.
    pub(crate) fn machine_units_per_mm(&self) -> Result<Option<f64>, Failure> {
        let Some((line, value)) = self.find("TRAJ", "LINEAR_UNITS") else { return Ok(None) };
        match value {
            "mm" | "metric" => Ok(Some(1.0)),
            "in" | "inch" | "imperial" => Ok(Some(Settings::rs274().machine_units_per_mm)),
            _ => Err(self.refuse(line, format!("LINEAR_UNITS = {value}"), "write mm or inch")),
        }
    }

    /// Folders in which subroutine files are looked for, after the program's own: PROGRAM_PREFIX, then SUBROUTINE_PATH;
    /// relative ones begin where the INI file is.
    pub(crate) fn subroutine_path(&self) -> Vec<PathBuf> {
        let beside = self.path.parent().unwrap_or(Path::new(""));
        let folders = |section, key| self.find(section, key).map_or("", |(_, value)| value).split(':');
        folders("DISPLAY", "PROGRAM_PREFIX")
            .chain(folders("RS274NGC", "SUBROUTINE_PATH"))
            .map(str::trim)
            .filter(|folder| !folder.is_empty())
            .map(|folder| beside.join(folder))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ini(text: &str) -> Ini {
        Ini { path: PathBuf::from("machine/test.ini"), text: text.into() }
    }

    #[test]
    fn values_are_those_of_their_section() {
        let ini = ini(
            "# [EMCIO]\n[AXIS_A]\nWRAPPED_ROTARY = 1\n[AXIS_B]\n;WRAPPED_ROTARY = 1\nLOCKING_INDEXER_JOINT=4\n\
                       [TRAJ]\n SPINDLES = 3\nLINEAR_UNITS = mm\n[RS274NGC]\nORIENT_OFFSET = -10.5\nSUBROUTINE_PATH = a:b/c\n",
        );
        let mut settings = Settings::rs274();
        assert!(ini.apply(&mut settings).is_ok());
        assert_eq!(settings.wrapped_rotary, [true, false, false]);
        assert_eq!(settings.locking_indexer, [false, true, false]);
        assert_eq!((settings.spindles, settings.orient_offset_deg), (3, -10.5));
        assert_eq!(ini.machine_units_per_mm().ok().flatten(), Some(1.0));
        assert_eq!(ini.subroutine_path(), [PathBuf::from("machine/a"), PathBuf::from("machine/b/c")]);
    }

    #[test]
    fn what_is_wrong_is_refused_at_its_line() {
        for (text, line) in [
            ("[TRAJ]\nSPINDLES = 9\n", 2),
            ("[RS274NGC]\n\nORIENT_OFFSET = ten\n", 3),
            ("[EMCIO]\nTOOL_CHANGE_AT_G30 = perhaps\n", 2),
            ("[EMCIO]\nRANDOM_TOOLCHANGER = 1\n", 2),
            ("[RS274NGC]\nREMAP = M6 ngc=change\n", 2),
        ] {
            let Err(Failure::CouldNot(diagnostics)) = ini(text).apply(&mut Settings::rs274()) else {
                panic!("{text:?} is accepted");
            };
            assert_eq!(diagnostics[0].line, line, "{text:?}");
        }
    }
}
