//! What a rig's `[estimator]` section says.

use crate::influence::InfluenceConfig;
use crate::network::NetworkConfig;

/// A configured method; fitting it to a recording gives a locator.
#[derive(Clone, Debug, PartialEq)]
pub enum EstimatorConfig {
    /// The founding paper's network (`kind = "network"`).
    Network(NetworkConfig),
    /// Influence functions, inverted (`kind = "influence"`).
    Influence(InfluenceConfig),
}

impl EstimatorConfig {
    /// Every `kind` that a rig can name.
    pub const KINDS: &'static [&'static str] = &["network", "influence"];

    /// Distinct contact positions that a recording must have for fitting.
    pub fn positions_needed(&self) -> usize {
        match self {
            Self::Network(_) | Self::Influence(_) => 2,
        }
    }

    /// The most often that one fit asks whether to go on.
    pub fn most_rounds(&self) -> u64 {
        match self {
            Self::Network(config) => u64::from(config.training.max_epochs),
            Self::Influence(_) => 1,
        }
    }

    /// The `kind` under which a rig names this estimator.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Network(_) => "network",
            Self::Influence(_) => "influence",
        }
    }
}

impl Default for EstimatorConfig {
    fn default() -> Self {
        Self::Network(NetworkConfig::default())
    }
}
