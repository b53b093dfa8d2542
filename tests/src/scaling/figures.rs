//! Runs a row and measures.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::{ComponentPath, FaultState, FaultTransition, ModuleStatus, RunId, Step};

use super::plan::Plan;
use super::row::{Row, Setting};
use crate::footprint::{Memory, processor_time};
use crate::in_time;
use crate::observer::{Faults, Observer, Statuses};
use crate::plant_clock::PlantClock;
use crate::process::Process;
use crate::publications::Publications;
use crate::verdict::Reached;

const RUN: RunId = RunId(1);
/// Before the plant starts, nothing is published but statuses.
const IDLE: Duration = Duration::from_secs(4);
/// The plant is waited for in strides of this many steps, at any pace.
const STRIDE: u64 = 200;

/// What a process, or the mean of several, takes of the machine.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Taken {
    /// Share of a core \[%\].
    pub percent: f64,
    /// Proportional share of memory \[MiB\].
    pub mib: f64,
}

/// What was measured of a row.
#[derive(Debug, Clone)]
pub struct Figures {
    /// The row.
    pub setting: Setting,
    /// Share of a core of a diagnoser while there are no samples, in the mean \[%\].
    pub idle_percent: f64,
    /// A diagnoser while nothing happens, in the mean.
    pub diagnoser: Taken,
    /// The plant meanwhile.
    pub plant: Taken,
    /// The router meanwhile.
    pub router: Option<Taken>,
    /// From the onset of each fault to the sample that decided \[steps\].
    pub steps: Vec<f64>,
    /// From the publication of that sample to the arrival of the verdict at a third party \[ms\].
    pub delays_ms: Vec<f64>,
    /// Final verdicts: what was latched, and the effects that were explained.
    pub verdicts: u64,
    /// Questions that were asked for them.
    pub questions: u64,
    /// Questions that were not answered in time.
    pub unanswered: u64,
    /// Samples that were dropped, or never came.
    pub lost: u64,
    /// Components that were latched though healthy, and faulty ones that were not.
    pub wrong: Vec<String>,
}

/// Time of the processors that some processes have had, at a time.
struct Meter<'a> {
    processes: &'a [Process],
    before: Vec<Duration>,
    start: Instant,
}

impl<'a> Meter<'a> {
    fn start(processes: &'a [Process]) -> Self {
        let before = processes.iter().map(|process| processor_time(process.pid())).collect();
        Self { processes, before, start: Instant::now() }
    }

    /// Of each process since the start, in the mean.
    fn read(&self) -> Taken {
        let elapsed = self.start.elapsed().as_secs_f64();
        let count = self.processes.len() as f64;
        let mut taken = Taken::default();
        for (process, before) in self.processes.iter().zip(&self.before) {
            let spent = processor_time(process.pid()) - *before;
            taken.percent += 100.0 * spent.as_secs_f64() / elapsed / count;
            taken.mib += Memory::of(process.pid()).proportional_mib / count;
        }
        taken
    }
}

/// Runs a row by a plan.
///
/// # Panics
/// If a process does not come up, or a fault is not found in time.
pub async fn measure(setting: Setting, plan: &Plan) -> Figures {
    let row = Row::lay_out(setting, &plan.schedule());
    let router: Vec<Process> = row.start_router().into_iter().collect();
    let diagnosers = row.start_diagnosers();
    let observer = row.observer().await;
    row.wait_for_diagnosers(&observer).await;
    row.wait_for_each_other(&observer).await;
    let clock = PlantClock::of_module(&observer, &plan.modules()[0]).await;
    let publications = Publications::of_modules(&observer, &plan.modules()).await;
    let mut faults = observer.faults().await;

    let meter = Meter::start(&diagnosers);
    tokio::time::sleep(IDLE).await;
    let idle_percent = meter.read().percent;

    let plant = [row.start_plant()];
    reach(&clock, plan.quiet.start).await;
    let meters = [&diagnosers[..], &plant, &router].map(Meter::start);
    reach(&clock, plan.quiet.end).await;
    let [diagnoser, plant_taken, router_taken] = meters.map(|meter| meter.read());

    let verdicts = verdicts(&mut faults, plan).await;
    reach(&clock, plan.end()).await;
    let statuses = statuses_at(&observer, &setting, plan.end()).await;
    let mut all = verdicts.clone();
    all.extend(faults.arrived());
    let first = first_latched(&all);
    let found = plan
        .faults
        .iter()
        .filter_map(|(component, onset)| first.get(component).map(|arrival| (*onset, *arrival)));
    let found: Vec<_> = found.collect();
    let figures = Figures {
        setting,
        idle_percent,
        diagnoser,
        plant: plant_taken,
        router: (!router.is_empty()).then_some(router_taken),
        steps: found.iter().map(|(onset, found)| steps_between(*onset, &found.1)).collect(),
        delays_ms: publications.delays_ms(found.iter().map(|(_, found)| *found)).await,
        verdicts: all.iter().filter(|(_, message)| Reached::of_message(message).is_some()).count()
            as u64,
        questions: sum(&statuses, |status| status.diagnosis.questions_asked),
        unanswered: sum(&statuses, |status| status.diagnosis.questions_unanswered),
        lost: sum(&statuses, |status| status.intake.dropped + status.diagnosis.samples_missing),
        wrong: wrong(plan, &first),
    };
    for process in plant.into_iter().chain(diagnosers) {
        process.stop().await;
    }
    figures
}

async fn reach(clock: &PlantClock, step: u64) {
    let from = clock.step(RUN).map_or(0, |step| step.0);
    let mut at = from;
    while at < step {
        at = step.min(at + STRIDE);
        clock.reach(RUN, at).await;
    }
}

/// Everything that arrives until each fault of the plan is latched.
async fn verdicts(faults: &mut Faults, plan: &Plan) -> Vec<(u64, FaultTransition)> {
    let mut messages = Vec::new();
    let mut open: Vec<&ComponentPath> =
        plan.faults.iter().map(|(component, _)| component).collect();
    while !open.is_empty() {
        let (arrival, message) = faults.next().await;
        if message.state() == FaultState::Latched {
            open.retain(|component| **component != message.component);
        }
        messages.push((arrival, message));
    }
    messages
}

/// Statuses of all modules when all of them have got to a step.
async fn statuses_at(observer: &Observer, setting: &Setting, step: u64) -> Statuses {
    let latest = observer.statuses().await;
    let all = |statuses: &Statuses| {
        let there = |status: &&ModuleStatus| status.step.is_some_and(|at| at >= Step(step));
        let count = statuses.values().filter(there).count();
        (count == setting.diagnosers()).then(|| statuses.clone())
    };
    in_time("the statuses of all modules", latest.first(all)).await
}

type Arrivals<'a> = BTreeMap<ComponentPath, &'a (u64, FaultTransition)>;

fn first_latched(all: &[(u64, FaultTransition)]) -> Arrivals<'_> {
    let mut first = Arrivals::new();
    for arrival in all.iter().filter(|(_, message)| message.state() == FaultState::Latched) {
        first.entry(arrival.1.component.clone()).or_insert(arrival);
    }
    first
}

fn steps_between(onset: Step, message: &FaultTransition) -> f64 {
    message.decided_step.unwrap().since(onset) as f64
}

fn sum(statuses: &Statuses, figure: impl Fn(&ModuleStatus) -> u64) -> u64 {
    statuses.values().map(figure).sum()
}

fn wrong(plan: &Plan, latched: &Arrivals<'_>) -> Vec<String> {
    let faulty =
        |component: &ComponentPath| plan.faults.iter().any(|(other, _)| other == component);
    let healthy = latched.keys().filter(|component| !faulty(component));
    let missed = plan.faults.iter().filter(|(component, _)| !latched.contains_key(component));
    let healthy = healthy.map(|component| format!("{component} is healthy"));
    healthy.chain(missed.map(|(component, _)| format!("{component} was missed"))).collect()
}
