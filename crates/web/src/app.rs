//! The state shared by all request handlers, and the routes to them.

use std::sync::Arc;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::middleware::{Next, from_fn_with_state};
use axum::response::Response;
use axum::routing::get;
use maud::{Markup, html};
use session::CertificateWatch;
use shell::clock::unix_ns;
use shell::shutdown::Shutdown;
use vocabulary::words::printable;
use vocabulary::{OperatorName, StructureName};

use crate::access::{Access, Viewer};
use crate::drawing::LinkedDrawing;
use crate::layout::Page;
use crate::metrics::Metrics;
use crate::notifier::Notifier;
use crate::observed::Observed;
use crate::part::Streams;
use crate::{
    access, assets, component, events, history, look, metrics, module, orders, overview, report,
    stream, wall,
};

/// The state shared by all request handlers.
#[derive(Debug)]
pub(crate) struct App {
    /// The observed structures.
    pub(crate) observed: Arc<Observed>,
    /// Access control: sessions and permissions.
    pub(crate) access: Arc<Access>,
    /// The structure to show; otherwise all observed structures.
    pub(crate) structure: Option<StructureName>,
    /// The operator in this process's certificate: access control admits orders only under this name.
    pub(crate) operator: Option<OperatorName>,
    /// The drawing of a structure, if configured.
    pub(crate) drawing: Option<LinkedDrawing>,
    /// The pages that are kept up to date.
    pub(crate) streams: Streams,
    /// Metrics.
    pub(crate) metrics: Metrics,
    /// The process that sends notifications.
    pub(crate) notifier: Notifier,
    /// The certificates that the page shows to the network and to browsers.
    pub(crate) certificates: CertificateWatch,
    /// Whether the process is shutting down, upon which open streams end.
    pub(crate) shutdown: Shutdown,
}

impl App {
    /// What is wrong with the page itself: notifications that do not get through, records that cannot be kept,
    /// certificates that expire soon.
    pub(crate) fn troubles(&self) -> Markup {
        let unkept = self.observed.records.problem();
        html! {
            (self.notifier.banner())
            @for words in self.certificates.expiring(unix_ns() / 1_000_000_000) {
                p.banner { (look::sign("unconfirmed")) "This page: " (printable(&words)) "; renew it: trusswatch pki renew" }
            }
            @if let Some(problem) = unkept {
                p.banner { (look::sign("unconfirmed")) "What this page hears is not kept: " (printable(&problem)) }
            }
        }
    }
}

/// Shared reference for handlers.
pub(crate) type Shared = Arc<App>;

/// All routes, behind the guard.
pub(crate) fn router(app: Shared) -> Router {
    access::protect(pages(app.clone()), Arc::clone(&app.access))
}

fn pages(app: Shared) -> Router {
    Router::new()
        .route("/", get(overview::page))
        .route("/component/{module}/{kind}/{name}", get(component::page))
        .route("/wall", get(wall::page))
        .route("/module/{name}", get(module::page))
        .route("/history", get(history::page))
        .route("/events", get(events::page))
        .route("/report", get(report::page))
        .route("/replay", get(report::replay))
        .route("/incident", get(report::incident))
        .route("/stream", get(stream::stream))
        .route("/fragments", get(stream::fragments))
        .route("/page.css", get(assets::style))
        .route("/page.js", get(assets::script))
        .route(assets::MANIFEST_PATH, get(assets::manifest))
        .route(assets::ICON_PATH, get(assets::icon))
        .route(assets::ALARM_ICON_PATH, get(assets::alarm_icon))
        .route("/healthz", get(metrics::healthz))
        .route("/metrics", get(metrics::metrics))
        .merge(access::routes(Arc::clone(&app.access)))
        .merge(orders::routes())
        .fallback(nothing)
        .layer(from_fn_with_state(app.clone(), count))
        .with_state(app)
}

async fn count(State(app): State<Shared>, request: Request, next: Next) -> Response {
    metrics::count(&app.metrics.requests);
    next.run(request).await
}

async fn nothing(State(app): State<Shared>, viewer: Viewer) -> Response {
    let scene = app.observed.scene();
    let live = String::new();
    let page = Page { title: "Not found", place: "", live, viewer: &viewer, scene: &scene };
    page.refusing(
        StatusCode::NOT_FOUND,
        &html! {
            h1 { "Not found" }
            p { "Page not found. Start from " a href="/" { "the overview" } "." }
        },
    )
}

#[cfg(test)]
mod tests {
    use crate::listener::PageAccess;
    use crate::tests::server::{PageServer, Setup};
    use pki::{Authority, Holder, Library, Lifetime};

    #[tokio::test(flavor = "multi_thread")]
    async fn the_page_says_when_its_certificate_expires() {
        let folder = tempfile::tempdir().unwrap();
        let tower = "tower".parse().unwrap();
        let authority = Authority::create(folder.path(), tower, Lifetime::of_days(400)).unwrap();
        let troubles = |days| {
            let holder: Holder = format!("operator.web{days}").parse().unwrap();
            let place = Library::at(folder.path()).place_of(&holder);
            authority.issue(&place, holder, &[], Lifetime::of_days(days)).unwrap();
            let identity = pki::credentials::identity(&place);
            let page = PageAccess {
                page_certificate: Some(identity.certificate),
                page_key: Some(identity.key),
                ..PageAccess::default()
            };
            async move {
                let page = PageServer::start(Setup { page, ..Setup::default() }).await;
                page.shared.troubles().into_string()
            }
        };
        let soon = troubles(20).await;
        let words = "This page: the certificate operator.web20.tower expires in ";
        assert!(soon.contains(words) && soon.contains("pki renew"), "{soon}");
        assert_eq!(troubles(30).await, "");
    }
}
