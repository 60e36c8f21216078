//! Prints the hash through semihosting; on other targets an empty program.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target {
    use cortex_m_semihosting::{debug, hprintln};
    use panic_semihosting as _;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let (hash, reachable) = pkm_same_bits::kinematics(pkm_same_bits::COUNT);
        hprintln!("{:016x} {}", hash, reachable);
        debug::exit(debug::EXIT_SUCCESS);
        loop {}
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
