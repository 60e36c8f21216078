//! Prints one program of the random generator: `... --example random_program -- FLAVOUR SEED`; with `variables` behind it
//! the parameter file that it may begin with.

#[path = "../tests/support/generator.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod generator;

use generator::{Flavour, program, variables};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [flavour, seed, what @ ..] = arguments.as_slice() else { panic!("FLAVOUR SEED [variables]") };
    let seed = seed.parse().expect("a seed");
    let flavour = Flavour::ALL.into_iter().find(|f| format!("{f:?}") == *flavour).expect("a flavour");
    #[allow(clippy::print_stdout)]
    {
        print!("{}", if what.is_empty() { program(seed, flavour) } else { variables(seed) });
    }
}
