//! Where to press: training positions for an estimator and a budget of presses.
//!
//! Rules (even, edge-dense, Chebyshev's nodes) stand beside two optima: positions that leave the least variance of
//! influence functions learnt as Gaussian processes, and positions that give the least error after simulated calibrations of
//! the estimator itself. All are judged alike, by calibrations with noise that no search has seen. With a recording begun,
//! [`next_press`] says where to press next, and when to stop.

mod error;
mod forward;
mod knowledge;
mod next;
mod search;
mod variance;

pub use super::calibration::{CalibrationError, Verification};
pub use error::PositionError;
pub use next::{Advice, NextPress, next_press};

use crate::calibration::{Seeds, Trial};
use crate::sensors::ContactPrior;
use crate::sensors::{SensorDesign, WeightedContacts};
use forward::Forward;
use palpate_estimators::arrangement::{Arrangement, Training, cells, chebyshev, squarest, warped_cells};
use palpate_estimators::estimator::EstimatorConfig;
use palpate_estimators::setup::Bench;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::ChannelModel;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;
use palpate_numerics::watch::Watch;
use search::{PatternSearch, evaluate};

/// Readings that a calibration is judged by, about: while searching, and when verifying.
const READINGS_IN_SEARCH: usize = 1000;
const READINGS: usize = 4000;
/// Positions in the middle portion of the edge-dense arrangement, the founding paper's better choice.
const IN_THE_MIDDLE: usize = 4;
/// Steps from even positions to Chebyshev's and beyond that searches start from.
const DENSITIES: [f64; 4] = [0.4, 0.8, 1.2, 1.6];
/// The seeds of searches lie so far from those that verify.
const SEARCH_SEEDS: u64 = 1 << 32;

/// What a design of training positions is busy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// How smooth the influence functions are, and the positions that leave the least variance.
    Variance,
    /// Simulated calibrations of positions that are moved about.
    Search,
    /// Calibrations with noise that the search has not seen.
    Verification,
}

impl Stage {
    /// As people are told of it.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Variance => "least variance",
            Self::Search => "calibrating in search",
            Self::Verification => "verifying",
        }
    }
}

/// How training positions came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Placement {
    /// As the rig has them.
    Rig,
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
            Self::Rig => "rig",
            Self::Even => "even",
            Self::EdgeDense => "edge-dense",
            Self::Chebyshev => "chebyshev",
            Self::VarianceOptimal => "variance-optimal",
            Self::Optimal => "optimal",
        }
    }
}

/// Training positions and what they are worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// How they came about.
    pub placement: Placement,
    /// Where to press; on a line from left to right.
    pub positions: Vec<Position>,
    /// What calibrations with fresh noise give.
    pub verification: Verification,
    /// Their mean error at each contact, in metres.
    pub errors_m: Vec<f64>,
}

/// How much may be pressed, and how long is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Training positions; at least 1.
    pub count: usize,
    /// Presses at each; at least 1.
    pub repeats: usize,
    /// Simulated calibrations that an arrangement is judged by while searching; at least 1.
    pub calibrations: usize,
    /// Arrangements that the search may try.
    pub trials: usize,
    /// Calibrations with fresh noise that verify each arrangement; at least 1.
    pub verifications: usize,
    /// Fixes all noise and every network's first weights.
    pub seed: u64,
}

/// A bench whose training positions are designed.
pub struct PositionProblem<'a> {
    bench: &'a Bench,
    training: Option<&'a Training>,
    estimator: &'a EstimatorConfig,
    budget: Budget,
    extent: Extent,
    force: Force,
    contacts: WeightedContacts,
    tolerance_m: f64,
}

impl<'a> PositionProblem<'a> {
    /// Checks that the bench can be simulated and the estimator fitted with so many presses. `training` tells the force of
    /// the presses, and the positions that are compared with where their number is the budget's; `design` tells which contacts
    /// matter, and what the locator will know of their force.
    ///
    /// # Errors
    /// [`PositionError`], with what is missing.
    pub fn new(
        bench: &'a Bench,
        training: Option<&'a Training>,
        estimator: &'a EstimatorConfig,
        design: Option<&SensorDesign>,
        budget: Budget,
    ) -> Result<Self, PositionError> {
        if bench.surface.model().is_none() {
            return Err(PositionError::NoModel);
        }
        if pressed(bench, training).force_n.is_none() {
            return Err(PositionError::NoForce);
        }
        if *estimator == EstimatorConfig::Auto {
            return Err(PositionError::Auto);
        }
        let needed = estimator.positions_needed();
        if budget.count < needed {
            return Err(PositionError::TooFew { count: budget.count, needed, kind: estimator.kind() });
        }
        let extent = bench.surface.extent();
        let prior = design.map(|design| design.contacts.clone());
        let contacts = WeightedContacts::of(&prior.unwrap_or_else(|| ContactPrior::all_over(extent)), extent);
        let tolerance_m = design.map_or(Self::TOLERANCE_M, |design| design.tolerance_m);
        let known =
            design.and_then(|design| design.force_is_known).unwrap_or(true) && bench.force_n.is_some();
        let force = if known { Force::Known } else { Force::Unknown };
        Ok(Self { bench, training, estimator, budget, extent, force, contacts, tolerance_m })
    }

    /// An error up to this is good enough unless the design says otherwise.
    const TOLERANCE_M: f64 = 2e-3;

    /// The contacts that are located after calibrating.
    pub fn contacts(&self) -> &WeightedContacts {
        &self.contacts
    }

    /// What the locator knows of their force: as the design says, or else the bench.
    pub fn force(&self) -> Force {
        self.force
    }

    /// An error up to this is good enough, in metres.
    pub fn tolerance_m(&self) -> f64 {
        self.tolerance_m
    }

    /// What may be pressed.
    pub fn budget(&self) -> Budget {
        self.budget
    }

    /// Whether contacts have two coordinates.
    pub fn is_plane(&self) -> bool {
        self.extent.is_plane()
    }

    /// Every arrangement, by rule and by search, each verified.
    ///
    /// # Errors
    /// [`PositionError`] when the estimator cannot be fitted to such presses.
    pub fn all(&self, watch: Watch) -> Result<Vec<Placed>, PositionError> {
        let mut arrangements = self.by_rule()?;
        arrangements.push((Placement::VarianceOptimal, self.variance_optimal(watch)?));
        let by_rule = arrangements.iter().map(|(_, positions)| positions.clone());
        let starts: Vec<_> = by_rule.chain(self.densities()).collect();
        arrangements.push((Placement::Optimal, self.search(&starts, watch)?));
        let of = arrangements.len() as f64;
        let mut placed = Vec::new();
        for (done, (placement, positions)) in arrangements.into_iter().enumerate() {
            placed.push(self.verified(placement, positions, done as f64 / of, watch)?);
        }
        Ok(placed)
    }

    /// The arrangements that rules give, the even one first.
    fn by_rule(&self) -> Result<Vec<(Placement, Vec<Position>)>, PositionError> {
        let (extent, count) = (self.extent, self.budget.count);
        let (columns, rows) = squarest(extent, count);
        let even = cells(extent, columns, rows);
        let mut arrangements = Vec::new();
        if let Some(training) = self.training.filter(|training| training.count == count) {
            let own = training.positions(extent)?;
            if own != even {
                arrangements.push((Placement::Rig, own));
            }
        }
        arrangements.insert(0, (Placement::Even, even));
        if !extent.is_plane() && count > IN_THE_MIDDLE && count.is_multiple_of(2) {
            let dense = Arrangement::EdgeDense { middle: IN_THE_MIDDLE, portion: Arrangement::PAPER_PORTION };
            arrangements.push((Placement::EdgeDense, dense.positions(count, extent)?));
        }
        arrangements.push((Placement::Chebyshev, warped_cells(extent, columns, rows, chebyshev)));
        Ok(arrangements)
    }

    /// Between even positions and Chebyshev's, and denser yet towards the ends.
    fn densities(&self) -> impl Iterator<Item = Vec<Position>> {
        let (extent, (columns, rows)) = (self.extent, squarest(self.extent, self.budget.count));
        DENSITIES.into_iter().map(move |density| {
            warped_cells(extent, columns, rows, |share| {
                let once = chebyshev(share);
                if density <= 1.0 {
                    share + density * (once - share)
                } else {
                    once + (density - 1.0) * (chebyshev(once) - once)
                }
            })
        })
    }

    fn variance_optimal(&self, watch: Watch) -> Result<Vec<Position>, PositionError> {
        watch.stage(Stage::Variance.in_words(), f64::NAN)?;
        let forward = Forward::of_model(&self.pressed(), self.force, watch)?;
        Ok(variance::least(&forward, &self.contacts, self.extent, &self.budget, watch)?)
    }

    /// The best of some arrangements by simulated calibrations, and then with its positions moved about.
    fn search(&self, starts: &[Vec<Position>], watch: Watch) -> Result<Vec<Position>, PositionError> {
        let trial = self.trial(READINGS_IN_SEARCH);
        let seeds =
            Seeds { first: self.budget.seed.wrapping_add(SEARCH_SEEDS), count: self.budget.calibrations };
        let score = |positions: &[Position], share: f64| -> Result<f64, PositionError> {
            watch.stage(Stage::Search.in_words(), share)?;
            let calibrated = trial.calibrate(positions, self.budget.repeats, seeds, watch)?;
            Ok(Verification::of(&calibrated, &self.contacts).mean_error_m)
        };
        let scores = evaluate(&score, starts, 0.0)?;
        let best = (0..starts.len()).min_by(|a, b| scores[*a].total_cmp(&scores[*b])).unwrap_or(0);
        let search = PatternSearch {
            extent: self.extent,
            mirrored: self.is_mirrored(),
            most_trials: self.budget.trials.saturating_sub(starts.len()),
        };
        search.run(&score, starts[best].clone(), scores[best])
    }

    /// Whether the bench reads the same, sensors in reverse, when the contact is mirrored.
    fn is_mirrored(&self) -> bool {
        let bench = self.pressed();
        let (Some(surface), Some(force_n)) = (bench.surface.model(), bench.force_n) else { return false };
        !self.extent.is_plane() && search::reads_mirrored(surface, &bench.layout, force_n)
    }

    /// What calibrations with fresh noise give.
    fn verified(
        &self,
        placement: Placement,
        positions: Vec<Position>,
        share: f64,
        watch: Watch,
    ) -> Result<Placed, PositionError> {
        let trial = self.trial(READINGS);
        let seeds = Seeds { first: self.budget.seed, count: self.budget.verifications };
        watch.stage(Stage::Verification.in_words(), share)?;
        let all = trial.calibrate(&positions, self.budget.repeats, seeds, watch)?;
        let mean_error_m = |contact: usize| mean(all.iter().map(|one| one.errors_m[contact]));
        Ok(Placed {
            placement,
            positions,
            verification: Verification::of(&all, &self.contacts),
            errors_m: (0..self.contacts.len()).map(mean_error_m).collect(),
        })
    }

    /// The bench with the force of the presses.
    fn pressed(&self) -> Bench {
        pressed(self.bench, self.training)
    }

    fn trial(&self, readings: usize) -> Trial<'_> {
        let pressed = self.pressed();
        let touched = Bench { force_n: self.bench.force_n.or(pressed.force_n), ..pressed.clone() };
        let clean = pressed.layout.sensors.iter().all(|sensor| sensor.channel == ChannelModel::default());
        let draws = if clean { 1 } else { readings.div_ceil(self.contacts.len()) };
        let known_n = self.bench.force_n.filter(|_| self.force() == Force::Known);
        Trial {
            pressed,
            touched,
            used: Bench { force_n: known_n, ..self.bench.clone() },
            estimator: self.estimator,
            contacts: &self.contacts,
            draws,
            tolerance_m: self.tolerance_m,
        }
    }
}

fn pressed(bench: &Bench, training: Option<&Training>) -> Bench {
    training.map_or_else(|| bench.clone(), |training| bench.pressed_by(training))
}

/// The arrangement with the least mean error; of those that are as good within twice the standard error, the first, so that
/// noise decides nothing.
pub fn best_placed(placed: &[Placed]) -> Option<&Placed> {
    let error = |placed: &Placed| placed.verification.mean_error_m;
    let least = placed.iter().min_by(|a, b| error(a).total_cmp(&error(b)))?;
    let as_good = |one: &&Placed| {
        let apart = one.verification.standard_error_m.hypot(least.verification.standard_error_m);
        error(one) - error(least) <= 2.0 * apart
    };
    placed.iter().find(as_good)
}

#[cfg(test)]
mod tests;
