//! Smoothness marginalized by evidence.

use ndarray::{Array1, Array2, Axis};
use palpate_numerics::Cholesky;

/// Prior second differences over the mean force: 10⁻³, almost straight, to 10², independent cells.
const DECADES: (i32, i32) = (-3, 2);
const LEVELS_A_DECADE: i32 = 4;
/// Initial smoothness over the information.
const FIRST_SHARE: f64 = 1e-4;
/// Least weight in the covariance.
const SHARE_THAT_MATTERS: f64 = 1e-4;

/// Regularised least squares of cell forces.
pub(super) struct Problem {
    /// A, enabled sensors × cells, over noise, in 1/N.
    pub influence: Array2<f64>,
    /// AᵀA.
    pub gram: Array2<f64>,
    /// P.
    pub roughness: Array2<f64>,
}

/// Mixture over smoothness.
pub(super) struct Mixture {
    /// Mean in newtons.
    pub forces: Array1<f64>,
    /// In N².
    pub covariance: Array2<f64>,
    /// Most probable λ, in 1/N².
    pub smoothness: f64,
    /// Least ‖A·x − y‖².
    pub least_misfit: f64,
}

struct Level {
    smoothness: f64,
    log_evidence: f64,
    chi_squared: f64,
    minimum: NonNegative,
}

impl Problem {
    pub fn new(influence: Array2<f64>, roughness: Array2<f64>) -> Self {
        Self { gram: influence.t().dot(&influence), influence, roughness }
    }

    /// `None` if no load explains y best.
    pub fn solve(&self, y: &Array1<f64>) -> Option<Mixture> {
        let levels = self.levels(y)?;
        let best = levels.iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
        let shares: Vec<f64> =
            levels.iter().map(|level| (level.log_evidence - best.log_evidence).exp()).collect();
        let sum: f64 = shares.iter().sum();
        let weighed: Vec<(f64, &Level)> = shares.iter().map(|share| share / sum).zip(&levels).collect();
        let (forces, covariance) = self.mixture(&weighed);
        let least_misfit = levels.iter().fold(f64::INFINITY, |least, level| least.min(level.chi_squared));
        Some(Mixture { forces, covariance, smoothness: best.smoothness, least_misfit })
    }

    /// Smoothest first.
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

    /// Laplace approximation of ln ∫ exp(−½·‖A·x − y‖² − ½·λ·xᵀP·x − μ·Σx) dx over the free cells, minus that
    /// without readings and a constant of μ.
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
        Some(Level { smoothness, log_evidence, chi_squared: misfit, minimum })
    }

    /// Σ w·x and Σ w·(H⁻¹ + (x − mean)·(x − mean)ᵀ).
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

/// Block exchanges without progress.
const PATIENCE: usize = 3;
/// Exchanges per unknown; a handful is usual.
const MOST_EXCHANGES: usize = 20;
/// Relative gradient rounding.
const ROUNDING: f64 = 1e-11;

/// Minimum of ½·xᵀH·x − gᵀx over x ≥ 0.
#[derive(Clone, Debug)]
pub(super) struct NonNegative {
    pub solution: Array1<f64>,
    /// Ascending.
    pub free: Vec<usize>,
    /// Of H on the free unknowns.
    pub factor: Cholesky,
}

/// Minimises ½·xᵀH·x − gᵀx over x ≥ 0 from the free unknowns `start`; `None` without convergence, or if H is
/// not positive definite.
///
/// Block principal pivoting: all infeasible unknowns change sides, or without progress the last alone, which
/// terminates (Júdice and Pires, Computers & Operations Research 21, 1994; Kim and Park, SIAM J. Sci. Comput.
/// 33, 2011).
pub(super) fn minimise(hessian: &Array2<f64>, g: &Array1<f64>, start: &[usize]) -> Option<NonNegative> {
    let n = g.len();
    let tolerance = ROUNDING * g.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let mut is_free = vec![false; n];
    start.iter().for_each(|i| is_free[*i] = true);
    let (mut fewest, mut patience) = (n + 1, PATIENCE);
    for _ in 0..MOST_EXCHANGES * n {
        let current = solve_free(hessian, g, &is_free)?;
        let gradient = hessian.dot(&current.solution) - g;
        let wrong = |i: &usize| {
            if is_free[*i] { current.solution[*i] < 0.0 } else { gradient[*i] < -tolerance }
        };
        let wrong: Vec<usize> = (0..n).filter(wrong).collect();
        let Some(last) = wrong.last() else { return Some(current) };
        if wrong.len() < fewest {
            (fewest, patience) = (wrong.len(), PATIENCE);
        } else if patience > 0 {
            patience -= 1;
        } else {
            is_free[*last] = !is_free[*last];
            continue;
        }
        wrong.iter().for_each(|i| is_free[*i] = !is_free[*i]);
    }
    None
}

fn solve_free(hessian: &Array2<f64>, g: &Array1<f64>, is_free: &[bool]) -> Option<NonNegative> {
    let free: Vec<usize> = (0..g.len()).filter(|i| is_free[*i]).collect();
    let factor = Cholesky::factor(block(hessian, &free)).ok()?;
    let values = factor.solve(&g.select(Axis(0), &free));
    let mut solution = Array1::zeros(g.len());
    free.iter().zip(&values).for_each(|(i, value)| solution[*i] = *value);
    Some(NonNegative { solution, free, factor })
}

pub(super) fn block(matrix: &Array2<f64>, listed: &[usize]) -> Array2<f64> {
    matrix.select(Axis(0), listed).select(Axis(1), listed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    proptest! {
        /// Karush–Kuhn–Tucker conditions.
        #[test]
        fn the_minimum_meets_its_conditions(seed in 0u64..1000, n in 1usize..40) {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let root = Array2::from_shape_fn((n, n), |_| rng.random_range(-1.0..1.0));
            let hessian = root.t().dot(&root) + 1e-3 * Array2::<f64>::eye(n);
            let g = Array1::from_shape_fn(n, |_| rng.random_range(-1.0..1.0));
            let everything: Vec<usize> = (0..n).collect();
            for start in [&everything[..], &[]] {
                let found = minimise(&hessian, &g, start).unwrap();
                let gradient = hessian.dot(&found.solution) - &g;
                for i in 0..n {
                    prop_assert!(found.solution[i] >= 0.0 && gradient[i] >= -1e-9);
                    prop_assert!((found.solution[i] * gradient[i]).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_minimum() {
        let hessian = Array2::from_diag(&Array1::from(vec![1.0, -1.0]));
        assert!(minimise(&hessian, &Array1::from(vec![1.0, 1.0]), &[0, 1]).is_none());
        let nan = Array2::from_elem((1, 1), f64::NAN);
        assert!(minimise(&nan, &Array1::from(vec![1.0]), &[0]).is_none());
    }
}
