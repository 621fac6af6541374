//! Placement of sensors: k of many candidate sites, of several kinds, for the expected contacts.
//!
//! ```
//! use palpate_design::sensors::{ContactPrior, SensorDesign, SensorProblem, Sites};
//! use palpate_estimators::setup::Setup;
//! use palpate_mechanics::sensing::SensorKind::Deflection;
//! use palpate_mechanics::surface::Beam;
//! use palpate_mechanics::units::{gpa, mm, newtons, um};
//! use palpate_numerics::watch::Watch;
//!
//! let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
//! let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
//! let contacts = ContactPrior::along(mm(20.0), mm(380.0), mm(5.0));
//! let design = SensorDesign::for_setup(&setup)?.contacts(contacts).sites(Sites::Every(mm(5.0))).unknown_force();
//! let problem = SensorProblem::new(&setup, &design, Watch::NONE)?;
//! let (even, best) = (problem.even()?.assessment, problem.greedy_exchange(0, Watch::NONE)?.assessment);
//! assert!(best.mean_limit_m.unwrap() < 0.82 * even.mean_limit_m.unwrap());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A layout is judged by the limit (see [`palpate_mechanics::limit`]) over those contacts, by one of four criteria
//! ([`DesignCriterion`]). Searches build layouts that meet every constraint of a [`SensorDesign`]; a [`DesignError`] names a
//! constraint that cannot be met. Layouts by the historical methods and the even layout are compared with them.
//!
//! With an unknown force, no layout can locate a contact over a support, so these contacts are excluded. At any other contact that
//! the readings do not determine there is no limit, and a mean would not exist. Criteria therefore include the prior information
//! that the contact lies on the surface: a flat prior of variance l²/12. Along a line the score of a contact is then
//! 1/√(1/s² + 12/l²), with s the limit. The mean, the largest limit and the share within a tolerance in an [`Assessment`] are
//! those of the limit itself.

mod assessment;
mod candidates;
mod design;
mod exchange;
mod exhaustive;
mod genetic;
mod limit_objective;
mod method;
mod objective;
mod pivoting;
mod principal;
mod refine;
mod sensitivity;

pub use crate::contacts::{ContactPrior, WeightedContacts};
pub use crate::verification::Verification;
pub use assessment::{Assessment, CountPoint, enough};
pub use candidates::PlacedSensor;
pub(crate) use design::TOLERANCE_M;
pub use design::{DesignCriterion, DesignError, Exclusion, FixedList, KeepOut, MustHave, SensorDesign};
pub use design::{SensorOffer, Sites, Supply, Symmetry};
pub use method::{Designed, Method, best_design, to_verify};
pub use pivoting::{condition_number, pivoted_columns};
pub use sensitivity::DesignCost;

use std::sync::Arc;

use candidates::{Candidates, Pool};
use objective::{Block, Objective};
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::{Force, LimitError};
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Watch;
use sensitivity::{Sensitivity, SensorAt};

/// A prepared design: the sensitivity of every candidate to every contact, and a layout that meets all constraints.
pub struct SensorProblem<'a> {
    setup: &'a Setup,
    sensitivity: Sensitivity<'a>,
    candidates: Candidates,
    table: Arc<Vec<Block>>,
    pool: Pool,
    objective: Box<dyn Objective + 'a>,
    /// A layout that meets all constraints.
    feasible: Vec<usize>,
}

impl<'a> SensorProblem<'a> {
    /// Prepares a design for a setup. The setup's own layout is used only by [`Method::Existing`].
    ///
    /// On a plate with more candidates than three times the contacts, the model is solved for the contacts. By reciprocity three
    /// solutions per contact give the readings of all sensors there and their derivatives.
    ///
    /// # Errors
    /// [`DesignError`] with the constraint that no layout can meet, with the number that is out of range, or when the watch stopped
    /// it.
    pub fn new(setup: &'a Setup, design: &SensorDesign, watch: Watch) -> Result<Self, DesignError> {
        let (sensitivity, candidates) = checked(setup, design)?;
        let table = sensitivity.table(&SensorAt::of_design(&candidates.sensors, design), watch)?;
        Self::with_table(setup, sensitivity, candidates, Arc::new(table), design)
    }

    /// Work and memory of [`SensorProblem::new`] and [`SensorProblem::all`], estimated without solving the model.
    ///
    /// # Errors
    /// [`DesignError`] for a number out of its range, or a constraint on candidates that contradicts the surface.
    pub fn estimated_cost(setup: &'a Setup, design: &SensorDesign) -> Result<DesignCost, DesignError> {
        let (sensitivity, candidates) = checked(setup, design)?;
        Ok(sensitivity.cost(candidates.sensors.len(), design.count))
    }

    /// This problem with another number of sensors.
    ///
    /// # Errors
    /// As [`SensorProblem::new`].
    pub fn with_count(&self, count: usize) -> Result<Self, DesignError> {
        let design = self.pool.design.clone().count(count);
        let (sensitivity, candidates) = (self.sensitivity.clone(), self.candidates.clone());
        Self::with_table(self.setup, sensitivity, candidates, Arc::clone(&self.table), &design)
    }

    fn with_table(
        setup: &'a Setup,
        sensitivity: Sensitivity<'a>,
        candidates: Candidates,
        table: Arc<Vec<Block>>,
        design: &SensorDesign,
    ) -> Result<Self, DesignError> {
        let pool = Pool::new(candidates.clone(), design, sensitivity.surface.extent())?;
        let feasible = exchange::feasible(&pool)?;
        let objective = sensitivity.objective(Arc::clone(&table), design.criterion, design.tolerance_m);
        Ok(Self { setup, sensitivity, candidates, table, pool, objective, feasible })
    }

    /// The design task.
    pub fn design(&self) -> &SensorDesign {
        &self.pool.design
    }

    /// Contacts for which the layout is designed.
    pub fn contacts(&self) -> &WeightedContacts {
        &self.sensitivity.contacts
    }

    /// Positions of contacts over supports, where no layout determines an unknown force. Searches and assessments exclude them.
    pub fn contacts_over_supports(&self) -> Vec<Position> {
        let positions = self.sensitivity.contacts.positions.iter().copied();
        positions.filter(|position| !self.sensitivity.is_judged(*position)).collect()
    }

    /// Whether the locator is given the force of the contacts.
    pub fn force(&self) -> Force {
        self.sensitivity.force
    }

    /// Force of the contacts, in newtons.
    pub fn force_n(&self) -> f64 {
        self.sensitivity.force_n
    }

    /// Extent of the surface.
    pub fn extent(&self) -> Extent {
        self.pool.extent
    }

    /// Number of candidates.
    pub fn candidates(&self) -> usize {
        self.pool.sensors.len()
    }

    /// The sensitivities of some sensors to the contacts.
    fn rows(&self, sensors: &[PlacedSensor]) -> Vec<Vec<Block>> {
        self.sensitivity.rows(&SensorAt::of_design(sensors, &self.pool.design))
    }
}

/// The contacts and candidates of a design, after its numbers are checked against their ranges.
fn checked<'a>(
    setup: &'a Setup,
    design: &SensorDesign,
) -> Result<(Sensitivity<'a>, Candidates), DesignError> {
    let surface = setup.surface().model().ok_or(LimitError::NoModel)?;
    let force_n = setup.force_n().ok_or(LimitError::NoForce)?;
    design.check(surface.extent())?;
    let noiseless = design.offers.iter().find(|offer| offer.channel.reading_sd() <= 0.0);
    if let Some(offer) = noiseless {
        return Err(DesignError::SingularNoise { kind: offer.kind });
    }
    let contacts = WeightedContacts::from_prior(&design.contacts, surface.extent())?;
    let sensitivity = Sensitivity { surface, contacts, force_n, force: design.force };
    if !sensitivity.contacts.positions.iter().any(|position| sensitivity.is_judged(*position)) {
        return Err(DesignError::OverSupports { contacts: sensitivity.contacts.len() });
    }
    Ok((sensitivity, Candidates::new(surface, design)?))
}

#[cfg(test)]
mod tests;
