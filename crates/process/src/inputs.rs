//! Numbers the inputs of the diagnoser consecutively from 1, each with the sample after which it was taken.

use diagnosis::messages::{Speaker, to_taken};
use diagnosis::{Action, Diagnoser, Event, Memory, SampleRejection};
use vocabulary::{Input, RunId, StatePart, Step, Taken};

/// The position of the diagnoser in the stream of samples.
#[derive(Debug, Clone, Copy, Default)]
struct SamplePosition {
    samples: u64,
    run: Option<RunId>,
    step: Option<Step>,
}

impl SamplePosition {
    fn of(diagnoser: &Diagnoser) -> Self {
        let (run, step) = (diagnoser.run(), diagnoser.last_step());
        Self { samples: diagnoser.counters().samples, run, step }
    }
}

/// Turns events and actions into inputs.
#[derive(Debug)]
pub struct InputNumbering {
    speaker: Speaker,
    process: u64,
    configuration: String,
    /// The number of the latest input.
    number: u64,
    /// The position before the event being handled.
    position: SamplePosition,
}

impl InputNumbering {
    /// The inputs of a process that starts now.
    #[must_use]
    pub fn new(speaker: Speaker, now_unix_ns: u64) -> Self {
        let position = SamplePosition::default();
        Self { speaker, process: now_unix_ns, configuration: String::new(), number: 0, position }
    }

    /// The start of the process \[ns since 1970\], which distinguishes its inputs from those of other processes.
    #[must_use]
    pub fn process(&self) -> u64 {
        self.process
    }

    /// The first input: the memory of the diagnoser, and the fingerprint of its configuration.
    pub fn start(&mut self, memory: &Memory, configuration: String, now_unix_ns: u64) -> Input {
        let software = env!("CARGO_PKG_VERSION").to_owned();
        self.configuration.clone_from(&configuration);
        let remembered = Box::new(self.speaker.remembered(memory));
        self.enter(Taken::Started { software, configuration, remembered }, now_unix_ns)
    }

    /// The input for an event to be handled; `None` for samples and for events that do not affect verdicts.
    pub fn event(
        &mut self,
        event: &Event,
        diagnoser: &Diagnoser,
        now_unix_ns: u64,
    ) -> Option<Input> {
        self.position = SamplePosition::of(diagnoser);
        to_taken(event).map(|taken| self.enter(taken, now_unix_ns))
    }

    /// The input for an action on the latest sample: it starts a run, earlier ones are missing, or it was rejected but
    /// still affects which later samples are used.
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

    /// The diagnoser's state between two events, still without its text, and where in the stream it is.
    pub fn state(&mut self, diagnoser: &Diagnoser, now_unix_ns: u64) -> (Input, StatePart) {
        self.position = SamplePosition::of(diagnoser);
        let (software, configuration) =
            (env!("CARGO_PKG_VERSION").to_owned(), self.configuration.clone());
        let state = StatePart { software, configuration, ..StatePart::default() };
        (self.input(Taken::State(Box::default()), now_unix_ns), state)
    }

    fn enter(&mut self, taken: Taken, now_unix_ns: u64) -> Input {
        self.number += 1;
        self.input(taken, now_unix_ns)
    }

    fn input(&self, taken: Taken, now_unix_ns: u64) -> Input {
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
