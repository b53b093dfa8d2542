//! Draws the structure with the states of its components.

use figure::structure::{SignLook, StructurePlan};
use maud::{Markup, PreEscaped, html};
use observer::{StateRow, title};
use truss::Structure;
use vocabulary::{ComponentPath, StructureName};

use crate::look;
use crate::view::LinkedScene;

/// The layout of a structure.
#[derive(Debug)]
pub(crate) struct LinkedDrawing {
    structure: Structure,
    plan: StructurePlan,
}

impl LinkedDrawing {
    pub(crate) fn of(structure: &Structure) -> Self {
        Self { structure: structure.clone(), plan: StructurePlan::of(structure) }
    }

    /// Whether the drawing shows this structure.
    pub(crate) fn is_of(&self, structure: &StructureName) -> bool {
        self.structure.name == *structure
    }

    /// The drawing; only the signs change over time.
    pub(crate) fn markup(&self, view: &LinkedScene<'_>) -> Markup {
        let name = &self.structure.name;
        html! {
            svg.drawing viewBox=(self.plan.view_box()) role="group" aria-label={ "Drawing of " (name) } {
                g.ground aria-hidden="true" { (PreEscaped(self.plan.ground())) }
                g #signs { (self.signs(view)) }
            }
        }
    }

    /// An enlarged drawing of the component's surroundings, and a description of its location. Empty if the drawing does not
    /// show the component.
    pub(crate) fn place(
        &self,
        view: &LinkedScene<'_>,
        structure: Option<&StructureName>,
        component: &ComponentPath,
    ) -> Markup {
        let is_drawn = structure.is_some_and(|name| self.is_of(name));
        let around = self.plan.view_box_around(component).filter(|_| is_drawn);
        let words = self.structure.place_of(component).filter(|_| is_drawn);
        html! {
            @if let Some(around) = around {
                svg.near viewBox=(around) role="img" aria-label={ "Where " (component) " is" } {
                    g.ground aria-hidden="true" { (PreEscaped(self.plan.ground())) }
                    g aria-hidden="true" inert { (self.signs(view)) }
                }
            }
            @if let Some(words) = words { p.where { (words.to_string()) } }
        }
    }

    /// A sign with a link for each component, in its present state.
    pub(crate) fn signs(&self, view: &LinkedScene<'_>) -> Markup {
        PreEscaped(self.plan.signs(|component| self.sign(view, component)))
    }

    fn sign(&self, view: &LinkedScene<'_>, component: &ComponentPath) -> SignLook {
        let href = view.component(Some(&self.structure.name), component);
        match view.scene.component(Some(&self.structure.name), component) {
            // No module diagnoses the component, or no state has arrived yet.
            None => SignLook {
                class: "absent".to_owned(),
                badge: String::new(),
                title: format!("{component}: nothing is known of it"),
                href,
            },
            Some(state) => {
                let row = StateRow::of_component(state);
                // Normal states are drawn without emphasis.
                let is_quiet = matches!(row.sign, "normal" | "unverified");
                SignLook {
                    class: look::classes(&row),
                    badge: if is_quiet { String::new() } else { format!("sign-{}", row.sign) },
                    title: title(state),
                    href,
                }
            }
        }
    }
}
