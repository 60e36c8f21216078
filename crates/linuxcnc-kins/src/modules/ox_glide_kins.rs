//! O-X glide: `loadrt ox_glide_kins`, geometry in `ox-glide.*`.
#![no_std]

pkm_linuxcnc_kins::module!("ox_glide_kins", pkm_linuxcnc_kins::switchable::OxGlideKins);
