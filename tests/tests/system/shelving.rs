//! Alarms that are set aside, with the operator's own program: a fault is found underneath, survives a kill, and counts
//! again by itself; a module is suppressed while no sample comes.

use daemon::config::Schedule;
use serde_json::Value;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::observer::{Faults, Observer};
use system_tests::operate::{Ended, trusswatch};
use system_tests::{in_time, scenarios, turn};
use vocabulary::{FaultState, FaultTransition, GivenOrderKind, RunId, fault::Fault};

const RUN: RunId = RunId(1);
const SEED: u64 = 11;
const CYLINDER: &str = "module1/actuator/a1";
const BY: [&str; 4] = ["--by", "ada", "--reason", "its seal is on order"];
/// More than the test takes.
const FOR_LONG: u64 = 1_000_000;

async fn check(deployment: &Deployment) -> Ended {
    trusswatch(deployment, &["faults", "--exit-code", "--json"]).await
}

/// Until a check ends with this exit code.
async fn check_until(deployment: &Deployment, code: i32) -> Value {
    let ended = async {
        loop {
            let ended = check(deployment).await;
            if ended.code == Some(code) {
                return ended.json();
            }
        }
    };
    in_time(&format!("a check with exit code {code}"), ended).await
}

async fn obeyed(deployment: &Deployment, words: &[&str]) {
    let ended = trusswatch(deployment, words).await;
    assert_eq!(ended.code, Some(0), "{ended:?}");
}

async fn shelve(deployment: &Deployment, time: &str) {
    obeyed(deployment, &[&["fault", "shelve", CYLINDER, "--for", time][..], &BY].concat()).await;
}

fn shown<'a>(picture: &'a Value, component: &str) -> &'a Value {
    let components = picture["components"].as_array().unwrap();
    components.iter().find(|shown| shown["component"] == component).unwrap()
}

async fn find(
    faults: &mut Faults,
    what: &str,
    wanted: impl Fn(&FaultTransition) -> bool,
) -> FaultTransition {
    faults.find(what, |_, transition| wanted(&transition).then_some(transition)).await
}

fn is_cylinder(transition: &FaultTransition) -> bool {
    transition.component.to_string() == CYLINDER
}

/// What the cylinder explains in the other module.
fn is_effect(transition: &FaultTransition) -> bool {
    let root = transition.verdict.explained_by().map(ToString::to_string);
    transition.module.as_str() == "module2" && root.as_deref() == Some(CYLINDER)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_shelved_fault_is_found_explains_others_survives_a_kill_and_counts_again_by_itself() {
    let _turn = turn::side_by_side().await;
    let fault = Fault::HardOver {};
    let deployment = Deployment::of_watched_tower(&scenarios::single(CYLINDER, fault));
    let observer = Observer::of(&deployment).await;
    let mut faults = observer.faults().await;
    let mut diagnosers = deployment.start_diagnosers();
    observer.wait_for(&MODULES, false).await;
    shelve(&deployment, "1h").await;
    let plant = deployment.start_plant("real", FOR_LONG, SEED, RUN);
    let (mut found, mut explains) = (None, false);
    let both = |_: u64, one: FaultTransition| {
        explains |= is_effect(&one);
        if is_cylinder(&one) && one.state() == FaultState::Latched {
            found = Some(one);
        }
        found.clone().filter(|_| explains)
    };
    let found = faults.find("the fault, latched, and an effect in the other module", both).await;
    let shelved = found.shelved.unwrap();
    assert_eq!((shelved.by.as_str(), shelved.reason.as_str()), ("ada", "its seal is on order"));
    let picture = check_until(&deployment, 0).await;
    assert_eq!(shown(&picture, CYLINDER)["state"], "latched", "{picture:#}");

    diagnosers[0].crash().await;
    observer.wait_until_gone("module1").await;
    assert_eq!(check(&deployment).await.code, Some(1), "a silent module counts");
    diagnosers[0] = deployment.start_diagnoser(0);
    observer.wait_for(&MODULES, false).await;
    let picture = check_until(&deployment, 0).await;
    let after = shown(&picture, CYLINDER);
    assert_eq!((&after["state"], &after["shelved"]["by"]), (&"latched".into(), &"ada".into()));

    shelve(&deployment, "3s").await;
    let is_lapse = |one: &FaultTransition| {
        one.order.as_ref().is_some_and(|order| matches!(order.kind, GivenOrderKind::Lapse { .. }))
    };
    let lapse = find(&mut faults, "its end by itself", is_lapse).await;
    assert!(is_cylinder(&lapse) && lapse.shelved.is_none() && lapse.durable, "{lapse:?}");
    assert_eq!(lapse.state(), FaultState::Latched);
    check_until(&deployment, 1).await;
    let history = trusswatch(&deployment, &["history", "--json"]).await.json();
    assert_eq!(history["gaps"], Value::Array(vec![]), "{history:#}");
    let transitions = history["transitions"].as_array().unwrap();
    let own = transitions.iter().filter(|item| item["component"] == CYLINDER);
    let orders: Vec<&Value> =
        own.filter(|item| !item["order"].is_null()).map(|item| &item["order"]["order"]).collect();
    assert_eq!(orders, ["shelve", "shelve", "lapse"], "{history:#}");
    plant.stop().await;
    for process in diagnosers {
        process.stop().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_suppressed_module_without_samples_does_not_count_and_a_silent_one_does() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_watched_tower(&Schedule::default());
    let observer = Observer::of(&deployment).await;
    let mut diagnosers = deployment.start_diagnosers();
    observer.wait_for(&MODULES, false).await;
    check_until(&deployment, 1).await;
    for module in MODULES {
        let suppress = ["fault", "suppress", module, "--for", "1h"];
        obeyed(&deployment, &[&suppress[..], &BY].concat()).await;
    }
    let picture = check_until(&deployment, 0).await;
    let phases: Vec<&Value> =
        picture["modules"].as_array().unwrap().iter().map(|module| &module["phase"]).collect();
    assert_eq!(phases, ["waiting", "waiting"], "{picture:#}");
    assert_eq!(picture["structures"][0]["set_aside"], 24, "{picture:#}");
    obeyed(&deployment, &["fault", "unsuppress", "module1", "--by", "ada"]).await;
    check_until(&deployment, 1).await;
    obeyed(&deployment, &[&["fault", "suppress", "module1", "--for", "1h"][..], &BY].concat())
        .await;
    check_until(&deployment, 0).await;
    diagnosers[1].crash().await;
    observer.wait_until_gone("module2").await;
    assert_eq!(check(&deployment).await.code, Some(1), "nobody knows of its components");
    for process in diagnosers.drain(..1) {
        process.stop().await;
    }
}
