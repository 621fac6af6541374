//! Outlier test by externally studentized residuals (Cook and Weisberg, *Residuals and Influence in
//! Regression*, 1982, section 2.2.1), with 1 % false alarms per recording.

use super::evidence::ChannelFit;
use super::prior::Prior;
use super::residuals::Residuals;
use crate::influence::calibration::CalibrationRows;
use crate::influence::measured::MeasuredError;
use ndarray::Zip;
use palpate_numerics::watch::Watch;
use palpate_numerics::{NotPositiveDefinite, chi_squared_critical_value};

pub(super) struct OutlierTest<'a> {
    pub prior: &'a Prior,
    pub fits: &'a [ChannelFit],
    pub sensors_m: &'a [Vec<f64>],
}

impl OutlierTest<'_> {
    /// First rows of the worst outliers; all `tested` presses share the noise estimate.
    pub fn worst(
        &self,
        presses: &CalibrationRows,
        tested: usize,
        at_once: usize,
    ) -> Result<Vec<usize>, NotPositiveDefinite> {
        const TAIL: f64 = 1e-2;
        /// Share of the own noise in an error's variance.
        const LEAST_NOISE_SHARE: f64 = 1e-6;
        let n = presses.len();
        let Residuals { squares, noise_shares, freedom } =
            Residuals::new(presses, self.prior, self.fits, self.sensors_m)?;
        let freedom = freedom - 3.0;
        if freedom < 5.0 {
            return Ok(Vec::new());
        }
        let freedom = freedom + tested.saturating_sub(n) as f64;
        let externally = |square: f64, noise_share: f64| {
            let others = (freedom - square).max(1e-3 * freedom);
            // The others do not predict an isolated press.
            if noise_share < LEAST_NOISE_SHARE { 0.0 } else { square * (freedom - 1.0) / others }
        };
        let squares = Zip::from(&squares)
            .and(&noise_shares)
            .map_collect(|square, noise_share| externally(*square, *noise_share));
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

    /// Tests parts of neighbouring presses until no outlier remains.
    pub fn by_parts(&self, presses: &CalibrationRows, watch: Watch) -> Result<Vec<usize>, MeasuredError> {
        /// Presses of a part: time is quadratic, and distant presses add no information.
        const PART: usize = 100;
        // Fewer positions do not identify offset and polynomials.
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
