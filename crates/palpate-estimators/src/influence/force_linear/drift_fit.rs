//! Drift of more presses than can be learnt from at once.
//!
//! Influences are learnt from presses whose drift was taken off, neighbours in space sharing a cell ([`super::condensed`]); offsets in the
//! course of the recording from cells of neighbours in time, in which what the influences say that the position changes was taken off. Each is
//! told by the estimate of the other before it, and the first by some of the presses alone.

use super::condensed::Estimate;
use super::drift::END;
use super::evidence::ChannelFit;
use super::posterior::offsets;
use super::presses::Presses;
use super::prior::Prior;
use crate::influence::measured::MeasuredError;
use ndarray::Array2;
use palpate_numerics::watch::Watch;

/// Drift of every channel, as presses that were condensed in time tell it.
pub(super) struct DriftFit {
    prior: Prior,
    fits: Vec<ChannelFit>,
    presses: Presses,
}

impl Presses {
    /// No more than about `most` presses that tell of a separable prior with drift what all of these tell, each as it would read at the end of
    /// the recording; and the drift.
    pub fn condensed_under_drift(
        &self,
        prior: &Prior,
        fits: &[ChannelFit],
        most: usize,
        watch: Watch,
    ) -> Result<(Self, DriftFit), MeasuredError> {
        /// Estimates of the drift, each by influences from the last one.
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
    /// Mean and variance of the offset of every channel at each of some times.
    fn offsets_at(&self, times: &[f64]) -> Result<Vec<Vec<(f64, f64)>>, MeasuredError> {
        offsets(&self.prior, &self.presses, &self.fits, &[], times)
    }

    /// The drift of every channel from each of some times to the end of the recording, a row a channel.
    pub fn until_the_end(&self, times: &[f64]) -> Result<Vec<Vec<f64>>, MeasuredError> {
        let all = self.offsets_at(&[&[END], times].concat())?;
        let of_channel = |offsets: Vec<(f64, f64)>| {
            let (end, _) = offsets[0];
            offsets[1..].iter().map(|(offset, _)| end - offset).collect()
        };
        Ok(all.into_iter().map(of_channel).collect())
    }

    /// Variance of the offset of every channel at the end.
    pub fn variances_at_the_end(&self) -> Result<Vec<f64>, MeasuredError> {
        Ok(self.offsets_at(&[END])?.iter().map(|of_channel| of_channel[0].1).collect())
    }

    /// Presses as they would read at the end.
    fn taken_off(&self, presses: &Presses) -> Result<Presses, MeasuredError> {
        let drifts = self.until_the_end(&presses.time)?;
        let drifts = Array2::from_shape_fn(presses.means.dim(), |(i, c)| drifts[c][i]);
        Ok(Presses { means: &presses.means + &drifts, time: vec![END; presses.len()], ..presses.clone() })
    }
}
