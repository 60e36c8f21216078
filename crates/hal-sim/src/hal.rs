//! The HAL: named pins, signals, parameters and functions, and threads that run the functions at fixed periods.
//!
//! Rules, as in LinuxCNC: names have at most 41 characters; a signal has one type and at most one writer (or any
//! number of in/out pins); a pin is linked to one signal at most; a function is on one thread at most; threads are made
//! in order of their periods, and each period is a multiple of the first. Departures: names of pins, parameters,
//! functions, components and threads are lower case; every period is exact, none is rounded.
//!
//! Units at the pins: mm and **degrees**, as in LinuxCNC.

use crate::component::{Component, Fault, Setpoint, Tick};
use crate::faults::{Faults, PinFault};
use crate::hal_error::HalError;
use crate::pins::{check_name, unknown};
use crate::values::{PinType, Values};
use pkm_stepgen::{Period, TimingError};
use std::any::Any;
use std::collections::BTreeMap;

/// Longest name, in characters.
pub const MAX_NAME: usize = 41;

/// Which way data flows through a pin, seen from its component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A pin that reads.
    In,
    /// A pin that writes.
    Out,
    /// A pin that does both.
    InOut,
    /// A parameter that may be set.
    Parameter,
    /// A parameter that only the component writes.
    ReadOnly,
}

/// A pin or parameter as `show` lists it.
#[derive(Debug, Clone)]
pub(crate) struct PinRecord {
    pub(crate) pin_type: PinType,
    pub(crate) role: Role,
    /// Index among the pins of its type.
    pub(crate) index: u32,
    /// Its own cell, where it points while it is not linked.
    pub(crate) own_cell: u32,
    pub(crate) signal: Option<String>,
    pub(crate) owner: &'static str,
}

#[derive(Debug, Clone)]
pub(crate) struct SignalRecord {
    pub(crate) pin_type: PinType,
    pub(crate) cell: u32,
    /// Names of the linked pins, in order of linking.
    pub(crate) pins: Vec<String>,
}

#[derive(Debug, Clone)]
struct FunctionRecord {
    component: usize,
    function: usize,
    thread: Option<String>,
}

/// A thread: functions in order, at a fixed period.
#[derive(Debug, Clone)]
struct Thread {
    name: String,
    period_ns: u64,
    /// Period in base periods, ≥ 1.
    every: u64,
    period: Period,
    ticks: u64,
    /// (component, function)
    run: Vec<(usize, usize)>,
    names: Vec<String>,
}

/// The HAL. `Clone` copies everything, state of the components included.
#[derive(Clone)]
pub struct Hal {
    timer_period_ns: u64,
    pub(crate) values: Values,
    pub(crate) pins: BTreeMap<String, PinRecord>,
    pub(crate) signals: BTreeMap<String, SignalRecord>,
    functions: BTreeMap<String, FunctionRecord>,
    components: Vec<Box<dyn Component>>,
    threads: Vec<Thread>,
    base_ticks: u64,
    faults: Faults,
}

impl Hal {
    /// An empty HAL whose edges have time stamps in units of `timer_period_ns`.
    ///
    /// # Errors
    /// `Timing` if it is 0.
    pub fn new(timer_period_ns: u64) -> Result<Self, HalError> {
        if timer_period_ns == 0 {
            return Err(TimingError::ZeroTimerPeriod.into());
        }
        Ok(Self {
            timer_period_ns,
            values: Values::default(),
            pins: BTreeMap::new(),
            signals: BTreeMap::new(),
            functions: BTreeMap::new(),
            components: Vec::new(),
            threads: Vec::new(),
            base_ticks: 0,
            faults: Faults::default(),
        })
    }

    /// The unit of edge times, ns.
    pub const fn timer_period_ns(&self) -> u64 {
        self.timer_period_ns
    }

    /// The values, for reading and writing by pin.
    pub const fn values(&self) -> &Values {
        &self.values
    }

    /// The values, for reading and writing by pin.
    pub const fn values_mut(&mut self) -> &mut Values {
        &mut self.values
    }

    // ---- components, functions, threads

    /// Adds a component whose pins exist, with the names of its functions in the order of their numbers.
    ///
    /// # Errors
    /// `BadName`, `Taken`.
    pub fn add_component(
        &mut self,
        component: Box<dyn Component>,
        functions: &[String],
    ) -> Result<(), HalError> {
        for name in functions {
            check_name(name, false)?;
            if self.functions.contains_key(name) {
                return Err(HalError::Taken { name: name.clone() });
            }
        }
        let component_index = self.components.len();
        for (function, name) in functions.iter().enumerate() {
            let record = FunctionRecord { component: component_index, function, thread: None };
            self.functions.insert(name.clone(), record);
        }
        self.components.push(component);
        Ok(())
    }

    /// A new thread; the first one made sets the base period.
    ///
    /// # Errors
    /// `BadName`, `Taken`, `ThreadPeriod`, `Timing`.
    pub fn new_thread(&mut self, name: &str, period_ns: u64) -> Result<(), HalError> {
        check_name(name, false)?;
        if self.threads.iter().any(|thread| thread.name == name) {
            return Err(HalError::Taken { name: name.to_owned() });
        }
        let base_period_ns = self.threads.first().map_or(period_ns, |thread| thread.period_ns);
        let last_period_ns = self.threads.last().map_or(0, |thread| thread.period_ns);
        if period_ns == 0 || period_ns < last_period_ns || !period_ns.is_multiple_of(base_period_ns) {
            return Err(HalError::ThreadPeriod { thread: name.to_owned(), period_ns, base_period_ns });
        }
        self.threads.push(Thread {
            name: name.to_owned(),
            period_ns,
            every: period_ns / base_period_ns,
            period: Period::new(0, period_ns, self.timer_period_ns)?,
            ticks: 0,
            run: Vec::new(),
            names: Vec::new(),
        });
        Ok(())
    }

    /// Appends a function to a thread (`addf`).
    ///
    /// # Errors
    /// `Unknown`, `FunctionInUse`.
    pub fn addf(&mut self, function_name: &str, thread_name: &str) -> Result<(), HalError> {
        let thread = self
            .threads
            .iter_mut()
            .find(|thread| thread.name == thread_name)
            .ok_or_else(|| unknown("thread", thread_name))?;
        let function =
            self.functions.get_mut(function_name).ok_or_else(|| unknown("function", function_name))?;
        if let Some(thread) = &function.thread {
            return Err(HalError::FunctionInUse {
                function: function_name.to_owned(),
                thread: thread.clone(),
            });
        }
        function.thread = Some(thread_name.to_owned());
        thread.run.push((function.component, function.function));
        thread.names.push(function_name.to_owned());
        Ok(())
    }

    /// All functions by name, with their thread.
    pub fn functions(&self) -> impl Iterator<Item = (&str, Option<&str>)> {
        self.functions.iter().map(|(name, function)| (name.as_str(), function.thread.as_deref()))
    }

    /// All threads: name, period in ns, functions in order.
    pub fn threads(&self) -> impl Iterator<Item = (&str, u64, &[String])> {
        self.threads.iter().map(|thread| (thread.name.as_str(), thread.period_ns, thread.names.as_slice()))
    }

    /// Names of the components in order of loading.
    pub fn components(&self) -> impl Iterator<Item = &'static str> {
        self.components.iter().map(|component| component.name())
    }

    /// A component by its place in order of loading.
    pub(crate) fn component(&self, index: usize) -> Option<&dyn Component> {
        self.components.get(index).map(AsRef::as_ref)
    }

    /// Works on a component by its place, with the values; nothing happens if it is of another type.
    pub(crate) fn with_component<T: Component>(
        &mut self,
        index: usize,
        work: impl FnOnce(&mut T, &mut Values),
    ) {
        let component = self.components.get_mut(index);
        let component = component.and_then(|component| (component.as_mut() as &mut dyn Any).downcast_mut());
        if let Some(component) = component {
            work(component, &mut self.values);
        }
    }

    /// The first component of a type, e.g. the sampler, to take its rows.
    pub fn component_mut<T: Component>(&mut self) -> Option<&mut T> {
        self.components.iter_mut().find_map(|component| {
            let component: &mut dyn Any = component.as_mut();
            component.downcast_mut()
        })
    }

    /// Runs one period of the first thread, and of each slower thread that is due; faster threads first.
    ///
    /// # Errors
    /// The first [`Fault`] of a component. All functions have run nevertheless, and time has gone on: a component that
    /// refuses leaves its outputs as they were, and the emergency stop works as ever.
    pub fn run(&mut self, setpoint: Option<&Setpoint>) -> Result<(), Fault> {
        let Self { threads, components, values, base_ticks, faults, .. } = self;
        let faulty = faults.begin_and_end(*base_ticks + 1, values);
        let mut result = Ok(());
        for thread in threads {
            if *base_ticks % thread.every != 0 {
                continue;
            }
            thread.ticks += 1;
            let tick = Tick { number: thread.ticks, period: thread.period, setpoint };
            for &(component, function) in &thread.run {
                if faulty {
                    faults.show(values);
                }
                if let Err(fault) = components[component].run(function, values, &tick)
                    && result.is_ok()
                {
                    result = Err(fault);
                }
            }
            thread.period = thread.period.next();
        }
        *base_ticks += 1;
        result
    }

    // ---- faults

    /// Takes all faults away.
    pub fn clear_faults(&mut self) {
        self.faults.clear(&mut self.values);
    }

    /// Puts a fault on an input pin. Ticks are periods of the first thread, counted from 1; a fault whose time has come
    /// already begins with the next period.
    ///
    /// # Errors
    /// `Unknown`: there is no such input pin.
    pub fn inject(&mut self, fault: &PinFault) -> Result<(), HalError> {
        let pin = self.pins.get(&fault.pin).filter(|pin| matches!(pin.role, Role::In | Role::InOut));
        let pin = pin.ok_or_else(|| unknown("input pin", &fault.pin))?;
        self.faults.add(fault, pin.pin_type, pin.index, self.base_ticks + 1, &mut self.values);
        Ok(())
    }
}
