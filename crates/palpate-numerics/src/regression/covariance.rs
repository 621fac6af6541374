//! The factored covariance of the rows.
//!
//! With S = C + b²·H·Hᵀ the signal's covariance over s² and D the noise's, C_ij = c(x_i, x_j), every computation needs
//! P = (K + b²·H·Hᵀ)⁻¹, K = C + D. The matrix inversion lemma gives it from the factors of K, n×n, and of
//! A = Hᵀ·K⁻¹·H + I/b², q×q: P = K⁻¹ − K⁻¹·H·A⁻¹·Hᵀ·K⁻¹ (Rasmussen and Williams, section 2.7). b² is never
//! added to C, so the trend's prior can be broad without a loss of digits.

use ndarray::{Array2, ArrayView2};

use super::groups::Groups;
use super::kernel::squared_distances_into;
use super::{Kernel, Trend};
use crate::{Cholesky, NotPositiveDefinite};

/// b²: the prior variance of the trend's coefficients over the signal's, for standardized coordinates.
pub(super) const TREND_VARIANCE: f64 = 1e8;
/// Addition to the diagonal of C, so that a covariance without noise has a factor despite rounding.
pub(super) const NUGGET: f64 = 1e-12;
/// Largest such addition.
const LARGEST_NUGGET: f64 = 1e-6;

/// Points of the rows, scaled for a covariance.
#[derive(Clone, Debug)]
pub(super) struct Points {
    /// u = (x − centre)/ℓ, d×n.
    pub scaled: Array2<f64>,
    /// H, n×q.
    pub basis: Array2<f64>,
}

impl Points {
    /// Points from coordinates, d×n, their centre and spread, and the length scales.
    pub fn new(
        coordinates: &ArrayView2<f64>,
        centre: &[f64],
        spread: &[f64],
        length_scales: &[f64],
        trend: Trend,
    ) -> Self {
        let over = |divisors: &[f64]| {
            let (d, n) = coordinates.dim();
            Array2::from_shape_fn((d, n), |(k, i)| (coordinates[[k, i]] - centre[k]) / divisors[k])
        };
        Self { scaled: over(length_scales), basis: trend.basis(&over(spread).view()) }
    }

    /// All points of `groups`.
    pub fn of_groups(groups: &Groups, length_scales: &[f64], trend: Trend) -> Self {
        Self::new(&groups.coordinates.view(), &groups.centre, &groups.spread, length_scales, trend)
    }

    /// C, and dC/d(r²) into `slopes`; lower triangles.
    pub fn correlations(&self, kernel: Kernel, mut slopes: Option<&mut Array2<f64>>) -> Array2<f64> {
        let n = self.scaled.ncols();
        let mut c = Array2::zeros((n, n));
        let mut r2 = vec![0.0; n];
        for (i, mut row) in c.outer_iter_mut().enumerate() {
            squared_distances_into(&mut r2[..=i], &self.scaled.view(), |k| self.scaled[[k, i]]);
            match &mut slopes {
                None => row.iter_mut().zip(&r2[..=i]).for_each(|(c, r2)| *c = kernel.correlation(*r2)),
                Some(slopes) => {
                    for ((c, slope), r2) in row.iter_mut().zip(slopes.row_mut(i)).zip(&r2[..=i]) {
                        (*c, *slope) = kernel.correlation_and_slope(*r2);
                    }
                }
            }
        }
        c
    }
}

/// K + b²·H·Hᵀ in factors.
#[derive(Clone, Debug)]
pub(super) struct Covariance {
    /// Factor L of K = L·Lᵀ.
    pub factor: Cholesky,
    /// L⁻¹·H, n×q.
    pub basis: Array2<f64>,
    /// Factor of A.
    pub trend: Cholesky,
}

impl Covariance {
    /// The factors from the lower triangle of C, the noise variance of every row over the signal's, and H.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] when no factor exists because of rounding.
    pub fn new(
        mut correlations: Array2<f64>,
        noise: &[f64],
        basis: &Array2<f64>,
        nugget: f64,
    ) -> Result<Self, NotPositiveDefinite> {
        for (i, noise) in noise.iter().enumerate() {
            correlations[[i, i]] += noise + nugget;
        }
        let factor = Cholesky::factor(correlations)?;
        let basis = factor.solve_lower_matrix(basis.clone());
        let mut a = basis.t().dot(&basis);
        a.diag_mut().mapv_inplace(|value| value + 1.0 / TREND_VARIANCE);
        let trend = factor_with_nugget(&a)?;
        Ok(Self { factor, basis, trend })
    }

    /// Factors as [`Self::new`] does, with the smallest sufficient nugget.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] when even the largest nugget is insufficient.
    pub fn regularised(points: &Points, kernel: Kernel, noise: &[f64]) -> Result<Self, NotPositiveDefinite> {
        let mut nugget = NUGGET;
        loop {
            match Self::new(points.correlations(kernel, None), noise, &points.basis, nugget) {
                Err(_) if nugget < LARGEST_NUGGET => nugget *= 100.0,
                done => return done,
            }
        }
    }

    /// ln det(K + b²·H·Hᵀ).
    pub fn log_determinant(&self) -> f64 {
        let terms = self.trend.size() as f64;
        self.factor.log_determinant() + self.trend.log_determinant() + terms * TREND_VARIANCE.ln()
    }

    /// α = P·y and the trend's coefficients β = A⁻¹·Hᵀ·K⁻¹·y, for each column of y, n×m: n×m and q×m.
    pub fn solve(&self, outputs: &Array2<f64>) -> (Array2<f64>, Array2<f64>) {
        let half = self.factor.solve_lower_matrix(outputs.as_standard_layout().into_owned());
        let beta = self.trend.solve_matrix(self.basis.t().dot(&half));
        let alpha = self.factor.solve_upper_matrix(half - self.basis.dot(&beta));
        (alpha, beta)
    }

    /// P.
    pub fn inverse(&self) -> Array2<f64> {
        let inverse_lower = self.factor.inverse_lower();
        let mut p = Cholesky::gram_of_lower(&inverse_lower);
        // W·Wᵀ = K⁻¹·H·A⁻¹·Hᵀ·K⁻¹ with W = L⁻ᵀ·(L⁻¹·H)·R⁻ᵀ, A = R·Rᵀ.
        let w = self.trend.solve_lower_matrix(self.basis.t().dot(&inverse_lower));
        ndarray::linalg::general_mat_mul(-1.0, &w.t(), &w, 1.0, &mut p);
        p
    }
}

/// Factors A. For collinear coordinates only 1/b² keeps A regular, and rounding can remove it; then a small multiple of the trace is
/// added.
fn factor_with_nugget(a: &Array2<f64>) -> Result<Cholesky, NotPositiveDefinite> {
    let trace = a.diag().sum();
    let mut added = 1e-15;
    let mut done = Cholesky::factor(a.clone());
    while done.is_err() && added < 1e-8 {
        let mut more = a.clone();
        more.diag_mut().mapv_inplace(|value| value + added * trace);
        done = Cholesky::factor(more);
        added *= 10.0;
    }
    done
}
