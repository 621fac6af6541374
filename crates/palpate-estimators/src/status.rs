//! Rule of `no_contact`, `outside_model` and `ambiguous` for known noise.
//!
//! - `no_contact`: noise exceeds the squared length |d|² of the whitened reading more often than half the
//!   [`FalseAlarmRate`], and the best contact reduces |d|² by at most its cost: the extended Bayesian
//!   information criterion at 0.2 %, with Φ(−√cost) in proportion to the rate. The actual rate is 0.3 to 1.3
//!   times the set one (docs/validation/false-alarms.md), exact with the `NoiseBounds` of force-linear
//!   surfaces.
//! - `outside_model`: the best χ² exceeds its critical value at [`OUTSIDE_MODEL_RATE`], or the contact seems
//!   distributed at [`SPREAD_RATE`] (not for digits).
//! - `ambiguous`: another mode has at least the probability [`OTHER_PLACE`], or the 95 % interval covers
//!   [`UNDETERMINED_SHARE`] of every side.
//!
//! A rate ten times lower raises both bounds by a tenth.

mod critical_values;
mod detection;
mod false_alarm_rate;
mod noise_bounds;
mod outside_model;
mod rule;
mod simpson;

pub(crate) use critical_values::CriticalValues;
pub(crate) use detection::Detection;
pub use false_alarm_rate::FalseAlarmRate;
pub(crate) use noise_bounds::{Directions, NoiseBounds};
pub use outside_model::{OUTSIDE_MODEL_RATE, SPREAD_RATE};
pub(crate) use outside_model::{chi_squared_bound, recording_bounds};
pub use rule::LINE_PLACES;
pub(crate) use rule::{StatusRule, contact_cost, unknowns};

use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// Significance level of tests on recordings.
pub(crate) const SIGNIFICANCE: f64 = 0.05;

/// Least probability of another mode in an `ambiguous` estimate.
pub const OTHER_PLACE: f64 = 0.01;

/// Share of a side that an undetermined interval covers.
pub const UNDETERMINED_SHARE: f64 = 0.95;

pub(crate) const NO_CONTACT: Estimate = Estimate::of_position(Position::along(0.0), Status::NoContact);

/// True where the 95 % interval covers [`UNDETERMINED_SHARE`] of every side.
pub fn is_undetermined(uncertainty: &Uncertainty, extent: Extent) -> bool {
    let covers =
        |(low, high): (f64, f64), side_m: f64| high.min(side_m) - low.max(0.0) >= UNDETERMINED_SHARE * side_m;
    covers(uncertainty.x_95_m, extent.length_m())
        && extent.width_m().is_none_or(|width_m| covers(uncertainty.y_95_m, width_m))
}

/// Makes an undetermined estimate `ambiguous`.
pub(crate) fn mark_undetermined(estimate: Estimate, extent: Extent) -> Estimate {
    let uncertainty = estimate.contact.uncertainty;
    match estimate.status {
        Status::Located if uncertainty.is_some_and(|uncertainty| is_undetermined(&uncertainty, extent)) => {
            Estimate { status: Status::Ambiguous, ..estimate }
        }
        _ => estimate,
    }
}

/// Without a noise model: located, or outside the surface.
pub(crate) fn on_surface(contact: ContactEstimate, extent: Extent) -> Estimate {
    let status = if extent.contains(contact.position) { Status::Located } else { Status::OutsideSurface };
    Estimate::of_contact(contact, status)
}

#[cfg(test)]
mod tests;
