//! Ten modules on a network that loses one sample in a thousand, each on its own and for good.

use std::collections::VecDeque;

use crate::fixture::{Bench, WARM_UP, name, setup};
use diagnosis::{Action, Event, ModuleSetup, QuestionToken, Rule, Verdict};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truss::Structure;
use vocabulary::ModuleName;

const MODULES: usize = 10;
const LOST: f64 = 1e-3;
/// Shows at once, and is no jump.
const BIAS_M: f64 = 20e-6;

/// The lower module of the small mast under another name, with nine peers.
fn module(number: usize) -> ModuleSetup {
    let of = |number: usize| name(&format!("m{number}"));
    let small = include_str!("../../../configs/small/lower.structure.toml");
    let structure = Structure::from_toml(&small.replace("lower", &format!("m{number}"))).unwrap();
    let peers = (0..MODULES).filter(|other| *other != number).map(of).collect();
    ModuleSetup { module: of(number), structure, peers, ..setup("lower", Rule::FirstChange) }
}

struct Network {
    benches: Vec<Bench>,
    /// Who asked.
    asked: Vec<usize>,
    random: ChaCha8Rng,
}

impl Network {
    fn new(seed: u64) -> Self {
        let benches = (0..MODULES).map(|number| {
            let mut bench = Bench::of(module(number));
            let noise = seed.wrapping_mul(100) + number as u64;
            bench.signals.random_from(noise);
            bench
        });
        let random = ChaCha8Rng::seed_from_u64(seed);
        Self { benches: benches.collect(), asked: Vec::new(), random }
    }

    fn run(&mut self, steps: u64) {
        for _ in 0..steps {
            for place in 0..MODULES {
                let sample = self.benches[place].signals.sample();
                if self.random.random::<f64>() >= LOST {
                    self.give(place, Event::Sample(sample));
                }
            }
        }
    }

    /// Hands an event over, and carries questions and answers to and fro.
    fn give(&mut self, place: usize, event: Event) {
        let mut events = VecDeque::from([(place, event)]);
        while let Some((place, event)) = events.pop_front() {
            self.benches[place].give(event);
            let actions = std::mem::take(&mut self.benches[place].actions);
            for action in actions {
                events.extend(self.event_of(place, action));
            }
        }
    }

    fn event_of(&mut self, place: usize, action: Action) -> Option<(usize, Event)> {
        let of = |peer: &ModuleName| peer.as_str()[1..].parse().unwrap();
        match action {
            Action::Ask { peer, question } => {
                let token = QuestionToken(self.asked.len() as u64);
                self.asked.push(place);
                Some((of(&peer), Event::Asked { token, question }))
            }
            Action::Answer { token, answer } => {
                let asker = self.asked[usize::try_from(token.0).unwrap()];
                Some((asker, Event::Answered(answer)))
            }
            _ => None,
        }
    }
}

/// One in seven was left unconfirmed as long as a lost sample blinded a module for a dozen steps.
#[test]
fn faults_are_judged_though_every_peer_loses_samples() {
    let mut latched = 0;
    for seed in 0..30 {
        let mut network = Network::new(seed);
        let started = WARM_UP + 150 + network.random.next_u64() % 100;
        network.run(started);
        let faulty = usize::try_from(seed).unwrap() % MODULES;
        network.benches[faulty].signals.gage_offsets[0] = BIAS_M;
        network.run(60);
        latched += u32::from(network.benches[faulty].verdict("sensor/g1") == Verdict::Latched);
        for (place, bench) in network.benches.iter().enumerate() {
            assert!(place == faulty || bench.latched().is_empty(), "seed {seed}, module {place}");
        }
    }
    assert!(latched >= 29, "{latched} of 30");
}
