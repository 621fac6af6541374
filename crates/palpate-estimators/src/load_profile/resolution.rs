//! What a layout resolves: over how much of the surface a profile averages the load.

use ndarray::Array2;

use super::Cells;
use super::smoothness::Problem;
use palpate_numerics::{Cholesky, median};

/// Averaging kernels of the linearised inverse: without the bound at 0, the force told of cell i is Σ_k R_ik times the force
/// of cell k, with R = (AᵀA + λ·P)⁻¹·AᵀA (Backus and Gilbert, *The Resolving Power of Gross Earth Data*, Geophys. J. R. astr.
/// Soc. 16, 1968). That no load is negative resolves more than this where there is none beside.
#[derive(Clone, Debug, PartialEq)]
pub struct Resolution {
    /// The cells.
    pub cells: Cells,
    /// R, a kernel a row.
    pub kernels: Array2<f64>,
    /// Width of each cell's kernel at half of its height, in metres; on a plane the side of a square as large as the area
    /// where it is above half of its height.
    pub widths_m: Vec<f64>,
}

impl Resolution {
    pub(super) fn of(problem: &Problem, cells: Cells, smoothness: f64) -> Option<Self> {
        let hessian = &problem.gram + &(smoothness * &problem.roughness);
        let factor = Cholesky::factor(hessian).ok()?;
        let half = factor.solve_lower_matrix(problem.gram.clone());
        // H⁻¹ = L⁻ᵀ·L⁻¹, and gram is symmetric: R = L⁻ᵀ·(L⁻¹·AᵀA).
        let kernels = factor.inverse_lower().t().dot(&half);
        let widths_m = (0..cells.len()).map(|cell| width_m(&cells, &kernels.row(cell).to_vec())).collect();
        Some(Self { cells, kernels, widths_m })
    }
}

impl Resolution {
    /// The median of the kernels' widths, in metres.
    pub fn median_width_m(&self) -> f64 {
        median(self.widths_m.clone()).unwrap_or(0.0)
    }
}

/// Width of a kernel at half of its height.
fn width_m(cells: &Cells, kernel: &[f64]) -> f64 {
    let Some(top) = (0..kernel.len()).max_by(|a, b| kernel[*a].total_cmp(&kernel[*b])) else { return 0.0 };
    let half = 0.5 * kernel[top];
    if cells.extent.width_m.is_some() {
        let above = kernel.iter().filter(|value| **value > half).count();
        return (above as f64 * cells.measure()).sqrt();
    }
    // Cells from the top to where the kernel falls to half, between two cells in proportion; the edge is an end too.
    let reach = |steps: &mut dyn Iterator<Item = usize>| {
        let (mut before, mut reached) = (kernel[top], 0.0);
        for cell in steps {
            if kernel[cell] <= half {
                return reached + (before - half) / (before - kernel[cell]);
            }
            (before, reached) = (kernel[cell], reached + 1.0);
        }
        reached + 0.5
    };
    cells.sides_m()[0] * (reach(&mut (0..top).rev()) + reach(&mut (top + 1..kernel.len())))
}
