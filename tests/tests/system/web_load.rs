//! Two hundred open pages and one that stalls cost the diagnosers nothing: the same faults, found at the same steps, as
//! soon as without them. The programs are those that `TRUSSWATCH_PROGRAMS` names.

use std::collections::BTreeSet;

use daemon::config::{Schedule, ScheduledFault};
use system_tests::deployment::{Deployment, MODULES};
use system_tests::footprint::Memory;
use system_tests::in_time;
use system_tests::observer::Observer;
use system_tests::publications::Publications;
use system_tests::quantiles::quantiles;
use system_tests::turn;
use system_tests::web_page::WebPage;
use vocabulary::{ComponentPath, FaultState, RunId, Step, fault::Fault};

const PAGES: usize = 200;
/// A minute at 1 kHz.
const STEPS: u64 = 60_000;
const FIRST: u64 = 6_000;
const NEXT: u64 = 4_400;
const GAGES_OF_A_MODULE: u64 = 6;
/// Memory that the page's process may take \[MiB\].
const MOST_MIB: f64 = 200.0;
/// A median that pages in the same machine may add to: the readers take a processor's time too.
const MOST_TIMES: f64 = 2.0;

fn schedule() -> Schedule {
    let faults = (0..2 * GAGES_OF_A_MODULE).map(|place| {
        let (module, gage) = (MODULES[place as usize % 2], 1 + place / 2);
        ScheduledFault {
            at_step: Step(FIRST + NEXT * place),
            until_step: None,
            component: format!("{module}/sensor/g{gage}").parse().unwrap(),
            fault: Fault::Bias { offset_m: 4e-4 },
        }
    });
    Schedule { faults: faults.collect() }
}

/// What was found in a run, and how soon it was known.
struct Found {
    /// The faulty components, with the steps at which their changes were detected.
    faults: BTreeSet<(ComponentPath, Step)>,
    /// From the sample that decided to the message \[ms\].
    delays_ms: Vec<f64>,
}

async fn run(pages: usize) -> Found {
    let deployment = Deployment::of_tower(&schedule());
    deployment.publish_as_shipped();
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    let publications = Publications::of(&observer).await;
    let mut faults = observer.faults().await;
    let page = if pages > 0 { Some(WebPage::start(&deployment).await) } else { None };
    let (mut readers, mut stalled) = (None, None);
    if let Some(page) = &page {
        (readers, stalled) = (Some(page.read(pages).await), Some(page.stall().await));
    }
    let mut plant = deployment.start_plant("real", STEPS, 7, RunId(7));
    let wanted = schedule().faults.len();
    let mut latched = Vec::new();
    while latched.len() < wanted {
        let (arrival, message) = faults.next().await;
        if message.state() == FaultState::Latched {
            latched.push((arrival, message));
        }
    }
    let delays_ms = publications.delays_ms(&latched).await;
    assert_eq!(plant.exit_code().await, Some(0), "{}", plant.log());
    if let (Some(page), Some(readers)) = (page, readers) {
        let memory = Memory::of(page.process().pid());
        println!(
            "{pages} pages read {:.0} MB; the process holds {memory:.1?}",
            readers.megabytes()
        );
        assert!(memory.proportional_mib < MOST_MIB, "{memory:?}");
        assert_eq!((readers.informed(), readers.ended()), (pages, 0), "{}", page.process().log());
        drop((readers, stalled));
        page.stop().await;
    }
    for process in diagnosers {
        in_time("the end", process.stop()).await;
    }
    let found = |(_, message): (u64, vocabulary::FaultTransition)| {
        (message.component, message.detection_step.unwrap())
    };
    Found { faults: latched.into_iter().map(found).collect(), delays_ms }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "wants the machine for itself, and takes two minutes: run it with `--ignored`"]
async fn two_hundred_open_pages_cost_no_diagnoser_anything() {
    let _turn = turn::alone().await;
    let without = run(0).await;
    let with = run(PAGES).await;
    assert_eq!(with.faults, without.faults);
    let [before, before_worst] = quantiles(without.delays_ms, [0.5, 1.0]);
    let [after, after_worst] = quantiles(with.delays_ms, [0.5, 1.0]);
    println!("from the deciding sample to the fault message, {} faults:", with.faults.len());
    println!("  without pages: median {before:.2} ms, longest {before_worst:.2} ms");
    println!("  with {PAGES} pages: median {after:.2} ms, longest {after_worst:.2} ms");
    assert!(after < MOST_TIMES * before, "{after:.2} ms, without pages {before:.2} ms");
}
