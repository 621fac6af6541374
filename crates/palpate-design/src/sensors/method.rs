//! Methods of sensor placement.

use std::sync::Arc;

use super::candidates::is_sensitive;
use super::design::DesignCriterion;
use super::design::{DesignError, RequiredSensor, SensorOffer, Supply};
use super::exchange::{Search, SearchResult};
use super::principal::{PrincipalComponents, Reconstruction};
use super::sensitivity::SensorAt;
use super::{Assessment, PlacedSensor, SensorProblem, exhaustive, genetic, pivoting, refine};
use palpate_estimators::arrangement::{inner_grid, squarest};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{self, ChannelModel, Layout, Sensor, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};

/// Method that made a layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Evenly spaced, for any constraints: the reference of the others.
    Even,
    /// The setup's own layout.
    #[serde(skip_deserializing)]
    Existing,
    /// Greedy choice, then exchange until the score stays.
    GreedyExchange,
    /// The best of all layouts.
    #[serde(skip_deserializing)]
    Exhaustive,
    /// A genetic search.
    Genetic,
    /// The best of the methods above, moved off the candidate sites.
    Refined,
    /// Greedy choice and exchange for the most information.
    DOptimal,
    /// Greedy choice and exchange for the best reconstruction from principal components.
    PrincipalComponents,
    /// QR factorisation with column pivoting on principal components.
    QrPivoting,
}

impl Method {
    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Even => "even",
            Self::Existing => "existing",
            Self::GreedyExchange => "greedy-exchange",
            Self::Exhaustive => "exhaustive",
            Self::Genetic => "genetic",
            Self::Refined => "refined",
            Self::DOptimal => "d-optimal",
            Self::PrincipalComponents => "principal-components",
            Self::QrPivoting => "qr-pivoting",
        }
    }

    /// Reference layout in words: "the even layout's".
    pub const fn reference_in_words(self) -> &'static str {
        match self {
            Self::Existing => "today's",
            _ => "the even layout's",
        }
    }

    /// Returns true if the method searches by the criterion.
    pub const fn is_search(self) -> bool {
        matches!(self, Self::GreedyExchange | Self::Exhaustive | Self::Genetic | Self::Refined)
    }
}

/// Layout and its assessment.
#[derive(Clone, Debug, PartialEq)]
pub struct AssessedLayout {
    /// Method of placement.
    pub method: Method,
    /// Sensors by kind in the order of the offers, left to right.
    pub layout: Layout,
    /// Figures of merit.
    pub assessment: Assessment,
}

/// Returns the search result with the best score.
pub fn best_design(designed: &[AssessedLayout]) -> Option<&AssessedLayout> {
    let searched = designed.iter().filter(|designed| designed.method.is_search());
    searched.min_by(|a, b| a.assessment.score.total_cmp(&b.assessment.score))
}

/// Selects the layouts to verify: references, and the best search result.
pub fn to_verify(designed: &[AssessedLayout]) -> impl Iterator<Item = &AssessedLayout> {
    let best = best_design(designed).map(|best| best.method);
    designed.iter().filter(move |designed| !designed.method.is_search() || Some(designed.method) == best)
}

impl SensorProblem<'_> {
    /// Computes the layouts of all suitable methods.
    ///
    /// # Errors
    /// As [`SensorProblem::assess`], or if cancelled.
    pub fn all(&self, seed: u64, watch: Watch) -> Result<Vec<AssessedLayout>, DesignError> {
        let even = self.even_if_any()?;
        let is_even = |existing: &AssessedLayout| {
            let places = |layout: &Layout| -> Vec<_> {
                layout.sensors().iter().map(|sensor| (sensor.kind, sensor.position)).collect()
            };
            even.as_ref().is_some_and(|even| places(&even.layout) == places(&existing.layout))
        };
        let existing = Some(self.existing()?).filter(|existing| !is_even(existing));
        let mut designed: Vec<AssessedLayout> = even.into_iter().chain(existing).collect();
        let mut best = self.search(watch).greedy_exchange(&self.feasible, seed)?;
        designed.push(self.designed(Method::GreedyExchange, &best.selection)?);
        if exhaustive::layouts(&self.pool, self.free_slots()) <= exhaustive::MOST_LAYOUTS
            && let Some(found) = exhaustive::search(&self.search(watch), self.free_slots())?
        {
            designed.push(self.designed(Method::Exhaustive, &found.selection)?);
            best = best.better_of(found);
        }
        let found = self.genetic(seed, watch)?;
        designed.push(self.designed(Method::Genetic, &found.selection)?);
        best = best.better_of(found);
        designed.push(self.assess_layout(Method::Refined, refine::refine(self, &best.selection, watch)?)?);
        designed.extend(self.historical(seed, watch)?);
        Ok(designed)
    }

    /// Computes the layout of one method; refinement starts from exchange or genetic search.
    ///
    /// # Errors
    /// As [`SensorProblem::all`], and [`DesignError::NoLayout`].
    pub fn by_method(&self, method: Method, seed: u64, watch: Watch) -> Result<AssessedLayout, DesignError> {
        let none = || DesignError::NoLayout { method: method.name() };
        let found = match method {
            Method::Even => return self.even(),
            Method::Existing => return self.existing(),
            Method::GreedyExchange => self.search(watch).greedy_exchange(&self.feasible, seed)?,
            // Here the criterion is D-optimality itself.
            Method::DOptimal if self.pool.design.criterion == DesignCriterion::DOptimality => {
                self.search(watch).greedy_exchange(&self.feasible, seed)?
            }
            Method::DOptimal | Method::PrincipalComponents | Method::QrPivoting => {
                let others = self.historical(seed, watch)?;
                return others.into_iter().find(|designed| designed.method == method).ok_or_else(none);
            }
            Method::Exhaustive => {
                let found = exhaustive::search(&self.search(watch), self.free_slots())?;
                found.ok_or_else(none)?
            }
            Method::Genetic => self.genetic(seed, watch)?,
            Method::Refined => {
                let exchanged = self.search(watch).greedy_exchange(&self.feasible, seed)?;
                let best = exchanged.better_of(self.genetic(seed, watch)?);
                return self.assess_layout(method, refine::refine(self, &best.selection, watch)?);
            }
        };
        self.designed(method, &found.selection)
    }

    /// Computes the layout by greedy choice and exchange, the fastest search.
    ///
    /// # Errors
    /// As [`SensorProblem::all`].
    pub fn greedy_exchange(&self, seed: u64, watch: Watch) -> Result<AssessedLayout, DesignError> {
        self.by_method(Method::GreedyExchange, seed, watch)
    }

    /// Computes the even layout of a kind that is not tied to supports: i·l/(k+1), on a plane a grid.
    ///
    /// # Errors
    /// As [`SensorProblem::assess`], and [`DesignError::NoLayout`] if only reactions are offered.
    pub fn even(&self) -> Result<AssessedLayout, DesignError> {
        self.even_if_any()?.ok_or(DesignError::NoLayout { method: Method::Even.name() })
    }

    pub(super) fn even_if_any(&self) -> Result<Option<AssessedLayout>, DesignError> {
        let design = &self.pool.design;
        let is_free = |offer: &SensorOffer| offer.kind != SensorKind::Reaction && offer.supply == Supply::Any;
        let Some(offer) = design.offers.iter().position(is_free) else {
            return Ok(None);
        };
        let mut sensors: Vec<PlacedSensor> = even_positions(design.count, self.pool.extent)
            .into_iter()
            .map(|position| PlacedSensor { offer, position })
            .collect();
        for i in 0..sensors.len() {
            let Some(moved) = self.nearest_that_reads(&sensors, i) else { return Ok(None) };
            sensors[i] = moved;
        }
        self.assess_layout(Method::Even, sensors).map(Some)
    }

    /// Returns a sensor, or the nearest free candidate if it always reads 0.
    fn nearest_that_reads(&self, sensors: &[PlacedSensor], which: usize) -> Option<PlacedSensor> {
        let sensor = sensors[which];
        let kind = self.pool.design.offers[sensor.offer].kind;
        if is_sensitive(self.sensitivity.surface, kind, sensor.position) {
            return Some(sensor);
        }
        let extent = self.pool.extent;
        let is_free = |other: &&PlacedSensor| {
            other.offer == sensor.offer && !sensors.iter().any(|taken| taken.is_same(other, extent))
        };
        let distance_m = |other: &PlacedSensor| other.position.distance_m(sensor.position);
        self.pool
            .sensors
            .iter()
            .filter(is_free)
            .min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)))
            .copied()
    }

    /// The setup's own layout.
    fn existing(&self) -> Result<AssessedLayout, DesignError> {
        let layout = self.setup.layout().clone();
        let assessment = self.assess(&layout)?;
        Ok(AssessedLayout { method: Method::Existing, layout, assessment })
    }

    pub(super) fn search<'s>(&'s self, watch: Watch<'s>) -> Search<'s> {
        Search { pool: &self.pool, objective: &*self.objective, watch }
    }

    fn genetic(&self, seed: u64, watch: Watch) -> Result<SearchResult, Cancelled> {
        genetic::search(&self.search(watch), &self.feasible, seed)
    }

    fn free_slots(&self) -> usize {
        self.feasible.len() - self.pool.fixed.len()
    }

    fn historical(&self, seed: u64, watch: Watch) -> Result<Vec<AssessedLayout>, DesignError> {
        let design = &self.pool.design;
        let mut designed = Vec::new();
        if design.criterion != DesignCriterion::DOptimality {
            let table = Arc::clone(&self.table);
            let objective =
                self.sensitivity.objective(table, DesignCriterion::DOptimality, design.tolerance_m);
            let search = Search { objective: &*objective, ..self.search(watch) };
            let found = search.greedy_exchange(&self.feasible, seed)?;
            designed.push(self.designed(Method::DOptimal, &found.selection)?);
        }
        let candidates = SensorAt::of_design(&self.pool.sensors, design);
        let components = PrincipalComponents::from_readings(&self.sensitivity.readings(&candidates, watch)?);
        // Readings that are all 0 to within noise, or not finite, have no components.
        if components.modes.is_empty() {
            return Ok(designed);
        }
        let search = Search { objective: &Reconstruction::new(&components), ..self.search(watch) };
        let found = search.greedy_exchange(&self.feasible, seed)?;
        designed.push(self.designed(Method::PrincipalComponents, &found.selection)?);
        if let Some(selection) = pivoting::search(&self.pool, &components.modes) {
            designed.push(self.designed(Method::QrPivoting, &selection)?);
        }
        Ok(designed)
    }

    fn designed(&self, method: Method, selection: &[usize]) -> Result<AssessedLayout, DesignError> {
        let candidates = self.pool.candidates(selection);
        self.assess_layout(
            method,
            candidates.into_iter().map(|candidate| self.pool.sensors[candidate]).collect(),
        )
    }

    fn assess_layout(
        &self,
        method: Method,
        sensors: Vec<PlacedSensor>,
    ) -> Result<AssessedLayout, DesignError> {
        let layout = self.layout(sensors)?;
        let assessment = self.assess(&layout)?;
        Ok(AssessedLayout { method, layout, assessment })
    }

    /// Builds a layout: kept sensors first, then by kind, left to right.
    fn layout(&self, mut placed: Vec<PlacedSensor>) -> Result<Layout, DesignError> {
        placed.sort_by(|a, b| {
            let by_offer = a.offer.cmp(&b.offer);
            let by_row = a.position.y_m.total_cmp(&b.position.y_m);
            by_offer.then(by_row).then(a.position.x_m.total_cmp(&b.position.x_m))
        });
        let mut sensors = self.take_fixed_sensors(&mut placed);
        for PlacedSensor { offer, position } in placed {
            let offer = &self.pool.design.offers[offer];
            let of_kind = sensors.iter().filter(|sensor| sensor.kind == offer.kind).count();
            let channel = ChannelModel { disabled: false, ..offer.channel };
            let mut names = (of_kind + 1..).map(|number| format!("{}_{number}", offer.kind));
            let is_free = |name: &String| sensors.iter().all(|sensor| sensor.name != *name);
            let name = names.find(is_free).unwrap_or_default();
            sensors.push(Sensor { kind: offer.kind, position, name, channel });
        }
        Ok(Layout::new(sensors)?)
    }

    /// Removes the kept sensors from `placed`, if all are placed.
    fn take_fixed_sensors(&self, placed: &mut Vec<PlacedSensor>) -> Vec<Sensor> {
        let design = &self.pool.design;
        let is_kept = |sensor: &PlacedSensor, wanted: &RequiredSensor| {
            let wanted = PlacedSensor { offer: wanted.offer, position: wanted.position };
            sensor.is_same(&wanted, self.pool.extent)
        };
        let kept = &design.must_have[..design.fixed.len()];
        if !kept.iter().all(|wanted| placed.iter().any(|sensor| is_kept(sensor, wanted))) {
            return Vec::new();
        }
        placed.retain(|sensor| !kept.iter().any(|wanted| is_kept(sensor, wanted)));
        design.fixed.clone()
    }

    /// Returns true for a kept sensor.
    pub fn is_kept(&self, sensor: &Sensor) -> bool {
        let kept = &self.pool.design.fixed;
        kept.iter().any(|kept| kept.kind == sensor.kind && kept.position == sensor.position)
    }

    /// Describes positions in words, new sensors apart from kept ones.
    pub fn places_in_words(&self, layout: &Layout) -> String {
        let words = |new: bool| {
            let sensors = layout.sensors().iter().filter(|sensor| self.is_kept(sensor) != new);
            let some = Layout::new(sensors.cloned().collect()).ok();
            some.map_or_else(String::new, |layout| layout.places_in_words(self.pool.extent))
        };
        if self.pool.design.fixed.is_empty() || !layout.sensors().iter().any(|sensor| self.is_kept(sensor)) {
            return layout.places_in_words(self.pool.extent);
        }
        match words(true).as_str() {
            "" => format!("kept {}", words(false)),
            new => format!("new {new}; kept {}", words(false)),
        }
    }

    /// Returns the existing layout if it is kept, else the even one.
    pub fn reference<'d>(&self, designed: &'d [AssessedLayout]) -> Option<&'d AssessedLayout> {
        let method = if self.pool.design.fixed.is_empty() { Method::Even } else { Method::Existing };
        designed.iter().find(|designed| designed.method == method)
    }
}

/// Even positions: i·l/(k+1), on a plane inner crossings of a grid.
fn even_positions(count: usize, extent: Extent) -> Vec<Position> {
    if let Extent::Line { .. } = extent {
        return sensing::even_positions(count, extent.length_m()).collect();
    }
    let (columns, rows) = squarest(extent, count);
    inner_grid(extent, columns, rows)
}
