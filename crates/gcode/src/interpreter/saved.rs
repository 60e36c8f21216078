//! M70 to M73: remember and restore the modal state (dialect section 14). A restore is itself a few blocks of
//! G-code, as in LinuxCNC, so it takes effect in the same order and with the same results.

use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Error, ErrorKind};
use crate::line::Line;
use crate::modal::*;
use crate::parameters;
use crate::settings::Dialect;
use core::fmt::Write;
use heapless::Vec;
use pkm_canon::{Direction, LengthUnit, MotionControlMode, Plane, Span};

/// Deepest call level: the main program and nine calls.
const LEVELS: usize = 10;

/// A remembered state.
#[derive(Debug, Clone)]
pub(crate) struct Saved {
    modal: Modal,
    tool_offset: [f64; 9],
    g92_applied: bool,
    /// M73: restore when the sub returns.
    #[cfg_attr(not(feature = "alloc"), expect(dead_code, reason = "subs need memory"))]
    on_return: bool,
}

/// The remembered state of each call level.
#[derive(Debug, Clone, Default)]
pub(crate) struct SavedStates {
    levels: [Option<Saved>; LEVELS],
}

type Text = heapless::String<240>;

impl State {
    fn saved_here(&mut self) -> Option<&mut Option<Saved>> {
        self.saved.levels.get_mut(self.call_level as usize)
    }

    /// M70, M71, M72, M73. True if other blocks have run.
    pub(crate) fn save_or_restore(
        &mut self,
        number: i32,
        block: &Block,
        out: &mut Out<'_>,
    ) -> Result<bool, Error> {
        let none = Err(block.m_error(MGroup::Spindle, ErrorKind::StateNone));
        match number {
            70 | 73 => {
                let saved = Saved {
                    modal: self.modal.clone(),
                    tool_offset: self.tool_offset,
                    g92_applied: self.parameters.get(parameters::G92_APPLIED) != 0.0,
                    on_return: number == 73,
                };
                if let Some(place) = self.saved_here() {
                    *place = Some(saved);
                }
                Ok(false)
            }
            71 => {
                if let Some(place) = self.saved_here() {
                    *place = None;
                }
                Ok(false)
            }
            _ => match self.saved_here().and_then(|place| place.clone()) {
                Some(saved) => self.restore(&saved, block.m_span(MGroup::Spindle), out),
                None => none,
            },
        }
    }

    /// A sub returns: what it remembered is forgotten; with M73 it is to be restored.
    #[cfg(feature = "alloc")]
    pub(crate) fn forget_saved(&mut self) -> Option<Saved> {
        self.saved_here().and_then(Option::take).filter(|saved| saved.on_return)
    }

    /// Runs the blocks that bring the state back. True if there were any.
    pub(crate) fn restore(&mut self, saved: &Saved, span: Span, out: &mut Out<'_>) -> Result<bool, Error> {
        let mut ran = false;
        if saved.modal.units != self.modal.units {
            let units = if saved.modal.units == LengthUnit::Inch { "G20" } else { "G21" };
            ran |= self.run_text(units, span, out)?;
        }
        let m_codes = self.m_codes_to(&saved.modal);
        let mut m_codes = m_codes.iter();
        let mut text = self.g_codes_to(saved);
        // In LinuxCNC the first M code stands in the block of the G codes (checked with rs274 2.9).
        if self.settings.dialect != Dialect::Pkm {
            let _ = text.push_str(m_codes.next().unwrap_or(&""));
        }
        ran |= self.run_text(&text, span, out)?;
        for text in m_codes {
            ran |= self.run_text(text, span, out)?;
        }
        Ok(ran)
    }

    /// Interprets a line that is not in the source; errors point at `span`. False for an empty one.
    fn run_text(&mut self, text: &str, span: Span, out: &mut Out<'_>) -> Result<bool, Error> {
        if text.is_empty() {
            return Ok(false);
        }
        if self.settings.dialect != Dialect::Pkm {
            // What follows bears no N (checked with rs274 2.9).
            out.line_read(text.as_bytes());
        }
        let at = |error: Error| Error { span, ..error };
        let mut line = Line::new();
        line.load(text.as_bytes(), span.file, span.line).map_err(at)?;
        line.prepare().map_err(at)?;
        let mut block = Block::new();
        block.read(&line, 0, self, &self.reader()).map_err(at)?;
        self.complete(&mut block).map_err(at)?;
        self.execute(&mut block, &line, out).map_err(at).map(|_| true)
    }

    /// The block of G codes, F and S.
    fn g_codes_to(&self, saved: &Saved) -> Text {
        let (now, then) = (&self.modal, &saved.modal);
        let always = self.settings.dialect != Dialect::LinuxCnc29;
        let mut text = Text::new();
        // The text has room for every code at once; a write cannot fail.
        if always || then.feed != now.feed {
            let _ = write!(text, "F{:.6} ", then.feed);
        }
        if always || then.spindles[0].speed != now.spindles[0].speed {
            let _ = write!(text, "S{:.6} ", then.spindles[0].speed);
        }
        if then.plane != now.plane {
            let _ = text.push_str(match then.plane {
                Plane::Xy => "G17 ",
                Plane::Xz => "G18 ",
                Plane::Yz => "G19 ",
                Plane::Uv => "G17.1 ",
                Plane::Uw => "G18.1 ",
                Plane::Vw => "G19.1 ",
            });
        }
        if then.compensation != now.compensation {
            let _ = text.push_str(match then.compensation {
                None => "G40 ",
                Some(Side::Left) => "G41 ",
                Some(Side::Right) => "G42 ",
            });
        }
        if then.incremental != now.incremental {
            let _ = text.push_str(if then.incremental { "G91 " } else { "G90 " });
        }
        if then.feed_mode != now.feed_mode {
            let _ = text.push_str(match then.feed_mode {
                FeedMode::InverseTime => "G93 ",
                FeedMode::PerMinute => "G94 ",
                FeedMode::PerTurn => "G95 ",
            });
        }
        if then.system != now.system {
            let _ = match then.system {
                n @ 1..=6 => write!(text, "G{} ", 53 + n),
                n => write!(text, "G59.{} ", n - 6),
            };
        }
        let has_offset = |offset: &[f64; 9]| offset.iter().any(|o| *o != 0.0);
        if has_offset(&saved.tool_offset) != has_offset(&self.tool_offset) {
            let _ = text.push_str(if has_offset(&saved.tool_offset) { "G43 " } else { "G49 " });
        }
        if then.retract_to_old != now.retract_to_old {
            let _ = text.push_str(if then.retract_to_old { "G98 " } else { "G99 " });
        }
        let css = |modal: &Modal| modal.spindles[0].surface_speed.is_some();
        if css(then) != css(now) {
            let _ = text.push_str(if css(then) { "G96 " } else { "G97 " });
        }
        if then.arc_centre_absolute != now.arc_centre_absolute {
            let _ = text.push_str(if then.arc_centre_absolute { "G90.1 " } else { "G91.1 " });
        }
        if then.diameter != now.diameter {
            let _ = text.push_str(if then.diameter { "G7 " } else { "G8 " });
        }
        let g92_applied = self.parameters.get(parameters::G92_APPLIED) != 0.0;
        if saved.g92_applied != g92_applied {
            let _ = text.push_str(if saved.g92_applied { "G92.3 " } else { "G92.2 " });
        }
        if then.path != now.path || then.naivecam_tolerance != now.naivecam_tolerance {
            let _ = match then.path {
                MotionControlMode::ExactPath => text.write_str("G61"),
                MotionControlMode::ExactStop => text.write_str("G61.1"),
                MotionControlMode::Continuous { tolerance } => {
                    write!(text, "G64 P{tolerance:.6} Q{:.6}", then.naivecam_tolerance)
                }
                MotionControlMode::Unset => Ok(()),
            };
        }
        text
    }

    /// The M codes. LinuxCNC misses some of the way back (checked with rs274 2.9): one kind of coolant that is too much,
    /// M51, M52 and M53 P0.
    fn m_codes_to(&self, then: &Modal) -> Vec<&'static str, 8> {
        let (now, pkm) = (&self.modal, self.settings.dialect == Dialect::Pkm);
        let mut texts = Vec::new();
        // There is room for every code at once; a push cannot fail.
        let mut add = |needed: bool, text| {
            if needed {
                let _ = texts.push(text);
            }
        };
        let turning = then.spindles[0].turning;
        add(
            turning != now.spindles[0].turning,
            match turning {
                None => "M5",
                Some(Direction::Clockwise) => "M3",
                Some(Direction::Counterclockwise) => "M4",
            },
        );
        let too_much = (now.mist && !then.mist) || (now.flood && !then.flood);
        let off = too_much && (pkm || !(then.mist || then.flood));
        add(off, "M9");
        add(then.mist && (off || !now.mist), "M7");
        add(then.flood && (off || !now.flood), "M8");
        if pkm {
            let [feed, speed] = [then.feed_override, then.spindles[0].speed_override];
            add(feed != now.feed_override, if feed { "M50 P1" } else { "M50 P0" });
            add(speed != now.spindles[0].speed_override, if speed { "M51 P1" } else { "M51 P0" });
            let [adaptive, hold] = [then.adaptive_feed, then.feed_hold];
            add(adaptive != now.adaptive_feed, if adaptive { "M52 P1" } else { "M52 P0" });
            add(hold != now.feed_hold, if hold { "M53 P1" } else { "M53 P0" });
        } else {
            add(then.feed_override != now.feed_override, if then.feed_override { "M48" } else { "M51" });
            add(then.feed_hold && !now.feed_hold, "M53");
        }
        texts
    }
}
