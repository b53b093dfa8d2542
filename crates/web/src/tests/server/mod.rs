//! For tests: the page on a real listener, and a browser that may lie.

mod browser;
mod stand_in;

use std::convert::Infallible;
use std::fmt::Display;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::Path;
use axum::http::header;
use axum::response::Html;
use axum::routing::get;
use axum::{Extension, Router};
use futures_util::stream::pending;
use maud::html;
use session::client::Live;
use session::{CertificateWatch, Network};
use shell::shutdown::{self, Trigger};
use shell::supervision::Supervisor;
use tokio::task::JoinHandle;
use vocabulary::OperatorName;
use zenoh::Session;

use crate::access::{Access, AccessSettings, Viewer};
use crate::app::{App, Shared};
use crate::listener::{Listener, PageAccess};
use crate::metrics::Metrics;
use crate::notifier::Notifier;
use crate::observed::Observed;
use crate::part::Streams;
use crate::records::PageRecords;
use crate::{access, orders};

pub(crate) use browser::{Answer, Browser, Request};
pub(crate) use stand_in::StandIn;

/// How long anything is waited for.
pub(crate) const WITHIN: Duration = Duration::from_secs(180);

/// A page that is served until it is dropped.
pub(crate) struct PageServer {
    pub(crate) address: SocketAddr,
    pub(crate) shared: Shared,
    pub(crate) trigger: Trigger,
    pub(crate) task: JoinHandle<()>,
}

/// What a page is started with.
#[derive(Default)]
pub(crate) struct Setup {
    pub(crate) access: AccessSettings,
    pub(crate) page: PageAccess,
    /// The endpoint of a stand-in.
    pub(crate) network: Option<String>,
    pub(crate) operator: Option<OperatorName>,
}

impl PageServer {
    pub(crate) async fn start(setup: Setup) -> Self {
        let Setup { mut access, page, network, operator } = setup;
        access.site = page.site();
        let (trigger, shutdown) = shutdown::pair();
        let app = App {
            observed: Arc::new(Observed::new(
                live(network),
                PageRecords::default(),
                Duration::from_secs(10),
            )),
            access: Arc::new(Access::new(access)),
            structure: None,
            operator,
            drawing: None,
            streams: Streams::default(),
            metrics: Metrics::new(Supervisor::from_environment().pulse()),
            notifier: Notifier::default(),
            certificates: CertificateWatch::start(
                page.page_certificate.clone().into_iter().collect(),
            ),
            shutdown: shutdown.clone(),
        };
        let shared = Arc::new(app);
        let listener = Listener::bind("127.0.0.1:0".parse().unwrap(), &page).await.unwrap();
        let address = listener.address().unwrap();
        let access = Arc::clone(&shared.access);
        let router = pages().merge(access::routes(Arc::clone(&access))).merge(orders::routes());
        let router = access::protect(router.with_state(shared.clone()), access);
        let task = tokio::spawn(listener.serve(router, shutdown));
        Self { address, shared, trigger, task }
    }

    /// A browser that has opened it.
    pub(crate) fn browser(&self) -> Browser {
        Browser::at(self.address)
    }

    /// One that is signed in.
    pub(crate) async fn signed_in(&self, state: &std::path::Path, may_order: bool) -> Browser {
        let person = "Ada Lovelace".parse().unwrap();
        let link = access::one_time_link(state, &person, may_order, Duration::from_secs(60));
        let link = link.unwrap();
        let (_, secret) = link.split_once("link=").unwrap();
        let mut browser = self.browser();
        let answer = browser.send(browser.post("/sign-in", &[("link", secret)])).await;
        assert_eq!(answer.status, 303, "{answer:?}");
        browser.keep_cookie(&answer);
        browser
    }
}

fn live(network: Option<String>) -> Live {
    let open = move || {
        let network = network.clone();
        async move {
            let connect = vec![network.ok_or("the network is not connected")?];
            let network = Network { connect, ..Network::default() };
            session::open(&network).await.map_err(|error| error.to_string())
        }
    };
    started(open)
}

fn started<F, E>(open: impl Fn() -> F + Send + 'static) -> Live
where
    F: Future<Output = Result<Session, E>> + Send + 'static,
    E: Display + Send + 'static,
{
    Live::start(open, None, Vec::new())
}

/// The least that a page has.
fn pages() -> Router<Shared> {
    let style = ([(header::CACHE_CONTROL, "max-age=60")], "body {}");
    Router::new()
        .route("/", get(overview))
        .route("/component/{module}/{kind}/{name}", get(component))
        .route("/page.css", get(move || async move { style }))
        .route("/over", get(over))
        .route("/endless", get(async || Body::from_stream(pending::<Result<Bytes, Infallible>>())))
}

async fn overview(viewer: Viewer) -> Html<String> {
    let page = html! {
        @if let Some(person) = &viewer.person {
            p class="person" { (person.name) }
            @if person.may_order {
                input type="hidden" name="token" value=(person.form_token);
            }
        }
        @if let Some(message) = &viewer.message {
            p class="message" { (message.words) }
        }
    };
    Html(page.into_string())
}

async fn component(Path((module, kind, name)): Path<(String, String, String)>) -> Html<String> {
    let path = format!("{module}/{kind}/{name}").parse::<vocabulary::ComponentPath>();
    let words = path.map_or_else(|error| error.to_string(), |path| path.to_string());
    Html(html! { p { (words) } }.into_string())
}

async fn over(Extension(connection): Extension<crate::listener::Connection>) -> String {
    connection.shown.map_or_else(|| "nobody".to_owned(), |shown| shown.to_string())
}
