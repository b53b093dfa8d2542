//! Isolation: which component is to blame for a change (section 4.3 of the paper, and beyond it).

mod case;
mod causes;
mod claims;
mod first_change;
mod isolator;
mod judgement;
mod knowledge;
mod open_cases;
mod paper;
mod windows;

pub(crate) use case::{Case, Finding};
pub use causes::{Explanation, Reason};
pub(crate) use claims::Word;
pub use first_change::FirstChange;
pub(crate) use isolator::Isolator;
pub(crate) use judgement::Judgement;
pub use knowledge::KnownChange;
