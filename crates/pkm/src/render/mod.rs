//! How results and messages look.

pub(crate) mod diagnostics;
pub(crate) mod summary;
