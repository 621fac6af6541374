//! Task of a design of training positions, and the ways in which they are placed.

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

/// Task of placing training positions: presses, estimator, contacts, and how long is searched.
/// [`PositionProblem::new`](super::PositionProblem::new) checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionDesign {
    /// The estimator that is calibrated; any but `auto`.
    pub estimator: Estimator,
    /// Training positions; at least 1.
    pub count: usize,
    /// Presses at each; at least 1.
    pub repeats: usize,
    /// Present training of the surface: tells the force of the presses where that is not the contacts', and the positions that are
    /// compared with where they are as many.
    pub existing: Option<Training>,
    /// The contacts that are located after calibrating; all over the surface where `None`.
    pub contacts: Option<ContactPrior>,
    /// Whether the locator will know their force, where the setup does.
    pub force: Force,
    /// An error up to this is good enough, in metres; greater than 0.
    pub tolerance_m: f64,
    /// Simulated calibrations that an arrangement is judged by while searching; at least 1.
    pub calibrations: usize,
    /// Arrangements that the search may try.
    pub trials: usize,
    /// Calibrations with fresh noise that verify each arrangement; at least 1.
    pub verifications: usize,
    /// Presses of a recording begun are enough once endlessly many more would lower the error by less than this, in %; between 0
    /// and 100.
    pub stop_percent: f64,
    /// Fixes all noise and every network's first weights.
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
    /// As many positions and presses as an existing arrangement has, and compared with it.
    pub fn for_training(existing: &Training) -> Self {
        let (count, repeats) = (existing.count, existing.repeats);
        Self { count, repeats, existing: Some(existing.clone()), ..Self::default() }
    }

    /// The same for another estimator.
    #[must_use]
    pub fn estimator(self, estimator: Estimator) -> Self {
        Self { estimator, ..self }
    }

    /// The same with another number of training positions.
    #[must_use]
    pub fn count(self, count: usize) -> Self {
        Self { count, ..self }
    }

    /// The same with another number of presses at each.
    #[must_use]
    pub fn repeats(self, repeats: usize) -> Self {
        Self { repeats, ..self }
    }

    /// The same for the contacts that sensors are designed for, with their tolerance and what is known of their force.
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
    /// As they are pressed now.
    Existing,
    /// Evenly: what the others are compared with.
    Even,
    /// More of them towards the ends, as the founding paper has it.
    EdgeDense,
    /// Chebyshev's nodes; on a plane a grid of them.
    Chebyshev,
    /// The least variance of influence functions that are learnt as Gaussian processes.
    VarianceOptimal,
    /// The least error of the estimator after simulated calibrations.
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

/// A setup, a design or a recording that no training positions can be found for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PositionError {
    /// The design was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
    /// A surface without a model.
    #[error("a measured surface has no model to simulate calibrations with")]
    NoModel,
    /// The force of the presses is not given.
    #[error("the force of the presses is not known")]
    NoForce,
    /// The estimator is not decided on.
    #[error("the estimator is `auto`; positions are designed for one estimator")]
    Auto,
    /// Fewer positions than the estimator needs.
    #[error("{count} training position(s); an estimator of kind `{kind}` needs at least {needed}")]
    TooFew {
        /// Number of training positions.
        count: usize,
        /// Least number.
        needed: usize,
        /// The estimator's kind.
        kind: &'static str,
    },
    /// The existing training positions cannot be laid out.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// A calibration cannot be simulated.
    #[error(transparent)]
    Calibration(#[from] EvaluationError<FitError>),
    /// A number that is not in its range.
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
        /// Channels of the recording.
        found: usize,
    },
    /// Too few places pressed to see how smooth the influence functions are.
    #[error(
        "the recording has {found} distinct positions; at least {needed} are needed to estimate the smoothness of the surface"
    )]
    TooFewPresses {
        /// Number of distinct positions in the recording.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// Presses of a small part of the surface, which do not tell the rest.
    #[error(
        "the presses cover {:.1} mm of {:.1} mm along {axis}; readings elsewhere are undetermined",
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
    /// Presses of which every place reads alike.
    #[error(
        "readings at different positions differ by no more than noise; check the channels and the positions of the presses"
    )]
    NothingTold,
    /// Presses of forces that differ on a surface without a model, of whose readings without contact nothing is known.
    #[error("the forces of the presses differ, and the readings of the untouched surface are unknown")]
    NoOffset,
    /// A channel of unknown noise.
    #[error(
        "the noise of channel {channel} is unknown: no position was pressed twice, or its repeats are equal, and the setup states no noise"
    )]
    NoNoise {
        /// Which channel, from 1.
        channel: usize,
    },
}
