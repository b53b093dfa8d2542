//! Numbers what the diagnoser takes: consecutively from 1, each with the sample after which it was taken.

use diagnosis::messages::{Speaker, to_taken};
use diagnosis::{Action, Diagnoser, Event, Memory, SampleRejection};
use shell::clock;
use vocabulary::{Input, RunId, Step, Taken};

/// How far the diagnoser has come.
#[derive(Debug, Clone, Copy, Default)]
struct Position {
    samples: u64,
    run: Option<RunId>,
    step: Option<Step>,
}

/// Makes inputs of what is taken.
#[derive(Debug)]
pub(crate) struct Register {
    speaker: Speaker,
    process: u64,
    /// The number of the latest input.
    number: u64,
    /// Where the diagnoser was before the event that it handles.
    position: Position,
}

impl Register {
    /// Of a process that starts now.
    pub(crate) fn new(speaker: Speaker) -> Self {
        let (process, position) = (clock::unix_ns(), Position::default());
        Self { speaker, process, number: 0, position }
    }

    /// When the process started \[ns since 1970\]: this distinguishes its inputs from those of others.
    pub(crate) fn process(&self) -> u64 {
        self.process
    }

    /// The first of all: what the diagnoser remembers, and the fingerprint of its configuration.
    pub(crate) fn start(&mut self, memory: &Memory, configuration: String) -> Input {
        let software = env!("CARGO_PKG_VERSION").to_owned();
        let remembered = Box::new(self.speaker.remembered(memory));
        self.enter(Taken::Started { software, configuration, remembered })
    }

    /// An event that the diagnoser is about to handle, unless no verdict depends on it or it is a sample.
    pub(crate) fn event(&mut self, event: &Event, diagnoser: &Diagnoser) -> Option<Input> {
        self.position = Position {
            samples: diagnoser.counters().samples,
            run: diagnoser.run(),
            step: diagnoser.last_step(),
        };
        to_taken(event, &self.speaker.structure).map(|taken| self.enter(taken))
    }

    /// What an action says about the sample of the latest event: which one it is, that others are missing before it, or
    /// that it was passed over and yet had a part in which are used after it.
    pub(crate) fn action(&mut self, action: &Action, diagnoser: &Diagnoser) -> Option<Input> {
        let taken = match *action {
            Action::RunStarted(run) => Taken::RunBegan { run, step: diagnoser.last_step()? },
            Action::Gap { from, missing } => Taken::Gap { from, missing },
            Action::Rejected {
                step,
                rejection: SampleRejection::Late | SampleRejection::FarAhead,
            } => Taken::Rejected { run: diagnoser.run()?, step },
            _ => return None,
        };
        Some(self.enter(taken))
    }

    fn enter(&mut self, taken: Taken) -> Input {
        self.number += 1;
        let Position { samples, run, step } = self.position;
        Input {
            structure: self.speaker.structure.clone(),
            module: self.speaker.module.clone(),
            process: self.process,
            number: self.number,
            samples,
            run,
            step,
            time_unix_ns: clock::unix_ns(),
            taken,
        }
    }
}
