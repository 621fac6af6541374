//! The rule by which an estimate is `no_contact`, `outside_model` or `ambiguous`, one for every estimator that knows the noise of
//! its channels.
//!
//! - `no_contact`: |d|², the squared length of the whitened reading d (less offsets, over the noise), is one that noise alone
//!   exceeds more often than [`FALSE_ALARM_RATE`], and the best contact takes no more of it off than a contact costs by the extended
//!   Bayesian information criterion. Noise alone fails the first at that rate. It fails the second at a rate that the numbers of
//!   channels and places give, as a cost is no quantile: up to two in a thousand on the benches of docs/at-the-limit.md.
//! - `outside_model`: the misfit χ² of the best contact is one that a contact of the model exceeds less often than
//!   [`FALSE_ALARM_RATE`].
//! - `ambiguous`: another place has a share of at least [`OTHER_PLACE`] of the posterior probability.
//!
//! One reading in a thousand is a false alarm that an engineer sees and can live with: a channel read a hundred times a second
//! then gives one every ten seconds, and a tracker averages it away; a rate ten times lower moves both bounds by a tenth of their size
//! and hides contacts that are that much stronger.

use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::chi_squared_critical_value;
use std::sync::OnceLock;

/// Share of readings whose noise alone exceeds the bound on |d|² of `no_contact`, and of those whose noise makes a contact
/// `outside_model`.
pub const FALSE_ALARM_RATE: f64 = 1e-3;

/// The least share of the posterior probability for another place to make an estimate `ambiguous`: of the readings that are `located`,
/// fewer than one in a hundred comes from another place than the one that is said.
pub const OTHER_PLACE: f64 = 0.01;

/// χ² that noise exceeds at [`FALSE_ALARM_RATE`], with `freedom` channels more than unknowns; without any, that of one. Contacts press and
/// lie on the surface, so that as many readings as unknowns need not have a contact that explains them; what the best leaves then is the
/// noise of the direction in which an end or a force of 0 held it.
pub(crate) fn misfit_bound(freedom: usize) -> f64 {
    /// Bounds that were asked for: estimators that weigh their channels anew for each reading ask every time.
    static KNOWN: [OnceLock<f64>; 65] = [const { OnceLock::new() }; 65];
    let freedom = freedom.max(1);
    let bound = || chi_squared_critical_value(FALSE_ALARM_RATE, freedom);
    KNOWN.get(freedom).map_or_else(bound, |known| *known.get_or_init(bound))
}

/// The misfit from which on no contact explains a reading, of a surface that is known by its recording alone: [`misfit_bound`] for
/// normal noise, and at least twice what one in a hundred of the recording's own readings leaves, as real noise has longer tails.
pub(crate) fn learnt_misfit_bound<'a>(
    freedom: usize,
    readings: impl ExactSizeIterator<Item = &'a [f64]>,
    misfit: impl Fn(&[f64]) -> f64,
) -> f64 {
    /// Readings that are tried.
    const TRIED: usize = 400;
    let every = readings.len().div_ceil(TRIED).max(1);
    let mut misfits: Vec<f64> =
        readings.step_by(every).map(misfit).filter(|misfit| misfit.is_finite()).collect();
    misfits.sort_by(f64::total_cmp);
    let usual = misfits.get(misfits.len() * 99 / 100).copied().unwrap_or(0.0);
    misfit_bound(freedom).max(2.0 * usual)
}

/// Places along a line that readings tell apart.
pub(crate) const LINE_PLACES: usize = 33;

/// Cost in χ² of a contact with so many unknowns, read by so many channels, that could have been at so many places, by the extended
/// Bayesian information criterion (Chen and Chen, Biometrika 95, 2008): unknowns·ln channels + 2·ln places.
pub(crate) fn contact_cost(unknowns: usize, channels: usize, places: usize) -> f64 {
    unknowns as f64 * (channels as f64).ln() + 2.0 * (places as f64).ln()
}

/// Numbers that a reading must tell of a contact: the coordinates of its position, and its force where that is not known.
pub(crate) fn unknowns(coordinates: usize, force_n: Option<f64>) -> usize {
    coordinates + usize::from(force_n.is_none())
}

/// The bounds of `no_contact` and `outside_model`, for readings of given channels.
///
/// Symbols: |d|² squared length of the whitened reading, χ² misfit of the best contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StatusRule {
    /// Largest |d|² of noise alone.
    noise_bound: f64,
    /// Least |d|² − χ² of a contact.
    contact_cost: f64,
    /// Largest χ² of a contact.
    misfit_bound: f64,
}

impl StatusRule {
    /// The rule for `channels` whose noise is known, and a contact of so many unknowns that could be at so many places.
    pub fn new(channels: usize, unknowns: usize, places: usize) -> Self {
        Self {
            noise_bound: misfit_bound(channels),
            contact_cost: contact_cost(unknowns, channels, places),
            misfit_bound: misfit_bound(channels.saturating_sub(unknowns)),
        }
    }

    /// The rule for a reading of channels whose noise is not known: only zeros are no contact, and the best contact may leave the share
    /// `misfit` of the reading's `square`.
    pub fn without_noise(square: f64, misfit: f64) -> Self {
        Self { noise_bound: 0.0, contact_cost: 0.0, misfit_bound: misfit * square }
    }

    /// Whether noise alone gives readings of length `square` = |d|².
    #[inline(always)]
    pub fn is_within_noise(&self, square: f64) -> bool {
        square <= self.noise_bound
    }

    /// Whether noise alone explains a reading of length `square` = |d|², and no worse than a contact whose χ² is `misfit`.
    #[inline(always)]
    pub fn is_no_contact(&self, square: f64, misfit: f64) -> bool {
        square <= misfit + self.contact_cost && self.is_within_noise(square)
    }

    /// Whether a contact whose χ² is `misfit` explains the reading; otherwise it is `outside_model`.
    #[inline(always)]
    pub fn is_explained(&self, misfit: f64) -> bool {
        misfit <= self.misfit_bound
    }

    /// χ² that a contact costs.
    pub fn contact_cost(&self) -> f64 {
        self.contact_cost
    }
}

/// The estimate of a reading that nothing but noise is in.
pub(crate) const NO_CONTACT: Estimate = Estimate::of_position(Position::along(0.0), Status::NoContact);

/// The estimate of a method that does not know the noise of its channels: located, or outside the surface.
pub(crate) fn on_surface(contact: ContactEstimate, extent: Extent) -> Estimate {
    let status = if extent.contains(contact.position) { Status::Located } else { Status::OutsideSurface };
    Estimate::of_contact(contact, status)
}

#[cfg(test)]
mod tests;
