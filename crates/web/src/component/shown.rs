//! The parts of a component's page that change.

use maud::{Markup, PreEscaped, html};
use observer::why_no_fault;
use vocabulary::{FaultTransition, Margins};

use super::evidence::ModuleAnswers;
use super::{facts, margins, plot, trail};
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
            part("summary", facts::verdict(self.view, self.transition)),
            part("facts", facts::facts(self.transition)),
            part("trail", trail::trail(self.view, self.transition, self.evidence)),
            part("frame", self.frame()),
            part("margins", self.margins()),
            part("plot", plot::plot(self.transition, self.traces)),
            part("journal", self.journal()),
        ]
    }

    fn margins(&self) -> Markup {
        let FaultTransition { structure, module, component, .. } = self.transition;
        let module = self.view.scene.module(Some(structure), module);
        let heard = module.filter(|module| !module.is_silent);
        let status = heard.and_then(|module| module.status.as_ref());
        let own = |margins: &&Margins| margins.component == component.component;
        let now = status.and_then(|status| status.margins.iter().find(own));
        margins::trends(self.transition, now, self.evidence.trends.as_deref())
    }

    fn frame(&self) -> Markup {
        match &self.evidence.frame {
            None => html! { p.nothing { "No freeze frame: " (why_no_fault(self.transition)) "." } },
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{component, module, scene, silent};
    use std::sync::Arc;
    use vocabulary::{Channel, Divergences, FaultState, RunId, Step};

    fn html(module: observer::ModuleView, traces: &Traces, is_read: bool) -> String {
        let scene = scene(vec![module]);
        let transition = &scene.modules[0].components[0];
        let (structure, module) = (&transition.structure, &transition.module);
        let mut journal = observer::ModuleHistory::new(structure, module, 1);
        journal.next_sequence = is_read.then_some(1);
        let evidence =
            ModuleAnswers { journals: vec![Arc::new(journal)], frame: None, trends: None };
        let view = LinkedScene::new(&scene);
        let parts = Shown { view: &view, transition, evidence: &evidence, traces }.parts();
        parts.into_iter().map(|part| part.html).collect()
    }

    #[test]
    fn of_a_silent_module_nothing_is_claimed_that_is_not_known() {
        let heard = || module("m1", vec![component("m1/sensor/g1", FaultState::Normal)]);
        let claims = [
            "<dt>reference</dt><dd>agrees",
            "no fault is declared",
            "It explains no other change, and none explains it.",
        ];
        let page = html(heard(), &Traces::new(), true);
        assert!(claims.iter().all(|claim| page.contains(claim)), "{page}");
        let page = html(silent(heard()), &Traces::new(), false);
        assert!(!claims.iter().any(|claim| page.contains(claim)), "{page}");
        for known in [
            "<dt>reference</dt><dd>not known",
            "whether it has a fault is not known",
            "No explanation is known; not read: the journal of m1.",
        ] {
            assert!(page.contains(known), "{known}: {page}");
        }
    }

    #[test]
    fn plots_say_which_span_they_show() {
        let heard = module("m1", vec![component("m1/sensor/g1", FaultState::Normal)]);
        let of = |second: u64| {
            let channel = Channel {
                component: "sensor/g1".parse().unwrap(),
                residual: 1e-6,
                divergence: Some(0.1),
                threshold: 1.0,
                own_unit: false,
            };
            Arc::new(Divergences {
                structure: "tower".parse().unwrap(),
                module: "m1".parse().unwrap(),
                run: RunId(1),
                step: Step(1000 * second),
                time_unix_ns: second * 1_000_000_000,
                channels: vec![channel],
            })
        };
        let traces = [7, 8, 9].into_iter().map(of).collect();
        let page = html(heard, &traces, true);
        assert!(page.contains("2.0 s up to step 9000, 1970-01-01T00:00:09.000Z"), "{page}");
    }
}
