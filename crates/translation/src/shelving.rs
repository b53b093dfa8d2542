//! By whom, why and until when an alarm is set aside.

use diagnosis::{Shelving, Span};

/// As it stands in messages.
#[must_use]
pub fn to_wire_shelving(shelving: Shelving) -> wire::Shelving {
    let Shelving { span, by, on_behalf_of, reason } = shelving;
    let Span { since_unix_ns, until_unix_ns } = span;
    wire::Shelving { since_unix_ns, until_unix_ns, by, on_behalf_of, reason }
}

pub(crate) fn from_wire_shelving(shelving: wire::Shelving) -> Shelving {
    let wire::Shelving { since_unix_ns, until_unix_ns, by, on_behalf_of, reason } = shelving;
    Shelving { span: Span { since_unix_ns, until_unix_ns }, by, on_behalf_of, reason }
}
