//! Forms for orders. They stand outside the parts that are updated live, so that text being typed is not lost. Users
//! who may not send orders get no forms.

use maud::{Markup, html};
use observer::{ModuleView, StateRow};
use vocabulary::{ComponentKind, FaultTransition, StructureName};

use crate::access::{Person, Viewer};

/// Forms for orders about a component.
pub(crate) fn of_component(viewer: &Viewer, transition: &FaultTransition, back: &str) -> Markup {
    let Some(person) = may_order(viewer) else { return refusal(viewer) };
    let (structure, name) = (Some(&transition.structure), &transition.component.to_string());
    let present = order_states(&StateRow::of_component(transition));
    let target = OrderForm { what: "component", name, structure, back, present: &present };
    let is_cylinder = transition.component.component.kind() == ComponentKind::Actuator;
    let is_faulty_cylinder = is_cylinder && transition.state().is_fault();
    html! {
        section.orders aria-labelledby="orders-title" {
            h2 #orders-title { "Orders" }
            div.forms {
                (target.form(person, ("acknowledge", "latched"), "Acknowledge", &note("Note", false)))
                (target.form(person, ("reset", "latched acknowledged"), "Reset", &reset_fields()))
                (target.form(person, ("shelve", "plain"), "Shelve", &aside_fields()))
                (target.form(person, ("unshelve", "aside"), "Unshelve", &note("Note", false)))
                (target.form(person, ("declare", NOT_FAULTY), "Declare faulty", &note("Reason", true)))
                @if transition.shut_off.is_some() {
                    (target.form(person, ("put-back", ALWAYS), "Put back", &note("Note", false)))
                } @else if is_faulty_cylinder {
                    (target.form(person, ("shut-off", ALWAYS), "Shut off", &note("Reason", true)))
                }
            }
        }
    }
}

/// Forms for orders about a module.
pub(crate) fn of_module(viewer: &Viewer, module: &ModuleView, back: &str) -> Markup {
    let Some(person) = may_order(viewer) else { return refusal(viewer) };
    let (structure, name) = (module.structure.as_ref(), module.module.as_str());
    let target = OrderForm { what: "module", name, structure, back, present: ALWAYS };
    html! {
        section.orders aria-labelledby="orders-title" {
            h2 #orders-title { "Maintenance" }
            div.forms {
                (target.form(person, ("suppress", ALWAYS), "Suppress all alarms", &aside_fields()))
                (target.form(person, ("unsuppress", ALWAYS), "End the suppression", &note("Note", false)))
            }
        }
    }
}

/// The user, if one who may send orders.
pub(crate) fn may_order(viewer: &Viewer) -> Option<&Person> {
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
    /// What is so at present, see [`order_states`].
    present: &'a str,
}

/// The component's state, and whether its alarm is set aside. Both decide which orders are possible; the page's script
/// tracks changes.
fn order_states(row: &StateRow) -> String {
    format!("{} {}", row.sign, if row.is_set_aside { "aside" } else { "plain" })
}

/// States in which a component can be declared faulty.
const NOT_FAULTY: &str = "normal unverified tentative unconfirmed explained unknown";
/// Of orders that are possible in any state.
const ALWAYS: &str = "";

impl OrderForm<'_> {
    /// A form for an order that is possible in any of these states. In others it is hidden.
    fn form(
        &self,
        person: &Person,
        (kind, states): (&str, &str),
        words: &str,
        fields: &Markup,
    ) -> Markup {
        let is_possible = states == ALWAYS
            || states.split(' ').any(|state| self.present.split(' ').any(|now| now == state));
        html! {
            form method="post" action={ "/order/" (kind) } data-for=[(states != ALWAYS).then_some(states)]
                hidden[!is_possible] {
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
        label.check { input type="checkbox" name="force" value="true"; "force: although it has not gone" }
        label.check { input type="checkbox" name="re_tare" value="true"; "replaced: re-tare its reference" }
    }
}

fn aside_fields() -> Markup {
    html! {
        label { "For" input type="text" name="for" value="2h" size="6" required; }
        (note("Reason", true))
    }
}
