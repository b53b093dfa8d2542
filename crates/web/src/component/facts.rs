//! A component's state with reasons, and what kind of fault it is.

use maud::{Markup, html};
use wire::{FaultTransition, Identification};
use wording::{candidate, identified, percent, printable, ratio, reason, residual};

use crate::look;
use crate::view::View;

/// What is known of its present state.
pub(super) fn facts(view: &View<'_>, transition: &FaultTransition) -> Markup {
    let why = reason(transition);
    let found = transition.identification.as_ref().filter(|_| transition.state().is_fault());
    html! {
        div.verdict.(look::classes(transition)) {
            p.headline { (look::state(transition)) @if let Some(found) = found { span.kind { (identified(found)) } } }
            @if !why.is_empty() { p.why { (why) } }
            @if let Some(root) = transition.verdict.explained_by() {
                p { "Explained by " a href=(view.component(Some(&transition.structure), root)) { (root) } "." }
            }
        }
        (figures(transition))
        @if let Some(found) = found { (candidates(found)) }
    }
}

fn figures(transition: &FaultTransition) -> Markup {
    let kind = transition.component.component.kind();
    let steps = [
        ("onset step", transition.onset_step),
        ("detection step", transition.detection_step),
        ("decided as of step", transition.decided_step),
    ];
    let condition = transition.condition.as_ref();
    html! {
        dl.facts {
            @if transition.sequence > 0 { div { dt { "since" } dd { (look::when(transition.time_unix_ns)) } } }
            @for (name, step) in steps {
                @if let Some(step) = step { div { dt { (name) } dd { (step) } } }
            }
            @if let Some(run) = transition.run { div { dt { "run" } dd { (run) } } }
            @if let Some(evidence) = &transition.evidence {
                div { dt { "residual" } dd { (residual(kind, evidence.residual)) } }
                div { dt { "divergence" } dd { (ratio(evidence.ratio())) } }
            }
            div { dt { "reference" } dd {
                (condition.map_or("not known", |known| in_words(known.agreement)))
                @if let Some(why) = condition.and_then(|known| known.reason.as_ref()) { ": " (printable(why)) }
            } }
        }
    }
}

fn in_words(agreement: wire::Agreement) -> &'static str {
    match agreement {
        wire::Agreement::NotVerified => "there is none",
        wire::Agreement::NotCompared => "not compared yet",
        wire::Agreement::Agrees => "agrees",
        wire::Agreement::Doubtful => "departed from in the latest window",
        wire::Agreement::Departed => "departed from",
        wire::Agreement::OneOf => "it or another component has departed from it",
        wire::Agreement::CannotTell => "cannot be compared at present",
    }
}

fn candidates(found: &Identification) -> Markup {
    html! {
        table.candidates {
            caption { "What kind of fault it may be, as of step " (found.as_of_step) }
            thead { tr { th scope="col" { "kind and size" } th.number scope="col" { "probability" } } }
            tbody {
                @for one in &found.candidates {
                    tr { td { (candidate(one)) } td.number { (percent(one.probability)) } }
                }
            }
        }
    }
}
