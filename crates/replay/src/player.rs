//! Leads a course through a diagnoser.

use diagnosis::{Action, Diagnoser, Measurements, Transition};
use vocabulary::{RunId, Step};

use crate::collection::ModuleRecord;
use crate::comparison::ReplayComparison;
use crate::course::{CourseItem, ProcessCourse};
use crate::samples::empty_sample;
use crate::shortfall::Shortfall;

/// A diagnoser takes samples that are less far ahead \[s\].
const STEP_JUMP_S: f64 = 10.0;

/// A verdict of the replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayedTransition {
    /// The transition.
    pub transition: Transition,
    /// When the latest sample before it was published \[ns since 1970\].
    pub time_unix_ns: u64,
}

/// What came of a replay.
#[derive(Debug)]
pub struct Replayed {
    /// The verdicts, in order.
    pub transitions: Vec<ReplayedTransition>,
    /// Samples used.
    pub samples: u64,
    /// What a comparison with the recording found.
    pub comparison: ReplayComparison,
    /// Why it does not go further, if it does not.
    pub shortfall: Option<Shortfall>,
}

/// A sample without a value.
pub(crate) fn without_values(diagnoser: &Diagnoser, run: RunId, step: Step) -> Measurements {
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

/// Was a sample refused because of its step? One that has the wrong number of values is refused whatever its step, and
/// leaves nothing behind.
pub(crate) fn is_of_consequence(
    diagnoser: &Diagnoser,
    step_s: f64,
    (run, step): (RunId, Step),
) -> bool {
    let last = diagnoser.last_step().filter(|_| diagnoser.run() == Some(run));
    last.is_some_and(|last| step <= last || step.since(last) as f64 * step_s > STEP_JUMP_S)
}

/// Replays what a process took. Whatever it would do itself, such as querying its peers, it need not: the answers are
/// recorded.
///
/// # Errors
/// A setup that no diagnoser can be made of.
pub fn replay(record: &ModuleRecord, course: &ProcessCourse) -> Result<Replayed, Shortfall> {
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
    let shortfall = player.play(&course.items).err().or(course.shortfall.clone());
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
    fn play(&mut self, items: &[CourseItem]) -> Result<(), Shortfall> {
        let mut actions = Vec::new();
        for item in items {
            let used = self.diagnoser.counters().samples;
            match item {
                CourseItem::Sample(index) => self.take(*index, &mut actions),
                CourseItem::Rejected(run, step) => {
                    if is_of_consequence(&self.diagnoser, self.step_s, (*run, *step)) {
                        let sample = without_values(&self.diagnoser, *run, *step);
                        self.diagnoser.take_sample(&sample, &mut actions);
                    }
                }
                CourseItem::Event(event) => self.diagnoser.handle((**event).clone(), &mut actions),
            }
            let takes = u64::from(matches!(item, CourseItem::Sample(_)));
            if self.diagnoser.counters().samples != used + takes {
                return Err(Shortfall::UnknownSample { samples: used });
            }
            self.note(&mut actions);
            if takes > 0 {
                self.comparison.step(&self.diagnoser);
            }
        }
        Ok(())
    }

    fn take(&mut self, index: usize, actions: &mut Vec<Action>) {
        self.record.samples.read(index, &mut self.sample);
        self.time_unix_ns =
            self.record.samples.head(index).map_or(self.time_unix_ns, |head| head.time_unix_ns);
        self.diagnoser.take_sample(&self.sample, actions);
    }

    fn note(&mut self, actions: &mut Vec<Action>) {
        for action in actions.drain(..) {
            match action {
                Action::Publish(transition) => {
                    self.comparison.transition(&transition);
                    let time_unix_ns = self.time_unix_ns;
                    self.transitions.push(ReplayedTransition { transition, time_unix_ns });
                }
                Action::Identify(excerpt) => self.comparison.identification(&excerpt),
                _ => {}
            }
        }
    }
}
