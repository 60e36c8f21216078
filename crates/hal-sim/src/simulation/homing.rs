//! The simulated machine homes: what its switches show, and where its joints' zeros are.

use super::{MOTION, STEPGEN, Simulation, TickError, part};
use crate::component::Setpoint;
use crate::components::motion::Motion;
use crate::components::stepgen::Stepgen;
use crate::homing::{HomeCommand, HomeInput, Homing, HomingError};
use crate::report::{Observer, TickReport};
use pkm_kins::MAX_JOINTS;

impl Simulation {
    /// Runs one servo period of homing.
    ///
    /// # Errors
    /// `Source`: homing failed, all joints stand. `Fault`: as in [`Self::tick_to`].
    pub fn home(
        &mut self,
        homing: &mut Homing,
        observers: &mut [&mut dyn Observer],
    ) -> Result<TickReport<'_>, TickError<HomingError>> {
        let mut inputs = [HomeInput::default(); MAX_JOINTS];
        let mut commands = [HomeCommand::default(); MAX_JOINTS];
        let count = self.lines.len();
        self.home_inputs(&mut inputs);
        homing.tick(&inputs[..count], &mut commands[..count]).map_err(TickError::Source)?;
        let mut setpoint = Setpoint { line: 0, in_position: false, ..self.setpoint };
        for (n, command) in commands[..count].iter().enumerate() {
            if let Some(shift) = command.homed_by {
                self.set_home(n, shift, true);
            }
            setpoint.joints[n] = command.position;
            setpoint.velocities[n] = command.travel / self.period.seconds();
        }
        self.tick_to(&setpoint, observers).map_err(TickError::Fault)
    }

    /// What the home switches showed in the last period.
    fn home_inputs(&mut self, inputs: &mut [HomeInput]) {
        let start = self.period.start().saturating_sub(u64::from(self.period.ticks()));
        let stepgen = part::<Stepgen>(&self.hal, STEPGEN);
        for ((line, generator), input) in self.lines.iter_mut().zip(stepgen.generators()).zip(inputs) {
            let values = self.hal.values();
            let edges = values.edges(line.home_switch);
            let edges = edges.read(&mut line.home_cursor, self.period.start());
            let pulses = values.edges(line.index);
            let pulses = pulses.read(&mut line.index_cursor, self.period.start());
            let cubic = generator.cubic();
            let at = |time: u64| {
                let part = time.saturating_sub(start) as f64 / f64::from(self.period.ticks());
                // at a steady speed; the cubic's own velocities do not matter
                let steps = cubic.at(0.0) + part * (cubic.at(1.0) - cubic.at(0.0));
                (cubic.base as f64 + steps) / line.steps_per_unit - line.offset
            };
            let rises = edges.iter().find(|edge| edge.level);
            let on = values.bit(line.home_switch);
            *input = HomeInput {
                on,
                was_on: on || line.home_on || rises.is_some(),
                made_at: rises.filter(|_| !line.home_on).map(|edge| at(edge.time)),
                index_at: pulses.iter().find(|edge| edge.level).map(|edge| at(edge.time)),
            };
            line.home_on = on;
        }
    }

    /// The joint's zero is from now on where `shift` (mm or rad) was; nothing moves.
    fn set_home(&mut self, n: usize, shift: f64, homed: bool) {
        self.hal.with_component(MOTION, |motion: &mut Motion, values| {
            motion.set_home(values, n, shift, homed);
        });
        self.lines[n].offset += shift;
        self.setpoint.joints[n] -= shift;
        self.states[n].position -= shift;
        self.states[n].commanded -= shift;
    }

    /// Forgets where the joints are, as after a loss of power: their coordinates stay until they are homed.
    pub fn forget_home(&mut self) {
        for n in 0..self.lines.len() {
            self.set_home(n, 0.0, false);
        }
    }
}
