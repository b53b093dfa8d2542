//! Whether a finding differs enough from the one published before to be news: each is one more measurement of the same
//! fault, and most of them say what is known.

use vocabulary::{Candidate, FaultSize, Identification};

/// The interval must have shrunk to less than this share of the published one.
const NARROWER: f64 = 0.5;

/// Is this news to who knows what was published?
pub(super) fn is_material(published: Option<&Identification>, found: &Identification) -> bool {
    let Some(published) = published else { return true };
    published.sequence != found.sequence
        || kind(published) != kind(found)
        || published.candidates.is_empty() != found.candidates.is_empty()
        || is_another_size(size(published), size(found))
}

fn kind(identification: &Identification) -> Option<&str> {
    identification.kind().map(|candidate| candidate.kind.as_str())
}

/// As long as the kind is not decided, no size is one that anybody relies on.
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
    use vocabulary::{RunId, Step, fault::FaultKind};

    fn identification(decided: bool, kinds: &[&str], size: Option<[f64; 3]>) -> Identification {
        let size = size.map(|[low, value, high]| FaultSize { value, low, high, unit: "m".into() });
        let candidate = |kind: &&str| Candidate {
            kind: FaultKind::ALL.into_iter().find(|known| known.as_str() == *kind).unwrap(),
            probability: 0.5,
            size: size.clone(),
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
            let later = Identification { as_of_step: Step(99), time_unix_ns: 6, ..same.clone() };
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
                assert_eq!(is_material(Some(before), now), place != other, "{before:?} {now:?}");
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
