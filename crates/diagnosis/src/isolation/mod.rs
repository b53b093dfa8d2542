//! Isolation: which component is to blame for a change (section 4.3 of the paper, and beyond it).

mod case;
mod causes;
mod claims;
mod first_change;
mod isolator;
mod knowledge;
mod windows;

pub(crate) use case::{Case, Finding, Judgement};
pub use causes::{Explanation, Reason};
pub(crate) use claims::Word;
pub use first_change::FirstChange;
pub(crate) use isolator::Isolator;
pub use knowledge::KnownChange;
