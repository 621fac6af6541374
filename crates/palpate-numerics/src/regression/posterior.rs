//! The posterior of a Gaussian process, and its predictions.

use ndarray::linalg::general_mat_vec_mul;
use ndarray::{Array2, ArrayView1, ArrayViewMut1};

use super::covariance::{Covariance, Points};
use super::evidence::{log_evidence, signal_variances};
use super::groups::Groups;
use super::kernel::squared_distances_into;
use super::{Hyperparameters, Kernel, RegressionError, Trend};
use crate::NotPositiveDefinite;

/// The posterior of m functions of d coordinates.
///
/// It is written without the factor of its covariance, which is made again when it is read: n³/3 operations for n
/// distinct points.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(into = "PosteriorData", try_from = "PosteriorData")]
pub struct GaussianProcess {
    data: PosteriorData,
    points: Points,
    covariance: Covariance,
    /// α, m×n.
    weights: Array2<f64>,
    /// β, m×q.
    trend: Array2<f64>,
}

/// Room for predictions of one [`GaussianProcess`].
#[derive(Clone, Debug)]
pub struct PredictionScratch {
    /// u.
    point: Vec<f64>,
    /// h, then what the trend leaves unexplained.
    basis: Vec<f64>,
    /// r², then the correlations with every row.
    correlations: Vec<f64>,
    /// dc/d(r²), then its product with u − u_i.
    slopes: Vec<f64>,
    product: Vec<f64>,
    /// One number an output.
    outputs: Vec<f64>,
}

impl PartialEq for GaussianProcess {
    fn eq(&self, other: &Self) -> bool {
        self.data == other.data
    }
}

impl GaussianProcess {
    /// The exact posterior of all groups.
    pub(super) fn of_groups(
        groups: &Groups,
        kernel: Kernel,
        trend: Trend,
        hyperparameters: &Hyperparameters,
    ) -> Result<Self, RegressionError> {
        let ratio = hyperparameters.noise_ratio;
        let scales = &hyperparameters.length_scales;
        let points = Points::new(&groups.coordinates.view(), &groups.centre, &groups.spread, scales, trend);
        let noise = groups.noise_ratios(ratio);
        let covariance = Covariance::regularised(&points, kernel, &noise)?;
        let (alpha, beta) = covariance.solve(&groups.means);
        let signal = signal_variances(groups, ratio, &alpha);
        let data = PosteriorData {
            kernel,
            trend,
            centre: groups.centre.clone(),
            spread: groups.spread.clone(),
            hyperparameters: hyperparameters.clone(),
            inputs: groups.coordinates.t().iter().copied().collect(),
            noise,
            row_noise: if groups.noise_given { None } else { Some(ratio) },
            offset: groups.offset.clone(),
            scale: groups.scale.clone(),
            signal_variance: signal.iter().zip(&groups.scale).map(|(s2, scale)| s2 * scale * scale).collect(),
            weights: alpha.t().iter().copied().collect(),
            trend_coefficients: beta.t().iter().copied().collect(),
            log_evidence: log_evidence(groups, ratio, &covariance, &alpha),
        };
        let weights = alpha.t().as_standard_layout().into_owned();
        let trend = beta.t().as_standard_layout().into_owned();
        Ok(Self { data, points, covariance, weights, trend })
    }

    /// Coordinates of a point, d.
    pub fn coordinates(&self) -> usize {
        self.points.scaled.nrows()
    }

    /// Outputs, m.
    pub fn outputs(&self) -> usize {
        self.weights.nrows()
    }

    /// Distinct points that it has seen, n.
    pub fn points(&self) -> usize {
        self.points.scaled.ncols()
    }

    /// Hyperparameters that maximise the evidence.
    pub fn hyperparameters(&self) -> &Hyperparameters {
        &self.data.hyperparameters
    }

    /// s_j², in the square of the output's unit.
    pub fn signal_variance(&self, output: usize) -> f64 {
        self.data.signal_variance[output]
    }

    /// The fitted noise variance η·s_j² of a single row, in the square of the output's unit; `None` where the noise of
    /// every row was given.
    pub fn noise_variance(&self, output: usize) -> Option<f64> {
        self.data.row_noise.map(|ratio| ratio * self.data.signal_variance[output])
    }

    /// The log evidence of all rows and outputs, in nats.
    pub fn log_evidence(&self) -> f64 {
        self.data.log_evidence
    }

    /// Room for its predictions.
    pub fn scratch(&self) -> PredictionScratch {
        let n = self.points();
        PredictionScratch {
            point: vec![0.0; self.coordinates()],
            basis: vec![0.0; self.trend.ncols()],
            correlations: vec![0.0; n],
            slopes: vec![0.0; n],
            product: vec![0.0; n],
            outputs: vec![0.0; self.outputs()],
        }
    }

    /// E f_j(x) for every output.
    ///
    /// # Panics
    /// When `point` is not d long, or `means` not m.
    pub fn mean_into(&self, point: &[f64], means: &mut [f64], scratch: &mut PredictionScratch) {
        self.place(point, scratch);
        for r2 in &mut scratch.correlations {
            *r2 = self.data.kernel.correlation(*r2);
        }
        self.means(means, scratch);
    }

    /// E f_j(x) and ∂E f_j/∂x_k, m×d row by row, in the output's unit over the coordinate's.
    ///
    /// # Panics
    /// When `point` is not d long, `means` not m, or `gradients` not m·d.
    pub fn mean_and_gradient_into(
        &self,
        point: &[f64],
        means: &mut [f64],
        gradients: &mut [f64],
        scratch: &mut PredictionScratch,
    ) {
        let d = self.coordinates();
        assert_eq!(gradients.len(), self.outputs() * d, "a gradient is as long as outputs times coordinates");
        self.place(point, scratch);
        for (r2, slope) in scratch.correlations.iter_mut().zip(&mut scratch.slopes) {
            (*r2, *slope) = self.data.kernel.correlation_and_slope(*r2);
        }
        self.means(means, scratch);
        for k in 0..d {
            let u = scratch.point[k];
            let row = self.points.scaled.row(k);
            for ((product, slope), ui) in scratch.product.iter_mut().zip(&scratch.slopes).zip(row) {
                *product = slope * (u - ui);
            }
            let factor = 2.0 / self.data.hyperparameters.length_scales[k];
            let mut sums = ArrayViewMut1::from(&mut scratch.outputs[..]);
            general_mat_vec_mul(factor, &self.weights, &ArrayView1::from(&scratch.product), 0.0, &mut sums);
            for (j, sum) in scratch.outputs.iter().enumerate() {
                let slope = match self.data.trend {
                    Trend::Constant => 0.0,
                    Trend::Linear => self.trend[[j, 1 + k]] / self.data.spread[k],
                };
                gradients[j * d + k] = self.data.scale[j] * (sum + slope);
            }
        }
    }

    /// E f_j(x) and Var f_j(x) for every output; a new row there would scatter by its noise besides.
    ///
    /// # Panics
    /// When `point` is not d long, or `means` or `variances` not m.
    pub fn predict_into(
        &self,
        point: &[f64],
        means: &mut [f64],
        variances: &mut [f64],
        scratch: &mut PredictionScratch,
    ) {
        assert_eq!(variances.len(), self.outputs(), "there is one variance an output");
        self.mean_into(point, means, scratch);
        self.covariance.factor.solve_lower_in_place(&mut scratch.correlations);
        let explained: f64 = scratch.correlations.iter().map(|v| v * v).sum();
        let half = ArrayView1::from(&scratch.correlations[..]);
        let mut rest = ArrayViewMut1::from(&mut scratch.basis[..]);
        general_mat_vec_mul(-1.0, &self.covariance.basis.t(), &half, 1.0, &mut rest);
        self.covariance.trend.solve_lower_in_place(&mut scratch.basis);
        let trend: f64 = scratch.basis.iter().map(|r| r * r).sum();
        let variance = (1.0 - explained + trend).max(0.0);
        for (out, signal) in variances.iter_mut().zip(&self.data.signal_variance) {
            *out = signal * variance;
        }
    }

    /// E f_j(x) and Var f_j(x), allocating.
    ///
    /// # Panics
    /// When `point` is not d long.
    pub fn predict(&self, point: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut means, mut variances) = (vec![0.0; self.outputs()], vec![0.0; self.outputs()]);
        self.predict_into(point, &mut means, &mut variances, &mut self.scratch());
        (means, variances)
    }

    /// u, h and the squared distances to every row.
    fn place(&self, point: &[f64], scratch: &mut PredictionScratch) {
        assert_eq!(point.len(), self.coordinates(), "a point has as many coordinates as a row");
        let PosteriorData { centre, spread, hyperparameters, .. } = &self.data;
        for (k, x) in point.iter().enumerate() {
            scratch.point[k] = (x - centre[k]) / hyperparameters.length_scales[k];
        }
        scratch.basis[0] = 1.0;
        for (k, h) in scratch.basis[1..].iter_mut().enumerate() {
            *h = (point[k] - centre[k]) / spread[k];
        }
        squared_distances_into(&mut scratch.correlations, &self.points.scaled.view(), |k| scratch.point[k]);
    }

    /// Means from h and the correlations.
    fn means(&self, means: &mut [f64], scratch: &PredictionScratch) {
        assert_eq!(means.len(), self.outputs(), "there is one mean an output");
        let correlations = ArrayView1::from(&scratch.correlations[..]);
        let mut sums = ArrayViewMut1::from(&mut means[..]);
        general_mat_vec_mul(1.0, &self.weights, &correlations, 0.0, &mut sums);
        for (j, mean) in means.iter_mut().enumerate() {
            let trend: f64 = self.trend.row(j).iter().zip(&scratch.basis).map(|(b, h)| b * h).sum();
            *mean = self.data.offset[j] + self.data.scale[j] * (*mean + trend);
        }
    }
}

impl From<GaussianProcess> for PosteriorData {
    fn from(process: GaussianProcess) -> Self {
        process.data
    }
}

impl TryFrom<PosteriorData> for GaussianProcess {
    type Error = PosteriorFault;

    fn try_from(data: PosteriorData) -> Result<Self, PosteriorFault> {
        data.check()?;
        let (n, d, m) = (data.noise.len(), data.centre.len(), data.offset.len());
        let shape = |values: &[f64], rows, columns| {
            Array2::from_shape_vec((rows, columns), values.to_vec()).unwrap_or_default()
        };
        let coordinates = shape(&data.inputs, n, d).reversed_axes();
        let scales = &data.hyperparameters.length_scales;
        let points = Points::new(&coordinates.view(), &data.centre, &data.spread, scales, data.trend);
        let covariance = Covariance::regularised(&points, data.kernel, &data.noise)?;
        let weights = shape(&data.weights, m, n);
        let trend = shape(&data.trend_coefficients, m, data.trend.size(d));
        Ok(Self { data, points, covariance, weights, trend })
    }
}

/// Everything that predictions need, but for what can be computed from it. Lists of lists are flat, row by row.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct PosteriorData {
    kernel: Kernel,
    pub trend: Trend,
    /// Value subtracted from each coordinate.
    pub centre: Vec<f64>,
    /// Divisor of each coordinate in the trend.
    pub spread: Vec<f64>,
    pub hyperparameters: Hyperparameters,
    /// n×d.
    pub inputs: Vec<f64>,
    /// Noise variance of each point over the signal's.
    pub noise: Vec<f64>,
    /// That of a single row, where it was fitted.
    pub row_noise: Option<f64>,
    pub offset: Vec<f64>,
    pub scale: Vec<f64>,
    pub signal_variance: Vec<f64>,
    /// m×n.
    pub weights: Vec<f64>,
    /// m×q.
    pub trend_coefficients: Vec<f64>,
    pub log_evidence: f64,
}

/// A posterior from a file, whose numbers do not fit together.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PosteriorFault {
    /// A list has the wrong length.
    #[error("the Gaussian process has {found} {what}; it must have {needed}")]
    Count {
        /// Content of the list.
        what: &'static str,
        /// Length that the rest asks for.
        needed: usize,
        /// Length of the list.
        found: usize,
    },
    /// A number that is infinite, not a number, or beyond its bound.
    #[error("the Gaussian process's {what} number {number} is {value}; it must be {bound}")]
    BadNumber {
        /// Content of the list.
        what: &'static str,
        /// Which one, from 1.
        number: usize,
        /// Its value.
        value: f64,
        /// Its bound.
        bound: &'static str,
    },
    /// Its covariance does not factor.
    #[error("the Gaussian process's covariance cannot be factored: {0}")]
    Singular(#[from] NotPositiveDefinite),
}

impl PosteriorData {
    /// Checks lengths and ranges.
    pub fn check(&self) -> Result<(), PosteriorFault> {
        let (n, d, m) = (self.noise.len(), self.centre.len(), self.offset.len());
        let some = |what, found: usize| {
            if found > 0 { Ok(()) } else { Err(PosteriorFault::Count { what, needed: 1, found }) }
        };
        some("points", n)?;
        some("coordinates", d)?;
        some("outputs", m)?;
        let lists: [(&'static str, usize, &[f64]); 6] = [
            ("spreads", d, &self.spread),
            ("length scales", d, &self.hyperparameters.length_scales),
            ("inputs", n.saturating_mul(d), &self.inputs),
            ("scales", m, &self.scale),
            ("signal variances", m, &self.signal_variance),
            ("weights", n.saturating_mul(m), &self.weights),
        ];
        let trend = ("trend coefficients", m * self.trend.size(d), &self.trend_coefficients[..]);
        for (what, needed, list) in lists.into_iter().chain([trend]) {
            if list.len() != needed {
                return Err(PosteriorFault::Count { what, needed, found: list.len() });
            }
        }
        let finite = [&self.centre, &self.inputs, &self.offset, &self.weights, &self.trend_coefficients];
        let names = ["centre", "input", "offset", "weight", "trend coefficient"];
        for (what, list) in names.into_iter().zip(finite) {
            numbers(what, list, |_| true, "finite")?;
        }
        let positive =
            [&self.spread, &self.hyperparameters.length_scales, &self.scale, &self.signal_variance];
        for (what, list) in ["spread", "length scale", "scale", "signal variance"].into_iter().zip(positive) {
            numbers(what, list, |value| value > 0.0, "finite and greater than 0")?;
        }
        numbers(
            "noise ratio",
            &[self.hyperparameters.noise_ratio],
            |v| v > 0.0,
            "finite and greater than 0",
        )?;
        numbers("log evidence", &[self.log_evidence], |_| true, "finite")?;
        let noise: Vec<f64> = self.noise.iter().copied().chain(self.row_noise).collect();
        numbers("noise", &noise, |value| value >= 0.0, "finite and at least 0")
    }
}

fn numbers(
    what: &'static str,
    list: &[f64],
    good: impl Fn(f64) -> bool,
    bound: &'static str,
) -> Result<(), PosteriorFault> {
    match list.iter().position(|value| !(value.is_finite() && good(*value))) {
        Some(i) => Err(PosteriorFault::BadNumber { what, number: i + 1, value: list[i], bound }),
        None => Ok(()),
    }
}
