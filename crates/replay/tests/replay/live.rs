//! The shipped plant and its diagnosers in one process, and everything that is published meanwhile.

use std::collections::VecDeque;
use std::path::Path;

use daemon::config::{DiagnoserConfig, PlantFlags, load_diagnoser, load_plant};
use diagnosis::identification::identify;
use diagnosis::messages::{Speaker, from_diagnoser, setup_fingerprint, to_taken};
use diagnosis::{
    Action, Change, Diagnoser, Event, Measurements, Memory, ModuleSetup, PastWatch, QuestionToken,
    StateQuestion,
};
use vocabulary::{
    Message, RunId, StatePart, Step, StructureName, Taken, Topic, encode, fault::Fault,
};

/// A message as it is recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Published {
    pub topic: String,
    pub payload: Vec<u8>,
    pub time_unix_ns: u64,
    pub step: u64,
}

impl Published {
    /// A part of a diagnoser's state.
    pub fn is_state(&self) -> bool {
        self.topic.ends_with("/input")
            && self.payload.windows(15).any(|w| w == br#""input":"state""#)
    }
}

struct Node {
    setup: ModuleSetup,
    diagnoser: Diagnoser,
    speaker: Speaker,
    process: u64,
    number: u64,
    watched_since: Option<Step>,
    changes: Vec<Change>,
}

/// A plant and its diagnosers.
pub struct Live {
    plant: plant::Plant,
    run: RunId,
    nodes: Vec<Node>,
    asked: Vec<(usize, StateQuestion)>,
    pub published: Vec<Published>,
    clock: u64,
}

const START: u64 = 1_700_000_000_000_000_000;

fn configurations() -> Vec<DiagnoserConfig> {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs");
    let load = |name: &str| load_diagnoser(&configs.join(name)).unwrap();
    ["module1.toml", "module2.toml"].map(load).into()
}

fn make_plant() -> plant::Plant {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs");
    load_plant(&configs.join("plant.toml"), &PlantFlags::default()).unwrap().make_plant().unwrap()
}

impl Live {
    /// The shipped ones, with what `change` does to their setups.
    pub fn new(change: impl Fn(&mut ModuleSetup)) -> Self {
        let structure: StructureName = "tower".parse().unwrap();
        let nodes = configurations().into_iter().map(|config| {
            let mut setup = config.module_setup();
            change(&mut setup);
            Node {
                diagnoser: Diagnoser::new(setup.clone()).unwrap(),
                speaker: Speaker::of(structure.clone(), setup.module.clone()),
                setup,
                process: 0,
                number: 0,
                watched_since: None,
                changes: Vec::new(),
            }
        });
        let mut live = Self {
            plant: make_plant(),
            run: RunId(7),
            nodes: nodes.collect(),
            asked: Vec::new(),
            published: Vec::new(),
            clock: START,
        };
        for place in 0..live.nodes.len() {
            live.begin(place, Memory::default());
        }
        live
    }

    /// The publisher begins again, with the same run or another one.
    pub fn begin_again(&mut self, run: RunId) {
        self.plant = make_plant();
        self.run = run;
    }

    /// A diagnoser is started again with what it had stored.
    pub fn restart(&mut self, place: usize) {
        let node = &mut self.nodes[place];
        let diagnoser = &node.diagnoser;
        let components = diagnoser.components().iter();
        let watched = node.watched_since.zip(diagnoser.last_step());
        let changes = node.changes.clone();
        let memory = Memory {
            sequence: diagnoser.next_sequence() - 1,
            latest: components.filter_map(|c| diagnoser.last_transition(c).cloned()).collect(),
            watch: diagnoser.run().map(|run| PastWatch { run, watched, changes }),
        };
        node.diagnoser = Diagnoser::new(node.setup.clone()).unwrap();
        self.begin(place, memory);
    }

    fn begin(&mut self, place: usize, memory: Memory) {
        self.clock += 1000;
        let node = &mut self.nodes[place];
        node.process = self.clock;
        node.number = 0;
        node.diagnoser.recall(memory.clone());
        let software = env!("CARGO_PKG_VERSION").to_owned();
        let configuration =
            node.speaker.configuration(&node.setup, &software, "t1", self.clock).unwrap();
        let remembered = Box::new(node.speaker.remembered(&memory));
        self.publish(place, Topic::Configuration, &configuration, 0);
        let configuration = configuration.fingerprint;
        self.input(place, 0, Taken::Started { software, configuration, remembered });
    }

    /// What a recorder asks for at the head of each file.
    pub fn tell_states(&mut self) {
        for place in 0..self.nodes.len() {
            let node = &self.nodes[place];
            let about = StatePart {
                software: env!("CARGO_PKG_VERSION").to_owned(),
                configuration: setup_fingerprint(&node.setup).unwrap(),
                ..StatePart::default()
            };
            let number = node.number;
            let diagnoser = &node.diagnoser;
            let position = diagnoser.run().zip(diagnoser.last_step());
            let samples = diagnoser.counters().samples;
            let now = self.clock;
            for part in from_diagnoser(diagnoser, &about) {
                // A state is no input: it has the number of the latest one; all parts have one time.
                self.nodes[place].number = number - 1;
                self.clock = now;
                self.input_at(place, (samples, position), Taken::State(Box::new(part)));
            }
        }
    }

    pub fn inject(&mut self, component: &str, fault: Fault) {
        self.plant.inject(&component.parse().unwrap(), fault).unwrap();
    }

    pub fn run(&mut self, steps: u64) {
        self.run_without(steps, |_, _| false);
    }

    /// Goes on; some samples are lost on their way to a diagnoser, by its place.
    pub fn run_without(&mut self, steps: u64, is_lost: impl Fn(usize, u64) -> bool) {
        for _ in 0..steps {
            let signals = self.plant.advance();
            let step = signals.step;
            let samples: Vec<Measurements> = (signals.modules.iter())
                .map(|module| Measurements {
                    run: self.run,
                    step,
                    demands_n: module.demands_n.clone(),
                    pressures_pa: module.pressures_pa.clone(),
                    elongations_m: module.elongations_m.clone(),
                })
                .collect();
            self.clock += 1_000_000;
            for (place, sample) in samples.into_iter().enumerate() {
                self.publish_sample(place, &sample);
                if !is_lost(place, step.0) {
                    self.take(place, sample);
                }
            }
        }
    }

    fn publish_sample(&mut self, place: usize, sample: &Measurements) {
        let Measurements { run, step, demands_n, pressures_pa, elongations_m } = sample.clone();
        let module = self.nodes[place].speaker.module.clone();
        let time_unix_ns = self.clock;
        let message = vocabulary::Sample {
            module,
            run,
            step,
            time_unix_ns,
            demands_n,
            pressures_pa,
            elongations_m,
            readings: Vec::new(),
            block: Vec::new(),
        };
        self.publish(place, Topic::Sample, &message, step.0);
    }

    fn take(&mut self, place: usize, sample: Measurements) {
        let step = sample.step;
        let before = *self.nodes[place].diagnoser.counters();
        self.handle(place, Event::Sample(sample));
        let node = &self.nodes[place];
        let changed = node.diagnoser.counters().changes != before.changes;
        if node.diagnoser.counters().samples > before.samples
            && (changed || step.0.is_multiple_of(100))
        {
            let message = node.speaker.divergences((self.run, step), &node.diagnoser, self.clock);
            self.publish(place, Topic::Divergence, &message, step.0);
        }
        if step.0.is_multiple_of(1000) {
            self.publish_status(place, step);
        }
    }

    fn publish_status(&mut self, place: usize, step: Step) {
        let node = &self.nodes[place];
        let Speaker { structure, module, .. } = node.speaker.clone();
        let message = vocabulary::ModuleStatus {
            run: Some(self.run),
            step: Some(step),
            next_sequence: node.diagnoser.next_sequence(),
            time_unix_ns: self.clock,
            ..vocabulary::ModuleStatus::waiting(structure, module)
        };
        self.publish(place, Topic::Status, &message, step.0);
    }

    pub fn order(&mut self, component: &str, kind: diagnosis::GivenOrderKind) {
        let path: vocabulary::ComponentPath = component.parse().unwrap();
        let place = self.nodes.iter().position(|n| n.speaker.module == path.module).unwrap();
        let order = diagnosis::GivenOrder {
            kind,
            by: "ann".into(),
            on_behalf_of: None,
            note: Some("seen".to_owned()),
        };
        let (token, component) = (diagnosis::OrderToken(1), path.component);
        self.handle(place, Event::Ordered { token, component, order });
    }

    fn handle(&mut self, place: usize, event: Event) {
        let mut pending = VecDeque::from([(place, event)]);
        while let Some((place, event)) = pending.pop_front() {
            let node = &mut self.nodes[place];
            let used = node.diagnoser.counters().samples;
            let before = node.diagnoser.run().zip(node.diagnoser.last_step());
            let now = match &event {
                Event::Sample(sample) => Some((sample.run, sample.step)),
                _ => None,
            };
            let taken = to_taken(&event);
            if let Some(taken) = taken {
                self.input_at(place, (used, before), taken);
            }
            let mut actions = Vec::new();
            self.nodes[place].diagnoser.handle(event, &mut actions);
            for action in actions {
                pending.extend(self.carry_out(place, action, (used, before), now));
            }
        }
    }

    fn carry_out(
        &mut self,
        place: usize,
        action: Action,
        before: (u64, Option<(RunId, Step)>),
        now: Option<(RunId, Step)>,
    ) -> Option<(usize, Event)> {
        match action {
            Action::RunStarted(run) => {
                let step = now.unwrap().1;
                self.input_at(place, before, Taken::RunBegan { run, step });
                self.nodes[place].changes.clear();
            }
            Action::Gap { from, missing } => {
                self.input_at(place, before, Taken::Gap { from, missing });
            }
            Action::Rejected { step, .. } => {
                let run = now.unwrap().0;
                self.input_at(place, before, Taken::Rejected { run, step });
            }
            Action::Phase { in_service_since, .. } => {
                self.nodes[place].watched_since = in_service_since;
            }
            Action::Settled { change, .. } => self.nodes[place].changes.push(change),
            Action::Publish(transition) => {
                let topic = Topic::Fault(transition.component.clone());
                let step = transition.decided.0;
                let message = self.nodes[place].speaker.transition(transition, self.clock);
                self.publish(place, topic, &message, step);
            }
            Action::Identify(excerpt) => {
                let speaker = &self.nodes[place].speaker;
                let found = speaker.identification(identify(&excerpt, None), self.clock);
                let topic = Topic::Identification(excerpt.component.clone());
                self.publish(place, topic, &found.without_signature(), excerpt.as_of.0);
            }
            Action::Ask { peer, question } => {
                let target = self.nodes.iter().position(|n| n.speaker.module == peer).unwrap();
                let token = QuestionToken(self.asked.len() as u64);
                self.asked.push((place, question));
                return Some((target, Event::Asked { token, question }));
            }
            Action::Answer { token, answer } => {
                let (asker, _) = self.asked[token.0 as usize];
                return Some((asker, Event::Answered(answer)));
            }
            Action::Refuse { token, refusal } => {
                let (asker, question) = self.asked[token.0 as usize];
                let peer = self.nodes[place].speaker.module.clone();
                let failure = diagnosis::PeerFailure::Refused(refusal.to_string());
                return Some((asker, Event::Unanswered { peer, question, failure }));
            }
            _ => {}
        }
        None
    }

    fn input(&mut self, place: usize, samples: u64, taken: Taken) {
        self.input_at(place, (samples, None), taken);
    }

    fn input_at(
        &mut self,
        place: usize,
        (samples, position): (u64, Option<(RunId, Step)>),
        taken: Taken,
    ) {
        let node = &mut self.nodes[place];
        node.number += 1;
        let (run, step) = position.unzip();
        let message = vocabulary::Input {
            structure: node.speaker.structure.clone(),
            module: node.speaker.module.clone(),
            process: node.process,
            number: node.number,
            samples,
            run,
            step,
            time_unix_ns: self.clock,
            taken,
        };
        self.publish(place, Topic::Input, &message, step.unwrap_or_default().0);
    }

    fn publish<M: Message>(&mut self, place: usize, topic: Topic, message: &M, step: u64) {
        self.clock += 1;
        self.published.push(Published {
            topic: self.nodes[place].speaker.key(topic),
            payload: encode(message).unwrap(),
            time_unix_ns: self.clock,
            step,
        });
    }
}
