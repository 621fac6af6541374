//! Sparse posterior from inducing points u (Snelson and Ghahramani, *Sparse Gaussian Processes using
//! Pseudo-inputs*, 2006).
//!
//! With C_uu = L·Lᵀ and φ(x) = L⁻¹·c(u, x), the process is φ·w + h·β and an independent remainder of variance
//! 1 − |φ|². For rows of noise D_i it is a regression on z = (φ, h) with variances Λ_i = D_i + 1 − |φ_i|²: A
//! = diag(1 … 1, 1/b² …) + Σ z_i·z_iᵀ/Λ_i = R·Rᵀ, with the posterior variance 1 − |φ|² + |R⁻¹·z|².

use super::blocks::{Triangle, cross_correlations};
use super::covariance::{NUGGET, TREND_VARIANCE};
use super::{Kernel, RegressionError};
use crate::watch::Watch;
use crate::{Cholesky, NotPositiveDefinite, random_order};
use ndarray::linalg::general_mat_mul;
use ndarray::{Array1, Array2, ArrayView2, Axis, s};

/// Largest number of points for the variance.
pub(super) const OF_VARIANCE: usize = 256;
/// Largest number of inducing points.
pub const INDUCING: usize = 1000;
const CANDIDATES: usize = 4000;
/// Negligible variance, as a share of the noise.
const SMALL: f64 = 0.02;
const ROWS: usize = 512;

/// Greedy selection by pivoted Cholesky factorisation.
pub(super) fn chosen(kernel: Kernel, scaled: &ArrayView2<f64>, ratio: f64, most: usize) -> Vec<usize> {
    let n = scaled.ncols();
    let mut candidates = random_order(n, 0);
    candidates.truncate(CANDIDATES);
    candidates.sort_unstable();
    let points = scaled.select(Axis(1), &candidates);
    let count = candidates.len();
    let mut left = vec![1.0 + NUGGET; count];
    let mut factor: Vec<Vec<f64>> = Vec::new();
    let mut chosen = Vec::new();
    while chosen.len() < most.min(count) {
        let best = (0..count).max_by(|a, b| left[*a].total_cmp(&left[*b]).then(b.cmp(a))).unwrap_or(0);
        if left[best] <= (SMALL * ratio).max(1e3 * NUGGET) {
            break;
        }
        let place = points.slice(s![.., best..=best]);
        let mut column = cross_correlations(kernel, &place, &points.view()).into_raw_vec_and_offset().0;
        for earlier in &factor {
            let own = earlier[best];
            column.iter_mut().zip(earlier).for_each(|(sum, value)| *sum -= own * value);
        }
        let pivot = left[best].sqrt();
        for (value, left) in column.iter_mut().zip(&mut left) {
            *value /= pivot;
            *left -= *value * *value;
        }
        left[best] = f64::NEG_INFINITY;
        factor.push(column);
        chosen.push(candidates[best]);
    }
    chosen
}

#[derive(Clone, Debug)]
pub(super) struct Reduced {
    chosen: Vec<usize>,
    /// L⁻¹.
    whiten: Triangle,
    /// R⁻¹.
    shrink: Triangle,
}

#[derive(Clone, Debug, Default)]
pub(super) struct ReducedScratch {
    correlations: Vec<f64>,
    basis: Vec<[f64; 8]>,
    product: Vec<[f64; 8]>,
}

impl Reduced {
    pub fn new(
        kernel: Kernel,
        scaled: &ArrayView2<f64>,
        chosen: Vec<usize>,
        factor: &Cholesky,
    ) -> Result<Self, NotPositiveDefinite> {
        let whiten = factor_of(kernel, &scaled.select(Axis(1), &chosen).view())?;
        Ok(Self {
            chosen,
            whiten: Triangle::new(&whiten.inverse_lower().view()),
            shrink: Triangle::new(&factor.inverse_lower().view()),
        })
    }

    /// Creates buffers.
    pub fn scratch(&self) -> ReducedScratch {
        let size = self.chosen.len();
        ReducedScratch {
            correlations: vec![0.0; size],
            basis: vec![[0.0; 8]; size / 8 + 2],
            product: vec![[0.0; 8]; size / 8 + 2],
        }
    }

    /// Var/s², from the correlations with all points and h.
    pub fn variance(&self, all: &[f64], h: &[f64], scratch: &mut ReducedScratch) -> f64 {
        let ReducedScratch { correlations, basis, product } = scratch;
        correlations.iter_mut().zip(&self.chosen).for_each(|(c, point)| *c = all[*point]);
        let explained = self.whiten.product_into(correlations, basis);
        let size = self.chosen.len();
        let basis = &mut basis.as_flattened_mut()[..size + h.len()];
        basis[size..].copy_from_slice(h);
        (1.0 - explained).max(0.0) + self.shrink.product_into(basis, product)
    }
}

/// L of C_uu.
fn factor_of(kernel: Kernel, points: &ArrayView2<f64>) -> Result<Cholesky, NotPositiveDefinite> {
    let mut correlations = cross_correlations(kernel, points, points);
    correlations.diag_mut().mapv_inplace(|c| c + NUGGET);
    Cholesky::factor(correlations)
}

#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    /// u, d×n.
    pub scaled: ArrayView2<'a, f64>,
    /// H, n×q.
    pub basis: ArrayView2<'a, f64>,
    /// ȳ, n×m.
    pub means: ArrayView2<'a, f64>,
    /// D, over s².
    pub noise: &'a [f64],
}

pub(super) struct ReducedPosterior {
    /// α, k×m; β, q×m.
    pub weights: Array2<f64>,
    pub trend: Array2<f64>,
    /// ȳᵀ·(Q + Λ)⁻¹·ȳ by output.
    pub quadratics: Vec<f64>,
    /// ln det(Q + Λ).
    pub log_determinant: f64,
    /// R of the first [`OF_VARIANCE`] points.
    pub variance: Cholesky,
    /// Posterior covariance at the chosen points and of β, over s².
    pub covariance: Array2<f64>,
}

pub(super) fn learn(
    kernel: Kernel,
    rows: Rows,
    chosen: &[usize],
    watch: Watch,
) -> Result<ReducedPosterior, RegressionError> {
    let (n, terms, outputs) = (rows.scaled.ncols(), rows.basis.ncols(), rows.means.ncols());
    let points = rows.scaled.select(Axis(1), chosen);
    let whiten = factor_of(kernel, &points.view())?;
    let (all, first) = (chosen.len(), chosen.len().min(OF_VARIANCE));
    let mut of_mean = Sums::new(all, terms, outputs);
    let mut of_variance = Sums::new(first, terms, 0);
    let (mut log_noise, mut square) = (0.0, vec![0.0; outputs]);
    for start in (0..n).step_by(ROWS) {
        watch.counted("learning from all presses", "presses", start, n)?;
        let these = start..(start + ROWS).min(n);
        let correlations =
            cross_correlations(kernel, &points.view(), &rows.scaled.slice(s![.., these.clone()]));
        let functions = whiten.solve_lower_matrix(correlations);
        let left = |count: usize| -> Vec<f64> {
            let explained = functions.slice(s![..count, ..]).map_axis(Axis(0), |phi| phi.dot(&phi));
            explained
                .iter()
                .zip(&rows.noise[these.clone()])
                .map(|(e, noise)| noise + (1.0 - e).max(0.0) + NUGGET)
                .collect()
        };
        let basis = rows.basis.slice(s![these.clone(), ..]);
        let means = rows.means.slice(s![these.clone(), ..]);
        let variances = left(all);
        of_mean.add(&functions.view(), &basis, &means, &variances);
        let none = means.slice(s![.., ..0]);
        of_variance.add(&functions.slice(s![..first, ..]), &basis, &none, &left(first));
        log_noise += variances.iter().map(|v| v.ln()).sum::<f64>();
        for (mean, variance) in means.outer_iter().zip(&variances) {
            square.iter_mut().zip(mean).for_each(|(sum, y)| *sum += y * y / variance);
        }
    }
    let Sums { precision, scores } = of_mean;
    let factor = Cholesky::factor(precision)?;
    let half = factor.solve_lower_matrix(scores);
    let explained = half.map_axis(Axis(0), |half| half.dot(&half));
    let solved = factor.solve_upper_matrix(half);
    let weights = whiten.solve_upper_matrix(solved.slice(s![..all, ..]).to_owned());
    let trend = solved.slice(s![all.., ..]).to_owned();
    // The process is L·w at the chosen points.
    let mut values = factor.inverse_lower();
    let at_points = values.slice(s![.., ..all]).dot(&whiten.lower().t());
    values.slice_mut(s![.., ..all]).assign(&at_points);
    Ok(ReducedPosterior {
        weights,
        trend,
        quadratics: square
            .iter()
            .zip(&explained)
            .map(|(square, explained)| (square - explained).max(0.0))
            .collect(),
        log_determinant: log_noise + factor.log_determinant() + terms as f64 * TREND_VARIANCE.ln(),
        variance: Cholesky::factor(of_variance.precision)?,
        covariance: values.t().dot(&values),
    })
}

/// A, and Σ z_i·ȳ_iᵀ/Λ_i.
struct Sums {
    precision: Array2<f64>,
    scores: Array2<f64>,
}

impl Sums {
    fn new(functions: usize, terms: usize, outputs: usize) -> Self {
        let mut diagonal = Array1::from_elem(functions + terms, 1.0);
        diagonal.slice_mut(s![functions..]).fill(1.0 / TREND_VARIANCE);
        Self { precision: Array2::from_diag(&diagonal), scores: Array2::zeros((functions + terms, outputs)) }
    }

    /// Adds r rows: φ, k×r, h, r×q, ȳ, r×m, and Λ.
    fn add(
        &mut self,
        functions: &ArrayView2<f64>,
        basis: &ArrayView2<f64>,
        means: &ArrayView2<f64>,
        variances: &[f64],
    ) {
        let mut z = ndarray::concatenate![Axis(0), *functions, basis.t()];
        for (mut column, variance) in z.columns_mut().into_iter().zip(variances) {
            column /= variance.sqrt();
        }
        // The lower triangle, some columns at a time.
        const COLUMNS: usize = 256;
        let size = z.nrows();
        for start in (0..size).step_by(COLUMNS) {
            let end = (start + COLUMNS).min(size);
            let mut part = self.precision.slice_mut(s![start.., start..end]);
            general_mat_mul(1.0, &z.slice(s![start.., ..]), &z.slice(s![start..end, ..]).t(), 1.0, &mut part);
        }
        if means.ncols() == 0 {
            return;
        }
        let mut scaled = means.to_owned();
        for (mut row, variance) in scaled.outer_iter_mut().zip(variances) {
            row /= variance.sqrt();
        }
        general_mat_mul(1.0, &z, &scaled, 1.0, &mut self.scores);
    }
}
