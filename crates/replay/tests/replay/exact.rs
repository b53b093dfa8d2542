//! What was recorded comes out again, and what differs or is missing is said.

use diagnosis::GivenOrderKind;
use replay::{Collection, ModuleRecord, Replayed, Shortfall};
use vocabulary::RunId;
use vocabulary::fault::{Fault, FaultKind};

use crate::live::Live;
use crate::{collect, replay_all, with_fault};

fn recorded(live: &Live, topic: &str) -> u64 {
    live.published.iter().filter(|message| message.topic.contains(topic)).count() as u64
}

fn sum(replayed: &[Replayed], of: impl Fn(&Replayed) -> u64) -> u64 {
    replayed.iter().map(of).sum()
}

/// Everything recorded was compared, and is the same.
fn is_same(live: &Live) -> Vec<Replayed> {
    let replayed = replay_all(&collect(live));
    let replayed: Vec<Replayed> = replayed.into_iter().map(|one| one.unwrap()).collect();
    for one in &replayed {
        assert_eq!(one.shortfall, None);
        assert!(
            one.comparison.difference.is_none(),
            "{}",
            one.comparison.difference.clone().unwrap()
        );
        assert_eq!(one.comparison.verdicts_beyond + one.comparison.verdicts_unrecorded, 0);
    }
    assert_eq!(sum(&replayed, |r| r.comparison.verdicts), recorded(live, "/fault/"));
    assert_eq!(sum(&replayed, |r| r.comparison.divergences), recorded(live, "/divergence"));
    assert_eq!(
        sum(&replayed, |r| r.comparison.identifications),
        recorded(live, "/identification/")
    );
    replayed
}

#[test]
fn a_fault_and_what_the_modules_asked_one_another() {
    let live = with_fault();
    let replayed = is_same(&live);
    assert!(sum(&replayed, |r| r.comparison.verdicts) >= 2);
    let answered = live.published.iter().any(|message| {
        message.topic.ends_with("/input")
            && String::from_utf8_lossy(&message.payload).contains("\"answered\"")
    });
    assert!(answered, "nobody asked anybody");
    assert_eq!(sum(&replayed, |r| r.samples), recorded(&live, "/sample"));
}

#[test]
fn messages_in_any_order_and_twice() {
    let mut live = with_fault();
    let once = live.published.clone();
    let extra = once.iter().filter(|message| !message.topic.contains("/fault/")).cloned();
    let doubled: Vec<_> = extra.chain(once.iter().rev().cloned()).collect();
    live.published = doubled;
    for one in replay_all(&collect(&live)) {
        let one = one.unwrap();
        assert_eq!((one.shortfall, one.comparison.difference), (None, None));
    }
}

#[test]
fn gaps_commands_and_runs_that_begin_again() {
    let mut live = with_fault();
    live.order("module1/sensor/g5", GivenOrderKind::Acknowledge);
    live.run_without(500, |place, step| place == 0 && step % 7 == 3);
    live.run_without(300, |place, _| place == 1);
    live.begin_again(RunId(7));
    live.run(3000);
    live.begin_again(RunId(8));
    live.inject("module2/sensor/g3", Fault::Bias { offset_m: 2e-4 });
    live.run(4000);
    is_same(&live);
}

#[test]
fn a_restart_with_what_was_remembered() {
    let mut live = with_fault();
    live.restart(0);
    live.run(3500);
    live.inject("module2/sensor/g3", Fault::Bias { offset_m: 2e-4 });
    live.run(2000);
    let replayed = is_same(&live);
    assert_eq!(replayed.len(), 3);
}

#[test]
fn a_digit_changed_in_a_sample_is_noticed() {
    let mut live = with_fault();
    let mut samples = live.published.iter_mut().filter(|m| m.topic.ends_with("module1/sample"));
    let sample = samples.nth(6000).unwrap();
    let text = String::from_utf8(sample.payload.clone()).unwrap();
    let at = text.find("elongations_m").unwrap() + 22;
    let digit = if text.as_bytes()[at] == b'7' { b'2' } else { b'7' };
    assert!(text.as_bytes()[at].is_ascii_digit(), "{text}");
    sample.payload[at] = digit;
    let records = collect(&live);
    let replayed: Vec<_> = replay_all(&records).into_iter().map(Result::unwrap).collect();
    let difference = replayed[0].comparison.difference.clone().unwrap();
    assert_eq!(difference.module.as_str(), "module1");
    assert!((6000..6110).contains(&difference.step.0), "{difference}");
    assert!(replayed[1].comparison.difference.is_none());
}

#[test]
fn a_verdict_changed_is_noticed() {
    let mut live = with_fault();
    let fault = live.published.iter_mut().rfind(|m| m.topic.contains("/fault/")).unwrap();
    let text = String::from_utf8(fault.payload.clone()).unwrap();
    let at = text.find("\"onset_step\":").unwrap() + 13;
    fault.payload[at] = if fault.payload[at] == b'4' { b'5' } else { b'4' };
    let replayed = replay_all(&collect(&live));
    let differences = replayed.into_iter().filter_map(|one| one.unwrap().comparison.difference);
    let fields: Vec<String> = differences.map(|difference| difference.field).collect();
    assert_eq!(fields, ["onset_step"]);
}

#[test]
fn another_kind_of_fault_is_noticed() {
    let mut live = with_fault();
    let found = live.published.iter_mut().rfind(|m| m.topic.contains("/identification/")).unwrap();
    let mut message: vocabulary::Identification = vocabulary::decode(&found.payload).unwrap();
    assert_eq!(message.candidates[0].kind, FaultKind::Bias.into());
    message.candidates[0].kind = FaultKind::Drift.into();
    found.payload = vocabulary::encode(&message).unwrap();
    let replayed = replay_all(&collect(&live));
    let differences = replayed.into_iter().filter_map(|one| one.unwrap().comparison.difference);
    let fields: Vec<String> = differences.map(|difference| difference.field).collect();
    assert_eq!(fields, ["identification.candidates.0.kind"]);
}

#[test]
fn a_configuration_that_was_changed_is_not_used() {
    let mut live = with_fault();
    let mut changed = live.published[0].clone();
    let mut message: vocabulary::ModuleConfiguration =
        vocabulary::decode(&changed.payload).unwrap();
    message.setup["thresholds"][0] = 1.0.into();
    changed.payload = vocabulary::encode(&message).unwrap();
    live.published.push(changed);
    is_same(&live);
    let records = collect(&live);
    assert_eq!((records[0].unreadable, records[0].configurations.len()), (1, 1));
    let because = records[0].unreadable_because.clone().unwrap();
    assert!(because.starts_with("configuration: its setup has the fingerprint"), "{because}");
}

/// A successor publishes its latest transitions again, and whether their run has ended.
#[test]
fn a_verdict_that_was_repeated_counts_once() {
    let live = with_fault();
    let mut repeated = with_fault();
    for mut fault in live.published.iter().filter(|m| m.topic.contains("/fault/")).cloned() {
        let mut message: vocabulary::FaultTransition = vocabulary::decode(&fault.payload).unwrap();
        message.run_ended = true;
        message.durable = !message.durable;
        fault.payload = vocabulary::encode(&message).unwrap();
        repeated.published.push(fault);
    }
    let replayed: Vec<_> =
        replay_all(&collect(&repeated)).into_iter().map(Result::unwrap).collect();
    assert!(replayed.iter().all(|one| one.comparison.difference.is_none()));
    assert_eq!(sum(&replayed, |r| r.comparison.verdicts), recorded(&live, "/fault/"));
}

/// As a module replies that cannot tell at present: no transition led there.
#[test]
fn a_state_that_is_unknown_for_now_is_no_verdict() {
    let mut live = with_fault();
    let mut fault = live.published.iter().rfind(|m| m.topic.contains("/fault/")).unwrap().clone();
    let mut message: vocabulary::FaultTransition = vocabulary::decode(&fault.payload).unwrap();
    message.verdict = vocabulary::Verdict::Unknown;
    fault.payload = vocabulary::encode(&message).unwrap();
    live.published.push(fault);
    for one in replay_all(&collect(&live)) {
        let one = one.unwrap();
        assert_eq!((one.shortfall, one.comparison.difference), (None, None));
    }
}

#[test]
fn what_is_missing_is_not_verified() {
    let whole = with_fault();
    let mut live = with_fault();
    live.published.retain(|message| {
        let text = String::from_utf8_lossy(&message.payload);
        !(message.topic.ends_with("module1/input") && text.contains("\"number\":3,"))
    });
    let replayed = replay_all(&collect(&live));
    let one = replayed[0].as_ref().unwrap();
    assert_eq!(one.shortfall, Some(Shortfall::InputsMissing { from: 3, to: 3 }));
    assert!(one.comparison.divergences_unverified > 0);
    assert_eq!(one.comparison.difference, None);

    live.published.clone_from(&whole.published);
    live.published
        .retain(|m| !(m.topic.ends_with("module2/sample") && (1200..1300).contains(&m.step)));
    let replayed = replay_all(&collect(&live));
    let one = replayed[1].as_ref().unwrap();
    let said = one.shortfall.clone().unwrap().to_string();
    assert_eq!(said, "samples 1200–1299 of run 7, which it used, are not in the recording");
    assert_eq!(one.comparison.difference, None);

    live.published.clone_from(&whole.published);
    live.published.retain(|m| {
        let text = String::from_utf8_lossy(&m.payload);
        !(m.topic.ends_with("/input") && text.contains("\"number\":1,"))
    });
    let replayed = replay_all(&collect(&live));
    assert!(replayed.iter().all(|one| matches!(one, Err(Shortfall::StartMissing))));
}

/// What was published from the first state after this step on, and the configurations.
fn from_state(live: &Live, after: u64) -> Vec<ModuleRecord> {
    let first = live.published.iter().position(|m| m.is_state() && m.step >= after).unwrap();
    let mut collection = Collection::default();
    for (at, message) in live.published.iter().enumerate() {
        if at >= first || message.topic.ends_with("/configuration") {
            collection.take(&message.topic, &message.payload);
        }
    }
    collection.finish()
}

#[test]
fn a_recording_that_begins_late_is_replayed_from_its_states() {
    let mut live = Live::new(|_| {});
    for fault in [None, Some("module1/sensor/g5"), None] {
        live.run_without(2500, |place, step| place == 0 && step % 1000 == 700);
        live.tell_states();
        if let Some(component) = fault {
            live.inject(component, Fault::Bias { offset_m: 2e-4 });
            // In the middle of the judgement: peers are being asked.
            live.run(7);
            live.tell_states();
        }
    }
    live.order("module1/sensor/g5", GivenOrderKind::Acknowledge);
    live.run(1500);
    for (after, least_verdicts) in [(0, 2), (5000, 1), (7000, 1)] {
        let replayed = replay_all(&from_state(&live, after));
        assert_eq!(replayed.len(), 2);
        let mut verdicts = 0;
        for replayed in replayed {
            let replayed = replayed.unwrap();
            let comparison = &replayed.comparison;
            assert_eq!((&comparison.difference, &replayed.shortfall), (&None, &None));
            assert_eq!((comparison.verdicts_unverified, comparison.divergences_unverified), (0, 0));
            assert!(comparison.divergences >= 14, "{comparison:?}");
            verdicts += comparison.verdicts;
        }
        assert!(verdicts >= least_verdicts, "{verdicts} after {after}");
    }
}

#[test]
fn after_lost_samples_a_recording_is_replayed_from_the_next_state_on() {
    let mut live = Live::new(|_| {});
    live.run(3000);
    live.tell_states();
    live.run(1000);
    let mut collection = Collection::default();
    for message in &live.published {
        if !(message.topic.ends_with("/sample") && message.step == 1000) {
            collection.take(&message.topic, &message.payload);
        }
    }
    let replayed = replay_all(&collection.finish());
    let ends: Vec<_> = replayed
        .iter()
        .map(|one| one.as_ref().unwrap())
        .map(|one| (one.samples, one.shortfall.is_some(), one.comparison.difference.is_some()))
        .collect();
    assert_eq!(ends, [(1000, true, false), (1000, false, false)].repeat(2));
}
