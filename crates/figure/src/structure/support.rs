//! Which sign a support is drawn with.

use truss::{Direction, Support};

/// How a support is drawn.
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
