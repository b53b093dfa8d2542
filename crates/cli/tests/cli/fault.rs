//! `trusswatch fault show` against a stand-in for the diagnosers.

use names::Step;
use serde_json::Value;
use wire::{Candidate, FaultState, FaultTransition, Identification, ModulePhase, Signature};
use wire::{SignaturePoint, Topic};

use crate::binary::run;
use crate::stand_in::{StandIn, bias, identification, nowhere};

fn signature() -> Signature {
    let point = |step: u64| {
        let fitted = if step < 3108 { 0.0 } else { 45.1e-6 };
        SignaturePoint { step: Step(step), measured: fitted + 2e-7, fitted }
    };
    Signature { unit: "m".to_owned(), points: (3050..3170).map(point).collect() }
}

/// Two modules with gages of the same names. The first has a fault that is identified, one that is not decided, and one
/// of which its state alone tells something; the second has none.
async fn tower() -> StandIn {
    let mut tower = StandIn::open("tower").await;
    let latched = |component, sequence| tower.transition(component, FaultState::Latched, sequence);
    let (first, second) = (latched("module1/sensor/g3", 1), latched("module1/sensor/g4", 2));
    let third = latched("module1/sensor/g5", 3);
    let decided = identification(&first, true, vec![bias(0.987)]);
    let drift = Candidate { kind: "drift".to_owned(), probability: 0.4, size: None };
    let undecided = identification(&second, false, vec![bias(0.6), drift]);
    let carried = Some(Box::new(identification(&third, true, vec![bias(0.99)])));
    let states = vec![
        FaultTransition { identification: Some(Box::new(decided.clone())), ..first },
        second,
        FaultTransition { identification: carried, ..third },
        tower.transition("module1/sensor/g6", FaultState::Normal, 0),
    ];
    tower.identified(Identification { signature: Some(signature()), ..decided }).await;
    tower.identified(undecided).await;
    let normal = vec![tower.transition("module2/sensor/g6", FaultState::Normal, 0)];
    tower.module("module1", ModulePhase::InService, &["module2"], states).await;
    tower.module("module2", ModulePhase::InService, &["module1"], normal).await;
    tower
}

#[tokio::test(flavor = "multi_thread")]
async fn kind_size_and_what_was_measured_are_shown_by_path_and_by_name() {
    let tower = tower().await;
    for component in ["module1/sensor/g3", "sensor/g3"] {
        let outcome = tower.run(&["fault", "show", component]);
        outcome.succeeds();
        for part in [
            "  module1/sensor/g3   of tower\n",
            "  state               latched\n",
            "  since               step 3108, published 2026-",
            "  kind                bias\n",
            "  probability         98.7 %\n",
            "  size                +45.1 µm (44.8 to 45.4)\n",
            "µm\n",
            "⠒ measured   ─ fitted   ━ both\n",
            "step 3050",
        ] {
            let text: Vec<&str> = outcome.stdout.lines().map(str::trim_end).collect();
            let text = text.join("\n") + "\n";
            assert!(text.contains(part), "`{part}` is not in\n{text}");
        }
        assert!(!outcome.stdout.contains('\x1b'), "no colours in a file");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn contenders_are_shown_and_that_nothing_measured_is_kept() {
    let tower = tower().await;
    let outcome = tower.run(&["fault", "show", "sensor/g4"]);
    outcome.succeeds();
    for part in ["not yet decided", "60.0 %: bias of +45.1 µm", "40.0 %: drift"] {
        assert!(outcome.stdout.contains(part), "`{part}` is not in\n{}", outcome.stdout);
    }
    // Nobody answers for this one: what its state carries is shown.
    let outcome = tower.run(&["fault", "show", "sensor/g5", "--timeout", "2"]);
    outcome.succeeds();
    for part in ["+45.1 µm", "nothing measured is kept any more\n"] {
        assert!(outcome.stdout.contains(part), "`{part}` is not in\n{}", outcome.stdout);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn json_has_the_state_with_the_identification_and_its_signature() {
    let outcome = tower().await.run(&["fault", "show", "module1/sensor/g3", "--json"]);
    outcome.succeeds();
    let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!((&document["v"], &document["state"]), (&Value::from(1), &Value::from("latched")));
    let identification = &document["identification"];
    assert_eq!(identification["candidates"][0]["kind"], "bias");
    assert_eq!(identification["signature"]["points"].as_array().unwrap().len(), 120);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_component_without_a_fault_has_none_and_what_is_unclear_is_not_guessed_at() {
    let tower = tower().await;
    let outcome = tower.run(&["fault", "show", "module1/sensor/g6"]);
    outcome.succeeds();
    let expected = "module1/sensor/g6 of tower, no fault declared: normal, not verified\n";
    assert_eq!(outcome.stdout, expected);
    let show = |component: &str| tower.run(&["fault", "show", component, "--timeout", "1"]);
    show("sensor/g6").fails(2, &["`module1/sensor/g6` or `module2/sensor/g6`; say which"]);
    show("module1/sensor/g9").fails(1, &["`module1` has no component `sensor/g9`"]);
    show("module9/sensor/g3").fails(4, &["`module9` is not there"]);
    show("valve/v1").fails(2, &["valve/v1"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_module_that_does_not_answer_is_told() {
    let mut tower = tower().await;
    tower.silence("module3", Topic::Fault("sensor/g1".parse().unwrap())).await;
    tower.statuses("module3", ModulePhase::InService, &[]).await;
    tower.token("module3").await;
    let outcome = tower.run(&["fault", "show", "module3/sensor/g1", "--timeout", "1"]);
    outcome.fails(4, &["module3 does not answer; nothing is known of its components"]);
    let nowhere = nowhere();
    let arguments = ["fault", "show", "sensor/g1", "--timeout", "0.5", "--connect", &nowhere];
    run(&arguments).fails(4, &[&nowhere]);
}
