//! Multifrontal sparse Cholesky factorisation (Duff and Reid, *The multifrontal solution of indefinite sparse
//! symmetric linear equations*, 1983; Liu, *The multifrontal method for sparse matrix solution: theory and
//! practice*, 1992), in the order of columns.
//!
//! Supernodes, columns of similar pattern, are eliminated in dense fronts: their columns of A plus update
//! matrices of their children.

use std::mem;
use std::ops::Range;

use ndarray::linalg::general_mat_mul;
use ndarray::{ArrayView2, ArrayViewMut2};

use super::cholesky::factor_leading;
use super::watch::{Cancelled, Watch};

const PANEL: usize = 64;

/// Smaller supernodes merge up to [`MOST_ZEROS`], as larger fronts are faster.
const SMALL: usize = 48;
const MOST_ZEROS: f64 = 0.2;

/// Share of zeros in larger supernodes.
const FEW_ZEROS: f64 = 0.02;

const STAGE: &str = "factoring the equations";
/// Work between checks of the watch.
const COLUMNS_EACH: usize = 1 << 10;
const PRODUCTS_EACH: usize = 1 << 23;

/// Lower triangle of a sparse symmetric matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseSymmetric {
    column_starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
}

/// The sparse factor L of A = L·Lᵀ.
pub struct SparseCholesky {
    size: usize,
    panels: Vec<Panel>,
    values: Vec<f64>,
}

/// Row by row: a square, then the nonzero rows below.
struct Panel {
    columns: Range<usize>,
    below: Vec<usize>,
    /// Index in the values.
    start: usize,
}

struct Supernode {
    columns: Range<usize>,
    /// Rows, ascending.
    pattern: Vec<usize>,
    /// Stored zeros.
    zeros: usize,
}

struct Fronts<'a> {
    waiting: Vec<Vec<Update<'a>>>,
    places: Vec<usize>,
}

struct Update<'a> {
    pattern: &'a [usize],
    triangle: Vec<f64>,
}

/// Error of a sparse matrix without a Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SparseCholeskyError {
    /// The matrix is not positive definite.
    #[error("a sparse matrix of {size} rows is not positive definite: a pivot is not greater than 0")]
    NotPositiveDefinite {
        /// Size of the matrix.
        size: usize,
    },
    /// The factor is too large for the memory.
    #[error("the factor of a sparse matrix of {size} rows does not fit into memory")]
    OutOfMemory {
        /// Size of the matrix.
        size: usize,
    },
    /// The watch cancelled the work.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl SparseSymmetric {
    /// Creates an empty matrix.
    pub fn with_capacity(elements: usize) -> Self {
        Self {
            column_starts: vec![0],
            rows: Vec::with_capacity(elements),
            values: Vec::with_capacity(elements),
        }
    }

    /// Appends a column; elements above the diagonal are ignored.
    pub fn push_column(&mut self, elements: impl IntoIterator<Item = (usize, f64)>) {
        let column = self.size();
        for (row, value) in elements.into_iter().filter(|(row, _)| *row >= column) {
            self.rows.push(row);
            self.values.push(value);
        }
        self.column_starts.push(self.rows.len());
    }

    /// Number of columns.
    pub fn size(&self) -> usize {
        self.column_starts.len() - 1
    }

    fn elements(&self, column: usize) -> Range<usize> {
        self.column_starts[column]..self.column_starts[column + 1]
    }
}

impl SparseCholesky {
    /// Factors a matrix.
    ///
    /// # Errors
    /// [`SparseCholeskyError`].
    ///
    /// # Panics
    /// For a row beyond the last column.
    pub fn new(matrix: &SparseSymmetric) -> Result<Self, SparseCholeskyError> {
        Self::new_watched(matrix, Watch::NONE)
    }

    /// Factors, watched.
    ///
    /// # Errors
    /// As [`SparseCholesky::new`], or cancelled.
    ///
    /// # Panics
    /// As [`SparseCholesky::new`].
    pub fn new_watched(matrix: &SparseSymmetric, watch: Watch) -> Result<Self, SparseCholeskyError> {
        let size = matrix.size();
        let no_memory = SparseCholeskyError::OutOfMemory { size };
        let supernodes = supernodes(matrix, watch)?;
        let largest = supernodes.iter().map(|node| node.pattern.len()).max().unwrap_or(0);
        let mut space = room(largest * largest).ok_or(no_memory)?;
        space.resize(largest * largest, 0.0);
        let stored: usize = supernodes.iter().map(Supernode::stored_numbers).sum();
        let mut factor = Self { size, panels: Vec::new(), values: room(stored).ok_or(no_memory)? };
        let mut fronts = Fronts::new(size);
        for node in &supernodes {
            watch.stage(STAGE, factor.values.len() as f64 / stored as f64)?;
            let front = &mut space[..node.pattern.len().pow(2)];
            fronts.assemble(matrix, node, front);
            let square = (node.pattern.len(), node.pattern.len());
            let matrix = ArrayViewMut2::from_shape(square, &mut *front).expect("a front is square");
            factor_leading(matrix, node.columns.len())
                .map_err(|_| SparseCholeskyError::NotPositiveDefinite { size })?;
            factor.store(node, front);
            fronts.keep_update(node, front).ok_or(no_memory)?;
        }
        Ok(factor)
    }

    /// Replaces consecutive right-hand sides b by A⁻¹·b in one sweep.
    ///
    /// # Panics
    /// For an incomplete b.
    pub fn solve_in_place(&self, b: &mut [f64]) {
        let done = self.solve_in_place_watched(b, Watch::NONE);
        debug_assert_eq!(done, Ok(()), "the watch does not stop it");
    }

    /// Solves, watched.
    ///
    /// # Errors
    /// [`Cancelled`]; b is then undefined.
    ///
    /// # Panics
    /// As [`SparseCholesky::solve_in_place`].
    pub fn solve_in_place_watched(&self, b: &mut [f64], watch: Watch) -> Result<(), Cancelled> {
        watch.round()?;
        if b.is_empty() {
            return Ok(());
        }
        let count = b.len() / self.size;
        let mut b = ArrayViewMut2::from_shape((count, self.size), b).expect("whole right-hand sides");
        // For each row, the entries of all right-hand sides side by side.
        let mut x: Vec<f64> = b.t().iter().copied().collect();
        let mut products = 0;
        let mut look = |panel: &Panel| {
            products += count * panel.columns.len() * (panel.columns.len() + panel.below.len());
            if products < PRODUCTS_EACH {
                return Ok(());
            }
            products = 0;
            watch.round()
        };
        for panel in &self.panels {
            look(panel)?;
            self.solve_lower(panel, count, &mut x);
        }
        for panel in self.panels.iter().rev() {
            look(panel)?;
            self.solve_upper(panel, count, &mut x);
        }
        let x = ArrayView2::from_shape((self.size, count), &x).expect("as long as b");
        b.assign(&x.t());
        Ok(())
    }

    /// Stored entries of L.
    pub fn stored_numbers(&self) -> usize {
        self.values.len()
    }

    fn store(&mut self, node: &Supernode, front: &[f64]) {
        for own in node.panels() {
            let first = node.columns.start;
            self.panels.push(Panel {
                columns: first + own.start..first + own.end,
                below: node.pattern[own.end..].to_vec(),
                start: self.values.len(),
            });
            for row in front.chunks_exact(node.pattern.len()).skip(own.start) {
                self.values.extend_from_slice(&row[own.clone()]);
            }
        }
    }

    fn blocks(&self, panel: &Panel) -> (&[f64], ArrayView2<'_, f64>) {
        let (width, height) = (panel.columns.len(), panel.below.len());
        let (square, below) = self.values[panel.start..].split_at(width * width);
        let below = ArrayView2::from_shape((height, width), &below[..height * width]);
        (square, below.expect("rows as long as the panel is wide"))
    }

    fn solve_lower(&self, panel: &Panel, count: usize, x: &mut [f64]) {
        let own = &mut x[panel.columns.start * count..panel.columns.end * count];
        // A sparse load affects few panels.
        if own.iter().all(|x| *x == 0.0) {
            return;
        }
        let width = panel.columns.len();
        let (square, below) = self.blocks(panel);
        for (i, l) in square.chunks_exact(width).enumerate() {
            let (done, rest) = own.split_at_mut(i * count);
            let row = &mut rest[..count];
            for (l, done) in l.iter().zip(done.chunks_exact(count)) {
                subtract_multiple(row, *l, done);
            }
            row.iter_mut().for_each(|x| *x /= l[i]);
        }
        let own = ArrayView2::from_shape((width, count), own).expect("a row each column");
        let changes = below.dot(&own);
        for (row, change) in panel.below.iter().zip(changes.outer_iter()) {
            let change = change.to_slice().expect("a product is stored row by row");
            subtract_multiple(&mut x[row * count..][..count], 1.0, change);
        }
    }

    fn solve_upper(&self, panel: &Panel, count: usize, x: &mut [f64]) {
        let width = panel.columns.len();
        let (square, below) = self.blocks(panel);
        let mut found = Vec::with_capacity(panel.below.len() * count);
        for row in &panel.below {
            found.extend_from_slice(&x[row * count..][..count]);
        }
        let found = ArrayView2::from_shape((panel.below.len(), count), &found).expect("a row each");
        let own = &mut x[panel.columns.start * count..panel.columns.end * count];
        let mut rows = ArrayViewMut2::from_shape((width, count), &mut *own).expect("a row each column");
        general_mat_mul(-1.0, &below.t(), &found, 1.0, &mut rows);
        for (i, l) in square.chunks_exact(width).enumerate().rev() {
            let (rest, row) = own.split_at_mut(i * count);
            let row = &mut row[..count];
            row.iter_mut().for_each(|x| *x /= l[i]);
            for (l, rest) in l.iter().zip(rest.chunks_exact_mut(count)) {
                subtract_multiple(rest, *l, row);
            }
        }
    }
}

impl Supernode {
    fn below(&self) -> &[usize] {
        &self.pattern[self.columns.len()..]
    }

    /// Merges the next column, unless too many zeros result.
    fn merge_next_column(&mut self, rows: &[usize]) -> bool {
        let width = self.columns.len();
        let zeros = self.zeros + width * rows.len();
        let most = if width < SMALL { MOST_ZEROS } else { FEW_ZEROS };
        let taken = zeros as f64 <= most * ((width + 1) * (self.pattern.len() + rows.len())) as f64;
        if taken {
            self.zeros = zeros;
            self.columns.end += 1;
            if !rows.is_empty() {
                self.pattern.extend_from_slice(rows);
                self.pattern.sort_unstable();
            }
        }
        taken
    }

    fn panels(&self) -> impl Iterator<Item = Range<usize>> {
        let width = self.columns.len();
        (0..width).step_by(PANEL).map(move |start| start..width.min(start + PANEL))
    }

    fn stored_numbers(&self) -> usize {
        self.panels().map(|own| own.len() * (self.pattern.len() - own.start)).sum()
    }
}

/// Relaxed supernodes (Ashcraft and Grimes, *The influence of relaxed supernode partitions on the
/// multifrontal method*, 1989).
fn supernodes(matrix: &SparseSymmetric, watch: Watch) -> Result<Vec<Supernode>, Cancelled> {
    let mut supernodes: Vec<Supernode> = Vec::new();
    // Supernodes by their first row below.
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); matrix.size()];
    // The last supernode with each row in its pattern.
    let mut owner = vec![usize::MAX; matrix.size()];
    for column in 0..matrix.size() {
        if column % COLUMNS_EACH == 0 {
            watch.stage(STAGE, 0.0)?;
        }
        let mut others = mem::take(&mut children[column]);
        let before = others.pop_if(|child| *child + 1 == supernodes.len());
        let mut rows = matrix.rows[matrix.elements(column)].to_vec();
        rows.extend(others.iter().flat_map(|child| supernodes[*child].below()));
        let new_of = |rows: &[usize], index: usize, owner: &mut [usize]| -> Vec<usize> {
            let mut is_new = |row: &usize| mem::replace(&mut owner[*row], index) != index;
            rows.iter().copied().filter(|row| is_new(row)).collect()
        };
        let taken = before.filter(|before| {
            let lacking = new_of(&rows, *before, &mut owner);
            supernodes[*before].merge_next_column(&lacking)
        });
        let index = taken.unwrap_or_else(|| {
            rows.push(column);
            rows.extend(before.iter().flat_map(|child| supernodes[*child].below()));
            let mut pattern = new_of(&rows, supernodes.len(), &mut owner);
            pattern.sort_unstable();
            supernodes.push(Supernode { columns: column..column + 1, pattern, zeros: 0 });
            supernodes.len() - 1
        });
        if let Some(parent) = supernodes[index].below().first() {
            children[*parent].push(index);
        }
    }
    Ok(supernodes)
}

impl<'a> Fronts<'a> {
    fn new(size: usize) -> Self {
        Self { waiting: (0..size).map(|_| Vec::new()).collect(), places: vec![0; size] }
    }

    fn assemble(&mut self, matrix: &SparseSymmetric, node: &Supernode, front: &mut [f64]) {
        let size = node.pattern.len();
        for (place, row) in node.pattern.iter().enumerate() {
            self.places[*row] = place;
        }
        for (i, row) in front.chunks_exact_mut(size).enumerate() {
            row[..=i].fill(0.0);
        }
        for (own, column) in node.columns.clone().enumerate() {
            for element in matrix.elements(column) {
                front[self.places[matrix.rows[element]] * size + own] += matrix.values[element];
            }
            for update in mem::take(&mut self.waiting[column]) {
                self.extend_add(&update, size, front);
            }
        }
    }

    fn extend_add(&self, update: &Update, size: usize, front: &mut [f64]) {
        let places: Vec<usize> = update.pattern.iter().map(|row| self.places[*row]).collect();
        let mut triangle = &update.triangle[..];
        for (i, place) in places.iter().enumerate() {
            let (row, rest) = triangle.split_at(i + 1);
            let target = &mut front[place * size..][..size];
            for (value, place) in row.iter().zip(&places) {
                target[*place] += value;
            }
            triangle = rest;
        }
    }

    fn keep_update(&mut self, node: &'a Supernode, front: &[f64]) -> Option<()> {
        let (size, width) = (node.pattern.len(), node.columns.len());
        let Some(parent) = node.below().first() else { return Some(()) };
        let mut triangle = room((size - width) * (size - width + 1) / 2)?;
        for (i, row) in front.chunks_exact(size).enumerate().skip(width) {
            triangle.extend_from_slice(&row[width..=i]);
        }
        self.waiting[*parent].push(Update { pattern: node.below(), triangle });
        Some(())
    }
}

fn subtract_multiple(x: &mut [f64], factor: f64, y: &[f64]) {
    for (x, y) in x.iter_mut().zip(y) {
        *x -= factor * y;
    }
}

fn room(count: usize) -> Option<Vec<f64>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    Some(values)
}

#[cfg(test)]
mod tests {
    use ndarray::{Array1, Array2, s};
    use proptest::prelude::*;

    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::Cholesky;

    /// Diagonally dominant, sparse and dense; one in `rarity` elements is not 0.
    fn matrices(elements: &[f64], rarity: usize) -> (SparseSymmetric, Array2<f64>) {
        let size = elements.len();
        let element = |i: usize, j: usize| match (i.min(j), i.max(j)) {
            (i, j) if i == j => size as f64,
            (i, j) if (7 * i + 11 * j + i * j) % rarity == 0 => elements[i] * elements[j],
            _ => 0.0,
        };
        let dense = Array2::from_shape_fn((size, size), |(i, j)| element(i, j));
        (sparse(&dense), dense)
    }

    fn sparse(dense: &Array2<f64>) -> SparseSymmetric {
        let mut sparse = SparseSymmetric::with_capacity(dense.len());
        for column in dense.columns() {
            sparse.push_column(column.iter().copied().enumerate().filter(|(_, value)| *value != 0.0));
        }
        sparse
    }

    impl SparseCholesky {
        fn lower(&self) -> Array2<f64> {
            let mut lower = Array2::zeros((self.size, self.size));
            for panel in &self.panels {
                let (square, below) = self.blocks(panel);
                let mut columns = lower.slice_mut(s![.., panel.columns.clone()]);
                for (i, row) in square.chunks_exact(panel.columns.len()).enumerate() {
                    (0..=i).for_each(|j| columns[[panel.columns.start + i, j]] = row[j]);
                }
                for (row, values) in panel.below.iter().zip(below.outer_iter()) {
                    columns.row_mut(*row).assign(&values);
                }
            }
            lower
        }
    }

    #[test]
    fn factoring_stops_at_any_check() {
        let (matrix, _) = matrices(&[0.5; 150], 7);
        let factor = SparseCholesky::new(&matrix).unwrap();
        let looks = AtomicUsize::new(0);
        let go_on = |_| looks.fetch_add(1, Ordering::Relaxed) < usize::MAX;
        SparseCholesky::new_watched(&matrix, Watch::new(&go_on)).unwrap();
        let all = looks.into_inner();
        assert!(all > 2, "{all}");
        for n in 0..all {
            let looks = AtomicUsize::new(0);
            let stop = |_| looks.fetch_add(1, Ordering::Relaxed) < n;
            let stopped = SparseCholesky::new_watched(&matrix, Watch::new(&stop)).err();
            assert_eq!((stopped, looks.into_inner()), (Some(Cancelled.into()), n + 1));
        }
        let stop = |_| false;
        assert_eq!(factor.solve_in_place_watched(&mut [1.0; 150], Watch::new(&stop)), Err(Cancelled));
    }

    fn largest(values: &Array2<f64>) -> f64 {
        values.iter().fold(0.0, |largest, value| value.abs().max(largest))
    }

    proptest! {
        #[test]
        fn the_factor_gives_the_matrix_back(
            elements in proptest::collection::vec(-1.0..1.0f64, 1..150), rarity in 1..60usize,
        ) {
            let (sparse, dense) = matrices(&elements, rarity);
            let lower = SparseCholesky::new(&sparse).unwrap().lower();
            prop_assert!(largest(&(lower.dot(&lower.t()) - &dense)) < 1e-13 * dense.nrows() as f64);
            prop_assert!(largest(&(&lower - &Cholesky::factor(dense).unwrap().lower())) < 1e-13);
        }

        #[test]
        fn solutions_are_those_of_the_dense_factor_however_many_at_once(
            elements in proptest::collection::vec(-1.0..1.0f64, 1..150), rarity in 1..60usize, count in 1..6usize,
        ) {
            let (sparse, dense) = matrices(&elements, rarity);
            let factor = SparseCholesky::new(&sparse).unwrap();
            let right_side = |which: usize| elements.iter().enumerate().map(move |(i, e)| if i % count == which { *e } else { 0.0 });
            let mut together: Vec<f64> = (0..count).flat_map(right_side).collect();
            factor.solve_in_place(&mut together);
            let dense = Cholesky::factor(dense).unwrap();
            for (which, found) in together.chunks_exact(elements.len()).enumerate() {
                let mut alone: Vec<f64> = right_side(which).collect();
                let expected = dense.solve(&Array1::from(alone.clone()));
                factor.solve_in_place(&mut alone);
                prop_assert_eq!(&alone, found);
                prop_assert!(found.iter().zip(&expected).all(|(x, expected)| (x - expected).abs() < 1e-13));
            }
        }

        #[test]
        fn solutions_do_not_depend_on_the_order(
            elements in proptest::collection::vec(-1.0..1.0f64, 1..80), rarity in 1..40usize, step in 1..80usize,
        ) {
            let (sparse_matrix, dense) = matrices(&elements, rarity);
            let size = elements.len();
            let mut order: Vec<usize> = (0..size).collect();
            order.sort_by_key(|i| (i * step % 83, *i));
            let permuted = Array2::from_shape_fn((size, size), |(i, j)| dense[[order[i], order[j]]]);
            let mut x = elements.clone();
            SparseCholesky::new(&sparse_matrix).unwrap().solve_in_place(&mut x);
            let mut y: Vec<f64> = order.iter().map(|i| elements[*i]).collect();
            SparseCholesky::new(&sparse(&permuted)).unwrap().solve_in_place(&mut y);
            prop_assert!(order.iter().zip(&y).all(|(i, y)| (x[*i] - y).abs() < 1e-13));
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_refused() {
        let singular = Array2::from_elem((40, 40), 1.0);
        let mut indefinite = Array2::from_diag(&Array1::linspace(1.0, 90.0, 90));
        indefinite[[70, 70]] = -1e-9;
        let not_finite = Array2::from_elem((1, 1), f64::NAN);
        for matrix in [singular, indefinite, not_finite, Array2::zeros((2, 2))] {
            let refused = SparseCholesky::new(&sparse(&matrix)).err();
            assert_eq!(refused, Some(SparseCholeskyError::NotPositiveDefinite { size: matrix.nrows() }));
        }
    }

    #[test]
    fn a_factor_too_large_for_memory_is_refused() {
        // An arrow matrix fills completely when its shaft is eliminated first.
        let size = 3_000_000;
        let mut matrix = SparseSymmetric::with_capacity(2 * size);
        matrix.push_column((0..size).map(|row| (row, 1.0)));
        (1..size).for_each(|column| matrix.push_column([(column, 2.0)]));
        let refused = SparseCholesky::new(&matrix).err();
        assert_eq!(refused, Some(SparseCholeskyError::OutOfMemory { size }));
    }

    #[test]
    fn the_smallest_matrices_have_factors() {
        let factor = SparseCholesky::new(&SparseSymmetric::with_capacity(0)).unwrap();
        factor.solve_in_place(&mut []);
        assert_eq!(factor.stored_numbers(), 0);
        let mut matrix = SparseSymmetric::with_capacity(1);
        matrix.push_column([(0, 4.0)]);
        let factor = SparseCholesky::new(&matrix).unwrap();
        let mut x = [2.0, 6.0];
        factor.solve_in_place(&mut x);
        assert_eq!((x, factor.stored_numbers()), ([0.5, 1.5], 1));
    }
}
