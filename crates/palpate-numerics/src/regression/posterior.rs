//! Posterior and predictions of a Gaussian process.

use ndarray::linalg::general_mat_vec_mul;
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, ArrayViewMut1, Axis};

use super::blocks::{Blocks, Triangle};
use super::covariance::{Covariance, Points};
use super::evidence::{evidence_of, log_evidence, signal_variances, variances_of, with_scatter};
use super::groups::Groups;
use super::kernel::squared_distances_into;
use super::reduced::{self, INDUCING, OF_VARIANCE, Reduced, ReducedScratch, Rows};
use super::{Hyperparameters, Kernel, RegressionError, Trend};
use crate::watch::Watch;
use crate::{Cholesky, NotPositiveDefinite};

/// Posterior of m functions of d coordinates, exact up to [`MOST_EXACT`] points, otherwise sparse.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(into = "PosteriorData", try_from = "PosteriorData")]
pub struct GaussianProcess {
    data: PosteriorData,
    points: Points,
    blocks: Blocks,
    variance: Variance,
    /// α, m×n.
    weights: Array2<f64>,
    /// β, m×q.
    trend: Array2<f64>,
    /// Posterior covariance at the points and of β, over s²; after a sparse fit.
    covariance: Option<Array2<f64>>,
}

/// Largest number of points of an exact posterior.
pub const MOST_EXACT: usize = 4096;
/// Largest number of points of an exact variance.
const MOST_EXACT_VARIANCE: usize = 512;

#[derive(Clone, Debug)]
enum Variance {
    /// L⁻¹, with L⁻¹·H and the factor of A.
    Exact { whiten: Triangle, basis: Array2<f64>, trend: Cholesky },
    /// From chosen points.
    Reduced(Reduced),
}

impl Variance {
    fn of_points(
        points: &Points,
        kernel: Kernel,
        noise: &[f64],
        ratio: f64,
        exact: Option<Covariance>,
    ) -> Result<Self, RegressionError> {
        if points.scaled.ncols() <= MOST_EXACT_VARIANCE {
            let covariance = exact.map_or_else(|| Covariance::regularised(points, kernel, noise), Ok)?;
            let whiten = Triangle::new(&covariance.factor.inverse_lower().view());
            return Ok(Self::Exact { whiten, basis: covariance.basis, trend: covariance.trend });
        }
        let chosen = reduced::chosen(kernel, &points.scaled.view(), ratio, OF_VARIANCE);
        let none = Array2::zeros((noise.len(), 0));
        let rows =
            Rows { scaled: points.scaled.view(), basis: points.basis.view(), means: none.view(), noise };
        let learnt = reduced::learn(kernel, rows, &chosen, Watch::NONE)?;
        Ok(Self::Reduced(Reduced::new(kernel, &points.scaled.view(), chosen, &learnt.variance)?))
    }
}

/// Buffers for predictions.
#[derive(Clone, Debug)]
pub struct PredictionScratch {
    point: Vec<f64>,
    /// h, then its unexplained part.
    basis: Vec<f64>,
    correlations: Vec<[f64; 8]>,
    reduced: ReducedScratch,
    /// dc/d(r²).
    slopes: Vec<f64>,
    /// L⁻¹·c; or r², then slopes times u − u_i.
    product: Vec<[f64; 8]>,
    outputs: Vec<f64>,
}

impl PartialEq for GaussianProcess {
    fn eq(&self, other: &Self) -> bool {
        self.data == other.data
    }
}

impl GaussianProcess {
    pub(super) fn of_groups(
        groups: &Groups,
        kernel: Kernel,
        trend: Trend,
        hyperparameters: &Hyperparameters,
        watch: Watch,
    ) -> Result<Self, RegressionError> {
        if groups.len() > MOST_EXACT {
            return Self::of_chosen(groups, kernel, trend, hyperparameters, watch);
        }
        let ratio = hyperparameters.noise_ratio;
        let scales = &hyperparameters.length_scales;
        let points = Points::of_groups(groups, scales, trend);
        let noise = groups.noise_ratios(ratio);
        let covariance = Covariance::regularised(&points, kernel, &noise)?;
        let (alpha, beta) = covariance.solve(&groups.means);
        let signal = signal_variances(groups, ratio, &alpha);
        let log_evidence = log_evidence(groups, ratio, &covariance, &alpha);
        let inputs = groups.coordinates.t().iter().copied().collect();
        let data = PosteriorData {
            noise: noise.clone(),
            log_evidence,
            ..PosteriorData::new(groups, (kernel, trend), hyperparameters, inputs, &signal, (&alpha, &beta))
        };
        let variance = Variance::of_points(&points, kernel, &noise, ratio, Some(covariance))?;
        Ok(Self::assemble(data, points, variance))
    }

    pub(super) fn of_chosen(
        groups: &Groups,
        kernel: Kernel,
        trend: Trend,
        hyperparameters: &Hyperparameters,
        watch: Watch,
    ) -> Result<Self, RegressionError> {
        let ratio = hyperparameters.noise_ratio;
        let scales = &hyperparameters.length_scales;
        let all = Points::of_groups(groups, scales, trend);
        let noise = groups.noise_ratios(ratio);
        let chosen = reduced::chosen(kernel, &all.scaled.view(), ratio, INDUCING);
        let rows = Rows {
            scaled: all.scaled.view(),
            basis: all.basis.view(),
            means: groups.means.view(),
            noise: &noise,
        };
        let learnt = reduced::learn(kernel, rows, &chosen, watch)?;
        let quadratics = with_scatter(groups, ratio, &learnt.quadratics);
        let signal = variances_of(groups, ratio, &quadratics);
        let inputs = groups.coordinates.select(Axis(1), &chosen);
        let first = chosen.len().min(OF_VARIANCE);
        let data = PosteriorData {
            noise: chosen.iter().map(|i| noise[*i]).collect(),
            log_evidence: evidence_of(groups, ratio, learnt.log_determinant, &quadratics),
            sparse: Some(SparseData {
                points: groups.len(),
                factor: packed(&learnt.variance.lower(), first + trend.size(scales.len())),
            }),
            ..PosteriorData::new(
                groups,
                (kernel, trend),
                hyperparameters,
                inputs.t().iter().copied().collect(),
                &signal,
                (&learnt.weights, &learnt.trend),
            )
        };
        let points = Points::new(&inputs.view(), &groups.centre, &groups.standard_deviations, scales, trend);
        let reduced = Reduced::new(kernel, &points.scaled.view(), (0..first).collect(), &learnt.variance)?;
        let process = Self::assemble(data, points, Variance::Reduced(reduced));
        Ok(Self { covariance: Some(learnt.covariance), ..process })
    }

    fn assemble(data: PosteriorData, points: Points, variance: Variance) -> Self {
        let (d, n) = points.scaled.dim();
        let m = data.offset.len();
        let shape = |values: &[f64], rows, columns| {
            Array2::from_shape_vec((rows, columns), values.to_vec()).unwrap_or_default()
        };
        let weights = shape(&data.weights, m, n);
        let trend = shape(&data.trend_coefficients, m, data.trend.size(d));
        let blocks = Blocks::new(data.kernel, &points.scaled.view(), &weights.view());
        Self { data, points, blocks, variance, weights, trend, covariance: None }
    }

    /// Number of coordinates, d.
    pub fn coordinates(&self) -> usize {
        self.points.scaled.nrows()
    }

    /// Number of outputs, m.
    pub fn outputs(&self) -> usize {
        self.weights.nrows()
    }

    /// Number of distinct points in the samples.
    pub fn points(&self) -> usize {
        self.data.sparse.as_ref().map_or(self.point_count(), |sparse| sparse.points)
    }

    /// Points that represent the mean, n.
    pub fn point_count(&self) -> usize {
        self.points.scaled.ncols()
    }

    /// Fitted or given hyperparameters.
    pub fn hyperparameters(&self) -> &Hyperparameters {
        &self.data.hyperparameters
    }

    /// Signal variance s_j².
    pub fn signal_variance(&self, output: usize) -> f64 {
        self.data.signal_variance[output]
    }

    /// Fitted noise variance η·s_j²; `None` for given noise.
    pub fn noise_variance(&self, output: usize) -> Option<f64> {
        self.data.row_noise.map(|ratio| ratio * self.data.signal_variance[output])
    }

    /// Log evidence, in nats.
    pub fn log_evidence(&self) -> f64 {
        self.data.log_evidence
    }

    /// Creates buffers.
    pub fn scratch(&self) -> PredictionScratch {
        let n = self.point_count();
        let reduced = match &self.variance {
            Variance::Exact { .. } => ReducedScratch::default(),
            Variance::Reduced(reduced) => reduced.scratch(),
        };
        PredictionScratch {
            point: vec![0.0; self.coordinates()],
            basis: vec![0.0; self.trend.ncols()],
            correlations: vec![[0.0; 8]; n.div_ceil(8)],
            reduced,
            slopes: vec![0.0; n],
            product: vec![[0.0; 8]; n.div_ceil(8)],
            outputs: vec![0.0; self.outputs()],
        }
    }

    /// Writes E f_j(x).
    ///
    /// # Panics
    /// On wrong lengths.
    pub fn mean_into(&self, point: &[f64], means: &mut [f64], scratch: &mut PredictionScratch) {
        self.place(point, scratch);
        self.means(means, scratch);
    }

    /// Writes E f_j(x) and ∂E f_j/∂x_k, m×d.
    ///
    /// # Panics
    /// On wrong lengths.
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
        self.means(means, scratch);
        let n = self.point_count();
        let PredictionScratch { point, slopes, product, outputs, .. } = scratch;
        let product = &mut product.as_flattened_mut()[..n];
        squared_distances_into(product, &self.points.scaled.view(), |k| point[k]);
        for (slope, r2) in slopes.iter_mut().zip(&*product) {
            *slope = self.data.kernel.correlation_and_slope(*r2).1;
        }
        for k in 0..d {
            let u = point[k];
            let row = self.points.scaled.row(k);
            for ((product, slope), ui) in product.iter_mut().zip(&*slopes).zip(row) {
                *product = slope * (u - ui);
            }
            let factor = 2.0 / self.data.hyperparameters.length_scales[k];
            let mut sums = ArrayViewMut1::from(&mut outputs[..]);
            general_mat_vec_mul(factor, &self.weights, &ArrayView1::from(&*product), 0.0, &mut sums);
            for (j, sum) in outputs.iter().enumerate() {
                let slope = match self.data.trend {
                    Trend::Constant => 0.0,
                    Trend::Linear => self.trend[[j, 1 + k]] / self.data.standard_deviations[k],
                };
                gradients[j * d + k] = self.data.scale[j] * (sum + slope);
            }
        }
    }

    /// Writes E f_j(x) and Var f_j(x), without noise.
    ///
    /// # Panics
    /// On wrong lengths.
    pub fn predict_into(
        &self,
        point: &[f64],
        means: &mut [f64],
        variances: &mut [f64],
        scratch: &mut PredictionScratch,
    ) {
        assert_eq!(variances.len(), self.outputs(), "there is one variance an output");
        self.mean_into(point, means, scratch);
        let variance = self.relative_variance(scratch);
        for (out, signal) in variances.iter_mut().zip(&self.data.signal_variance) {
            *out = signal * variance;
        }
    }

    /// Var f_j(x)/s_j².
    fn relative_variance(&self, scratch: &mut PredictionScratch) -> f64 {
        let correlations = &scratch.correlations.as_flattened()[..self.point_count()];
        match &self.variance {
            Variance::Reduced(reduced) => {
                reduced.variance(correlations, &scratch.basis, &mut scratch.reduced)
            }
            Variance::Exact { whiten, basis, trend } => {
                let explained = whiten.product_into(correlations, &mut scratch.product);
                let half = ArrayView1::from(&scratch.product.as_flattened()[..self.point_count()]);
                let mut rest = ArrayViewMut1::from(&mut scratch.basis[..]);
                general_mat_vec_mul(-1.0, &basis.t(), &half, 1.0, &mut rest);
                trend.solve_lower_in_place(&mut scratch.basis);
                (1.0 - explained + scratch.basis.iter().map(|r| r * r).sum::<f64>()).max(0.0)
            }
        }
    }

    /// Writes E f_j(x) and returns Var f_j(x)/s_j², for tables: a reduced variance, or that from the nearest
    /// points, if smaller.
    ///
    /// # Panics
    /// On wrong lengths.
    pub fn tabulate_into(&self, point: &[f64], means: &mut [f64], scratch: &mut PredictionScratch) -> f64 {
        self.mean_into(point, means, scratch);
        let variance = self.relative_variance(scratch);
        let correlations = &scratch.correlations.as_flattened()[..self.point_count()];
        let by_nearest = match (&self.variance, &self.data.sparse, &self.covariance) {
            (Variance::Reduced(_), None, _) => self.variance_by_nearest(correlations, &scratch.basis),
            (Variance::Reduced(_), Some(_), Some(covariance)) => {
                self.variance_by_nearest_values(covariance, correlations, &scratch.basis)
            }
            _ => None,
        };
        by_nearest.map_or(variance, |near| near.min(variance))
    }

    /// Nearest points, unordered.
    fn nearest(correlations: &[f64]) -> (Vec<usize>, Array1<f64>) {
        const NEAREST: usize = 32;
        let mut order: Vec<usize> = (0..correlations.len()).collect();
        let by_distance = |a: &usize, b: &usize| correlations[*b].total_cmp(&correlations[*a]).then(a.cmp(b));
        order.select_nth_unstable_by(NEAREST.min(correlations.len() - 1), by_distance);
        order.truncate(NEAREST);
        let here = order.iter().map(|i| correlations[*i]).collect();
        (order, here)
    }

    /// Variance from the rows at the nearest points, an upper bound.
    fn variance_by_nearest(&self, correlations: &[f64], h: &[f64]) -> Option<f64> {
        let (nearest, here) = Self::nearest(correlations);
        let points = Points {
            scaled: self.points.scaled.select(Axis(1), &nearest),
            basis: self.points.basis.select(Axis(0), &nearest),
        };
        let noise: Vec<f64> = nearest.iter().map(|i| self.data.noise[*i]).collect();
        let covariance = Covariance::regularised(&points, self.data.kernel, &noise).ok()?;
        let half = covariance.factor.solve_lower(&here);
        let rest = covariance.trend.solve_lower(&(&ArrayView1::from(h) - &half.dot(&covariance.basis)));
        Some((1.0 - half.dot(&half) + rest.dot(&rest)).max(0.0))
    }

    /// Variance from the posterior values at the nearest points, plus the conditional variance.
    fn variance_by_nearest_values(
        &self,
        covariance: &Array2<f64>,
        correlations: &[f64],
        h: &[f64],
    ) -> Option<f64> {
        let (nearest, here) = Self::nearest(correlations);
        let without_trend = Array2::zeros((nearest.len(), 0));
        let points = Points { scaled: self.points.scaled.select(Axis(1), &nearest), basis: without_trend };
        let without_noise = vec![0.0; nearest.len()];
        let factor = Covariance::regularised(&points, self.data.kernel, &without_noise).ok()?.factor;
        let half = factor.solve_lower(&here);
        let open = (1.0 - half.dot(&half)).max(0.0);
        let weights: Vec<f64> = factor.solve_upper(&half).iter().chain(h).copied().collect();
        let trend = self.point_count()..self.point_count() + h.len();
        let entries: Vec<usize> = nearest.into_iter().chain(trend).collect();
        let told: f64 = entries
            .iter()
            .zip(&weights)
            .map(|(i, wi)| {
                wi * entries.iter().zip(&weights).map(|(j, wj)| wj * covariance[[*i, *j]]).sum::<f64>()
            })
            .sum();
        Some(open + told.max(0.0))
    }

    /// Returns E f_j(x) and Var f_j(x).
    ///
    /// # Panics
    /// On a wrong length.
    pub fn predict(&self, point: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut means, mut variances) = (vec![0.0; self.outputs()], vec![0.0; self.outputs()]);
        self.predict_into(point, &mut means, &mut variances, &mut self.scratch());
        (means, variances)
    }

    fn place(&self, point: &[f64], scratch: &mut PredictionScratch) {
        assert_eq!(point.len(), self.coordinates(), "a point has as many coordinates as a row");
        let PosteriorData { centre, standard_deviations: spread, hyperparameters, .. } = &self.data;
        for (k, x) in point.iter().enumerate() {
            scratch.point[k] = (x - centre[k]) / hyperparameters.length_scales[k];
        }
        scratch.basis[0] = 1.0;
        for (k, h) in scratch.basis[1..].iter_mut().enumerate() {
            *h = (point[k] - centre[k]) / spread[k];
        }
    }

    fn means(&self, means: &mut [f64], scratch: &mut PredictionScratch) {
        assert_eq!(means.len(), self.outputs(), "there is one mean an output");
        self.blocks.sums_into(&scratch.point, &mut scratch.correlations, means);
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
        let (n, d) = (data.noise.len(), data.centre.len());
        let coordinates =
            Array2::from_shape_vec((n, d), data.inputs.clone()).unwrap_or_default().reversed_axes();
        let Hyperparameters { length_scales, noise_ratio } = &data.hyperparameters;
        let points = Points::new(
            &coordinates.view(),
            &data.centre,
            &data.standard_deviations,
            length_scales,
            data.trend,
        );
        let variance = match &data.sparse {
            None => Variance::of_points(&points, data.kernel, &data.noise, *noise_ratio, None)?,
            Some(sparse) => {
                let first = n.min(OF_VARIANCE);
                let factor =
                    Cholesky::from_lower(&unpacked(&sparse.factor, first + data.trend.size(d)).view());
                let chosen = (0..first).collect();
                Variance::Reduced(Reduced::new(data.kernel, &points.scaled.view(), chosen, &factor)?)
            }
        };
        Ok(Self::assemble(data, points, variance))
    }
}

fn packed(lower: &ArrayView2<f64>, size: usize) -> Vec<f64> {
    (0..size).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|at| lower[at]).collect()
}

fn unpacked(list: &[f64], size: usize) -> Array2<f64> {
    Array2::from_shape_fn((size, size), |(i, j)| if j <= i { list[i * (i + 1) / 2 + j] } else { 0.0 })
}

/// Serialised data; matrices are flat, row by row.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct PosteriorData {
    kernel: Kernel,
    pub trend: Trend,
    /// Mean of each coordinate.
    pub centre: Vec<f64>,
    /// Standard deviation of each coordinate.
    #[serde(rename = "spread")]
    pub standard_deviations: Vec<f64>,
    pub hyperparameters: Hyperparameters,
    /// n×d.
    pub inputs: Vec<f64>,
    /// Noise of each point, over s².
    pub noise: Vec<f64>,
    /// η; `None` for given noise.
    pub row_noise: Option<f64>,
    pub offset: Vec<f64>,
    pub scale: Vec<f64>,
    pub signal_variance: Vec<f64>,
    /// m×n.
    pub weights: Vec<f64>,
    /// m×q.
    pub trend_coefficients: Vec<f64>,
    pub log_evidence: f64,
    /// `None` for an exact posterior.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sparse: Option<SparseData>,
}

#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct SparseData {
    /// Number of all points.
    points: usize,
    /// R, row by row.
    factor: Vec<f64>,
}

/// Error of an inconsistent file.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PosteriorFault {
    /// A list has the wrong length.
    #[error("the Gaussian process has {found} {what}; it must have {needed}")]
    Count {
        /// Name of the list.
        what: &'static str,
        /// Required length.
        needed: usize,
        /// Length.
        found: usize,
    },
    /// A number is out of range.
    #[error("the Gaussian process's {what} number {number} is {value}; it must be {bound}")]
    BadNumber {
        /// Name of the list.
        what: &'static str,
        /// Index, from 1.
        number: usize,
        /// Value.
        value: f64,
        /// Bound.
        bound: &'static str,
    },
    /// The covariance is not positive definite.
    #[error("the Gaussian process's covariance cannot be factored: {0}")]
    Singular(#[from] NotPositiveDefinite),
    /// The variance cannot be computed.
    #[error(transparent)]
    Regression(#[from] RegressionError),
}

impl PosteriorData {
    fn new(
        groups: &Groups,
        (kernel, trend): (Kernel, Trend),
        hyperparameters: &Hyperparameters,
        inputs: Vec<f64>,
        signal: &[f64],
        (alpha, beta): (&Array2<f64>, &Array2<f64>),
    ) -> Self {
        Self {
            kernel,
            trend,
            centre: groups.centre.clone(),
            standard_deviations: groups.standard_deviations.clone(),
            hyperparameters: hyperparameters.clone(),
            inputs,
            noise: Vec::new(),
            row_noise: if groups.noise_given { None } else { Some(hyperparameters.noise_ratio) },
            offset: groups.offset.clone(),
            scale: groups.scale.clone(),
            signal_variance: signal.iter().zip(&groups.scale).map(|(s2, scale)| s2 * scale * scale).collect(),
            weights: alpha.t().iter().copied().collect(),
            trend_coefficients: beta.t().iter().copied().collect(),
            log_evidence: 0.0,
            sparse: None,
        }
    }

    pub fn check(&self) -> Result<(), PosteriorFault> {
        let (n, d, m) = (self.noise.len(), self.centre.len(), self.offset.len());
        let some = |what, found: usize| {
            if found > 0 { Ok(()) } else { Err(PosteriorFault::Count { what, needed: 1, found }) }
        };
        some("points", n)?;
        some("coordinates", d)?;
        some("outputs", m)?;
        let lists: [(&'static str, usize, &[f64]); 6] = [
            ("spreads", d, &self.standard_deviations),
            ("length scales", d, &self.hyperparameters.length_scales),
            ("inputs", n.saturating_mul(d), &self.inputs),
            ("scales", m, &self.scale),
            ("signal variances", m, &self.signal_variance),
            ("weights", n.saturating_mul(m), &self.weights),
        ];
        let trend = ("trend coefficients", m * self.trend.size(d), &self.trend_coefficients[..]);
        let size = n.min(OF_VARIANCE).saturating_add(self.trend.size(d));
        let factor = self
            .sparse
            .as_ref()
            .map(|sparse| ("variance factors", size.saturating_mul(size + 1) / 2, sparse.factor.as_slice()));
        for (what, needed, list) in lists.into_iter().chain([trend]).chain(factor) {
            if list.len() != needed {
                return Err(PosteriorFault::Count { what, needed, found: list.len() });
            }
        }
        let finite = [&self.centre, &self.inputs, &self.offset, &self.weights, &self.trend_coefficients];
        let names = ["centre", "input", "offset", "weight", "trend coefficient"];
        for (what, list) in names.into_iter().zip(finite) {
            numbers(what, list, |_| true, "finite")?;
        }
        let positive = [
            &self.standard_deviations,
            &self.hyperparameters.length_scales,
            &self.scale,
            &self.signal_variance,
        ];
        for (what, list) in ["spread", "length scale", "scale", "signal variance"].into_iter().zip(positive) {
            numbers(what, list, |value| value > 0.0, "finite and greater than 0")?;
        }
        numbers(
            "noise ratio",
            &[self.hyperparameters.noise_ratio],
            |v| v > 0.0,
            "finite and greater than 0",
        )?;
        if let Some(SparseData { factor, .. }) = &self.sparse {
            numbers("variance factor", factor, |_| true, "finite")?;
            let diagonal: Vec<f64> = (0..size).map(|i| factor[i * (i + 3) / 2]).collect();
            numbers("variance factor", &diagonal, |value| value > 0.0, "finite and greater than 0")?;
        }
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
