//! Drift of many presses, by alternation.
//!
//! Influence functions follow from drift-free presses condensed in space ([`super::condensed`]), and offsets
//! from presses condensed in time. The first drift follows from a subset.

use super::condensed::Estimate;
use super::drift::END;
use super::evidence::ChannelFit;
use super::posterior::offsets;
use super::prior::Prior;
use crate::influence::calibration::CalibrationRows;
use crate::influence::measured::MeasuredError;
use ndarray::Array2;
use palpate_numerics::watch::Watch;

pub(super) struct DriftFit {
    prior: Prior,
    fits: Vec<ChannelFit>,
    presses: CalibrationRows,
}

impl CalibrationRows {
    /// Condenses to about `most` presses, corrected to the last row; returns the drift too.
    pub(super) fn condensed_under_drift(
        &self,
        prior: &Prior,
        fits: &[ChannelFit],
        most: usize,
        watch: Watch,
    ) -> Result<(Self, DriftFit), MeasuredError> {
        const ROUNDS: usize = 2;
        let mut few = self.thinned(most);
        let mut drift = None;
        for _ in 0..ROUNDS {
            let estimate = Estimate::new(few, prior, fits)?;
            let presses = self.condensed_in_time(prior, &estimate, most, watch)?;
            let fit = DriftFit { prior: prior.clone(), fits: fits.to_vec(), presses };
            let still = fit.taken_off(self)?;
            few = still.condensed(prior, fits, most, watch)?;
            drift = Some(fit);
        }
        Ok((few, drift.expect("there is a round")))
    }
}

impl DriftFit {
    fn offsets_at(&self, times: &[f64]) -> Result<Vec<Vec<(f64, f64)>>, MeasuredError> {
        offsets(&self.prior, &self.presses, &self.fits, &[], times)
    }

    /// Drift of every channel until the last row.
    pub fn until_the_end(&self, times: &[f64]) -> Result<Vec<Vec<f64>>, MeasuredError> {
        let all = self.offsets_at(&[&[END], times].concat())?;
        let of_channel = |offsets: Vec<(f64, f64)>| {
            let (end, _) = offsets[0];
            offsets[1..].iter().map(|(offset, _)| end - offset).collect()
        };
        Ok(all.into_iter().map(of_channel).collect())
    }

    pub fn variances_at_the_end(&self) -> Result<Vec<f64>, MeasuredError> {
        Ok(self.offsets_at(&[END])?.iter().map(|of_channel| of_channel[0].1).collect())
    }

    fn taken_off(&self, presses: &CalibrationRows) -> Result<CalibrationRows, MeasuredError> {
        let drifts = self.until_the_end(&presses.time)?;
        let drifts = Array2::from_shape_fn(presses.means.dim(), |(i, c)| drifts[c][i]);
        Ok(CalibrationRows {
            means: &presses.means + &drifts,
            time: vec![END; presses.len()],
            ..presses.clone()
        })
    }
}
