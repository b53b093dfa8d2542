//! Plots, legible in greyscale print and for colour-blind readers: lines differ in colour, brightness and dash pattern.
//! Lines of many points are reduced to the resolution of a pixel; peaks are kept.
//!
//! A [`Figure`] has rows of [`Panel`]s, a panel has two axes, [`Series`] and [`PanelMark`]s.

mod axis;
pub(crate) mod ink;
mod labels;
mod layout;
mod legend;
mod page;
mod panel;
mod panel_drawing;
mod series;
mod series_drawing;
pub mod ticks;

pub use axis::{PlotAxis, Scale};
pub use page::{Figure, PanelRow};
pub use panel::{MarkKind, Panel, PanelMark};
pub use series::{Marker, Series, SeriesStyle, Shape};
