//! The factored covariance of the rows.
//!
//! With C_ij = c(x_i, x_j), noise D and K = C + D, P = (K + b²·H·Hᵀ)⁻¹ = K⁻¹ − K⁻¹·H·A⁻¹·Hᵀ·K⁻¹, A =
//! Hᵀ·K⁻¹·H + I/b², q×q (Rasmussen and Williams, section 2.7). A large b² costs no digits.

use ndarray::{Array2, ArrayView2};

use super::groups::Groups;
use super::kernel::squared_distances_into;
use super::{Kernel, Trend};
use crate::{Cholesky, NotPositiveDefinite};

/// b², the trend's prior variance over s².
pub(super) const TREND_VARIANCE: f64 = 1e8;
/// Nugget against rounding.
pub(super) const NUGGET: f64 = 1e-12;
const LARGEST_NUGGET: f64 = 1e-6;

#[derive(Clone, Debug)]
pub(super) struct Points {
    /// (x − centre)/ℓ, d×n.
    pub scaled: Array2<f64>,
    /// H, n×q.
    pub basis: Array2<f64>,
}

impl Points {
    /// Scales coordinates, d×n.
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

    pub fn of_groups(groups: &Groups, length_scales: &[f64], trend: Trend) -> Self {
        Self::new(
            &groups.coordinates.view(),
            &groups.centre,
            &groups.standard_deviations,
            length_scales,
            trend,
        )
    }

    /// C; dC/d(r²) into `slopes`.
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

#[derive(Clone, Debug)]
pub(super) struct Covariance {
    /// L of K = L·Lᵀ.
    pub factor: Cholesky,
    /// L⁻¹·H, n×q.
    pub basis: Array2<f64>,
    pub trend: Cholesky,
}

impl Covariance {
    /// Factors the lower triangle of C with relative noise, and H.
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

    /// Factors with the smallest sufficient nugget.
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

    /// α = P·y, n×m, and β = A⁻¹·Hᵀ·K⁻¹·y, q×m.
    pub fn solve(&self, outputs: &Array2<f64>) -> (Array2<f64>, Array2<f64>) {
        let half = self.factor.solve_lower_matrix(outputs.as_standard_layout().into_owned());
        let beta = self.trend.solve_matrix(self.basis.t().dot(&half));
        let alpha = self.factor.solve_upper_matrix(half - self.basis.dot(&beta));
        (alpha, beta)
    }

    pub fn inverse(&self) -> Array2<f64> {
        let inverse_lower = self.factor.inverse_lower();
        let mut p = Cholesky::gram_of_lower(&inverse_lower);
        // W·Wᵀ = K⁻¹·H·A⁻¹·Hᵀ·K⁻¹ with W = L⁻ᵀ·(L⁻¹·H)·R⁻ᵀ, A = R·Rᵀ.
        let w = self.trend.solve_lower_matrix(self.basis.t().dot(&inverse_lower));
        ndarray::linalg::general_mat_mul(-1.0, &w.t(), &w, 1.0, &mut p);
        p
    }
}

/// Adds a share of the trace where rounding removes 1/b², as for collinear coordinates.
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
