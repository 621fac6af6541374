//! A check of learnt locators by the forward way: what contacts read, learnt from the same recording as the locator.
//!
//! Networks, Gaussian processes, neighbours and the centroid go from a reading to a position, and give one for any reading. What a contact
//! reads, they do not know. Influence functions (of a bending finger its own equations) do, and so tell by one rule, that of
//! [`crate::status`], whether a reading is noise, or that of no contact; and the interval in which the contact is that explains it. Of an
//! estimate with a check
//!
//! - `no_contact`, `outside_model` and `ambiguous`, with the other places, are as the check says them;
//! - the position stays, but for one beyond an edge of the surface where a contact on it explains the reading: it is moved to that edge;
//! - the 95 % interval is the least that holds the check's and the position. What a learnt method says of its own errors is of contacts like
//!   those of its presses: how errors change with force and place, the forward way knows better.

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

/// Influence functions, or the equations of a bending finger, by which the estimates of a learnt method are checked; see [the module](self).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReadingCheck {
    /// Influence functions.
    Influence(InfluenceLocator),
    /// A finger's equations.
    Digit(DigitLocator),
}

impl ReadingCheck {
    /// Rows that influence functions are learnt from, at most: with more the check gains nothing that would change a status.
    pub const MOST_ROWS: usize = 500;

    /// The check by a recording; `None` where influence functions cannot be learnt from it.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch stopped it.
    pub fn fit(task: FitTask) -> Result<Option<Self>, Cancelled> {
        let recording = Self::thinned(task.recording);
        let task = FitTask { recording: &recording, ..task };
        if let SurfaceSpec::Digit(_) = task.setup.surface() {
            return Ok(DigitEstimator::default().fit_method(task).ok().map(Self::Digit));
        }
        let mut methods = vec![Influence::default()];
        if task.setup.surface().model().is_some() {
            // Too few presses to correct mechanics by.
            methods.push(Influence { source: InfluenceSource::Mechanics, ..Influence::default() });
        }
        for method in methods {
            match method.fit_method(task) {
                Ok(fitted) => return Ok(Some(Self::Influence(fitted))),
                Err(error) if Cancelled::caused(&error) => return Err(Cancelled),
                Err(_) => {}
            }
        }
        Ok(None)
    }

    /// The rows that a check is learnt from: [`ReadingCheck::MOST_ROWS`] at most, picked evenly.
    pub(crate) fn thinned(recording: &Recording) -> Cow<'_, Recording> {
        let rows = recording.rows.len();
        if rows <= Self::MOST_ROWS {
            return Cow::Borrowed(recording);
        }
        let picked: Vec<usize> = thinned(rows, Self::MOST_ROWS).collect();
        Cow::Owned(recording.subset(&picked))
    }

    /// Share of untouched readings that may be taken for a contact; `None` of one that tells no untouched reading.
    pub fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        match self {
            Self::Influence(influence) => influence.false_alarm_rate(),
            Self::Digit(digit) => Some(digit.false_alarm_rate),
        }
    }

    /// Offset of each channel, in its SI unit; `None` where it was not learnt.
    pub fn offsets(&self) -> Option<Vec<f64>> {
        match self {
            Self::Influence(influence) => influence.offsets(),
            Self::Digit(digit) => digit.offsets(),
        }
    }

    /// Its means, in words.
    pub fn in_words(&self) -> &'static str {
        match self {
            Self::Influence(_) => "influence functions of the same recording",
            Self::Digit(_) => "the equations of a bending finger",
        }
    }
}

impl CheckEstimate for ReadingCheck {
    fn checked(&self, reading: &[f64], estimate: Estimate, extent: Extent) -> Estimate {
        let explained = match self {
            Self::Influence(influence) => influence.locate(reading),
            Self::Digit(digit) => digit.locate(reading),
        };
        by(explained, estimate, extent)
    }

    fn check_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate], extent: Extent) {
        let mut explained = vec![NO_CONTACT; estimates.len()];
        match self {
            Self::Influence(influence) => influence.locate_batch(readings, channels, &mut explained),
            Self::Digit(digit) => digit.locate_batch(readings, channels, &mut explained),
        }
        for (estimate, explained) in estimates.iter_mut().zip(explained) {
            *estimate = by(explained, *estimate, extent);
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        match self {
            Self::Influence(influence) => influence.check(setup),
            Self::Digit(digit) => digit.check(setup),
        }
    }
}

/// The estimate of a learnt method, as that of the forward way leaves it: `explained`.
fn by(explained: Estimate, estimate: Estimate, extent: Extent) -> Estimate {
    let widened = || {
        let position = nearest_on(extent, estimate.contact.position);
        let contact = ContactEstimate { position, ..estimate.contact };
        ContactEstimate { uncertainty: uncertainty_with(&contact, &explained.contact), ..contact }
    };
    match explained.status {
        Status::NoContact => explained,
        Status::OutsideModel => Estimate { status: Status::OutsideModel, ..estimate },
        Status::Ambiguous => Estimate { contact: widened(), ..explained },
        Status::Located | Status::OutsideSurface => Estimate { contact: widened(), ..explained },
    }
}

/// The point of a surface that is nearest to a position.
fn nearest_on(extent: Extent, Position { x_m, y_m }: Position) -> Position {
    let held = |at_m: f64, size_m: f64| at_m.max(0.0).min(size_m);
    Position { x_m: held(x_m, extent.length_m()), y_m: held(y_m, extent.width_m().unwrap_or(0.0)) }
}

/// The uncertainty by the contact that explains the reading, widened such that it holds the estimate.
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
