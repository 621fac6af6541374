//! Algebra of small matrices without allocation.

/// A matrix by rows.
pub type Matrix<const N: usize> = [[f64; N]; N];

/// Largest relative pivot that is rounding.
///
/// Ten additions of sums over tens of channels err by up to 45·ε (Higham, *Accuracy and Stability of
/// Numerical Algorithms*, 3.1 and 10.1).
pub const ROUNDING: f64 = 1e-14;

/// A = L·D·Lᵀ for a symmetric positive semidefinite lower triangle.
///
/// A fixed unknown has no pivot, and is 0 in solutions and inverses.
///
/// ```
/// use palpate_numerics::small::Ldl;
///
/// let factors = Ldl::new(&[[4.0, 0.0], [2.0, 3.0]]).unwrap(); // the lower triangle of [[4, 2], [2, 3]]
/// assert_eq!(factors.determinant(), 8.0);
/// assert_eq!(factors.solve([8.0, 8.0]), [1.0, 2.0]);
/// assert!(Ldl::new(&[[1.0, 0.0], [2.0, 4.0]]).is_none()); // singular
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ldl<const N: usize> {
    /// L below the diagonal.
    lower: Matrix<N>,
    /// D; 0 for a fixed unknown.
    pivots: [f64; N],
    inverse_pivots: [f64; N],
}

#[expect(clippy::needless_range_loop, reason = "as the formulas have their indices")]
impl<const N: usize> Ldl<N> {
    /// Factors a matrix; `None` unless positive definite, to [`ROUNDING`].
    #[inline]
    pub fn new(a: &Matrix<N>) -> Option<Self> {
        Self::of_free(a, [true; N])
    }

    /// Factors the `free` part, with the rest fixed; `None` as [`Ldl::new`].
    #[inline]
    pub fn of_free(a: &Matrix<N>, free: [bool; N]) -> Option<Self> {
        let factors =
            Self::factor(a, |k, pivot, rounding| if free[k] && pivot > rounding { pivot } else { 0.0 });
        (0..N).all(|k| !free[k] || factors.pivots[k] > 0.0).then_some(factors)
    }

    /// Factors a semidefinite matrix; undetermined unknowns are fixed.
    #[inline]
    pub fn semidefinite(a: &Matrix<N>) -> Self {
        Self::factor(a, |_, pivot, rounding| if pivot > rounding { pivot } else { 0.0 })
    }

    /// Factors with pivots raised to [`ROUNDING`].
    #[inline]
    pub fn regularised(a: &Matrix<N>) -> Self {
        Self::factor(a, |_, pivot, rounding| pivot.max(rounding))
    }

    /// Factors R·Rᵀ from R.
    #[inline]
    pub fn of_root(root: &Matrix<N>) -> Self {
        let lower = std::array::from_fn(|i| std::array::from_fn(|j| root[i][j] / root[j][j]));
        let pivots: [f64; N] = std::array::from_fn(|k| root[k][k] * root[k][k]);
        Self { lower, pivots, inverse_pivots: pivots.map(f64::recip) }
    }

    /// Golub and Van Loan, *Matrix Computations*, 4.1.2. `pivot_of(index, pivot, rounding)` returns the used
    /// pivot.
    #[inline(always)]
    fn factor(a: &Matrix<N>, pivot_of: impl Fn(usize, f64, f64) -> f64) -> Self {
        let mut factors = Self { lower: [[0.0; N]; N], pivots: [0.0; N], inverse_pivots: [0.0; N] };
        for i in 0..N {
            // L·D of this row; the division by D follows afterwards.
            let mut row = [0.0; N];
            let mut left = a[i][i];
            for j in 0..i {
                row[j] = a[i][j];
                for m in 0..j {
                    row[j] -= row[m] * factors.lower[j][m];
                }
                factors.lower[i][j] = row[j] * factors.inverse_pivots[j];
                left -= row[j] * factors.lower[i][j];
            }
            let pivot = pivot_of(i, left, ROUNDING * a[i][i]);
            let inverse = 1.0 / pivot;
            factors.pivots[i] = pivot;
            factors.inverse_pivots[i] = if pivot == 0.0 { 0.0 } else { inverse };
        }
        factors
    }

    /// 1/D; 0 if fixed.
    #[inline]
    pub fn inverse_pivots(&self) -> &[f64; N] {
        &self.inverse_pivots
    }

    /// R = L·√D, so that A = R·Rᵀ.
    #[inline]
    pub fn root(&self) -> Matrix<N> {
        let roots = self.pivots.map(f64::sqrt);
        let entry = |i: usize, j: usize| if i == j { roots[j] } else { self.lower[i][j] * roots[j] };
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }

    /// L⁻¹·b.
    #[inline]
    pub fn solve_lower(&self, mut b: [f64; N]) -> [f64; N] {
        for i in 1..N {
            for j in 0..i {
                b[i] -= self.lower[i][j] * b[j];
            }
        }
        b
    }

    /// A⁻¹·b.
    #[inline]
    pub fn solve(&self, b: [f64; N]) -> [f64; N] {
        let mut x = self.solve_lower(b);
        for i in (0..N).rev() {
            x[i] *= self.inverse_pivots[i];
            for j in i + 1..N {
                x[i] -= self.lower[j][i] * x[j];
            }
        }
        x
    }

    /// bᵀ·A⁻¹·b.
    #[inline]
    pub fn quadratic(&self, b: [f64; N]) -> f64 {
        self.solve_lower(b).iter().zip(&self.inverse_pivots).map(|(y, inverse)| y * y * inverse).sum()
    }

    /// A⁻¹.
    #[inline]
    pub fn inverse(&self) -> Matrix<N> {
        let mut undone = [[0.0; N]; N];
        for j in 0..N {
            undone[j][j] = 1.0;
            for i in j + 1..N {
                for m in j..i {
                    undone[i][j] -= self.lower[i][m] * undone[m][j];
                }
            }
        }
        let mut inverse = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let entry = (i..N).map(|m| undone[m][i] * self.inverse_pivots[m] * undone[m][j]).sum();
                (inverse[i][j], inverse[j][i]) = (entry, entry);
            }
        }
        inverse
    }

    /// det A without fixed unknowns.
    #[inline]
    pub fn determinant(&self) -> f64 {
        self.pivots.iter().filter(|pivot| **pivot != 0.0).product()
    }

    /// ln det A without fixed unknowns.
    #[inline]
    pub fn log_determinant(&self) -> f64 {
        self.pivots.iter().filter(|pivot| **pivot != 0.0).map(|pivot| pivot.ln()).sum()
    }
}

/// aᵀ·b.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Adds factor·b to a.
#[inline]
pub fn add_multiple(a: &mut [f64], factor: f64, b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
}

/// aᵀ·M·b.
#[inline]
pub fn form<const N: usize>(a: &[f64; N], matrix: &Matrix<N>, b: &[f64; N]) -> f64 {
    a.iter().zip(matrix).map(|(a, row)| a * dot(row, b)).sum()
}

/// Adds weight·j·jᵀ to A.
#[inline(always)]
pub fn add_outer<const N: usize>(a: &mut Matrix<N>, weight: f64, j: &[f64; N]) {
    for (row, left) in a.iter_mut().zip(j) {
        let left = weight * left;
        row.iter_mut().zip(j).for_each(|(entry, right)| *entry += left * right);
    }
}

/// Eigenvalues of [[xx, xy], [xy, yy]], descending, ≥ 0.
#[inline]
pub fn principal_variances([xx, xy, yy]: [f64; 3]) -> [f64; 2] {
    let (mean, radius) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    [mean + radius, (mean - radius).max(0.0)]
}

/// Eigenvector of the larger eigenvalue.
#[inline]
pub fn principal_direction([xx, xy, yy]: [f64; 3]) -> [f64; 2] {
    let (sin, cos) = (0.5 * xy.atan2(0.5 * (xx - yy))).sin_cos();
    [cos, sin]
}

/// Solves A·x = b; not finite if singular.
///
/// One correction makes it exact to rounding (Skeel, Math. Comp. 35, 1980).
pub fn solve_general<const N: usize>(a: &Matrix<N>, b: &[f64; N]) -> [f64; N] {
    let solution = eliminated(*a, *b);
    let left_over = std::array::from_fn(|i| b[i] - dot(&a[i], &solution));
    let correction = eliminated(*a, left_over);
    std::array::from_fn(|i| solution[i] + correction[i])
}

/// Gaussian elimination with row scaling and partial pivoting.
fn eliminated<const N: usize>(mut a: Matrix<N>, mut b: [f64; N]) -> [f64; N] {
    for (row, right) in a.iter_mut().zip(&mut b) {
        let size = row.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        row.iter_mut().for_each(|value| *value /= size);
        *right /= size;
    }
    for column in 0..N {
        let larger = |i: &usize, j: &usize| a[*i][column].abs().total_cmp(&a[*j][column].abs());
        let pivot = (column..N).max_by(larger).unwrap_or(column);
        a.swap(column, pivot);
        b.swap(column, pivot);
        let above = a[column];
        for i in column + 1..N {
            let factor = a[i][column] / above[column];
            a[i].iter_mut().zip(&above).for_each(|(value, above)| *value -= factor * above);
            b[i] -= factor * b[column];
        }
    }
    for i in (0..N).rev() {
        b[i] = (b[i] - dot(&a[i][i + 1..], &b[i + 1..])) / a[i][i];
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symmetric_eigen;
    use ndarray::Array2;
    use proptest::prelude::*;

    /// R·Rᵀ with a diagonal of R from 0.1 to 2.
    fn positive_definite() -> impl Strategy<Value = Matrix<4>> {
        proptest::array::uniform16(-1.0..1.0f64).prop_map(|numbers| {
            let root = |i: usize, j: usize| match i.cmp(&j) {
                std::cmp::Ordering::Less => 0.0,
                std::cmp::Ordering::Equal => 1.05 + 0.95 * numbers[5 * i],
                std::cmp::Ordering::Greater => numbers[4 * i + j],
            };
            std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|m| root(i, m) * root(j, m)).sum()))
        })
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * (1.0 + a.abs())
    }

    proptest! {
        #[test]
        fn factors_solve_invert_and_give_the_determinant(a in positive_definite()) {
            let factors = Ldl::new(&a).unwrap();
            let (root, inverse) = (factors.root(), factors.inverse());
            let right = [1.0, -2.0, 0.5, 3.0];
            let solution = factors.solve(right);
            for i in 0..4 {
                prop_assert!(close(right[i], dot(&a[i], &solution)));
                prop_assert!(close(solution[i], dot(&inverse[i], &right)));
                for j in 0..4 {
                    prop_assert!(close(a[i][j], dot(&root[i], &root[j])));
                    prop_assert_eq!(inverse[i][j], inverse[j][i]);
                }
            }
            prop_assert!(close(factors.quadratic(right), dot(&right, &solution)));
            prop_assert!(close(form(&solution, &a, &solution), dot(&right, &solution)));
            let (eigenvalues, _) = symmetric_eigen(&Array2::from(a.to_vec()));
            prop_assert!(close(factors.determinant() / eigenvalues.product(), 1.0));
            prop_assert!(close(factors.log_determinant(), factors.determinant().ln()));
            prop_assert_eq!(Ldl::regularised(&a), factors);
            prop_assert!(close(Ldl::of_root(&root).determinant(), factors.determinant()));
            let general = solve_general(&a, &right);
            prop_assert!((0..4).all(|i| close(general[i], solution[i])));
        }

        #[test]
        fn constrained_unknowns_are_excluded(a in positive_definite()) {
            let factors = Ldl::of_free(&a, [true, false, true, false]).unwrap();
            let smaller = Ldl::new(&[[a[0][0], a[0][2]], [a[2][0], a[2][2]]]).unwrap();
            let [x, y] = smaller.solve([1.0, -2.0]);
            let solution = factors.solve([1.0, 7.0, -2.0, 8.0]);
            prop_assert!((solution[1], solution[3]) == (0.0, 0.0));
            prop_assert!(close(solution[0], x) && close(solution[2], y));
            prop_assert!(close(factors.determinant(), smaller.determinant()));
            prop_assert!(factors.inverse()[1] == [0.0; 4] && close(factors.inverse()[2][2], smaller.inverse()[1][1]));
        }
    }

    #[test]
    fn a_matrix_that_is_singular_to_rounding_is_not_positive_definite() {
        // The remainder of the second unknown is (1 + share)·10⁻⁶ − 10⁻⁶, in other units than the first.
        let a = |share: f64| [[1e6, 1.0], [1.0, (1.0 + share) * 1e-6]];
        assert!(
            Ldl::new(&a(2e-14)).is_some() && Ldl::new(&a(0.0)).is_none() && Ldl::new(&a(-1e-3)).is_none()
        );
        assert_eq!(Ldl::semidefinite(&a(0.0)).solve([1e6, 5.0]), [1.0, 0.0]);
        assert!(Ldl::regularised(&a(0.0)).inverse()[1][1] >= 0.9e20);
        for number in [f64::NAN, f64::INFINITY, 0.0] {
            assert!(Ldl::new(&[[1.0, 0.0], [0.0, number]]).is_none(), "{number}");
        }
    }

    #[test]
    fn principal_axes_turn_with_the_ellipse() {
        for angle in [0.0, 0.3, 1.2, -0.7f64] {
            let (sin, cos) = angle.sin_cos();
            let turned = [9.0 * cos * cos + sin * sin, 8.0 * sin * cos, 9.0 * sin * sin + cos * cos];
            let ([larger, smaller], [x, y]) = (principal_variances(turned), principal_direction(turned));
            assert!(close(larger, 9.0) && close(smaller, 1.0) && close(x * cos + y * sin, 1.0));
        }
    }

    #[test]
    fn equations_of_very_different_sizes_are_solved_to_rounding() {
        let scale = [1e-9, 1.0, 1e9];
        let a = [[0.0, 2.0, 1.0], [1.0, 1.0, 0.0], [3.0, -1.0, 2.0]];
        let (truth, scaled): ([f64; 3], Matrix<3>) =
            ([1.0, -2.0, 3.0], std::array::from_fn(|i| a[i].map(|value| scale[i] * value)));
        let found = solve_general(&scaled, &std::array::from_fn(|i| dot(&scaled[i], &truth)));
        assert!((0..3).all(|i| (found[i] - truth[i]).abs() < 1e-15 * 4.0), "{found:?}");
        assert!(!solve_general(&[[1.0, 2.0], [2.0, 4.0]], &[1.0, 1.0])[0].is_finite());
    }
}
