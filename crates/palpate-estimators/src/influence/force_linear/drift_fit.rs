//! Drift of many presses, by alternating estimates.
//!
//! Influence functions follow from presses without their drift, condensed in space ([`super::condensed`]).
//! Offsets over time follow from presses condensed in time, corrected for the change of influence with
//! position. Each estimate uses the preceding one of the other kind; the first uses some of the presses.

use super::condensed::Estimate;
use super::drift::END;
use super::evidence::ChannelFit;
use super::posterior::offsets;
use super::presses::Presses;
use super::prior::Prior;
use crate::influence::measured::MeasuredError;
use ndarray::Array2;
use palpate_numerics::watch::Watch;

/// Drift of every channel, by presses condensed in time.
pub(super) struct DriftFit {
    prior: Prior,
    fits: Vec<ChannelFit>,
    presses: Presses,
}

impl Presses {
    /// Returns about `most` presses equivalent to all under a separable prior with drift, corrected to the
    /// last row, and the drift.
    pub fn condensed_under_drift(
        &self,
        prior: &Prior,
        fits: &[ChannelFit],
        most: usize,
        watch: Watch,
    ) -> Result<(Self, DriftFit), MeasuredError> {
        /// Rounds of the alternation.
        const ROUNDS: usize = 2;
        let mut few = self.thinned(most);
        let mut drift = None;
        for _ in 0..ROUNDS {
            let estimate = Estimate::new(few, prior, fits)?;
            let presses = self.condensed_in_time(prior, &estimate, most, watch)?;
            let told = DriftFit { prior: prior.clone(), fits: fits.to_vec(), presses };
            let still = told.taken_off(self)?;
            few = still.condensed(prior, fits, most, watch)?;
            drift = Some(told);
        }
        Ok((few, drift.expect("there is a round")))
    }
}

impl DriftFit {
    /// Mean and variance of every channel's offset at each time.
    fn offsets_at(&self, times: &[f64]) -> Result<Vec<Vec<(f64, f64)>>, MeasuredError> {
        offsets(&self.prior, &self.presses, &self.fits, &[], times)
    }

    /// Returns the drift of every channel from each time to the last row, one row per channel.
    pub fn until_the_end(&self, times: &[f64]) -> Result<Vec<Vec<f64>>, MeasuredError> {
        let all = self.offsets_at(&[&[END], times].concat())?;
        let of_channel = |offsets: Vec<(f64, f64)>| {
            let (end, _) = offsets[0];
            offsets[1..].iter().map(|(offset, _)| end - offset).collect()
        };
        Ok(all.into_iter().map(of_channel).collect())
    }

    /// Returns the variance of every channel's offset at the last row.
    pub fn variances_at_the_end(&self) -> Result<Vec<f64>, MeasuredError> {
        Ok(self.offsets_at(&[END])?.iter().map(|of_channel| of_channel[0].1).collect())
    }

    /// Presses with readings corrected to the last row.
    fn taken_off(&self, presses: &Presses) -> Result<Presses, MeasuredError> {
        let drifts = self.until_the_end(&presses.time)?;
        let drifts = Array2::from_shape_fn(presses.means.dim(), |(i, c)| drifts[c][i]);
        Ok(Presses { means: &presses.means + &drifts, time: vec![END; presses.len()], ..presses.clone() })
    }
}
