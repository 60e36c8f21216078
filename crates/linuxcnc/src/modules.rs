//! Which LinuxCNC module serves which `kinematics.type`, and its geometry as HAL parameters.

use pkm_kins::{Named, Slot};
use pkm_machine::kinematics::Parameters;

/// A kinematics module of LinuxCNC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Module {
    /// What `loadrt` loads.
    pub name: &'static str,
    /// First part of its HAL names.
    pub prefix: &'static str,
}

/// `kinematics.type` and its module; `cartesian` is LinuxCNC's own trivkins.
pub(crate) const MODULES: [(&str, Module); 10] = [
    ("planar", Module { name: "planar_kins", prefix: "planar" }),
    ("moma", Module { name: "moma_kins", prefix: "moma" }),
    ("moma-4s", Module { name: "moma_4s_kins", prefix: "moma-4s" }),
    ("moma-w", Module { name: "moma_w_kins", prefix: "moma-w" }),
    ("hv-mill", Module { name: "hv_mill_kins", prefix: "hv-mill" }),
    ("hv-machine", Module { name: "hv_machine_kins", prefix: "hv-machine" }),
    ("ox-glide", Module { name: "ox_glide_kins", prefix: "ox-glide" }),
    ("lambda6", Module { name: "lambda_kins", prefix: "lambda" }),
    ("linear-delta", Module { name: "delta_kins", prefix: "linear-delta" }),
    ("hexapod", Module { name: "hexapod_kins", prefix: "hexapod" }),
];

/// The module of a `kinematics.type`; none for `cartesian`.
pub fn module(kind: &str) -> Option<Module> {
    MODULES.iter().find(|(name, _)| *name == kind).map(|(_, module)| *module)
}

/// Visits the parameters, whatever they are; `false` if they have no names.
pub(crate) fn visit(parameters: &mut Parameters, visitor: &mut impl FnMut(pkm_kins::Name, Slot<'_>)) -> bool {
    match parameters {
        Parameters::Planar(p) => p.visit(visitor),
        Parameters::Moma(p) => p.visit(visitor),
        Parameters::Moma4s(p) => p.visit(visitor),
        Parameters::MomaW(p) => p.visit(visitor),
        Parameters::HvMill(p) => p.visit(visitor),
        Parameters::HvMachine(p) => p.visit(visitor),
        Parameters::OxGlide(p) => p.visit(visitor),
        Parameters::Lambda6(p) => p.visit(visitor),
        Parameters::LinearDelta(p) => p.visit(visitor),
        Parameters::Hexapod(p) => p.visit(visitor),
        _ => return false,
    }
    true
}

/// HAL name (without the prefix) and value of every parameter. Numbers in the shortest form that reads back the same.
pub(crate) fn geometry(parameters: &Parameters) -> Vec<(String, String)> {
    let mut parameters = parameters.clone();
    let mut list = Vec::new();
    visit(&mut parameters, &mut |name, slot| {
        let value = match slot {
            Slot::Number(number) => number.to_string(),
            Slot::Integer(integer) => integer.to_string(),
            Slot::Flag(flag) => u8::from(*flag).to_string(),
        };
        list.push((name.to_string(), value));
    });
    list
}
