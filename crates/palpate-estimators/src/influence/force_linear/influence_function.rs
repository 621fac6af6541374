//! Influence functions of a force-linear surface at any position.

use super::locator::{ForceLinearLocator, VALUES};
use crate::influence::inversion::Slopes;
use crate::influence::lanes::LANES;
use crate::influence::loads::{LoadChannel, NotProportional};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::InfluenceFunction;
use std::sync::Arc;

impl ForceLinearLocator {
    /// Coordinates of a position, in nodes; those of the nearest place of the grid beyond it.
    pub(super) fn nodes_at(&self, position: Position) -> [f64; 2] {
        let [x, y] = self.axes();
        [(x, position.x_m), (y, position.y_m)]
            .map(|(axis, at_m)| ((at_m - axis.start) / axis.step).clamp(0.0, (axis.count - 1) as f64))
    }

    /// Writes f, ∂f/∂x and ∂f/∂y over the noise, per newton and metre; beyond the grid f is constant.
    pub(super) fn slopes_at(&self, position: Position, slopes: &mut Vec<Slopes>) {
        /// In nodes; a position at an end of the grid is within it.
        const ROUNDING: f64 = 1e-9;
        let at = self.nodes_at(position);
        self.layers.interpolate_slopes(at, VALUES..VALUES + 1, slopes);
        let coordinates_m = [position.x_m, position.y_m];
        for (k, axis) in self.axes().into_iter().enumerate() {
            let is_within = ((coordinates_m[k] - axis.start) / axis.step - at[k]).abs() <= ROUNDING;
            let per_metre = if is_within { axis.step.recip() } else { 0.0 };
            for slopes in &mut *slopes {
                slopes[k + 1].iter_mut().for_each(|slope| *slope *= per_metre);
            }
        }
    }

    /// Influence function, offset and noise of each channel, in its unit; `None` for channels not in use.
    ///
    /// The noise is that of an untouched surface, with the offset's posterior variance.
    ///
    /// # Errors
    /// [`NotProportional`] for readings that are not proportional to the force.
    pub fn influences(&self) -> Result<Vec<Option<LoadChannel<'_>>>, NotProportional> {
        if self.saturation_share().is_some() {
            return Err(NotProportional::Saturation);
        }
        if self.response() != 1.0 {
            return Err(NotProportional::Exponent(self.response()));
        }
        let noise_sds = self.noise_of_channels();
        let mut influences = vec![None; noise_sds.len()];
        for (k, (channel, offset, scale)) in self.channels().enumerate() {
            let influence = Arc::new(TabulatedInfluence { locator: self, channel: k, scale });
            influences[channel] =
                noise_sds[channel].map(|noise_sd| LoadChannel { influence, offset, noise_sd });
        }
        Ok(influences)
    }
}

/// Influence function of a channel in use.
struct TabulatedInfluence<'a> {
    locator: &'a ForceLinearLocator,
    /// From 0 among the channels in use.
    channel: usize,
    /// Reading per unit of the table.
    scale: f64,
}

impl TabulatedInfluence<'_> {
    fn value_and_gradient(&self, position: Position) -> [f64; 3] {
        let mut slopes = Vec::new();
        self.locator.slopes_at(position, &mut slopes);
        slopes[self.channel / LANES].map(|lanes| self.scale * lanes[self.channel % LANES])
    }
}

impl InfluenceFunction for TabulatedInfluence<'_> {
    fn at(&self, position: Position) -> f64 {
        self.value_and_gradient(position)[0]
    }

    fn gradient(&self, position: Position) -> [f64; 2] {
        let [_, along, across] = self.value_and_gradient(position);
        [along, across]
    }
}
