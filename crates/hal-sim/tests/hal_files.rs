//! HAL files as people write them, and what is wrong with others.

use pkm_hal_sim::Value;
use pkm_hal_sim::components::sampler::Sampler;
use pkm_hal_sim::hal_file::Session;

fn run(text: &str) -> (Session, String) {
    let mut session = Session::new(100).unwrap();
    let mut out = String::new();
    if let Err(error) = session.run_file(text, &mut out) {
        panic!("{error}");
    }
    (session, out)
}

fn ticks(session: &mut Session, count: usize) {
    for _ in 0..count {
        session.hal_mut().run(None).unwrap();
    }
}

#[test]
fn a_sine_moves_a_stepper() {
    // in the manner of LinuxCNC's own stepgen demonstrations
    let (mut session, out) = run("
# a signal generator drives a step generator
loadrt threads name1=base-thread period1=50000 fp1=0 name2=servo-thread period2=1000000
loadrt siggen
loadrt stepgen step_type=0,0 ctrl_type=p,p
addf stepgen.make-pulses base-thread
addf stepgen.capture-position servo-thread
addf siggen.0.update servo-thread
addf stepgen.update-freq servo-thread

net position siggen.0.sine => stepgen.0.position-cmd \\
    stepgen.1.position-cmd   # both
setp siggen.0.amplitude 5
setp siggen.0.frequency = 2.0
setp stepgen.0.position-scale 400
setp stepgen.1.position-scale -80
setp stepgen.0.steplen 2000
setp stepgen.0.stepspace 2000
setp stepgen.0.enable 1
setp stepgen.1.enable TRUE
start
getp stepgen.0.position-scale
ptype stepgen.0.counts
gets position
");
    assert!(session.is_running());
    assert_eq!(out, "400\ns32\n0\n");
    // 625 servo periods of 20 base periods: five eighths of 2 Hz beyond one turn, i.e. a quarter of a turn
    ticks(&mut session, 625 * 20 + 1);
    let at = |name: &str| session.hal().getp(name).unwrap();
    let Value::Float(command) = at("siggen.0.sine") else { panic!() };
    let (Value::S32(steps), Value::S32(backwards)) = (at("stepgen.0.counts"), at("stepgen.1.counts")) else {
        panic!()
    };
    assert!((command - 5.0).abs() < 1e-3, "{command}");
    // capture runs before update: it shows the end of the period before
    assert!((f64::from(steps) - 2000.0).abs() <= 1.0, "{steps}");
    assert!((f64::from(backwards) + 400.0).abs() <= 1.0, "{backwards}");
}

#[test]
fn blocks_do_what_their_names_say() {
    // name, inputs set, outputs expected after two periods of 1 ms
    let table = [
        ("and2", "in0=1 in1=1", "out=TRUE"),
        ("and2", "in0=1 in1=0", "out=FALSE"),
        ("or2", "in0=0 in1=1", "out=TRUE"),
        ("or2", "", "out=FALSE"),
        ("xor2", "in0=1 in1=1", "out=FALSE"),
        ("xor2", "in1=1", "out=TRUE"),
        ("not", "", "out=TRUE"),
        ("not", "in=1", "out=FALSE"),
        ("mux2", "in0=2.5 in1=-1", "out=2.5"),
        ("mux2", "in0=2.5 in1=-1 sel=1", "out=-1"),
        ("mux4", "in2=7 sel1=1", "out=7"),
        ("mux4", "in3=8 sel0=1 sel1=1", "out=8"),
        ("lut5", "function=0x80000000 in-0=1 in-1=1 in-2=1 in-3=1 in-4=1", "out=TRUE"),
        ("lut5", "function=0x80000000 in-0=1 in-1=1 in-2=1 in-3=1", "out=FALSE"),
        ("lut5", "function=0x10 in-2=1", "out=TRUE"),
        ("scale", "in=3 gain=2 offset=-1", "out=5"),
        ("sum2", "in0=3 in1=4 gain1=-2 offset=0.5", "out=-4.5"),
        ("mult2", "in0=3 in1=-4", "out=-12"),
        ("comp", "in0=1 in1=2", "out=TRUE equal=FALSE"),
        ("comp", "in0=1 in1=1.4 hyst=1", "out=FALSE equal=TRUE"),
        ("ddt", "in=3", "out=0"),
        ("integ", "in=3 gain=100", "out=0.6"),
        ("integ", "in=3 gain=100 max=0.5", "out=0.5"),
        ("integ", "in=3 reset=1", "out=0"),
        ("limit1", "in=3 max=2", "out=2"),
        ("limit1", "in=-3 min=-2", "out=-2"),
        ("limit3", "in=3 maxv=100 maxa=100000", "out=0.2"),
        ("estop-latch", "ok-in=1", "ok-out=FALSE fault-out=TRUE"),
        ("estop-latch", "ok-in=1 reset=1", "ok-out=TRUE fault-out=FALSE watchdog=FALSE"),
        ("estop-latch", "ok-in=1 reset=1 fault-in=1", "ok-out=FALSE fault-out=TRUE"),
        ("pid", "command=3 feedback=1 Pgain=2 enable=1", "error=2 output=4 saturated=FALSE"),
        ("pid", "command=3 feedback=1 Pgain=2", "error=2 output=0"),
        ("pid", "command=3 Pgain=2 maxoutput=5 enable=1", "output=5 saturated=TRUE"),
        ("pid", "command=3 Pgain=0 Igain=100 enable=1", "output=0.6"),
        ("pid", "command=3 Pgain=0 FF0=2 bias=1 enable=1", "output=7"),
        ("pid", "command=3 deadband=3 enable=1", "error=0 output=0"),
    ];
    for (name, inputs, outputs) in table {
        let mut file = format!("loadrt threads name1=t period1=1000000\nloadrt {name}\n");
        let function = if name == "pid" { "pid.0.do-pid-calcs".to_owned() } else { format!("{name}.0") };
        file += &format!("addf {function} t\n");
        for input in inputs.split_whitespace() {
            file += &format!("setp {name}.0.{}\n", input.replace('=', " "));
        }
        let (mut session, _) = run(&file);
        ticks(&mut session, 2);
        for output in outputs.split_whitespace() {
            let (pin, expected) = output.split_once('=').unwrap();
            let value = session.hal().getp(&format!("{name}.0.{pin}")).unwrap().to_string();
            assert_eq!(value, expected, "{name} {inputs}: {pin}");
        }
    }
}

#[test]
fn the_signal_generator_keeps_its_shapes() {
    let (mut session, _) = run("
loadrt threads name1=t period1=1000000
loadrt siggen
addf siggen.0.update t
setp siggen.0.frequency 125
setp siggen.0.offset 1
");
    let mut rows = Vec::new();
    for _ in 0..9 {
        ticks(&mut session, 1);
        rows.push(["square", "sawtooth", "triangle", "cosine"].map(|wave| {
            match session.hal().getp(&format!("siggen.0.{wave}")).unwrap() {
                Value::Float(value) => (value * 1000.0).round() / 1000.0,
                _ => panic!(),
            }
        }));
    }
    let expected = [
        [2.0, 0.0, 0.0, 2.0],
        [2.0, 0.25, 0.5, 1.707],
        [2.0, 0.5, 1.0, 1.0],
        [2.0, 0.75, 1.5, 0.293],
        [0.0, 1.0, 2.0, 0.0],
        [0.0, 1.25, 1.5, 0.293],
        [0.0, 1.5, 1.0, 1.0],
        [0.0, 1.75, 0.5, 1.707],
        [2.0, 0.0, 0.0, 2.0],
    ];
    assert_eq!(rows, expected);
}

#[test]
fn the_charge_pump_divides() {
    let (mut session, _) = run("
loadrt threads name1=t period1=50000
loadrt charge_pump
addf charge-pump t
");
    let mut levels = String::new();
    for _ in 0..8 {
        ticks(&mut session, 1);
        for pin in ["charge-pump.out", "charge-pump.out-2", "charge-pump.out-4"] {
            levels.push(if session.hal().getp(pin) == Ok(Value::Bit(true)) { '1' } else { '0' });
        }
        levels.push(' ');
    }
    assert_eq!(levels, "100 010 110 001 101 011 111 000 ");
}

#[test]
fn show_lists_what_there_is() {
    let (_, out) = run("
loadrt threads name1=servo-thread period1=1000000
loadrt and2 names=safe
loadrt not count=2
addf not.0 servo-thread
addf safe servo-thread
net go not.0.out => safe.in0
show
");
    let expected = "\
Loaded components:
  and2
  not
  not

Component pins:
  Owner        Type  Dir          Value  Name
  not          bit   IN           FALSE  not.0.in
  not          bit   OUT          FALSE  not.0.out ==> go
  not          bit   IN           FALSE  not.1.in
  not          bit   OUT          FALSE  not.1.out
  and2         bit   IN           FALSE  safe.in0 <== go
  and2         bit   IN           FALSE  safe.in1
  and2         bit   OUT          FALSE  safe.out

Parameters:
  Owner        Type  Dir          Value  Name

Signals:
  Type           Value  Name
  bit            FALSE  go
                          <== not.0.out
                          ==> safe.in0

Functions:
  not.0                          servo-thread
  not.1                          -
  safe                           servo-thread

Threads:
     1000000 ns  servo-thread
               1 not.0
               2 safe

";
    assert_eq!(out, expected);
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let head = "loadrt threads name1=t period1=1000000\nloadrt and2 count=2\nloadrt siggen\nnewsig s float\n";
    let table = [
        ("laodrt and2", "line 5, column 1: there is no command 'laodrt'"),
        ("loadrt", "line 5, column 1: the command is written: loadrt MODULE [OPTION=VALUE ...]"),
        ("loadrt hm2_eth", "line 5, column 8: there is no module 'hm2_eth' here"),
        ("loadrt or2 cuont=2", "line 5, column 12: the module has no option 'cuont'"),
        ("loadrt or2 count=0", "line 5, column 12: the option should be a number from 1 to 16"),
        ("loadrt or2 count=1e3", "line 5, column 12: the option should be a number from 1 to 16"),
        ("loadrt and2", "line 5, column 8: the name 'and2.0.in0' is taken"),
        ("loadrt stepgen", "line 5, column 8: the option 'step_type' is missing"),
        (
            "loadrt stepgen step_type=0,15",
            "line 5, column 16: the option should be a number from 0 to 14 for each channel",
        ),
        ("loadrt threads name1=u", "line 5, column 8: the option 'period1' is missing"),
        (
            "loadrt threads name1=u period1=0",
            "line 5, column 24: the option should be a period in ns, from 1 to 1000000000",
        ),
        (
            "loadrt threads name1=u period1=1500000",
            "line 5, column 8: the period of thread 'u', 1500000 ns, is not a multiple of the first thread's, 1000000 ns",
        ),
        ("addf and2.0 u", "line 5, column 13: there is no thread 'u'"),
        ("addf and2.7 t", "line 5, column 6: there is no function 'and2.7'"),
        ("addf and2.0 t 3", "line 5, column 15: '3' is too much here"),
        ("net x", "line 5, column 1: the command is written: net SIGNAL PIN ..."),
        ("net x and2.0.out and2.0.uot", "line 5, column 18: there is no pin 'and2.0.uot'"),
        (
            "net x and2.0.out and2.1.out",
            "line 5, column 18: signal 'x' is written by 'and2.0.out' already; 'and2.1.out' cannot write it too",
        ),
        ("net s and2.0.out", "line 5, column 5: 's' is of type float, not bit"),
        ("newsig y flaot", "line 5, column 10: 'flaot' is no type; types are bit, float, s32, u32"),
        ("setp siggen.0.amplitude 5mm", "line 5, column 25: '5mm' is no value of type float"),
        ("setp siggen.0.amplitude nan", "line 5, column 25: 'nan' is no value of type float"),
        ("setp siggen.0.amplitude", "line 5, column 1: the command is written: setp NAME VALUE"),
        ("setp siggen.0.sine 1", "line 5, column 6: 'siggen.0.sine' cannot be set: something else writes it"),
        ("net x \\\n  and2.0.out \\\n  nothing", "line 7, column 3: there is no pin 'nothing'"),
        (
            "setp siggen.0.amplitude [JOINT_0]SCALE",
            "line 5, column 25: '[JOINT_0]SCALE': values of an INI file are not supported; write the value",
        ),
        ("setp \"siggen.0.amplitude 1", "line 5, column 6: a quote does not end on this line"),
        (
            "show everything",
            "line 5, column 6: the command is written: show [comp|pin|param|sig|funct|thread|all [PATTERN]]",
        ),
    ];
    for (command, message) in table {
        let mut session = Session::new(100).unwrap();
        let error = session.run_file(&format!("{head}{command}\n"), &mut String::new()).unwrap_err();
        assert_eq!(error.to_string(), message, "{command}");
    }
}

#[test]
fn any_bytes_end_in_an_answer() {
    let seeds =
        ["net \u{e9}\u{e9} \"", "\\", "\"\"", "=> <=", "setp = =", "loadrt = = =", "\t\u{0}\r", "# \\\nnet"];
    for text in seeds {
        let mut session = Session::new(100).unwrap();
        let _ = session.run_file(text, &mut String::new());
    }
}

#[test]
fn the_sampler_keeps_rows_until_they_are_taken() {
    let (mut session, _) = run("
loadrt threads name1=t period1=1000000
loadrt siggen
loadrt sampler cfg=fB depth=5
addf siggen.0.update t
addf sampler.0 t
net saw siggen.0.sawtooth => sampler.0.pin.0
net clock siggen.0.clock => sampler.0.pin.1
setp siggen.0.frequency 125
");
    ticks(&mut session, 3);
    let take = |session: &mut Session| {
        let sampler = session.hal_mut().component_mut::<Sampler>().unwrap();
        let mut rows = String::new();
        while let Some((tick, values)) = sampler.take() {
            rows += &format!("{tick} {} {}\n", values[0], values[1]);
        }
        rows
    };
    assert_eq!(take(&mut session), "1 -1 TRUE\n2 -0.75 TRUE\n3 -0.5 TRUE\n");
    ticks(&mut session, 7);
    assert_eq!(session.hal().getp("sampler.0.overruns"), Ok(Value::S32(2)));
    assert_eq!(session.hal().getp("sampler.0.full"), Ok(Value::Bit(true)));
    assert_eq!(session.hal().getp("sampler.0.curr-depth"), Ok(Value::S32(5)));
    assert_eq!(take(&mut session), "4 -0.25 TRUE\n5 0 FALSE\n6 0.25 FALSE\n7 0.5 FALSE\n8 0.75 FALSE\n");
    session.hal_mut().setp("sampler.0.enable", Value::Bit(false)).unwrap();
    ticks(&mut session, 3);
    assert_eq!(take(&mut session), "");
}
