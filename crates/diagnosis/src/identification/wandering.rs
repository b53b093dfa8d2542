//! How much a healthy series wanders: by what is likely before the onset.

/// In a second, in standard deviations of a step's noise; each as likely as the others.
const TRIED: [f64; 7] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
/// Of these, those of which the likelihood before the onset is no less than the largest one's times e to minus this.
const WITHIN: f64 = 3.0;

/// Where too little is known.
const USUAL: f64 = 0.1;
/// Values before the onset without which nothing is learnt from them.
pub(super) const LEAST_BEFORE: usize = 40;

/// How likely it is that it wanders more later than it did before.
const MORE_LATER: f64 = 0.05;

/// What is likely, and how likely each of it is in comparison with the others, given the logarithm of the likelihood before
/// the onset. The wind is not the same before and after it: so the next larger one is among them.
pub(super) fn likely(log_likelihood: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let weighed = TRIED.map(|walk| (walk, log_likelihood(walk)));
    let largest = weighed.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
    let mut likely: Vec<(f64, f64)> = weighed
        .into_iter()
        .filter(|(_, log)| *log >= largest - WITHIN)
        .map(|(walk, _)| (walk, 1.0))
        .collect();
    let most = likely.last().map_or(0.0, |(walk, _)| *walk);
    let more = TRIED.into_iter().find(|walk| *walk > most);
    likely.extend(more.map(|walk| (walk, MORE_LATER)));
    likely
}

/// The likeliest, given so many values before the onset and the logarithm of their likelihood.
pub(super) fn likeliest(before: usize, log_likelihood: impl Fn(f64) -> f64) -> f64 {
    if before < LEAST_BEFORE {
        return USUAL;
    }
    let weighed = TRIED.map(|walk| (walk, log_likelihood(walk)));
    weighed.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(USUAL, |(walk, _)| walk)
}
