//! Run from line: what the skipped lines leave behind is commanded, nothing of them moves, and what cannot be begun at is
//! refused by name.

use pkm_canon::text::{Spelling, TextWriter};
use pkm_canon::{Canon, CanonSink, Position, Span};
use pkm_gcode::{Interpreter, MachineCodes, MemorySource, Settings, Status};

const PROGRAM: &str = "\
G21 G90 F500 S1000 M3 M8
G10 L2 P1 X5
#<n> = 0
o1 while [#<n> lt 3]
  #<n> = [#<n> + 1]
  G1 X#<n> Y1
o1 endwhile
o2 sub
  G0 X[#1 * 3]
o2 endsub
o2 call [3]
G1 X10 Y#<n>
G2 X20 I5
G91 G1 X1
X2
M2
G0 X1
";

/// The commands of one line of text each, without their columns.
#[derive(Default)]
struct Texts(Vec<String>);

impl CanonSink for Texts {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        let mut text = Vec::new();
        TextWriter::new(|bytes: &[u8]| text = bytes.to_vec(), Spelling::V2_9).command(command, span);
        let text = String::from_utf8_lossy(&text).trim_end().to_string();
        self.0.push(text.get(13..).unwrap_or(&text).to_string());
    }
}

/// What is commanded from a line on, or the code of the refusal.
fn from(text: &str, line: u32, elsewhere: Option<Position>) -> Result<Vec<String>, &'static str> {
    let codes = MachineCodes::new(&[428]).expect("in range");
    let mut interpreter =
        Interpreter::new(Settings { machine_codes: codes, max_blocks: 1000, ..Settings::default() });
    let (mut source, mut texts) = (MemorySource::new(text.as_bytes()), Texts::default());
    let code = |error: pkm_gcode::Error| error.kind.code();
    interpreter.skip_to_line(line, &mut source, &mut texts).map_err(code)?;
    if let Some(position) = elsewhere {
        interpreter.begin_elsewhere(position);
    }
    while interpreter.step(&mut source, &mut texts).map_err(code)? != Status::Ended {}
    Ok(texts.0)
}

#[test]
fn the_state_is_commanded_and_the_program_goes_on() {
    let texts = from(PROGRAM, 12, None).expect("line 12 can be begun at");
    let first_move = texts.iter().position(|text| text.starts_with("STRAIGHT")).expect("it moves");
    for expected in [
        "USE_LENGTH_UNITS(CANON_UNITS_MM)",
        "SET_G5X_OFFSET(1, 5.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)",
        "SET_FEED_RATE(500.0000)",
        "SET_SPINDLE_SPEED(0, 1000.0000)",
        "START_SPINDLE_CLOCKWISE(0)",
        "FLOOD_ON()",
    ] {
        assert!(texts[..first_move].iter().any(|text| text == expected), "{expected} in {texts:#?}");
    }
    // #<n> is what the loop left; nothing of lines 6 and 9 is left.
    assert_eq!(texts[first_move], "STRAIGHT_FEED(10.0000, 3.0000, 0.0000, 0.0000, 0.0000, 0.0000)");
    assert!(texts[first_move + 1].starts_with("ARC_FEED(20.0000"));
    // The whole program ends alike.
    let whole = from(PROGRAM, 1, None).expect("line 1 is the begin");
    assert_eq!(whole[whole.len() - 8..], texts[texts.len() - 8..]);
    assert!(whole.iter().filter(|text| text.starts_with("STRAIGHT")).count() > 6);
}

#[test]
fn what_cannot_be_begun_at_is_refused() {
    let here = Some(Position::default());
    for (text, line, elsewhere) in [
        (PROGRAM, 5, None),  // in a loop
        (PROGRAM, 7, None),  // its end
        (PROGRAM, 9, None),  // in a sub
        (PROGRAM, 17, None), // behind M2
        (PROGRAM, 99, None), // behind the file
        (PROGRAM, 13, here), // an arc from elsewhere
        (PROGRAM, 14, here), // an incremental move from elsewhere
        (PROGRAM, 15, here),
        ("F100\nG38.2 Z-1\nG0 X1\nM2\n", 3, None),
        ("M428\nG0 X1\nM2\n", 2, None),
        ("M66 P1 L0\nG0 X1\nM2\n", 2, None),
        ("F100\nG41.1 D1 G1 X5\nX10\nG40\nM2\n", 3, None),
        ("F100\nG5.2 P1 X1 Y1 L3\nX2 Y2 P1\nX3 Y1 P1\nG5.3\nM2\n", 3, None),
    ] {
        assert_eq!(from(text, line, elsewhere).err(), Some("start-line"), "line {line} of {text}");
    }
    // A mistake in a skipped line is still one; an endless loop before the line ends.
    assert_eq!(from("G1 X1\nG0 X2\nM2\n", 2, None).err(), Some("feed-zero"));
    assert_eq!(from("o1 while [1]\no1 endwhile\nG0 X2\nM2\n", 3, None).err(), Some("too-many-blocks"));
    for line in [1, 2, 3, 4, 8, 11, 12, 16] {
        assert!(from(PROGRAM, line, None).is_ok(), "line {line}");
    }
    assert!(from(PROGRAM, 12, here).is_ok());
}
