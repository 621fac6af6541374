//! Bounds of `no_contact` and `outside_model` on the whitened reading and its residual.

use super::critical_values::CriticalValues;
use super::{Detection, FalseAlarmRate, chi_squared_bound};
use palpate_numerics::{bisect, chi_squared_critical_value, normal_cdf};

/// Places along a line that a contact may have in the information criterion of its detection.
pub const LINE_PLACES: usize = 33;

/// Extended Bayesian information criterion (Chen and Chen, Biometrika 95, 2008): unknowns·ln channels + 2·ln
/// places.
pub(crate) fn contact_cost(unknowns: usize, channels: usize, places: usize) -> f64 {
    unknowns as f64 * (channels as f64).ln() + 2.0 * (places as f64).ln()
}

pub(crate) fn unknowns(coordinates: usize, force_n: Option<f64>) -> usize {
    coordinates + usize::from(force_n.is_none())
}

/// Bounds on |d|² of the whitened reading and χ² of the best contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StatusRule {
    noise_bound: f64,
    detection_cost: f64,
    contact_cost: f64,
    chi_squared_bound: f64,
}

impl StatusRule {
    pub fn new(channels: usize, unknowns: usize, places: usize, rate: FalseAlarmRate) -> Self {
        let contact_cost = contact_cost(unknowns, channels, places);
        Self {
            noise_bound: noise_bound(channels, rate),
            detection_cost: detection_cost(contact_cost, rate),
            contact_cost,
            chi_squared_bound: chi_squared_bound(channels.saturating_sub(unknowns)),
        }
    }

    /// Only zeros are `no_contact`; χ² may be the share `chi_squared` of `square`.
    pub fn without_noise(square: f64, chi_squared: f64) -> Self {
        Self {
            noise_bound: 0.0,
            detection_cost: 0.0,
            contact_cost: 0.0,
            chi_squared_bound: chi_squared * square,
        }
    }

    /// True where noise explains |d|² = `square`.
    #[inline(always)]
    pub fn is_within_noise(&self, square: f64) -> bool {
        square <= self.noise_bound
    }

    /// True where noise explains |d|² = `square`, no worse than χ² = `chi_squared`.
    #[inline(always)]
    pub fn is_no_contact(&self, square: f64, chi_squared: f64) -> bool {
        square <= chi_squared + self.detection_cost && self.is_within_noise(square)
    }

    /// Reduction of `square`, less the one that detection needs.
    pub fn net_reduction(&self, square: f64, chi_squared: f64) -> f64 {
        square - chi_squared - self.detection_cost
    }

    /// True for an explained reading.
    #[inline(always)]
    pub fn is_explained(&self, chi_squared: f64) -> bool {
        chi_squared <= self.chi_squared_bound
    }

    pub fn detection(&self, channels: usize, unknowns: usize) -> Detection {
        Detection { channels, unknowns, square: self.noise_bound, taken: self.detection_cost }
    }

    /// Cost beside other contacts, at any false-alarm rate.
    pub fn contact_cost(&self) -> f64 {
        self.contact_cost
    }
}

/// |d|² that noise exceeds at half a rate.
pub(super) fn noise_bound(channels: usize, rate: FalseAlarmRate) -> f64 {
    static DEFAULTS: CriticalValues = CriticalValues::new(0.5 * FalseAlarmRate::DEFAULT.share());
    if rate == FalseAlarmRate::DEFAULT {
        return DEFAULTS.at(channels);
    }
    chi_squared_critical_value(0.5 * rate.share(), channels.max(1))
}

/// Cost of a contact, scaled from 0.1 % to half a rate.
pub(super) fn detection_cost(contact_cost: f64, rate: FalseAlarmRate) -> f64 {
    let tail = normal_cdf(-contact_cost.sqrt()) * 0.5 * rate.share() / FalseAlarmRate::DEFAULT.share();
    bisect((0.0, 20.0), 40, |u| normal_cdf(-u) > tail).powi(2)
}
