//! The interpreter: one block per step, executed in RS274's fixed order, out come canonical commands.

mod arcs;
mod check;
mod comments;
mod compensation;
mod cycles;
mod end;
mod execute;
#[cfg(feature = "alloc")]
mod flow;
#[cfg(feature = "alloc")]
mod lathe_cycles;
#[cfg(feature = "alloc")]
mod lathe_profile;
mod modes;
mod motion;
mod offsets;
mod probing;
mod queue;
#[cfg(feature = "alloc")]
mod recovery;
#[cfg(feature = "alloc")]
mod remap;
mod saved;
mod splines;
#[cfg(feature = "std")]
mod start_line;
mod state;
mod threads;
mod tools;

use crate::block::Block;
use crate::error::{Error, ErrorKind};
use crate::line::Line;
use crate::parameters::{self, Parameters};
use crate::settings::{Dialect, MM_PER_INCH, Settings};
use crate::source::{LineSource, Place};
use crate::tool_table::ToolTable;
pub(crate) use arcs::PlaneAxes;
use pkm_canon::{Canon, CanonSink, FileId, LengthUnit, Position, Span};
use queue::Queue;
use state::State;

/// True for the names that the interpreter itself gives a value.
#[cfg(feature = "std")]
pub(crate) fn is_predefined(name: &[u8]) -> bool {
    static STATE: std::sync::OnceLock<alloc::boxed::Box<State>> = std::sync::OnceLock::new();
    let state = STATE.get_or_init(|| alloc::boxed::Box::new(State::new(Settings::default())));
    name == b"_current_tool" || state.predefined(name).is_some()
}

/// pkm's own dialect accepts it before the first block.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// What a step left behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Go on with the next step.
    Running,
    /// The block probed, changed the tool, read an input or held a code of the machine's own: the next block depends on
    /// what the machine did. A caller with a machine lets the motion finish and tells the interpreter (see
    /// [`Interpreter::set_position`]); without one it may go on at once.
    Synch,
    /// The program has ended by M2, M30, M99 or `%`; the rest of the source is not read.
    Ended,
}

/// Takes commands and stamps them with the block they come from.
pub(crate) struct Out<'a> {
    sink: &'a mut dyn CanonSink,
    span: Span,
    /// What waits for the end of a compensated move.
    queue: &'a mut Queue,
}

impl Out<'_> {
    /// Emits a command, or lets it wait behind a compensated move.
    pub(crate) fn emit(&mut self, command: Canon<'_>) {
        if !self.queue.take(&command, self.span) {
            self.sink.command(&command, self.span);
        }
    }

    /// The interpreter's own remarks, as LinuxCNC words them.
    pub(crate) fn remark(&mut self, text: &str) {
        self.emit(Canon::Comment(text.into()));
    }

    /// A line that the interpreter has written itself is interpreted.
    pub(crate) fn line_read(&mut self, text: &[u8]) {
        self.sink.line_read(text, self.span);
    }

    /// Everything that waits goes out.
    pub(crate) fn flush(&mut self) {
        self.queue.flush(self.sink);
    }
}

/// How far the program is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing was emitted.
    New,
    /// No block was read yet; blank lines may come.
    Opening,
    /// Between the first block and the end; `framed` = the program began with `%`.
    Running { framed: bool },
    /// After the end.
    Ended,
}

/// An RS274/NGC interpreter: modal state, parameters, tool table.
#[derive(Debug, Clone)]
pub struct Interpreter {
    state: State,
    line: Line,
    block: Block,
    phase: Phase,
    queue: Queue,
    begun: bool,
    /// Blocks since the last motion, dwell or input.
    idle_blocks: u64,
    /// Blocks executed or passed over.
    blocks: u64,
    /// The block has been read and is being executed.
    executing: bool,
    /// The next move is the first after a start from a line.
    #[cfg(feature = "std")]
    approaches: bool,
    /// Lines of the program before this one have been executed: what lies before it is executed again.
    furthest: u32,
    #[cfg(feature = "alloc")]
    flow: flow::Flow,
    #[cfg(feature = "alloc")]
    recovery: recovery::Recovery,
    #[cfg(feature = "alloc")]
    remapping: remap::Remapping,
    /// The lathe cycle whose profile is being read.
    #[cfg(feature = "alloc")]
    lathe: Option<alloc::boxed::Box<lathe_cycles::Profile>>,
}

impl Interpreter {
    /// An interpreter in its start state: G17 G21 G40 G49 G54 G80 G90 G91.1 G94 G97 G99 G8, position 0.
    pub fn new(settings: Settings) -> Self {
        Self {
            state: State::new(settings),
            line: Line::new(),
            block: Block::new(),
            phase: Phase::New,
            queue: Queue::default(),
            begun: false,
            idle_blocks: 0,
            blocks: 0,
            executing: false,
            #[cfg(feature = "std")]
            approaches: false,
            furthest: 0,
            #[cfg(feature = "alloc")]
            flow: flow::Flow::default(),
            #[cfg(feature = "alloc")]
            recovery: recovery::Recovery::default(),
            #[cfg(feature = "alloc")]
            remapping: remap::Remapping::default(),
            #[cfg(feature = "alloc")]
            lathe: None,
        }
    }

    pub(crate) fn settings(&self) -> &Settings {
        &self.state.settings
    }

    /// The parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.state.parameters
    }

    /// The parameters, to load a parameter file before the first step. What is set here about offsets and the
    /// active coordinate system takes effect at the start.
    pub fn parameters_mut(&mut self) -> &mut Parameters {
        &mut self.state.parameters
    }

    /// The tool table.
    pub fn tools(&self) -> &ToolTable {
        &self.state.tools
    }

    /// The tool table, to fill it before the first step.
    pub fn tools_mut(&mut self) -> &mut ToolTable {
        &mut self.state.tools
    }

    /// The line read last, trailing blanks cut: the source text for messages.
    pub fn source_line(&self) -> &[u8] {
        self.line.raw()
    }

    /// The text of a span's line if it is the line read last, else nothing: an error may point back, for example to
    /// the call of a sub that was not found.
    pub fn source_line_of(&self, span: Span) -> &[u8] {
        if (span.file, span.line) == (self.line.file, self.line.number) { self.line.raw() } else { &[] }
    }

    /// The open calls, innermost first: where the block being executed was called from.
    #[cfg(feature = "alloc")]
    pub fn calls(&self) -> impl Iterator<Item = Span> {
        self.flow.calls()
    }

    /// All labels of o-words read so far, and the one of a sub that is looked for.
    #[cfg(feature = "std")]
    pub(crate) fn labels(&self) -> (impl Iterator<Item = &[u8]>, Option<&[u8]>) {
        (self.flow.label_names(), self.flow.missing())
    }

    /// Where the program believes the tool is: program coordinates, program units, degrees.
    pub fn position(&self) -> Position {
        Position::from_array(self.state.position)
    }

    /// Tells the interpreter where the machine stands: machine coordinates, mm and degrees, without offsets. Call
    /// it before the first step (the program starts where the machine stands) and after [`Status::Synch`].
    pub fn set_machine_position_mm(&mut self, position: Position) {
        if self.phase == Phase::New {
            self.state.take_over_parameters();
        }
        self.state.set_machine_position_mm(position);
    }

    /// Where the program believes the machine stands: machine coordinates, mm and degrees, offsets included.
    pub fn machine_position_mm(&self) -> Position {
        let mut machine = self.state.machine_point(self.state.position);
        if self.state.modal.units == LengthUnit::Inch {
            state::scale_lengths(&mut machine, MM_PER_INCH);
        }
        Position::from_array(machine)
    }

    /// After [`Interpreter::go_on`]: the code of the machine's own that stands in the block at fault. The caller does it all the same,
    /// so that what follows is not misjudged.
    #[cfg(feature = "alloc")]
    pub fn lost_machine_code(&self) -> Option<(i32, Span)> {
        self.recovery.lost_code
    }

    /// Tells the interpreter where the tool is: program coordinates, program units, degrees.
    pub fn set_position(&mut self, position: Position) {
        self.state.position = position.to_array();
    }

    /// Tells the interpreter where the probe tripped (program coordinates and units) and whether it did.
    pub fn set_probe_result(&mut self, point: Position, tripped: bool) {
        self.state.parameters.set_nine(parameters::PROBE_POINT, &point.to_array());
        self.state.parameters.set(parameters::PROBE_TRIPPED, tripped.into());
    }

    /// Tells the interpreter the answer to M66: the input's value, or `None` when the wait timed out.
    pub fn set_input(&mut self, value: Option<f64>) {
        self.state.parameters.set(parameters::INPUT, value.unwrap_or(-1.0));
    }

    /// What the last block does that its writer may not expect, a note and no error: an arc with a larger difference of its
    /// radii than any before it.
    pub fn take_notice(&mut self) -> Option<Error> {
        self.state.notice.take()
    }

    /// The G94 or G95 that made F unset, as long as F was not set again.
    #[cfg(feature = "std")]
    pub(crate) fn feed_unset(&self) -> Option<Span> {
        self.state.feed_unset
    }

    /// True after M2, M30, M99, the closing `%` or the end of the file.
    pub fn has_ended(&self) -> bool {
        self.phase == Phase::Ended
    }

    /// True once a block was read.
    pub fn has_begun(&self) -> bool {
        self.begun
    }

    /// Emits what every program begins with: units, offsets, rotation. The first step does it by itself.
    pub fn start(&mut self, sink: &mut dyn CanonSink) {
        if self.phase != Phase::New {
            return;
        }
        self.phase = Phase::Opening;
        self.state.take_over_parameters();
        let state = &self.state;
        let mut out = Out { sink, span: Span::default(), queue: &mut self.queue };
        out.emit(Canon::UseLengthUnits(state.modal.units));
        out.emit(state.g5x_command());
        out.emit(state.g92_command());
        out.emit(Canon::SetXyRotation(state.rotation_deg));
        out.emit(Canon::SetFeedReference);
    }

    /// Before the first block a random tool changer gets its tools in order.
    fn prepare_tools(&mut self) -> Result<(), Error> {
        if self.phase != Phase::New || !self.state.settings.random_toolchanger {
            return Ok(());
        }
        self.state.prepare_random_changer().map_err(|kind| {
            self.phase = Phase::Ended;
            Error { kind, span: Span::default() }
        })
    }

    /// Reads and executes one block.
    ///
    /// # Errors
    /// What is wrong with the block and where. Commands of the block that come before the error in the order of
    /// execution have been emitted. The next step goes on with the next block; what would only repeat or follow from
    /// an error that was returned is not returned again (with the feature `alloc`).
    pub fn step(&mut self, source: &mut dyn LineSource, sink: &mut dyn CanonSink) -> Result<Status, Error> {
        self.prepare_tools()?;
        self.start(sink);
        #[cfg(feature = "alloc")]
        self.go_on(source, sink);
        let here = source.place();
        let stepped = self.step_block(source, sink);
        #[cfg(feature = "alloc")]
        if stepped.is_err() {
            self.spoil_profile();
        }
        #[cfg(feature = "alloc")]
        let stepped = self.recover(stepped, here, source, sink);
        #[cfg(not(feature = "alloc"))]
        let _ = here;
        stepped
    }

    fn step_block(&mut self, source: &mut dyn LineSource, sink: &mut dyn CanonSink) -> Result<Status, Error> {
        if self.phase == Phase::Ended {
            return Ok(Status::Ended);
        }
        let place = source.place();
        let number = place.line + 1;
        match source.next_line() {
            Ok(Some(text)) => {
                let marked = self.phase == Phase::Opening && number == 1 && text.starts_with(BYTE_ORDER_MARK);
                let refused = marked && self.state.settings.dialect != Dialect::Pkm;
                let text = if marked && !refused { &text[BYTE_ORDER_MARK.len()..] } else { text };
                let loaded = self.line.load(text, place.file, number);
                let mut frame_begins = false;
                if self.phase == Phase::Opening && !self.line.raw().is_empty() {
                    sink.command(&Canon::OnReset, Span::default());
                    self.begun = true;
                    frame_begins = self.line.raw().trim_ascii() == b"%";
                    self.phase = Phase::Running { framed: frame_begins };
                }
                sink.line_read(self.line.raw(), self.line.whole());
                if frame_begins {
                    return Ok(Status::Running);
                }
                // A line that cannot be read counts too: a loop of such lines must end.
                self.count_block(place)?;
                loaded?;
                if refused {
                    let span = self.line.span(0, BYTE_ORDER_MARK.len());
                    return Err(Error { kind: ErrorKind::ByteOrderMark, span });
                }
            }
            Ok(None) => return Err(self.end_of_file()),
            Err(cause) => {
                self.phase = Phase::Ended;
                let span = Span::new(place.file, number, 0, 0);
                return Err(Error { kind: ErrorKind::FileOpen { cause }, span });
            }
        }
        self.execute_line(place, source, sink)
    }

    fn end_of_file(&mut self) -> Error {
        let kind = match self.phase {
            Phase::Running { framed: true } => ErrorKind::FileNoEndPercent,
            Phase::Running { framed: false } => ErrorKind::FileNoEnd,
            _ => ErrorKind::FileEmpty,
        };
        // The search for a sub ends here; the program may go on behind its call.
        #[cfg(feature = "alloc")]
        if let Some(error) = self.flow.unanswered() {
            return error;
        }
        self.phase = Phase::Ended;
        // What lacks its end has swallowed M2.
        #[cfg(feature = "alloc")]
        if let Some(error) = self.flow.unclosed() {
            return error;
        }
        let end = self.line.raw().len();
        Error { kind, span: self.line.span(end, end) }
    }

    /// A loop that does nothing for too long is taken for endless; a run may have a limit. Lines of the program that are
    /// executed for the first time do not count: however long it is, it ends.
    fn count_block(&mut self, here: Place) -> Result<(), Error> {
        if here.file == FileId(0) && here.line >= self.furthest {
            self.furthest = here.line + 1;
            return Ok(());
        }
        self.idle_blocks += 1;
        self.blocks += 1;
        let Settings { max_idle_blocks, max_blocks, .. } = self.state.settings;
        let kind = if max_idle_blocks > 0 && self.idle_blocks > max_idle_blocks {
            ErrorKind::EndlessLoop { blocks: max_idle_blocks }
        } else if max_blocks > 0 && self.blocks > max_blocks {
            ErrorKind::TooManyBlocks { limit: max_blocks }
        } else {
            return Ok(());
        };
        self.phase = Phase::Ended;
        #[cfg(feature = "alloc")]
        let span = self.flow.last_loop().unwrap_or_else(|| self.line.whole());
        #[cfg(not(feature = "alloc"))]
        let span = self.line.whole();
        Err(Error { kind, span })
    }

    fn execute_line(
        &mut self,
        here: Place,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<Status, Error> {
        let trimmed = self.line.raw().trim_ascii_start();
        let framed = self.phase == Phase::Running { framed: true };
        match trimmed {
            [] => return Ok(Status::Running),
            b"%" if framed => {
                sink.command(&Canon::Finish, self.line.whole());
                #[cfg(feature = "alloc")]
                if let Some(error) = self.flow.unanswered() {
                    return Err(error);
                }
                self.phase = Phase::Ended;
                #[cfg(feature = "alloc")]
                if let Some(error) = self.flow.unclosed() {
                    return Err(error);
                }
                self.state.check_spline_ended(self.line.whole())?;
                return Ok(Status::Ended);
            }
            [b'/', ..] if self.state.settings.block_delete => return Ok(Status::Running),
            _ => {}
        }
        self.line.prepare()?;
        let start = self.line.skip_number()?;
        self.state.source_line = self.line.number;
        if self.line.code().get(start) == Some(&b'o') {
            return self.control(start, here, source, sink);
        }
        if self.is_skipping() {
            return Ok(Status::Running);
        }
        self.executing = false;
        #[cfg(feature = "alloc")]
        if self.depends_on_an_error() {
            self.salvage(start, source, sink);
            let ended = self.phase == Phase::Ended;
            return Ok(if ended { Status::Ended } else { Status::Running });
        }
        let reader = self.state.reader();
        #[cfg(feature = "alloc")]
        let reader = self.profile_reader(reader);
        self.block.read(&self.line, start, &self.state, &reader)?;
        self.state.complete(&mut self.block)?;
        #[cfg(feature = "std")]
        if let Some(motion) = self.block.motion.filter(|_| self.approaches) {
            self.check_approach(motion)?;
        }
        if self.block.motion.is_some() || self.block.has_pause() {
            self.idle_blocks = 0;
        }
        self.state.store_settings(&self.block, &self.line)?;
        if let Some(status) = self.program_call(source, sink)? {
            return Ok(status);
        }
        #[cfg(feature = "alloc")]
        if self.lathe.is_some() {
            self.take_profile_block()?;
            return Ok(Status::Running);
        }
        #[cfg(feature = "alloc")]
        if !self.state.remaps.is_empty() && self.holds_remap() {
            return self.begin_remapped(source, sink);
        }
        self.execute_block(source, sink)
    }

    /// Executes the block as it is.
    #[inline(always)]
    fn execute_block(
        &mut self,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<Status, Error> {
        let framed = self.phase == Phase::Running { framed: true };
        let mut out = Out { sink, span: self.block.span(), queue: &mut self.queue };
        self.executing = true;
        let status = self.state.execute(&mut self.block, &self.line, &mut out)?;
        if out.queue.overflow {
            self.phase = Phase::Ended;
            let kind = ErrorKind::QueueFull { limit: queue::MAX_WAITING as u16 };
            return Err(Error { kind, span: self.block.span() });
        }
        #[cfg(feature = "alloc")]
        if status != Status::Ended {
            self.begin_profile(source)?;
            return Ok(status);
        }
        if status == Status::Ended {
            self.phase = Phase::Ended;
            if framed && !has_closing_percent(source) {
                out.remark("interpreter: percent sign missing from end of file");
            }
        }
        Ok(status)
    }

    #[cfg(feature = "alloc")]
    fn control(
        &mut self,
        start: usize,
        here: Place,
        source: &mut dyn LineSource,
        sink: &mut dyn CanonSink,
    ) -> Result<Status, Error> {
        let span = self.line.whole();
        if let Some(saved) = self.o_word(start, here, source)? {
            self.state.restore(&saved, span, &mut Out { sink, span, queue: &mut self.queue })?;
        }
        self.end_profile(sink)?;
        self.end_remapped(source, sink)
    }

    #[cfg(feature = "alloc")]
    fn is_skipping(&self) -> bool {
        self.flow.is_skipping()
    }
}

/// Reads on to the closing `%`; the rest of the program is not interpreted.
fn has_closing_percent(source: &mut dyn LineSource) -> bool {
    while let Ok(Some(text)) = source.next_line() {
        if text.trim_ascii() == b"%" {
            return true;
        }
    }
    false
}

/// Without memory there are no o-words; each is refused by name.
#[cfg(not(feature = "alloc"))]
impl Interpreter {
    fn control(
        &mut self,
        start: usize,
        _: Place,
        _: &mut dyn LineSource,
        _: &mut dyn CanonSink,
    ) -> Result<Status, Error> {
        let span = self.line.code_span(start, self.line.code().len());
        Err(Error { kind: ErrorKind::ONoMemory, span })
    }

    fn is_skipping(&self) -> bool {
        false
    }

    fn program_call(&self, _: &mut dyn LineSource, _: &mut dyn CanonSink) -> Result<Option<Status>, Error> {
        match self.block.has_m(98) {
            true => Err(Error { kind: ErrorKind::ONoMemory, span: self.block.span() }),
            false => Ok(None),
        }
    }
}
