//! How much a healthy series wanders: by what is likely before the onset.

/// In a second, in standard deviations of a step's noise; each as likely as the others.
const TRIED: [f64; 7] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
/// Of these, those of which the likelihood before the onset is no less than the largest one's times e to minus this.
const WITHIN: f64 = 3.0;

/// Where too little is known.
const USUAL: f64 = 0.1;
/// Values before the onset without which nothing is learnt from them.
pub(super) const LEAST_BEFORE: usize = 40;

/// What is likely, given the logarithm of the likelihood before the onset.
pub(super) fn likely(log_likelihood: impl Fn(f64) -> f64) -> Vec<f64> {
    let weighed = TRIED.map(|walk| (walk, log_likelihood(walk)));
    let largest = weighed.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
    weighed.into_iter().filter(|(_, log)| *log >= largest - WITHIN).map(|(walk, _)| walk).collect()
}

/// The likeliest, given so many values before the onset and the logarithm of their likelihood.
pub(super) fn likeliest(before: usize, log_likelihood: impl Fn(f64) -> f64) -> f64 {
    if before < LEAST_BEFORE {
        return USUAL;
    }
    let weighed = TRIED.map(|walk| (walk, log_likelihood(walk)));
    weighed.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(USUAL, |(walk, _)| walk)
}
