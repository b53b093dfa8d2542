//! What one process of a module took, in order.

use std::collections::BTreeMap;

use diagnosis::messages::{from_taken, to_memory};
use diagnosis::{Event, Memory, ModuleSetup};
use vocabulary::{Input, ModuleConfiguration, RunId, Step, Taken};

use crate::collection::ModuleRecord;
use crate::cursor::{NextSample, SampleCursor};
use crate::shortfall::Shortfall;

/// One thing taken.
#[derive(Debug, Clone)]
pub(crate) enum CourseItem {
    /// The sample at this place.
    Sample(usize),
    /// A sample that was not used because of its step. Its values do not matter.
    Rejected(RunId, Step),
    /// Anything else.
    Event(Box<Event>),
}

/// What one process took, as far as it is recorded.
#[derive(Debug)]
pub struct ProcessCourse {
    /// When the process was started \[ns since 1970\].
    pub process: u64,
    /// When the next one was; the largest number if none was.
    pub until: u64,
    /// Version of the software.
    pub software: String,
    /// What it was set up with.
    pub setup: ModuleSetup,
    /// What it remembered.
    pub memory: Memory,
    /// What should be known of the replay.
    pub notes: Vec<String>,
    /// Why it cannot be followed further, if it cannot.
    pub shortfall: Option<Shortfall>,
    /// The last step that it is known to have taken.
    pub known_until: Option<(RunId, Step)>,
    pub(crate) items: Vec<CourseItem>,
}

/// The courses of all processes of a module, the first one first.
#[must_use]
pub fn courses(record: &ModuleRecord) -> Vec<(u64, Result<ProcessCourse, Shortfall>)> {
    let mut processes: Vec<u64> = record.inputs.keys().copied().collect();
    processes.push(u64::MAX);
    let pairs = processes.windows(2);
    pairs.map(|pair| (pair[0], course(record, pair[0], pair[1]))).collect()
}

fn course(record: &ModuleRecord, process: u64, until: u64) -> Result<ProcessCourse, Shortfall> {
    let nothing = BTreeMap::new();
    let inputs = record.inputs.get(&process).unwrap_or(&nothing);
    let started = inputs.get(&1).map(|input| input.taken.clone());
    let Some(Taken::Started { software, configuration, remembered }) = started else {
        return Err(Shortfall::StartMissing);
    };
    let (setup, notes) = setup(record, &configuration)?;
    let mut course = ProcessCourse {
        process,
        until,
        software,
        setup,
        memory: to_memory(*remembered),
        notes,
        shortfall: None,
        known_until: None,
        items: Vec::new(),
    };
    let mut follower = InputFollower {
        cursor: SampleCursor::new(&record.samples),
        items: &mut course.items,
        taken: 0,
        next: NextSample::Following,
    };
    course.shortfall = follower.follow(inputs).err();
    course.known_until = known_until(record, (process, until), inputs);
    if course.shortfall.is_none() {
        let known = course.known_until;
        course.shortfall = follower.finish(known, until == u64::MAX).err();
    }
    Ok(course)
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

/// What a module was set up with last, as far as it is recorded.
///
/// # Errors
/// Its configuration is not there, or cannot be used.
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

/// The last step that the process is known to have taken.
fn known_until(
    record: &ModuleRecord,
    (process, until): (u64, u64),
    inputs: &BTreeMap<u64, Input>,
) -> Option<(RunId, Step)> {
    let last = inputs.values().next_back()?;
    let own = match last.taken {
        Taken::RunBegan { run, step } => Some((run, step)),
        Taken::Gap { from, missing } => last.run.map(|run| (run, from.plus(missing))),
        _ => last.run.zip(last.step),
    };
    let since = last.time_unix_ns.max(process);
    let from = record.positions.partition_point(|position| position.time_unix_ns <= since);
    let later = record.positions[from..].iter().take_while(|p| p.time_unix_ns < until);
    let run = later.clone().last().map(|position| position.run).or(own.map(|(run, _)| run))?;
    let steps = later.map(|position| (position.run, position.step)).chain(own);
    steps.filter(|position| position.0 == run).max()
}

/// Goes through the inputs and looks up the samples between them.
struct InputFollower<'a> {
    cursor: SampleCursor<'a>,
    items: &'a mut Vec<CourseItem>,
    taken: u64,
    next: NextSample,
}

impl InputFollower<'_> {
    fn follow(&mut self, inputs: &BTreeMap<u64, Input>) -> Result<(), Shortfall> {
        for (expected, (&number, input)) in (1..).zip(inputs) {
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
                    problem: "the process starts once more".to_owned(),
                })?;
                self.items.push(CourseItem::Event(Box::new(event)));
            }
        }
        Ok(())
    }

    /// Follows the samples after the last input: as far as the process is known to have come, or, if none came after it,
    /// as far as they go.
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
