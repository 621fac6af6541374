//! Task of a design of training positions.

use crate::contacts::{ContactPrior, WeightedContacts};
use crate::sensors::{SensorDesign, TOLERANCE_M};
use palpate_estimators::arrangement::{ArrangementError, Training};
use palpate_estimators::estimator::{Estimator, FitError};
use palpate_estimators::evaluation::EvaluationError;
use palpate_estimators::influence::Influence;
use palpate_mechanics::limit::Force;
use palpate_mechanics::surface::Extent;
use palpate_numerics::OutOfRange;
use palpate_numerics::regression::RegressionError;
use palpate_numerics::watch::Cancelled;

/// Task of placing training positions. [`PositionProblem::new`](super::PositionProblem::new) checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionDesign {
    /// Estimator to calibrate; not `auto`.
    pub estimator: Estimator,
    /// Number of training positions; at least 1.
    pub count: usize,
    /// Presses per position; at least 1.
    pub repeats: usize,
    /// Existing training: its force and, at equal count, positions to compare with.
    pub existing: Option<Training>,
    /// Contacts to locate; the whole surface if `None`.
    pub contacts: Option<ContactPrior>,
    /// Known if the locator is given the force of the setup.
    pub force: Force,
    /// Tolerance of the error, m; greater than 0.
    pub tolerance_m: f64,
    /// Simulated calibrations per score; at least 1.
    pub calibrations: usize,
    /// Largest number of scored arrangements.
    pub trials: usize,
    /// Calibrations per verification; at least 1.
    pub verifications: usize,
    /// Stopping rule: least further reduction of the error, %; 0 to 100.
    pub stop_percent: f64,
    /// Seed of noise and initial weights.
    pub seed: u64,
}

impl Default for PositionDesign {
    fn default() -> Self {
        Self {
            estimator: Estimator::Influence(Influence::default()),
            count: 10,
            repeats: 1,
            existing: None,
            contacts: None,
            force: Force::Known,
            tolerance_m: TOLERANCE_M,
            calibrations: 8,
            trials: 300,
            verifications: 25,
            stop_percent: 5.0,
            seed: 0,
        }
    }
}

impl PositionDesign {
    /// Adopts an existing training, for comparison.
    pub fn for_training(existing: &Training) -> Self {
        let (count, repeats) = (existing.count, existing.repeats);
        Self { count, repeats, existing: Some(existing.clone()), ..Self::default() }
    }

    /// Sets the estimator.
    #[must_use]
    pub fn estimator(self, estimator: Estimator) -> Self {
        Self { estimator, ..self }
    }

    /// Sets the number of training positions.
    #[must_use]
    pub fn count(self, count: usize) -> Self {
        Self { count, ..self }
    }

    /// Sets the number of presses per position.
    #[must_use]
    pub fn repeats(self, repeats: usize) -> Self {
        Self { repeats, ..self }
    }

    /// Adopts contacts, force and tolerance of a sensor design.
    #[must_use]
    pub fn contacts_of(self, design: &SensorDesign) -> Self {
        let SensorDesign { contacts, force, tolerance_m, .. } = design;
        Self { contacts: Some(contacts.clone()), force: *force, tolerance_m: *tolerance_m, ..self }
    }

    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        OutOfRange::check_positive([
            ("the number of training positions", self.count as f64),
            ("the number of presses", self.repeats as f64),
            ("the number of calibrations", self.calibrations as f64),
            ("the number of verifications", self.verifications as f64),
            ("the tolerance in m", self.tolerance_m),
        ])
    }

    pub(super) fn weighted_contacts(&self, extent: Extent) -> Result<WeightedContacts, OutOfRange> {
        let all_over = || ContactPrior::over_surface(extent);
        WeightedContacts::from_prior(&self.contacts.clone().unwrap_or_else(all_over), extent)
    }
}

/// Method that placed training positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Placement {
    /// The existing positions.
    Existing,
    /// Even positions, the reference.
    Even,
    /// Denser towards the ends, as in the founding paper.
    EdgeDense,
    /// Chebyshev nodes; on a plane a grid of them.
    Chebyshev,
    /// Least posterior variance of the influence functions.
    VarianceOptimal,
    /// Least error after simulated calibrations.
    Optimal,
}

impl Placement {
    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Existing => "existing",
            Self::Even => "even",
            Self::EdgeDense => "edge-dense",
            Self::Chebyshev => "chebyshev",
            Self::VarianceOptimal => "variance-optimal",
            Self::Optimal => "optimal",
        }
    }
}

/// Reason why no training positions can be proposed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PositionError {
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
    /// A surface without a model.
    #[error("a measured surface has no model to simulate calibrations with")]
    NoModel,
    /// Unknown force of the presses.
    #[error("the force of the presses is not known")]
    NoForce,
    /// The estimator `auto`.
    #[error("the estimator is `auto`; positions are designed for one estimator")]
    Auto,
    /// Too few positions for the estimator.
    #[error("{count} training position(s); an estimator of kind `{kind}` needs at least {needed}")]
    TooFew {
        /// Number of training positions.
        count: usize,
        /// Least number.
        needed: usize,
        /// Kind of the estimator.
        kind: &'static str,
    },
    /// Invalid existing arrangement.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// Failed simulation of a calibration.
    #[error(transparent)]
    Calibration(#[from] EvaluationError<FitError>),
    /// Value out of range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// Failed regression.
    #[error("the influence functions cannot be learnt: {0}")]
    Regression(#[from] RegressionError),
    /// Wrong number of channels.
    #[error("the recording has {found} channels; the setup has {needed} sensors")]
    Channels {
        /// Number of sensors.
        needed: usize,
        /// Number of channels.
        found: usize,
    },
    /// Too few distinct positions.
    #[error(
        "the recording has {found} distinct positions; at least {needed} are needed to estimate the smoothness of the surface"
    )]
    TooFewPresses {
        /// Number of distinct positions.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// Presses on a small part of the surface.
    #[error(
        "the presses cover {:.1} mm of {:.1} mm along {axis}; readings elsewhere are undetermined",
        reach_m * 1e3,
        side_m * 1e3
    )]
    SmallPart {
        /// The axis, `x` or `y`.
        axis: char,
        /// Length between the outermost presses, m.
        reach_m: f64,
        /// Length of the surface, m.
        side_m: f64,
    },
    /// Readings that differ only by noise.
    #[error(
        "readings at different positions differ by no more than noise; check the channels and the positions of the presses"
    )]
    NothingTold,
    /// Unknown offsets.
    #[error("the forces of the presses differ, and the readings of the untouched surface are unknown")]
    NoOffset,
    /// A channel of unknown noise.
    #[error(
        "the noise of channel {channel} is unknown: no position was pressed twice, or its repeats are equal, and the setup states no noise"
    )]
    NoNoise {
        /// Number of the channel, from 1.
        channel: usize,
    },
}
