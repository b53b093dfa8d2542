//! Thresholds that healthy values exceed so seldom.
//!
//! Of each snippet that was left out the largest z'² is known. Beyond their median these fall off exponentially, as those
//! of Gaussians do; the mean excess β of the k largest over the next one is known to 2kβ/χ²(2k) at most, with 95 %
//! confidence. So few snippets in N exceed a level u + e: k/N·exp(−e/β).

/// Quantile of the standard normal at 5 %.
const NORMAL_5: f64 = -1.644_853_6;

/// The z' that the largest of a snippet exceeds no more often than once in `once_in` snippets, with 95 % confidence, if
/// these are the largest of snippets that had been left out.
pub(crate) fn exceeded_once_in(once_in: f64, largest: &[f64]) -> f64 {
    let mut squares: Vec<f64> = largest.iter().map(|z| z * z).collect();
    squares.sort_unstable_by(|a, b| b.total_cmp(a));
    let upper = squares.len() / 2;
    let Some(&level) = squares.get(upper) else { return 0.0 };
    let count = upper as f64;
    let excess = squares[..upper].iter().map(|square| square - level).sum::<f64>();
    let most = 2.0 * excess / chi_square_5(2.0 * count).max(f64::MIN_POSITIVE);
    let seldom = (once_in * count / squares.len() as f64).max(1.0);
    (level + most * seldom.ln()).sqrt()
}

/// Quantile of χ² at 5 % (Wilson and Hilferty).
fn chi_square_5(freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    freedom * (1.0 - spread + NORMAL_5 * spread.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Tables: 5 % quantiles of χ² with 10, 48 and 100 degrees of freedom.
    #[test]
    fn quantiles_are_those_of_tables() {
        for (freedom, quantile) in [(10.0, 3.940), (48.0, 33.098), (100.0, 77.929)] {
            assert!((chi_square_5(freedom) - quantile).abs() < 0.01, "{freedom}");
        }
    }

    /// The largest of eight Gaussians in each snippet: which z is exceeded once in 10⁵ snippets is known, erfc(z/√2)·8 =
    /// 1e-5: 4.85. The bound lies above it in about 95 of 100 sets of fifty, and not far.
    #[test]
    fn a_threshold_is_exceeded_as_seldom_as_stated() {
        let mut generator = ChaCha8Rng::seed_from_u64(3);
        let mut largest_of_eight = || -> f64 {
            let one = |_| -> f64 { StandardNormal.sample(&mut generator) };
            (0..8).map(one).fold(0.0, |largest: f64, z| largest.max(z.abs()))
        };
        let mut thresholds: Vec<f64> = (0..400)
            .map(|_| {
                exceeded_once_in(1e5, &(0..50).map(|_| largest_of_eight()).collect::<Vec<_>>())
            })
            .collect();
        thresholds.sort_unstable_by(f64::total_cmp);
        let above = thresholds.iter().filter(|threshold| **threshold > 4.85).count();
        assert!((360..=400).contains(&above), "{above}");
        assert!((5.0..6.5).contains(&thresholds[200]), "{}", thresholds[200]);
    }

    #[test]
    fn of_nothing_nothing_follows() {
        assert_eq!(exceeded_once_in(1e5, &[]), 0.0);
        assert_eq!(exceeded_once_in(1e5, &[2.0]), 2.0);
        assert!((exceeded_once_in(1e5, &[2.0; 9]) - 2.0).abs() < 1e-12);
    }
}
