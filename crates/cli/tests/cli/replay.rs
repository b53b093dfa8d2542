//! `trusswatch replay` through the real binary.

use std::path::{Path, PathBuf};

use recording::{Recorded, Writer};
use serde_json::Value;
use tempfile::TempDir;
use vocabulary::fault::Fault;
use vocabulary::{FaultTransition, decode, encode};

use crate::binary::{Outcome, run};
use crate::recorded_live::{Live, Published};

pub(crate) const BIAS_M: f64 = 2e-4;

/// What is published while a gage fails, without a reference: only changes are found.
pub(crate) fn published() -> Vec<Published> {
    published_of(Live::new(|setup| setup.reference = None))
}

/// Likewise, with these diagnosers.
pub(crate) fn published_of(mut live: Live) -> Vec<Published> {
    live.run(5000);
    live.tell_states();
    live.inject("module1/sensor/g5", Fault::Bias { offset_m: BIAS_M });
    live.run(3000);
    live.published
}

/// Writes a recording.
pub(crate) fn write(file: &Path, messages: &[Published]) {
    let mut writer = Writer::create(file).unwrap();
    for message in messages {
        let recorded = Recorded {
            topic: message.topic.clone(),
            time_unix_ns: message.time_unix_ns,
            sequence: u32::try_from(message.step).unwrap(),
            payload: message.payload.clone(),
        };
        writer.write(&recorded).unwrap();
    }
    writer.finish().unwrap();
}

/// A recording in two files.
fn recording(change: impl Fn(&mut Vec<Published>)) -> (TempDir, [PathBuf; 2]) {
    let directory = TempDir::new().unwrap();
    let mut messages = published();
    change(&mut messages);
    let files = ["a.mcap", "b.mcap"].map(|name| directory.path().join(name));
    let (first, second) = messages.split_at(messages.len() / 2);
    write(&files[0], first);
    write(&files[1], second);
    (directory, files)
}

fn replay(files: &[PathBuf; 2], more: &[&str]) -> Outcome {
    let files = files.iter().map(|file| file.to_str().unwrap());
    run(&[&["replay"], &files.collect::<Vec<_>>()[..], more].concat())
}

#[test]
fn a_recording_gives_its_verdicts_again() {
    let (_directory, files) = recording(|_| {});
    let shown = replay(&files, &[]);
    shown.succeeds();
    for text in ["sensor/g5", "latched", "times real time", "8.0 s of 2 modules"] {
        assert!(shown.stdout.contains(text), "`{text}` is not in {}", shown.stdout);
    }
    let verified = replay(&files, &["--verify"]);
    verified.succeeds();
    assert!(verified.stdout.contains("of 2 modules: the same"), "{}", verified.stdout);
    assert!(!verified.stdout.contains("not verified"), "{}", verified.stdout);
    let document = replay(&files, &["--json", "--module", "module1"]);
    document.succeeds();
    let document: Value = serde_json::from_str(&document.stdout).unwrap();
    let process = &document["modules"][0]["processes"][0];
    assert_eq!(document["modules"].as_array().unwrap().len(), 1);
    assert_eq!(process["samples"], 8000);
    assert_eq!(process["difference"], Value::Null);
    replay(&files, &["--module", "module9"]).fails(3, &["no module `module9`", "`module1`"]);
}

#[test]
fn a_changed_sample_is_noticed() {
    let (_directory, files) = recording(|messages| {
        let mut samples = messages.iter_mut().filter(|m| m.topic.ends_with("module2/sample"));
        let sample = samples.nth(6000).unwrap();
        let text = String::from_utf8(sample.payload.clone()).unwrap();
        let at = text.find("\"elongations_m\":[").unwrap() + 21;
        assert!(text.as_bytes()[at].is_ascii_digit(), "{text}");
        sample.payload[at] = if text.as_bytes()[at] == b'5' { b'6' } else { b'5' };
    });
    let outcome = replay(&files, &["--verify"]);
    outcome.fails(1, &["module2/", "at step 6", "in the recording", "in the replay"]);
}

#[test]
fn what_cannot_be_verified_is_not() {
    let (_directory, files) = recording(|messages| {
        messages.retain(|message| !message.topic.ends_with("/input"));
    });
    let outcome = replay(&files, &["--verify"]);
    outcome.fails(3, &["nothing can be verified", "are not in the recording"]);
    let nothing = PathBuf::from("/nonexistent.mcap");
    replay(&[nothing.clone(), nothing], &[]).fails(3, &["/nonexistent.mcap"]);
}

#[test]
fn the_exit_code_reports_what_was_not_compared() {
    let (_directory, files) = recording(|messages| {
        messages.retain(|m| !(m.topic.ends_with("module1/sample") && m.step == 100));
    });
    let outcome = replay(&files, &["--verify"]);
    outcome.fails(6, &[": not verified", "module1, started", "sample 100 of run 7"]);
    assert!(outcome.stdout.contains("of 2 modules: the same"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains(" identifications: not verified"), "{}", outcome.stdout);
    replay(&files, &[]).succeeds();
}

#[test]
fn a_verdict_that_the_recording_lacks_was_not_compared() {
    let (_directory, files) = recording(|messages| {
        let is_verdict = |m: &Published| decode::<FaultTransition>(&m.payload).is_ok();
        let first = messages.iter().position(is_verdict).unwrap();
        messages.remove(first);
    });
    replay(&files, &["--verify"]).fails(6, &["verdicts are not in the recording"]);
}

/// The recording itself shows that there were some.
#[test]
fn of_a_process_without_any_messages_of_a_kind_not_everything_was_compared() {
    for (topic, lacks) in [
        ("module1/fault/", "verdicts are not in the recording"),
        ("module1/divergence", "its divergences are not in the recording"),
        ("module1/identification/", "its identifications are not in the recording"),
    ] {
        let (_directory, files) = recording(|messages| {
            let before = messages.len();
            messages.retain(|message| !message.topic.contains(topic));
            assert!(messages.len() < before, "{topic}");
        });
        let outcome = replay(&files, &["--verify"]);
        outcome.fails(6, &["module1, started", lacks]);
        assert!(!outcome.stderr.contains("module2"), "{}", outcome.stderr);
        // None was published.
        replay(&files, &["--verify", "--module", "module2"]).succeeds();
    }
}

/// The journal gives its inputs, and the next process its verdicts.
#[test]
fn what_a_process_decided_before_the_recording_began_is_not_in_question() {
    let mut live = Live::new(|setup| setup.reference = None);
    live.run(3000);
    live.inject("module1/sensor/g5", Fault::Bias { offset_m: 2e-4 });
    live.run(3000);
    let begins = live.published.len();
    live.restart(0);
    live.run(3000);
    let directory = TempDir::new().unwrap();
    let file = directory.path().join("a.mcap");
    let is_fetched = |message: &Published| {
        ["/input", "/fault/", "/identification/"].iter().any(|topic| message.topic.contains(topic))
    };
    let (before, recorded) = live.published.split_at(begins);
    let fetched = before.iter().filter(|message| is_fetched(message)).cloned();
    let messages: Vec<Published> = fetched.chain(recorded.iter().cloned()).collect();
    assert!(messages.iter().any(|message| message.topic.contains("module1/fault/")));
    write(&file, &messages);
    let outcome = run(&["replay", file.to_str().unwrap(), "--verify", "--module", "module1"]);
    outcome.succeeds();
    let wanted =
        "module1: what its processes decided that had ended before the recording began (1)";
    assert!(outcome.stdout.contains(wanted), "{}", outcome.stdout);
    assert!(!outcome.stdout.contains("not verified"), "{}", outcome.stdout);
}

#[test]
fn of_two_configurations_a_changed_one_is_noticed() {
    let (_directory, files) = recording(|messages| {
        let mut changed = messages[0].clone();
        let text = String::from_utf8(changed.payload).unwrap();
        changed.payload = text.replacen("\"step_s\":0.001", "\"step_s\":0.002", 1).into();
        messages.push(changed);
    });
    let outcome = replay(&files, &["--verify"]);
    outcome.fails(3, &["1 messages of `module1` cannot be read", "fingerprint"]);
}

/// As a recorder has it that was started late, or whose first file was deleted.
#[test]
fn a_file_without_the_start_is_compared_from_its_state_on() {
    let (_directory, files) = recording(|messages| {
        let state = messages.iter().position(|m| m.is_state()).unwrap();
        let mut at = 0..;
        messages.retain(|m| at.next().unwrap() >= state || m.topic.ends_with("/configuration"));
    });
    let outcome = replay(&files, &["--verify"]);
    outcome.succeeds();
    let wanted = "replayed from step 4999 of run 7 on, where the recording has its state";
    assert!(outcome.stdout.contains(wanted), "{}", outcome.stdout);
    assert!(!outcome.stdout.contains("not verified"), "{}", outcome.stdout);
    let other = replay(&files, &["--threshold-factor", "1"]);
    other.fails(6, &["is not known of every component", "the recording begins at step 4999"]);
    assert!(!other.stdout.contains("nor would anything"), "{}", other.stdout);
    let (_directory, changed) = recording(|messages| {
        let state = messages.iter().position(|m| m.is_state()).unwrap();
        let mut at = 0..;
        messages.retain(|m| at.next().unwrap() >= state || m.topic.ends_with("/configuration"));
        for state in messages.iter_mut().filter(|m| m.is_state()) {
            let length = state.payload.len();
            state.payload[length / 2] = b'A' + state.payload[length / 2] % 2;
        }
    });
    replay(&changed, &["--verify"]).fails(3, &["its state cannot be used: it was changed"]);
}

/// As a diagnoser does that was started again, and as it answers a recorder that was.
#[test]
fn verdicts_that_are_recorded_again_are_compared_once() {
    let (_directory, files) = recording(|messages| {
        for mut fault in messages.clone().into_iter().filter(|m| m.topic.contains("/fault/")) {
            let mut message: FaultTransition = decode(&fault.payload).unwrap();
            message.run_ended = true;
            message.durable = !message.durable;
            fault.payload = encode(&message).unwrap();
            messages.push(fault);
        }
    });
    let outcome = replay(&files, &["--verify"]);
    outcome.succeeds();
    assert!(!outcome.stdout.contains("not verified"), "{}", outcome.stdout);
}

#[test]
fn other_settings_stand_beside_what_was() {
    let (_directory, files) = recording(|_| {});
    let outcome = replay(&files, &["--threshold-factor", "1e6", "--json"]);
    outcome.succeeds();
    let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let rows = document["components"].as_array().unwrap();
    let named = |time: &str| rows.iter().filter(|row| row[time]["state"] == "latched").count();
    assert_eq!((named("was"), named("would_be")), (1, 0), "{}", outcome.stdout);
    let same = replay(&files, &["--rule", "first_change"]);
    same.succeeds();
    let row = same.stdout.lines().find(|line| line.contains("module1/sensor/g5")).unwrap();
    assert_eq!(row.matches("latched").count(), 2, "{row}");
    let (_directory, late) = recording(|messages| {
        messages.retain(|m| !(m.topic.ends_with("/sample") && m.step < 5500));
    });
    let part = replay(&late, &["--threshold-factor", "1"]);
    part.fails(6, &["what would have been named is not known of every component"]);
    let row = part.stdout.lines().find(|line| line.contains("module1/sensor/g5")).unwrap();
    let states = ["latched", "unknown", "only a part is recorded"];
    assert!(states.iter().all(|state| row.contains(state)), "{}", part.stdout);
    replay(&files, &["--threshold-factor", "-1"]).fails(2, &["`--threshold-factor` is -1"]);
}

#[test]
fn what_cannot_be_published_is_named() {
    let (_directory, files) = recording(|_| {});
    replay(&files, &["--speed", "2"]).fails(2, &["--publish"]);
    replay(&files, &["--publish", "--verify"]).fails(2, &["--verify", "--publish"]);
    replay(&files, &["--publish", "--speed", "fast"]).fails(2, &["invalid speed `fast`"]);
    replay(&files, &["--publish"]).fails(2, &["no endpoint given"]);
    let nobody = ["--publish", "--connect", "tcp/127.0.0.1:1"];
    replay(&files, &[&nobody[..], &["--run", "99"]].concat()).fails(3, &["no run 99", "it has 7"]);
    let other = [&nobody[..], &["--structure", "bridge"]].concat();
    replay(&files, &other).fails(3, &["no structure `bridge`", "`tower`"]);
}
