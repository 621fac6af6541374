//! Saturation of the channels: readings of hard presses fall short of proportion to the force.
//!
//! A deviation x from the offset that is proportional to the force is read as y = x/(1 + s/(1 − s)·|x|/X), the hyperbolic law of a Langmuir
//! isotherm and of resistive foams. The share s is the amount by which the largest deviation X falls short. With the largest read
//! deviation Y = (1 − s)·X, the inverse is x = y/(1 − s·|y|/Y). All channels have one s, and each has its own Y, that of the presses. Beyond Y the inverse
//! continues along its tangent.
//!
//! s has the largest evidence of the linearized presses, plus the logarithm of the Jacobian, Σ ln(dx/dy) over rows and channels (Box and
//! Cox, *Journal of the Royal Statistical Society B* 26, 1964). The prior is that of the presses as they are, apart from its
//! scatter: presses that saturate seem to scatter with their force.

use super::learning::{Learnt, MOST_PRESSES, MOST_SEARCHED};
use super::locator::ForceLinearLocator;
use super::presses::relative_times;
use crate::fit::FitTask;
use crate::influence::config::Structure;
use crate::influence::measured::MeasuredError;
use crate::recording::Recording;
use crate::thinning::thinned;
use serde::{Deserialize, Serialize};

/// Saturation of the channels in use; see [the module](self).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Saturation {
    /// s, at least 0 and below 1.
    pub share: f64,
    /// Y of each channel in use, in its unit.
    pub ranges: Vec<f64>,
}

impl Saturation {
    /// x of a deviation y of a channel in use.
    pub fn linearized(&self, channel: usize, deviation: f64) -> f64 {
        let range = self.ranges[channel];
        let within = deviation.abs().min(range);
        let linear = within / (1.0 - self.share * within / range);
        deviation.signum() * (linear + (deviation.abs() - within) * self.slope(channel, within))
    }

    /// dx/dy.
    fn slope(&self, channel: usize, deviation: f64) -> f64 {
        let range = self.ranges[channel];
        (1.0 - self.share * deviation.abs().min(range) / range).powi(-2)
    }
}

/// Learns influence functions and saturation; `None` where [`super::fit`] finds no influence functions.
pub(super) fn fit(task: FitTask) -> Result<Option<ForceLinearLocator>, MeasuredError> {
    let FitTask { setup, recording, watch, .. } = task;
    let linear = Structure::ForceLinear;
    let Some(learnt) = Learnt::new(setup, recording, linear, MOST_PRESSES, watch)? else { return Ok(None) };
    let presses = Deviations::new(&learnt, recording)?;
    let searched = presses.thinned(&learnt);
    let share = most_likely_share(|share| searched.log_evidence(&learnt, &presses.saturation(share), task))?;
    let saturation = presses.saturation(share);
    let linearized = presses.linearized(&saturation);
    let locator = super::fit(FitTask { recording: &linearized, ..task }, linear)?;
    Ok(locator.map(|locator| locator.with_saturation(saturation, &learnt.live)))
}

/// The share with the largest log evidence, to 0.6 %.
fn most_likely_share(
    mut log_evidence: impl FnMut(f64) -> Result<f64, MeasuredError>,
) -> Result<f64, MeasuredError> {
    const TRIED: [f64; 5] = [0.0, 0.1, 0.2, 0.4, 0.6];
    const STEPS: [f64; 4] = [0.05, 0.025, 0.0125, 0.00625];
    const MOST: f64 = 0.9;
    let mut best = (f64::NEG_INFINITY, 0.0);
    for share in TRIED {
        let found = log_evidence(share)?;
        if found > best.0 {
            best = (found, share);
        }
    }
    for step in STEPS {
        let (_, from) = best;
        for share in [from - step, from + step] {
            if (0.0..=MOST).contains(&share) {
                let found = log_evidence(share)?;
                if found > best.0 {
                    best = (found, share);
                }
            }
        }
    }
    Ok(best.1)
}

/// Deviations of readings from the offsets of their time.
struct Deviations<'a> {
    recording: &'a Recording,
    /// Channels in use, from 0.
    channels: &'a [usize],
    /// Offset of each channel in use at each row.
    offsets: Vec<Vec<f64>>,
    /// Rows that presses were learnt from.
    rows: Vec<usize>,
}

impl<'a> Deviations<'a> {
    fn new(learnt: &'a Learnt, recording: &'a Recording) -> Result<Self, MeasuredError> {
        let offsets = learnt.offsets_at_or_constant(&relative_times(recording))?;
        let rows = 0..recording.rows.len();
        let rows = rows.filter(|row| learnt.set_aside.binary_search(row).is_err()).collect();
        Ok(Self { recording, channels: &learnt.live, offsets, rows })
    }

    /// Rows of the presses by which hyperparameters are searched: all repeats of each.
    fn thinned(&self, learnt: &Learnt) -> Self {
        let first_rows = &learnt.pressed.row;
        let kept: Vec<usize> = thinned(first_rows.len(), MOST_SEARCHED).collect();
        let press_of = |row: &usize| first_rows.partition_point(|first| first <= row).saturating_sub(1);
        let is_kept = |row: &&usize| kept.binary_search(&press_of(row)).is_ok();
        let rows = self.rows.iter().filter(is_kept).copied().collect();
        Self { rows, offsets: self.offsets.clone(), ..*self }
    }

    fn at(&self, row: usize, channel: usize) -> f64 {
        self.recording.rows[row].reading[self.channels[channel]] - self.offsets[channel][row]
    }

    /// The saturation by a share, with the ranges of these rows.
    fn saturation(&self, share: f64) -> Saturation {
        let largest = |channel: usize| {
            let sizes = self.rows.iter().map(|row| self.at(*row, channel).abs());
            sizes.fold(f64::MIN_POSITIVE, f64::max)
        };
        Saturation { share, ranges: (0..self.channels.len()).map(largest).collect() }
    }

    /// The recording with readings in proportion to the force.
    fn linearized(&self, saturation: &Saturation) -> Recording {
        let mut recording = self.recording.clone();
        for (row, linearized) in recording.rows.iter_mut().enumerate() {
            for (c, channel) in self.channels.iter().enumerate() {
                linearized.reading[*channel] =
                    self.offsets[c][row] + saturation.linearized(c, self.at(row, c));
            }
        }
        recording
    }

    /// Log evidence of these rows, linearized, with the logarithm of the Jacobian.
    fn log_evidence(
        &self,
        learnt: &Learnt,
        saturation: &Saturation,
        FitTask { setup, watch, .. }: FitTask,
    ) -> Result<f64, MeasuredError> {
        let linearized = self.linearized(saturation).subset(&self.rows);
        let channels = || 0..self.channels.len();
        let of_row =
            |row: &usize| channels().map(|c| saturation.slope(c, self.at(*row, c)).ln()).sum::<f64>();
        let log_jacobian: f64 = self.rows.iter().map(of_row).sum();
        Ok(learnt.log_evidence(setup, &linearized, watch)? + log_jacobian)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SATURATION: Saturation = Saturation { share: 0.2, ranges: Vec::new() };

    fn saturation() -> Saturation {
        Saturation { ranges: vec![4.0], ..SATURATION }
    }

    #[test]
    fn linearizes_the_hyperbolic_law() {
        let largest = 4.0 / 0.8;
        for x in [-5.0, -1.0, 0.0, 0.3, 2.5, 5.0] {
            let y = x / (1.0 + 0.25 * f64::abs(x) / largest);
            assert!((saturation().linearized(0, y) - x).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn slope_is_the_derivative_within_the_range_and_beyond() {
        for y in [-6.0, -4.5, -3.0, 0.5, 3.9, 4.1, 9.0] {
            let at = |y: f64| saturation().linearized(0, y);
            let difference = (at(y + 1e-5) - at(y - 1e-5)) / 2e-5;
            assert!((difference - saturation().slope(0, y)).abs() < 1e-8, "{y}");
        }
    }

    #[test]
    fn finds_the_largest_log_evidence() {
        for truth in [0.0, 0.07, 0.33, 0.62, 0.9] {
            let found = most_likely_share(|share| Ok(-(share - truth).powi(2))).unwrap();
            assert!((found - truth).abs() < 0.01 || truth > 0.65, "{found} for {truth}");
        }
    }
}
