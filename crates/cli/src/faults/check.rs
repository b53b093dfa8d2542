//! Whether all is well.

use observer::{ModulePicture, Picture, Urgency};
use wire::{FaultTransition, ModulePhase};

/// Every module is one process that answers and is in service, and no component is faulty or possibly so. What is set
/// aside does not count, nor that a module is not in service while it is suppressed; a silent one does. False without any
/// module, and where a module that is down might not be on the list.
pub(super) fn all_is_well(picture: &Picture) -> bool {
    let structures: Vec<&[ModulePicture]> = picture.modules.chunk_by(of_one_structure).collect();
    let only = structures.len() == 1;
    !structures.is_empty() && structures.iter().all(|modules| are_well(modules, only))
}

/// Whether two modules are of one structure.
pub(super) fn of_one_structure(a: &ModulePicture, b: &ModulePicture) -> bool {
    a.member.structure == b.member.structure
}

/// The same of the modules of one structure, which may be the only one.
pub(super) fn are_well(modules: &[ModulePicture], only: bool) -> bool {
    is_complete(modules, only) && modules.iter().all(is_well)
}

/// A module that is down is named by the statuses of its peers, which do not pass a gateway, or by whoever expects it:
/// a name without a structure stands for a module of the only one.
fn is_complete(modules: &[ModulePicture], only: bool) -> bool {
    let reports = |module: &ModulePicture| module.member.status.is_some();
    let is_expected = |module: &ModulePicture| module.member.expected;
    modules.iter().any(reports) || only && modules.iter().any(is_expected)
}

fn is_well(module: &ModulePicture) -> bool {
    let is_in_service = module.member.phase() == Some(ModulePhase::InService);
    let troubled = |component: &FaultTransition| Urgency::of(component).needs_attention();
    module.answers()
        && !module.has_several_processes()
        && (is_in_service || module.suppression().is_some())
        && !module.components.iter().any(troubled)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::{module, picture, shelved, silent, state, suppressed};
    use wire::{FaultState, PhaseChange};

    #[test]
    fn faults_doubts_and_silences_are_not_well() {
        let with = |state_is| {
            let components = vec![state("m1/sensor/g1", state_is)];
            picture(vec![module("m1", ModulePhase::InService, components)])
        };
        for state_is in [FaultState::Normal, FaultState::Tentative, FaultState::Explained] {
            assert!(all_is_well(&with(state_is)), "{state_is}");
        }
        for state_is in [
            FaultState::Latched,
            FaultState::Acknowledged,
            FaultState::Unconfirmed,
            FaultState::Unknown,
        ] {
            assert!(!all_is_well(&with(state_is)), "{state_is}");
        }
        let normal = || vec![state("m1/sensor/g1", FaultState::Normal)];
        for phase in [ModulePhase::Stale, ModulePhase::Waiting, ModulePhase::Initialising] {
            assert!(!all_is_well(&picture(vec![module("m1", phase, normal())])), "{phase:?}");
        }
        let one_silent =
            vec![module("m1", ModulePhase::InService, normal()), silent("m2", Some("m1"))];
        assert!(!all_is_well(&picture(one_silent)));
        assert!(!all_is_well(&Picture::default()));
    }

    #[test]
    fn what_is_set_aside_does_not_count_and_the_rest_does() {
        let gage = |state_is| state("m1/sensor/g1", state_is);
        let other = |state_is| state("m1/sensor/g2", state_is);
        let of = |phase, components| all_is_well(&picture(vec![module("m1", phase, components)]));
        let (in_service, stale) = (ModulePhase::InService, ModulePhase::Stale);
        for trouble in [FaultState::Latched, FaultState::Unconfirmed, FaultState::Unknown] {
            let beside = |second| vec![shelved(gage(trouble)), other(second)];
            assert!(of(in_service, beside(FaultState::Normal)), "{trouble}");
            assert!(!of(in_service, beside(FaultState::Latched)), "another one, {trouble}");
            assert!(!of(stale, beside(FaultState::Normal)), "the module is not suppressed");
        }
        let both = |first, second| vec![first, second];
        let unknown = || suppressed(gage(FaultState::Unknown));
        for phase in [stale, ModulePhase::Waiting, ModulePhase::Initialising] {
            assert!(of(phase, both(unknown(), suppressed(other(FaultState::Latched)))));
            assert!(!of(phase, both(unknown(), other(FaultState::Normal))), "not all of it");
        }
        let silenced = picture(vec![module("m1", in_service, Vec::new())]);
        assert!(!all_is_well(&silenced), "it does not answer");
    }

    #[test]
    fn without_a_status_only_a_structure_whose_modules_are_expected_is_well() {
        let normal = || vec![state("m1/sensor/g1", FaultState::Normal)];
        let without_status = |expected| {
            let mut one = module("m1", ModulePhase::InService, normal());
            let status = one.member.status.take().unwrap();
            one.member.phase_change = Some(PhaseChange {
                structure: status.structure,
                module: status.module,
                phase: ModulePhase::InService,
                before: None,
                run: None,
                step: None,
                reason: String::new(),
                time_unix_ns: 1,
            });
            one.member.expected = expected;
            one
        };
        assert!(!all_is_well(&picture(vec![without_status(false)])));
        assert!(all_is_well(&picture(vec![without_status(true)])));
        let mut elsewhere = without_status(true);
        elsewhere.member.structure = Some("mast".parse().unwrap());
        assert!(!all_is_well(&picture(vec![without_status(true), elsewhere])));
    }

    #[test]
    fn two_processes_of_one_module_are_not_well() {
        let normal = vec![state("m1/sensor/g1", FaultState::Normal)];
        let one = module("m1", ModulePhase::InService, normal);
        let ids = ["a1", "b2"].map(|id| id.parse().unwrap());
        let mut seen = one.clone();
        seen.processes.extend(&ids[..1]);
        assert!(all_is_well(&picture(vec![seen.clone()])));
        seen.processes.extend(ids);
        assert!(!all_is_well(&picture(vec![seen])));
        let mut reported = one;
        reported.member.status.as_mut().unwrap().another_process = true;
        assert!(!all_is_well(&picture(vec![reported])));
    }
}
