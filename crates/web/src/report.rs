//! What this page has kept: a report of a period, and a fault with everything that belongs to it, as pages to print; the
//! drawing as it was.

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::response::Response;
use maud::{Markup, html};
use observer::{
    JournalEntry, Journals, ModuleHistory, PastFault, PeriodReport, Times, explained_by, scene_at,
};
use serde::Deserialize;
use vocabulary::words::{NOTHING, parse_utc, percent, printable, span, utc};
use vocabulary::{ComponentPath, StructureName};

use crate::access::Viewer;
use crate::app::{App, Shared};
use crate::history::entries;
use crate::layout::Page;
use crate::look;
use crate::overview::alarms;
use crate::view::LinkedScene;

/// What a report covers unless a time is given.
const PERIOD: Duration = Duration::from_secs(30 * 24 * 3600);
/// Most events of a module that are read.
const MOST: usize = 50_000;
/// What is shown of an incident from before its verdict: the change that led to it.
const BEFORE: Duration = Duration::from_secs(60);

/// What is asked for. Empty fields count as absent, because a form sends them.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub(crate) struct ReportParameters {
    from: String,
    to: String,
    /// The number of an incident.
    id: String,
    /// The moment of a replay.
    at: String,
}

impl ReportParameters {
    fn period(&self, now_unix_ns: u64) -> Result<(u64, u64), String> {
        let read = |name: &str, text: &str| match text {
            "" => Ok(None),
            _ => parse_utc(text).map(Some).map_err(|problem| format!("{name}: {problem}")),
        };
        let until = read("to", &self.to)?.unwrap_or(now_unix_ns).min(now_unix_ns);
        let span_ns = u64::try_from(PERIOD.as_nanos()).unwrap_or(u64::MAX);
        let from = read("from", &self.from)?.unwrap_or(until.saturating_sub(span_ns));
        if from >= until {
            return Err("from: it is not before the end of the period".to_owned());
        }
        Ok((from, until))
    }

    /// The page with the form, and what is wrong with the parameters.
    fn refused(&self, page: &Page<'_>, problem: &str) -> Response {
        page.refusing(
            StatusCode::BAD_REQUEST,
            &html! {
                h1 { (page.title) }
                (self.form(page.place))
                p.trouble.latched role="alert" { (printable(problem)) }
            },
        )
    }

    /// The form for the period.
    fn form(&self, action: &str) -> Markup {
        let local = |text: &str| text.trim_end_matches('Z').to_owned();
        html! {
            form.filter method="get" action=(action) {
                label { "From [UTC]" input type="datetime-local" step="1" name="from" value=(local(&self.from)); }
                label { "To [UTC]" input type="datetime-local" step="1" name="to" value=(local(&self.to)); }
                button type="submit" { "Show" }
            }
        }
    }
}

/// Everything that is kept, by module, each with the components that are known of it.
async fn kept(app: &App, within: RangeInclusive<u64>) -> Vec<(ModuleHistory, Vec<ComponentPath>)> {
    let scene = app.observed.scene();
    let records = Arc::clone(&app.observed.records);
    let read = move || {
        let modules = records.modules().into_iter();
        let wanted = modules.filter(|(_, module)| module.as_str() != vocabulary::keys::PLANT);
        let read = |(structure, module): (StructureName, _)| {
            let of = |view: &&observer::ModuleView| {
                view.structure.as_ref() == Some(&structure) && view.module == module
            };
            let known = scene.modules.iter().filter(of).flat_map(|view| &view.components);
            let names = known.map(|state| state.component.clone()).collect();
            (records.history(&structure, &module, within.clone(), MOST), names)
        };
        wanted.map(read).collect()
    };
    tokio::task::spawn_blocking(read).await.unwrap_or_default()
}

/// `/report`
pub(crate) async fn page(
    State(app): State<Shared>,
    Query(asked): Query<ReportParameters>,
    viewer: Viewer,
) -> Response {
    let scene = app.observed.scene();
    let page = Page {
        title: "Report",
        place: "/report",
        live: String::new(),
        viewer: &viewer,
        scene: &scene,
    };
    let mut period = match asked.period(shell::clock::unix_ns()) {
        Ok(period) => period,
        Err(problem) => return asked.refused(&page, &problem),
    };
    let kept = kept(&app, 0..=period.1).await;
    let since = app.observed.records.since_unix_ns();
    // Of the time before, nothing is known.
    let is_shortened = since.is_some_and(|since| since > period.0);
    period.0 = period.0.max(since.unwrap_or(0)).min(period.1);
    let reports: Vec<_> = kept
        .into_iter()
        .map(|(history, names)| {
            let report = PeriodReport::of(&history, names, period);
            (history, report)
        })
        .collect();
    let view = LinkedScene::new(&scene);
    page.respond(&html! {
        h1 { "Report" }
        p { (look::when(period.0)) " to " (look::when(period.1)) " · "
            a href={ "/replay?from=" (asked.from) "&to=" (asked.to) } { "replay" } }
        (asked.form("/report"))
        @match since {
            None => p.nothing { "Nothing is kept: start the page with --state-dir." },
            Some(_) => {
                @if is_shortened { p.note { "This page has kept what it heard since then; of the time before nothing is known." } }
                (faults(&view, &reports))
                (components(&view, &reports))
                (gaps(&reports))
            }
        }
    })
}

type Reports = [(ModuleHistory, PeriodReport)];

fn faults(view: &LinkedScene<'_>, reports: &Reports) -> Markup {
    let mut faults: Vec<&PastFault> =
        reports.iter().flat_map(|(_, report)| &report.faults).collect();
    faults.sort_by_key(|fault| fault.latched.time_unix_ns);
    let mut after: Vec<u64> =
        faults.iter().filter_map(|fault| fault.acknowledged_after_ns()).collect();
    after.sort_unstable();
    html! {
        section {
            h2 { "Faults" }
            @if faults.is_empty() { p.nothing { "None." } }
            @else {
                p { (faults.len()) " in the period"
                    @if let [.., longest] = after[..] {
                        @let median = u64::midpoint(after[(after.len() - 1) / 2], after[after.len() / 2]);
                        "; acknowledged after " (ns(median)) " (median), at most " (ns(longest))
                    } "."
                }
                div.wide tabindex="0" role="region" aria-label="Faults" { table {
                    thead { tr { @for name in ["verdict", "component", "kind and size", "acknowledged", "ended"] { th scope="col" { (name) } } } }
                    tbody { @for fault in faults { tr {
                        td { (look::when(fault.latched.time_unix_ns)) }
                        th scope="row" { @match fault.incident() {
                            Some(id) => a href={ "/incident?id=" (id.replace('@', "%40")) } { (fault.component) },
                            None => a href=(view.component(Some(&fault.structure), &fault.component)) { (fault.component) },
                        } }
                        td { (printable(&fault.kind)) }
                        td { @match (&fault.acknowledged, fault.acknowledged_after_ns()) {
                            (Some((_, by)), Some(after)) => { "after " (ns(after)) ", by " (printable(by)) },
                            _ => "–",
                        } }
                        td { @match fault.ended_unix_ns { Some(ended) => (look::when(ended)), None => "not ended" } }
                    } } }
                } }
            }
        }
    }
}

fn components(view: &LinkedScene<'_>, reports: &Reports) -> Markup {
    html! {
        section {
            h2 { "Components" }
            div.wide tabindex="0" role="region" aria-label="Components" { table {
                thead { tr {
                    th scope="col" { "component" }
                    @for name in ["available", "healthy", "faulty", "unknown"] { th.number scope="col" { (name) } }
                } }
                tbody { @for (history, report) in reports { @for (component, times) in &report.components {
                    @let Times { healthy_ns, faulty_ns, unknown_ns } = *times;
                    tr {
                        th scope="row" { a href=(view.component(Some(&history.structure), component)) { (component) } }
                        td.number { (percent(times.availability())) }
                        td.number { (ns(healthy_ns)) }
                        td.number { (ns(faulty_ns)) }
                        td.number { (ns(unknown_ns)) }
                    }
                } } }
            } }
            p.note { "Available: watched and without a known fault. Unknown: not monitored, or not comparable." }
        }
    }
}

fn gaps(reports: &Reports) -> Markup {
    html! {
        section {
            h2 { "Gaps in monitoring" }
            @if reports.iter().all(|(_, report)| report.gaps.is_empty()) { p.nothing { "None." } }
            @else { ul.notes { @for (history, report) in reports { @for (from, until, why) in &report.gaps { li {
                (history.module) ": " (look::when(*from)) " to " (look::when(*until)) " (" (ns(until - from)) "): " (why.join(", then "))
            } } } } }
        }
    }
}

/// A duration in words.
#[expect(clippy::cast_precision_loss, reason = "a display value")]
fn ns(duration: u64) -> String {
    if duration == 0 {
        return NOTHING.to_owned();
    }
    span(duration as f64 / 1e6)
}

/// Most events that are listed of a time range.
const LISTED: usize = 500;

/// `/replay`: the drawing as it was at a time, event by event.
pub(crate) async fn replay(
    State(app): State<Shared>,
    Query(asked): Query<ReportParameters>,
    viewer: Viewer,
) -> Response {
    let scene = app.observed.scene();
    let live = String::new();
    let page = Page { title: "Replay", place: "/replay", live, viewer: &viewer, scene: &scene };
    let period = asked.period(shell::clock::unix_ns());
    let at = match asked.at.as_str() {
        "" => Ok(None),
        text => parse_utc(text).map(Some).map_err(|problem| format!("at: {problem}")),
    };
    let (period, at) = match period.and_then(|period| Ok((period, at?))) {
        Ok(asked) => asked,
        Err(problem) => return asked.refused(&page, &problem),
    };
    let kept = kept(&app, 0..=period.1).await;
    let entries = Journals::merge(kept.iter().map(|(history, _)| history)).entries;
    let within = entries
        .iter()
        .filter(|entry| (period.0..=period.1).contains(&entry.time_unix_ns()) && is_shown(entry));
    let within: Vec<&JournalEntry<'_>> = within.collect();
    let at = at.or_else(|| within.last().map(|entry| entry.time_unix_ns())).unwrap_or(period.1);
    let heard = kept.iter().map(|(history, names)| (history, names.as_slice()));
    let past = scene_at(heard, at);
    page.respond(&replayed(&app, &LinkedScene::new(&past), &asked, &within))
}

/// Whether an entry changes the drawing.
fn is_shown(entry: &JournalEntry<'_>) -> bool {
    !matches!(entry, JournalEntry::Identification(_))
}

fn replayed(
    app: &App,
    past: &LinkedScene<'_>,
    asked: &ReportParameters,
    within: &[&JournalEntry<'_>],
) -> Markup {
    let at = past.scene.time_unix_ns;
    // Times in links are in milliseconds: an entry is shown from the end of its millisecond on.
    let link = |entry: &JournalEntry<'_>| {
        let shown = utc(entry.time_unix_ns().saturating_add(999_999));
        format!("/replay?from={}&to={}&at={shown}", asked.from, asked.to)
    };
    let next = within.iter().find(|entry| entry.time_unix_ns() > at);
    let before =
        within.iter().rev().find(|entry| entry.time_unix_ns().saturating_add(1_000_000) < at);
    let listed = within.len().saturating_sub(LISTED);
    html! {
        h1 { "Replay" }
        (asked.form("/replay"))
        @if app.observed.records.since_unix_ns().is_none() { p.nothing { "Nothing is kept: start the page with --state-dir." } }
        p.headline { "As of " (look::when(at)) }
        p.steps {
            @if let Some(before) = before { a rel="prev" href=(link(before)) { "‹ earlier" } }
            @if let Some(next) = next { a rel="next" href=(link(next)) { "later ›" } }
        }
        div.overview.drawn[app.drawing.is_some()] {
            section.alarms { h2 { "Alarms then" } (alarms::urgent(past)) (alarms::others(past)) }
            @if let Some(drawing) = &app.drawing {
                section.structure { h2 { "Structure then" } (drawing.markup(past)) }
            }
            section.events {
                h2 { "Events" }
                @if within.is_empty() { p.nothing { "None in this time." } }
                @if listed > 0 { p.note { (listed) " earlier ones are left out: narrow the time." } }
                ol.log { @for entry in within[listed..].iter().rev() {
                    @let line = entry.line();
                    @let is_present = entry.time_unix_ns() <= at && next.is_none_or(|next| entry.time_unix_ns() < next.time_unix_ns());
                    li aria-current=[(is_present && within.iter().rfind(|one| one.time_unix_ns() <= at) == Some(entry)).then_some("step")] {
                        a href=(link(entry)) { (look::when(line.time_unix_ns)) } " " (look::event(&line)) " " (line.who)
                        @if !line.why.is_empty() { ": " (line.why) }
                    }
                } }
            }
        }
    }
}

/// `/incident`
pub(crate) async fn incident(
    State(app): State<Shared>,
    Query(asked): Query<ReportParameters>,
    viewer: Viewer,
) -> Response {
    let scene = app.observed.scene();
    let view = LinkedScene::new(&scene);
    let live = String::new();
    let page = Page { title: "Incident", place: "", live, viewer: &viewer, scene: &scene };
    let histories: Vec<ModuleHistory> =
        kept(&app, 0..=u64::MAX).await.into_iter().map(|(history, _)| history).collect();
    let until = shell::clock::unix_ns();
    let faults =
        histories.iter().flat_map(|history| PeriodReport::of(history, [], (0, until)).faults);
    let mut faults = faults;
    let Some(fault) = faults.find(|fault| fault.incident().as_deref() == Some(asked.id.as_str()))
    else {
        let words = html! { h1 { "Incident" } p { "Nothing is kept of an incident `" (printable(&asked.id)) "`. " a href="/report" { "The report" } " lists all." } };
        return page.refusing(StatusCode::NOT_FOUND, &words);
    };
    page.respond(&sheet(&app, &view, &fault, &histories))
}

fn sheet(
    app: &App,
    view: &LinkedScene<'_>,
    fault: &PastFault,
    histories: &[ModuleHistory],
) -> Markup {
    let PastFault { structure, component, latched, kind, .. } = fault;
    let before = u64::try_from(BEFORE.as_nanos()).unwrap_or_default();
    let begin = latched.time_unix_ns.saturating_sub(before);
    let end = fault.ended_unix_ns.unwrap_or(u64::MAX);
    let mine = |entry: &JournalEntry<'_>| {
        let is_effect =
            matches!(entry, JournalEntry::Transition(one) if explained_by(one) == Some(component));
        (begin..=end).contains(&entry.time_unix_ns())
            && (entry.component() == Some(component) || is_effect)
    };
    let of_structure = || histories.iter().filter(|history| history.structure == *structure);
    html! {
        nav.trace aria-label="Place" { a href="/report" { "Report" } }
        h1 { (component) @if !kind.is_empty() { ": " (printable(kind)) } }
        dl.facts {
            div { dt { "incident" } dd { (fault.incident().unwrap_or_default()) } }
            div { dt { "verdict" } dd { (look::when(latched.time_unix_ns)) } }
            @if let Some((at, by)) = &fault.acknowledged { div { dt { "acknowledged" } dd { (look::when(*at)) ", by " (printable(by)) } } }
            @if let Some(after) = fault.acknowledged_after_ns() { div { dt { "after" } dd { (ns(after)) } } }
            div { dt { "ended" } dd { @match fault.ended_unix_ns { Some(ended) => (look::when(ended)), None => "not yet" } } }
            div { dt { "software of this page" } dd { (env!("CARGO_PKG_VERSION")) } }
            div { dt { "printed" } dd { (utc(shell::clock::unix_ns())) } }
        }
        @if let Some(drawing) = &app.drawing {
            section.place { h2 { "Where it is" } (drawing.place(view, Some(structure), component)) }
        }
        section { h2 { "What happened" } (entries(view, of_structure(), mine)) }
        p { a href=(view.component(Some(structure), component)) { "Its present state, evidence and margins" } }
    }
}
