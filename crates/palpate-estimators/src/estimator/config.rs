//! What a rig's `[estimator]` section says.

use crate::centroid::CentroidConfig;
use crate::closed_form::ClosedFormConfig;
use crate::digit::{DigitConfig, DigitTheory};
use crate::gaussian_process::GaussianProcessConfig;
use crate::influence::InfluenceConfig;
use crate::neighbours::NeighboursConfig;
use crate::network::{LevenbergMarquardtConfig, NetworkConfig};
use crate::setup::Bench;
use palpate_mechanics::surface::SurfaceSpec;

/// A configured method; fitting it to a recording gives a locator.
#[derive(Clone, Debug, PartialEq)]
pub enum EstimatorConfig {
    /// The founding paper's network (`kind = "network"`).
    Network(NetworkConfig),
    /// Networks trained by Levenberg–Marquardt with Bayesian regularisation (`kind = "network-lm"`).
    NetworkLm(LevenbergMarquardtConfig),
    /// Influence functions, inverted (`kind = "influence"`).
    Influence(InfluenceConfig),
    /// Gaussian-process regression of the position (`kind = "gaussian-process"`).
    GaussianProcess(GaussianProcessConfig),
    /// The beam's own equations (`kind = "closed-form"`).
    ClosedForm(ClosedFormConfig),
    /// The bending finger's own equations (`kind = "digit"`).
    Digit(DigitConfig),
    /// Nearest neighbours (`kind = "neighbours"`).
    Neighbours(NeighboursConfig),
    /// The calibrated centroid of array sensors (`kind = "centroid"`).
    Centroid(CentroidConfig),
    /// Whichever of the others locates best in cross-validation (`kind = "auto"`).
    Auto,
}

impl EstimatorConfig {
    /// Every `kind` that a rig can name.
    pub const KINDS: &'static [&'static str] = &[
        "network",
        "network-lm",
        "influence",
        "gaussian-process",
        "closed-form",
        "digit",
        "neighbours",
        "centroid",
        "auto",
    ];

    /// Every method that can be asked to locate on a bench, each with its default settings, the best guess first.
    pub fn contenders(bench: &Bench) -> Vec<Self> {
        let mut contenders = vec![
            Self::Influence(InfluenceConfig::default()),
            Self::GaussianProcess(GaussianProcessConfig::default()),
        ];
        if matches!(bench.surface, SurfaceSpec::Beam(_)) {
            contenders.push(Self::ClosedForm(ClosedFormConfig));
        }
        if matches!(bench.surface, SurfaceSpec::Digit(_)) {
            contenders.insert(0, Self::Digit(DigitConfig::default()));
        }
        contenders.extend([
            Self::Neighbours(NeighboursConfig::default()),
            Self::Centroid(CentroidConfig),
            Self::NetworkLm(LevenbergMarquardtConfig::default()),
            Self::Network(NetworkConfig::default()),
        ]);
        contenders
    }

    /// A digit's estimator by the linear theory of bending, to be compared with.
    pub const LINEAR_DIGIT: Self = Self::Digit(DigitConfig { theory: DigitTheory::Linear });

    /// Distinct contact positions that a recording must have for fitting.
    pub fn positions_needed(&self) -> usize {
        match self {
            Self::ClosedForm(_) | Self::Digit(_) => 1,
            _ => 2,
        }
    }

    /// The most often that one fit asks whether to go on.
    pub fn most_rounds(&self) -> u64 {
        match self {
            Self::Network(config) => u64::from(config.training.max_epochs),
            _ => 1,
        }
    }

    /// The `kind` under which a rig names this estimator.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Network(_) => "network",
            Self::NetworkLm(_) => "network-lm",
            Self::Influence(_) => "influence",
            Self::GaussianProcess(_) => "gaussian-process",
            Self::ClosedForm(_) => "closed-form",
            Self::Digit(_) => "digit",
            Self::Neighbours(_) => "neighbours",
            Self::Centroid(_) => "centroid",
            Self::Auto => "auto",
        }
    }
}

impl Default for EstimatorConfig {
    fn default() -> Self {
        Self::Network(NetworkConfig::default())
    }
}
