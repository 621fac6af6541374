//! Task of a design of training positions, and the methods that place them.

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

/// Task of placing training positions: presses, estimator, contacts, and the effort of the search.
/// [`PositionProblem::new`](super::PositionProblem::new) checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionDesign {
    /// The estimator to calibrate; any but `auto`.
    pub estimator: Estimator,
    /// Number of training positions; at least 1.
    pub count: usize,
    /// Presses at each position; at least 1.
    pub repeats: usize,
    /// Present training of the surface. It gives the force of the presses where that differs from the contacts' force. The
    /// present positions are compared with the others if they are equally many.
    pub existing: Option<Training>,
    /// Contacts that are located after the calibration; all over the surface if `None`.
    pub contacts: Option<ContactPrior>,
    /// Whether their force is known to the locator, if it is known to the setup.
    pub force: Force,
    /// Tolerance of the location error, in metres; greater than 0.
    pub tolerance_m: f64,
    /// Simulated calibrations that evaluate an arrangement in a search; at least 1.
    pub calibrations: usize,
    /// Largest number of arrangements in the search.
    pub trials: usize,
    /// Calibrations with fresh noise that verify each arrangement; at least 1.
    pub verifications: usize,
    /// Stopping rule: a recording has enough presses if infinitely many more would lower the error by less than this, in %; between
    /// 0 and 100.
    pub stop_percent: f64,
    /// Seed of all noise and of the initial weights of every network.
    pub seed: u64,
}

/// Ten positions, pressed once each, for influence functions and contacts of known force all over the surface.
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
    /// A design with the numbers of positions and presses of an existing arrangement, which is compared with the result.
    pub fn for_training(existing: &Training) -> Self {
        let (count, repeats) = (existing.count, existing.repeats);
        Self { count, repeats, existing: Some(existing.clone()), ..Self::default() }
    }

    /// This design for another estimator.
    #[must_use]
    pub fn estimator(self, estimator: Estimator) -> Self {
        Self { estimator, ..self }
    }

    /// This design with another number of training positions.
    #[must_use]
    pub fn count(self, count: usize) -> Self {
        Self { count, ..self }
    }

    /// This design with another number of presses at each position.
    #[must_use]
    pub fn repeats(self, repeats: usize) -> Self {
        Self { repeats, ..self }
    }

    /// This design with the contacts, the tolerance and the knowledge of the force of a sensor design.
    #[must_use]
    pub fn contacts_of(self, design: &SensorDesign) -> Self {
        let SensorDesign { contacts, force, tolerance_m, .. } = design;
        Self { contacts: Some(contacts.clone()), force: *force, tolerance_m: *tolerance_m, ..self }
    }

    /// Checks every number against its bound.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        OutOfRange::check_positive([
            ("the number of training positions", self.count as f64),
            ("the number of presses", self.repeats as f64),
            ("the number of calibrations", self.calibrations as f64),
            ("the number of verifications", self.verifications as f64),
            ("the tolerance in m", self.tolerance_m),
        ])
    }

    /// The contacts with their weights.
    pub(super) fn weighted_contacts(&self, extent: Extent) -> Result<WeightedContacts, OutOfRange> {
        let all_over = || ContactPrior::all_over(extent);
        WeightedContacts::from_prior(&self.contacts.clone().unwrap_or_else(all_over), extent)
    }
}

/// Method that placed training positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Placement {
    /// The present training positions.
    Existing,
    /// Evenly spaced: the reference of the others.
    Even,
    /// Denser towards the ends, as in the founding paper.
    EdgeDense,
    /// Chebyshev's nodes; on a plane a grid of them.
    Chebyshev,
    /// The least variance of influence functions that are learnt as Gaussian processes.
    VarianceOptimal,
    /// The least error of the estimator after simulated calibrations.
    Optimal,
}

impl Placement {
    /// Name of the method in tables.
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

/// A setup, a design or a recording without a possible arrangement of training positions.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PositionError {
    /// The design was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
    /// The surface has no model.
    #[error("a measured surface has no model to simulate calibrations with")]
    NoModel,
    /// The force of the presses is missing.
    #[error("the force of the presses is not known")]
    NoForce,
    /// The estimator is `auto`.
    #[error("the estimator is `auto`; positions are designed for one estimator")]
    Auto,
    /// There are fewer positions than the estimator needs.
    #[error("{count} training position(s); an estimator of kind `{kind}` needs at least {needed}")]
    TooFew {
        /// Number of training positions.
        count: usize,
        /// Least number of training positions.
        needed: usize,
        /// The estimator's kind.
        kind: &'static str,
    },
    /// The existing training positions do not fit the surface.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// A calibration cannot be simulated.
    #[error(transparent)]
    Calibration(#[from] EvaluationError<FitError>),
    /// A number out of its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The influence functions cannot be learnt.
    #[error("the influence functions cannot be learnt: {0}")]
    Regression(#[from] RegressionError),
    /// The recording has other channels than the setup has sensors.
    #[error("the recording has {found} channels; the setup has {needed} sensors")]
    Channels {
        /// Sensors of the setup.
        needed: usize,
        /// Channels in the recording.
        found: usize,
    },
    /// Too few places are pressed to estimate the smoothness of the influence functions.
    #[error(
        "the recording has {found} distinct positions; at least {needed} determine the smoothness of the surface"
    )]
    TooFewPresses {
        /// Number of distinct positions in the recording.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// The presses cover a small part of the surface, which does not determine the readings elsewhere.
    #[error(
        "the presses reach over {:.1} mm of {:.1} mm along {axis}, and do not show how readings change elsewhere",
        reach_m * 1e3,
        side_m * 1e3
    )]
    SmallPart {
        /// The axis, `x` or `y`.
        axis: char,
        /// Length between the outermost presses, in metres.
        reach_m: f64,
        /// Length of the surface, in metres.
        side_m: f64,
    },
    /// The readings at all places are equal to within noise.
    #[error(
        "readings at different positions differ by no more than noise; check the channels and the positions of the presses"
    )]
    NothingTold,
    /// The presses have different forces on a surface without a model, and the offsets of the channels are unknown.
    #[error("the forces of the presses differ, and the untouched reading of the channels is unknown")]
    NoOffset,
    /// The noise of a channel is unknown.
    #[error(
        "the noise of channel {channel} is unknown: no position was pressed twice, or its repeats are equal, and the setup states no noise"
    )]
    NoNoise {
        /// Number of the channel, from 1.
        channel: usize,
    },
}
