//! The evidence framework: how strongly weights decay and how noisy targets are, from the data alone.
//!
//! D. J. C. MacKay, Neural Computation 4 (1992), 448; with the Gauss–Newton curvature of F. D. Foresee and M. T. Hagan, ICNN 1997.
//! Symbols: w the P weights, e_k the errors of output k over N rows and J_k their Jacobian; α weight decay, β_k one over
//! the variance of output k's noise; A = Σ β_k·J_kᵀJ_k + α·1 the curvature; γ_k effective parameters.
//!
//! ```text
//! S   = ½ Σ β_k·|e_k|² + ½ α·|w|²
//! γ_k = β_k·tr(A⁻¹·J_kᵀJ_k),  γ = Σ γ_k = P − α·tr A⁻¹
//! α   = γ/|w|²,  β_k = (N − γ_k)/|e_k|²
//! ln evidence = −S − ½ ln det A + ½ P ln α + ½ N Σ ln β_k    (up to a constant)
//! ```

use ndarray::Array2;

use palpate_numerics::Cholesky;

/// α and β.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hyperparameters {
    pub(super) alpha: f64,
    pub(super) betas: Vec<f64>,
}

/// Targets have variance 1; noise below this standard deviation is none.
const LEAST_NOISE: f64 = 1e-7;

impl Hyperparameters {
    /// S for the squared errors of every output and |w|².
    pub(super) fn objective(&self, squared_errors: &[f64], squared_weights: f64) -> f64 {
        let misfit: f64 = self.betas.iter().zip(squared_errors).map(|(beta, e)| beta * e).sum();
        0.5 * (misfit + self.alpha * squared_weights)
    }

    /// Σ β_k·J_kᵀJ_k + (α + μ)·1.
    pub(super) fn curvature(&self, products: &[Array2<f64>], mu: f64) -> Array2<f64> {
        let size = products.first().map_or(0, Array2::nrows);
        let mut curvature = Array2::eye(size) * (self.alpha + mu);
        for (product, beta) in products.iter().zip(&self.betas) {
            curvature.scaled_add(*beta, product);
        }
        curvature
    }

    /// γ_k from the factored A.
    pub(super) fn effective_parameters(&self, a: &Cholesky, products: &[Array2<f64>]) -> Vec<f64> {
        let inverse = a.inverse();
        let trace = |product: &Array2<f64>| (&inverse * product).sum();
        products.iter().zip(&self.betas).map(|(product, beta)| beta * trace(product)).collect()
    }

    /// One step of the fixed point.
    pub(super) fn update(
        &mut self,
        gammas: &[f64],
        rows: usize,
        squared_errors: &[f64],
        squared_weights: f64,
    ) {
        let rows = rows as f64;
        self.alpha = (gammas.iter().sum::<f64>() / squared_weights).clamp(1e-8, 1e8);
        for ((beta, gamma), error) in self.betas.iter_mut().zip(gammas).zip(squared_errors) {
            // A network that could take every row by heart leaves no rows to see noise in: it is granted one in a hundred.
            let free = (rows - gamma).max(0.01 * rows);
            *beta = (free / error).min(LEAST_NOISE.powi(-2));
        }
    }

    /// ln evidence, for S and the factored A.
    pub(super) fn log_evidence(&self, objective: f64, a: &Cholesky, rows: usize) -> f64 {
        let noise: f64 = self.betas.iter().map(|beta| beta.ln()).sum();
        -objective - 0.5 * a.log_determinant()
            + 0.5 * a.size() as f64 * self.alpha.ln()
            + 0.5 * rows as f64 * noise
    }
}
