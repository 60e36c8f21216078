//! `encoder`: counts the phases of an incremental encoder, with index.
//!
//! | pin or parameter                                  | type      | meaning                                        |
//! |---------------------------------------------------|-----------|------------------------------------------------|
//! | `encoder.N.phase-a`, `-b`, `-z`                   | bit in    | the encoder's lines, with edges inside periods |
//! | `encoder.N.counts`                                | s32 out   | four a line; one a line without `x4-mode`; wraps |
//! | `encoder.N.position`, `.velocity`                 | float out | counts / scale, and its change per second      |
//! | `encoder.N.reset`                                 | bit in    | true: counts are 0                             |
//! | `encoder.N.index-enable`                          | bit io    | true: the next rising Z sets counts to 0 and this to false |
//! | `encoder.N.position-scale`                        | float rw  | counts per unit, not 0                         |
//! | `encoder.N.x4-mode`, `.counter-mode`              | bit rw    | counter mode: each rising A counts one up      |
//!
//! Functions: `encoder.update-counters` counts, `encoder.capture-position` shows. A leads B while counts grow.

use crate::component::{Component, Fault, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, FloatPin, S32Pin, Values};

#[derive(Debug, Clone)]
struct Channel {
    /// A, B, Z
    lines: [BitPin; 3],
    cursors: [u64; 3],
    levels: [bool; 3],
    reset: BitPin,
    index_enable: BitPin,
    counts: S32Pin,
    position: FloatPin,
    velocity: FloatPin,
    scale: FloatPin,
    x4_mode: BitPin,
    counter_mode: BitPin,
    /// Changes of state, four a line.
    quarters: i64,
    /// Lines, in counter mode.
    rises: i64,
    last_position: f64,
    /// Edges of a period: time, line, place among the line's, level; kept for its memory.
    edges: Vec<(u64, usize, usize, bool)>,
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Encoders {
    channels: Vec<Channel>,
}

impl Encoders {
    /// Loads the component: pins and functions.
    ///
    /// # Errors
    /// `Taken` if it is loaded already.
    pub fn load(hal: &mut Hal, count: usize) -> Result<(), HalError> {
        let mut channels = Vec::new();
        for n in 0..count {
            let name = |pin: &str| format!("encoder.{n}.{pin}");
            let mut line = |pin: &str| hal.new_bit("encoder", &name(pin), Role::In, false);
            let lines = [line("phase-a")?, line("phase-b")?, line("phase-z")?];
            let reset = line("reset")?;
            channels.push(Channel {
                lines,
                cursors: [0; 3],
                levels: [false; 3],
                reset,
                index_enable: hal.new_bit("encoder", &name("index-enable"), Role::InOut, false)?,
                counts: hal.new_s32("encoder", &name("counts"), Role::Out, 0)?,
                position: hal.new_float("encoder", &name("position"), Role::Out, 0.0)?,
                velocity: hal.new_float("encoder", &name("velocity"), Role::Out, 0.0)?,
                scale: hal.new_float("encoder", &name("position-scale"), Role::Parameter, 1.0)?,
                x4_mode: hal.new_bit("encoder", &name("x4-mode"), Role::Parameter, true)?,
                counter_mode: hal.new_bit("encoder", &name("counter-mode"), Role::Parameter, false)?,
                quarters: 0,
                rises: 0,
                last_position: 0.0,
                edges: Vec::new(),
            });
        }
        let functions = ["encoder.update-counters".to_owned(), "encoder.capture-position".to_owned()];
        hal.add_component(Box::new(Self { channels }), &functions)
    }
}

impl Channel {
    fn zero(&mut self) {
        (self.quarters, self.rises) = (0, 0);
    }

    /// One line changes.
    fn edge(&mut self, line: usize, level: bool, values: &mut Values) {
        if self.levels[line] == level {
            return;
        }
        self.levels[line] = level;
        let [a, b, z] = self.levels;
        match line {
            0 => {
                self.quarters += if a != b { 1 } else { -1 };
                self.rises += i64::from(a);
            }
            1 => self.quarters += if a == b { 1 } else { -1 },
            _ if z && values.bit(self.index_enable) => {
                self.zero();
                values.set_bit(self.index_enable, false);
            }
            _ => {}
        }
    }

    fn update(&mut self, values: &mut Values, end: u64) {
        let mut edges = std::mem::take(&mut self.edges);
        edges.clear();
        for (line, pin) in self.lines.into_iter().enumerate() {
            let fresh = values.edges(pin).read(&mut self.cursors[line], end);
            edges.extend(fresh.iter().enumerate().map(|(place, edge)| (edge.time, line, place, edge.level)));
        }
        // in order of time; A before B before Z at the same time
        edges.sort_unstable();
        for &(_, line, _, level) in &edges {
            self.edge(line, level, values);
        }
        self.edges = edges;
        // lines that are set without edges, by other components
        for (line, pin) in self.lines.into_iter().enumerate() {
            let level = values.bit(pin);
            self.edge(line, level, values);
        }
        if values.bit(self.reset) {
            self.zero();
        }
    }

    fn capture(&mut self, values: &mut Values, seconds: f64) {
        let counts = if values.bit(self.counter_mode) {
            self.rises
        } else if values.bit(self.x4_mode) {
            self.quarters
        } else {
            self.quarters.div_euclid(4)
        };
        let scale = values.float(self.scale);
        let position = if scale == 0.0 { 0.0 } else { counts as f64 / scale };
        values.set_s32(self.counts, counts as i32);
        values.set_float(self.position, position);
        values.set_float(self.velocity, (position - self.last_position) / seconds);
        self.last_position = position;
    }
}

impl Component for Encoders {
    fn name(&self) -> &'static str {
        "encoder"
    }

    fn run(&mut self, function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        for channel in &mut self.channels {
            match function {
                0 => channel.update(values, tick.period.end()),
                _ => channel.capture(values, tick.period.seconds()),
            }
        }
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}
