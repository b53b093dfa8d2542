//! Chooses the sign for a support.

use truss::{Direction, Support};

/// The sign of a support.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SupportKind {
    Clamped,
    Pinned,
    Guided,
}

pub(super) fn kind_of_support(support: &Support) -> SupportKind {
    let translations = [Direction::X, Direction::Y, Direction::Z];
    if *support == Support::CLAMPED {
        SupportKind::Clamped
    } else if translations.into_iter().all(|direction| support.holds(direction)) {
        SupportKind::Pinned
    } else {
        SupportKind::Guided
    }
}
