//! The process: observes, saves what is to be sent, and sends it to each recipient in a separate task.

use std::collections::BTreeMap;
use std::fs::{DirBuilder, File};
use std::io::Write;
use std::net::SocketAddr;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use observer::NetworkState;
use observer::calls::{Calls, OpenIncident};
use parking_lot::Mutex;
use session::client::Live;
use session::{CertificateWatch, Network};
use shell::clock::unix_ns;
use shell::exit::Failure;
use shell::health::{HealthCondition, Listening, ProcessReport, Subject, live, render};
use shell::shutdown::Shutdown;
use shell::supervision::{Pulse, Supervisor};
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::sleep;
use vocabulary::delivery::Backoff;
use vocabulary::{ModuleName, StructureName};

use crate::recipients::{MessageContext, TellError, remind, tell};
use crate::settings::{Notify, Recipient, Service};

/// Interval of looking at the scene if nothing changes; each look is a watchdog heartbeat.
const EVERY: Duration = Duration::from_millis(250);
/// Pauses between attempts to tell a recipient.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(60);
/// Interval of sending active alerts to Alertmanagers again.
const REMIND_EVERY: Duration = Duration::from_secs(60);
/// Longest time for messages under way at shutdown.
const DRAINING: Duration = Duration::from_secs(2);
/// The file of open incidents and pending notifications in the state directory, and its next version.
const STATE: &str = "calls.json";
const NEXT_STATE: &str = "calls.json.new";

/// Configuration of the process.
#[derive(Debug, Clone)]
pub struct NotifyConfig {
    /// The network to connect to.
    pub network: Network,
    /// The structure to observe; otherwise all.
    pub structure: Option<StructureName>,
    /// Modules that should be running.
    pub expected: Vec<ModuleName>,
    /// Whom to tell.
    pub notify: Notify,
    /// The structure's description, for places and drawings.
    pub drawing: Option<truss::Structure>,
    /// The directory of open incidents and pending notifications.
    pub state_dir: PathBuf,
    /// The address of health and metrics.
    pub health: Option<SocketAddr>,
    /// Timeout for opening a session.
    pub timeout: Duration,
    /// Certificates of other processes: people are told when they expire soon, as of this process's own.
    pub certificates: Vec<PathBuf>,
}

/// Observes and tells until shutdown.
///
/// # Errors
/// The state directory cannot be used, its content is damaged, or the health address is in use.
pub async fn run(config: NotifyConfig, shutdown: Shutdown) -> Result<(), Failure> {
    let supervisor = Supervisor::from_environment();
    let calls = restore(&config.state_dir, &config.notify.recipients)?;
    let listening = Listening::on(config.health)
        .map_err(|error| Failure::running("health is not served", error))?;
    let desk = Arc::new(Desk::new(&config, calls, supervisor.pulse()));
    let served = listening.serve(Health(Arc::clone(&desk)));
    let _server = served.map_err(|error| Failure::running("health is not served", error))?;
    let NotifyConfig { network, structure, expected, timeout, .. } = config;
    let open = move || {
        let network = network.clone();
        async move { session::open_within(&network, timeout).await }
    };
    let observed = Live::start(open, structure, expected);
    let mut telling = JoinSet::new();
    for recipient in &config.notify.recipients {
        tracing::info!("recipient: {}", recipient.name);
        telling.spawn(attend(Arc::clone(&desk), recipient.clone()));
    }
    supervisor.ready("observing");
    observe(&desk, &observed, &supervisor, config.notify.escalate_after, shutdown).await;
    supervisor.stopping();
    desk.end();
    let all = async { while telling.join_next().await.is_some() {} };
    if tokio::time::timeout(DRAINING, all).await.is_err() {
        tracing::info!(
            "shutdown timed out: a message being sent is sent again after the next start"
        );
    }
    if let Some(session) = observed.session() {
        session::close(&session).await;
    }
    Ok(())
}

async fn observe(
    desk: &Desk,
    observed: &Live,
    supervisor: &Supervisor,
    escalate_after: Option<Duration>,
    mut shutdown: Shutdown,
) {
    let escalate_after_ns = escalate_after.map(|after| after.as_nanos() as u64);
    let mut scenes = observed.scenes();
    while !shutdown.is_requested() {
        supervisor.progress();
        supervisor.status(&desk.status());
        let scene = observed.scene();
        let (now, shown) = (unix_ns(), desk.certificates.shown());
        desk.change(|calls| {
            calls.observe_certificates(&shown, now) | calls.observe(&scene, now, escalate_after_ns)
        });
        desk.connection(&scene.network);
        tokio::select! {
            () = shutdown.requested() => {}
            _ = scenes.changed() => {}
            () = sleep(EVERY) => {}
        }
    }
}

/// Tells one recipient, one call after the other.
async fn attend(desk: Arc<Desk>, recipient: Recipient) {
    let mut news = desk.news.subscribe();
    let mut backoff = Backoff::new(FIRST_PAUSE, LONGEST_PAUSE);
    let mut reminded = Instant::now();
    loop {
        if *news.borrow_and_update() == ENDED {
            return;
        }
        let is_alertmanager = recipient.service == Service::Alertmanager;
        let call = desk.calls.lock().next(&recipient.key).cloned();
        let outcome = if let Some(call) = call.clone() {
            let (to, around) = (recipient.clone(), Arc::clone(&desk.around));
            blocking(move || tell(&to, &call, &around)).await
        } else if is_alertmanager && reminded.elapsed() >= REMIND_EVERY {
            let open: Vec<OpenIncident> = desk.calls.lock().open().cloned().collect();
            let (to, around) = (recipient.clone(), Arc::clone(&desk.around));
            reminded = Instant::now();
            blocking(move || remind(&to, open.iter(), unix_ns(), &around)).await
        } else {
            let waiting = async {
                let _ = news.changed().await;
            };
            if is_alertmanager {
                let _ = tokio::time::timeout(REMIND_EVERY, waiting).await;
            } else {
                waiting.await;
            }
            continue;
        };
        match outcome {
            Ok(()) => backoff.succeed(),
            Err(TellError::Later(problem)) => {
                desk.failed(&recipient, &problem);
                let pause = backoff.fail();
                // News do not shorten the pause, the end does.
                let mut end = desk.news.subscribe();
                let ended = end.wait_for(|number| *number == ENDED);
                let _ = tokio::time::timeout(pause, ended).await;
                continue;
            }
            Err(TellError::Refused(problem)) => {
                tracing::error!("{} rejected a message: {problem}", recipient.name);
                desk.refused(&recipient, &problem);
            }
        }
        if let Some(call) = call {
            desk.told(&recipient, call.number);
        }
    }
}

async fn blocking(
    work: impl FnOnce() -> Result<(), TellError> + Send + 'static,
) -> Result<(), TellError> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|error| Err(TellError::Later(error.to_string())))
}

/// The number of news after which nothing more comes.
const ENDED: u64 = u64::MAX;

/// What is known of a recipient.
#[derive(Debug, Clone, Default)]
struct DeliveryCounts {
    told: u64,
    failures: u64,
    refused: u64,
    /// Why it is not told at present, and since when \[ns since 1970\].
    problem: Option<(String, u64)>,
}

/// What the tasks share.
struct Desk {
    calls: Mutex<Calls>,
    recipients: Vec<Recipient>,
    attempts: Mutex<BTreeMap<String, DeliveryCounts>>,
    around: Arc<MessageContext>,
    news: watch::Sender<u64>,
    state_dir: PathBuf,
    /// Why the state cannot be written, if so.
    unsaved: Mutex<Option<String>>,
    network: Mutex<Option<String>>,
    certificates: CertificateWatch,
    pulse: Arc<Pulse>,
}

impl Desk {
    fn new(config: &NotifyConfig, calls: Calls, pulse: Arc<Pulse>) -> Self {
        let recipients = config.notify.recipients.clone();
        let attempts =
            recipients.iter().map(|one| (one.key.clone(), DeliveryCounts::default())).collect();
        let (structure, page) = (config.drawing.clone(), config.notify.page.clone());
        Self {
            calls: Mutex::new(calls),
            recipients,
            attempts: Mutex::new(attempts),
            around: Arc::new(MessageContext { structure, page }),
            news: watch::channel(0).0,
            state_dir: config.state_dir.clone(),
            unsaved: Mutex::new(None),
            network: Mutex::new(Some("opening a session".to_owned())),
            certificates: CertificateWatch::start(
                [config.network.certificates(), config.certificates.clone()].concat(),
            ),
            pulse,
        }
    }

    /// Changes what is open or waits; a change is on the disk before anybody is told. If the disk fails, people are told all
    /// the same.
    fn change(&self, change: impl FnOnce(&mut Calls) -> bool) {
        let mut calls = self.calls.lock();
        let before = calls.revision();
        let is_news = change(&mut calls);
        if calls.revision() != before {
            self.save(&calls);
        }
        drop(calls);
        if is_news {
            self.news.send_modify(|number| *number = number.saturating_add(1).min(ENDED - 1));
        }
    }

    fn save(&self, calls: &Calls) {
        let saved = save(&self.state_dir, calls);
        let mut unsaved = self.unsaved.lock();
        if let Err(error) = &saved
            && unsaved.is_none()
        {
            tracing::error!(
                "{}: {error}; notifications continue, and may be repeated",
                self.state_dir.display()
            );
        }
        *unsaved = saved.err().map(|error| error.to_string());
    }

    fn told(&self, recipient: &Recipient, number: u64) {
        self.change(|calls| {
            calls.delivered(&recipient.key, number);
            false
        });
        let mut attempts = self.attempts.lock();
        let own = attempts.entry(recipient.key.clone()).or_default();
        own.told += 1;
        if own.problem.take().is_some() {
            tracing::info!("{} is reached again", recipient.name);
        }
    }

    fn failed(&self, recipient: &Recipient, problem: &str) {
        let mut attempts = self.attempts.lock();
        let own = attempts.entry(recipient.key.clone()).or_default();
        own.failures += 1;
        match &mut own.problem {
            Some((known, _)) => problem.clone_into(known),
            None => {
                tracing::warn!("{} not reached, retrying: {problem}", recipient.name);
                own.problem = Some((problem.to_owned(), unix_ns()));
            }
        }
    }

    fn refused(&self, recipient: &Recipient, problem: &str) {
        let mut attempts = self.attempts.lock();
        let own = attempts.entry(recipient.key.clone()).or_default();
        (own.failures, own.refused) = (own.failures + 1, own.refused + 1);
        tracing::debug!("{}: {problem}", recipient.name);
    }

    fn connection(&self, network: &NetworkState) {
        *self.network.lock() = match network {
            NetworkState::Open => None,
            NetworkState::CutOff(_) => Some("cut off from the network".to_owned()),
            NetworkState::Opening => Some("opening a session".to_owned()),
            NetworkState::Failed(reason) => Some(format!("no network: {reason}")),
            NetworkState::Closed => Some("the session has ended".to_owned()),
        };
    }

    fn end(&self) {
        self.news.send_replace(ENDED);
    }

    /// What keeps people from being told, in words.
    fn problems(&self) -> Vec<String> {
        let calls = self.calls.lock();
        let attempts = self.attempts.lock();
        let of = |recipient: &Recipient| {
            let (problem, since) = attempts.get(&recipient.key)?.problem.clone()?;
            let (waiting, age) =
                (calls.waiting(&recipient.key), vocabulary::words::age(since, unix_ns()));
            Some(format!("{}: {problem} (for {age}; {waiting} pending)", recipient.name))
        };
        let recipients = self.recipients.iter().filter_map(of);
        let unsaved = self.unsaved.lock().clone().map(|error| format!("state not saved: {error}"));
        self.network.lock().clone().into_iter().chain(unsaved).chain(recipients).collect()
    }

    fn status(&self) -> String {
        let problems = self.problems();
        let open = self.calls.lock().open().filter(|open| open.is_called()).count();
        match problems.first() {
            Some(problem) => problem.clone(),
            None => format!("{open} incidents open; {} recipients", self.recipients.len()),
        }
    }
}

/// What `/healthz`, `/readyz` and `/metrics` answer.
struct Health(Arc<Desk>);

impl Subject for Health {
    fn live(&self) -> HealthCondition {
        live(self.0.pulse.sign(Instant::now()))
    }

    fn ready(&self) -> HealthCondition {
        let problems = self.0.problems();
        match problems.is_empty() {
            true => HealthCondition::well(self.0.status()),
            false => HealthCondition::unwell(problems.join("; ")),
        }
    }

    fn metrics(&self) -> Result<String, std::fmt::Error> {
        let desk = &self.0;
        let process = ProcessReport::read(desk.pulse.sign(Instant::now()));
        let calls = desk.calls.lock();
        let open = calls.open().filter(|open| open.is_called()).count() as u64;
        let dropped = calls.dropped();
        let waiting: Vec<(String, u64)> = desk
            .recipients
            .iter()
            .map(|one| (one.name.clone(), calls.waiting(&one.key) as u64))
            .collect();
        drop(calls);
        let attempts = desk.attempts.lock();
        let counts: Vec<(String, DeliveryCounts)> = desk
            .recipients
            .iter()
            .map(|one| (one.name.clone(), attempts.get(&one.key).cloned().unwrap_or_default()))
            .collect();
        drop(attempts);
        let is_connected = u64::from(desk.network.lock().is_none());
        let until_unix_s = desk.certificates.until_unix_s();
        render(Vec::new(), move |sheet| {
            process.write(sheet)?;
            sheet.certificate_expiry(until_unix_s)?;
            let help = "Whether it is connected to the network.";
            sheet.gauge("trusswatch_notify_connected", help, is_connected)?;
            sheet.gauge(
                "trusswatch_incidents",
                "Open incidents of which notifications were sent.",
                open,
            )?;
            let help = "Notifications dropped because too many were pending.";
            sheet.counter("trusswatch_notify_dropped", help, dropped)?;
            let of = |name: &String| std::borrow::Cow::from(name.clone());
            let values = waiting.iter().map(|(name, count)| (of(name), *count));
            let help = "Notifications pending for a recipient.";
            sheet.gauges("trusswatch_notify_pending", help, "recipient", values)?;
            let values = counts.iter().map(|(name, of_one)| (name.as_str(), of_one.told));
            let help = "Notifications delivered to a recipient.";
            sheet.counters("trusswatch_notify_delivered", help, "recipient", values)?;
            let values = counts.iter().map(|(name, of_one)| (name.as_str(), of_one.failures));
            let help = "Failed attempts to reach a recipient.";
            sheet.counters("trusswatch_notify_failures", help, "recipient", values)?;
            let values = counts.iter().map(|(name, of_one)| (name.as_str(), of_one.refused));
            let help = "Notifications that a recipient rejected.";
            sheet.counters("trusswatch_notify_rejected", help, "recipient", values)
        })
    }
}

/// What was open and waited when the process ended.
fn restore(state_dir: &Path, recipients: &[Recipient]) -> Result<Calls, Failure> {
    let unusable = |error: std::io::Error| {
        Failure::running(&format!("the state directory {}", state_dir.display()), error)
    };
    DirBuilder::new().recursive(true).mode(0o700).create(state_dir).map_err(unusable)?;
    let file = state_dir.join(STATE);
    let mut calls = match std::fs::read(&file) {
        Ok(text) => serde_json::from_slice(&text).map_err(|error| {
            let what = format!(
                "{}: {error}; move it away to start over: open incidents are sent once more",
                file.display()
            );
            Failure::Running(what)
        })?,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Calls::default(),
        Err(error) => return Err(unusable(error)),
    };
    let keys: Vec<String> = recipients.iter().map(|recipient| recipient.key.clone()).collect();
    for gone in calls.tell(&keys) {
        tracing::warn!("pending notifications of a removed recipient dropped: {gone}");
    }
    save(state_dir, &calls).map_err(unusable)?;
    Ok(calls)
}

/// Replaces the file as a whole: killed at any moment, it is the former or the new one.
fn save(state_dir: &Path, calls: &Calls) -> std::io::Result<()> {
    let next = state_dir.join(NEXT_STATE);
    let mut file = File::create(&next)?;
    file.write_all(&serde_json::to_vec(calls)?)?;
    file.sync_all()?;
    std::fs::rename(&next, state_dir.join(STATE))?;
    File::open(state_dir)?.sync_all()
}
