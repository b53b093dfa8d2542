//! `trusswatch stroke` against a stand-in for the plant.

use serde_json::{Value, json};
use vocabulary::Stroke;

use crate::binary::run;
use crate::stand_in::StandIn;

const STROKE: [&str; 2] = ["stroke", "module1/actuator/a3"];

#[tokio::test(flavor = "multi_thread")]
async fn a_stroke_arrives_as_it_was_ordered_or_with_its_usual_size() {
    let mut tower = StandIn::open("tower").await;
    let taken = tower.plant_with_strokes().await;
    let outcome = tower.run(&STROKE);
    outcome.succeeds();
    let line = "module1/actuator/a3: stroke of ±50 kN from step 4711 to step 16710\n";
    assert_eq!(outcome.stdout, line);
    let sizes = ["--force-n", "2.5e3", "--duration-s", "30", "--largest-strain", "1e-4", "--json"];
    let outcome = tower.run(&[&STROKE[..], &sizes].concat());
    outcome.succeeds();
    let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let expected = json!({
        "v": 1, "structure": "tower", "component": "module1/actuator/a3",
        "force_n": 2500.0, "duration_s": 30.0, "largest_strain": 1e-4,
        "first_step": 4711, "last_step": 34710,
    });
    assert_eq!(document, expected);
    let stroke = |force_n, duration_s, largest_strain| Stroke {
        component: "module1/actuator/a3".parse().unwrap(),
        force_n,
        duration_s,
        largest_strain,
    };
    let expected = [stroke(50e3, 12.0, 2e-4), stroke(2500.0, 30.0, 1e-4)];
    assert_eq!(*taken.lock().unwrap(), expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refusal_and_a_plant_that_is_not_there_are_distinguished() {
    let mut tower = StandIn::open("tower").await;
    tower.token("module1").await;
    let stroke = ["stroke", "module1/actuator/a9"];
    let briefly = [&stroke[..], &["--timeout", "1"]].concat();
    tower.run(&briefly).fails(4, &["no plant was there", "no command was sent"]);
    tower.plant_with_strokes().await;
    tower.run(&stroke).fails(1, &["module1/actuator/a9: refused: there is no"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plant_that_takes_no_strokes_gives_no_answer() {
    let mut tower = StandIn::open("tower").await;
    tower.plant().await;
    let stroke = [&STROKE[..], &["--timeout", "5"]].concat();
    tower.run(&stroke).fails(4, &["module1/actuator/a3: no answer", "may or may not"]);
}

#[test]
fn what_cannot_be_meant_is_not_sent() {
    let stroke = |arguments: &[&str]| {
        let connect = ["--connect", "tcp/127.0.0.1:1"];
        run(&[&["stroke"], arguments, &connect].concat())
    };
    stroke(&[]).fails(2, &["COMPONENT"]);
    stroke(&["m/sensor/g"]).fails(2, &["`m/sensor/g` is a sensor; only an actuator"]);
    for size in ["--force-n", "--duration-s", "--largest-strain"] {
        for value in ["0", "-5", "NaN", "inf", "much"] {
            stroke(&["m/actuator/a", size, value]).fails(2, &[size, value, "above 0"]);
        }
    }
}

#[test]
fn the_help_says_who_takes_it_and_has_an_example() {
    let help = run(&["stroke", "--help"]);
    help.succeeds();
    for text in ["Only the simulated plant", "trusswatch stroke module1/actuator/a3", "50000"] {
        assert!(help.stdout.contains(text), "{text} is not in {}", help.stdout);
    }
}
