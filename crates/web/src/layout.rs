//! The layout common to all pages.

use axum::http::StatusCode;
use axum::response::{Html, IntoResponse, Response};
use maud::{DOCTYPE, Markup, html};
use observer::{NetworkState, Scene, alarms, all_is_well, attention};
use vocabulary::words::{printable, utc};

use crate::access::Viewer;
use crate::{assets, look};

/// A page.
pub(crate) struct Page<'a> {
    /// The subject, for the title.
    pub(crate) title: &'a str,
    /// The highlighted entry of the navigation.
    pub(crate) place: &'a str,
    /// The URL parameters that the script sends to keep the page up to date; empty for a static page.
    pub(crate) live: String,
    pub(crate) viewer: &'a Viewer,
    pub(crate) scene: &'a Scene,
}

const PLACES: [(&str, &str); 5] = [
    ("/", "Overview"),
    ("/events", "Events"),
    ("/history", "History"),
    ("/report", "Report"),
    ("/wall", "Wall"),
];

impl Page<'_> {
    /// Wraps this main part into a page.
    pub(crate) fn respond(&self, main: &Markup) -> Response {
        Html(self.markup(main).into_string()).into_response()
    }

    /// Likewise, for a request that failed.
    pub(crate) fn refusing(&self, status: StatusCode, main: &Markup) -> Response {
        (status, self.respond(main)).into_response()
    }

    pub(crate) fn markup(&self, main: &Markup) -> Markup {
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title #title { (title(self.scene, self.title)) }
                    link #icon rel="icon" href=(icon(self.scene)) type="image/svg+xml";
                    link rel="stylesheet" href="/page.css";
                    link rel="manifest" href=(assets::MANIFEST_PATH) crossorigin="use-credentials";
                    meta name="theme-color" content="#1d3b53";
                    script src="/page.js" defer {}
                }
                body data-live=(self.live) {
                    a.skip href="#main" { "To the content" }
                    (look::signs())
                    (self.header())
                    main #main tabindex="-1" {
                        @if let Some(message) = &self.viewer.message {
                            p.message.refused[message.is_refusal] role="status" { (printable(&message.words)) }
                        }
                        div #network role="status" { (network(self.scene)) }
                        (main)
                    }
                }
            }
        }
    }

    fn header(&self) -> Markup {
        html! {
            header.bar {
                a.brand href="/" { "trusswatch" }
                nav aria-label="Pages" {
                    @for (href, words) in PLACES {
                        a href=(href) aria-current=[(href == self.place).then_some("page")] { (words) }
                    }
                }
                div.right {
                    span #person { (person(self.viewer)) }
                    p.live #live {
                        @if self.live.is_empty() { "as of " } @else { "not live: as of " }
                        span #clock { (clock(self.scene)) }
                        @if !self.live.is_empty() { ", reload for the present" }
                    }
                }
            }
        }
    }
}

/// Who is signed in; sent again with every stream, because the session may have ended.
pub(crate) fn person(viewer: &Viewer) -> Markup {
    html! {
        @if let Some(person) = &viewer.person {
            span.person { b { (printable(&person.name)) } " · " a href="/sign-out" { "sign out" } }
        } @else if viewer.read_only.is_none() {
            a.person href="/sign-in" { "sign in" }
        }
    }
}

/// The title of a page, preceded by the number of alarms that need attention, so that a background tab shows it.
pub(crate) fn title(scene: &Scene, words: &str) -> Markup {
    let attention = attention(&alarms(&scene.modules));
    html! { @if attention > 0 { "(" (attention) ") " } (words) " · trusswatch" }
}

/// The address of the icon: red unless all is known to be well.
pub(crate) fn icon(scene: &Scene) -> Markup {
    let is_well = scene.network == NetworkState::Open && all_is_well(scene);
    html! { (if is_well { assets::ICON_PATH } else { assets::ALARM_ICON_PATH }) }
}

/// What an open page shows instead of the state of a component or module that is in no list any more.
pub(crate) fn not_reported() -> Markup {
    html! { p.headline { "No longer reported; anything below was the last known." } }
}

/// The page for an unknown module or component.
pub(crate) fn unknown(viewer: &Viewer, scene: &Scene, problem: &str) -> Response {
    let page = Page { title: "Not known", place: "", live: String::new(), viewer, scene };
    page.refusing(
        StatusCode::NOT_FOUND,
        &html! {
            h1 { "Not known" }
            p { (printable(problem)) ". " a href="/" { "The overview" } " lists the present state." }
        },
    )
}

/// The time of the shown state, by the local clock. With a network it is the scene's time, so that the page visibly
/// ages if the task that updates the scene hangs. Cut off, it is the time of the loss. Before a network is there, it is
/// the present, because "nothing is known" is true now.
pub(crate) fn clock(scene: &Scene) -> Markup {
    look::when(match scene.network {
        NetworkState::Open => scene.time_unix_ns,
        NetworkState::CutOff(since) => since,
        _ => shell::clock::unix_ns(),
    })
}

/// A problem with the connection to the structure; empty without one.
pub(crate) fn network(scene: &Scene) -> Markup {
    let words = match &scene.network {
        NetworkState::Opening => "Connecting: the present state is unknown.".to_owned(),
        NetworkState::Failed(reason) => {
            let reason = printable(reason);
            format!(
                "No connection to the network: {reason}. Retrying; the present state is unknown."
            )
        }
        NetworkState::CutOff(since) => {
            let since = utc(*since);
            format!(
                "This page is cut off: since {since} none of its entry points to the network answers. \
                 The state of all modules is unknown; what is shown was the last known."
            )
        }
        NetworkState::Closed => {
            "The connection to the network has ended. It is tried again.".to_owned()
        }
        NetworkState::Open if scene.modules.is_empty() => "No module answers.".to_owned(),
        NetworkState::Open => return html! {},
    };
    let is_cut_off = scene.network != NetworkState::Open;
    html! { p.banner data-cut-off[is_cut_off] { (look::sign("unknown")) (words) } }
}
