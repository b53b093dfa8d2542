//! The process: it serves pages at once and shows the state of the network connection.

use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt;
use std::sync::Arc;
use std::time::Duration;

use observer::{Live, NetworkState};
use shell::exit::Failure;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;

use crate::access::{self, Access, AccessSettings};
use crate::app::{App, Shared};
use crate::config::WebConfig;
use crate::drawing::LinkedDrawing;
use crate::listener::Listener;
use crate::metrics::Metrics;
use crate::observed::Observed;
use crate::part::Streams;
use crate::router::router;

/// Interval of status updates, each of which is a watchdog heartbeat.
const EVERY: Duration = Duration::from_millis(250);
/// Time for responses in progress at shutdown.
const DRAINING: Duration = Duration::from_secs(2);

/// Serves the page until shutdown, with or without a network.
///
/// # Errors
/// The state directory cannot be created, the address cannot be bound, or serving fails.
pub async fn run(config: WebConfig, shutdown: Shutdown) -> Result<(), Failure> {
    let supervisor = Supervisor::from_environment();
    make_state_directory(&config)?;
    let unserved = |error| Failure::running("the page is not served", error);
    let listener = Listener::bind(&config.listener).await.map_err(unserved)?;
    let app = app(config, &supervisor, shutdown.clone());
    let outcome = serve_until_done(&app, &supervisor, listener, shutdown).await;
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
pub(crate) fn app(config: WebConfig, supervisor: &Supervisor, shutdown: Shutdown) -> Shared {
    let access = AccessSettings {
        site: config.listener.site(),
        require_sign_in: config.require_sign_in,
        state: config.state_dir,
        revoked: config.revoked,
        read_only: access::read_only(&config.network),
    };
    let WebConfig { network, structure, expected, drawing, timeout, .. } = config;
    let operator = network.operator();
    let open = move || {
        let network = network.clone();
        async move { session::open_within(&network, timeout).await }
    };
    Arc::new(App {
        observed: Arc::new(Observed::new(Live::start(open, structure.clone(), expected), timeout)),
        access: Arc::new(Access::new(access)),
        structure,
        operator,
        drawing: drawing.as_ref().map(LinkedDrawing::of),
        streams: Streams::default(),
        metrics: Metrics::new(supervisor.pulse()),
        shutdown,
    })
}

async fn serve_until_done(
    app: &Shared,
    supervisor: &Supervisor,
    listener: Listener,
    mut shutdown: Shutdown,
) -> Result<(), Failure> {
    for address in listener.addresses() {
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
    let (modules, streams) = (scene.modules.len(), app.metrics.streams());
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
    use crate::listener::ListenerSettings;
    use crate::tests::server::{PageServer, Setup, WITHIN};
    use shell::shutdown;

    /// Both the listener and the loop around it wait for the request to end, and either may be the first to see it.
    #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
    async fn a_requested_end_is_no_failure() {
        let page = PageServer::start(Setup::default()).await;
        let supervisor = Supervisor::from_environment();
        for _ in 0..3000 {
            let settings = ListenerSettings {
                listen: vec!["127.0.0.1:0".parse().unwrap()],
                tls: None,
                behind_proxy: None,
                names: Vec::new(),
            };
            let listener = Listener::bind(&settings).await.unwrap();
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
}
