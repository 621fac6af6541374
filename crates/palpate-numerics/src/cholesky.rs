//! Blocked Cholesky factorisation (Golub and Van Loan, *Matrix Computations*, 4.2.5).

use ndarray::linalg::general_mat_mul;
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, ArrayViewMut2, Axis, s};

const BLOCK: usize = 64;

/// Largest size without recursion.
const NARROW: usize = 16;

const LANES: usize = 8;

const GRAM: usize = 48;

/// The factor L of A = L·Lᵀ.
///
/// ```
/// use ndarray::array;
/// use palpate_numerics::Cholesky;
///
/// let factor = Cholesky::factor(array![[4.0, 2.0], [2.0, 3.0]])?;
/// let x = factor.solve(&array![8.0, 8.0]);
/// assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14);
/// assert!((factor.log_determinant() - 8f64.ln()).abs() < 1e-15);
/// # Ok::<(), palpate_numerics::NotPositiveDefinite>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Cholesky {
    /// Row by row in memory.
    lower: Array2<f64>,
}

/// Error of a matrix without a Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the matrix is not positive definite: pivot {row} of {size} is {pivot:e}")]
pub struct NotPositiveDefinite {
    /// Failed pivot, from 1.
    pub row: usize,
    /// Size of the matrix.
    pub size: usize,
    /// Value of the pivot.
    pub pivot: f64,
}

impl Cholesky {
    /// Factors a square matrix from its lower triangle.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`].
    ///
    /// # Panics
    /// For a rectangular matrix.
    pub fn factor(mut matrix: Array2<f64>) -> Result<Self, NotPositiveDefinite> {
        let size = matrix.nrows();
        assert_eq!(size, matrix.ncols(), "a matrix to be factored is square");
        if !matrix.is_standard_layout() {
            matrix = matrix.as_standard_layout().into_owned();
        }
        factor_panel(matrix.view_mut()).map_err(|error| NotPositiveDefinite { size, ..error })?;
        for (row, mut values) in matrix.outer_iter_mut().enumerate() {
            values.slice_mut(s![row + 1..]).fill(0.0);
        }
        Ok(Self { lower: matrix })
    }

    /// Wraps L of positive diagonal.
    ///
    /// # Panics
    /// For a rectangular matrix.
    pub fn from_lower(lower: &ArrayView2<f64>) -> Self {
        assert_eq!(lower.nrows(), lower.ncols(), "a factor is square");
        Self { lower: lower.as_standard_layout().into_owned() }
    }

    /// L.
    pub fn lower(&self) -> ArrayView2<'_, f64> {
        self.lower.view()
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.lower.nrows()
    }

    /// ln det A = 2·Σ ln L_ii.
    pub fn log_determinant(&self) -> f64 {
        2.0 * self.lower.diag().iter().map(|d| d.ln()).sum::<f64>()
    }

    /// L⁻¹·b.
    pub fn solve_lower(&self, b: &Array1<f64>) -> Array1<f64> {
        let mut x = b.to_vec();
        self.solve_lower_in_place(&mut x);
        Array1::from(x)
    }

    /// Replaces b by L⁻¹·b.
    ///
    /// # Panics
    /// For a short b.
    pub fn solve_lower_in_place(&self, b: &mut [f64]) {
        let lower = self.lower.as_slice().expect("it lies row by row");
        for (i, row) in lower.chunks_exact(self.size().max(1)).enumerate() {
            let sum = ArrayView1::from(&row[..i]).dot(&ArrayView1::from(&b[..i]));
            b[i] = (b[i] - sum) / row[i];
        }
    }

    /// L⁻ᵀ·b.
    pub fn solve_upper(&self, b: &Array1<f64>) -> Array1<f64> {
        let mut x = b.clone();
        for i in (0..self.size()).rev() {
            let row = self.lower.row(i);
            x[i] /= row[i];
            let value = x[i];
            x.slice_mut(s![..i]).scaled_add(-value, &row.slice(s![..i]));
        }
        x
    }

    /// A⁻¹·b.
    pub fn solve(&self, b: &Array1<f64>) -> Array1<f64> {
        self.solve_upper(&self.solve_lower(b))
    }

    /// L⁻¹·B.
    ///
    /// # Panics
    /// For a wrong number of rows.
    pub fn solve_lower_matrix(&self, mut b: Array2<f64>) -> Array2<f64> {
        assert_eq!(b.nrows(), self.size(), "a right side has as many rows as the matrix");
        let columns = b.ncols();
        self.substitute_forward(b.view_mut(), 0, &|_| columns);
        b
    }

    /// A⁻¹·B.
    ///
    /// # Panics
    /// For a wrong number of rows.
    pub fn solve_matrix(&self, b: Array2<f64>) -> Array2<f64> {
        self.solve_upper_matrix(self.solve_lower_matrix(b))
    }

    /// L⁻ᵀ·B.
    ///
    /// # Panics
    /// For a wrong number of rows.
    pub fn solve_upper_matrix(&self, mut b: Array2<f64>) -> Array2<f64> {
        assert_eq!(b.nrows(), self.size(), "a right side has as many rows as the matrix");
        self.substitute_backward(b.view_mut(), 0);
        b
    }

    /// A⁻¹.
    pub fn inverse(&self) -> Array2<f64> {
        Self::gram_of_lower(&self.inverse_lower())
    }

    /// L⁻¹.
    pub fn inverse_lower(&self) -> Array2<f64> {
        let mut inverse = Array2::eye(self.size());
        // Right of the diagonal block, rows stay 0.
        self.substitute_forward(inverse.view_mut(), 0, &|end| end);
        inverse
    }

    /// Above row `end` only `columns(end)` columns are nonzero.
    fn substitute_forward(&self, mut b: ArrayViewMut2<f64>, start: usize, columns: &impl Fn(usize) -> usize) {
        let size = b.nrows();
        if size > NARROW {
            let half = (size / 2).next_multiple_of(NARROW);
            let (mut above, mut below) = b.split_at(Axis(0), half);
            self.substitute_forward(above.view_mut(), start, columns);
            let middle = start + half;
            let left = self.lower.slice(s![middle..start + size, start..middle]);
            let used = s![.., ..columns(middle)];
            general_mat_mul(-1.0, &left, &above.slice(used), 1.0, &mut below.slice_mut(used));
            self.substitute_forward(below, middle, columns);
            return;
        }
        let mut b = b.slice_mut(s![.., ..columns(start + size)]);
        for i in 0..size {
            let (above, mut below) = b.view_mut().split_at(Axis(0), i);
            let mut row = below.row_mut(0);
            for (k, above) in above.outer_iter().enumerate() {
                row.scaled_add(-self.lower[[start + i, start + k]], &above);
            }
            row /= self.lower[[start + i, start + i]];
        }
    }

    fn substitute_backward(&self, mut b: ArrayViewMut2<f64>, start: usize) {
        let size = b.nrows();
        if size > NARROW {
            let half = (size / 2).next_multiple_of(NARROW);
            let middle = start + half;
            let (mut above, mut below) = b.split_at(Axis(0), half);
            self.substitute_backward(below.view_mut(), middle);
            let left = self.lower.slice(s![middle..start + size, start..middle]);
            general_mat_mul(-1.0, &left.t(), &below, 1.0, &mut above);
            self.substitute_backward(above, start);
            return;
        }
        for i in (0..size).rev() {
            let (mut done, below) = b.view_mut().split_at(Axis(0), i + 1);
            let mut row = done.row_mut(i);
            for (k, below) in below.outer_iter().enumerate() {
                row.scaled_add(-self.lower[[start + i + 1 + k, start + i]], &below);
            }
            row /= self.lower[[start + i, start + i]];
        }
    }

    /// Mᵀ·M for a lower triangular M.
    pub fn gram_of_lower(lower: &Array2<f64>) -> Array2<f64> {
        let size = lower.nrows();
        let mut gram = Array2::zeros((size, size));
        for start in (0..size).step_by(BLOCK) {
            let end = (start + BLOCK).min(size);
            let left = lower.slice(s![start.., start..end]);
            let right = lower.slice(s![start.., ..end]);
            general_mat_mul(1.0, &left.t(), &right, 0.0, &mut gram.slice_mut(s![start..end, ..end]));
            let square = gram.slice(s![start..end, ..start]).to_owned();
            gram.slice_mut(s![..start, start..end]).assign(&square.t());
        }
        gram
    }
}

/// Factors `columns` of a lower triangle, and updates the rest.
pub(super) fn factor_leading(
    matrix: ArrayViewMut2<'_, f64>,
    columns: usize,
) -> Result<(), NotPositiveDefinite> {
    let (mut left, right) = matrix.split_at(Axis(1), columns);
    factor_panel(left.view_mut())?;
    let (_, right) = right.split_at(Axis(0), columns);
    subtract_gram(right, left.slice(s![columns.., ..]));
    Ok(())
}

/// Recursive factorisation (Gustavson, *Recursion leads to automatic variable blocking for dense
/// linear-algebra algorithms*, 1997).
fn factor_panel(mut panel: ArrayViewMut2<'_, f64>) -> Result<(), NotPositiveDefinite> {
    let columns = panel.ncols();
    if columns <= NARROW {
        return factor_narrow(panel);
    }
    let half = (columns / 2).next_multiple_of(NARROW);
    factor_leading(panel.view_mut(), half)?;
    let right = panel.slice_mut(s![half.., half..]);
    factor_panel(right).map_err(|error| NotPositiveDefinite { row: error.row + half, ..error })
}

fn factor_narrow(panel: ArrayViewMut2<'_, f64>) -> Result<(), NotPositiveDefinite> {
    let (size, columns) = panel.dim();
    let (mut square, mut below) = panel.split_at(Axis(0), columns);
    let mut lower = [[0.0; NARROW]; NARROW];
    for i in 0..columns {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let rest = square[[i, j]] - sum;
            lower[i][j] = if j < i { rest / lower[j][j] } else { rest.sqrt() };
            if i == j && !(rest > 0.0 && rest.is_finite()) {
                return Err(NotPositiveDefinite { row: j + 1, size, pivot: rest });
            }
            square[[i, j]] = lower[i][j];
        }
    }
    for mut rows in below.axis_chunks_iter_mut(Axis(0), LANES) {
        // One column for each row of B.
        let mut x = [[0.0; LANES]; NARROW];
        for (lane, row) in rows.outer_iter().enumerate() {
            x.iter_mut().zip(row).for_each(|(x, value)| x[lane] = *value);
        }
        #[expect(clippy::needless_range_loop, reason = "as the formula has its indices")]
        for j in 0..columns {
            let (done, rest) = x.split_at_mut(j);
            let mut sum = [0.0; LANES];
            for (done, l) in done.iter().zip(&lower[j]) {
                sum.iter_mut().zip(done).for_each(|(sum, x)| *sum += x * l);
            }
            rest[0].iter_mut().zip(&sum).for_each(|(x, sum)| *x = (*x - sum) / lower[j][j]);
        }
        for (lane, row) in rows.outer_iter_mut().enumerate() {
            x.iter().zip(row).for_each(|(x, value)| *value = x[lane]);
        }
    }
    Ok(())
}

/// Subtracts A·Aᵀ from a lower triangle, or its first columns.
#[expect(clippy::needless_pass_by_value, reason = "a view is handed on as the matrix is")]
fn subtract_gram(mut matrix: ArrayViewMut2<'_, f64>, a: ArrayView2<'_, f64>) {
    let columns = matrix.ncols();
    if columns <= GRAM {
        general_mat_mul(-1.0, &a, &a.slice(s![..columns, ..]).t(), 1.0, &mut matrix);
        return;
    }
    let half = (columns / 2).next_multiple_of(LANES);
    let (above, below) = a.split_at(Axis(0), half);
    let (mut top, bottom) = matrix.split_at(Axis(0), half);
    let (mut left, right) = bottom.split_at(Axis(1), half);
    subtract_gram(top.slice_mut(s![.., ..half]), above);
    general_mat_mul(-1.0, &below, &above.t(), 1.0, &mut left);
    subtract_gram(right, below);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn positive_definite(size: usize) -> Array2<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(size as u64);
        let root = Array2::from_shape_fn((size, size), |_| rng.random_range(-1.0..1.0));
        root.dot(&root.t()) + Array2::<f64>::eye(size)
    }

    #[test]
    fn the_factor_gives_the_matrix_back() {
        for size in [1, 2, 63, 64, 65, 200] {
            let matrix = positive_definite(size);
            let cholesky = Cholesky::factor(matrix.clone()).unwrap();
            let product = cholesky.lower().dot(&cholesky.lower().t());
            let worst = (&product - &matrix).iter().fold(0.0, |m: f64, e| m.max(e.abs()));
            assert!(worst < 1e-11 * size as f64, "{size}: {worst}");
        }
    }

    #[test]
    fn solving_undoes_multiplying() {
        let matrix = positive_definite(130);
        let cholesky = Cholesky::factor(matrix.clone()).unwrap();
        let truth = Array1::from_shape_fn(130, |i| (i as f64).sin());
        let found = cholesky.solve(&matrix.dot(&truth));
        assert!((&found - &truth).iter().all(|e| e.abs() < 1e-9));
        let columns = Array2::from_shape_fn((130, 7), |(i, j)| ((i * (j + 1)) as f64).sin());
        let solved = cholesky.solve_matrix(matrix.dot(&columns));
        assert!((&solved - &columns).iter().all(|e| e.abs() < 1e-9));
        let unit = cholesky.inverse().dot(&matrix) - Array2::<f64>::eye(130);
        assert!(unit.iter().all(|e| e.abs() < 1e-9));
    }

    #[test]
    fn the_determinant_is_that_of_a_diagonal() {
        let matrix = Array2::from_diag(&Array1::from(vec![2.0, 3.0, 4.0]));
        let cholesky = Cholesky::factor(matrix).unwrap();
        assert!((cholesky.log_determinant() - 24f64.ln()).abs() < 1e-14);
    }

    #[test]
    fn an_indefinite_matrix_names_its_pivot() {
        let mut matrix = positive_definite(70);
        matrix[[66, 66]] = -1.0;
        let error = Cholesky::factor(matrix).unwrap_err();
        assert_eq!((error.row, error.size), (67, 70));
        let nan = Array2::from_elem((2, 2), f64::NAN);
        assert_eq!(Cholesky::factor(nan).unwrap_err().row, 1);
    }
}
