//! Bounds of sums over a load of any shape, without a prior.
//!
//! With A, x ≥ 0 and y as in [the module above](super), the 95 % bounds of c·x are those of the
//! [profile likelihood](super::profile_likelihood) of ‖A·x − y‖² (Rust and Burrus, *Mathematical Programming
//! and the Numerical Solution of Linear Equations*, 1972; Kuusela and Stark, *Annals of Applied Statistics*
//! 11, 2017).

use super::profile_likelihood::{NON_NEGATIVE_INCREASE, Profile, ProfilePoint};
use ndarray::{Array1, Array2};
use palpate_numerics::{Cholesky, extend_to};

const MOST_STEPS: usize = 40;
const NEGLIGIBLE: f64 = 1e-3;

pub(super) struct Bounds {
    gram: Array2<f64>,
    right: Array1<f64>,
    square: f64,
    best: Array1<f64>,
    /// Greatest accepted misfit.
    most: f64,
    /// ρ² for coefficient 1.
    stiffness: f64,
}

type Least = ProfilePoint<Array1<f64>>;

impl Bounds {
    pub fn new(influence: &Array2<f64>, y: &Array1<f64>) -> Self {
        let (gram, right) = (influence.t().dot(influence), influence.t().dot(y));
        let stiffness = gram.diag().sum() / gram.nrows().max(1) as f64;
        let best = LeastSquares { gram: &gram, right: &right, drawn: None }.non_negative();
        let square = y.dot(y);
        let most = squared_residual((&gram, &right, square), &best) + NON_NEGATIVE_INCREASE;
        Self { gram, right, square, best, most, stiffness }
    }

    pub fn least_misfit(&self) -> f64 {
        self.most - NON_NEGATIVE_INCREASE
    }

    /// Bounds of c·x, possibly infinite.
    pub fn of_sum(&self, c: &Array1<f64>) -> (f64, f64) {
        let [low, high] = [-1.0, 1.0].map(|side| self.bound(c, side));
        let low = low.map_or(f64::NEG_INFINITY, |end| end.value);
        let high = high.map_or(f64::INFINITY, |end| end.value);
        // A sum of forces is at least 0.
        let low = if c.iter().all(|c| *c >= 0.0) { low.max(0.0) } else { low };
        (low, high)
    }

    /// Bounds of Σ a·x/Σ x over some cells.
    ///
    /// A mean v is accepted if the bounds of Σ (a − v)·x contain 0; the load at the upper bound gives the
    /// next v (Dinkelbach, *On Nonlinear Fractional Programming*, Management Science 13, 1967).
    pub fn of_mean(&self, cells: &[usize], coordinates: &[f64]) -> (f64, f64) {
        let ends = coordinates.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |ends, a| extend_to(ends, *a));
        let mean = |load: &Array1<f64>| {
            let (mut moment, mut sum) = (0.0, 0.0);
            for (cell, a) in cells.iter().zip(coordinates) {
                (moment, sum) = (moment + a * load[*cell], sum + load[*cell]);
            }
            (sum > 0.0).then(|| moment / sum)
        };
        let size = ends.1 - ends.0;
        let bound = |side: f64, end: f64| {
            let Some(mut v) = mean(&self.best) else { return end };
            for _ in 0..MOST_STEPS {
                let mut c = Array1::zeros(self.right.len());
                cells.iter().zip(coordinates).for_each(|(cell, a)| c[*cell] = (a - v) / size);
                let next = self.bound(&c, side).map(|end| mean(&end.load));
                let Some(Some(next)) = next else { return end };
                let gain = side * (next - v);
                if gain > 0.0 {
                    v = next;
                }
                if gain <= NEGLIGIBLE * size {
                    break;
                }
            }
            v
        };
        if size > 0.0 { (bound(-1.0, ends.0), bound(1.0, ends.1)) } else { ends }
    }

    /// End of c·x on one side.
    fn bound(&self, c: &Array1<f64>, side: f64) -> Option<Least> {
        let value = c.dot(&self.best);
        let step = side * 0.01 * value.abs().max(1.0 / self.stiffness.sqrt());
        let best = Least { load: self.best.clone(), value, chi_squared: self.least_misfit() };
        let is_force = c.iter().all(|c| *c >= 0.0);
        let profile = Profile {
            most: self.most,
            minimum: |target, _: &Array1<f64>| self.least(c, target),
            // No load has a sum below 0.
            is_stationary: |_: &Least, point: &Least, _| side < 0.0 && is_force && point.value <= 0.0,
        };
        profile.end(best, step)
    }

    fn least(&self, c: &Array1<f64>, t: f64) -> Least {
        let drawn = Some((c, self.stiffness, t));
        let x = LeastSquares { gram: &self.gram, right: &self.right, drawn }.non_negative();
        Least {
            value: c.dot(&x),
            chi_squared: squared_residual((&self.gram, &self.right, self.square), &x),
            load: x,
        }
    }
}

/// ‖A·x − y‖² from AᵀA, Aᵀy and |y|².
fn squared_residual((gram, right, square): (&Array2<f64>, &Array1<f64>, f64), x: &Array1<f64>) -> f64 {
    let used: Vec<usize> = (0..x.len()).filter(|i| x[*i] > 0.0).collect();
    let row = |i: &usize| x[*i] * used.iter().map(|j| gram[[*i, *j]] * x[*j]).sum::<f64>();
    used.iter().map(row).sum::<f64>() - 2.0 * x.dot(right) + square
}

/// Relative gradient rounding.
const ROUNDING: f64 = 1e-10;

/// ‖A·x − y‖² + ρ²·(c·x − t)², the second term optional.
struct LeastSquares<'a> {
    gram: &'a Array2<f64>,
    right: &'a Array1<f64>,
    drawn: Option<(&'a Array1<f64>, f64, f64)>,
}

impl LeastSquares<'_> {
    fn gram(&self, i: usize, j: usize) -> f64 {
        self.gram[[i, j]] + self.drawn.map_or(0.0, |(c, stiffness, _)| stiffness * c[i] * c[j])
    }

    fn right(&self, i: usize) -> f64 {
        self.right[i] + self.drawn.map_or(0.0, |(c, stiffness, t)| stiffness * t * c[i])
    }

    /// Active-set minimum over x ≥ 0 (Lawson and Hanson, *Solving Least Squares Problems*, 1974, chapter 23),
    /// cheap for a wide A. `smoothness::minimise` needs a positive definite matrix, unlike AᵀA.
    fn non_negative(&self) -> Array1<f64> {
        let columns = self.right.len();
        let lengths: Vec<f64> = (0..columns).map(|j| self.gram(j, j).sqrt()).collect();
        let right: Vec<f64> = (0..columns).map(|j| self.right(j) / lengths[j]).collect();
        let least = ROUNDING * right.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let mut x = Array1::<f64>::zeros(columns);
        let mut used: Vec<usize> = Vec::new();
        // Columns that linearly depend on the active ones, to rounding.
        let mut spent: Vec<usize> = Vec::new();
        for _ in 0..3 * columns {
            let slope =
                |j: usize| right[j] - used.iter().map(|i| self.gram(j, *i) * x[*i]).sum::<f64>() / lengths[j];
            let waiting = (0..columns).filter(|j| !used.contains(j) && !spent.contains(j));
            let steepest = waiting.map(|j| (slope(j), j)).max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, next)) = steepest.filter(|(slope, _)| *slope > least) else { break };
            used.push(next);
            if self.fit(&mut x, &mut used, next) { spent.clear() } else { spent.push(next) }
        }
        x
    }

    /// Moves to the minimum over non-negative active columns; false, without a move, if `next` does not
    /// reduce the misfit.
    fn fit(&self, x: &mut Array1<f64>, used: &mut Vec<usize>, next: usize) -> bool {
        let mut is_first = true;
        while !used.is_empty() {
            let gram = Array2::from_shape_fn((used.len(), used.len()), |(i, j)| self.gram(used[i], used[j]));
            let right: Array1<f64> = used.iter().map(|i| self.right(*i)).collect();
            let solution = Cholesky::factor(gram).ok().map(|factor| factor.solve(&right));
            let of_next = |solution: &Array1<f64>| {
                used.iter().position(|j| *j == next).is_some_and(|at| solution[at] > 0.0)
            };
            let is_sound = |solution: &Array1<f64>| {
                solution.iter().all(|value| value.is_finite()) && (!is_first || of_next(solution))
            };
            let Some(solution) = solution.filter(is_sound) else {
                used.retain(|j| *j != next);
                return false;
            };
            is_first = false;
            if solution.iter().all(|value| *value > 0.0) {
                used.iter().zip(&solution).for_each(|(j, value)| x[*j] = *value);
                return true;
            }
            let negative = used.iter().zip(&solution).filter(|(_, value)| **value <= 0.0);
            let share = negative.map(|(j, value)| x[*j] / (x[*j] - value)).fold(1.0, f64::min);
            used.iter().zip(&solution).for_each(|(j, value)| x[*j] += share * (value - x[*j]));
            let least = 1e-14 * x.iter().fold(0.0, |most: f64, value| most.max(*value));
            let (kept, left): (Vec<usize>, Vec<usize>) = used.iter().partition(|j| x[**j] > least);
            left.iter().for_each(|j| x[*j] = 0.0);
            if left.is_empty() {
                return true;
            }
            *used = kept;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    proptest! {
        /// Karush–Kuhn–Tucker conditions, with and without a target.
        #[test]
        fn the_minimum_meets_its_conditions(seed in 0u64..1000, rows in 1usize..10, columns in 1usize..40) {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let a = Array2::from_shape_fn((rows, columns), |_| rng.random_range(-1.0..1.0));
            let y = Array1::from_shape_fn(rows, |_| rng.random_range(-1.0..1.0));
            let c = Array1::from_shape_fn(columns, |_| rng.random_range(0.0..1.0));
            let (gram, right) = (a.t().dot(&a), a.t().dot(&y));
            for drawn in [None, Some((&c, 0.5, 2.0))] {
                let problem = LeastSquares { gram: &gram, right: &right, drawn };
                let x = problem.non_negative();
                for i in 0..columns {
                    let gradient = (0..columns).map(|j| problem.gram(i, j) * x[j]).sum::<f64>() - problem.right(i);
                    prop_assert!(x[i] >= 0.0 && gradient >= -1e-6, "{} {gradient}", x[i]);
                    prop_assert!((x[i] * gradient).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn bounds_of_one_cell_are_those_of_least_squares() {
        // One sensor, one cell: x = y/a ± √5/a.
        let bounds = Bounds::new(&Array2::from_elem((1, 1), 2.0), &Array1::from(vec![20.0]));
        let (low, high) = bounds.of_sum(&Array1::ones(1));
        let half = 0.5 * NON_NEGATIVE_INCREASE.sqrt();
        assert!((low - (10.0 - half)).abs() < 1e-3 && (high - (10.0 + half)).abs() < 1e-3, "{low} {high}");
        // A cell without a sensitive sensor has no upper bound, and a small reading may have the lower bound
        // 0.
        let blind =
            Bounds::new(&Array2::from_shape_vec((1, 2), vec![2.0, 0.0]).unwrap(), &Array1::from(vec![20.0]));
        assert_eq!(blind.of_sum(&Array1::ones(2)).1, f64::INFINITY);
        let faint = Bounds::new(&Array2::from_elem((1, 1), 2.0), &Array1::from(vec![1.0]));
        assert_eq!(faint.of_sum(&Array1::ones(1)).0, 0.0);
    }

    #[test]
    fn bounds_of_a_mean_are_those_of_two_cells() {
        // Two sensors, each of one cell at 0 m or 1 m: forces of 20/2 and 10/2 N with standard deviation 1/2
        // N. For the mean v, (1 − v)·b = v·a, and the least misfit is (v·20 − (1 − v)·10)²/(v² + (1 − v)²).
        let a = Array2::from_diag(&Array1::from(vec![2.0, 2.0]));
        let bounds = Bounds::new(&a, &Array1::from(vec![20.0, 10.0]));
        let misfit = |v: f64| (v * 20.0 - (1.0 - v) * 10.0).powi(2) / (v * v + (1.0 - v) * (1.0 - v));
        let (low, high) = bounds.of_mean(&[0, 1], &[0.0, 1.0]);
        assert!(low < 1.0 / 3.0 && 1.0 / 3.0 < high, "{low} {high}");
        for end in [low, high] {
            assert!((misfit(end) - NON_NEGATIVE_INCREASE).abs() < 0.1, "{end}: {}", misfit(end));
        }
        // One cell has one mean, and an insensitive cell may have all of the load.
        assert_eq!(bounds.of_mean(&[1], &[0.3]), (0.3, 0.3));
        let blind =
            Bounds::new(&Array2::from_shape_vec((1, 2), vec![2.0, 0.0]).unwrap(), &Array1::from(vec![20.0]));
        assert_eq!(blind.of_mean(&[0, 1], &[0.0, 1.0]).1, 1.0);
    }
}
