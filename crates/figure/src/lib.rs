//! Figures as SVG text: plots ([`plot`]), the drawing of a structure ([`structure`]) and of a fault's freeze frame
//! ([`freeze_frame`]). The same input gives the same bytes.

pub mod freeze_frame;
pub mod plot;
pub mod structure;
