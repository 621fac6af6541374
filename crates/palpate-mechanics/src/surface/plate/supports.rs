//! Forces of a plate's point supports by the force method.
//!
//! Symbols: K₀ stiffness matrix without point supports; K₀ₕ with further degrees of freedom constrained
//! against rigid motions R; B deflections at the supports as functionals; C their compliances; r their forces
//! on the plate; f a load.
//!
//! With u = K₀ₕ⁻¹·(f + B·r) + R·a, R'·f + G'·r = 0, G = B'·R, B'·u = −C·r, S = B'·K₀ₕ⁻¹·B and y = B'·K₀ₕ⁻¹·f:
//!
//! ```text
//! | S + C  G | |r|     | y    |
//! | G'     0 |·|a| = − | R'·f |
//! ```
//!
//! (Benzi, Golub and Liesen, *Numerical solution of saddle point problems*, 2005, section 6). For soft
//! springs K₀ + B·C⁻¹·B' would be singular.

use ndarray::{Array1, Array2};

use palpate_numerics::{Cholesky, NotPositiveDefinite};

/// Inverse: r = −P·y − Q·R'f, a = −Q'·y + N·R'f.
pub(super) struct SupportForces {
    /// P.
    pub by_deflection: Array2<f64>,
    /// Q.
    pub by_load: Array2<f64>,
    /// N.
    pub motion_by_load: Array2<f64>,
}

/// Lower bound of the scales, for rigid supports at constrained nodes.
const LEAST_SCALE: f64 = 1e-3;

impl SupportForces {
    /// Inverts the equations from S + C, G, and ℓ²/D.
    ///
    /// With M = D·(S + C)·D and D·G = Ĝ·L', Ĝ orthonormal, M + Ĝ·Ĝ' is positive definite.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] for rigid motions or coincident supports.
    pub fn new(
        compliance: &Array2<f64>,
        motions: &Array2<f64>,
        own_compliance_m_per_n: f64,
    ) -> Result<Self, NotPositiveDefinite> {
        let scale: Array1<f64> =
            compliance.diag().mapv(|c| 1.0 / (c + LEAST_SCALE * own_compliance_m_per_n).sqrt());
        let by_rows = scale.view().insert_axis(ndarray::Axis(1));
        let scaled = compliance * &by_rows * &scale;
        let (orthonormal, triangle) = orthonormalised(motions * &by_rows);
        let factor = Cholesky::factor(&scaled + &orthonormal.dot(&orthonormal.t()))?;
        let inverse = inverse_of(&factor);
        let flexible = inverse.dot(&orthonormal);
        let shared = Cholesky::factor(orthonormal.t().dot(&flexible))?;
        let by_load = flexible.dot(&inverse_of(&shared));
        // Exact balance: the rounding error is added back, and removed from the forces without resultant.
        let lacking = Array2::<f64>::eye(orthonormal.ncols()) - orthonormal.t().dot(&by_load);
        let by_load = &by_load + &orthonormal.dot(&lacking);
        let balanced = |forces: Array2<f64>| &forces - &orthonormal.dot(&orthonormal.t().dot(&forces));
        let half = balanced(&inverse - &inverse.dot(&orthonormal).dot(&by_load.t()));
        let by_deflection = balanced(half.t().to_owned());
        let by_load = by_load.dot(&inverse_of_transposed(&triangle)) * by_rows;
        let by_deflection = 0.5 * (&by_deflection + &by_deflection.t()) * by_rows * &scale;
        let motion_by_load = by_load.t().dot(&compliance.dot(&by_load));
        Ok(Self { by_deflection, by_load, motion_by_load })
    }
}

/// Gram–Schmidt in two passes, with the triangle that restores the originals.
fn orthonormalised(mut columns: Array2<f64>) -> (Array2<f64>, Array2<f64>) {
    let count = columns.ncols();
    let mut triangle = Array2::zeros((count, count));
    for i in 0..count {
        for j in (0..i).chain(0..i) {
            let share = columns.column(j).dot(&columns.column(i));
            let along = columns.column(j).to_owned();
            columns.column_mut(i).scaled_add(-share, &along);
            triangle[[j, i]] += share;
        }
        let length = columns.column(i).dot(&columns.column(i)).sqrt();
        triangle[[i, i]] = length;
        columns.column_mut(i).mapv_inplace(|value| value / length);
    }
    (columns, triangle)
}

fn inverse_of(factor: &Cholesky) -> Array2<f64> {
    let mut inverse = Array2::zeros((factor.size(), factor.size()));
    for (i, mut column) in inverse.columns_mut().into_iter().enumerate() {
        let mut unit = Array1::zeros(factor.size());
        unit[i] = 1.0;
        column.assign(&factor.solve(&unit));
    }
    inverse
}

/// U⁻ᵀ of an upper triangle U.
fn inverse_of_transposed(triangle: &Array2<f64>) -> Array2<f64> {
    let mut inverse: Array2<f64> = Array2::zeros(triangle.raw_dim());
    for column in 0..triangle.ncols() {
        for row in column..triangle.nrows() {
            let unit = if row == column { 1.0 } else { 0.0 };
            let sum: f64 = (column..row).map(|k| triangle[[k, row]] * inverse[[k, column]]).sum();
            inverse[[row, column]] = (unit - sum) / triangle[[row, row]];
        }
    }
    inverse
}
