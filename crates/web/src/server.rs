//! The process: it serves pages at once and shows the state of the network connection.

use std::fs::DirBuilder;
use std::net::SocketAddr;
use std::os::unix::fs::DirBuilderExt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use observer::NetworkState;
use session::client::Live;
use session::{CertificateWatch, Network};
use shell::exit::Failure;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use truss::Structure;
use vocabulary::{ModuleName, StructureName};

use crate::access::{Access, AccessSettings};
use crate::app::{App, Shared, router};
use crate::drawing::LinkedDrawing;
use crate::listener::{Listener, PageAccess};
use crate::metrics::Metrics;
use crate::notifier::Notifier;
use crate::observed::Observed;
use crate::part::Streams;
use crate::records::PageRecords;

/// Interval of status updates, each of which is a watchdog heartbeat.
const EVERY: Duration = Duration::from_millis(250);
/// Time for responses in progress at shutdown.
const DRAINING: Duration = Duration::from_secs(2);

/// Configuration of the web page.
#[derive(Debug, Clone)]
pub struct WebConfig {
    /// The network to connect to.
    pub network: Network,
    /// The structure to show; otherwise all observed structures.
    pub structure: Option<StructureName>,
    /// Modules that should be running.
    pub expected: Vec<ModuleName>,
    /// The address of the page.
    pub listen: SocketAddr,
    /// Access to the page.
    pub access: PageAccess,
    /// The structure to draw.
    pub drawing: Option<Structure>,
    /// The directory for persistent state: one-time links, and the page's records.
    pub state_dir: Option<PathBuf>,
    /// Timeout for answers of modules.
    pub timeout: Duration,
    /// The health address of `trusswatch notify`, whose problems the overview shows.
    pub notifier: Option<String>,
}

/// Serves the page until shutdown, with or without a network.
///
/// # Errors
/// The state directory cannot be created, the address cannot be bound, or serving fails.
pub async fn run(config: WebConfig, shutdown: Shutdown) -> Result<(), Failure> {
    let supervisor = Supervisor::from_environment();
    make_state_directory(&config)?;
    let unserved = |error| Failure::running("the page is not served", error);
    let listener = Listener::bind(config.listen, &config.access).await.map_err(unserved)?;
    let app = app(config, &supervisor, shutdown.clone())?;
    let outcome = serve_until_done(&app, &supervisor, listener, shutdown).await;
    app.observed.records.close();
    if let Some(session) = app.observed.session() {
        session::close(&session).await;
    }
    outcome
}

/// `trusswatch web` and the command that creates links share this directory.
fn make_state_directory(config: &WebConfig) -> Result<(), Failure> {
    let Some(directory) = &config.state_dir else { return Ok(()) };
    let made = DirBuilder::new().recursive(true).mode(0o700).create(directory);
    made.map_err(|error| {
        let what = format!("the state directory {} cannot be made", directory.display());
        Failure::running(&what, error)
    })
}

/// The shared state of request handlers. Opens the session in the background.
pub(crate) fn app(
    config: WebConfig,
    supervisor: &Supervisor,
    shutdown: Shutdown,
) -> Result<Shared, Failure> {
    let state = config.state_dir.clone();
    let access = AccessSettings {
        site: config.access.site(),
        require_sign_in: config.access.require_sign_in,
        state: config.state_dir,
        revoked: config.access.revoked,
        read_only: read_only(&config.network),
    };
    let WebConfig { network, structure, expected, drawing, timeout, notifier, .. } = config;
    let mut certificates = network.certificates();
    certificates.extend(config.access.page_certificate);
    let operator = network.operator();
    let open = move || {
        let network = network.clone();
        async move { session::open_within(&network, timeout).await }
    };
    let live = Live::start(open, structure.clone(), expected);
    let records = PageRecords::start(state.as_deref(), &live)
        .map_err(|problem| Failure::running("what the page has kept cannot be opened", problem))?;
    Ok(Arc::new(App {
        observed: Arc::new(Observed::new(live, records, timeout)),
        access: Arc::new(Access::new(access)),
        structure,
        operator,
        drawing: drawing.as_ref().map(LinkedDrawing::of),
        streams: Streams::default(),
        metrics: Metrics::new(supervisor.pulse()),
        notifier: Notifier::watching(notifier),
        certificates: CertificateWatch::start(certificates),
        shutdown,
    }))
}

/// Why this process may not send commands, if so: on a network with access control only operators may send commands, and the process has no
/// operator's certificate.
fn read_only(network: &Network) -> Option<String> {
    let directory = network.tls.as_ref().filter(|_| network.operator().is_none())?;
    Some(format!(
        "This page is read-only: its network certificate in `{}` is not an operator's.",
        directory.display()
    ))
}

async fn serve_until_done(
    app: &Shared,
    supervisor: &Supervisor,
    listener: Listener,
    mut shutdown: Shutdown,
) -> Result<(), Failure> {
    if let Ok(address) = listener.address() {
        tracing::info!("the page is at {}://{address}/", listener.scheme());
    }
    let mut serving = tokio::spawn(listener.serve(router(Arc::clone(app)), shutdown.clone()));
    supervisor.ready("serving");
    while !shutdown.is_requested() {
        supervisor.progress();
        supervisor.status(&status(app));
        tokio::select! {
            // In this order, because serving also ends on shutdown.
            biased;
            () = shutdown.requested() => {}
            ended = &mut serving => return Err(Failure::running("web server failed", reason(ended))),
            () = tokio::time::sleep(EVERY) => {}
        }
    }
    supervisor.stopping();
    // Streams end on their own; slow connections are dropped.
    if tokio::time::timeout(DRAINING, serving).await.is_err() {
        tracing::warn!("shutdown timed out after {DRAINING:?} before all responses were sent");
    }
    Ok(())
}

fn reason(ended: Result<(), tokio::task::JoinError>) -> String {
    ended.map_or_else(|error| error.to_string(), |()| "it ended".to_owned())
}

fn status(app: &App) -> String {
    let scene = app.observed.scene();
    let (modules, streams) = (scene.modules.len(), app.streams.open());
    match &scene.network {
        NetworkState::Open => format!("{modules} modules, {streams} open pages"),
        NetworkState::CutOff(_) => "cut off from the network".to_owned(),
        NetworkState::Opening => "opening a session".to_owned(),
        NetworkState::Failed(reason) => format!("no network: {reason}"),
        NetworkState::Closed => "the session has ended".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::server::{PageServer, Setup, WITHIN};
    use pki::{Authority, Holder, Library, Lifetime};
    use shell::shutdown;

    /// Both the listener and the loop around it wait for the request to end, and either may be the first to see it.
    #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
    async fn a_requested_end_is_no_failure() {
        let page = PageServer::start(Setup::default()).await;
        let supervisor = Supervisor::from_environment();
        for _ in 0..3000 {
            let listen = "127.0.0.1:0".parse().unwrap();
            let listener = Listener::bind(listen, &PageAccess::default()).await.unwrap();
            let (trigger, shutdown) = shutdown::pair();
            let serving = serve_until_done(&page.shared, &supervisor, listener, shutdown);
            let ending = async {
                tokio::task::yield_now().await;
                trigger.pull();
            };
            let served = tokio::time::timeout(WITHIN, async { tokio::join!(serving, ending).0 });
            assert!(served.await.unwrap().is_ok());
        }
    }

    #[test]
    fn only_an_operators_certificate_orders_where_there_are_certificates() {
        let folder = tempfile::tempdir().unwrap();
        let structure = "tower".parse().unwrap();
        let authority = Authority::create(folder.path(), structure, Lifetime::of_days(30)).unwrap();
        let network = |holder: &str| {
            let holder: Holder = holder.parse().unwrap();
            let place = Library::at(folder.path()).place_of(&holder);
            authority.issue(&place, holder, &[], Lifetime::of_days(20)).unwrap();
            Network { tls: Some(place), ..Network::default() }
        };
        assert_eq!(read_only(&network("operator.web")), None);
        assert!(read_only(&network("observer.wall")).unwrap().contains("observer.wall"));
        assert_eq!(read_only(&Network::default()), None);
    }
}
