//! Seeded random programs: plausible ones, and the same with one thing spoiled.

#[path = "generator/deeper.rs"]
mod deeper;

#[allow(unused_imports)] // the example prints programs alone
pub use deeper::{SUB_FILES, variables};

use pkm_kins::maths;
use std::fmt::Write;

/// splitmix64 (Steele, Lea, Flood 2014).
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    pub fn chance(&mut self, percent: u64) -> bool {
        self.below(100) < percent
    }

    pub fn pick<'a>(&mut self, choices: &[&'a str]) -> &'a str {
        choices[self.below(choices.len() as u64) as usize]
    }
}

/// What a spoiled byte becomes.
const SPOILS: &[u8] = b"GXYZIJKRPFM#[]()0123456789.-+*/=<> \n%;o";

/// One random program.
pub struct Generator {
    random: Random,
    text: String,
}

/// A program of the families named by `flavour`; the same seed gives the same bytes.
pub fn program(seed: u64, flavour: Flavour) -> String {
    let mut generator = Generator { random: Random(seed), text: String::new() };
    generator.write_program(flavour);
    generator.text
}

/// Which families of blocks a program holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flavour {
    Motion,
    Arcs,
    Offsets,
    Expressions,
    Modes,
    Cycles,
    Flow,
    Compensation,
    Everything,
    Spoiled,
    Lathe,
    Splines,
    Loops,
    Calls,
    Tables,
    /// All of these, and the same spoiled.
    Mixed,
    SpoiledMixed,
}

impl Flavour {
    pub const ALL: [Flavour; 17] = [
        Flavour::Motion,
        Flavour::Arcs,
        Flavour::Offsets,
        Flavour::Expressions,
        Flavour::Modes,
        Flavour::Cycles,
        Flavour::Flow,
        Flavour::Compensation,
        Flavour::Everything,
        Flavour::Spoiled,
        Flavour::Lathe,
        Flavour::Splines,
        Flavour::Loops,
        Flavour::Calls,
        Flavour::Tables,
        Flavour::Mixed,
        Flavour::SpoiledMixed,
    ];
}

impl Generator {
    fn write_program(&mut self, flavour: Flavour) {
        if self.random.chance(20) {
            self.text.push_str("G20\n");
        }
        self.text.push_str("F200 S1000\n");
        let count = 5 + self.random.below(30);
        for _ in 0..count {
            if self.random.chance(10) {
                let n = self.random.below(100_000);
                let _ = write!(self.text, "N{n} ");
            }
            self.block(flavour);
            self.text.push('\n');
        }
        self.text.push_str(if self.random.chance(50) { "M2\n" } else { "M30\n" });
        if matches!(flavour, Flavour::Spoiled | Flavour::SpoiledMixed) {
            self.spoil();
        }
    }

    /// One byte of the text becomes another, is doubled or goes away.
    fn spoil(&mut self) {
        let mut bytes = std::mem::take(&mut self.text).into_bytes();
        for _ in 0..1 + self.random.below(2) {
            let at = self.random.below(bytes.len() as u64) as usize;
            match self.random.below(3) {
                0 => bytes[at] = SPOILS[self.random.below(SPOILS.len() as u64) as usize],
                1 => bytes.insert(at, bytes[at]),
                _ => drop(bytes.remove(at)),
            }
        }
        self.text = String::from_utf8(bytes).expect("ASCII stays ASCII");
    }

    fn block(&mut self, flavour: Flavour) {
        match flavour {
            Flavour::Motion => self.motion(),
            Flavour::Arcs => match self.random.below(6) {
                0 => self.motion(),
                1 => self.plane(),
                _ => self.arc(),
            },
            Flavour::Offsets => match self.random.below(3) {
                0 => self.motion(),
                _ => self.offset(),
            },
            Flavour::Expressions => self.expression_block(),
            Flavour::Modes => match self.random.below(4) {
                0 => self.motion(),
                _ => self.mode(),
            },
            Flavour::Cycles => match self.random.below(8) {
                0 => self.motion(),
                1 => self.plane(),
                2 => {
                    let code =
                        self.random.pick(&["G98", "G99", "G90", "G91", "G80", "M3", "M4", "G61", "G64"]);
                    self.text.push_str(code);
                }
                _ => self.cycle(),
            },
            Flavour::Flow => self.flow(),
            Flavour::Compensation => self.compensated(),
            Flavour::Lathe => self.lathe(),
            Flavour::Splines => self.spline(),
            Flavour::Loops => self.loops(),
            Flavour::Calls => self.calls(),
            Flavour::Tables => self.tables(),
            Flavour::Mixed | Flavour::SpoiledMixed => match self.random.below(7) {
                0 => self.lathe(),
                1 => self.spline(),
                2 => self.loops(),
                3 => self.calls(),
                4 => self.tables(),
                5 => self.compensated(),
                _ => self.block(Flavour::Everything),
            },
            Flavour::Everything | Flavour::Spoiled => match self.random.below(9) {
                0 | 1 => self.motion(),
                2 => self.arc(),
                3 => self.offset(),
                4 => self.expression_block(),
                5 => self.mode(),
                6 => self.cycle(),
                7 => self.flow(),
                _ => self.plane(),
            },
        }
    }

    /// A coordinate of up to three digits and three decimals.
    fn number(&mut self) -> f64 {
        let whole = self.random.below(60_000) as f64 - 30_000.0;
        match self.random.below(3) {
            0 => (whole / 1000.0).round(),
            1 => (whole / 10.0).round() / 100.0,
            _ => whole / 1000.0,
        }
    }

    fn word(&mut self, letter: char) {
        let value = self.number();
        let _ = write!(self.text, "{letter}{value} ");
    }

    fn axes(&mut self, percent: u64) {
        for letter in "XYZABC".chars() {
            let chance = if letter < 'D' { percent / 4 } else { percent };
            if self.random.chance(chance) {
                self.word(letter);
            }
        }
    }

    fn motion(&mut self) {
        let code = self.random.pick(&["G0 ", "G1 ", "", "G1 ", "G53 G0 ", "G0 ", "G1 "]);
        self.text.push_str(code);
        match self.random.below(20) {
            0 => {
                let (radius, angle) = (self.random.below(50), self.random.below(360));
                let _ = write!(self.text, "@{radius} ^{angle}");
            }
            _ => self.axes(60),
        }
    }

    fn plane(&mut self) {
        let code = self.random.pick(&["G17", "G18", "G19"]);
        self.text.push_str(code);
    }

    /// An arc that closes: end words chosen so that the radii agree, now and then not.
    fn arc(&mut self) {
        let code = self.random.pick(&["G2 ", "G3 ", "G2 ", "G3 ", ""]);
        let plane = self.random.pick(&["G17 ", "G18 ", "G19 "]);
        let letters = match plane {
            "G17 " => ['X', 'Y', 'Z', 'I', 'J'],
            "G18 " => ['Z', 'X', 'Y', 'K', 'I'],
            _ => ['Y', 'Z', 'X', 'J', 'K'],
        };
        let _ = write!(self.text, "{plane}{code}");
        let incremental = self.random.pick(&["G90 ", "G91 ", "G91 "]);
        let _ = write!(self.text, "{incremental}");
        if self.random.chance(40) {
            let (dx, dy) = (self.number(), self.number());
            let radius = (maths::hypot(dx, dy) / 2.0 + self.random.below(30) as f64).ceil();
            let sign = if self.random.chance(30) { "-" } else { "" };
            let _ = write!(self.text, "{}{dx} {}{dy} R{sign}{radius} ", letters[0], letters[1]);
        } else {
            let (i, j) = (self.number(), self.number());
            let angle = (self.random.below(360) as f64).to_radians();
            let (sin, cos) = (maths::sin(angle), maths::cos(angle));
            // From the start (0, 0) about (i, j) by `angle`.
            let (dx, dy) = (i - (i * cos - j * sin), j - (i * sin + j * cos));
            let _ = write!(self.text, "{}{dx:.5} {}{dy:.5} ", letters[0], letters[1]);
            let _ = write!(self.text, "{}{i} {}{j} ", letters[3], letters[4]);
        }
        if self.random.chance(30) {
            self.word(letters[2]);
        }
        if self.random.chance(15) {
            let turns = 1 + self.random.below(4);
            let _ = write!(self.text, "P{turns} ");
        }
        if self.random.chance(10) {
            self.word('A');
        }
    }

    fn offset(&mut self) {
        match self.random.below(9) {
            0 => {
                let code = self.random.pick(&[
                    "G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3", "G92.1", "G92.2",
                    "G92.3", "G28.1", "G30.1", "G20", "G21", "G49", "G90", "G91", "G28", "G30",
                ]);
                self.text.push_str(code);
            }
            1 | 2 => {
                let (system, l) = (self.random.below(10), self.random.pick(&["2", "2", "20"]));
                let _ = write!(self.text, "G10 L{l} P{system} ");
                self.axes(50);
                if l == "2" && self.random.chance(40) {
                    let degrees = self.random.below(360);
                    let _ = write!(self.text, "R{degrees}");
                }
            }
            3 => {
                self.text.push_str("G92 ");
                self.axes(50);
            }
            4 => {
                self.text.push_str("G52 ");
                self.axes(50);
            }
            5 => {
                self.text.push_str("G43.1 ");
                self.axes(50);
            }
            6 => {
                let code = self.random.pick(&[
                    "T1 M6",
                    "T2 M6 G43",
                    "G43 H3",
                    "G43 H1",
                    "G43",
                    "G43.2 H2",
                    "T4 M6",
                    "T0 M6",
                    "M61 Q1",
                ]);
                self.text.push_str(code);
            }
            7 => {
                let (tool, l) = (1 + self.random.below(4), self.random.pick(&["1", "10", "11"]));
                let _ = write!(self.text, "G10 L{l} P{tool} ");
                self.axes(50);
                if self.random.chance(20) {
                    self.text.push_str("R3 Q2");
                }
            }
            _ => {
                let code = self.random.pick(&["G28 ", "G30 ", "G53 G1 ", "G53 G0 "]);
                self.text.push_str(code);
                self.axes(40);
            }
        }
    }

    /// An expression of limited depth.
    fn expression(&mut self, depth: u32) -> String {
        match self.random.below(if depth == 0 { 3 } else { 8 }) {
            0 => format!("{}", self.number()),
            1 => format!("#{}", 31 + self.random.below(5)),
            2 => format!("{}", self.random.below(10)),
            3 => {
                let function = self.random.pick(&[
                    "SIN", "COS", "ABS", "FIX", "FUP", "ROUND", "TAN", "SQRT", "EXP", "LN", "ACOS", "ASIN",
                ]);
                let argument = self.expression(depth - 1);
                match function {
                    "SQRT" | "LN" => format!("{function}[abs[{argument}] + 1]"),
                    "EXP" => format!("EXP[[{argument}] mod 5]"),
                    "ACOS" | "ASIN" => format!("{function}[SIN[{argument}]]"),
                    "TAN" => format!("TAN[[{argument}] mod 80]"),
                    _ => format!("{function}[{argument}]"),
                }
            }
            4 => format!("ATAN[{}]/[{}]", self.expression(depth - 1), self.expression(depth - 1)),
            5 => format!("-[{}]", self.expression(depth - 1)),
            _ => {
                let operator = self.random.pick(&[
                    "+", "-", "*", "+", "-", "*", " mod ", " and ", " or ", " xor ", " eq ", " ne ", " gt ",
                    " ge ", " lt ", " le ",
                ]);
                let (a, b) = (self.expression(depth - 1), self.expression(depth - 1));
                let b = if operator == " mod " { format!("[abs[{b}] + 1]") } else { b };
                if self.random.chance(50) {
                    format!("[{a}{operator}{b}]")
                } else {
                    let c = self.expression(depth - 1);
                    format!("[{a}{operator}{b} + {c}]")
                }
            }
        }
    }

    fn expression_block(&mut self) {
        let value = self.expression(3);
        let index = 31 + self.random.below(5);
        match self.random.below(6) {
            0 => {
                let _ = write!(self.text, "#{index}=[[{value}] mod 1000]");
            }
            1 => {
                let _ = write!(self.text, "#<abc>=[{value}]\n(print,#<abc> #{index} %d#{index})");
            }
            2 => {
                let _ = write!(self.text, "(debug,%.3f #{index} #<nope>)");
            }
            3 => {
                let other = self.expression(2);
                let _ = write!(self.text, "#{index}=7 #{index}=[{other}] G0 X[{value}] Y#{index}");
            }
            4 => {
                let _ = write!(self.text, "G1 X[{value}] Y#{index} Z-#{index}");
            }
            _ => {
                let name = self.random.pick(&[
                    "_x",
                    "_y",
                    "_z",
                    "_feed",
                    "_rpm",
                    "_plane",
                    "_motion_mode",
                    "_metric",
                    "_absolute",
                    "_line",
                    "_coord_system",
                    "_imperial",
                    "_incremental",
                    "_ccomp",
                    "_spindle_on",
                    "_mist",
                    "_abs_x",
                    "_current_tool",
                    "_selected_tool",
                    "_retract_old_z",
                    "_tool_offset",
                    "_feed_hold",
                ]);
                let _ = write!(self.text, "(print,#<{name}> #5420 #5421)");
            }
        }
    }

    fn mode(&mut self) {
        let code = self.random.pick(&[
            "G61",
            "G61.1",
            "G64",
            "G64 P0.1",
            "G64 P0.05 Q0.01",
            "G90",
            "G91",
            "G90.1",
            "G91.1",
            "G93",
            "G94",
            "G95",
            "F100",
            "F50",
            "S500",
            "M3",
            "M4",
            "M5",
            "M7",
            "M8",
            "M9",
            "M48",
            "M49",
            "M50 P0",
            "M51 P0",
            "M50",
            "M51",
            "M52",
            "M52 P0",
            "M53 P0",
            "M53 P1",
            "G96 S100",
            "G96 D500 S100",
            "G97",
            "G4 P0.5",
            "(comment)",
            "(MSG,hello)",
            "; nothing",
            "G20",
            "G21",
            "M0",
            "M1",
            "M60",
            "M62 P1",
            "M63 P2",
            "M64 P0",
            "M65 P3",
            "M66 P0 L0",
            "M67 E1 Q3.5",
            "M68 E0 Q-1",
            "G98",
            "G99",
            "G80",
            "G40",
            "G7",
            "G8",
            "G17",
            "G18",
            "G19",
            "/G0 X5",
            "G38.2 Z-50",
            "G38.3 X100 Y5",
            "M19 R45",
            "M19 R30 P1 Q5",
            "(LOG,x #31)",
            "(logopen,foo.txt)",
            "(logclose)",
            "G17.1",
            "G33 Z-5 K1",
            "G33.1 Z-9 K0.5",
            "M70",
            "M72",
            "T1",
            "T1 M6",
            "F100 G94",
            "G1 X5 F100",
            "G94 F100",
        ]);
        self.text.push_str(code);
    }

    fn cycle(&mut self) {
        let code = self
            .random
            .pick(&["G81", "G82", "G83", "G73", "G85", "G89", "G86", "G88", "G84", "G74", "G81", ""]);
        let _ = write!(self.text, "{code} ");
        for letter in ['X', 'Y'] {
            if self.random.chance(60) {
                self.word(letter);
            }
        }
        if self.random.chance(70) {
            let depth = -(self.random.below(20) as f64) / 2.0 - 1.0;
            let _ = write!(self.text, "Z{depth} ");
        }
        if self.random.chance(80) {
            let r = self.random.below(10) as f64 / 2.0;
            let _ = write!(self.text, "R{r} ");
        }
        if matches!(code, "G83" | "G73") {
            let q = 1 + self.random.below(4);
            let _ = write!(self.text, "Q{q} ");
        }
        if matches!(code, "G82" | "G86" | "G88" | "G89") || self.random.chance(5) {
            self.text.push_str("P0.25 ");
        }
        if code != "G74" && self.random.chance(20) {
            let l = 1 + self.random.below(3);
            let _ = write!(self.text, "L{l} ");
        }
    }

    fn flow(&mut self) {
        let label = 100 + self.random.below(900_000);
        let condition = self.expression(2);
        let count = self.random.below(5);
        let index = 31 + self.random.below(5);
        let _ = match self.random.below(7) {
            0 => write!(
                self.text,
                "o{label} if [{condition}]\nG0 X{count}\no{label} else\nG0 Y{count}\no{label} endif"
            ),
            1 => write!(self.text, "o{label} repeat [{count}]\nG91 G0 X1\nG90\no{label} endrepeat"),
            2 => write!(
                self.text,
                "#{index}=0\no{label} while [#{index} lt {count}]\n#{index}=[#{index}+1]\nG0 Z#{index}\n\
                 o{label} endwhile"
            ),
            3 => write!(
                self.text,
                "#{index}=0\no{label} do\n#{index}=[#{index}+1]\no{} if [#{index} eq 2]\no{label} continue\n\
                 o{} endif\nG0 X#{index}\no{label} while [#{index} lt {count}]",
                label + 1,
                label + 1
            ),
            4 => write!(
                self.text,
                "o{label} sub\n#<a>=[#1+#2]\nG0 X#<a>\no{label} endsub [#<a>*2]\n\
                 o{label} call [{condition}] [{count}]\nG0 Y#<_value>"
            ),
            5 => write!(
                self.text,
                "o{label} if [{condition}]\nG0 X1\no{label} elseif [{condition} gt 1]\nG0 X2\no{label} elseif \
                 [{count} eq 2]\nG0 X3\no{label} endif"
            ),
            _ => write!(
                self.text,
                "#{index}=0\no{label} while [1]\n#{index}=[#{index}+1]\no{} if [#{index} gt {count}]\n\
                 o{label} break\no{} endif\nG0 X#{index}\no{label} endwhile",
                label + 1,
                label + 1
            ),
        };
    }

    /// A contour with cutter compensation: mostly outside corners, tool smaller than the moves.
    fn compensated(&mut self) {
        let side = self.random.pick(&["G41.1 D2", "G42.1 D2", "G41.1 D0.5", "G42.1 D3", "G41 D1", "G42 D4"]);
        let (x, y) = (self.number(), self.number());
        let _ = write!(self.text, "G0 X{x} Y{y}\n{side}\n");
        let (mut x, mut y) = (x, y);
        for _ in 0..2 + self.random.below(6) {
            match self.random.below(8) {
                0 => {
                    let z = self.random.below(10);
                    let _ = writeln!(self.text, "G1 Z-{z}");
                }
                1 => {
                    let code = self.random.pick(&["F100", "M8", "M9", "(note)", "S500", "G4 P0.1"]);
                    let _ = writeln!(self.text, "{code}");
                }
                2 | 3 => {
                    let code = self.random.pick(&["G2", "G3"]);
                    let (dx, dy) = (self.number() / 2.0, self.number() / 2.0);
                    let radius = (maths::hypot(dx, dy) / 2.0 + self.random.below(20) as f64 + 2.0).ceil();
                    (x, y) = (x + dx, y + dy);
                    let _ = writeln!(self.text, "{code} X{x:.4} Y{y:.4} R{radius}");
                }
                _ => {
                    let code = self.random.pick(&["G1", "G1", "G1", "G0"]);
                    let (dx, dy) = (self.number(), self.number());
                    (x, y) = (x + dx, y + dy);
                    let _ = writeln!(self.text, "{code} X{x:.4} Y{y:.4}");
                }
            }
        }
        self.text.push_str("G40\nG0 Z5");
    }
}
