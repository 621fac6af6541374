//! Sites by QR factorization with column pivoting, as in PySensors.
//!
//! Each step chooses the column (site) farthest from the span of the chosen ones (Businger and Golub,
//! *Numerische Mathematik* 7, 1965; Manohar, Brunton, Kutz and Brunton, *IEEE Control Systems* 38, 2018).
//! With q the unit vector of its new part, the distance² of every column falls by (q·column)²; q is
//! orthogonal to all earlier ones, so columns stay unchanged.

use ndarray::Array2;

use super::candidates::Pool;
use palpate_numerics::small::{add_multiple, dot};
use palpate_numerics::symmetric_eigen;

/// Columns per block; their distances stay in the nearest cache.
const BLOCK: usize = 1024;
/// Least relative squared distance outside the span.
const NOTHING_NEW: f64 = 1e-20;

struct Pivoting<'a> {
    /// One row per mode.
    modes: &'a [Vec<f64>],
    /// Squared distances from the span.
    left: Vec<f64>,
    /// Unit vectors of the span.
    span: Vec<Vec<f64>>,
    longest: f64,
}

impl<'a> Pivoting<'a> {
    fn new(modes: &'a [Vec<f64>]) -> Self {
        let left = squares(modes);
        let longest = left.iter().copied().fold(0.0, f64::max);
        Self { modes, left, span: Vec::new(), longest }
    }

    fn is_exhausted(&self) -> bool {
        self.span.len() == self.modes.len()
            || self.left.iter().all(|left| *left <= NOTHING_NEW * self.longest)
    }

    fn restart(&mut self) {
        self.left = squares(self.modes);
        self.span.clear();
    }

    fn choose(&mut self, column: usize) {
        let mut unit: Vec<f64> = self.modes.iter().map(|mode| mode[column]).collect();
        // Twice is enough for full orthogonality (Giraud et al. 2005).
        for _ in 0..2 {
            for other in &self.span {
                let share = dot(&unit, other);
                add_multiple(&mut unit, -share, other);
            }
        }
        let length = dot(&unit, &unit).sqrt();
        if length * length <= NOTHING_NEW * self.longest {
            return;
        }
        unit.iter_mut().for_each(|value| *value /= length);
        let mut along = [0.0; BLOCK];
        for (block, left) in self.left.chunks_mut(BLOCK).enumerate() {
            let along = &mut along[..left.len()];
            along.fill(0.0);
            for (unit, mode) in unit.iter().zip(self.modes) {
                let mode = &mode[block * BLOCK..][..left.len()];
                along.iter_mut().zip(mode).for_each(|(along, value)| *along += unit * value);
            }
            left.iter_mut().zip(&*along).for_each(|(left, along)| *left = (*left - along * along).max(0.0));
        }
        self.span.push(unit);
    }
}

fn squares(modes: &[Vec<f64>]) -> Vec<f64> {
    let mut squares = vec![0.0; modes.first().map_or(0, Vec::len)];
    for mode in modes {
        squares.iter_mut().zip(mode).for_each(|(square, value)| *square += value * value);
    }
    squares
}

/// Returns the first `count` pivots, at most one per row; the first of equals.
pub fn pivoted_columns(modes: &[Vec<f64>], count: usize) -> Vec<usize> {
    let mut pivoting = Pivoting::new(modes);
    let mut pivots = Vec::new();
    while pivots.len() < count && !pivoting.is_exhausted() {
        let farthest = (0..pivoting.left.len())
            .reduce(|best, column| if pivoting.left[column] > pivoting.left[best] { column } else { best });
        let Some(column) = farthest else { break };
        pivoting.choose(column);
        // Rounding errors in its own distance must not let the column be chosen again.
        pivoting.left[column] = 0.0;
        pivots.push(column);
    }
    pivots
}

/// Returns the ratio of the extreme singular values of some columns, at least as many as rows; infinite for
/// dependent rows.
pub fn condition_number(modes: &[Vec<f64>], columns: &[usize]) -> f64 {
    let chosen = Array2::from_shape_fn((modes.len(), columns.len()), |(i, k)| modes[i][columns[k]]);
    let (squares, _) = symmetric_eigen(&chosen.dot(&chosen.t()));
    match (squares.first(), squares.last()) {
        (Some(largest), Some(least)) if *least > 0.0 => (largest / least).sqrt(),
        _ => f64::INFINITY,
    }
}

pub(super) fn search(pool: &Pool, modes: &[Vec<f64>]) -> Option<Vec<usize>> {
    let modes = &modes[..modes.len().min(pool.design.count)];
    let mut pivoting = Pivoting::new(modes);
    for candidate in pool.candidates(&pool.fixed) {
        pivoting.choose(candidate);
    }
    let all = pool.all();
    let mut selection = pool.fixed.clone();
    while !pool.is_whole(&selection) {
        if pivoting.is_exhausted() {
            pivoting.restart();
        }
        let reach = |unit: usize| -> f64 {
            let members = pool.units[unit].members().map(|candidate| pivoting.left[candidate]);
            members.sum::<f64>() / pool.units[unit].size() as f64
        };
        let joinable = pool.joinable(&selection, &all, None);
        let unit = joinable.into_iter().reduce(|a, b| if reach(b) > reach(a) { b } else { a })?;
        for candidate in pool.units[unit].members() {
            pivoting.choose(candidate);
        }
        selection.push(unit);
    }
    Some(selection)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sines(modes: usize, sites: usize) -> Vec<Vec<f64>> {
        let at = |i: usize| (i as f64 + 1.0) / (sites as f64 + 1.0);
        let mode = |k: usize| (0..sites).map(|i| (k as f64 * std::f64::consts::PI * at(i)).sin()).collect();
        (1..=modes).map(mode).collect()
    }

    /// Reference: Gram–Schmidt on all columns.
    #[test]
    fn every_pivot_reaches_farthest_out_of_those_before() {
        let modes = sines(6, 97);
        let mut columns: Vec<Vec<f64>> =
            (0..97).map(|i| modes.iter().map(|mode| mode[i]).collect()).collect();
        for pivot in pivoted_columns(&modes, 6) {
            let length = |column: &Vec<f64>| column.iter().map(|v| v * v).sum::<f64>();
            let farthest = columns.iter().map(length).fold(0.0, f64::max);
            assert!(length(&columns[pivot]) >= farthest * (1.0 - 1e-9), "{pivot}");
            let size = length(&columns[pivot]).sqrt();
            let unit: Vec<f64> = columns[pivot].iter().map(|v| v / size).collect();
            for column in &mut columns {
                let share: f64 = column.iter().zip(&unit).map(|(a, b)| a * b).sum();
                column.iter_mut().zip(&unit).for_each(|(value, unit)| *value -= share * unit);
            }
        }
    }

    #[test]
    fn condition_numbers_of_known_matrices() {
        let stretched = vec![vec![3.0, 0.0, 9.0], vec![0.0, 2.0, 9.0]];
        assert!((condition_number(&stretched, &[0, 1]) - 1.5).abs() < 1e-12);
        assert_eq!(condition_number(&stretched, &[0]), f64::INFINITY);
        // Sines at the multiples of a ninth are orthogonal and of equal length.
        assert!((condition_number(&sines(8, 8), &[0, 1, 2, 3, 4, 5, 6, 7]) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_matrix_has_no_more_pivots_than_rank() {
        let same = vec![vec![1.0, 2.0, 3.0], vec![2.0, 4.0, 6.0]];
        assert_eq!(pivoted_columns(&same, 2), [2]);
    }
}
