//! Learnt influence functions at the nodes of a locator's table.

use super::channels::Channels;
use palpate_mechanics::contact::Position;

/// Influence functions of the channels in use at the nodes of a locator's table.
#[derive(Clone, Debug, PartialEq)]
pub struct InfluencesAtNodes {
    /// Positions of the nodes.
    pub positions: Vec<Position>,
    /// Indices of the channels in use, from 0.
    pub channels: Vec<usize>,
    /// Offset of each channel in use, in its SI unit or raw.
    pub offsets: Vec<f64>,
    /// Standard deviation of the noise of each channel in use.
    pub noise_sd: Vec<f64>,
    /// Reading per newton, positions × channels in use.
    pub values: Vec<f64>,
    /// Posterior standard deviation of the values, positions × channels in use.
    pub sd: Vec<f64>,
}

impl InfluencesAtNodes {
    pub(super) fn of_table(
        positions: Vec<Position>,
        channels: &Channels,
        [values, variances]: [&[f64]; 2],
    ) -> Self {
        let Channels { offsets, noise_sd, .. } = channels;
        let channels = channels.live();
        let in_use = |of: &[f64]| -> Vec<f64> {
            let rows = of.chunks_exact(offsets.len());
            rows.flat_map(|row| channels.iter().map(|channel| row[*channel])).collect()
        };
        Self {
            values: in_use(values),
            sd: in_use(variances).into_iter().map(f64::sqrt).collect(),
            offsets: in_use(offsets),
            noise_sd: in_use(noise_sd),
            positions,
            channels,
        }
    }
}
