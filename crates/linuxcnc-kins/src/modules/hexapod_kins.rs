//! Hexapod: `loadrt hexapod_kins`, geometry in `hexapod.*`.
#![no_std]

pkm_linuxcnc_kins::module!("hexapod_kins", pkm_linuxcnc_kins::pkm_kins::Hexapod);
