//! Quadratic programs with nothing below zero.

use ndarray::{Array1, Array2, Axis};

use palpate_numerics::Cholesky;

/// Exchanges of the whole set that may pass without progress before indices are exchanged one by one.
const PATIENCE: usize = 3;
/// Exchanges after which the search is given up, for each unknown; a handful is usual in all.
const MOST_EXCHANGES: usize = 20;
/// A gradient above minus this share of the largest entry of g is rounding.
const ROUNDING: f64 = 1e-11;

/// Where ½·xᵀH·x − gᵀx is least for x ≥ 0.
#[derive(Clone, Debug)]
pub(super) struct NonNegative {
    /// x.
    pub solution: Array1<f64>,
    /// The unknowns that are not held at 0, in rising order.
    pub free: Vec<usize>,
    /// The Cholesky factor of H on them.
    pub factor: Cholesky,
}

/// Minimises ½·xᵀH·x − gᵀx over x ≥ 0 for a positive definite H, beginning with `start` as the free unknowns; `None` where H
/// is not positive definite to rounding, or the search does not end.
///
/// Block principal pivoting: all unknowns that are on the wrong side change sides at once; when that makes no progress, the
/// last of them alone, which is certain to end (Júdice and Pires, Computers & Operations Research 21, 1994; Kim and Park,
/// SIAM J. Sci. Comput. 33, 2011).
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

/// The minimum over the free unknowns, the others being 0.
fn solve_free(hessian: &Array2<f64>, g: &Array1<f64>, is_free: &[bool]) -> Option<NonNegative> {
    let free: Vec<usize> = (0..g.len()).filter(|i| is_free[*i]).collect();
    let factor = Cholesky::factor(block(hessian, &free)).ok()?;
    let values = factor.solve(&g.select(Axis(0), &free));
    let mut solution = Array1::zeros(g.len());
    free.iter().zip(&values).for_each(|(i, value)| solution[*i] = *value);
    Some(NonNegative { solution, free, factor })
}

/// The rows and columns of a matrix that are listed.
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
        /// Karush, Kuhn and Tucker: x ≥ 0, gradient ≥ 0, and one of them 0.
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
