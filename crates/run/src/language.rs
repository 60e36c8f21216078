//! What can be said of a program without a machine: its language alone.

use crate::Options;
use crate::check::Checked;
use crate::program::Program;
use crate::setup::{open, prepared, settings};
use pkm_canon::diagnostic::Diagnostic;
use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::canon_text_of;

/// Counts what a program does.
#[derive(Default)]
struct Count {
    blocks: u64,
    moves: u64,
}

impl CanonSink for Count {
    fn command(&mut self, command: &Canon<'_>, _: Span) {
        let moves = matches!(
            command,
            Canon::StraightTraverse(_)
                | Canon::StraightFeed(_)
                | Canon::ArcFeed { .. }
                | Canon::NurbsFeed { .. }
                | Canon::StraightProbe { .. }
                | Canon::RigidTap { .. }
        );
        self.moves += u64::from(moves);
    }

    fn line_read(&mut self, _: &[u8], _: Span) {
        self.blocks += 1;
    }
}

/// Checks the language of a whole program: every line is read, the lines that run are interpreted.
///
/// # Errors
/// The program cannot be read.
pub fn check_language(program: &Program, options: &Options) -> Result<Checked, Diagnostic> {
    let settings = settings(None, options);
    let name = program.name();
    let mut checked = Checked::default();
    let mut interpreter = prepared(settings, options);
    let mut source = open(program, None)?;
    let mut count = Count::default();
    let begun = match options.start_line {
        Some(line) => interpreter.skip_to_line(line, &mut source, &mut count),
        None => Ok(()),
    };
    match begun {
        Err(error) => checked.add(program, interpreter.diagnose(&error, &source, &name)),
        Ok(()) => canon_text_of(&mut interpreter, &mut source, &mut count, |error, interpreter, source| {
            checked.add(program, interpreter.diagnose(error, source, &name));
            !checked.is_full()
        }),
    }
    (checked.blocks, checked.moves) = (count.blocks, count.moves);
    checked.add_static(program, None, options)?;
    checked.sort(program);
    Ok(checked)
}
