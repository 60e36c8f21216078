//! Step types: what a step does to the lines. Numbers and sequences are those of LinuxCNC's `stepgen` (the quadrature
//! begins with both lines low).
//!
//! | number | lines              | one step is                                                             |
//! |--------|--------------------|-------------------------------------------------------------------------|
//! | 0      | step, dir          | a pulse on step                                                         |
//! | 1      | up, down           | a pulse on up or on down                                                |
//! | 2      | A B                | the next state of a quadrature                                          |
//! | 3-14   | A B C (D (E))      | the next state of a table for three, four or five phases, full or half steps |
//!
//! With 1 and above, direction setup and hold together are the least time between steps in opposite directions; with 2
//! and above a state lasts the step length at least, the step space has no meaning.

/// Lines of a phase table, at most.
pub const MAX_PHASES: usize = 5;

/// See the module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepType {
    /// Type 0.
    StepDir,
    /// Type 1.
    UpDown,
    /// Types 2 to 14.
    Phases(Phases),
}

/// States that follow each other while the joint moves forward; bit n is line n.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Phases {
    lines: u8,
    states: &'static [u8],
}

/// A leads B while the joint moves forward; both are low at step 0.
pub const QUADRATURE: Phases = Phases { lines: 2, states: &[0b00, 0b01, 0b11, 0b10] };

const TABLES: [Phases; 13] = [
    QUADRATURE,
    // three phases: full, half
    Phases { lines: 3, states: &[0b001, 0b010, 0b100] },
    Phases { lines: 3, states: &[0b001, 0b011, 0b010, 0b110, 0b100, 0b101] },
    // four phases: one coil on, two coils on, bipolar one, bipolar two
    Phases { lines: 4, states: &[0b0001, 0b0010, 0b0100, 0b1000] },
    Phases { lines: 4, states: &[0b0011, 0b0110, 0b1100, 0b1001] },
    Phases { lines: 4, states: &[0b0001, 0b0111, 0b1110, 0b1000] },
    Phases { lines: 4, states: &[0b0101, 0b0110, 0b1010, 0b1001] },
    // four phases, half steps: unipolar, bipolar
    Phases { lines: 4, states: &[0b0001, 0b0011, 0b0010, 0b0110, 0b0100, 0b1100, 0b1000, 0b1001] },
    Phases { lines: 4, states: &[0b0001, 0b0101, 0b0111, 0b0110, 0b1110, 0b1010, 0b1000, 0b1001] },
    // five phases: one coil on, two coils on, half steps, half steps with two or three on
    Phases { lines: 5, states: &[0b00001, 0b00010, 0b00100, 0b01000, 0b10000] },
    Phases { lines: 5, states: &[0b00011, 0b00110, 0b01100, 0b11000, 0b10001] },
    Phases {
        lines: 5,
        states: &[0b00001, 0b00011, 0b00010, 0b00110, 0b00100, 0b01100, 0b01000, 0b11000, 0b10000, 0b10001],
    },
    Phases {
        lines: 5,
        states: &[0b00011, 0b00111, 0b00110, 0b01110, 0b01100, 0b11100, 0b11000, 0b11001, 0b10001, 0b10011],
    },
];

impl StepType {
    /// The step type with a number of LinuxCNC's; None beyond 14.
    pub const fn from_number(number: usize) -> Option<Self> {
        match number {
            0 => Some(Self::StepDir),
            1 => Some(Self::UpDown),
            2..=14 => Some(Self::Phases(TABLES[number - 2])),
            _ => None,
        }
    }

    /// Number of lines.
    pub const fn lines(&self) -> usize {
        match self {
            Self::StepDir | Self::UpDown => 2,
            Self::Phases(phases) => phases.lines as usize,
        }
    }
}

impl Phases {
    /// The levels at a step count: bit n is line n.
    pub fn state(&self, count: i64) -> u8 {
        let place = count.rem_euclid(self.states.len() as i64);
        self.states.get(place as usize).copied().unwrap_or(0)
    }

    /// Number of lines.
    pub const fn lines(&self) -> usize {
        self.lines as usize
    }

    /// Steps after which the states repeat.
    pub const fn cycle(&self) -> usize {
        self.states.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_cycles_without_repetition() {
        for number in 2..=14 {
            let Some(StepType::Phases(phases)) = StepType::from_number(number) else { panic!("{number}") };
            let cycle = phases.cycle() as i64;
            for count in 0..cycle {
                let state = phases.state(count);
                assert!(u32::from(state) < 1 << phases.lines(), "type {number}");
                assert!(
                    (count + 1..count + cycle).all(|other| phases.state(other) != state),
                    "type {number}"
                );
                assert_eq!(phases.state(count - 7 * cycle), state, "type {number}");
            }
        }
        assert_eq!(StepType::from_number(15), None);
        // a quadrature changes one line a step
        for count in -4..4 {
            let changed = QUADRATURE.state(count) ^ QUADRATURE.state(count + 1);
            assert_eq!(changed.count_ones(), 1);
        }
    }
}
