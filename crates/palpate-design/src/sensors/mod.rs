//! Placement of sensors: k of many candidate sites, of several kinds.
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
//! A [`DesignCriterion`] scores layouts by the limit (see [`palpate_mechanics::limit`]). Searches meet every
//! constraint of a [`SensorDesign`].
//!
//! Contacts over a support are excluded if the force is unknown. Criteria include the flat prior of the
//! surface: along a line the score of a contact is 1/√(1/s² + 12/l²), with the limit s. An [`Assessment`]
//! gives the limits themselves.

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
pub use design::{DesignCriterion, DesignError, Exclusion, FixedList, KeepOut, RequiredSensor, SensorDesign};
pub use design::{SensorOffer, Sites, Supply, Symmetry};
pub use method::{AssessedLayout, Method, best_design, to_verify};
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

/// Prepared design with sensitivities and a feasible layout.
pub struct SensorProblem<'a> {
    setup: &'a Setup,
    sensitivity: Sensitivity<'a>,
    candidates: Candidates,
    table: Arc<Vec<Block>>,
    pool: Pool,
    objective: Box<dyn Objective + 'a>,
    feasible: Vec<usize>,
}

impl<'a> SensorProblem<'a> {
    /// Prepares a design.
    ///
    /// A plate with more candidates than three times the contacts is solved by reciprocity: three solutions
    /// per contact give all readings and derivatives.
    ///
    /// # Errors
    /// [`DesignError`] with the unmet constraint, or if cancelled.
    pub fn new(setup: &'a Setup, design: &SensorDesign, watch: Watch) -> Result<Self, DesignError> {
        let (sensitivity, candidates) = checked(setup, design)?;
        let table = sensitivity.table(&SensorAt::of_design(&candidates.sensors, design), watch)?;
        Self::with_table(setup, sensitivity, candidates, Arc::new(table), design)
    }

    /// Estimates work and memory of [`SensorProblem::new`] and [`SensorProblem::all`].
    ///
    /// # Errors
    /// [`DesignError`] for an invalid design.
    pub fn estimated_cost(setup: &'a Setup, design: &SensorDesign) -> Result<DesignCost, DesignError> {
        let (sensitivity, candidates) = checked(setup, design)?;
        Ok(sensitivity.cost(candidates.sensors.len(), design.count))
    }

    /// Returns this problem with another number of sensors.
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
        let feasible = exchange::feasible_layout(&pool)?;
        let objective = sensitivity.objective(Arc::clone(&table), design.criterion, design.tolerance_m);
        Ok(Self { setup, sensitivity, candidates, table, pool, objective, feasible })
    }

    /// Design task.
    pub fn design(&self) -> &SensorDesign {
        &self.pool.design
    }

    /// Contacts of the design.
    pub fn contacts(&self) -> &WeightedContacts {
        &self.sensitivity.contacts
    }

    /// Lists the excluded contacts over supports.
    pub fn contacts_over_supports(&self) -> Vec<Position> {
        let positions = self.sensitivity.contacts.positions.iter().copied();
        positions.filter(|position| !self.sensitivity.is_judged(*position)).collect()
    }

    /// Known if the locator is given the force.
    pub fn force(&self) -> Force {
        self.sensitivity.force
    }

    /// Force of the contacts, N.
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

    fn rows(&self, sensors: &[PlacedSensor]) -> Vec<Vec<Block>> {
        self.sensitivity.rows(&SensorAt::of_design(sensors, &self.pool.design))
    }
}

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
