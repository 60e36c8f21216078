//! Prints the hash of this computer; on a microcontroller an empty program.
#![cfg_attr(any(target_os = "none", target_arch = "wasm32"), no_std, no_main)]

#[cfg(not(any(target_os = "none", target_arch = "wasm32")))]
fn main() {
    let (hash, reachable) = pkm_same_bits::kinematics(pkm_same_bits::COUNT);
    // the number that crates/stepgen/tests/edges.rs expects
    assert_eq!(pkm_same_bits::steps::hash(), 0x7ca1_c86c_ce98_cf9d);
    println!("{hash:016x} {reachable}");
}
