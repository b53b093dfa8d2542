//! The inputs of one process of a module, in order.

use std::collections::{BTreeMap, BTreeSet};

use diagnosis::messages::{from_taken, to_diagnoser, to_memory};
use diagnosis::{Diagnoser, Event, Memory, ModuleSetup};
use vocabulary::{Input, ModuleConfiguration, RunId, StatePart, Step, Taken};

use crate::collection::ModuleRecord;
use crate::cursor::{NextSample, SampleCursor};
use crate::shortfall::Shortfall;

/// An input.
#[derive(Debug, Clone)]
pub(crate) enum CourseItem {
    /// The sample with this index.
    Sample(usize),
    /// A sample rejected because of its step; its values are irrelevant.
    Rejected(RunId, Step),
    /// Any other input.
    Event(Box<Event>),
}

/// The recorded inputs of one process.
#[derive(Debug)]
pub struct ProcessCourse {
    /// The start of the process \[ns since 1970\].
    pub process: u64,
    /// The start of the next process, or the next state from which this one can be followed; otherwise the largest
    /// number \[ns since 1970\].
    pub until: u64,
    /// Version of the software.
    pub software: String,
    /// Its setup.
    pub setup: ModuleSetup,
    /// Its memory at the start or, if it is followed from a state on, its transitions so far.
    pub memory: Memory,
    /// The state from which it is followed, if not from its start.
    pub state: Option<RecordedState>,
    /// Remarks on the replay.
    pub notes: Vec<String>,
    /// Why it cannot be followed further, if so.
    pub shortfall: Option<Shortfall>,
    /// The last step that it is known to have processed.
    pub known_until: Option<(RunId, Step)>,
    pub(crate) items: Vec<CourseItem>,
}

/// A recorded state of a process.
#[derive(Debug)]
pub struct RecordedState {
    /// By the module's clock \[ns since 1970\].
    pub time_unix_ns: u64,
    /// Run and step of the latest sample; `None` before the first.
    pub position: Option<(RunId, Step)>,
    pub(crate) diagnoser: Diagnoser,
    /// The number of the latest input.
    number: u64,
    sample_time_unix_ns: Option<u64>,
}

impl ProcessCourse {
    /// The beginning of the replay: the start of the process, or the time of the state \[ns since 1970\].
    #[must_use]
    pub fn from(&self) -> u64 {
        self.state.as_ref().map_or(self.process, |state| state.time_unix_ns)
    }

    fn samples(&self) -> u64 {
        self.items.iter().filter(|item| matches!(item, CourseItem::Sample(_))).count() as u64
    }

    /// The number of samples that the process had used at the end of this course.
    fn samples_until(&self) -> u64 {
        let before = self.state.as_ref().map_or(0, |state| state.diagnoser.counters().samples);
        before + self.samples()
    }
}

/// The processes of a module in order; each began at this time \[ns since 1970\].
fn processes(record: &ModuleRecord) -> Vec<u64> {
    let of_states = record.states.keys().map(|(process, ..)| *process);
    let processes: BTreeSet<u64> = record.inputs.keys().copied().chain(of_states).collect();
    processes.into_iter().collect()
}

/// How many processes of a module had ended before the recording began: their successors had begun. What they decided is
/// known from replies alone, so that it cannot be complete.
#[must_use]
pub fn processes_before(record: &ModuleRecord) -> usize {
    let Some(since) = record.heard_since() else { return 0 };
    let began = processes(record).partition_point(|process| *process <= since);
    began.saturating_sub(1)
}

/// The courses of all processes of a module in order. A process has several courses if something is missing and a later
/// state follows. Processes that ended before the recording began are left out.
#[must_use]
pub fn courses(record: &ModuleRecord) -> Vec<(u64, Result<ProcessCourse, Shortfall>)> {
    let own = processes(record).into_iter().skip(processes_before(record));
    let processes: Vec<u64> = own.chain([u64::MAX]).collect();
    let is_over = |process: u64, until: u64| {
        let speaks = |time: u64| time >= process && time < until;
        until < u64::MAX && !record.divergences.iter().any(|message| speaks(message.time_unix_ns))
    };
    let pairs = processes.windows(2).map(|pair| (pair[0], pair[1]));
    let followed = pairs.flat_map(|(process, until)| {
        let stretches = stretches(record, (process, until)).into_iter();
        stretches.map(move |course| (process, until, course))
    });
    let recorded =
        followed.filter(|(process, until, course)| course.is_ok() || !is_over(*process, *until));
    recorded.map(|(process, _, course)| (process, course)).collect()
}

/// The courses of one process: from its start or its first state on and, after missing inputs, from the next state on.
fn stretches(record: &ModuleRecord, span: (u64, u64)) -> Vec<Result<ProcessCourse, Shortfall>> {
    let mut stretches = Vec::new();
    let mut latest = from_start(record, span);
    for (&(_, samples, _), parts) in
        record.states.range((span.0, 0, 0)..=(span.0, u64::MAX, u64::MAX))
    {
        match &latest {
            Ok(course) if course.shortfall.is_none() => break,
            Ok(course) if samples <= course.samples_until() => continue,
            _ => {}
        }
        match (from_state(record, span, parts), &mut latest) {
            (Ok(next), Ok(ended)) if ended.samples() > 0 => {
                ended.until = next.from();
                stretches.push(std::mem::replace(&mut latest, Ok(next)));
            }
            (Ok(next), _) => latest = Ok(next),
            (Err(why), Err(_)) => latest = Err(why),
            (Err(_), Ok(_)) => {}
        }
    }
    stretches.push(latest);
    stretches
}

fn from_start(record: &ModuleRecord, span: (u64, u64)) -> Result<ProcessCourse, Shortfall> {
    let started = record.inputs.get(&span.0).and_then(|inputs| inputs.get(&1));
    let Some(Taken::Started { software, configuration, remembered }) =
        started.map(|input| input.taken.clone())
    else {
        return Err(Shortfall::StartMissing);
    };
    follow(record, span, (software, &configuration), to_memory(*remembered), None)
}

fn from_state(
    record: &ModuleRecord,
    span: (u64, u64),
    messages: &[Input],
) -> Result<ProcessCourse, Shortfall> {
    let part = |message| match message {
        &Input { taken: Taken::State(ref part), .. } => Some(&**part),
        _ => None,
    };
    let parts: BTreeMap<u64, &StatePart> =
        messages.iter().filter_map(part).map(|part| (part.part, part)).collect();
    let parts: Vec<&StatePart> = parts.into_values().collect();
    let (Some(head), Some(first)) = (messages.first(), parts.first()) else {
        return Err(Shortfall::StartMissing);
    };
    let diagnoser = to_diagnoser(&parts).map_err(Shortfall::State)?;
    let components = diagnoser.components().iter();
    let memory = Memory {
        sequence: diagnoser.next_sequence() - 1,
        latest: components.filter_map(|c| diagnoser.last_transition(c).cloned()).collect(),
        watch: None,
    };
    let state = RecordedState {
        time_unix_ns: head.time_unix_ns,
        position: head.run.zip(head.step),
        diagnoser,
        number: head.number,
        sample_time_unix_ns: first.sample_time_unix_ns,
    };
    follow(record, span, (first.software.clone(), &first.configuration), memory, Some(state))
}

fn follow(
    record: &ModuleRecord,
    (process, until): (u64, u64),
    (software, configuration): (String, &str),
    memory: Memory,
    state: Option<RecordedState>,
) -> Result<ProcessCourse, Shortfall> {
    let nothing = BTreeMap::new();
    let inputs = record.inputs.get(&process).unwrap_or(&nothing);
    let (setup, notes) = setup(record, configuration)?;
    let mut items = Vec::new();
    let mut follower = InputFollower {
        cursor: SampleCursor::new(&record.samples),
        items: &mut items,
        taken: 0,
        next: NextSample::Following,
    };
    if let Some(state) = &state {
        follower.taken = state.diagnoser.counters().samples;
        if let Some(position) = state.position {
            follower.cursor.resume(position, state.sample_time_unix_ns);
        }
    }
    let first = state.as_ref().map_or(1, |state| state.number + 1);
    let mut shortfall = follower.follow(first, inputs).err();
    let known_until = known_until(record, (process, until), inputs);
    if shortfall.is_none() {
        shortfall = follower.finish(known_until, until == u64::MAX).err();
    }
    Ok(ProcessCourse {
        process,
        until,
        software,
        setup,
        memory,
        state,
        notes,
        shortfall,
        known_until,
        items,
    })
}

fn setup(
    record: &ModuleRecord,
    fingerprint: &str,
) -> Result<(ModuleSetup, Vec<String>), Shortfall> {
    let configurations = &record.configurations;
    let same = configurations.iter().rev().find(|known| known.fingerprint == fingerprint);
    let Some(chosen) = same.or(configurations.last()) else {
        return Err(Shortfall::Configuration("not in the recording".to_owned()));
    };
    let mut notes = Vec::new();
    if same.is_none() {
        let used = &chosen.fingerprint;
        notes.push(format!(
            "its configuration, {fingerprint}, is not in the recording: replayed with {used}"
        ));
    }
    Ok((read_setup(record, chosen)?, notes))
}

/// The last recorded setup of a module.
///
/// # Errors
/// Its configuration is not recorded or cannot be used.
pub fn latest_setup(record: &ModuleRecord) -> Result<ModuleSetup, Shortfall> {
    let missing = || Shortfall::Configuration("not in the recording".to_owned());
    read_setup(record, record.configurations.last().ok_or_else(missing)?)
}

fn read_setup(
    record: &ModuleRecord,
    configuration: &ModuleConfiguration,
) -> Result<ModuleSetup, Shortfall> {
    let setup: ModuleSetup = serde_json::from_value(configuration.setup.clone())
        .map_err(|error| Shortfall::Configuration(error.to_string()))?;
    if setup.module != record.module {
        let problem = format!("it is that of `{}`", setup.module);
        return Err(Shortfall::Configuration(problem));
    }
    Ok(setup)
}

/// The last step that the process is known to have processed.
fn known_until(
    record: &ModuleRecord,
    (process, until): (u64, u64),
    inputs: &BTreeMap<u64, Input>,
) -> Option<(RunId, Step)> {
    let last = inputs.values().next_back();
    let own = last.and_then(|last| match last.taken {
        Taken::RunBegan { run, step } => Some((run, step)),
        Taken::Gap { from, missing } => last.run.map(|run| (run, from.plus(missing))),
        _ => last.run.zip(last.step),
    });
    let since = last.map_or(process, |last| last.time_unix_ns.max(process));
    let from = record.positions.partition_point(|position| position.time_unix_ns <= since);
    let later = record.positions[from..].iter().take_while(|p| p.time_unix_ns < until);
    let run = later.clone().last().map(|position| position.run).or(own.map(|(run, _)| run))?;
    let steps = later.map(|position| (position.run, position.step)).chain(own);
    steps.filter(|position| position.0 == run).max()
}

/// Walks through the inputs and looks up the samples between them.
struct InputFollower<'a> {
    cursor: SampleCursor<'a>,
    items: &'a mut Vec<CourseItem>,
    taken: u64,
    next: NextSample,
}

impl InputFollower<'_> {
    fn follow(&mut self, first: u64, inputs: &BTreeMap<u64, Input>) -> Result<(), Shortfall> {
        for (expected, (&number, input)) in (first..).zip(inputs.range(first..)) {
            if number != expected {
                return Err(Shortfall::InputsMissing { from: expected, to: number - 1 });
            }
            self.take_samples(input.samples)?;
            self.check(input)?;
            self.take(input)?;
        }
        Ok(())
    }

    fn take_samples(&mut self, until: u64) -> Result<(), Shortfall> {
        while self.taken < until {
            self.take_sample(until)?;
        }
        Ok(())
    }

    fn take_sample(&mut self, wanted: u64) -> Result<(), Shortfall> {
        let next = std::mem::replace(&mut self.next, NextSample::Following);
        let index = self.cursor.advance(next, (self.taken, wanted))?;
        self.items.push(CourseItem::Sample(index));
        self.taken += 1;
        Ok(())
    }

    fn check(&self, input: &Input) -> Result<(), Shortfall> {
        let number = input.number;
        if self.taken > input.samples {
            let problem = format!("{} samples after {}", input.samples, self.taken);
            return Err(Shortfall::Contradiction { number, problem });
        }
        let said = input.run.zip(input.step);
        let position = self.cursor.position();
        if said == position {
            return Ok(());
        }
        let words = |position: Option<(RunId, Step)>| {
            position.map_or("no sample yet".to_owned(), |(run, step)| {
                format!("step {step} of run {run}")
            })
        };
        let problem = format!("it was taken at {}, not at {}", words(said), words(position));
        Err(Shortfall::Contradiction { number, problem })
    }

    fn take(&mut self, input: &Input) -> Result<(), Shortfall> {
        match &input.taken {
            Taken::Started { .. } if input.number == 1 => {}
            Taken::RunBegan { run, step } => {
                self.next = NextSample::Begins(*run, *step, input.time_unix_ns);
            }
            Taken::Gap { from, missing } => self.next = NextSample::At(from.plus(*missing)),
            Taken::Rejected { run, step } => self.items.push(CourseItem::Rejected(*run, *step)),
            taken => {
                let event = from_taken(taken.clone()).ok_or_else(|| Shortfall::Contradiction {
                    number: input.number,
                    problem: "the process starts again".to_owned(),
                })?;
                self.items.push(CourseItem::Event(Box::new(event)));
            }
        }
        Ok(())
    }

    /// Follows the samples after the last input: up to the last step known or, for the last process, to the last sample.
    fn finish(&mut self, known: Option<(RunId, Step)>, is_last: bool) -> Result<(), Shortfall> {
        loop {
            let reached = match (known, self.cursor.position(), self.next) {
                (None, ..) => true,
                (Some(_), _, NextSample::At(_) | NextSample::Begins(..)) | (Some(_), None, _) => {
                    false
                }
                (Some((run, step)), Some(position), NextSample::Following) => {
                    if position.0 != run {
                        return Err(Shortfall::UnknownSample { samples: self.taken });
                    }
                    position.1 >= step
                }
            };
            if reached && !is_last {
                return Ok(());
            }
            let wanted = match (known, self.cursor.position()) {
                (Some((_, step)), Some((_, last))) => self.taken + step.since(last).max(1),
                _ => self.taken + 1,
            };
            match self.take_sample(wanted) {
                Ok(()) => {}
                Err(_) if reached => return Ok(()),
                Err(shortfall) => return Err(shortfall),
            }
        }
    }
}
