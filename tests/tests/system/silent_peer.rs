//! A peer is killed or frozen before it would be queried: the querying module reports it, continues without missing a
//! sample, and settles when the peer is back. How soon is measured on a quiet machine.

use std::collections::BTreeSet;

use daemon::config::Schedule;
use nix::sys::signal::Signal;
use system_tests::deployment::Deployment;
use system_tests::observer::{Faults, Observer, unix_ns};
use system_tests::plant_clock::PlantClock;
use system_tests::process::Process;
use system_tests::publications::Publications;
use system_tests::signs::{Sign, Signs};
use system_tests::verdict::Reached;
use system_tests::{reference, scenarios, turn};
use vocabulary::{ComponentPath, Doubt, FaultState, FaultTransition, RunId, fault::Fault};

const ASKER: &str = "module1";
const SILENT: &str = "module2";
const FAULTY: &str = "module1/sensor/g2";
const RUN: RunId = RunId(1);
const SEED: u64 = 100;
/// More than any test takes.
const FOR_LONG: u64 = 1_000_000;
/// Where timing is measured, the peer falls silent this many steps before the onset.
const BEFORE: u64 = 20;
/// How long it stays silent \[steps\]; it is back long before the plant's recording of the onset is overwritten.
const SILENCE: u64 = 1000;
/// Steps after the verdict in which no other one may follow.
const AFTERWARDS: u64 = 1500;
/// A jump would need no peer.
const SMALL_BIAS_M: f64 = 1.2e-5;
const SECOND_MS: f64 = 1000.0;
/// How soon the querying module settles.
const SETTLING_MS: f64 = 2000.0;
/// The querying module publishes its progress every twenty steps; queries may delay it a little.
const STANDSTILL_MS: f64 = 400.0;

#[derive(Debug, Clone, Copy)]
enum Silence {
    Killed,
    Frozen,
}

impl Silence {
    fn begin(self, peer: &mut Process) {
        match self {
            // Silent at once; how long the kernel takes to bury it is not to hold this test up.
            Silence::Killed => peer.signal(Signal::SIGKILL),
            Silence::Frozen => peer.signal(Signal::SIGSTOP),
        }
    }

    /// Returns when the peer is back \[ns since 1970\].
    async fn end(self, deployment: &Deployment, observer: &Observer, peer: &mut Process) -> u64 {
        match self {
            Silence::Killed => {
                peer.exit_code().await;
                *peer = deployment.start_diagnoser(1);
                observer.wait_for(&[SILENT], false).await;
                unix_ns()
            }
            Silence::Frozen => {
                let back = unix_ns();
                peer.signal(Signal::SIGCONT);
                back
            }
        }
    }
}

fn ms(from: u64, to: u64) -> f64 {
    to.saturating_sub(from) as f64 / 1e6
}

/// Waits for a transition of the faulty component; notes the verdicts on the way.
async fn find(
    faults: &mut Faults,
    reached: &mut BTreeSet<Reached>,
    state: FaultState,
) -> (u64, FaultTransition) {
    let faulty: ComponentPath = FAULTY.parse().unwrap();
    let wanted = |at: u64, message: FaultTransition| {
        reached.extend(Reached::of_message(&message));
        let is_wanted = message.component == faulty && message.state() == state;
        is_wanted.then_some((at, message))
    };
    faults.find(&format!("{FAULTY} {state}"), wanted).await
}

/// The longest time without progress among these signals \[ms\].
fn longest_standstill(signs: Vec<(u64, Sign)>) -> f64 {
    let progress = signs.into_iter().filter(|(_, sign)| matches!(sign, Sign::Progress(_)));
    let times: Vec<u64> = progress.map(|(at, _)| at).collect();
    assert!(times.len() > 2, "no progress");
    times.windows(2).map(|pair| ms(pair[0], pair[1])).fold(0.0, f64::max)
}

/// What was measured \[ms\].
#[derive(Debug)]
struct Measured {
    unconfirmed: f64,
    standstill: f64,
    settled: f64,
}

/// How the fault comes after the beginning of the silence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Onset {
    /// By order, whenever the peer has fallen silent.
    Ordered,
    /// By the plant's schedule, a moment later.
    Scheduled,
}

async fn silence(how: Silence, onset: Onset) -> Measured {
    let bias = Fault::Bias { offset_m: SMALL_BIAS_M };
    let mut schedule = scenarios::single(FAULTY, bias);
    let deployment = match onset {
        Onset::Scheduled => Deployment::of_watched_tower(&schedule),
        Onset::Ordered => Deployment::of_watched_tower(&Schedule::default()),
    };
    // How long a peer's answer is waited for is the subject; how late samples may be is not.
    deployment.patient_with_samples();
    let hold = deployment.diagnoser_configs()[0].module_setup().isolation.hold_steps;
    let observer = Observer::of(&deployment).await;
    let mut diagnosers = deployment.start_diagnosers();
    observer.wait_for(&[ASKER, SILENT], false).await;
    let mut faults = observer.faults().await;
    let mut signs = Signs::of(&observer, ASKER).await;
    let clock = PlantClock::of(&observer).await;
    let publications = Publications::of(&observer).await;
    let plant = deployment.start_plant("real", FOR_LONG, SEED, RUN);
    if onset == Onset::Scheduled {
        clock.reach(RUN, scenarios::ONSET - BEFORE).await;
    } else {
        observer.wait_until_watching(&[ASKER, SILENT]).await;
    }
    how.begin(&mut diagnosers[1]);
    signs.arrived();
    if onset == Onset::Ordered {
        schedule.faults[0].at_step = observer.inject(FAULTY, Some(bias)).await;
    }
    let mut reached = BTreeSet::new();

    let (at, message) = find(&mut faults, &mut reached, FaultState::Unconfirmed).await;
    let deciding = message.detection_step.unwrap().plus(hold);
    let unconfirmed = ms(publications.time_of(&message.module, deciding).await, at);
    let silent = Doubt::Silent(vec![SILENT.parse().unwrap()]);
    assert_eq!(message.verdict.doubt(), Some(&silent));

    clock.reach(RUN, schedule.faults[0].at_step.0 + SILENCE).await;
    let standstill = longest_standstill(signs.arrived());
    assert!(reached.is_empty(), "judged without its peer: {reached:#?}");
    let back = how.end(&deployment, &observer, &mut diagnosers[1]).await;
    let (at, latched) = find(&mut faults, &mut reached, FaultState::Latched).await;
    let settled = ms(back, at);

    clock.reach(RUN, latched.detection_step.unwrap().0 + AFTERWARDS).await;
    plant.stop().await;
    // All have every sample that there was.
    let statuses = observer.statuses().await;
    let last = statuses.first(|latest| {
        let mut steps = latest.values().map(|status| status.step);
        let same = latest.len() == 2 && steps.all(|step| step == clock.step(RUN));
        clock.step(RUN).filter(|_| same)
    });
    let last = system_tests::in_time("the last sample", last).await;
    for module in [ASKER, SILENT] {
        let status = observer.status_of(module, |_| true).await;
        assert_eq!((status.step, status.intake.dropped), (Some(last), 0), "{module}");
        if module == ASKER {
            assert_eq!(status.diagnosis.samples_missing, 0, "{module}");
            assert_eq!(status.diagnosis.samples, last.0 + 1, "{module}");
        }
    }
    let rest = faults.arrived();
    reached.extend(rest.iter().filter_map(|(_, message)| Reached::of_message(message)));
    let expected = reference::verdicts_with(&deployment, &schedule, SEED, RUN, last.0 + 1);
    assert_eq!(reached, expected, "{how:?}\n{}", deployment.logs());
    for process in diagnosers {
        process.stop().await;
    }
    Measured { unconfirmed, standstill, settled }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_peer_is_named_and_the_verdict_follows_when_it_is_back() {
    let _turn = turn::side_by_side().await;
    silence(Silence::Killed, Onset::Ordered).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_frozen_peer_is_named_and_the_verdict_follows_when_it_goes_on() {
    let _turn = turn::side_by_side().await;
    silence(Silence::Frozen, Onset::Ordered).await;
}

async fn in_time(how: Silence) {
    let _turn = turn::alone().await;
    let measured = silence(how, Onset::Scheduled).await;
    println!("{how:?}: {measured:.1?} [ms]");
    let Measured { unconfirmed, standstill, settled } = measured;
    assert!(unconfirmed < SECOND_MS, "{how:?}: unconfirmed only after {unconfirmed} ms");
    assert!(standstill < STANDSTILL_MS, "{how:?}: stood still for {standstill} ms");
    assert!(settled < SETTLING_MS, "{how:?}: settled only after {settled} ms");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "measures time: wants both cores for itself"]
async fn a_peer_killed_just_before_it_would_be_asked_is_named_within_a_second() {
    in_time(Silence::Killed).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "measures time: wants both cores for itself"]
async fn a_peer_frozen_just_before_it_would_be_asked_is_named_within_a_second() {
    in_time(Silence::Frozen).await;
}
