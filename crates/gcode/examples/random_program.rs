//! Prints one program of the random generator: `... --example random_program -- FLAVOUR SEED`.

#[path = "../tests/support/generator.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod generator;

use generator::{Flavour, program};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [flavour, seed] = arguments.as_slice() else { panic!("FLAVOUR SEED") };
    let flavour = Flavour::ALL.into_iter().find(|f| format!("{f:?}") == *flavour).expect("a flavour");
    #[allow(clippy::print_stdout)]
    {
        print!("{}", program(seed.parse().expect("a seed"), flavour));
    }
}
