//! Cross-validation: how far healthy values are from what snippets say that they are not in.

use std::collections::BTreeMap;

use super::gaussian::{Gaussian, Observation};

/// Folds, over snippets.
const FOLDS: usize = 8;

/// How snippets that are left out are compared with what the others say.
pub(super) struct LeftOut<'a> {
    /// The least deviation of each value.
    pub(super) least: &'a [f64],
    /// Whose departures count.
    pub(super) candidates: &'a [usize],
    /// Which values are known.
    pub(super) there: &'a [bool],
    /// Windows in which one of these values is beyond what the others have seen do not count: nor are they compared in
    /// service.
    pub(super) forces: &'a [usize],
}

impl LeftOut<'_> {
    /// The largest z' of each snippet.
    pub(super) fn largest(&self, observations: &[Observation<'_>]) -> BTreeMap<usize, f64> {
        (0..FOLDS).flat_map(|fold| self.largest_in(fold, observations)).collect()
    }

    fn largest_in(&self, fold: usize, observations: &[Observation<'_>]) -> BTreeMap<usize, f64> {
        let is_out = |one: &&Observation| one.snippet % FOLDS == fold;
        let rest: Vec<_> = observations.iter().filter(|one| !is_out(one)).copied().collect();
        let gaussian = Gaussian::learn(&rest, self.least);
        let range = |&place: &usize| {
            let values = rest.iter().map(|one| one.values[place]);
            let least = values.clone().fold(f64::MAX, f64::min);
            (place, least..=values.fold(f64::MIN, f64::max))
        };
        let seen: Vec<_> = self.forces.iter().map(range).collect();
        let is_seen = |one: &&Observation| {
            seen.iter().all(|(place, range)| range.contains(&one.values[*place]))
        };
        let mut largest = BTreeMap::new();
        for one in observations.iter().filter(is_out).filter(is_seen) {
            let known = one.values.iter().zip(self.there);
            let known: Vec<f64> =
                known.map(|(value, there)| if *there { *value } else { f64::NAN }).collect();
            let Some(comparison) = gaussian.compare(&known) else { continue };
            let departures = self.candidates.iter().filter_map(|k| comparison.departure(*k));
            let most = departures.map(|departure| departure.predicted).fold(0.0, f64::max);
            let of_snippet: &mut f64 = largest.entry(one.snippet).or_default();
            *of_snippet = of_snippet.max(most);
        }
        largest
    }
}
