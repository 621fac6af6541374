//! Disabling of a channel of a measured surface.
//!
//! A whitening W of the noise C and the signal S (W·C·Wᵀ = I, W·S·Wᵀ = diag(d)) mixes all channels. C =
//! (Wᵀ·W)⁻¹ and W⁻¹ = C·Wᵀ give C, S = W⁻¹·diag(d)·W⁻ᵀ and the means of the readings. Without the rows and
//! columns of the channel, these have a whitening of their own.

use super::locator::{MeasuredContents, MeasuredLocator};
use super::table::Table;
use crate::influence::missing_channel::residual_limit_after;
use crate::influence::noise::{Noise, Whitening};
use ndarray::{Array1, Array2, Axis};
use palpate_numerics::{Cholesky, NotPositiveDefinite};

impl MeasuredLocator {
    /// Disables channel `channel` (from 0); returns false, without a change, when no channel would remain.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] for a singular noise covariance in a locator file.
    pub fn leave_out(&mut self, channel: usize) -> Result<bool, NotPositiveDefinite> {
        let (stored, channels) = (&self.stored, self.whitening().channels());
        let Some(removed) = stored.channels_in_use().position(|other| other == channel) else {
            return Ok(channels > 0);
        };
        if channels == 1 {
            return Ok(false);
        }
        *self = stored.without_channel(channel, removed)?.into_locator();
        Ok(true)
    }
}

impl MeasuredContents {
    /// Channels of a reading that are in use, from 0.
    pub fn channels_in_use(&self) -> impl Iterator<Item = usize> {
        let channels = self.whitening.channels() + self.missing.len();
        (0..channels).filter(|channel| !self.missing.contains(channel))
    }

    /// Removes `channel`, number `removed` among those in use.
    fn without_channel(&self, channel: usize, removed: usize) -> Result<Self, NotPositiveDefinite> {
        let channels = self.whitening.channels();
        let others: Vec<usize> = (0..channels).filter(|other| *other != removed).collect();
        let covariances = Covariances::of(&self.whitening)?;
        let whitening = covariances.whitening_of(&others, self.whitening.gain)?;
        let means = covariances.means_of(&others, &whitening, &self.table);
        let (before, after) = (self.table.freedom(channels), self.table.freedom(channels - 1));
        Ok(Self {
            whitening,
            table: Table { means, ..self.table.clone() },
            missing: [&self.missing[..], &[channel]].concat(),
            residual_limit: residual_limit_after(self.residual_limit, before, after),
            ..self.clone()
        })
    }
}

/// Covariances of scaled readings.
struct Covariances {
    /// C.
    noise: Array2<f64>,
    /// S.
    signal: Array2<f64>,
    /// W⁻¹.
    inverse: Array2<f64>,
}

impl Covariances {
    fn of(whitening: &Whitening) -> Result<Self, NotPositiveDefinite> {
        let matrix = weights(whitening);
        let noise = Cholesky::factor(matrix.t().dot(&matrix))?.inverse();
        let inverse = noise.dot(&matrix.t());
        let signal = inverse.dot(&Array2::from_diag(&Array1::from(whitening.signal.clone())));
        Ok(Self { noise, signal: signal.dot(&inverse.t()), inverse })
    }

    fn whitening_of(&self, channels: &[usize], gain: f64) -> Result<Whitening, NotPositiveDefinite> {
        let of = |matrix: &Array2<f64>| matrix.select(Axis(0), channels).select(Axis(1), channels);
        Whitening::from_covariances(Noise { covariance: of(&self.noise), gain }, &of(&self.signal))
    }

    /// Means of some channels by their whitening, node by node.
    fn means_of(&self, channels: &[usize], whitening: &Whitening, table: &Table) -> Vec<f64> {
        let all = self.inverse.ncols();
        let means = Array2::from_shape_fn((table.variances.len(), all), |(i, j)| table.means[i * all + j]);
        let whitened = weights(whitening).dot(&self.inverse.select(Axis(0), channels));
        means.dot(&whitened.t()).iter().copied().collect()
    }
}

fn weights(whitening: &Whitening) -> Array2<f64> {
    let channels = whitening.channels();
    Array2::from_shape_fn((channels, channels), |(i, j)| whitening.matrix[i * channels + j])
}
