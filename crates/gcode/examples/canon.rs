//! Prints the canonical commands of a program as LinuxCNC's `rs274 -g` does:
//! `cargo run -p pkm-gcode --example canon -- PROGRAM [TOOL_TABLE]`.

use pkm_canon::text::{Spelling, TextWriter};
use pkm_gcode::{FileSource, Settings, ToolTable, canon_text};
use std::io::{BufWriter, Write};
use std::path::Path;

fn main() -> std::process::ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(program) = arguments.first() else { return std::process::ExitCode::from(2) };
    let directory = Path::new(program).parent().map_or_else(Default::default, Path::to_path_buf);
    let mut source = match FileSource::open(Path::new(program), vec![directory]) {
        Ok(source) => source,
        Err(error) => {
            eprintln!("{program}: {error}");
            return std::process::ExitCode::from(2);
        }
    };
    let tools = match arguments.get(1).map(std::fs::read) {
        Some(Ok(text)) => ToolTable::parse(&text, |_, _| {}).unwrap_or_default(),
        _ => ToolTable::default(),
    };
    let mut output = BufWriter::new(std::io::stdout().lock());
    let mut write = |bytes: &[u8]| {
        // A closed pipe ends the output, not the program.
        let _ = output.write_all(bytes);
    };
    let mut writer = TextWriter::new(&mut write, Spelling::V2_9);
    let mut failed = false;
    canon_text(Settings::rs274(), tools, &mut source, &mut writer, |error, line| {
        failed = true;
        let diagnostic = error.to_diagnostic(program, line);
        eprintln!(
            "{}:{}:{}: error[{}]: {}",
            diagnostic.file, diagnostic.line, diagnostic.column, diagnostic.code, diagnostic.message
        );
        eprintln!("{}", String::from_utf8_lossy(line));
        false
    });
    let _ = output.flush();
    std::process::ExitCode::from(u8::from(failed))
}
