//! A secured structure is upgraded: modules first, then the access rules with the router. Commands of operators have had
//! keys of their own since: at which stage which command line is obeyed, and what is said where none can be.

use std::time::Duration;

use names::fault::Fault;
use serde_json::Value;
use system_tests::binaries::Version;
use system_tests::security::stand::Stand;
use system_tests::{in_time, scenarios, turn};

const FAULTY: &str = "module1/sensor/g2";
const HEALTHY: [&str; 2] = ["module1/sensor/g7", "module2/sensor/g7"];
const VERSIONS: [Version; 2] = [Version::Former, Version::Present];
/// From one look to the next.
const GLANCE: Duration = Duration::from_millis(100);

/// The state and the sequence number of the faulty component, once both modules are there and it has this state.
async fn found(stand: &Stand, state: &str) -> Value {
    let looking = async {
        loop {
            let ended = stand.trusswatch("observer.wall", &["faults", "--all", "--json"]).await;
            let picture: Value = serde_json::from_str(&ended.out).unwrap_or_default();
            let components = picture["components"].as_array().cloned().unwrap_or_default();
            let shown = components.iter().find(|shown| shown["component"] == FAULTY);
            let shown = shown.filter(|shown| shown["state"] == state && components.len() == 24);
            if let Some(shown) = shown {
                assert_eq!(picture["problems"], Value::Array(vec![]), "{picture:#}");
                return shown["sequence"].clone();
            }
            tokio::time::sleep(GLANCE).await;
        }
    };
    in_time(&format!("{FAULTY} {state}"), looking).await
}

/// Whether each module takes a command of this version: one that it refuses, for nothing is wrong.
async fn takes(stand: &Stand, version: Version) -> [bool; 2] {
    let mut taken = [false; 2];
    for (taken, component) in taken.iter_mut().zip(HEALTHY) {
        let words = ["ack", component, "--by", "ada", "--timeout", "5"];
        let ended = stand.trusswatch_of(version, "operator.ada", &words).await;
        *taken = ended.code == Some(1) && ended.err.contains("only a latched fault");
        assert!(*taken || ended.code == Some(4), "{ended:?}");
        let says_why = ended.err.contains("the access rules are not: upgrade it");
        assert!(*taken || version == Version::Former || says_why, "{ended:?}");
    }
    taken
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs programs of a former version: see .ci/upgrade"]
async fn modules_first_and_then_rules_leave_no_stage_without_commands() {
    let _turn = turn::side_by_side().await;
    let schedule = scenarios::single(FAULTY, Fault::Bias { offset_m: 4e-4 });
    let mut stand = Stand::former_star(&schedule).await;
    let sequence = found(&stand, "latched").await;
    for module in [None, Some(0), Some(1)] {
        if let Some(module) = module {
            stand.upgrade_diagnoser(module).await;
        }
        assert_eq!(found(&stand, "latched").await, sequence);
        for version in VERSIONS {
            assert_eq!(takes(&stand, version).await, [true; 2], "{version:?} after {module:?}");
        }
    }
    stand.upgrade_rules().await;
    assert_eq!(found(&stand, "latched").await, sequence);
    assert_eq!(takes(&stand, Version::Present).await, [true; 2]);
    assert_eq!(takes(&stand, Version::Former).await, [false; 2]);
    let ended = stand.trusswatch("operator.ada", &["ack", FAULTY]).await;
    assert_eq!(ended.code, Some(0), "{ended:?}");
    found(&stand, "acknowledged").await;
    stand.clear().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs programs of a former version: see .ci/upgrade"]
async fn rules_before_modules_leave_them_without_commands_and_that_is_said() {
    let _turn = turn::side_by_side().await;
    let schedule = scenarios::single(FAULTY, Fault::Bias { offset_m: 4e-4 });
    let mut stand = Stand::former_star(&schedule).await;
    found(&stand, "latched").await;
    stand.upgrade_rules().await;
    found(&stand, "latched").await;
    assert_eq!(takes(&stand, Version::Present).await, [false; 2]);
    stand.upgrade_diagnoser(0).await;
    found(&stand, "latched").await;
    assert_eq!(takes(&stand, Version::Present).await, [true, false]);
    stand.clear().await;
}
