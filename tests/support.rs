//! Runs the `pkm` binary and keeps what it said.

use serde_json::Value;
use std::ffi::OsStr;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// What a run of `pkm` left behind.
pub(crate) struct Run {
    /// Exit status; -1 after a signal.
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

/// Runs `pkm` with these arguments and this standard input.
pub(crate) fn pkm_with_input<S: AsRef<OsStr>>(arguments: &[S], input: &[u8]) -> Run {
    let mut child = Command::new(env!("CARGO_BIN_EXE_pkm"))
        .args(arguments)
        .env_remove("NO_COLOR")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("pkm starts");
    let mut stdin = child.stdin.take().expect("stdin is piped");
    let input = input.to_vec();
    let writer = std::thread::spawn(move || {
        // pkm may end before it has read everything.
        let _ = stdin.write_all(&input);
    });
    let output = child.wait_with_output().expect("pkm ends");
    writer.join().expect("the writer ends");
    let run = Run {
        status: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8(output.stdout).expect("stdout is UTF-8"),
        stderr: String::from_utf8(output.stderr).expect("stderr is UTF-8"),
    };
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    assert!((0..=2).contains(&run.status), "exit status {}\n{}", run.status, run.stderr);
    run
}

/// Runs `pkm` with these arguments and nothing on standard input.
pub(crate) fn pkm<S: AsRef<OsStr>>(arguments: &[S]) -> Run {
    pkm_with_input(arguments, b"")
}

impl Run {
    /// Standard output, one JSON value per line.
    #[track_caller]
    pub(crate) fn json_lines(&self) -> Vec<Value> {
        self.stdout
            .lines()
            .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}")))
            .collect()
    }
}

/// Writes a file; tests may, the program itself writes atomically.
#[allow(clippy::disallowed_methods)]
pub(crate) fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    std::fs::write(path, bytes).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}
