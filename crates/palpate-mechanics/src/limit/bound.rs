//! Fisher information and Cramér–Rao bound at one contact.
//!
//! With J the derivatives of whitened readings by parameters, F = JᵀJ = Rᵀ·R, J = Q·R, and no unbiased
//! estimator has a covariance below F⁻¹ (Kay, *Fundamentals of Statistical Signal Processing: Estimation
//! Theory*, 1993, section 3.9). F itself would lose digits.

use std::f64::consts::FRAC_2_PI;

use serde::Serialize;

use palpate_numerics::small::{Ldl, Matrix, add_multiple, dot, principal_variances};

/// The Cramér–Rao bound at one contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bound {
    /// Least standard deviation along the length.
    pub sd_x_m: f64,
    /// Least standard deviation across the width; 0 on a line.
    pub sd_y_m: f64,
    /// Covariance of both.
    pub covariance_xy_m2: f64,
    /// Least standard deviation of the force; `None` if known.
    pub sd_force_n: Option<f64>,
    /// √(sd_x² + sd_y²).
    pub sd_position_m: f64,
}

impl Bound {
    /// Returns the bound for a known force, from derivatives of whitened readings along and across; `None` if
    /// undetermined.
    pub fn of_columns(columns: [Vec<f64>; 2]) -> Option<Self> {
        Some(Self::new(inverse_information(columns)?, None))
    }

    pub(super) fn new(position: [[f64; 2]; 2], force: Option<f64>) -> Self {
        let [[xx, xy], [_, yy]] = position;
        Self {
            sd_x_m: xx.sqrt(),
            sd_y_m: yy.sqrt(),
            covariance_xy_m2: xy,
            sd_force_n: force.map(f64::sqrt),
            sd_position_m: (xx + yy).sqrt(),
        }
    }

    /// Mean position error of an efficient Gaussian estimator.
    ///
    /// s₁·√(2/π)·E(1 − s₂²/s₁²), with principal standard deviations s₁ ≥ s₂ and the complete elliptic
    /// integral E.
    pub fn mean_error_m(&self) -> f64 {
        let (xx, yy) = (self.sd_x_m * self.sd_x_m, self.sd_y_m * self.sd_y_m);
        let [larger, smaller] = principal_variances([xx, self.covariance_xy_m2, yy]);
        if larger <= 0.0 {
            return 0.0;
        }
        (larger * FRAC_2_PI).sqrt() * elliptic_e((smaller / larger).sqrt())
    }
}

/// E(1 − k′²) (Abramowitz and Stegun, 17.6.4).
fn elliptic_e(complement: f64) -> f64 {
    // As k′ → 0, the product below tends to 0 · ∞; E is 1 to rounding here.
    if complement < 1e-9 {
        return 1.0;
    }
    let (mut a, mut b) = (1.0, complement);
    let mut sum = 0.5 * (1.0 - complement * complement);
    let mut weight = 0.5;
    while (a - b).abs() > 1e-15 * a {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        weight *= 2.0;
        sum += weight * c * c;
    }
    std::f64::consts::FRAC_PI_2 / a * (1.0 - sum)
}

/// Largest relative remainder that is rounding: numerical derivatives are precise to 10⁻¹⁰.
const EXPLAINED: f64 = 1e-9;

/// F⁻¹; `None` if singular to rounding.
pub(super) fn inverse_information<const P: usize>(mut columns: [Vec<f64>; P]) -> Option<Matrix<P>> {
    let covariance = Ldl::of_root(&orthogonalise(&mut columns)?).inverse();
    covariance.iter().flatten().all(|entry| entry.is_finite()).then_some(covariance)
}

fn orthogonalise<const P: usize>(columns: &mut [Vec<f64>; P]) -> Option<Matrix<P>> {
    let mut triangle = [[0.0; P]; P];
    for (j, shares) in triangle.iter_mut().enumerate() {
        let (before, rest) = columns.split_at_mut(j);
        let column = &mut rest[0];
        let length = norm(column);
        for (unit, share) in before.iter().zip(shares.iter_mut()) {
            *share = dot(unit, column);
            add_multiple(column, -*share, unit);
        }
        let left = norm(column);
        if !left.is_normal() || left <= EXPLAINED * length {
            return None;
        }
        column.iter_mut().for_each(|value| *value /= left);
        shares[j] = left;
    }
    Some(triangle)
}

pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn the_elliptic_integral_meets_tabled_values() {
        // Abramowitz and Stegun, table 17.1: E(m) at m = 1 − k′².
        for (m, e) in [(0.0, FRAC_PI_2), (0.5, 1.350_643_881), (0.9, 1.104_774_733), (0.99, 1.015_993_546)] {
            assert!((elliptic_e((1.0_f64 - m).sqrt()) - e).abs() < 1e-9, "{m}");
        }
        assert_eq!(elliptic_e(0.0), 1.0);
        assert!((elliptic_e(1e-8) - elliptic_e(1e-10)).abs() < 1e-9);
    }

    #[test]
    fn the_mean_error_is_known_on_a_line_and_in_a_round_plane() {
        let line = Bound::new([[4e-6, 0.0], [0.0, 0.0]], None);
        assert!((line.mean_error_m() - 2e-3 * (2.0 / PI).sqrt()).abs() < 1e-12);
        let round = Bound::new([[4e-6, 0.0], [0.0, 4e-6]], None);
        assert!((round.mean_error_m() - 2e-3 * (PI / 2.0).sqrt()).abs() < 1e-12);
        let along = Bound::new([[9e-6, 0.0], [0.0, 1e-6]], None);
        let turned = Bound::new([[5e-6, 4e-6], [4e-6, 5e-6]], None);
        assert!((along.mean_error_m() - turned.mean_error_m()).abs() < 1e-12);
    }

    #[test]
    fn the_inverse_undoes_the_information() {
        let columns = [vec![1.0, 2.0, 0.5, -1.0], vec![0.3, -1.0, 2.0, 0.0], vec![4.0, 0.1, 0.2, 0.7]];
        let covariance = inverse_information(columns.clone()).unwrap();
        for (i, row) in covariance.iter().enumerate() {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| row[k] * dot(&columns[k], &columns[j])).sum();
                assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn linearly_dependent_columns_are_singular() {
        let column = vec![1.0, 2.0, 3.0];
        let twice: Vec<f64> = column.iter().map(|value| 2.0 * value).collect();
        assert_eq!(inverse_information([column.clone(), twice]), None);
        assert_eq!(inverse_information([vec![0.0; 3]]), None);
        assert_eq!(inverse_information([vec![f64::NAN; 3]]), None);
        assert_eq!(inverse_information([column, vec![f64::INFINITY; 3]]), None);
    }
}
