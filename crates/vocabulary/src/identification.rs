//! What kind of fault a component has, and how large it is.

use std::fmt;

use crate::fault::FaultKind;
use crate::{ComponentPath, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;

/// What kind of fault a component has and how large it is, as far as that is known. Published when it is first known
/// and whenever it changes materially; returned by queries as long as the component is faulty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Identification {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The component.
    pub component: ComponentPath,
    /// The run that the steps are counted in.
    pub run: RunId,
    /// The sequence number of the transition that declared the fault.
    pub sequence: u64,
    /// The latest step that counted.
    pub as_of_step: Step,
    /// Whether the first candidate is probable enough to be called the kind of the fault.
    pub decided: bool,
    /// What it may be, the most probable first; empty if it could not be identified.
    pub candidates: Vec<Candidate>,
    /// What was measured, and what the first candidate makes of it. Only in answer to a question, and only as long as
    /// what was measured is kept.
    pub signature: Option<Signature>,
    /// When the fault was first identified as this kind, if that was before this estimate of its size \[ns since 1970\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since_unix_ns: Option<u64>,
    /// When this was found \[ns since 1970\].
    pub time_unix_ns: u64,
}

/// A kind that a fault may be of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Candidate {
    /// The kind.
    pub kind: IdentifiedKind,
    /// How probable it is, from 0 to 1.
    pub probability: f64,
    /// Its size if it is of this kind, where the kind has one, in the kind's unit: `m` of a bias and of what
    /// a bad contact adds, `m/s` of a drift, `m per step` of a random walk's increment, `1` of a gain, `m²` of a leak's
    /// coefficient.
    pub size: Option<FaultSize>,
}

/// What a fault is identified as. It was of no other kind than [`FaultKind`] has if it was injected; a real one may be.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum IdentifiedKind {
    /// None of the known kinds explains what was measured.
    NoneOfThese,
    /// One of the known kinds.
    #[serde(untagged)]
    Known(FaultKind),
}

impl IdentifiedKind {
    /// The known kind.
    #[must_use]
    pub fn known(self) -> Option<FaultKind> {
        match self {
            IdentifiedKind::Known(kind) => Some(kind),
            IdentifiedKind::NoneOfThese => None,
        }
    }

    /// The name used in messages, e.g. `random_walk`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        self.known().map_or("none_of_these", FaultKind::as_str)
    }

    /// What it is called in a sentence, e.g. `external leakage of chamber A`.
    #[must_use]
    pub fn words(self) -> &'static str {
        self.known().map_or("none of the known kinds", FaultKind::words)
    }

    /// What its size is measured in; `None` if it has none.
    #[must_use]
    pub fn size_unit(self) -> Option<&'static str> {
        self.known()?.size_unit()
    }
}

impl From<FaultKind> for IdentifiedKind {
    fn from(kind: FaultKind) -> Self {
        Self::Known(kind)
    }
}

impl fmt::Display for IdentifiedKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// How large a fault is, with its 95 % interval, in the unit of its kind ([`FaultKind::size_unit`]) unless it says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultSize {
    /// The centre of the interval.
    pub value: f64,
    /// It is less than this with a probability of 2.5 %.
    pub low: f64,
    /// It is more than this with a probability of 2.5 %.
    pub high: f64,
    /// It is in the unit of the channel's readings, of a drift in that per second: a learned module knows no units.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub own_unit: bool,
}

/// What was measured of a fault, and what the most probable kind makes of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Signature {
    /// Of `measured` and `fitted`: `m` of a gage, how much it reads too much; `m³` of a cylinder, how much more oil a chamber
    /// holds than its valve was commanded to let in. Later versions may know others.
    pub unit: String,
    /// The steps, in their order.
    pub points: Vec<SignaturePoint>,
}

/// A step of a signature.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SignaturePoint {
    /// The step.
    pub step: Step,
    /// What was measured, in the signature's unit.
    pub measured: f64,
    /// What the first candidate says that should have been measured, in the signature's unit.
    pub fitted: f64,
}

/// Most points of a signature: as many as a drawing has columns.
pub const MAX_SIGNATURE_POINTS: usize = 120;

impl Identification {
    /// The kind, if it is decided.
    #[must_use]
    pub fn kind(&self) -> Option<&Candidate> {
        self.candidates.first().filter(|_| self.decided)
    }

    /// The same without what was measured, which is not kept.
    #[must_use]
    pub fn without_signature(mut self) -> Identification {
        self.signature = None;
        self
    }
}

impl Message for Identification {
    const WHAT: &'static str = "identification";
}
