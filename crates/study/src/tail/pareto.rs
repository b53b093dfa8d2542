//! The generalised Pareto distribution.

/// A generalised Pareto distribution of excesses x ≥ 0: P(X > x) = (1 + ξ·x/σ)^(−1/ξ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pareto {
    /// ξ: 0 for an exponential tail, above for a heavier one, below for one that ends at −σ/ξ.
    pub shape: f64,
    /// σ, above 0, in units of x.
    pub scale: f64,
}

impl Pareto {
    /// P(X > x).
    #[must_use]
    pub fn survival(&self, x: f64) -> f64 {
        let reduced = x / self.scale;
        if self.shape == 0.0 {
            return (-reduced).exp();
        }
        let base = self.shape * reduced;
        if base <= -1.0 { 0.0 } else { (-base.ln_1p() / self.shape).exp() }
    }

    /// The x that is exceeded with a probability of `survival`, above 0 and up to 1.
    #[must_use]
    pub fn exceeded_with(&self, survival: f64) -> f64 {
        let exponential = -survival.ln();
        if self.shape == 0.0 {
            return self.scale * exponential;
        }
        self.scale * (self.shape * exponential).exp_m1() / self.shape
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_the_inverse_of_the_survival() {
        for shape in [-0.3, -1e-12, 0.0, 1e-12, 0.2, 1.5] {
            let pareto = Pareto { shape, scale: 3e-4 };
            for survival in [1.0, 0.5, 1e-3, 1e-7] {
                let there_and_back = pareto.survival(pareto.exceeded_with(survival));
                assert!((there_and_back / survival - 1.0).abs() < 1e-9, "{shape} {survival}");
            }
        }
    }

    #[test]
    fn a_tail_of_negative_shape_ends() {
        let pareto = Pareto { shape: -0.5, scale: 1.0 };
        assert!(pareto.survival(1.999) > 0.0);
        assert_eq!(pareto.survival(2.0), 0.0);
        assert_eq!(pareto.survival(3.0), 0.0);
    }
}
