//! Errors of locators after simulated calibrations.

use palpate_estimators::evaluation::{EvaluatedContact, Evaluation, median};
use palpate_numerics::{mean, standard_error};
use serde::Serialize;

use crate::contacts::WeightedContacts;

/// Location error after simulated calibrations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// Mean error, m.
    pub mean_error_m: f64,
    /// Standard error between calibrations, m.
    pub standard_error_m: f64,
    /// Median error of the calibrations, m.
    pub median_error_m: f64,
    /// Share of the contacts within the tolerance, %.
    pub within_tolerance_percent: f64,
    /// Number of calibrations.
    pub calibrations: usize,
}

impl Verification {
    /// Summarizes calibrations with equally many readings per contact, contact by contact.
    pub(crate) fn from_calibrations(
        calibrations: &[Evaluation],
        contacts: &WeightedContacts,
        tolerance_m: f64,
    ) -> Self {
        let errors: Vec<f64> =
            calibrations.iter().map(|one| contacts.mean(errors_by_contact(one, contacts))).collect();
        let within = calibrations.iter().map(|one| share_within(one, contacts, tolerance_m));
        Self {
            mean_error_m: mean(errors.iter().copied()),
            standard_error_m: standard_error(&errors),
            within_tolerance_percent: 100.0 * mean(within),
            calibrations: errors.len(),
            median_error_m: median(errors).unwrap_or(f64::NAN),
        }
    }
}

pub(crate) fn errors_by_contact(calibration: &Evaluation, contacts: &WeightedContacts) -> Vec<f64> {
    let readings = calibration.located.len() / contacts.len();
    let error_m = |located: &[EvaluatedContact]| -> f64 {
        located.iter().map(|one| one.error_m() / readings as f64).sum()
    };
    calibration.located.chunks_exact(readings).map(error_m).collect()
}

fn share_within(calibration: &Evaluation, contacts: &WeightedContacts, tolerance_m: f64) -> f64 {
    let readings = calibration.located.len() / contacts.len();
    let of_contacts = calibration.located.chunks_exact(readings).zip(&contacts.weights);
    let good = of_contacts.flat_map(|(located, weight)| {
        let good = located.iter().filter(|one| one.error_m() <= tolerance_m);
        good.map(move |_| weight / readings as f64)
    });
    good.sum()
}
