//! Compiles `every_mechanism.c` with the system's C compiler against the checked-in header and the static library, and runs it.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The static library that cargo built beside this test.
fn library() -> PathBuf {
    let exe = std::env::current_exe().expect("this test");
    let deps = exe.parent().expect("deps");
    let newest = |dir: &Path| {
        let files = std::fs::read_dir(dir).expect("a folder").filter_map(Result::ok).map(|f| f.path());
        files
            .filter(|f| {
                let name = f.file_name().unwrap_or_default().to_string_lossy().into_owned();
                name.starts_with("libpkm_kins_c") && name.ends_with(".a")
            })
            .max_by_key(|f| f.metadata().and_then(|m| m.modified()).expect("a time"))
    };
    newest(deps).or_else(|| newest(deps.parent().expect("profile"))).expect("libpkm_kins_c*.a")
}

#[test]
fn a_c_program_calls_every_mechanism() {
    let root = env!("CARGO_MANIFEST_DIR");
    let program = std::env::temp_dir().join(format!("pkm-kins-c-{}", std::process::id()));
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let compiled = Command::new(&compiler)
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(format!("{root}/include"))
        .arg(format!("{root}/tests/every_mechanism.c"))
        .arg(library())
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(&program)
        .output()
        .unwrap_or_else(|e| panic!("{compiler}: {e}"));
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let run = Command::new(&program).output().expect("the program runs");
    let _ = std::fs::remove_file(&program);
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success(), "{said}");
    assert!(said.contains("lambda6 ok, 6 joints") && said.contains("0 failures"), "{said}");
}
