//! Alarms that are set aside, and who did it.

use crate::printable;
use crate::{Aside, FaultTransition, Shelving};

use super::state::state_in_words;
use super::time::utc;

/// Until when, by whom and why the component's alarm is set aside; none if it counts.
#[must_use]
pub fn aside(transition: &FaultTransition) -> Option<String> {
    transition.aside().map(|aside| match aside {
        Aside::Shelved(shelving) => format!("shelved {}", until(shelving)),
        Aside::Suppressed(shelving) => format!("suppressed {}", until(shelving)),
    })
}

/// Each way in which the component's alarm is set aside, with until when, by whom and why.
pub(crate) fn asides(transition: &FaultTransition) -> impl Iterator<Item = String> {
    let both = [("shelved", &transition.shelved), ("suppressed", &transition.suppressed)];
    both.into_iter()
        .filter_map(|(how, shelving)| Some(format!("{how} {}", until(shelving.as_ref()?))))
}

/// The state, and how its alarm is set aside: two words that stand where there is little room.
#[must_use]
pub fn state_and_aside(transition: &FaultTransition) -> String {
    let state = state_in_words(transition);
    match transition.aside() {
        None => state,
        Some(Aside::Shelved(_)) => format!("{state}, shelved"),
        Some(Aside::Suppressed(_)) => format!("{state}, suppressed"),
    }
}

/// Until when, by whom and why.
#[must_use]
pub fn until(shelving: &Shelving) -> String {
    let Shelving { until_unix_ns, by, on_behalf_of, reason, .. } = shelving;
    let (end, who) = (utc(*until_unix_ns), by_whom(by, on_behalf_of.as_deref()));
    format!("until {end} by {who}: {}", printable(reason))
}

/// A person, and the program if he used one.
#[must_use]
pub(crate) fn by_whom(by: &str, on_behalf_of: Option<&str>) -> String {
    let by = printable(by);
    match on_behalf_of {
        Some(person) => format!("{} (through {by})", printable(person)),
        None => by,
    }
}
