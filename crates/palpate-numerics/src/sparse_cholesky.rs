//! Cholesky factors of sparse matrices; the one place that knows the library which computes them.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// A symmetric matrix, which grows by columns: its elements on and above the diagonal.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseSymmetric {
    column_starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
}

/// In which order unknowns are eliminated; it decides how many numbers the factor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EliminationOrder {
    /// As the matrix numbers them, for a caller who knows a good order.
    AsNumbered,
    /// By approximate minimum degree, after Amestoy, Davis and Duff (1996).
    MinimumDegree,
}

/// A = L·Lᵀ with a sparse L. Its numbers do not depend on how many threads there are: it uses one.
pub struct SparseCholesky {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
}

/// Why a sparse matrix has no Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SparseCholeskyError {
    /// The matrix is not positive definite.
    #[error("a sparse matrix of {size} rows is not positive definite: a pivot is not greater than 0")]
    NotPositiveDefinite {
        /// Rows of the matrix.
        size: usize,
    },
    /// The factor does not fit into memory.
    #[error("there is no memory for the factor of a sparse matrix of {size} rows")]
    OutOfMemory {
        /// Rows of the matrix.
        size: usize,
    },
}

impl SparseSymmetric {
    /// A matrix without columns, with room for `elements` elements.
    pub fn with_capacity(elements: usize) -> Self {
        Self {
            column_starts: vec![0],
            rows: Vec::with_capacity(elements),
            values: Vec::with_capacity(elements),
        }
    }

    /// Adds the next column: row and value of its elements, each row once. Those below the diagonal are left out, for
    /// their mirror images are in later columns.
    pub fn push_column(&mut self, elements: &mut [(usize, f64)]) {
        let column = self.size();
        elements.sort_unstable_by_key(|(row, _)| *row);
        for (row, value) in elements.iter().take_while(|(row, _)| *row <= column) {
            self.rows.push(*row);
            self.values.push(*value);
        }
        self.column_starts.push(self.rows.len());
    }

    /// How many columns there are.
    pub fn size(&self) -> usize {
        self.column_starts.len() - 1
    }
}

impl SparseCholesky {
    /// Factors `matrix`.
    ///
    /// # Errors
    /// [`SparseCholeskyError`] when it is not positive definite, or too large.
    pub fn new(matrix: &SparseSymmetric, order: EliminationOrder) -> Result<Self, SparseCholeskyError> {
        let size = matrix.size();
        let pattern =
            SymbolicSparseColMatRef::new_checked(size, size, &matrix.column_starts, None, &matrix.rows);
        let ordering = match order {
            EliminationOrder::AsNumbered => SymmetricOrdering::Identity,
            EliminationOrder::MinimumDegree => SymmetricOrdering::Amd,
        };
        let no_memory = SparseCholeskyError::OutOfMemory { size };
        let symbolic =
            factorize_symbolic_cholesky(pattern, Side::Upper, ordering, CholeskySymbolicParams::default())
                .map_err(|_| no_memory)?;
        let mut values = zeros(symbolic.len_val()).ok_or(no_memory)?;
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| no_memory)?;
        let factored = symbolic.factorize_numeric_llt(
            &mut values,
            SparseColMatRef::new(pattern, &matrix.values),
            Side::Upper,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        );
        match factored {
            Ok(_) => Ok(Self { symbolic, values }),
            Err(LltError::NonPositivePivot { .. }) => Err(SparseCholeskyError::NotPositiveDefinite { size }),
        }
    }

    /// The solution x of A·x = b in the place of b; or of several b, one after the other, in one sweep through the factor,
    /// whose reading from memory bounds a sweep for one.
    ///
    /// # Panics
    /// When b is not as long as the matrix, or a multiple of that.
    pub fn solve_in_place(&self, b: &mut [f64]) {
        let (rows, columns) = (self.symbolic.nrows(), b.len() / self.symbolic.nrows().max(1));
        let scratch = self.symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        let right_side = MatMut::from_column_major_slice_mut(b, rows, columns);
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            right_side,
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }

    /// How many numbers L is stored in, some zeros among them.
    pub fn stored_numbers(&self) -> usize {
        self.values.len()
    }
}

/// `count` zeros, if there is memory for them.
fn zeros(count: usize) -> Option<Vec<f64>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    values.resize(count, 0.0);
    Some(values)
}

#[cfg(test)]
mod tests {
    use ndarray::{Array1, Array2};
    use proptest::prelude::*;

    use super::*;
    use crate::Cholesky;

    /// A band matrix with a heavy diagonal, sparse and dense.
    fn matrices(elements: &[f64], band: usize) -> (SparseSymmetric, Array2<f64>) {
        let size = elements.len();
        let element = |row: usize, column: usize| match row.abs_diff(column) {
            0 => 2.0 * band as f64 + 1.0,
            apart if apart <= band => elements[row.max(column)] * elements[row.min(column)],
            _ => 0.0,
        };
        let mut sparse = SparseSymmetric::with_capacity(size * (band + 1));
        for column in 0..size {
            let rows = (column.saturating_sub(band)..size.min(column + band + 1)).rev();
            sparse.push_column(&mut rows.map(|row| (row, element(row, column))).collect::<Vec<_>>());
        }
        (sparse, Array2::from_shape_fn((size, size), |(row, column)| element(row, column)))
    }

    proptest! {
        #[test]
        fn solutions_are_those_of_the_dense_factor(
            elements in proptest::collection::vec(-1.0..1.0f64, 1..120), band in 0..8usize,
        ) {
            let (sparse, dense) = matrices(&elements, band);
            let expected = Cholesky::factor(dense).unwrap().solve(&Array1::from(elements.clone()));
            for order in [EliminationOrder::AsNumbered, EliminationOrder::MinimumDegree] {
                let factor = SparseCholesky::new(&sparse, order).unwrap();
                let mut x = elements.clone();
                factor.solve_in_place(&mut x);
                prop_assert!(x.iter().zip(&expected).all(|(x, expected)| (x - expected).abs() < 1e-12));
                prop_assert!(factor.stored_numbers() >= elements.len());
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_refused() {
        let mut matrix = SparseSymmetric::with_capacity(3);
        matrix.push_column(&mut [(0, 4.0)]);
        matrix.push_column(&mut [(1, 1.0), (0, 2.0)]);
        let refused = SparseCholesky::new(&matrix, EliminationOrder::AsNumbered).err();
        assert_eq!(refused, Some(SparseCholeskyError::NotPositiveDefinite { size: 2 }));
    }

    #[test]
    fn an_empty_matrix_has_an_empty_factor() {
        let factor =
            SparseCholesky::new(&SparseSymmetric::with_capacity(0), EliminationOrder::AsNumbered).unwrap();
        factor.solve_in_place(&mut []);
        assert_eq!(factor.stored_numbers(), 0);
    }
}
