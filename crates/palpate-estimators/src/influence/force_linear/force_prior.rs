//! Forces of the presses, and the range of forces that contacts are expected to have by them.

use super::presses::Presses;
use super::prior::Prior;
use crate::force_prior::ForceRange;
use crate::recording::is_one_force;
use palpate_numerics::mean_and_variance;

/// The greatest force of contacts over that of the calibration, where the response to the force is not proportional.
const HARDEST: f64 = 3.0;

/// Forces of the presses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PressForces {
    /// Mean and standard deviation of φ, in newtons.
    pub mean_n: f64,
    pub sd_n: f64,
    /// φ of [`HARDEST`].
    pub hardest_n: f64,
    /// Range of contacts; `None` where contacts are expected to be as hard as the presses.
    pub range: Option<ForceRange>,
}

impl PressForces {
    /// Forces of the presses, and the range that the setup states, or that extrapolation allows ([`ForceRange::of_presses`]).
    pub fn new(presses: &Presses, prior: &Prior, stated: Option<ForceRange>) -> Self {
        let pressed = || presses.force_n.iter().filter(|force_n| **force_n != 0.0);
        let responses_n = || pressed().map(|force_n| prior.response_n(*force_n));
        let (mean_n, variance_n2) = mean_and_variance(responses_n());
        let is_proportional = prior.response == 1.0 && prior.is_separable();
        let of_presses = ForceRange::of_presses(pressed().map(|force_n| force_n.abs()));
        Self {
            mean_n,
            // Presses of one force do not bound others.
            sd_n: if is_one_force(responses_n()) { mean_n.abs() } else { variance_n2.sqrt() },
            hardest_n: prior.response_n(HARDEST * presses.greatest_force_n()),
            range: stated.or_else(|| of_presses.filter(|_| is_proportional)),
        }
    }
}
