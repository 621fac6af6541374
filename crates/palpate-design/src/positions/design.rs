//! What training positions are designed for, and how they come about.

use crate::contacts::{ContactPrior, WeightedContacts};
use crate::sensors::{SensorDesign, TOLERANCE_M};
use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::Estimator;
use palpate_estimators::influence::Influence;
use palpate_mechanics::limit::Force;
use palpate_mechanics::surface::Extent;
use palpate_numerics::OutOfRange;

/// How much may be pressed, for which estimator and contacts, and how long is searched.
/// [`PositionProblem::new`](super::PositionProblem::new) checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionDesign {
    /// The estimator that is calibrated; any but `auto`.
    pub estimator: Estimator,
    /// Training positions; at least 1.
    pub count: usize,
    /// Presses at each; at least 1.
    pub repeats: usize,
    /// How the surface is pressed now: tells the force of the presses where that is not the contacts', and the positions that are
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
    pub fn like(existing: &Training) -> Self {
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
        match &self.contacts {
            Some(contacts) => WeightedContacts::of(contacts, extent),
            None => WeightedContacts::of(&ContactPrior::all_over(extent), extent),
        }
    }
}

/// How training positions came about.
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
    /// Its name in tables.
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
