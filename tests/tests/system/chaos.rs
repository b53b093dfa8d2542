//! Under any disturbance of processes and network during a fault, the final verdicts are those of an
//! undisturbed run in one process, and never wrong meanwhile.
//!
//! A few rows side by side in real time, each in a laboratory of its own; `TRUSSWATCH_CHAOS=loss` runs those
//! whose fault has the word `loss` in it, and `TRUSSWATCH_CHAOS_LOGS=1` prints what the processes of failed rows logged.

use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::time::Duration;

use system_tests::chaos::disturbance::{
    BadNetwork, BrokenDisk, ClockJump, Crash, Disturbance, Flood, Freeze, LargeMessages, Lie,
    LostRouter, LyingPeer, Nothing, Panic,
};
use system_tests::chaos::row::{Lasting, Outcome, Row};
use system_tests::chaos::table::Table;
use system_tests::lab::{Impairment, Lab, Node};
use system_tests::scenarios::{self, ONSET};
use system_tests::turn;
use tokio::sync::Semaphore;
use vocabulary::fault::Fault;

const MS: Duration = Duration::from_millis(1);
/// Steps after the end of a disturbance: more than it takes to settle.
const AFTERWARDS: u64 = 2150;
/// Rows that run side by side: two processors are not to be a disturbance of their own.
const SIDE_BY_SIDE: u32 = 3;

/// A gage of the second module reads far too much; the controller trusts it, and gages of both
/// modules really change.
fn fault_with_effects() -> daemon::config::Schedule {
    scenarios::single("module2/sensor/g1", Fault::Bias { offset_m: -6e-4 })
}

/// A row around the onset of the fault.
fn row(fault: &str, lasting: Lasting, disturbance: impl Disturbance + 'static) -> Row {
    let steps = match lasting {
        Lasting::Steps { until, .. } => until + AFTERWARDS,
        // Time for all verdicts, also after a restart of the plant.
        Lasting::Moment { .. } => ONSET + 600,
        // Until shortly before the onset leaves the interval, which is a change of its own.
        Lasting::WholeRun { .. } => ONSET + 1950,
    };
    Row {
        fault: fault.into(),
        disturbance: Box::new(disturbance),
        lasting,
        schedule: fault_with_effects(),
        steps,
        floods: false,
    }
}

const fn steps(from: u64, until: u64) -> Lasting {
    Lasting::Steps { from, until }
}

const fn moment(at: u64) -> Lasting {
    Lasting::Moment { at }
}

const BEFORE: Lasting = steps(ONSET - 400, ONSET - 200);
const DURING: Lasting = steps(ONSET - 50, ONSET + 300);
const AFTER: Lasting = steps(ONSET + 400, ONSET + 600);
const AROUND: Lasting = steps(ONSET - 500, ONSET + 1000);

fn crashes() -> Vec<Row> {
    use Node::{Module1, Module2};
    let crash = |fault, lasting, nodes: &[Node]| row(fault, lasting, Crash(nodes.to_vec()));
    vec![
        crash("kill -9 of module1 before the onset", BEFORE, &[Module1]),
        crash("kill -9 of module1 during the onset", DURING, &[Module1]),
        crash("kill -9 of module1 after the onset", AFTER, &[Module1]),
        crash("kill -9 of module2 before the onset", BEFORE, &[Module2]),
        crash("kill -9 of module2 during the onset", DURING, &[Module2]),
        crash("kill -9 of module2 after the onset", AFTER, &[Module2]),
        crash("kill -9 of both, module1 back first", DURING, &[Module1, Module2]),
        crash("kill -9 of both, module2 back first", DURING, &[Module2, Module1]),
    ]
}

fn restarts() -> Vec<Row> {
    use Node::{Module1, Module2, Plant};
    let crash = |fault: &str, at, nodes: &[Node]| row(fault, moment(at), Crash(nodes.to_vec()));
    let mut rows = vec![
        crash("plant restart before the onset", 500, &[Plant]),
        crash("plant restart after the onset", ONSET + 400, &[Plant]),
    ];
    for order in [
        [Plant, Module1, Module2],
        [Plant, Module2, Module1],
        [Module1, Plant, Module2],
        [Module2, Plant, Module1],
        [Module1, Module2, Plant],
        [Module2, Module1, Plant],
    ] {
        let names = order.map(Node::name).join(", ");
        rows.push(crash(&format!("restart of all: {names}"), 200, &order));
    }
    rows.push(crash("restart of all after the onset", ONSET + 400, &[Plant, Module1, Module2]));
    rows
}

fn freezes() -> Vec<Row> {
    vec![
        row("SIGSTOP of module1", AROUND, Freeze(Node::Module1)),
        row("SIGSTOP of module2", AROUND, Freeze(Node::Module2)),
    ]
}

fn panics() -> Vec<Row> {
    let panic = |fault, lasting, node, thread| row(fault, lasting, Panic::of(node, thread));
    vec![
        panic("panic of module1's events thread", DURING, Node::Module1, "events"),
        panic("panic of module2's events thread", DURING, Node::Module2, "events"),
        panic("panic of module2's journal thread", AFTER, Node::Module2, "journal"),
    ]
}

fn disks() -> Vec<Row> {
    use Node::{Module1, Module2};
    // Longer than a module waits for its disk.
    let lasting = steps(ONSET - 500, ONSET + 1500);
    let broken = |fault, what| row(fault, lasting, BrokenDisk::new(Module2, what));
    let killed = |fault, node, what| row(fault, lasting, BrokenDisk::and_kill(node, what));
    vec![
        broken("disk of module2 does not answer", "hang-sync"),
        broken("disk of module2 frozen", "hang"),
        broken("disk of module2 full", "full"),
        killed("disk of module1 frozen, then kill -9", Module1, "hang"),
        killed("disk of module2 frozen, then kill -9", Module2, "hang"),
        killed("disk of module2 full, then kill -9", Module2, "full"),
    ]
}

fn networks() -> Vec<Row> {
    let late = Impairment::delay(20 * MS, 10 * MS);
    let far = Impairment { loss: 0.01, ..Impairment::delay(80 * MS, 10 * MS) };
    let cut = Impairment::cut();
    let (one, two) = (Node::Module1, Node::Module2);
    let network = |fault, network| row(fault, AROUND, network);
    let lost_router =
        |fault, at| Row { steps: ONSET + 1950, ..row(fault, moment(at), LostRouter::default()) };
    // Longer than it takes to give a peer up.
    let long = steps(ONSET - 1500, ONSET + 1500);
    vec![
        network("loss 5 % everywhere", BadNetwork::everywhere(Impairment::loss(0.05))),
        network("loss 20 % between modules", BadNetwork::between_modules(Impairment::loss(0.2))),
        network("loss 20 % everywhere", BadNetwork::everywhere(Impairment::loss(0.2))),
        network("delay 20 ± 10 ms, reordered", BadNetwork::between_modules(late)),
        network("delay 20 ± 10 ms everywhere, reordered", BadNetwork::everywhere(late)),
        network("delay 80 ± 10 ms, loss 1 % everywhere", BadNetwork::everywhere(far)),
        network("partition module1 to module2", BadNetwork::one_way(one, two, cut)),
        network("partition module2 to module1", BadNetwork::one_way(two, one, cut)),
        network("partition both ways", BadNetwork::between_modules(cut)),
        row("partition both ways for 3 s", long, BadNetwork::between_modules(cut)),
        lost_router("linked routers, one restarts before the onset", ONSET - 400),
        lost_router("linked routers, one restarts after the onset", ONSET + 50),
    ]
}

fn enemies() -> Vec<Row> {
    // Early enough for the true peer to be given up before the onset.
    let peer = |fault, lie| row(fault, steps(ONSET - 1600, ONSET + 500), LyingPeer::new(lie));
    // A fault of the module that asks, which the liar may hide; the true peer is back at the end.
    let plausible = |fault, lie| Row {
        schedule: scenarios::single("module1/sensor/g2", Fault::Bias { offset_m: 4e-4 }),
        ..row(fault, steps(ONSET - 1600, ONSET + 500), LyingPeer::new(lie))
    };
    vec![
        peer("lying peer: answers another question", Lie::AnotherQuestion),
        peer("lying peer: malformed JSON", Lie::Malformed),
        peer("lying peer: a change not asked for", Lie::ChangeOutside),
        peer("lying peer: contradicts the true one", Lie::Contradiction),
        plausible("plausible liar: the cause was mine", Lie::Cause),
        plausible("plausible liar: always refuses", Lie::Refusal),
        Row {
            floods: true,
            ..row("flood on the sample key", steps(ONSET - 500, ONSET + 2500), Flood::default())
        },
        Row {
            floods: true,
            ..row("messages of 64 MiB to module1", DURING, LargeMessages::default())
        },
        row("clock jumps an hour to and fro", AROUND, ClockJump::default()),
    ]
}

/// Every kind of fault, while modules communicate over a bad network from beginning to end.
fn scenarios_in_bad_network() -> Vec<Row> {
    let bad = Impairment { loss: 0.2, ..Impairment::delay(20 * MS, 10 * MS) };
    let lasting = Lasting::WholeRun { right_from: ONSET + 300 };
    let scenario = |(number, schedule): (usize, daemon::config::Schedule)| {
        let component = schedule.faults[0].component.clone();
        let fault = format!("scenario {number}, {component}: loss 20 %, 20 ± 10 ms");
        Row { schedule, ..row(&fault, lasting, BadNetwork::between_modules(bad)) }
    };
    scenarios::all().into_iter().enumerate().map(scenario).collect()
}

/// A row that fails to come to an end is a row that failed.
async fn perform(row: Row, number: u64) -> (String, Outcome) {
    let fault = row.fault.clone();
    let outcome = match tokio::spawn(AssertUnwindSafe(row.perform(Lab::required(number)))).await {
        Ok(outcome) => outcome,
        Err(error) => Outcome { problems: vec![reason(error)], ..Outcome::default() },
    };
    let verdict = if outcome.problems.is_empty() { "ok" } else { "FAILED" };
    println!("{fault}: {verdict}");
    if !outcome.problems.is_empty() && std::env::var_os("TRUSSWATCH_CHAOS_LOGS").is_some() {
        println!("{}", outcome.logs);
    }
    (fault, outcome)
}

fn reason(error: tokio::task::JoinError) -> String {
    let panic = error.into_panic();
    let text = panic.downcast_ref::<String>().cloned();
    let text = text.or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string));
    text.unwrap_or_else(|| "panicked".into())
}

fn wanted(row: &Row) -> bool {
    std::env::var("TRUSSWATCH_CHAOS").map_or(true, |word| row.fault.contains(&word))
}

/// All rows with their numbers, which are the seeds of their networks.
fn rows() -> Vec<(u64, Row)> {
    let mut rows = vec![row("nothing", AROUND, Nothing)];
    let groups = [crashes(), restarts(), freezes(), panics(), disks(), networks(), enemies()];
    rows.extend(groups.into_iter().flatten());
    (1..).zip(rows).chain((100..).zip(scenarios_in_bad_network())).collect()
}

/// One row of each kind of disturbance, whose effects differ most.
const SELECTION: [&str; 12] = [
    "nothing",
    "kill -9 of module2 during the onset",
    "kill -9 of both, module1 back first",
    "plant restart after the onset",
    "restart of all: module1, module2, plant",
    "SIGSTOP of module2",
    "panic of module2's events thread",
    "disk of module2 frozen, then kill -9",
    "loss 20 % everywhere",
    "partition both ways for 3 s",
    "linked routers, one restarts after the onset",
    "lying peer: contradicts the true one",
];

async fn perform_all(rows: Vec<(u64, Row)>) {
    let places = Arc::new(Semaphore::new(SIDE_BY_SIDE as usize));
    let running = rows.into_iter().map(|(number, row)| {
        let places = Arc::clone(&places);
        tokio::spawn(async move {
            let wants = if row.floods { SIDE_BY_SIDE } else { 1 };
            let _place = places.acquire_many(wants).await.unwrap();
            perform(row, number).await
        })
    });
    let mut table = Table::default();
    for row in running.collect::<Vec<_>>() {
        let (fault, outcome) = row.await.unwrap();
        table.add(fault, outcome);
    }
    println!("{}", table.to_text());
    assert!(table.failed().is_empty(), "failed: {}", table.failed().join("; "));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs laboratories (network namespaces, as root) and both cores for itself"]
async fn a_selection_of_disturbances_leaves_the_verdicts_of_an_undisturbed_run() {
    let _turn = turn::alone().await;
    let selected: Vec<_> =
        rows().into_iter().filter(|(_, row)| SELECTION.contains(&row.fault.as_str())).collect();
    assert_eq!(selected.len(), SELECTION.len(), "each is the name of one row");
    perform_all(selected).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs laboratories (network namespaces, as root), and takes minutes"]
async fn every_disturbance_leaves_the_verdicts_of_an_undisturbed_run() {
    let _turn = turn::alone().await;
    perform_all(rows().into_iter().filter(|(_, row)| wanted(row)).collect()).await;
}
