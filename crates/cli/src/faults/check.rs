//! Whether all is well.

use observer::{ModulePicture, Picture};
use wire::{FaultState, ModulePhase};

/// Every module is one process that answers and is in service, and no component is faulty or possibly so. False
/// without any module.
pub(super) fn all_is_well(picture: &Picture) -> bool {
    !picture.modules.is_empty() && are_well(&picture.modules)
}

/// The same of these modules.
pub(super) fn are_well(modules: &[ModulePicture]) -> bool {
    modules.iter().all(is_well)
}

fn is_well(module: &ModulePicture) -> bool {
    let troubled = |state: FaultState| {
        state.is_fault() || matches!(state, FaultState::Unconfirmed | FaultState::Unknown)
    };
    module.answers()
        && !module.has_several_processes()
        && module.member.phase() == Some(ModulePhase::InService)
        && !module.components.iter().any(|component| troubled(component.state))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::{module, picture, silent, state};

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
        for phase in [
            ModulePhase::Stale,
            ModulePhase::Waiting,
            ModulePhase::Initialising,
            ModulePhase::Other,
        ] {
            assert!(!all_is_well(&picture(vec![module("m1", phase, normal())])), "{phase:?}");
        }
        let one_silent =
            vec![module("m1", ModulePhase::InService, normal()), silent("m2", Some("m1"))];
        assert!(!all_is_well(&picture(one_silent)));
        assert!(!all_is_well(&Picture::default()));
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
