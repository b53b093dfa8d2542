//! A fault, when it begins and ends, and in which run.

use std::time::{Duration, Instant};

use daemon::config::Schedule;

use super::SETTLING;
use super::disturbance::Disturbance;
use super::stage::{Site, Stage};
use crate::LIMIT;
use crate::lab::Lab;

/// Polling interval.
const GLANCE: Duration = Duration::from_millis(20);

/// When a disturbance lasts.
#[derive(Debug, Clone, Copy)]
pub enum Lasting {
    /// From one of the plant's steps to another.
    Steps {
        /// When it begins.
        from: u64,
        /// When it ends.
        until: u64,
    },
    /// It ends as soon as it has begun.
    Moment {
        /// When that is.
        at: u64,
    },
    /// From before the first step to after the last; all the same everything must become right, however long the
    /// disturbance itself takes.
    WholeRun {
        /// The step from which on it is waited for.
        right_from: u64,
    },
}

impl Lasting {
    /// Most steps of the plant to settle in, if there is a limit.
    fn limit(self) -> Option<u64> {
        match self {
            Lasting::WholeRun { .. } => None,
            Lasting::Steps { .. } | Lasting::Moment { .. } => Some(SETTLING),
        }
    }
}

/// A row of the table.
pub struct Row {
    /// What is done, in words.
    pub fault: String,
    /// What is done.
    pub disturbance: Box<dyn Disturbance>,
    /// When.
    pub lasting: Lasting,
    /// The faults of the structure.
    pub schedule: Schedule,
    /// Steps of the run.
    pub steps: u64,
    /// Does it take all that the machine has?
    pub floods: bool,
}

/// What came of a row.
#[derive(Debug, Default)]
pub struct Outcome {
    /// What an undisturbed run finds.
    pub expected: String,
    /// How many steps after the end of the disturbance everything was as in an undisturbed run.
    pub settled: Option<u64>,
    /// In numbers.
    pub seen: Vec<String>,
    /// Violations.
    pub problems: Vec<String>,
    /// What the processes logged, if there are problems.
    pub logs: String,
}

impl Row {
    /// Sets everything up, runs the disturbance and returns the outcome.
    pub async fn perform(mut self, lab: Lab) -> Outcome {
        let mut site = Site::new(lab, &self.schedule);
        self.disturbance.set_up(&mut site).await;
        let mut stage = Stage::raise(site, self.steps).await;
        let mut outcome = Outcome { expected: self.expected(&stage), ..Outcome::default() };
        self.disturb(&mut stage, &mut outcome).await;
        stage.last_step().await;
        // Problems found by now are final; otherwise the last verdicts need a moment.
        if outcome.problems.is_empty()
            && let Err(differences) = settle(&stage, self.lasting.limit()).await
        {
            outcome.problems.extend(differences.iter().map(|what| format!("at the end {what}")));
        }
        self.sum_up(stage, outcome).await
    }

    fn expected(&self, stage: &Stage) -> String {
        match self.lasting {
            Lasting::WholeRun { .. } => format!("{}, at whatever time", stage.expected()),
            Lasting::Steps { .. } | Lasting::Moment { .. } => stage.expected(),
        }
    }

    async fn disturb(&mut self, stage: &mut Stage, outcome: &mut Outcome) {
        match self.lasting {
            Lasting::Steps { from, until } => {
                stage.reach(from).await;
                self.disturbance.begin(stage).await;
                stage.reach(until).await;
            }
            Lasting::Moment { at } => {
                stage.reach(at).await;
                self.disturbance.begin(stage).await;
            }
            Lasting::WholeRun { right_from } => {
                self.disturbance.begin(stage).await;
                stage.reach(right_from).await;
            }
        }
        if !matches!(self.lasting, Lasting::WholeRun { .. }) {
            self.disturbance.end(stage).await;
        }
        match settle(stage, self.lasting.limit()).await {
            Ok(after) => outcome.settled = Some(after),
            Err(differences) => outcome.problems.extend(differences),
        }
    }

    async fn sum_up(mut self, stage: Stage, mut outcome: Outcome) -> Outcome {
        match self.disturbance.effect() {
            Ok(effect) if effect.is_empty() => {}
            Ok(effect) => outcome.seen.push(effect),
            Err(nothing) => outcome.problems.push(nothing),
        }
        self.disturbance.tear_down().await;
        let closing = stage.close().await;
        if closing.unconfirmed > 0 {
            outcome.seen.push(format!("{} unconfirmed meanwhile", closing.unconfirmed));
        }
        outcome.seen.extend(closing.hardships);
        outcome.problems.extend(closing.wrong);
        if !outcome.problems.is_empty() {
            outcome.logs = closing.logs;
        }
        outcome
    }
}

/// Waits until everything is as in an undisturbed run and returns how many of the plant's steps that took; beyond the
/// limit, the differences. Without a limit and when there are no more steps, nothing takes longer than [`LIMIT`].
async fn settle(stage: &Stage, limit: Option<u64>) -> Result<u64, Vec<String>> {
    let (begun, start) = (stage.step(), Instant::now());
    loop {
        let differences = stage.differences().await;
        let steps = stage.step().since(begun);
        if differences.is_empty() {
            return Ok(steps);
        }
        if limit.is_some_and(|limit| steps > limit) || start.elapsed() > LIMIT {
            return Err(differences);
        }
        tokio::time::sleep(GLANCE).await;
    }
}
