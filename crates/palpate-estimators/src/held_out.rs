//! Uncertainty from cross-validated errors.

use serde::{Deserialize, Serialize};

use crate::fit::LocatorFault;
use palpate_core::Uncertainty;
use palpate_mechanics::contact::Position;
use palpate_numerics::{conformal_95, root_mean_square};

/// Cross-validated errors, with conformal half-widths of the 95 % interval: number ⌈0.95·(n + 1)⌉ of n sorted
/// absolute errors (Vovk, Gammerman and Shafer 2005).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldOutErrors {
    /// Root mean square error along x and y.
    pub rms_m: [f64; 2],
    /// Half-width of the 95 % interval along x and y.
    pub half_95_m: [f64; 2],
}

impl HeldOutErrors {
    /// Computes the uncertainty; `None` for fewer than [`FEWEST_FOR_95`](palpate_numerics::FEWEST_FOR_95)
    /// errors.
    pub fn from_errors(errors_m: &[[f64; 2]]) -> Option<Self> {
        let axis = |axis: usize| {
            let sizes: Vec<f64> = errors_m.iter().map(|error| error[axis].abs()).collect();
            Some((root_mean_square(&sizes), conformal_95(sizes)?))
        };
        let ((rms_x, half_x), (rms_y, half_y)) = (axis(0)?, axis(1)?);
        Some(Self { rms_m: [rms_x, rms_y], half_95_m: [half_x, half_y] })
    }

    /// Returns the uncertainty at `position`.
    pub fn uncertainty(&self, position: Position) -> Uncertainty {
        let [half_x, half_y] = self.half_95_m;
        Uncertainty {
            covariance: [self.rms_m[0].powi(2), 0.0, 0.0, self.rms_m[1].powi(2), 0.0, 0.0],
            x_95_m: (position.x_m - half_x, position.x_m + half_x),
            y_95_m: (position.y_m - half_y, position.y_m + half_y),
            force_95_n: None,
        }
    }

    /// Checks values from a file.
    ///
    /// # Errors
    /// [`LocatorFault::BadNumber`].
    pub fn check(&self) -> Result<(), LocatorFault> {
        let numbers = self.rms_m.into_iter().chain(self.half_95_m);
        LocatorFault::check_numbers("held-out error", numbers, |x| x >= 0.0, "a number of at least 0")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_covers_nineteen_in_twenty() {
        let errors: Vec<[f64; 2]> = (1..=99).map(|i| [f64::from(i) * -1e-3, 0.0]).collect();
        let spread = HeldOutErrors::from_errors(&errors).unwrap();
        assert_eq!(spread.half_95_m, [95e-3, 0.0]);
        // Σ i² = n·(n + 1)·(2n + 1)/6
        assert!((spread.rms_m[0] - 1e-3 * (100.0 * 199.0 / 6.0_f64).sqrt()).abs() < 1e-12);
        let uncertainty = spread.uncertainty(Position::along(0.2));
        assert!((uncertainty.x_95_m.0 - 0.105).abs() < 1e-12 && (uncertainty.x_95_m.1 - 0.295).abs() < 1e-12);
    }

    #[test]
    fn too_few_errors_give_no_bound() {
        assert_eq!(HeldOutErrors::from_errors(&[[1.0, 0.0]; 18]), None);
        assert_eq!(HeldOutErrors::from_errors(&[[1.0, 0.0]; 19]).map(|s| s.half_95_m[0]), Some(1.0));
    }
}
