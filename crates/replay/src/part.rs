//! The inputs of a module when all modules run together, with their times.

use std::collections::BTreeMap;

use diagnosis::{Event, ModuleSetup};
use vocabulary::{ModuleName, RunId, Step};

use crate::collection::ModuleRecord;
use crate::course::{CourseItem, ProcessCourse};
use crate::samples::Samples;

/// A time: that of the run's first sample, the number of restarts of the run, and the step.
pub(crate) type Moment = (u64, u64, Step);

/// A module of a joint replay.
#[derive(Debug)]
pub struct ReplayPart<'a> {
    pub(crate) samples: &'a Samples,
    pub(crate) setup: ModuleSetup,
    /// Its inputs, in order of their times.
    pub(crate) items: Vec<(Moment, CourseItem)>,
}

/// A setup that no diagnoser accepts.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("module `{module}`: {problems}")]
pub struct PartError {
    /// The module.
    pub module: ModuleName,
    /// Its problems.
    pub problems: String,
}

impl<'a> ReplayPart<'a> {
    /// A module with a setup and the inputs of its processes or, if none is recorded, all its samples in order.
    #[must_use]
    pub fn new(
        record: &'a ModuleRecord,
        courses: &[ProcessCourse],
        setup: ModuleSetup,
        runs: &Beginnings,
    ) -> Self {
        let samples = &record.samples;
        let all: Vec<CourseItem>;
        let items: Box<dyn Iterator<Item = &CourseItem>> = if courses.is_empty() {
            all = (0..samples.len()).map(CourseItem::Sample).collect();
            Box::new(all.iter())
        } else {
            Box::new(courses.iter().flat_map(|course| &course.items))
        };
        let mut line = ItemTimes { runs, run: None, moment: Moment::default(), time: 0 };
        let items = items.filter_map(|item| line.place(samples, item)).collect();
        Self { samples, setup, items }
    }
}

/// The time of the first recorded sample of each run \[ns since 1970\].
#[derive(Debug, Default)]
pub struct Beginnings(BTreeMap<RunId, u64>);

impl Beginnings {
    /// The beginnings of all runs of these modules.
    #[must_use]
    pub fn of(records: &[ModuleRecord]) -> Self {
        let mut runs = BTreeMap::new();
        for record in records {
            for head in (0..record.samples.len()).filter_map(|index| record.samples.head(index)) {
                let first = runs.entry(head.run).or_insert(head.time_unix_ns);
                *first = head.time_unix_ns.min(*first);
            }
        }
        Self(runs)
    }
}

/// Assigns times to the inputs of a module.
#[derive(Debug)]
struct ItemTimes<'a> {
    runs: &'a Beginnings,
    run: Option<RunId>,
    moment: Moment,
    /// The time of publishing of the latest sample.
    time: u64,
}

impl ItemTimes<'_> {
    fn place(&mut self, samples: &Samples, item: &CourseItem) -> Option<(Moment, CourseItem)> {
        match item {
            CourseItem::Sample(index) => {
                let head = samples.head(*index)?;
                let is_same = self.run == Some(head.run);
                if is_same && head.step <= self.moment.2 {
                    // Already used by the process before.
                    if head.time_unix_ns <= self.time {
                        return None;
                    }
                    self.moment.1 += 1;
                }
                self.moment.2 = head.step;
                if !is_same {
                    let begun = self.runs.0.get(&head.run).copied().unwrap_or_default();
                    self.moment = (begun, 0, head.step);
                    self.run = Some(head.run);
                }
                self.time = head.time_unix_ns;
                Some((self.moment, item.clone()))
            }
            CourseItem::Rejected(run, _) => {
                (self.run == Some(*run)).then(|| (self.moment, item.clone()))
            }
            CourseItem::Event(event) => match **event {
                Event::Ordered { .. } => Some((self.moment, item.clone())),
                _ => None,
            },
        }
    }
}
