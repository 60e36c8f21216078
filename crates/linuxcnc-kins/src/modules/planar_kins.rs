//! A general planar mechanism: `loadrt planar_kins`, geometry in `planar.*`.
#![no_std]

pkm_linuxcnc_kins::module!("planar_kins", pkm_linuxcnc_kins::pkm_kins::Planar);
