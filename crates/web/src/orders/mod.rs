//! Orders that people give on the page: forms that are sent to `/order/{kind}`.
//!
//! | file | what |
//! |---|---|
//! | `given` | what a form orders |
//! | `giving` | how it is sent to the module |

mod given;
mod giving;
#[cfg(test)]
mod tests;

use axum::Router;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::post;
use maud::html;

use crate::access::{Fields, Viewer, destination, plain};
use crate::app::Shared;
use given::Given;

/// Where forms with orders are sent.
pub(crate) fn routes() -> Router<Shared> {
    Router::new().route("/order/{kind}", post(order))
}

/// Gives the order and leads back to the page, which shows the outcome.
async fn order(
    State(shared): State<Shared>,
    Path(kind): Path<String>,
    viewer: Viewer,
    fields: Fields,
) -> Response {
    let access = &shared.access;
    let person = viewer.person.as_ref().filter(|person| person.may_order);
    let Some(person) = person else {
        let name = viewer.person.as_ref().map_or("nobody", |person| person.name.as_str());
        return forbidden(name, access.read_only());
    };
    let (is_done, words) = match Given::read(&kind, &fields) {
        Ok(given) => {
            let outcome = giving::give(&shared, &person.name, &given).await;
            (outcome.is_done(), outcome.words(given.kind, &given.subject()))
        }
        Err(wrong) => (false, format!("{}; no command was sent", vocabulary::printable(&wrong))),
    };
    log(&person.name, is_done, &words);
    access.leave_message(&viewer, words);
    let back = destination(fields.get("back"));
    (StatusCode::SEE_OTHER, [(header::LOCATION, back)]).into_response()
}

fn log(person: &str, is_done: bool, words: &str) {
    let person = vocabulary::printable(person);
    if is_done {
        tracing::info!("an order by {person}: {words}");
    } else {
        tracing::warn!("an order by {person}: {words}");
    }
}

fn forbidden(name: &str, read_only: Option<&str>) -> Response {
    let name = vocabulary::printable(name);
    tracing::warn!("an order by {name} was refused: not permitted");
    let content = html! {
        p { "No order was sent: " strong { (name) } " may look, and order nothing." }
        @if let Some(why) = read_only {
            p { (vocabulary::printable(why)) }
        }
        p { a href="/" { "To the overview" } }
    };
    plain(StatusCode::FORBIDDEN, "Not permitted", &content)
}
