//! What a rig's `[estimator]` section says.

use crate::centroid::Centroid;
use crate::closed_form::ClosedForm;
use crate::digit::{DigitEstimator, DigitTheory};
use crate::gaussian_process::GaussianProcessEstimator;
use crate::influence::Influence;
use crate::neighbours::Neighbours;
use crate::network::{LevenbergMarquardt, Network};
use crate::setup::Setup;
use palpate_mechanics::surface::SurfaceSpec;

/// A configured method; fitting it to a recording gives a locator.
#[derive(Clone, Debug, PartialEq)]
pub enum Estimator {
    /// The founding paper's network (`kind = "network"`).
    Network(Network),
    /// Networks trained by Levenberg–Marquardt with Bayesian regularisation (`kind = "network-lm"`).
    NetworkLm(LevenbergMarquardt),
    /// Influence functions, inverted (`kind = "influence"`).
    Influence(Influence),
    /// Gaussian-process regression of the position (`kind = "gaussian-process"`).
    GaussianProcess(GaussianProcessEstimator),
    /// The beam's own equations (`kind = "closed-form"`).
    ClosedForm(ClosedForm),
    /// The bending finger's own equations (`kind = "digit"`).
    Digit(DigitEstimator),
    /// Nearest neighbours (`kind = "neighbours"`).
    Neighbours(Neighbours),
    /// The calibrated centroid of array sensors (`kind = "centroid"`).
    Centroid(Centroid),
    /// Whichever of the others locates best in cross-validation (`kind = "auto"`).
    Auto,
}

impl Estimator {
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
    pub fn contenders(setup: &Setup) -> Vec<Self> {
        let mut contenders = vec![
            Self::Influence(Influence::default()),
            Self::GaussianProcess(GaussianProcessEstimator::default()),
        ];
        if matches!(setup.surface, SurfaceSpec::Beam(_)) {
            contenders.push(Self::ClosedForm(ClosedForm));
        }
        if matches!(setup.surface, SurfaceSpec::Digit(_)) {
            contenders.insert(0, Self::Digit(DigitEstimator::default()));
        }
        contenders.extend([
            Self::Neighbours(Neighbours::default()),
            Self::Centroid(Centroid),
            Self::NetworkLm(LevenbergMarquardt::default()),
            Self::Network(Network::default()),
        ]);
        contenders
    }

    /// A digit's estimator by the linear theory of bending, to be compared with.
    pub const LINEAR_DIGIT: Self = Self::Digit(DigitEstimator { theory: DigitTheory::Linear });

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

impl Default for Estimator {
    fn default() -> Self {
        Self::Network(Network::default())
    }
}
