//! One mechanism of the HV-Mill: `loadrt hv_mill_kins`, geometry in `hv-mill.*`.
#![no_std]

pkm_linuxcnc_kins::module!("hv_mill_kins", pkm_linuxcnc_kins::pkm_kins::HvMill);
