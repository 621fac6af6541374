//! What a rig's `[estimator]` section says.

use crate::network::NetworkConfig;

/// A configured method; fitting it to a recording gives a locator.
#[derive(Clone, Debug, PartialEq)]
pub enum EstimatorConfig {
    /// The founding paper's network (`kind = "network"`).
    Network(NetworkConfig),
}

impl EstimatorConfig {
    /// Every `kind` that a rig can name.
    pub const KINDS: &'static [&'static str] = &["network"];

    /// Distinct contact positions that a recording must have for fitting.
    pub fn positions_needed(&self) -> usize {
        match self {
            Self::Network(_) => 2,
        }
    }

    /// The most often that one fit asks whether to go on.
    pub fn most_rounds(&self) -> u64 {
        match self {
            Self::Network(config) => u64::from(config.training.max_epochs),
        }
    }

    /// The `kind` under which a rig names this estimator.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Network(_) => "network",
        }
    }
}

impl Default for EstimatorConfig {
    fn default() -> Self {
        Self::Network(NetworkConfig::default())
    }
}
