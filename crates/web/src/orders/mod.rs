//! Orders that people give on the page: forms that are sent to `/order/{kind}`.
//!
//! | file | what |
//! |---|---|
//! | `given` | what a form orders |
//! | `giving` | how it is sent to the module |
//! | `outcome` | what became of it, in words |

mod given;
mod giving;
mod outcome;
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
use outcome::Outcome;

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
    let outcome = match Given::read(&kind, &fields) {
        Ok(given) => giving::give(&shared, &person.name, given).await,
        Err(wrong) => Outcome::not_sent(&wrong),
    };
    outcome.log(&person.name);
    access.leave_message(&viewer, outcome.words);
    let back = destination(fields.get("back"));
    (StatusCode::SEE_OTHER, [(header::LOCATION, back)]).into_response()
}

fn forbidden(name: &str, read_only: Option<&str>) -> Response {
    let name = names::printable(name);
    tracing::warn!("an order by {name} was refused: not permitted");
    let content = html! {
        p { "No order was sent: " strong { (name) } " may look, and order nothing." }
        @if let Some(why) = read_only {
            p { (names::printable(why)) }
        }
        p { a href="/" { "To the overview" } }
    };
    plain(StatusCode::FORBIDDEN, "Not permitted", &content)
}
