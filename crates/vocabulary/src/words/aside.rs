//! Shelving and suppression in words.

use crate::printable;
use crate::{Aside, FaultTransition, Shelving};

use super::state::state_in_words;
use super::time::utc;

/// The shelving or suppression of the component's alarm, with end, issuer and reason; `None` if the alarm is active.
#[must_use]
pub fn aside(transition: &FaultTransition) -> Option<String> {
    transition.aside().map(|aside| match aside {
        Aside::Shelved(shelving) => format!("shelved {}", until(shelving)),
        Aside::Suppressed(shelving) => format!("suppressed {}", until(shelving)),
    })
}

/// Shelving and suppression of the component's alarm, each with end, issuer and reason.
pub(crate) fn asides(transition: &FaultTransition) -> impl Iterator<Item = String> {
    let both = [("shelved", &transition.shelved), ("suppressed", &transition.suppressed)];
    both.into_iter()
        .filter_map(|(how, shelving)| Some(format!("{how} {}", until(shelving.as_ref()?))))
}

/// The state, and whether the alarm is shelved or suppressed: two words for places with little space.
#[must_use]
pub fn state_and_aside(transition: &FaultTransition) -> String {
    let state = state_in_words(transition);
    match transition.aside() {
        None => state,
        Some(Aside::Shelved(_)) => format!("{state}, shelved"),
        Some(Aside::Suppressed(_)) => format!("{state}, suppressed"),
    }
}

/// End, issuer and reason.
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
