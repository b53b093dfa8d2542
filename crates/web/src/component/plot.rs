//! Plots of residual and divergence, as published: of a minute, or for as long as they have been received.

use figure::freeze_frame::divergence_panel;
use figure::plot::{Figure, Panel, PanelRow, PlotAxis, Series, SeriesStyle, Shape};
use maud::{Markup, PreEscaped, html};
use vocabulary::words::{span, utc};
use vocabulary::{Channel, ComponentKind, FaultTransition};

use crate::observed::Traces;

/// Height of a plot \[px\].
const HEIGHT: f64 = 120.0;

/// A time \[s, 0 is the latest\], and the channel at that time.
type Point<'a> = (f64, &'a Channel);

/// The plots, or a note that data are missing.
pub(super) fn plot(transition: &FaultTransition, traces: &Traces) -> Markup {
    let points = points(transition, traces);
    if points.len() < 2 {
        return html! {
            p.nothing { "Waiting for divergences from the diagnoser." }
        };
    }
    let latest = traces.back().map_or((0, 0), |latest| (latest.step.0, latest.time_unix_ns));
    let begin = points.first().map_or(0.0, |(time, _)| -time);
    let spanned =
        format!("{} up to step {}, {}", span(1e3 * begin.round()), latest.0, utc(latest.1));
    let figure = Figure {
        title: "Residual and divergence".to_owned(),
        description: format!("Residual and divergence of {}: {spanned}.", transition.component),
        subtitle: spanned,
        rows: [residual(transition, &points), divergence(&points)]
            .map(|panel| PanelRow::new(HEIGHT, vec![panel]))
            .into(),
    };
    html! { div.plot { (PreEscaped(figure.svg())) } }
}

#[expect(clippy::cast_precision_loss, reason = "a minute")]
fn points<'a>(transition: &FaultTransition, traces: &'a Traces) -> Vec<Point<'a>> {
    let latest = traces.back().map_or(0, |latest| latest.time_unix_ns);
    let own = |channel: &&Channel| channel.component == transition.component.component;
    let point = |message: &'a std::sync::Arc<vocabulary::Divergences>| {
        let channel = message.channels.iter().find(own)?;
        Some((-(latest.saturating_sub(message.time_unix_ns) as f64) / 1e9, channel))
    };
    traces.iter().filter_map(point).collect()
}

fn residual(transition: &FaultTransition, points: &[Point<'_>]) -> Panel {
    let own_unit = points.last().is_some_and(|(_, channel)| channel.own_unit);
    let (scale, unit) = match transition.component.component.kind() {
        _ if own_unit => (1.0, "unit of the reading"),
        ComponentKind::Actuator => (1e-3, "kN"),
        ComponentKind::Sensor => (1e6, "µm"),
    };
    let values = points.iter().map(|(time, channel)| [*time, scale * channel.residual]).collect();
    let line = Series::new("", Shape::Line, SeriesStyle::nth(0).solid(), values);
    Panel::new("residual", time(), PlotAxis::linear(format!("[{unit}]")), vec![line])
}

fn divergence(points: &[Point<'_>]) -> Panel {
    let ratio = |channel: &Channel| {
        channel.divergence.map_or(f64::NAN, |divergence| divergence / channel.threshold)
    };
    let ratios = points.iter().map(|(time, channel)| [*time, ratio(channel)]);
    divergence_panel(time(), ratios.collect())
}

fn time() -> PlotAxis {
    PlotAxis::linear("time [s]")
}
