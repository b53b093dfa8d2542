//! Which diagnosers are present, and how far they have come.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};
use vocabulary::{Key, ModuleName, Progress, RunId, Step, StructureName, Topic, keys::Watched};
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

/// How long a wait lasts at most before it is checked whether the end was requested.
const GLANCE: Duration = Duration::from_millis(50);

/// The diagnosers of the equipped modules.
#[derive(Debug)]
pub(crate) struct Diagnosers {
    run: RunId,
    state: Mutex<DiagnosersState>,
    changed: Condvar,
}

#[derive(Debug)]
struct DiagnosersState {
    /// The step that the plant computes next.
    next_step: Step,
    modules: BTreeMap<ModuleName, ModuleProgress>,
}

#[derive(Debug, Clone, Copy, Default)]
struct ModuleProgress {
    present: bool,
    /// Steps that need not be waited for any more, counted from 0.
    done: Step,
    /// After the latest step that was published: for later ones there is nothing to wait for.
    published: Step,
    /// Made no progress for too long: not waited for until it does.
    excused: bool,
}

impl ModuleProgress {
    fn is_waited_for(&self) -> bool {
        self.present && !self.excused
    }
}

impl Diagnosers {
    pub(crate) fn new(run: RunId, modules: &[ModuleName]) -> Self {
        let entries = modules.iter().map(|module| (module.clone(), ModuleProgress::default()));
        let state = DiagnosersState { next_step: Step(0), modules: entries.collect() };
        Self { run, state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Notes who comes and goes, those included who are there already.
    pub(crate) async fn watch_tokens(
        self: &Arc<Self>,
        session: &Session,
        structure: &StructureName,
    ) -> zenoh::Result<Subscriber<()>> {
        let this = Arc::clone(self);
        let watched = Watched { structure: Some(structure), module: None };
        session
            .liveliness()
            .declare_subscriber(watched.tokens())
            .history(true)
            .callback(move |token| {
                if let Ok(Key::Module { module, topic: Topic::Alive, .. }) =
                    token.key_expr().as_str().parse()
                {
                    this.note_presence(&module, token.kind() == SampleKind::Put);
                }
            })
            .await
    }

    fn note_presence(&self, module: &ModuleName, present: bool) {
        let mut state = self.state();
        let next_step = state.next_step;
        let Some(entry) = state.modules.get_mut(module) else { return };
        tracing::info!(%module, step = %next_step, "diagnoser {}", if present { "reachable" } else { "disappeared" });
        // A diagnoser that returns in the middle has not seen the steps before and never will.
        let done = entry.done.max(next_step);
        *entry = ModuleProgress { present, done, published: entry.published, excused: false };
        drop(state);
        self.changed.notify_all();
    }

    fn note_progress(&self, module: &ModuleName, progress: Progress) {
        let mut state = self.state();
        let Some(entry) = state.modules.get_mut(module) else { return };
        let done = progress.step.plus(1);
        if progress.run == self.run && done > entry.done {
            entry.done = done;
            entry.excused = false;
            drop(state);
            self.changed.notify_all();
        }
    }

    /// Subscribes to progress, which diagnosers publish only while there is a subscriber.
    pub(crate) fn watch_progress(
        self: &Arc<Self>,
        session: &Session,
        structure: &StructureName,
    ) -> zenoh::Result<Subscriber<()>> {
        let this = Arc::clone(self);
        let watched = Watched { structure: Some(structure), module: None };
        let take = move |received: zenoh::sample::Sample| {
            let key = received.key_expr().as_str().parse();
            let message = vocabulary::decode::<Progress>(&received.payload().to_bytes());
            match (key, message) {
                (Ok(Key::Module { module, topic: Topic::Progress, .. }), Ok(progress)) => {
                    this.note_progress(&module, progress);
                }
                (_, Err(error)) => tracing::debug!("progress not used: {error}"),
                (Ok(_) | Err(_), Ok(_)) => {}
            }
        };
        session.declare_subscriber(watched.progress()).callback(take).wait()
    }

    /// Those of `modules` that are not present.
    pub(crate) fn missing(&self, modules: &[ModuleName]) -> Vec<ModuleName> {
        let state = self.state();
        let is_missing =
            |module: &&ModuleName| !state.modules.get(*module).is_some_and(|entry| entry.present);
        modules.iter().filter(is_missing).cloned().collect()
    }

    /// Notes that all steps before this one were computed.
    pub(crate) fn advance_to(&self, step: Step) {
        self.state().next_step = step;
    }

    /// Notes that a module's sample of this step was published.
    pub(crate) fn note_published(&self, module: &ModuleName, step: Step) {
        if let Some(entry) = self.state().modules.get_mut(module) {
            entry.published = step.plus(1);
        }
    }

    /// Waits until every present diagnoser has done the steps before `step` that were published. It gives up on
    /// diagnosers without progress for `timeout`, and returns as soon as `stop` is true.
    pub(crate) fn wait_until_done(&self, step: Step, timeout: Duration, stop: impl Fn() -> bool) {
        let mut state = self.state();
        let mut last_sum = None;
        let mut since = Instant::now();
        loop {
            let behind = |entry: &ModuleProgress| {
                entry.is_waited_for() && entry.done < step.min(entry.published)
            };
            if !state.modules.values().any(behind) || stop() {
                return;
            }
            let sum: u128 = state.modules.values().map(|entry| u128::from(entry.done.0)).sum();
            if last_sum != Some(sum) {
                (last_sum, since) = (Some(sum), Instant::now());
            } else if since.elapsed() >= timeout {
                for (module, entry) in state.modules.iter_mut().filter(|(_, entry)| behind(entry)) {
                    tracing::warn!(%module, done = %entry.done, "no progress for {timeout:?}: no longer waiting \
                        for this diagnoser");
                    entry.excused = true;
                }
                return;
            }
            self.changed.wait_for(&mut state, GLANCE.min(timeout));
        }
    }

    fn state(&self) -> MutexGuard<'_, DiagnosersState> {
        self.state.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMEOUT: Duration = Duration::from_millis(30);

    fn module(name: &str) -> ModuleName {
        name.parse().unwrap()
    }

    fn diagnosers() -> Diagnosers {
        Diagnosers::new(RunId(1), &[module("a"), module("b")])
    }

    fn waits(diagnosers: &Diagnosers, step: u64) -> bool {
        let asked = std::cell::Cell::new(0);
        let stop = || {
            asked.set(asked.get() + 1);
            true
        };
        diagnosers.wait_until_done(Step(step), TIMEOUT, stop);
        asked.get() > 0
    }

    fn publish(diagnosers: &Diagnosers, steps: std::ops::Range<u64>) {
        for step in steps.map(Step) {
            diagnosers.note_published(&module("a"), step);
            diagnosers.note_published(&module("b"), step);
        }
    }

    #[test]
    fn those_who_are_not_there_are_missing_and_not_waited_for() {
        let diagnosers = diagnosers();
        publish(&diagnosers, 0..5);
        assert_eq!(diagnosers.missing(&[module("a"), module("b")]), [module("a"), module("b")]);
        assert!(!waits(&diagnosers, 5));
        diagnosers.note_presence(&module("a"), true);
        assert_eq!(diagnosers.missing(&[module("a"), module("b")]), [module("b")]);
        assert!(waits(&diagnosers, 5));
        diagnosers.note_presence(&module("a"), false);
        assert!(!waits(&diagnosers, 5));
    }

    #[test]
    fn the_slowest_is_waited_for() {
        let diagnosers = diagnosers();
        publish(&diagnosers, 0..10);
        for name in ["a", "b"] {
            diagnosers.note_presence(&module(name), true);
        }
        diagnosers.note_progress(&module("a"), Progress { run: RunId(1), step: Step(9) });
        diagnosers.note_progress(&module("b"), Progress { run: RunId(1), step: Step(4) });
        assert!(!waits(&diagnosers, 5));
        assert!(waits(&diagnosers, 6));
    }

    /// As of a recording that begins late or has gaps.
    #[test]
    fn steps_that_were_never_published_are_not_waited_for() {
        let diagnosers = diagnosers();
        diagnosers.note_presence(&module("a"), true);
        assert!(!waits(&diagnosers, 20_000));
        publish(&diagnosers, 20_000..20_010);
        assert!(waits(&diagnosers, 20_001));
        diagnosers.note_progress(&module("a"), Progress { run: RunId(1), step: Step(20_009) });
        assert!(!waits(&diagnosers, 20_500));
    }

    #[test]
    fn progress_in_another_run_counts_for_nothing() {
        let diagnosers = diagnosers();
        publish(&diagnosers, 0..10);
        diagnosers.note_presence(&module("a"), true);
        diagnosers.note_progress(&module("a"), Progress { run: RunId(2), step: Step(9) });
        assert!(waits(&diagnosers, 1));
    }

    #[test]
    fn a_late_diagnoser_owes_nothing_of_what_was_before() {
        let diagnosers = diagnosers();
        publish(&diagnosers, 0..1001);
        diagnosers.advance_to(Step(1000));
        diagnosers.note_presence(&module("a"), true);
        assert!(!waits(&diagnosers, 1000));
        assert!(waits(&diagnosers, 1001));
    }

    #[test]
    fn the_wait_times_out_and_progress_restores_it() {
        let diagnosers = diagnosers();
        publish(&diagnosers, 0..5);
        diagnosers.note_presence(&module("a"), true);
        diagnosers.wait_until_done(Step(5), TIMEOUT, || false);
        assert!(!waits(&diagnosers, 5));
        diagnosers.note_progress(&module("a"), Progress { run: RunId(1), step: Step(2) });
        assert!(waits(&diagnosers, 5));
    }
}
