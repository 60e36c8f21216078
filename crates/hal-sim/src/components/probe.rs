//! `probe`: a simulated touch probe: on while the tool is inside a workpiece of boxes.
//!
//! | pin                               | type     | meaning                                          |
//! |-----------------------------------|----------|--------------------------------------------------|
//! | `probe.0.x`, `.y`, `.z`           | float in | where the tool is, mm                            |
//! | `probe.0.tripped`                 | bit out  | it touches (to be linked to `motion.probe-input`) |
//!
//! Function: `probe.0.update`. The surface of a box belongs to it. No bounce, no delay but that of the period.

use crate::component::{Component, Fault, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, Values};
use pkm_kins::JointRange;

/// A box: what it takes up of X, Y and Z, mm; a half-space has infinite sides.
pub type Solid = [JointRange; 3];

/// True if a point is inside or on the surface of one of the boxes.
pub fn touches(workpiece: &[Solid], point: [f64; 3]) -> bool {
    let inside = |solid: &Solid| {
        solid.iter().zip(point).all(|(range, value)| (range.min..=range.max).contains(&value))
    };
    workpiece.iter().any(inside)
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Probe {
    workpiece: Vec<Solid>,
    point: [FloatPin; 3],
    tripped: BitPin,
}

impl Probe {
    /// Loads the component.
    ///
    /// # Errors
    /// `Taken` if it is loaded already.
    pub fn load(hal: &mut Hal, workpiece: &[Solid]) -> Result<(), HalError> {
        let mut float = |pin: &str| hal.new_float("probe", pin, Role::In, 0.0);
        let probe = Self {
            workpiece: workpiece.to_vec(),
            point: [float("probe.0.x")?, float("probe.0.y")?, float("probe.0.z")?],
            tripped: hal.new_bit("probe", "probe.0.tripped", Role::Out, false)?,
        };
        hal.add_component(Box::new(probe), &["probe.0.update".to_owned()])
    }
}

impl Component for Probe {
    fn name(&self) -> &'static str {
        "probe"
    }

    fn run(&mut self, _function: usize, values: &mut Values, _tick: &Tick<'_>) -> Result<(), Fault> {
        let point = self.point.map(|pin| values.float(pin));
        values.set_bit(self.tripped, touches(&self.workpiece, point));
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touches_half_spaces_and_boxes() {
        let all = JointRange { min: f64::NEG_INFINITY, max: f64::INFINITY };
        let table = [all, all, JointRange { min: f64::NEG_INFINITY, max: -5.0 }];
        let side = |min, max| JointRange { min, max };
        let block = [side(10.0, 40.0), side(0.0, 20.0), side(-5.0, 8.0)];
        let workpiece = [table, block];
        for (point, touching) in [
            ([0.0, 0.0, -4.999], false),
            ([0.0, 0.0, -5.0], true),
            ([10.0, 20.0, 8.0], true),
            ([9.999, 20.0, 8.0], false),
            ([f64::NAN, 0.0, 0.0], false),
        ] {
            assert_eq!(touches(&workpiece, point), touching, "{point:?}");
        }
        assert!(!touches(&[], [0.0; 3]));
    }
}
