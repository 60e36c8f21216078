//! The HAL files.

use crate::modules::Module;
use pkm_machine::Machine;
use std::fmt::Write as _;

/// Kinematics, motion, emergency stop and tool change.
pub(crate) fn main(machine: &Machine, module: Option<Module>) -> String {
    let mut t = format!(
        "# {}: kinematics and motion\nloadrt [KINS]KINEMATICS\n\
         loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD base_period_nsec=[EMCMOT]BASE_PERIOD num_joints=[KINS]JOINTS\n\
         addf motion-command-handler servo-thread\naddf motion-controller servo-thread\n\n\
         # No hardware: the emergency stop and the tool changer answer themselves. On a machine connect the real ones.\n\
         net estop-loop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in\n\
         net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared\n\
         net tool-change iocontrol.0.tool-change => iocontrol.0.tool-changed\n",
        machine.name
    );
    if module.is_some() && !machine.switches.is_empty() {
        t.push_str("\n# Which mechanism or form is active: set by the M codes in remap/ with M68 E3.\nnet kinematics-type motion.analog-out-03 => motion.switchkins-type\n");
    }
    t
}

/// The geometry, as the machine file has it.
pub(crate) fn geometry(machine: &Machine, module: Module, numbers: &[(String, String)]) -> String {
    let mut t = format!(
        "# {}: dimensions of the mechanism, from machine.toml (mm, degrees; limits: 0 = none)\n# {}\n",
        machine.name, machine.source
    );
    for (name, value) in numbers {
        let _ = writeln!(t, "setp {}.{name} {value}", module.prefix);
    }
    t
}

/// Every joint is where it is told to be.
pub(crate) fn loopback(machine: &Machine) -> String {
    let mut t = String::from("# Simulation: every joint is where it is told to be\n");
    for joint in 0..machine.joints.len() {
        let _ = writeln!(
            t,
            "net joint-{joint}-position joint.{joint}.motor-pos-cmd => joint.{joint}.motor-pos-fb"
        );
    }
    t
}

/// LinuxCNC's step generator.
pub(crate) fn stepgen(machine: &Machine) -> String {
    let joints = 0..machine.joints.len();
    let types = vec!["0"; machine.joints.len()].join(",");
    let mut t = format!(
        "# Step and direction by LinuxCNC's own step generator; it needs [EMCMOT]BASE_PERIOD. Times in ns.\n\
         loadrt stepgen step_type={types}\n\
         addf stepgen.capture-position servo-thread 1\naddf stepgen.update-freq servo-thread\naddf stepgen.make-pulses base-thread\n"
    );
    for joint in joints {
        let _ = write!(
            t,
            "\nsetp stepgen.{joint}.position-scale [JOINT_{joint}]SCALE\n\
             setp stepgen.{joint}.steplen [JOINT_{joint}]STEPLEN\nsetp stepgen.{joint}.stepspace [JOINT_{joint}]STEPSPACE\n\
             setp stepgen.{joint}.dirsetup [JOINT_{joint}]DIRSETUP\nsetp stepgen.{joint}.dirhold [JOINT_{joint}]DIRHOLD\n\
             setp stepgen.{joint}.maxaccel [JOINT_{joint}]STEPGEN_MAXACCEL\n\
             net joint-{joint}-command joint.{joint}.motor-pos-cmd => stepgen.{joint}.position-cmd\n\
             net joint-{joint}-position stepgen.{joint}.position-fb => joint.{joint}.motor-pos-fb\n\
             net joint-{joint}-enable joint.{joint}.amp-enable-out => stepgen.{joint}.enable\n"
        );
    }
    t
}

/// Output pins of a parallel port, in the order in which they are used.
const PINS: [u8; 12] = [2, 3, 4, 5, 6, 7, 8, 9, 14, 16, 17, 1];

/// The pins of a parallel port, for `stepgen.hal`.
pub(crate) fn parport(machine: &Machine) -> String {
    let ports = machine.joints.len().div_ceil(PINS.len() / 2);
    let addresses = ["0x378 out", "0x278 out"][..ports.min(2)].join(" ");
    let mut t = format!(
        "# Pins of the parallel port, for stepgen.hal. Addresses and pins: as your breakout board has them.\nloadrt hal_parport cfg=\"{addresses}\"\n"
    );
    for port in 0..ports {
        let _ = writeln!(t, "addf parport.{port}.write base-thread");
    }
    for joint in 0..machine.joints.len() {
        let port = joint / (PINS.len() / 2);
        let first = joint % (PINS.len() / 2) * 2;
        let (step, dir) = (PINS[first], PINS[first + 1]);
        let _ = write!(
            t,
            "net joint-{joint}-step stepgen.{joint}.step => parport.{port}.pin-{step:02}-out\n\
             net joint-{joint}-dir stepgen.{joint}.dir => parport.{port}.pin-{dir:02}-out\n"
        );
    }
    t
}

/// A Mesa card on Ethernet.
pub(crate) fn mesa(machine: &Machine) -> String {
    let count = machine.joints.len();
    let board = "hm2_[HOSTMOT2](BOARD).0";
    let mut t = format!(
        "# Step and direction by a Mesa card; times in ns, as in stepgen.hal. The firmware must have {count} step generators.\n\
         loadrt hostmot2\nloadrt hm2_eth board_ip=[HOSTMOT2](BOARD_IP) config=\"num_encoders=0 num_pwmgens=0 num_stepgens={count}\"\n\
         addf {board}.read servo-thread 1\naddf {board}.write servo-thread\nsetp {board}.watchdog.timeout_ns 5000000\n"
    );
    for joint in 0..count {
        let _ = write!(
            t,
            "\nsetp {board}.stepgen.{joint:02}.step_type 0\nsetp {board}.stepgen.{joint:02}.control-type 0\n\
             setp {board}.stepgen.{joint:02}.position-scale [JOINT_{joint}]SCALE\n\
             setp {board}.stepgen.{joint:02}.steplen [JOINT_{joint}]STEPLEN\nsetp {board}.stepgen.{joint:02}.stepspace [JOINT_{joint}]STEPSPACE\n\
             setp {board}.stepgen.{joint:02}.dirsetup [JOINT_{joint}]DIRSETUP\nsetp {board}.stepgen.{joint:02}.dirhold [JOINT_{joint}]DIRHOLD\n\
             setp {board}.stepgen.{joint:02}.maxvel [JOINT_{joint}]STEPGEN_MAXVEL\nsetp {board}.stepgen.{joint:02}.maxaccel [JOINT_{joint}]STEPGEN_MAXACCEL\n\
             net joint-{joint}-command joint.{joint}.motor-pos-cmd => {board}.stepgen.{joint:02}.position-cmd\n\
             net joint-{joint}-position {board}.stepgen.{joint:02}.position-fb => joint.{joint}.motor-pos-fb\n\
             net joint-{joint}-enable joint.{joint}.amp-enable-out => {board}.stepgen.{joint:02}.enable\n"
        );
    }
    t
}
