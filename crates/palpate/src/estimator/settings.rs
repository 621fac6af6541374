//! An estimator's settings in words, so that a report can list those of any method.

use super::EstimatorConfig;

/// One setting of an estimator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Its key in a rig's `[estimator]`, or a name of its own where a rig cannot change it.
    pub key: &'static str,
    /// What it is, in words.
    pub name: &'static str,
    /// Its value in words, with its unit.
    pub value: String,
}

impl EstimatorConfig {
    /// Every setting of the estimator, in words.
    pub fn settings(&self) -> Vec<Setting> {
        match self {
            Self::Network(config) => config.settings(),
        }
    }
}
