//! Which values are displaced: the smallest set without which the others agree with their Gaussian.
//!
//! There is evidence of a value if z' exceeds the threshold, or z by far: several large displacements make each
//! other's z' small. Sets are grown one by one, the likeliest of each size; among sets of one size in which no evidence
//! is left the likeliest counts. What is nearly as likely in place of a member is named with it.

use super::gaussian::{GaussianComparison, ValueDeparture};

/// Most values that may be displaced in a commissioned module.
const LARGEST_SET: usize = 3;
/// Sets of each size that are grown further.
const GROWN: usize = 16;
/// z against the threshold from which on it is evidence by itself.
const BY_FAR: f64 = 2.6;
/// What is less likely by no more than this may be meant just as well (twice the logarithm of the likelihood).
const AS_LIKELY: f64 = 12.0;

/// What counts as evidence of a displacement, and how many values may be displaced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SetRule {
    /// z' above which there is evidence.
    pub(crate) threshold: f64,
    /// z above which there is evidence, whatever z' is.
    pub(crate) by_far: f64,
    /// The most values that may be displaced.
    pub(crate) largest: usize,
}

impl SetRule {
    /// The rule of a commissioned module.
    pub(crate) fn of(threshold: f64) -> Self {
        Self { threshold, by_far: BY_FAR * threshold, largest: LARGEST_SET }
    }
}

/// A displaced value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Displaced {
    /// Its place.
    pub(crate) place: usize,
    /// Its departure from what those say that are not displaced.
    pub(crate) departure: ValueDeparture,
    /// Other places that may be meant just as well, likeliest first.
    pub(crate) or: Vec<usize>,
}

/// Is there evidence that the value at this place is displaced?
pub(crate) fn is_evidence(departure: ValueDeparture, rule: SetRule) -> bool {
    departure.predicted > rule.threshold || departure.plain > rule.by_far
}

/// The largest evidence at any of these places, as a share of the threshold.
pub(crate) fn largest_evidence(
    comparison: &GaussianComparison,
    places: impl Iterator<Item = usize>,
    rule: SetRule,
) -> f64 {
    let shares = places.filter_map(|place| comparison.departure(place));
    shares.map(|departure| share(departure, rule).abs()).fold(0.0, f64::max)
}

/// The evidence as a share of the threshold, negative if the value is too small.
pub(crate) fn share(departure: ValueDeparture, rule: SetRule) -> f64 {
    let share = (departure.predicted / rule.threshold).max(departure.plain / rule.by_far);
    share.copysign(departure.size)
}

/// The smallest set of displaced values among the candidates; `None` if no set that is small enough explains it.
pub(crate) fn smallest(
    all: &GaussianComparison,
    candidates: &[usize],
    rule: SetRule,
) -> Option<Vec<Displaced>> {
    let is_clean = |rest: &GaussianComparison| {
        let departures = candidates.iter().filter_map(|place| rest.departure(*place));
        departures.into_iter().all(|departure| !is_evidence(departure, rule))
    };
    let mut sets = vec![(Vec::new(), all.clone())];
    for _ in 0..=rule.largest {
        if let Some((set, rest)) = sets.iter().find(|(_, rest)| is_clean(rest)) {
            return Some(
                set.iter().map(|place| describe(all, set, *place, rest, candidates)).collect(),
            );
        }
        sets = grown(&sets, candidates);
    }
    None
}

/// The likeliest sets with one member more, likeliest first.
fn grown(
    sets: &[(Vec<usize>, GaussianComparison)],
    candidates: &[usize],
) -> Vec<(Vec<usize>, GaussianComparison)> {
    let mut larger: Vec<(Vec<usize>, GaussianComparison)> = Vec::new();
    for (set, rest) in sets {
        for &place in candidates.iter().filter(|place| rest.considers(**place)) {
            let mut members = set.clone();
            members.push(place);
            members.sort_unstable();
            if !larger.iter().any(|(known, _)| *known == members) {
                larger.push((members, rest.without(place)));
            }
        }
    }
    larger.sort_by(|(_, a), (_, b)| a.distance().total_cmp(&b.distance()));
    larger.truncate(GROWN);
    larger
}

fn describe(
    all: &GaussianComparison,
    set: &[usize],
    place: usize,
    rest: &GaussianComparison,
    candidates: &[usize],
) -> Displaced {
    let others = set.iter().filter(|other| **other != place);
    let with_it = others.fold(all.clone(), |comparison, other| comparison.without(*other));
    let none = ValueDeparture { plain: 0.0, predicted: 0.0, size: 0.0 };
    let departure = with_it.departure(place).unwrap_or(none);
    let as_likely = |other: &usize| {
        let possible = !set.contains(other) && with_it.considers(*other);
        let less_likely = possible.then(|| with_it.without(*other).less_likely_than(rest))?;
        (less_likely <= AS_LIKELY).then_some((less_likely, *other))
    };
    let mut or: Vec<(f64, usize)> = candidates.iter().filter_map(as_likely).collect();
    or.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let or = or.into_iter().map(|(_, other)| other).collect();
    Displaced { place, departure, or }
}

#[cfg(test)]
mod tests {
    use super::super::gaussian::{Gaussian, SnippetValues};
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const THRESHOLD: f64 = 6.0;

    /// Eight values that follow three causes, with noise 1; the last two follow one cause alone, both alike.
    fn draw(generator: &mut ChaCha8Rng) -> [f64; 8] {
        let mut normal = || -> f64 { StandardNormal.sample(generator) };
        let causes = [100.0 * normal(), 100.0 * normal(), 100.0 * normal()];
        let mut values = [0.0; 8];
        for (place, value) in values.iter_mut().enumerate() {
            let angle = place as f64;
            let of_causes = match place {
                6 | 7 => causes[2],
                _ => causes[0] * angle.cos() + causes[1] * angle.sin(),
            };
            *value = of_causes + normal();
        }
        values
    }

    fn gaussian() -> Gaussian {
        let mut generator = ChaCha8Rng::seed_from_u64(3);
        let data: Vec<_> = (0..2000).map(|_| draw(&mut generator)).collect();
        let observations: Vec<_> = data
            .iter()
            .enumerate()
            .map(|(snippet, values)| SnippetValues { snippet, values })
            .collect();
        Gaussian::learn(&observations, &[0.0; 8])
    }

    fn found(displacements: &[(usize, f64)], seed: u64) -> Option<Vec<Displaced>> {
        let mut values = draw(&mut ChaCha8Rng::seed_from_u64(seed));
        for (place, size) in displacements {
            values[*place] += size;
        }
        let comparison = gaussian().compare(&values).unwrap();
        smallest(&comparison, &(0..8).collect::<Vec<_>>(), SetRule::of(THRESHOLD))
    }

    #[test]
    fn nothing_is_displaced_in_healthy_values() {
        for seed in 0..50 {
            assert_eq!(found(&[], seed), Some(Vec::new()));
        }
    }

    #[test]
    fn one_and_two_are_named_with_their_sizes() {
        for seed in 0..20 {
            let one = found(&[(2, -30.0)], seed).unwrap();
            assert_eq!(one.iter().map(|d| d.place).collect::<Vec<_>>(), [2]);
            assert!((one[0].departure.size + 30.0).abs() < 6.0 && one[0].or.is_empty(), "{one:?}");
            let two = found(&[(0, 40.0), (4, 60.0)], seed).unwrap();
            assert_eq!(two.iter().map(|d| d.place).collect::<Vec<_>>(), [0, 4]);
        }
    }

    #[test]
    fn two_that_cannot_be_told_apart_are_named_together() {
        let found = found(&[(6, 30.0)], 1).unwrap();
        assert_eq!(found.len(), 1);
        let mut places = vec![found[0].place];
        places.extend(&found[0].or);
        places.sort_unstable();
        assert_eq!(places, [6, 7]);
    }

    #[test]
    fn no_small_set_explains_what_is_off_everywhere() {
        let mut generator = ChaCha8Rng::seed_from_u64(9);
        let off: Vec<(usize, f64)> =
            (0..6).map(|place| (place, 200.0 * generator.random::<f64>() + 50.0)).collect();
        assert_eq!(found(&off, 1), None);
    }
}
