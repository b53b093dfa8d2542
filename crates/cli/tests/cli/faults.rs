//! `trusswatch faults` against a stand-in for the diagnosers.

use serde_json::Value;
use vocabulary::{
    Doubt, FaultState, FaultTransition, GivenOrder, GivenOrderKind, ModulePhase, Shelving, Step,
    Topic, Verdict,
};

use crate::binary::{Outcome, outcome, run, trusswatch};
use crate::stand_in::{StandIn, bias, identification, nowhere};

fn json(outcome: &Outcome) -> Value {
    serde_json::from_str(&outcome.stdout).unwrap()
}

fn list<'a>(document: &'a Value, name: &str) -> Vec<&'a Value> {
    document[name].as_array().unwrap().iter().collect()
}

/// The line that starts so, its columns separated by single blanks.
fn line(outcome: &Outcome, start: &str) -> String {
    let line = outcome.stdout.lines().find(|line| line.trim_start().starts_with(start));
    let line = line.unwrap_or_else(|| panic!("no `{start}` in:\n{}", outcome.stdout));
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Two modules with a component in every state, and a third that is only named as a peer.
async fn troubled() -> StandIn {
    let mut tower = StandIn::open("tower").await;
    let state = |component: &str, state, sequence| tower.transition(component, state, sequence);
    let acknowledged = FaultTransition {
        order: Some(GivenOrder {
            kind: GivenOrderKind::Acknowledge,
            on_behalf_of: None,
            by: "ada@station".to_owned(),
            note: Some("looks loose".to_owned()),
        }),
        ..state("module1/sensor/g2", FaultState::Acknowledged, 2)
    };
    let latched =
        FaultTransition { durable: false, ..state("module1/actuator/a3", FaultState::Latched, 3) };
    let identification = Some(Box::new(identification(&latched, true, vec![bias(0.99)])));
    let latched = FaultTransition { identification, ..latched };
    let normal = state("module1/sensor/g1", FaultState::Normal, 0);
    let explained = FaultTransition {
        verdict: Verdict::Explained {
            by: "module1/actuator/a3".parse().unwrap(),
            since: Step(3100),
        },
        ..state("module2/sensor/g5", FaultState::Explained, 1)
    };
    let unconfirmed = FaultTransition {
        verdict: Verdict::Unconfirmed { doubt: Doubt::Unknowing(vec!["module3".parse().unwrap()]) },
        ..state("module2/sensor/g6", FaultState::Unconfirmed, 2)
    };
    let (first, second) = (vec![acknowledged, latched, normal], vec![explained, unconfirmed]);
    tower.module("module1", ModulePhase::InService, &["module2", "module3"], first).await;
    tower.module("module2", ModulePhase::Stale, &["module1"], second).await;
    tower
}

#[tokio::test(flavor = "multi_thread")]
async fn every_module_and_every_component_that_is_not_normal_is_shown() {
    let tower = troubled().await;
    let outcome = tower.run(&["faults"]);
    outcome.succeeds();
    assert_eq!(line(&outcome, "module1 "), "module1 in service 4711 0.8 ms 1.1 ms ok -");
    assert_eq!(line(&outcome, "module2 "), "module2 STALE 4711 0.8 ms 1.1 ms ok -");
    assert_eq!(line(&outcome, "module3 "), "module3 NOT ANSWERING - - - - peer of module1");
    for (component, why) in [
        ("module1/actuator/a3", "× threshold NOT IN THE JOURNAL"),
        ("module1/sensor/g2", "acknowledged by ada@station: looks loose"),
        ("module2/sensor/g6", "module3 was not monitoring at that step"),
    ] {
        let line = line(&outcome, component);
        assert!(line.ends_with(why), "{line}");
    }
    let root = line(&outcome, "module1/actuator/a3");
    assert!(root.contains("; 1 effect: module2/sensor/g5"), "{root}");
    assert!(!outcome.stdout.contains("module1/sensor/g1"), "it is normal");
    let words = outcome.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("module3 NOT ANSWERING its components are unknown"), "{words}");
    let all = tower.run(&["faults", "--all"]);
    assert!(line(&all, "module1/sensor/g1").contains("normal"));
}

#[tokio::test(flavor = "multi_thread")]
async fn json_contains_the_same() {
    let tower = troubled().await;
    let outcome = tower.run(&["faults", "--json", "--expect", "module9"]);
    outcome.succeeds();
    let document = json(&outcome);
    assert!(outcome.stdout.starts_with("{\n  \"v\": 1,\n"), "{}", outcome.stdout);
    assert_eq!(document["all_is_well"], false);
    let modules: Vec<_> = list(&document, "modules")
        .iter()
        .map(|m| (m["module"].as_str().unwrap(), m["answers"].as_bool().unwrap()))
        .collect();
    let expected = [("module1", true), ("module2", true), ("module3", false), ("module9", false)];
    assert_eq!(modules, expected);
    assert_eq!(document["modules"][1]["phase"], "stale");
    assert_eq!(document["modules"][3]["expected"], true);
    let components = list(&document, "components");
    assert_eq!(components.len(), 4);
    assert_eq!(components[0]["component"], "module1/actuator/a3");
    assert_eq!(components[0]["durable"], false);
    assert_eq!(components[0]["identification"]["candidates"][0]["kind"], "bias");
    assert_eq!(components[1]["identification"], Value::Null);
    assert_eq!(components[0]["time"], "2026-11-18T11:06:40.750Z");
    assert_eq!(list(&json(&tower.run(&["faults", "--json", "--all"])), "components").len(), 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_check_fails_unless_all_is_well() {
    let mut tower = StandIn::open("tower").await;
    let normal = vec![tower.transition("module1/sensor/g1", FaultState::Normal, 0)];
    tower.module("module1", ModulePhase::InService, &[], normal).await;
    let check =
        |arguments: &[&str]| tower.run(&[&["faults", "--exit-code"], arguments].concat()).code;
    assert_eq!(check(&[]), Some(0));
    assert_eq!(check(&["--expect", "module2"]), Some(1), "a silent module");
    let latched = vec![tower.transition("module3/sensor/g1", FaultState::Latched, 1)];
    tower.module("module3", ModulePhase::InService, &[], latched).await;
    assert_eq!(tower.run(&["faults", "--exit-code"]).code, Some(1), "a fault");
}

fn shelving(reason: &str) -> Shelving {
    Shelving {
        since_unix_ns: 1_795_000_000_000_000_000,
        until_unix_ns: 1_795_007_200_000_000_000,
        by: "web".to_owned(),
        on_behalf_of: Some("ada".to_owned()),
        reason: reason.to_owned(),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_set_aside_is_shown_and_does_not_fail_a_check() {
    let mut tower = StandIn::open("tower").await;
    let latched = FaultTransition {
        shelved: Some(shelving("rewired")),
        ..tower.transition("module1/sensor/g1", FaultState::Latched, 1)
    };
    let normal = FaultTransition {
        shelved: Some(shelving("rewired too")),
        ..tower.transition("module1/sensor/g2", FaultState::Normal, 2)
    };
    tower.module("module1", ModulePhase::InService, &[], vec![latched, normal]).await;
    let stale = FaultTransition {
        suppressed: Some(shelving("painting")),
        ..tower.transition("module2/sensor/g3", FaultState::Normal, 1)
    };
    tower.module("module2", ModulePhase::Stale, &[], vec![stale]).await;
    let outcome = tower.run(&["faults", "--exit-code", "--all"]);
    outcome.succeeds();
    for (component, state, aside) in [
        (
            "module1/sensor/g1",
            "latched, shelved",
            "shelved until 2026-11-18T13:06:40.000Z by ada (through web): rewired",
        ),
        ("module1/sensor/g2", "normal, not verified, shelved", "(through web): rewired too"),
        ("module2/sensor/g3", "unknown, suppressed", "(through web): painting"),
        (
            "module2 ",
            "STALE",
            "suppressed until 2026-11-18T13:06:40.000Z by ada (through web): painting",
        ),
    ] {
        let line = line(&outcome, component);
        assert!(line.contains(state) && line.contains(aside), "{line}");
    }
    let document = json(&tower.run(&["faults", "--json"]));
    assert_eq!(document["all_is_well"], true);
    assert_eq!(document["structures"][0]["set_aside"], 3);
    assert_eq!(document["modules"][0]["set_aside"], 2);
    assert_eq!(document["modules"][0]["suppressed"], Value::Null);
    assert_eq!(document["modules"][1]["suppressed"]["reason"], "painting");
    let components = list(&document, "components");
    assert_eq!(components.len(), 3);
    assert_eq!(components[0]["shelved"]["on_behalf_of"], "ada");
    let expected = tower.run(&["faults", "--exit-code", "--expect", "module3"]);
    assert_eq!(expected.code, Some(1), "a silent one counts");
    let shown = tower.run(&["fault", "show", "module1/sensor/g1"]);
    assert!(shown.stdout.contains("shelved until"), "{}", shown.stdout);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_stale_module_calls_normal_is_unknown() {
    let mut tower = StandIn::open("tower").await;
    let states = ["module1/sensor/g1", "module1/sensor/g2"]
        .map(|component| tower.transition(component, FaultState::Normal, 0));
    tower.module("module1", ModulePhase::Stale, &[], states.into()).await;
    let outcome = tower.run(&["faults"]);
    outcome.succeeds();
    let counts = "0 of 2 components are normal, 2 unknown";
    assert!(outcome.stdout.contains(counts), "{}", outcome.stdout);
    let words = outcome.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("module1 STALE 2 components unknown"), "{words}");
    assert!(!words.contains("module1/sensor/g1"), "its module's row says the same: {words}");
    let document = json(&tower.run(&["faults", "--json"]));
    assert_eq!(
        (&document["modules"][0]["normal"], &document["modules"][0]["unknown"]),
        (&Value::from(0), &Value::from(2))
    );
    let all = tower.run(&["faults", "--all"]);
    assert!(line(&all, "module1/sensor/g1").contains("unknown"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_module_that_is_there_and_does_not_answer_is_shown_as_not_answering() {
    let mut tower = troubled().await;
    tower.silence("module4", Topic::Fault("sensor/g1".parse().unwrap())).await;
    tower.statuses("module4", ModulePhase::InService, &[]).await;
    tower.token("module4").await;
    let outcome = tower.run(&["faults", "--timeout", "10"]);
    outcome.succeeds();
    let line = line(&outcome, "module4 ");
    assert!(line.starts_with("module4 NOT ANSWERING 4711"), "{line}");
    assert!(line.ends_with("is present, but does not report its components"), "{line}");
}

#[tokio::test(flavor = "multi_thread")]
async fn one_endpoint_shows_what_the_process_there_sees_and_several_show_all() {
    let mut first = StandIn::open("tower").await;
    let mut second = StandIn::connected_to("tower", &[&first]).await;
    let state = |tower: &StandIn, component| tower.transition(component, FaultState::Latched, 1);
    let states = vec![state(&first, "module1/sensor/g1")];
    first.module("module1", ModulePhase::InService, &["module2"], states).await;
    let states = vec![state(&second, "module2/sensor/g1")];
    second.module("module2", ModulePhase::InService, &["module1"], states).await;
    let both = ["faults", "--mode", "peer", "--connect", &second.endpoint];
    for arguments in [&both[..1], &both] {
        let outcome = first.run(arguments);
        outcome.succeeds();
        for module in ["module1", "module2"] {
            let line = line(&outcome, &format!("{module}/sensor/g1"));
            assert!(line.contains("latched"), "{line}");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn another_structure_is_shown_unless_one_is_asked_for() {
    let tower = troubled().await;
    let mut bridge = tower.also("bridge");
    let states = vec![bridge.transition("span1/sensor/g1", FaultState::Latched, 1)];
    bridge.module("span1", ModulePhase::InService, &[], states).await;
    let both = tower.run(&["faults"]);
    assert!(both.stdout.contains("tower\n") && both.stdout.contains("bridge\n"), "{}", both.stdout);
    let one = tower.run(&["faults", "--structure", "bridge"]);
    assert!(!one.stdout.contains("module1") && one.stdout.contains("span1"), "{}", one.stdout);
}

#[tokio::test(flavor = "multi_thread")]
async fn without_any_module_it_is_not_healthy() {
    let tower = StandIn::open("tower").await;
    let none = tower.run(&["faults", "--timeout", "0.5"]);
    none.fails(4, &["no module answered", &tower.endpoint]);
    let expected = tower.run(&["faults", "--exit-code", "--timeout", "0.5", "--expect", "module1"]);
    expected.fails(4, &["no module answered"]);
    assert!(line(&expected, "module1 ").contains("NOT ANSWERING"));
}

#[tokio::test(flavor = "multi_thread")]
async fn environment_and_client_file_say_where_to_look() {
    let mut tower = StandIn::open("tower").await;
    tower.module("module1", ModulePhase::InService, &[], vec![]).await;
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("client.toml");
    let text = format!("[context.site]\nconnect = [{:?}]\nstructure = \"tower\"\n", tower.endpoint);
    std::fs::write(&file, text).unwrap();
    let with = |variable: &str, value: &std::ffi::OsStr| {
        let mut command = trusswatch();
        command.args(["faults", "--json"]).env(variable, value);
        tokio::task::block_in_place(|| outcome(&mut command))
    };
    for (variable, value) in
        [("TRUSSWATCH_CONNECT", tower.endpoint.as_ref()), ("TRUSSWATCH_CLIENT", file.as_os_str())]
    {
        let found = with(variable, value);
        assert_eq!(found.code, Some(0), "{variable}: {}", found.stderr);
        assert!(found.stdout.contains("\"module1\""), "{variable}: {}", found.stdout);
    }
}

#[test]
fn without_a_connection_it_says_where_it_looked() {
    let nowhere = nowhere();
    let outcome = run(&["faults", "--timeout", "0.5", "--connect", &nowhere]);
    outcome.fails(4, &[&nowhere, "within 500ms"]);
    run(&["faults"]).fails(2, &["--connect tcp/HOST:PORT"]);
    run(&["faults", "--connect", "here"])
        .fails(2, &["`here` is not a valid endpoint", "tcp/127.0.0.1"]);
    run(&["faults", "--connect", "tpc/127.0.0.1:7447"])
        .fails(2, &["no known protocol; use tcp, tls"]);
    run(&["faults", "--timeout", "0", "--connect", &nowhere]).fails(2, &["more than 0"]);
}
