//! Other detectors on the same residuals, at the same rate of false alarms.
//!
//! Every detector has one statistic for each channel, divided by the mean of its largest healthy values, and alarms when one
//! of them exceeds a common limit. The limit follows from fault-free runs and the rate of false alarms asked for. The alarm
//! names the channel whose statistic is the largest within the hold time: the rule of the shipped diagnosers, without
//! delays of the network.

mod channelwise;
mod detectors;
mod joint;
mod summary;

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

pub use detectors::DetectorName;
pub use summary::{RivalKind, RivalPoint, RivalRow, RivalSummary, SizedFaults};

use crate::campaign::{Campaign, Rows};
use crate::case::{CampaignCase, CaseRun};
use crate::error::StudyError;
use crate::figure::rivals_figure;
use crate::group::{Diagnosed, RigEvent};
use crate::report::{ReportFigure, Table};
use crate::rig::{Rig, TimedFault};
use crate::scenarios::ScenarioCampaign;
use crate::system::{CommissionedPlant, System};
use detectors::{DetectorBank, Trained};

/// A fault is followed for so long \[s\].
const FOLLOWED_S: f64 = 2.0;

/// Scenarios and fault-free runs of which the first half sets the limits and the second half is counted.
pub struct RivalCampaign {
    /// The scenarios and the fault-free runs.
    pub of: ScenarioCampaign,
    /// The same plant with the paper's diagnosers.
    pub paper: System,
    /// False alarms of each detector per hour.
    pub per_hour: f64,
    trained: OnceLock<Result<Trained, String>>,
}

/// The course of a detector's largest statistic in a run. Levels are logarithmic, in steps of 2 %.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StatisticCourse {
    /// The highest level while there was no fault.
    pub healthy: Option<i32>,
    /// From the onset on, each level that is higher than all before: steps since the onset, level, and place of the
    /// channel among those of all modules.
    pub rising: Vec<(u64, i32, usize)>,
}

/// The result of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RivalRecord {
    /// Its fault; `None` in a fault-free run.
    pub injection: Option<TimedFault>,
    /// Place of its channel.
    pub faulty: Option<usize>,
    /// Steps that were watched without a fault.
    pub watched: u64,
    /// One for each detector.
    pub courses: Vec<StatisticCourse>,
    /// What the shipped diagnosers named.
    pub shipped: Vec<Diagnosed>,
    /// What the paper's diagnosers named.
    pub paper: Vec<Diagnosed>,
}

/// The level of a statistic; `None` for no statistic.
fn level(statistic: f64) -> Option<i32> {
    (statistic > 0.0).then(|| (statistic.ln() / 1.02_f64.ln()).floor() as i32)
}

impl RivalCampaign {
    /// A campaign with untrained detectors; they are trained by the first case.
    #[must_use]
    pub fn new(of: ScenarioCampaign, paper: System, per_hour: f64) -> Self {
        Self { of, paper, per_hour, trained: OnceLock::new() }
    }

    /// Whether this case sets limits.
    fn calibrates(&self, case: u64) -> bool {
        case >= self.of.scenarios && case < self.of.scenarios + self.of.nominal.div_ceil(2)
    }

    /// Steps between an alarm and the decision which component it names.
    fn hold_steps(&self) -> u64 {
        let setups = self.of.system.setups.iter();
        setups.map(|setup| setup.isolation.hold_steps).max().unwrap_or(0)
    }

    fn trained(&self) -> Result<&Trained, StudyError> {
        let train =
            || Trained::new(&self.of.system, &self.paper).map_err(|error| error.to_string());
        self.trained
            .get_or_init(train)
            .as_ref()
            .map_err(|error| StudyError::Training(error.clone()))
    }
}

impl Campaign for RivalCampaign {
    type Kind = &'static str;
    type Row = RivalRecord;
    type Summary = RivalSummary;

    fn systems(&self) -> &[System] {
        self.of.systems()
    }

    fn cases(&self) -> u64 {
        self.of.cases()
    }

    fn plant_of(&self, case: u64) -> (usize, Option<u64>) {
        self.of.plant_of(case)
    }

    fn draw(
        &self,
        number: u64,
        plant: Option<&CommissionedPlant>,
    ) -> Result<CampaignCase<&'static str>, StudyError> {
        self.of.draw(number, plant)
    }

    fn judge(
        &self,
        case: &CampaignCase<&'static str>,
        run: &mut CaseRun,
    ) -> Result<RivalRecord, StudyError> {
        let trained = self.trained()?;
        let mut statistics = DetectorBank::new(trained);
        let mut paper = self.paper.rig(case.seed, case.faults.clone())?;
        let mut paper_events = Vec::new();
        let fault = case.faults.first();
        let onset = fault.map(|fault| fault.at);
        let last = onset.map_or(u64::MAX, |onset| onset.0 + self.of.system.steps(FOLLOWED_S));
        let from = self.of.system.watched_from().max(self.paper.watched_from());
        let mut courses = vec![StatisticCourse::default(); DetectorName::ALL.len()];
        let mut watched = 0;
        while run.step()? {
            paper.step()?;
            paper_events.extend(paper.take_occurrences());
            let Some(step) = run.rig.samples().first().map(|sample| sample.step) else { continue };
            let largest = statistics.step(&run.rig, &paper);
            if step.0 < from {
                continue;
            }
            let since = onset.filter(|onset| step >= *onset).map(|onset| step.since(onset));
            watched += u64::from(since.is_none());
            for (course, (statistic, place)) in courses.iter_mut().zip(largest) {
                course.follow(since, *statistic, *place);
            }
            if step.0 >= last {
                break;
            }
        }
        let paper = paper_events.iter().filter_map(RigEvent::diagnosed).collect();
        Ok(RivalRecord {
            injection: fault.cloned(),
            faulty: fault.and_then(|fault| place_of(&run.rig, fault)),
            watched,
            courses,
            shipped: run.diagnosed(),
            paper,
        })
    }

    fn summarize(&self, rows: &Rows<RivalRecord>) -> RivalSummary {
        let step_s = self.of.system.parameters.step_s;
        let calibrates = |case: u64| self.calibrates(case);
        RivalSummary::of(rows, calibrates, self.per_hour, self.hold_steps(), step_s)
    }

    fn tables(&self, _: &Rows<RivalRecord>, summary: &RivalSummary) -> (Vec<Table>, Vec<String>) {
        summary.tables()
    }

    fn figures(&self, summary: &RivalSummary) -> Result<Vec<ReportFigure>, StudyError> {
        let caption = "Right component against the size of the fault".to_owned();
        Ok(vec![ReportFigure { name: "rivals", caption, svg: rivals_figure(summary) }])
    }
}

impl StatisticCourse {
    /// Processes the largest statistic of a step.
    fn follow(&mut self, since_onset: Option<u64>, statistic: f64, place: usize) {
        let Some(level) = level(statistic) else { return };
        match since_onset {
            None => self.healthy = self.healthy.max(Some(level)),
            Some(since) => {
                if self.rising.last().is_none_or(|(_, highest, _)| level > *highest) {
                    self.rising.push((since, level, place));
                }
            }
        }
    }

    /// Steps from the onset to the alarm at this limit, and the place that it names.
    fn alarm(&self, limit: i32, hold_steps: u64) -> Option<(u64, usize)> {
        let first = self.rising.iter().position(|(_, level, _)| *level >= limit)?;
        let (since, ..) = self.rising[first];
        let held = self.rising[first..].iter().take_while(|(at, ..)| *at <= since + hold_steps);
        held.last().map(|(_, _, place)| (since, *place))
    }
}

/// Place of a fault's channel among those of all modules.
fn place_of(rig: &Rig, fault: &TimedFault) -> Option<usize> {
    let channels = rig.diagnosers().iter().flat_map(|diagnoser| {
        let module = diagnoser.module();
        diagnoser.components().iter().map(move |component| (module, component))
    });
    let (module, component) = (&fault.component.module, &fault.component.component);
    let mut channels = channels.enumerate();
    channels.find(|(_, of)| *of == (module, component)).map(|(place, _)| place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_names_the_largest_within_the_hold_time() {
        let course = StatisticCourse {
            healthy: None,
            rising: vec![(3, 0, 5), (4, 10, 6), (9, 20, 7), (12, 30, 8)],
        };
        assert_eq!(course.alarm(1, 6), Some((4, 7)));
        assert_eq!(course.alarm(0, 6), Some((3, 7)));
        assert_eq!(course.alarm(11, 0), Some((9, 7)));
        assert_eq!(course.alarm(31, 6), None);
    }

    #[test]
    fn a_course_keeps_what_is_higher_than_before() {
        let mut course = StatisticCourse::default();
        for (since, statistic) in
            [(None, 2.0), (None, 1.0), (Some(0), 1.0), (Some(1), 0.5), (Some(2), 3.0)]
        {
            course.follow(since, statistic, 4);
        }
        assert_eq!(course.healthy, level(2.0));
        assert_eq!(course.rising, [(0, 0, 4), (2, level(3.0).unwrap(), 4)]);
        assert_eq!((level(1.0), level(1.021), level(0.0)), (Some(0), Some(1), None));
    }
}
