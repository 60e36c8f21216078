//! A machine file from a LinuxCNC configuration.

mod program;

use crate::ini::Ini;
use crate::modules::{MODULES, visit};
use pkm_kins::*;
use pkm_machine::kinematics::Parameters;
use pkm_machine::{MachineFile, shipped};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// What was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imported {
    /// The text of a machine file.
    pub toml: String,
    /// What the configuration does not say, and what stands in the machine file instead.
    pub remarks: Vec<String>,
}

/// Why a configuration cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImportError {
    /// Code of a diagnostic.
    pub code: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: String,
}

fn refuse<T>(code: &'static str, message: String, help: &str) -> Result<T, ImportError> {
    Err(ImportError { code, message, help: help.to_owned() })
}

/// Reads an INI file's text. `folder` is the INI file's, as seen from where the machine file will be; `read` gives the text of
/// a file that the INI names.
///
/// # Errors
/// No INI of LinuxCNC, kinematics that `pkm` does not have, a geometry that is not complete.
pub fn import(
    ini: &str,
    folder: &Path,
    read: &dyn Fn(&str) -> Option<String>,
) -> Result<Imported, ImportError> {
    let (ini, missing) = Ini::included(ini, read);
    let ini = Ini::parse(&ini);
    if !ini.has("KINS") || !ini.has("JOINT_0") {
        return refuse(
            "linuxcnc-ini",
            match &missing[..] {
                [] => "no [KINS] and [JOINT_0]: not an INI file of LinuxCNC 2.8 or newer".into(),
                missing => {
                    format!("no [KINS] and [JOINT_0], and #INCLUDE {} cannot be read", missing.join(", "))
                }
            },
            "LinuxCNC's update_ini converts older files",
        );
    }
    let remarks = missing.iter().map(|name| format!("#INCLUDE {name} cannot be read")).collect();
    let mut import = Import { hal: Hal::default(), remarks, inch: 1.0, ini: &ini, folder };
    import.read_hal(read);
    let units = ini.get("TRAJ", "LINEAR_UNITS").unwrap_or("mm").to_ascii_lowercase();
    import.inch = match (units.as_str(), units.parse::<f64>()) {
        ("mm" | "metric", _) => 1.0,
        ("in" | "inch" | "imperial", _) => 25.4,
        // a number counts units per mm; an inch is written with few digits
        (_, Ok(number)) if (number * 25.4 - 1.0).abs() < 1e-3 => 25.4,
        (_, Ok(number)) if number > 0.0 && number.is_finite() => 1.0 / number,
        _ => {
            return refuse(
                "linuxcnc-units",
                format!("[TRAJ]LINEAR_UNITS = {units} is neither mm nor inch"),
                "write mm or inch",
            );
        }
    };
    let toml = import.machine()?;
    Ok(Imported { toml, remarks: import.remarks })
}

/// What HAL files say.
#[derive(Debug, Default)]
struct Hal {
    setp: BTreeMap<String, String>,
    signals: BTreeMap<String, Vec<String>>,
}

struct Import<'a> {
    ini: &'a Ini,
    hal: Hal,
    remarks: Vec<String>,
    /// mm per unit of length.
    inch: f64,
    folder: &'a Path,
}

/// The geometry, as written and as a mechanism.
struct Built {
    toml: String,
    mechanism: Mechanism,
}

impl Import<'_> {
    fn remark(&mut self, text: String) {
        self.remarks.push(text);
    }

    fn read_hal(&mut self, read: &dyn Fn(&str) -> Option<String>) {
        let mut lines = Vec::new();
        for file in self.ini.all("HAL", "HALFILE") {
            let name = file.split_whitespace().next().unwrap_or("");
            match read(name).filter(|_| name.ends_with(".hal")) {
                Some(text) => lines.extend(text.replace("\\\n", " ").lines().map(str::to_owned)),
                None => self.remarks.push(format!("HALFILE {name} is not read")),
            }
        }
        lines.extend(self.ini.all("HAL", "HALCMD").map(str::to_owned));
        for line in lines {
            let line = line.split('#').next().unwrap_or("");
            let words: Vec<String> = line.split_whitespace().map(|word| self.ini.expand(word)).collect();
            match words.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
                ["setp", name, value, ..] | [name, "=", value, ..] => {
                    // A value of the INI file may carry more than the number.
                    self.hal.setp.insert((*name).to_owned(), (*value).to_owned());
                }
                ["net", signal, pins @ ..] => {
                    let pins = pins.iter().filter(|pin| !matches!(**pin, "=>" | "<=" | "<=>"));
                    self.hal
                        .signals
                        .entry((*signal).to_owned())
                        .or_default()
                        .extend(pins.map(|pin| (*pin).to_owned()));
                }
                _ => {}
            }
        }
    }

    /// The step generator of a joint, e.g. `stepgen.0` or `hm2_7i92.0.stepgen.00`.
    fn stepgen(&self, joint: usize) -> String {
        let command = format!("joint.{joint}.motor-pos-cmd");
        self.hal
            .signals
            .values()
            .find(|pins| pins.contains(&command))
            .and_then(|pins| pins.iter().find_map(|pin| pin.strip_suffix(".position-cmd")))
            .filter(|name| name.contains("stepgen"))
            .map_or_else(|| format!("stepgen.{joint}"), str::to_owned)
    }

    fn setp(&self, name: &str) -> Option<f64> {
        self.hal.setp.get(name)?.parse().ok()
    }

    fn machine(&mut self) -> Result<String, ImportError> {
        let Built { toml: kinematics, mechanism } = self.kinematics()?;
        let ini = self.ini;
        let name: String = ini
            .get("EMC", "MACHINE")
            .unwrap_or("imported")
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' })
            .take(41)
            .collect();
        let mut t = format!(
            "# Imported from LinuxCNC by `pkm import-linuxcnc`.\nname = \"{}\"\nsource = \"imported from a LinuxCNC configuration\"\n\n",
            if name.is_empty() { "imported" } else { &name }
        );
        let period = ini.number("EMCMOT", "SERVO_PERIOD").unwrap_or_else(|| {
            self.remark("[EMCMOT]SERVO_PERIOD is missing: 1000000 ns".into());
            1e6
        });
        let _ = writeln!(t, "[servo]\nperiod_ns = {}\n", period.round() as i64);
        if let Some(period) = ini.number("PKM", "TIMER_PERIOD_NS") {
            let _ = writeln!(t, "[stepgen]\ntimer_period_ns = {}\n", period as i64);
        }
        let _ = writeln!(t, "[path]\nblend_tolerance_mm = {}", self.blend_tolerance());
        if let Some(smoothing) = ini.number("PKM", "JOINT_SMOOTHING_MS") {
            let _ = writeln!(t, "joint_smoothing_ms = {smoothing}");
        }
        if let (Some(guard), Some(warn)) =
            (ini.number("PKM", "SINGULARITY_GUARD"), ini.number("PKM", "SINGULARITY_WARN"))
        {
            let _ = writeln!(t, "\n[singularity]\nguard = {guard}\nwarn = {warn}");
        }
        let _ = writeln!(t, "\n{kinematics}");
        let mut homes = [0.0; MAX_JOINTS];
        for (joint, home) in homes.iter_mut().enumerate().take(mechanism.joint_count()) {
            let rotary = mechanism.joint_kind(joint) == JointKind::Rotary;
            *home = self.joint(&mut t, joint, rotary)?;
        }
        self.axes(&mut t, &mechanism);
        self.home(&mut t, &mechanism, &homes)?;
        for switch in ini.all("PKM", "SWITCH") {
            if let Some((code, to)) = switch.split_once(' ') {
                let _ = writeln!(t, "\n[[switch]]\ncode = {code}\nto = \"{}\"", to.trim());
            }
        }
        self.program(&mut t);
        Ok(t)
    }

    /// P of G64 in the start-up code.
    fn blend_tolerance(&self) -> f64 {
        let code = self.ini.get("RS274NGC", "RS274NGC_STARTUP_CODE").unwrap_or("").to_ascii_uppercase();
        let after =
            code.split("G64").nth(1).and_then(|rest| rest.split_whitespace().next().map(str::to_owned));
        let tolerance: f64 = after
            .and_then(|word| word.strip_prefix('P').and_then(|number| number.parse().ok()))
            .unwrap_or(0.0);
        if code.contains("G20") { tolerance * 25.4 } else { tolerance }
    }

    /// One `[[joint]]`; returns its home position, mm or degrees.
    fn joint(&mut self, t: &mut String, joint: usize, rotary: bool) -> Result<f64, ImportError> {
        let ini = self.ini;
        let section = format!("JOINT_{joint}");
        if !ini.has(&section) {
            return refuse(
                "linuxcnc-joint",
                format!("[{section}] is missing: the kinematics has a joint {joint}"),
                "write the section",
            );
        }
        let factor = if rotary { 1.0 } else { self.inch };
        let unit = if rotary { "deg" } else { "mm" };
        let mut given = |key: &str, otherwise: f64| match ini.number(&section, key) {
            Some(value) if value.abs() < 1e6 => metric(value, factor),
            _ => {
                self.remarks.push(format!("[{section}]{key} is missing: {otherwise} {unit} stands for it"));
                otherwise
            }
        };
        let (min, max) = (given("MIN_LIMIT", -1000.0), given("MAX_LIMIT", 1000.0));
        let velocity = given("MAX_VELOCITY", 10.0);
        let acceleration = given("MAX_ACCELERATION", 100.0);
        let home = metric(ini.number(&section, "HOME").unwrap_or(0.0), factor);
        let stepgen = self.stepgen(joint);
        let scale = ["SCALE", "STEP_SCALE", "OUTPUT_SCALE", "INPUT_SCALE"]
            .iter()
            .find_map(|key| ini.number(&section, key))
            .or_else(|| self.setp(&format!("{stepgen}.position-scale")));
        let scale = scale.filter(|scale| *scale != 0.0).unwrap_or_else(|| {
            self.remark(format!("[{section}]SCALE is missing: 400 steps per unit stand for it"));
            400.0
        });
        if scale < 0.0 {
            self.remark(format!(
                "[{section}]SCALE is negative: the direction is the wiring's, its size is kept"
            ));
        }
        // Of a whole number of steps per inch nothing is lost.
        let scale = scale.abs() / factor;
        let name = ini.get(&section, "NAME").map_or_else(|| format!("joint{joint}"), str::to_owned);
        let _ = write!(
            t,
            "[[joint]]\nname = \"{name}\"\nmin_{unit} = {min}\nmax_{unit} = {max}\nmax_velocity_{unit}_s = {velocity}\n\
             max_acceleration_{unit}_s2 = {acceleration}\nsteps_per_{unit} = {scale}\n"
        );
        let keys = [
            ("step_length_ns", "steplen", "STEPLEN"),
            ("step_space_ns", "stepspace", "STEPSPACE"),
            ("direction_setup_ns", "dirsetup", "DIRSETUP"),
            ("direction_hold_ns", "dirhold", "DIRHOLD"),
        ];
        let times: Vec<(&str, i64)> = keys
            .iter()
            .filter_map(|(key, pin, entry)| {
                let time = self.setp(&format!("{stepgen}.{pin}")).or_else(|| ini.number(&section, entry))?;
                // LinuxCNC's 0 is "as short as can be"
                let least = i64::from(matches!(*pin, "steplen" | "stepspace"));
                Some((*key, (time.round() as i64).max(least)))
            })
            .collect();
        let model = ini
            .get(&section, "DRIVER")
            .filter(|model| pkm_machine::drivers::DRIVERS.iter().any(|(name, _)| name == model));
        let list = times.iter().map(|(key, time)| format!("{key} = {time}")).collect::<Vec<_>>().join(", ");
        if times.len() == keys.len() {
            match model {
                Some(model) => writeln!(t, "driver = {{ model = \"{model}\", {list} }}"),
                None => writeln!(t, "driver = {{ minimum = {{ {list} }} }}"),
            }
            .unwrap_or(());
        } else {
            self.remark(format!("joint {joint}: no complete step timing: a DRV8825's stands for it"));
            t.push_str("driver = { model = \"DRV8825\" }\n");
        }
        t.push('\n');
        Ok(home)
    }

    fn axes(&mut self, t: &mut String, mechanism: &Mechanism) {
        let derived = self.ini.get("PKM", "DERIVED_AXES").unwrap_or("");
        for axis in mechanism.axes().iter() {
            let section = format!("AXIS_{}", axis.letter());
            if !self.ini.has(&section) || derived.contains(axis.letter()) {
                continue;
            }
            let (unit, factor) = if axis.is_rotary() { ("deg", 1.0) } else { ("mm", self.inch) };
            let mut lines = String::new();
            let value = |key| {
                self.ini.number(&section, key).filter(|value| value.abs() < 1e6).map(|v| metric(v, factor))
            };
            if let (Some(min), Some(max)) = (value("MIN_LIMIT"), value("MAX_LIMIT")) {
                let _ = writeln!(lines, "min_{unit} = {min}\nmax_{unit} = {max}");
            }
            for (key, name) in [("MAX_VELOCITY", "max_velocity"), ("MAX_ACCELERATION", "max_acceleration")] {
                if let Some(value) = value(key).filter(|value| *value > 0.0) {
                    let square = if name.ends_with("ation") { "s2" } else { "s" };
                    let _ = writeln!(lines, "{name}_{unit}_{square} = {value}");
                }
            }
            let _ = writeln!(t, "[axis.{}]\n{lines}", axis.letter().to_ascii_lowercase());
        }
    }

    fn home(&mut self, t: &mut String, mechanism: &Mechanism, homes: &Joints) -> Result<(), ImportError> {
        t.push_str("[home]\n");
        if let Some(written) = self.ini.get("PKM", "HOME") {
            for word in written.split_whitespace() {
                let (letter, number) = word.split_at(1);
                let _ = writeln!(t, "{} = {number}", letter.to_ascii_lowercase());
            }
            return Ok(());
        }
        let mut joints = *homes;
        for (index, joint) in joints.iter_mut().enumerate() {
            if index < mechanism.joint_count() && mechanism.joint_kind(index) == JointKind::Rotary {
                *joint = maths::radians(*joint);
            }
        }
        let mut seed = Pose::ZERO;
        let written = self.ini.get("TRAJ", "HOME").unwrap_or("");
        for (axis, word) in Axis::ALL.into_iter().zip(written.split_whitespace()) {
            let value: f64 = word.parse().unwrap_or(0.0);
            seed.set(axis, if axis.is_rotary() { maths::radians(value) } else { value * self.inch });
        }
        match mechanism.forward(&joints, &seed) {
            Ok(pose) => {
                for axis in mechanism.axes().iter() {
                    let value = pose.get(axis);
                    let value = if axis.is_rotary() { maths::degrees(value) } else { value };
                    let _ = writeln!(t, "{} = {value}", axis.letter().to_ascii_lowercase());
                }
                Ok(())
            }
            Err(error) => refuse(
                "linuxcnc-home",
                format!("the joints' HOME positions are no pose of the machine: {error}"),
                "correct [JOINT_n]HOME",
            ),
        }
    }

    fn kinematics(&mut self) -> Result<Built, ImportError> {
        let line = self.ini.get("KINS", "KINEMATICS").unwrap_or("");
        let mut words = line.split_whitespace();
        let name = words.next().unwrap_or("");
        let argument = |key: &str| {
            let key = format!("{key}=");
            line.split_whitespace().find_map(|word| word.strip_prefix(key.as_str()).map(str::to_owned))
        };
        match name {
            "trivkins" => {
                let letters =
                    argument("coordinates").unwrap_or_else(|| "XYZABCUVW".into()).to_ascii_uppercase();
                let joints = self.ini.number("KINS", "JOINTS").map_or(letters.len(), |n| n as usize);
                let letters: String =
                    letters.chars().filter(char::is_ascii_alphabetic).take(joints).collect();
                let axes: Vec<Axis> = letters
                    .chars()
                    .filter_map(|c| Axis::ALL.into_iter().find(|axis| axis.letter() == c))
                    .collect();
                if axes.len() != letters.len() || !axes.is_sorted_by(|a, b| a < b) {
                    return refuse(
                        "linuxcnc-kinematics",
                        format!(
                            "trivkins coordinates={letters}: `pkm` needs every axis once, in the order XYZABCUVW"
                        ),
                        "machines with two joints on an axis are not supported",
                    );
                }
                let mechanism = Cartesian::new(AxisSet::new(&axes)).map(Mechanism::from);
                Self::built(format!("[kinematics]\ntype = \"cartesian\"\naxes = \"{letters}\"\n"), mechanism)
            }
            "lineardeltakins" => {
                // What the module begins with, asked under halrun (LinuxCNC 2.9).
                let [joint_radius_mm, joint_length_mm] = [("R", 130.25), ("L", 269.0)].map(|(key, own)| {
                    let pin = format!("lineardeltakins.{key}");
                    self.inch
                        * self.setp(&pin).unwrap_or_else(|| {
                            self.remark(format!("{pin} is not set: the module's own {own} stands for it"));
                            own
                        })
                });
                self.named(
                    "linear-delta",
                    &Parameters::LinearDelta(LinearDeltaParameters { joint_radius_mm, joint_length_mm }),
                )
            }
            "genhexkins" => {
                let mut p = HexapodParameters::symmetric(300.0, 0.4, 150.0, 0.4, 400.0);
                for (joint, (base, platform)) in p.base_mm.iter_mut().zip(&mut p.platform_mm).enumerate() {
                    for (place, what) in [(base, "base"), (platform, "platform")] {
                        for (value, axis) in place.iter_mut().zip(["x", "y", "z"]) {
                            let pin = format!("genhexkins.{what}.{joint}.{axis}");
                            let Some(number) = self.setp(&pin) else {
                                return refuse(
                                    "linuxcnc-geometry",
                                    format!("{pin} is not set in the HAL files"),
                                    "setp all 36 of them, in machine units",
                                );
                            };
                            *value = number * self.inch;
                        }
                    }
                }
                let home = self.ini.get("TRAJ", "HOME").unwrap_or("");
                p.start_z_mm =
                    home.split_whitespace().nth(2).and_then(|z| z.parse().ok()).unwrap_or(0.0) * self.inch;
                self.named("hexapod", &Parameters::Hexapod(p))
            }
            _ => self.ours(name, argument("machine")),
        }
    }

    /// One of pkm's modules: the geometry from `setp`.
    fn ours(&mut self, name: &str, shipped_as: Option<String>) -> Result<Built, ImportError> {
        let Some((kind, module)) = MODULES.iter().find(|(_, module)| module.name == name) else {
            let known: Vec<&str> = MODULES.iter().map(|(_, module)| module.name).collect();
            return refuse(
                "linuxcnc-kinematics",
                format!("[KINS]KINEMATICS = {name} is no kinematics that `pkm` has"),
                &format!("known are trivkins, lineardeltakins, genhexkins, {}", known.join(", ")),
            );
        };
        if self.inch != 1.0 {
            return refuse("linuxcnc-units", format!("{name} in inches"), "pkm's modules work in mm");
        }
        let whole = shipped_as.is_some();
        let mut parameters = match shipped_as.as_deref().map(shipped::text) {
            Some(None) => {
                return refuse(
                    "linuxcnc-geometry",
                    "machine= names no machine that ships".into(),
                    "`pkm machines` lists them",
                );
            }
            Some(Some(text)) => parameters_of(text),
            None => start(kind),
        }
        .ok_or(ImportError {
            code: "linuxcnc-geometry",
            message: format!("no start for {kind}"),
            help: String::new(),
        })?;
        let mut missing = Vec::new();
        let known = visit(&mut parameters, &mut |name, slot| {
            let pin = format!("{}.{name}", module.prefix);
            match (self.setp(&pin), slot) {
                (None, _) => {
                    if !whole {
                        missing.push(pin);
                    }
                }
                (Some(value), Slot::Number(number)) => *number = value,
                // A value out of range becomes one that no mechanism accepts.
                (Some(value), Slot::Integer(integer)) => *integer = value.clamp(-128.0, 127.0) as i8,
                (Some(value), Slot::Flag(flag)) => *flag = value != 0.0,
            }
        });
        if !known || !missing.is_empty() {
            return refuse(
                "linuxcnc-geometry",
                format!("the HAL files do not set {}", missing.join(", ")),
                "geometry.hal, as `pkm linuxcnc` writes it, sets all",
            );
        }
        self.named(kind, &parameters)
    }

    fn named(&self, kind: &str, parameters: &Parameters) -> Result<Built, ImportError> {
        use toml::Table;
        let (table, mechanism) = match parameters {
            Parameters::Planar(p) => (Table::try_from(p), Planar::new(p).map(Mechanism::from)),
            Parameters::Moma(p) => (Table::try_from(p), Moma::new(p).map(Mechanism::from)),
            Parameters::Moma4s(p) => (Table::try_from(p), Moma4s::new(p).map(Mechanism::from)),
            Parameters::MomaW(p) => (Table::try_from(p), MomaW::new(p).map(Mechanism::from)),
            Parameters::HvMill(p) => (Table::try_from(p), HvMill::new(p).map(Mechanism::from)),
            Parameters::HvMachine(p) => (Table::try_from(p), HvMachine::new(p).map(Mechanism::from)),
            Parameters::OxGlide(p) => (Table::try_from(p), OxGlide::new(p).map(Mechanism::from)),
            Parameters::Lambda6(p) => (Table::try_from(p), Lambda6::new(p).map(Mechanism::from)),
            Parameters::LinearDelta(p) => (Table::try_from(p), LinearDelta::new(p).map(Mechanism::from)),
            Parameters::Hexapod(p) => (Table::try_from(p), Hexapod::new(p).map(Mechanism::from)),
            _ => return refuse("linuxcnc-kinematics", format!("{kind} has no named parameters"), ""),
        };
        let text = table.and_then(|mut table| {
            table.insert("type".into(), kind.into());
            toml::to_string(&Table::from_iter([("kinematics".to_owned(), table.into())]))
        });
        match text {
            Ok(text) => Self::built(text, mechanism),
            Err(error) => refuse("linuxcnc-geometry", error.to_string(), ""),
        }
    }

    fn built(toml: String, mechanism: Result<Mechanism, GeometryError>) -> Result<Built, ImportError> {
        match mechanism {
            Ok(mechanism) => Ok(Built { toml, mechanism }),
            Err(error) => refuse(
                "linuxcnc-geometry",
                format!("the geometry makes no mechanism: {error}"),
                "correct the setp lines",
            ),
        }
    }
}

/// Inches in mm, without the rounding of the product: 1.2 in is 30.48 mm. Millimetres and degrees stay as they are.
fn metric(value: f64, factor: f64) -> f64 {
    if factor > 1.0 { (value * factor * 1e9).round() / 1e9 } else { value * factor }
}

fn parameters_of(text: &str) -> Option<Parameters> {
    Some(MachineFile::parse("shipped", text, &[]).ok()?.kinematics.into_inner().parameters)
}

/// Parameters of a kind to be overwritten one by one.
fn start(kind: &str) -> Option<Parameters> {
    match kind {
        "planar" => Some(Parameters::Planar(PlanarParameters {
            reference_mm: [[0.0; 2]; 2],
            guide_angle_deg: [0.0; 2],
            l_mm: [0.0; 2],
            offset_mm: [[0.0; 2]; 2],
            working_mode: [0; 2],
            assembly: 0,
            one_sided: false,
        })),
        "linear-delta" => Some(Parameters::LinearDelta(LinearDeltaParameters {
            joint_radius_mm: 0.0,
            joint_length_mm: 0.0,
        })),
        "hexapod" => Some(Parameters::Hexapod(HexapodParameters::symmetric(300.0, 0.4, 150.0, 0.4, 400.0))),
        _ => shipped::SHIPPED.iter().find_map(|(_, text)| {
            let file = MachineFile::parse("shipped", text, &[]).ok()?;
            (file.kinematics.get_ref().kind == kind).then(|| file.kinematics.into_inner().parameters)
        }),
    }
}
