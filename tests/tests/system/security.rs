//! Unauthorised clients, members that exceed their rights, and for each a permitted counterpart: one
//! table, printed at the end (`cargo test --release --workspace --test system security -- --nocapture`).

use std::time::Duration;

use daemon::config::Schedule;
use serde_json::Value;
use system_tests::footprint::most_resident_kib;
use system_tests::hostile::{LARGE_ROOM_KIB, put_large};
use system_tests::observer::{Observer, unix_ns};
use system_tests::scenarios;
use system_tests::security::intruder::Papers;
use system_tests::security::letters::{self, Letters, answers, answers_to_the_refused, hold};
use system_tests::security::silence::Silence;
use system_tests::security::stand::Stand;
use system_tests::security::table::Table;
use system_tests::turn;
use system_tests::{LIMIT, in_time};
use vocabulary::fault::Fault;
use zenoh::Session;

/// For the reply to a query that is refused on its way, to which none comes.
const NO_REPLY: Duration = Duration::from_secs(3);
/// From one attempt to the next.
const GLANCE: Duration = Duration::from_millis(20);
const GAGE: &str = "module1/sensor/g2";
/// The key of the fault that module 1 really has.
const TRUE_FAULT: &str = "trusswatch/tower/module1/fault/sensor/g2";
/// A key of module 1 that others try to use.
const VICTIM: &str = "trusswatch/tower/module1/fault/sensor/g7";
/// The key that its journal is queried on.
const HISTORY: &str = "trusswatch/tower/module1/history";
/// What its diagnoser took beside samples.
const INPUT: &str = "trusswatch/tower/module1/input";
/// What that was set up with.
const CONFIGURATION: &str = "trusswatch/tower/module1/configuration";
/// Another one.
const SAMPLE: &str = "trusswatch/tower/module1/sample";
/// A key of the plant's own.
const PLANT: &str = "trusswatch/tower/plant/status";
/// A command in the name of another operator than the one who tries.
const FORGED_COMMAND: &str = "trusswatch/tower/module1/command/acknowledge/bob";
/// A command on the key of networks without access control.
const OPEN_COMMAND: &str = "trusswatch/tower/module1/command/acknowledge";
/// A key of module 2's own.
const OWN: &str = "trusswatch/tower/module2/fault/sensor/g7";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_router_admits_exactly_what_access_control_permits() {
    let _turn = turn::side_by_side().await;
    let schedule = scenarios::single(GAGE, Fault::Bias { offset_m: 4e-4 });
    let stand = Stand::star(&schedule).await;
    let observer = stand.session("observer.wall").await;
    let letters = Letters::to(&observer).await;
    letters.wait(TRUE_FAULT, "\"latched\"").await;

    let mut table = Table::default();
    at_the_door(&stand, &mut table).await;
    unnamed(&stand, &mut table).await;
    overfilling(&stand, &mut table).await;
    writing(&stand, &letters, &mut table).await;
    answering(&stand, &observer, &mut table).await;
    commanding(&stand, &mut table).await;
    history(&stand, &mut table).await;
    provenance(&stand, &mut table).await;

    judge(stand, &table).await;
}

/// A plant on the ground, a module in the middle, another one and an operator at the top: what is allowed works across
/// all links, what is forbidden is refused at the first of them, and a router passes on what its side may say.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn routers_in_a_row_pass_on_what_their_side_may_say() {
    let _turn = turn::side_by_side().await;
    in_a_row_of(2).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "the same with one more router takes as long again"]
async fn three_routers_in_a_row_pass_on_what_their_side_may_say() {
    let _turn = turn::side_by_side().await;
    in_a_row_of(3).await;
}

async fn in_a_row_of(routers: usize) {
    let schedule = scenarios::single(GAGE, Fault::Bias { offset_m: 4e-4 });
    let stand = Stand::row(&schedule, routers).await;
    let observer = stand.session("observer.wall").await;
    let letters = Letters::to(&observer).await;
    let mut table = Table::default();
    let heard = letters.hear(TRUE_FAULT, "\"latched\"").await;
    table.allowed("an observer on the ground hears a fault", heard);
    unnamed(&stand, &mut table).await;
    writing(&stand, &letters, &mut table).await;
    answering(&stand, &observer, &mut table).await;
    commanding(&stand, &mut table).await;
    history(&stand, &mut table).await;
    provenance(&stand, &mut table).await;
    other_side(&stand, &observer, &letters, &mut table).await;
    judge(stand, &table).await;
}

/// Whoever has the key of a router may say what its side may say: the modules are on its side, the plant is not.
async fn other_side(stand: &Stand, observer: &Session, letters: &Letters, table: &mut Table) {
    let above = stand.session_below("router.middle").await;
    let of_plant = observer.declare_subscriber(PLANT).await.unwrap();
    let passed_on = async {
        while !letters.have(OWN, "passed on by a router") {
            above.put(PLANT, "forged by a router").await.unwrap();
            above.put(OWN, "passed on by a router").await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    let heard = happens(passed_on).await;
    table.allowed("a router passing on what its side may say", heard);
    let trace = stand.trace(&["refused Put", PLANT, "router.middle.tower"]).await;
    let mut said = std::iter::from_fn(|| of_plant.try_recv().ok().flatten());
    let forged = said.any(|said| said.payload().to_bytes().starts_with(b"forged"));
    table.forbidden("a router speaking for the plant on this side", forged, trace);
}

/// A thief has copies of a module's and an operator's keys: they are of use until they are revoked, and not
/// after; those that were made instead are.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_revoked_key_may_do_nothing() {
    let _turn = turn::side_by_side().await;
    let schedule = scenarios::single(GAGE, Fault::Bias { offset_m: 4e-4 });
    let mut stand = Stand::star(&schedule).await;
    let [module, operator] = ["module2", "operator.ada"].map(|holder| lost_copy(&stand, holder));
    let observer = stand.session("observer.wall").await;
    let letters = Letters::to(&observer).await;
    letters.wait(TRUE_FAULT, "\"latched\"").await;
    let mut table = Table::default();
    let heard = write_until_heard(&stand.session(&module).await, &letters, "by the lost key").await;
    table.allowed("a lost key of module 2 writing its fault key", heard);
    let obeyed = orders(&stand, &operator, &["ack", GAGE], "30").await;
    table.allowed("a lost key of an operator commanding", obeyed);

    stand.revoke(&["module2", "operator.ada"]).await;
    let observer = stand.session("observer.wall").await;
    let letters = Letters::to(&observer).await;
    letters.wait(TRUE_FAULT, "\"acknowledged\"").await;
    let lost = stand.session(&module).await;
    lost.put(OWN, "by the revoked key").await.unwrap();
    let trace = stand.trace(&["no access control rule for", &lost.zid().to_string()]).await;
    let next =
        write_until_heard(&stand.session("module2").await, &letters, "by the next key").await;
    let heard = letters.have_anywhere("by the revoked key");
    table.forbidden("a revoked key of module 2 writing its fault key", heard, trace);
    table.allowed("the next key of module 2 writing its fault key", next);

    let lost = stand.session(&operator).await;
    let heard = !answers_to_the_refused(&lost, TRUE_FAULT).await.is_empty();
    let trace = stand.trace(&["no access control rule for", &lost.zid().to_string()]).await;
    let obeyed = heard || orders(&stand, &operator, &["reset", GAGE, "--force"], "5").await;
    table.forbidden("a revoked key of an operator querying and commanding", obeyed, trace);
    let obeyed = orders(&stand, "operator.ada", &["reset", GAGE, "--force"], "30").await;
    table.allowed("the next key of an operator commanding", obeyed);
    judge(stand, &table).await;
}

/// Copies a holder's certificate and key; returns where they are, seen from the library.
fn lost_copy(stand: &Stand, holder: &str) -> String {
    let copy = format!("../lost/{holder}");
    std::fs::create_dir_all(stand.library.join(&copy)).unwrap();
    for file in ["authority.pem", "certificate.pem", "key.pem"] {
        let from = stand.library.join(holder).join(file);
        std::fs::copy(from, stand.library.join(&copy).join(file)).unwrap();
    }
    copy
}

/// Does it happen at all?
async fn happens(event: impl Future<Output = ()>) -> bool {
    tokio::time::timeout(LIMIT, event).await.is_ok()
}

/// Until a subscriber has it, and whether it ever has: a link may break on a busy machine, and what is on it is gone.
async fn write_until_heard(session: &Session, letters: &Letters, text: &str) -> bool {
    let written = async {
        while !letters.have(OWN, text) {
            session.put(OWN, text).await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    happens(written).await
}

/// Whether an order is obeyed within so many seconds.
async fn orders(stand: &Stand, holder: &str, order: &[&str], seconds: &str) -> bool {
    let words = [order, &["--by", "ada", "--timeout", seconds]].concat();
    stand.trusswatch(holder, &words).await.code == Some(0)
}

/// Without a router each peer enforces the same on its own links.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn peers_enforce_it_themselves() {
    let _turn = turn::side_by_side().await;
    let schedule = scenarios::single(GAGE, Fault::Bias { offset_m: 4e-4 });
    let stand = Stand::peers(&schedule).await;
    let observer = stand.session("observer.wall").await;
    let letters = Letters::to(&observer).await;
    letters.wait(TRUE_FAULT, "\"latched\"").await;
    let mut table = Table::default();
    at_the_door(&stand, &mut table).await;
    commanding(&stand, &mut table).await;
    judge(stand, &table).await;
}

/// The attempts are real: without access control the same ones have an effect.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_refused_would_have_had_an_effect() {
    let _turn = turn::side_by_side().await;
    let stand = Stand::lawless_star(&Schedule::default()).await;
    let observer = stand.session("observer.wall").await;
    let letters = Letters::to(&observer).await;
    let second = stand.session("module2").await;
    let operator = stand.session("operator.ada").await;
    let forged = async {
        // Until the subscription has reached the writers.
        while !(letters.have(VICTIM, "by module 2") && letters.have(VICTIM, "by an operator")) {
            second.put(VICTIM, "forged by module 2").await.unwrap();
            operator.put(VICTIM, "forged by an operator").await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    in_time("a forged fault", forged).await;
    answer(&second, VICTIM, "answered by module 2 for module 1").await;
    let impostor =
        async { while !hold(&answers(&observer, VICTIM).await, VICTIM, "answered by module 2") {} };
    in_time("an impostor's answer", impostor).await;
    let watcher = Observer { session: observer, structure: "tower".parse().unwrap() };
    let harmed = watcher.status_of("module1", |status| status.intake.malformed > 0);
    let forging = async {
        // Until the victim has subscribed.
        loop {
            second.put(SAMPLE, "forged").await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    tokio::select! {
        _ = harmed => {}
        () = forging => {}
    }
    stand.clear().await;
}

async fn judge(stand: Stand, table: &Table) {
    println!("{}", table.to_text());
    let (failed, logs) = (table.failed(), stand.logs());
    assert!(failed.is_empty(), "{failed:?}\n{logs}");
    stand.clear().await;
}

async fn at_the_door(stand: &Stand, table: &mut Table) {
    // They last until the time of their handshakes is over.
    let silence = Silence::at(stand);
    let got_in = Papers::Right.knock(stand).await;
    table.allowed("module 1 behind 1500 connections that say nothing", got_in);
    table.allowed("module 1 with its certificate", Papers::Right.knock(stand).await);
    for (what, papers, word) in [
        ("a certificate of the wrong authority", Papers::WrongAuthority, "BadSignature"),
        ("no certificate", Papers::Missing, "no certificates"),
        ("an expired certificate", Papers::Expired, "xpired"),
        ("plain TCP", Papers::PlainTcp, "corrupt message"),
    ] {
        let words = ["WARN", "connection was refused", word];
        let mut got_in = papers.knock(stand).await;
        let again = async {
            // A busy machine may give up before it has refused anybody.
            while !got_in && !stand.has_trace(&words) {
                got_in = papers.knock(stand).await;
            }
        };
        in_time(what, again).await;
        let trace = stand.trace(&words).await;
        table.forbidden(what, got_in, trace);
    }
    table.allowed("module 1 when they have been given up", Papers::Right.knock(stand).await);
    drop(silence);
}

/// A certificate of the right authority alone grants nothing.
async fn unnamed(stand: &Stand, table: &mut Table) {
    let mallory = stand.session("operator.mallory").await;
    let letters = Letters::to(&mallory).await;
    let replies = answers_to_the_refused(&mallory, TRUE_FAULT).await;
    let heard = !replies.is_empty() || letters.have_anywhere("latched");
    let trace = stand.trace(&["WARN", "no access control rule for"]).await;
    table.forbidden("a valid certificate that no rule names", heard, trace);
}

/// The parts of a message are put together before access control sees it: who may only read can send one.
async fn overfilling(stand: &Stand, table: &mut Table) {
    let most_kib = || most_resident_kib(stand.guard_pid()).unwrap();
    let before = most_kib();
    let observer = stand.session("observer.wall").await;
    let watcher = stand.session("operator.ada").await;
    let watcher = Observer { session: watcher, structure: "tower".parse().unwrap() };
    let malformed = malformed_after(&watcher, unix_ns()).await;
    put_large(&observer, SAMPLE).await;
    // What comes after the large messages is refused by access control. A link may break on a busy machine, and what is
    // on it is gone.
    let again = async {
        loop {
            observer.put(SAMPLE, "short").await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    let trace = tokio::select! {
        trace = stand.trace(&["refused Put", SAMPLE, "observer.wall"]) => trace,
        () = again => unreachable!("it is put until it is refused"),
    };
    println!("most memory of the router {before} KiB before, {} KiB after", most_kib());
    let filled = most_kib() > before + LARGE_ROOM_KIB;
    table.harmless("an observer sending messages of 64 MiB", filled);
    let received = malformed_after(&watcher, unix_ns()).await > malformed;
    table.forbidden("an observer writing a sample after them", received, trace);
}

async fn writing(stand: &Stand, letters: &Letters, table: &mut Table) {
    let second = stand.session("module2").await;
    let written = async {
        // A link may break on a busy machine, and what is on it is gone.
        while !letters.have(OWN, "written by module 2") {
            second.put(VICTIM, "forged by module 2").await.unwrap();
            second.put(OWN, "written by module 2").await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    in_time("a text of module 2", written).await;
    let trace = stand.trace(&["refused Put", VICTIM, "module2.tower"]).await;
    let forged = letters.have_anywhere("forged by module 2");
    table.forbidden("module 2 writing module 1's fault key", forged, trace);
    table.allowed("module 2 writing its own fault key", letters.have(OWN, "written by module 2"));

    let operator = stand.session("operator.ada").await;
    let mut asked = Vec::new();
    let answered = async {
        // The answer comes after the router has dealt with what was before the question.
        while asked.is_empty() {
            operator.put(VICTIM, "forged by an operator").await.unwrap();
            asked = answers(&operator, TRUE_FAULT).await;
        }
    };
    in_time("an answer to an operator", answered).await;
    let written = async {
        while !letters.have(OWN, "written after the operator") {
            second.put(OWN, "written after the operator").await.unwrap();
            tokio::time::sleep(GLANCE).await;
        }
    };
    in_time("a text after the operator's", written).await;
    let trace = stand.trace(&["refused Put", VICTIM, "operator.ada.tower"]).await;
    let forged = letters.have_anywhere("forged by an operator");
    table.forbidden("an operator forging a fault", forged, trace);
    table.allowed("an operator querying a fault", !asked.is_empty());

    let watcher = Observer { session: operator, structure: "tower".parse().unwrap() };
    let before = malformed_after(&watcher, unix_ns()).await;
    second.put(SAMPLE, "forged").await.unwrap();
    let trace = stand.trace(&["refused Put", SAMPLE, "module2.tower"]).await;
    let received = malformed_after(&watcher, unix_ns()).await > before;
    table.forbidden("module 2 forging a sample of module 1", received, trace);
}

/// Samples that module 1 could not read, from a status later than this time.
async fn malformed_after(watcher: &Observer, unix_ns: u64) -> u64 {
    let status = watcher.status_of("module1", |status| status.time_unix_ns > unix_ns).await;
    status.intake.malformed
}

/// Answers as an impostor, on a key of its own and on one of module 1.
async fn answer(session: &Session, on: &'static str, text: &'static str) {
    let key = if on == VICTIM { "trusswatch/tower/module1/fault/**" } else { OWN };
    letters::answer(session, key, on, text).await;
}

async fn answering(stand: &Stand, observer: &Session, table: &mut Table) {
    let second = stand.session("module2").await;
    answer(&second, VICTIM, "answered by module 2 for module 1").await;
    answer(&second, OWN, "answered by module 2").await;
    let by_second =
        async { while !hold(&answers(observer, OWN).await, OWN, "answered by module 2") {} };
    let answered = happens(by_second).await;
    table.allowed("module 2 answering for itself", answered);

    let about_first = answers(observer, VICTIM).await;
    let forged = hold(&about_first, VICTIM, "answered by module 2");
    let trace = stand.trace(&["refused Declare Queryable", "module1/fault", "module2.tower"]).await;
    table.forbidden("module 2 answering for module 1", forged, trace);
    table.allowed("module 1 answering for itself", hold(&about_first, VICTIM, "\"module1\""));

    // A question to all: module 2 is asked too, and answers in the name of module 1.
    let asked = "trusswatch/tower/module2/fault/sensor/g8";
    letters::answer(&second, asked, VICTIM, "slipped in by module 2").await;
    let trace = async {
        loop {
            let all = answers(observer, "trusswatch/tower/*/fault/**").await;
            let forged = hold(&all, VICTIM, "slipped in");
            if forged || stand.has_trace(&["refused Reply", VICTIM, "module2.tower"]) {
                return forged;
            }
        }
    };
    let forged = in_time("an answer in the name of another", trace).await;
    let trace = stand.trace(&["refused Reply", VICTIM, "module2.tower"]).await;
    table.forbidden("module 2 answering a question to all in module 1's name", forged, trace);
}

async fn state(stand: &Stand) -> Value {
    let picture = stand.trusswatch("observer.wall", &["faults", "--json"]).await;
    assert_eq!(picture.code, Some(0), "{picture:?}");
    let picture = picture.json();
    let components = picture["components"].as_array().unwrap();
    let shown = components.iter().find(|shown| shown["component"] == GAGE).unwrap();
    shown["state"].clone()
}

async fn commanding(stand: &Stand, table: &mut Table) {
    let before = state(stand).await;
    table.allowed("an observer looking at the faults", before == "latched");
    let order = ["ack", GAGE, "--by", "eve", "--timeout", "2"];
    let ended = stand.trusswatch("observer.wall", &order).await;
    let trace = stand.trace(&["refused Query", "command/acknowledge", "observer.wall"]).await;
    let obeyed = ended.code == Some(0) || state(stand).await != "latched";
    table.forbidden("an observer commanding", obeyed, trace);

    let operator = stand.session("operator.ada").await;
    for (what, key) in [
        ("an operator commanding in another's name", FORGED_COMMAND),
        ("an operator commanding in nobody's name", OPEN_COMMAND),
    ] {
        let order = r#"{"v":1,"component":"sensor/g2","by":"bob","note":null,"force":false}"#;
        let obeyed = async {
            let replies = operator.get(key).payload(order).timeout(NO_REPLY).await.unwrap();
            std::iter::from_fn(|| replies.recv().ok()).any(|reply| reply.result().is_ok())
        };
        let obeyed = in_time("the end of a command", obeyed).await;
        let whose = format!("{key} by operator.ada");
        let trace = stand.trace(&["refused Query", &whose]).await;
        table.forbidden(what, obeyed || state(stand).await != "latched", trace);
    }
    let order = ["ack", GAGE, "--by", "eve"];
    let ended = stand.trusswatch("operator.ada", &order).await;
    assert_eq!(ended.code, Some(2), "{ended:?}");

    let order = ["ack", GAGE];
    let ended = stand.trusswatch("operator.ada", &order).await;
    let obeyed = ended.code == Some(0) && state(stand).await == "acknowledged";
    table.allowed("an operator commanding", obeyed);
    let history = stand.trusswatch("observer.wall", &["history", "--json"]).await;
    let history = history.out.replace(' ', "");
    let named = history.contains(r#""by":"ada""#) && !history.contains(r#""by":"bob""#);
    table.allowed("the journal naming the operator of the certificate", named);
}

async fn history(stand: &Stand, table: &mut Table) {
    let second = stand.session("module2").await;
    letters::answer(&second, HISTORY, HISTORY, "history by module 2").await;
    let trace = stand.trace(&["refused Declare Queryable", HISTORY, "module2.tower"]).await;

    let late = stand.session("observer.wall").await;
    let letters = Letters::to(&late).await;
    letters.wait(TRUE_FAULT, "\"acknowledged\"").await;
    let pages = answers(&late, HISTORY).await;
    let complete =
        hold(&pages, HISTORY, "\"latched\"") && hold(&pages, HISTORY, "\"acknowledged\"");
    table.allowed("an observer who comes late getting the history", complete);
    let forged = pages.iter().any(|(_, text)| text.contains("history by module 2"));
    table.forbidden("module 2 forging module 1's history", forged, trace);
}

/// What a recording needs beside what is published.
async fn provenance(stand: &Stand, table: &mut Table) {
    let second = stand.session("module2").await;
    letters::answer(&second, INPUT, INPUT, "inputs by module 2").await;
    let trace = stand.trace(&["refused Declare Queryable", INPUT, "module2.tower"]).await;

    let observer = stand.session("observer.wall").await;
    let letters = Letters::to(&observer).await;
    letters.wait(TRUE_FAULT, "\"acknowledged\"").await;
    let inputs = answers(&observer, INPUT).await;
    let complete = hold(&inputs, INPUT, "\"started\"") && hold(&inputs, INPUT, "\"ordered\"");
    table.allowed("an observer getting what a diagnoser took", complete);
    let configuration = answers(&observer, CONFIGURATION).await;
    let complete = hold(&configuration, CONFIGURATION, "\"setup\"");
    table.allowed("an observer getting the configuration of a diagnoser", complete);
    let forged = inputs.iter().any(|(_, text)| text.contains("inputs by module 2"));
    table.forbidden("module 2 forging module 1's inputs", forged, trace);
}
