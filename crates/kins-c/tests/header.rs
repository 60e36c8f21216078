//! The checked-in header is what cbindgen makes of the source. `PKM_BLESS=1 cargo test -p pkm-kins-c` writes it anew.

#[test]
fn the_header_is_current() {
    let root = env!("CARGO_MANIFEST_DIR");
    let config = cbindgen::Config::from_file(format!("{root}/cbindgen.toml")).expect("cbindgen.toml");
    let bindings = cbindgen::Builder::new()
        .with_config(config)
        .with_src(format!("{root}/src/lib.rs"))
        .with_src(format!("{root}/src/parameters.rs"))
        .generate()
        .expect("bindings");
    let mut made = Vec::new();
    bindings.write(&mut made);
    let made = String::from_utf8(made).expect("UTF-8");
    let path = format!("{root}/include/pkm_kins.h");
    if std::env::var_os("PKM_BLESS").is_some() {
        let new = format!("{path}.new");
        std::io::Write::write_all(&mut std::fs::File::create(&new).expect("create"), made.as_bytes())
            .expect("write");
        std::fs::rename(&new, &path).expect("rename");
    }
    let there = std::fs::read_to_string(&path).expect("include/pkm_kins.h");
    assert!(there == made, "include/pkm_kins.h is not current: PKM_BLESS=1 cargo test -p pkm-kins-c");
}
