//! Samples that are never sent again: a healthy module stays healthy whatever is lost, and a fault that
//! begins in a gap is found after it.

use crate::tower;
use diagnosis::{Action, Diagnoser, Doubt, Measurements, Verdict};
use plant::Plant;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use vocabulary::ModulePhase;
use vocabulary::{Component, RunId};

/// Steps until module 1 is in service, and a few more.
const START: u64 = 3000;

/// Module 1 of a tower of which samples get lost.
struct Lossy {
    plant: Plant,
    diagnoser: Diagnoser,
    actions: Vec<Action>,
}

impl Lossy {
    fn new(seed: u64) -> Self {
        let (structure, parameters, setups) = tower::parts();
        let mut setup = setups[0].clone();
        // It decides alone, and gages' thresholds are those of a tower in a storm.
        setup.peers.clear();
        setup.thresholds[4..].fill(0.005);
        Self {
            plant: study::plant(&structure, &parameters, 0.0, seed).unwrap(),
            diagnoser: Diagnoser::new(setup).unwrap(),
            actions: Vec::new(),
        }
    }

    fn lose(&mut self, steps: u64) {
        for _ in 0..steps {
            self.plant.advance();
        }
    }

    fn take(&mut self, steps: u64) {
        for _ in 0..steps {
            let signals = self.plant.advance();
            let module = &signals.modules[0];
            let sample = Measurements {
                run: RunId(1),
                step: signals.step,
                demands_n: module.demands_n.clone(),
                pressures_pa: module.pressures_pa.clone(),
                elongations_m: module.elongations_m.clone(),
            };
            self.diagnoser.take_sample(&sample, &mut self.actions);
        }
    }

    fn in_service(&self) -> bool {
        self.diagnoser.phase() == ModulePhase::InService
    }

    fn changes(&self) -> u64 {
        self.diagnoser.counters().changes
    }

    fn verdict(&self, component: &Component) -> &Verdict {
        self.diagnoser.verdicts().find(|(own, _)| *own == component).unwrap().1
    }
}

#[test]
fn nothing_changes_in_a_healthy_module_after_a_gap_of_any_length() {
    for (case, missing) in [1, 3, 10, 20, 21, 50, 100, 200, 201, 500, 1000, 4000].iter().enumerate()
    {
        let mut lossy = Lossy::new(900 + case as u64);
        lossy.take(START);
        for _ in 0..12 {
            lossy.lose(*missing);
            lossy.take(START);
            assert!(lossy.in_service(), "gaps of {missing}");
        }
        assert_eq!(lossy.changes(), 0, "gaps of {missing}");
    }
}

#[test]
fn nothing_changes_in_a_healthy_module_under_any_pattern_of_gaps() {
    for seed in 0..20 {
        let mut lossy = Lossy::new(950 + seed);
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let mut length = |most: f64| most.powf(random.random::<f64>()).round() as u64;
        lossy.take(START);
        for _ in 0..200 {
            lossy.lose(length(5000.0));
            lossy.take(length(3000.0));
        }
        assert_eq!(lossy.changes(), 0, "pattern {seed}");
    }
}

#[test]
fn a_module_is_in_service_soon_after_a_short_gap_and_relearns_after_a_long_one() {
    for (missing, steps_until_service) in [(20, 12), (21, 62), (200, 62), (201, 2511)] {
        let mut lossy = Lossy::new(970);
        lossy.take(START);
        lossy.lose(missing);
        let mut steps = 0;
        while steps == 0 || !lossy.in_service() {
            lossy.take(1);
            steps += 1;
        }
        assert_eq!(steps, steps_until_service, "after {missing}");
    }
}

#[test]
fn a_fault_that_begins_in_a_short_gap_is_found_after_it() {
    let faults = [
        ("actuator/a2", tower::leakage()),
        ("actuator/a3", tower::hard_over()),
        ("sensor/g2", tower::bias(60e-6 * 3.0)),
    ];
    for missing in [10, 100, 200] {
        for (component, fault) in faults {
            let mut lossy = Lossy::new(980);
            lossy.take(START);
            lossy.lose(missing / 2);
            let path = format!("module1/{component}").parse().unwrap();
            lossy.plant.inject(&path, fault).unwrap();
            lossy.lose(missing / 2);
            lossy.take(1000);
            // What a long gap hides may explain what shows after it.
            let doubt = Doubt::Unknowing(vec!["module1".parse().unwrap()]);
            let wanted = match missing {
                10 => Verdict::Latched,
                _ => Verdict::Unconfirmed { doubt },
            };
            assert_eq!(lossy.verdict(&path.component), &wanted, "{component} after {missing}");
        }
    }
}
