//! `[kinematics]`: `type` chooses the mechanism, the other keys are its parameters as `pkm_kins` names them.
//!
//! | `type`      | parameters                                                      |
//! |-------------|-----------------------------------------------------------------|
//! | `cartesian` | `axes = "XYZ"`: the axes, one joint each, in letter order       |
//! | `planar`    | [`PlanarParameters`]                                            |
//! | `moma`      | [`MomaParameters`]                                              |
//! | `moma-4s`   | [`Moma4sParameters`]                                            |
//! | `moma-w`    | [`MomaWParameters`]: `[[kinematics.mechanism]]` twice           |
//! | `hv-mill`   | [`HvMillParameters`]: one mechanism of the HV-Mill              |
//! | `hv-machine` | [`HvMachineParameters`]: both, `[kinematics.h]`, `[kinematics.v]` |
//! | `ox-glide`  | [`OxGlideParameters`]                                           |
//! | `lambda6`   | [`Lambda6Parameters`]                                           |
//! | `linear-delta` | [`LinearDeltaParameters`]                                    |
//! | `hexapod`   | [`HexapodParameters`]                                           |

use crate::source::Findings;
use pkm_kins::{
    Axis, AxisSet, Cartesian, GeometryError, Hexapod, HexapodParameters, HvMachine, HvMachineParameters,
    HvMill, HvMillParameters, HvSideParameters, Key, Lambda6, Lambda6Parameters, LinearDelta,
    LinearDeltaParameters, Mechanism, Moma, Moma4s, Moma4sParameters, MomaParameters, MomaW, MomaWParameters,
    OxGlide, OxGlideParameters, Planar, PlanarParameters, Spindle,
};
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

/// `[kinematics]` as written.
#[derive(Debug, Clone)]
pub struct KinematicsFile {
    /// One of [`TYPES`].
    pub kind: String,
    /// The parameters of the chosen mechanism.
    pub parameters: Parameters,
    places: Vec<Place>,
}

/// The parameters of a mechanism as written.
#[derive(Debug, Clone)]
#[non_exhaustive]
#[allow(missing_docs, clippy::large_enum_variant)] // one per file
pub enum Parameters {
    Cartesian(CartesianParameters),
    Planar(PlanarParameters),
    Moma(MomaParameters),
    Moma4s(Moma4sParameters),
    MomaW(MomaWParameters),
    HvMill(HvMillParameters),
    HvMachine(HvMachineParameters),
    OxGlide(OxGlideParameters),
    Lambda6(Lambda6Parameters),
    LinearDelta(LinearDeltaParameters),
    Hexapod(HexapodParameters),
}

/// A Cartesian machine as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CartesianParameters {
    /// Axis letters.
    pub axes: Spanned<String>,
}

/// The `type` names.
pub const TYPES: [&str; 11] = [
    "cartesian",
    "planar",
    "moma",
    "moma-4s",
    "moma-w",
    "hv-mill",
    "hv-machine",
    "ox-glide",
    "lambda6",
    "linear-delta",
    "hexapod",
];

/// Where a key's value stands, so that a geometry error can point at it.
#[derive(Debug, Clone)]
struct Place {
    /// The tables it is in, e.g. `mechanism` `1` or `h` `mechanism`.
    path: Vec<String>,
    name: String,
    span: Range<usize>,
    entries: Vec<Range<usize>>,
}

impl KinematicsFile {
    /// Takes `[kinematics]` out of the file's root table; `None` after noting what is wrong.
    pub(crate) fn take(root: &mut DeTable<'_>, findings: &mut Findings<'_>) -> Option<Spanned<Self>> {
        let Some(value) = root.remove("kinematics") else {
            findings.error(
                "machine-missing-key",
                0..0,
                "missing table `[kinematics]`".into(),
                &known_types(),
            );
            return None;
        };
        let span = value.span();
        let DeValue::Table(mut table) = value.into_inner() else {
            findings.error(
                "machine-wrong-type",
                span,
                "`kinematics` is not a table".into(),
                "write [kinematics]",
            );
            return None;
        };
        let Some(kind) = table.remove("type") else {
            findings.error(
                "machine-missing-key",
                span,
                "`kinematics.type` is missing".into(),
                &known_types(),
            );
            return None;
        };
        let mut places = Vec::new();
        collect_places(&table, &[], &mut places);
        let kind_span = kind.span();
        let kind = kind.get_ref().as_str().unwrap_or("").to_owned();
        let parameters = ValueDeserializer::from(Spanned::new(span.clone(), DeValue::Table(table)));
        let parameters = match kind.as_str() {
            "cartesian" => CartesianParameters::deserialize(parameters).map(Parameters::Cartesian),
            "planar" => PlanarParameters::deserialize(parameters).map(Parameters::Planar),
            "moma" => MomaParameters::deserialize(parameters).map(Parameters::Moma),
            "moma-4s" => Moma4sParameters::deserialize(parameters).map(Parameters::Moma4s),
            "moma-w" => MomaWParameters::deserialize(parameters).map(Parameters::MomaW),
            "hv-mill" => HvMillParameters::deserialize(parameters).map(Parameters::HvMill),
            "hv-machine" => HvMachineParameters::deserialize(parameters).map(Parameters::HvMachine),
            "ox-glide" => OxGlideParameters::deserialize(parameters).map(Parameters::OxGlide),
            "lambda6" => Lambda6Parameters::deserialize(parameters).map(Parameters::Lambda6),
            "linear-delta" => LinearDeltaParameters::deserialize(parameters).map(Parameters::LinearDelta),
            "hexapod" => HexapodParameters::deserialize(parameters).map(Parameters::Hexapod),
            _ => {
                let message = format!("kinematics.type = {kind:?} is not a mechanism");
                findings.error("machine-mechanism", kind_span, message, &known_types());
                return None;
            }
        };
        match parameters {
            Ok(parameters) => Some(Spanned::new(span, Self { kind, parameters, places })),
            Err(error) => {
                findings.shape(&error);
                None
            }
        }
    }

    /// The mechanism; `None` after noting why the parameters make none. `span`: of the whole table.
    pub(crate) fn build(&self, span: Range<usize>, findings: &mut Findings<'_>) -> Option<Mechanism> {
        let built: Result<Mechanism, GeometryError> = match &self.parameters {
            Parameters::Cartesian(p) => {
                let Some(axes) = axis_set(p.axes.get_ref()) else {
                    let message = format!("axes = {:?} is not a list of axis letters", p.axes.get_ref());
                    let help = "letters of XYZABCUVW in this order, each once, e.g. \"XYZ\"";
                    findings.error("machine-geometry", p.axes.span(), message, help);
                    return None;
                };
                Cartesian::new(axes).map(Mechanism::from)
            }
            Parameters::Planar(p) => Planar::new(p).map(Mechanism::from),
            Parameters::Moma(p) => Moma::new(p).map(Mechanism::from),
            Parameters::Moma4s(p) => Moma4s::new(p).map(Mechanism::from),
            Parameters::MomaW(p) => MomaW::new(p).map(Mechanism::from),
            Parameters::HvMill(p) => HvMill::new(p).map(Mechanism::from),
            Parameters::HvMachine(p) => HvMachine::new(p).map(Mechanism::from),
            Parameters::OxGlide(p) => OxGlide::new(p).map(Mechanism::from),
            Parameters::Lambda6(p) => Lambda6::new(p).map(Mechanism::from),
            Parameters::LinearDelta(p) => LinearDelta::new(p).map(Mechanism::from),
            Parameters::Hexapod(p) => Hexapod::new(p).map(Mechanism::from),
        };
        built
            .map_err(|error| {
                let help = "the parameters must make a mechanism; `pkm machines NAME` shows a set that does";
                let span = error.key().and_then(|key| self.place(key)).unwrap_or(span);
                findings.error("machine-geometry", span, format!("kinematics: {error}"), help);
            })
            .ok()
    }

    /// Where a parameter stands. Of two mechanisms, in the first that is not valid by itself.
    fn place(&self, key: Key) -> Option<Range<usize>> {
        let faulty: Option<&str> = match &self.parameters {
            Parameters::MomaW(p) => {
                let index = p.mechanism.iter().position(|mechanism| Moma4s::new(mechanism).is_err());
                index.map(|index| ["0", "1"][index])
            }
            Parameters::HvMachine(p) => {
                let alone = |spindle, side: &HvSideParameters| HvMillParameters {
                    spindle,
                    controlled_axes: 4,
                    mechanism: side.mechanism,
                    cr_mm: side.cr_mm,
                    w0_mm: side.w0_mm,
                    table_sense: side.table_sense,
                    head: None,
                };
                let faulty = |spindle, side| HvMill::new(&alone(spindle, side)).is_err();
                faulty(Spindle::H, &p.h).then_some("h").or(faulty(Spindle::V, &p.v).then_some("v"))
            }
            _ => None,
        };
        let inside = |place: &&Place| faulty.is_none_or(|name| place.path.iter().any(|table| table == name));
        let place = self.places.iter().filter(|place| place.name == key.name).find(inside)?;
        let entry = key.index.and_then(|index| place.entries.get(index));
        Some(entry.unwrap_or(&place.span).clone())
    }
}

/// The places of all keys of the table and of the tables in it and in its arrays.
fn collect_places(table: &DeTable<'_>, path: &[String], places: &mut Vec<Place>) {
    for (name, value) in table {
        let name = name.get_ref().clone().into_owned();
        let mut entries = Vec::new();
        let deeper =
            |more: &[&str]| [path, &more.iter().map(|&name| name.to_owned()).collect::<Vec<_>>()].concat();
        match value.get_ref() {
            DeValue::Table(inner) => collect_places(inner, &deeper(&[&name]), places),
            DeValue::Array(array) => {
                for (index, entry) in array.iter().enumerate() {
                    entries.push(entry.span());
                    if let DeValue::Table(inner) = entry.get_ref() {
                        collect_places(inner, &deeper(&[&name, &index.to_string()]), places);
                    }
                }
            }
            _ => {}
        }
        places.push(Place { path: path.to_vec(), name, span: value.span(), entries });
    }
}

fn known_types() -> String {
    format!("known types are {}", TYPES.join(", "))
}

/// The axes of a list of letters in letter order.
fn axis_set(letters: &str) -> Option<AxisSet> {
    let axes: Option<Vec<Axis>> =
        letters.chars().map(|letter| Axis::ALL.into_iter().find(|axis| axis.letter() == letter)).collect();
    let axes = axes?;
    axes.is_sorted_by(|a, b| a < b).then(|| AxisSet::new(&axes))
}
