//! The identification of a component's present fault. It is discarded with the fault, and an identification of an
//! earlier fault is rejected, because it was computed from measurements before the reset.

use vocabulary::{Candidate, FaultSize, FaultState, FaultTransition, Identification};

/// The present fault of a component, if it has one, with its identification.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct IdentifiedFault {
    /// The sequence number of the component's latest transition.
    sequence: u64,
    /// The sequence number of the first transition that may have declared the fault; `None` without a fault.
    declared: Option<u64>,
    latest: Option<Identification>,
    published: Option<Identification>,
}

impl IdentifiedFault {
    /// Records a transition of the component; one older than the latest is ignored.
    pub fn enter(&mut self, transition: &FaultTransition) {
        if transition.sequence < self.sequence {
            return;
        }
        if !transition.state().is_fault() {
            *self = Self { sequence: transition.sequence, ..Self::default() };
            return;
        }
        self.sequence = transition.sequence;
        // An acknowledged or shelved fault was declared earlier, perhaps in a deleted part of the journal.
        let declared = match transition.state() {
            FaultState::Latched if !is_of_earlier_fault(transition) => transition.sequence,
            _ => 0,
        };
        let carried = transition.identification.as_ref();
        let declared = carried.map_or(declared, |carried| carried.sequence.min(declared));
        self.declared.get_or_insert(declared);
        if let Some(carried) = carried {
            self.recall((**carried).clone());
        }
    }

    /// Restores an identification that was published before.
    pub fn recall(&mut self, published: Identification) {
        if self.is_of_it(&published) {
            self.latest = Some(published.clone());
            self.published = Some(published);
        }
    }

    /// Records an identification. Returns it if it is to be published.
    pub fn find(&mut self, mut found: Identification) -> Option<Identification> {
        if !self.is_of_it(&found) {
            return None;
        }
        let before = self.latest.as_ref().filter(|before| is_same_kind(before, &found));
        let since = |before: &Identification| before.since_unix_ns.unwrap_or(before.time_unix_ns);
        found.since_unix_ns = before.map(since);
        let brief = found.clone().without_signature();
        self.latest = Some(found);
        is_material(self.published.as_ref(), &brief).then(|| {
            self.published = Some(brief.clone());
            brief
        })
    }

    /// The latest identification.
    pub fn latest(&self) -> Option<&Identification> {
        self.latest.as_ref()
    }

    /// The identification last published.
    pub fn published(&self) -> Option<&Identification> {
        self.published.as_ref()
    }

    fn is_of_it(&self, found: &Identification) -> bool {
        let known = self.latest.as_ref().map_or(0, |latest| latest.sequence);
        self.declared.is_some_and(|declared| found.sequence >= declared.max(known))
            && found.sequence <= self.sequence
    }
}

/// Whether this transition is only about the alarm of a fault declared earlier.
fn is_of_earlier_fault(transition: &FaultTransition) -> bool {
    transition.order.as_ref().is_some_and(|order| !order.kind.is_about_verdict())
}

/// A size is news if its interval shrinks below this share of the published one.
const NARROWER: f64 = 0.5;

/// Whether an identification differs enough from the published one to be published. Each one is another measurement of
/// the same fault, and most add nothing new.
fn is_material(published: Option<&Identification>, found: &Identification) -> bool {
    let Some(published) = published else { return true };
    !is_same_kind(published, found) || is_another_size(size(published), size(found))
}

/// Whether both are of the same fault, and of the same kind, or both undecided, or both without any candidate.
fn is_same_kind(one: &Identification, other: &Identification) -> bool {
    one.sequence == other.sequence
        && kind(one) == kind(other)
        && one.candidates.is_empty() == other.candidates.is_empty()
}

fn kind(identification: &Identification) -> Option<&str> {
    identification.kind().map(|candidate| candidate.kind.as_str())
}

/// The size is not relevant as long as the kind is undecided.
fn size(identification: &Identification) -> Option<&FaultSize> {
    identification.kind().and_then(|Candidate { size, .. }| size.as_ref())
}

fn is_another_size(published: Option<&FaultSize>, found: Option<&FaultSize>) -> bool {
    match (published, found) {
        (Some(published), Some(found)) => {
            let left = found.value < published.low || found.value > published.high;
            let width = |size: &FaultSize| size.high - size.low;
            left || width(found) < NARROWER * width(published)
        }
        (published, found) => published.is_some() != found.is_some(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{Candidate, RunId, Step};

    fn transition(sequence: u64, state: FaultState) -> FaultTransition {
        let component = "m1/sensor/g1".parse().unwrap();
        let untouched = FaultTransition::untouched("t".parse().unwrap(), component, 0);
        FaultTransition { sequence, verdict: vocabulary::Verdict::example(state), ..untouched }
    }

    fn identification(sequence: u64, as_of: u64) -> Identification {
        let transition = transition(sequence, FaultState::Latched);
        Identification {
            structure: transition.structure,
            module: transition.module,
            component: transition.component,
            run: RunId(1),
            sequence,
            as_of_step: Step(as_of),
            decided: true,
            candidates: vec![Candidate {
                kind: vocabulary::fault::FaultKind::Stuck.into(),
                probability: 1.0,
                size: None,
            }],
            signature: Some(vocabulary::Signature { unit: "m".into(), points: Vec::new() }),
            since_unix_ns: None,
            time_unix_ns: 0,
        }
    }

    fn after(transitions: &[(u64, FaultState)]) -> IdentifiedFault {
        let mut fault = IdentifiedFault::default();
        for (sequence, state) in transitions {
            fault.enter(&transition(*sequence, *state));
        }
        fault
    }

    #[test]
    fn the_first_finding_is_published_and_the_same_again_is_only_known() {
        let mut fault = after(&[(3, FaultState::Tentative), (4, FaultState::Latched)]);
        let published = fault.find(identification(4, 100)).unwrap();
        assert_eq!(published.signature, None);
        assert_eq!(fault.find(identification(4, 200)), None);
        let latest = fault.latest().unwrap();
        assert!(latest.as_of_step == Step(200) && latest.signature.is_some());
        assert_eq!(fault.published(), Some(&published));
    }

    #[test]
    fn a_kind_is_identified_when_it_was_first_found_whatever_its_size() {
        let found = |kinds: &[&str], time_unix_ns| {
            let size = FaultSize { value: 9.0, low: 8.0, high: 10.0, own_unit: false };
            let candidate = |kind: &&str| Candidate {
                kind: vocabulary::fault::FaultKind::named(kind).unwrap().into(),
                probability: 0.5,
                size: (time_unix_ns > 30).then_some(size),
            };
            let candidates = kinds.iter().map(candidate).collect();
            let decided = kinds.len() == 1;
            Identification { decided, candidates, time_unix_ns, ..identification(4, time_unix_ns) }
        };
        let mut fault = after(&[(4, FaultState::Latched)]);
        let mut since = |kinds: &[&str], time_unix_ns| {
            let is_published = fault.find(found(kinds, time_unix_ns)).is_some();
            (is_published, fault.latest().unwrap().since_unix_ns)
        };
        assert_eq!(since(&["bias", "drift"], 10), (true, None));
        assert_eq!(since(&["drift", "bias"], 11), (false, Some(10)));
        assert_eq!(since(&["bias"], 20), (true, None));
        assert_eq!(since(&["bias"], 30), (false, Some(20)));
        assert_eq!(since(&["bias"], 40), (true, Some(20)), "its size is new");
        assert_eq!(since(&["drift"], 50), (true, None));
        fault.enter(&transition(5, FaultState::Normal));
        fault.enter(&transition(6, FaultState::Latched));
        let another = Identification { sequence: 6, ..found(&["drift"], 60) };
        assert_eq!(fault.find(another).unwrap().since_unix_ns, None);
    }

    #[test]
    fn what_was_found_of_a_fault_that_is_reset_is_dropped() {
        let mut fault = after(&[(4, FaultState::Latched), (5, FaultState::Normal)]);
        assert_eq!(fault.find(identification(4, 100)), None);
        fault.enter(&transition(6, FaultState::Latched));
        assert_eq!(fault.find(identification(4, 100)), None, "the one before");
        assert_eq!(fault.latest(), None);
        assert!(fault.find(identification(6, 300)).is_some());
    }

    #[test]
    fn a_reset_ends_what_is_known_and_an_acknowledgement_does_not() {
        let mut fault = after(&[(4, FaultState::Latched)]);
        fault.find(identification(4, 100));
        fault.enter(&transition(5, FaultState::Acknowledged));
        assert_eq!(fault.latest().unwrap().sequence, 4);
        assert_eq!(fault.find(identification(4, 200)), None, "no news");
        fault.enter(&transition(3, FaultState::Normal));
        assert!(fault.latest().is_some(), "an earlier transition changes nothing");
        fault.enter(&transition(6, FaultState::Normal));
        assert_eq!((fault.latest(), fault.published()), (None, None));
    }

    #[test]
    fn a_fault_of_which_only_the_acknowledgement_is_left_is_recalled() {
        let mut fault = after(&[(9, FaultState::Acknowledged)]);
        fault.recall(identification(4, 100));
        assert_eq!(fault.published().unwrap().sequence, 4);
        assert_eq!(fault.find(identification(4, 200)), None, "known from before");
        let mut fault = after(&[(9, FaultState::Latched)]);
        fault.recall(identification(4, 100));
        assert_eq!(fault.published(), None, "of a fault before this one");
    }

    #[test]
    fn a_fault_of_which_only_the_shelving_is_left_is_recalled() {
        let order = vocabulary::GivenOrder {
            kind: vocabulary::GivenOrderKind::Shelve(vocabulary::Span {
                since_unix_ns: 1,
                until_unix_ns: 2,
            }),
            by: "ada".to_owned(),
            on_behalf_of: None,
            note: None,
        };
        let shelved = FaultTransition { order: Some(order), ..transition(9, FaultState::Latched) };
        let mut fault = IdentifiedFault::default();
        fault.enter(&shelved);
        fault.recall(identification(4, 100));
        assert_eq!(fault.published().unwrap().sequence, 4);
        let mut fault = after(&[(4, FaultState::Latched)]);
        fault.find(identification(4, 100));
        fault.enter(&shelved);
        assert_eq!(fault.latest().unwrap().sequence, 4, "it goes on");
    }

    #[test]
    fn what_a_transition_carries_is_recalled() {
        let carried = identification(4, 100).without_signature();
        for state in [FaultState::Latched, FaultState::Acknowledged] {
            let identification = Some(Box::new(carried.clone()));
            let mut fault = IdentifiedFault::default();
            fault.enter(&FaultTransition { identification, ..transition(9, state) });
            assert_eq!(fault.published(), Some(&carried), "{state}");
        }
    }

    mod materiality {
        use super::*;

        fn identification(decided: bool, kinds: &[&str], size: Option<[f64; 3]>) -> Identification {
            let size =
                size.map(|[low, value, high]| FaultSize { value, low, high, own_unit: false });
            let candidate = |kind: &&str| Candidate {
                kind: vocabulary::fault::FaultKind::named(kind).unwrap().into(),
                probability: 0.5,
                size,
            };
            Identification {
                structure: "t".parse().unwrap(),
                module: "m1".parse().unwrap(),
                component: "m1/sensor/g1".parse().unwrap(),
                run: RunId(1),
                sequence: 4,
                as_of_step: Step(9),
                decided,
                candidates: kinds.iter().map(candidate).collect(),
                signature: None,
                since_unix_ns: None,
                time_unix_ns: 5,
            }
        }

        fn bias(low: f64, value: f64, high: f64) -> Identification {
            identification(true, &["bias"], Some([low, value, high]))
        }

        fn undecided() -> Identification {
            identification(false, &["bias", "drift"], None)
        }

        #[test]
        fn the_first_word_is_news_even_if_it_is_that_nothing_fits() {
            for first in [bias(1.0, 2.0, 3.0), undecided(), identification(false, &[], None)] {
                assert!(is_material(None, &first));
            }
        }

        #[test]
        fn the_same_again_is_no_news() {
            for same in [bias(1.0, 2.0, 3.0), undecided(), identification(false, &[], None)] {
                let later =
                    Identification { as_of_step: Step(99), time_unix_ns: 6, ..same.clone() };
                assert!(!is_material(Some(&same), &later), "{same:?}");
            }
        }

        #[test]
        fn another_kind_is_news_and_so_is_that_it_is_decided_or_no_longer() {
            let drift = identification(true, &["drift"], Some([1.0, 2.0, 3.0]));
            let nothing = identification(false, &[], None);
            let all = [bias(1.0, 2.0, 3.0), drift, undecided(), nothing];
            for (place, before) in all.iter().enumerate() {
                for (other, now) in all.iter().enumerate() {
                    assert_eq!(
                        is_material(Some(before), now),
                        place != other,
                        "{before:?} {now:?}"
                    );
                }
            }
        }

        #[test]
        fn an_order_of_contenders_that_changes_is_no_news() {
            let changed = identification(false, &["drift", "bias", "gain"], None);
            assert!(!is_material(Some(&undecided()), &changed));
        }

        #[test]
        fn a_size_is_news_when_it_leaves_the_published_interval_or_is_known_twice_as_well() {
            let published = bias(1.0, 2.0, 3.0);
            for (found, expected) in [
                (bias(1.1, 2.1, 3.1), false),
                (bias(2.0, 3.0, 4.0), false),
                (bias(2.1, 3.1, 4.1), true),
                (bias(-0.1, 0.9, 1.9), true),
                (bias(1.5, 2.0, 2.5), false),
                (bias(1.51, 2.0, 2.49), true),
                (bias(0.0, 2.0, 4.0), false),
                (identification(true, &["bias"], None), true),
            ] {
                assert_eq!(is_material(Some(&published), &found), expected, "{found:?}");
            }
            let unsized_ = identification(true, &["bias"], None);
            assert!(is_material(Some(&unsized_), &published));
        }

        #[test]
        fn the_size_of_an_undecided_kind_is_no_news() {
            let sized = |value| identification(false, &["bias"], Some([value, value, value]));
            assert!(!is_material(Some(&sized(1.0)), &sized(9.0)));
        }

        #[test]
        fn another_fault_of_the_same_component_is_news() {
            let before = bias(1.0, 2.0, 3.0);
            let next = Identification { sequence: 7, ..before.clone() };
            assert!(is_material(Some(&before), &next));
        }
    }
}
