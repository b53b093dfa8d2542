//! The process: it serves at once, and whatever comes of the network is shown.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use observer::{Live, NetworkState};
use shell::exit::Failure;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

use crate::access::Access;
use crate::app::{App, Shared};
use crate::config::WebConfig;
use crate::desk::Desk;
use crate::drawing::Drawing;
use crate::metrics::Counters;
use crate::router::router;

/// From one status to the next; each is a watchdog heartbeat.
const EVERY: Duration = Duration::from_millis(250);
/// How long answers that are under way at the end may take.
const DRAINING: Duration = Duration::from_secs(2);

/// Serves the page until it is asked to end, whether or not there is a network.
///
/// # Errors
/// The address cannot be had, or serving fails.
pub async fn run(config: WebConfig, shutdown: Shutdown) -> Result<(), Failure> {
    let supervisor = Supervisor::from_environment();
    let listener = listen(config.listen).await?;
    let app = app(config, &supervisor, shutdown.clone());
    let outcome = serve_until_done(&app, &supervisor, listener, shutdown).await;
    if let Some(session) = app.live.session() {
        session::close(&session).await;
    }
    outcome
}

async fn listen(address: SocketAddr) -> Result<TcpListener, Failure> {
    TcpListener::bind(address).await.map_err(|error| {
        let what = format!(
            "the page cannot be served on {address}; free the port or choose another address"
        );
        Failure::running(&what, error)
    })
}

/// What requests see. The session is opened meanwhile.
pub(crate) fn app(config: WebConfig, supervisor: &Supervisor, shutdown: Shutdown) -> Shared {
    let WebConfig { network, structure, expected, drawing, timeout, .. } = config;
    let operator = network.operator();
    let open = move || {
        let network = network.clone();
        async move { session::open(&network).await }
    };
    Arc::new(App {
        live: Live::start(open, structure.clone(), expected),
        access: Access::default(),
        structure,
        operator,
        timeout,
        drawing: drawing.as_ref().map(Drawing::of),
        desk: Desk::default(),
        counters: Counters::default(),
        pulse: supervisor.pulse(),
        shutdown,
    })
}

async fn serve_until_done(
    app: &Shared,
    supervisor: &Supervisor,
    listener: TcpListener,
    mut shutdown: Shutdown,
) -> Result<(), Failure> {
    if let Ok(address) = listener.local_addr() {
        tracing::info!("the page is at http://{address}/");
    }
    let mut serving = serve(listener, router(Arc::clone(app)), shutdown.clone());
    supervisor.ready("serving");
    while !shutdown.is_requested() {
        supervisor.progress();
        supervisor.status(&status(app));
        tokio::select! {
            () = shutdown.requested() => {}
            ended = &mut serving => return Err(Failure::running("the page is no longer served", reason(ended))),
            () = tokio::time::sleep(EVERY) => {}
        }
    }
    supervisor.stopping();
    // Streams end by themselves; who is slow is not waited for longer.
    if tokio::time::timeout(DRAINING, serving).await.is_err() {
        tracing::warn!("some answers were not taken within {DRAINING:?}");
    }
    Ok(())
}

/// Serves in a task of its own until the end is asked for.
pub(crate) fn serve(
    listener: TcpListener,
    router: Router,
    mut shutdown: Shutdown,
) -> JoinHandle<std::io::Result<()>> {
    tokio::spawn(async move {
        let end = async move { shutdown.requested().await };
        axum::serve(listener, router).with_graceful_shutdown(end).await
    })
}

fn reason(ended: Result<std::io::Result<()>, tokio::task::JoinError>) -> String {
    match ended {
        Ok(Ok(())) => "it ended".to_owned(),
        Ok(Err(error)) => error.to_string(),
        Err(error) => error.to_string(),
    }
}

fn status(app: &App) -> String {
    let scene = app.live.scene();
    let (modules, streams) = (scene.modules.len(), app.counters.streams());
    match &scene.network {
        NetworkState::Open => format!("{modules} modules, {streams} open pages"),
        NetworkState::Opening => "opening a session".to_owned(),
        NetworkState::Failed(reason) => format!("no network: {reason}"),
        NetworkState::Closed => "the session has ended".to_owned(),
    }
}
