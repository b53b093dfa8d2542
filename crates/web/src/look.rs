//! How a state looks: never by colour alone, always with a sign and words.

use maud::{Markup, html};
use observer::{EventLine, ModuleView, StateRow};
use vocabulary::words::utc;

/// Every sign: name, outline, and content on a canvas of 16 × 16.
const SIGNS: [(&str, &str, &str); 8] = [
    ("latched", "M5 .8h6L15.2 5v6L11 15.2H5L.8 11V5z", "M8 3.6v5.6M8 11.4v1.4"),
    ("acknowledged", "M5 .8h6L15.2 5v6L11 15.2H5L.8 11V5z", "M4.6 8.2l2.4 2.5 4.4-5"),
    (
        "unconfirmed",
        "M8 1l7.4 13.6H.6z",
        "M6.5 7.2c.2-1.7 3-1.6 3 .2 0 1.2-1.5 1.2-1.5 2.6M8 11.6v1.3",
    ),
    (
        "unknown",
        "M1.4 1.4h13.2v13.2H1.4z",
        "M6 5.8c.3-2.4 4.2-2.2 4.1.3 0 1.7-2.1 1.7-2.1 3.6M8 11.2v1.4",
    ),
    ("explained", "M8 .6L15.4 8 8 15.4.6 8z", "M4.6 8h6M8.4 5.6L11 8l-2.6 2.4"),
    (
        "tentative",
        "M8 1.2a6.8 6.8 0 1 1 0 13.6A6.8 6.8 0 0 1 8 1.2z",
        "M4.4 8.6c1.4-2.4 2.8-1.7 3.6-.6s2.2 1.8 3.6-.6",
    ),
    ("unverified", "M8 2.6a5.4 5.4 0 1 1 0 10.8A5.4 5.4 0 0 1 8 2.6z", ""),
    ("normal", "M8 2.6a5.4 5.4 0 1 1 0 10.8A5.4 5.4 0 0 1 8 2.6z", "M5.6 8.2l1.7 1.7 3.1-3.6"),
];

/// Hollow signs: for faults that are acknowledged and states that are not certain.
const HOLLOW: [&str; 3] = ["acknowledged", "tentative", "unverified"];

/// The definitions of the signs, once per page.
pub(crate) fn signs() -> Markup {
    html! {
        svg.signs width="0" height="0" aria-hidden="true" focusable="false" {
            @for (name, outline, within) in SIGNS {
                symbol id={ "sign-" (name) } viewBox="0 0 16 16" {
                    path.outline.hollow[HOLLOW.contains(&name)] d=(outline) {}
                    path.within d=(within) {}
                }
            }
        }
    }
}

/// The icon of a state, shown beside its words.
pub(crate) fn sign(class: &str) -> Markup {
    html! {
        svg.sign aria-hidden="true" focusable="false" { use href={ "#sign-" (class) } {} }
    }
}

/// The CSS class of a state, which is also the name of its sign, and whether its alarm is shelved or suppressed.
pub(crate) fn classes(row: &StateRow) -> String {
    let aside = if row.is_set_aside { " aside" } else { "" };
    format!("{}{aside}", row.sign)
}

/// A state as sign and words.
pub(crate) fn state(row: &StateRow) -> Markup {
    html! { span.state.(classes(row)) { (sign(row.sign)) (row.state) } }
}

/// An event as sign and words.
pub(crate) fn event(line: &EventLine) -> Markup {
    html! { span.state.(line.sign) { (sign(line.sign)) (line.what) } }
}

/// A module's phase, or that it does not answer, as sign and words.
pub(crate) fn condition(module: &ModuleView) -> Markup {
    let class = observer::sign(module.tone());
    html! { span.state.(class) { (sign(class)) (module.condition()) } }
}

/// A time to the second; to the millisecond in the machine-readable attribute and the tooltip.
pub(crate) fn when(time_unix_ns: u64) -> Markup {
    let exact = utc(time_unix_ns);
    let shown = exact.split('.').next().unwrap_or_default().replace('T', " ");
    html! { time datetime=(exact) title=(exact) { (shown) " UTC" } }
}
