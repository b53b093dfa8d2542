//! Figures as SVG text, drawn for grey print and for colour-blind readers as well: lines differ in
//! colour, brightness and dash pattern. Lines of many points are thinned out to what a pixel can show;
//! peaks survive.
//!
//! A [`Figure`] has rows of [`Panel`]s, a panel has two axes, [`Series`] and [`Mark`]s. The same
//! input gives the same bytes.

mod axis;
mod decimation;
mod drawing;
mod ink;
mod labels;
mod legend;
mod page;
mod panel;
mod paper;
mod plot;
mod plot_axes;
mod plot_marks;
mod plot_series;
mod power;
mod series;
mod ticks;

pub use axis::{Axis, Scale};
pub use page::{Figure, Row};
pub use panel::{Mark, MarkKind, Panel};
pub use paper::{figure4, figure5, figure6};
pub use power::power_figure;
pub use series::{Marker, Series, Shape, Stroke};
