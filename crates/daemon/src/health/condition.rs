//! Well or not, and the words for it.

use std::time::Duration;

use wire::{ModulePhase, PlantPhase, PlantStatus};

use super::metrics::ModuleReport;
use crate::supervision::{Sign, words};

/// Without coming round for so long, a loop hangs: the patience of the shipped units' watchdog.
const PATIENCE: Duration = Duration::from_secs(2);

/// Well or not, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Condition {
    pub(crate) well: bool,
    pub(crate) words: String,
}

impl Condition {
    fn well(words: impl Into<String>) -> Self {
        Self { well: true, words: words.into() }
    }

    fn unwell(words: impl Into<String>) -> Self {
        Self { well: false, words: words.into() }
    }
}

/// Whether a loop with this sign of life is alive.
pub(super) fn live(sign: Sign) -> Condition {
    match sign {
        Sign::NotYet => Condition::unwell(words::OPENING),
        Sign::Over => Condition::unwell(words::STOPPING),
        Sign::Ago(age) if age < PATIENCE => Condition::well("the loop comes round"),
        Sign::Ago(age) => {
            let age_s = age.as_secs_f64();
            Condition::unwell(format!("the loop has not come round for {age_s:.1} s"))
        }
    }
}

/// Whether a diagnoser that reported this last can be relied on to tell faults.
pub(super) fn module_ready(live: Condition, report: Option<&ModuleReport>) -> Condition {
    if !live.well {
        return live;
    }
    let Some(ModuleReport { status, reason, .. }) = report else {
        return Condition::unwell(words::OPENING);
    };
    let words = format!("{}: {reason}", status.phase.as_str());
    Condition { well: status.phase == ModulePhase::InService, words }
}

/// Whether a plant computes steps.
pub(super) fn plant_ready(live: Condition, status: &PlantStatus) -> Condition {
    if !live.well {
        return live;
    }
    Condition { well: status.phase == PlantPhase::Running, words: words::of_plant(status) }
}

#[cfg(test)]
mod tests {
    use super::super::metrics::testing::{module_report, plant_status};
    use super::*;

    fn alive() -> Condition {
        live(Sign::Ago(Duration::from_millis(50)))
    }

    #[test]
    fn a_loop_is_alive_while_it_comes_round() {
        assert!(alive().well);
        assert!(live(Sign::Ago(PATIENCE - Duration::from_millis(1))).well);
        let hung = live(Sign::Ago(Duration::from_millis(2500)));
        assert_eq!(hung, Condition::unwell("the loop has not come round for 2.5 s"));
        assert_eq!(live(Sign::NotYet), Condition::unwell("opening a session"));
        assert_eq!(live(Sign::Over), Condition::unwell("stopping"));
    }

    #[test]
    fn a_module_is_ready_in_service_and_in_no_other_phase() {
        for (phase, well, words) in [
            (ModulePhase::Waiting, false, "waiting: as it is"),
            (ModulePhase::Initialising, false, "initialising: as it is"),
            (ModulePhase::InService, true, "in_service: as it is"),
            (ModulePhase::Stale, false, "stale: as it is"),
        ] {
            let expected = Condition { well, words: words.to_owned() };
            assert_eq!(module_ready(alive(), Some(&module_report(phase))), expected);
        }
        assert_eq!(module_ready(alive(), None), Condition::unwell("opening a session"));
    }

    #[test]
    fn a_plant_is_ready_while_it_computes_steps() {
        for (phase, well) in
            [(PlantPhase::Waiting, false), (PlantPhase::Running, true), (PlantPhase::Done, false)]
        {
            assert_eq!(plant_ready(alive(), &plant_status(phase)).well, well, "{phase:?}");
        }
    }

    #[test]
    fn whoever_hangs_is_not_ready_whatever_it_said_last() {
        let hung = live(Sign::Ago(2 * PATIENCE));
        let report = module_report(ModulePhase::InService);
        assert_eq!(module_ready(hung.clone(), Some(&report)), hung);
        assert_eq!(plant_ready(hung.clone(), &plant_status(PlantPhase::Running)), hung);
    }
}
