//! What is urgent, what is well, and how it is worded, whichever view shows it.

use std::time::Duration;

use vocabulary::words::Tone;
use vocabulary::{
    Condition, FaultState, FaultTransition, JournalStatus, ModulePhase, Obstacle, OrderKind, RunId,
    Step, StructureName, Unknown, Verdict,
};

use super::*;
use crate::testing::{
    acknowledged, agreeing, at, identification, journaled, module, mute, phase_change, scene,
    shelved, state, suppressed,
};

const SECOND: u64 = 1_000_000_000;

fn normal() -> FaultTransition {
    state("m1/sensor/g1", FaultState::Normal)
}

fn in_service(components: Vec<FaultTransition>) -> ModuleView {
    module("m1", ModulePhase::InService, components)
}

fn is_well(modules: Vec<ModuleView>) -> bool {
    all_is_well(&scene(modules))
}

fn listed(modules: &[ModuleView]) -> Vec<String> {
    alarms(modules).iter().map(StateRow::name).collect()
}

/// Of a module whose samples have stopped.
fn unmonitored(component: &str) -> FaultTransition {
    let reason = "no sample for 500 ms".to_owned();
    let unknown = Unknown { since_unix_ns: 2 * SECOND, reason };
    state(component, FaultState::Normal).while_unknown(unknown)
}

#[test]
fn faults_doubts_and_silences_are_not_well() {
    let with = |of_component| is_well(vec![in_service(vec![state("m1/sensor/g1", of_component)])]);
    for harmless in [FaultState::Normal, FaultState::Tentative, FaultState::Explained] {
        assert!(with(harmless), "{harmless}");
    }
    let troubles = [
        FaultState::Latched,
        FaultState::Acknowledged,
        FaultState::Unconfirmed,
        FaultState::Unknown,
    ];
    for trouble in troubles {
        assert!(!with(trouble), "{trouble}");
    }
    for phase in [ModulePhase::Stale, ModulePhase::Waiting, ModulePhase::Initialising] {
        assert!(!is_well(vec![module("m1", phase, vec![normal()])]), "{phase:?}");
    }
    assert!(!is_well(vec![in_service(vec![normal()]), mute("m2", Some("m1"))]));
    let silent = ModuleView { is_silent: true, ..in_service(vec![normal()]) };
    assert!(!is_well(vec![silent]));
    assert!(!is_well(vec![in_service(Vec::new())]), "it does not answer");
    assert!(!is_well(Vec::new()));
}

#[test]
fn what_is_shelved_or_suppressed_does_not_count_and_the_rest_does() {
    let gage = |of_component| state("m1/sensor/g1", of_component);
    let other = |of_component| state("m1/sensor/g2", of_component);
    let of = |phase, components| is_well(vec![module("m1", phase, components)]);
    let stale = ModulePhase::Stale;
    for trouble in [FaultState::Latched, FaultState::Unconfirmed, FaultState::Unknown] {
        let beside = |second| vec![shelved(gage(trouble)), other(second)];
        assert!(of(ModulePhase::InService, beside(FaultState::Normal)), "{trouble}");
        assert!(!of(ModulePhase::InService, beside(FaultState::Latched)), "another, {trouble}");
        assert!(!of(stale, beside(FaultState::Normal)), "the module is not suppressed");
    }
    let unknown = || suppressed(gage(FaultState::Unknown));
    for phase in [stale, ModulePhase::Waiting, ModulePhase::Initialising] {
        assert!(of(phase, vec![unknown(), suppressed(other(FaultState::Latched))]));
        assert!(!of(phase, vec![unknown(), other(FaultState::Normal)]), "not all of it");
    }
}

#[test]
fn without_a_status_only_a_structure_whose_modules_are_expected_is_well() {
    let without_status = |expected| {
        let mut one = in_service(vec![normal()]);
        one.status = None;
        one.phase_change = Some(phase_change(ModulePhase::InService, 1));
        ModuleView { expected, ..one }
    };
    assert!(!is_well(vec![without_status(false)]));
    assert!(is_well(vec![without_status(true)]));
    assert!(!is_well(vec![at("mast", without_status(true)), without_status(true)]));
}

#[test]
fn two_processes_of_one_module_are_not_well() {
    let mut seen = in_service(vec![normal()]);
    seen.processes.insert("a1".to_owned());
    assert!(is_well(vec![seen.clone()]));
    seen.processes.insert("b2".to_owned());
    assert!(seen.remarks().contains("stop the others") && !is_well(vec![seen]));
    let mut reported = in_service(vec![normal()]);
    reported.status.as_mut().unwrap().another_process = true;
    assert!(!is_well(vec![reported]));
}

/// A module in service that reports this of its journal.
fn journaling(journal: JournalStatus) -> ModuleView {
    let mut module = in_service(vec![normal()]);
    module.status.as_mut().unwrap().journal = journal;
    module
}

#[test]
fn a_journal_is_ok_only_if_nothing_is_wrong_with_it() {
    let kept = JournalStatus { directory: Some("/var".to_owned()), ..JournalStatus::default() };
    let words = |journal: &JournalStatus| {
        let health = JournalHealth::of(journal);
        (health.to_string(), health.is_ok())
    };
    assert_eq!(words(&kept), ("ok".to_owned(), true));
    assert_eq!(words(&JournalStatus::default()), ("none".to_owned(), true));
    let lost = JournalStatus { lost: 1, ..kept.clone() };
    assert_eq!(words(&lost), ("1 lost".to_owned(), false));
    let damaged = JournalStatus { damaged: 2, ..kept.clone() };
    assert_eq!(words(&damaged), ("2 damaged".to_owned(), false));
    let problem = Some("disk full\u{1b}".to_owned());
    let full = JournalStatus { problem, unsaved: 3, ..kept.clone() };
    assert_eq!(words(&full), (r"disk full\u{1b}, 3 not saved".to_owned(), false));
    // What was lost is history; what cannot be written needs an operator now.
    for past in [kept, lost, damaged] {
        assert!(is_well(vec![journaling(past)]));
    }
    let failing = journaling(full);
    assert_eq!(
        alarms(std::slice::from_ref(&failing))[0].why,
        r"journal: disk full\u{1b}, 3 not saved"
    );
    assert!(!is_well(vec![failing]));
}

#[test]
fn between_clocks_that_differ_no_time_is_measured() {
    let mut module = in_service(vec![normal()]);
    let status = module.status.as_mut().unwrap();
    (status.lag_ms, status.sample_age_ms) = (Some(1.2), Some(3.0));
    assert_eq!(module.lag().zip(module.sample_age()).unwrap(), ("1.2 ms".into(), "3.0 ms".into()));
    let status = module.status.as_mut().unwrap();
    (status.lag_ms, status.sample_age_ms) = (Some(-3_600_000.0), Some(-3_599_000.0));
    assert_eq!((module.lag(), module.sample_age()), (None, None));
    let remark = "its clock is 3600 s behind the publisher's; check time synchronisation";
    assert_eq!(module.remarks(), remark);
}

#[test]
fn an_unreliable_module_stands_between_faults_and_doubts_and_for_its_unknown_components() {
    let mut faulty = in_service(vec![
        state("m1/sensor/g1", FaultState::Unconfirmed),
        FaultTransition { sequence: 1, ..state("m1/sensor/g2", FaultState::Latched) },
        FaultTransition {
            sequence: 2,
            time_unix_ns: 9,
            ..state("m1/sensor/g3", FaultState::Latched)
        },
        state("m1/sensor/g4", FaultState::Normal),
    ]);
    let silent = ModuleView {
        is_silent: true,
        components: vec![unmonitored("m2/sensor/g1"), state("m2/sensor/g2", FaultState::Latched)],
        ..module("m2", ModulePhase::InService, Vec::new())
    };
    let warming_up = module("m3", ModulePhase::Initialising, vec![unmonitored("m3/sensor/g1")]);
    let modules = [faulty.clone(), silent, warming_up];
    let expected = ["m1/sensor/g2", "m1/sensor/g3", "m2/sensor/g2", "m2", "m1/sensor/g1", "m3"];
    assert_eq!(listed(&modules), expected);
    let row = &alarms(&modules)[3];
    assert_eq!((row.state.as_str(), row.kind.as_str()), ("NOT ANSWERING", "1 component unknown"));
    assert_eq!(row.groups[0].components, ["m2/sensor/g1".parse().unwrap()]);
    assert_eq!(rows(&modules).len(), 9, "all of them");
    faulty.components = vec![state("m1/sensor/g1", FaultState::Unknown)];
    assert_eq!(listed(&[faulty]), ["m1/sensor/g1"], "its module is not the reason");
}

#[test]
fn what_is_shelved_comes_after_what_needs_attention_and_is_never_hidden() {
    let quiet = shelved(state("m1/sensor/g1", FaultState::Normal));
    let known = shelved(state("m1/actuator/a1", FaultState::Latched));
    let fault = state("m1/sensor/g2", FaultState::Acknowledged);
    let explained = state("m1/sensor/g3", FaultState::Explained);
    let maintained = module(
        "m2",
        ModulePhase::Stale,
        vec![suppressed(state("m2/sensor/g1", FaultState::Unknown))],
    );
    let modules = [in_service(vec![known, quiet, fault, explained]), maintained];
    let expected =
        ["m1/sensor/g2", "m2", "m1/actuator/a1", "m2/sensor/g1", "m1/sensor/g3", "m1/sensor/g1"];
    assert_eq!(listed(&modules), expected);
    let rows = alarms(&modules);
    let shelved = "shelved until 1970-01-01T02:00:00.000Z by ada: the gage is being rewired";
    assert_eq!((rows[2].state.as_str(), rows[2].why.as_str()), ("latched, shelved", shelved));
    let suppressed = "suppressed until 1970-01-01T02:00:00.000Z by ada: painting";
    assert_eq!((rows[1].state.as_str(), rows[1].why.as_str()), ("STALE", suppressed));
    assert_eq!(rows[5].state, "normal, not verified, shelved");
    assert!(rows[1..4].iter().all(|row| row.urgency == Urgency::SetAside));
}

#[test]
fn a_module_that_does_not_answer_says_how_it_is_known_of() {
    let expected = ModuleView { expected: true, ..mute("m9", None) };
    let present = ModuleView { present: true, ..mute("m8", None) };
    let silent =
        ModuleView { is_silent: true, heard_unix_ns: SECOND, ..in_service(vec![normal()]) };
    let remarks = [mute("m3", Some("m1")), expected, present, silent].map(|module| {
        assert_eq!((module.condition(), module.tone()), ("NOT ANSWERING", Tone::Alarm));
        module.remarks()
    });
    let words = [
        "peer of m1",
        "expected",
        "is present, but does not report its components",
        "nothing heard since 1970-01-01T00:00:01.000Z",
    ];
    assert_eq!(remarks, words);
}

#[test]
fn the_most_urgent_structure_comes_first_and_one_that_does_not_answer_is_not_well() {
    let well = |structure| at(structure, in_service(vec![agreeing(normal())]));
    let scene = scene(vec![
        well("a"),
        at("b", mute("m1", None)),
        at("c", in_service(vec![state("m1/sensor/g1", FaultState::Latched)])),
        well("c"),
        at("d", module("m1", ModulePhase::Waiting, vec![normal()])),
    ]);
    let structures = structures(&scene);
    let shown = structures.iter().map(|one| {
        let name = one.structure.map_or("", StructureName::as_str);
        (name, one.all_is_well, one.counts.latched, one.modules_in_service)
    });
    let expected = [("c", false, 1, 2), ("b", false, 0, 0), ("d", false, 0, 0), ("a", true, 0, 1)];
    assert_eq!(shown.collect::<Vec<_>>(), expected);
    assert_eq!((structures[3].counts.verified, structures[1].module_count), (1, 1));
}

#[test]
fn the_whole_is_in_a_sentence_that_says_what_is_not_known() {
    let verified = || in_service(vec![agreeing(normal())]);
    assert_eq!(scene(vec![verified()]).summary(), "1 of 1 components are normal");
    let some = vec![agreeing(normal()), state("m2/sensor/g1", FaultState::Normal)];
    let words = "2 of 2 components are normal (1 not verified)";
    assert_eq!(scene(vec![in_service(some)]).summary(), words);
    let stale =
        vec![unmonitored("m2/sensor/g1"), shelved(state("m2/sensor/g2", FaultState::Latched))];
    let others = scene(vec![verified(), module("m2", ModulePhase::Stale, stale)]);
    let words = "1 of 2 modules not in service; 1 of 3 components are normal, 1 latched, 1 unknown, \
                 1 shelved or suppressed";
    assert_eq!(others.summary(), words);
    let dead = scene(vec![verified(), mute("m2", Some("m1"))]);
    let words = "1 of 2 modules not in service; 1 of 1 components are normal; those of m2 unknown";
    assert_eq!(dead.summary(), words);
    let nothing = "1 of 1 modules not in service; all components unknown";
    assert_eq!(scene(vec![mute("m1", None)]).summary(), nothing);
    let cut = Scene { network: NetworkState::Closed, ..scene(vec![verified()]) };
    assert!(cut.summary().ends_with("; last known state"));
    assert_eq!(scene(Vec::new()).summary(), "no module answers");
    assert_eq!(Scene::default().summary(), "no network: state unknown");
}

/// A transition with steps of its change.
fn with_steps(transition: FaultTransition) -> FaultTransition {
    FaultTransition {
        sequence: 3,
        run: Some(vocabulary::RunId(1)),
        onset_step: Some(vocabulary::Step(4)),
        detection_step: Some(vocabulary::Step(5)),
        decided_step: Some(vocabulary::Step(7)),
        ..transition
    }
}

#[test]
fn what_is_normal_or_unknown_has_no_steps_of_a_change_that_has_ended() {
    let steps = |transition: FaultTransition| {
        let measured = StateRow::of_component(&with_steps(transition)).measured;
        (measured.onset_step, measured.detection_step, measured.decided_step, measured.run)
    };
    let of = |of_component| steps(state("m1/sensor/g1", of_component));
    for standing in [FaultState::Latched, FaultState::Explained, FaultState::Unconfirmed] {
        let found = (4, 5, 7, 1);
        let (onset, detection, decided, run) = of(standing);
        let numbers = (onset.unwrap().0, detection.unwrap().0, decided.unwrap().0, run.unwrap().0);
        assert_eq!(numbers, found, "{standing}");
    }
    assert_eq!(of(FaultState::Normal), (None, None, None, None));
    assert_eq!(of(FaultState::Unknown), (None, None, None, None));
    assert_eq!(steps(unmonitored("m1/sensor/g1")), (None, None, None, None));
}

#[test]
fn an_order_has_a_time_and_no_step() {
    let step = |transition| EventLine::of_transition(&transition).step;
    assert_eq!(step(journaled("m1", 1, 0)), Some(vocabulary::Step(7)));
    assert_eq!(step(acknowledged("m1", 2)), None);
}

#[test]
fn a_component_whose_alarm_alone_was_suppressed_is_normal_since_an_unknown_time() {
    let since = |since_unix_ns| {
        let normal = FaultTransition { sequence: 1, since_unix_ns, ..suppressed(normal()) };
        StateRow::of_component(&normal).since_unix_ns
    };
    assert_eq!((since(0), since(SECOND)), (None, Some(SECOND)));
}

#[test]
fn what_a_dead_module_reported_is_called_the_last_known() {
    let fault = state("m2/sensor/g2", FaultState::Acknowledged);
    let components = vec![agreeing(state("m2/sensor/g1", FaultState::Normal)), fault];
    let mut dead = ModuleView {
        is_silent: true,
        heard_unix_ns: SECOND,
        ..module("m2", ModulePhase::InService, components)
    };
    dead.doubt();
    let modules = [in_service(vec![agreeing(normal())]), dead];
    let rows = alarms(&modules);
    let fault = rows.iter().find(|row| row.component.is_some()).unwrap();
    assert_eq!(fault.state, "acknowledged, last known");
    let why = "not monitored since 1970-01-01T00:00:01.000Z: its diagnoser is not heard";
    assert_eq!(fault.why, why);
    let words = "1 of 2 modules not in service; 1 of 3 components are normal, 1 acknowledged, \
                 1 unknown, 1 last known";
    assert_eq!(in_a_sentence(&modules), words);
    assert_eq!(title(&modules[1].components[1]), "m2/sensor/g2: acknowledged, last known");
}

#[test]
fn a_module_that_does_not_answer_is_not_said_to_do_so_since_it_entered_service() {
    let mut present = module("m1", ModulePhase::InService, Vec::new());
    present.phase_change = Some(phase_change(ModulePhase::InService, 7));
    assert_eq!(
        (present.condition(), present.row().unwrap().since_unix_ns),
        ("NOT ANSWERING", None)
    );
}

#[test]
fn the_counts_of_normal_components_agree() {
    let counts = |components: &[FaultTransition]| Counts::of(components);
    let normal = || state("m1/sensor/g1", FaultState::Normal);
    let some = counts(&[agreeing(normal()), normal(), state("m1/sensor/g2", FaultState::Latched)]);
    assert_eq!((some.normal, some.normal_of_total().as_str()), (2, "2 of 3 (1 not verified)"));
    assert_eq!(some.words(), "2 of 3 components are normal (1 not verified), 1 latched");
    let none = counts(&[normal()]);
    assert_eq!(none.words(), "1 of 1 components are normal, not verified");
}

fn line(news: News) -> (String, String, String) {
    let line = EventLine::of(&ObservedEvent { number: 1, time_unix_ns: 7, news });
    (line.who, line.what, line.why)
}

#[test]
fn each_kind_of_event_has_its_line() {
    let of = |who: &str, what: &str, why: &str| (who.to_owned(), what.to_owned(), why.to_owned());
    let structure: StructureName = "tower".parse().unwrap();
    let latched =
        FaultTransition { detection_step: Some(vocabulary::Step(5)), ..journaled("m1", 1, 0) };
    let fault = line(News::Fault(Box::new(latched)));
    assert_eq!(fault, of("m1/sensor/g1", "latched", "changed at step 5"));
    let seen =
        FaultTransition { detection_step: Some(vocabulary::Step(5)), ..acknowledged("m1", 2) };
    let fault = line(News::Fault(Box::new(seen)));
    let why = "acknowledged by ada@station: looks loose";
    assert_eq!(fault, of("m1/sensor/g1", "acknowledged", why));
    let given = vocabulary::GivenOrderKind::Unsuppress;
    let mut unsuppressed = acknowledged("m1", 3);
    unsuppressed.order.as_mut().unwrap().kind = given;
    unsuppressed.detection_step = Some(vocabulary::Step(5));
    let why = "no longer suppressed, ordered by ada@station: looks loose";
    let row = StateRow::of_component(&unsuppressed);
    assert_eq!(row.why, "", "an order that has ended something is of the past");
    let fault = line(News::Fault(Box::new(unsuppressed)));
    assert_eq!(fault, of("m1/sensor/g1", "acknowledged", why), "and no change of its own");
    let found = line(News::Identification(Box::new(identification(false, &["bias", "drift"]))));
    assert_eq!(found, of("m1/sensor/g2", "not identified", "bias or drift: not yet decided"));
    let gone = News::Presence {
        structure: structure.clone(),
        who: "m2".to_owned(),
        there: false,
        at_start: false,
    };
    assert_eq!(line(gone), of("m2", "GONE", ""));
    let (tower, who) = (structure.clone(), "m2".to_owned());
    let found = News::Presence { structure: tower, who, there: true, at_start: true };
    assert_eq!(line(found), of("m2", "there", "when this view connected or before"));
    let module = "m1".parse().unwrap();
    let several = line(News::SeveralProcesses { structure: structure.clone(), module });
    let why = "duplicate diagnosers for this module: stop all but one";
    assert_eq!(several, of("m1", "SEVERAL", why));
    let (module, reason) = ("m1".parse().unwrap(), "refused".to_owned());
    let missed = line(News::Missed { structure, module, from: 3, to: 4, reason });
    assert_eq!(missed, of("m1", "MISSED", "transitions 3 to 4 could not be fetched: refused"));
    let lost = line(News::Lost { count: 3 });
    assert_eq!(lost, of("this view", "LOST", "3 events dropped: receive queue full"));
    let hostile =
        line(News::Unreadable { key: "k".to_owned(), problem: "\x1b[2J\u{202e}".to_owned() });
    assert_eq!(hostile, of("this view", "not understood", r"k: \u{1b}[2J\u{202e}"));
}

#[test]
fn the_outcome_of_a_command_says_whether_anything_was_changed() {
    let words = |outcome: OrderOutcome| outcome.words(OrderKind::Reset, "m1/sensor/g1");
    let obeyed = |durable| OrderOutcome::Obeyed { state: FaultState::Normal, sequence: 7, durable };
    assert_eq!(words(obeyed(true)), "m1/sensor/g1: reset: now normal, transition 7");
    let suppressed = obeyed(true).words(OrderKind::Suppress, "m1");
    assert_eq!(suppressed, "m1: suppressed: up to transition 7", "the verdicts are as before");
    assert!(words(obeyed(false)).contains("carried out but not saved: the disk of `m1`"));
    let refused = OrderOutcome::from(Err(QueryError::Refused("busy\u{1b}".to_owned())));
    assert_eq!(words(refused), r"m1/sensor/g1: refused: busy\u{1b}");
    let unanswered = OrderOutcome::from(Err(QueryError::Unanswered(Duration::from_secs(3))));
    let expected =
        "m1/sensor/g1: no answer within 3s; the command may or may not have been carried out";
    assert_eq!(words(unanswered), expected);
    let not_sent = OrderOutcome::not_sent("the network is not connected");
    assert_eq!(words(not_sent), "m1/sensor/g1: the network is not connected; no command was sent");
}

/// Its change is explained by another component's fault.
fn explained(component: &str, by: &str) -> FaultTransition {
    let (by, since) = (by.parse().unwrap(), Step(17));
    FaultTransition {
        verdict: Verdict::Explained { by, since },
        ..state(component, FaultState::Normal)
    }
}

/// It cannot be compared with its reference since then.
fn incomparable(component: &str, obstacle: Obstacle, since_unix_ns: u64) -> FaultTransition {
    let condition = Condition::CannotTell { obstacle };
    let unknown = Unknown { since_unix_ns, reason: condition.reason().unwrap() };
    let state = state(component, FaultState::Normal).while_unknown(unknown);
    FaultTransition { condition: Some(condition), ..state }
}

fn latched_at(component: &str, step: u64, since_unix_ns: u64) -> FaultTransition {
    FaultTransition {
        run: Some(RunId(4)),
        detection_step: Some(Step(step)),
        since_unix_ns,
        ..state(component, FaultState::Latched)
    }
}

/// The rows of alarms: name, incident and what belongs to it.
fn incidents(modules: &[ModuleView]) -> Vec<(String, Option<String>, String)> {
    let row = |row: StateRow| (row.name(), row.incident.clone(), row.what());
    alarms(modules).into_iter().map(row).collect()
}

#[test]
fn a_fault_with_its_effects_and_what_cannot_be_compared_since_then_is_one_incident() {
    let force = || Obstacle::UnseenForce("m2/actuator/a3".parse().unwrap());
    let modules = [
        in_service(vec![
            latched_at("m1/actuator/a1", 17, 5 * SECOND),
            explained("m1/sensor/g1", "m1/actuator/a1"),
            incomparable("m1/sensor/g2", force(), 6 * SECOND),
        ]),
        module(
            "m2",
            ModulePhase::InService,
            vec![
                // Over another effect.
                explained("m2/sensor/g1", "m1/sensor/g1"),
                incomparable("m2/sensor/g2", force(), 6 * SECOND),
                incomparable("m2/sensor/g3", Obstacle::Swinging, 4 * SECOND),
                explained("m2/sensor/g4", "m2/sensor/g9"),
            ],
        ),
    ];
    let words = "2 effects: m1/sensor/g1, m2/sensor/g1; 2 components not comparable: the force of m2/actuator/a3 is beyond what was seen during commissioning";
    let number = Some("tower/m1/actuator/a1@4-17".to_owned());
    let swings = "1 component not comparable: the structure swings more than during commissioning";
    let expected = [
        ("m1/actuator/a1".to_owned(), number.clone(), words.to_owned()),
        ("m2".to_owned(), None, swings.to_owned()),
        ("m2/sensor/g4".to_owned(), None, String::new()),
    ];
    assert_eq!(incidents(&modules), expected);
    // Nothing is lost: every component has its row in the list of all.
    assert_eq!(rows(&modules).iter().filter(|row| row.component.is_some()).count(), 7);
    // An acknowledged fault keeps its number and what belongs to it.
    let mut later = modules;
    later[0].components[0].verdict = Verdict::Acknowledged;
    assert_eq!(incidents(&later)[1], ("m1/actuator/a1".to_owned(), number, words.to_owned()));
}

#[test]
fn without_a_fault_what_cannot_be_compared_for_one_reason_is_one_row_of_its_module() {
    let gages = ["m1/sensor/g1", "m1/sensor/g2", "m1/sensor/g3"];
    let gages = gages.map(|gage| incomparable(gage, Obstacle::NoSetFits, 3 * SECOND));
    let modules = [in_service(gages.to_vec())];
    let [row] = &alarms(&modules)[..] else { panic!("{:?}", alarms(&modules)) };
    assert_eq!(
        (row.name(), row.urgency, row.since_unix_ns),
        ("m1".to_owned(), Urgency::Unknown, Some(3 * SECOND))
    );
    assert_eq!(row.groups[0].components.len(), 3);
    assert!(!is_well(modules.to_vec()));
}

#[test]
fn of_several_candidates_the_likeliest_stands_for_all() {
    let names = ["m1/sensor/g1", "m1/sensor/g2"];
    let components: Vec<_> = names.iter().rev().map(|name| name.parse().unwrap()).collect();
    let one_of = |name: &&str| {
        let condition = Condition::OneOf { as_of: Step(9), components: components.clone() };
        let unknown = Unknown { since_unix_ns: SECOND, reason: condition.reason().unwrap() };
        let state = state(name, FaultState::Normal).while_unknown(unknown);
        FaultTransition { condition: Some(condition), ..state }
    };
    let modules = [in_service(names.iter().map(one_of).collect())];
    let expected =
        [("m1/sensor/g2".to_owned(), None, "or one of 1 other: m1/sensor/g1".to_owned())];
    assert_eq!(incidents(&modules), expected);
}

#[test]
fn a_fault_that_is_gone_is_ready_to_reset() {
    let gone = |from: u64, verdict: FaultState| FaultTransition {
        condition: Some(Condition::Agrees { from: Step(from), as_of: Step(from + 9) }),
        verdict: Verdict::example(verdict),
        ..latched_at("m1/sensor/g1", 17, SECOND)
    };
    let words = |from, verdict| StateRow::of_component(&gone(from, verdict)).state;
    assert_eq!(words(18, FaultState::Acknowledged), "acknowledged, ready to reset");
    assert_eq!(words(18, FaultState::Latched), "latched, ready to reset");
    assert_eq!(words(17, FaultState::Latched), "latched", "it agreed before the fault");
    assert!(!words(18, FaultState::Normal).contains("reset"));
    let order = vocabulary::GivenOrder {
        kind: vocabulary::GivenOrderKind::ShutOff { since_unix_ns: 18 * SECOND },
        by: "ada".to_owned(),
        on_behalf_of: None,
        note: None,
    };
    let shut_off = FaultTransition { shut_off: Some(order), ..gone(18, FaultState::Latched) };
    assert!(
        !StateRow::of_component(&shut_off).state.contains("reset"),
        "it is to be put back first"
    );
}

#[test]
fn what_comes_and_goes_is_one_line_with_a_count_and_faults_have_each_their_own() {
    let event = |number: u64, at: u64, verdict| {
        let transition = FaultTransition {
            sequence: number,
            time_unix_ns: at * SECOND,
            ..state("m1/sensor/g1", verdict)
        };
        ObservedEvent { number, time_unix_ns: at * SECOND, news: News::Fault(Box::new(transition)) }
    };
    let mut events = Vec::new();
    for k in 0..50 {
        events.push(event(2 * k, 1000 + 10 * k, FaultState::Tentative));
        events.push(event(2 * k + 1, 1005 + 10 * k, FaultState::Normal));
    }
    events.push(event(200, 1500, FaultState::Latched));
    events.push(event(201, 1510, FaultState::Latched));
    // Long before.
    events.insert(0, event(0, 10, FaultState::Normal));
    let lines = counted(events.iter().rev());
    let shown: Vec<(&str, u32)> =
        lines.iter().map(|one| (one.line.what.as_str(), one.times)).collect();
    let expected =
        [("latched", 1), ("latched", 1), ("normal", 50), ("tentative", 50), ("normal", 1)];
    assert_eq!(shown, expected);
    assert_eq!(
        (lines[2].first_unix_ns, lines[2].line.time_unix_ns),
        (1005 * SECOND, 1495 * SECOND)
    );
}
