//! Faults on pins: each kind does what it says; after any of them the machine stands or goes on, and can be used again.

mod common;

use common::machine;
use pkm_hal_sim::hal_file::Session;
use pkm_hal_sim::{FaultTextError, HalError, PinFault, Role, Setpoint, Simulation, Value};

#[test]
fn faults_are_text() {
    for text in [
        "12,joint.0.motor-pos-fb,freeze",
        "12+3,a.b,set=-1.5",
        "1,a,set=true",
        "1,a,set=false",
        "1,a,offset=0.25",
        "7,a,invert",
        "7,a,nan",
        "7,a,inf",
    ] {
        assert_eq!(text.parse::<PinFault>().unwrap().to_string(), text);
    }
    let tick = |text: &str| Err(FaultTextError::Tick(text.to_owned()));
    let kind = |text: &str| Err(FaultTextError::Kind(text.to_owned()));
    assert_eq!("12,a".parse::<PinFault>(), Err(FaultTextError::Parts));
    assert_eq!("0,a,nan".parse::<PinFault>(), tick("0"));
    assert_eq!("1+0,a,nan".parse::<PinFault>(), tick("1+0"));
    assert_eq!("-1,a,nan".parse::<PinFault>(), tick("-1"));
    assert_eq!("1,a,set".parse::<PinFault>(), kind("set"));
    assert_eq!("1,a,set=nan".parse::<PinFault>(), kind("set=nan"));
    assert_eq!("1,a,explode".parse::<PinFault>(), kind("explode"));
}

#[test]
fn a_reader_sees_its_fault_for_its_time() {
    let mut session = Session::new(1000).unwrap();
    let file = "
loadrt threads name1=t period1=1000000
loadrt siggen
loadrt scale count=2
addf siggen.0.update t
addf scale.0 t
addf scale.1 t
net x siggen.0.sawtooth scale.0.in scale.1.in
setp scale.0.gain 1
setp scale.1.gain 1
setp siggen.0.frequency 62.5
setp siggen.0.offset 1
setp siggen.0.amplitude 8
";
    session.run_file(file, &mut String::new()).unwrap();
    // the sawtooth is −7, −6, ... at ticks 1, 2, ...
    for fault in [
        "3+1,scale.0.in,set=100",
        "4+2,scale.0.in,freeze",
        "5+2,scale.0.in,offset=0.5",
        "8+1,scale.0.in,invert",
        "9,scale.0.in,nan",
    ] {
        session.hal_mut().inject(&fault.parse().unwrap()).unwrap();
    }
    let mut seen = Vec::new();
    for tick in 1..=10 {
        session.hal_mut().run(None).unwrap();
        assert_eq!(session.hal().getp("scale.1.out"), Ok(Value::Float(f64::from(tick) - 8.0)));
        seen.push(session.hal().getp("scale.0.out").unwrap().to_string());
    }
    // frozen before tick 4 (at −5), at tick 5 with the offset on top; then the offset alone
    assert_eq!(seen, ["-7", "-6", "100", "-5", "-4.5", "-1.5", "-1", "0", "NaN", "NaN"]);
    for pin in ["scale.0.out", "scale.0.nothing"] {
        let fault = PinFault { pin: pin.to_owned(), ..fault_at(1) };
        let unknown = HalError::Unknown { what: "input pin", name: pin.to_owned() };
        assert_eq!(session.hal_mut().inject(&fault), Err(unknown));
    }
}

fn fault_at(tick: u64) -> PinFault {
    format!("{tick},x,nan").parse().unwrap()
}

fn hash(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// No output is anything but a finite number.
fn all_finite(simulation: &Simulation, context: &str) {
    for (name, _, role, value, ..) in simulation.hal().pins() {
        if let Value::Float(number) = value
            && role == Role::Out
        {
            assert!(number.is_finite(), "{context}: {name} is {number}");
        }
    }
    assert!(simulation.feedback().iter().all(|joint| joint.is_finite()), "{context}");
}

#[test]
fn any_single_fault_ends_well() {
    let (mut good, mut source) = machine(2);
    for n in 0..2 {
        good.hal_mut().setp(&format!("joint.{n}.f-error-lim"), Value::Float(0.05)).unwrap();
    }
    let inputs: Vec<String> = good
        .hal()
        .pins()
        .filter(|(_, _, role, ..)| *role == Role::In)
        .map(|(name, ..)| name.to_owned())
        .collect();
    assert!(inputs.len() > 15, "{inputs:?}");
    for _ in 0..300 {
        good.tick(&mut source, &mut []).unwrap();
    }
    let scale = std::env::var("PKM_TEST_SCALE").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let (mut stopped, mut went_on) = (0, 0);
    for seed in 0..1500 * scale {
        let pick = |salt: u64, below: u64| hash(seed * 16 + salt) % below;
        let kinds =
            ["set=0", "set=1", "set=1000", "freeze", "invert", "offset=1", "offset=-0.3", "nan", "inf"];
        let time = match pick(0, 2) {
            0 => format!("{}", 301 + pick(1, 40)),
            _ => format!("{}+{}", 301 + pick(1, 40), 1 + pick(2, 20)),
        };
        let pin = &inputs[pick(3, inputs.len() as u64) as usize];
        let text = format!("{time},{pin},{}", kinds[pick(4, kinds.len() as u64) as usize]);
        let context = format!("seed {seed}: {text}");
        let mut simulation = good.clone();
        simulation.hal_mut().inject(&text.parse().unwrap()).unwrap();
        let fault = (0..80).find_map(|_| {
            let result = simulation.tick(&mut source, &mut []).err();
            all_finite(&simulation, &context);
            result
        });
        if fault.is_some() {
            stopped += 1;
            // all joints stand from the next period on
            let _ = simulation.idle(&mut []);
            let stands = simulation.feedback();
            for _ in 0..5 {
                let _ = simulation.idle(&mut []);
                all_finite(&simulation, &context);
            }
            assert_eq!(simulation.feedback(), stands, "{context}: {fault:?}");
        } else {
            went_on += 1;
        }
        let wires = ["step", "dir"].iter().any(|line| pin.ends_with(&format!(".{line}")));
        for statistics in simulation.statistics() {
            assert!(wires || statistics.violations.total() == 0, "{context}: {statistics:?}");
        }
    }
    assert!(stopped > 300 && went_on > 300, "{stopped} {went_on}");
}

#[test]
fn after_a_fault_has_passed_the_machine_is_usable() {
    for text in [
        "310+5,stepgen.1.position-cmd,nan",
        "310+5,joint.0.motor-pos-fb,inf",
        "310+5,joint.1.pos-lim-sw-in,set=1",
    ] {
        let (mut simulation, mut source) = machine(2);
        simulation.hal_mut().inject(&text.parse().unwrap()).unwrap();
        let fault = (0..400).find_map(|_| simulation.tick(&mut source, &mut []).err());
        let fault = fault.unwrap_or_else(|| panic!("{text}: nothing happened")).to_string();
        assert!(fault.contains("at tick 310"), "{text}: {fault}");
        for _ in 0..20 {
            let _ = simulation.idle(&mut []);
        }
        simulation.reset();
        let mut setpoint = Setpoint { joints: simulation.feedback(), ..Setpoint::default() };
        simulation.tick_to(&setpoint, &mut []).unwrap();
        for _ in 0..100 {
            setpoint.joints[1] += 0.01;
            setpoint.velocities[1] = 10.0;
            simulation.tick_to(&setpoint, &mut []).unwrap();
        }
        assert!(simulation.report().joints[1].step_error.abs() <= 0.5, "{text}");
        assert!((simulation.feedback()[1] - setpoint.joints[1]).abs() <= 0.5 / 400.0 + 1e-9, "{text}");
    }
}
