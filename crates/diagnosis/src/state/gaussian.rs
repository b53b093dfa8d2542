//! A Gaussian learnt from snippets of healthy data, and how far new values are from it.
//!
//! With x the values, μ and S the Gaussian's mean and covariance, P = S⁻¹ and v = P (x − μ), the distance is
//! Q = (x − μ)ᵀ v, and z_j² = v_j²/P_jj is twice what the logarithm of the likelihood gains if value j alone is
//! displaced. A Gaussian learnt from n snippets is not known exactly: its prediction has heavier tails, and
//! z'_j² = z_j²/(1 + 1/n + (Q − z_j²)/n) is the distance in its terms (Hotelling's statistic with n in place of the
//! degrees of freedom: windows of one snippet tell little more than one of them).

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Added to each variance, as a share of it: what the arithmetic can resolve.
const RIDGE: f64 = 1e-9;
/// Inverses that are kept: of all values, and without some of them.
const KEPT_INVERSES: usize = 8;
/// Snippets of a second in a year are no more.
const MOST_SNIPPETS: usize = 100_000_000;

/// A Gaussian of several values, each in units of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gaussian {
    /// How many snippets it was learnt from, n.
    pub snippets: usize,
    /// Mean of each value.
    pub mean: Vec<f64>,
    /// Standard deviation of each value.
    pub deviation: Vec<f64>,
    /// Correlation of each value with those before it.
    pub correlations: Vec<Vec<f64>>,
}

/// One window's values, and the snippet that it belongs to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SnippetValues<'a> {
    pub(crate) snippet: usize,
    pub(crate) values: &'a [f64],
}

impl Gaussian {
    /// Learns from observations of as many values as `least` says: the least deviation that each is taken for.
    pub(crate) fn learn(observations: &[SnippetValues<'_>], least: &[f64]) -> Self {
        let (count, size) = (observations.len().max(1) as f64, least.len());
        let mut snippets: Vec<usize> = observations.iter().map(|one| one.snippet).collect();
        snippets.sort_unstable();
        snippets.dedup();
        let mean_of =
            |place: usize| observations.iter().map(|one| one.values[place]).sum::<f64>() / count;
        let mean: Vec<f64> = (0..size).map(mean_of).collect();
        // Of each value with those up to itself; by observations, for these are in memory one after another.
        let mut products: Vec<Vec<f64>> = (0..size).map(|place| vec![0.0; place + 1]).collect();
        let mut off = vec![0.0; size];
        for one in observations {
            let values = one.values.iter().zip(&mean);
            off.iter_mut().zip(values).for_each(|(off, (value, mean))| *off = value - mean);
            for (own, row) in off.iter().zip(&mut products) {
                row.iter_mut().zip(&off).for_each(|(sum, other)| *sum += own * other);
            }
        }
        let covariance = |a: usize, b: usize| products[a][b] / count;
        let deviation: Vec<f64> =
            (0..size).map(|place| covariance(place, place).sqrt().max(least[place])).collect();
        let correlation = |a: usize, b: usize| covariance(a, b) / (deviation[a] * deviation[b]);
        let correlations = (0..size).map(|a| (0..a).map(|b| correlation(a, b)).collect()).collect();
        Self { snippets: snippets.len(), mean, deviation, correlations }
    }

    /// How such values move about the mean of their snippet.
    pub(crate) fn learn_moving(observations: &[SnippetValues<'_>], least: &[f64]) -> Self {
        let of_snippets = observations.chunk_by(|a, b| a.snippet == b.snippet);
        let about_mean = |windows: &[SnippetValues<'_>]| -> Vec<(usize, Vec<f64>)> {
            let count = windows.len() as f64;
            let mean_of = |k: usize| windows.iter().map(|one| one.values[k]).sum::<f64>() / count;
            let mean: Vec<f64> = (0..least.len()).map(mean_of).collect();
            let off = |one: &SnippetValues<'_>| {
                let off = one.values.iter().zip(&mean).map(|(value, mean)| value - mean);
                (one.snippet, off.collect())
            };
            windows.iter().map(off).collect()
        };
        let moving: Vec<(usize, Vec<f64>)> = of_snippets.flat_map(about_mean).collect();
        let moving =
            moving.iter().map(|(snippet, values)| SnippetValues { snippet: *snippet, values });
        Self::learn(&moving.collect::<Vec<_>>(), least)
    }

    /// Learns from single rows of one stretch of time.
    pub(crate) fn of_rows<'a>(rows: impl Iterator<Item = &'a [f64]>, least: &[f64]) -> Self {
        let observations: Vec<_> =
            rows.map(|values| SnippetValues { snippet: 0, values }).collect();
        Self::learn(&observations, least)
    }

    /// The Gaussian with this mean and covariance.
    pub(crate) fn of_covariance(
        snippets: usize,
        mean: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Self {
        let deviation: Vec<f64> = covariance.diagonal().iter().map(|v| v.sqrt()).collect();
        let correlation = |a: usize, b: usize| covariance[(a, b)] / (deviation[a] * deviation[b]);
        let rows = 0..mean.len();
        let correlations = rows.map(|a| (0..a).map(|b| correlation(a, b)).collect()).collect();
        Self { snippets, mean: mean.iter().copied().collect(), deviation, correlations }
    }

    /// Adds a share of another's covariance, of its values at these places.
    pub(crate) fn widen(&mut self, other: &Gaussian, places: &[usize], share: f64) {
        let size = self.mean.len();
        let sum = |a: usize, b: usize| {
            self.covariance(a, b) + share * other.covariance(places[a], places[b])
        };
        let deviation: Vec<f64> = (0..size).map(|k| sum(k, k).sqrt()).collect();
        let correlations = (0..size)
            .map(|a| (0..a).map(|b| sum(a, b) / (deviation[a] * deviation[b])).collect())
            .collect();
        self.deviation = deviation;
        self.correlations = correlations;
    }

    fn covariance(&self, a: usize, b: usize) -> f64 {
        let (low, high) = (a.min(b), a.max(b));
        let correlation = if low == high { 1.0 } else { self.correlations[high][low] };
        correlation * self.deviation[a] * self.deviation[b]
    }

    /// How one of these values follows from the others: by what each is multiplied in value − prediction, one for the value
    /// itself, and the standard deviation of that.
    pub(crate) fn regression(&self, places: &[usize], own: usize) -> Option<(Vec<f64>, f64)> {
        self.regression_on_noisy(places, own, |_| 0.0)
    }

    /// The same with so much variance added to each of the others, in its own unit: a ridge regression.
    pub(crate) fn regression_on_noisy(
        &self,
        places: &[usize],
        own: usize,
        variance: impl Fn(usize) -> f64,
    ) -> Option<(Vec<f64>, f64)> {
        let precision =
            self.precision_with(
                places,
                |place| {
                    if place == places[own] { 0.0 } else { variance(place) }
                },
            )?;
        let (weight, scale) = (precision[(own, own)], self.deviation[places[own]]);
        let weights = places.iter().enumerate();
        let weights =
            weights.map(|(k, place)| precision[(own, k)] / weight * scale / self.deviation[*place]);
        Some((weights.collect(), scale / weight.sqrt()))
    }

    /// Are the lengths those of so many values, and the figures such that it can be used?
    pub(crate) fn is_sound(&self, size: usize) -> bool {
        self.problem("", size).is_none()
    }

    /// What cannot be right of so many values, if the Gaussian has this name.
    pub(crate) fn problem(&self, name: &str, size: usize) -> Option<String> {
        let lengths = self.mean.len() == size
            && self.deviation.len() == size
            && self.correlations.len() == size
            && self.correlations.iter().enumerate().all(|(place, row)| row.len() == place);
        if !lengths {
            return Some(format!("`{name}` is not of {size} values; use as many in each list"));
        }
        if !(1..=MOST_SNIPPETS).contains(&self.snippets) {
            let snippets = self.snippets;
            return Some(format!("`{name}.snippets` is {snippets}; use 1 to {MOST_SNIPPETS}"));
        }
        let wrong = |key, values: &[f64], is_right: fn(f64) -> bool, expected| {
            let value = values.iter().find(|value| !is_right(**value))?;
            Some(format!("`{name}.{key}` is {value}; use {expected}"))
        };
        let correlations = self.correlations.concat();
        let is_correlation = |r: f64| r.abs() <= 1.0 + 1e-9;
        wrong("mean", &self.mean, f64::is_finite, "a finite number")
            .or_else(|| {
                let is_deviation = |d: f64| d.is_finite() && d > 0.0;
                wrong("deviation", &self.deviation, is_deviation, "a finite number above 0")
            })
            .or_else(|| wrong("correlations", &correlations, is_correlation, "-1 to 1"))
            .or_else(|| {
                let precision = self.precision(&(0..size).collect::<Vec<_>>());
                precision.is_none().then(|| format!("`{name}.correlations` contradict each other"))
            })
    }

    /// The standard deviation of a value given all others, as predicted from so few snippets.
    pub(crate) fn deviation_given_others(&self, place: usize) -> f64 {
        let places: Vec<usize> = (0..self.mean.len()).collect();
        let spread = (1.0 + 1.0 / self.snippets as f64).sqrt();
        self.regression(&places, place).map_or(f64::NAN, |(_, deviation)| spread * deviation)
    }

    /// How much each of these values must be displaced for its z' to reach a threshold, on average, if only they are
    /// known.
    pub(crate) fn smallest_displacements(&self, places: &[usize], threshold: f64) -> Vec<f64> {
        let Some(precision) = self.precision(places) else { return Vec::new() };
        // Of a healthy window Q is as large as there are values.
        let (n, others) = (self.snippets as f64, places.len() as f64 - 1.0);
        let spread = (1.0 + (1.0 + others) / n).sqrt();
        let displacement = |(k, place): (usize, &usize)| {
            threshold * spread * self.deviation[*place] / precision[(k, k)].sqrt()
        };
        places.iter().enumerate().map(displacement).collect()
    }

    /// Compares values with it; those that are not finite are left out. `None` if nothing is left, or no inverse.
    pub(crate) fn compare(&self, values: &[f64]) -> Option<GaussianComparison> {
        self.compare_with(values, &mut Inverses::default())
    }

    /// The same with the inverses of earlier comparisons with this Gaussian, among which windows with the same values
    /// present find theirs.
    pub(crate) fn compare_with(
        &self,
        values: &[f64],
        inverses: &mut Inverses,
    ) -> Option<GaussianComparison> {
        let is_present = |k: &usize| values[*k].is_finite();
        let present = || (0..values.len()).filter(is_present);
        let known = inverses.0.iter().position(|one| one.places.iter().copied().eq(present()));
        match known {
            Some(place) => inverses.0[..=place].rotate_right(1),
            None => {
                let places: Vec<usize> = present().collect();
                let precision = self.precision(&places)?;
                let scales = places.iter().map(|place| self.deviation[*place]).collect();
                inverses.0.insert(0, Arc::new(Inverse { places, scales, precision }));
                inverses.0.truncate(KEPT_INVERSES);
            }
        }
        let inverse = Arc::clone(&inverses.0[0]);
        let off = |(&place, scale): (&usize, &f64)| (values[place] - self.mean[place]) / scale;
        let off = inverse.places.iter().zip(&inverse.scales).map(off);
        let off = DVector::from_iterator(inverse.places.len(), off);
        let pull = &inverse.precision * &off;
        let distance = off.dot(&pull);
        Some(GaussianComparison { distance, snippets: self.snippets as f64, inverse, pull })
    }

    /// The inverse of the correlations of these values.
    fn precision(&self, places: &[usize]) -> Option<DMatrix<f64>> {
        self.precision_with(places, |_| 0.0)
    }

    /// The same with so much added to the variance of each value.
    fn precision_with(
        &self,
        places: &[usize],
        more: impl Fn(usize) -> f64,
    ) -> Option<DMatrix<f64>> {
        if places.is_empty() {
            return None;
        }
        let correlation = |row: usize, column: usize| {
            let (a, b) = (places[row].max(places[column]), places[row].min(places[column]));
            if a == b {
                1.0 + RIDGE + more(a) / self.deviation[a].powi(2)
            } else {
                self.correlations[a][b]
            }
        };
        let matrix = DMatrix::from_fn(places.len(), places.len(), correlation);
        matrix.cholesky().map(|factor| factor.inverse())
    }
}

/// Some values of a Gaussian without the others: what a comparison needs of them.
#[derive(Debug, Clone)]
struct Inverse {
    /// Ascending.
    places: Vec<usize>,
    /// Their deviations.
    scales: Vec<f64>,
    /// The inverse of their correlations.
    precision: DMatrix<f64>,
}

/// The inverses that the latest comparisons with one Gaussian needed, latest first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Inverses(Vec<Arc<Inverse>>);

/// How far values are from a Gaussian, some of them perhaps left out of consideration.
#[derive(Debug, Clone)]
pub(crate) struct GaussianComparison {
    /// Of the values that are there; those left out of consideration have a precision of 0.
    inverse: Arc<Inverse>,
    pull: DVector<f64>,
    distance: f64,
    snippets: f64,
}

/// How far one value is from what the others say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ValueDeparture {
    /// z.
    pub(crate) plain: f64,
    /// z'.
    pub(crate) predicted: f64,
    /// How much too large the value is, in its own unit.
    pub(crate) size: f64,
}

impl GaussianComparison {
    /// Q.
    pub(crate) fn distance(&self) -> f64 {
        self.distance
    }

    /// Is there a value at this place that is considered?
    pub(crate) fn considers(&self, place: usize) -> bool {
        self.position(place).is_some()
    }

    /// The value at a place against what the others that are considered say.
    pub(crate) fn departure(&self, place: usize) -> Option<ValueDeparture> {
        let k = self.position(place)?;
        let (pull, weight) = (self.pull[k], self.inverse.precision[(k, k)]);
        let square = pull * pull / weight;
        let others = (self.distance - square).max(0.0);
        let spread = 1.0 + 1.0 / self.snippets + others / self.snippets;
        Some(ValueDeparture {
            plain: square.sqrt(),
            predicted: (square / spread).sqrt(),
            size: self.inverse.scales[k] * pull / weight,
        })
    }

    /// The same without the value at a place.
    pub(crate) fn without(&self, place: usize) -> GaussianComparison {
        let mut rest = self.clone();
        let Some(k) = self.position(place) else { return rest };
        let precision = &mut Arc::make_mut(&mut rest.inverse).precision;
        let column = precision.column(k).clone_owned();
        let (weight, pull) = (column[k], self.pull[k]);
        precision.ger(-1.0 / weight, &column, &column, 1.0);
        precision.row_mut(k).fill(0.0);
        precision.column_mut(k).fill(0.0);
        rest.pull.axpy(-pull / weight, &column, 1.0);
        rest.distance = (self.distance - pull * pull / weight).max(0.0);
        rest.pull[k] = 0.0;
        rest
    }

    /// By how much twice the logarithm of the likelihood is smaller than with the values of `other`, in the terms of
    /// the prediction.
    pub(crate) fn less_likely_than(&self, other: &GaussianComparison) -> f64 {
        let n = self.snippets;
        n * ((n + self.distance) / (n + other.distance)).ln()
    }

    /// Where a value that is considered stands among those that are there.
    fn position(&self, place: usize) -> Option<usize> {
        let k = self.inverse.places.binary_search(&place).ok()?;
        (self.inverse.precision[(k, k)] > 0.0).then_some(k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// x and y follow a common cause, z is noise of its own.
    fn draw(count: usize, seed: u64) -> Vec<[f64; 3]> {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut generator) };
        let one = |_| {
            let cause = 10.0 * normal();
            [cause + 0.1 * normal(), 2.0 * cause + 0.1 * normal() + 5.0, 1e-6 * normal()]
        };
        (0..count).map(one).collect()
    }

    fn learnt() -> Gaussian {
        let data = draw(4000, 1);
        let observations: Vec<_> = data
            .iter()
            .enumerate()
            .map(|(snippet, values)| SnippetValues { snippet, values })
            .collect();
        Gaussian::learn(&observations, &[0.0; 3])
    }

    #[test]
    fn a_value_is_judged_by_those_that_go_with_it() {
        let gaussian = learnt();
        assert!(gaussian.is_sound(3));
        // Both far off, but as they go together.
        let together = gaussian.compare(&[30.0, 65.0, 0.0]).unwrap();
        assert!(together.departure(0).unwrap().plain < 2.0);
        // Given y, x is known to √(0.1² + (0.1/2)²) = 0.112.
        let apart = gaussian.compare(&[31.0, 65.0, 0.0]).unwrap();
        let departure = apart.departure(0).unwrap();
        assert!((departure.plain - 1.0 / 0.112).abs() < 0.6, "{departure:?}");
        assert!((departure.size - 1.0).abs() < 0.03, "{departure:?}");
        assert!(apart.departure(2).unwrap().plain < 0.5);
    }

    #[test]
    fn what_is_missing_is_left_out_and_leaving_out_is_the_same_as_missing() {
        let gaussian = learnt();
        let values = [31.0, 65.0, 2e-6];
        let missing = gaussian.compare(&[f64::NAN, 65.0, 2e-6]).unwrap();
        let without = gaussian.compare(&values).unwrap().without(0);
        assert!((missing.distance() - without.distance()).abs() < 1e-9);
        for place in 1..3 {
            let (a, b) = (missing.departure(place).unwrap(), without.departure(place).unwrap());
            assert!((a.predicted - b.predicted).abs() < 1e-9 && (a.size - b.size).abs() < 1e-9);
        }
        assert!(!without.considers(0) && !missing.considers(0) && missing.departure(0).is_none());
        assert!(gaussian.compare(&[f64::NAN; 3]).is_none());
    }

    #[test]
    fn distances_of_healthy_values_are_those_of_chi_square() {
        let gaussian = learnt();
        let fresh = draw(4000, 2);
        let distance = |values: &[f64; 3]| gaussian.compare(values).unwrap().distance();
        let mean = fresh.iter().map(distance).sum::<f64>() / 4000.0;
        // χ² with three degrees of freedom: mean 3, deviation of the mean of 4000 values √6/√4000 = 0.04.
        assert!((mean - 3.0).abs() < 0.2, "{mean}");
    }

    #[test]
    fn a_gaussian_of_few_snippets_is_trusted_less() {
        let few = Gaussian { snippets: 5, ..learnt() };
        let values = [31.0, 65.0, 10e-6];
        let (few, many) = (few.compare(&values).unwrap(), learnt().compare(&values).unwrap());
        let (few, many) = (few.departure(0).unwrap(), many.departure(0).unwrap());
        assert_eq!(few.plain, many.plain);
        assert!(few.predicted < 0.6 * many.predicted, "{few:?} {many:?}");
    }
}
