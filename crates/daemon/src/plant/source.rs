//! What publishes samples, simulated or recorded: declared on the network, paced, and watched by diagnosers.

use std::sync::Arc;
use std::time::{Duration, Instant};

use shell::exit::Failure;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use vocabulary::Occurrences;
use vocabulary::{Encoding, Key, ModuleName, PlantPhase, PlantTopic, RunId, Step, StructureName};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;

use super::diagnosers::Diagnosers;
use super::pacing::Pacing;
use super::sample_publisher::{SampleForm, SamplePublisher};
use super::status::{self, SharedStatus};
use crate::config::{LockStep, Speed};

/// How often presence is checked while diagnosers are waited for.
pub(crate) const PRESENCE_EVERY: Duration = Duration::from_millis(10);
/// How long the diagnosers may take over the last samples.
const LAST_SAMPLES: Duration = Duration::from_secs(5);
/// After the last sample questions for samples are answered until none has come for so long: a recorder notices half a
/// second later that the last ones did not arrive.
const NO_QUESTION: Duration = Duration::from_millis(1500);
/// But no longer than this.
const LAST_QUESTIONS: Duration = Duration::from_secs(10);

/// Whose samples are published, and how fast.
pub(crate) struct SourceSettings {
    pub(crate) structure: StructureName,
    pub(crate) run: RunId,
    /// The modules that have samples.
    pub(crate) modules: Vec<ModuleName>,
    /// Diagnosers that must be present before the first sample.
    pub(crate) wait_for: Vec<ModuleName>,
    /// How fast time passes.
    pub(crate) speed: Speed,
    /// Length of a step \[s\].
    pub(crate) step_s: f64,
    /// By the clock, how many steps are published together.
    pub(crate) burst_steps: u64,
    /// Those of a burst are one message.
    pub(crate) blocks: bool,
    /// The form of messages.
    pub(crate) encoding: Encoding,
    /// How diagnosers are waited for.
    pub(crate) lock_step: LockStep,
}

/// Owned by the thread that publishes samples.
pub(crate) struct PacedSource {
    session: Session,
    settings: SourceSettings,
    /// In the order of the modules.
    publishers: Vec<SamplePublisher>,
    diagnosers: Arc<Diagnosers>,
    /// Subscribed to only when progress is needed.
    progress: Option<Subscriber<()>>,
    pacing: Pacing,
    pub(crate) status: Arc<SharedStatus>,
    supervisor: Arc<Supervisor>,
    shutdown: Shutdown,
    /// Samples that could not be sent.
    unsent: u64,
    unsent_logged: Occurrences,
}

/// What a source has declared on the network.
pub(crate) struct SourceDeclarations {
    token: LivelinessToken,
    presence: Subscriber<()>,
    pub(crate) queryables: Vec<Queryable<()>>,
    pub(crate) reporting: JoinHandle<()>,
}

impl SourceSettings {
    fn form(&self, is_lock_step: bool) -> SampleForm {
        // In lock-step no step may wait in a block that diagnosers are waited for before it is full.
        let most = if is_lock_step { self.lock_step.window_steps } else { u64::MAX };
        let block_steps = if self.blocks { self.burst_steps.min(most) } else { 1 };
        SampleForm { encoding: self.encoding, block_steps, is_lock_step }
    }
}

impl PacedSource {
    pub(crate) async fn declare(
        session: &Session,
        settings: SourceSettings,
        status: Arc<SharedStatus>,
        supervisor: Arc<Supervisor>,
        shutdown: Shutdown,
    ) -> zenoh::Result<(Self, SourceDeclarations)> {
        let SourceSettings { structure, run, modules, .. } = &settings;
        let diagnosers = Arc::new(Diagnosers::new(*run, modules));
        let presence = diagnosers.watch_tokens(session, structure).await?;
        let pacing = Pacing::new(&settings, Arc::clone(&diagnosers));
        let (mut publishers, mut queryables) = (Vec::new(), Vec::new());
        let form = settings.form(pacing.is_lock_step());
        for module in modules {
            let publisher = SamplePublisher::declare(session, structure, module, *run, form);
            let publisher = publisher.await?;
            queryables.push(publisher.recent().declare(session, structure, module).await?);
            publishers.push(publisher);
        }
        let publisher = status::declare(session, structure).await?;
        let reporting = status::report(publisher, Arc::clone(&status), Arc::clone(&supervisor));
        let reporting = tokio::spawn(reporting);
        let token_key = Key::of_plant(structure, PlantTopic::Alive).to_string();
        let token = session.liveliness().declare_token(token_key).await?;
        let source = Self {
            session: session.clone(),
            settings,
            publishers,
            diagnosers,
            progress: None,
            pacing,
            status,
            supervisor,
            shutdown,
            unsent: 0,
            unsent_logged: Occurrences::default(),
        };
        Ok((source, SourceDeclarations { token, presence, queryables, reporting }))
    }

    /// Was the end requested? Every loop of the thread checks this, which shows its progress.
    pub(crate) fn is_to_end(&self) -> bool {
        self.supervisor.progress();
        self.shutdown.is_requested()
    }

    /// Waits for the diagnosers that must be present, and does something else meanwhile, which has to take some time.
    pub(crate) fn wait_for_diagnosers(&mut self, mut meanwhile: impl FnMut()) {
        if self.pacing.is_lock_step() {
            self.watch_progress();
        }
        let mut announced = Vec::new();
        loop {
            let missing = self.diagnosers.missing(&self.settings.wait_for);
            if missing.is_empty() {
                break;
            }
            if announced != missing {
                let names: Vec<String> = missing.iter().map(ToString::to_string).collect();
                tracing::info!(missing = names.join(", "), "waiting for diagnosers");
                self.status.update(|status| status.waiting_for = missing.clone());
                announced = missing;
            }
            if self.is_to_end() {
                break;
            }
            meanwhile();
        }
        self.status.phase(PlantPhase::Running);
    }

    /// Waits until a step may be published.
    pub(crate) fn wait_for_step(&mut self, step: Step) {
        let (supervisor, shutdown) = (&self.supervisor, &self.shutdown);
        self.pacing.wait(step, || {
            supervisor.progress();
            shutdown.is_requested()
        });
    }

    /// Publishes a module's sample, or keeps it for its block. Could be sent what was to be?
    pub(crate) fn publish(
        &mut self,
        module: usize,
        step: Step,
        demands_n: &[f64],
        pressures_pa: &[[f64; 2]],
        elongations_m: &[f64],
    ) -> bool {
        let Some(publisher) = self.publishers.get_mut(module) else { return false };
        let sent = publisher.publish(step, demands_n, pressures_pa, elongations_m);
        self.note_sent(module, sent)
    }

    fn note_sent(&mut self, module: usize, sent: Result<Option<Step>, String>) -> bool {
        let Some(publisher) = self.publishers.get(module) else { return false };
        match sent {
            Ok(Some(last)) => self.diagnosers.note_published(publisher.module(), last),
            Ok(None) => {}
            Err(error) => {
                self.unsent += 1;
                if let Some(times) = self.unsent_logged.note(Instant::now()) {
                    tracing::warn!(module = %publisher.module(), times, "sample not sent: {error}");
                }
                return false;
            }
        }
        true
    }

    /// All samples of the steps before this one were published.
    pub(crate) fn advance_to(&mut self, next_step: Step) {
        self.diagnosers.advance_to(next_step);
        let lateness = self.pacing.lateness();
        self.status.update(|status| {
            status.next_step = next_step;
            status.late_steps = lateness.steps;
            status.latest_ms = lateness.worst.as_secs_f64() * 1e3;
            status.samples_unsent = self.unsent;
        });
    }

    /// Waits until the diagnosers have taken all steps before this one, if there is any, and answers last questions.
    pub(crate) fn finish(&mut self, next_step: Option<Step>) {
        for module in 0..self.publishers.len() {
            let sent = self.publishers[module].flush();
            self.note_sent(module, sent);
        }
        self.status.phase(PlantPhase::Done);
        self.watch_progress();
        if let Some(next_step) = next_step {
            self.diagnosers.wait_until_done(next_step, LAST_SAMPLES, || self.is_to_end());
        }
        let begun = Instant::now();
        let is_asked =
            |publisher: &SamplePublisher| publisher.recent().was_asked_within(NO_QUESTION);
        while !self.is_to_end() && begun.elapsed() < LAST_QUESTIONS {
            if begun.elapsed() >= NO_QUESTION && !self.publishers.iter().any(is_asked) {
                return;
            }
            std::thread::sleep(PRESENCE_EVERY);
        }
    }

    /// Steps that came too late.
    pub(crate) fn late_steps(&self) -> u64 {
        self.pacing.lateness().steps
    }

    /// Without progress, diagnosers are waited for until the timeout.
    fn watch_progress(&mut self) {
        if self.progress.is_none() {
            match self.diagnosers.watch_progress(&self.session, &self.settings.structure) {
                Ok(subscriber) => self.progress = Some(subscriber),
                Err(error) => tracing::warn!("cannot subscribe to diagnosers' progress: {error}"),
            }
        }
    }
}

impl SourceDeclarations {
    pub(crate) async fn undeclare(self) -> zenoh::Result<()> {
        self.reporting.abort();
        self.token.undeclare().await?;
        for queryable in self.queryables {
            queryable.undeclare().await?;
        }
        self.presence.undeclare().await
    }
}

/// Runs work on a thread of its own, which nothing of the runtime holds up.
pub(crate) async fn on_a_thread<T: Send + 'static>(
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Failure> {
    let (ending, ended) = oneshot::channel();
    std::thread::Builder::new()
        .name(name.to_owned())
        .spawn(move || {
            // Fails only if the receiver is gone.
            let _ = ending.send(work());
        })
        .map_err(|error| Failure::running(&format!("cannot start the thread `{name}`"), error))?;
    // An error means that the thread has failed.
    ended.await.map_err(|_| Failure::Running(format!("the thread `{name}` has failed")))
}
