//! What cylinders can still do.

use crate::{ActuatorName, Identification, Key, ModuleName, StructureName, Topic};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::fault::FaultKind;
use crate::identification::IdentifiedKind;

/// A kind that is less probable than this is not reckoned with.
const PROBABLE: f64 = 0.05;

/// What the cylinders of a module can still do: when that changes, and once a second.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Capability {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// Its cylinders, in the order of its samples.
    pub cylinders: Vec<CylinderCapability>,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
}

impl Message for Capability {
    const WHAT: &'static str = "capability";
}

impl Capability {
    /// The key that it is published on.
    #[must_use]
    pub fn key(&self) -> Key {
        Key::of_module(&self.structure, &self.module, Topic::Capability)
    }
}

/// What a cylinder can still do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct CylinderCapability {
    /// The cylinder.
    pub name: ActuatorName,
    /// What it can do; as long as that is not decided, the least that it may be able to do.
    pub ability: Ability,
    /// Is that decided?
    pub decided: bool,
    /// If its leak grows, the time until it is as wide as its valve, and its force follows no more \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ends_in_s: Option<u64>,
}

/// What a cylinder can do, the most first.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Ability {
    /// It follows its demand.
    Full,
    /// No fault is known, but it changed and is not judged yet, or is not monitored at present.
    Unknown,
    /// It leaks: its force follows a demand that makes up for the error in the long run.
    Leaking,
    /// It follows no demand, or late; its force changes with the structure alone.
    Locked,
    /// It is shut off, and without force.
    ShutOff,
    /// It pushes with the supply pressure, whatever its demand: its measured force is a disturbance.
    HardOver,
}

impl Ability {
    /// Of a cylinder with a fault of this kind. Of a gage's kind, nothing is lost.
    #[must_use]
    pub fn with(kind: IdentifiedKind) -> Self {
        match kind {
            IdentifiedKind::Known(
                FaultKind::InternalLeakage
                | FaultKind::ExternalLeakageA
                | FaultKind::ExternalLeakageB,
            ) => Self::Leaking,
            IdentifiedKind::Known(FaultKind::Stiction) => Self::Locked,
            IdentifiedKind::Known(FaultKind::HardOver) | IdentifiedKind::NoneOfThese => {
                Self::HardOver
            }
            IdentifiedKind::Known(_) => Self::Full,
        }
    }
}

impl CylinderCapability {
    /// Of a cylinder that is declared faulty, from what is known of its fault.
    #[must_use]
    pub fn of_faulty(name: ActuatorName, known: Option<&Identification>) -> Self {
        let candidates = known.map(|known| known.candidates.as_slice()).unwrap_or_default();
        if let Some(candidate) = known.and_then(Identification::kind) {
            let ability = Ability::with(candidate.kind);
            return Self { name, ability, decided: true, ends_in_s: None };
        }
        let probable = candidates.iter().filter(|candidate| candidate.probability >= PROBABLE);
        let least = probable.map(|candidate| Ability::with(candidate.kind)).max();
        let ability = least.unwrap_or(Ability::HardOver);
        Self { name, ability, decided: false, ends_in_s: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Candidate, RunId, Step};

    fn known(decided: bool, candidates: &[(FaultKind, f64)]) -> Identification {
        let candidate = |(kind, probability): &(FaultKind, f64)| Candidate {
            kind: (*kind).into(),
            probability: *probability,
            size: None,
        };
        Identification {
            structure: "tower".parse().unwrap(),
            module: "m".parse().unwrap(),
            component: "m/actuator/a".parse().unwrap(),
            run: RunId(1),
            sequence: 1,
            as_of_step: Step(9),
            decided,
            candidates: candidates.iter().map(candidate).collect(),
            signature: None,
            since_unix_ns: None,
            time_unix_ns: 1,
        }
    }

    #[test]
    fn what_is_not_decided_counts_as_the_worst_of_what_is_probable() {
        let of = |known: Option<&Identification>| {
            let found = CylinderCapability::of_faulty("a".parse().unwrap(), known);
            (found.ability, found.decided)
        };
        assert_eq!(of(None), (Ability::HardOver, false));
        let (leak, stuck) = (FaultKind::InternalLeakage, FaultKind::Stiction);
        let split = known(false, &[(leak, 0.6), (stuck, 0.38), (FaultKind::HardOver, 0.02)]);
        assert_eq!(of(Some(&split)), (Ability::Locked, false));
        let leaks = known(true, &[(leak, 0.93), (stuck, 0.07)]);
        assert_eq!(of(Some(&leaks)), (Ability::Leaking, true));
        let hard_over = known(true, &[(FaultKind::HardOver, 1.0)]);
        assert_eq!(of(Some(&hard_over)), (Ability::HardOver, true));
    }
}
