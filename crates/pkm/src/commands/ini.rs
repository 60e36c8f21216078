//! The settings of the interpreter from LinuxCNC's INI file, with the meaning they have for `rs274 -i`.

use crate::outcome::Failure;
use pkm_gcode::{Interpreter, LineSource, Remap, Settings};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The largest INI file that is read.
const MOST_BYTES: u64 = 1 << 20;

/// LinuxCNC's INI file.
pub(crate) struct Ini {
    path: PathBuf,
    entries: pkm_linuxcnc::Ini,
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
        Ok(Self { path: path.to_owned(), entries: pkm_linuxcnc::Ini::parse(&text) })
    }

    /// Refuses the value of a key.
    fn refuse(&self, section: &str, key: &str, help: &str) -> Failure {
        let value = self.entries.get(section, key).unwrap_or_default();
        let message = format!("[{section}]{key} = {value} is not understood");
        Failure::could_not("ini-file", &self.path.display().to_string(), message, help)
    }

    fn number(&self, section: &str, key: &str) -> Result<Option<f64>, Failure> {
        match (self.entries.get(section, key), self.entries.number(section, key)) {
            (None, _) => Ok(None),
            (Some(_), Some(number)) if number.is_finite() => Ok(Some(number)),
            (Some(_), _) => Err(self.refuse(section, key, "write a number")),
        }
    }

    fn flag(&self, section: &str, key: &str) -> Result<bool, Failure> {
        match self.entries.get(section, key).map(str::to_ascii_lowercase).as_deref() {
            Some("1" | "yes" | "true" | "on") => Ok(true),
            None | Some("0" | "no" | "false" | "off" | "") => Ok(false),
            Some(_) => Err(self.refuse(section, key, "write 0 or 1")),
        }
    }

    /// What the file says about the interpreter; everything else stays as it is.
    ///
    /// # Errors
    /// A value that is none, or a setting that pkm does not have and without which programs would mean something else.
    pub(crate) fn apply(&self, settings: &mut Settings) -> Result<(), Failure> {
        const NGC: &str = "RS274NGC";
        settings.random_toolchanger = self.flag("EMCIO", "RANDOM_TOOLCHANGER")?;
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
        if let Some(value) = self.entries.get("TRAJ", "SPINDLES") {
            settings.spindles = match value.parse() {
                Ok(count @ 1..=8) => count,
                _ => return Err(self.refuse("TRAJ", "SPINDLES", "write 1 to 8")),
            };
        }
        Ok(())
    }

    /// The remapped codes.
    ///
    /// # Errors
    /// One that pkm cannot do, one that stands there twice, or one whose sub has no file.
    pub(crate) fn remap(
        &self,
        settings: &Settings,
        interpreter: &mut Interpreter,
        source: &mut dyn LineSource,
    ) -> Result<(), Failure> {
        for text in self.entries.all("RS274NGC", "REMAP") {
            let refuse = |message: String, help: &str| {
                let message = format!("[RS274NGC]REMAP = {text}: {message}");
                Failure::could_not("ini-file", &self.path.display().to_string(), message, help)
            };
            let remap = Remap::parse(text, settings).map_err(|error| refuse(error.message, error.help))?;
            if !matches!(source.find_subroutine(remap.sub()), Ok(Some(_))) {
                let help =
                    "put it beside the program file or into a folder of PROGRAM_PREFIX or SUBROUTINE_PATH";
                return Err(refuse(format!("there is no file {}.ngc", remap.sub()), help));
            }
            if !interpreter.add_remap(remap) {
                return Err(refuse("this code is remapped already".to_owned(), "remove one of the lines"));
            }
        }
        Ok(())
    }

    /// Machine units per mm, if the file says so. LinuxCNC 2.9's rs274 does not look at it.
    ///
    /// # Errors
    /// A unit that is none.
    pub(crate) fn machine_units_per_mm(&self) -> Result<Option<f64>, Failure> {
        match self.entries.get("TRAJ", "LINEAR_UNITS") {
            None => Ok(None),
            Some("mm" | "metric") => Ok(Some(1.0)),
            Some("in" | "inch" | "imperial") => Ok(Some(Settings::rs274().machine_units_per_mm)),
            Some(_) => Err(self.refuse("TRAJ", "LINEAR_UNITS", "write mm or inch")),
        }
    }

    /// Folders in which subroutine files are looked for, after the program's own: PROGRAM_PREFIX, then SUBROUTINE_PATH;
    /// relative ones begin where the INI file is.
    pub(crate) fn subroutine_path(&self) -> Vec<PathBuf> {
        let beside = self.path.parent().unwrap_or(Path::new(""));
        let mut folders = self.entries.folders("DISPLAY", "PROGRAM_PREFIX", beside);
        folders.extend(self.entries.folders("RS274NGC", "SUBROUTINE_PATH", beside));
        folders
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ini(text: &str) -> Ini {
        Ini { path: PathBuf::from("machine/test.ini"), entries: pkm_linuxcnc::Ini::parse(text) }
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
    fn what_is_wrong_is_refused_by_name() {
        for (text, name) in [
            ("[TRAJ]\nSPINDLES = 9\n", "[TRAJ]SPINDLES = 9"),
            ("[RS274NGC]\n\nORIENT_OFFSET = ten\n", "[RS274NGC]ORIENT_OFFSET = ten"),
            ("[EMCIO]\nTOOL_CHANGE_AT_G30 = perhaps\n", "[EMCIO]TOOL_CHANGE_AT_G30"),
        ] {
            let Err(Failure::CouldNot(diagnostics)) = ini(text).apply(&mut Settings::rs274()) else {
                panic!("{text:?} is accepted");
            };
            assert!(diagnostics[0].message.starts_with(name), "{}", diagnostics[0].message);
        }
    }
}
