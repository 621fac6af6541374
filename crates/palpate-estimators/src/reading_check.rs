//! Check of learnt locators by a forward model.
//!
//! Learnt methods give a position for any reading. Influence functions, or a digit's equations, decide by the
//! rule of [`crate::status`] whether a contact explains it.
//!
//! - The check determines statuses and further modes.
//! - The position remains, within the surface for explained readings.
//! - The 95 % interval contains the check's interval and the position.
//! - Where influence functions explain poorly, shorter cross-validated intervals are kept for pressed forces.

use serde::{Deserialize, Serialize};

use crate::digit::{DigitEstimator, DigitLocator};
use crate::fit::{CheckEstimate, Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::influence::{Influence, InfluenceLocator, InfluenceSource};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::status::{FalseAlarmRate, NO_CONTACT};
use crate::thinning::thinned;
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, SurfaceSpec};
use palpate_numerics::watch::Cancelled;
use palpate_numerics::{clamped_interval, extend_to};
use std::borrow::Cow;
use std::error::Error;

/// Check of estimates; see [the module](self).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "CheckData", try_from = "CheckData")]
pub struct ReadingCheck {
    model: ForwardModel,
    own_intervals: Option<OwnIntervals>,
}

#[derive(Clone, Debug, PartialEq)]
enum ForwardModel {
    Influence(InfluenceLocator),
    Digit(DigitLocator),
}

impl ForwardModel {
    fn locator(&self) -> &dyn Locate<Check = NoCheck> {
        match self {
            Self::Influence(influence) => influence,
            Self::Digit(digit) => digit,
        }
    }
}

/// Ratio of mean lengths for own intervals.
const OWN_SHARE: f64 = 0.9;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OwnIntervals {
    force_n: Option<(f64, f64)>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CheckData {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    influence: Option<InfluenceLocator>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    digit: Option<DigitLocator>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    own_intervals: Option<OwnIntervals>,
}

impl From<ReadingCheck> for CheckData {
    fn from(ReadingCheck { model, own_intervals }: ReadingCheck) -> Self {
        let (influence, digit) = match model {
            ForwardModel::Influence(influence) => (Some(influence), None),
            ForwardModel::Digit(digit) => (None, Some(digit)),
        };
        Self { influence, digit, own_intervals }
    }
}

impl TryFrom<CheckData> for ReadingCheck {
    type Error = &'static str;

    fn try_from(CheckData { influence, digit, own_intervals }: CheckData) -> Result<Self, Self::Error> {
        let model = match (influence, digit) {
            (Some(influence), None) => ForwardModel::Influence(influence),
            (None, Some(digit)) => ForwardModel::Digit(digit),
            _ => return Err("a check has either `influence` or `digit`"),
        };
        Ok(Self { model, own_intervals })
    }
}

impl ReadingCheck {
    /// Limit of rows; more do not change a status.
    pub const MOST_ROWS: usize = 500;

    /// Fits the check; `None` where influence functions fail.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn fit(task: FitTask) -> Result<Option<Self>, Cancelled> {
        let recording = Self::thinned(task.recording);
        let task = FitTask { recording: &recording, ..task };
        let with_model = |model| Self { model, own_intervals: None };
        if let SurfaceSpec::Digit(_) = task.setup.surface() {
            let digit = unless_cancelled(DigitEstimator::default().fit_method(task))?;
            return Ok(digit.map(|digit| with_model(ForwardModel::Digit(digit))));
        }
        let mut methods = vec![Influence::default()];
        if task.setup.surface().model().is_some() {
            // For presses that are too few to correct the mechanics.
            methods.push(Influence { source: InfluenceSource::Mechanics, ..Influence::default() });
        }
        for method in methods {
            if let Some(influence) = unless_cancelled(method.fit_method(task))? {
                return Ok(Some(with_model(ForwardModel::Influence(influence))));
            }
        }
        Ok(None)
    }

    /// Keeps own intervals shorter by more than a tenth, except for a known force: no test detects another,
    /// and the check adapts better.
    pub(crate) fn keeping_intervals(
        mut self,
        task: FitTask,
        locate: impl Fn(&[f64]) -> Estimate,
    ) -> Result<Self, Cancelled> {
        let extent = task.setup.surface().extent();
        let (mut own_m, mut widened_m) = (0.0, 0.0);
        for row in Self::thinned(task.recording).rows.iter().filter(|row| row.touches()) {
            task.watch.round()?;
            let estimate = locate(&row.reading);
            let checked = self.checked(&row.reading, estimate, extent);
            if checked.status == Status::Located {
                own_m += interval_m(&estimate, extent);
                widened_m += interval_m(&checked, extent);
            }
        }
        if task.setup.force_n().is_none() && own_m < OWN_SHARE * widened_m {
            let forces_n = task.recording.rows.iter().filter(|row| row.touches()).map(|row| row.force_n);
            let forces_n: Option<Vec<f64>> = forces_n.collect();
            let end = |of: fn(f64, f64) -> f64| forces_n.as_ref()?.iter().copied().reduce(of);
            let force_n = end(f64::min).zip(end(f64::max));
            self.own_intervals = Some(OwnIntervals { force_n });
        }
        Ok(self)
    }

    pub(crate) fn thinned(recording: &Recording) -> Cow<'_, Recording> {
        let rows = recording.rows.len();
        if rows <= Self::MOST_ROWS {
            return Cow::Borrowed(recording);
        }
        let picked: Vec<usize> = thinned(rows, Self::MOST_ROWS).collect();
        Cow::Owned(recording.subset(&picked))
    }

    /// False-alarm rate; `None` for a check without detection.
    pub fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        self.model.locator().false_alarm_rate()
    }

    /// Learnt offsets in SI units.
    pub fn offsets(&self) -> Option<Vec<f64>> {
        self.model.locator().offsets()
    }

    /// True where own intervals are kept.
    pub fn keeps_intervals(&self) -> bool {
        self.own_intervals.is_some()
    }

    /// Name of the forward model.
    pub fn in_words(&self) -> &'static str {
        match &self.model {
            ForwardModel::Influence(_) => "influence functions of the same recording",
            ForwardModel::Digit(_) => "the equations of a bending finger",
        }
    }
}

impl CheckEstimate for ReadingCheck {
    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        self.false_alarm_rate()
    }

    fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        self.model.locator().noise_sd()
    }

    fn checked(&self, reading: &[f64], estimate: Estimate, extent: Extent) -> Estimate {
        let explained = self.model.locator().locate(reading);
        self.combine_estimates(explained, estimate, extent)
    }

    fn check_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate], extent: Extent) {
        let mut explained = vec![NO_CONTACT; estimates.len()];
        self.model.locator().locate_batch(readings, channels, &mut explained);
        for (estimate, explained) in estimates.iter_mut().zip(explained) {
            *estimate = self.combine_estimates(explained, *estimate, extent);
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.model.locator().check(setup)
    }
}

impl ReadingCheck {
    fn combine_estimates(&self, explained: Estimate, estimate: Estimate, extent: Extent) -> Estimate {
        let position = nearest_on(extent, estimate.contact.position);
        let contact = ContactEstimate { position, ..estimate.contact };
        let around = |other: &ContactEstimate| ContactEstimate {
            uncertainty: other
                .uncertainty
                .map_or(contact.uncertainty, |uncertainty| Some(about_contact(uncertainty, other, &contact))),
            ..contact
        };
        match explained.status {
            Status::NoContact => explained,
            Status::OutsideModel => Estimate { status: Status::OutsideModel, ..estimate },
            Status::Located | Status::OutsideSurface if self.keeps_interval(&explained.contact) => {
                Estimate { contact: around(&estimate.contact), ..explained }
            }
            Status::Located | Status::OutsideSurface | Status::Ambiguous => {
                Estimate { contact: around(&explained.contact), ..explained }
            }
        }
    }

    /// Contacts without a force, and those of pressed forces.
    fn keeps_interval(&self, explained: &ContactEstimate) -> bool {
        self.own_intervals.is_some_and(|OwnIntervals { force_n: pressed_n }| {
            let forces = pressed_n.zip(explained.force_n);
            forces.is_none_or(|((least_n, most_n), force_n)| (least_n..=most_n).contains(&force_n))
        })
    }
}

/// `None` for a fit that fails by other errors than [`Cancelled`].
fn unless_cancelled<T, E: Error + 'static>(fit: Result<T, E>) -> Result<Option<T>, Cancelled> {
    match fit {
        Ok(fitted) => Ok(Some(fitted)),
        Err(error) if Cancelled::caused(&error) => Err(Cancelled),
        Err(_) => Ok(None),
    }
}

/// Sum of the interval lengths of all coordinates; infinite without an interval.
fn interval_m(estimate: &Estimate, extent: Extent) -> f64 {
    let Some(uncertainty) = estimate.contact.uncertainty else { return f64::INFINITY };
    let length_m = |interval: (f64, f64), side_m: f64| {
        let (low_m, high_m) = clamped_interval(interval, side_m);
        high_m - low_m
    };
    let y_m = extent.width_m().map_or(0.0, |width_m| length_m(uncertainty.y_95_m, width_m));
    length_m(uncertainty.x_95_m, extent.length_m()) + y_m
}

fn nearest_on(extent: Extent, Position { x_m, y_m }: Position) -> Position {
    let clamp = |at_m: f64, side_m: f64| at_m.max(0.0).min(side_m);
    Position { x_m: clamp(x_m, extent.length_m()), y_m: clamp(y_m, extent.width_m().unwrap_or(0.0)) }
}

/// Uncertainty of the estimate `other` about `contact`: second moments C + d·dᵀ, with the distance d between
/// both, and intervals that contain `contact`.
fn about_contact(
    uncertainty: Uncertainty,
    other: &ContactEstimate,
    contact: &ContactEstimate,
) -> Uncertainty {
    let (at, there) = (contact.position, other.position);
    let (dx, dy) = (there.x_m - at.x_m, there.y_m - at.y_m);
    let [xx, xy, xf, yy, yf, ff] = uncertainty.covariance;
    Uncertainty {
        covariance: [xx + dx * dx, xy + dx * dy, xf, yy + dy * dy, yf, ff],
        x_95_m: extend_to(uncertainty.x_95_m, at.x_m),
        y_95_m: extend_to(uncertainty.y_95_m, at.y_m),
        force_95_n: uncertainty
            .force_95_n
            .zip(contact.force_n)
            .map(|(interval, at_n)| extend_to(interval, at_n)),
    }
}

#[cfg(test)]
mod tests;
