//! What cannot be read is shown as unknown and never passes for healthy.

use serde_json::{Value, json};
use vocabulary::{FaultState, ModulePhase, Topic};

use crate::stand_in::StandIn;

const GAGE: &str = "module1/sensor/g1";

/// A module in service whose only component answers with one word replaced.
async fn with_word(place: &str, word: &str) -> StandIn {
    let mut tower = StandIn::open("tower").await;
    let transition = tower.transition(GAGE, FaultState::Normal, 6);
    let mut text: Value =
        serde_json::from_slice(&vocabulary::encode(&transition).unwrap()).unwrap();
    text["condition"] =
        json!({"agreement": "agrees", "from_step": 3712, "as_of_step": 4711, "reason": null});
    *text.pointer_mut(place).unwrap() = word.into();
    tower.text("module1", Topic::Fault("sensor/g1".parse().unwrap()), text.to_string()).await;
    tower.statuses("module1", ModulePhase::InService, &[]).await;
    tower.token("module1").await;
    tower
}

#[tokio::test(flavor = "multi_thread")]
async fn a_state_that_cannot_be_read_is_unknown_and_not_well() {
    let tower = with_word("/state", "normal").await;
    assert_eq!(tower.run(&["faults", "--exit-code"]).code, Some(0));
    for place in ["/state", "/symptom", "/condition/agreement"] {
        let tower = with_word(place, "an_unknown_word").await;
        let checked = tower.run(&["faults", "--exit-code"]);
        assert_eq!(checked.code, Some(1), "{}", checked.stdout);
        for part in ["0 of 1 components are normal, 1 unknown", "its state cannot be read"] {
            assert!(checked.stdout.contains(part), "`{part}` is not in\n{}", checked.stdout);
        }
        let document: Value =
            serde_json::from_str(&tower.run(&["faults", "--json"]).stdout).unwrap();
        let found = (&document["all_is_well"], &document["modules"][0]["normal"]);
        assert_eq!(found, (&Value::from(false), &Value::from(0)));
        assert_eq!(document["components"][0]["state"], "unknown");
    }
}
