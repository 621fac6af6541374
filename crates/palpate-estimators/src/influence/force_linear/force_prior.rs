//! Prior of the force of a contact whose force is not known, by the forces of the presses.

use super::presses::Presses;
use super::prior::Prior;
use crate::recording::is_one_force;
use palpate_numerics::mean_and_variance;

/// Forces up to this many times the greatest of the calibration are looked for.
const HARDEST: f64 = 3.0;

/// Mean and standard deviation of φ of contacts, and the greatest that is looked for, in newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ForcePrior {
    pub mean_n: f64,
    pub sd_n: f64,
    pub hardest_n: f64,
}

impl ForcePrior {
    /// The prior by the presses.
    ///
    /// Presses of one force say nothing of others: contacts may then have any force about as great, and the standard deviation is the mean. Where
    /// readings are proportional to the force, extrapolation is safe, and so it is with presses of nearly one force: with forces of the coefficient of
    /// variation c the prior has the greater of c and 1 − 3·c/2. Forces of c = 0.4 and more, evenly over a factor of 5.5, speak for themselves.
    pub fn of_presses(presses: &Presses, prior: &Prior) -> Self {
        let pressed = || presses.force_n.iter().filter(|force_n| **force_n != 0.0);
        let responses_n = || pressed().map(|force_n| prior.response_n(*force_n));
        let (mean_n, variance_n2) = mean_and_variance(responses_n());
        let varied_n = if is_one_force(responses_n()) { 0.0 } else { variance_n2.sqrt() };
        let is_proportional = prior.response == 1.0 && prior.is_separable();
        let broad_n = if is_proportional || varied_n == 0.0 { mean_n.abs() - 1.5 * varied_n } else { 0.0 };
        Self {
            mean_n,
            sd_n: varied_n.max(broad_n),
            hardest_n: prior.response_n(HARDEST * presses.greatest_force_n()),
        }
    }
}
