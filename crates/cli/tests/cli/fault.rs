//! `trusswatch fault show` against a stand-in for the diagnosers.

use serde_json::Value;
use vocabulary::{
    Candidate, FaultState, FaultTransition, FreezeFrame, FrozenSignals, Identification,
    ModulePhase, RunId, Signature, SignaturePoint, Step, Topic, Trace,
};

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
    let kind = vocabulary::fault::FaultKind::Drift.into();
    let drift = Candidate { kind, probability: 0.4, size: None };
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
            "  since               2026-",
            "  onset               step 3108\n",
            "  kind                bias\n",
            "  probability         98.7 %\n",
            "  size                +45.1 µm (44.8 to 45.4)\n",
            "µm\n",
            "⠒ measured   • fitted   ● both\n",
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
async fn contenders_and_a_missing_freeze_frame_are_shown() {
    let tower = tower().await;
    let outcome = tower.run(&["fault", "show", "sensor/g4"]);
    outcome.succeeds();
    for part in ["not yet decided", "60.0 %: bias of +45.1 µm", "40.0 %: drift"] {
        assert!(outcome.stdout.contains(part), "`{part}` is not in\n{}", outcome.stdout);
    }
    // Nobody answers for this one: what its state carries is shown.
    let outcome = tower.run(&["fault", "show", "sensor/g5", "--timeout", "10"]);
    outcome.succeeds();
    for part in ["+45.1 µm", "no measurements are kept\n"] {
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
    let show = |component: &str| tower.run(&["fault", "show", component]);
    show("sensor/g6").fails(2, &["`module1/sensor/g6` or `module2/sensor/g6`; say which"]);
    show("module1/sensor/g9").fails(1, &["`module1` has no component `sensor/g9`"]);
    show("module9/sensor/g3").fails(4, &["no module `module9` was seen"]);
    show("valve/v1").fails(2, &["valve/v1"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_module_that_does_not_answer_is_reported() {
    let mut tower = tower().await;
    tower.silence("module3", Topic::Fault("sensor/g1".parse().unwrap())).await;
    tower.statuses("module3", ModulePhase::InService, &[]).await;
    tower.token("module3").await;
    let outcome = tower.run(&["fault", "show", "module3/sensor/g1", "--timeout", "10"]);
    outcome.fails(4, &["module3 does not answer; its components are unknown"]);
    let nowhere = nowhere();
    let arguments = ["fault", "show", "sensor/g1", "--timeout", "0.5", "--connect", &nowhere];
    run(&arguments).fails(4, &[&nowhere]);
}

/// Two seconds with a jump of the reading in the middle, where the fault begins.
fn frame_of(latched: &FaultTransition) -> FreezeFrame {
    let onset = latched.onset_step.unwrap();
    let steps: Vec<Step> = (onset.0 - 1000..onset.0 + 1000).map(Step).collect();
    let trace = |name: &str, unit: &str, before: Option<f64>, after: f64| Trace {
        name: name.to_owned(),
        unit: unit.to_owned(),
        values: steps.iter().map(|step| if *step < onset { before } else { Some(after) }).collect(),
    };
    FreezeFrame {
        structure: latched.structure.clone(),
        module: latched.module.clone(),
        component: latched.component.clone(),
        incarnation: latched.incarnation,
        time_unix_ns: 1_795_000_000_000_000_000,
        signals: FrozenSignals {
            sequence: latched.sequence,
            run: RunId(1),
            step_s: 1e-3,
            onset_step: onset,
            detection_step: latched.detection_step.unwrap(),
            decided_step: latched.decided_step.unwrap(),
            threshold: 0.5,
            traces: vec![
                trace("reading", "m", Some(1e-6), 46e-6),
                trace("residual", "m", Some(0.0), 45e-6),
                trace("divergence", "1", None, 50.0),
            ],
            steps,
        },
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_freeze_frame_of_the_fault_is_drawn_and_written_to_files() {
    let tower = tower().await;
    let latched = tower.transition("module1/sensor/g3", FaultState::Latched, 1);
    let frame = frame_of(&latched);
    // The newest first; the other one is of an earlier fault of the same component.
    let earlier = FrozenSignals { sequence: 0, onset_step: Step(5), ..frame.signals.clone() };
    let earlier = FreezeFrame { signals: earlier, ..frame.clone() };
    let component = "module1/sensor/g4".parse().unwrap();
    let other = FreezeFrame {
        component,
        signals: FrozenSignals { sequence: 2, ..frame.signals.clone() },
        ..frame.clone()
    };
    tower.frames("module1", vec![other, frame.clone(), earlier]).await;
    let folder = tempfile::tempdir().unwrap();
    let [svg, csv] = ["frame.svg", "frame.csv"].map(|name| folder.path().join(name));
    let [svg, csv] = [svg.to_str().unwrap(), csv.to_str().unwrap()];
    let shown = tower.run(&["fault", "show", "sensor/g3", "--svg", svg, "--csv", csv]);
    shown.succeeds();
    let detection = format!("  ┊ detection step {}\n", frame.signals.detection_step);
    for part in [
        "  freeze frame of transition 1\n",
        "  reading [µm]\n",
        "  residual [µm]\n",
        "  divergence over threshold (╌), power of ten\n",
        &detection,
    ] {
        assert!(shown.stdout.contains(part), "`{part}` is not in\n{}", shown.stdout);
    }
    assert!(!shown.stdout.contains('\x1b'), "no colours in a file");
    let drawn = std::fs::read_to_string(svg).unwrap();
    let drawn = roxmltree::Document::parse(&drawn).unwrap();
    assert_eq!(drawn.root_element().tag_name().name(), "svg");
    let texts: Vec<&str> = drawn.descendants().filter_map(|node| node.text()).collect();
    for part in ["Fault of module1/sensor/g3", "threshold", "onset", "latched"] {
        assert!(texts.iter().any(|text| text.contains(part)), "`{part}` is not in {texts:?}");
    }
    let rows = std::fs::read_to_string(csv).unwrap();
    assert!(rows.starts_with("step,since detection [s],reading [m],residual [m],divergence [1]\n"));
    assert_eq!(rows.lines().count(), 2001);
    let json = tower.run(&["fault", "show", "sensor/g3", "--json"]);
    json.succeeds();
    let document: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(document["freeze_frame"]["sequence"], 1);
    assert_eq!(document["freeze_frame"]["traces"][1]["values"][1500], 45e-6);
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_freeze_frame_it_says_why() {
    let tower = tower().await;
    let shown = tower.run(&["fault", "show", "sensor/g3"]);
    shown.succeeds();
    let why = "no freeze frame: its module does not provide one\n";
    assert!(shown.stdout.ends_with(why), "{}", shown.stdout);
    let latched = tower.transition("module1/sensor/g4", FaultState::Latched, 2);
    tower.frames("module1", vec![frame_of(&latched)]).await;
    let shown = tower.run(&["fault", "show", "sensor/g3"]);
    shown.succeeds();
    let why = "no freeze frame: frames are complete two seconds after latching";
    assert!(shown.stdout.contains(why), "{}", shown.stdout);
    let svg = ["fault", "show", "sensor/g3", "--svg", "/nowhere/frame.svg"];
    tower.run(&svg).fails(
        1,
        &["module1/sensor/g3: no freeze frame: frames are complete two seconds after latching"],
    );
    let svg = ["fault", "show", "sensor/g4", "--svg", "/nowhere/frame.svg"];
    tower.run(&svg).fails(1, &["/nowhere/frame.svg"]);
    let svg = ["fault", "show", "module1/sensor/g6", "--svg", "/nowhere/frame.svg"];
    tower.run(&svg).fails(1, &["module1/sensor/g6: no fault is declared"]);
}
