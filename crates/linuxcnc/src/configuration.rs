//! The files of a LinuxCNC configuration.

use crate::example::example;
use crate::hal;
use crate::modules::{Module, geometry, module};
use crate::travel::{AxisTravel, REGULAR, Travel, travel};
use pkm_kins::{JointKind, Kinematics, OxForm, Spindle, maths};
use pkm_machine::kinematics::Parameters;
use pkm_machine::{Joint, Machine, MachineFile, Switch, SwitchTarget};
use std::fmt::Write as _;
use std::path::PathBuf;

/// A configuration: file names (with `/` for folders) and contents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Configuration {
    /// The INI file among them.
    pub ini: String,
    /// The module to be loaded; none for a Cartesian machine, which LinuxCNC's trivkins serves.
    pub module: Option<Module>,
    /// All files.
    pub files: Vec<(String, String)>,
}

/// The configuration of a machine. `file` is the machine file `machine` was made from.
pub fn configuration(file: &MachineFile, machine: &Machine) -> Configuration {
    let module = module(&machine.mechanism_type);
    let travel = travel(machine);
    let name = machine.name.as_str();
    let ini_name = format!("{name}.ini");
    let mut files = vec![
        (ini_name.clone(), ini(file, machine, module, &travel)),
        (format!("{name}.hal"), hal::main(machine, module)),
        ("loopback.hal".into(), hal::loopback(machine)),
        ("stepgen.hal".into(), hal::stepgen(machine)),
        ("parport.hal".into(), hal::parport(machine)),
        ("mesa.hal".into(), hal::mesa(machine)),
        ("tool.tbl".into(), "T1 P1 D1 Z0 ;lengths in mm; one line for each tool\n".into()),
        (format!("{name}.var"), "5220\t1\n".into()),
        ("example.ngc".into(), example(machine, &travel)),
        ("machine.toml".into(), machine_file(file, machine)),
        ("README.md".into(), readme(machine, module, &ini_name)),
    ];
    if let Some(module) = module {
        let numbers = geometry(&file.kinematics.get_ref().parameters);
        files.push(("geometry.hal".into(), hal::geometry(machine, module, &numbers)));
    }
    for switch in &machine.switches {
        files.push((format!("remap/m{}.ngc", switch.code), remap(file, switch, &travel)));
    }
    Configuration { ini: ini_name, module, files }
}

/// Folders of subroutine files. The configuration is elsewhere than the machine file, so they begin at the root.
fn subroutine_path(machine: &Machine) -> Vec<String> {
    let absolute = |folder: &PathBuf| std::path::absolute(folder).unwrap_or_else(|_| folder.clone());
    machine.program.subroutine_path.iter().map(|folder| absolute(folder).display().to_string()).collect()
}

/// The machine file as written, but for these folders.
fn machine_file(file: &MachineFile, machine: &Machine) -> String {
    let mut text = file.source.text().to_owned();
    let written = file.tables.program.subroutine_path.iter().zip(subroutine_path(machine));
    // From the end, so that the places before it stay; a folder that --set names stands behind the text.
    for (folder, absolute) in
        written.rev().filter(|(folder, _)| folder.span().end <= file.source.text().len())
    {
        text.replace_range(folder.span(), &toml::Value::from(absolute).to_string());
    }
    text
}

/// Type of LinuxCNC's switchable kinematics: 0 is the one the machine starts with.
pub(crate) fn kinematics_type(file: &MachineFile, to: SwitchTarget) -> Option<u8> {
    match (&file.kinematics.get_ref().parameters, to) {
        (Parameters::HvMachine(p), SwitchTarget::Mechanism(spindle)) => Some(u8::from(spindle != p.active)),
        (Parameters::OxGlide(p), SwitchTarget::Form(form)) => Some(u8::from(form != p.form)),
        _ => None,
    }
}

/// Steps per second that the fastest joint needs.
pub(crate) fn fastest_step_rate(machine: &Machine) -> f64 {
    machine.joints.iter().map(|joint| joint.max_velocity * joint.steps_per_unit).fold(1.0, f64::max)
}

/// The base period for software stepping: half a step of the fastest joint, at most 50 µs.
pub(crate) fn base_period_ns(machine: &Machine) -> u64 {
    (1e9 / (2.0 * fastest_step_rate(machine))).floor().clamp(1.0, 50_000.0) as u64
}

/// Whether a computer without a card can be expected to make these steps.
pub(crate) const SHORTEST_BASE_PERIOD_NS: u64 = 15_000;

const UNITS: [&str; 2] = ["mm", "degrees"];

fn ini(file: &MachineFile, machine: &Machine, module: Option<Module>, travel: &Travel) -> String {
    let name = &machine.name;
    let mut t = String::new();
    let letters: Vec<String> =
        machine.mechanism.axes().iter().map(|axis| axis.letter().to_string()).collect();
    let kinematics = module.map_or_else(
        || format!("trivkins coordinates={} kinstype=BOTH", letters.concat()),
        |module| module.name.to_owned(),
    );
    let blend = machine.path.blend_tolerance;
    let path = if blend > 0.0 { format!("G64 P{blend}") } else { "G61".to_owned() };
    let base = base_period_ns(machine);
    let home = machine.home;
    let _ = write!(
        t,
        "# {name}: {}\n# Written by `pkm linuxcnc` from machine.toml, which is the source of every number here. Units: mm, degrees, s.\n\n\
         [EMC]\nVERSION = 1.1\nMACHINE = {name}\nDEBUG = 0\n\n\
         [DISPLAY]\nDISPLAY = axis\nPOSITION_OFFSET = RELATIVE\nPOSITION_FEEDBACK = ACTUAL\nMAX_FEED_OVERRIDE = 1.5\n\
         DEFAULT_LINEAR_VELOCITY = {}\nMAX_LINEAR_VELOCITY = {}\nPROGRAM_PREFIX = .\nOPEN_FILE = example.ngc\n\n\
         [TASK]\nTASK = milltask\nCYCLE_TIME = 0.001\n\n\
         [RS274NGC]\nPARAMETER_FILE = {name}.var\nRS274NGC_STARTUP_CODE = G21 G90 G94 G17 {path}\n",
        machine.description,
        travel.linear_velocity / 2.0,
        travel.linear_velocity,
    );
    if !machine.switches.is_empty() {
        t.push_str(
            "# The machine's own M codes: which mechanism or form is active (motion.switchkins-type).\n",
        );
        t.push_str("HAL_PIN_VARS = 1\n");
        for switch in &machine.switches {
            let _ = writeln!(t, "REMAP = M{0} modalgroup=10 ngc=m{0}", switch.code);
        }
    }
    for code in &machine.program.remaps {
        let _ = writeln!(t, "REMAP = {}", code.written);
    }
    let mut folders = subroutine_path(machine);
    if !machine.switches.is_empty() {
        folders.insert(0, "remap".to_owned());
    }
    if !folders.is_empty() {
        let _ = writeln!(t, "SUBROUTINE_PATH = {}", folders.join(":"));
    }
    let _ = write!(
        t,
        "\n[EMCMOT]\nEMCMOT = motmod\nCOMM_TIMEOUT = 4.0\n# ns\nSERVO_PERIOD = {}\n\
         # For software stepping (stepgen.hal) write {base}: half a step of the fastest joint ({:.0} steps/s).{}\nBASE_PERIOD = 0\n\n\
         [EMCIO]\nEMCIO = io\nCYCLE_TIME = 0.100\nTOOL_TABLE = tool.tbl\nRANDOM_TOOLCHANGER = {}\n\n\
         [HAL]\nHALFILE = {name}.hal\n",
        machine.servo_period_ns,
        fastest_step_rate(machine),
        if base < SHORTEST_BASE_PERIOD_NS {
            " That is faster than most computers can step: use a card, fewer steps or lower speeds."
        } else {
            ""
        },
        u8::from(machine.program.random_tool_changer),
    );
    if module.is_some() {
        t.push_str("# The geometry. Without it the module refuses every pose: no machine moves with another machine's dimensions.\nHALFILE = geometry.hal\n");
    }
    let _ = write!(
        t,
        "# Where the joints go: one of these three.\n# 1. nowhere: simulation\nHALFILE = loopback.hal\n\
         # 2. step and direction from this computer: set BASE_PERIOD above; parport.hal for the pins\n#HALFILE = stepgen.hal\n#HALFILE = parport.hal\n\
         # 3. step and direction from a Mesa card\n#HALFILE = mesa.hal\n\n\
         [HOSTMOT2]\n# For mesa.hal.\nBOARD = 7i92\nBOARD_IP = 10.10.10.10\n\n\
         [TRAJ]\nCOORDINATES = {}\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\n\
         # LinuxCNC does not limit joint speed in coordinated motion. These, and the axes' own, are what every joint can follow at nine\n\
         # of ten poses of the workspace that are farther than {REGULAR} from a singularity (0 singular, 1 best). Where the joints are\n\
         # worse off, program slower: `pkm check` and `pkm plan` say where.\n\
         DEFAULT_LINEAR_VELOCITY = {}\nMAX_LINEAR_VELOCITY = {}\nDEFAULT_LINEAR_ACCELERATION = {}\nMAX_LINEAR_ACCELERATION = {}\n\
         # Where forward kinematics begins to look.\nHOME = {} {} {}\n\n\
         [KINS]\nKINEMATICS = {kinematics}\nJOINTS = {}\n\n",
        letters.join(" "),
        travel.linear_velocity / 2.0,
        travel.linear_velocity,
        travel.linear_acceleration,
        travel.linear_acceleration,
        home.x,
        home.y,
        home.z,
        machine.joints.len(),
    );
    for axis in &travel.axes {
        axis_section(&mut t, axis, file, machine);
    }
    let home_joints = machine.mechanism.inverse(&machine.home).unwrap_or_default();
    let tables = file.tables.joint.get_ref();
    for (index, ((joint, written), home)) in machine.joints.iter().zip(tables).zip(home_joints).enumerate() {
        joint_section(&mut t, index, joint, written.get_ref(), joint.to_face(home));
    }
    let _ = write!(
        t,
        "# What LinuxCNC has no words for; `pkm import-linuxcnc` reads it back.\n[PKM]\nTIMER_PERIOD_NS = {}\nSINGULARITY_GUARD = {}\nSINGULARITY_WARN = {}\n",
        machine.timer_period_ns, machine.singularity.guard, machine.singularity.warn
    );
    if let Some(smoothing) = &file.tables.path.joint_smoothing_ms {
        let _ = writeln!(t, "JOINT_SMOOTHING_MS = {}", smoothing.get_ref());
    }
    let pose: Vec<String> = file
        .tables
        .home
        .get_ref()
        .iter()
        .filter_map(|(axis, value)| value.map(|value| format!("{}{}", axis.letter(), value.get_ref())))
        .collect();
    let _ = writeln!(t, "HOME = {}", pose.join(" "));
    let derived = travel.axes.iter().map(|axis| axis.axis).filter(|&axis| machine.axis(axis).is_none());
    let derived: String = derived.map(|axis| axis.letter()).collect();
    let _ = writeln!(t, "# Axes whose limits follow from the joints'\nDERIVED_AXES = {derived}");
    for Switch { code, to } in &machine.switches {
        let to = match to {
            SwitchTarget::Mechanism(Spindle::H) => "H",
            SwitchTarget::Mechanism(Spindle::V) => "V",
            SwitchTarget::Form(OxForm::O) => "O",
            SwitchTarget::Form(OxForm::X) => "X",
        };
        let _ = writeln!(t, "SWITCH = {code} {to}");
    }
    t
}

fn axis_section(t: &mut String, axis: &AxisTravel, file: &MachineFile, machine: &Machine) {
    let letter = axis.axis.letter();
    let unit = UNITS[usize::from(axis.axis.is_rotary())];
    let AxisTravel { mut min, mut max, velocity, acceleration, .. } = *axis;
    let _ = writeln!(t, "[AXIS_{letter}]\n# {unit}, {unit}/s, {unit}/s2");
    // In joint mode X and Y of the O-X glide are its joints, and their ranges must fit.
    if matches!(file.kinematics.get_ref().parameters, Parameters::OxGlide(_))
        && !machine.switches.is_empty()
        && let Some(joint) = machine.joints.get(axis.axis as usize)
    {
        t.push_str("# Wide enough for the joint itself, which X and Y are while the form is switched; joints have their own limits.\n");
        min = min.min(joint.range.min);
        max = max.max(joint.range.max);
    } else if machine.axis(axis.axis).is_none_or(|limits| limits.range.is_none()) {
        t.push_str(
            "# The box that the workspace fits in; what is out of reach in it, the kinematics refuses.\n",
        );
    }
    let _ = writeln!(
        t,
        "MIN_LIMIT = {min}\nMAX_LIMIT = {max}\nMAX_VELOCITY = {velocity}\nMAX_ACCELERATION = {acceleration}\n"
    );
}

fn joint_section(t: &mut String, index: usize, joint: &Joint, written: &pkm_machine::file::Joint, home: f64) {
    let rotary = joint.kind == JointKind::Rotary;
    let unit = UNITS[usize::from(rotary)];
    // The numbers as written in the machine file: nothing is lost on the way.
    let keys = if rotary {
        [
            &written.min_deg,
            &written.max_deg,
            &written.max_velocity_deg_s,
            &written.max_acceleration_deg_s2,
            &written.steps_per_deg,
        ]
    } else {
        [
            &written.min_mm,
            &written.max_mm,
            &written.max_velocity_mm_s,
            &written.max_acceleration_mm_s2,
            &written.steps_per_mm,
        ]
    };
    let [min, max, velocity, acceleration, scale] =
        keys.map(|key| key.as_ref().map_or(0.0, |number| *number.get_ref()));
    let timing = joint.timing;
    let minimum = joint.driver.minimum;
    let _ = write!(
        t,
        "[JOINT_{index}]\n# {}\nNAME = {}\nTYPE = {}\n# {unit}, {unit}/s, {unit}/s2\nMIN_LIMIT = {min}\nMAX_LIMIT = {max}\n\
         MAX_VELOCITY = {velocity}\nMAX_ACCELERATION = {acceleration}\n\
         # Steps per {unit}\nSCALE = {scale}\n\
         # Room for the step generator to catch up: its own limits are a little above.\nSTEPGEN_MAXVEL = {}\nSTEPGEN_MAXACCEL = {}\n\
         # Driver {}: needs at least {} {} {} {} ns\nDRIVER = {}\nSTEPLEN = {}\nSTEPSPACE = {}\nDIRSETUP = {}\nDIRHOLD = {}\n\
         FERROR = {}\nMIN_FERROR = {}\n\
         # Homes where it stands, which must be the home pose. With a switch: set HOME_SEARCH_VEL, HOME_LATCH_VEL and HOME_OFFSET\n\
         # to the joint's position at the switch.\nHOME = {home}\nHOME_OFFSET = {home}\nHOME_SEQUENCE = 0\n\n",
        joint.name,
        joint.name,
        if rotary { "ANGULAR" } else { "LINEAR" },
        velocity * 1.2,
        acceleration * 1.5,
        joint.driver.model,
        minimum.step_length,
        minimum.step_space,
        minimum.dir_setup,
        minimum.dir_hold,
        joint.driver.model,
        timing.step_length,
        timing.step_space,
        timing.dir_setup,
        timing.dir_hold,
        velocity * 0.02,
        velocity * 0.005,
    );
}

/// The subroutine behind one of the machine's M codes.
fn remap(file: &MachineFile, switch: &Switch, travel: &Travel) -> String {
    let code = switch.code;
    let number = kinematics_type(file, switch.to).unwrap_or(0);
    let mut t = format!(
        "; M{code}: {}. Motion comes to rest, then motion.switchkins-type becomes {number}.\no<m{code}> sub\nM66 E0 L0\n",
        switch.to
    );
    if let (SwitchTarget::Form(form), Parameters::OxGlide(p)) =
        (switch.to, &file.kinematics.get_ref().parameters)
    {
        // Where c = (CD - AB - s)/2 has the other sign, the sliders go there: AB' = CD - s, CD' = AB + s.
        let _ = write!(
            t,
            "; Joint mode: X Y Z are the joints AB CD Z.\nM73\nM68 E3 Q2\nM66 E0 L0\nG21 G90 G61 G94\n\
             #<ab> = #<_abs_x>\n#<cd> = #<_abs_y>\n\
             ; Half the distance of the links' centres: above 0 in O, below in X.\n#<c> = [[#<cd> - #<ab> - {s}] / 2]\n\
             o100 if [#<c> {other} 0]\n  ; x and z stay, y swings out to the links' length and back.\n  G53 G1 X[#<cd> - {s}] Y[#<ab> + {s}] F{feed}\n  M66 E0 L0\no100 endif\n",
            s = p.s_mm,
            other = if form == OxForm::O { "LT" } else { "GT" },
            feed = (travel.linear_velocity * 30.0).floor().max(1.0),
        );
    }
    let _ = write!(t, "M68 E3 Q{number}\nM66 E0 L0\no<m{code}> endsub\n");
    t
}

fn readme(machine: &Machine, module: Option<Module>, ini: &str) -> String {
    let name = &machine.name;
    let mut t = format!(
        "# {name} in LinuxCNC\n\n{}. {}.\n\nWritten by `pkm linuxcnc`; `machine.toml` is the source of every number: change it there and write the configuration again.\n\n",
        machine.description, machine.source
    );
    if let Some(Module { name: module, prefix }) = module {
        let _ = write!(
            t,
            "## The kinematics module\n\nBuild it in the pkm repository, and install it (LinuxCNC loads modules from its own folder only):\n\n```sh\n\
             cargo build --profile linuxcnc --package pkm-linuxcnc-kins --examples\n\
             sudo install -m 644 target/linuxcnc/examples/lib{module}.so /usr/lib/linuxcnc/modules/{module}.so\n```\n\n\
             Its geometry are the HAL parameters `{prefix}.*`, set by `geometry.hal`; `halcmd show param {prefix}` shows them,\n\
             `halcmd setp` changes them. A geometry that makes no mechanism, or that would move a joint of a driven machine by more than\n\
             0.5, is refused with a message; the pin `{prefix}.errors` counts refused poses.\n\n"
        );
    }
    let _ = write!(
        t,
        "## Run it\n\n```sh\npkm check example.ngc --machine machine.toml\nlinuxcnc {ini}\n```\n\n\
         Then: F1 (emergency stop off), F2 (machine on), Home All, open `example.ngc`, R.\n\n\
         | file | what |\n|---|---|\n| `{ini}` | limits, scales, periods |\n| `{name}.hal` | kinematics and motion |\n"
    );
    if module.is_some() {
        t.push_str("| `geometry.hal` | the mechanism's dimensions |\n");
    }
    t.push_str(
        "| `loopback.hal` | simulation: every joint is where it is told to be |\n\
         | `stepgen.hal`, `parport.hal` | step and direction from this computer's parallel port |\n\
         | `mesa.hal` | step and direction from a Mesa card |\n\
         | `tool.tbl`, `*.var` | tools, parameters |\n\
         | `example.ngc` | a program the machine can run |\n",
    );
    if !machine.switches.is_empty() {
        t.push_str("| `remap/` | the machine's own M codes |\n");
    }
    let first = machine.joints.first();
    let fastest = first.map_or(0.0, |joint| joint.max_velocity * joint.steps_per_unit);
    let _ = write!(
        t,
        "\n## Before it moves metal\n\nThe simulation needs nothing. For a real machine choose `stepgen.hal` or `mesa.hal` in the INI, look at every pin in them (`parport.hal`\n\
         and `mesa.hal` were written without the hardware), connect the emergency stop, give the joints home switches, and let it step one joint at a time\n\
         in joint mode first. Joint 0 makes {fastest:.0} steps/s at full speed.\n"
    );
    if machine.joints.iter().any(|joint| {
        joint.range.max - joint.range.min > maths::radians(720.0) && joint.kind == JointKind::Rotary
    }) {
        t.push_str("\nA rotary joint that may turn on for ever is bounded only for LinuxCNC's sake.\n");
    }
    t
}
