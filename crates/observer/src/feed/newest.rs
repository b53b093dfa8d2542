//! The newest of what is published and given in answer to questions: each once.

use std::collections::BTreeMap;

use vocabulary::{ComponentPath, Identification, PhaseChange, StructureName};

use super::continuity::Whose;

/// Components and modules that are remembered.
const REMEMBERED: usize = 16_384;

/// How something came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Came {
    /// It was published: it is news unless it is the same again.
    Published,
    /// In answer to a question: it may have been overtaken, or differ from what was published in nothing that matters.
    Answered,
}

/// What was handed out last.
#[derive(Debug, Default)]
pub(super) struct Newest {
    identifications: BTreeMap<(StructureName, ComponentPath), Identification>,
    phases: BTreeMap<Whose, PhaseChange>,
}

impl Newest {
    /// Is it to be handed out?
    pub(super) fn identification(&mut self, found: &Identification, came: Came) -> bool {
        let whose = (found.structure.clone(), found.component.clone());
        let is_news = |before: &Identification| match came {
            Came::Published => before != found,
            Came::Answered => {
                found.time_unix_ns > before.time_unix_ns && essence(before) != essence(found)
            }
        };
        replace(&mut self.identifications, whose, found, is_news)
    }

    /// Is it to be handed out?
    pub(super) fn phase(&mut self, change: &PhaseChange, came: Came) -> bool {
        let PhaseChange { structure, module, .. } = change;
        let whose = Whose { structure: structure.clone(), module: module.clone() };
        let is_news = |before: &PhaseChange| match came {
            Came::Published => before != change,
            Came::Answered => change.time_unix_ns > before.time_unix_ns,
        };
        replace(&mut self.phases, whose, change, is_news)
    }
}

/// Which fault it is, and of which kind. The size is in the answer to each question a little different.
fn essence(found: &Identification) -> (u64, bool, Option<&str>) {
    let likeliest = found.candidates.first();
    (found.sequence, found.decided, likeliest.map(|candidate| candidate.kind.as_str()))
}

fn replace<K: Ord, V: Clone>(
    known: &mut BTreeMap<K, V>,
    key: K,
    value: &V,
    is_news: impl FnOnce(&V) -> bool,
) -> bool {
    let is_news = known.get(&key).is_none_or(is_news);
    if is_news {
        if known.len() >= REMEMBERED {
            known.clear();
        }
        known.insert(key, value.clone());
    }
    is_news
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{Candidate, ModulePhase, RunId, Step, fault::FaultKind};

    fn phase(time_unix_ns: u64) -> PhaseChange {
        PhaseChange {
            structure: "tower".parse().unwrap(),
            module: "m1".parse().unwrap(),
            phase: ModulePhase::InService,
            before: None,
            run: None,
            step: None,
            reason: String::new(),
            time_unix_ns,
        }
    }

    fn identification(kind: FaultKind, time_unix_ns: u64) -> Identification {
        Identification {
            structure: "tower".parse().unwrap(),
            module: "m1".parse().unwrap(),
            component: "m1/sensor/g1".parse().unwrap(),
            run: RunId(1),
            sequence: 2,
            as_of_step: Step(time_unix_ns),
            decided: true,
            candidates: vec![Candidate { kind, probability: 1.0, size: None }],
            signature: None,
            time_unix_ns,
        }
    }

    #[test]
    fn what_was_published_is_news_unless_it_is_the_same_again_and_an_answer_only_if_it_is_later() {
        let mut newest = Newest::default();
        let mut at = |time, came| newest.phase(&phase(time), came);
        assert!(at(5, Came::Answered) && !at(5, Came::Published));
        assert!(at(7, Came::Published) && !at(6, Came::Answered));
        assert!(at(4, Came::Published), "a clock was set back");
    }

    #[test]
    fn an_answer_about_the_same_kind_of_the_same_fault_is_no_news() {
        let mut newest = Newest::default();
        let mut is_news =
            |kind, time, came| newest.identification(&identification(kind, time), came);
        assert!(is_news(FaultKind::Bias, 5, Came::Answered));
        assert!(
            !is_news(FaultKind::Bias, 15, Came::Answered)
                && is_news(FaultKind::Bias, 25, Came::Published)
        );
        assert!(is_news(FaultKind::Drift, 35, Came::Answered));
    }
}
