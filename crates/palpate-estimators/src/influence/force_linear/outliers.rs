//! Presses that nothing explains.
//!
//! The error of each press, as the others predict it, is taken over a deviation that it has no part in (externally studentized residuals;
//! Cook and Weisberg, *Residuals and Influence in Regression*, 1982, section 2.2.1). It is an outlier where it is further off than noise is
//! in one of a hundred recordings.

use super::evidence::ChannelFit;
use super::presses::Presses;
use super::prior::Prior;
use super::residuals::Residuals;
use crate::influence::measured::MeasuredError;
use ndarray::Zip;
use palpate_numerics::watch::Watch;
use palpate_numerics::{NotPositiveDefinite, chi_squared_critical_value};

/// Test of presses for outliers under a prior that was learnt.
pub(super) struct OutlierTest<'a> {
    pub prior: &'a Prior,
    pub fits: &'a [ChannelFit],
    pub sensors_m: &'a [Vec<f64>],
}

impl OutlierTest<'_> {
    /// First rows of the worst outliers among the presses, no more than `at_once`; others may be none without them. `tested` presses are
    /// tested in all, and told the noise together.
    pub fn worst(
        &self,
        presses: &Presses,
        tested: usize,
        at_once: usize,
    ) -> Result<Vec<usize>, NotPositiveDefinite> {
        const TAIL: f64 = 1e-2;
        /// Share of the noise's variance in the error of a press, below which it is not judged.
        const LEAST_TOLD: f64 = 1e-6;
        let n = presses.len();
        let Residuals { squares, told, freedom } =
            Residuals::new(presses, self.prior, self.fits, self.sensors_m)?;
        let freedom = freedom - 3.0;
        if freedom < 5.0 {
            return Ok(Vec::new());
        }
        let freedom = freedom + tested.saturating_sub(n) as f64;
        let externally = |square: f64, told: f64| {
            let others = (freedom - square).max(1e-3 * freedom);
            // The others say next to nothing of a press alone at its place.
            if told < LEAST_TOLD { 0.0 } else { square * (freedom - 1.0) / others }
        };
        let squares = Zip::from(&squares).and(&told).map_collect(|square, told| externally(*square, *told));
        let channels = self.fits.len();
        let bound = |count: usize, tests: usize| {
            let bound = chi_squared_critical_value(TAIL / tests as f64, count);
            let freedom = freedom * count as f64;
            freedom * ((bound / freedom).exp() - 1.0)
        };
        let (of_all, of_one) = (bound(channels, 2 * tested), bound(1, 2 * tested * channels));
        let excess = |i: usize| {
            let row = squares.row(i);
            (row.sum() / of_all).max(row.iter().fold(0.0, |most: f64, square| most.max(*square)) / of_one)
        };
        let mut found: Vec<usize> = (0..n).filter(|i| excess(*i) > 1.0).collect();
        found.sort_by(|a, b| excess(*b).total_cmp(&excess(*a)));
        Ok(found.into_iter().take(at_once).map(|i| presses.row[i]).collect())
    }

    /// First rows of the outliers of many presses, each part of them near one another tested by itself until none is left.
    pub fn by_parts(&self, presses: &Presses, watch: Watch) -> Result<Vec<usize>, MeasuredError> {
        /// Presses of a part: the time grows with their square, and those further away tell nothing that these do not.
        const PART: usize = 100;
        // Fewer would not tell offset and polynomials.
        let places = 3 * (1 + self.prior.polynomials());
        let mut outliers = Vec::new();
        for part in presses.parts(PART, places, &self.prior.lengths_m) {
            let mut part = presses.select(&part);
            loop {
                watch.round()?;
                let found = self.worst(&part, presses.len(), 1)?;
                if found.is_empty() {
                    break;
                }
                let kept: Vec<usize> = (0..part.len()).filter(|i| !found.contains(&part.row[*i])).collect();
                part = part.select(&kept);
                outliers.extend(found);
            }
        }
        Ok(outliers)
    }
}
