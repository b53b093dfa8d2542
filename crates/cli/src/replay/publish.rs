//! `trusswatch replay --publish`: recorded samples on the network, in the plant's place.

use std::collections::BTreeSet;
use std::io::Write;

use ::replay::{ModuleRecord, latest_setup};
use daemon::config::Speed;
use daemon::player::{self, Playback, Programme};
use shell::shutdown::ShutdownFlags;
use shell::{clock, logging, runtime};
use vocabulary::{RunId, StructureName};

use super::reading::RecordingContents;
use crate::failure::Failure;
use crate::link::Link;
use crate::output;

/// How recorded samples are published.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Publish")]
pub(crate) struct PublishArguments {
    /// Publish the recorded samples in the plant's place, as a run of their own; queries for past ones are answered
    #[arg(long, conflicts_with_all = ["verify", "config", "threshold_factor", "rule", "residual"])]
    publish: bool,
    /// How fast: `real`, a factor of that, or `max` for as fast as the diagnosers
    #[arg(long, default_value = "real", value_name = "SPEED", requires = "publish")]
    speed: Speed,
    /// The recorded run; otherwise the latest
    #[arg(long, value_name = "RUN", requires = "publish")]
    run: Option<u64>,
    /// Begin when the diagnosers of all recorded modules are there
    #[arg(long, requires = "publish")]
    wait: bool,
    #[command(flatten)]
    link: Link,
}

impl PublishArguments {
    /// Is anything to be published?
    pub(crate) fn is_wanted(&self) -> bool {
        self.publish
    }

    /// Publishes until the last sample is out, or the end is asked for.
    pub(crate) fn publish(&self, reading: &RecordingContents) -> Result<(), Failure> {
        logging::start();
        let target = self.link.target()?;
        let records = of_one_structure(&reading.records, target.structure.as_ref())?;
        let recorded = recorded_run(&records, self.run.map(RunId))?;
        let step_s = latest_setup(records[0]).map_err(|short| Failure::input(short.to_string()))?;
        let samples = records.iter().flat_map(|record| samples(record, recorded));
        let programme = Programme::new(records[0].structure.clone(), step_s.step_s, samples);
        let wait_for = records.iter().filter(|_| self.wait).map(|record| record.module.clone());
        let run = RunId(clock::unix_ns() / 1000);
        let playback = Playback { speed: self.speed, run, wait_for: wait_for.collect() };
        let network = target.network().clone();
        let mut published = 0;
        let into = &mut published;
        runtime::until_done(ShutdownFlags::default(), |shutdown| async move {
            *into = player::run(&network, programme, playback, shutdown).await?;
            Ok(())
        })?;
        let mut out = output::stdout();
        writeln!(out, "published {published} samples of run {recorded} as run {run}")?;
        Ok(())
    }
}

/// The modules of one structure; there is at least one.
fn of_one_structure<'a>(
    records: &'a [ModuleRecord],
    wanted: Option<&StructureName>,
) -> Result<Vec<&'a ModuleRecord>, Failure> {
    let structures: BTreeSet<&StructureName> =
        records.iter().map(|record| &record.structure).collect();
    let named: Vec<String> = structures.iter().map(|name| format!("`{name}`")).collect();
    let known = named.join(", ");
    let structure = match (wanted, structures.first()) {
        (Some(wanted), _) if structures.contains(wanted) => wanted,
        (Some(wanted), _) => {
            let problem = format!("no structure `{wanted}` in the recording; it has {known}");
            return Err(Failure::input(problem));
        }
        (None, Some(only)) if structures.len() == 1 => only,
        (None, _) => {
            let problem = format!("the recording has {known}; choose one by `--structure`");
            return Err(Failure::usage(problem));
        }
    };
    Ok(records.iter().filter(|record| record.structure == *structure).collect())
}

/// The run to publish: the one that is wanted, or the latest.
fn recorded_run(records: &[&ModuleRecord], wanted: Option<RunId>) -> Result<RunId, Failure> {
    let heads = |record: &&ModuleRecord| {
        let samples = &record.samples;
        (0..samples.len()).filter_map(|index| samples.head(index)).collect::<Vec<_>>()
    };
    let heads: Vec<_> = records.iter().flat_map(heads).collect();
    let runs: BTreeSet<RunId> = heads.iter().map(|head| head.run).collect();
    let latest = heads.iter().max_by_key(|head| head.time_unix_ns).map(|head| head.run);
    match (wanted, latest) {
        (Some(run), _) if runs.contains(&run) => Ok(run),
        (None, Some(run)) => Ok(run),
        (_, None) => Err(Failure::input("the recording has no samples")),
        (Some(run), _) => {
            let known: Vec<String> = runs.iter().map(ToString::to_string).collect();
            let known = known.join(", ");
            Err(Failure::input(format!("no run {run} in the recording; it has {known}")))
        }
    }
}

/// The samples of a module of this run.
fn samples(record: &ModuleRecord, run: RunId) -> impl Iterator<Item = vocabulary::Sample> + '_ {
    let samples = (0..record.samples.len()).filter_map(|index| record.samples.get(index));
    samples.filter(move |sample| sample.run == run).map(|sample| {
        let diagnosis::Measurements { run, step, demands_n, pressures_pa, elongations_m } = sample;
        let module = record.module.clone();
        vocabulary::Sample {
            module,
            run,
            step,
            time_unix_ns: 0,
            demands_n,
            pressures_pa,
            elongations_m,
            // Those of a learned module are taken as elongations too.
            readings: Vec::new(),
            block: Vec::new(),
        }
    })
}
