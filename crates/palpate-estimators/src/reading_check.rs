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
use crate::fit::{CheckEstimate, Fit, FitTask, Locate, LocatorFault};
use crate::influence::{Influence, InfluenceLocator, InfluenceSource};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::status::{FalseAlarmRate, NO_CONTACT};
use crate::thinning::thinned;
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, SurfaceSpec};
use palpate_numerics::watch::Cancelled;
use std::borrow::Cow;

/// Check of estimates; see [the module](self).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "CheckData", try_from = "CheckData")]
pub struct ReadingCheck {
    by: Forward,
    own_intervals: Option<OwnIntervals>,
}

#[derive(Clone, Debug, PartialEq)]
enum Forward {
    Influence(InfluenceLocator),
    Digit(DigitLocator),
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
    fn from(ReadingCheck { by, own_intervals }: ReadingCheck) -> Self {
        let (influence, digit) = match by {
            Forward::Influence(influence) => (Some(influence), None),
            Forward::Digit(digit) => (None, Some(digit)),
        };
        Self { influence, digit, own_intervals }
    }
}

impl TryFrom<CheckData> for ReadingCheck {
    type Error = &'static str;

    fn try_from(CheckData { influence, digit, own_intervals }: CheckData) -> Result<Self, Self::Error> {
        let by = match (influence, digit) {
            (Some(influence), None) => Forward::Influence(influence),
            (None, Some(digit)) => Forward::Digit(digit),
            _ => return Err("a check has either `influence` or `digit`"),
        };
        Ok(Self { by, own_intervals })
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
        if let SurfaceSpec::Digit(_) = task.setup.surface() {
            let digit = DigitEstimator::default().fit_method(task).ok();
            return Ok(digit.map(|digit| Self { by: Forward::Digit(digit), own_intervals: None }));
        }
        let mut methods = vec![Influence::default()];
        if task.setup.surface().model().is_some() {
            // For presses that are too few to correct the mechanics.
            methods.push(Influence { source: InfluenceSource::Mechanics, ..Influence::default() });
        }
        for method in methods {
            match method.fit_method(task) {
                Ok(fitted) => return Ok(Some(Self { by: Forward::Influence(fitted), own_intervals: None })),
                Err(error) if Cancelled::caused(&error) => return Err(Cancelled),
                Err(_) => {}
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
        match &self.by {
            Forward::Influence(influence) => influence.false_alarm_rate(),
            Forward::Digit(digit) => Some(digit.false_alarm_rate),
        }
    }

    /// Learnt offsets in SI units.
    pub fn offsets(&self) -> Option<Vec<f64>> {
        match &self.by {
            Forward::Influence(influence) => influence.offsets(),
            Forward::Digit(digit) => digit.offsets(),
        }
    }

    /// True where own intervals are kept.
    pub fn keeps_intervals(&self) -> bool {
        self.own_intervals.is_some()
    }

    /// Name of the forward model.
    pub fn in_words(&self) -> &'static str {
        match &self.by {
            Forward::Influence(_) => "influence functions of the same recording",
            Forward::Digit(_) => "the equations of a bending finger",
        }
    }
}

impl CheckEstimate for ReadingCheck {
    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        self.false_alarm_rate()
    }

    fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        match &self.by {
            Forward::Influence(influence) => influence.noise_sd(),
            Forward::Digit(digit) => digit.noise_sd(),
        }
    }

    fn checked(&self, reading: &[f64], estimate: Estimate, extent: Extent) -> Estimate {
        let explained = match &self.by {
            Forward::Influence(influence) => influence.locate(reading),
            Forward::Digit(digit) => digit.locate(reading),
        };
        self.combine_estimates(explained, estimate, extent)
    }

    fn check_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate], extent: Extent) {
        let mut explained = vec![NO_CONTACT; estimates.len()];
        match &self.by {
            Forward::Influence(influence) => influence.locate_batch(readings, channels, &mut explained),
            Forward::Digit(digit) => digit.locate_batch(readings, channels, &mut explained),
        }
        for (estimate, explained) in estimates.iter_mut().zip(explained) {
            *estimate = self.combine_estimates(explained, *estimate, extent);
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        match &self.by {
            Forward::Influence(influence) => influence.check(setup),
            Forward::Digit(digit) => digit.check(setup),
        }
    }
}

impl ReadingCheck {
    fn combine_estimates(&self, explained: Estimate, estimate: Estimate, extent: Extent) -> Estimate {
        let is_like_presses = self.own_intervals.is_some_and(|OwnIntervals { force_n }| {
            let told = force_n.zip(explained.contact.force_n);
            told.is_none_or(|((least, most), force_n)| (least..=most).contains(&force_n))
        });
        let moved = || {
            let position = nearest_on(extent, estimate.contact.position);
            ContactEstimate { position, ..estimate.contact }
        };
        let widened = || {
            let contact = moved();
            ContactEstimate { uncertainty: uncertainty_with(&contact, &explained.contact), ..contact }
        };
        match explained.status {
            Status::NoContact => explained,
            Status::OutsideModel => Estimate { status: Status::OutsideModel, ..estimate },
            Status::Ambiguous => Estimate { contact: widened(), ..explained },
            Status::Located | Status::OutsideSurface if is_like_presses => {
                let contact = moved();
                let uncertainty = uncertainty_with(&contact, &estimate.contact);
                Estimate { contact: ContactEstimate { uncertainty, ..contact }, ..explained }
            }
            Status::Located | Status::OutsideSurface => Estimate { contact: widened(), ..explained },
        }
    }
}

/// Summed over coordinates; infinite without an interval.
fn interval_m(estimate: &Estimate, extent: Extent) -> f64 {
    let Some(told) = estimate.contact.uncertainty else { return f64::INFINITY };
    let length_m = |(low, high): (f64, f64), side_m: f64| high.min(side_m) - low.max(0.0);
    let y_m = extent.width_m().map_or(0.0, |width_m| length_m(told.y_95_m, width_m));
    length_m(told.x_95_m, extent.length_m()) + y_m
}

fn nearest_on(extent: Extent, Position { x_m, y_m }: Position) -> Position {
    let held = |at_m: f64, size_m: f64| at_m.max(0.0).min(size_m);
    Position { x_m: held(x_m, extent.length_m()), y_m: held(y_m, extent.width_m().unwrap_or(0.0)) }
}

fn uncertainty_with(estimate: &ContactEstimate, explained: &ContactEstimate) -> Option<Uncertainty> {
    let Some(other) = explained.uncertainty else { return estimate.uncertainty };
    let (at, there) = (estimate.position, explained.position);
    let with = |(low, high): (f64, f64), x: f64| (low.min(x), high.max(x));
    let (dx, dy) = (there.x_m - at.x_m, there.y_m - at.y_m);
    let [xx, xy, xf, yy, yf, ff] = other.covariance;
    Some(Uncertainty {
        covariance: [xx + dx * dx, xy + dx * dy, xf, yy + dy * dy, yf, ff],
        x_95_m: with(other.x_95_m, at.x_m),
        y_95_m: with(other.y_95_m, at.y_m),
        force_95_n: other.force_95_n.zip(estimate.force_n).map(|(force_95_n, at_n)| with(force_95_n, at_n)),
    })
}

#[cfg(test)]
mod tests;
