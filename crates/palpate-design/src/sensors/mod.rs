//! Where to put the sensors: k of many candidate sites, of several kinds, for the contacts that are expected.
//!
//! A layout is judged by the limit (see [`palpate_mechanics::limit`]) over those contacts, by one of four criteria
//! ([`DesignCriterion`]). Searches put layouts together that keep every constraint of a [`SensorDesign`]; what cannot be kept
//! is a [`DesignError`] that names it. Beside them stand layouts by the historical methods, and the even layout.
//!
//! Where readings do not tell a contact there is no limit, and a mean would not exist. Criteria therefore reckon with what is
//! known without any reading, that the contact lies on the surface: a flat prior of variance l²/12. Along a line the score of a
//! contact is then 1/√(1/s² + 12/l²), with s the limit. The mean, the largest limit and the share within a tolerance that an
//! [`Assessment`] has are those of the limit itself.

mod assessment;
mod by_method;
mod candidates;
mod contacts;
mod counts;
mod error;
mod exchange;
mod exhaustive;
mod genetic;
mod limit_objective;
mod method;
mod objective;
mod pivoting;
mod pool;
mod principal;
mod refine;
mod rows;
mod sensor_design;
mod stage;
mod starts;
mod verification;

pub use super::calibration::{CalibrationError, Verification};
pub use assessment::Assessment;
pub use candidates::PlacedSensor;
pub use contacts::WeightedContacts;
pub use counts::{CountPoint, enough};
pub use error::{DesignError, Exclusion};
pub use method::Method;
pub use pivoting::{condition_number, pivoted_columns};
pub use sensor_design::{
    ContactPrior, DesignCriterion, KeepOut, MustHave, SensorDesign, SensorOffer, Sites, Symmetry,
};
pub use stage::Stage;

use std::sync::Arc;

use candidates::Candidates;
use exchange::Found;
use objective::{Block, Objective};
use palpate_estimators::arrangement::{inner_grid, squarest};
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::{Force, LimitError};
use palpate_mechanics::sensing::{ChannelModel, Layout, Sensor, SensorKind, even_positions};
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};
use pool::Pool;
use principal::{PrincipalComponents, Reconstruction};
use rows::Touches;

/// A layout and its worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Designed {
    /// How it came about.
    pub method: Method,
    /// The sensors, kind by kind as they are offered, from left to right.
    pub layout: Layout,
    /// How good it is.
    pub assessment: Assessment,
}

/// A design made ready: what every candidate tells of every contact.
pub struct SensorProblem<'a> {
    setup: &'a Setup,
    touches: Touches<'a>,
    candidates: Candidates,
    table: Arc<Vec<Block>>,
    pool: Pool,
    objective: Box<dyn Objective + 'a>,
    /// A layout that keeps all constraints.
    packed: Vec<usize>,
}

impl<'a> SensorProblem<'a> {
    /// Makes a design for a bench ready; of the bench's own layout nothing is used.
    ///
    /// # Errors
    /// [`DesignError`], with the constraint that no layout can keep.
    pub fn new(setup: &'a Setup, design: &SensorDesign, watch: Watch) -> Result<Self, DesignError> {
        let surface = setup.surface.model().ok_or(LimitError::NoModel)?;
        let force_n = setup.force_n.ok_or(LimitError::NoForce)?;
        let silent = design.offers.iter().find(|offer| offer.channel.reading_sd() <= 0.0);
        if let Some(offer) = silent {
            return Err(DesignError::SingularNoise { kind: offer.kind });
        }
        let known = design.force_is_known.unwrap_or(true);
        let force = if known { Force::Known } else { Force::Unknown };
        let contacts = WeightedContacts::of(&design.contacts, surface.extent());
        let touches = Touches { surface, contacts, force_n, force };
        let candidates = Candidates::of(surface, design)?;
        let table = touches.table(&candidates.sensors, design, watch)?;
        Self::with_table(setup, touches, candidates, Arc::new(table), design)
    }

    /// The same for another number of sensors.
    ///
    /// # Errors
    /// As [`SensorProblem::new`].
    pub fn with_count(&self, count: usize) -> Result<Self, DesignError> {
        let design = SensorDesign { count, ..self.pool.design.clone() };
        let (touches, candidates) = (self.touches.clone(), self.candidates.clone());
        Self::with_table(self.setup, touches, candidates, Arc::clone(&self.table), &design)
    }

    fn with_table(
        setup: &'a Setup,
        touches: Touches<'a>,
        candidates: Candidates,
        table: Arc<Vec<Block>>,
        design: &SensorDesign,
    ) -> Result<Self, DesignError> {
        let extent = touches.surface.extent();
        let pool = Pool::new(candidates.clone(), design, extent)?;
        let all: Vec<usize> = (0..pool.units.len()).collect();
        let packed = starts::packed(&pool, &all)?;
        let objective = touches.objective(Arc::clone(&table), design.criterion, design.tolerance_m);
        Ok(Self { setup, touches, candidates, table, pool, objective, packed })
    }

    /// What is designed.
    pub fn design(&self) -> &SensorDesign {
        &self.pool.design
    }

    /// The contacts that it is designed for.
    pub fn contacts(&self) -> &WeightedContacts {
        &self.touches.contacts
    }

    /// What is known of their force.
    pub fn force(&self) -> Force {
        self.touches.force
    }

    /// Their force, in newtons.
    pub fn force_n(&self) -> f64 {
        self.touches.force_n
    }

    /// Whether contacts have two coordinates.
    pub fn is_plane(&self) -> bool {
        self.pool.extent.is_plane()
    }

    /// How many candidates there are.
    pub fn candidates(&self) -> usize {
        self.pool.sensors.len()
    }

    /// The even layout, of the first kind that is not tied to supports: at i·l/(k+1), on a plane the grid whose cells are
    /// closest to squares. `None` where only reactions are offered, or an even sensor would have no noise to judge it by.
    ///
    /// # Errors
    /// As [`SensorProblem::assess`].
    pub fn even(&self) -> Result<Option<Designed>, DesignError> {
        let design = &self.pool.design;
        let Some(offer) = design.offers.iter().position(|offer| offer.kind != SensorKind::Reaction) else {
            return Ok(None);
        };
        let positions = even_places(design.count, self.pool.extent);
        let sensors = positions.into_iter().map(|position| PlacedSensor { offer, position }).collect();
        self.judged(Method::Even, sensors).map(Some)
    }

    /// The rig's own layout, unless it is the even one.
    ///
    /// # Errors
    /// As [`SensorProblem::assess`].
    pub fn own(&self, even: Option<&Designed>) -> Result<Option<Designed>, DesignError> {
        let layout = &self.setup.layout;
        let places = |layout: &Layout| -> Vec<_> {
            layout.sensors.iter().map(|sensor| (sensor.kind, sensor.position)).collect()
        };
        if even.is_some_and(|even| places(&even.layout) == places(layout)) {
            return Ok(None);
        }
        let assessment = self.assess(layout)?;
        Ok(Some(Designed { method: Method::Rig, layout: layout.clone(), assessment }))
    }

    /// The layout by greedy choice and exchange.
    ///
    /// # Errors
    /// As [`SensorProblem::assess`].
    pub fn greedy_exchange(&self, seed: u64, watch: Watch) -> Result<Designed, DesignError> {
        let found = self.exchanged(&*self.objective, seed, watch)?;
        self.designed(Method::GreedyExchange, &found.selection)
    }

    fn exchanged(&self, objective: &dyn Objective, seed: u64, watch: Watch) -> Result<Found, Cancelled> {
        exchange::search(&self.pool, objective, &self.packed, seed, watch)
    }

    /// Every layout: even, the rig's own, by all searches that suit, by the historical methods.
    ///
    /// # Errors
    /// As [`SensorProblem::assess`].
    pub fn all(&self, seed: u64, watch: Watch) -> Result<Vec<Designed>, DesignError> {
        let even = self.even()?;
        let own = self.own(even.as_ref())?;
        let mut designed: Vec<Designed> = even.into_iter().chain(own).collect();
        let mut best = self.exchanged(&*self.objective, seed, watch)?;
        designed.push(self.designed(Method::GreedyExchange, &best.selection)?);
        let slots = self.packed.len() - self.pool.fixed.len();
        if exhaustive::layouts(&self.pool, slots) <= exhaustive::MOST_LAYOUTS {
            if let Some(found) = exhaustive::search(&self.pool, &*self.objective, slots, watch)? {
                designed.push(self.designed(Method::Exhaustive, &found.selection)?);
                best = best.or_better(Some(found));
            }
        }
        let found = genetic::search(&self.pool, &*self.objective, &self.packed, seed, watch)?;
        designed.push(self.designed(Method::Genetic, &found.selection)?);
        best = best.or_better(Some(found));
        designed.push(self.judged(Method::Refined, refine::refine(self, &best.selection, watch)?)?);
        designed.extend(self.historical(seed, watch)?);
        Ok(designed)
    }

    /// Layouts by other people's criteria.
    fn historical(&self, seed: u64, watch: Watch) -> Result<Vec<Designed>, DesignError> {
        let mut designed = Vec::new();
        if self.pool.design.criterion != DesignCriterion::DOptimality {
            let table = Arc::clone(&self.table);
            let tolerance_m = self.pool.design.tolerance_m;
            let objective = self.touches.objective(table, DesignCriterion::DOptimality, tolerance_m);
            let found = self.exchanged(&*objective, seed, watch)?;
            designed.push(self.designed(Method::DOptimal, &found.selection)?);
        }
        let readings = self.touches.readings(&self.pool.sensors, &self.pool.design);
        let components = PrincipalComponents::of(&readings);
        let reconstruction = Reconstruction::new(&components);
        let found = self.exchanged(&reconstruction, seed, watch)?;
        designed.push(self.designed(Method::PrincipalComponents, &found.selection)?);
        if let Some(selection) = pivoting::search(&self.pool, &components.modes) {
            designed.push(self.designed(Method::QrPivoting, &selection)?);
        }
        Ok(designed)
    }

    fn designed(&self, method: Method, selection: &[usize]) -> Result<Designed, DesignError> {
        let candidates = self.pool.candidates(selection);
        self.judged(method, candidates.into_iter().map(|candidate| self.pool.sensors[candidate]).collect())
    }

    fn judged(&self, method: Method, sensors: Vec<PlacedSensor>) -> Result<Designed, DesignError> {
        let layout = self.layout(sensors);
        let assessment = self.assess(&layout)?;
        Ok(Designed { method, layout, assessment })
    }

    /// Kind by kind, from left to right.
    fn layout(&self, mut placed: Vec<PlacedSensor>) -> Layout {
        placed.sort_by(|a, b| {
            let by_offer = a.offer.cmp(&b.offer);
            let by_row = a.position.y_m.total_cmp(&b.position.y_m);
            by_offer.then(by_row).then(a.position.x_m.total_cmp(&b.position.x_m))
        });
        let mut sensors: Vec<Sensor> = Vec::new();
        for PlacedSensor { offer, position } in placed {
            let offer = &self.pool.design.offers[offer];
            let number = sensors.iter().filter(|sensor| sensor.kind == offer.kind).count() + 1;
            let channel = ChannelModel { dead: false, ..offer.channel };
            let name = format!("{}_{number}", offer.kind);
            sensors.push(Sensor { kind: offer.kind, position, name, channel });
        }
        Layout { sensors }
    }

    fn row(&self, sensor: &PlacedSensor) -> Vec<Block> {
        let offer = &self.pool.design.offers[sensor.offer];
        self.touches.row(offer.kind, sensor.position, &offer.channel)
    }
}

/// The best of the layouts that searches by the criterion found.
pub fn best_design(designed: &[Designed]) -> Option<&Designed> {
    let searched = designed.iter().filter(|designed| designed.method.is_search());
    searched.min_by(|a, b| a.assessment.score.total_cmp(&b.assessment.score))
}

/// i·l/(k+1) on a line; on a plane the inner crossings of the grid whose cells are closest to squares.
fn even_places(count: usize, extent: Extent) -> Vec<Position> {
    if !extent.is_plane() {
        return even_positions(count, extent.length_m).collect();
    }
    let (columns, rows) = squarest(extent, count);
    inner_grid(extent, columns, rows)
}

#[cfg(test)]
mod tests;
