//! The linear theory of bending, judged on the clean readings of a digit that is bent exactly.

use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Digit;

use super::{DigitEstimator, DigitLocator, DigitTheory};
use crate::fit::{Fit, Fitted};
use crate::setup::Setup;
use crate::simulate::{CleanSensors, simulate_at};

/// A locator by the linear theory, and the exact readings that it is asked for.
pub struct LinearTheory<'a> {
    locator: Fitted<DigitLocator>,
    sensors: CleanSensors<'a>,
}

impl<'a> LinearTheory<'a> {
    /// On the bench of a digit; `None` where the linear theory does not suit its sensors.
    pub fn of(setup: &Setup, digit: &'a Digit) -> Option<Self> {
        let unknown = Setup { force_n: None, ..setup.clone() };
        let pressed = Setup { force_n: Some(digit.characteristic_force_n()), ..setup.clone() };
        // The estimator learns nothing, but every fit wants a recording.
        let recording = simulate_at(&pressed, &[Position::along(digit.length_m())], 1, 0).ok()?;
        let locator = DigitEstimator { theory: DigitTheory::Linear }.fit(&unknown, &recording).ok()?;
        Some(Self { locator, sensors: CleanSensors::new(digit, &setup.layout) })
    }

    /// Errors of position, in metres, and of force, in newtons, of a contact that is read without noise; NaN for what is not found.
    pub fn errors(&self, contact: Contact) -> [f64; 2] {
        let Ok(estimate) = self.locator.locate(&self.sensors.reading(contact)) else { return [f64::NAN; 2] };
        let found = estimate.contact;
        let off_n = found.force_n.map_or(f64::NAN, |force_n| (force_n - contact.force_n).abs());
        [found.position.distance_m(contact.position), off_n]
    }
}
