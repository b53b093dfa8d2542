//! Statuses in which every number is another one.

use std::time::Duration;

use serde_json::Value;
use shell::health::ProcessReport;
use shell::supervision::Sign;
use vocabulary::fault::FaultKind;
use vocabulary::{
    FaultState, IdentifiedKind, JournalStatus, Margins, ModulePhase, ModuleStatus, PeerOutcome,
    PeerStatus, PlantPhase, PlantStatus, PresentFault, RunId, Step,
};

use super::{AsideReport, ComponentReport, IdentificationReport, KindReport, ModuleReport};
use diagnosis::messages::Speaker;

/// Who reports.
pub(crate) fn speaker() -> Speaker {
    Speaker::of("tower".parse().unwrap(), "module1".parse().unwrap())
}

/// What its process uses.
pub(crate) fn process() -> ProcessReport {
    let sign = Sign::Ago(Duration::from_micros(1500));
    ProcessReport { sign, processor_s: Some(2.25), resident_bytes: Some(4096) }
}

/// A report with three components and two peers.
pub(crate) fn module_report(phase: ModulePhase) -> ModuleReport {
    let Speaker { structure, module, .. } = speaker();
    let peer = |name: &str, present| PeerStatus {
        module: name.parse().unwrap(),
        present,
        latest: Some(PeerOutcome::Refused),
        reason: Some("no \"sample\"\nyet".into()),
        answered: 0,
        refused: 0,
        timed_out: 0,
        absent: 0,
        malformed: 0,
        disputed: 0,
    };
    let status = ModuleStatus {
        software: "0.2.0".into(),
        thresholds: "0123456789abcdef".into(),
        phase,
        in_service_since_step: Some(Step(0)),
        run: Some(RunId(0)),
        step: Some(Step(0)),
        lag_ms: Some(0.5),
        sample_age_ms: Some(0.5),
        next_sequence: 0,
        journal: JournalStatus {
            directory: Some("/var/lib".into()),
            problem: Some("full".into()),
            ..JournalStatus::default()
        },
        peers: vec![peer("module2", true), peer("module3", false)],
        certificate_until_unix_s: Some(1),
        margins: vec![
            Margins {
                change: Some(422.5),
                oil_content: Some(-0.5),
                ..Margins::unknown("actuator/a1".parse().unwrap())
            },
            Margins::unknown("sensor/g2".parse().unwrap()),
        ],
        ..ModuleStatus::waiting(structure, module)
    };
    let component = |name: &str, state| ComponentReport {
        component: name.parse().unwrap(),
        state,
        aside: Vec::new(),
    };
    let shelved = ComponentReport {
        aside: vec![AsideReport { how: "shelved", until_unix_ns: 1_800_000_000_500_000_000 }],
        ..component("sensor/g1", FaultState::Acknowledged)
    };
    ModuleReport {
        status: numbered(&status),
        reason: "as it is".into(),
        components: vec![
            component("actuator/a1", FaultState::Latched),
            shelved,
            component("sensor/g2", FaultState::Normal),
        ],
        identifications: identifications(),
    }
}

/// A gage that is identified, but not decided.
fn identifications() -> IdentificationReport {
    let kind = |kind, probability| KindReport {
        component: "sensor/g1".parse().unwrap(),
        kind,
        probability,
    };
    IdentificationReport {
        done: 40,
        took: Duration::from_millis(1500),
        turned_away: 2,
        failed: 1,
        published: 3,
        kinds: vec![
            kind(FaultKind::Bias.into(), 0.75),
            kind(FaultKind::Drift.into(), 0.125),
            kind(IdentifiedKind::NoneOfThese, 0.0625),
        ],
    }
}

/// A plant with one fault.
pub(crate) fn plant_status(phase: PlantPhase) -> PlantStatus {
    numbered(&PlantStatus {
        structure: speaker().structure,
        software: "0.2.0".into(),
        run: RunId(0),
        phase,
        waiting_for: Vec::new(),
        next_step: Step(0),
        speed: Some(0.5),
        late_steps: 0,
        latest_ms: 0.5,
        samples_unsent: 0,
        faults: vec![PresentFault {
            component: "module1/sensor/g2".parse().unwrap(),
            fault: vocabulary::fault::Fault::ZeroOutput {},
        }],
        done_without: Vec::new(),
        messages_refused: 0,
        time_unix_ns: 0,
    })
}

/// Every number replaced by another one, from 1000 on; a fraction stays one.
fn numbered<T: serde::Serialize + serde::de::DeserializeOwned>(status: &T) -> T {
    let mut value = serde_json::to_value(status).unwrap();
    let mut next = 1000;
    number(&mut value, &mut next);
    serde_json::from_value(value).unwrap()
}

fn number(value: &mut Value, next: &mut u64) {
    match value {
        Value::Number(old) => {
            *next += 1;
            #[expect(clippy::cast_precision_loss, reason = "small")]
            let fraction = *next as f64 + 0.5;
            *value = if old.is_f64() { fraction.into() } else { (*next).into() };
        }
        Value::Array(values) => values.iter_mut().for_each(|value| number(value, next)),
        Value::Object(fields) => fields.values_mut().for_each(|value| number(value, next)),
        _ => {}
    }
}

/// Every number of a message, with the name of its field.
pub(crate) fn numbers(value: &Value) -> Vec<(String, f64)> {
    let fields: Vec<(String, &Value)> = match value {
        Value::Object(fields) => fields.iter().map(|(name, value)| (name.clone(), value)).collect(),
        Value::Array(values) => values.iter().map(|value| (String::new(), value)).collect(),
        _ => Vec::new(),
    };
    let mut found = Vec::new();
    for (name, value) in fields {
        match value.as_f64() {
            Some(number) => found.push((name, number)),
            None => found.extend(numbers(value)),
        }
    }
    found
}
