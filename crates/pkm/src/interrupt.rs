//! Ctrl-C: the first asks for a clean end, the second ends at once. A command that has written nothing yet ends at once, too.

use std::io::{Write, stderr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status after Ctrl-C.
pub(crate) const STATUS: u8 = 130;

/// A flag that the first Ctrl-C (or SIGTERM, SIGHUP) sets.
pub(crate) fn flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&flag);
    // Without a handler Ctrl-C ends the program at once, which is safe too: files are written atomically.
    let _ = ctrlc::set_handler(move || {
        if seen.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(STATUS));
        }
    });
    flag
}

/// For a command that leaves nothing half done: the first Ctrl-C says so and ends it.
pub(crate) fn at_once(what: &'static str) {
    let _ = ctrlc::set_handler(move || {
        let _ = writeln!(stderr(), "interrupted: the {what} is not finished, nothing was written");
        std::process::exit(i32::from(STATUS));
    });
}
