//! Drawings of freeze frames: what was measured around the latching of a fault, as SVG text.
//!
//! | file | what |
//! |---|---|
//! | `drawing` | a frame drawn as SVG |
//! | `signals` | its traces, times and ratios as they are shown |
//! | `testing` | a made-up frame |

mod drawing;
mod signals;
pub mod testing;

pub use drawing::svg;
pub use signals::{ratios, seconds, shown_in, trace};
