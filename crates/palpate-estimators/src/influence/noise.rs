//! Covariance of the channels' noise, and whitening by it.

use ndarray::{Array2, ArrayView1};

use palpate_numerics::{Cholesky, NotPositiveDefinite, symmetric_eigen};

/// Linear map W of readings that whitens the noise C and diagonalizes the signal's covariance S: W·C·Wᵀ = I,
/// W·S·Wᵀ = diag(d).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Whitening {
    /// W, m×m, row by row.
    pub matrix: Vec<f64>,
    /// d: ratio of signal and noise variance per whitened channel; at least 0.
    pub signal: Vec<f64>,
    /// γ: standard deviation of a common-mode gain error; 0 where a nuisance coordinate or a logarithm
    /// replaces it.
    pub gain: f64,
}

impl Whitening {
    /// Computes W: C = L·Lᵀ, L⁻¹·S·L⁻ᵀ = U·diag(d)·Uᵀ, W = Uᵀ·L⁻¹.
    pub(super) fn from_covariances(noise: Noise, signal: &Array2<f64>) -> Result<Self, NotPositiveDefinite> {
        let m = noise.covariance.nrows();
        let factor = Cholesky::factor(noise.covariance)?;
        let inverse = factor.solve_lower_matrix(Array2::eye(m));
        let (values, vectors) = symmetric_eigen(&inverse.dot(signal).dot(&inverse.t()));
        let matrix = vectors.t().dot(&inverse);
        let signal = values.iter().map(|d| d.max(0.0)).collect();
        Ok(Self { matrix: matrix.iter().copied().collect(), signal, gain: noise.gain })
    }

    /// Multiplies the standard deviations by `factor`.
    pub(super) fn widened(mut self, factor: f64) -> Self {
        self.gain *= factor;
        self.matrix.iter_mut().for_each(|weight| *weight /= factor);
        self
    }

    /// Number of channels, m.
    pub fn channels(&self) -> usize {
        self.signal.len()
    }

    pub(super) fn apply(&self, scaled: &[f64], out: &mut [f64]) {
        for (out, row) in out.iter_mut().zip(self.matrix.chunks_exact(self.channels().max(1))) {
            *out = row.iter().zip(scaled).map(|(w, y)| w * y).sum();
        }
    }
}

/// Deviation of a reading: e ~ N(0, C) and a factor 1 + N(0, γ²).
#[derive(Clone, Debug)]
pub(super) struct Noise {
    /// C.
    pub covariance: Array2<f64>,
    /// γ.
    pub gain: f64,
}

/// Least degrees of freedom for a variance, and per channel for a covariance.
const LEAST_FREEDOM: usize = 4;
/// Rounds of expectation–maximization.
const ROUNDS: usize = 40;

impl Noise {
    /// Estimates C and γ from repeats; row i is at place `places[i]` with mean output `means`.
    ///
    /// Each deviation is a·f + e with f the mean and a a gain error. C and γ maximize the likelihood by
    /// expectation–maximization (Dempster, Laird and Rubin 1977). `floor` is added to the variances. `None`
    /// with less than 4 degrees of freedom; with less than 4 per channel C is diagonal.
    pub fn of_repeats(
        places: &[usize],
        outputs: &Array2<f64>,
        means: &Array2<f64>,
        floor: &[f64],
        with_gain: bool,
    ) -> Result<Option<Self>, NotPositiveDefinite> {
        let channels = outputs.ncols();
        let rows: Vec<usize> = repeats(places, means.nrows());
        let freedom = places.len() - rows.iter().filter(|rows| **rows > 0).count();
        if freedom < LEAST_FREEDOM {
            return Ok(None);
        }
        // A mean of n rows absorbs a share of 1/n of their scatter.
        let used: Vec<usize> = (0..places.len()).filter(|row| rows[places[*row]] > 1).collect();
        let deviations = Array2::from_shape_fn((used.len(), channels), |(i, j)| {
            let place = places[used[i]];
            let n = rows[place] as f64;
            (outputs[[used[i], j]] - means[[place, j]]) * (n / (n - 1.0)).sqrt()
        });
        let count = used.len() as f64;
        let floor = Array2::from_diag(&ArrayView1::from(floor));
        let covariance = deviations.t().dot(&deviations) / count;
        if freedom < LEAST_FREEDOM * channels {
            // Variance of Student's t with these degrees of freedom.
            let students = freedom as f64 / (freedom as f64 - 2.0);
            let variances = Array2::from_diag(&covariance.diag()) * students;
            return Ok(Some(Self { covariance: variances + floor, gain: 0.0 }));
        }
        let mut noise = Self { covariance: covariance + &floor, gain: 0.0 };
        if with_gain {
            noise.gain = 0.05;
            let here = Array2::from_shape_fn(deviations.dim(), |(i, j)| means[[places[used[i]], j]]);
            for _ in 0..ROUNDS {
                noise = noise.improved(&deviations, &here)?;
                noise.covariance += &floor;
            }
        }
        Ok(Some(noise))
    }

    fn improved(&self, deviations: &Array2<f64>, means: &Array2<f64>) -> Result<Self, NotPositiveDefinite> {
        let precision = Cholesky::factor(self.covariance.clone())?.inverse();
        let weighted = means.dot(&precision);
        let gain2 = self.gain * self.gain;
        let mut rest = deviations.clone();
        let (mut square, mut left) = (0.0, Array2::<f64>::zeros(precision.dim()));
        for (i, mut rest) in rest.outer_iter_mut().enumerate() {
            let (mean, weights) = (means.row(i), weighted.row(i));
            let variance = gain2 / (1.0 + gain2 * weights.dot(&mean));
            let gain = variance * weights.dot(&rest);
            square += gain * gain + variance;
            rest.scaled_add(-gain, &mean);
            for (j, value) in mean.iter().enumerate() {
                left.row_mut(j).scaled_add(variance * value, &mean);
            }
        }
        let count = deviations.nrows() as f64;
        Ok(Self { covariance: (rest.t().dot(&rest) + left) / count, gain: (square / count).sqrt() })
    }
}

fn repeats(places: &[usize], count: usize) -> Vec<usize> {
    let mut rows = vec![0; count];
    places.iter().for_each(|place| rows[*place] += 1);
    rows
}
