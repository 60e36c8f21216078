//! The test binary stands in for LinuxCNC's HAL: the modules it loads must see its functions.
fn main() {
    println!("cargo::rustc-link-arg-tests=-rdynamic");
    println!("cargo::rerun-if-changed=build.rs");
}
