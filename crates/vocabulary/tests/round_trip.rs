//! What is written is read back, bit for bit.
#![expect(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail loudly")]

mod support;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use serde_json::Value;
use support::{plain_topics, plant_topics};
use vocabulary::{
    Ability, ActuatorFault, Alarm, Candidate, Capability, Change, ChangeReport, Channel, Component,
    Condition, Corrected, CorrectedReadings, CylinderCapability, CylinderMeans, DecodeError,
    Divergences, Doubt, Evidence, FaultSize, FaultState, FaultTransition, GageMeans, GivenOrder,
    GivenOrderKind, HistoryPage, Identification, IdentifiedKind, Injected, Injection,
    JournalStatus, Key, Margins, Message, ModuleName, ModulePhase, ModuleStatus, Obeyed, Obstacle,
    Order, PeerOutcome, PeerStatus, PhaseChange, PlantPhase, PlantStatus, PresentFault, Progress,
    ReadingSource, Refused, ReplacedReading, RunId, Sample, Shelving, Signature, SignaturePoint,
    StateAnswer, StateQuestion, Step, Stroke, StrokeBegun, StructureName, Symptom, Topic, Unknown,
    VERSION, Verdict, WindowLength, WindowMeans, decode, encode,
    fault::{Fault, FaultKind},
    keys::PLANT,
};

fn back<M: Message>(message: &M) -> M {
    let bytes = encode(message).unwrap();
    decode(&bytes).unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&bytes)))
}

fn name() -> impl Strategy<Value = String> {
    "[A-Za-z0-9_][A-Za-z0-9_-]{0,63}"
}

fn component() -> impl Strategy<Value = Component> {
    (name(), any::<bool>()).prop_map(|(name, actuator)| {
        let kind = if actuator { "actuator" } else { "sensor" };
        format!("{kind}/{name}").parse().unwrap()
    })
}

fn topic() -> impl Strategy<Value = Topic> {
    prop_oneof![
        proptest::sample::select(plain_topics()),
        component().prop_map(Topic::Fault),
        component().prop_map(Topic::Identification),
    ]
}

fn finite() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite())
}

proptest! {
    #[test]
    fn a_modules_key_is_read_back(structure in name(), module in name(), topic in topic()) {
        prop_assume!(module != PLANT);
        let key = Key::of_module(&structure.parse().unwrap(), &module.parse().unwrap(), topic);
        prop_assert_eq!(key.to_string().parse(), Ok(key));
    }

    #[test]
    fn a_plants_key_is_read_back(structure in name()) {
        for topic in plant_topics() {
            let key = Key::of_plant(&structure.parse().unwrap(), topic);
            prop_assert_eq!(key.to_string().parse(), Ok(key));
        }
    }

    #[test]
    fn any_text_as_a_key_is_read_or_refused_without_harm(text in ".{0,200}") {
        if let Ok(key) = text.parse::<Key>() {
            prop_assert_eq!(key.to_string(), text);
        }
    }

    #[test]
    fn a_sample_comes_back_with_the_very_same_bits(
        run in any::<u64>(),
        step in any::<u64>(),
        values in prop::collection::vec(finite(), 0..20),
    ) {
        let sample = Sample {
            module: "module1".parse().unwrap(),
            run: RunId(run),
            step: Step(step),
            time_unix_ns: run,
            demands_n: values.clone(),
            pressures_pa: values.iter().map(|&x| [x, -x]).collect(),
            elongations_m: values,
            readings: Vec::new(),
            block: Vec::new(),
        };
        let again = back(&sample);
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&again.elongations_m), bits(&sample.elongations_m));
        prop_assert_eq!(again, sample);
    }

    #[test]
    fn a_spoilt_message_is_decoded_or_refused_for_the_right_reason(bytes in spoilt()) {
        let decoded = decode::<Sample>(&bytes);
        let text = std::str::from_utf8(&bytes);
        // `None` also for valid JSON with a number beyond the range of f64, which `Value` refuses.
        let json = text.ok().and_then(|text| serde_json::from_str::<Value>(text).ok());
        let version = json.as_ref().map(|json| &json["v"]);
        match &decoded {
            Ok(sample) => {
                prop_assert!(version.is_none_or(|v| v == VERSION));
                prop_assert_eq!(&back(sample), sample);
            }
            Err(DecodeError::NotText) => prop_assert!(text.is_err()),
            Err(DecodeError::Malformed(_)) => prop_assert_eq!(&json, &None),
            Err(DecodeError::NoVersion) => prop_assert!(version.is_none_or(Value::is_null)),
            Err(DecodeError::UnknownVersion(_)) => {
                prop_assert!(version.is_none_or(|v| !v.is_null() && v != VERSION));
            }
            Err(DecodeError::WrongMessage { .. }) => prop_assert!(text.is_ok()),
            Err(error @ DecodeError::TooLong { .. }) => prop_assert!(false, "{error}"),
        }
        prop_assert_eq!(text.is_err(), matches!(decoded, Err(DecodeError::NotText)));
    }
}

/// What is done to the bytes of a message.
#[derive(Debug, Clone)]
enum Spoiling {
    /// One byte becomes this one.
    Byte(prop::sample::Index, u8),
    /// The rest is gone.
    Cut(prop::sample::Index),
    /// What is between these comes twice.
    Repeat(prop::sample::Index, prop::sample::Index),
    /// This text comes in between.
    Insert(prop::sample::Index, &'static str),
    /// The value of a field becomes this text.
    Value(prop::sample::Index, &'static str),
}

const TEXTS: [&str; 7] = ["null", "1e999", "\"v\":2,", "[]", "-1", "2", "{}"];

impl Spoiling {
    fn spoil(&self, bytes: &mut Vec<u8>) {
        let ends = bytes.len() + 1;
        match self {
            Spoiling::Byte(at, byte) if !bytes.is_empty() => {
                let at = at.index(bytes.len());
                bytes[at] = *byte;
            }
            Spoiling::Byte(..) => {}
            Spoiling::Cut(at) => bytes.truncate(at.index(ends)),
            Spoiling::Repeat(one, other) => {
                let (one, other) = (one.index(ends), other.index(ends));
                let part = bytes[one.min(other)..one.max(other)].to_vec();
                bytes.splice(one.max(other)..one.max(other), part);
            }
            Spoiling::Insert(at, text) => {
                let at = at.index(ends);
                bytes.splice(at..at, text.bytes());
            }
            Spoiling::Value(field, text) => {
                let colons = bytes.iter().enumerate().filter(|(_, byte)| **byte == b':');
                let colons: Vec<usize> = colons.map(|(place, _)| place + 1).collect();
                if !colons.is_empty() {
                    let from = colons[field.index(colons.len())];
                    let is_end = |byte: &u8| [b',', b'}'].contains(byte);
                    let length = bytes[from..].iter().position(is_end);
                    let until = length.map_or(bytes.len(), |length| from + length);
                    bytes.splice(from..until, text.bytes());
                }
            }
        }
    }
}

/// The bytes of a message after some of that, or of none at all.
fn spoilt() -> impl Strategy<Value = Vec<u8>> {
    let index = any::<prop::sample::Index>;
    let text = || proptest::sample::select(&TEXTS[..]);
    let spoiling = prop_oneof![
        (index(), any::<u8>()).prop_map(|(at, byte)| Spoiling::Byte(at, byte)),
        index().prop_map(Spoiling::Cut),
        (index(), index()).prop_map(|(one, other)| Spoiling::Repeat(one, other)),
        (index(), text()).prop_map(|(at, text)| Spoiling::Insert(at, text)),
        (index(), text()).prop_map(|(field, text)| Spoiling::Value(field, text)),
    ];
    let values = prop::collection::vec(finite(), 0..4);
    let spoilings = prop::collection::vec(spoiling, 0..3);
    let of_message = (values, spoilings).prop_map(|(values, spoilings)| {
        let sample = Sample {
            module: module(),
            run: RunId(7),
            step: Step(41),
            time_unix_ns: 9,
            demands_n: values.clone(),
            pressures_pa: values.iter().map(|&x| [x, -x]).collect(),
            elongations_m: values,
            readings: Vec::new(),
            block: Vec::new(),
        };
        let mut bytes = encode(&sample).unwrap();
        spoilings.iter().for_each(|spoiling| spoiling.spoil(&mut bytes));
        bytes
    });
    let any_bytes = prop::collection::vec(any::<u8>(), 0..300);
    prop_oneof![9 => of_message, 1 => any_bytes]
}

#[test]
fn a_field_that_is_not_read_may_hold_a_number_that_no_field_has_room_for() {
    let text = r#"{"v":1,"module":"module1","run":7,"step":41,"time_unix_ns":9,"demands_n":[],"of_later":1e999}"#;
    assert_eq!(decode::<Sample>(text.as_bytes()).unwrap().step, Step(41));
}

/// Otherwise the property above would say little.
#[test]
fn spoilt_messages_are_refused_for_every_reason_there_is_and_some_are_still_read() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..2000 {
        let bytes = spoilt().new_tree(&mut runner).unwrap().current();
        seen.insert(match decode::<Sample>(&bytes) {
            Ok(_) => "read",
            Err(DecodeError::TooLong { .. }) => "too long",
            Err(DecodeError::NotText) => "not text",
            Err(DecodeError::Malformed(_)) => "malformed",
            Err(DecodeError::NoVersion) => "no version",
            Err(DecodeError::UnknownVersion(_)) => "unknown version",
            Err(DecodeError::WrongMessage { .. }) => "wrong message",
        });
    }
    let all = ["malformed", "no version", "not text", "read", "unknown version", "wrong message"];
    assert_eq!(seen, all.into());
}

fn structure() -> StructureName {
    "tower".parse().unwrap()
}

fn module() -> ModuleName {
    "module1".parse().unwrap()
}

const EVIDENCE: Evidence = Evidence {
    step: Step(41),
    residual: -1e-7,
    level: 2e-8,
    divergence: Some(0.1),
    threshold: 0.05,
};

fn identification() -> Identification {
    let size = FaultSize { value: 4.5e-5, low: -4.4e-5, high: 4.6e-5, own_unit: false };
    let candidate = |kind: FaultKind, size| Candidate { kind: kind.into(), probability: 0.5, size };
    let point = SignaturePoint { step: Step(40), measured: -1e-300, fitted: 0.1 };
    Identification {
        structure: structure(),
        module: module(),
        component: "module1/sensor/g1".parse().unwrap(),
        run: RunId(5),
        sequence: 3,
        as_of_step: Step(47),
        decided: false,
        candidates: vec![candidate(FaultKind::Bias, Some(size)), candidate(FaultKind::Stuck, None)],
        signature: Some(Signature { unit: "m".to_owned(), points: vec![point] }),
        since_unix_ns: Some(8),
        time_unix_ns: 9,
    }
}

#[test]
fn an_identification_is_read_back_and_one_of_an_unknown_kind_is_not() {
    let identification = identification();
    assert_eq!(back(&identification), identification);
    let text = String::from_utf8(vocabulary::encode(&identification).unwrap()).unwrap();
    for unknown in ["\"of_a_later_version\"", "0"] {
        let text = text.replace("\"stuck\"", unknown);
        let error = vocabulary::decode::<Identification>(text.as_bytes()).unwrap_err();
        assert!(matches!(error, DecodeError::WrongMessage { .. }), "{error}");
    }
    assert_eq!(identification.kind(), None, "it is not decided");
    let decided = Identification { decided: true, ..identification };
    assert_eq!(decided.kind(), decided.candidates.first());
}

#[test]
fn a_fault_may_be_identified_as_none_of_the_kinds_and_cannot_be_injected_as_that() {
    let kinds = FaultKind::ALL.map(IdentifiedKind::Known);
    for kind in kinds.into_iter().chain([IdentifiedKind::NoneOfThese]) {
        let text = serde_json::to_string(&kind).unwrap();
        assert_eq!(text, format!("\"{kind}\""));
        assert_eq!(serde_json::from_str::<IdentifiedKind>(&text).unwrap(), kind);
    }
    assert_eq!(IdentifiedKind::NoneOfThese.to_string(), "none_of_these");
    assert!(serde_json::from_str::<Fault>(r#"{"kind":"none_of_these"}"#).is_err());
}

#[test]
fn events_are_read_back() {
    let change = ChangeReport {
        structure: structure(),
        component: "module1/sensor/g1".parse().unwrap(),
        run: RunId(5),
        step: Step(41),
        evidence: Evidence { divergence: None, ..EVIDENCE },
        time_unix_ns: 9,
    };
    assert_eq!(back(&change), change);
    let transition = FaultTransition {
        structure: structure(),
        module: module(),
        component: "module1/sensor/g1".parse().unwrap(),
        verdict: Verdict::Explained { by: "module2/actuator/a1".parse().unwrap(), since: Step(39) },
        symptom: Symptom::NoSignal,
        sequence: 3,
        incarnation: 1_795_290_000_000,
        run: Some(RunId(5)),
        run_ended: true,
        onset_step: Some(Step(40)),
        detection_step: Some(Step(41)),
        decided_step: Some(Step(47)),
        evidence: Some(EVIDENCE),
        silent_because: vec!["not there".into()],
        before_service: true,
        disputed: Some("module2/sensor/g1".parse().unwrap()),
        unknown: Some(Unknown { since_unix_ns: 8, reason: "no sample for 500 ms".into() }),
        tare: Some(1.5e-6),
        condition: Some(Condition::CannotTell {
            obstacle: Obstacle::UnseenForce("module2/actuator/a1".parse().unwrap()),
        }),
        identification: Some(Box::new(identification().without_signature())),
        order: Some(GivenOrder {
            kind: GivenOrderKind::Reset { force: true },
            by: "web".into(),
            on_behalf_of: Some("ada".into()),
            note: Some("valve changed".into()),
        }),
        state_order: Some(Box::new(GivenOrder {
            kind: GivenOrderKind::Acknowledge,
            by: "web".into(),
            on_behalf_of: None,
            note: None,
        })),
        shelved: Some(shelving()),
        suppressed: Some(Shelving { on_behalf_of: None, ..shelving() }),
        reading: Some(ReplacedReading {
            step: Step(7),
            own_m: Some(3e-4),
            elongation_m: Some(1e-6),
            low_m: Some(9e-7),
            high_m: Some(1.1e-6),
        }),
        shut_off: Some(GivenOrder {
            kind: GivenOrderKind::ShutOff { since_unix_ns: 4 },
            by: "ada".into(),
            on_behalf_of: None,
            note: None,
        }),
        durable: false,
        since_unix_ns: 6,
        time_unix_ns: 9,
    };
    assert_eq!(back(&transition), transition);
    let component = || "module1/actuator/a1".parse().unwrap();
    for doubt in [
        Doubt::Silent(vec!["module2".parse().unwrap()]),
        Doubt::Unknowing(Vec::new()),
        Doubt::Assumed(component()),
        Doubt::OneOf(vec![component()]),
        Doubt::RunEnded,
    ] {
        let transition =
            FaultTransition { verdict: Verdict::Unconfirmed { doubt }, ..transition.clone() };
        assert_eq!(back(&transition), transition);
    }
    let divergences = Divergences {
        structure: structure(),
        module: module(),
        run: RunId(5),
        step: Step(41),
        time_unix_ns: 9,
        channels: vec![Channel {
            component: "actuator/a1".parse().unwrap(),
            residual: 12.5,
            divergence: None,
            threshold: 0.1,
            own_unit: false,
        }],
    };
    assert_eq!(back(&divergences), divergences);
    let mut readings = CorrectedReadings::default();
    readings.push(1e-6, 1e-7, ReadingSource::Own);
    readings.push(f64::NAN, 1e-7, ReadingSource::Replaced);
    assert_eq!(readings.source, [ReadingSource::Own, ReadingSource::NotValid]);
    assert_eq!(readings.high_m, [Some(1e-6 + 1e-7), None]);
    let corrected = Corrected {
        structure: structure(),
        module: module(),
        run: RunId(5),
        step: Step(41),
        time_unix_ns: 9,
        readings,
        forces_n: vec![Some(12.5), None],
    };
    assert_eq!(back(&corrected), corrected);
    let capability = Capability {
        structure: structure(),
        module: module(),
        cylinders: vec![CylinderCapability {
            name: "a1".parse().unwrap(),
            ability: Ability::HardOver,
            decided: false,
            ends_in_s: Some(4000),
        }],
        time_unix_ns: 9,
    };
    assert_eq!(back(&capability), capability);
}

#[test]
fn the_states_of_a_fault_have_the_names_of_the_manual() {
    let states = [
        FaultState::Normal,
        FaultState::Tentative,
        FaultState::Unconfirmed,
        FaultState::Explained,
        FaultState::Latched,
        FaultState::Acknowledged,
    ];
    for state in states {
        assert_eq!(serde_json::to_string(&state).unwrap(), format!("\"{state}\""));
    }
}

#[test]
fn answers_orders_and_refusals_are_read_back() {
    let over = Change {
        component: "sensor/g1".parse().unwrap(),
        step: Step(4),
        onset: Step(3),
        ratio: 1.25,
        until: Some(Step(6)),
    };
    let going_on = Change { until: None, ..over.clone() };
    let answer = StateAnswer {
        module: module(),
        question: StateQuestion {
            run: RunId(1),
            from: Step(1),
            as_of: Step(9),
            window: Some(WindowLength::Long),
        },
        watching_since: None,
        changes: vec![over, going_on],
        actuator_faults: vec![ActuatorFault { actuator: "a1".parse().unwrap(), step: Step(2) }],
        alarms: vec![Alarm {
            component: "sensor/g1".parse().unwrap(),
            step: Step(2),
            faulty: true,
        }],
        pending: vec!["sensor/g2".parse().unwrap()],
        window: Some(WindowMeans {
            length: WindowLength::Long,
            until: Step(9),
            gages: vec![
                None,
                Some(GageMeans { residual_m: 1e-6, scatter_m2: 1e-12, swing_m2: 0.0 }),
            ],
            cylinders: vec![Some(CylinderMeans {
                force_n: 1.5,
                rate_n_per_s: 0.5,
                tracking_n: -0.1,
                content_pa: 8e6,
            })],
        }),
    };
    assert_eq!(back(&answer), answer);
    let refused = Refused { reason: "no sample yet".into() };
    assert_eq!(back(&refused), refused);
    let component: vocabulary::ComponentPath = "module1/sensor/g1".parse().unwrap();
    for (fault, at_step) in [
        (Some(Fault::Bias { offset_m: 1e-5 }), Some(Step(7))),
        (Some(Fault::ZeroOutput {}), None),
        (Some(Fault::Drift { drift_m_per_s: 0.1 + 0.2 }), None),
        (Some(Fault::Gain { gain: 0.95 }), None),
        (Some(Fault::Stuck {}), None),
        (Some(Fault::Intermittent { offset_m: -5e-5, closed_s: 0.5, open_s: 0.02 }), None),
        (Some(Fault::Stiction { band_m3_per_s: 1e-5 }), None),
        (None, None),
    ] {
        let injection = Injection { component: component.clone().into(), fault, at_step };
        assert_eq!(back(&injection), injection);
    }
    let injected = Injected { component, effective_step: Step(8) };
    assert_eq!(back(&injected), injected);
    let component: vocabulary::ComponentPath = "module1/actuator/a3".parse().unwrap();
    let stroke = Stroke {
        component: component.clone().into(),
        force_n: 0.1 + 0.2,
        duration_s: 2.5,
        largest_strain: 1e-4,
    };
    assert_eq!(back(&stroke), stroke);
    let begun = StrokeBegun { component, first_step: Step(9), last_step: Step(2508) };
    assert_eq!(back(&begun), begun);
    let order = Order {
        component: Some("actuator/a1".parse().unwrap()),
        by: "web".into(),
        on_behalf_of: Some("ada".into()),
        note: Some("painting".into()),
        for_s: Some(7200),
        ..Order::default()
    };
    assert_eq!(back(&order), order);
    let obeyed = Obeyed {
        component: Some("actuator/a1".parse().unwrap()),
        state: FaultState::Acknowledged,
        sequence: 7,
        durable: false,
    };
    assert_eq!(back(&obeyed), obeyed);
    let phase = PhaseChange {
        structure: structure(),
        module: module(),
        phase: ModulePhase::Stale,
        number: 1,
        not_monitored: std::collections::BTreeMap::new(),
        before: Some(ModulePhase::InService),
        run: Some(RunId(1)),
        step: Some(Step(2)),
        reason: "no sample for 500 ms".into(),
        time_unix_ns: 9,
    };
    assert_eq!(back(&phase), phase);
    let page = HistoryPage {
        structure: structure(),
        module: module(),
        transitions: Vec::new(),
        identifications: vec![identification()],
        phases: vec![phase.clone()],
        first_sequence: Some(1),
        next_sequence: 4,
        more: false,
    };
    assert_eq!(back(&page), page);
    let progress = Progress { run: RunId(1), step: Step(2) };
    assert_eq!(back(&progress), progress);
}

#[test]
fn statuses_are_read_back() {
    let status = ModuleStatus {
        structure: structure(),
        module: module(),
        software: "0.2.0".into(),
        thresholds: "0123456789abcdef".into(),
        reference: Some("fedcba9876543210".into()),
        phase: ModulePhase::InService,
        in_service_since_step: Some(Step(2018)),
        run: Some(RunId(1)),
        step: Some(Step(3000)),
        lag_ms: Some(0.4),
        sample_age_ms: Some(1.4),
        queued_samples: 1,
        latched: 1,
        unconfirmed: 0,
        verified: 11,
        unknown: 11,
        shelved: 2,
        suppressed: Some(shelving()),
        waiting_questions: 0,
        next_sequence: 4,
        journal: JournalStatus { problem: Some("disk full".into()), ..Default::default() },
        peers: vec![PeerStatus {
            module: "module2".parse().unwrap(),
            present: true,
            latest: Some(PeerOutcome::Refused),
            reason: Some("no sample yet".into()),
            answered: 1,
            refused: 2,
            timed_out: 3,
            absent: 4,
            malformed: 5,
            disputed: 6,
        }],
        another_process: true,
        inquiries: vocabulary::InquiryCounters { received: 3, ..Default::default() },
        intake: vocabulary::IntakeCounters { received: 3002, malformed: 1, ..Default::default() },
        diagnosis: vocabulary::Counters { samples: 3001, ..Default::default() },
        publisher: vocabulary::PublisherCounters { events: 5, ..Default::default() },
        certificate_until_unix_s: Some(1_826_831_315),
        margins: vec![Margins {
            change: Some(0.25),
            departure: Some(-0.5),
            ..Margins::unknown("sensor/g1".parse().unwrap())
        }],
        time_unix_ns: 10,
    };
    assert_eq!(back(&status), status);
    let plant = PlantStatus {
        structure: structure(),
        software: "0.2.0".into(),
        run: RunId(1),
        phase: PlantPhase::Waiting,
        waiting_for: vec![module()],
        next_step: Step(0),
        speed: None,
        late_steps: 0,
        latest_ms: 0.0,
        samples_unsent: 0,
        faults: vec![PresentFault {
            component: "module1/actuator/a1".parse().unwrap(),
            fault: Fault::HardOver {},
        }],
        done_without: vec!["module1/actuator/a1".parse().unwrap()],
        messages_refused: 1,
        time_unix_ns: 10,
    };
    assert_eq!(back(&plant), plant);
}

fn shelving() -> Shelving {
    Shelving {
        since_unix_ns: 3,
        until_unix_ns: 9,
        by: "web".into(),
        on_behalf_of: Some("ada".into()),
        reason: "painting".into(),
    }
}
