//! Detectors that watch the channels of a module together, and name the one that contributes most.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::channelwise::Ewma;

/// Healthy standardised residuals of a module: a row for each step, a column for each channel.
pub(super) type Healthy = DMatrix<f64>;

/// The mean and the covariance of healthy residuals, the latter with this share of the unit matrix so that channels that
/// repeat each other do no harm.
fn gaussian(healthy: &Healthy) -> (DVector<f64>, DMatrix<f64>) {
    const RIDGE: f64 = 1e-3;
    let mean = healthy.row_mean().transpose();
    let centred =
        DMatrix::from_fn(healthy.nrows(), healthy.ncols(), |i, j| healthy[(i, j)] - mean[j]);
    let count = healthy.nrows().max(1) as f64;
    let channels = healthy.ncols();
    let covariance =
        centred.tr_mul(&centred) / count + DMatrix::identity(channels, channels) * RIDGE;
    (mean, covariance)
}

fn inverse(covariance: DMatrix<f64>) -> DMatrix<f64> {
    let channels = covariance.nrows();
    // The ridge makes every finite covariance positive definite; the decomposition fails only if a value is not finite.
    covariance
        .cholesky()
        .map_or_else(|| DMatrix::identity(channels, channels), |root| root.inverse())
}

/// Puts the module's statistic on the channel that contributes most, none on the others.
fn attribute(total: f64, contributions: impl Iterator<Item = f64>, statistics: &mut [f64]) {
    statistics.fill(0.0);
    let largest = contributions.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some(statistic) = largest.and_then(|(place, _)| statistics.get_mut(place)) {
        *statistic = total;
    }
}

/// The squared distance by the healthy covariance (Hotelling 1947), of the residuals or of their moving averages (MEWMA,
/// Lowry et al. 1992). A channel contributes what it would reduce the distance by if it were displaced.
#[derive(Clone)]
pub(super) struct Distance {
    mean: DVector<f64>,
    precision: DMatrix<f64>,
    weight: f64,
    average: DVector<f64>,
}

impl Distance {
    /// Of the residuals themselves.
    pub(super) fn hotelling(healthy: &Healthy) -> Self {
        Self::weighted(healthy, 1.0)
    }

    /// Of moving averages.
    pub(super) fn mewma(healthy: &Healthy) -> Self {
        Self::weighted(healthy, Ewma::WEIGHT)
    }

    fn weighted(healthy: &Healthy, weight: f64) -> Self {
        let (mean, covariance) = gaussian(healthy);
        let precision = inverse(covariance * (weight / (2.0 - weight)));
        let average = DVector::zeros(mean.len());
        Self { mean, precision, weight, average }
    }

    pub(super) fn step(&mut self, residuals: &[f64], statistics: &mut [f64]) {
        for (place, average) in self.average.iter_mut().enumerate() {
            *average += self.weight * (residuals[place] - self.mean[place] - *average);
        }
        let weighted = &self.precision * &self.average;
        let total = weighted.dot(&self.average);
        let gains = weighted
            .iter()
            .zip(self.precision.diagonal().iter())
            .map(|(v, p)| v * v / p)
            .collect::<Vec<_>>();
        attribute(total, gains.into_iter(), statistics);
    }
}

/// The squared distance from the plane of the principal components (Q, Jackson and Mudholkar 1979). A channel
/// contributes the square of its own error.
#[derive(Clone)]
pub(super) struct PrincipalError {
    mean: DVector<f64>,
    /// Projection on what the components leave.
    rest: DMatrix<f64>,
}

impl PrincipalError {
    /// Components that together explain this share of the variance are kept.
    const EXPLAINED: f64 = 0.9;

    pub(super) fn fitted(healthy: &Healthy) -> Self {
        let (mean, covariance) = gaussian(healthy);
        let channels = mean.len();
        let all = covariance.trace();
        let eigen = SymmetricEigen::new(covariance);
        let mut order: Vec<usize> = (0..channels).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let mut rest = DMatrix::identity(channels, channels);
        let mut explained = 0.0;
        for place in order {
            // One direction at least remains.
            if explained + eigen.eigenvalues[place] > Self::EXPLAINED * all {
                break;
            }
            explained += eigen.eigenvalues[place];
            let direction = eigen.eigenvectors.column(place);
            rest -= direction * direction.transpose();
        }
        Self { mean, rest }
    }

    pub(super) fn step(&self, residuals: &[f64], statistics: &mut [f64]) {
        let error = &self.rest * (DVector::from_column_slice(residuals) - &self.mean);
        attribute(error.norm_squared(), error.iter().map(|e| e * e), statistics);
    }
}

/// Each channel predicted from the others of its module by a Gaussian process with a squared exponential kernel on some
/// healthy residuals (Rasmussen and Williams 2006, algorithm 2.1). The statistic of a channel is its error in units of the
/// healthy one.
#[derive(Clone)]
pub(super) struct GaussianProcess {
    /// By channel: the inputs that were learned, a row each; their weights; the healthy error.
    channels: Vec<(DMatrix<f64>, DVector<f64>, f64)>,
    length: f64,
}

impl GaussianProcess {
    const LEARNED: usize = 40;
    const NOISE_VARIANCE: f64 = 0.3;

    pub(super) fn fitted(healthy: &Healthy) -> Self {
        let inputs = healthy.ncols().saturating_sub(1).max(1);
        // Standardised inputs are this far apart.
        let length = (2.0 * inputs as f64).sqrt();
        let every = (healthy.nrows() / Self::LEARNED).max(1);
        let learned: Vec<usize> = (0..healthy.nrows()).step_by(every).take(Self::LEARNED).collect();
        let fit = |channel: usize| {
            let others = healthy.clone().remove_column(channel);
            let points = others.select_rows(&learned);
            let kernel = DMatrix::from_fn(points.nrows(), points.nrows(), |i, j| {
                let distance = (points.row(i) - points.row(j)).norm_squared();
                kernel(distance, length) + if i == j { Self::NOISE_VARIANCE } else { 0.0 }
            });
            let values = DVector::from_iterator(
                learned.len(),
                learned.iter().map(|row| healthy[(*row, channel)]),
            );
            let weights = kernel
                .cholesky()
                .map_or_else(|| DVector::zeros(learned.len()), |root| root.solve(&values));
            let mut process = (points, weights, 1.0);
            // Points that were learned have no share in the healthy error.
            let judged =
                (0..healthy.nrows()).filter(|row| row % every != 0).step_by(every.div_ceil(20));
            let (mut squares, mut count) = (0.0, 0.0);
            for row in judged {
                let input: Vec<f64> = others.row(row).iter().copied().collect();
                let error =
                    healthy[(row, channel)] - predicted(&process, input.iter().copied(), length);
                squares += error * error;
                count += 1.0;
            }
            if squares > 0.0 {
                process.2 = (squares / count).sqrt();
            }
            process
        };
        Self { channels: (0..healthy.ncols()).map(fit).collect(), length }
    }

    pub(super) fn step(&self, residuals: &[f64], statistics: &mut [f64]) {
        for (place, (process, statistic)) in self.channels.iter().zip(statistics).enumerate() {
            let others =
                residuals.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, x)| *x);
            let error = residuals[place] - predicted(process, others, self.length);
            *statistic = error.abs() / process.2;
        }
    }
}

fn kernel(squared_distance: f64, length: f64) -> f64 {
    (-0.5 * squared_distance / (length * length)).exp()
}

fn predicted(
    (points, weights, _): &(DMatrix<f64>, DVector<f64>, f64),
    input: impl Iterator<Item = f64>,
    length: f64,
) -> f64 {
    let mut distances = vec![0.0; points.nrows()];
    for (column, value) in points.column_iter().zip(input) {
        distances.iter_mut().zip(column.iter()).for_each(|(d, p)| *d += (p - value) * (p - value));
    }
    distances.iter().zip(weights.iter()).map(|(d, weight)| weight * kernel(*d, length)).sum()
}

/// A network that reproduces the residuals of a module through a narrow layer (tanh), trained by gradient descent with
/// momentum (Adam, Kingma and Ba 2015). A channel contributes the square of its own error in units of the healthy one.
#[derive(Clone)]
pub(super) struct Autoencoder {
    encode: DMatrix<f64>,
    decode: DMatrix<f64>,
    deviations: Vec<f64>,
}

impl Autoencoder {
    const EPOCHS: i32 = 300;
    const RATE: f64 = 0.01;
    /// The most steps of the healthy residuals that it is trained with.
    const TRAINED: usize = 1000;

    pub(super) fn fitted(healthy: &Healthy, random: &mut impl Rng) -> Self {
        let channels = healthy.ncols();
        let narrow = channels.div_ceil(3);
        let every = healthy.nrows().div_ceil(Self::TRAINED).max(1);
        let rows: Vec<usize> = (0..healthy.nrows()).step_by(every).collect();
        let samples = healthy.select_rows(&rows);
        let mut normal = |_, _| -> f64 { StandardNormal.sample(random) };
        let scale = 1.0 / (channels.max(1) as f64).sqrt();
        let mut weights = [
            DMatrix::from_fn(channels, narrow, &mut normal) * scale,
            DMatrix::from_fn(narrow, channels, &mut normal) * scale,
        ];
        let mut moments = weights.clone().map(|w| [w.clone() * 0.0, w * 0.0]);
        let count = samples.nrows().max(1) as f64;
        for epoch in 1..=Self::EPOCHS {
            let hidden = (&samples * &weights[0]).map(f64::tanh);
            let error = &hidden * &weights[1] - &samples;
            let back = (&error * weights[1].transpose()).zip_map(&hidden, |e, h| e * (1.0 - h * h));
            let gradients = [samples.tr_mul(&back) / count, hidden.tr_mul(&error) / count];
            for ((weight, [first, second]), gradient) in
                weights.iter_mut().zip(&mut moments).zip(gradients)
            {
                *first = &*first * 0.9 + &gradient * 0.1;
                *second = &*second * 0.999 + gradient.map(|g| g * g) * 0.001;
                let (one, two) = (1.0 - 0.9_f64.powi(epoch), 1.0 - 0.999_f64.powi(epoch));
                *weight -= first
                    .zip_map(second, |m, v| Self::RATE * (m / one) / ((v / two).sqrt() + 1e-8));
            }
        }
        let [encode, decode] = weights;
        let error = (&samples * &encode).map(f64::tanh) * &decode - &samples;
        let deviation =
            |column: nalgebra::DVectorView<f64>| (column.norm_squared() / count).sqrt().max(1e-6);
        let deviations = error.column_iter().map(deviation).collect();
        Self { encode, decode, deviations }
    }

    pub(super) fn step(&self, residuals: &[f64], statistics: &mut [f64]) {
        let input = DVector::from_column_slice(residuals);
        let output = self.decode.tr_mul(&self.encode.tr_mul(&input).map(f64::tanh));
        let error = output - input;
        let squares: Vec<f64> =
            error.iter().zip(&self.deviations).map(|(e, d)| (e / d) * (e / d)).collect();
        attribute(squares.iter().sum(), squares.iter().copied(), statistics);
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Independent normal residuals.
    fn normal(steps: usize, channels: usize, seed: u64) -> Healthy {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        DMatrix::from_fn(steps, channels, |_, _| StandardNormal.sample(&mut random))
    }

    /// Three channels that follow one cause, and one that does not.
    fn related(steps: usize, seed: u64) -> Healthy {
        let mixing = DMatrix::from_row_slice(2, 4, &[1.0, -0.8, 0.6, 0.0, 0.0, 0.0, 0.0, 1.0]);
        normal(steps, 2, seed) * mixing + normal(steps, 4, seed + 1) * 0.1
    }

    #[test]
    fn average_run_lengths_are_those_of_the_literature() {
        // Montgomery, Introduction to Statistical Quality Control, 7th ed., table 11.3: p = 4, λ = 0.2 → H = 13.87 for an
        // average run length of 200. T² with p = 4: P(χ² > 14.86) = 0.005, so 200.
        let healthy = normal(200_000, 4, 3);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for (new, limit, stated) in [
            (Distance::mewma(&healthy), 13.87, 200.0),
            (Distance::hotelling(&healthy), 14.86, 200.0),
        ] {
            let (mut steps, runs) = (0_u32, 1500);
            for _ in 0..runs {
                let mut detector = new.clone();
                let mut statistics = [0.0; 4];
                while statistics.iter().sum::<f64>() <= limit {
                    let residuals: [f64; 4] =
                        std::array::from_fn(|_| StandardNormal.sample(&mut random));
                    detector.step(&residuals, &mut statistics);
                    steps += 1;
                }
            }
            let measured = f64::from(steps) / f64::from(runs);
            assert!((measured / stated - 1.0).abs() < 0.1, "{measured} {stated}");
        }
    }

    #[test]
    fn each_names_the_displaced_channel() {
        let healthy = related(4000, 11);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let encoder = Autoencoder::fitted(&healthy, &mut random);
        let (process, principal) =
            (GaussianProcess::fitted(&healthy), PrincipalError::fitted(&healthy));
        let (hotelling, mewma) = (Distance::hotelling(&healthy), Distance::mewma(&healthy));
        let test = related(50, 99);
        for displaced in 0..3 {
            let mut named = [0; 5];
            for row in test.row_iter() {
                let mut residuals: Vec<f64> = row.iter().copied().collect();
                residuals[displaced] += 3.0;
                let mut all = vec![vec![0.0; 4]; 5];
                hotelling.clone().step(&residuals, &mut all[0]);
                mewma.clone().step(&residuals, &mut all[1]);
                principal.step(&residuals, &mut all[2]);
                process.step(&residuals, &mut all[3]);
                encoder.step(&residuals, &mut all[4]);
                for (named, statistics) in named.iter_mut().zip(&all) {
                    let largest = (0..4).max_by(|a, b| statistics[*a].total_cmp(&statistics[*b]));
                    *named += u32::from(largest == Some(displaced));
                }
            }
            // A distance by the covariance cannot be misled; the others share errors among related channels.
            assert!(named[0] == 50 && named[1] == 50, "{displaced}: {named:?}");
            assert!(named[2..].iter().all(|count| *count >= 25), "{displaced}: {named:?}");
        }
    }

    #[test]
    fn a_process_predicts_what_follows_from_the_others() {
        let healthy = related(4000, 21);
        let process = GaussianProcess::fitted(&healthy);
        // 0 follows from 1 and 2; 3 from none.
        assert!(process.channels[0].2 < 0.4, "{}", process.channels[0].2);
        assert!((0.8..1.3).contains(&process.channels[3].2), "{}", process.channels[3].2);
    }

    #[test]
    fn an_encoder_learns_what_a_narrow_layer_can_hold() {
        let healthy = related(4000, 31);
        let encoder = Autoencoder::fitted(&healthy, &mut ChaCha8Rng::seed_from_u64(2));
        assert!(
            encoder.deviations.iter().all(|deviation| *deviation < 0.5),
            "{:?}",
            encoder.deviations
        );
    }
}
