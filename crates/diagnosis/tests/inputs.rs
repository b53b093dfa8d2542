//! What is recorded of an event is the same event again, after its way through a file, bit for bit.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use diagnosis::messages::{Speaker, from_taken, to_memory, to_taken};
use diagnosis::state::{CylinderMeans, GageMeans, WindowLength, WindowMeans};
use diagnosis::{
    ActuatorFault, Alarm, Change, Event, Evidence, GivenOrder, GivenOrderKind, Memory, OrderToken,
    PastWatch, PeerFailure, Shelving, Span, StateAnswer, StateQuestion, Symptom, Transition,
    Verdict,
};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use vocabulary::{Component, Input, ModuleName, RunId, Step, Taken};

fn finite() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite())
}

fn step() -> impl Strategy<Value = Step> {
    any::<u64>().prop_map(Step)
}

fn module() -> impl Strategy<Value = ModuleName> {
    "[a-z]{1,8}".prop_filter("a module", |name| name != "plant").prop_map(|n| n.parse().unwrap())
}

fn component() -> impl Strategy<Value = Component> {
    "(actuator|sensor)/[a-z][0-9]".prop_map(|name| name.parse().unwrap())
}

fn length() -> impl Strategy<Value = Option<WindowLength>> {
    option::of(proptest::sample::select(WindowLength::ALL.to_vec()))
}

fn question() -> impl Strategy<Value = StateQuestion> {
    (any::<u64>(), step(), step(), length()).prop_map(|(run, from, as_of, window)| StateQuestion {
        run: RunId(run),
        from,
        as_of,
        window,
    })
}

fn change() -> impl Strategy<Value = Change> {
    (component(), any::<u64>(), any::<u64>(), finite(), option::of(step())).prop_map(
        |(component, one, other, ratio, until)| Change {
            component,
            onset: Step(one.min(other)),
            step: Step(one.max(other)),
            ratio,
            until,
        },
    )
}

fn gage() -> impl Strategy<Value = Option<GageMeans>> {
    option::of((finite(), finite(), finite())).prop_map(|means| {
        means.map(|(residual_m, scatter_m2, swing_m2)| GageMeans {
            residual_m,
            scatter_m2,
            swing_m2,
        })
    })
}

fn cylinder() -> impl Strategy<Value = Option<CylinderMeans>> {
    option::of((finite(), finite(), finite(), finite())).prop_map(|means| {
        means.map(|(force_n, rate_n_per_s, tracking_n, content_pa)| CylinderMeans {
            force_n,
            rate_n_per_s,
            tracking_n,
            content_pa,
        })
    })
}

fn answer() -> impl Strategy<Value = StateAnswer> {
    let alarm = (component(), step(), any::<bool>());
    let alarm = alarm.prop_map(|(component, step, faulty)| Alarm { component, step, faulty });
    let fault = ("[a-z][0-9]", step());
    let fault = fault
        .prop_map(|(actuator, step)| ActuatorFault { actuator: actuator.parse().unwrap(), step });
    (
        (module(), question()),
        option::of(step()),
        vec(change(), 0..3),
        vec(fault, 0..3),
        vec(alarm, 0..3),
        option::of((vec(gage(), 0..3), vec(cylinder(), 0..3))),
    )
        .prop_map(
            |((module, question), watching_since, changes, actuator_faults, alarms, means)| {
                StateAnswer {
                    module,
                    question,
                    watching_since,
                    changes,
                    actuator_faults,
                    pending: alarms.iter().map(|alarm| alarm.component.clone()).collect(),
                    alarms,
                    // What was not asked for is not answered.
                    window: question.window.zip(means).map(|(length, (gages, cylinders))| {
                        WindowMeans { length, until: question.as_of, gages, cylinders }
                    }),
                }
            },
        )
}

fn span() -> impl Strategy<Value = Span> {
    any::<(u64, u64)>()
        .prop_map(|(since_unix_ns, until_unix_ns)| Span { since_unix_ns, until_unix_ns })
}

fn order_kind() -> impl Strategy<Value = GivenOrderKind> {
    prop_oneof![
        Just(GivenOrderKind::Acknowledge),
        Just(GivenOrderKind::ReTare),
        any::<bool>().prop_map(|force| GivenOrderKind::Reset { force }),
        span().prop_map(GivenOrderKind::Shelve),
        Just(GivenOrderKind::Unshelve),
        span().prop_map(GivenOrderKind::Suppress),
        Just(GivenOrderKind::Unsuppress),
        any::<u64>().prop_map(|since_unix_ns| GivenOrderKind::ShutOff { since_unix_ns }),
        Just(GivenOrderKind::PutBack),
        Just(GivenOrderKind::Declare),
        any::<u64>().prop_map(|now_unix_ns| GivenOrderKind::Lapse { now_unix_ns }),
    ]
}

fn given() -> impl Strategy<Value = GivenOrder> {
    let person = option::of(any::<String>());
    (order_kind(), any::<String>(), person, option::of(any::<String>()))
        .prop_map(|(kind, by, on_behalf_of, note)| GivenOrder { kind, by, on_behalf_of, note })
}

fn shelving() -> impl Strategy<Value = Option<Box<Shelving>>> {
    let shelving = (span(), any::<String>(), option::of(any::<String>()), any::<String>());
    option::of(shelving.prop_map(|(span, by, on_behalf_of, reason)| {
        Box::new(Shelving {
            since_unix_ns: span.since_unix_ns,
            until_unix_ns: span.until_unix_ns,
            by,
            on_behalf_of,
            reason,
        })
    }))
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        answer().prop_map(Event::Answered),
        // In other words, but it went unanswered.
        (module(), question(), any::<String>()).prop_map(|(peer, question, reason)| {
            Event::Unanswered { peer, question, failure: PeerFailure::Refused(reason) }
        }),
        module().prop_map(|peer| Event::Returned { peer }),
        (component(), given()).prop_map(|(component, order)| {
            Event::Ordered { token: OrderToken(0), component, order }
        }),
    ]
}

/// Through a file.
fn back(taken: Taken) -> Taken {
    let input = Input {
        structure: "tower".parse().unwrap(),
        module: "module1".parse().unwrap(),
        process: u64::MAX,
        number: 1,
        samples: 0,
        run: None,
        step: None,
        time_unix_ns: 1,
        taken,
    };
    vocabulary::decode::<Input>(&vocabulary::encode(&input).unwrap()).unwrap().taken
}

/// Whatever a failure is called, it is one.
fn without_reason(event: Event) -> Event {
    match event {
        Event::Unanswered { peer, question, .. } => {
            Event::Unanswered { peer, question, failure: PeerFailure::Absent }
        }
        other => other,
    }
}

proptest! {
    #[test]
    fn an_event_comes_back(event in event()) {
        let taken = to_taken(&event).unwrap();
        let found = from_taken(back(taken)).unwrap();
        prop_assert_eq!(without_reason(found), without_reason(event));
    }

    #[test]
    fn what_is_remembered_comes_back(
        changes in vec(change(), 0..3),
        run in any::<u64>(),
        watched in option::of((step(), step())),
        (component, given, tare) in (component(), option::of(given()), option::of(finite())),
        numbers in (finite(), finite(), option::of(0.0..1e30), 0.001..1e30),
        (verdict_order, shut_off) in (option::of(given()), option::of(given())),
        (shelved, suppressed) in (shelving(), shelving()),
    ) {
        let (residual, level, divergence, threshold) = numbers;
        let transition = Transition {
            sequence: 9,
            run: RunId(run),
            run_ended: true,
            component,
            verdict: Verdict::Acknowledged,
            symptom: Symptom::Departure,
            onset: Step(3),
            detection: Step(4),
            decided: Step(5),
            evidence: Evidence { step: Step(5), residual, level, divergence, threshold },
            before_service: true,
            disputed: None,
            tare,
            order: given,
            verdict_order: verdict_order.map(Box::new),
            shelved,
            suppressed,
            shut_off: shut_off.map(Box::new),
        };
        let watch = Some(PastWatch { run: RunId(run), watched, changes });
        let memory = Memory { sequence: 9, latest: vec![transition], watch };
        let speaker = Speaker::of("tower".parse().unwrap(), "module1".parse().unwrap());
        let started = Taken::Started {
            software: "1.0.0".to_owned(),
            configuration: String::new(),
            remembered: Box::new(speaker.remembered(&memory)),
        };
        let Taken::Started { remembered, .. } = back(started) else { unreachable!() };
        prop_assert_eq!(to_memory(*remembered), memory);
    }
}
