//! Commands that wait for the end of a compensated move: the move itself, and what came after it.

use super::state::scale_lengths;
use heapless::Vec;
use pkm_canon::{Canon, CanonSink, Position, Span, Text};

/// Most commands that wait for one move.
pub(crate) const MAX_WAITING: usize = 64;
/// Most bytes of text that wait.
const MAX_TEXT: usize = 2048;

/// A waiting move, whose end the next move may still change.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Move {
    Straight {
        traverse: bool,
        direction: [f64; 2],
        end: [f64; 9],
    },
    /// `sweep` is the programmed angle; 0 = an arc around a corner, which may be any.
    Arc {
        sweep: f64,
        end: [f64; 9],
        centre: [f64; 2],
        turns: i32,
    },
}

#[derive(Debug, Clone, Copy)]
enum Waiting {
    Move(Move),
    Command(Canon<'static>),
    /// Bytes of [`Queue::text`], a comment.
    Text {
        start: usize,
        end: usize,
    },
}

/// The queue; empty whenever cutter compensation is off.
#[derive(Debug, Clone, Default)]
pub(crate) struct Queue {
    waiting: Vec<(Waiting, Span), MAX_WAITING>,
    text: Vec<u8, MAX_TEXT>,
    /// More was to wait than there is room for.
    pub(crate) overflow: bool,
    /// The first of the moves that went out last.
    last: Option<Move>,
    /// Lathe tools: what is added to Z and X of a move.
    pub(crate) shift: [f64; 2],
}

/// The command without borrowed parts, if it is one of those that wait.
fn waits(command: &Canon<'_>) -> Option<Canon<'static>> {
    Some(match *command {
        Canon::SetFeedRate(rate) => Canon::SetFeedRate(rate),
        Canon::SetFeedMode { spindle, mode } => Canon::SetFeedMode { spindle, mode },
        Canon::SetSpindleSpeed { spindle, speed } => Canon::SetSpindleSpeed { spindle, speed },
        Canon::SetSpindleMode { spindle, css_limit } => Canon::SetSpindleMode { spindle, css_limit },
        Canon::StartSpindle { spindle, direction } => Canon::StartSpindle { spindle, direction },
        Canon::StopSpindle { spindle } => Canon::StopSpindle { spindle },
        Canon::OrientSpindle { spindle, angle, mode } => Canon::OrientSpindle { spindle, angle, mode },
        Canon::WaitOrientComplete { spindle, timeout } => Canon::WaitOrientComplete { spindle, timeout },
        Canon::Mist(on) => Canon::Mist(on),
        Canon::Flood(on) => Canon::Flood(on),
        Canon::Dwell(seconds) => Canon::Dwell(seconds),
        _ => return None,
    })
}

impl Queue {
    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// The move that waits first; if none waits, the one that was first last (so does LinuxCNC, by accident).
    pub(crate) fn front(&self) -> Option<Move> {
        match self.waiting.first() {
            Some((Waiting::Move(waiting), _)) => Some(*waiting),
            Some(_) => None,
            None => self.last,
        }
    }

    fn push(&mut self, waiting: Waiting, span: Span) {
        self.overflow |= self.waiting.push((waiting, span)).is_err();
    }

    /// A move waits.
    pub(crate) fn push_move(&mut self, waiting: Move, span: Span) {
        self.push(Waiting::Move(waiting), span);
    }

    /// Takes a command if it has to wait. False = it goes out at once.
    pub(crate) fn take(&mut self, command: &Canon<'_>, span: Span) -> bool {
        if self.waiting.is_empty() {
            return false;
        }
        let text = match command {
            // LinuxCNC is in a hurry with this remark (checked with rs274 2.9).
            Canon::Comment(Text(text)) if text.starts_with(b"interpreter: Lathe") => return false,
            Canon::Comment(Text(text)) => text,
            _ => match waits(command) {
                Some(command) => {
                    self.push(Waiting::Command(command), span);
                    return true;
                }
                None => return false,
            },
        };
        let start = self.text.len();
        self.overflow |= self.text.extend_from_slice(text).is_err();
        let end = self.text.len();
        self.push(Waiting::Text { start, end }, span);
        true
    }

    /// The waiting moves, to move their ends.
    pub(crate) fn moves_mut(&mut self) -> impl Iterator<Item = &mut Move> {
        self.waiting.iter_mut().filter_map(|(waiting, _)| match waiting {
            Waiting::Move(waiting) => Some(waiting),
            _ => None,
        })
    }

    /// G20, G21: lengths in force change their number. The result is how many entries wait.
    pub(crate) fn scale(&mut self, factor: f64) -> usize {
        for waiting in self.moves_mut() {
            match waiting {
                Move::Straight { end, .. } => scale_lengths(end, factor),
                Move::Arc { end, centre, .. } => {
                    scale_lengths(end, factor);
                    centre.iter_mut().for_each(|value| *value *= factor);
                }
            }
        }
        self.shift.iter_mut().for_each(|value| *value *= factor);
        self.waiting.len()
    }

    /// Everything goes out in its order.
    pub(crate) fn flush(&mut self, sink: &mut dyn CanonSink) {
        self.last = self.front();
        for (waiting, span) in &self.waiting {
            let shifted = |mut end: [f64; 9]| {
                end[2] += self.shift[0];
                end[0] += self.shift[1];
                Position::from_array(end)
            };
            match *waiting {
                Waiting::Move(Move::Straight { traverse: true, end, .. }) => {
                    sink.command(&Canon::StraightTraverse(shifted(end)), *span);
                }
                Waiting::Move(Move::Straight { end, .. }) => {
                    sink.command(&Canon::StraightFeed(shifted(end)), *span);
                }
                Waiting::Move(Move::Arc { end, centre, turns, .. }) => {
                    let [first_centre, second_centre] =
                        [centre[0] + self.shift[0], centre[1] + self.shift[1]];
                    let end = shifted(end);
                    sink.command(&Canon::ArcFeed { end, first_centre, second_centre, turns }, *span);
                }
                Waiting::Command(ref command) => sink.command(command, *span),
                Waiting::Text { start, end } => {
                    let text = Text(self.text.get(start..end).unwrap_or_default());
                    sink.command(&Canon::Comment(text), *span);
                }
            }
        }
        self.waiting.clear();
        self.text.clear();
    }
}
