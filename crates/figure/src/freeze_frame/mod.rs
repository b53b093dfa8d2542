//! Drawings of freeze frames: measurements around the latching of a fault, as SVG text.
//!
//! | file | what |
//! |---|---|
//! | `drawing` | draws a frame as SVG |
//! | `signals` | the traces, times and ratios of a frame in display units |
//! | `testing` | a made-up frame |

mod drawing;
mod signals;
pub mod testing;

pub use drawing::svg;
pub use signals::{ratios, seconds, shown_in, trace};
