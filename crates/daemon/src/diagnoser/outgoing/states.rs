//! The present state of each component, for queries on `{module}/fault/**`.

use shell::clock;
use vocabulary::{Component, FaultTransition, Topic};
use zenoh::key_expr::KeyExpr;

use crate::diagnoser::conditions::Conditions;
use crate::diagnoser::service::Service;
use diagnosis::messages::Speaker;

/// The latest transition of each component, in the order of the channels.
#[derive(Debug)]
pub(crate) struct States {
    speaker: Speaker,
    pages: Vec<Page>,
    service: Service,
    conditions: Conditions,
}

#[derive(Debug)]
struct Page {
    component: Component,
    key: String,
    latest: Option<FaultTransition>,
}

impl States {
    pub(crate) fn new(
        speaker: &Speaker,
        components: &[Component],
        service: Service,
        conditions: Conditions,
    ) -> Self {
        let page = |component: &Component| Page {
            component: component.clone(),
            key: speaker.key(Topic::Fault(component.clone())),
            latest: None,
        };
        let pages = components.iter().map(page).collect();
        Self { speaker: speaker.clone(), pages, service, conditions }
    }

    pub(crate) fn components(&self) -> impl Iterator<Item = &Component> {
        self.pages.iter().map(|page| &page.component)
    }

    /// Takes a transition, unless a later one was taken before it.
    pub(crate) fn enter(&mut self, transition: &FaultTransition) {
        let component = &transition.component.component;
        let page = self.pages.iter_mut().find(|page| page.component == *component);
        let is_later = |known: &FaultTransition| known.sequence > transition.sequence;
        if let Some(page) = page.filter(|page| !page.latest.as_ref().is_some_and(is_later)) {
            page.latest = Some(transition.clone());
        }
    }

    /// The states of those components whose key the expression asked for covers; what is not monitored at
    /// present is not normal.
    pub(crate) fn covered_by(&self, expression: &KeyExpr<'_>) -> Vec<(&str, FaultTransition)> {
        let covered = self.pages.iter().enumerate().filter(|(_, page)| {
            KeyExpr::try_from(page.key.as_str()).is_ok_and(|key| expression.intersects(&key))
        });
        let unknown = self.service.unknown();
        let state = |channel: usize, page: &Page| {
            let state = match &page.latest {
                Some(transition) => transition.clone(),
                None => self.speaker.untouched(&page.component, clock::unix_ns()),
            };
            match &unknown {
                Some(unknown) => state.while_unknown(unknown.clone()),
                None => self.conditions.enter(channel, state),
            }
        };
        covered.map(|(channel, page)| (page.key.as_str(), state(channel, page))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shell::supervision::Supervisor;
    use vocabulary::Condition;
    use vocabulary::{FaultState, ModulePhase};

    fn service() -> Service {
        let supervisor = Supervisor::from_environment();
        supervisor.progress();
        Service::new(supervisor.pulse(), "no sample has come yet".to_owned())
    }

    fn book_of(service: Service) -> States {
        let speaker = Speaker::of("tower".parse().unwrap(), "module1".parse().unwrap());
        let names = ["actuator/a1", "sensor/a1", "sensor/g2"];
        let components: Vec<Component> = names.iter().map(|name| name.parse().unwrap()).collect();
        let conditions = [Condition::NotVerified, Condition::NotVerified, Condition::NotVerified];
        let conditions = Conditions::new(conditions.iter());
        let mut book = States::new(&speaker, &components, service, conditions);
        let mut latched = speaker.untouched(&components[2], 9);
        latched.verdict = vocabulary::Verdict::Latched;
        latched.sequence = 3;
        book.enter(&latched);
        book
    }

    fn book() -> States {
        let service = service();
        service.enter(ModulePhase::InService, "every channel is watched".to_owned());
        book_of(service)
    }

    fn asked(expression: &str) -> Vec<(String, u64)> {
        let book = book();
        let expression = KeyExpr::try_from(expression).unwrap();
        let states = book.covered_by(&expression).into_iter();
        states.map(|(key, state)| (key.to_owned(), state.sequence)).collect()
    }

    #[test]
    fn every_component_has_a_state_even_one_that_never_changed() {
        let sequences: Vec<u64> =
            asked("trusswatch/*/*/fault/**").into_iter().map(|(_, sequence)| sequence).collect();
        assert_eq!(sequences, [0, 0, 3]);
    }

    #[test]
    fn what_is_not_monitored_is_unknown_and_a_fault_stays_one() {
        let service = service();
        let book = book_of(service.clone());
        let states = || -> Vec<FaultState> {
            let expression = KeyExpr::try_from("trusswatch/*/*/fault/**").unwrap();
            book.covered_by(&expression).into_iter().map(|(_, state)| state.state()).collect()
        };
        assert_eq!(states(), [FaultState::Unknown, FaultState::Unknown, FaultState::Latched]);
        service.enter(ModulePhase::InService, String::new());
        assert_eq!(states(), [FaultState::Normal, FaultState::Normal, FaultState::Latched]);
    }

    #[test]
    fn only_what_is_asked_for_is_answered() {
        let one = [("trusswatch/tower/module1/fault/sensor/g2".to_owned(), 3)];
        assert_eq!(asked("trusswatch/tower/module1/fault/sensor/g2"), one);
        assert_eq!(asked("trusswatch/tower/module1/fault/sensor/*").len(), 2);
        assert_eq!(asked("trusswatch/tower/module2/fault/**").len(), 0);
    }
}
