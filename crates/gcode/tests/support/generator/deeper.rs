//! Families of blocks that need a longer set-up: lathes, splines, loops within loops, calls, tool tables.

use super::Generator;
use pkm_kins::maths;
use std::fmt::Write;

impl Generator {
    fn small(&mut self, limit: u64) -> u64 {
        self.random.below(limit)
    }

    fn line(&mut self, text: &str) {
        self.text.push_str(text);
        self.text.push('\n');
    }

    /// A contour in XZ with a lathe tool of any orientation, a thread, or a mode of lathes.
    pub(super) fn lathe(&mut self) {
        match self.random.below(8) {
            0 => {
                let code = self
                    .random
                    .pick(&["G7", "G8", "G20", "G21", "G18", "G17", "G91.1", "G90.1", "G90", "G91"]);
                self.text.push_str(code);
            }
            1 => self.thread(),
            2 => self.motion(),
            _ => self.turned_contour(),
        }
    }

    fn turned_contour(&mut self) {
        let orientation = self.small(10);
        let (x, z) = (self.number(), self.number());
        let code = self.random.pick(&["G41.1", "G42.1"]);
        let _ = writeln!(self.text, "G90 G40 G18 G0 X{x} Z{z}");
        match self.random.below(4) {
            0 => {
                let tool = self.random.pick(&["G41 D4", "G42 D4", "G41 D1", "G42", "G41 D2"]);
                self.line(tool);
            }
            1 => self.line("G41.1 D-1.5 L3"),
            _ => {
                let diameter = 1 + self.small(3);
                let _ = writeln!(self.text, "{code} D{diameter} L{orientation}");
            }
        }
        let (mut x, mut z) = (x, z);
        for _ in 0..2 + self.random.below(6) {
            let (dx, dz) = (self.number(), self.number());
            match self.random.below(10) {
                0 => {
                    let code = self.random.pick(&[
                        "G1 Y3",
                        "G1 Y-2 A5",
                        "G20",
                        "G21",
                        "M8",
                        "(note)",
                        "(MSG,m)",
                        "M0",
                        "G7",
                        "G8",
                        "G4 P1",
                        "G94 F100",
                        "G97 S10",
                        "M3",
                        "G80",
                    ]);
                    self.line(code);
                }
                1..=4 => {
                    let code = self.random.pick(&["G2", "G3"]);
                    let (dx, dz) = (dx / 2.0, dz / 2.0);
                    let radius = (maths::hypot(dx, dz) / 2.0 + self.random.below(20) as f64 + 1.0).ceil();
                    let sign = if self.random.chance(15) { "-" } else { "" };
                    (x, z) = (x + dx, z + dz);
                    let rotary = if self.random.chance(10) { " B7" } else { "" };
                    let _ = writeln!(self.text, "{code} X{x:.4} Z{z:.4} R{sign}{radius}{rotary}");
                }
                _ => {
                    let code = self.random.pick(&["G1", "G1", "G1", "G0"]);
                    (x, z) = (x + dx, z + dz);
                    let rotary = if self.random.chance(10) { " C4" } else { "" };
                    let _ = writeln!(self.text, "{code} X{x:.4} Z{z:.4}{rotary}");
                }
            }
        }
        self.text.push_str("G40\nG0 Y5");
    }

    fn thread(&mut self) {
        self.line("G40 G18 M3");
        match self.random.below(4) {
            0 => {
                let (z, k) = (self.number(), self.number());
                let words = self.random.pick(&["", " $0", " X4", " F10", " Y2", " $1"]);
                let _ = write!(self.text, "G33 Z{z} K{k}{words}");
            }
            1 => {
                let z = self.number();
                let words = self.random.pick(&["", " I1", " I2.5", " I0.5", " $0", " X1"]);
                let _ = write!(self.text, "G33.1 Z{z} K0.5{words}");
            }
            _ => {
                let (i, j, k) = (self.number(), self.small(5), self.small(9));
                let (z, p) = (self.number(), 1 + self.small(3));
                let words = self.random.pick(&["", "", "", "Y2 ", "G17 ", "G19 "]);
                let _ = write!(self.text, "G90 G76 P{p} Z{z} I{i} J0.{j} K{k} {words}");
                let r = self.random.pick(&["R1.", "R1.", "R0."]);
                for (word, limit) in [(r, 10), ("Q", 40), ("H", 4), ("E", 5), ("L", 5)] {
                    if self.random.chance(50) {
                        let value = self.small(limit);
                        let _ = write!(self.text, "{word}{value} ");
                    }
                }
            }
        }
    }

    pub(super) fn spline(&mut self) {
        match self.random.below(9) {
            0 => self.motion(),
            1 => {
                let code = self
                    .random
                    .pick(&["G17", "G18", "G90", "G91", "G20", "G21", "F100", "F0", "G93", "G80", "G94 F5"]);
                self.text.push_str(code);
            }
            2..=4 => {
                self.text.push_str("G5 ");
                for letter in "XYIJPQ".chars() {
                    if self.random.chance(if letter < 'L' { 75 } else { 97 }) {
                        self.word(letter);
                    }
                }
                if self.random.chance(3) {
                    self.word('Z');
                }
            }
            5 => {
                self.text.push_str("G5.1 ");
                for letter in "XYIJ".chars() {
                    if self.random.chance(92) {
                        self.word(letter);
                    }
                }
            }
            _ => self.nurbs(),
        }
    }

    fn nurbs(&mut self) {
        let first = self.random.pick(&[
            "G5.2 P1",
            "G5.2",
            "G5.2 X1 Y1 P2",
            "G5.2 X4 Y2 P1 L4",
            "G5.2 P2 L3",
            "G5.2 P1 X3",
        ]);
        self.line(first);
        for _ in 0..1 + self.random.below(5) {
            if self.random.chance(8) {
                let code = self.random.pick(&["F50", "(note)", "G0 X1", "G4 P1", "M8"]);
                self.line(code);
            }
            let (x, y) = (self.number(), self.number());
            let weight = if self.random.chance(95) { 1 + self.small(3) } else { 0 };
            let code = self.random.pick(&["", "", "G5.2 "]);
            let _ = writeln!(self.text, "{code}X{x} Y{y} P{weight}");
        }
        self.text.push_str("G5.3");
    }

    /// Loops and branches within each other; labels from a short list, so that they meet again.
    pub(super) fn loops(&mut self) {
        let depth = 1 + self.random.below(3) as u32;
        self.construct(depth);
    }

    fn construct(&mut self, depth: u32) {
        let label = self.small(1_000_000);
        let counter = 31 + self.small(9);
        let count = self.small(4);
        let expression = self.expression(1);
        match self.random.below(6) {
            0 => {
                let _ = writeln!(self.text, "o{label} if [{expression}]");
                self.body(depth, None);
                if self.random.chance(60) {
                    let _ = writeln!(self.text, "o{label} elseif [#{counter} gt {count}]");
                    self.body(depth, None);
                }
                if self.random.chance(60) {
                    let _ = writeln!(self.text, "o{label} else");
                    self.body(depth, None);
                }
                let _ = write!(self.text, "o{label} endif");
            }
            1 | 2 => {
                let _ = writeln!(
                    self.text,
                    "#<n{label}>=0\no{label} while [#<n{label}> lt {count}]\n#<n{label}>=[#<n{label}>+1] #{counter}=#<n{label}>"
                );
                self.body(depth, Some(label));
                let _ = write!(self.text, "o{label} endwhile");
            }
            3 | 4 => {
                let _ = writeln!(
                    self.text,
                    "#<n{label}>=0\no{label} do\n#<n{label}>=[#<n{label}>+1] #{counter}=#<n{label}>"
                );
                self.body(depth, Some(label));
                let _ = write!(self.text, "o{label} while [#<n{label}> lt {count}]");
            }
            _ => {
                let half = if self.random.chance(20) { ".5" } else { "" };
                let _ = writeln!(self.text, "o{label} repeat [{count}{half}]");
                self.body(depth, None);
                let _ = write!(self.text, "o{label} endrepeat");
            }
        }
    }

    /// What stands within; `label` is that of the loop around it.
    fn body(&mut self, depth: u32, label: Option<u64>) {
        for _ in 0..1 + self.random.below(2) {
            match (self.random.below(5), label) {
                (0, Some(label)) => {
                    let (inner, value) = (self.small(1_000_000), self.small(3));
                    let word = self.random.pick(&["break", "continue"]);
                    let index = 31 + self.small(9);
                    let _ = writeln!(
                        self.text,
                        "o{inner} if [#{index} eq {value}]\no{label} {word}\no{inner} endif"
                    );
                }
                (1, _) if depth > 0 => {
                    self.construct(depth - 1);
                    self.text.push('\n');
                }
                _ => {
                    let (letter, index) = (self.random.pick(&["X", "Y", "Z"]), 31 + self.small(9));
                    let _ = writeln!(self.text, "G0 {letter}#{index}");
                }
            }
        }
    }

    /// Subs in the file, before and after their calls, in files of their own, and Fanuc's programs.
    pub(super) fn calls(&mut self) {
        let label = 1000 + self.small(1_000_000);
        let (a, b) = (self.expression(1), self.expression(1));
        match self.random.below(9) {
            0 => {
                let file = self.random.pick(&["helper", "nested", "twice", "lost", "none", "HELPER"]);
                let percent = if matches!(file, "lost" | "none") { 8 } else { 100 };
                if self.random.chance(percent) {
                    let _ =
                        write!(self.text, "o<{file}> call [{a}] [{b}]\nG0 X#<_value> Y#<_value_returned>");
                }
            }
            1 => {
                let times = self.random.pick(&["", " L2", " L0", " L3"]);
                let _ = write!(self.text, "M98 P77{times}");
            }
            2 => {
                let _ = writeln!(self.text, "o{label} sub\n#<here>=[#1+#2]\n#<_there>=#<here>\n#3=4");
                self.body(1, None);
                let _ = write!(
                    self.text,
                    "o{label} endsub [#<here>]\n#3=9\no{label} call [{a}] [{b}] [1]\nG0 X#<_there> Y#3 Z#<_value>"
                );
            }
            3 => {
                // A recursion of known depth.
                let depth = self.small(11);
                let _ = write!(
                    self.text,
                    "o{label} sub\nG0 X#1\no1 if [#1 gt 0]\no{label} call [#1-1]\no1 endif\nG0 Y#1\n\
                     o{label} endsub [#1]\no{label} call [{depth}]"
                );
            }
            4 => {
                let (count, limit) = (self.small(5), self.small(5));
                let _ = write!(
                    self.text,
                    "o{label} sub\no7 repeat [{count}]\n#1=[#1+1]\nG0 Z#1\no8 if [#1 gt {limit}]\n\
                     o{label} return [#1]\no8 endif\no7 endrepeat\no{label} endsub [9]\n\
                     o{label} call [1]\no{label} call [0]\no{label} call [2]\nG0 X#<_value>"
                );
            }
            5 => {
                let state = self.random.pick(&["M70", "M73", "M73", "M70\nM72", "M73\nM71"]);
                let change = self.random.pick(&[
                    "G91", "G20", "G18", "F77 S88", "G61", "M3 M8", "G7 G98", "G55", "M50 P0", "G92 X4",
                ]);
                let _ = write!(
                    self.text,
                    "o{label} sub\n{state}\n{change}\nG0 X1\no{label} endsub\no{label} call\nG0 Y1"
                );
            }
            6 => {
                let _ = write!(
                    self.text,
                    "#<x{label}>=[{a}]\n#1=EXISTS[#<x{label}>] #2=EXISTS[#<y{label}>]\nG0 X#1 Y#2"
                );
            }
            7 => {
                let arguments = "[1] ".repeat(self.small(33) as usize);
                let _ = write!(self.text, "o<twice> call {arguments}");
            }
            _ => self.motion(),
        }
    }

    /// Tools with orientation, settings of the tool table, spindles, coordinate systems that come from a file.
    pub(super) fn tables(&mut self) {
        match self.random.below(10) {
            0 => self.motion(),
            1 | 2 => {
                let (tool, l) = (1 + self.small(5), self.random.pick(&["1", "10", "11", "0"]));
                let _ = write!(self.text, "G10 L{l} P{tool} ");
                for letter in "XYZAUIJRQ".chars() {
                    let percent = if letter == 'U' { 2 } else { 40 };
                    if self.random.chance(percent) {
                        let value = if letter == 'Q' { self.small(10) as f64 } else { self.number() };
                        let _ = write!(self.text, "{letter}{value} ");
                    }
                }
            }
            3 => {
                let code = self.random.pick(&[
                    "T1 M6",
                    "T4 M6 G43",
                    "T4",
                    "M6",
                    "G43",
                    "G43 H4",
                    "G43.2 H2",
                    "G43.1 X1 Z2",
                    "G49",
                    "M61 Q4",
                    "M61 Q0",
                    "T0 M6",
                    "T99999 M6",
                    "T5",
                    "G43 H0",
                    "G43.2 X1",
                    "M61 Q-1",
                    "M61",
                    "G43.1 A3",
                ]);
                self.text.push_str(code);
            }
            4 => {
                let index = self.random.pick(&[
                    "5400", "5401", "5403", "5410", "5411", "5413", "5161", "5220", "5221", "5230", "5211",
                    "5210", "5399", "5070", "5061",
                ]);
                let _ = write!(self.text, "(print,#{index})\nG0 X#{index}");
            }
            5 => {
                let index = self
                    .random
                    .pick(&["5221", "5222", "5230", "5241", "5250", "5161", "5181", "5211", "5210", "5220"]);
                let value = 1 + self.small(3);
                let _ = write!(self.text, "#{index}={value}");
            }
            6 => self.offset(),
            7 => {
                let code = self.random.pick(&[
                    "M3 $0",
                    "M4 $-1",
                    "M5 $0",
                    "M5",
                    "S100 $0",
                    "S200 $-1",
                    "M3 $1",
                    "G96 S100 D500",
                    "G96 D1000 S50",
                    "G97 S5",
                    "M19 R90 $0",
                    "M19 R90 P3",
                    "M19 Q1",
                    "M19 R400",
                    "M51 P0 $0",
                    "M51 P1",
                    "S3 $2",
                    "M48",
                    "M49",
                    "G97 $0 S1",
                ]);
                self.text.push_str(code);
            }
            8 => {
                let code = self.random.pick(&[
                    "G54",
                    "G55",
                    "G59.3",
                    "G20",
                    "G21",
                    "G92.1",
                    "G92.2",
                    "G92.3",
                    "G28",
                    "G30",
                    "G28.1",
                    "G30.1",
                    "G28 X1",
                    "G30 Z1 A2",
                ]);
                self.text.push_str(code);
            }
            _ => {
                let code = self.random.pick(&[
                    "M66 P1 L0",
                    "M66 E2",
                    "M66 P0 L3 Q1",
                    "M66 P1 L1",
                    "M66 P1 E1",
                    "M67 E1 Q2",
                    "M68 E2",
                    "M62 P3",
                    "G38.2 Z-5",
                    "G38.3 X3 Y4",
                    "G38.4 Z3",
                    "G38.5 X3 A3",
                    "G17.1",
                    "G17",
                    "M100",
                    "M101 P1 Q2",
                    "G52 X1",
                    "M0",
                    "M60",
                    "M1",
                ]);
                self.text.push_str(code);
            }
        }
    }
}

/// Subroutine files that stand beside every program.
pub const SUB_FILES: [(&str, &str); 5] = [
    (
        "helper.ngc",
        "o<helper> sub\nG0 X[#1+1]\no1 if [#2 gt 0]\nG0 Y#2\no1 endif\no<helper> endsub [#1*2]\nM2\n",
    ),
    (
        "nested.ngc",
        "(text before)\nG0 X99\no<nested> sub\no<helper> call [#1] [#2]\nG0 Z#1\no<nested> endsub\n",
    ),
    (
        "twice.ngc",
        "o<twice> sub\nG0 Z[#1+#30]\no5 repeat [2]\nG0 X#1\no5 endrepeat\no<twice> return [7]\no<twice> endsub\n",
    ),
    ("lost.ngc", "o<other> sub\nG0 X1\no<other> endsub\n"),
    ("77.ngc", "O77\nG0 Z[#31+1]\nM99\n"),
];

/// A parameter file: homes, offsets, two systems with rotation, lengths in machine units.
pub fn variables(seed: u64) -> String {
    let mut random = super::Random(seed ^ 0x7661_7269_6162_6c65);
    let mut text = String::new();
    for first in [5161, 5181, 5211, 5221, 5241, 5381] {
        for axis in 0..6 {
            let value = random.below(2000) as f64 / 100.0 - 10.0;
            let _ = writeln!(text, "{}\t{value:.6}", first + axis);
        }
        if first == 5181 {
            let _ = writeln!(text, "5210\t{}", random.below(2));
        }
        if first == 5211 {
            let _ = writeln!(text, "5220\t{}", 1 + random.below(3));
        }
        if first > 5220 {
            let _ = writeln!(text, "{}\t{}", first + 9, random.below(4) * 30);
        }
    }
    text
}
