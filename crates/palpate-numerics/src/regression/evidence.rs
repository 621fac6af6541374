//! The log evidence and its gradient.
//!
//! With the covariance s_j²·(S + η·V) of the N rows of output j, V their relative noise variances, ln p(y_j)
//! = −½·(N·ln 2πs_j² + ln det(S + η·V) + y_jᵀ·(S + η·V)⁻¹·y_j / s_j²) (Rasmussen and Williams, eq. 5.8).
//! Collapsed to n groups of precision p_i and scatter Σ_i:
//!
//! - ln det(S + η·V) = ln det(S + η·D) + (N − n)·ln η + Σ ln p_i + Σ ln v_r, D = diag(1/p_i);
//! - Q_j = ȳ_jᵀ·P·ȳ_j + Σ_i scatter_ij/η, P = (S + η·D)⁻¹.
//!
//! Fitted noise: s_j² = Q_j/N. Given noise: s² = 1/η.

use std::f64::consts::PI;

use ndarray::Array2;

use super::covariance::{Covariance, NUGGET, Points};
use super::groups::Groups;
use super::{Hyperparameters, Kernel, Trend};
use crate::NotPositiveDefinite;

/// Nugget of Q_j against ln 0; outputs are of order 1.
const LEAST_QUADRATIC: f64 = 1e-10;

pub(super) struct Evidence<'a> {
    pub groups: &'a Groups,
    pub kernel: Kernel,
    pub trend: Trend,
}

impl Evidence<'_> {
    /// ln p, and its gradient by logarithms of the hyperparameters.
    pub fn with_gradient(
        &self,
        hyperparameters: &Hyperparameters,
        gradient: &mut [f64],
    ) -> Result<f64, NotPositiveDefinite> {
        let groups = self.groups;
        let (scales, ratio) = (&hyperparameters.length_scales, hyperparameters.noise_ratio);
        let points = Points::of_groups(groups, scales, self.trend);
        let noise = groups.noise_ratios(ratio);
        let mut slopes = Array2::zeros((groups.len(), groups.len()));
        let correlations = points.correlations(self.kernel, Some(&mut slopes));
        let covariance = Covariance::new(correlations, &noise, &points.basis, NUGGET)?;
        let (alpha, _) = covariance.solve(&groups.means);
        let quadratics = quadratic_forms(groups, ratio, &alpha);
        let rows = groups.total_rows() as f64;
        // 1/s_j².
        let inverse_variances: Vec<f64> =
            quadratics.iter().map(|q| if groups.noise_given { ratio } else { rows / q }).collect();

        let by_covariance = by_covariance(&covariance, &alpha, &inverse_variances);
        let (by_scales, by_ratio) = gradient.split_at_mut(scales.len());
        by_length_scales(by_scales, &by_covariance, &slopes, &points.scaled);
        let outputs = groups.means.ncols() as f64;
        let repeats = rows - groups.len() as f64;
        let through_noise: f64 = noise.iter().zip(by_covariance.diag()).map(|(noise, g)| noise * g).sum();
        let through_scatter: f64 = (0..groups.means.ncols())
            .map(|j| 0.5 * inverse_variances[j] * groups.scatter.column(j).sum() / ratio)
            .sum();
        by_ratio[0] = through_noise - 0.5 * outputs * repeats + through_scatter;
        if groups.noise_given {
            by_ratio[0] += 0.5 * outputs * rows - 0.5 * ratio * quadratics.iter().sum::<f64>();
        }
        Ok(log_evidence(groups, ratio, &covariance, &alpha))
    }
}

/// Standardized s_j².
pub(super) fn signal_variances(groups: &Groups, ratio: f64, alpha: &Array2<f64>) -> Vec<f64> {
    variances_of(groups, ratio, &quadratic_forms(groups, ratio, alpha))
}

pub(super) fn variances_of(groups: &Groups, ratio: f64, quadratics: &[f64]) -> Vec<f64> {
    if groups.noise_given {
        return vec![1.0 / ratio; groups.means.ncols()];
    }
    let rows = groups.total_rows() as f64;
    quadratics.iter().map(|q| q / rows).collect()
}

/// ln p of all outputs.
pub(super) fn log_evidence(groups: &Groups, ratio: f64, covariance: &Covariance, alpha: &Array2<f64>) -> f64 {
    evidence_of(groups, ratio, covariance.log_determinant(), &quadratic_forms(groups, ratio, alpha))
}

/// ln p from the points' determinant and Q_j.
pub(super) fn evidence_of(groups: &Groups, ratio: f64, log_determinant: f64, quadratics: &[f64]) -> f64 {
    let rows = groups.total_rows() as f64;
    let repeats = rows - groups.len() as f64;
    let precisions: f64 = groups.precision.iter().map(|p| p.ln()).sum();
    let variances: f64 = groups.log_variance.iter().sum();
    let determinant = log_determinant + repeats * ratio.ln() + precisions + variances;
    let signal = variances_of(groups, ratio, quadratics);
    let of_output = |j: usize| {
        let units = 2.0 * rows * groups.scale[j].ln();
        -0.5 * (rows * (2.0 * PI * signal[j]).ln() + determinant + quadratics[j] / signal[j] + units)
    };
    (0..quadratics.len()).map(of_output).sum()
}

/// Q_j.
fn quadratic_forms(groups: &Groups, ratio: f64, alpha: &Array2<f64>) -> Vec<f64> {
    let of_means: Vec<f64> =
        groups.means.columns().into_iter().zip(alpha.columns()).map(|(y, alpha)| y.dot(&alpha)).collect();
    with_scatter(groups, ratio, &of_means)
}

/// Q_j from ȳ_jᵀ·P·ȳ_j.
pub(super) fn with_scatter(groups: &Groups, ratio: f64, of_means: &[f64]) -> Vec<f64> {
    let least = if groups.noise_given { 0.0 } else { LEAST_QUADRATIC };
    let of_output =
        |(j, of_means): (usize, &f64)| of_means.max(0.0) + groups.scatter.column(j).sum() / ratio + least;
    of_means.iter().enumerate().map(of_output).collect()
}

/// d ln p/dK_il for i ≠ l: ½·(Σ_j α_j·α_jᵀ/s_j² − m·P) (Rasmussen and Williams, eq. 5.9).
fn by_covariance(covariance: &Covariance, alpha: &Array2<f64>, inverse_variances: &[f64]) -> Array2<f64> {
    let mut derivative = covariance.inverse();
    let mut weighted = alpha.clone();
    for (mut column, weight) in weighted.columns_mut().into_iter().zip(inverse_variances) {
        column *= *weight;
    }
    let outputs = alpha.ncols() as f64;
    ndarray::linalg::general_mat_mul(0.5, &weighted, &alpha.t(), -0.5 * outputs, &mut derivative);
    derivative
}

/// d ln p/d ln ℓ_k = Σ_il G_il·(dc/d(r²))_il·(−2)·(u_ik − u_lk)².
fn by_length_scales(out: &mut [f64], g: &Array2<f64>, slopes: &Array2<f64>, scaled: &Array2<f64>) {
    out.fill(0.0);
    let mut product = vec![0.0; g.ncols()];
    for i in 1..g.nrows() {
        let (g, slopes) = (g.row(i), slopes.row(i));
        product.iter_mut().zip(g.iter().zip(slopes)).take(i).for_each(|(p, (g, slope))| *p = g * slope);
        for (out, u) in out.iter_mut().zip(scaled.outer_iter()) {
            let here = u[i];
            let sum: f64 = product.iter().zip(u).take(i).map(|(p, u)| p * (u - here) * (u - here)).sum();
            // Both triangles: twice.
            *out -= 4.0 * sum;
        }
    }
}
