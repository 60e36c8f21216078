//! Canonical machining commands, as RS274/NGC names them, and the source spans that travel with them.
//!
//! This is the border between language and motion: `gcode` produces these commands and knows no machine;
//! `planner` consumes them and knows no parser. Nothing here allocates (feature `alloc`: [`diagnostic`]).
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

mod buffer;
mod command;
mod decimal;
#[cfg(feature = "alloc")]
pub mod diagnostic;
mod motion9;
mod span;
pub mod text;
mod text_bytes;

pub use command::*;
pub use motion9::Motion9Writer;
pub use span::{FileId, Span};
pub use text_bytes::Text;
