//! Linear delta: `loadrt delta_kins`, geometry in `linear-delta.*`.
#![no_std]

pkm_linuxcnc_kins::module!("delta_kins", pkm_linuxcnc_kins::pkm_kins::LinearDelta);
