//! A machine file becomes a LinuxCNC configuration and comes back.

use pkm_kins::Kinematics;
use pkm_linuxcnc::{Configuration, configuration, import, module};
use pkm_linuxcnc_kins::mechanism::Mechanism;
use pkm_linuxcnc_kins::pkm_kins::*;
use pkm_linuxcnc_kins::switchable::{HvMachineKins, OxGlideKins};
use pkm_machine::kinematics::Parameters;
use pkm_machine::{Machine, MachineFile, shipped};
use std::path::Path;

fn of(name: &str, text: &str) -> (Machine, Configuration) {
    let file = MachineFile::parse(name, text, &[]).unwrap();
    let machine = Machine::try_from(file.clone()).unwrap();
    let configuration = configuration(&file, &machine);
    (machine, configuration)
}

fn read<'a>(configuration: &'a Configuration, name: &str) -> Option<&'a str> {
    configuration.files.iter().find(|(file, _)| file == name).map(|(_, text)| text.as_str())
}

#[test]
fn import_of_the_configuration_keeps_every_number() {
    for (name, text) in shipped::SHIPPED {
        let (before, configuration) = of(name, text);
        let ini = read(&configuration, &configuration.ini).unwrap();
        let imported = import(ini, Path::new(""), &|file| read(&configuration, file).map(str::to_owned))
            .unwrap_or_else(|error| panic!("{name}: {error:?}"));
        assert!(imported.remarks.is_empty(), "{name}: {:?}", imported.remarks);
        let after = Machine::parse(name, &imported.toml, &[])
            .unwrap_or_else(|findings| panic!("{name}: {findings:?}\n{}", imported.toml));
        assert_eq!(after.name, before.name);
        assert_eq!(after.mechanism, before.mechanism, "{name}");
        assert_eq!(after.mechanism_type, before.mechanism_type, "{name}");
        assert_eq!(after.servo_period_ns, before.servo_period_ns, "{name}");
        assert_eq!(after.timer_period_ns, before.timer_period_ns, "{name}");
        assert_eq!(after.home, before.home, "{name}");
        assert_eq!(after.switches, before.switches, "{name}");
        assert_eq!(after.path.blend_tolerance, before.path.blend_tolerance, "{name}");
        assert_eq!(after.singularity.guard, before.singularity.guard, "{name}");
        assert_eq!(after.axes.len(), before.axes.len(), "{name}");
        for (a, b) in after.joints.iter().zip(&before.joints) {
            assert_eq!((&a.name, a.kind, a.range), (&b.name, b.kind, b.range), "{name}");
            assert_eq!(a.max_velocity.to_bits(), b.max_velocity.to_bits(), "{name}");
            assert_eq!(a.max_acceleration.to_bits(), b.max_acceleration.to_bits(), "{name}");
            assert_eq!(a.steps_per_unit.to_bits(), b.steps_per_unit.to_bits(), "{name}");
            assert_eq!((a.timing, &a.driver), (b.timing, &b.driver), "{name}");
        }
        // And a second time: the same configuration.
        let (_, again) = of(name, &imported.toml);
        let sorted = |c: &Configuration| {
            c.files
                .iter()
                .filter(|(f, _)| f == "geometry.hal")
                .map(|(_, t)| {
                    t.lines().filter(|l| l.starts_with("setp")).map(str::to_owned).collect::<Vec<_>>()
                })
                .collect::<Vec<_>>()
        };
        assert_eq!(sorted(&again), sorted(&configuration), "{name}");
    }
}

/// The modules' own idea of a shipped machine is the machine file's; their HAL names are those the configuration sets.
fn same<M: Mechanism>(kind: &str)
where
    M::Parameters: PartialEq + core::fmt::Debug,
    Parameters: AsParameters<M::Parameters>,
{
    let module = module(kind).unwrap();
    assert_eq!(module.prefix, M::PREFIX);
    for (name, parameters) in M::SHIPPED {
        let Some(text) = shipped::text(name) else { continue };
        let file = MachineFile::parse(name, text, &[]).unwrap();
        if file.kinematics.get_ref().kind == kind {
            assert_eq!(Some(&parameters()), file.kinematics.get_ref().parameters.as_parameters(), "{name}");
        }
    }
}

trait AsParameters<P> {
    fn as_parameters(&self) -> Option<&P>;
}
macro_rules! as_parameters {
    ($($kind:ident($parameters:ty)),+) => { $(impl AsParameters<$parameters> for Parameters {
        fn as_parameters(&self) -> Option<&$parameters> {
            if let Parameters::$kind(p) = self { Some(p) } else { None }
        }
    })+ };
}
as_parameters!(
    Moma(MomaParameters),
    Moma4s(Moma4sParameters),
    MomaW(MomaWParameters),
    HvMill(HvMillParameters),
    HvMachine(HvMachineParameters),
    OxGlide(OxGlideParameters),
    Lambda6(Lambda6Parameters)
);

#[test]
fn modules_know_the_shipped_machines() {
    same::<Moma>("moma");
    same::<Moma4s>("moma-4s");
    same::<MomaW>("moma-w");
    same::<HvMill>("hv-mill");
    same::<HvMachineKins>("hv-machine");
    same::<OxGlideKins>("ox-glide");
    same::<Lambda6>("lambda6");
}

const FOREIGN: &str = "[EMC]\nMACHINE = My Router!\n[TRAJ]\nLINEAR_UNITS = inch\n[EMCMOT]\nSERVO_PERIOD = 1000000\n[KINS]\n\
    KINEMATICS = trivkins coordinates=xyz\nJOINTS = 3\n[HAL]\nHALFILE = a.hal\nHALFILE = b.tcl\n[AXIS_X]\nMIN_LIMIT = -1\nMAX_LIMIT = 10\nMAX_VELOCITY = 2\n\
    [JOINT_0]\nMIN_LIMIT = -1\nMAX_LIMIT = 10\nMAX_VELOCITY = 1\nMAX_ACCELERATION = 20\nSCALE = 5080 # steps\nSTEPLEN = 5000\n\
    [JOINT_1]\nMIN_LIMIT = -1\nMAX_LIMIT = 10\nMAX_VELOCITY = 1\nMAX_ACCELERATION = 20\nSCALE = -5080\n\
    [JOINT_2]\nMIN_LIMIT = -1\nMAX_LIMIT = 1e99\nMAX_VELOCITY = 1\nMAX_ACCELERATION = 20\n";
const FOREIGN_HAL: &str = "# stepconf\nloadrt stepgen step_type=0,0,0\nnet xpos-cmd joint.0.motor-pos-cmd => stepgen.2.position-cmd\n\
    setp stepgen.2.steplen [JOINT_0]STEPLEN\nsetp stepgen.2.stepspace 4000\nsetp stepgen.2.dirsetup 3000\nsetp stepgen.2.dirhold 2000\n";

#[test]
fn reads_a_foreign_configuration_in_inches() {
    let read = |file: &str| (file == "a.hal").then(|| FOREIGN_HAL.to_owned());
    let imported = import(FOREIGN, Path::new(""), &read).unwrap();
    let machine =
        Machine::parse("foreign", &imported.toml, &[]).unwrap_or_else(|e| panic!("{e:?}\n{}", imported.toml));
    assert_eq!(machine.name, "My-Router-");
    assert_eq!(machine.mechanism.axes().iter().count(), 3);
    let x = &machine.joints[0];
    assert_eq!((x.range.min, x.range.max, x.steps_per_unit), (-25.4, 254.0, 200.0));
    assert_eq!(
        (x.timing.step_length, x.timing.step_space, x.timing.dir_setup, x.timing.dir_hold),
        (5000, 4000, 3000, 2000)
    );
    assert_eq!(machine.axis(Axis::X).unwrap().max_velocity, Some(50.8));
    for word in ["b.tcl", "negative", "[JOINT_2]SCALE", "[JOINT_2]MAX_LIMIT", "step timing"] {
        assert!(
            imported.remarks.iter().any(|remark| remark.contains(word)),
            "{word}: {:?}",
            imported.remarks
        );
    }
}

#[test]
fn units_may_be_a_number_and_geometry_the_modules_own() {
    let none = |_: &str| None;
    let inches = import(FOREIGN, Path::new(""), &none).unwrap();
    assert_eq!(import(&FOREIGN.replace("= inch", "= 0.03937"), Path::new(""), &none), Ok(inches));
    let delta =
        import(&FOREIGN.replace("trivkins", "lineardeltakins").replace("inch", "1.0"), Path::new(""), &none)
            .unwrap();
    assert!(delta.toml.contains("joint_length_mm = 269.0\njoint_radius_mm = 130.25\n"), "{}", delta.toml);
    assert!(delta.remarks.iter().any(|remark| remark.contains("lineardeltakins.R is not set")));
    assert!(Machine::parse("delta", &delta.toml, &[]).is_ok());
}

#[test]
fn refuses_what_it_cannot_read() {
    let none = |_: &str| None;
    let code = |ini: &str| import(ini, Path::new(""), &none).unwrap_err().code;
    assert_eq!(code(""), "linuxcnc-ini");
    assert_eq!(code("\u{0}\u{ff}[[]=\\"), "linuxcnc-ini");
    assert_eq!(code(&FOREIGN.replace("trivkins", "pumakins")), "linuxcnc-kinematics");
    assert_eq!(
        code(&FOREIGN.replace("=xyz", "=xyyz").replace("JOINTS = 3", "JOINTS = 4")),
        "linuxcnc-kinematics"
    );
    assert_eq!(code(&FOREIGN.replace("inch", "furlong")), "linuxcnc-units");
    assert_eq!(code(&FOREIGN.replace("[JOINT_2]", "[JOINT_5]")), "linuxcnc-joint");
    let mm = FOREIGN.replace("inch", "mm");
    assert_eq!(code(&mm.replace("trivkins", "moma_kins")), "linuxcnc-geometry");
    assert_eq!(code(&FOREIGN.replace("inch", "-1")), "linuxcnc-units");
    assert_eq!(code(&mm.replace("trivkins", "moma_kins machine=none")), "linuxcnc-geometry");
    assert_eq!(code(&FOREIGN.replace("trivkins", "moma_kins")), "linuxcnc-units");
    assert_eq!(code(&mm.replace("trivkins", "genhexkins")), "linuxcnc-geometry");
}

#[test]
fn remapped_codes_and_the_tool_changer_come_along() {
    const PROGRAM: &str = "[DISPLAY]\nPROGRAM_PREFIX = ../nc\n[EMCIO]\nRANDOM_TOOLCHANGER = 1\nTOOL_CHANGE_AT_G30 = 1\nTOOL_CHANGE_QUILL_UP = 0\n[RS274NGC]\n\
        SUBROUTINE_PATH = ./subs:/shared\nREMAP =  M400  modalgroup=10 argspec=Pq ngc=corner # remark\nREMAP=M6 prolog=a ngc=b epilog=c\n\
        REMAP = G88.1 modalgroup=1 py=involute\nREMAP = M400 ngc=again\n";
    let none = |_: &str| None;
    let bare = import(FOREIGN, Path::new("lc"), &none).unwrap();
    assert!(!bare.toml.contains("[program]"), "{}", bare.toml);
    let imported = import(&format!("{PROGRAM}{FOREIGN}"), Path::new("lc"), &none).unwrap();
    let new: Vec<_> = imported.remarks.iter().filter(|remark| !bare.remarks.contains(remark)).collect();
    for (remark, said) in new.iter().zip([
        "prolog=a needs Python",
        "py=involute needs Python",
        "already",
        "[EMCIO]TOOL_CHANGE_AT_G30",
    ]) {
        assert!(remark.contains("is left out") && remark.contains(said), "{remark}");
    }
    assert_eq!(new.len(), 4, "{new:?}");

    let program = |name: &str, toml: &str| {
        let machine =
            Machine::parse(name, toml, &[]).unwrap_or_else(|findings| panic!("{findings:?}\n{toml}"));
        let settings = machine.program;
        let written: Vec<String> = settings.remaps.into_iter().map(|code| code.written).collect();
        let folders: Vec<String> =
            settings.subroutine_path.iter().map(|folder| folder.display().to_string()).collect();
        (written, folders, settings.random_tool_changer)
    };
    let wanted = (
        vec!["M400 modalgroup=10 argspec=Pq ngc=corner".to_owned()],
        ["lc/../nc", "lc/subs", "/shared"].map(str::to_owned).to_vec(),
        true,
    );
    assert_eq!(program("mine.toml", &imported.toml), wanted);

    // A configuration is elsewhere than the machine file: its folders begin at the root, in both files.
    let (_, there) = of("mine.toml", &imported.toml);
    let absolute = |folder: &String| std::path::absolute(folder).unwrap().display().to_string();
    let wanted = (wanted.0, wanted.1.iter().map(absolute).collect(), true);
    assert_eq!(program("lc/machine.toml", read(&there, "machine.toml").unwrap()), wanted);
    let ini = read(&there, &there.ini).unwrap();
    let again = import(ini, Path::new("lc"), &|file| read(&there, file).map(str::to_owned)).unwrap();
    assert_eq!(program("mine.toml", &again.toml), wanted);
    assert!(again.remarks.is_empty(), "{:?}", again.remarks);

    // The machine's own codes are remapped in LinuxCNC, not here.
    let text = format!(
        "{}\n[program]\nremap = [\"M400 ngc=corner\"]\nsubroutine_path = [\"/shared\"]\n",
        shipped::text("ox-glide-o").unwrap()
    );
    let (_, there) = of("ox", &text);
    let ini = read(&there, &there.ini).unwrap();
    for line in [
        "REMAP = M450 modalgroup=10 ngc=m450\n",
        "REMAP = M400 ngc=corner\n",
        "SUBROUTINE_PATH = remap:/shared\n",
    ] {
        assert!(ini.contains(line), "{line}{ini}");
    }
    let again = import(ini, Path::new("lc"), &|file| read(&there, file).map(str::to_owned)).unwrap();
    let wanted = (vec!["M400 ngc=corner".to_owned()], vec!["/shared".to_owned()], false);
    assert_eq!(program("ox", &again.toml), wanted);
}
