//! Placement of training presses for an estimator.
//!
//! ```
//! use palpate_design::positions::{PositionDesign, PositionProblem, best_placed};
//! use palpate_estimators::setup::Setup;
//! use palpate_mechanics::sensing::SensorKind::Deflection;
//! use palpate_mechanics::surface::Beam;
//! use palpate_mechanics::units::{gpa, mm, newtons, um};
//! use palpate_numerics::watch::Watch;
//!
//! let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
//! let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
//! let design = PositionDesign { trials: 20, calibrations: 2, verifications: 4, ..PositionDesign::default() };
//! let problem = PositionProblem::new(&setup, &design.count(6).repeats(2))?;
//! let placed = problem.all(Watch::NONE)?;
//! let best = best_placed(&placed).expect("there are several arrangements");
//! assert_eq!(best.positions.len(), 6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Two optima, least posterior variance and least error after simulated calibrations, are compared with
//! rules. Verifications use fresh noise. [`next_press`] advises on an incomplete recording.

mod design;
mod forward;
mod next;
mod presses;
mod search;
mod variance;

pub use crate::verification::Verification;
pub use design::{Placement, PositionDesign, PositionError};
pub use next::{Advice, NextPress, next_press};

use crate::contacts::WeightedContacts;
use crate::verification::errors_by_contact;
use forward::ForwardModel;
use palpate_estimators::arrangement::{Arrangement, cells, chebyshev, squarest, warped_cells};
use palpate_estimators::estimator::Estimator;
use palpate_estimators::evaluation::{Calibration, Evaluation};
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::ChannelModel;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;
use palpate_numerics::watch::Watch;
use search::{PatternSearch, evaluate};

const SEARCHING: &str = "search by calibrations";
/// Approximate readings per calibration: in a search, in the verification.
const READINGS_IN_SEARCH: usize = 1000;
const READINGS: usize = 4000;
/// Middle positions of the edge-dense arrangement, as in the founding paper.
const IN_THE_MIDDLE: usize = 4;
/// Starts of the search: 0 even, 1 Chebyshev, larger denser towards the ends.
const DENSITIES: [f64; 4] = [0.4, 0.8, 1.2, 1.6];
const SEARCH_SEEDS: u64 = 1 << 32;

/// Training positions and their verification.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifiedPositions {
    /// Rule or search of the positions.
    pub placement: Placement,
    /// Training positions; on a line from left to right.
    pub positions: Vec<Position>,
    /// Result of calibrations with fresh noise.
    pub verification: Verification,
    /// Mean error at each contact, m.
    pub errors_m: Vec<f64>,
}

/// Returns the first arrangement within two standard errors of the least mean error.
pub fn best_placed(placed: &[VerifiedPositions]) -> Option<&VerifiedPositions> {
    let error = |placed: &VerifiedPositions| placed.verification.mean_error_m;
    let least = placed.iter().min_by(|a, b| error(a).total_cmp(&error(b)))?;
    let as_good = |one: &&VerifiedPositions| {
        let apart = one.verification.standard_error_m.hypot(least.verification.standard_error_m);
        error(one) - error(least) <= 2.0 * apart
    };
    placed.iter().find(as_good)
}

/// Checked setup and design task of training positions.
pub struct PositionProblem {
    design: PositionDesign,
    training_setup: Setup,
    /// Simulated calibration without training positions.
    calibration: Calibration,
    extent: Extent,
    force: Force,
    contacts: WeightedContacts,
}

impl PositionProblem {
    /// Checks simulation and estimator.
    ///
    /// # Errors
    /// [`PositionError`] with the missing item.
    pub fn new(setup: &Setup, design: &PositionDesign) -> Result<Self, PositionError> {
        if setup.surface().model().is_none() {
            return Err(PositionError::NoModel);
        }
        design.check()?;
        let press_force_n = design.existing.as_ref().and_then(|training| training.force_n);
        let pressed = setup.clone().with_force(press_force_n.or(setup.force_n()))?;
        if pressed.force_n().is_none() {
            return Err(PositionError::NoForce);
        }
        if matches!(design.estimator, Estimator::Auto(_)) {
            return Err(PositionError::Auto);
        }
        let (count, needed) = (design.count, design.estimator.positions_needed());
        if count < needed {
            return Err(PositionError::TooFew { count, needed, kind: design.estimator.kind() });
        }
        let extent = setup.surface().extent();
        let contacts = design.weighted_contacts(extent)?;
        let calibration = Calibration::new(setup, press_force_n)?;
        let (force, calibration) = match design.force {
            Force::Known if setup.force_n().is_some() => (Force::Known, calibration),
            _ => (Force::Unknown, calibration.unknown_force()),
        };
        Ok(Self { design: design.clone(), training_setup: pressed, calibration, extent, force, contacts })
    }

    /// Design task.
    pub fn design(&self) -> &PositionDesign {
        &self.design
    }

    /// Contacts to locate.
    pub fn contacts(&self) -> &WeightedContacts {
        &self.contacts
    }

    /// Known if both the design and the setup give the force.
    pub fn force(&self) -> Force {
        self.force
    }

    /// Extent of the surface.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Computes and verifies all arrangements.
    ///
    /// # Errors
    /// [`PositionError`] if a fit fails, or if cancelled.
    pub fn all(&self, watch: Watch) -> Result<Vec<VerifiedPositions>, PositionError> {
        let mut arrangements = self.by_rule()?;
        arrangements.push((Placement::VarianceOptimal, self.variance_optimal(watch)?));
        let by_rule = arrangements.iter().map(|(_, positions)| positions.clone());
        let starts: Vec<_> = by_rule.chain(self.densities()).collect();
        arrangements.push((Placement::Optimal, self.search(&starts, watch)?));
        let of = arrangements.len() as f64;
        let verified = arrangements.into_iter().enumerate().map(|(done, (placement, positions))| {
            watch.stage("verifying", done as f64 / of)?;
            self.verified(placement, positions, watch)
        });
        verified.collect()
    }

    fn by_rule(&self) -> Result<Vec<(Placement, Vec<Position>)>, PositionError> {
        let (extent, count) = (self.extent, self.design.count);
        let (columns, rows) = squarest(extent, count);
        let even = cells(extent, columns, rows);
        let mut arrangements = Vec::new();
        if let Some(training) = self.design.existing.as_ref().filter(|training| training.count == count) {
            let existing = training.positions(extent)?;
            if existing != even {
                arrangements.push((Placement::Existing, existing));
            }
        }
        arrangements.insert(0, (Placement::Even, even));
        if matches!(extent, Extent::Line { .. }) && count > IN_THE_MIDDLE && count.is_multiple_of(2) {
            let dense = Arrangement::EdgeDense { middle: IN_THE_MIDDLE, portion: Arrangement::PAPER_PORTION };
            arrangements.push((Placement::EdgeDense, dense.positions(count, extent)?));
        }
        arrangements.push((Placement::Chebyshev, warped_cells(extent, columns, rows, chebyshev)));
        Ok(arrangements)
    }

    fn densities(&self) -> impl Iterator<Item = Vec<Position>> {
        let (extent, (columns, rows)) = (self.extent, squarest(self.extent, self.design.count));
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
        watch.stage("least variance", f64::NAN)?;
        let forward = ForwardModel::from_mechanics(&self.training_setup, self.force, watch)?;
        Ok(variance::least(&forward, &self.contacts, self.extent, &self.design, watch)?)
    }

    fn search(&self, starts: &[Vec<Position>], watch: Watch) -> Result<Vec<Position>, PositionError> {
        let (design, first) = (&self.design, self.design.seed.wrapping_add(SEARCH_SEEDS));
        let score = |positions: &[Position], share: f64| -> Result<f64, PositionError> {
            watch.stage(SEARCHING, share)?;
            let judged =
                self.calibrate(positions, READINGS_IN_SEARCH, (first, design.calibrations), watch)?;
            Ok(Verification::from_calibrations(&judged, &self.contacts, design.tolerance_m).mean_error_m)
        };
        let scores = evaluate(&score, starts, 0.0)?;
        let best = (0..starts.len()).min_by(|a, b| scores[*a].total_cmp(&scores[*b])).unwrap_or(0);
        let search = PatternSearch {
            extent: self.extent,
            mirrored: self.is_mirrored(),
            most_trials: design.trials.saturating_sub(starts.len()),
        };
        search.run(&score, starts[best].clone(), scores[best])
    }

    fn is_mirrored(&self) -> bool {
        let setup = &self.training_setup;
        let (Some(surface), Some(force_n)) = (setup.surface().model(), setup.force_n()) else { return false };
        matches!(self.extent, Extent::Line { .. })
            && search::is_mirror_symmetric(surface, setup.layout(), force_n)
    }

    fn verified(
        &self,
        placement: Placement,
        positions: Vec<Position>,
        watch: Watch,
    ) -> Result<VerifiedPositions, PositionError> {
        let seeds = (self.design.seed, self.design.verifications);
        let judged = self.calibrate(&positions, READINGS, seeds, watch)?;
        let errors: Vec<Vec<f64>> = judged.iter().map(|one| errors_by_contact(one, &self.contacts)).collect();
        let mean_error_m = |contact: usize| mean(errors.iter().map(|errors_m| errors_m[contact]));
        Ok(VerifiedPositions {
            placement,
            positions,
            verification: Verification::from_calibrations(&judged, &self.contacts, self.design.tolerance_m),
            errors_m: (0..self.contacts.len()).map(mean_error_m).collect(),
        })
    }

    /// Simulates one calibration per seed; a seed gives equal noise at any positions.
    fn calibrate(
        &self,
        positions: &[Position],
        readings: usize,
        (first, count): (u64, usize),
        watch: Watch,
    ) -> Result<Vec<Evaluation>, PositionError> {
        let channels = self.training_setup.layout().sensors().iter().map(|sensor| sensor.channel);
        let faultless = channels.into_iter().all(|channel| channel == ChannelModel::default());
        let readings = if faultless { 1 } else { readings.div_ceil(self.contacts.len()) };
        let calibration = self.calibration.clone().with_presses(positions, self.design.repeats);
        let seeds = (0..count as u64).map(|k| first.wrapping_add(k));
        let calibrated = calibration.with_contacts(&self.contacts.positions, readings).run_many(
            &self.design.estimator,
            seeds,
            watch,
        )?;
        Ok(calibrated.into_iter().map(|one| one.evaluation).collect())
    }
}

#[cfg(test)]
mod tests;
