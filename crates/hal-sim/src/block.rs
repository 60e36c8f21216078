//! Small components: any number of instances, one function each.

use crate::component::{Component, Fault, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, S32Pin, U32Pin, Values};

/// A small component. One instance has its own pins and one function.
pub trait Block: Clone + Send + Sync + 'static {
    /// Name of the module, e.g. `and2`.
    const NAME: &'static str;
    /// What follows the instance's name in the function's name: empty, or e.g. `.update`.
    const FUNCTION: &'static str = "";

    /// Makes the pins.
    ///
    /// # Errors
    /// As [`Hal::new_bit`].
    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError>;

    /// Reads inputs, writes outputs.
    fn update(&mut self, values: &mut Values, tick: &Tick<'_>);
}

/// Makes the pins of one instance: names become `instance.name`.
pub struct BlockPins<'a> {
    hal: &'a mut Hal,
    owner: &'static str,
    instance: &'a str,
}

#[allow(missing_docs)]
impl BlockPins<'_> {
    fn name(&self, pin: &str) -> String {
        format!("{}.{pin}", self.instance)
    }

    pub fn bit_in(&mut self, pin: &str) -> Result<BitPin, HalError> {
        self.hal.new_bit(self.owner, &self.name(pin), Role::In, false)
    }

    pub fn bit_in_true(&mut self, pin: &str) -> Result<BitPin, HalError> {
        self.hal.new_bit(self.owner, &self.name(pin), Role::In, true)
    }

    pub fn bit_out(&mut self, pin: &str) -> Result<BitPin, HalError> {
        self.hal.new_bit(self.owner, &self.name(pin), Role::Out, false)
    }

    pub fn bit_io(&mut self, pin: &str) -> Result<BitPin, HalError> {
        self.hal.new_bit(self.owner, &self.name(pin), Role::InOut, false)
    }

    pub fn float_in(&mut self, pin: &str, value: f64) -> Result<FloatPin, HalError> {
        self.hal.new_float(self.owner, &self.name(pin), Role::In, value)
    }

    pub fn float_out(&mut self, pin: &str) -> Result<FloatPin, HalError> {
        self.hal.new_float(self.owner, &self.name(pin), Role::Out, 0.0)
    }

    pub fn s32_out(&mut self, pin: &str) -> Result<S32Pin, HalError> {
        self.hal.new_s32(self.owner, &self.name(pin), Role::Out, 0)
    }

    pub fn u32_out(&mut self, pin: &str) -> Result<U32Pin, HalError> {
        self.hal.new_u32(self.owner, &self.name(pin), Role::Out, 0)
    }

    pub fn bit_parameter(&mut self, pin: &str) -> Result<BitPin, HalError> {
        self.hal.new_bit(self.owner, &self.name(pin), Role::Parameter, false)
    }

    pub fn float_parameter(&mut self, pin: &str, value: f64) -> Result<FloatPin, HalError> {
        self.hal.new_float(self.owner, &self.name(pin), Role::Parameter, value)
    }

    pub fn u32_parameter(&mut self, pin: &str, value: u32) -> Result<U32Pin, HalError> {
        self.hal.new_u32(self.owner, &self.name(pin), Role::Parameter, value)
    }

    /// Unit of edge times, ns.
    pub fn timer_period_ns(&self) -> u64 {
        self.hal.timer_period_ns()
    }
}

#[derive(Clone)]
struct Instance<B>(B);

impl<B: Block> Component for Instance<B> {
    fn name(&self) -> &'static str {
        B::NAME
    }

    fn run(&mut self, _function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        self.0.update(values, tick);
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}

/// Loads instances of a block under their names, e.g. `and2.0`.
///
/// # Errors
/// `BadName`, `Taken`.
pub fn load<B: Block>(hal: &mut Hal, names: &[String]) -> Result<(), HalError> {
    for instance in names {
        let block = B::new(&mut BlockPins { hal, owner: B::NAME, instance })?;
        hal.add_component(Box::new(Instance(block)), &[format!("{instance}{}", B::FUNCTION)])?;
    }
    Ok(())
}
