//! The content of a description file, before any check.
//!
//! Entries of lists and tables are read one by one, so that an error in one does not hide errors in others.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use crate::direction::Direction;

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Description {
    /// Name of the structure.
    pub(crate) name: Spanned<String>,
    pub(crate) damping: Spanned<DampingDescription>,
    pub(crate) materials: BTreeMap<String, DescriptionEntry<MaterialDescription>>,
    pub(crate) sections: BTreeMap<String, DescriptionEntry<SectionDescription>>,
    /// The generator, which replaces nodes and members.
    pub(crate) storeys: Option<DescriptionEntry<StoreysDescription>>,
    #[serde(default)]
    pub(crate) nodes: Vec<DescriptionEntry<NodeDescription>>,
    #[serde(default)]
    pub(crate) members: Vec<DescriptionEntry<MemberDescription>>,
    #[serde(default)]
    pub(crate) modules: Vec<Spanned<ModuleDescription>>,
    #[serde(default)]
    pub(crate) surroundings: Vec<Spanned<SurroundingsDescription>>,
}

/// What the rest of a larger structure does to the nodes of this part of it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SurroundingsDescription {
    /// Node and direction of each row of the stiffness.
    pub(crate) freedoms: Vec<(String, Direction)>,
    /// The lower triangle of the stiffness, row by row, so that it is symmetric \[N/m, N, N·m\].
    pub(crate) stiffness: Vec<Vec<f64>>,
}

/// Rayleigh damping.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DampingDescription {
    pub(crate) alpha_per_s: f64,
    pub(crate) beta_s: f64,
}

/// A material.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MaterialDescription {
    pub(crate) young_pa: f64,
    pub(crate) poisson: f64,
    pub(crate) density_kg_per_m3: f64,
}

/// Cross-section, material and kind of members.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SectionDescription {
    pub(crate) kind: SectionKind,
    pub(crate) material: String,
    pub(crate) area_m2: f64,
    pub(crate) second_moment_y_m4: Option<f64>,
    pub(crate) second_moment_z_m4: Option<f64>,
    pub(crate) torsion_constant_m4: Option<f64>,
}

/// Rod or beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum SectionKind {
    Rod,
    Beam,
}

/// Storeys stacked on a polygon, see [`crate::generator`].
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StoreysDescription {
    /// Plan of a storey, corner by corner \[m\].
    pub(crate) corners_m: Vec<[f64; 2]>,
    /// Height of a storey \[m\].
    pub(crate) height_m: f64,
    /// Mass of a storey besides its members, shared evenly by its corners \[kg\].
    pub(crate) mass_kg: f64,
    /// Directions in which the feet are fixed.
    pub(crate) base: Vec<Direction>,
    /// Section of the beams around each floor.
    pub(crate) horizontal: String,
    /// Section of the diagonals across each floor, if any.
    pub(crate) floor_diagonal: Option<String>,
    /// Section of the diagonals on each face, corner to corner over a whole module.
    pub(crate) face_diagonal: String,
}

/// A joint.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NodeDescription {
    pub(crate) name: String,
    pub(crate) position_m: [f64; 3],
    #[serde(default)]
    pub(crate) mass_kg: f64,
    #[serde(default)]
    pub(crate) fixed: Vec<Direction>,
    #[serde(default = "one")]
    pub(crate) mass_factor: f64,
}

/// A rod or beam between two joints.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MemberDescription {
    pub(crate) name: String,
    pub(crate) ends: [String; 2],
    pub(crate) section: String,
    /// The module it belongs to; optional if there is only one.
    pub(crate) module: Option<String>,
    /// A vector whose component perpendicular to the member gives the local y axis.
    pub(crate) local_y: Option<[f64; 3]>,
    #[serde(default = "one")]
    pub(crate) stiffness_factor: f64,
}

fn one() -> f64 {
    1.0
}

/// A module and its equipment.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ModuleDescription {
    pub(crate) name: String,
    /// Nodes on which it stands on earlier modules; by default all nodes shared with them. Explicit form only.
    pub(crate) lower_interface: Option<Vec<String>>,
    /// Number of storeys; with the generator only.
    pub(crate) storeys: Option<usize>,
    /// Section of the columns; with the generator only.
    pub(crate) column: Option<String>,
    #[serde(default)]
    pub(crate) actuators: Vec<DescriptionEntry<ActuatorDescription>>,
    #[serde(default)]
    pub(crate) gages: Vec<DescriptionEntry<GageDescription>>,
}

/// A hydraulic cylinder, in a member or between two nodes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ActuatorDescription {
    pub(crate) name: String,
    pub(crate) between: Option<[String; 2]>,
    pub(crate) member: Option<String>,
}

/// A strain gage on a member.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GageDescription {
    pub(crate) name: String,
    pub(crate) member: String,
}

/// An entry of a list or table: its content or the error in it, and its position.
#[derive(Debug)]
pub(crate) struct DescriptionEntry<T> {
    /// Byte offset in the text.
    pub(crate) offset: usize,
    /// The entry's `name`, which may be readable even if the rest is not.
    pub(crate) name: Option<String>,
    /// The entry, or the parser's error.
    pub(crate) value: Result<T, String>,
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for DescriptionEntry<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let entry = Spanned::<toml::Value>::deserialize(deserializer)?;
        let offset = entry.span().start;
        let content = entry.into_inner();
        let name = content.get("name").and_then(toml::Value::as_str).map(str::to_owned);
        let value = content.try_into().map_err(|error| complaint(&error));
        Ok(DescriptionEntry { offset, name, value })
    }
}

/// The parser's message on one line.
pub(crate) fn complaint(error: &toml::de::Error) -> String {
    error.message().lines().next().unwrap_or("not a valid entry").to_owned()
}
