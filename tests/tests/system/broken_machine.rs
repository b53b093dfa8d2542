//! A disk that hangs or is full, and threads that panic: faults are published all the same, what is said of the disk is
//! true, whoever asks the process to end sees it end, and nothing that was published is forgotten.

use std::sync::Arc;
use std::time::Duration;

use daemon::config::Schedule;
use nix::sys::signal::Signal;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::interposer::Interposer;
use system_tests::observer::{Faults, Observer, states};
use system_tests::operate::{Ended, trusswatch};
use system_tests::process::{Process, is_end_by_panic};
use system_tests::turn;
use system_tests::{LIMIT, in_time};
use vocabulary::{FaultState, FaultTransition, ModuleStatus, RunId, fault::Fault};

const STEPS: u64 = 1_000_000;
const GAGE: &str = "module1/sensor/g2";
const OTHER_GAGE: &str = "module1/sensor/g5";

/// The tower at work; the diagnoser of module 1 behind an interposer.
struct Works {
    deployment: Deployment,
    interposer: Arc<Interposer>,
    observer: Observer,
    faults: Faults,
    diagnosers: Vec<Process>,
    _plant: Process,
}

impl Works {
    async fn in_service() -> Self {
        Self::begun_with(&[]).await
    }

    /// The same, with these orders to the interposer from the start.
    async fn begun_with(orders: &[&str]) -> Self {
        let deployment = Deployment::of_watched_tower(&Schedule::default());
        deployment.patient();
        let interposer = deployment.interpose(0);
        orders.iter().for_each(|order| interposer.order(order));
        let observer = Observer::of(&deployment).await;
        let faults = observer.faults().await;
        let diagnosers = deployment.start_diagnosers();
        observer.wait_for(&MODULES, false).await;
        let plant = deployment.start_plant("real", STEPS, 11, RunId(11));
        observer.wait_until_watching(&MODULES).await;
        Self { deployment, interposer, observer, faults, diagnosers, _plant: plant }
    }

    async fn inject(&self, component: &str) {
        self.observer.inject(component, Some(Fault::Bias { offset_m: 4e-4 })).await;
    }

    /// The next transition of a component to this state.
    async fn transition(&mut self, component: &str, state: FaultState) -> FaultTransition {
        let wanted = |_: u64, found: FaultTransition| {
            (found.component.to_string() == component && found.state() == state).then_some(found)
        };
        self.faults.find(&format!("{component} {state}"), wanted).await
    }

    async fn status(&self, wanted: impl Fn(&ModuleStatus) -> bool) -> ModuleStatus {
        self.observer.status_of("module1", wanted).await
    }

    /// Waits until the journal is as it should be.
    async fn recovers(&self) -> ModuleStatus {
        let well =
            |status: &ModuleStatus| status.journal.problem.is_none() && status.journal.unsaved == 0;
        self.status(well).await
    }

    /// Kills the first diagnoser and starts it again.
    async fn crash(&mut self) {
        self.diagnosers[0].crash().await;
        self.start_again().await;
    }

    /// Starts the first diagnoser again, which has ended.
    async fn start_again(&mut self) {
        self.observer.wait_until_gone("module1").await;
        self.diagnosers[0] = self.deployment.start_diagnoser(0);
        self.observer.wait_for(&MODULES, false).await;
    }

    /// The present state of a component, from its module.
    async fn state(&self, component: &str) -> FaultTransition {
        let found = async {
            loop {
                let mut states = states(&self.observer.session).await.into_iter();
                if let Some(state) = states.find(|state| state.component.to_string() == component) {
                    return state;
                }
            }
        };
        in_time("the state of a component", found).await
    }

    /// The states that the module's journal has of a component, in the order of their numbers.
    async fn journalled(&self, component: &str) -> Vec<FaultState> {
        let (structure, module) = ("tower".parse().unwrap(), "module1".parse().unwrap());
        let session = &self.observer.session;
        let history = session::client::history(session, &structure, &module, 1, LIMIT).await;
        let transitions = history.transitions.into_iter();
        let own = transitions.filter(|transition| transition.component.to_string() == component);
        own.map(|transition| transition.state()).collect()
    }

    async fn order(&self, words: &[&str]) -> Ended {
        trusswatch(&self.deployment, words).await
    }

    async fn stop(self) {
        for diagnoser in self.diagnosers {
            diagnoser.stop().await;
        }
    }
}

fn hangs(status: &ModuleStatus) -> bool {
    status.journal.problem.as_ref().is_some_and(|problem| problem.contains("hung for"))
}

/// A fault while the disk hangs, whatever of it hangs.
async fn a_fault_while_the_disk_hangs(what: &str) {
    let _turn = turn::side_by_side().await;
    let mut works = Works::in_service().await;
    works.interposer.order(what);
    works.inject(GAGE).await;
    // The disk hangs until that is called off: what comes now did not wait for it.
    let latched = works.transition(GAGE, FaultState::Latched).await;
    assert!(!latched.durable);
    let status = works.status(hangs).await;
    assert!(status.journal.unsaved > 0, "{:?}", status.journal);
    // The disk owes nothing more to the next one.
    works.inject(OTHER_GAGE).await;
    works.transition(OTHER_GAGE, FaultState::Latched).await;
    assert_eq!(works.state(GAGE).await.state(), FaultState::Latched);
    works.interposer.call_off(what);
    works.recovers().await;
    let state = works.state(GAGE).await;
    assert!(state.durable && state.state() == FaultState::Latched, "{state:?}");
    works.crash().await;
    for component in [GAGE, OTHER_GAGE] {
        assert_eq!(works.state(component).await.state(), FaultState::Latched);
        assert!(works.journalled(component).await.contains(&FaultState::Latched));
    }
    works.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fault_is_published_while_waiting_for_the_disk_hangs() {
    a_fault_while_the_disk_hangs("hang-sync").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fault_is_published_while_everything_that_writes_hangs() {
    a_fault_while_the_disk_hangs("hang").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn on_a_disk_that_hangs_from_the_start_it_diagnoses_and_says_so() {
    let _turn = turn::side_by_side().await;
    let mut works = Works::begun_with(&["hang"]).await;
    let status = works.status(|status| status.journal.problem.is_some()).await;
    let problem = status.journal.problem.unwrap();
    assert!(problem.contains("did not answer") || problem.contains("hung for"), "{problem}");
    works.inject(GAGE).await;
    assert!(!works.transition(GAGE, FaultState::Latched).await.durable);
    works.interposer.call_off("hang");
    works.recovers().await;
    works.crash().await;
    assert_eq!(works.state(GAGE).await.state(), FaultState::Latched);
    works.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn with_a_frozen_disk_a_process_ends_when_asked_to() {
    let _turn = turn::side_by_side().await;
    let mut works = Works::in_service().await;
    works.interposer.order("hang");
    works.inject(GAGE).await;
    works.transition(GAGE, FaultState::Latched).await;
    // The disk never answers: a process that waited for it would not end.
    works.diagnosers[0].signal(Signal::SIGTERM);
    assert_eq!(works.diagnosers[0].exit_code().await, Some(0));
    // It cannot start before it has read what it knew, and can be stopped in that too.
    let before = works.diagnosers[0].log().len();
    let mut next = works.deployment.start_diagnoser(0);
    let begun = async {
        while !next.log()[before..].contains("opening the state directory") {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    in_time("the beginning of a start", begun).await;
    next.signal(Signal::SIGTERM);
    assert_eq!(next.exit_code().await, Some(0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_order_that_a_full_disk_does_not_keep_says_so() {
    let _turn = turn::side_by_side().await;
    let mut works = Works::in_service().await;
    works.inject(GAGE).await;
    works.transition(GAGE, FaultState::Latched).await;
    works.interposer.order("full");
    let ended = works.order(&["ack", GAGE, "--by", "ada"]).await;
    assert_eq!(ended.code, Some(5), "{ended:?}");
    assert!(ended.err.contains("not saved"), "{ended:?}");
    let ended = works.order(&["ack", OTHER_GAGE, "--by", "ada", "--json"]).await;
    assert_eq!(ended.code, Some(1), "it has no fault: {ended:?}");
    // A process that starts on a full disk knows before its first fault.
    works.crash().await;
    let status = works.status(|status| status.journal.problem.is_some()).await;
    assert!(status.journal.problem.unwrap().contains("No space left"));
    let ended = works.order(&["ack", GAGE, "--by", "ada", "--json"]).await;
    assert_eq!(ended.code, Some(5), "{ended:?}");
    assert_eq!(ended.json()["orders"][0]["durable"], false, "{ended:?}");
    works.interposer.call_off("full");
    works.recovers().await;
    works.crash().await;
    assert_eq!(works.state(GAGE).await.state(), FaultState::Acknowledged);
    works.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_thread_that_panics_ends_the_process() {
    let _turn = turn::side_by_side().await;
    // One that holds no lock of Zenoh's, and one that may.
    panics_of(&["identifier", "events"]).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "restarts a diagnoser six times"]
async fn whichever_thread_panics_the_process_ends() {
    let _turn = turn::side_by_side().await;
    panics_of(&["identifier", "events", "routine", "journal", "replies", "history"]).await;
}

/// Each of these threads panics in turn, the one that identifies faults first: what panics within an identification costs
/// that alone, so it is told before it has anything to identify.
async fn panics_of(threads: &[&str]) {
    let mut works = Works::in_service().await;
    works.interposer.order(&format!("panic-{}", threads[0]));
    works.inject(GAGE).await;
    works.transition(GAGE, FaultState::Latched).await;
    for thread in threads {
        let order = format!("panic-{thread}");
        works.interposer.order(&order);
        // Something to do for each of them.
        works.inject(OTHER_GAGE).await;
        states(&works.observer.session).await;
        // The process may end before it answers.
        works.order(&["history", "--module", "module1", "--timeout", "2"]).await;

        let status = works.diagnosers[0].exit_status().await;
        let log = works.diagnosers[0].log();
        assert!(is_end_by_panic(status), "{thread}: {status}\n{log}");
        // Those that hold no lock of Zenoh's.
        let ends_in_order = ["identifier", "journal"].contains(thread);
        assert!(status.code() == Some(1) || !ends_in_order, "{thread}: {status}\n{log}");
        let named = match status.code() {
            Some(_) => format!("error: the thread `{thread}` has panicked"),
            None => format!("thread '{thread}'"),
        };
        assert!(log.lines().any(|line| line.starts_with(&named)), "{log}");
        works.interposer.call_off(&order);
        works.start_again().await;
        assert_eq!(works.state(GAGE).await.state(), FaultState::Latched);
    }
    works.stop().await;
}
