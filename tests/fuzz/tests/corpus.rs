//! The kept corpus, replayed through every target.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test code")]

use std::collections::BTreeSet;
use std::panic::catch_unwind;

use fuzz_targets::{TARGETS, inputs, recorded_targets};

#[test]
fn every_target_has_a_corpus_and_every_corpus_a_target() {
    let targets: BTreeSet<String> = TARGETS.iter().map(|target| target.name.to_owned()).collect();
    assert_eq!(targets.len(), TARGETS.len(), "two targets of the same name");
    assert_eq!(recorded_targets(), targets);
    for target in &targets {
        assert!(!inputs(target).is_empty(), "the corpus of {target} is empty");
    }
}

#[test]
fn what_the_targets_promise_holds_of_every_kept_input() {
    let mut broken = Vec::new();
    for target in TARGETS {
        for (path, bytes) in inputs(target.name) {
            if catch_unwind(|| (target.check)(&bytes)).is_err() {
                broken.push(path);
            }
        }
    }
    assert!(broken.is_empty(), "see above for why: {broken:#?}");
}
