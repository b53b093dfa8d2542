//! The distributed verdicts are those of the same run in one process: component, outcome, onset,
//! detection and decision, at any speed and in any start order.

use std::collections::BTreeSet;

use system_tests::deployment::Deployment;
use system_tests::observer::{Faults, Observer};
use system_tests::verdict::Reached;
use system_tests::{LIMIT, in_time, reference, scenarios, turn};
use vocabulary::RunId;

#[derive(Clone, Copy)]
enum Order {
    PlantFirst,
    DiagnosersFirst,
}

/// Runs a scenario in processes and holds its verdicts against those of one process.
async fn compare(
    schedule: daemon::config::Schedule,
    steps: u64,
    number: u64,
    speed: &str,
    order: Order,
) {
    let (seed, run) = (100 + number, RunId(1000 + number));
    let deployment = Deployment::of_tower(&schedule);
    deployment.patient();
    let expected = reference::verdicts(&deployment, seed, run, steps);
    assert!(!expected.is_empty(), "scenario {number} shows nothing");
    let start_plant = || deployment.start_plant(speed, steps, seed, run);
    let (mut plant, diagnosers);
    let (observer, mut faults);
    match order {
        Order::PlantFirst => {
            plant = start_plant();
            // The plant waits for its diagnosers, so the observer cannot be late.
            diagnosers = vec![deployment.start_diagnoser(1)];
            observer = Observer::of(&deployment).await;
            faults = observer.faults().await;
        }
        Order::DiagnosersFirst => {
            diagnosers = vec![deployment.start_diagnoser(1)];
            observer = Observer::of(&deployment).await;
            faults = observer.faults().await;
            observer.wait_for(&["module2"], false).await;
            plant = start_plant();
        }
    }
    let last = deployment.start_diagnoser(0);
    let reached = match collect(&mut faults, &expected).await {
        Ok(reached) => reached,
        Err(reached) => panic!(
            "scenario {number} at speed {speed} reached only {reached:#?} of {expected:#?}\n{}",
            deployment.logs()
        ),
    };
    assert_eq!(plant.exit_code().await, Some(0), "{}", plant.log());
    let mut all = reached;
    all.extend(faults.arrived().iter().filter_map(|(_, message)| Reached::of_message(message)));
    assert_eq!(all, expected, "scenario {number} at speed {speed}");
    for process in diagnosers.into_iter().chain([last]) {
        process.stop().await;
    }
    observer.session.close().await.unwrap();
}

/// Listens until everything expected has been reached; if it is not in time, what has.
async fn collect(
    faults: &mut Faults,
    expected: &BTreeSet<Reached>,
) -> Result<BTreeSet<Reached>, BTreeSet<Reached>> {
    let mut reached = BTreeSet::new();
    let deadline = tokio::time::Instant::now() + LIMIT;
    while !expected.is_subset(&reached) {
        match tokio::time::timeout_at(deadline, faults.next()).await {
            Ok((_, message)) => reached.extend(Reached::of_message(&message)),
            Err(_) => return Err(reached),
        }
    }
    Ok(reached)
}

/// Each scenario in these orders of start.
async fn compare_all(speed: &'static str, at_a_time: usize, orders: impl Fn(u64) -> Vec<Order>) {
    let mut running = tokio::task::JoinSet::new();
    for (number, schedule) in (0..).zip(scenarios::all()) {
        for order in orders(number) {
            let steps = scenarios::STEPS;
            running.spawn(compare(schedule.clone(), steps, number, speed, order));
            if running.len() >= at_a_time {
                in_time("a scenario", running.join_next()).await.unwrap().unwrap();
            }
        }
    }
    while let Some(done) = in_time("a scenario", running.join_next()).await {
        done.unwrap();
    }
}

/// Found by comparison with the reference: from the first step on, in both modules, and creeping.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn of_what_no_change_shows() {
    let _turn = turn::side_by_side().await;
    let (schedule, steps) = scenarios::unseen();
    let expected = reference::verdicts(&Deployment::of_tower(&schedule), 190, RunId(1090), steps);
    for fault in &schedule.faults {
        let named = |reached: &Reached| {
            reached.component == fault.component && reached.outcome == "latched"
        };
        assert!(expected.iter().any(named), "{fault:?} {expected:#?}");
    }
    compare(schedule, steps, 90, "max", Order::DiagnosersFirst).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn at_full_speed() {
    let _turn = turn::side_by_side().await;
    compare_all("max", 1, |_| vec![Order::PlantFirst, Order::DiagnosersFirst]).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn in_real_time() {
    let _turn = turn::side_by_side().await;
    // Every other scenario in either order: waiting takes its time in real time.
    let one = |number| match number % 2 {
        0 => Order::PlantFirst,
        _ => Order::DiagnosersFirst,
    };
    compare_all("real", 3, |number| vec![one(number)]).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes twice as long as `in_real_time`, which has one order of start of each scenario"]
async fn in_real_time_in_any_order_of_start() {
    let _turn = turn::side_by_side().await;
    compare_all("real", 3, |_| vec![Order::PlantFirst, Order::DiagnosersFirst]).await;
}
