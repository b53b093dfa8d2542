//! What needs attention, the most urgent first: modules that give no verdicts stand among the faults.

use maud::{Markup, html};
use observer::{LiveModule, Urgency};
use wire::{FaultState, FaultTransition};
use wording::{identified, reason};

use super::trouble::{Trouble, troubles};
use crate::look;
use crate::view::View;

/// A line of the list.
enum Alarm<'a> {
    Module(&'a LiveModule, Trouble),
    Component(&'a FaultTransition),
    /// Components of one module of which nothing is known, for the same reason.
    Unknown(Vec<&'a FaultTransition>),
}

/// What somebody has to do something about.
pub(super) fn urgent(view: &View<'_>) -> Markup {
    let alarms = alarms(view);
    let nothing = if view.scene.modules.is_empty() {
        "Nothing is known."
    } else {
        "Nothing of what is known."
    };
    html! {
        @if alarms.is_empty() { p.nothing { (nothing) } }
        @else { ol.list { @for alarm in &alarms { (line(view, alarm)) } } }
    }
}

/// What is set aside, explained, or changed a moment ago: never hidden.
pub(super) fn others(view: &View<'_>) -> Markup {
    let wanted = |urgency: Urgency| !urgency.needs_attention() && urgency != Urgency::Normal;
    let mut others: Vec<&FaultTransition> =
        view.scene.components().filter(|component| wanted(Urgency::of(component))).collect();
    others.sort_by_key(|component| Urgency::of(component));
    let shelved = view.scene.components().filter(|component| {
        Urgency::of(component) == Urgency::Normal && component.aside().is_some()
    });
    others.extend(shelved);
    html! {
        @if !others.is_empty() {
            h3 { "Set aside, explained or tentative" }
            ol.list { @for component in others { (component_line(view, component)) } }
        }
    }
}

fn alarms<'a>(view: &View<'a>) -> Vec<Alarm<'a>> {
    let modules = view.scene.modules.iter();
    let mut alarms: Vec<Alarm<'a>> = modules
        .flat_map(|module| {
            troubles(module).into_iter().map(move |trouble| Alarm::Module(module, trouble))
        })
        .collect();
    let urgent = view.scene.components().filter(|c| Urgency::of(c).needs_attention());
    let (unknown, known): (Vec<_>, Vec<_>) =
        urgent.partition(|c| Urgency::of(c) == Urgency::Unknown);
    alarms.extend(known.into_iter().map(Alarm::Component));
    let together = |a: &&FaultTransition, b: &&FaultTransition| {
        a.structure == b.structure && a.module == b.module && a.unknown == b.unknown
    };
    alarms.extend(unknown.chunk_by(together).map(|group| match group {
        [one] => Alarm::Component(one),
        several => Alarm::Unknown(several.to_vec()),
    }));
    alarms.sort_by_key(rank);
    alarms
}

/// A module without verdicts comes after new faults and before what follows from it: the components it does not watch.
fn rank(alarm: &Alarm<'_>) -> (u8, Urgency) {
    match alarm {
        Alarm::Module(_, trouble) if trouble.tone == wording::Tone::Alarm => (0, Urgency::Latched),
        Alarm::Module(..) => (2, Urgency::Unconfirmed),
        Alarm::Unknown(_) => (3, Urgency::Unknown),
        Alarm::Component(component) => match Urgency::of(component) {
            Urgency::Latched => (1, Urgency::Latched),
            other => (3, other),
        },
    }
}

fn line(view: &View<'_>, alarm: &Alarm<'_>) -> Markup {
    match alarm {
        Alarm::Module(module, trouble) => module_line(view, module, trouble),
        Alarm::Component(component) => component_line(view, component),
        Alarm::Unknown(components) => unknown_line(view, components),
    }
}

fn unknown_line(view: &View<'_>, components: &[&FaultTransition]) -> Markup {
    let Some(first) = components.first() else { return html! {} };
    html! {
        li.alarm.unknown {
            span.state.unknown { (look::sign("unknown")) "unknown" }
            span.what { (components.len()) " components of " (first.module) }
            p.why { (reason(first)) }
            p.those {
                @for component in components {
                    a href=(view.component(Some(&component.structure), &component.component)) {
                        (component.component.component.name())
                    }
                    " "
                }
            }
        }
    }
}

fn module_line(view: &View<'_>, module: &LiveModule, trouble: &Trouble) -> Markup {
    let member = &module.picture.member;
    let class = look::tone_class(trouble.tone);
    html! {
        li.alarm.(class) {
            span.state.(class) { (look::sign(class)) "module" }
            a.what href=(view.module(member.structure.as_ref(), &member.module)) { (member.module) }
            p.why { (trouble.words) }
        }
    }
}

/// A component with everything that is known of its state.
pub(crate) fn component_line(view: &View<'_>, component: &FaultTransition) -> Markup {
    let kind = component.identification.as_ref().filter(|_| component.state().is_fault());
    let why = reason(component);
    html! {
        li.alarm.(look::classes(component)) {
            (look::state(component))
            a.what href=(view.component(Some(&component.structure), &component.component)) {
                (component.component)
            }
            @if let Some(found) = kind { span.kind { (identified(found)) } }
            @if component.sequence > 0 { (since(component)) }
            @if !why.is_empty() { p.why { (why) } }
        }
    }
}

/// Of a component that never had a transition, the time is that of the answer.
fn since(component: &FaultTransition) -> Markup {
    let onset = component.onset_step.filter(|_| component.state() != FaultState::Normal);
    html! {
        p.meta {
            "since " (look::when(component.time_unix_ns))
            @if let Some(step) = onset { ", onset step " (step) }
        }
    }
}
