use super::*;
use diagnosis::Verdict;
use vocabulary::Step;

const NOW: u64 = 9_000_000;

fn speaker() -> Speaker {
    Speaker::of("t".parse().unwrap(), "m1".parse().unwrap())
}

fn transition(component: &str, sequence: u64, state: FaultState) -> FaultTransition {
    let mut message = speaker().untouched(&component.parse().unwrap(), 5);
    message.sequence = sequence;
    message.verdict = vocabulary::Verdict::example(state);
    message.run = Some(RunId(1));
    let step = Some(Step(sequence));
    (message.onset_step, message.detection_step, message.decided_step) = (step, step, step);
    message.evidence = Some(vocabulary::Evidence {
        step: Step(1),
        residual: 1.0,
        level: 0.5,
        divergence: Some(2.0),
        threshold: 1.0,
    });
    message
}

fn recorded(component: &str, sequence: u64, state: FaultState) -> JournalRecord {
    JournalRecord::Transition(Box::new(transition(component, sequence, state)))
}

fn change(run: u64, step: u64) -> JournalRecord {
    let component = "sensor/g1".parse().unwrap();
    let change = Change::at(component, Step(step), 2.0);
    JournalRecord::Change { run: RunId(run), change }
}

fn found(component: &str, sequence: u64, as_of: u64) -> Identification {
    let point = vocabulary::SignaturePoint { step: Step(as_of), measured: 1.0, fitted: 2.0 };
    let found = diagnosis::identification::IdentificationResult {
        run: RunId(1),
        sequence,
        component: component.parse().unwrap(),
        as_of: Step(as_of),
        candidates: Vec::new(),
        signature: vec![point],
    };
    speaker().identification(found, 0)
}

fn identified(component: &str, sequence: u64, as_of: u64) -> JournalRecord {
    JournalRecord::Identification(Box::new(found(component, sequence, as_of).without_signature()))
}

fn restored(records: &[JournalRecord]) -> ComponentStore {
    ComponentStore::restore(records.to_vec(), &"m1".parse().unwrap(), NOW)
}

fn memory(store: &ComponentStore, watch: Option<WatchedSteps>) -> Memory {
    store.memory(&"m1".parse().unwrap(), watch)
}

/// With three components of which `sensor/g2` has had its third transition.
fn store() -> ComponentStore {
    let mut store = ComponentStore::default();
    let names = ["actuator/a1", "sensor/a1", "sensor/g2"];
    let components: Vec<Component> = names.iter().map(|name| name.parse().unwrap()).collect();
    store.configure(&"m1".parse().unwrap(), &components, "no sample received yet".to_owned(), NOW);
    let _ = store.transition(transition("sensor/g2", 3, FaultState::Latched), 1);
    store
}

fn states(store: &ComponentStore) -> Vec<FaultState> {
    let states = store.states(&speaker(), |_| true, None, NOW);
    states.iter().map(|published| published.state.state()).collect()
}

#[test]
fn an_agreement_does_not_hold_while_the_module_does_not_monitor() {
    let mut store = store();
    let agrees = Condition::Agrees { from: Step(1), as_of: Step(9) };
    store.conditions([agrees.clone(), Condition::NotVerified, agrees.clone()], NOW);
    let conditions = |store: &ComponentStore| -> Vec<Option<Condition>> {
        let states = store.states(&speaker(), |_| true, None, NOW).into_iter();
        states.map(|published| published.state.condition).collect()
    };
    let not_compared = Some(Condition::NotCompared);
    let not_verified = Some(Condition::NotVerified);
    assert_eq!(
        conditions(&store),
        [not_compared.clone(), not_verified.clone(), not_compared.clone()]
    );
    store.monitored(ModulePhase::InService, String::new(), NOW);
    assert_eq!(conditions(&store), [Some(agrees.clone()), not_verified.clone(), Some(agrees)]);
    store.monitored(ModulePhase::Stale, String::new(), NOW);
    store.monitored(ModulePhase::InService, String::new(), NOW);
    assert_eq!(conditions(&store), [not_compared.clone(), not_verified, not_compared]);
}

#[test]
fn the_latest_of_each_component_the_sequence_and_the_runs_changes_come_back() {
    let records = [
        recorded("sensor/g1", 1, FaultState::Tentative),
        change(1, 7),
        recorded("sensor/g1", 2, FaultState::Latched),
        recorded("actuator/a1", 3, FaultState::Normal),
        recorded("actuator/a1", 1, FaultState::Latched),
        change(2, 9),
        change(2, 9),
    ];
    let store = restored(&records);
    let watch = WatchedSteps { run: RunId(2), watched: Some((Step(1), Step(20))) };
    let memory = memory(&store, Some(watch));
    assert_eq!(memory.sequence, 3);
    let verdicts: Vec<_> = memory.latest.iter().map(|t| t.verdict.clone()).collect();
    assert_eq!(verdicts, [Verdict::Latched, Verdict::Normal]);
    let watch = memory.watch.unwrap();
    assert_eq!(watch.changes.iter().map(|c| c.step.0).collect::<Vec<_>>(), [9]);
    assert_eq!(watch.watched, Some((Step(1), Step(20))));
}

#[test]
fn after_the_end_of_a_run_its_faults_are_left_and_its_changes_are_not() {
    let latched = |sequence| recorded("sensor/g1", sequence, FaultState::Latched);
    let mut records = vec![latched(1), change(1, 7), JournalRecord::RunEnded, change(1, 2)];
    let recalled = |records: &[JournalRecord]| {
        let watch = WatchedSteps { run: RunId(1), watched: None };
        let memory = memory(&restored(records), Some(watch));
        let changes: Vec<u64> = memory.watch.unwrap().changes.iter().map(|c| c.step.0).collect();
        (memory.latest.iter().map(|latest| latest.run_ended).collect::<Vec<_>>(), changes)
    };
    assert_eq!(recalled(&records), (vec![true], vec![2]));
    let snapshot = restored(&records).snapshot();
    // Whatever stands before it in an older file, and on its own.
    assert_eq!(recalled(&[&records[..2], &snapshot].concat()), (vec![true], vec![2]));
    assert_eq!(recalled(&snapshot), (vec![true], vec![2]));
    records.push(latched(2));
    assert_eq!(recalled(&records), (vec![false], vec![2]));
}

#[test]
fn changes_of_one_step_are_returned_once_though_a_snapshot_repeats_them() {
    let change = |component: &str| {
        let component = component.parse().unwrap();
        JournalRecord::Change { run: RunId(2), change: Change::at(component, Step(9), 2.0) }
    };
    let records = ["actuator/a1", "sensor/g1", "actuator/a1", "sensor/g1"].map(change);
    let memory = memory(&restored(&records), Some(WatchedSteps { run: RunId(2), watched: None }));
    let changes = memory.watch.unwrap().changes;
    let names: Vec<_> = changes.iter().map(|change| change.component.to_string()).collect();
    assert_eq!(names, ["actuator/a1", "sensor/g1"]);
}

#[test]
fn another_modules_journal_is_not_recalled_but_kept() {
    let records = [recorded("sensor/g1", 1, FaultState::Latched), identified("sensor/g1", 1, 9)];
    let mut store = ComponentStore::restore(records.to_vec(), &"m2".parse().unwrap(), NOW);
    assert_eq!(memory_of(&store, "m2"), Memory::default());
    store.configure(&"m2".parse().unwrap(), &["sensor/g1".parse().unwrap()], String::new(), NOW);
    assert_eq!(store.published(), (Vec::new(), Vec::new()));
    assert_eq!(store.snapshot(), records);
    assert_eq!(store.incarnation(), 9);
}

fn memory_of(store: &ComponentStore, module: &str) -> Memory {
    store.memory(&module.parse().unwrap(), None)
}

fn recalled(records: &[JournalRecord]) -> Vec<(String, u64)> {
    let mut store = restored(records);
    let components = ["sensor/g1".parse().unwrap(), "sensor/g2".parse().unwrap()];
    store.configure(&"m1".parse().unwrap(), &components, String::new(), NOW);
    let published = store.published().1.into_iter();
    published.map(|found| (found.component.component.to_string(), found.as_of_step.0)).collect()
}

#[test]
fn the_latest_word_on_each_present_fault_comes_back() {
    let latched = |component, sequence| recorded(component, sequence, FaultState::Latched);
    let records = vec![
        latched("sensor/g1", 1),
        identified("sensor/g1", 1, 10),
        latched("sensor/g2", 2),
        identified("sensor/g2", 2, 11),
        identified("sensor/g1", 1, 20),
        recorded("sensor/g1", 3, FaultState::Acknowledged),
        recorded("sensor/g2", 4, FaultState::Normal),
    ];
    assert_eq!(recalled(&records), [("sensor/g1".to_owned(), 20)]);
    // The same from a new file, which begins with the latest of each.
    let shorter = [&records[5..7], &records[4..5], &records[3..4]].concat();
    assert_eq!(recalled(&shorter), [("sensor/g1".to_owned(), 20)]);
    assert_eq!(recalled(&restored(&records).snapshot()), [("sensor/g1".to_owned(), 20)]);
}

#[test]
fn every_component_has_a_state_even_one_that_never_changed() {
    let published = store().states(&speaker(), |_| true, None, NOW);
    let sequences: Vec<u64> = published.iter().map(|published| published.state.sequence).collect();
    assert_eq!(sequences, [0, 0, 3]);
    let wanted = |component: &Component| component.to_string() == "sensor/g2";
    assert_eq!(store().states(&speaker(), wanted, None, NOW).len(), 1);
}

#[test]
fn what_is_not_monitored_is_unknown_since_it_began_and_a_fault_stays_one() {
    let mut store = store();
    assert_eq!(states(&store), [FaultState::Unknown, FaultState::Unknown, FaultState::Latched]);
    store.monitored(ModulePhase::Initialising, "too few samples".to_owned(), NOW + 5);
    let unknown = store.states(&speaker(), |_| true, None, NOW).remove(0).state.unknown.unwrap();
    assert_eq!((unknown.since_unix_ns, unknown.reason.as_str()), (NOW, "too few samples"));
    store.monitored(ModulePhase::InService, String::new(), NOW + 6);
    assert_eq!(states(&store), [FaultState::Normal, FaultState::Normal, FaultState::Latched]);
    let stuck = Some(Unknown { since_unix_ns: 1, reason: "stuck".to_owned() });
    let published = store.states(&speaker(), |_| true, stuck, NOW);
    assert_eq!(published[0].state.state(), FaultState::Unknown);
    let present: Vec<FaultState> = store.present().map(|present| present.state).collect();
    assert_eq!(present, [FaultState::Normal, FaultState::Normal, FaultState::Latched]);
}

#[test]
fn what_a_cylinder_can_do_is_unknown_until_its_change_is_judged() {
    let mut store = store();
    let can_do = |store: &ComponentStore| {
        let cylinder = store.capability(|_, _| None).next().unwrap();
        (cylinder.ability, cylinder.decided)
    };
    assert_eq!(can_do(&store), (Ability::Unknown, false), "not monitored");
    store.monitored(ModulePhase::InService, String::new(), NOW);
    assert_eq!(can_do(&store), (Ability::Full, true));
    for (sequence, state, expected) in [
        (4, FaultState::Tentative, (Ability::Unknown, false)),
        (5, FaultState::Unconfirmed, (Ability::Unknown, false)),
        (6, FaultState::Explained, (Ability::Full, true)),
        (7, FaultState::Latched, (Ability::HardOver, false)),
    ] {
        let _ = store.transition(transition("actuator/a1", sequence, state), sequence);
        assert_eq!(can_do(&store), expected, "{state}");
    }
}

#[test]
fn a_transition_after_an_identification_carries_it_without_the_signature() {
    let mut store = store();
    assert!(store.identification(found("sensor/g2", 3, 50)).is_some());
    assert!(store.identification(found("sensor/g2", 3, 60)).is_none(), "no news");
    let latest: Vec<_> = store.identifications(|_| true).collect();
    assert_eq!((latest.len(), latest[0].as_of_step), (1, Step(60)));
    assert!(latest[0].signature.is_some());
    let next = store.transition(transition("sensor/g2", 4, FaultState::Acknowledged), 2);
    let carried = next.identification.unwrap();
    assert_eq!((carried.as_of_step, carried.signature), (Step(60), None));
    let state = store.states(&speaker(), |_| true, None, NOW).remove(2);
    assert_eq!((state.state.identification.unwrap().as_of_step, state.ticket), (Step(60), 2));
    let _ = store.transition(transition("sensor/g2", 5, FaultState::Normal), 3);
    assert_eq!(store.identifications(|_| true).count(), 0);
    assert!(store.identification(found("sensor/g2", 3, 70)).is_none(), "its fault is over");
}

#[test]
fn a_module_is_suppressed_if_all_its_components_are_and_until_the_first_of_them_is_not() {
    let mut store = store();
    for (place, name) in ["actuator/a1", "sensor/a1", "sensor/g2"].into_iter().enumerate() {
        assert_eq!(store.suppression(), None);
        let sequence = 4 + place as u64;
        let shelving = Shelving {
            since_unix_ns: 1,
            until_unix_ns: 100 - place as u64,
            by: "ada".to_owned(),
            on_behalf_of: None,
            reason: "painting".to_owned(),
        };
        let mut suppressed = transition(name, sequence, FaultState::Normal);
        suppressed.suppressed = Some(shelving);
        let _ = store.transition(suppressed, sequence);
    }
    assert_eq!(store.suppression().unwrap().until_unix_ns, 98);
}

#[test]
fn the_inputs_before_each_transition_are_written_with_it_and_survive_a_new_file() {
    let input = |number| Input {
        structure: "t".parse().unwrap(),
        module: "m1".parse().unwrap(),
        process: 7,
        number,
        samples: 0,
        run: None,
        step: None,
        time_unix_ns: 0,
        taken: vocabulary::Taken::Gap { from: Step(1), missing: 1 },
    };
    let numbers = |store: &ComponentStore, module: &str| {
        let module = module.parse().unwrap();
        store.inputs(&module).map(|input| input.number).collect::<Vec<_>>()
    };
    let mut store = store();
    (1..=100).for_each(|number| store.input(input(number)));
    assert_eq!(numbers(&store, "m1"), [0; 0]);
    let written = store.inputs_of_transition();
    assert_eq!(written.len(), INPUTS_OF_TRANSITION);
    assert_eq!(store.inputs_of_transition(), []);
    let expected: Vec<u64> = (37..=100).collect();
    assert_eq!(numbers(&store, "m1"), expected);
    for records in [written, store.snapshot()] {
        assert_eq!(numbers(&restored(&records), "m1"), expected);
        assert_eq!(numbers(&restored(&records), "m2"), [0; 0]);
    }
    (101..=110).for_each(|number| store.input(input(number)));
    store.inputs_of_transition();
    (111..=170).for_each(|number| store.input(input(number)));
    store.inputs_of_transition();
    assert_eq!(numbers(&store, "m1"), (43..=170).collect::<Vec<_>>());
}

#[test]
fn orders_do_not_change_since_when_a_component_is_in_its_state() {
    let mut store = store();
    let mut take = |sequence, state, detected, time_unix_ns| {
        let given = FaultTransition {
            detection_step: Some(Step(detected)),
            since_unix_ns: time_unix_ns,
            time_unix_ns,
            ..transition("sensor/g2", sequence, state)
        };
        store.transition(given, sequence).since_unix_ns
    };
    assert_eq!(take(4, FaultState::Latched, 9, 100), 100);
    assert_eq!(take(5, FaultState::Latched, 9, 200), 100, "shelved");
    assert_eq!(take(6, FaultState::Acknowledged, 9, 300), 100);
    assert_eq!(take(7, FaultState::Normal, 9, 400), 400, "reset");
    assert_eq!(take(8, FaultState::Normal, 9, 500), 400, "suppressed");
    assert_eq!(take(9, FaultState::Latched, 12, 600), 600);
    assert_eq!(take(10, FaultState::Latched, 14, 700), 700, "another change");
}

#[test]
fn a_component_that_never_changed_is_normal_since_an_unknown_time() {
    let mut store = store();
    let mut take = |sequence, state, time_unix_ns| {
        let given = FaultTransition {
            detection_step: Some(Step(9)),
            since_unix_ns: time_unix_ns,
            time_unix_ns,
            ..transition("actuator/a1", sequence, state)
        };
        store.transition(given, sequence).since_unix_ns
    };
    assert_eq!(take(4, FaultState::Normal, 100), 0, "shelved");
    assert_eq!(take(5, FaultState::Normal, 200), 0, "no longer");
    assert_eq!(take(6, FaultState::Latched, 300), 300);
}

#[test]
fn changes_of_phase_are_numbered_across_restarts_and_survive_a_new_file() {
    let change = || {
        let json = serde_json::json!({
            "structure": "t", "module": "m1", "number": 0, "phase": "in_service", "before": null,
            "not_monitored": { "m1/sensor/g1": "it cannot be compared" }, "run": null,
            "step": null, "reason": "", "time_unix_ns": 5,
        });
        serde_json::from_value::<PhaseChange>(json).unwrap()
    };
    let mut store = store();
    let numbers = [(); 2].map(|()| store.phase_changed(change()).number);
    assert_eq!(numbers, [1, 2]);
    let snapshot = store.snapshot();
    let latest = JournalRecord::Phase(Box::new(PhaseChange { number: 2, ..change() }));
    assert!(snapshot.contains(&latest));
    let mut restarted = restored(&snapshot);
    assert!(restarted.phase().is_none(), "it is the former process's");
    assert_eq!(restarted.phase_changed(change()).number, 3);
}

#[test]
fn a_component_without_a_fault_that_cannot_be_compared_is_not_monitored() {
    let mut store = store();
    let conditions = |condition: Condition| std::iter::repeat_n(condition, 3);
    let lost = |store: &ComponentStore| store.not_monitored().len();
    for condition in [
        Condition::NotVerified,
        Condition::NotCompared,
        Condition::Departed { as_of: Step(9) },
        Condition::Doubtful { as_of: Step(9) },
    ] {
        store.conditions(conditions(condition), NOW);
        assert_eq!(lost(&store), 0);
    }
    let obstacle = vocabulary::Obstacle::Swinging;
    store.conditions(conditions(Condition::CannotTell { obstacle }), NOW);
    assert_eq!(lost(&store), 2);
    let _ = store.transition(transition("sensor/a1", 4, FaultState::Latched), 1);
    assert_eq!(lost(&store), 1, "a fault stays one");
}
