//! A page that needs only the style sheet: for sign-in and refused requests.

use axum::http::StatusCode;
use axum::response::{Html, IntoResponse, Response};
use maud::{DOCTYPE, Markup, html};

/// Path of the style sheet.
const STYLE: &str = "/page.css";

/// A page with a heading.
pub(crate) fn plain(status: StatusCode, title: &str, content: &Markup) -> Response {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) " – trusswatch" }
                link rel="stylesheet" href=(STYLE);
            }
            body {
                main class="plain" {
                    h1 { (title) }
                    (content)
                }
            }
        }
    };
    (status, Html(page.into_string())).into_response()
}
