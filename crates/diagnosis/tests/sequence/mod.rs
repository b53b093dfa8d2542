//! Arbitrary sequences of events, and what must hold after each of them.
//!
//! | file | job |
//! |---|---|
//! | `happening` | something that may happen |
//! | `driver` | makes it happen to a diagnoser |
//! | `journal` | what outlives the diagnoser's process |
//! | `peer` | what one peer has answered validly, and what it was asked |
//! | `inquiries` | questions and commands, and whether each had its one reply |
//! | `life` | what may become of the verdict on a component |
//! | `unshelved` | a history as it would be without any order that sets an alarm aside |

mod driver;
mod happening;
mod inquiries;
mod journal;
mod life;
mod peer;
mod unshelved;

pub use driver::Driver;
pub use happening::{Happening, Said, happening, shelving};
pub use life::is_of_alarm;
pub use unshelved::unshelved;
