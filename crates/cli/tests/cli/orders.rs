//! `trusswatch ack`, `reset`, `fault shelve` and the like against a stand-in for the diagnosers.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde_json::Value;
use vocabulary::{FaultState, Obeyed, Order, OrderKind, Topic};

use crate::binary::run;
use crate::stand_in::{Judge, StandIn, nowhere};

/// Obeys, but for `sensor/g9`.
fn reasonable(kind: OrderKind, order: &Order) -> Result<Obeyed, String> {
    if order.component.as_ref().is_some_and(|m| m.component.name() == "g9") {
        return Err("`sensor/g9` is normal; there is nothing to acknowledge".to_owned());
    }
    let state = match kind {
        OrderKind::Acknowledge => FaultState::Acknowledged,
        _ => FaultState::Normal,
    };
    Ok(Obeyed {
        component: order.component.as_ref().map(|m| m.component.clone()),
        state,
        sequence: 7,
        durable: true,
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn a_command_arrives_as_it_was_given_and_its_outcome_is_printed() {
    let mut tower = StandIn::open("tower").await;
    let orders = tower.orders("module1", Arc::new(reasonable)).await;
    tower.token("module1").await;
    let (by, note) = (["--by", "ada"], ["--note", "seen on site"]);
    let given = [&["ack", "module1/sensor/g2"][..], &by, &note].concat();
    let outcome = tower.run(&given);
    outcome.succeeds();
    let printed = "acknowledged module1/sensor/g2 by ada: now acknowledged, transition 7\n";
    assert_eq!(outcome.stdout, printed);
    tower.run(&["reset", "module1/sensor/g2", "--by", "ada", "--force"]).succeeds();
    let order = |note: Option<&str>, force| Order {
        component: Some("sensor/g2".parse().unwrap()),
        by: "ada".to_owned(),
        note: note.map(str::to_owned),
        force,
        ..Order::default()
    };
    assert_eq!(*orders.lock().unwrap(), [order(Some("seen on site"), false), order(None, true)]);
}

#[tokio::test(flavor = "multi_thread")]
async fn control_characters_in_the_own_name_do_not_reach_the_terminal() {
    let mut tower = StandIn::open("tower").await;
    tower.orders("module1", Arc::new(reasonable)).await;
    tower.token("module1").await;
    let given = ["ack", "module1/sensor/g2", "--by", "ada\u{1b}[2J\u{9b}31m"];
    let people = tower.run(&given);
    let machines = tower.run(&[&given[..], &["--json"]].concat());
    assert!(people.stdout.contains(r" by ada\u{1b}[2J\u{9b}31m: "), "{}", people.stdout);
    for outcome in [people, machines] {
        outcome.succeeds();
        let printed = outcome.stdout + &outcome.stderr;
        assert!(!printed.contains(['\u{1b}', '\u{9b}']), "{printed:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn alarms_are_set_aside_for_a_time_and_for_a_reason() {
    let mut tower = StandIn::open("tower").await;
    let orders = tower.orders("module1", Arc::new(reasonable)).await;
    tower.token("module1").await;
    let run = |arguments: &[&str]| {
        let outcome = tower.run(&[&["fault"], arguments, &["--by", "ada"]].concat());
        outcome.succeeds();
        outcome.stdout
    };
    let (span, reason) = (["--for", "1h 30m"], ["--reason", "painting"]);
    let shelved =
        run(&[&["shelve", "module1/sensor/g1", "module1/sensor/g2"][..], &span, &reason].concat());
    let line = |gage| format!("shelved      module1/sensor/{gage} by ada: transition 7\n");
    assert_eq!(shelved, line("g1") + &line("g2"));
    let suppressed = run(&[&["suppress", "module1"][..], &span, &reason].concat());
    assert_eq!(suppressed, "suppressed   module1 by ada: up to transition 7\n");
    assert!(run(&["unshelve", "module1/sensor/g1", "--note", "done"]).starts_with("unshelved"));
    let ended: Value = serde_json::from_str(&run(&["unsuppress", "module1", "--json"])).unwrap();
    let ended = &ended["orders"][0];
    assert_eq!((&ended["module"], &ended["component"]), (&"module1".into(), &Value::Null));
    assert_eq!((&ended["order"], &ended["outcome"]), (&"unsuppress".into(), &"obeyed".into()));
    let order = |component: Option<&str>, for_s, note: Option<&str>| Order {
        component: component.map(|component| component.parse().unwrap()),
        by: "ada".to_owned(),
        note: note.map(str::to_owned),
        for_s,
        ..Order::default()
    };
    let expected = [
        order(Some("sensor/g1"), Some(5400), Some("painting")),
        order(Some("sensor/g2"), Some(5400), Some("painting")),
        order(None, Some(5400), Some("painting")),
        order(Some("sensor/g1"), None, Some("done")),
        order(None, None, None),
    ];
    assert_eq!(*orders.lock().unwrap(), expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cylinder_is_shut_off_and_put_back_and_a_component_is_declared_faulty_for_a_reason() {
    let mut tower = StandIn::open("tower").await;
    let orders = tower.orders("module1", Arc::new(reasonable)).await;
    tower.token("module1").await;
    for (command, done) in
        [("shut-off", "shut off"), ("put-back", "put back"), ("declare", "declared faulty")]
    {
        let arguments = ["fault", command, "module1/actuator/a1", "--by", "ada", "--note", "loud"];
        let outcome = tower.run(&arguments);
        outcome.succeeds();
        assert!(outcome.stdout.starts_with(done), "{}", outcome.stdout);
    }
    assert!(orders.lock().unwrap().iter().all(|order| order.note.as_deref() == Some("loud")));
    tower
        .run(&["fault", "declare", "module1/sensor/g1", "--by", "ada"])
        .fails(2, &["`declare` needs a reason"]);
    assert_eq!(orders.lock().unwrap().len(), 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_set_aside_is_refused_with_the_reason() {
    let mut tower = StandIn::open("tower").await;
    let judge = |_, order: &Order| match &order.component {
        Some(mention) => Err(format!("`{mention}` is not shelved")),
        None => Err("no component of `module1` is suppressed".to_owned()),
    };
    tower.orders("module1", Arc::new(judge)).await;
    tower.token("module1").await;
    let run = |arguments: &[&str]| tower.run(&[&["fault"], arguments, &["--by", "ada"]].concat());
    let refused = "module1/sensor/g1: refused: `sensor/g1` is not shelved";
    run(&["unshelve", "module1/sensor/g1"]).fails(1, &[refused]);
    let refused = "module1: refused: no component of `module1` is suppressed";
    run(&["unsuppress", "module1"]).fails(1, &[refused]);
    run(&["unsuppress", "module2", "--timeout", "0.5"])
        .fails(4, &["module2: its diagnoser was not seen", "no command was sent"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_done_but_not_saved_is_exit_code_5_unless_something_weighs_more() {
    let mut tower = StandIn::open("tower").await;
    let unsaved = |kind, order: &Order| {
        reasonable(kind, order).map(|obeyed| Obeyed { durable: false, ..obeyed })
    };
    tower.orders("module1", Arc::new(unsaved)).await;
    tower.token("module1").await;
    let outcome = tower.run(&["ack", "module1/sensor/g2", "--by", "ada"]);
    outcome.fails(5, &["module1/sensor/g2: carried out but not saved: the disk of `module1`"]);
    assert!(outcome.stdout.contains("now acknowledged"), "{}", outcome.stdout);
    let both = ["ack", "module1/sensor/g2", "module1/sensor/g9", "--by", "ada"];
    tower.run(&both).fails(1, &["not saved", "refused"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refusal_is_printed_with_its_reason_and_does_not_stop_the_others() {
    let mut tower = StandIn::open("tower").await;
    tower.orders("module1", Arc::new(reasonable)).await;
    tower.token("module1").await;
    let components = ["module1/sensor/g9", "module1/sensor/g2"];
    let outcome = tower.run(&["ack", components[0], components[1], "--by", "ada", "--json"]);
    outcome.fails(1, &["module1/sensor/g9: refused: `sensor/g9` is normal"]);
    let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(document["v"], 1);
    assert_eq!(document["orders"][0]["outcome"], "refused");
    assert!(document["orders"][0]["reason"].as_str().unwrap().contains("is normal"));
    assert_eq!(document["orders"][1]["outcome"], "obeyed");
    assert_eq!(document["orders"][1]["state"], "acknowledged");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_absent_module_and_a_silent_one_are_distinguished() {
    let mut tower = StandIn::open("tower").await;
    let ack = |tower: &StandIn, timeout| {
        tower.run(&["ack", "module1/sensor/g2", "--by", "ada", "--timeout", timeout])
    };
    ack(&tower, "0.5").fails(4, &["module1/sensor/g2", "not seen", "no command was sent"]);
    tower.silence("module1", Topic::Command(OrderKind::Acknowledge)).await;
    tower.token("module1").await;
    ack(&tower, "10").fails(4, &["module1/sensor/g2", "may or may not have been carried out"]);
    let nowhere = nowhere();
    run(&["reset", "m/sensor/g", "--by", "a", "--timeout", "0.5", "--connect", &nowhere])
        .fails(4, &[&nowhere]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reset_waits_for_the_evidence_to_go() {
    let mut tower = StandIn::open("tower").await;
    let attempts = Arc::new(AtomicU64::new(0));
    let count = attempts.clone();
    let judge: Arc<Judge> =
        Arc::new(move |kind, order| match count.fetch_add(1, Ordering::Relaxed) {
            0..3 => Err("the divergence is still 3 times its threshold".to_owned()),
            _ => reasonable(kind, order),
        });
    tower.orders("module1", judge).await;
    tower.token("module1").await;
    let reset = ["reset", "module1/sensor/g2", "--by", "ada"];
    tower.run(&reset).fails(1, &["still 3 times"]);
    let outcome = tower.run(&[&reset[..], &["--wait", "20"]].concat());
    outcome.succeeds();
    assert!(outcome.stdout.contains("now normal"), "{}", outcome.stdout);
    assert_eq!(attempts.load(Ordering::Relaxed), 4);
    let too_soon = tower.run(&["reset", "module1/sensor/g9", "--by", "ada", "--wait", "0.3"]);
    too_soon.fails(1, &["refused"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_module_of_two_structures_is_not_guessed_at() {
    let mut tower = StandIn::open("tower").await;
    let mut bridge = tower.also("bridge");
    let mut taken = Vec::new();
    for structure in [&mut tower, &mut bridge] {
        taken.push(structure.orders("module1", Arc::new(reasonable)).await);
        structure.token("module1").await;
    }
    let ack = ["ack", "module1/sensor/g2", "--by", "ada"];
    tower.run(&ack).fails(2, &["`bridge` and `tower`", "--structure"]);
    tower.run(&[&ack[..], &["--structure", "bridge"]].concat()).succeeds();
    let taken: Vec<usize> = taken.iter().map(|orders| orders.lock().unwrap().len()).collect();
    assert_eq!(taken, [0, 1]);
}

#[test]
fn orders_that_cannot_be_meant_are_not_sent() {
    let connect = ["--connect", "tcp/127.0.0.1:1"];
    let order = |arguments: &[&str]| run(&[arguments, &connect].concat());
    order(&["ack"]).fails(2, &["COMPONENT"]);
    order(&["ack", "module1/valve/x"]).fails(2, &["actuator/NAME"]);
    order(&["ack", "m/sensor/g", "--by", " "]).fails(2, &["state who issues the command"]);
    order(&["reset", "m/sensor/g", "--force", "--wait", "3"]).fails(2, &["--wait"]);
    let shelve = |span, reason| {
        order(&["fault", "shelve", "m/sensor/g", "--by", "a", "--for", span, "--reason", reason])
    };
    shelve("soon", "painting").fails(2, &["use whole seconds", "`1h 30m`"]);
    shelve("32days", "painting").fails(2, &["from 1s to 31days"]);
    shelve("2h", " ").fails(2, &["needs a reason"]);
    order(&["fault", "shelve", "m/sensor/g", "--for", "2h"]).fails(2, &["--reason"]);
    order(&["fault", "suppress", "m/sensor/g", "--for", "2h", "--reason", "x"])
        .fails(2, &["m/sensor/g"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_issuer_is_taken_from_the_environment() {
    let mut tower = StandIn::open("tower").await;
    let orders = tower.orders("module1", Arc::new(reasonable)).await;
    tower.token("module1").await;
    let arguments = ["ack", "module1/sensor/g2", "--connect", &tower.endpoint];
    let order = |user: &str| {
        let mut command = crate::binary::trusswatch();
        command.args(arguments).env("USER", user).env_remove("LOGNAME");
        tokio::task::block_in_place(|| command.output().unwrap().status.code())
    };
    assert_eq!(order("grace"), Some(0));
    assert!(orders.lock().unwrap()[0].by.starts_with("grace@"));
    assert_eq!(order(""), Some(2));
}
