//! Whether a process can be relied on.

use shell::health::HealthCondition;
use shell::supervision::OPENING;
use vocabulary::{ModulePhase, PlantPhase, PlantStatus};

use crate::metrics::ModuleReport;
use crate::status_line;

/// Whether a diagnoser with this latest report can be relied on to report faults.
pub(crate) fn module_ready(
    live: HealthCondition,
    report: Option<&ModuleReport>,
) -> HealthCondition {
    if !live.well {
        return live;
    }
    let Some(ModuleReport { status, reason, .. }) = report else {
        return HealthCondition::unwell(OPENING);
    };
    let mut words = vec![format!("{}: {reason}", status.phase.as_str())];
    // Verdicts are right all the same; an order reaches only one of the two.
    words.extend(status.another_process.then(|| status_line::ANOTHER_PROCESS.to_owned()));
    // No verdict depends on a clock.
    words.extend(status.clock_difference().map(|difference| difference.to_string()));
    let words = words.join("; ");
    match &status.journal.problem {
        None => HealthCondition { well: status.phase == ModulePhase::InService, words },
        // Faults are published, and a restart forgets them.
        Some(problem) => HealthCondition::unwell(format!("{words}; journal: {problem}")),
    }
}

/// Whether a plant computes steps.
pub(crate) fn plant_ready(live: HealthCondition, status: &PlantStatus) -> HealthCondition {
    if !live.well {
        return live;
    }
    HealthCondition {
        well: status.phase == PlantPhase::Running,
        words: status_line::of_plant(status),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use shell::health::live;
    use shell::supervision::Sign;

    use super::*;
    use crate::metrics::testing::{module_report, plant_status};

    fn alive() -> HealthCondition {
        live(Sign::Ago(Duration::from_millis(50)))
    }

    #[test]
    fn remarks_are_added_to_the_reason() {
        let mut report = module_report(ModulePhase::InService);
        report.status.journal.problem = None;
        (report.status.another_process, report.status.lag_ms) = (true, Some(-3_600_000.0));
        let words = "in_service: as it is; duplicate diagnoser for this module; \
                     its clock is 3600 s behind the publisher's; check time synchronisation";
        assert_eq!(module_ready(alive(), Some(&report)), HealthCondition::well(words));
    }

    #[test]
    fn a_module_is_ready_in_service_and_in_no_other_phase() {
        for (phase, well, words) in [
            (ModulePhase::Waiting, false, "waiting: as it is"),
            (ModulePhase::Initialising, false, "initialising: as it is"),
            (ModulePhase::InService, true, "in_service: as it is"),
            (ModulePhase::Stale, false, "stale: as it is"),
        ] {
            let mut report = module_report(phase);
            report.status.journal.problem = None;
            let expected = HealthCondition { well, words: words.to_owned() };
            assert_eq!(module_ready(alive(), Some(&report)), expected);
        }
        assert_eq!(module_ready(alive(), None), HealthCondition::unwell("opening a session"));
    }

    #[test]
    fn a_module_whose_disk_hangs_is_not_ready() {
        let mut report = module_report(ModulePhase::InService);
        report.status.journal.problem = Some("the disk has hung for 7 s".to_owned());
        let words = "in_service: as it is; journal: the disk has hung for 7 s";
        assert_eq!(module_ready(alive(), Some(&report)), HealthCondition::unwell(words));
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
    fn a_hanging_loop_is_not_ready_whatever_the_last_report() {
        let hung = live(Sign::Ago(Duration::from_secs(4)));
        let report = module_report(ModulePhase::InService);
        assert_eq!(module_ready(hung.clone(), Some(&report)), hung);
        assert_eq!(plant_ready(hung.clone(), &plant_status(PlantPhase::Running)), hung);
    }
}
