//! Learnt readings, tabulated over position and nuisance coordinate.

use crate::influence::grid::Axis;

/// Whitened mean readings and their relative variance at the nodes of a grid.
///
/// Index of a node: (x·count_y + y)·count_nuisance + nuisance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Along the surface, in metres.
    pub x: Axis,
    /// Across it, in metres; a single node on a line.
    pub y: Axis,
    /// Scaled nuisance coordinate; a single node without one.
    pub nuisance: Axis,
    /// W·f̄, channel by channel, node by node.
    pub means: Vec<f64>,
    /// v: process variance over the signal's, node by node.
    pub variances: Vec<f64>,
}

impl Table {
    /// Scales the noise standard deviation by `factor`.
    pub(super) fn widened(mut self, factor: f64) -> Self {
        self.means.iter_mut().for_each(|value| *value /= factor);
        self
    }

    /// Number of positions (x, y).
    pub fn places(&self) -> usize {
        self.x.count * self.y.count
    }

    /// Degrees of freedom of a contact's residual from `channels` channels.
    pub(super) fn freedom(&self, channels: usize) -> usize {
        let fitted = [self.x, self.y, self.nuisance].iter().filter(|axis| axis.count > 1).count();
        channels.saturating_sub(fitted)
    }

    pub(super) fn channels(&self) -> usize {
        self.means.len() / self.variances.len().max(1)
    }

    pub(super) fn mean(&self, place: usize, node: usize, channel: usize) -> f64 {
        self.means[(place * self.nuisance.count + node) * self.channels() + channel]
    }
}
