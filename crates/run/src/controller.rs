//! The motion controller with its machine: homing, then the program; what stops it, and how.

use crate::feeder::{Feeder, FeederError};
use crate::probing::spindle_config;
use crate::program::Program;
use crate::wiring::{self, Wiring};
use crate::{Options, messages};
use pkm_canon::diagnostic::Diagnostic;
use pkm_hal_sim::{Homing, Observer, Simulation, SimulationConfig, TickError};
use pkm_machine::Machine;

/// Periods in which a machine that stops must have come to rest, and those after which it has.
const MOST_STOPPING: u64 = 1_000_000;
const AT_REST: u64 = 3;

/// A program on a machine, period by period.
pub(crate) struct Controller<'a> {
    program: &'a Program,
    pub(crate) simulation: Simulation,
    pub(crate) feeder: Feeder<'a>,
    homing: Option<Homing>,
    substeps: u64,
}

impl<'a> Controller<'a> {
    /// `switches`: the machine has switches even if nothing asks for them; `spindle`: the program needs one.
    pub(crate) fn new(
        program: &'a Program,
        machine: &'a Machine,
        options: &Options,
        (switches, spindle): (bool, bool),
    ) -> Result<Self, Diagnostic> {
        let substeps = u64::from(options.substeps.max(1));
        let feeder = Feeder::new(program, machine, options)?;
        let switches = switches || options.home || !options.faults.is_empty();
        let wiring = Wiring { substeps, switches, homed: !options.home, seed: 1 };
        let stands = options.start.unwrap_or(machine.home);
        let config = SimulationConfig {
            spindle: spindle.then(|| spindle_config(machine)),
            workpiece: options.workpiece(machine).to_vec(),
            ..wiring::config(machine, stands, wiring)
        };
        let mut simulation = Simulation::new(&config).map_err(|e| messages::host(program, &e.to_string()))?;
        for fault in options.faults {
            simulation.hal_mut().inject(fault).map_err(|e| messages::no_such_pin(program, fault, &e))?;
        }
        let homing = options.home.then(|| {
            let count = machine.joints.len();
            wiring::homing(machine, machine.home, substeps, &simulation.report().setpoint.joints[..count])
        });
        Ok(Self { program, simulation, feeder, homing, substeps })
    }

    pub(crate) fn homing(&self) -> Option<&Homing> {
        self.homing.as_ref()
    }

    pub(crate) fn is_homing(&self) -> bool {
        self.homing.is_some()
    }

    /// Homed, everything driven, at rest.
    pub(crate) fn is_done(&mut self) -> bool {
        self.homing.is_none() && self.simulation.missed_periods() == 0 && self.feeder.is_done()
    }

    /// One servo period.
    ///
    /// # Errors
    /// Why the program cannot go on. [`Self::stop`] brings the machine to rest.
    pub(crate) fn period(&mut self, observers: &mut [&mut dyn Observer]) -> Result<(), Diagnostic> {
        for _ in 0..self.substeps {
            self.substep(observers)?;
        }
        Ok(())
    }

    fn substep(&mut self, observers: &mut [&mut dyn Observer]) -> Result<(), Diagnostic> {
        let line = self.feeder.line();
        let result = match &mut self.homing {
            Some(homing) => match self.simulation.home(homing, observers) {
                Err(TickError::Source(error)) => return Err(messages::homing(self.program, &error)),
                Err(TickError::Fault(fault)) => Err(TickError::Fault(fault)),
                Ok(_) => Ok(()),
            },
            None => self.simulation.tick(&mut self.feeder, observers).map(|_| ()),
        };
        match result {
            Err(TickError::Source(FeederError(diagnostic))) => Err(*diagnostic),
            Err(TickError::Fault(fault)) => Err(messages::fault(self.program, line, &fault)),
            Ok(()) if !self.simulation.drives_on() => {
                Err(messages::emergency_stop(self.program, line, self.simulation.tick_number()))
            }
            Ok(()) => {
                self.homing.take_if(|homing| homing.is_done());
                Ok(())
            }
        }
    }

    /// After a stop: until the drives are off, and the machine is seen to stand.
    pub(crate) fn stop(&mut self, observers: &mut [&mut dyn Observer]) {
        let mut periods = 0;
        while self.simulation.drives_on() && periods < MOST_STOPPING {
            // homing that failed, an aborted program: at rest with the drives on
            let rests = self.simulation.report().setpoint.velocities.iter().all(|v| *v == 0.0);
            if rests && periods >= AT_REST {
                break;
            }
            // what has failed is told already
            let _ = self.simulation.idle(observers);
            periods += 1;
        }
        for _ in 0..AT_REST {
            let _ = self.simulation.idle(observers);
        }
    }
}
