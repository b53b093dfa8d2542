//! From the samples used and the inputs, a second diagnoser does what the first one did.

use std::path::Path;

use diagnosis::divergence::Interval;
use diagnosis::messages::{Speaker, from_taken, to_memory};
use diagnosis::{
    Action, Diagnoser, Event, GivenOrder, GivenOrderKind, Measurements, ModuleSetup, OrderToken,
    PeerFailure, Span, StateAnswer, StateQuestion, Verdict,
};
use vocabulary::{Input, RunId, Step, Taken};

use process::InputNumbering;

const WARM_UP: u64 = 300;
const BIAS_M: f64 = 50e-6;

fn setup() -> ModuleSetup {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/small/lower.toml");
    let mut setup = crate::config::load_diagnoser(&file).unwrap().module_setup();
    setup.detection.divergence.window = 5;
    setup.detection.divergence.interval = Interval::Sliding { vectors: 200 };
    setup.detection.warm_up_vectors = WARM_UP;
    setup.isolation.quiet_steps = 20;
    setup.isolation.effect_steps = 25;
    setup.thresholds.fill(0.6);
    setup
}

/// A module at rest, with noise.
struct Signals {
    random: u64,
    bias_m: f64,
    size: (usize, usize),
}

impl Signals {
    /// Between −1 and 1.
    fn noise(&mut self) -> f64 {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let upper = u32::try_from(self.random >> 32).unwrap();
        2.0 * f64::from(upper) / f64::from(u32::MAX) - 1.0
    }

    fn sample(&mut self, run: RunId, step: Step) -> Measurements {
        let (actuators, gages) = self.size;
        let pressures = |s: &mut Self| [70e5 + 1.7e4 * s.noise(), 98.6e5 + 1.7e4 * s.noise()];
        let mut elongations: Vec<f64> = (0..gages).map(|_| 1.5e-6 * self.noise()).collect();
        elongations[0] += self.bias_m;
        Measurements {
            run,
            step,
            demands_n: vec![-20.0; actuators],
            pressures_pa: (0..actuators).map(|_| pressures(self)).collect(),
            elongations_m: elongations,
        }
    }
}

fn nothing_changed(question: StateQuestion) -> StateAnswer {
    StateAnswer {
        module: "upper".parse().unwrap(),
        question,
        watching_since: Some(Step(0)),
        changes: Vec::new(),
        actuator_faults: Vec::new(),
        alarms: Vec::new(),
        pending: Vec::new(),
        window: None,
    }
}

/// A diagnoser as the loop drives it, and what is recorded of it.
struct Live {
    diagnoser: Diagnoser,
    numbering: InputNumbering,
    signals: Signals,
    used: Vec<Measurements>,
    inputs: Vec<Vec<u8>>,
    done: Vec<Action>,
    questions: u64,
}

impl Live {
    fn start() -> Self {
        let setup = setup();
        let module = setup.structure.module(&setup.module).unwrap();
        let size = (module.actuators.len(), module.gages.len());
        let speaker = Speaker::of("small".parse().unwrap(), setup.module.clone());
        let mut live = Self {
            diagnoser: Diagnoser::new(setup).unwrap(),
            numbering: InputNumbering::new(speaker, 7),
            signals: Signals { random: 1, bias_m: 0.0, size },
            used: Vec::new(),
            inputs: Vec::new(),
            done: Vec::new(),
            questions: 0,
        };
        let started = live.numbering.start(&diagnosis::Memory::default(), "abc".to_owned(), 7);
        live.note(Some(started));
        live
    }

    fn note(&mut self, input: Option<Input>) {
        self.inputs.extend(input.map(|input| vocabulary::encode(&input).unwrap()));
    }

    /// What the diagnoser asked.
    fn give(&mut self, event: Event) -> Vec<StateQuestion> {
        let input = self.numbering.event(&event, &self.diagnoser, 7);
        self.note(input);
        let sample = match &event {
            Event::Sample(sample) => Some(sample.clone()),
            _ => None,
        };
        let used_before = self.diagnoser.counters().samples;
        let mut actions = Vec::new();
        self.diagnoser.handle(event, &mut actions);
        if self.diagnoser.counters().samples != used_before {
            self.used.extend(sample);
        }
        for action in &actions {
            let input = self.numbering.action(action, &self.diagnoser, 7);
            self.note(input);
        }
        let asked = actions.iter().filter_map(|action| match action {
            Action::Ask { question, .. } => Some(*question),
            _ => None,
        });
        let asked = asked.collect();
        self.done.extend(actions);
        asked
    }

    fn run(&mut self, run: u64, steps: std::ops::Range<u64>) {
        for step in steps {
            let sample = self.signals.sample(RunId(run), Step(step));
            let questions = self.give(Event::Sample(sample));
            self.reply(questions);
        }
    }

    /// Every other question is answered.
    fn reply(&mut self, questions: Vec<StateQuestion>) {
        for question in questions {
            self.questions += 1;
            let event = if self.questions.is_multiple_of(2) {
                Event::Answered(nothing_changed(question))
            } else {
                let (peer, failure) = ("upper".parse().unwrap(), PeerFailure::TimedOut);
                Event::Unanswered { peer, question, failure }
            };
            self.give(event);
        }
    }

    fn order(&mut self, kind: GivenOrderKind) {
        let component = "sensor/g1".parse().unwrap();
        let order = GivenOrder {
            kind,
            by: "ada".to_owned(),
            on_behalf_of: None,
            note: Some("seen".to_owned()),
        };
        self.give(Event::Ordered { token: OrderToken(0), component, order });
    }

    fn inputs(&self) -> Vec<Input> {
        self.inputs.iter().map(|bytes| vocabulary::decode(bytes).unwrap()).collect()
    }

    /// The same from what is recorded alone.
    fn replayed(&self) -> Vec<Action> {
        let mut diagnoser = Diagnoser::new(setup()).unwrap();
        let mut actions = Vec::new();
        let mut inputs = self.inputs().into_iter().peekable();
        let mut next = self.used.iter();
        loop {
            let samples = diagnoser.counters().samples;
            while let Some(input) = inputs.next_if(|input| input.samples == samples) {
                let latest = (diagnoser.run(), diagnoser.last_step());
                assert_eq!((input.run, input.step), latest, "{input:?}");
                match input.taken {
                    Taken::Started { remembered, .. } => diagnoser.recall(to_memory(*remembered)),
                    Taken::Rejected { run, step } => {
                        // Whatever it measured.
                        let blank = Measurements { run, step, ..self.used[0].clone() };
                        diagnoser.take_sample(&blank, &mut actions);
                    }
                    taken => {
                        if let Some(event) = from_taken(taken) {
                            diagnoser.handle(event, &mut actions);
                        }
                    }
                }
            }
            let Some(sample) = next.next() else { break };
            diagnoser.take_sample(sample, &mut actions);
        }
        assert_eq!(inputs.next(), None, "all inputs have had their turn");
        actions
    }
}

/// As text, since what is not a number equals nothing; numbers come back from it as they are.
fn written(actions: &[Action]) -> Vec<String> {
    actions.iter().map(|action| format!("{action:?}")).collect()
}

fn kinds(inputs: &[Input]) -> Vec<&'static str> {
    let kind = |input: &Input| match input.taken {
        Taken::Started { .. } => "started",
        Taken::RunBegan { .. } => "run_began",
        Taken::Gap { .. } => "gap",
        Taken::Rejected { .. } => "rejected",
        Taken::Answered { .. } => "answered",
        Taken::Unanswered { .. } => "unanswered",
        Taken::Returned { .. } => "returned",
        Taken::Ordered { .. } => "ordered",
        Taken::State(_) => "state",
    };
    let mut kinds: Vec<_> = inputs.iter().map(kind).collect();
    kinds.dedup();
    kinds
}

#[test]
fn from_samples_and_inputs_a_second_diagnoser_does_the_same() {
    let mut live = Live::start();
    live.order(GivenOrderKind::Acknowledge);
    live.run(1, 0..WARM_UP + 200);
    // Samples are missing, and some come twice or late.
    live.run(1, 520..600);
    live.run(1, 599..600);
    live.run(1, 590..595);
    live.run(1, 600..700);
    live.signals.bias_m = BIAS_M;
    live.run(1, 700..900);
    live.order(GivenOrderKind::Acknowledge);
    let span = Span { since_unix_ns: 5, until_unix_ns: 9 };
    live.order(GivenOrderKind::Shelve(span));
    live.order(GivenOrderKind::Suppress(span));
    live.order(GivenOrderKind::Unsuppress);
    let questions = live.give(Event::Returned { peer: "upper".parse().unwrap() });
    live.reply(questions);
    // A single jump of more than ten seconds is not believed; of two in a row, the second is.
    live.run(1, 50_000..50_001);
    live.run(1, 900..950);
    live.run(1, 20_000..20_600);
    live.order(GivenOrderKind::Lapse { now_unix_ns: 9 });
    live.order(GivenOrderKind::Reset { force: true });
    live.run(1, 20_600..21_000);
    // Another run, and then the same once more from its beginning.
    live.run(2, 7..900);
    live.signals.bias_m = 0.0;
    live.run(2, 0..900);
    let inputs = live.inputs();
    let numbers: Vec<u64> = inputs.iter().map(|input| input.number).collect();
    assert_eq!(numbers, (1..=inputs.len() as u64).collect::<Vec<_>>());
    let kinds = kinds(&inputs);
    assert_eq!(kinds[..5], ["started", "ordered", "run_began", "gap", "rejected"]);
    for kind in ["answered", "unanswered", "returned"] {
        assert!(kinds.contains(&kind), "{kind} is not among {kinds:?}");
    }
    let counters = live.diagnoser.counters();
    assert_eq!((counters.runs, counters.samples_late > 50), (3, true), "{counters:?}");
    assert_eq!(counters.samples_far_ahead, 2);
    let latched =
        |action: &Action| matches!(action, Action::Publish(t) if t.verdict == Verdict::Latched);
    assert!(live.done.iter().any(latched), "a fault was found");
    let mut expected = live.done.clone();
    // A sample that comes twice leaves no trace.
    expected.retain(|action| {
        let rejection = diagnosis::SampleRejection::Repeated;
        !matches!(action, Action::Rejected { rejection: found, .. } if *found == rejection)
    });
    assert_eq!(written(&live.replayed()), written(&expected));
}
