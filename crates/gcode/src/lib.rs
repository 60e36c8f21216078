//! The RS274/NGC interpreter: text → blocks with spans → modal state → canonical commands.
//!
//! ```
//! use pkm_canon::{Canon, CanonSink, Span};
//! use pkm_gcode::{Interpreter, MemorySource, Settings, Status};
//!
//! struct Count(usize);
//! impl CanonSink for Count {
//!     fn command(&mut self, command: &Canon<'_>, _span: Span) {
//!         self.0 += usize::from(matches!(command, Canon::StraightFeed(_)));
//!     }
//! }
//!
//! let mut source = MemorySource::new(b"F100\nG1 X10\nY5\nM2\n");
//! let mut interpreter = Interpreter::new(Settings::default());
//! let mut feeds = Count(0);
//! while interpreter.step(&mut source, &mut feeds).expect("a correct program") != Status::Ended {}
//! assert_eq!(feeds.0, 2);
//! ```
//!
//! One [`Interpreter::step`] reads and executes one block. After an error the caller may stop, or go on with the
//! next block so that one run reports every independent error. Steady state allocates nothing; without the feature
//! `alloc` the interpreter runs plain programs on a microcontroller: no o-words, no user-defined named parameters.
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

#[cfg(feature = "std")]
mod advice;
mod block;
mod error;
mod expression;
mod functions;
mod interpreter;
mod lexer;
mod line;
mod modal;
#[cfg(feature = "alloc")]
mod o_word;
#[cfg(feature = "alloc")]
mod parameter_file;
mod parameters;
#[cfg(feature = "alloc")]
mod remap;
mod settings;
mod simulation;
mod source;
#[cfg(feature = "std")]
mod static_check;
mod tool_table;

pub use error::{Code, Error, ErrorKind};
pub use interpreter::{Interpreter, Status};
#[cfg(feature = "alloc")]
pub use parameter_file::ParameterFile;
pub use parameters::Parameters;
#[cfg(feature = "alloc")]
pub use remap::{Remap, RemapError};
pub use settings::{Dialect, MachineCodes, Settings};
pub use simulation::{SimulatedMachine, canon_text, canon_text_of};
#[cfg(feature = "std")]
pub use source::FileSource;
pub use source::{LineSource, MAX_LINE, MemorySource, Place, SourceError};
#[cfg(feature = "std")]
pub use static_check::static_check;
pub use tool_table::{MAX_TOOLS, ToolTable};
