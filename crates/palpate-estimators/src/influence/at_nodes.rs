//! Influence functions at the nodes of a locator's table, as the presses told them.

use super::channels::Channels;
use palpate_mechanics::contact::Position;

/// Influence functions of the channels in use, with their uncertainty, at the nodes of a locator's table.
#[derive(Clone, Debug, PartialEq)]
pub struct InfluencesAtNodes {
    /// Positions of the nodes.
    pub positions: Vec<Position>,
    /// The channels in use, from 0.
    pub channels: Vec<usize>,
    /// Offset of each of them, in its SI unit or raw.
    pub offsets: Vec<f64>,
    /// Standard deviation of the noise of each of them.
    pub noise_sd: Vec<f64>,
    /// Reading per newton, less the offset: positions × channels in use.
    pub values: Vec<f64>,
    /// Standard deviation of the values, from calibrating with finitely many noisy presses: positions × channels in use.
    pub sd: Vec<f64>,
}

impl InfluencesAtNodes {
    /// The functions of a table of all channels, nodes × channels, of which some are in use.
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
