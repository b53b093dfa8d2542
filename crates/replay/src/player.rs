//! Feeds the inputs of a course to a diagnoser.

use std::collections::BTreeMap;

use diagnosis::{Action, Diagnoser, Measurements, Transition};
use vocabulary::{CorrectedReadings, RunId, Step};

use crate::collection::ModuleRecord;
use crate::comparison::ReplayComparison;
use crate::course::{CourseItem, ProcessCourse, courses};
use crate::samples::{Samples, empty_sample};
use crate::shortfall::Shortfall;

/// A diagnoser rejects samples further ahead than this \[s\].
const STEP_JUMP_S: f64 = 10.0;

/// A transition of the replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayedTransition {
    /// The transition.
    pub transition: Transition,
    /// The time of publishing of the latest sample before it \[ns since 1970\].
    pub time_unix_ns: u64,
}

/// The result of a replay.
#[derive(Debug)]
pub struct Replayed {
    /// The transitions, in order.
    pub transitions: Vec<ReplayedTransition>,
    /// The number of samples used.
    pub samples: u64,
    /// The comparison with the recording.
    pub comparison: ReplayComparison,
    /// Why it ends early, if so.
    pub shortfall: Option<Shortfall>,
}

/// Feeds an item to a diagnoser with this length of a step \[s\]. Returns the time of publishing of a sample. `sample` is
/// reused.
pub(crate) fn feed(
    (diagnoser, step_s): (&mut Diagnoser, f64),
    item: &CourseItem,
    samples: &Samples,
    sample: &mut Measurements,
    actions: &mut Vec<Action>,
) -> Option<u64> {
    match item {
        CourseItem::Sample(index) => {
            samples.read(*index, sample);
            diagnoser.take_sample(sample, actions);
            return samples.head(*index).map(|head| head.time_unix_ns);
        }
        CourseItem::Rejected(run, step) => {
            if is_of_consequence(diagnoser, step_s, (*run, *step)) {
                let sample = without_values(diagnoser, *run, *step);
                diagnoser.take_sample(&sample, actions);
            }
        }
        CourseItem::Event(event) => diagnoser.handle((**event).clone(), actions),
    }
    None
}

/// A sample without values.
fn without_values(diagnoser: &Diagnoser, run: RunId, step: Step) -> Measurements {
    let is_actuator = |c: &&vocabulary::Component| matches!(c, vocabulary::Component::Actuator(_));
    let actuators = diagnoser.components().iter().filter(is_actuator).count();
    let gages = diagnoser.components().len() - actuators;
    Measurements {
        run,
        step,
        demands_n: vec![f64::NAN; actuators],
        pressures_pa: vec![[f64::NAN; 2]; actuators],
        elongations_m: vec![f64::NAN; gages],
    }
}

/// Whether a sample is rejected because of its step. One with the wrong number of values is rejected whatever its step,
/// and has no effect.
fn is_of_consequence(diagnoser: &Diagnoser, step_s: f64, (run, step): (RunId, Step)) -> bool {
    let last = diagnoser.last_step().filter(|_| diagnoser.run() == Some(run));
    last.is_some_and(|last| step <= last || step.since(last) as f64 * step_s > STEP_JUMP_S)
}

/// Replays the inputs of a process. Its queries to peers are ignored, because the answers are recorded.
///
/// # Errors
/// The setup is invalid.
pub fn replay(record: &ModuleRecord, course: &ProcessCourse) -> Result<Replayed, Shortfall> {
    replay_watched(record, course, &mut |_| ())
}

/// What the gages of a run read at each step, or should have read if they were declared faulty, as the recorded processes
/// of the module had it; without its peers' forces, which no recording has.
///
/// # Errors
/// No process of the module can be replayed.
pub fn corrected(
    record: &ModuleRecord,
    run: RunId,
) -> Result<BTreeMap<Step, CorrectedReadings>, Shortfall> {
    let mut readings = BTreeMap::new();
    let mut shortfall = Some(Shortfall::NoInputs);
    for (_, course) in courses(record) {
        let replayed = course.and_then(|course| {
            replay_watched(record, &course, &mut |diagnoser| {
                if let (Some(now), Some(step)) = (diagnoser.run(), diagnoser.last_step())
                    && now == run
                {
                    diagnoser.write_readings(readings.entry(step).or_default());
                }
            })
        });
        match replayed {
            Ok(_) => shortfall = None,
            Err(why) => shortfall = shortfall.map(|_| why),
        }
    }
    shortfall.map_or(Ok(readings), Err)
}

/// Replays, and shows the diagnoser after each sample.
fn replay_watched(
    record: &ModuleRecord,
    course: &ProcessCourse,
    watch: &mut dyn FnMut(&Diagnoser),
) -> Result<Replayed, Shortfall> {
    let mut diagnoser =
        Diagnoser::new(course.setup.clone()).map_err(|problems| Shortfall::of_setup(&problems))?;
    match &course.state {
        Some(state) => diagnoser = state.diagnoser.clone(),
        None => diagnoser.recall(course.memory.clone()),
    }
    let before = diagnoser.counters().samples;
    let mut player = Player {
        record,
        diagnoser,
        step_s: course.setup.step_s,
        sample: empty_sample(),
        time_unix_ns: 0,
        transitions: Vec::new(),
        comparison: ReplayComparison::new(record, course),
    };
    let shortfall = player.play(&course.items, watch).err().or(course.shortfall.clone());
    player.comparison.finish(course, shortfall.is_some());
    let Player { diagnoser, transitions, comparison, .. } = player;
    let samples = diagnoser.counters().samples - before;
    Ok(Replayed { transitions, samples, comparison, shortfall })
}

struct Player<'a> {
    record: &'a ModuleRecord,
    diagnoser: Diagnoser,
    step_s: f64,
    sample: Measurements,
    time_unix_ns: u64,
    transitions: Vec<ReplayedTransition>,
    comparison: ReplayComparison,
}

impl Player<'_> {
    fn play(
        &mut self,
        items: &[CourseItem],
        watch: &mut dyn FnMut(&Diagnoser),
    ) -> Result<(), Shortfall> {
        let mut actions = Vec::new();
        for item in items {
            let used = self.diagnoser.counters().samples;
            let samples = &self.record.samples;
            let published = feed(
                (&mut self.diagnoser, self.step_s),
                item,
                samples,
                &mut self.sample,
                &mut actions,
            );
            self.time_unix_ns = published.unwrap_or(self.time_unix_ns);
            let takes = u64::from(matches!(item, CourseItem::Sample(_)));
            if self.diagnoser.counters().samples != used + takes {
                return Err(Shortfall::UnknownSample { samples: used });
            }
            self.note(&mut actions);
            if takes > 0 {
                self.comparison.step(&self.diagnoser);
                watch(&self.diagnoser);
            }
        }
        Ok(())
    }

    fn note(&mut self, actions: &mut Vec<Action>) {
        for action in actions.drain(..) {
            match action {
                Action::Publish(transition) => {
                    self.comparison.transition(&transition, self.time_unix_ns);
                    let time_unix_ns = self.time_unix_ns;
                    self.transitions.push(ReplayedTransition { transition, time_unix_ns });
                }
                Action::Identify(excerpt) => self.comparison.identification(&excerpt),
                _ => {}
            }
        }
    }
}
