//! Figures as SVG text: plots ([`plot`]) and the drawing of a structure ([`structure`]). The same input gives the
//! same bytes.

pub mod plot;
pub mod structure;
