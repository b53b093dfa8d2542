//! Integration over one thing that a hypothesis leaves open, of which many places are possible: coarse at first, finer
//! around the most likely place.

use super::level::Weighed;
use super::mixture::Mixture;

/// How often the places on either side of the most likely one are halved.
const ROUNDS: usize = 8;
/// An onset this long before the detection is as likely as one at it \[s\]; one twice as long ago half as likely.
pub(super) const YOUNG_S: f64 = 0.005;

/// Places along a coordinate along which any place is as likely beforehand as any other, in ascending order.
#[derive(Debug, Clone)]
pub(super) struct SearchAxis {
    at: Vec<f64>,
    coarse: Vec<usize>,
}

impl SearchAxis {
    /// Begins with places that are at least so far apart, the first and the last among them.
    pub(super) fn new(at: Vec<f64>, apart: f64) -> Self {
        let mut coarse: Vec<usize> = Vec::new();
        let last = at.len().saturating_sub(1);
        for place in (0..at.len()).rev() {
            let far = coarse.last().is_none_or(|kept| at[*kept] - at[place] >= apart);
            if far || place == 0 {
                coarse.push(place);
            }
        }
        coarse.reverse();
        debug_assert!(coarse.last().is_none_or(|kept| *kept == last));
        Self { at, coarse }
    }

    /// Onsets by when they are \[s\], from the detection on and in ascending order: at first `apart` as a share of their age.
    pub(super) fn of_onsets(at_s: impl Iterator<Item = f64>, apart: f64) -> Self {
        Self::new(at_s.map(|at_s| -(YOUNG_S - at_s).ln()).collect(), apart)
    }

    /// The places that are weighed at first.
    pub(super) fn coarse(&self) -> &[usize] {
        &self.coarse
    }

    /// Weighs a hypothesis over the axis. Of one place there may be several cases, each as likely as the others.
    pub(super) fn integrate(&self, mut weigh: impl FnMut(usize) -> Vec<Weighed>) -> Mixture {
        let mut weighed: Vec<(usize, Vec<Weighed>)> =
            self.coarse.iter().map(|place| (*place, weigh(*place))).collect();
        for _ in 0..ROUNDS {
            let best = |(_, cases): &(usize, Vec<Weighed>)| {
                cases.iter().map(|case| case.log_likelihood).fold(f64::NEG_INFINITY, f64::max)
            };
            let likeliest =
                (0..weighed.len()).max_by(|a, b| best(&weighed[*a]).total_cmp(&best(&weighed[*b])));
            let Some(likeliest) = likeliest else { break };
            let here = weighed[likeliest].0;
            let sides = [likeliest.checked_sub(1), Some(likeliest + 1)];
            let near =
                sides.into_iter().flatten().filter_map(|k| weighed.get(k)).map(|(at, _)| *at);
            let halves: Vec<usize> = near
                .filter(|other| other.abs_diff(here) > 1)
                .map(|other| usize::midpoint(here, other))
                .collect();
            if halves.is_empty() {
                break;
            }
            weighed.extend(halves.into_iter().map(|place| (place, weigh(place))));
            weighed.sort_by_key(|(place, _)| *place);
        }
        self.mixture(&weighed)
    }

    fn mixture(&self, weighed: &[(usize, Vec<Weighed>)]) -> Mixture {
        let mut mixture = Mixture::default();
        let at = |k: usize| self.at[weighed[k].0];
        let Some(last) = weighed.len().checked_sub(1) else { return mixture };
        let span = at(last) - at(0);
        for (k, (place, cases)) in weighed.iter().enumerate() {
            let width = 0.5 * (at((k + 1).min(last)) - at(k.saturating_sub(1)));
            let share = if span > 0.0 { width / span } else { 1.0 };
            let log_prior = (share / cases.len() as f64).ln();
            for case in cases {
                let log_likelihood = case.log_likelihood + log_prior;
                mixture.add(Weighed { log_likelihood, place: *place, ..*case });
            }
        }
        mixture
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A narrow likelihood, nowhere near a coarse place.
    fn narrow(at: f64) -> Weighed {
        let log_likelihood = -0.5 * ((at - 3.3) / 0.02).powi(2);
        Weighed { mean: at, variance: 1e-9, ..Weighed::of(log_likelihood) }
    }

    #[test]
    fn a_narrow_likelihood_is_found_between_coarse_places_and_integrated() {
        let at = |place: usize| place as f64 / 200.0;
        let axis = SearchAxis::new((0..2001).map(at).collect(), 0.1);
        let mixture = axis.integrate(|place| vec![narrow(at(place))]);
        let exact = 0.02 * std::f64::consts::TAU.sqrt() / 10.0;
        assert!((mixture.log_likelihood() - f64::ln(exact)).abs() < 0.7, "{mixture:?}");
        assert!((mixture.size().unwrap().value - 3.3).abs() < 0.01);
    }
}
