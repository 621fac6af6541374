//! How smooth a load is: every smoothness weighed by its evidence.

use ndarray::{Array1, Array2};

use super::non_negative::{NonNegative, block, minimise};
use palpate_numerics::Cholesky;

/// Second differences of the forces of cells have standard deviations from 10⁻³ to 10² of a cell's mean force, a quarter of
/// a decade apart: from a load that is all but a straight line to one whose cells know nothing of each other.
const DECADES: (i32, i32) = (-3, 2);
const LEVELS_A_DECADE: i32 = 4;
/// Smoothness for the first guess of the force, as a share of what the readings say.
const FIRST_SHARE: f64 = 1e-4;
/// A level with a smaller share of the probability changes nothing.
const SHARE_THAT_MATTERS: f64 = 1e-4;

/// What the readings and the smoothness have to say about the forces of cells.
pub(super) struct Problem {
    /// A: mean influence of each cell (columns) on each live sensor (rows), over the sensor's noise; in 1/N.
    pub influence: Array2<f64>,
    /// AᵀA.
    pub gram: Array2<f64>,
    /// P.
    pub roughness: Array2<f64>,
}

/// The forces of cells, over all levels of smoothness.
pub(super) struct Mixture {
    /// Mean force of each cell, in newtons.
    pub forces: Array1<f64>,
    /// Their covariance, in N².
    pub covariance: Array2<f64>,
    /// λ of the most probable level, in 1/N².
    pub smoothness: f64,
    /// The least ‖A·x − y‖² of all levels.
    pub least_misfit: f64,
}

/// One smoothness λ.
struct Level {
    smoothness: f64,
    log_evidence: f64,
    misfit: f64,
    minimum: NonNegative,
}

impl Problem {
    pub fn new(influence: Array2<f64>, roughness: Array2<f64>) -> Self {
        Self { gram: influence.t().dot(&influence), influence, roughness }
    }

    /// The forces that a whitened reading y tells; `None` where no load at all explains it best.
    pub fn solve(&self, y: &Array1<f64>) -> Option<Mixture> {
        let levels = self.levels(y)?;
        let best = levels.iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
        let shares: Vec<f64> =
            levels.iter().map(|level| (level.log_evidence - best.log_evidence).exp()).collect();
        let sum: f64 = shares.iter().sum();
        let weighed: Vec<(f64, &Level)> = shares.iter().map(|share| share / sum).zip(&levels).collect();
        let (forces, covariance) = self.mixture(&weighed);
        let least_misfit = levels.iter().fold(f64::INFINITY, |least, level| least.min(level.misfit));
        Some(Mixture { forces, covariance, smoothness: best.smoothness, least_misfit })
    }

    /// All levels, from the smoothest down.
    fn levels(&self, y: &Array1<f64>) -> Option<Vec<Level>> {
        let cells = self.gram.nrows();
        let g = self.influence.t().dot(y);
        let everything: Vec<usize> = (0..cells).collect();
        let first = FIRST_SHARE * self.gram.diag().sum() / self.roughness.diag().sum();
        let first = minimise(&self.hessian(first), &g, &everything)?;
        let force = first.solution.sum();
        if force <= 0.0 {
            return None;
        }
        // −ln of the exponential prior of a cell's force is μ·x.
        let rate = cells as f64 / force;
        let g = g - rate;
        let mut free = first.free;
        let mut levels = Vec::new();
        for step in DECADES.0 * LEVELS_A_DECADE..=DECADES.1 * LEVELS_A_DECADE {
            let bend = 10f64.powf(f64::from(step) / f64::from(LEVELS_A_DECADE)) / rate;
            let smoothness = 1.0 / (bend * bend);
            let Some(minimum) = minimise(&self.hessian(smoothness), &g, &free) else { continue };
            free.clone_from(&minimum.free);
            levels.extend(self.level(y, smoothness, rate, minimum));
        }
        (!levels.is_empty()).then_some(levels)
    }

    fn hessian(&self, smoothness: f64) -> Array2<f64> {
        &self.gram + &(smoothness * &self.roughness)
    }

    /// Evidence of a level: ln of ∫ exp(−½·‖A·x − y‖² − ½·λ·xᵀP·x − μ·Σx) dx over the free cells, by Laplace's method, less
    /// the logarithm of the same without readings; that of μ is the same for all levels and left out.
    fn level(&self, y: &Array1<f64>, smoothness: f64, rate: f64, minimum: NonNegative) -> Option<Level> {
        let x = &minimum.solution;
        let force = x.sum();
        if force <= 0.0 {
            return None;
        }
        let residual = self.influence.dot(x) - y;
        let misfit = residual.dot(&residual);
        let roughness = x.dot(&self.roughness.dot(x));
        let prior = Cholesky::factor(block(&self.roughness, &minimum.free)).ok()?;
        let free = minimum.free.len() as f64;
        let log_evidence = -0.5 * (misfit + smoothness * roughness) - rate * force
            + 0.5 * (free * smoothness.ln() + prior.log_determinant() - minimum.factor.log_determinant());
        Some(Level { smoothness, log_evidence, misfit, minimum })
    }

    /// Mean and covariance over the levels: Σ w·x, and Σ w·(H⁻¹ + (x − mean)·(x − mean)ᵀ).
    fn mixture(&self, weighed: &[(f64, &Level)]) -> (Array1<f64>, Array2<f64>) {
        let cells = self.gram.nrows();
        let forces = weighed.iter().fold(Array1::zeros(cells), |mut sum: Array1<f64>, (weight, level)| {
            sum.scaled_add(*weight, &level.minimum.solution);
            sum
        });
        let mut covariance = Array2::zeros((cells, cells));
        for (weight, level) in weighed.iter().filter(|(weight, _)| *weight > SHARE_THAT_MATTERS) {
            let free = &level.minimum.free;
            let within = level.minimum.factor.inverse();
            let beside = &level.minimum.solution - &forces;
            for (i, a) in free.iter().enumerate() {
                for (j, b) in free.iter().enumerate() {
                    covariance[[*a, *b]] += weight * within[[i, j]];
                }
            }
            for (i, mut row) in covariance.outer_iter_mut().enumerate() {
                row.scaled_add(weight * beside[i], &beside);
            }
        }
        (forces, covariance)
    }
}
