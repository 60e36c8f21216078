//! `[kinematics]`: `type` chooses the mechanism, the other keys are its parameters as `pkm_kins` names them.
//!
//! | `type`      | parameters                                                      |
//! |-------------|-----------------------------------------------------------------|
//! | `cartesian` | `axes = "XYZ"`: the axes, one joint each, in letter order       |
//! | `planar`    | [`PlanarParameters`]                                            |
//! | `moma`      | [`MomaParameters`]                                              |
//! | `moma-4s`   | [`Moma4sParameters`]                                            |
//! | `moma-w`    | [`MomaWParameters`]: `[[kinematics.mechanism]]` twice           |

use crate::source::Findings;
use pkm_kins::{
    Axis, AxisSet, Cartesian, GeometryError, Key, Mechanism, Moma, Moma4s, Moma4sParameters, MomaParameters,
    MomaW, MomaWParameters, Planar, PlanarParameters,
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
}

/// A Cartesian machine as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CartesianParameters {
    /// Axis letters.
    pub axes: Spanned<String>,
}

/// The `type` names.
pub const TYPES: [&str; 5] = ["cartesian", "planar", "moma", "moma-4s", "moma-w"];

/// Where a key's value stands, so that a geometry error can point at it.
#[derive(Debug, Clone)]
struct Place {
    /// Which `[[kinematics.mechanism]]`, from 0.
    mechanism: Option<usize>,
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
        let places = places(&table, None);
        let kind_span = kind.span();
        let kind = kind.get_ref().as_str().unwrap_or("").to_owned();
        let parameters = ValueDeserializer::from(Spanned::new(span.clone(), DeValue::Table(table)));
        let parameters = match kind.as_str() {
            "cartesian" => CartesianParameters::deserialize(parameters).map(Parameters::Cartesian),
            "planar" => PlanarParameters::deserialize(parameters).map(Parameters::Planar),
            "moma" => MomaParameters::deserialize(parameters).map(Parameters::Moma),
            "moma-4s" => Moma4sParameters::deserialize(parameters).map(Parameters::Moma4s),
            "moma-w" => MomaWParameters::deserialize(parameters).map(Parameters::MomaW),
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
        };
        built
            .map_err(|error| {
                let help = "the parameters must make a mechanism; `pkm machines NAME` shows a set that does";
                let span = error.key().and_then(|key| self.place(key)).unwrap_or(span);
                findings.error("machine-geometry", span, format!("kinematics: {error}"), help);
            })
            .ok()
    }

    /// Where a parameter stands. Of two mechanisms, the first that is not valid by itself.
    fn place(&self, key: Key) -> Option<Range<usize>> {
        let faulty = match &self.parameters {
            Parameters::MomaW(p) => p.mechanism.iter().position(|mechanism| Moma4s::new(mechanism).is_err()),
            _ => None,
        };
        let place = self.places.iter().find(|place| place.name == key.name && place.mechanism == faulty)?;
        let entry = key.index.and_then(|index| place.entries.get(index));
        Some(entry.unwrap_or(&place.span).clone())
    }
}

/// The places of all keys of the table and of the tables in its arrays.
fn places(table: &DeTable<'_>, mechanism: Option<usize>) -> Vec<Place> {
    let mut places = Vec::new();
    for (name, value) in table {
        let mut entries = Vec::new();
        if let DeValue::Array(array) = value.get_ref() {
            for (index, entry) in array.iter().enumerate() {
                entries.push(entry.span());
                if let (DeValue::Table(inner), None) = (entry.get_ref(), mechanism) {
                    places.extend(self::places(inner, Some(index)));
                }
            }
        }
        places.push(Place {
            mechanism,
            name: name.get_ref().clone().into_owned(),
            span: value.span(),
            entries,
        });
    }
    places
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
