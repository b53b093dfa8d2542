//! Diagnosers are killed two hundred times at random moments around the onsets of faults: no fault that
//! was published is ever missing from the history, a subscriber gets every one in the history, numbers have no gap, and
//! every start takes up what was there before. At every fourth kill the disk has hung for a moment.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use system_tests::deployment::{Deployment, MODULES};
use system_tests::interposer::Interposer;
use system_tests::kills::audit::Audit;
use system_tests::kills::collection::{Collection, same};
use system_tests::kills::logs::Lives;
use system_tests::kills::operator::Operator;
use system_tests::kills::plan::{Kill, Plan};
use system_tests::kills::summary::Summary;
use system_tests::observer::{Observer, states};
use system_tests::plant_clock::PlantClock;
use system_tests::process::Process;
use system_tests::turn;
use vocabulary::{ComponentPath, FaultState, FaultTransition, ModuleName, RunId};

/// Kills, unless the environment variable `TRUSSWATCH_KILLS` says otherwise.
const KILLS: usize = 200;
const SEED: u64 = 20;
const RUN: RunId = RunId(1);
/// So long before a kill the disk hangs, if it does \[steps\].
const HUNG: u64 = 100;
/// After the last fault is over, until everything has settled \[steps\].
const REST: u64 = 3000;

/// Everything that is there during the kills.
struct Scene {
    deployment: Deployment,
    diagnosers: Vec<Process>,
    observer: Observer,
    collection: Collection,
    operator: Operator,
    clock: PlantClock,
    interposers: [Arc<Interposer>; 2],
    kills: usize,
    problems: Vec<String>,
}

impl Scene {
    async fn set(plan: &Plan) -> Self {
        let deployment = Deployment::of_watched_tower(&plan.schedule);
        let observer = Observer::of(&deployment).await;
        let collection = Collection::of(&observer).await;
        let interposers = [0, 1].map(|index| deployment.interpose(index));
        let diagnosers = deployment.start_diagnosers();
        observer.wait_for(&MODULES, false).await;
        let operator = Operator::of(&observer, RUN, plan.schedule.clone()).await;
        let clock = PlantClock::of(&observer).await;
        let problems = Vec::new();
        Self {
            deployment,
            diagnosers,
            observer,
            collection,
            operator,
            clock,
            interposers,
            kills: 0,
            problems,
        }
    }

    async fn kill(&mut self, kill: Kill) {
        let disk = &self.interposers[kill.victim];
        let hangs = self.kills.is_multiple_of(4);
        self.kills += 1;
        if hangs {
            self.clock.reach(RUN, kill.at_step.saturating_sub(HUNG)).await;
            disk.order("hang");
        }
        self.clock.reach(RUN, kill.at_step).await;
        let victim = &mut self.diagnosers[kill.victim];
        if !victim.is_running() {
            self.problems.push(format!("{} has ended by itself", MODULES[kill.victim]));
        }
        victim.crash().await;
        if hangs {
            disk.call_off("hang");
        }
        *victim = self.deployment.start_diagnoser(kill.victim);
    }

    /// Compares the histories with everything published and obeyed so far.
    async fn audit(&mut self) -> Vec<Audit> {
        self.observer.wait_for(&MODULES, false).await;
        let (collected, books) = (self.collection.so_far(), self.operator.books());
        let mut audits = Vec::new();
        for module in MODULES.map(|name| name.parse::<ModuleName>().unwrap()) {
            let audit = Audit::of(&self.observer, &module, &collected, &books).await;
            self.problems.extend(audit.problems.iter().cloned());
            audits.push(audit);
        }
        audits
    }

    /// The present states of all components that ever had a transition.
    async fn states(&self) -> BTreeMap<ComponentPath, FaultTransition> {
        let states = states(&self.observer.session).await.into_iter();
        let changed = states.filter(|state| state.sequence > 0).map(last_judged);
        changed.map(|state| (state.component.clone(), state)).collect()
    }

    /// When settled, the last transitions of the histories are the present states.
    async fn compare_with_the_present(&mut self, audits: &[Audit]) {
        let last = audits.iter().flat_map(Audit::latest);
        let last: BTreeMap<_, _> =
            last.map(|(component, state)| (component, last_judged(state))).collect();
        let present = self.states().await;
        let agrees =
            |(component, state)| present.get(component).is_some_and(|present| same(present, state));
        if last.len() != present.len() || !last.iter().all(agrees) {
            self.problems.push(format!("the present is {present:#?}, the histories say {last:#?}"));
        }
    }

    /// One fault has many consequences; the first ones suffice.
    fn check(&self) {
        let (first, count) = (self.problems.iter().take(10), self.problems.len());
        assert!(count == 0, "{count} problems: {:#?}", first.collect::<Vec<_>>());
    }

    fn sum_up(&mut self, audits: &[Audit], took: Duration) -> Summary {
        let (collected, books) = (self.collection.so_far(), self.operator.books());
        let logs = self.diagnosers.iter().map(Process::log);
        let lives: Vec<Lives> = logs.map(|log| Lives::found_in(&log)).collect();
        self.problems.extend(collected.contradictions.iter().chain(&books.senseless).cloned());
        self.problems.extend(lives.iter().flat_map(|lives| &lives.complaints).cloned());
        Summary::of((self.kills, took), audits, &collected, &books, &lives)
    }
}

/// What a state was when it was judged last, whatever has become unknown since, for the plant has ended by then, and
/// whatever else has been found of the fault. Transitions have no condition, states have the present one.
fn last_judged(mut state: FaultTransition) -> FaultTransition {
    if state.unknown.take().is_some() && state.state() == FaultState::Unknown {
        state.verdict = vocabulary::Verdict::Normal;
    }
    state.identification = None;
    state.condition = None;
    state
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes three minutes and a machine of its own: run it with `--ignored`"]
async fn two_hundred_kills_lose_no_fault() {
    let _turn = turn::alone().await;
    let started = Instant::now();
    let kills = std::env::var("TRUSSWATCH_KILLS").map_or(KILLS, |kills| kills.parse().unwrap());
    let plan = Plan::draw(SEED, kills);
    let mut scene = Scene::set(&plan).await;
    let steps = plan.over + REST;
    let mut plant = scene.deployment.start_plant("real", steps, SEED, RUN);
    for batch in &plan.batches {
        for kill in batch {
            scene.kill(*kill).await;
        }
        scene.audit().await;
        scene.check();
    }
    assert_eq!(plant.exit_code().await, Some(0), "{}", plant.log());
    for module in MODULES {
        let last = Some(vocabulary::Step(steps - 1));
        scene.observer.status_of(module, |status| status.step == last).await;
    }
    let audits = scene.audit().await;
    for audit in &audits {
        scene.collection.has_all(&audit.history).await;
    }
    scene.compare_with_the_present(&audits).await;
    let summary = scene.sum_up(&audits, started.elapsed());
    println!("{summary}");
    scene.check();
    let faults = plan.schedule.faults.len();
    assert!(summary.latched > faults / 4, "{} of {faults} faults latched", summary.latched);
    assert!(summary.obeyed > faults / 4, "{} orders obeyed", summary.obeyed);
    assert!(summary.ready > kills / 2, "ready {} times", summary.ready);
    for process in std::mem::take(&mut scene.diagnosers) {
        process.stop().await;
    }
}
