//! Making the runs of a campaign: those that are not done yet, several at a time, until stopped.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use study::{Campaign, NominalRecord, Occurrence, Rig, ScenarioRecord, StudyError, parallel};

use super::arguments::RunsArguments;
use super::journal::{Done, Journal};
use crate::failure::Failure;
use crate::progress::Progress;

/// A run to be made.
#[derive(Debug, Clone, Copy)]
enum Run {
    Scenario(u64),
    Nominal(u64),
}

/// What came of it.
enum Record {
    Scenario(ScenarioRecord),
    Nominal(NominalRecord),
}

/// The runs of a campaign.
pub(super) struct Runs {
    pub(super) scenarios: Vec<ScenarioRecord>,
    pub(super) nominal: Vec<NominalRecord>,
    /// Was nothing left undone?
    pub(super) complete: bool,
}

/// Where completed runs are kept, and the preset that they are of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept<'a> {
    pub(super) directory: &'a Path,
    pub(super) preset: &'static str,
}

/// Makes what the arguments ask for and is not done yet.
pub(super) fn make(
    arguments: &RunsArguments,
    campaign: &Campaign,
    kept: Option<Kept>,
    stop: &AtomicBool,
) -> Result<Runs, Failure> {
    let (mut journal, mut done) = match kept {
        Some(kept) => open(&kept, campaign)?,
        None => (None, Done::default()),
    };
    // A journal may hold more than is asked for.
    done.scenarios.retain(|number, _| *number < arguments.scenarios);
    done.nominal.retain(|number, _| *number < arguments.nominal);
    let scenarios = Done::missing(&done.scenarios, arguments.scenarios).into_iter();
    let nominal = Done::missing(&done.nominal, arguments.nominal).into_iter();
    let runs: Vec<Run> = scenarios.map(Run::Scenario).chain(nominal.map(Run::Nominal)).collect();
    let all = arguments.scenarios + arguments.nominal;
    let progress = Progress::of_time("runs", seconds_left(campaign, &runs));
    let keep = |_: &Run, record: Record| done.keep(record, journal.as_mut());
    let make = |run: &Run| make_one(campaign, *run, &progress);
    parallel::for_each(&runs, arguments.jobs.count(), stop, make, keep)?;
    progress.end();
    let complete = (done.scenarios.len() + done.nominal.len()) as u64 == all;
    debug_assert!(complete || stop.load(Ordering::Relaxed));
    Ok(Runs {
        scenarios: done.scenarios.into_values().collect(),
        nominal: done.nominal.into_values().collect(),
        complete,
    })
}

fn open(kept: &Kept, campaign: &Campaign) -> Result<(Option<Journal>, Done), Failure> {
    let Kept { directory, preset } = kept;
    std::fs::create_dir_all(directory).map_err(|error| {
        Failure::runtime(format!("cannot make the directory `{}`: {error}", directory.display()))
    })?;
    let (journal, done) = Journal::open(directory, preset, campaign)?;
    Ok((Some(journal), done))
}

/// The tower's time that these runs take \[s\].
fn seconds_left(campaign: &Campaign, runs: &[Run]) -> u64 {
    let ranges = &campaign.ranges;
    let length = |run: &Run| match run {
        Run::Scenario(_) => ranges.length_s,
        Run::Nominal(_) => ranges.nominal_s,
    };
    runs.iter().map(length).sum::<f64>() as u64
}

fn make_one(campaign: &Campaign, run: Run, progress: &Progress) -> Result<Record, Failure> {
    let steps_per_second = (1.0 / campaign.parameters.step_s).round().max(1.0) as u64;
    let mut step = 0;
    let count = |_: &Rig, _: &[Occurrence]| {
        step += 1;
        if step % steps_per_second == 0 {
            progress.advance();
        }
        Ok(())
    };
    let record = match run {
        Run::Scenario(number) => campaign.follow_scenario(number, count).map(Record::Scenario),
        Run::Nominal(number) => campaign.follow_nominal(number, count).map(Record::Nominal),
    };
    record.map_err(|error| unusable(&error))
}

/// A study that cannot be made.
pub(super) fn unusable(error: &StudyError) -> Failure {
    Failure::input(error.to_string())
}

impl Done {
    fn keep(&mut self, record: Record, journal: Option<&mut Journal>) -> Result<(), Failure> {
        match record {
            Record::Scenario(record) => {
                journal.map_or(Ok(()), |journal| journal.scenario(&record))?;
                self.scenarios.insert(record.number, record);
            }
            Record::Nominal(record) => {
                journal.map_or(Ok(()), |journal| journal.nominal(&record))?;
                self.nominal.insert(record.number, record);
            }
        }
        Ok(())
    }
}
