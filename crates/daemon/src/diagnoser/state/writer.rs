//! The thread that writes: records first, and when the disk has them, how far the module has watched. So the watch
//! never says more than the journal can prove.

use std::time::Duration;

use shell::clock;

use super::keeper::Keeper;
use super::record::{Record, VERSION};
use super::watch_file::{Watch, WatchFile};
use super::write_queue::{Batch, JournalBoard, Outlet, Submission, queue};

/// How often a disk that refused is tried again.
const RETRY: Duration = Duration::from_secs(1);

/// What the thread owns.
#[derive(Debug)]
pub(crate) struct Writer {
    keeper: Keeper,
    watch_file: Option<WatchFile>,
    outlet: Outlet,
}

impl Writer {
    /// With what it takes from. That it has started is the first thing that it writes: whether the disk takes
    /// anything is known before there is a fault.
    pub(crate) fn new(
        keeper: Keeper,
        watch_file: Option<WatchFile>,
    ) -> (Self, Submission, JournalBoard) {
        let start = Record::Start {
            v: VERSION,
            software: env!("CARGO_PKG_VERSION").to_owned(),
            time_unix_ns: clock::unix_ns(),
            incarnation: keeper.status().incarnation,
        };
        let (submission, outlet, board) = queue(vec![start], keeper.status().clone());
        (Self { keeper, watch_file, outlet }, submission, board)
    }

    /// Writes until nothing more can come.
    pub(crate) fn run(mut self) {
        while let Some(batch) = self.outlet.take(self.keeper.is_behind().then_some(RETRY)) {
            let durable = self.write(batch);
            self.outlet.settle(durable, self.keeper.status());
        }
    }

    fn write(&mut self, batch: Batch) -> bool {
        let Batch { records, watch, dropped: (dropped, count) } = batch;
        self.keeper.make_up_for(&dropped, count);
        let nothing_to_do = records.is_empty() && self.keeper.is_up_to_date();
        let durable = nothing_to_do || self.keeper.save(records);
        if let Some(watch) = watch.filter(|_| durable) {
            self.write_watch(watch);
        }
        durable
    }

    fn write_watch(&mut self, watch: Watch) {
        let Some(file) = &mut self.watch_file else { return };
        if let Err(error) = file.write(watch) {
            tracing::debug!("watch file: {error}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    fn watch(until: u64) -> Watch {
        Watch { run: RunId(1), watched: Some((Step(0), Step(until))) }
    }

    fn change(step: u64) -> Record {
        let change = vocabulary::Change::at("sensor/g1".parse().unwrap(), Step(step), 2.0);
        Record::Change { run: RunId(1), change }
    }

    #[test]
    fn the_watch_says_nothing_that_the_journal_lacks() {
        let directory = tempfile::tempdir().unwrap();
        let state = directory.path().join("state");
        std::fs::write(&state, "in the way").unwrap();
        let (keeper, _) = Keeper::open(Some(&state), 10_000, &"m1".parse().unwrap()).unwrap();
        let watched = || WatchFile::open(directory.path()).unwrap();
        let (mut writer, _submission, _) = Writer::new(keeper, Some(watched().0));
        let batch = |step| Batch {
            records: vec![change(step)],
            watch: Some(watch(step)),
            ..Batch::default()
        };
        assert!(!writer.write(batch(5)));
        assert_eq!(watched().1, None);
        std::fs::remove_file(&state).unwrap();
        assert!(writer.write(batch(6)));
        assert_eq!(watched().1, Some(watch(6)));
    }

    #[test]
    fn a_start_is_written_at_once() {
        let directory = tempfile::tempdir().unwrap();
        let module = "m1".parse().unwrap();
        let (keeper, _) = Keeper::open(Some(directory.path()), 10_000, &module).unwrap();
        let (writer, submission, board) = Writer::new(keeper, None);
        drop(submission);
        writer.run();
        assert!(board.has_all());
        let records: Vec<String> =
            journal::read(directory.path()).unwrap().map(Result::unwrap).collect();
        assert!(records.len() == 1 && records[0].contains(r#""record":"start""#), "{records:?}");
    }
}
