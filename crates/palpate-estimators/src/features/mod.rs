//! What an inverse method sees of a reading: its channels, or what of them does not depend on the load.

mod fitted;

pub use fitted::{ChannelScale, Feature, FeatureSource, Features};

use crate::setup::Setup;

/// Which numbers a reading becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeatureKind {
    /// The readings themselves.
    Readings,
    /// r/‖r‖ and ln ‖r‖. Where readings are proportional to the force, r/‖r‖ does not change with it, and ln ‖r‖ says
    /// how much there is of it.
    LoadInvariant,
}

impl FeatureKind {
    /// The readings where the force is known, and what the load does not change where it is not.
    pub fn for_setup(setup: &Setup) -> Self {
        if setup.force_n.is_some() { Self::Readings } else { Self::LoadInvariant }
    }
}

/// A recording whose readings never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("none of the recording's {channels} channels varies over its {rows} rows; at least 1 must")]
pub struct NoFeatures {
    /// Channels of the recording.
    pub channels: usize,
    /// Its rows.
    pub rows: usize,
}

#[cfg(test)]
mod tests;
