//! Pins, parameters and signals of the HAL.

use crate::hal::{Hal, MAX_NAME, PinRecord, Role, SignalRecord};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, PinType, S32Pin, U32Pin, Value};

pub(crate) fn check_name(name: &str, signal: bool) -> Result<(), HalError> {
    let good =
        |c: char| matches!(c, 'a'..='z' | '0'..='9' | '.' | '-') || (signal && matches!(c, 'A'..='Z' | '_'));
    if name.is_empty() || name.len() > MAX_NAME || !name.chars().all(good) {
        return Err(HalError::BadName { name: name.to_owned() });
    }
    Ok(())
}

pub(crate) fn unknown(what: &'static str, name: &str) -> HalError {
    HalError::Unknown { what, name: name.to_owned() }
}

impl Hal {
    // ---- pins and parameters

    fn new_pin(
        &mut self,
        owner: &'static str,
        name: &str,
        role: Role,
        value: Value,
    ) -> Result<u32, HalError> {
        check_name(name, false)?;
        if self.pins.contains_key(name) {
            return Err(HalError::Taken { name: name.to_owned() });
        }
        let values = &mut self.values;
        let index = match value {
            Value::Bit(value) => {
                let index = values.bits.pin(value);
                values.edges.resize_with(values.bits.cells.len(), Default::default);
                index
            }
            Value::Float(value) => values.floats.pin(value),
            Value::S32(value) => values.s32s.pin(value),
            Value::U32(value) => values.u32s.pin(value),
        };
        let own_cell = values.pin_cells(value.pin_type())[index as usize];
        let record = PinRecord { pin_type: value.pin_type(), role, index, own_cell, signal: None, owner };
        self.pins.insert(name.to_owned(), record);
        Ok(index)
    }

    /// A new bit pin or parameter.
    ///
    /// # Errors
    /// `BadName`, `Taken`.
    pub fn new_bit(
        &mut self,
        owner: &'static str,
        name: &str,
        role: Role,
        value: bool,
    ) -> Result<BitPin, HalError> {
        self.new_pin(owner, name, role, Value::Bit(value)).map(BitPin)
    }

    /// A new float pin or parameter.
    ///
    /// # Errors
    /// `BadName`, `Taken`.
    pub fn new_float(
        &mut self,
        owner: &'static str,
        name: &str,
        role: Role,
        value: f64,
    ) -> Result<FloatPin, HalError> {
        self.new_pin(owner, name, role, Value::Float(value)).map(FloatPin)
    }

    /// A new signed integer pin or parameter.
    ///
    /// # Errors
    /// `BadName`, `Taken`.
    pub fn new_s32(
        &mut self,
        owner: &'static str,
        name: &str,
        role: Role,
        value: i32,
    ) -> Result<S32Pin, HalError> {
        self.new_pin(owner, name, role, Value::S32(value)).map(S32Pin)
    }

    /// A new unsigned integer pin or parameter.
    ///
    /// # Errors
    /// `BadName`, `Taken`.
    pub fn new_u32(
        &mut self,
        owner: &'static str,
        name: &str,
        role: Role,
        value: u32,
    ) -> Result<U32Pin, HalError> {
        self.new_pin(owner, name, role, Value::U32(value)).map(U32Pin)
    }

    /// Value of a pin or parameter (`getp`).
    ///
    /// # Errors
    /// `Unknown`.
    pub fn getp(&self, name: &str) -> Result<Value, HalError> {
        let pin = self.pins.get(name).ok_or_else(|| unknown("pin or parameter", name))?;
        let cell = match &pin.signal {
            Some(signal) => self.signals[signal].cell,
            None => pin.own_cell,
        };
        Ok(self.values.cell(pin.pin_type, cell))
    }

    /// Sets a parameter, or an input pin that is not linked (`setp`).
    ///
    /// # Errors
    /// `Unknown`, `WrongType`, `NotSettable`, `NotFinite`.
    pub fn setp(&mut self, name: &str, value: Value) -> Result<(), HalError> {
        let pin = self.pins.get(name).ok_or_else(|| unknown("pin or parameter", name))?;
        if matches!(pin.role, Role::Out | Role::ReadOnly) || pin.signal.is_some() {
            return Err(HalError::NotSettable { name: name.to_owned() });
        }
        check_value(name, pin.pin_type, value)?;
        self.values.set_cell(pin.own_cell, value);
        Ok(())
    }

    /// Type of a pin or parameter.
    ///
    /// # Errors
    /// `Unknown`.
    pub fn pin_type(&self, name: &str) -> Result<PinType, HalError> {
        self.pins.get(name).map(|pin| pin.pin_type).ok_or_else(|| unknown("pin or parameter", name))
    }

    fn pin_index(&self, name: &str, expected: PinType) -> Result<u32, HalError> {
        let pin = self.pins.get(name).ok_or_else(|| unknown("pin or parameter", name))?;
        if pin.pin_type != expected {
            return Err(HalError::WrongType {
                name: name.to_owned(),
                expected: pin.pin_type,
                found: expected,
            });
        }
        Ok(pin.index)
    }

    /// A bit pin by name, to read it fast.
    ///
    /// # Errors
    /// `Unknown`, `WrongType`.
    pub fn bit_pin(&self, name: &str) -> Result<BitPin, HalError> {
        self.pin_index(name, PinType::Bit).map(BitPin)
    }

    /// A float pin by name, to read it fast.
    ///
    /// # Errors
    /// `Unknown`, `WrongType`.
    pub fn float_pin(&self, name: &str) -> Result<FloatPin, HalError> {
        self.pin_index(name, PinType::Float).map(FloatPin)
    }

    /// All pins and parameters by name: type, role, value, signal.
    pub fn pins(&self) -> impl Iterator<Item = (&str, PinType, Role, Value, Option<&str>, &'static str)> {
        self.pins.iter().map(|(name, pin)| {
            let cell = pin.signal.as_ref().map_or(pin.own_cell, |signal| self.signals[signal].cell);
            let value = self.values.cell(pin.pin_type, cell);
            (name.as_str(), pin.pin_type, pin.role, value, pin.signal.as_deref(), pin.owner)
        })
    }

    // ---- signals

    /// A new signal.
    ///
    /// # Errors
    /// `BadName`, `Taken`.
    pub fn new_signal(&mut self, name: &str, pin_type: PinType) -> Result<(), HalError> {
        check_name(name, true)?;
        if self.signals.contains_key(name) {
            return Err(HalError::Taken { name: name.to_owned() });
        }
        let cell = self.values.new_cell(match pin_type {
            PinType::Bit => Value::Bit(false),
            PinType::Float => Value::Float(0.0),
            PinType::S32 => Value::S32(0),
            PinType::U32 => Value::U32(0),
        });
        self.signals.insert(name.to_owned(), SignalRecord { pin_type, cell, pins: Vec::new() });
        Ok(())
    }

    /// Links a pin to a signal. The first pin gives the signal its value. Linking twice to the same signal is no change.
    ///
    /// # Errors
    /// `Unknown`, `WrongType`, `Linked`, `SecondWriter`; a parameter is no pin.
    pub fn link(&mut self, pin_name: &str, signal_name: &str) -> Result<(), HalError> {
        let pin = self.pins.get(pin_name).ok_or_else(|| unknown("pin", pin_name))?.clone();
        let signal = self.signals.get(signal_name).ok_or_else(|| unknown("signal", signal_name))?;
        if matches!(pin.role, Role::Parameter | Role::ReadOnly) {
            return Err(unknown("pin", pin_name));
        }
        match &pin.signal {
            Some(linked) if linked == signal_name => return Ok(()),
            Some(linked) => {
                return Err(HalError::Linked { pin: pin_name.to_owned(), signal: linked.clone() });
            }
            None => {}
        }
        if pin.pin_type != signal.pin_type {
            return Err(HalError::WrongType {
                name: signal_name.to_owned(),
                expected: signal.pin_type,
                found: pin.pin_type,
            });
        }
        let clashes = |other: &&String| {
            matches!(
                (pin.role, self.pins[*other].role),
                (Role::Out, Role::Out | Role::InOut) | (Role::InOut, Role::Out)
            )
        };
        if let Some(writer) = signal.pins.iter().find(clashes) {
            return Err(HalError::SecondWriter {
                signal: signal_name.to_owned(),
                writer: writer.clone(),
                pin: pin_name.to_owned(),
            });
        }
        let (cell, first) = (signal.cell, signal.pins.is_empty());
        if first || pin.role == Role::Out {
            self.values.set_cell(cell, self.values.cell(pin.pin_type, pin.own_cell));
        }
        self.values.pin_cells_mut(pin.pin_type)[pin.index as usize] = cell;
        if let Some(record) = self.pins.get_mut(pin_name) {
            record.signal = Some(signal_name.to_owned());
        }
        if let Some(record) = self.signals.get_mut(signal_name) {
            record.pins.push(pin_name.to_owned());
        }
        Ok(())
    }

    /// Takes a pin off its signal; it keeps the signal's value.
    ///
    /// # Errors
    /// `Unknown`.
    pub fn unlink(&mut self, pin_name: &str) -> Result<(), HalError> {
        let value = self.getp(pin_name)?;
        let pin = self.pins.get_mut(pin_name).ok_or_else(|| unknown("pin", pin_name))?;
        let (pin_type, index, own_cell) = (pin.pin_type, pin.index, pin.own_cell);
        if let Some(signal) = pin.signal.take().and_then(|name| self.signals.get_mut(&name)) {
            signal.pins.retain(|name| name != pin_name);
            self.values.set_cell(own_cell, value);
            self.values.pin_cells_mut(pin_type)[index as usize] = own_cell;
        }
        Ok(())
    }

    /// Makes the signal if it does not exist (with the type of the first pin) and links the pins to it. All or nothing.
    ///
    /// # Errors
    /// As [`Self::link`].
    pub fn net(&mut self, signal_name: &str, pin_names: &[&str]) -> Result<(), HalError> {
        let existed = self.signals.contains_key(signal_name);
        if !existed {
            let first = pin_names.first().ok_or_else(|| unknown("signal", signal_name))?;
            let pin_type = self.pins.get(*first).ok_or_else(|| unknown("pin", first))?.pin_type;
            self.new_signal(signal_name, pin_type)?;
        }
        let mut linked = Vec::new();
        for pin in pin_names {
            let fresh = self.pins.get(*pin).is_some_and(|record| record.signal.is_none());
            if let Err(error) = self.link(pin, signal_name) {
                for pin in linked {
                    self.unlink(pin)?;
                }
                if !existed {
                    self.signals.remove(signal_name);
                }
                return Err(error);
            }
            if fresh {
                linked.push(pin);
            }
        }
        Ok(())
    }

    /// Value of a signal (`gets`).
    ///
    /// # Errors
    /// `Unknown`.
    pub fn gets(&self, name: &str) -> Result<Value, HalError> {
        let signal = self.signals.get(name).ok_or_else(|| unknown("signal", name))?;
        Ok(self.values.cell(signal.pin_type, signal.cell))
    }

    /// Sets a signal that has no writer (`sets`).
    ///
    /// # Errors
    /// `Unknown`, `WrongType`, `NotSettable`, `NotFinite`.
    pub fn sets(&mut self, name: &str, value: Value) -> Result<(), HalError> {
        let signal = self.signals.get(name).ok_or_else(|| unknown("signal", name))?;
        if signal.pins.iter().any(|pin| self.pins[pin].role == Role::Out) {
            return Err(HalError::NotSettable { name: name.to_owned() });
        }
        check_value(name, signal.pin_type, value)?;
        self.values.set_cell(signal.cell, value);
        Ok(())
    }

    /// All signals by name: type, value, linked pins in order of linking with their roles.
    pub fn signals(&self) -> impl Iterator<Item = (&str, PinType, Value, Vec<(&str, Role)>)> {
        self.signals.iter().map(|(name, signal)| {
            let pins = signal.pins.iter().map(|pin| (pin.as_str(), self.pins[pin].role)).collect();
            (name.as_str(), signal.pin_type, self.values.cell(signal.pin_type, signal.cell), pins)
        })
    }
}

fn check_value(name: &str, expected: PinType, value: Value) -> Result<(), HalError> {
    if value.pin_type() != expected {
        return Err(HalError::WrongType { name: name.to_owned(), expected, found: value.pin_type() });
    }
    match value {
        Value::Float(number) if !number.is_finite() => Err(HalError::NotFinite { name: name.to_owned() }),
        _ => Ok(()),
    }
}
