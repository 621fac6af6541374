//! Levenberg's steps to the place of one contact on a plane, and to its force where that is not known (K. Levenberg,
//! Quart. Appl. Math. 2, 1944, with Marquardt's scaling by the diagonal).
//!
//! Symbols as in [`super::search`].

use super::search::{Equations, Minimum, Search, Unknowns};
use crate::influence::belief::ForceBelief;

/// Steps, those that were refused included.
const MOST_STEPS: usize = 40;
/// A step that lowers the misfit by less than this, a fiftieth of a standard deviation, is the last one.
const SMALL: f64 = 4e-4;

impl Search {
    /// The minimum near a place.
    pub fn refine(&self, whitened: &[f64], start_m: [f64; 2]) -> Minimum {
        let mut at: Unknowns = [start_m[0], start_m[1], self.best_force(whitened, start_m)];
        // Within one refinement the calibration's variances stay, so that misfits can be compared.
        let mut here = self.equations(whitened, at, Some(start_m));
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let Some(step) = self.step(&here, at, damping) else { break };
            let next = self.held([at[0] + step[0], at[1] + step[1], at[2] + step[2]]);
            let moved = [next[0] - at[0], next[1] - at[1], next[2] - at[2]];
            let gain: f64 = moved.iter().zip(&here.right).map(|(step, right)| step * right).sum();
            let there = self.equations(whitened, next, Some(start_m));
            if there.misfit <= here.misfit {
                (at, here) = (next, there);
                damping = (0.1 * damping).max(1e-9);
            } else {
                damping = (10.0 * damping).max(1e-3);
            }
            if gain.abs() <= SMALL {
                break;
            }
        }
        let Equations { misfit, information, .. } = self.equations(whitened, at, None);
        Minimum { at, misfit, information }
    }

    /// Unknowns on the surface, with a force that presses.
    fn held(&self, [x_m, y_m, force_n]: Unknowns) -> Unknowns {
        [x_m.clamp(0.0, self.size_m[0]), y_m.clamp(0.0, self.size_m[1]), force_n.max(0.0)]
    }

    /// The damped step of those unknowns that are free: at an edge, the one that leads beyond it is not. `None` where no
    /// unknown is free or the reading tells nothing.
    fn step(&self, equations: &Equations, at: Unknowns, damping: f64) -> Option<Unknowns> {
        let ends = [(0.0, self.size_m[0]), (0.0, self.size_m[1]), (0.0, f64::INFINITY)];
        let mut free = [true; 3];
        free[2] = !matches!(self.force, ForceBelief::Known(_));
        for k in 0..3 {
            let right = equations.right[k];
            free[k] &= !(at[k] <= ends[k].0 && right < 0.0 || at[k] >= ends[k].1 && right > 0.0);
        }
        let mut matrix = equations.information;
        for (k, row) in matrix.iter_mut().enumerate() {
            row[k] *= 1.0 + damping;
        }
        solve(matrix, equations.right, free)
    }
}

/// Solves for the free unknowns, the others being 0, by elimination without pivoting, as the matrix is positive definite;
/// `None` where it is not.
pub(super) fn solve(mut matrix: [[f64; 3]; 3], mut right: [f64; 3], free: [bool; 3]) -> Option<[f64; 3]> {
    if !free.contains(&true) {
        return None;
    }
    for k in 0..3 {
        if !free[k] {
            matrix.iter_mut().for_each(|row| row[k] = 0.0);
            matrix[k] = [0.0; 3];
            matrix[k][k] = 1.0;
            right[k] = 0.0;
        }
    }
    let diagonal = [matrix[0][0], matrix[1][1], matrix[2][2]];
    for p in 0..3 {
        if matrix[p][p].is_nan() || matrix[p][p] <= 1e-14 * diagonal[p] {
            return None;
        }
        let pivot = matrix[p];
        for r in p + 1..3 {
            let factor = matrix[r][p] / pivot[p];
            matrix[r].iter_mut().zip(pivot).for_each(|(entry, above)| *entry -= factor * above);
            right[r] -= factor * right[p];
        }
    }
    let mut solution = [0.0; 3];
    for r in (0..3).rev() {
        let known: f64 = (r + 1..3).map(|c| matrix[r][c] * solution[c]).sum();
        solution[r] = (right[r] - known) / matrix[r][r];
    }
    Some(solution)
}
