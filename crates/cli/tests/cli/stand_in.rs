//! A session that plays the diagnosers of a structure.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use session::Network;
use tokio::task::JoinHandle;
use vocabulary::{
    Candidate, ComponentPath, Evidence, FaultSize, FaultState, FaultTransition, FreezeFrame,
    FreezeFrameQuestion, HistoryPage, HistoryQuestion, Identification, Injected, Injection, Key,
    Mention, Message, ModuleName, ModulePhase, ModuleStatus, Obeyed, Order, OrderKind, PeerStatus,
    PlantTopic, Refused, RunId, Step, Stroke, StrokeBegun, StructureName, Topic,
};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::Query;

use crate::binary::{Outcome, run};

/// From one status to the next; a diagnoser takes a second.
const STATUS_PERIOD: Duration = Duration::from_millis(50);
/// Transitions on a page, so that a short journal has several.
const PAGE: usize = 2;

/// Diagnosers in a session of their own that listens at an endpoint.
pub(crate) struct StandIn {
    session: Session,
    pub(crate) endpoint: String,
    structure: StructureName,
    tokens: Vec<LivelinessToken>,
    tasks: Vec<JoinHandle<()>>,
}

/// What a diagnoser does with an order.
pub(crate) type Judge = dyn Fn(OrderKind, &Order) -> Result<Obeyed, String> + Send + Sync;

impl StandIn {
    pub(crate) async fn open(structure: &str) -> StandIn {
        StandIn::connected_to(structure, &[]).await
    }

    pub(crate) async fn connected_to(structure: &str, others: &[&StandIn]) -> StandIn {
        let endpoint = nowhere();
        let connect = others.iter().map(|other| other.endpoint.clone()).collect();
        let listen = vec![endpoint.clone()];
        let network = Network { listen, connect, ..Network::default() };
        let session = session::open(&network).await.unwrap();
        StandIn {
            session,
            endpoint,
            structure: structure.parse().unwrap(),
            tokens: Vec::new(),
            tasks: Vec::new(),
        }
    }

    /// Another structure behind the same endpoint.
    pub(crate) fn also(&self, structure: &str) -> StandIn {
        StandIn {
            session: self.session.clone(),
            endpoint: self.endpoint.clone(),
            structure: structure.parse().unwrap(),
            tokens: Vec::new(),
            tasks: Vec::new(),
        }
    }

    /// A liveliness token, declared last of all.
    pub(crate) async fn token(&mut self, module: &str) {
        let key = self.key(module, Topic::Alive);
        self.tokens.push(self.session.liveliness().declare_token(key).await.unwrap());
    }

    /// Answers queries for the state of components.
    pub(crate) async fn states(&self, module: &str, states: Vec<FaultTransition>) {
        let watched = vocabulary::keys::Watched {
            structure: Some(&self.structure),
            module: Some(&module.parse().unwrap()),
        };
        let keys: Vec<String> = states
            .iter()
            .map(|state| self.key(module, Topic::Fault(state.component.component.clone())))
            .collect();
        self.serve(watched.faults(), move |query| {
            for (key, state) in keys.iter().zip(&states) {
                reply(&query, key, state);
            }
        })
        .await;
    }

    /// Answers queries for what a fault is.
    pub(crate) async fn identified(&self, found: Identification) {
        let topic = Topic::Identification(found.component.component.clone());
        let key = self.key(found.module.as_str(), topic);
        self.serve(key.clone(), move |query| reply(&query, &key, &found)).await;
    }

    /// Answers questions for freeze frames.
    pub(crate) async fn frames(&self, module: &str, frames: Vec<FreezeFrame>) {
        let key = self.key(module, Topic::FreezeFrame);
        self.serve(key.clone(), move |query| {
            let asked = FreezeFrameQuestion::from_parameters(query.parameters().as_str()).unwrap();
            for frame in &frames {
                match asked.transition {
                    None => {
                        let mut head = frame.clone();
                        head.signals.steps.clear();
                        head.signals.traces.clear();
                        reply(&query, &key, &head);
                    }
                    Some(number) if number == frame.signals.sequence => reply(&query, &key, frame),
                    Some(_) => {}
                }
            }
        })
        .await;
    }

    /// Publishes the module's status periodically.
    pub(crate) async fn statuses(&mut self, module: &str, phase: ModulePhase, peers: &[&str]) {
        let status = self.status(module, phase, peers);
        let publisher =
            self.session.declare_publisher(self.key(module, Topic::Status)).await.unwrap();
        self.tasks.push(tokio::spawn(async move {
            let mut ticks = tokio::time::interval(STATUS_PERIOD);
            loop {
                ticks.tick().await;
                publisher.put(vocabulary::encode(&status).unwrap()).await.unwrap();
            }
        }));
    }

    /// A journal with these sequence numbers, in short pages.
    pub(crate) async fn journal(&self, module: &str, transitions: Vec<FaultTransition>, next: u64) {
        self.journal_with(module, transitions, Vec::new(), next).await;
    }

    /// The same with identifications of faults, each on the page of its fault.
    pub(crate) async fn journal_with(
        &self,
        module: &str,
        transitions: Vec<FaultTransition>,
        identifications: Vec<Identification>,
        next: u64,
    ) {
        let (structure, module): (_, ModuleName) =
            (self.structure.clone(), module.parse().unwrap());
        let key = self.key(module.as_str(), Topic::History);
        self.serve(key.clone(), move |query| {
            let asked = HistoryQuestion::from_parameters(query.parameters().as_str()).unwrap();
            let later: Vec<_> =
                transitions.iter().filter(|t| t.sequence >= asked.since).cloned().collect();
            let shown: Vec<_> = later.iter().take(PAGE).cloned().collect();
            let on_page = |found: &&Identification| {
                shown.iter().any(|transition| transition.sequence == found.sequence)
            };
            let page = HistoryPage {
                structure: structure.clone(),
                module: module.clone(),
                identifications: identifications.iter().filter(on_page).cloned().collect(),
                phases: Vec::new(),
                transitions: shown.clone(),
                first_sequence: transitions.first().map(|transition| transition.sequence),
                next_sequence: next,
                more: later.len() > PAGE,
            };
            reply(&query, &key, &page);
        })
        .await;
    }

    /// Takes orders; returns those that came.
    pub(crate) async fn orders(&self, module: &str, judge: Arc<Judge>) -> Arc<Mutex<Vec<Order>>> {
        let orders = Arc::new(Mutex::new(Vec::new()));
        for kind in OrderKind::ALL {
            let key = self.key(module, Topic::Command(kind));
            let (judge, orders) = (judge.clone(), orders.clone());
            self.serve(key.clone(), move |query| {
                let payload = query.payload().unwrap().to_bytes();
                let order: Order = vocabulary::decode(&payload).unwrap();
                match judge(kind, &order) {
                    Ok(obeyed) => reply(&query, &key, &obeyed),
                    Err(reason) => refuse(&query, reason),
                }
                orders.lock().unwrap().push(order);
            })
            .await;
        }
        orders
    }

    /// A plant that is there and takes faults and repairs; returns those that came. It knows no `sensor/g9`.
    pub(crate) async fn plant(&mut self) -> Arc<Mutex<Vec<Injection>>> {
        self.plant_that_takes(PlantTopic::Inject, |injection: &Injection| {
            let component = known(&injection.component)?;
            Ok(Injected { component, effective_step: injection.at_step.unwrap_or(Step(4711)) })
        })
        .await
    }

    /// A plant that is there and takes stroke tests, of a thousand steps a second; returns those that came. It knows
    /// no `actuator/a9`.
    pub(crate) async fn plant_with_strokes(&mut self) -> Arc<Mutex<Vec<Stroke>>> {
        self.plant_that_takes(PlantTopic::Stroke, |stroke: &Stroke| {
            let component = known(&stroke.component)?;
            let last_step = Step(4710 + (stroke.duration_s * 1e3) as u64);
            Ok(StrokeBegun { component, first_step: Step(4711), last_step })
        })
        .await
    }

    async fn plant_that_takes<O: Message + Send + 'static, R: Message>(
        &mut self,
        topic: PlantTopic,
        judge: impl Fn(&O) -> Result<R, String> + Send + Sync + 'static,
    ) -> Arc<Mutex<Vec<O>>> {
        let orders = Arc::new(Mutex::new(Vec::new()));
        let (key, taken) = (Key::of_plant(&self.structure, topic).to_string(), orders.clone());
        self.serve(key.clone(), move |query| {
            let order: O = vocabulary::decode(&query.payload().unwrap().to_bytes()).unwrap();
            match judge(&order) {
                Ok(obeyed) => reply(&query, &key, &obeyed),
                Err(reason) => refuse(&query, reason),
            }
            taken.lock().unwrap().push(order);
        })
        .await;
        let alive = Key::of_plant(&self.structure, PlantTopic::Alive).to_string();
        self.tokens.push(self.session.liveliness().declare_token(alive).await.unwrap());
        orders
    }

    /// Publishes a verdict.
    pub(crate) async fn publish(&self, transition: &FaultTransition) {
        let topic = Topic::Fault(transition.component.component.clone());
        let key = self.key(transition.module.as_str(), topic);
        self.session.put(key, vocabulary::encode(transition).unwrap()).await.unwrap();
    }

    /// Answers queries on a topic with this text.
    pub(crate) async fn text(&self, module: &str, topic: Topic, text: String) {
        let key = self.key(module, topic);
        self.serve(key.clone(), move |query| {
            zenoh::Wait::wait(query.reply(&key, text.as_str())).unwrap();
        })
        .await;
    }

    /// Takes questions on a topic and never answers them.
    pub(crate) async fn silence(&self, module: &str, topic: Topic) {
        let key = self.key(module, topic);
        let kept = Mutex::new(Vec::new());
        self.serve(key, move |query| kept.lock().unwrap().push(query)).await;
    }

    /// A module that is present, and publishes its status and its states.
    pub(crate) async fn module(
        &mut self,
        module: &str,
        phase: ModulePhase,
        peers: &[&str],
        states: Vec<FaultTransition>,
    ) {
        self.states(module, states).await;
        self.statuses(module, phase, peers).await;
        self.token(module).await;
    }

    pub(crate) fn transition(
        &self,
        component: &str,
        state: FaultState,
        sequence: u64,
    ) -> FaultTransition {
        transition(&self.structure, component, state, sequence)
    }

    fn key(&self, module: &str, topic: Topic) -> String {
        Key::of_module(&self.structure, &module.parse().unwrap(), topic).to_string()
    }

    async fn serve(&self, key: String, answer: impl Fn(Query) + Send + Sync + 'static) {
        self.session
            .declare_queryable(key)
            .complete(true)
            .callback(answer)
            .background()
            .await
            .unwrap();
    }

    fn status(&self, module: &str, phase: ModulePhase, peers: &[&str]) -> ModuleStatus {
        let peer = |name: &&str| PeerStatus {
            present: true,
            ..PeerStatus::unasked(name.parse().unwrap())
        };
        ModuleStatus {
            structure: self.structure.clone(),
            module: module.parse().unwrap(),
            software: "0.2.0".to_owned(),
            thresholds: "made up".to_owned(),
            reference: None,
            phase,
            in_service_since_step: Some(Step(2512)),
            run: None,
            step: Some(Step(4711)),
            lag_ms: Some(0.8),
            sample_age_ms: Some(1.1),
            queued_samples: 0,
            latched: 0,
            unconfirmed: 0,
            unknown: 0,
            verified: 0,
            shelved: 0,
            suppressed: None,
            waiting_questions: 0,
            next_sequence: 4,
            journal: vocabulary::JournalStatus {
                directory: Some("journal".to_owned()),
                ..vocabulary::JournalStatus::default()
            },
            peers: peers.iter().map(peer).collect(),
            another_process: false,
            intake: vocabulary::IntakeCounters::default(),
            inquiries: vocabulary::InquiryCounters::default(),
            diagnosis: vocabulary::Counters::default(),
            publisher: vocabulary::PublisherCounters::default(),
            certificate_until_unix_s: None,
            margins: Vec::new(),
            time_unix_ns: 1_795_000_000_000_000_000,
        }
    }

    /// Runs a command against this session; it has time for what is to come, unless its arguments say how much.
    pub(crate) fn run(&self, arguments: &[&str]) -> Outcome {
        let mut arguments = [arguments, &["--connect", &self.endpoint]].concat();
        if !arguments.contains(&"--timeout") {
            arguments.extend(["--timeout", "30"]);
        }
        tokio::task::block_in_place(|| run(&arguments))
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        for task in &self.tasks {
            task.abort();
        }
    }
}

/// What a fault is, without a signature.
pub(crate) fn identification(
    transition: &FaultTransition,
    decided: bool,
    candidates: Vec<Candidate>,
) -> Identification {
    Identification {
        structure: transition.structure.clone(),
        module: transition.module.clone(),
        component: transition.component.clone(),
        run: RunId(7),
        sequence: transition.sequence,
        as_of_step: Step(4108),
        decided,
        candidates,
        signature: None,
        since_unix_ns: None,
        time_unix_ns: transition.time_unix_ns + 1_000_000_000,
    }
}

/// A bias of +45.1 µm.
pub(crate) fn bias(probability: f64) -> Candidate {
    let (value, low, high) = (45.1e-6, 44.8e-6, 45.4e-6);
    let size = Some(FaultSize { value, low, high, own_unit: false });
    Candidate { kind: vocabulary::fault::FaultKind::Bias.into(), probability, size }
}

/// A transition with everything that a fault has.
fn transition(
    structure: &StructureName,
    component: &str,
    state: FaultState,
    sequence: u64,
) -> FaultTransition {
    let evidence = Evidence {
        step: Step(3112),
        residual: -6.1e-4,
        level: 0.0,
        divergence: Some(4226.0),
        threshold: 10.0,
    };
    FaultTransition {
        verdict: vocabulary::Verdict::example(state),
        sequence,
        onset_step: Some(Step(3108)),
        detection_step: Some(Step(3112)),
        decided_step: Some(Step(3118)),
        evidence: Some(evidence),
        ..FaultTransition::untouched(
            structure.clone(),
            component.parse().unwrap(),
            1_795_000_000_000_000_000 + sequence * 250_000_000,
        )
    }
}

/// The component that is mentioned, unless it is the ninth.
fn known(mention: &Mention) -> Result<ComponentPath, String> {
    let Mention { module, component } = mention.clone();
    let path = ComponentPath { module: module.unwrap(), component };
    if path.component.name().ends_with('9') {
        Err(format!("there is no `{path}`"))
    } else {
        Ok(path)
    }
}

fn reply<M: Message>(query: &Query, key: &str, message: &M) {
    zenoh::Wait::wait(query.reply(key, vocabulary::encode(message).unwrap())).unwrap();
}

fn refuse(query: &Query, reason: String) {
    zenoh::Wait::wait(query.reply_err(vocabulary::encode(&Refused { reason }).unwrap())).unwrap();
}

/// An endpoint without a listener.
pub(crate) fn nowhere() -> String {
    session::loopback::endpoints().map(|[endpoint]| endpoint).unwrap()
}
