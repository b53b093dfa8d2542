//! Style sheet, script and icon, embedded in the program.

use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::IntoResponse;

/// The style sheet.
pub(crate) const STYLE: &str = include_str!("assets/page.css");
/// The script.
pub(crate) const SCRIPT: &str = include_str!("assets/page.js");
/// The icon, and its color, which is replaced by red while an alarm needs attention.
pub(crate) const ICON: &str = include_str!("assets/icon.svg");
const CALM_FILL: &str = "#1d3b53";
const ALARM_FILL: &str = "#b3261e";
pub(crate) const ICON_PATH: &str = "/icon.svg";
pub(crate) const ALARM_ICON_PATH: &str = "/alarm.svg";

/// What a phone installs.
pub(crate) const MANIFEST_PATH: &str = "/page.webmanifest";
const MANIFEST: &str = r##"{"name":"trusswatch","short_name":"trusswatch","start_url":".","scope":".","display":"standalone",
"background_color":"#fbfbfa","theme_color":"#1d3b53","icons":[{"src":"icon.svg","sizes":"any","type":"image/svg+xml"}]}"##;

/// Another version of the program has different assets: browsers revalidate them with every page; they are small.
const CACHING: &str = "no-cache";

pub(crate) async fn style() -> impl IntoResponse {
    ([(CONTENT_TYPE, "text/css; charset=utf-8"), (CACHE_CONTROL, CACHING)], STYLE)
}

pub(crate) async fn script() -> impl IntoResponse {
    ([(CONTENT_TYPE, "text/javascript; charset=utf-8"), (CACHE_CONTROL, CACHING)], SCRIPT)
}

pub(crate) async fn icon() -> impl IntoResponse {
    ([(CONTENT_TYPE, "image/svg+xml"), (CACHE_CONTROL, CACHING)], ICON)
}

pub(crate) async fn alarm_icon() -> impl IntoResponse {
    let icon = ICON.replace(CALM_FILL, ALARM_FILL);
    ([(CONTENT_TYPE, "image/svg+xml"), (CACHE_CONTROL, CACHING)], icon)
}

pub(crate) async fn manifest() -> impl IntoResponse {
    ([(CONTENT_TYPE, "application/manifest+json"), (CACHE_CONTROL, CACHING)], MANIFEST)
}
