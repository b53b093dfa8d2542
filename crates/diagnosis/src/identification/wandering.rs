//! How much a healthy series wanders: by what is likeliest before the onset.

/// In a second, in standard deviations of a step's noise.
const TRIED: [f64; 6] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0];
/// Where too little is known.
const USUAL: f64 = 0.1;
/// Values before the onset without which nothing is learnt from them.
pub(super) const LEAST_BEFORE: usize = 40;

/// The likeliest deviation, given so many points before the onset and the logarithm of their likelihood.
pub(super) fn likeliest(before: usize, log_likelihood: impl Fn(f64) -> f64) -> f64 {
    if before < LEAST_BEFORE {
        return USUAL;
    }
    let weighed = TRIED.map(|walk| (walk, log_likelihood(walk)));
    weighed.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(USUAL, |(walk, _)| walk)
}
