//! What the noise of the channels does to a comparison of readings.

use ndarray::{Array2, ArrayView1};

use palpate_numerics::{Cholesky, NotPositiveDefinite, symmetric_eigen};

/// A linear map W of readings after which noise is the unit matrix and what the process does not know is diagonal:
/// W·C·Wᵀ = I, W·S·Wᵀ = diag(d).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Whitening {
    /// W, m×m, row by row.
    pub matrix: Vec<f64>,
    /// d: the signal's variance over the noise's in each whitened channel; at least 0.
    pub signal: Vec<f64>,
    /// γ: the standard deviation of a gain about 1 that all channels of one reading share; 0 where a nuisance coordinate
    /// or a logarithm has taken its place.
    pub gain: f64,
}

impl Whitening {
    /// From the covariance C of the noise and S of the signal, both m×m, and γ.
    ///
    /// C = L·Lᵀ, L⁻¹·S·L⁻ᵀ = U·diag(d)·Uᵀ, W = Uᵀ·L⁻¹.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] where C is singular.
    pub(super) fn from_covariances(noise: Noise, signal: &Array2<f64>) -> Result<Self, NotPositiveDefinite> {
        let m = noise.covariance.nrows();
        let factor = Cholesky::factor(noise.covariance)?;
        let inverse = factor.solve_lower_matrix(Array2::eye(m));
        let (values, vectors) = symmetric_eigen(&inverse.dot(signal).dot(&inverse.t()));
        let matrix = vectors.t().dot(&inverse);
        let signal = values.iter().map(|d| d.max(0.0)).collect();
        Ok(Self { matrix: matrix.iter().copied().collect(), signal, gain: noise.gain })
    }

    /// The same for noise, gain and signal of `factor` times the deviation.
    pub(super) fn widened(mut self, factor: f64) -> Self {
        self.gain *= factor;
        self.matrix.iter_mut().for_each(|weight| *weight /= factor);
        self
    }

    /// Channels, m.
    pub fn channels(&self) -> usize {
        self.signal.len()
    }

    /// W·y into `out`.
    pub(super) fn apply(&self, scaled: &[f64], out: &mut [f64]) {
        for (out, row) in out.iter_mut().zip(self.matrix.chunks_exact(self.channels().max(1))) {
            *out = row.iter().zip(scaled).map(|(w, y)| w * y).sum();
        }
    }
}

/// Scatter of a reading about the mean of its place: e ~ N(0, C) and a factor 1 + N(0, γ²).
#[derive(Clone, Debug)]
pub(super) struct Noise {
    /// C.
    pub covariance: Array2<f64>,
    /// γ.
    pub gain: f64,
}

/// Degrees of freedom that tell a variance; of each channel, their covariance.
const LEAST_FREEDOM: usize = 4;
/// Rounds of the iteration that tells gain from noise.
const ROUNDS: usize = 40;

impl Noise {
    /// From repeats: `places` says of each row where it belongs, `means` are the places' mean outputs. `None` with less than 4 degrees of freedom. With less
    /// than 4 for each channel the channels' variances are told, but not how they go together.
    ///
    /// Each deviation is a·f + e with f the place's mean and a a gain error. C and γ are those of greatest likelihood,
    /// found by expectation and maximisation (Dempster, Laird and Rubin 1977); without gain, C is the pooled covariance. The
    /// variances in `floor` are added.
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
        // A mean of n rows takes a share of 1/n of their scatter with it.
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
            // The variance of Student's t, as few repeats told it.
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

    /// One round: the gain of every row as it probably was, then what is left.
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

/// Rows at each of `count` places.
fn repeats(places: &[usize], count: usize) -> Vec<usize> {
    let mut rows = vec![0; count];
    places.iter().for_each(|place| rows[*place] += 1);
    rows
}
