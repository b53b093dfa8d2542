//! Forms for orders. They stand outside the parts that are updated live, so that text being typed is not lost. Users
//! who may not send orders get no forms.

use maud::{Markup, html};
use observer::ModuleView;
use vocabulary::{ComponentKind, FaultTransition, StructureName};

use crate::access::{Person, Viewer};

/// Forms for orders about a component.
pub(crate) fn of_component(viewer: &Viewer, transition: &FaultTransition, back: &str) -> Markup {
    let Some(person) = may_order(viewer) else { return refusal(viewer) };
    let (structure, name) = (Some(&transition.structure), &transition.component.to_string());
    let target = OrderForm { what: "component", name, structure, back };
    let is_cylinder = transition.component.component.kind() == ComponentKind::Actuator;
    let is_faulty_cylinder = is_cylinder && transition.state().is_fault();
    html! {
        section.orders aria-labelledby="orders-title" {
            h2 #orders-title { "Orders" }
            div.forms {
                (target.form(person, "acknowledge", "Acknowledge", &note("Note", false)))
                (target.form(person, "reset", "Reset", &reset_fields()))
                (target.form(person, "shelve", "Shelve", &aside_fields()))
                (target.form(person, "unshelve", "Unshelve", &note("Note", false)))
                @if !transition.state().is_fault() {
                    (target.form(person, "declare", "Declare faulty", &note("Reason", true)))
                }
                @if transition.shut_off.is_some() {
                    (target.form(person, "put-back", "Put back", &note("Note", false)))
                } @else if is_faulty_cylinder {
                    (target.form(person, "shut-off", "Shut off", &note("Reason", true)))
                }
            }
        }
    }
}

/// Forms for orders about a module.
pub(crate) fn of_module(viewer: &Viewer, module: &ModuleView, back: &str) -> Markup {
    let Some(person) = may_order(viewer) else { return refusal(viewer) };
    let (structure, name) = (module.structure.as_ref(), module.module.as_str());
    let target = OrderForm { what: "module", name, structure, back };
    html! {
        section.orders aria-labelledby="orders-title" {
            h2 #orders-title { "Maintenance" }
            div.forms {
                (target.form(person, "suppress", "Suppress all alarms", &aside_fields()))
                (target.form(person, "unsuppress", "End the suppression", &note("Note", false)))
            }
        }
    }
}

fn may_order(viewer: &Viewer) -> Option<&Person> {
    viewer.person.as_ref().filter(|person| person.may_order)
}

fn refusal(viewer: &Viewer) -> Markup {
    html! {
        p.note {
            @match (&viewer.read_only, &viewer.person) {
                (Some(why), _) => (why),
                (None, None) => { "To acknowledge, reset or shelve, " a href="/sign-in" { "sign in" } "." },
                (None, Some(_)) => "You have read-only access.",
            }
        }
    }
}

/// The subject of an order, and the page to return to.
struct OrderForm<'a> {
    what: &'a str,
    name: &'a str,
    structure: Option<&'a StructureName>,
    back: &'a str,
}

impl OrderForm<'_> {
    fn form(&self, person: &Person, kind: &str, words: &str, fields: &Markup) -> Markup {
        html! {
            form method="post" action={ "/order/" (kind) } {
                fieldset {
                    legend { (words) }
                    input type="hidden" name="token" value=(person.form_token);
                    input type="hidden" name=(self.what) value=(self.name);
                    @if let Some(structure) = self.structure {
                        input type="hidden" name="structure" value=(structure);
                    }
                    input type="hidden" name="back" value=(self.back);
                    (fields)
                    button type="submit" { (words) }
                }
            }
        }
    }
}

fn note(words: &str, required: bool) -> Markup {
    html! {
        label { (words) input type="text" name="note" maxlength="500" autocomplete="off" required[required]; }
    }
}

fn reset_fields() -> Markup {
    html! {
        (note("Note", false))
        label.check { input type="checkbox" name="force" value="true"; "although it has not gone" }
        label.check { input type="checkbox" name="re_tare" value="true"; "replaced: re-tare its reference" }
    }
}

fn aside_fields() -> Markup {
    html! {
        label { "For" input type="text" name="for" value="2h" size="6" required; }
        (note("Reason", true))
    }
}
