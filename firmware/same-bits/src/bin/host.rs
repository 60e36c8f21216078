//! Prints the hash of this computer; on a microcontroller an empty program.
#![cfg_attr(any(target_os = "none", target_arch = "wasm32"), no_std, no_main)]

#[cfg(not(any(target_os = "none", target_arch = "wasm32")))]
fn main() {
    let all = || pkm_same_bits::kinematics(pkm_same_bits::COUNT);
    let (hash, reachable) = all();
    // the number that crates/stepgen/tests/edges.rs expects
    assert_eq!(pkm_same_bits::steps::hash(), 0x7ca1_c86c_ce98_cf9d);
    let (_, steps) = pkm_same_bits::controller::hash();
    assert!(steps > 0, "the controller refused its program");
    // on two threads at once: nothing is shared
    let threads = [std::thread::spawn(all), std::thread::spawn(all)];
    for thread in threads {
        assert_eq!(thread.join().ok(), Some((hash, reachable)));
    }
    eprintln!("the controller's program: {steps} steps");
    println!("{hash:016x} {reachable}");
}
