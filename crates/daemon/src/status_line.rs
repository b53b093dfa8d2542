//! The one-line status shown by `systemctl status`: phase, step, faults, lag. It begins with `degraded` whenever the
//! absence of reported faults does not prove the absence of faults.

use vocabulary::{ModulePhase, ModuleStatus, PlantPhase, PlantStatus};

/// Two diagnosers of one module.
pub(crate) const ANOTHER_PROCESS: &str = "duplicate diagnoser for this module";

/// The status of a diagnoser.
pub(crate) fn of_module(status: &ModuleStatus) -> String {
    let mut words = vec![phase(status.phase).to_owned()];
    if let Some(step) = status.step {
        words.push(format!("step {step}"));
    }
    words.push(faults(status));
    if let Some(difference) = status.clock_difference() {
        words.push(difference.to_string());
    } else if let Some(lag_ms) = status.lag_ms.filter(|_| status.phase != ModulePhase::Stale) {
        words.push(format!("lag {lag_ms:.1} ms"));
    }
    let absent: Vec<&str> =
        status.peers.iter().filter(|p| !p.present).map(|p| p.module.as_str()).collect();
    if !absent.is_empty() {
        words.push(format!("peers unreachable: {}", absent.join(" ")));
    }
    if status.another_process {
        words.push(ANOTHER_PROCESS.to_owned());
    }
    if let Some(problem) = &status.journal.problem {
        words.push(format!("journal: {problem}"));
    }
    words.join(", ")
}

fn phase(phase: ModulePhase) -> &'static str {
    match phase {
        ModulePhase::Waiting => "degraded: no sample received yet",
        ModulePhase::Initialising => "degraded: initialising",
        ModulePhase::InService => "in service",
        ModulePhase::Stale => "degraded: samples have stopped coming",
    }
}

fn faults(status: &ModuleStatus) -> String {
    let mut words = match (status.latched, status.unknown) {
        (0, 0) => vec!["no fault".to_owned()],
        (0, _) => Vec::new(),
        (1, _) => vec!["1 fault".to_owned()],
        (several, _) => vec![format!("{several} faults")],
    };
    for (count, what) in [
        (status.unconfirmed, "unconfirmed"),
        (status.unknown, "unknown"),
        (status.shelved, "shelved or suppressed"),
    ] {
        if count > 0 {
            words.push(format!("{count} {what}"));
        }
    }
    words.join(" and ")
}

/// The status of the plant.
pub(crate) fn of_plant(status: &PlantStatus) -> String {
    let phase = match status.phase {
        PlantPhase::Waiting if status.waiting_for.is_empty() => "starting".to_owned(),
        PlantPhase::Waiting => {
            let names: Vec<&str> = status.waiting_for.iter().map(|name| name.as_str()).collect();
            format!("waiting for the diagnosers of {}", names.join(" "))
        }
        PlantPhase::Running => "running".to_owned(),
        PlantPhase::Done => "done".to_owned(),
    };
    let present = match status.faults.len() {
        0 => "no fault injected".to_owned(),
        1 => "1 fault injected".to_owned(),
        several => format!("{several} faults injected"),
    };
    let without = match status.done_without.len() {
        0 => String::new(),
        1 => ", controller does without 1 component".to_owned(),
        several => format!(", controller does without {several} components"),
    };
    let (step, late) = (status.next_step, status.late_steps);
    format!("{phase}, step {step}, {present}{without}, {late} steps late")
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{PeerStatus, PresentFault, RunId, Step};

    fn module(phase: ModulePhase) -> ModuleStatus {
        let waiting = ModuleStatus::waiting("tower".parse().unwrap(), "module1".parse().unwrap());
        ModuleStatus { phase, ..waiting }
    }

    fn peer(name: &str, present: bool) -> PeerStatus {
        PeerStatus { present, ..PeerStatus::unasked(name.parse().unwrap()) }
    }

    #[test]
    fn a_module_in_service_reports_step_faults_and_lag() {
        let mut status = module(ModulePhase::InService);
        (status.step, status.lag_ms, status.latched) = (Some(Step(4711)), Some(0.84), 1);
        status.peers = vec![peer("module2", true)];
        assert_eq!(of_module(&status), "in service, step 4711, 1 fault, lag 0.8 ms");
        (status.latched, status.unconfirmed) = (2, 1);
        assert_eq!(
            of_module(&status),
            "in service, step 4711, 2 faults and 1 unconfirmed, lag 0.8 ms"
        );
    }

    #[test]
    fn alarms_that_are_set_aside_are_counted_beside_the_faults() {
        let mut status = module(ModulePhase::InService);
        (status.latched, status.shelved) = (1, 2);
        assert_eq!(of_module(&status), "in service, 1 fault and 2 shelved or suppressed");
    }

    #[test]
    fn without_samples_it_is_degraded_and_says_so() {
        let mut status = module(ModulePhase::Waiting);
        status.unknown = 12;
        status.peers = vec![peer("module2", false), peer("module3", true), peer("module4", false)];
        assert_eq!(
            of_module(&status),
            "degraded: no sample received yet, 12 unknown, peers unreachable: module2 module4"
        );
        let mut status = module(ModulePhase::Stale);
        (status.step, status.lag_ms) = (Some(Step(9)), Some(0.8));
        (status.latched, status.unknown) = (1, 11);
        status.journal.problem = Some("no space left".to_owned());
        assert_eq!(
            of_module(&status),
            "degraded: samples have stopped coming, step 9, 1 fault and 11 unknown, journal: no space left"
        );
    }

    #[test]
    fn another_process_of_the_same_module_is_reported() {
        let mut status = module(ModulePhase::InService);
        status.another_process = true;
        let line = of_module(&status);
        assert_eq!(line, "in service, no fault, duplicate diagnoser for this module");
    }

    #[test]
    fn clocks_that_are_apart_are_reported_instead_of_a_lag() {
        let line = |phase, lag_ms| {
            let mut status = module(phase);
            status.lag_ms = Some(lag_ms);
            of_module(&status)
        };
        let behind = "in service, no fault, its clock is 3600 s behind the publisher's; check time synchronisation";
        assert_eq!(line(ModulePhase::InService, -3_600_000.0), behind);
        let ahead = "in service, no fault, its clock is 61 s ahead of the publisher's; check time synchronisation";
        assert_eq!(line(ModulePhase::InService, 61_000.0), ahead);
        assert!(line(ModulePhase::Waiting, -1200.0).contains("1.2 s behind"));
        // It may be so far back, or have been when samples stopped.
        for (phase, lag_ms) in [
            (ModulePhase::InService, 59_000.0),
            (ModulePhase::InService, -900.0),
            (ModulePhase::Stale, 61_000.0),
        ] {
            assert!(!line(phase, lag_ms).contains("clock"), "{phase:?}, {lag_ms}");
        }
    }

    #[test]
    fn a_plant_reports_whom_it_waits_for_and_what_was_injected() {
        let mut status = PlantStatus {
            structure: "tower".parse().unwrap(),
            software: String::new(),
            run: RunId(1),
            phase: PlantPhase::Waiting,
            waiting_for: vec!["module1".parse().unwrap(), "module2".parse().unwrap()],
            next_step: Step(0),
            speed: Some(1.0),
            late_steps: 0,
            latest_ms: 0.0,
            samples_unsent: 0,
            faults: Vec::new(),
            done_without: Vec::new(),
            messages_refused: 0,
            time_unix_ns: 0,
        };
        let waiting = "waiting for the diagnosers of module1 module2, step 0, no fault injected, \
                       0 steps late";
        assert_eq!(of_plant(&status), waiting);
        status.phase = PlantPhase::Running;
        (status.next_step, status.late_steps) = (Step(12), 3);
        status.faults = vec![PresentFault {
            component: "module1/sensor/g2".parse().unwrap(),
            fault: vocabulary::fault::Fault::ZeroOutput {},
        }];
        assert_eq!(of_plant(&status), "running, step 12, 1 fault injected, 3 steps late");
        status.done_without = vec!["module1/sensor/g2".parse().unwrap()];
        let without = "running, step 12, 1 fault injected, controller does without 1 component, \
                       3 steps late";
        assert_eq!(of_plant(&status), without);
    }
}
