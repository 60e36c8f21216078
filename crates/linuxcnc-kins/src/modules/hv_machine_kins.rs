//! The HV-Mill with both mechanisms: `loadrt hv_machine_kins`, geometry in `hv-machine.*`.
#![no_std]

pkm_linuxcnc_kins::module!("hv_machine_kins", pkm_linuxcnc_kins::switchable::HvMachineKins);
