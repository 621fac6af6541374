//! Levenberg's steps to the place of one contact on a plane, and to its force where that is not known (K. Levenberg,
//! Quart. Appl. Math. 2, 1944, with Marquardt's scaling by the diagonal).
//!
//! Symbols as in [`super::search`].

use super::search::{Equations, Minimum, Search, Unknowns};
use palpate_numerics::small::Ldl;

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
        free[2] = self.force.known_n().is_none();
        for k in 0..3 {
            let right = equations.right[k];
            free[k] &= !(at[k] <= ends[k].0 && right < 0.0 || at[k] >= ends[k].1 && right > 0.0);
        }
        if free == [false; 3] {
            return None;
        }
        let mut matrix = equations.information;
        for (k, row) in matrix.iter_mut().enumerate() {
            row[k] *= 1.0 + damping;
        }
        Some(Ldl::of_free(&matrix, free)?.solve(equations.right))
    }
}
