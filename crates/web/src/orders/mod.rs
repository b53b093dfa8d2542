//! Orders that users send with forms to `/order/{kind}`.
//!
//! | file | what |
//! |---|---|
//! | `form_order` | reads an order from a form |

mod form_order;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use axum::Router;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::post;
use futures_util::future::join_all;
use maud::html;
use observer::OrderOutcome;
use vocabulary::StructureName;
use zenoh::Session;

use crate::access::{Fields, PageMessage, Viewer, destination, plain};
use crate::app::{App, Shared};
use form_order::FormOrder;

/// Routes that receive forms with orders.
pub(crate) fn routes() -> Router<Shared> {
    Router::new().route("/order/{kind}", post(order))
}

/// Carries out the order and redirects to the page, which shows the outcome.
async fn order(
    State(shared): State<Shared>,
    Path(kind): Path<String>,
    viewer: Viewer,
    fields: Fields,
) -> Response {
    let access = &shared.access;
    let person = viewer.person.as_ref().filter(|person| person.may_order);
    let Some(person) = person else {
        let name = viewer.person.as_ref().map_or("this connection", |person| person.name.as_str());
        return forbidden(name, access.read_only());
    };
    let (is_done, words) = match FormOrder::read(&kind, &fields, &person.name) {
        Ok(orders) => {
            let sent = orders.into_iter().map(|given| {
                let shared = &shared;
                async move {
                    let outcome = send(shared, given.clone()).await;
                    (outcome.is_done(), given.words(&outcome))
                }
            });
            let outcomes = join_all(sent).await;
            let words: Vec<&str> = outcomes.iter().map(|(_, words)| words.as_str()).collect();
            (outcomes.iter().all(|(is_done, _)| *is_done), words.join("; "))
        }
        Err(wrong) => (false, format!("{}; no command was sent", vocabulary::printable(&wrong))),
    };
    log(&person.name, is_done, &words);
    access.leave_message(&viewer, PageMessage { words, is_refusal: !is_done });
    let back = destination(fields.get("back"));
    (StatusCode::SEE_OTHER, [(header::LOCATION, back)]).into_response()
}

/// Sends the order and waits for the answer.
async fn send(app: &App, given: FormOrder) -> OrderOutcome {
    let Some(session) = app.observed.session() else {
        return OrderOutcome::not_sent("the network is not connected");
    };
    match structure(app, &session, &given).await {
        Ok(structure) => {
            let request = given.request(structure, app.operator.clone());
            session::client::order(&session, &request, app.observed.timeout).await.into()
        }
        Err(wrong) => OrderOutcome::not_sent(&wrong),
    }
}

/// The structure of the module. A module name found in several structures is ambiguous and refused.
async fn structure(
    app: &App,
    session: &Session,
    given: &FormOrder,
) -> Result<StructureName, String> {
    let (module, within) = (&given.module, app.observed.timeout);
    let wanted = given.structure.as_ref().or(app.structure.as_ref());
    if let (Some(wanted), Some(shown)) = (wanted, &app.structure)
        && wanted != shown
    {
        return Err(format!("this page is about `{shown}`, not about `{wanted}`"));
    }
    let homes = session::client::homes(session, wanted, std::slice::from_ref(module), within).await;
    let homes = homes.map_err(|error| error.to_string())?;
    let mut homes: BTreeSet<StructureName> = homes.get(module).cloned().unwrap_or_default();
    if homes.len() > 1 {
        let names: Vec<String> = homes.iter().map(|name| format!("`{name}`")).collect();
        return Err(format!("`{module}` is there in {}; say which", names.join(" and ")));
    }
    homes
        .pop_first()
        .ok_or_else(|| format!("the diagnoser of `{module}` was not seen (waited {within:?})"))
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
    tracing::warn!("command by {name} refused: not permitted");
    let content = html! {
        p { "No command was sent: " strong { (name) } " has read-only access." }
        @if let Some(why) = read_only {
            p { (vocabulary::printable(why)) }
        }
        p { a href="/" { "To the overview" } }
    };
    plain(StatusCode::FORBIDDEN, "Not permitted", &content)
}
