//! Levenberg–Marquardt training (Levenberg 1944; Marquardt 1963; Hagan and Menhaj 1994) by the evidence
//! framework (D. J. C. MacKay, Neural Computation 4 (1992), 448; with the Gauss–Newton curvature of F. D.
//! Foresee and M. T. Hagan, ICNN 1997).
//!
//! Symbols: w P weights, e_k errors of output k over N rows, J_k Jacobian, α weight decay, β_k inverse noise
//! variance, A = Σ β_k·J_kᵀJ_k + α·1 curvature, γ_k effective parameters.
//!
//! ```text
//! S   = ½ Σ β_k·|e_k|² + ½ α·|w|²
//! γ_k = β_k·tr(A⁻¹·J_kᵀJ_k),  γ = Σ γ_k = P − α·tr A⁻¹
//! α   = γ/|w|²,  β_k = (N − γ_k)/|e_k|²
//! ln evidence = −S − ½ ln det A + ½ P ln α + ½ N Σ ln β_k    (up to a constant)
//! ```
//!
//! For a layer a = f(W·x + b) and δ = ∂output/∂z: δ_below = f′ ∘ Wᵀ·δ, ∂output/∂w_ij = δ_i·x_j.

use super::Member;
use crate::network::{Activation, Topology};
use ndarray::{Array1, Array2, ArrayView2, Axis};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{Cholesky, random_order};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

pub(super) struct Training<'a> {
    pub(super) topology: &'a Topology,
    /// Presses × inputs.
    pub(super) inputs: Array2<f64>,
    /// Presses × outputs, each of variance 1.
    pub(super) targets: Array2<f64>,
    pub(super) max_iterations: u32,
}

struct Linearisation {
    errors: Array2<f64>,
    jacobians: Vec<Array2<f64>>,
    products: Vec<Array2<f64>>,
}

const MOST_DAMPING: f64 = 1e12;

/// Updates cost more than a step.
const STEPS_A_UPDATE: u32 = 3;

const SETTLED: f64 = 0.01;

impl Training<'_> {
    pub(super) fn subsampled(&self, most: usize, seed: u64) -> Self {
        let mut rows = random_order(self.inputs.nrows(), seed);
        rows.truncate(most);
        rows.sort_unstable();
        Self {
            inputs: self.inputs.select(Axis(0), &rows),
            targets: self.targets.select(Axis(0), &rows),
            ..*self
        }
    }

    /// `None` for infinite weights.
    pub(super) fn run(&self, seed: u64, watch: Watch) -> Result<Option<Member>, Cancelled> {
        let mut weights = self.initial_weights(seed);
        // Starts from little noise: with few rows, noise alone is another maximum of the evidence.
        let mut hyper = Hyperparameters { alpha: 0.01, betas: vec![1e4; self.topology.outputs()] };
        let (mut mu, mut iterations, mut calm) = (1.0, 0, 0);
        let mut here = self.linearise(&weights);
        while iterations < self.max_iterations && calm < 3 {
            watch.round()?;
            iterations += 1;
            let before = hyper.clone();
            let moved = self.step(&mut weights, &here, &hyper, &mut mu);
            if moved {
                here = self.linearise(&weights);
            }
            if moved && !iterations.is_multiple_of(STEPS_A_UPDATE) {
                continue;
            }
            let Ok(a) = Cholesky::factor(hyper.curvature(&here.products, 0.0)) else { return Ok(None) };
            let gammas = hyper.effective_parameters(&a, &here.products);
            hyper.update(&gammas, self.inputs.nrows(), &squares(&here.errors), weights.dot(&weights));
            let drift = (hyper.alpha / before.alpha).ln().abs()
                + hyper.betas.iter().zip(&before.betas).map(|(b, old)| (b / old).ln().abs()).sum::<f64>();
            calm = if drift < SETTLED { calm + 1 } else { 0 };
            mu = mu.min(0.1 * MOST_DAMPING);
        }
        Ok(self.finish(&weights, &here, &hyper, iterations))
    }

    /// Normal of variance 1/inputs.
    fn initial_weights(&self, seed: u64) -> Array1<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut weights = Vec::with_capacity(self.topology.weight_count());
        for layer in 0..self.topology.layers() {
            let sd = 1.0 / (self.topology.row_len(layer) as f64).sqrt();
            let count = self.topology.rows(layer) * self.topology.row_len(layer);
            weights.extend((0..count).map(|_| sd * rng.sample::<f64, _>(StandardNormal)));
        }
        Array1::from(weights)
    }

    fn errors(&self, weights: &Array1<f64>) -> Array2<f64> {
        &self.targets - &outputs(self.topology, weights.as_slice().unwrap_or(&[]), &self.inputs.view())
    }

    fn linearise(&self, weights: &Array1<f64>) -> Linearisation {
        let (outputs, jacobians) =
            jacobians(self.topology, weights.as_slice().unwrap_or(&[]), &self.inputs.view());
        let products = jacobians.iter().map(|jacobian| jacobian.t().dot(jacobian)).collect();
        Linearisation { errors: &self.targets - &outputs, jacobians, products }
    }

    /// w ← w + (A + μ·1)⁻¹·(Σ β_k·J_kᵀe_k − α·w), μ raised until the objective falls; false at a minimum.
    fn step(
        &self,
        weights: &mut Array1<f64>,
        here: &Linearisation,
        hyper: &Hyperparameters,
        mu: &mut f64,
    ) -> bool {
        let start = hyper.objective(&squares(&here.errors), weights.dot(weights));
        let mut descent = &*weights * -hyper.alpha;
        for (k, jacobian) in here.jacobians.iter().enumerate() {
            descent.scaled_add(hyper.betas[k], &jacobian.t().dot(&here.errors.column(k)));
        }
        while *mu < MOST_DAMPING {
            if let Ok(damped) = Cholesky::factor(hyper.curvature(&here.products, *mu)) {
                let there = &*weights + &damped.solve(&descent);
                let value = hyper.objective(&squares(&self.errors(&there)), there.dot(&there));
                if value < start {
                    *weights = there;
                    *mu = (*mu * 0.1).max(1e-12);
                    return true;
                }
            }
            *mu *= 10.0;
        }
        false
    }

    fn finish(
        &self,
        weights: &Array1<f64>,
        here: &Linearisation,
        hyper: &Hyperparameters,
        iterations: u32,
    ) -> Option<Member> {
        let curvature = Cholesky::factor(hyper.curvature(&here.products, 0.0)).ok()?;
        let gammas = hyper.effective_parameters(&curvature, &here.products);
        let objective = hyper.objective(&squares(&here.errors), weights.dot(weights));
        let log_evidence = hyper.log_evidence(objective, &curvature, self.inputs.nrows());
        let lower = curvature.lower();
        let rows = lower.outer_iter().enumerate();
        (log_evidence.is_finite() && weights.iter().all(|w| w.is_finite())).then(|| Member {
            weights: weights.to_vec(),
            curvature_factor: rows.flat_map(|(i, row)| row.to_vec().into_iter().take(i + 1)).collect(),
            noise: hyper.betas.iter().map(|beta| 1.0 / beta).collect(),
            effective_parameters: gammas.iter().sum(),
            log_evidence,
            iterations,
        })
    }
}

/// |e_k|² of every output.
fn squares(errors: &Array2<f64>) -> Vec<f64> {
    errors.columns().into_iter().map(|column| column.dot(&column)).collect()
}

/// α and β.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hyperparameters {
    pub(super) alpha: f64,
    pub(super) betas: Vec<f64>,
}

/// Standard deviation that counts as 0.
const LEAST_NOISE: f64 = 1e-7;

impl Hyperparameters {
    /// S.
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

    /// γ_k.
    pub(super) fn effective_parameters(&self, a: &Cholesky, products: &[Array2<f64>]) -> Vec<f64> {
        let inverse = a.inverse();
        let trace = |product: &Array2<f64>| (&inverse * product).sum();
        products.iter().zip(&self.betas).map(|(product, beta)| beta * trace(product)).collect()
    }

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
            // An exact fit has 0 degrees of freedom for the noise; at least 1 % of the rows remain.
            let free = (rows - gamma).max(0.01 * rows);
            *beta = (free / error).min(LEAST_NOISE.powi(-2));
        }
    }

    pub(super) fn log_evidence(&self, objective: f64, a: &Cholesky, rows: usize) -> f64 {
        let noise: f64 = self.betas.iter().map(|beta| beta.ln()).sum();
        -objective - 0.5 * a.log_determinant()
            + 0.5 * a.size() as f64 * self.alpha.ln()
            + 0.5 * rows as f64 * noise
    }
}

pub(super) fn outputs(topology: &Topology, weights: &[f64], inputs: &ArrayView2<f64>) -> Array2<f64> {
    let mut outputs = Array2::zeros((inputs.nrows(), topology.outputs()));
    let mut layers = Activations::new(topology);
    for (input, mut output) in inputs.outer_iter().zip(outputs.outer_iter_mut()) {
        layers.forward(topology, weights, input.iter().copied());
        output.iter_mut().zip(layers.last()).for_each(|(out, a)| *out = *a);
    }
    outputs
}

/// Outputs and their Jacobians, rows × weights.
pub(super) fn jacobians(
    topology: &Topology,
    weights: &[f64],
    inputs: &ArrayView2<f64>,
) -> (Array2<f64>, Vec<Array2<f64>>) {
    let (rows, count) = (inputs.nrows(), topology.weight_count());
    let mut outputs = Array2::zeros((rows, topology.outputs()));
    let mut jacobians = vec![Array2::zeros((rows, count)); topology.outputs()];
    let mut layers = Activations::new(topology);
    for (row, input) in inputs.outer_iter().enumerate() {
        layers.forward(topology, weights, input.iter().copied());
        for (k, jacobian) in jacobians.iter_mut().enumerate() {
            outputs[[row, k]] = layers.last()[k];
            if let Some(gradient) = jacobian.row_mut(row).as_slice_mut() {
                layers.gradient(topology, weights, k, gradient);
            }
        }
    }
    (outputs, jacobians)
}

struct Activations {
    layers: Vec<Vec<f64>>,
    delta: Vec<f64>,
    below: Vec<f64>,
}

impl Activations {
    fn new(topology: &Topology) -> Self {
        let layers = topology.sizes.iter().map(|size| vec![0.0; *size]).collect();
        Self { layers, delta: Vec::new(), below: Vec::new() }
    }

    fn last(&self) -> &[f64] {
        self.layers.last().map_or(&[], Vec::as_slice)
    }

    fn forward(&mut self, topology: &Topology, mut weights: &[f64], inputs: impl Iterator<Item = f64>) {
        self.layers[0].iter_mut().zip(inputs).for_each(|(x, input)| *x = input);
        for layer in 0..topology.layers() {
            let (below, above) = self.layers.split_at_mut(layer + 1);
            let (x, activation) = (&below[layer], topology.activation(layer));
            for a in above[0].iter_mut() {
                let (row, rest) = weights.split_at(topology.row_len(layer));
                weights = rest;
                let bias = if topology.biases { row[x.len()] } else { 0.0 };
                *a = activation.apply(row.iter().zip(x).map(|(w, x)| w * x).sum::<f64>() + bias);
            }
        }
    }

    /// ∂ output `k` / ∂ weights.
    fn gradient(&mut self, topology: &Topology, weights: &[f64], k: usize, gradient: &mut [f64]) {
        self.delta.clear();
        self.delta.resize(topology.outputs(), 0.0);
        self.delta[k] = slope(topology.output_activation, self.last()[k]);
        let mut end = weights.len();
        for layer in (0..topology.layers()).rev() {
            let (row_len, rows) = (topology.row_len(layer), topology.rows(layer));
            let start = end - row_len * rows;
            let x = &self.layers[layer];
            self.below.clear();
            self.below.resize(x.len(), 0.0);
            for (i, delta) in self.delta.iter().enumerate() {
                let at = start + i * row_len;
                for (j, x) in x.iter().enumerate() {
                    gradient[at + j] = delta * x;
                    self.below[j] += delta * weights[at + j];
                }
                if topology.biases {
                    gradient[at + x.len()] = *delta;
                }
            }
            if layer > 0 {
                let activation = topology.activation(layer - 1);
                self.below.iter_mut().zip(x).for_each(|(delta, a)| *delta *= slope(activation, *a));
            }
            std::mem::swap(&mut self.delta, &mut self.below);
            end = start;
        }
    }
}

fn slope(activation: Activation, a: f64) -> f64 {
    match activation {
        Activation::Logistic => a * (1.0 - a),
        Activation::Tanh => 1.0 - a * a,
        Activation::Linear => 1.0,
    }
}
