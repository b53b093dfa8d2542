//! The parts of a component's page that change.

use maud::{Markup, PreEscaped, html};
use vocabulary::FaultTransition;

use super::evidence::ModuleAnswers;
use super::{facts, plot, trail};
use crate::history;
use crate::observed::Traces;
use crate::part::{PagePart, part};
use crate::view::LinkedScene;

/// The parts of a component's page that change.
pub(super) struct Shown<'a> {
    pub(super) view: &'a LinkedScene<'a>,
    pub(super) transition: &'a FaultTransition,
    pub(super) evidence: &'a ModuleAnswers,
    pub(super) traces: &'a Traces,
}

impl Shown<'_> {
    pub(super) fn parts(&self) -> Vec<PagePart> {
        vec![
            part("facts", facts::facts(self.view, self.transition)),
            part("trail", trail::trail(self.view, self.transition, self.evidence)),
            part("frame", self.frame()),
            part("plot", plot::plot(self.transition, self.traces)),
            part("journal", self.journal()),
        ]
    }

    fn frame(&self) -> Markup {
        match &self.evidence.frame {
            None => html! { p.nothing { "No freeze frame: the component has no fault." } },
            Some(Err(why)) => html! { p.nothing { "No freeze frame: " (why) "." } },
            Some(Ok(drawing)) => html! { div.plot { (PreEscaped(drawing)) } },
        }
    }

    fn journal(&self) -> Markup {
        let Some(journal) = self.evidence.journal(&self.transition.module) else {
            return html! { p.nothing { "Not read yet." } };
        };
        history::of_component(self.view, journal, &self.transition.component)
    }
}
