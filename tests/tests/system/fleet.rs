//! Two structures behind gateways and the router of their fleet: what crosses, and what does not.

use std::sync::Arc;
use std::time::{Duration, Instant};

use daemon::config::Schedule;
use observer::News;
use serde_json::Value;
use session::client::Live;
use system_tests::lab::{Impairment, Lab, Node};
use system_tests::scenarios;
use system_tests::security::ears::Ears;
use system_tests::security::fleet::Fleet;
use system_tests::security::letters::{answer, answers, answers_to_the_refused, hold};
use system_tests::security::table::Table;
use system_tests::{LIMIT, in_time, turn};
use vocabulary::{FaultState, fault::Fault};
use zenoh::Session;

/// From one attempt to the next.
const GLANCE: Duration = Duration::from_millis(20);
const GAGE: &str = "module1/sensor/g2";
/// The key of the fault that the tower really has.
const TRUE_FAULT: &str = "trusswatch/tower/module1/fault/sensor/g2";
/// A key of the tower that others try to use.
const VICTIM: &str = "trusswatch/tower/module1/fault/sensor/g7";
/// It and those beside it.
const FAULTS: &str = "trusswatch/tower/module1/fault/**";
/// Another one.
const SAMPLE: &str = "trusswatch/tower/module1/sample";
/// A key of the mast's own.
const OWN: &str = "trusswatch/mast/module1/fault/sensor/g7";
/// Everything there is.
const ROOT: &str = "trusswatch/";
/// What leaves a structure.
const LEAVE: [&str; 4] = ["fault", "identification", "phase", "alive"];

fn tower() -> Schedule {
    scenarios::single(GAGE, Fault::Bias { offset_m: 4e-4 })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn of_a_structure_only_faults_phases_and_presence_leave_and_orders_enter() {
    let _turn = turn::side_by_side().await;
    let mut fleet = Fleet::of(&[("tower", tower()), ("mast", Schedule::default())]).await;
    let observer = fleet.session("observer.wall").await;
    let above = Ears::of(&observer).await;
    let mut feed = Live::events(&observer, None).await.unwrap();
    let within = fleet.session_within(0, "observer.wall").await;
    let inside = Ears::of(&within).await;
    let neighbour = fleet.session_within(1, "observer.wall").await;
    let beside = Ears::of(&neighbour).await;
    linked(&above, &["tower", "mast"]).await;
    fleet.start_plants();

    let mut table = Table::default();
    hearing(&above, &inside, &beside, &mut table).await;
    following(&mut feed, &mut table).await;
    querying(&observer, &neighbour, &mut table).await;
    looking(&fleet, &mut table).await;
    commanding(&fleet, &above, &mut table).await;
    speaking_for_another(&fleet, &observer, &above, &mut table).await;
    losing_a_module(&mut fleet, &mut table).await;
    let foreign = beside.keys().iter().any(|key| !key.starts_with("trusswatch/mast/"));
    table.harmless("a client of the mast hearing anything of another structure", foreign);
    table.harmless("an observer of the fleet hearing anything else", hears_more(&above));
    judge(fleet, &table).await;
}

/// What a router of the fleet without rules can do, the gateway's refuse.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_lawless_router_of_the_fleet_can_neither_listen_to_samples_nor_speak_into_a_structure() {
    let _turn = turn::side_by_side().await;
    let mut fleet = Fleet::of(&[("tower", tower())]).await;
    fleet.lose_the_hub().await;
    let intruder = fleet.session("observer.wall").await;
    let above = Ears::of(&intruder).await;
    let within = fleet.session_within(0, "observer.wall").await;
    let inside = Ears::of(&within).await;
    linked(&above, &["tower"]).await;
    fleet.start_plants();

    let mut table = Table::default();
    let heard = above.hear(TRUE_FAULT, "\"latched\"").await;
    table.allowed("the fleet hearing a fault", heard);
    let trace = fleet.trace(&["refused Declare Subscriber", "/sample", "router.hub.fleet"]).await;
    table.forbidden("the fleet's router listening to samples", hears_more(&above), trace);

    answer(&intruder, FAULTS, VICTIM, "answered by the fleet").await;
    let words = ["refused Declare Queryable", "module1/fault", "router.hub.fleet"];
    let trace = fleet.trace(&words).await;
    let answered = hold(&answers(&within, VICTIM).await, VICTIM, "answered by the fleet");
    table.forbidden("the fleet's router answering for a module", answered, trace);

    let state =
        answers_to_the_refused(&intruder, "trusswatch/tower/module1/state?run=1;step=1").await;
    table.harmless("the fleet querying as a peer", !state.is_empty());
    let past = answers_to_the_refused(&intruder, SAMPLE).await;
    table.harmless("the fleet querying for past samples", !past.is_empty());
    for _ in 0..10 {
        intruder.put(SAMPLE, "forged by the fleet").await.unwrap();
        intruder.put(VICTIM, "forged by the fleet").await.unwrap();
    }
    let obeyed = fleet.trusswatch("operator.ada", &["ack", GAGE]).await.code == Some(0);
    table.allowed("an operator of the fleet commanding after that", obeyed);
    inside.wait(TRUE_FAULT, "\"acknowledged\"").await;
    let forged = inside.have(ROOT, "by the fleet");
    table.harmless("the fleet's router writing samples and faults", forged);
    let injection = ["inject", GAGE, "bias", "--offset-m", "1e-4"];
    let injected = fleet.trusswatch("operator.ada", &injection).await.code == Some(0);
    table.harmless("the fleet injecting a fault", injected);
    judge(fleet, &table).await;
}

/// The attempts are real: without access control in gateway and router the same ones have an effect.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_rules_samples_leave_and_what_is_forged_enters() {
    let _turn = turn::side_by_side().await;
    let mut fleet = Fleet::of(&[("tower", Schedule::default())]).await;
    fleet.lose_the_hub().await;
    fleet.members[0].lose_the_gate().await;
    let intruder = fleet.session("observer.wall").await;
    let above = Ears::of(&intruder).await;
    let within = fleet.session_within(0, "observer.wall").await;
    let inside = Ears::of(&within).await;
    linked(&above, &["tower"]).await;
    fleet.start_plants();
    for topic in ["sample", "status", "divergence", "progress"] {
        above.wait(&format!("trusswatch/tower/module1/{topic}"), "").await;
    }
    let forged = async {
        while !inside.have(VICTIM, "forged") {
            intruder.put(VICTIM, "forged by the fleet").await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    in_time("a forged fault", forged).await;
    fleet.clear().await;
}

/// The gateways of these structures have found the fleet's router.
async fn linked(above: &Ears, structures: &[&str]) {
    for structure in structures {
        for module in ["module1", "module2"] {
            above.wait(&format!("trusswatch/{structure}/{module}/alive"), "").await;
        }
    }
}

/// Than what may leave a structure.
fn hears_more(ears: &Ears) -> bool {
    let topic = |key: &String| key.split('/').nth(3).unwrap_or_default().to_owned();
    ears.keys().iter().any(|key| !LEAVE.contains(&topic(key).as_str()))
}

async fn hearing(above: &Ears, inside: &Ears, beside: &Ears, table: &mut Table) {
    let heard =
        inside.hear(SAMPLE, "").await && inside.hear("trusswatch/tower/module1/status", "").await;
    table.allowed("a client in the tower hearing samples and statuses", heard);
    let heard = beside.hear("trusswatch/mast/module1/sample", "").await;
    table.allowed("a client in the mast hearing samples", heard);
    let heard = above.hear(TRUE_FAULT, "\"latched\"").await;
    table.allowed("an observer of the fleet hearing a fault of the tower", heard);
    let heard = above.hear("trusswatch/tower/module1/identification/", "bias").await;
    table.allowed("an observer of the fleet hearing what kind of fault it is", heard);
    let mut heard = true;
    for structure in ["tower", "mast"] {
        for module in ["module1", "module2"] {
            let key = |topic: &str| format!("trusswatch/{structure}/{module}/{topic}");
            heard &= above.hear(&key("phase"), "\"in_service\"").await;
            heard &= above.hear(&key("alive"), "").await;
        }
    }
    table.allowed("an observer of the fleet hearing phases and presence of both", heard);
}

/// What `follow` prints.
async fn following(feed: &mut Live, table: &mut Table) {
    let latched = async {
        loop {
            match &feed.next_event().await.unwrap().news {
                News::Fault(fault) | News::Present(fault)
                    if fault.state() == FaultState::Latched =>
                {
                    return;
                }
                _ => {}
            }
        }
    };
    let shown = tokio::time::timeout(LIMIT, latched).await.is_ok();
    table.allowed("`follow` at the fleet showing the fault", shown);
}

async fn querying(observer: &Session, neighbour: &Session, table: &mut Table) {
    let states = answers(observer, "trusswatch/*/*/fault/**").await;
    let of = |structure: &str| states.iter().any(|(key, _)| key.contains(structure));
    table.allowed(
        "an observer of the fleet querying for present states",
        of("/tower/") && of("/mast/"),
    );
    let mut states = Vec::new();
    let of = |states: &[(String, String)], structure| {
        states.iter().any(|(key, _)| key.contains(structure))
    };
    let answered = async {
        while !of(&states, "/mast/") {
            states.extend(answers_to_the_refused(neighbour, "trusswatch/*/*/fault/**").await);
        }
    };
    let answered = tokio::time::timeout(LIMIT, answered).await.is_ok();
    table.allowed("a client of the mast querying for its states", answered);
    table.harmless("a client of the mast querying for the tower's", of(&states, "/tower/"));
    let named = answers_to_the_refused(neighbour, TRUE_FAULT).await;
    table.harmless("a client of the mast querying for one of the tower's", !named.is_empty());
}

async fn picture(fleet: &Fleet, words: &[&str]) -> Value {
    let ended = fleet.trusswatch("observer.wall", &[&["faults", "--json"], words].concat()).await;
    assert_eq!(ended.code, Some(0), "{ended:?}");
    ended.json()
}

async fn looking(fleet: &Fleet, table: &mut Table) {
    let start = Instant::now();
    let picture = picture(fleet, &[]).await;
    println!("the picture of the fleet took {:?}", start.elapsed());
    let modules = picture["modules"].as_array().unwrap();
    let answer = modules.iter().filter(|module| module["answers"] == true).count();
    let all = modules.len() == 4 && answer == 4;
    table.allowed("`faults` at the fleet showing all modules of both", all);
    let components = picture["components"].as_array().unwrap();
    let latched =
        components.iter().any(|one| one["component"] == GAGE && one["state"] == "latched");
    table.allowed("`faults` at the fleet showing the fault", latched);
    // No status names them: what is not expected is not waited for.
    let words = ["faults", "--structure", "mast", "--exit-code"];
    let well = fleet.trusswatch("observer.wall", &words).await.code == Some(0);
    table.harmless("a module that might be overlooked passing for well", well);
    let words = [&words[..], &["--expect", "module1,module2"]].concat();
    let well = fleet.trusswatch("observer.wall", &words).await.code == Some(0);
    table.allowed("`faults` at the fleet finding the mast well, all modules expected", well);
}

async fn commanding(fleet: &Fleet, above: &Ears, table: &mut Table) {
    let order = ["ack", GAGE, "--structure", "tower"];
    let ended = fleet.trusswatch("observer.wall", &[&order[..], &["--by", "eve"]].concat()).await;
    let words = ["refused Query", "tower/module1/command/acknowledge", "observer.wall.fleet"];
    let trace = fleet.trace(&words).await;
    let obeyed = ended.code == Some(0) || above.have(TRUE_FAULT, "\"acknowledged\"");
    table.forbidden("an observer of the fleet commanding", obeyed, trace);
    let ended = fleet.trusswatch("operator.ada", &order).await;
    above.wait(TRUE_FAULT, "\"acknowledged\"").await;
    table.allowed("an operator of the fleet commanding", ended.code == Some(0));
    let words = ["inject", GAGE, "bias", "--offset-m", "1e-4", "--structure", "tower"];
    let injected = fleet.trusswatch("operator.ada", &words).await.code == Some(0);
    let words = ["refused Query", "plant/command/inject", "operator.ada.fleet"];
    let trace = fleet.trace(&words).await;
    table.forbidden("an operator of the fleet injecting a fault", injected, trace);
    let history = fleet.trusswatch("observer.wall", &["history", "--json"]).await;
    let named = history.code == Some(0) && history.out.replace(' ', "").contains(r#""by":"ada""#);
    table.allowed("`history` at the fleet naming the operator", named);
}

/// Whoever has the key of the mast's gateway may speak for the mast, and for nobody else.
async fn speaking_for_another(fleet: &Fleet, observer: &Session, above: &Ears, table: &mut Table) {
    let gateway = fleet.session("router.mast").await;
    let passed_on = async {
        while !above.have(OWN, "passed on by the mast") {
            gateway.put(VICTIM, "forged by the mast").await.unwrap();
            gateway.put(OWN, "passed on by the mast").await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    let heard = tokio::time::timeout(LIMIT, passed_on).await.is_ok();
    table.allowed("a gateway speaking for its structure", heard);
    let trace = fleet.trace(&["refused Put", VICTIM, "router.mast.fleet"]).await;
    let forged = above.have(VICTIM, "forged");
    table.forbidden("a gateway speaking for another structure", forged, trace);

    answer(&gateway, FAULTS, VICTIM, "answered by the mast").await;
    let words = ["refused Declare Queryable", "tower/module1/fault", "router.mast.fleet"];
    let trace = fleet.trace(&words).await;
    let answered = hold(&answers(observer, VICTIM).await, VICTIM, "answered by the mast");
    table.forbidden("a gateway answering for another structure", answered, trace);

    gateway.put("trusswatch/mast/module1/sample", "a sample").await.unwrap();
    let words = ["refused Put", "mast/module1/sample", "router.mast.fleet"];
    let trace = fleet.trace(&words).await;
    let heard = above.have("trusswatch/mast/module1/sample", "");
    table.forbidden("a gateway passing on samples", heard, trace);
}

/// No status names a module that is down: who counts on it names it.
async fn losing_a_module(fleet: &mut Fleet, table: &mut Table) {
    fleet.members[1].lose_a_module().await;
    // No answer is to come from one of them.
    let words = ["--structure", "mast", "--expect", "module1,module2", "--timeout", "3"];
    let missing = async {
        loop {
            let picture = picture(fleet, &words).await;
            let modules = picture["modules"].as_array().unwrap();
            let of = |name: &str| modules.iter().find(|module| module["module"] == name).unwrap();
            if of("module2")["answers"] == false && of("module1")["answers"] == true {
                return;
            }
        }
    };
    let missed = tokio::time::timeout(LIMIT, missing).await.is_ok();
    table.allowed("an expected module that is down being missed at the fleet", missed);
}

async fn judge(fleet: Fleet, table: &Table) {
    println!("{}", table.to_text());
    let (failed, logs) = (table.failed(), fleet.logs());
    assert!(failed.is_empty(), "{failed:?}\n{logs}");
    fleet.clear().await;
}

/// The lease of the gateway's link and of the fleet's.
const LEASE_MS: u32 = 5000;
/// How long the link has to hold.
const HELD: Duration = Duration::from_secs(20);
/// Of the tower.
const COMPONENTS: usize = 24;

/// Between gateway and fleet 80 ms each way, one frame in a hundred lost.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs a laboratory: network namespaces, as root"]
async fn a_long_and_lossy_link_carries_faults_and_orders_and_is_not_dropped() {
    let _turn = turn::alone().await;
    let lab = Arc::new(Lab::required(41));
    let way = Duration::from_millis(80);
    let far = Impairment { loss: 0.01, ..Impairment::delay(way, Duration::from_millis(10)) };
    lab.impair_between(Node::Module1, Node::Observer, far);
    let mut fleet = Fleet::afar("tower", tower(), &lab, LEASE_MS).await;
    let observer = fleet.session("observer.wall").await;
    let above = Ears::of(&observer).await;
    linked(&above, &["tower"]).await;
    fleet.start_plants();
    above.wait(TRUE_FAULT, "\"latched\"").await;
    let late = above.lateness(TRUE_FAULT).unwrap();
    println!("a fault is known at the fleet {late:?} after its module published it");
    let start = Instant::now();
    let ended = fleet.trusswatch("operator.ada", &["ack", GAGE, "--timeout", "10"]).await;
    println!("an order from there took {:?}", start.elapsed());
    assert_eq!(ended.code, Some(0), "{ended:?}\n{}", fleet.logs());
    let start = Instant::now();
    picture(&fleet, &["--timeout", "10"]).await;
    println!("the picture from there took {:?}", start.elapsed());
    tokio::select! {
        () = above.loss() => panic!("the link was dropped\n{}", fleet.logs()),
        () = querying_for(HELD, &observer) => {}
    }
    for (from, to) in [(Node::Module1, Node::Observer), (Node::Observer, Node::Module1)] {
        let frames = lab.tally(from, to);
        println!("frames from {from:?} to {to:?}: {frames:?}");
        assert!(frames.lost > 0, "{frames:?}");
    }
    assert!(late < Duration::from_secs(3), "{late:?}");
    lab.impair_between(Node::Module1, Node::Observer, Impairment::cut());
    in_time("the end of a link that is cut", above.loss()).await;
    fleet.clear().await;
}

/// Asks for present states again and again.
async fn querying_for(span: Duration, session: &Session) {
    let (start, mut answered) = (Instant::now(), Vec::new());
    while start.elapsed() < span {
        let asked = Instant::now();
        let states = answers(session, "trusswatch/tower/*/fault/**").await;
        assert_eq!(states.len(), COMPONENTS, "{states:?}");
        answered.push(asked.elapsed());
    }
    answered.sort();
    let (most, count) = (answered.last(), answered.len());
    println!("{count} queries for present states, median {:?}, most {most:?}", answered[count / 2]);
}
