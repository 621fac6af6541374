//! Prior of the contact force by the calibration forces.

use super::prior::Prior;
use crate::force_prior::ForceRange;
use crate::influence::calibration::CalibrationRows;
use crate::recording::is_one_force;
use palpate_numerics::mean_and_variance;

/// Largest contact force over the calibration's, for a nonlinear response.
const HARDEST: f64 = 3.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PressForces {
    /// Mean and standard deviation of φ, in newtons.
    pub mean_n: f64,
    pub sd_n: f64,
    /// φ of [`HARDEST`], in newtons.
    pub hardest_n: f64,
    /// `None` where the moments define the prior.
    pub range: Option<ForceRange>,
}

impl PressForces {
    pub fn new(presses: &CalibrationRows, prior: &Prior, stated: Option<ForceRange>) -> Self {
        let pressed = || presses.force_n.iter().filter(|force_n| **force_n != 0.0);
        let responses_n = || pressed().map(|force_n| prior.response_n(*force_n));
        let (mean_n, variance_n2) = mean_and_variance(responses_n());
        let is_proportional = prior.response == 1.0 && prior.is_separable();
        let of_presses = ForceRange::of_presses(pressed().map(|force_n| force_n.abs()));
        Self {
            mean_n,
            // One force has no standard deviation: its size replaces it.
            sd_n: if is_one_force(responses_n()) { mean_n.abs() } else { variance_n2.sqrt() },
            hardest_n: prior.response_n(HARDEST * presses.greatest_force_n()),
            range: stated.or_else(|| of_presses.filter(|_| is_proportional)),
        }
    }
}
