//! The verdicts on a recorded run are those that were agreed on: a change of any shows as a change of
//! `data/recorded_run.verdicts`, which `BLESS=1` rewrites.

use std::collections::VecDeque;

use crate::fixture;
use diagnosis::{
    Action, Diagnoser, Event, Measurements, PeerFailure, QuestionToken, Rule, Verdict,
};
use vocabulary::{ModuleName, RunId, Step};

const RECORDING: &str = include_str!("data/recorded_run.csv");
const VERDICTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/recorded_run.verdicts");

const THRESHOLD: f64 = 0.03;

/// The modules' diagnosers, which query each other, and what they published.
struct Replay {
    diagnosers: Vec<Diagnoser>,
    asked: Vec<(usize, ModuleName)>,
    published: String,
}

impl Replay {
    fn give(&mut self, index: usize, event: Event) {
        let mut events = VecDeque::from([(index, event)]);
        while let Some((index, event)) = events.pop_front() {
            let mut actions = Vec::new();
            self.diagnosers[index].handle(event, &mut actions);
            for action in actions {
                events.extend(self.consequence(index, action));
            }
        }
    }

    fn consequence(&mut self, index: usize, action: Action) -> Option<(usize, Event)> {
        match action {
            Action::Ask { peer, question } => {
                let target = self.diagnosers.iter().position(|d| *d.module() == peer).unwrap();
                let token = QuestionToken(self.asked.len() as u64);
                self.asked.push((index, peer));
                Some((target, Event::Asked { token, question }))
            }
            Action::Answer { token, answer } => {
                let asker = self.asked[usize::try_from(token.0).unwrap()].0;
                Some((asker, Event::Answered(answer)))
            }
            Action::Refuse { token, refusal } => {
                let (asker, peer) = self.asked[usize::try_from(token.0).unwrap()].clone();
                panic!(
                    "{peer} refused to answer {asker}: {}",
                    PeerFailure::Refused(refusal.to_string())
                )
            }
            Action::Publish(transition) => {
                let module = self.diagnosers[index].module();
                let by = match &transition.verdict {
                    Verdict::Explained { by, .. } => format!(" by {by}"),
                    _ => String::new(),
                };
                self.published += &format!(
                    "{module}/{} {}{by}: onset {}, detection {}, decided {}\n",
                    transition.component,
                    transition.verdict.as_str(),
                    transition.onset,
                    transition.detection,
                    transition.decided,
                );
                None
            }
            _ => None,
        }
    }
}

fn sample(diagnoser: &Diagnoser, actuators: usize, row: &[&str]) -> Measurements {
    let [step, module, numbers @ ..] = row else { panic!("a row of {} cells", row.len()) };
    assert_eq!(*module, diagnoser.module().as_str());
    let numbers: Vec<f64> = numbers.iter().map(|number| number.parse().unwrap()).collect();
    let (demands, rest) = numbers.split_at(actuators);
    let (pressures, elongations) = rest.split_at(2 * actuators);
    Measurements {
        run: RunId(1),
        step: Step(step.parse().unwrap()),
        demands_n: demands.to_vec(),
        pressures_pa: pressures.chunks(2).map(|pair| [pair[0], pair[1]]).collect(),
        elongations_m: elongations.to_vec(),
    }
}

#[test]
fn a_recorded_run_gets_the_verdicts_that_were_agreed_on() {
    let mut setups = ["lower", "upper"].map(|module| fixture::setup(module, Rule::FirstChange));
    // So low that effects are seen, too.
    setups.iter_mut().for_each(|setup| setup.thresholds.fill(THRESHOLD));
    let actuators = setups.clone().map(|s| s.structure.module(&s.module).unwrap().actuators.len());
    let diagnosers = setups.into_iter().map(|setup| Diagnoser::new(setup).unwrap()).collect();
    let mut replay = Replay { diagnosers, asked: Vec::new(), published: String::new() };
    let rows = RECORDING.lines().filter(|line| !line.starts_with('#'));
    for (number, row) in rows.enumerate() {
        let row: Vec<&str> = row.split(',').collect();
        let index = number % 2;
        let sample = sample(&replay.diagnosers[index], actuators[index], &row);
        replay.give(index, Event::Sample(sample));
    }
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(VERDICTS, &replay.published).unwrap();
    }
    assert_eq!(replay.published, std::fs::read_to_string(VERDICTS).unwrap());
}
