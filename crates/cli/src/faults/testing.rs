//! Made-up pictures for tests.

use std::collections::BTreeSet;

use names::{RunId, Step};
use observer::{Member, ModulePicture, Picture};
use wire::{
    Agreement, Candidate, Condition, Evidence, FaultState, FaultTransition, Identification,
    ModulePhase, ModuleStatus, Shelving, Unknown,
};

pub(crate) fn picture(modules: Vec<ModulePicture>) -> Picture {
    Picture { modules, problems: Vec::new() }
}

pub(crate) fn module(
    name: &str,
    phase: ModulePhase,
    components: Vec<FaultTransition>,
) -> ModulePicture {
    let ModulePicture { member, .. } = silent(name, None);
    let status = Some(status(name, phase));
    let member = Member { present: true, status, ..member };
    ModulePicture { components, ..ModulePicture::of(member) }
}

/// A module that does not answer.
pub(crate) fn silent(name: &str, peer_of: Option<&str>) -> ModulePicture {
    let member = Member {
        structure: Some("tower".parse().unwrap()),
        module: name.parse().unwrap(),
        present: false,
        status: None,
        phase_change: None,
        expected: false,
        peer_of: peer_of.iter().map(|name| name.parse().unwrap()).collect::<BTreeSet<_>>(),
    };
    ModulePicture::of(member)
}

/// The same in another structure.
pub(super) fn at(structure: &str, mut module: ModulePicture) -> ModulePicture {
    module.member.structure = Some(structure.parse().unwrap());
    module
}

pub(crate) fn state(component: &str, state: FaultState) -> FaultTransition {
    let (structure, component) = ("tower".parse().unwrap(), component.parse().unwrap());
    FaultTransition {
        verdict: wire::Verdict::example(state),
        ..FaultTransition::untouched(structure, component, 1_000_000_000)
    }
}

/// Its alarm is set aside by an operator.
pub(crate) fn shelved(state: FaultTransition) -> FaultTransition {
    FaultTransition { shelved: Some(shelving("the gage is being rewired")), ..state }
}

/// Its alarm is set aside while its module is maintained.
pub(super) fn suppressed(state: FaultTransition) -> FaultTransition {
    FaultTransition { suppressed: Some(shelving("painting")), ..state }
}

fn shelving(reason: &str) -> Shelving {
    Shelving {
        since_unix_ns: 1_000_000_000,
        until_unix_ns: 7_200_000_000_000,
        by: "ada".to_owned(),
        on_behalf_of: None,
        reason: reason.to_owned(),
    }
}

/// It agrees with its reference.
pub(super) fn agreeing(state: FaultTransition) -> FaultTransition {
    let condition =
        Condition { agreement: Agreement::Agrees, as_of_step: Some(Step(4999)), reason: None };
    FaultTransition { condition: Some(condition), ..state }
}

/// Of a module whose samples have stopped.
pub(super) fn unknown_state(component: &str) -> FaultTransition {
    let reason = "no sample for 500 ms".to_owned();
    state(component, FaultState::Normal)
        .while_unknown(Unknown { since_unix_ns: 2_000_000_000, reason })
}

/// A fault that the journal did not take.
pub(crate) fn latched(component: &str) -> FaultTransition {
    let evidence = Evidence {
        step: Step(42),
        residual: 6e-4,
        level: 0.0,
        divergence: Some(4226.0),
        threshold: 10.0,
    };
    FaultTransition {
        sequence: 1,
        onset_step: Some(Step(40)),
        detection_step: Some(Step(42)),
        decided_step: Some(Step(46)),
        evidence: Some(evidence),
        durable: false,
        ..state(component, FaultState::Latched)
    }
}

/// Of the gage `m1/sensor/g2`, as of a tenth of a second after its detection, without sizes.
pub(crate) fn identification(decided: bool, kinds: &[&str]) -> Identification {
    let candidate = |kind: &&str| {
        let probability = if decided { 0.987 } else { 0.5 };
        Candidate { kind: (*kind).to_owned(), probability, size: None }
    };
    Identification {
        structure: "tower".parse().unwrap(),
        module: "m1".parse().unwrap(),
        component: "m1/sensor/g2".parse().unwrap(),
        run: RunId(1),
        sequence: 1,
        as_of_step: Step(142),
        decided,
        candidates: kinds.iter().map(candidate).collect(),
        signature: None,
        time_unix_ns: 1_100_000_000,
    }
}

pub(crate) fn status(name: &str, phase: ModulePhase) -> ModuleStatus {
    ModuleStatus {
        structure: "tower".parse().unwrap(),
        module: name.parse().unwrap(),
        software: String::new(),
        thresholds: String::new(),
        reference: None,
        phase,
        in_service_since_step: None,
        run: None,
        step: Some(Step(4711)),
        lag_ms: Some(1.2),
        sample_age_ms: Some(3.0),
        queued_samples: 0,
        latched: 0,
        unconfirmed: 0,
        unknown: 0,
        verified: 0,
        shelved: 0,
        suppressed: None,
        waiting_questions: 0,
        next_sequence: 1,
        journal: wire::JournalStatus::default(),
        peers: Vec::new(),
        another_process: false,
        intake: wire::IntakeCounters::default(),
        inquiries: wire::InquiryCounters::default(),
        diagnosis: wire::Counters::default(),
        publisher: wire::PublisherCounters::default(),
        time_unix_ns: 0,
    }
}
