//! Lambda: `loadrt lambda_kins`, geometry in `lambda.*`.
#![no_std]

pkm_linuxcnc_kins::module!("lambda_kins", pkm_linuxcnc_kins::pkm_kins::Lambda6);
