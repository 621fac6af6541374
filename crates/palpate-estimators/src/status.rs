//! The rule by which an estimate is `no_contact`, `outside_model` or `ambiguous`, one for every estimator that knows the noise of
//! its channels.
//!
//! - `no_contact`: |d|², the squared length of the whitened reading d (less offsets, over the noise), is one that noise alone
//!   exceeds more often than [`FALSE_ALARM_RATE`], and a contact explains the reading no better than its unknowns cost
//!   ([`contact_cost`]).
//! - `outside_model`: the misfit χ² of the best contact is one that a contact of the model exceeds less often than
//!   [`FALSE_ALARM_RATE`].
//! - `ambiguous`: another place has a share of at least [`OTHER_PLACE`] of the posterior probability.
//!
//! One reading in a thousand is a false alarm that an engineer sees and can live with: a channel read a hundred times a second
//! then gives one every ten seconds, and a tracker averages it away; a rate ten times lower moves both bounds by a tenth of their size
//! and hides contacts that are that much stronger.

use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::surface::Extent;
use palpate_numerics::chi_squared_critical_value;

/// The share of readings that are called `outside_model`, or not called `no_contact`, by noise alone.
pub const FALSE_ALARM_RATE: f64 = 1e-3;

/// The least share of the posterior probability for another place to make an estimate `ambiguous`: of the readings that are `located`,
/// fewer than one in a hundred comes from another place than the one that is said.
pub const OTHER_PLACE: f64 = 0.01;

/// The χ² of `freedom` channels more than unknowns that noise exceeds at [`FALSE_ALARM_RATE`]; infinite for none, as every reading
/// is then explained.
pub fn misfit_bound(freedom: usize) -> f64 {
    if freedom == 0 { f64::INFINITY } else { chi_squared_critical_value(FALSE_ALARM_RATE, freedom) }
}

/// Places along a line that readings tell apart.
pub const LINE_PLACES: usize = 33;

/// Cost in χ² of a contact with so many unknowns, read by so many channels, that could have been at so many places, by the extended
/// Bayesian information criterion (Chen and Chen, Biometrika 95, 2008): unknowns·ln channels + 2·ln places.
pub fn contact_cost(unknowns: usize, channels: usize, places: usize) -> f64 {
    unknowns as f64 * (channels as f64).ln() + 2.0 * (places as f64).ln()
}

/// The estimate of a method that does not know the noise of its channels: located, or outside the surface.
pub fn on_surface(contact: ContactEstimate, extent: Extent) -> Estimate {
    let status = if extent.contains(contact.position) { Status::Located } else { Status::OutsideSurface };
    Estimate::of_contact(contact, status)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_the_quantile_of_chi_squared() {
        // Of two degrees of freedom the distribution is exponential: P(χ² > b) = e^(−b/2).
        assert!((misfit_bound(2) + 2.0 * FALSE_ALARM_RATE.ln()).abs() < 1e-6);
        assert_eq!(misfit_bound(0), f64::INFINITY);
    }
}
