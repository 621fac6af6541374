//! Cholesky factorisation A = L·Lᵀ of a symmetric positive definite matrix.
//!
//! What bounds it: the trailing update of the blocked algorithm (Golub and Van Loan, *Matrix Computations*, 4.2.5) is
//! nearly all of the n³/3 multiply-adds, and is a matrix product, which ndarray hands to a tuned kernel.

use ndarray::linalg::general_mat_mul;
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, Axis, s};

/// Columns that are factored before the rest of the matrix is updated.
const BLOCK: usize = 64;

/// The factor L of A = L·Lᵀ, lower triangular.
#[derive(Clone, Debug, PartialEq)]
pub struct Cholesky {
    lower: Array2<f64>,
}

/// A matrix that has no Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the matrix is not positive definite: pivot {row} of {size} is {pivot:e}")]
pub struct NotPositiveDefinite {
    /// Which pivot failed, from 1.
    pub row: usize,
    /// Rows of the matrix.
    pub size: usize,
    /// Its value, which must be greater than 0.
    pub pivot: f64,
}

impl Cholesky {
    /// Factors a square matrix, of which only the lower triangle is read.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`], with the pivot that is not greater than 0 or not finite.
    ///
    /// # Panics
    /// When the matrix is not square.
    pub fn factor(mut matrix: Array2<f64>) -> Result<Self, NotPositiveDefinite> {
        let size = matrix.nrows();
        assert_eq!(size, matrix.ncols(), "a matrix to be factored is square");
        for start in (0..size).step_by(BLOCK) {
            let end = (start + BLOCK).min(size);
            factor_panel(&mut matrix, start, end)?;
            update_trailing(&mut matrix, start, end);
        }
        for (row, mut values) in matrix.outer_iter_mut().enumerate() {
            values.slice_mut(s![row + 1..]).fill(0.0);
        }
        Ok(Self { lower: matrix })
    }

    /// L.
    pub fn lower(&self) -> ArrayView2<'_, f64> {
        self.lower.view()
    }

    /// Rows of the matrix.
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

    /// L⁻¹·b in the place of b.
    ///
    /// # Panics
    /// When b is shorter than the matrix.
    pub fn solve_lower_in_place(&self, b: &mut [f64]) {
        for (i, row) in self.lower.outer_iter().enumerate() {
            let sum = row.slice(s![..i]).dot(&ArrayView1::from(&b[..i]));
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

    /// L⁻¹·B, column by column, in blocks that are matrix products.
    pub fn solve_lower_matrix(&self, mut b: Array2<f64>) -> Array2<f64> {
        let size = self.size();
        for start in (0..size).step_by(BLOCK) {
            let end = (start + BLOCK).min(size);
            for i in start..end {
                let (done, mut rest) = b.view_mut().split_at(Axis(0), i);
                let mut row = rest.row_mut(0);
                for k in start..i {
                    row.scaled_add(-self.lower[[i, k]], &done.row(k));
                }
                row /= self.lower[[i, i]];
            }
            let (done, mut rest) = b.view_mut().split_at(Axis(0), end);
            let left = self.lower.slice(s![end.., start..end]);
            general_mat_mul(-1.0, &left, &done.slice(s![start.., ..]), 1.0, &mut rest);
        }
        b
    }

    /// A⁻¹.
    pub fn inverse(&self) -> Array2<f64> {
        Self::gram_of_lower(&self.inverse_lower())
    }

    /// L⁻¹, lower triangular.
    pub fn inverse_lower(&self) -> Array2<f64> {
        let size = self.size();
        let mut inverse = Array2::eye(size);
        for start in (0..size).step_by(BLOCK) {
            let end = (start + BLOCK).min(size);
            // Right of the diagonal block, these rows stay 0.
            let (mut done, mut rest) = inverse.slice_mut(s![.., ..end]).split_at(Axis(0), end);
            for i in start..end {
                let (above, mut below) = done.view_mut().split_at(Axis(0), i);
                let mut row = below.row_mut(0);
                for k in start..i {
                    row.scaled_add(-self.lower[[i, k]], &above.row(k));
                }
                row /= self.lower[[i, i]];
            }
            let left = self.lower.slice(s![end.., start..end]);
            general_mat_mul(-1.0, &left, &done.slice(s![start.., ..]), 1.0, &mut rest);
        }
        inverse
    }

    /// Mᵀ·M for a lower triangular M: A⁻¹ where M = L⁻¹.
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

/// Factors columns `start..end`, from the diagonal down.
fn factor_panel(matrix: &mut Array2<f64>, start: usize, end: usize) -> Result<(), NotPositiveDefinite> {
    let size = matrix.nrows();
    for j in start..end {
        let (above, mut below) = matrix.view_mut().split_at(Axis(0), j + 1);
        let row = above.row(j).slice(s![start..j]).to_owned();
        let pivot = above[[j, j]] - row.dot(&row);
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(NotPositiveDefinite { row: j + 1, size, pivot });
        }
        let root = pivot.sqrt();
        for mut lower in below.outer_iter_mut() {
            let sum = lower.slice(s![start..j]).dot(&row);
            lower[j] = (lower[j] - sum) / root;
        }
        matrix[[j, j]] = root;
    }
    Ok(())
}

/// Takes the finished columns `start..end` off the lower triangle to their right, block column by block column.
fn update_trailing(matrix: &mut Array2<f64>, start: usize, end: usize) {
    let panel = matrix.slice(s![end.., start..end]).to_owned();
    for column in (0..panel.nrows()).step_by(BLOCK) {
        let width = BLOCK.min(panel.nrows() - column);
        let left = panel.slice(s![column.., ..]);
        let right = panel.slice(s![column..column + width, ..]);
        let from = end + column;
        let mut target = matrix.slice_mut(s![from.., from..from + width]);
        general_mat_mul(-1.0, &left, &right.t(), 1.0, &mut target);
    }
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
