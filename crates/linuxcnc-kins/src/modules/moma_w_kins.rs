//! MOMA-W: `loadrt moma_w_kins`, geometry in `moma-w.*`.
#![no_std]

pkm_linuxcnc_kins::module!("moma_w_kins", pkm_linuxcnc_kins::pkm_kins::MomaW);
