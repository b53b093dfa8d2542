//! The deployment of a row: its processes, and how far the plant has come.

use std::collections::BTreeMap;
use std::process::ExitStatus;
use std::sync::Arc;
use std::time::Duration;

use daemon::config::Schedule;
use nix::sys::signal::Signal;
use session::Network;
use vocabulary::{ModuleName, RunId, Step};
use zenoh::Session;

use super::record::{Record, Standing};
use super::witness::Witness;
use crate::deployment::Deployment;
use crate::lab::{Lab, Node};
use crate::observer::Observer;
use crate::plant_clock::PlantClock;
use crate::process::Process;
use crate::reference;

/// The same wind, loads and noise in every row.
const SEED: u64 = 100;

/// Steps that the plant is good for beyond those of a row: on a busy machine processes start and settle late, and a
/// module that comes after the last sample hears none. The plant is stopped when the row is done.
const SPARE_STEPS: u64 = 20_000;

/// A standstill that is worth reporting; a module publishes its progress some fifty times a second.
const WORTH_TELLING: Duration = Duration::from_millis(300);

/// The processes of a row in a laboratory, and the monitoring client.
pub struct Stage {
    // Before the laboratory: the processes end before their network does.
    processes: BTreeMap<Node, Process>,
    witness: Witness,
    clock: PlantClock,
    pub(super) observer: Observer,
    pub(super) lab: Arc<Lab>,
    deployment: Deployment,
    run: RunId,
    steps: u64,
}

/// What is there before any process: the network and the configurations.
pub struct Site {
    /// The network.
    pub lab: Arc<Lab>,
    /// The configurations.
    pub deployment: Deployment,
}

impl Site {
    /// A place for a run with these faults.
    #[must_use]
    pub fn new(lab: Lab, schedule: &Schedule) -> Self {
        let lab = Arc::new(lab);
        let deployment = Deployment::in_lab(schedule, Arc::clone(&lab));
        Self { lab, deployment }
    }

    /// A session of the test connected to this node only.
    pub(super) async fn session_with(&self, node: Node) -> Session {
        session_with(&self.deployment, node).await
    }
}

async fn session_with(deployment: &Deployment, node: Node) -> Session {
    let endpoint = deployment.endpoints[node.index()].clone();
    session::open(&Network::peer_of(&[endpoint])).await.unwrap()
}

impl Stage {
    /// Starts everything; the plant at last.
    pub(super) async fn raise(site: Site, steps: u64) -> Self {
        let Site { lab, deployment } = site;
        let run = RunId(1);
        // Before anything runs: it takes a while, and retry intervals of waiting processes grow.
        let timeline = tokio::task::block_in_place(|| {
            reference::timeline(&deployment, SEED, run, steps + SPARE_STEPS)
        });
        let diagnosers = [Node::Module1, Node::Module2];
        let processes = diagnosers.map(|node| (node, start_diagnoser(&deployment, node)));
        let observer = Observer::of(&deployment).await;
        observer.wait_for(&diagnosers.map(Node::name), false).await;
        let witness = Witness::of(&observer, Record::against(timeline, run)).await;
        let clock = PlantClock::of(&observer).await;
        let processes = processes.into();
        let mut stage = Self { processes, witness, clock, observer, lab, deployment, run, steps };
        stage.start_plant();
        stage
    }

    fn start_plant(&mut self) {
        let plant = self.deployment.start_plant("real", self.steps + SPARE_STEPS, SEED, self.run);
        self.processes.insert(Node::Plant, plant);
    }

    /// Kills a process at once.
    pub(super) async fn crash(&mut self, node: Node) {
        self.processes.remove(&node).unwrap().crash().await;
        self.observer.wait_until_gone(node.name()).await;
    }

    /// Waits until a process has ended by itself, and says how.
    pub(super) async fn ended(&mut self, node: Node) -> ExitStatus {
        let status = self.processes.remove(&node).unwrap().exit_status().await;
        self.observer.wait_until_gone(node.name()).await;
        status
    }

    /// Starts a process that was killed; the plant begins a new run. It is there when this returns.
    pub(super) async fn revive(&mut self, node: Node) {
        if node == Node::Plant {
            self.run = RunId(self.run.0 + 1);
            self.witness.record().begin_run(self.run);
            self.start_plant();
            self.observer.wait_for(&[], true).await;
        } else {
            self.processes.insert(node, start_diagnoser(&self.deployment, node));
            self.observer.wait_for(&[node.name()], false).await;
        }
    }

    /// Sends a process a signal.
    pub(super) fn signal(&self, node: Node, signal: Signal) {
        self.processes[&node].signal(signal);
    }

    /// A session of the test connected to this node only.
    pub(super) async fn session_with(&self, node: Node) -> Session {
        session_with(&self.deployment, node).await
    }

    /// Where this node listens.
    pub(super) fn endpoint_of(&self, node: Node) -> String {
        self.deployment.endpoints[node.index()].clone()
    }

    /// The configurations.
    pub(super) fn deployment(&self) -> &Deployment {
        &self.deployment
    }

    /// Waits until the plant is at a step, or beyond.
    pub(super) async fn reach(&self, step: u64) {
        self.clock.reach(self.run, step).await;
    }

    /// Waits for as many steps of the plant.
    pub(super) async fn pass(&self, steps: u64) {
        let now = self.clock.step(self.run).map_or(0, |step| step.0);
        self.reach(now + steps).await;
    }

    /// The plant's latest step.
    pub(super) fn step(&self) -> Step {
        self.clock.step(self.run).unwrap_or(Step(0))
    }

    /// How what the modules report now differs from an undisturbed run at the plant's step.
    pub(super) async fn differences(&self) -> Vec<String> {
        let now = self.step();
        let states = self.witness.states().await;
        self.witness.record().differences(&states, now)
    }

    /// What an undisturbed run finds.
    pub(super) fn expected(&self) -> String {
        self.witness.record().expected()
    }

    /// Waits until the plant has done the row's last step, and stops it.
    pub(super) async fn last_step(&mut self) {
        self.reach(self.steps).await;
        self.signal(Node::Plant, Signal::SIGTERM);
        let plant = self.processes.get_mut(&Node::Plant).unwrap();
        let code = plant.exit_code().await;
        if code != Some(0) {
            self.complain(format!("the plant ended with {code:?}"));
        }
    }

    /// Ends the diagnosers in order, and returns what was seen.
    pub(super) async fn close(mut self) -> Closing {
        for node in [Node::Module1, Node::Module2] {
            let Some(mut process) = self.processes.remove(&node) else { continue };
            process.signal(Signal::SIGTERM);
            let code = process.exit_code().await;
            if code != Some(0) {
                self.complain(format!("{} ended with {code:?}", node.name()));
            }
        }
        self.witness.dismiss().await;
        session::close(&self.observer.session).await;
        let record = self.witness.record();
        Closing {
            wrong: record.wrong.iter().cloned().collect(),
            unconfirmed: record.unconfirmed.len(),
            hardships: record.standings.iter().flat_map(hardships).collect(),
            logs: self.deployment.logs(),
        }
    }

    fn complain(&self, what: String) {
        self.witness.record().wrong.insert(what);
    }
}

/// What was seen in a row from beginning to end.
pub(super) struct Closing {
    /// Violations.
    pub(super) wrong: Vec<String>,
    /// How many components were unconfirmed at some time.
    pub(super) unconfirmed: usize,
    /// What the modules went through.
    pub(super) hardships: Vec<String>,
    /// What the processes logged.
    pub(super) logs: String,
}

/// Samples that a module has missed, and how long it got no further.
fn hardships((module, standing): (&ModuleName, &Standing)) -> Vec<String> {
    let mut words = Vec::new();
    if let Some(status) = &standing.status {
        let missing = status.diagnosis.samples_missing + status.intake.dropped;
        if missing > 0 {
            words.push(format!("{module} missed {missing} samples"));
        }
    }
    if standing.longest_standstill > WORTH_TELLING {
        let seconds = standing.longest_standstill.as_secs_f64();
        words.push(format!("{module} stood still {seconds:.1} s"));
    }
    words
}

fn start_diagnoser(deployment: &Deployment, node: Node) -> Process {
    deployment.start_diagnoser(node.index() - Node::Module1.index())
}
