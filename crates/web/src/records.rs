//! The page's own records, in the file `page.redb` of its state directory: events, for the history of modules that are
//! gone, and margins, for their trends.
//!
//! The file is an embedded database, because its transactions are complete or absent after `kill -9`. Margins take a
//! fixed space per module, since each [`TrendSpan`] has so many intervals; of events the latest [`MOST_EVENTS`] are kept.
//! Events are written at once, margins of intervals that have ended once a minute, of others every ten minutes.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use observer::trend::{ModuleSummary, TrendSpan, add_margins};
use observer::{ModuleHistory, News, ObservedEvent, Scene};
use parking_lot::Mutex;
use redb::{Database, ReadableDatabase, ReadableTable, ReadableTableMetadata, TableDefinition};
use session::client::Live;
use shell::clock;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep};
use vocabulary::{Component, ModuleName, ModuleStatus, StructureName};

/// The file in the state directory.
const FILE: &str = "page.redb";
/// By module, span and interval: the summaries of its components, as CBOR.
const MARGINS: TableDefinition<'_, (&str, u8, u64), &[u8]> = TableDefinition::new("margins");
/// By module, time of arrival \[ns since 1970\] and a number: an event, as JSON. What concerns no module, or all, has an
/// empty name.
const EVENTS: TableDefinition<'_, (&str, u64, u64), &[u8]> = TableDefinition::new("events");
/// When the page last wrote something \[ns since 1970\]: until then it was running.
const RUNNING: TableDefinition<'_, (), u64> = TableDefinition::new("running");
/// The most events that are kept; beyond, the oldest tenth is dropped.
const MOST_EVENTS: u64 = 200_000;
/// Interval of looking for what is new.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Interval of writing margins of intervals that have ended, and of all.
const WRITE_EVERY: Duration = Duration::from_secs(60);
const WRITE_ALL_EVERY: Duration = Duration::from_secs(600);

type StoreError = redb::Error;

/// How the margins of a module's components have developed: by span, (start \[s since 1970\], summaries).
#[derive(Debug, Default)]
pub(crate) struct ModuleTrends {
    /// Up to this time \[s since 1970\].
    pub(crate) until_unix_s: u64,
    /// In the order of [`TrendSpan::ALL`].
    pub(crate) spans: [Vec<(u64, ModuleSummary)>; TrendSpan::ALL.len()],
}

impl ModuleTrends {
    /// The summaries of a span.
    pub(crate) fn span(&self, span: TrendSpan) -> &[(u64, ModuleSummary)] {
        &self.spans[span as usize]
    }

    /// Whether anything is kept of a component.
    pub(crate) fn has(&self, component: &Component) -> bool {
        let name = component.to_string();
        self.spans.iter().flatten().any(|(_, summary)| summary.contains_key(&name))
    }

    /// Reads what is kept.
    pub(crate) fn read(records: &PageRecords, of: (&StructureName, &ModuleName)) -> Self {
        let until_unix_s = clock::unix_ns() / 1_000_000_000;
        let spans = TrendSpan::ALL.map(|span| records.margins(of, span, until_unix_s));
        Self { until_unix_s, spans }
    }
}

/// The records, and the task that adds to them.
#[derive(Debug, Default)]
pub(crate) struct PageRecords {
    kept: Option<Arc<RecordDatabase>>,
    _task: JoinSet<()>,
}

#[derive(Debug)]
struct RecordDatabase {
    database: Database,
    /// Intervals that are not yet written, or not to their end.
    recent: Mutex<BTreeMap<(String, TrendSpan, u64), ModuleSummary>>,
    /// Why something could not be written or read, if so.
    problem: Mutex<Option<String>>,
}

impl PageRecords {
    /// Keeps what is heard in a directory; without one, nothing.
    ///
    /// # Errors
    /// The file cannot be opened: it is damaged, or another process has it.
    pub(crate) fn start(directory: Option<&Path>, live: &Live) -> Result<Self, String> {
        let mut records = Self::open(directory)?;
        let Some(kept) = records.kept.clone() else { return Ok(records) };
        let scenes = live.scenes();
        records._task.spawn(async move {
            let mut recorder = Recorder::new(kept);
            loop {
                let scene = Arc::clone(&scenes.borrow());
                // Writing waits for the disk.
                recorder = match tokio::task::spawn_blocking(move || recorder.take(&scene)).await {
                    Ok(recorder) => recorder,
                    Err(error) => return tracing::error!("the page's records end: {error}"),
                };
                sleep(LOOK_EVERY).await;
            }
        });
        Ok(records)
    }

    fn open(directory: Option<&Path>) -> Result<Self, String> {
        let Some(directory) = directory else { return Ok(Self::default()) };
        let path = directory.join(FILE);
        let unopened = |error: StoreError| {
            let right = match error {
                StoreError::DatabaseAlreadyOpen => {
                    "another page uses it; give each its --state-dir"
                }
                _ => "move it away to start over, without what was kept",
            };
            format!("{}: {error}; {right}", path.display())
        };
        let database = Database::create(&path).map_err(|error| unopened(error.into()))?;
        let kept = RecordDatabase { database, recent: Mutex::default(), problem: Mutex::default() };
        kept.make_tables().map_err(unopened)?;
        kept.note_restart(clock::unix_ns()).map_err(unopened)?;
        Ok(Self { kept: Some(Arc::new(kept)), _task: JoinSet::new() })
    }

    /// Writes everything, at the end of the process.
    pub(crate) fn close(&self) {
        if let Some(kept) = &self.kept {
            kept.write(|kept| kept.write_margins(true));
        }
    }

    /// Why something cannot be kept or read at present, if so.
    pub(crate) fn problem(&self) -> Option<String> {
        self.kept.as_ref()?.problem.lock().clone()
    }

    /// Whether anything is kept.
    pub(crate) fn is_there(&self) -> bool {
        self.kept.is_some()
    }

    /// The summaries of a module over a span, up to a time: (start \[s since 1970\], summaries), oldest first.
    pub(crate) fn margins(
        &self,
        (structure, module): (&StructureName, &ModuleName),
        span: TrendSpan,
        now_unix_s: u64,
    ) -> Vec<(u64, ModuleSummary)> {
        let Some(kept) = &self.kept else { return Vec::new() };
        let last = span.interval(now_unix_s);
        let wanted = last.saturating_sub(span.intervals() - 1)..=last;
        let name = format!("{structure}/{module}");
        let found = kept.read(|kept| kept.read_margins(&name, span, wanted));
        let begin = |(interval, summary)| (interval * span.interval_s(), summary);
        found.unwrap_or_default().into_iter().map(begin).collect()
    }

    /// What was heard of a module, as its journal would have it.
    pub(crate) fn history(
        &self,
        structure: &StructureName,
        module: &ModuleName,
        within: RangeInclusive<u64>,
        most: usize,
    ) -> ModuleHistory {
        let name = format!("{structure}/{module}");
        let read = |kept: &RecordDatabase| {
            let mut events = kept.read_events(&name, within.clone(), most)?;
            events.extend(kept.read_events("", within, most)?);
            events.sort_by_key(|event| (event.time_unix_ns, event.number));
            Ok(events)
        };
        let events = self.kept.as_ref().and_then(|kept| kept.read(read));
        ModuleHistory::heard(structure, module, events.unwrap_or_default())
    }

    /// The modules of which something is kept, each with its structure.
    pub(crate) fn modules(&self) -> Vec<(StructureName, ModuleName)> {
        let names = self.kept.as_ref().and_then(|kept| kept.read(RecordDatabase::read_names));
        let parsed = |name: String| {
            let (structure, module) = name.split_once('/')?;
            Some((structure.parse().ok()?, module.parse().ok()?))
        };
        names.unwrap_or_default().into_iter().filter_map(parsed).collect()
    }

    /// The time of the earliest event that is kept \[ns since 1970\].
    pub(crate) fn since_unix_ns(&self) -> Option<u64> {
        self.kept.as_ref()?.read(RecordDatabase::read_earliest)?
    }
}

impl RecordDatabase {
    /// Writes; a failure is logged once, and shown until something is written again.
    fn write<T>(&self, work: impl FnOnce(&Self) -> Result<T, StoreError>) -> Option<T> {
        let written = self.read(work);
        if written.is_some() {
            *self.problem.lock() = None;
        }
        written
    }

    /// Reads; a failure is logged once and shown. That a full disk can be read says nothing of whether it can be written.
    fn read<T>(&self, work: impl FnOnce(&Self) -> Result<T, StoreError>) -> Option<T> {
        let error = match work(self) {
            Ok(value) => return Some(value),
            Err(error) => error.to_string(),
        };
        let mut problem = self.problem.lock();
        if problem.as_ref() != Some(&error) {
            tracing::error!("the page's records cannot be written or read: {error}");
        }
        *problem = Some(error);
        None
    }

    fn make_tables(&self) -> Result<(), StoreError> {
        let transaction = self.database.begin_write()?;
        transaction.open_table(MARGINS)?;
        transaction.open_table(EVENTS)?;
        transaction.open_table(RUNNING)?;
        Ok(transaction.commit()?)
    }

    /// Notes that since the latest writing the page was not running, and is again.
    fn note_restart(&self, now_unix_ns: u64) -> Result<(), StoreError> {
        let table = self.database.begin_read()?.open_table(RUNNING)?;
        let Some(ran_until) = table.get(())?.map(|time| time.value()) else { return Ok(()) };
        let event = |time_unix_ns, connected| {
            Arc::new(ObservedEvent {
                number: 0,
                time_unix_ns,
                news: News::Connection { connected },
            })
        };
        self.write_events(&[event(ran_until, false), event(now_unix_ns.max(ran_until), true)])
    }

    fn read_margins(
        &self,
        name: &str,
        span: TrendSpan,
        wanted: RangeInclusive<u64>,
    ) -> Result<BTreeMap<u64, ModuleSummary>, StoreError> {
        let table = self.database.begin_read()?.open_table(MARGINS)?;
        let mut found = BTreeMap::new();
        let keys = (name, span as u8, *wanted.start())..=(name, span as u8, *wanted.end());
        for row in table.range(keys)? {
            let (key, value) = row?;
            // A row that another version wrote is passed over.
            if let Ok(summary) = ciborium::from_reader(value.value()) {
                found.insert(key.value().2, summary);
            }
        }
        for ((module, of, interval), summary) in self.recent.lock().iter() {
            if module == name && *of == span && wanted.contains(interval) {
                found.insert(*interval, summary.clone());
            }
        }
        Ok(found)
    }

    /// The latest events under a name, oldest first.
    fn read_events(
        &self,
        name: &str,
        within: RangeInclusive<u64>,
        most: usize,
    ) -> Result<Vec<ObservedEvent>, StoreError> {
        let table = self.database.begin_read()?.open_table(EVENTS)?;
        let mut events = Vec::new();
        let keys = (name, *within.start(), 0)..=(name, *within.end(), u64::MAX);
        for row in table.range(keys)?.rev().take(most) {
            let (key, value) = row?;
            let (_, time_unix_ns, number) = key.value();
            if let Ok(news) = serde_json::from_slice(value.value()) {
                events.push(ObservedEvent { number, time_unix_ns, news });
            }
        }
        events.reverse();
        Ok(events)
    }

    fn read_names(&self) -> Result<Vec<String>, StoreError> {
        let table = self.database.begin_read()?.open_table(EVENTS)?;
        let mut names: Vec<String> = Vec::new();
        loop {
            let after = names.last().map_or("", String::as_str);
            let next = table.range((after, u64::MAX, u64::MAX)..)?.next().transpose()?;
            let Some((key, _)) = next else { return Ok(names) };
            let name = key.value().0.to_owned();
            names.push(name);
        }
    }

    fn read_earliest(&self) -> Result<Option<u64>, StoreError> {
        let mut names = self.read_names()?;
        names.push(String::new());
        let table = self.database.begin_read()?.open_table(EVENTS)?;
        let mut earliest = None;
        for name in &names {
            let first = table.range((name.as_str(), 0, 0)..)?.next().transpose()?;
            let time = first.map(|(key, _)| key.value().1);
            earliest = [earliest, time].into_iter().flatten().min();
        }
        Ok(earliest)
    }

    fn write_events(&self, events: &[Arc<ObservedEvent>]) -> Result<(), StoreError> {
        let transaction = self.database.begin_write()?;
        {
            let mut table = transaction.open_table(EVENTS)?;
            for event in events {
                let (name, json) = (name_of(&event.news), serde_json::to_vec(&event.news));
                let key = (name.as_str(), event.time_unix_ns, event.number);
                table.insert(key, json.unwrap_or_default().as_slice())?;
            }
            transaction.open_table(RUNNING)?.insert((), clock::unix_ns())?;
            if table.len()? > MOST_EVENTS {
                let times = table.iter()?.map(|row| Ok(row?.0.value().1));
                let mut times = times.collect::<Result<Vec<u64>, StoreError>>()?;
                let tenth = times.len() / 10;
                let cut = *times.select_nth_unstable(tenth).1;
                table.retain(|(_, time, _), _| time >= cut)?;
            }
        }
        Ok(transaction.commit()?)
    }

    /// Adds what a status says to each span's present interval.
    fn add(&self, status: &ModuleStatus) -> Result<(), StoreError> {
        let name = format!("{}/{}", status.structure, status.module);
        let seconds = status.time_unix_ns / 1_000_000_000;
        for span in TrendSpan::ALL {
            let interval = span.interval(seconds);
            let key = (name.clone(), span, interval);
            if !self.recent.lock().contains_key(&key) {
                // After a restart an interval goes on.
                let mut before = self.read_margins(&name, span, interval..=interval)?;
                let summary = before.remove(&interval).unwrap_or_default();
                self.recent.lock().insert(key.clone(), summary);
            }
            if let Some(summary) = self.recent.lock().get_mut(&key) {
                add_margins(summary, &status.margins);
            }
        }
        Ok(())
    }

    /// Writes the intervals that have ended, or all.
    fn write_margins(&self, all: bool) -> Result<(), StoreError> {
        let rows = self.recent.lock().clone();
        let has_ended = |(name, span, interval): &(String, TrendSpan, u64)| {
            let later = rows.range((name.clone(), *span, interval + 1)..).next();
            later.is_some_and(|((other, of, _), _)| other == name && of == span)
        };
        let ended: BTreeSet<_> = rows.keys().filter(|key| has_ended(key)).cloned().collect();
        let transaction = self.database.begin_write()?;
        {
            let mut table = transaction.open_table(MARGINS)?;
            for (key, summary) in rows.iter().filter(|(key, _)| all || ended.contains(key)) {
                let (name, span, interval) = key;
                let mut bytes = Vec::new();
                if ciborium::into_writer(summary, &mut bytes).is_ok() {
                    table.insert((name.as_str(), *span as u8, *interval), bytes.as_slice())?;
                }
                let first = interval.saturating_sub(span.intervals() - 1);
                let old = (name.as_str(), *span as u8, 0)..(name.as_str(), *span as u8, first);
                table.retain_in(old, |_, _| false)?;
            }
        }
        transaction.open_table(RUNNING)?.insert((), clock::unix_ns())?;
        transaction.commit()?;
        self.recent.lock().retain(|key, _| !ended.contains(key));
        Ok(())
    }
}

/// The name under which an event is kept.
fn name_of(news: &News) -> String {
    match news {
        News::Fault(transition) | News::Present(transition) => {
            format!("{}/{}", transition.structure, transition.module)
        }
        News::Identification(found) => format!("{}/{}", found.structure, found.module),
        News::Phase(change) => format!("{}/{}", change.structure, change.module),
        News::Presence { structure, who, .. } => format!("{structure}/{who}"),
        News::SeveralProcesses { structure, module } | News::Missed { structure, module, .. } => {
            format!("{structure}/{module}")
        }
        News::Unreadable { .. } | News::Connection { .. } | News::Lost { .. } => String::new(),
    }
}

/// Notes what is new in each scene.
struct Recorder {
    kept: Arc<RecordDatabase>,
    /// The number of the latest event that was kept.
    event: u64,
    /// The time of each module's latest status.
    statuses: BTreeMap<(StructureName, ModuleName), u64>,
    written: Instant,
    all_written: Instant,
}

impl Recorder {
    fn new(kept: Arc<RecordDatabase>) -> Self {
        let now = Instant::now();
        Self { kept, event: 0, statuses: BTreeMap::new(), written: now, all_written: now }
    }

    fn take(mut self, scene: &Scene) -> Self {
        self.take_events(scene);
        for module in scene.modules.iter().filter(|module| !module.is_silent) {
            let Some(status) = &module.status else { continue };
            let key = (status.structure.clone(), status.module.clone());
            if self.statuses.insert(key, status.time_unix_ns) != Some(status.time_unix_ns) {
                self.kept.read(|kept| kept.add(status));
            }
        }
        let all = self.all_written.elapsed() >= WRITE_ALL_EVERY;
        if (all || self.written.elapsed() >= WRITE_EVERY)
            && self.kept.write(|kept| kept.write_margins(all)).is_some()
        {
            self.written = Instant::now();
            if all {
                self.all_written = self.written;
            }
        }
        self
    }

    /// Keeps the events that are new; those that had left the scene before it was looked at are counted as lost.
    fn take_events(&mut self, scene: &Scene) {
        let mut new: Vec<Arc<ObservedEvent>> =
            scene.events.iter().filter(|event| event.number > self.event).cloned().collect();
        let first = new.iter().map(|event| event.time_unix_ns).min();
        // In the order of their times, which may not be that of their numbers.
        let last = new.iter().map(|event| event.number).max();
        let Some((time_unix_ns, last)) = first.zip(last) else { return };
        let lost = last - self.event - new.len() as u64;
        let is_missing = |number: &u64| !new.iter().any(|event| event.number == *number);
        if let Some(number) = (self.event + 1..last).find(is_missing) {
            let lost = ObservedEvent { number, time_unix_ns, news: News::Lost { count: lost } };
            new.insert(0, Arc::new(lost));
        }
        if self.kept.write(|kept| kept.write_events(&new)).is_some() {
            self.event = last;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{component, scene, status};
    use vocabulary::{FaultState, FaultTransition, Margins};

    fn kept(directory: &Path) -> Arc<RecordDatabase> {
        PageRecords::open(Some(directory)).unwrap().kept.unwrap()
    }

    fn records(kept: Arc<RecordDatabase>) -> PageRecords {
        PageRecords { kept: Some(kept), _task: JoinSet::new() }
    }

    fn names() -> (StructureName, ModuleName) {
        ("tower".parse().unwrap(), "m1".parse().unwrap())
    }

    fn status_at(seconds: u64, departure: f64) -> ModuleStatus {
        let margins = Margins {
            departure: Some(departure),
            ..Margins::unknown("sensor/g1".parse().unwrap())
        };
        let time_unix_ns = seconds * 1_000_000_000;
        ModuleStatus { margins: vec![margins], time_unix_ns, ..status("m1") }
    }

    fn fault(sequence: u64) -> News {
        let transition = component("m1/sensor/g1", FaultState::Latched);
        News::Fault(Box::new(FaultTransition { sequence, ..transition }))
    }

    fn event(number: u64, news: News) -> Arc<ObservedEvent> {
        Arc::new(ObservedEvent { number, time_unix_ns: 1000 + number, news })
    }

    #[test]
    fn margins_survive_a_kill_except_for_the_last_minutes_and_an_interval_goes_on_after_it() {
        let directory = tempfile::tempdir().unwrap();
        let (structure, module) = names();
        {
            let kept = kept(directory.path());
            for second in 0..100 {
                kept.add(&status_at(second, 0.5)).unwrap();
            }
            kept.write_margins(true).unwrap();
            kept.add(&status_at(100, 0.9)).unwrap();
            // No `close`: what came after the last writing is lost.
        }
        let kept = kept(directory.path());
        kept.add(&status_at(101, -1.0)).unwrap();
        let records = records(kept);
        let of = |span| records.margins((&structure, &module), span, 101);
        let departure = |(_, summary): &(u64, ModuleSummary)| summary["sensor/g1"][1];
        let hour = of(TrendSpan::Hour);
        assert_eq!(
            hour.iter().map(|(begin, _)| *begin).collect::<Vec<_>>(),
            [0, 20, 40, 60, 80, 100]
        );
        assert_eq!((departure(&hour[5]).count, departure(&hour[5]).mean), (1, -1.0));
        let day = of(TrendSpan::Day);
        assert_eq!(departure(&day[0]).count, 101);
        assert!((f64::from(departure(&day[0]).mean) - 49.0 / 101.0).abs() < 1e-6);
        assert_eq!(departure(&day[0]).extreme, -1.0);
    }

    #[test]
    fn a_module_takes_a_fixed_space_and_what_is_older_than_a_span_is_dropped() {
        let directory = tempfile::tempdir().unwrap();
        let kept = kept(directory.path());
        let hours = 30;
        for minute in 0..hours * 60 {
            kept.add(&status_at(60 * minute, 0.1)).unwrap();
            if minute.is_multiple_of(20) {
                kept.write_margins(false).unwrap();
            }
        }
        kept.write_margins(true).unwrap();
        let rows = |span: TrendSpan| {
            let table = kept.database.begin_read().unwrap().open_table(MARGINS).unwrap();
            let all = ("tower/m1", span as u8, 0)..("tower/m1", span as u8, u64::MAX);
            table.range(all).unwrap().count() as u64
        };
        assert!(rows(TrendSpan::Hour) <= TrendSpan::Hour.intervals(), "{}", rows(TrendSpan::Hour));
        assert!(rows(TrendSpan::Day) <= TrendSpan::Day.intervals(), "{}", rows(TrendSpan::Day));
        assert_eq!((rows(TrendSpan::Month), rows(TrendSpan::Year)), (8, 2));
        assert!(kept.recent.lock().len() <= TrendSpan::ALL.len());
    }

    #[test]
    fn a_year_of_a_module_takes_a_megabyte() {
        let directory = tempfile::tempdir().unwrap();
        let kept = kept(directory.path());
        let mut status = status_at(0, 0.1);
        let one = Margins {
            change: Some(0.0123),
            departure: Some(-0.2345),
            scatter: Some(0.0678),
            ..Margins::unknown("sensor/g1".parse().unwrap())
        };
        let component = |k: u64| format!("sensor/g{k}").parse().unwrap();
        status.margins =
            (0..12).map(|k| Margins { component: component(k), ..one.clone() }).collect();
        let modules = 4;
        // Twice as long as each span lasts, in steps of its interval.
        for span in TrendSpan::ALL {
            for interval in 0..2 * span.intervals() {
                status.time_unix_ns = interval * span.interval_s() * 1_000_000_000;
                for module in 0..modules {
                    status.module = format!("m{module}").parse().unwrap();
                    kept.add(&status).unwrap();
                }
                if interval.is_multiple_of(3) {
                    kept.write_margins(false).unwrap();
                }
            }
            kept.write_margins(true).unwrap();
        }
        drop(kept);
        let bytes = std::fs::metadata(directory.path().join(FILE)).unwrap().len();
        assert!(bytes < modules * 1_500_000, "{bytes} bytes for {modules} modules");
    }

    #[test]
    fn the_history_of_a_module_that_is_gone_is_what_was_heard_of_it_once_each() {
        let directory = tempfile::tempdir().unwrap();
        let (structure, module) = names();
        let gone = News::Presence {
            structure: structure.clone(),
            who: "m1".to_owned(),
            there: false,
            at_start: false,
        };
        let first =
            [event(1, fault(7)), event(2, gone), event(3, News::Connection { connected: false })];
        kept(directory.path()).write_events(&first).unwrap();
        // The page starts again, and is told of the present fault once more.
        let News::Fault(again) = fault(7) else { unreachable!() };
        let kept = kept(directory.path());
        kept.write_events(&[event(9, News::Present(again))]).unwrap();
        let records = records(kept);
        let heard = records.history(&structure, &module, 0..=u64::MAX, 100);
        let sequences: Vec<u64> = heard.transitions.iter().map(|one| one.sequence).collect();
        assert_eq!((sequences, heard.observed.len(), heard.is_heard), (vec![7], 4, true));
        assert_eq!(heard.notes(), ["m1: what follows is what this page heard of it"]);
        assert_eq!(records.modules(), [(structure, module)]);
        assert_eq!(records.since_unix_ns(), Some(1001));
    }

    #[test]
    fn each_event_is_kept_once_and_those_that_were_missed_are_counted() {
        let directory = tempfile::tempdir().unwrap();
        let (structure, module) = names();
        let kept = kept(directory.path());
        let mut seen = scene(Vec::new());
        seen.events = [event(3, fault(3)), event(4, fault(4))].into();
        let recorder = Recorder::new(Arc::clone(&kept)).take(&seen);
        let recorder = recorder.take(&seen);
        seen.events.push_back(event(5, fault(5)));
        recorder.take(&seen);
        let heard = records(kept).history(&structure, &module, 0..=u64::MAX, 100);
        assert_eq!(heard.transitions.iter().map(|one| one.sequence).collect::<Vec<_>>(), [3, 4, 5]);
        assert!(matches!(
            heard.observed[..],
            [ObservedEvent { news: News::Lost { count: 2 }, .. }]
        ));
    }

    #[test]
    fn an_event_without_a_line_is_not_lost() {
        let directory = tempfile::tempdir().unwrap();
        let (structure, module) = names();
        let kept = kept(directory.path());
        let mut known = observer::Structures::new(Some(&structure), vec![module.clone()]);
        let normal = || News::Present(Box::new(component("m1/sensor/g1", FaultState::Normal)));
        let mut recorder = Recorder::new(Arc::clone(&kept));
        for news in [normal(), normal(), fault(3), normal(), fault(4)] {
            known.news(news, 1000);
            recorder = recorder.take(&known.scene(1, 1000));
        }
        let heard = records(kept).history(&structure, &module, 0..=u64::MAX, 100);
        assert_eq!((heard.transitions.len(), heard.observed), (2, vec![]));
    }

    #[test]
    fn that_records_can_be_read_does_not_hide_that_they_cannot_be_written() {
        let directory = tempfile::tempdir().unwrap();
        let kept = kept(directory.path());
        let full = |_: &RecordDatabase| -> Result<(), StoreError> {
            Err(StoreError::Corrupted("no space left".to_owned()))
        };
        kept.write(full);
        assert!(kept.read(RecordDatabase::read_names).is_some());
        assert!(kept.problem.lock().as_ref().unwrap().contains("no space left"));
        kept.write(|kept| kept.write_margins(true)).unwrap();
        assert_eq!(*kept.problem.lock(), None);
    }

    #[test]
    fn a_file_that_is_no_database_is_refused_with_its_name() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join(FILE), "rubbish").unwrap();
        let problem = PageRecords::open(Some(directory.path())).unwrap_err();
        assert!(problem.contains(FILE) && problem.contains("move it away"), "{problem}");
    }
}
