//! Several structures, one line of figures each.

use names::StructureName;
use observer::{ModulePicture, Picture};
use serde::Serialize;
use wire::{FaultState, ModulePhase};

use super::check::{are_well, of_one_structure};

/// How a structure is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RollUp<'a> {
    /// None of modules that are expected and of which nothing was seen.
    pub(super) structure: Option<&'a StructureName>,
    /// What `--exit-code` tells of it.
    pub(super) all_is_well: bool,
    /// Modules that are there or should be.
    pub(super) modules: usize,
    /// Those that reported the state of their components.
    pub(super) modules_answering: usize,
    /// Those of them that are in service.
    pub(super) modules_in_service: usize,
    /// Components, by state.
    pub(super) latched: usize,
    pub(super) acknowledged: usize,
    pub(super) unconfirmed: usize,
    pub(super) unknown: usize,
    pub(super) normal: usize,
    /// Those of the normal ones that agree with their reference.
    pub(super) verified: usize,
    /// Those of any state whose alarm is set aside.
    pub(super) set_aside: usize,
    #[serde(skip)]
    pub(super) members: &'a [ModulePicture],
}

impl<'a> RollUp<'a> {
    /// Of the modules of one structure, which may be the only one.
    fn of(members: &'a [ModulePicture], only: bool) -> Self {
        let count = |state| members.iter().map(|module| module.count(state)).sum();
        let answering = || members.iter().filter(|module| module.answers());
        let in_service =
            |module: &&ModulePicture| module.member.phase() == Some(ModulePhase::InService);
        Self {
            structure: members.first().and_then(|module| module.member.structure.as_ref()),
            all_is_well: are_well(members, only),
            modules: members.len(),
            modules_answering: answering().count(),
            modules_in_service: answering().filter(in_service).count(),
            latched: count(FaultState::Latched),
            acknowledged: count(FaultState::Acknowledged),
            unconfirmed: count(FaultState::Unconfirmed),
            unknown: count(FaultState::Unknown),
            normal: count(FaultState::Normal),
            verified: members.iter().map(ModulePicture::verified).sum(),
            set_aside: members.iter().map(ModulePicture::set_aside).sum(),
            members,
        }
    }

    /// How many modules there are that do not answer, or are not in service, though they are not suppressed.
    fn without_service(&self) -> usize {
        let suppressed = |module: &&ModulePicture| {
            module.suppression().is_some() && module.member.phase() != Some(ModulePhase::InService)
        };
        self.modules - self.modules_in_service - self.members.iter().filter(suppressed).count()
    }

    /// How many components are in this state, and their alarm counts.
    pub(super) fn alarms(&self, state: FaultState) -> usize {
        self.members.iter().map(|module| module.alarms(state)).sum()
    }

    /// The more urgent, the greater.
    fn urgency(&self) -> impl Ord + use<> {
        let alarms = |state| self.alarms(state);
        let doubtful = alarms(FaultState::Unconfirmed) + alarms(FaultState::Unknown);
        let (latched, seen) = (alarms(FaultState::Latched), alarms(FaultState::Acknowledged));
        (!self.all_is_well, latched, self.without_service(), doubtful, seen)
    }
}

/// Each structure, the most urgent first.
pub(super) fn by_urgency(picture: &Picture) -> Vec<RollUp<'_>> {
    let structures: Vec<&[ModulePicture]> = picture.modules.chunk_by(of_one_structure).collect();
    let only = structures.len() == 1;
    let mut structures: Vec<RollUp<'_>> =
        structures.into_iter().map(|members| RollUp::of(members, only)).collect();
    structures.sort_by_key(|structure| std::cmp::Reverse(structure.urgency()));
    structures
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::{agreeing, at, latched, module, picture, silent, state};

    #[test]
    fn what_needs_somebody_comes_first_and_what_does_not_answer_is_not_well() {
        let normal = || vec![agreeing(state("m1/sensor/g1", FaultState::Normal))];
        let well = |structure| at(structure, module("m1", ModulePhase::InService, normal()));
        let picture = picture(vec![
            well("a"),
            at("b", silent("m1", None)),
            at("c", module("m1", ModulePhase::InService, vec![latched("m1/sensor/g1")])),
            well("c"),
            at("d", module("m1", ModulePhase::Stale, normal())),
        ]);
        let structures = by_urgency(&picture);
        let shown: Vec<_> = structures
            .iter()
            .map(|one| {
                (
                    one.structure.unwrap().as_str(),
                    one.all_is_well,
                    one.latched,
                    one.modules_in_service,
                )
            })
            .collect();
        let expected =
            [("c", false, 1, 2), ("b", false, 0, 0), ("d", false, 0, 0), ("a", true, 0, 1)];
        assert_eq!(shown, expected);
        assert_eq!(
            (structures[3].normal, structures[3].verified, structures[1].modules),
            (1, 1, 1)
        );
    }
}
