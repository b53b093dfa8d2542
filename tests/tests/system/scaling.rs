//! Many diagnosers on one machine, as each other's peers and as clients of a router: processor time and
//! memory of each, time from a fault to its verdict at a third party, questions per verdict.

use std::time::{Duration, Instant};

use daemon::config::Schedule;
use system_tests::scaling::{Figures, Plan, Row, Setting, Table, Topology, measure};
use system_tests::turn;

/// All modules of the row.
const ALL: usize = usize::MAX / 4;
/// Those of the own tower and of one on either side.
const NEXT: usize = 1;

const fn of(
    copies: usize,
    topology: Topology,
    neighbours: usize,
    speed: f64,
    block_steps: u32,
) -> Setting {
    Setting { copies, topology, neighbours, speed, block_steps }
}

/// Towers, topology, range of peers, a pace at which two cores keep up, and steps of a message. A hundred that are
/// all connected to each other need five cores before the first sample.
const ROWS: [Setting; 11] = [
    of(1, Topology::Peers, ALL, 1.0, 1),
    of(1, Topology::Star, ALL, 1.0, 1),
    of(5, Topology::Peers, ALL, 0.5, 1),
    of(5, Topology::Star, ALL, 0.5, 1),
    of(10, Topology::Star, NEXT, 1.0, 10),
    of(25, Topology::Peers, ALL, 0.1, 1),
    of(25, Topology::Star, ALL, 0.1, 1),
    of(50, Topology::Peers, NEXT, 0.05, 1),
    of(50, Topology::Star, NEXT, 0.05, 1),
    of(50, Topology::Star, ALL, 0.05, 1),
    of(50, Topology::Star, NEXT, 0.25, 10),
];
/// Faults that are injected.
const FAULTS: usize = 6;
/// The same for a quick measurement on a machine that has other things to do.
const QUICK: [Setting; 3] = [
    of(1, Topology::Peers, ALL, 1.0, 1),
    of(5, Topology::Star, ALL, 0.4, 10),
    of(5, Topology::Peers, NEXT, 0.4, 1),
];

/// Loose limits, for machines that are slow or busy: processor time per sample \[µs\], memory \[MiB\], time
/// to a verdict at a third party \[ms\].
const MOST_US: f64 = 1000.0;
const MOST_MIB: f64 = 60.0;
const LATEST_MS: f64 = 2000.0;

async fn measured(setting: Setting, quiet: Duration, faults: usize) -> Figures {
    let figures = measure(setting, &Plan::new(&setting, quiet, faults)).await;
    let Figures { lost, unanswered, questions, verdicts, wrong, delays_ms, .. } = &figures;
    println!(
        "{setting:?}: {verdicts} verdicts, {questions} questions, {unanswered} unanswered, {lost} \
         samples lost, {delays_ms:.1?} ms"
    );
    assert_eq!(wrong, &Vec::<String>::new(), "{setting:?}");
    figures
}

/// No module queries more than its peers, and no verdict is reached without queries.
fn check(figures: &Figures) {
    let (per_verdict, peers) = (figures.questions_per_verdict(), figures.peers_of_each());
    assert!(per_verdict > 0.5 && per_verdict < 2.0 * peers + 1.0, "{per_verdict} of {peers}");
    assert!(figures.per_sample_us() < MOST_US, "{figures:?}");
    assert!(figures.diagnoser.mib < MOST_MIB, "{figures:?}");
    assert!(figures.delays_ms.iter().all(|delay| *delay < LATEST_MS), "{figures:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "measures time: wants both cores for itself"]
async fn ten_diagnosers_as_peers_and_on_a_router_name_what_is_faulty() {
    let _turn = turn::alone().await;
    let mut table = Table::default();
    for setting in QUICK {
        let figures = measured(setting, Duration::from_secs(2), 2).await;
        check(&figures);
        table.add(figures);
    }
    println!("{}", table.to_text());
}

/// As when the power comes back. On two cores the handshakes of this many take seconds, and a link that is given
/// up halfway must not keep two peers apart.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "wants both cores for itself: run it with `--ignored`"]
async fn fifty_diagnosers_that_start_in_one_instant_find_each_other() {
    let _turn = turn::alone().await;
    let setting = of(25, Topology::Peers, ALL, 1.0, 1);
    let row = Row::lay_out(setting, &Schedule::default());
    let start = Instant::now();
    let diagnosers = row.start_diagnosers();
    let observer = row.observer().await;
    row.wait_for_diagnosers(&observer).await;
    row.wait_for_each_other(&observer).await;
    println!("all of them know each other after {:.1?}", start.elapsed());
    for process in diagnosers {
        process.stop().await;
    }
}

/// Takes ten minutes; `SCALING=100` measures the rows of 100 diagnosers only, `SCALING=100-router` those
/// on a router, `SCALING=100-router-10` those of them with blocks of ten steps.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "wants both cores for itself: run it with `--ignored`"]
async fn up_to_a_hundred_diagnosers_on_one_machine() {
    let _turn = turn::alone().await;
    let wanted = std::env::var("SCALING").unwrap_or_default();
    let mut table = Table::default();
    for setting in ROWS {
        let Setting { copies, topology, .. } = setting;
        let name = format!("{}-{topology}-{}", setting.diagnosers(), setting.block_steps);
        if !wanted.is_empty() && !format!("{name}-").starts_with(&format!("{wanted}-")) {
            continue;
        }
        // One tower takes its faults one after the other; several get one each.
        let faults = if copies == 1 { FAULTS } else { FAULTS.min(copies) };
        let figures = measured(setting, Duration::from_secs(10), faults).await;
        assert_eq!((figures.lost, figures.unanswered), (0, 0), "{figures:?}");
        check(&figures);
        table.add(figures);
        println!("{}", table.to_text());
    }
}
