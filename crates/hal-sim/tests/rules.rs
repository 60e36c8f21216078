//! The HAL's rules: names, types, one writer, threads.

use pkm_hal_sim::{BitPin, Component, Fault, FloatPin, Hal, HalError, PinType, Role, Tick, Value, Values};

fn hal() -> Hal {
    let mut hal = Hal::new(100).unwrap();
    for (name, role) in [("a.out", Role::Out), ("b.out", Role::Out), ("c.in", Role::In), ("d.in", Role::In)] {
        hal.new_float("test", name, role, 0.0).unwrap();
    }
    for name in ["e.io", "f.io"] {
        hal.new_float("test", name, Role::InOut, 0.0).unwrap();
    }
    hal.new_bit("test", "g.bit", Role::Out, true).unwrap();
    hal.new_float("test", "h.gain", Role::Parameter, 1.0).unwrap();
    hal.new_s32("test", "i.counts", Role::ReadOnly, -7).unwrap();
    hal.new_u32("test", "j.mask", Role::In, 7).unwrap();
    hal
}

#[test]
fn names_have_41_characters_at_most() {
    let mut hal = hal();
    let longest = "a".repeat(41);
    hal.new_bit("test", &longest, Role::In, false).unwrap();
    for bad in ["", &"a".repeat(42), "A.pin", "a_b", "a b", "é", "a/b", "a\0"] {
        let result = hal.new_bit("test", bad, Role::In, false);
        assert_eq!(result, Err(HalError::BadName { name: bad.to_owned() }));
    }
    // signals are people's own names
    hal.new_signal("X_pos-cmd", PinType::Float).unwrap();
    assert!(hal.new_signal("x=>y", PinType::Float).is_err());
    assert_eq!(
        hal.new_bit("test", "a.out", Role::In, false),
        Err(HalError::Taken { name: "a.out".to_owned() })
    );
    assert_eq!(
        hal.new_signal("X_pos-cmd", PinType::Bit),
        Err(HalError::Taken { name: "X_pos-cmd".to_owned() })
    );
}

#[test]
fn a_signal_has_one_writer() {
    let mut hal = hal();
    hal.net("x", &["a.out", "c.in"]).unwrap();
    let second = HalError::SecondWriter {
        signal: "x".to_owned(),
        writer: "a.out".to_owned(),
        pin: "b.out".to_owned(),
    };
    assert_eq!(hal.net("x", &["d.in", "b.out"]), Err(second.clone()));
    assert_eq!(second.to_string(), "signal 'x' is written by 'a.out' already; 'b.out' cannot write it too");
    // all or nothing: d.in was linked before the refusal and is free again
    hal.net("y", &["b.out", "d.in"]).unwrap();
    assert!(matches!(hal.link("e.io", "x"), Err(HalError::SecondWriter { .. })));
    // any number of in/out pins, but no writer beside them
    hal.net("io", &["e.io", "f.io"]).unwrap();
    let mut other = Hal::new(1).unwrap();
    other.new_float("test", "out", Role::Out, 0.0).unwrap();
    other.new_float("test", "io", Role::InOut, 0.0).unwrap();
    other.net("s", &["io"]).unwrap();
    assert!(matches!(other.link("out", "s"), Err(HalError::SecondWriter { .. })));
}

#[test]
fn links_carry_values_and_types() {
    let mut hal = hal();
    hal.setp("c.in", Value::Float(2.5)).unwrap();
    hal.net("x", &["c.in", "d.in"]).unwrap();
    assert_eq!(hal.getp("d.in"), Ok(Value::Float(2.5)));
    hal.sets("x", Value::Float(-1.0)).unwrap();
    assert_eq!(hal.getp("c.in"), Ok(Value::Float(-1.0)));
    assert_eq!(hal.setp("c.in", Value::Float(0.0)), Err(HalError::NotSettable { name: "c.in".to_owned() }));
    assert!(matches!(hal.link("g.bit", "x"), Err(HalError::WrongType { .. })));
    assert!(matches!(hal.link("h.gain", "x"), Err(HalError::Unknown { .. })));
    assert!(matches!(hal.link("c.in", "nothing"), Err(HalError::Unknown { .. })));
    assert!(matches!(hal.link("nothing", "x"), Err(HalError::Unknown { .. })));
    hal.new_signal("y", PinType::Float).unwrap();
    assert!(matches!(hal.link("c.in", "y"), Err(HalError::Linked { .. })));
    hal.unlink("c.in").unwrap();
    assert_eq!(hal.getp("c.in"), Ok(Value::Float(-1.0)));
    hal.setp("c.in", Value::Float(9.0)).unwrap();
    assert_eq!(hal.gets("x"), Ok(Value::Float(-1.0)));
    // a net that fails leaves no signal behind
    assert!(hal.net("z", &["g.bit", "j.mask"]).is_err());
    assert!(hal.gets("z").is_err());
    assert_eq!(hal.getp("g.bit"), Ok(Value::Bit(true)));
}

#[test]
fn only_finite_numbers_of_the_right_type_can_be_set() {
    let mut hal = hal();
    hal.setp("h.gain", Value::Float(3.0)).unwrap();
    for value in [f64::NAN, f64::INFINITY] {
        let refused = Err(HalError::NotFinite { name: "h.gain".to_owned() });
        assert_eq!(hal.setp("h.gain", Value::Float(value)), refused);
    }
    assert!(matches!(hal.setp("h.gain", Value::S32(1)), Err(HalError::WrongType { .. })));
    assert!(matches!(hal.setp("i.counts", Value::S32(1)), Err(HalError::NotSettable { .. })));
    assert!(matches!(hal.setp("a.out", Value::Float(1.0)), Err(HalError::NotSettable { .. })));
    hal.net("x", &["a.out"]).unwrap();
    assert!(matches!(hal.sets("x", Value::Float(1.0)), Err(HalError::NotSettable { .. })));
    assert_eq!(hal.getp("h.gain"), Ok(Value::Float(3.0)));
}

/// out = in + 1, counting its runs.
#[derive(Clone)]
struct AddOne {
    input: FloatPin,
    output: FloatPin,
    alarm: BitPin,
}

impl Component for AddOne {
    fn name(&self) -> &'static str {
        "add-one"
    }

    fn run(&mut self, _function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        let sum = values.float(self.input) + 1.0;
        values.set_float(self.output, sum);
        values.set_bit(self.alarm, tick.number % 2 == 1);
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}

fn add_one(hal: &mut Hal, n: usize) {
    let component = AddOne {
        input: hal.new_float("add-one", &format!("add-one.{n}.in"), Role::In, 0.0).unwrap(),
        output: hal.new_float("add-one", &format!("add-one.{n}.out"), Role::Out, 0.0).unwrap(),
        alarm: hal.new_bit("add-one", &format!("add-one.{n}.odd"), Role::Out, false).unwrap(),
    };
    hal.add_component(Box::new(component), &[format!("add-one.{n}")]).unwrap();
}

#[test]
fn functions_run_in_order_at_their_periods() {
    let mut hal = Hal::new(1000).unwrap();
    for n in 0..3 {
        add_one(&mut hal, n);
    }
    hal.new_thread("base-thread", 50_000).unwrap();
    hal.new_thread("servo-thread", 200_000).unwrap();
    hal.net("first", &["add-one.0.out", "add-one.1.in"]).unwrap();
    hal.net("loop", &["add-one.1.out", "add-one.0.in"]).unwrap();
    // 1 before 0: what 0 makes is seen by 1 one period later
    hal.addf("add-one.1", "base-thread").unwrap();
    hal.addf("add-one.0", "base-thread").unwrap();
    hal.addf("add-one.2", "servo-thread").unwrap();
    let in_use = HalError::FunctionInUse { function: "add-one.0".into(), thread: "base-thread".into() };
    assert_eq!(hal.addf("add-one.0", "servo-thread"), Err(in_use));
    assert!(matches!(hal.addf("nothing", "servo-thread"), Err(HalError::Unknown { .. })));
    assert!(matches!(hal.addf("add-one.2", "nothing"), Err(HalError::Unknown { .. })));
    hal.run(None).unwrap();
    assert_eq!((hal.gets("first"), hal.gets("loop")), (Ok(Value::Float(2.0)), Ok(Value::Float(1.0))));
    // the slow thread runs in the first of every four base periods
    let mut odd = Vec::new();
    for _ in 0..8 {
        odd.push(hal.getp("add-one.2.odd").unwrap() == Value::Bit(true));
        hal.run(None).unwrap();
    }
    assert_eq!(odd, [true, true, true, true, false, false, false, false]);
}

#[test]
fn thread_periods_are_checked() {
    let mut hal = Hal::new(1000).unwrap();
    assert!(matches!(hal.new_thread("t", 0), Err(HalError::ThreadPeriod { .. })));
    assert!(matches!(hal.new_thread("t", 1500), Err(HalError::Timing(_))));
    hal.new_thread("base-thread", 50_000).unwrap();
    assert!(matches!(hal.new_thread("servo-thread", 20_000), Err(HalError::ThreadPeriod { .. })));
    assert!(matches!(hal.new_thread("servo-thread", 75_000), Err(HalError::ThreadPeriod { .. })));
    assert!(matches!(hal.new_thread("base-thread", 100_000), Err(HalError::Taken { .. })));
    hal.new_thread("servo-thread", 1_000_000).unwrap();
    assert!(Hal::new(0).is_err());
}
