//! How results and messages look.

pub(crate) mod canon_json;
pub(crate) mod diagnostics;
pub(crate) mod summary;
