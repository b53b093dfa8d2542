//! `trusswatch inject` against a stand-in for the plant.

use serde_json::Value;
use vocabulary::{Injection, Step, fault::Fault};

use crate::binary::run;
use crate::stand_in::StandIn;

fn injection(component: &str, fault: Option<Fault>, at_step: Option<u64>) -> Injection {
    Injection { component: component.parse().unwrap(), fault, at_step: at_step.map(Step) }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fault_arrives_as_it_was_given_and_so_does_a_repair() {
    let mut tower = StandIn::open("tower").await;
    let taken = tower.plant().await;
    let outcome = tower.run(&["inject", "module1/sensor/g2", "bias", "--offset-m", "-6e-4"]);
    outcome.succeeds();
    assert_eq!(outcome.stdout, "module1/sensor/g2: bias from step 4711 on\n");
    let outcome =
        tower.run(&["inject", "module1/sensor/g2", "--repair", "--at-step", "9000", "--json"]);
    outcome.succeeds();
    let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!((&document["effective_step"], &document["v"]), (&9000.into(), &1.into()));
    assert_eq!((&document["fault"], &document["structure"]), (&Value::Null, &"tower".into()));
    let contact = ["--offset-m", "5e-5", "--closed-s", "0.5", "--open-s", "0.02"];
    tower
        .run(&[&["inject", "module1/sensor/g5", "intermittent"], &contact[..]].concat())
        .succeeds();
    let stiction = ["inject", "module1/actuator/a1", "stiction", "--band-m3-per-s", "1e-5"];
    tower.run(&stiction).succeeds();
    let contact = Fault::Intermittent { offset_m: 5e-5, closed_s: 0.5, open_s: 0.02 };
    let stiction = Fault::Stiction { band_m3_per_s: 1e-5 };
    let expected = [
        injection("module1/sensor/g2", Some(Fault::Bias { offset_m: -6e-4 }), None),
        injection("module1/sensor/g2", None, Some(9000)),
        injection("module1/sensor/g5", Some(contact), None),
        injection("module1/actuator/a1", Some(stiction), None),
    ];
    assert_eq!(*taken.lock().unwrap(), expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refusal_and_a_plant_that_is_not_there_are_distinguished() {
    let mut tower = StandIn::open("tower").await;
    tower.token("module1").await;
    let inject = ["inject", "module1/sensor/g9", "zero_output"];
    let briefly = [&inject[..], &["--timeout", "1"]].concat();
    tower.run(&briefly).fails(4, &["no plant was there", "no command was sent"]);
    tower.plant().await;
    tower.run(&inject).fails(1, &["module1/sensor/g9: refused: there is no"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plant_of_several_is_not_guessed_at() {
    let mut tower = StandIn::open("tower").await;
    let mut bridge = tower.also("bridge");
    let (of_tower, of_bridge) = (tower.plant().await, bridge.plant().await);
    let inject = ["inject", "module1/actuator/a1", "hard_over"];
    tower.run(&inject).fails(2, &["`bridge` and `tower`", "--structure"]);
    tower.run(&[&inject[..], &["--structure", "bridge"]].concat()).succeeds();
    let taken = [of_tower, of_bridge].map(|taken| taken.lock().unwrap().len());
    assert_eq!(taken, [0, 1]);
}

#[test]
fn what_cannot_be_meant_is_not_sent() {
    let inject = |arguments: &[&str]| {
        let connect = ["--connect", "tcp/127.0.0.1:1"];
        run(&[&["inject"], arguments, &connect].concat())
    };
    inject(&["m/sensor/g"]).fails(2, &["FAULT"]);
    inject(&["m/sensor/g", "biass"]).fails(2, &["biass", "bias"]);
    inject(&["m/sensor/g", "bias"]).fails(2, &["`bias` needs --offset-m"]);
    inject(&["m/sensor/g", "bias", "--offset-m", "7"]).fails(2, &["offset_m", "±1 m"]);
    inject(&["m/sensor/g", "gain", "--gain", "0"]).fails(2, &["`gain`", "`zero_output`"]);
    inject(&["m/sensor/g", "stuck", "--gain", "1"]).fails(2, &["takes no --gain"]);
    inject(&["m/sensor/g", "zero_output", "--area-m2", "1e-7"]).fails(2, &["takes no --area-m2"]);
    inject(&["m/sensor/g", "hard_over"]).fails(2, &["m/sensor/g", "hard_over", "actuator"]);
    inject(&["m/sensor/g", "zero_output", "--repair"]).fails(2, &["--repair"]);
}
