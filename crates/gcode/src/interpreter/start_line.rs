//! Run from line: the lines before it are interpreted as they stand, calls and loops included, and what they command is
//! thrown away; then the state they leave is commanded, and the program goes on at that line.

use super::{Interpreter, Out, Phase, Status};
use crate::error::{Error, ErrorKind};
use crate::modal::{FeedMode, G0, G1, G33, GCode, GGroup};
use crate::source::{LineSource, Place};
use crate::static_check::{Nesting, nesting_at};
use pkm_canon::{Canon, CanonSink, FileId, Position, Span};

/// Takes what is commanded before the line, and notes what the machine alone could answer.
#[derive(Default)]
struct Replay {
    unknown: Option<Span>,
}

impl CanonSink for Replay {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        if matches!(command, Canon::StraightProbe { .. } | Canon::MachineCode(_) | Canon::WaitInput { .. }) {
            self.unknown.get_or_insert(span);
        }
    }
}

impl Interpreter {
    /// Goes on at a line of the program, counted from 1, instead of its first: call it before the first step. Modes,
    /// offsets, tool, feed, spindle, coolant, parameters and position are what the lines before it leave; they are
    /// commanded before this returns, without motion and without a tool change: the tool is taken to be in the spindle.
    ///
    /// # Errors
    /// The line is inside a sub, branch or loop, behind the end, or where compensation or a spline is open; a block before
    /// it is wrong, or depends on what the machine did (a probe, an input, a code of the machine's own).
    pub fn skip_to_line(
        &mut self,
        line: u32,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<(), Error> {
        let span = Span::new(FileId(0), line, 0, 0);
        let fail = |kind| Err(Error { kind, span });
        let first = Place::default();
        let sought = |interpreter: &Self, source: &mut dyn LineSource| {
            let kind = |cause| Error { kind: ErrorKind::FileOpen { cause }, span: interpreter.line.whole() };
            source.seek(first).map_err(kind)
        };
        sought(self, source)?;
        match nesting_at(source, &self.state.settings, &self.state.remaps, line) {
            Nesting::Top => {}
            Nesting::Sub => return fail(ErrorKind::StartInSub { line }),
            Nesting::Construct => return fail(ErrorKind::StartInConstruct { line }),
            Nesting::Nowhere => return fail(ErrorKind::StartPastEnd { line }),
        }
        sought(self, source)?;
        let mut replay = Replay::default();
        loop {
            let place = source.place();
            if place.file == FileId(0)
                && place.line + 1 == line
                && self.flow.depth() == 0
                && !self.is_skipping()
            {
                break;
            }
            let status = self.step(source, &mut replay)?;
            if let Some(span) = replay.unknown {
                return Err(Error { kind: ErrorKind::StartUnknown, span });
            }
            if status == Status::Ended {
                return fail(ErrorKind::StartPastEnd { line });
            }
        }
        if self.state.modal.compensation.is_some() {
            return fail(ErrorKind::StartCompensation { line });
        }
        if self.state.splines.is_open() {
            return fail(ErrorKind::StartSpline { line });
        }
        self.prepare_tools()?;
        self.start(sink);
        if self.phase != Phase::Opening {
            self.command_state(span, sink);
        }
        Ok(())
    }

    /// After [`Interpreter::skip_to_line`]: the machine stands elsewhere than the lines before would have left it (machine
    /// coordinates, mm and degrees). The first move must then be straight and absolute.
    pub fn begin_elsewhere(&mut self, position: Position) {
        self.set_machine_position_mm(position);
        self.approaches = true;
    }

    /// The first move after [`Interpreter::begin_elsewhere`].
    pub(super) fn check_approach(&mut self, motion: GCode) -> Result<(), Error> {
        self.approaches = false;
        let incremental = match self.block.g(GGroup::Distance) {
            Some(code) => code == 910,
            None => self.state.modal.incremental,
        };
        let kind = if incremental {
            ErrorKind::StartIncremental
        } else if matches!(motion, G0 | G1) || motion > G33 && motion != crate::modal::G33_1 {
            return Ok(());
        } else {
            ErrorKind::StartArc
        };
        Err(self.block.motion_error(kind))
    }

    fn command_state(&mut self, span: Span, sink: &mut dyn CanonSink) {
        let state = &self.state;
        let modal = &state.modal;
        let mut out = Out { sink, span, queue: &mut self.queue };
        out.emit(Canon::UseLengthUnits(modal.units));
        out.emit(state.g5x_command());
        out.emit(state.g92_command());
        out.emit(Canon::SetXyRotation(state.rotation_deg));
        if let Some(tool) = state
            .tools
            .get(0)
            .filter(|tool| state.loaded_slot > 0 || state.settings.exchanges_tools() && tool.number > 0)
        {
            out.emit(Canon::ChangeToolNumber { slot: state.loaded_slot, tool: tool.number });
        }
        if modal.selected_slot >= 0 {
            out.emit(Canon::SelectTool(modal.selected_tool));
        }
        out.emit(Canon::UseToolLengthOffset(Position::from_array(state.tool_offset)));
        out.emit(Canon::SelectPlane(modal.plane));
        out.emit(Canon::SetMotionControlMode(modal.path));
        out.emit(Canon::SetNaivecamTolerance(modal.naivecam_tolerance));
        let mode = i32::from(modal.feed_mode == FeedMode::PerTurn);
        out.emit(Canon::SetFeedMode { spindle: 0, mode });
        out.emit(Canon::SetFeedRate(modal.feed));
        out.emit(Canon::FeedOverride(modal.feed_override));
        for (number, spindle) in (0..).zip(&modal.spindles[..state.settings.spindles.min(8).into()]) {
            out.emit(Canon::SpeedOverride { spindle: number, on: spindle.speed_override });
            let css_limit = spindle.surface_speed.unwrap_or(0.0);
            out.emit(Canon::SetSpindleMode { spindle: number, css_limit });
            out.emit(Canon::SetSpindleSpeed { spindle: number, speed: spindle.speed });
            if let Some(direction) = spindle.turning {
                out.emit(Canon::StartSpindle { spindle: number, direction });
            }
        }
        if modal.mist {
            out.emit(Canon::Mist(true));
        }
        if modal.flood {
            out.emit(Canon::Flood(true));
        }
    }
}
