//! MOMA 4S: `loadrt moma_4s_kins`, geometry in `moma-4s.*`.
#![no_std]

pkm_linuxcnc_kins::module!("moma_4s_kins", pkm_linuxcnc_kins::pkm_kins::Moma4s);
