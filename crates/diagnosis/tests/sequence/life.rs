//! What may become of the verdict on a component, over all its transitions.

use std::collections::BTreeMap;

use diagnosis::{GivenOrderKind, Transition, Verdict};
use vocabulary::{Component, ComponentPath};

use crate::fixture::name;

/// The latest transition of every component, and the number of the latest of all.
#[derive(Debug, Default)]
pub struct Lives {
    latest: BTreeMap<Component, Transition>,
    sequence: u64,
}

impl Lives {
    /// Takes note of a transition, which must be allowed.
    pub fn note(&mut self, transition: &Transition) {
        assert_eq!(transition.sequence, self.sequence + 1, "contiguous");
        assert!(transition.onset <= transition.detection, "{transition:?}");
        check_explanation(transition);
        check_order(transition);
        let before = self.verdict(&transition.component);
        if is_about_verdict(transition) {
            check_step(&before, transition);
        } else {
            assert_eq!(transition.verdict, before, "{transition:?}");
        }
        self.check_aside(transition);
        self.sequence = transition.sequence;
        self.latest.insert(transition.component.clone(), transition.clone());
    }

    /// Whether it is set aside changes by orders about that and by nothing else.
    fn check_aside(&self, transition: &Transition) {
        let latest = self.latest.get(&transition.component);
        let aside = |one: &Transition| (one.shelved.clone(), one.suppressed.clone());
        let before = latest.map(aside).unwrap_or_default();
        if is_about_verdict(transition) {
            assert_eq!(aside(transition), before, "{transition:?}");
        }
        let same_verdict = |before: &Transition| before.command() == transition.command();
        if !is_about_verdict(transition) {
            assert!(latest.is_none_or(same_verdict), "{transition:?}");
        }
    }

    /// The present verdict on a component.
    pub fn verdict(&self, component: &Component) -> Verdict {
        self.latest.get(component).map_or(Verdict::Normal, |latest| latest.verdict.clone())
    }

    /// The latest transition of each component that had one.
    pub fn latest(&self) -> impl Iterator<Item = &Transition> {
        self.latest.values()
    }

    /// The number of the latest transition.
    pub fn sequence(&self) -> u64 {
        self.sequence
    }
}

/// Whether it is more than a change of what is set aside.
pub fn is_about_verdict(transition: &Transition) -> bool {
    transition.order.as_ref().is_none_or(|order| order.kind.is_about_verdict())
}

/// Whether it is about the alarm alone. A cylinder that is shut off cannot be reset, so that is more.
pub fn is_of_alarm(kind: GivenOrderKind) -> bool {
    use GivenOrderKind::{Lapse, Shelve, Suppress, Unshelve, Unsuppress};
    matches!(kind, Shelve(_) | Unshelve | Suppress(_) | Unsuppress | Lapse { .. })
}

/// Nothing explains itself.
fn check_explanation(transition: &Transition) {
    if let Verdict::Explained { by, since } = &transition.verdict {
        let component = transition.component.clone();
        assert_ne!(*by, ComponentPath { module: name("lower"), component }, "{transition:?}");
        assert!(*since <= transition.decided, "{transition:?}");
    }
}

/// Commands and nothing else lead to what only commands may lead to.
fn check_order(transition: &Transition) {
    let kind = transition.order.as_ref().map(|order| order.kind);
    match kind {
        Some(GivenOrderKind::Acknowledge) => assert_eq!(transition.verdict, Verdict::Acknowledged),
        Some(GivenOrderKind::Declare) => assert_eq!(transition.verdict, Verdict::Latched),
        Some(GivenOrderKind::Reset { .. } | GivenOrderKind::ReTare) => {
            assert_eq!(transition.verdict, Verdict::Normal);
        }
        Some(
            GivenOrderKind::Shelve(_)
            | GivenOrderKind::Unshelve
            | GivenOrderKind::Suppress(_)
            | GivenOrderKind::Unsuppress
            | GivenOrderKind::ShutOff { .. }
            | GivenOrderKind::PutBack
            | GivenOrderKind::Lapse { .. },
        ) => {}
        None => assert_ne!(transition.verdict, Verdict::Acknowledged),
    }
}

fn check_step(before: &Verdict, transition: &Transition) {
    let kind = transition.order.as_ref().map(|order| order.kind);
    let allowed = match before {
        Verdict::Latched => {
            matches!(
                kind,
                Some(GivenOrderKind::Acknowledge | GivenOrderKind::Reset { force: true })
            )
        }
        Verdict::Acknowledged => {
            matches!(kind, Some(GivenOrderKind::Reset { .. } | GivenOrderKind::ReTare))
        }
        _ if before.is_undecidable() => {
            matches!(kind, Some(GivenOrderKind::Reset { .. }))
                || transition.verdict == Verdict::Latched
        }
        _ => true,
    };
    assert!(allowed, "from {before:?} to {transition:?}");
}
