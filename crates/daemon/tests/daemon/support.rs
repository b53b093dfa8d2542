//! What several tests need: a reference in one process, processes as tasks, an observer.

use std::collections::{BTreeMap, VecDeque};
use std::future::Future;
use std::path::{Path, PathBuf};
use std::time::Duration;

use daemon::config::{DiagnoserConfig, PlantConfig, PlantFlags, load_diagnoser, load_plant};
use diagnosis::{Action, Diagnoser, Event, Measurements, PeerFailure, QuestionToken, Transition};
use session::Network;
use shell::exit::Failure;
use shell::shutdown::{self, Trigger};
use tokio::task::JoinHandle;
use vocabulary::{ModuleName, ModuleStatus, RunId};
use zenoh::Session;

/// No step of a test takes longer than this, on a busy machine either.
pub const LIMIT: Duration = Duration::from_secs(180);
/// The longest lease that a session may have [ms].
const LONGEST_LEASE_MS: u32 = 60_000;

pub async fn in_time<F: Future>(what: &str, future: F) -> F::Output {
    match tokio::time::timeout(LIMIT, future).await {
        Ok(output) => output,
        Err(_) => panic!("{what} did not happen within {LIMIT:?}"),
    }
}

pub fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs")
}

/// A free endpoint.
pub fn free_endpoint() -> String {
    session::loopback::endpoints().map(|[endpoint]| endpoint).unwrap()
}

/// A plant and its diagnosers, each with an endpoint of its own.
pub struct Rig {
    pub plant: PlantConfig,
    pub diagnosers: Vec<DiagnoserConfig>,
    pub endpoints: Vec<String>,
}

impl Rig {
    /// From the shipped files.
    pub fn new(plant: &str, modules: &[&str], flags: &PlantFlags) -> Self {
        let mut plant = load_plant(&configs().join(plant), flags).unwrap();
        let load = |file: &&str| load_diagnoser(&configs().join(file)).unwrap();
        let mut diagnosers: Vec<_> = modules.iter().map(load).collect();
        let endpoints: Vec<String> = (0..=modules.len()).map(|_| free_endpoint()).collect();
        plant.network = Network { listen: vec![endpoints[0].clone()], ..Network::default() };
        for (index, diagnoser) in diagnosers.iter_mut().enumerate() {
            let own = index + 1;
            diagnoser.network = Network {
                listen: vec![endpoints[own].clone()],
                connect: endpoints[..own].to_vec(),
                ..Network::default()
            };
        }
        Self { plant, diagnosers, endpoints }
    }

    /// With the longest limits that may be configured, for tests of which these are not the subject: on a busy machine
    /// an answer takes longer than the shipped ones allow.
    pub fn patient(mut self) -> Self {
        self.plant.network.lease_ms = Some(LONGEST_LEASE_MS);
        self.plant.lock_step.timeout_ms = 3_600_000;
        for diagnoser in &mut self.diagnosers {
            diagnoser.network.lease_ms = Some(LONGEST_LEASE_MS);
            diagnoser.queries.timeout_ms = 10_000;
            diagnoser.queries.pause_ms = 10_000;
            diagnoser.queries.hold_ms = 60_000;
            diagnoser.input.stale_after_ms = 3_600_000;
            diagnoser.input.resync_after_ms = 60_000;
            diagnoser.input.incumbent_ms = 60_000;
        }
        self
    }

    pub fn start_plant(&self) -> Process {
        let (trigger, shutdown) = shutdown::pair();
        let config = self.plant.clone();
        Process { trigger, task: tokio::spawn(daemon::plant::run(config, shutdown)) }
    }

    pub fn start_diagnoser(&self, index: usize) -> Process {
        let (trigger, shutdown) = shutdown::pair();
        let config = self.diagnosers[index].clone();
        Process { trigger, task: tokio::spawn(daemon::diagnoser::run(config, shutdown)) }
    }

    pub fn modules(&self) -> Vec<ModuleName> {
        self.diagnosers.iter().map(|diagnoser| diagnoser.module().clone()).collect()
    }

    /// A session that is connected to everybody. Nobody gives it up because it is kept waiting.
    pub async fn observer(&self) -> Session {
        let lease_ms = Some(LONGEST_LEASE_MS);
        let network = Network { lease_ms, ..Network::peer_of(&self.endpoints) };
        in_time("the observer's session", session::open(&network)).await.unwrap()
    }
}

/// The first status of any module that is wanted.
pub async fn status(observer: &Session, wanted: impl Fn(&ModuleStatus) -> bool) -> ModuleStatus {
    let read = |received: &zenoh::sample::Sample| {
        vocabulary::decode::<ModuleStatus>(&received.payload().to_bytes()).ok().filter(&wanted)
    };
    first(observer, "trusswatch/*/*/status", "the status wanted", read).await
}

/// What `read` makes of the first message on these keys of which it makes anything.
pub async fn first<T>(
    observer: &Session,
    keys: &str,
    what: &str,
    read: impl Fn(&zenoh::sample::Sample) -> Option<T>,
) -> T {
    let messages = observer.declare_subscriber(keys).await.unwrap();
    in_time(what, async {
        loop {
            let received = messages.recv_async().await.unwrap();
            if let Some(found) = read(&received) {
                return found;
            }
        }
    })
    .await
}

/// A process that runs as a task.
pub struct Process {
    pub trigger: Trigger,
    pub task: JoinHandle<Result<(), Failure>>,
}

impl Process {
    pub async fn stop(self) {
        self.trigger.pull();
        self.end().await;
    }

    pub async fn end(self) {
        in_time("the end of a process", self.task).await.unwrap().unwrap();
    }
}

/// The same in one process: everybody sees every step at once, and every question is answered.
pub struct Reference {
    plant: plant::Plant,
    pub diagnosers: Vec<Diagnoser>,
    names: Vec<ModuleName>,
    agenda: Vec<daemon::config::ScheduledFault>,
    pub transitions: Vec<(ModuleName, Transition)>,
    pub largest: BTreeMap<String, f64>,
    /// As they would be published.
    pub samples: Vec<vocabulary::Sample>,
}

impl Reference {
    pub fn new(rig: &Rig) -> Self {
        let diagnosers =
            rig.diagnosers.iter().map(|config| Diagnoser::new(config.module_setup()).unwrap());
        Self {
            plant: rig.plant.make_plant().unwrap(),
            diagnosers: diagnosers.collect(),
            names: rig.modules(),
            agenda: rig.plant.schedule.faults.clone(),
            transitions: Vec::new(),
            largest: BTreeMap::new(),
            samples: Vec::new(),
        }
    }

    pub fn run(&mut self, run: RunId, steps: u64) {
        for _ in 0..steps {
            self.step(run);
        }
    }

    fn step(&mut self, run: RunId) {
        let step = self.plant.next_step();
        for fault in &self.agenda {
            if fault.until_step == Some(step) {
                self.plant.clear(&fault.component).unwrap();
            }
            if fault.at_step == step {
                self.plant.inject(&fault.component, fault.fault).unwrap();
            }
        }
        let signals = self.plant.advance().clone();
        let mut events = VecDeque::new();
        for module in &signals.modules {
            let index = self.names.iter().position(|name| *name == module.module).unwrap();
            let sample = Measurements {
                run,
                step,
                demands_n: module.demands_n.clone(),
                pressures_pa: module.pressures_pa.clone(),
                elongations_m: module.elongations_m.clone(),
            };
            self.samples.push(published(module.module.clone(), &sample));
            events.push_back((index, Event::Sample(sample)));
        }
        let mut askers = Vec::new();
        while let Some((index, event)) = events.pop_front() {
            let mut actions = Vec::new();
            self.diagnosers[index].handle(event, &mut actions);
            for action in actions {
                self.carry_out(index, action, &mut events, &mut askers);
            }
        }
        for (diagnoser, name) in self.diagnosers.iter().zip(&self.names) {
            for (component, evidence) in diagnoser.components().iter().zip(diagnoser.evidence()) {
                let largest = self.largest.entry(format!("{name}/{component}")).or_default();
                if diagnoser.phase() == vocabulary::ModulePhase::InService {
                    *largest = largest.max(evidence.divergence.unwrap_or(0.0));
                }
            }
        }
    }

    fn carry_out(
        &mut self,
        index: usize,
        action: Action,
        events: &mut VecDeque<(usize, Event)>,
        askers: &mut Vec<(usize, vocabulary::StateQuestion)>,
    ) {
        match action {
            Action::Publish(transition) => {
                self.transitions.push((self.names[index].clone(), transition));
            }
            Action::Ask { peer, question } => {
                let token = QuestionToken(askers.len() as u64);
                askers.push((index, question));
                let peer = self.names.iter().position(|name| *name == peer).unwrap();
                events.push_back((peer, Event::Asked { token, question }));
            }
            Action::Answer { token, answer } => {
                let asker = askers[usize::try_from(token.0).unwrap()].0;
                events.push_back((asker, Event::Answered(answer)));
            }
            Action::Refuse { token, refusal } => {
                let (asker, question) = askers[usize::try_from(token.0).unwrap()];
                let failure = PeerFailure::Refused(refusal.to_string());
                let peer = self.names[index].clone();
                events.push_back((asker, Event::Unanswered { peer, question, failure }));
            }
            _ => {}
        }
    }
}

fn published(module: ModuleName, sample: &Measurements) -> vocabulary::Sample {
    let Measurements { run, step, demands_n, pressures_pa, elongations_m } = sample.clone();
    vocabulary::Sample {
        module,
        run,
        step,
        time_unix_ns: 0,
        demands_n,
        pressures_pa,
        elongations_m,
        readings: Vec::new(),
        block: Vec::new(),
    }
}

/// One transition, without what differs from run to run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    pub component: String,
    pub state: String,
    pub onset: u64,
    pub detection: u64,
    pub decided: u64,
    pub explained_by: Option<String>,
}

/// All transitions, by module and sequence number.
pub type Story = BTreeMap<(String, u64), Outcome>;

pub fn story_of_reference(reference: &Reference) -> Story {
    let outcome_of = |(module, transition): &(ModuleName, Transition)| {
        let explained_by = match &transition.verdict {
            diagnosis::Verdict::Explained { by, .. } => Some(by.to_string()),
            _ => None,
        };
        let outcome = Outcome {
            component: format!("{module}/{}", transition.component),
            state: transition.verdict.as_str().to_owned(),
            onset: transition.onset.0,
            detection: transition.detection.0,
            decided: transition.decided.0,
            explained_by,
        };
        ((module.to_string(), transition.sequence), outcome)
    };
    reference.transitions.iter().map(outcome_of).collect()
}

/// Takes a transition into the story.
pub fn note(story: &mut Story, transition: &vocabulary::FaultTransition) {
    let step = |step: Option<vocabulary::Step>| step.unwrap().0;
    let outcome = Outcome {
        component: transition.component.to_string(),
        state: transition.state().to_string(),
        onset: step(transition.onset_step),
        detection: step(transition.detection_step),
        decided: step(transition.decided_step),
        explained_by: transition.verdict.explained_by().map(ToString::to_string),
    };
    story.insert((transition.module.to_string(), transition.sequence), outcome);
}
