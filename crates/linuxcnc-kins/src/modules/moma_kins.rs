//! MOMA: `loadrt moma_kins`, geometry in `moma.*`.
#![no_std]

pkm_linuxcnc_kins::module!("moma_kins", pkm_linuxcnc_kins::pkm_kins::Moma);
