//! Levenberg–Marquardt: Gauss–Newton steps, damped as far as they must be (Levenberg 1944; Marquardt 1963; Hagan and Menhaj 1994).

use ndarray::{Array1, Array2, Axis};
use palpate_numerics::watch::{Cancelled, Watch};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::evidence::Hyperparameters;
use super::perceptron::{jacobians, outputs};
use crate::network::Topology;
use palpate_numerics::{Cholesky, random_order};

/// What one network is trained on.
pub(super) struct Training<'a> {
    pub(super) topology: &'a Topology,
    /// A row a press, a column an input.
    pub(super) inputs: Array2<f64>,
    /// A row a press, a column an output, each with variance 1.
    pub(super) targets: Array2<f64>,
    pub(super) max_iterations: u32,
}

/// A trained network and what the evidence says of it.
pub(super) struct Trained {
    pub(super) weights: Vec<f64>,
    pub(super) hyperparameters: Hyperparameters,
    pub(super) curvature: Cholesky,
    pub(super) effective_parameters: f64,
    pub(super) log_evidence: f64,
    pub(super) iterations: u32,
}

/// Where a step starts: the errors there, and their derivatives.
struct Place {
    errors: Array2<f64>,
    jacobians: Vec<Array2<f64>>,
    products: Vec<Array2<f64>>,
}

/// Damping beyond which no step goes down any more.
const MOST_DAMPING: f64 = 1e12;

/// Steps between two updates of the hyperparameters, which cost more than a step.
const STEPS_A_UPDATE: u32 = 3;

/// Relative change of the hyperparameters below which they have settled; three such updates in a row end training.
const SETTLED: f64 = 0.01;

impl Training<'_> {
    /// The same of at most `most` presses, drawn at random.
    pub(super) fn of_some(&self, most: usize, seed: u64) -> Self {
        let mut rows = random_order(self.inputs.nrows(), seed);
        rows.truncate(most);
        rows.sort_unstable();
        Self {
            inputs: self.inputs.select(Axis(0), &rows),
            targets: self.targets.select(Axis(0), &rows),
            ..*self
        }
    }

    /// Trains from the weights of a seed; `None` when the weights leave the numbers.
    pub(super) fn run(&self, seed: u64, watch: Watch) -> Result<Option<Trained>, Cancelled> {
        let mut weights = self.initial_weights(seed);
        // Starting from little noise: where rows are few, "all is noise" is a maximum of the evidence too.
        let mut hyper = Hyperparameters { alpha: 0.01, betas: vec![1e4; self.topology.outputs()] };
        let (mut mu, mut iterations, mut calm) = (1.0, 0, 0);
        let mut place = self.place(&weights);
        while iterations < self.max_iterations && calm < 3 {
            watch.round()?;
            iterations += 1;
            let before = hyper.clone();
            let moved = self.step(&mut weights, &place, &hyper, &mut mu);
            if moved {
                place = self.place(&weights);
            }
            if moved && !iterations.is_multiple_of(STEPS_A_UPDATE) {
                continue;
            }
            let Ok(a) = Cholesky::factor(hyper.curvature(&place.products, 0.0)) else { return Ok(None) };
            let gammas = hyper.effective_parameters(&a, &place.products);
            hyper.update(&gammas, self.inputs.nrows(), &squares(&place.errors), weights.dot(&weights));
            let drift = (hyper.alpha / before.alpha).ln().abs()
                + hyper.betas.iter().zip(&before.betas).map(|(b, old)| (b / old).ln().abs()).sum::<f64>();
            calm = if drift < SETTLED { calm + 1 } else { 0 };
            mu = mu.min(0.1 * MOST_DAMPING);
        }
        Ok(self.finish(&weights, &place, hyper, iterations))
    }

    /// Weights so small that every node starts within the bend of its tanh: normal with variance 1/inputs of the node.
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

    fn place(&self, weights: &Array1<f64>) -> Place {
        let (outputs, jacobians) =
            jacobians(self.topology, weights.as_slice().unwrap_or(&[]), &self.inputs.view());
        let products = jacobians.iter().map(|jacobian| jacobian.t().dot(jacobian)).collect();
        Place { errors: &self.targets - &outputs, jacobians, products }
    }

    /// w ← w + (A + μ·1)⁻¹·(Σ β_k·J_kᵀe_k − α·w), with μ grown until the objective falls; whether it could be.
    fn step(&self, weights: &mut Array1<f64>, place: &Place, hyper: &Hyperparameters, mu: &mut f64) -> bool {
        let start = hyper.objective(&squares(&place.errors), weights.dot(weights));
        let mut descent = &*weights * -hyper.alpha;
        for (k, jacobian) in place.jacobians.iter().enumerate() {
            descent.scaled_add(hyper.betas[k], &jacobian.t().dot(&place.errors.column(k)));
        }
        while *mu < MOST_DAMPING {
            if let Ok(damped) = Cholesky::factor(hyper.curvature(&place.products, *mu)) {
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
        place: &Place,
        hyper: Hyperparameters,
        iterations: u32,
    ) -> Option<Trained> {
        let curvature = Cholesky::factor(hyper.curvature(&place.products, 0.0)).ok()?;
        let gammas = hyper.effective_parameters(&curvature, &place.products);
        let objective = hyper.objective(&squares(&place.errors), weights.dot(weights));
        let log_evidence = hyper.log_evidence(objective, &curvature, self.inputs.nrows());
        (log_evidence.is_finite() && weights.iter().all(|w| w.is_finite())).then(|| Trained {
            weights: weights.to_vec(),
            effective_parameters: gammas.iter().sum(),
            hyperparameters: hyper,
            curvature,
            log_evidence,
            iterations,
        })
    }
}

/// |e_k|² of every output.
fn squares(errors: &Array2<f64>) -> Vec<f64> {
    errors.columns().into_iter().map(|column| column.dot(&column)).collect()
}
