//! Estimate of the saturation.
//!
//! s maximizes the log evidence of linearized presses plus the log Jacobian, Σ ln(dx/dy) (Box and Cox,
//! *Journal of the Royal Statistical Society B* 26, 1964). The prior is that of raw presses without scatter,
//! which resembles saturation.

use super::learning::{InfluenceModel, MOST_PRESSES, MOST_SEARCHED};
use super::saturation::Saturation;
use crate::fit::FitTask;
use crate::influence::calibration::relative_times;
use crate::influence::config::Structure;
use crate::influence::measured::MeasuredError;
use crate::recording::Recording;
use crate::thinning::thinned;
use std::sync::Arc;

pub(super) struct Linearization {
    pub recording: Recording,
    pub saturation: Saturation,
    learnt: Arc<InfluenceModel>,
}

impl Linearization {
    /// Estimates the saturation; `None` without influence functions.
    pub fn new(task: FitTask) -> Result<Option<Self>, MeasuredError> {
        let Some(learnt) = InfluenceModel::of_task(task, Structure::ForceLinear, MOST_PRESSES)? else {
            return Ok(None);
        };
        let presses = PressDeviations::new(&learnt, task.recording)?;
        let searched = presses.thinned(&learnt);
        let share =
            most_likely_share(|share| searched.log_evidence(&learnt, &presses.saturation(share), task))?;
        let saturation = presses.saturation(share);
        let recording = presses.linearized(&saturation);
        Ok(Some(Self { recording, saturation, learnt }))
    }

    /// Channels of the ranges, from 0.
    pub fn channels(&self) -> &[usize] {
        &self.learnt.live
    }
}

/// Share of largest log evidence, to 0.6 %.
fn most_likely_share(
    mut log_evidence: impl FnMut(f64) -> Result<f64, MeasuredError>,
) -> Result<f64, MeasuredError> {
    /// Coarse search and refinement; shares above 0.7 are another response than saturation.
    const TRIED: [f64; 5] = [0.0, 0.1, 0.2, 0.4, 0.6];
    const STEPS: [f64; 4] = [0.05, 0.025, 0.0125, 0.00625];
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
            if share >= 0.0 {
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
struct PressDeviations<'a> {
    recording: &'a Recording,
    channels: &'a [usize],
    /// Offsets by channel and row.
    offsets: Vec<Vec<f64>>,
    rows: Vec<usize>,
}

impl<'a> PressDeviations<'a> {
    fn new(learnt: &'a InfluenceModel, recording: &'a Recording) -> Result<Self, MeasuredError> {
        let offsets = learnt.offsets_at_or_constant(&relative_times(recording))?;
        let rows = 0..recording.rows.len();
        let rows = rows.filter(|row| learnt.set_aside.binary_search(row).is_err()).collect();
        Ok(Self { recording, channels: &learnt.live, offsets, rows })
    }

    /// All repeats of the presses of the hyperparameter search.
    fn thinned(&self, learnt: &InfluenceModel) -> Self {
        let first_rows = &learnt.pressed.row;
        let kept: Vec<usize> = thinned(first_rows.len(), MOST_SEARCHED).collect();
        let press_of = |row: &usize| first_rows.partition_point(|first| first <= row).saturating_sub(1);
        let is_kept = |row: &&usize| kept.binary_search(&press_of(row)).is_ok();
        let rows = self.rows.iter().filter(is_kept).copied().collect();
        Self { rows, offsets: self.offsets.clone(), ..*self }
    }

    fn deviation(&self, row: usize, channel: usize) -> f64 {
        self.recording.rows[row].reading[self.channels[channel]] - self.offsets[channel][row]
    }

    fn saturation(&self, share: f64) -> Saturation {
        let largest = |channel: usize| {
            let sizes = self.rows.iter().map(|row| self.deviation(*row, channel).abs());
            sizes.fold(f64::MIN_POSITIVE, f64::max)
        };
        Saturation { share, ranges: (0..self.channels.len()).map(largest).collect() }
    }

    fn linearized(&self, saturation: &Saturation) -> Recording {
        let mut recording = self.recording.clone();
        for (row, linearized) in recording.rows.iter_mut().enumerate() {
            for (c, channel) in self.channels.iter().enumerate() {
                linearized.reading[*channel] =
                    self.offsets[c][row] + saturation.linearized(c, self.deviation(row, c));
            }
        }
        recording
    }

    fn log_evidence(
        &self,
        learnt: &InfluenceModel,
        saturation: &Saturation,
        FitTask { setup, watch, .. }: FitTask,
    ) -> Result<f64, MeasuredError> {
        let linearized = self.linearized(saturation).subset(&self.rows);
        let channels = || 0..self.channels.len();
        let of_row =
            |row: &usize| channels().map(|c| saturation.slope(c, self.deviation(*row, c)).ln()).sum::<f64>();
        let log_jacobian: f64 = self.rows.iter().map(of_row).sum();
        Ok(learnt.log_evidence(setup, &linearized, watch)? + log_jacobian)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_largest_log_evidence() {
        for truth in [0.0, 0.07, 0.33, 0.62] {
            let found = most_likely_share(|share| Ok(-(share - truth).powi(2))).unwrap();
            assert!((found - truth).abs() < 0.01, "{found} for {truth}");
        }
    }
}
