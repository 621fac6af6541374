//! Covariance functions, trends and hyperparameters.

use ndarray::{Array2, ArrayView2};

use super::RegressionError;

/// Correlation as a function of r² = Σ_k ((x_k − x′_k)/ℓ_k)².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kernel {
    /// c = (1 + √5·r + 5r²/3)·e^(−√5·r) (Rasmussen and Williams, eq. 4.17).
    #[default]
    Matern52,
    /// c = (1 + √3·r)·e^(−√3·r) (eq. 4.17, ν = 3/2).
    Matern32,
    /// c = e^(−r²/2) (eq. 4.9).
    SquaredExponential,
}

impl Kernel {
    /// c(r²).
    pub fn correlation(self, r2: f64) -> f64 {
        self.correlation_and_slope(r2).0
    }

    /// c and dc/d(r²).
    pub fn correlation_and_slope(self, r2: f64) -> (f64, f64) {
        match self {
            Self::Matern52 => {
                // Beyond 1000 the decay is 0, and its product with infinity would be NaN.
                let scaled = (5.0 * r2).sqrt().min(1000.0);
                let decay = (-scaled).exp();
                ((1.0 + scaled + scaled * scaled / 3.0) * decay, -5.0 / 6.0 * (1.0 + scaled) * decay)
            }
            Self::Matern32 => {
                let scaled = (3.0 * r2).sqrt().min(1000.0);
                let decay = (-scaled).exp();
                ((1.0 + scaled) * decay, -1.5 * decay)
            }
            Self::SquaredExponential => {
                let c = (-0.5 * r2).exp();
                (c, -0.5 * c)
            }
        }
    }
}

/// Mean function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trend {
    /// h = (1).
    #[default]
    Constant,
    /// h = (1, z_1 … z_d), with standardized coordinates z.
    Linear,
}

impl Trend {
    pub(super) fn size(self, coordinates: usize) -> usize {
        match self {
            Self::Constant => 1,
            Self::Linear => 1 + coordinates,
        }
    }

    /// h, n×q, for standardized coordinates, d×n.
    pub(super) fn basis(self, standardized: &ArrayView2<f64>) -> Array2<f64> {
        let (coordinates, rows) = standardized.dim();
        Array2::from_shape_fn((rows, self.size(coordinates)), |(row, term)| match term {
            0 => 1.0,
            _ => standardized[[term - 1, row]],
        })
    }
}

/// Hyperparameters of a Gaussian process.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hyperparameters {
    /// ℓ_k > 0.
    pub length_scales: Vec<f64>,
    /// η > 0, a row's noise variance over s²; for given noise 1/s².
    pub noise_ratio: f64,
}

impl Hyperparameters {
    pub(super) fn check(&self, coordinates: usize) -> Result<(), RegressionError> {
        let found = self.length_scales.len();
        if found != coordinates {
            return Err(RegressionError::Count { what: "length scales", needed: coordinates, found });
        }
        let bad = |value: &f64| !(value.is_finite() && *value > 0.0);
        if let Some(i) = self.length_scales.iter().position(bad) {
            let value = self.length_scales[i];
            return Err(RegressionError::Hyperparameter { what: "length scale", number: i + 1, value });
        }
        if bad(&self.noise_ratio) {
            let value = self.noise_ratio;
            return Err(RegressionError::Hyperparameter { what: "noise ratio", number: 1, value });
        }
        Ok(())
    }

    /// Hyperparameters from logarithms, the noise ratio last.
    pub(super) fn from_logarithms(logarithms: &[f64]) -> Self {
        let mut values: Vec<f64> = logarithms.iter().map(|value| value.exp()).collect();
        let noise_ratio = values.pop().unwrap_or(1.0);
        Self { length_scales: values, noise_ratio }
    }
}

/// Distances r² from a point to the first scaled rows, d×n.
pub(super) fn squared_distances_into(out: &mut [f64], rows: &ArrayView2<f64>, point: impl Fn(usize) -> f64) {
    out.fill(0.0);
    for (k, coordinate) in rows.outer_iter().enumerate() {
        let x = point(k);
        for (r2, u) in out.iter_mut().zip(coordinate) {
            *r2 += (u - x) * (u - x);
        }
    }
}
