//! What the evidence is maximised over.

use super::RegressionError;

/// The numbers that say how smooth the functions are and how noisy the rows.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hyperparameters {
    /// ℓ_k, one a coordinate, in the coordinate's unit; greater than 0.
    pub length_scales: Vec<f64>,
    /// η, greater than 0: the noise variance of a row over the signal variance s². Where the noise of every row is
    /// given, it is 1/s², in the unit of 1 over the outputs' square.
    pub noise_ratio: f64,
}

impl Hyperparameters {
    /// Checks them for rows of `coordinates` coordinates.
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

    /// From their logarithms: the length scales', then the noise ratio's.
    pub(super) fn from_logarithms(logarithms: &[f64]) -> Self {
        let mut values: Vec<f64> = logarithms.iter().map(|value| value.exp()).collect();
        let noise_ratio = values.pop().unwrap_or(1.0);
        Self { length_scales: values, noise_ratio }
    }
}
