//! Thresholds from the tail of nominal divergences: peaks over threshold.
//!
//! Further runs will exceed the maximum over some runs, at an unknown rate. Extreme value theory provides the rate: the
//! excess of a channel's highest peaks over a high level follows a generalised Pareto distribution (Pickands 1975),
//! whatever the divergence's own distribution. The tail is extrapolated beyond the data to the threshold that is
//! reached at the tolerated rate.
//!
//! Its accuracy was measured on the simulated tower (runs of 15 s, plants that differ by up to 10 %, 24 channels):
//! fitted to some runs and counted in 6.9 h of others, the peaks above the thresholds, as a multiple of those expected,
//! mean ± standard deviation over fits to different runs:
//!
//! | fitted to | fits | 100 per hour | 10 per hour | 1 per hour | 0.3 per hour |
//! |---|---|---|---|---|---|
//! | 0.35 h | 30 | 1.22 ± 0.23 | 1.48 ± 0.57 | 1.5 ± 1.2 | 1.3 ± 1.1 |
//! | 0.69 h | 15 | 1.12 ± 0.17 | 1.20 ± 0.43 | 1.3 ± 1.0 | 1.5 ± 1.9 |
//! | 1.39 h | 7 | 1.07 ± 0.08 | 1.00 ± 0.18 | 0.9 ± 0.3 | 1.0 ± 0.5 |
//! | 3.47 h | 3 | 1.04 ± 0.04 | 0.93 ± 0.09 | 0.9 ± 0.1 | 1.0 ± 0.4 |
//!
//! At 1 and 0.3 per hour 7 and 2 peaks were expected in total, so that counting alone contributes deviations of 0.4 and
//! 0.7; lower rates are beyond the counted data. The best estimate alone, without averaging over the uncertainty of the
//! fit, yielded 5.8, 2.8, 1.3 and 1.0 for 1 per hour. The tail of ln D instead of D is not better where it was counted,
//! and gives absurd thresholds beyond (hundreds of times the largest divergence), because an error of its shape enters
//! the exponent once more.
//!
//! Peaks of D → the largest of each channel → their generalised Pareto distribution → threshold.

mod largest_peaks;
mod pareto;
mod pareto_fit;
mod peak_finder;
mod threshold;

pub use largest_peaks::LargestPeaks;
pub use pareto::Pareto;
pub use pareto_fit::ParetoFit;
pub use peak_finder::PeakFinder;
pub use threshold::{TailError, TailThreshold, tail_threshold};
