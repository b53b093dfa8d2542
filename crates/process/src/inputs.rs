//! Numbers what the diagnoser takes: consecutively from 1, each with the sample after which it was taken.

use diagnosis::messages::{Speaker, to_taken};
use diagnosis::{Action, Diagnoser, Event, Memory, SampleRejection};
use vocabulary::{Input, RunId, Step, Taken};

/// How far the diagnoser has come.
#[derive(Debug, Clone, Copy, Default)]
struct SamplePosition {
    samples: u64,
    run: Option<RunId>,
    step: Option<Step>,
}

/// Makes inputs of what is taken.
#[derive(Debug)]
pub struct InputNumbering {
    speaker: Speaker,
    process: u64,
    /// The number of the latest input.
    number: u64,
    /// Where the diagnoser was before the event that it handles.
    position: SamplePosition,
}

impl InputNumbering {
    /// Of a process that starts now.
    #[must_use]
    pub fn new(speaker: Speaker, now_unix_ns: u64) -> Self {
        let position = SamplePosition::default();
        Self { speaker, process: now_unix_ns, number: 0, position }
    }

    /// When the process started \[ns since 1970\]: this distinguishes its inputs from those of others.
    #[must_use]
    pub fn process(&self) -> u64 {
        self.process
    }

    /// The first of all: what the diagnoser remembers, and the fingerprint of its configuration.
    pub fn start(&mut self, memory: &Memory, configuration: String, now_unix_ns: u64) -> Input {
        let software = env!("CARGO_PKG_VERSION").to_owned();
        let remembered = Box::new(self.speaker.remembered(memory));
        self.enter(Taken::Started { software, configuration, remembered }, now_unix_ns)
    }

    /// An event that the diagnoser is about to handle, unless no verdict depends on it or it is a sample.
    pub fn event(
        &mut self,
        event: &Event,
        diagnoser: &Diagnoser,
        now_unix_ns: u64,
    ) -> Option<Input> {
        self.position = SamplePosition {
            samples: diagnoser.counters().samples,
            run: diagnoser.run(),
            step: diagnoser.last_step(),
        };
        to_taken(event).map(|taken| self.enter(taken, now_unix_ns))
    }

    /// What an action says about the sample of the latest event: which one it is, that others are missing before it, or
    /// that it was passed over and yet had a part in which are used after it.
    pub fn action(
        &mut self,
        action: &Action,
        diagnoser: &Diagnoser,
        now_unix_ns: u64,
    ) -> Option<Input> {
        let taken = match *action {
            Action::RunStarted(run) => Taken::RunBegan { run, step: diagnoser.last_step()? },
            Action::Gap { from, missing } => Taken::Gap { from, missing },
            Action::Rejected {
                step,
                rejection: SampleRejection::Late | SampleRejection::FarAhead,
            } => Taken::Rejected { run: diagnoser.run()?, step },
            _ => return None,
        };
        Some(self.enter(taken, now_unix_ns))
    }

    fn enter(&mut self, taken: Taken, now_unix_ns: u64) -> Input {
        self.number += 1;
        let SamplePosition { samples, run, step } = self.position;
        Input {
            structure: self.speaker.structure.clone(),
            module: self.speaker.module.clone(),
            process: self.process,
            number: self.number,
            samples,
            run,
            step,
            time_unix_ns: now_unix_ns,
            taken,
        }
    }
}
