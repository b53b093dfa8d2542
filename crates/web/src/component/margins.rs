//! How near a component is to its limits, now and over an hour, a day, a month and a year, and when it may reach one.

use std::collections::BTreeSet;

use figure::plot::{
    Figure, MarkKind, Panel, PanelMark, PanelRow, PlotAxis, Series, SeriesStyle, Shape,
};
use maud::{Markup, PreEscaped, html};
use observer::trend::{Forecast, ModuleSummary, Summary, TrendSpan, daily, forecast};
use vocabulary::words::utc;
use vocabulary::{Component, FaultTransition, Margins, ModuleName};

use crate::records::ModuleTrends;

/// Height of a panel \[px\], and of one of many.
const HEIGHT: f64 = 110.0;
const LOW_HEIGHT: f64 = 64.0;
/// Columns of the panels of a module.
const COLUMNS: usize = 3;
/// The tests in words, in the order of [`Margins::TESTS`].
const TESTS: [&str; 4] = [
    "change (divergence)",
    "mean against its reference",
    "oil content against its reference",
    "noise against its reference",
];

/// Likewise, in a word.
pub(crate) const NAMES: [&str; Margins::TESTS.len()] = ["change", "mean", "oil content", "noise"];

/// The present margins of a component, as a table.
pub(crate) fn present(margins: &Margins) -> Markup {
    let known =
        || margins.shares().into_iter().zip(TESTS).filter(|((_, share), _)| share.is_some());
    html! {
        @if known().next().is_none() { p.nothing { "No test says anything of it at present." } }
        @else {
            dl.facts.margins {
                @for ((_, share), words) in known() { div { dt { (words) } dd { (meter(share)) } } }
            }
        }
    }
}

/// A share of a limit: a bar and a number.
pub(crate) fn meter(share: Option<f64>) -> Markup {
    html! {
        @if let Some(share) = share {
            meter min="0" max="1" high="0.7" optimum="0" value=(format!("{:.3}", share.abs().min(1.0)))
                aria-label="share of the limit" {}
            " " (format!("{share:.2}"))
        } @else { "–" }
    }
}

/// What is kept of a component, drawn, and what it may come to.
pub(super) fn trends(
    transition: &FaultTransition,
    now: Option<&Margins>,
    kept: Option<&ModuleTrends>,
) -> Markup {
    html! {
        @match now { Some(margins) => (present(margins)), None => p.nothing { "Its margins are not known." } }
        @match kept.filter(|kept| kept.has(&transition.component.component)) {
            None => p.nothing { "Nothing is kept of them: start the page with --state-dir." },
            Some(kept) => {
                @for (words, forecast) in forecasts(kept, &transition.component.component) {
                    p.why { (words) ": " (forecast.words()) "." }
                }
                div.plot { (PreEscaped(drawing(transition, kept).svg())) }
            }
        }
    }
}

/// The tests of a component that come nearer to their limits, with the date.
pub(crate) fn forecasts(
    kept: &ModuleTrends,
    component: &Component,
) -> Vec<(&'static str, Forecast)> {
    let month = kept.span(TrendSpan::Month);
    let name = component.to_string();
    // A change has no trend: it is sudden.
    let of = |test: usize| {
        let own = |(time, summary): &(u64, ModuleSummary)| Some((*time, summary.get(&name)?[test]));
        Some((TESTS[test], forecast(&daily(month.iter().filter_map(own)))?))
    };
    (1..TESTS.len()).filter_map(of).collect()
}

fn drawing(transition: &FaultTransition, kept: &ModuleTrends) -> Figure {
    let name = transition.component.component.to_string();
    let used = |test: usize| TrendSpan::ALL.iter().any(|span| has(kept, *span, &name, test));
    let tests: Vec<usize> = (0..TESTS.len()).filter(|test| used(*test)).collect();
    let panel = |span: TrendSpan| {
        // One legend is enough.
        let named = if span == TrendSpan::Day { &tests[..] } else { &[] };
        panel((words_of(span).0, &name), kept, span, (&tests, named))
    };
    let rows = [[TrendSpan::Hour, TrendSpan::Day], [TrendSpan::Month, TrendSpan::Year]]
        .map(|spans| PanelRow::new(HEIGHT, spans.map(panel).into()));
    figure(&transition.component.to_string(), kept, rows.into())
}

/// What is kept of all components of a module over a span, drawn; the legend is at the right of the first row.
pub(crate) fn drawing_of_module(
    module: &ModuleName,
    kept: &ModuleTrends,
    span: TrendSpan,
) -> Figure {
    let names: BTreeSet<&String> = kept.span(span).iter().flat_map(|(_, of)| of.keys()).collect();
    let used = |test: &usize| names.iter().any(|name| has(kept, span, name, *test));
    let tests: Vec<usize> = (0..TESTS.len()).filter(used).collect();
    let last_column = names.len().min(COLUMNS).saturating_sub(1);
    let panel = |(index, name): (usize, &&String)| {
        let named = if index == last_column { &tests[..] } else { &[] };
        panel((name, name), kept, span, (&tests, named))
    };
    let panels: Vec<Panel> = names.iter().enumerate().map(panel).collect();
    let row = |panels: &[Panel]| PanelRow::new(LOW_HEIGHT, panels.to_vec()).columns(COLUMNS);
    figure(module.as_str(), kept, panels.chunks(COLUMNS).map(row).collect())
}

fn figure(of: &str, kept: &ModuleTrends, rows: Vec<PanelRow>) -> Figure {
    let until = utc(kept.until_unix_s * 1_000_000_000);
    Figure {
        title: "Margins".to_owned(),
        description: format!("Shares of the limits of {of}, up to {until}."),
        subtitle: format!("lines: means; bands: extremes; up to {until}"),
        rows,
    }
}

/// A component over a span: these tests, of which some are named in the legend.
fn panel(
    (title, name): (&str, &str),
    kept: &ModuleTrends,
    span: TrendSpan,
    (tests, named): (&[usize], &[usize]),
) -> Panel {
    let words = |test: &usize| if named.contains(test) { NAMES[*test] } else { "" };
    let series = tests.iter().map(|test| series(kept, span, name, *test, words(test))).collect();
    let limit = [
        PanelMark::new(MarkKind::Level, 1.0, if named.is_empty() { "" } else { "limit" }),
        PanelMark::new(MarkKind::Level, -1.0, ""),
    ];
    let (_, unit, length) = words_of(span);
    let x = PlotAxis::linear(format!("[{unit}]")).over([-length, 0.0]);
    let y = PlotAxis::linear("share of limit").over([-1.15, 1.15]);
    Panel::new(title, x, y, series).marked(limit)
}

fn has(kept: &ModuleTrends, span: TrendSpan, name: &str, test: usize) -> bool {
    let of = |summary: &ModuleSummary| summary.get(name).is_some_and(|of| of[test].count > 0);
    kept.span(span).iter().any(|(_, summary)| of(summary))
}

/// Title, unit and length.
pub(crate) fn words_of(span: TrendSpan) -> (&'static str, &'static str, f64) {
    match span {
        TrendSpan::Hour => ("hour", "min", 60.0),
        TrendSpan::Day => ("day", "h", 24.0),
        TrendSpan::Month => ("month", "days", 31.0),
        TrendSpan::Year => ("year", "days", 366.0),
    }
}

#[expect(clippy::cast_precision_loss, reason = "seconds of a year")]
fn series(kept: &ModuleTrends, span: TrendSpan, name: &str, test: usize, words: &str) -> Series {
    let (_, _, length) = words_of(span);
    let unit_s = (span.intervals() * span.interval_s()) as f64 / length;
    let (mut points, mut spread) = (Vec::new(), Vec::new());
    let mut last = None;
    for (begin, summary) in kept.span(span) {
        let Some(Summary { count: 1.., mean, extreme }) = summary.get(name).map(|of| of[test])
        else {
            continue;
        };
        let middle = *begin as f64 + span.interval_s() as f64 / 2.0;
        let at = (middle - kept.until_unix_s as f64) / unit_s;
        // A gap in monitoring is a gap in the line.
        if last.is_some_and(|last| *begin > last + span.interval_s()) {
            points.push([at, f64::NAN]);
            spread.push([f64::NAN; 2]);
        }
        last = Some(*begin);
        let (mean, extreme) = (f64::from(mean), f64::from(extreme));
        points.push([at, mean]);
        spread.push([mean.min(extreme), mean.max(extreme)]);
    }
    Series::new(words, Shape::Line, SeriesStyle::nth(test).solid(), points).spread(spread)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::component;
    use vocabulary::FaultState;

    /// Until this time everything was kept [s since 1970].
    const UNTIL_S: u64 = 400 * 86_400;

    /// A module whose gage comes nearer to its limit by 0.02 a day, since three weeks ago, and varies by day.
    fn kept() -> ModuleTrends {
        let spans = TrendSpan::ALL.map(|span| {
            let last = span.interval(UNTIL_S - 1);
            let of = |interval: u64| {
                let time = interval * span.interval_s();
                let days = (time as f64 - (UNTIL_S as f64 - 21.0 * 86_400.0)) / 86_400.0;
                let wave = (time as f64 / 86_400.0 * std::f64::consts::TAU).sin();
                let noise = ((interval * 7919) % 101) as f64 / 101.0 - 0.5;
                let mut summary = ModuleSummary::new();
                let of_gage = summary.entry("sensor/g1".to_owned()).or_default();
                for share in [-1.0, 0.0, 1.0] {
                    of_gage[0].add(0.08 + 0.03 * noise + 0.02 * share);
                    of_gage[1]
                        .add(0.02 * days.max(0.0) + 0.04 * wave + 0.05 * noise + 0.06 * share);
                    of_gage[3].add(-0.05 + 0.02 * noise);
                }
                (time, summary)
            };
            // A gap in monitoring.
            let first = last + 1 - span.intervals();
            let gap = first + span.intervals() / 3..first + span.intervals() / 3 + 8;
            (first..=last).filter(|interval| !gap.contains(interval)).map(of).collect()
        });
        ModuleTrends { until_unix_s: UNTIL_S, spans }
    }

    #[test]
    fn a_component_that_comes_nearer_has_a_date_and_every_span_its_line() {
        let transition = component("m1/sensor/g1", FaultState::Normal);
        let html = trends(&transition, None, Some(&kept())).into_string();
        if let Some(file) = std::env::var_os("TRUSSWATCH_PICTURES") {
            let file = std::path::Path::new(&file).join("margins.svg");
            std::fs::write(file, drawing(&transition, &kept()).svg()).unwrap();
        }
        let words = "mean against its reference: at this rate its limit in ";
        assert!(html.contains(words), "{html}");
        let [(_, found)] = forecasts(&kept(), &transition.component.component)[..] else {
            panic!()
        };
        // Of 1, 0.42 are reached.
        assert!((24.0..34.0).contains(&found.days), "{found:?}");
        for span in ["hour", "day", "month", "year", "limit"] {
            assert!(html.contains(span), "{span}");
        }
        assert!(!html.contains("oil content"), "{html}");
    }

    #[test]
    fn a_module_shows_all_its_components_with_one_legend() {
        let mut kept = kept();
        for (_, summary) in kept.spans.iter_mut().flatten() {
            for number in 2..=7 {
                summary.insert(format!("sensor/g{number}"), summary["sensor/g1"]);
            }
        }
        let svg = drawing_of_module(&"m1".parse().unwrap(), &kept, TrendSpan::Month).svg();
        if let Some(file) = std::env::var_os("TRUSSWATCH_PICTURES") {
            let file = std::path::Path::new(&file).join("margins-of-module.svg");
            std::fs::write(file, &svg).unwrap();
        }
        for number in 1..=7 {
            assert_eq!(svg.matches(&format!(") sensor/g{number}\n")).count(), 1, "{number}");
        }
        for name in ["limit", "mean", "noise"] {
            assert_eq!(svg.matches(&format!("\n{name}\n")).count(), 1, "{name}");
        }
    }

    #[test]
    fn what_no_test_says_is_not_drawn_as_far_from_the_limit() {
        let transition = component("m1/sensor/g2", FaultState::Normal);
        let html = trends(
            &transition,
            Some(&Margins::unknown("sensor/g2".parse().unwrap())),
            Some(&kept()),
        );
        let html = html.into_string();
        assert!(html.contains("No test says anything of it") && !html.contains("<meter"), "{html}");
        assert!(html.contains("Nothing is kept of them"), "{html}");
    }
}
