//! Assessment of layouts.

use std::ops::RangeInclusive;

use serde::Serialize;

use super::SensorProblem;
use super::candidates::{PlacedSensor, exclusion, mirrored};
use super::design::DesignError;
use super::design::Symmetry;
use super::objective::{Block, ForceBelief};
use super::sensitivity::{Sensitivity, SensorAt};
use crate::verification::Verification;
use palpate_estimators::arrangement::cells;
use palpate_estimators::estimator::{Estimator, FitError};
use palpate_estimators::evaluation::{Calibration, EvaluationError};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulateError;
use palpate_mechanics::limit::{Bound, CramerRaoBound, Force, LimitCurve};
use palpate_mechanics::sensing::{Layout, Sensor, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Watch;

/// Training of the verification: positions along a line and along a plane's sides, presses per position.
const TRAINING_ALONG_A_LINE: usize = 30;
const TRAINING_ALONG_A_PLANE: usize = 8;
const PRESSES: usize = 20;
/// Approximate number of readings per calibration.
const READINGS: usize = 4000;
/// Relative tolerance of a sufficient score.
const ENOUGH: f64 = 0.1;

/// Figures of merit, without contacts over a support if the force is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Assessment {
    /// Criterion, smaller is better: a limit in m, a share, or ½·ln det.
    pub score: f64,
    /// Mean limit, m; `None` for an undetermined contact.
    pub mean_limit_m: Option<f64>,
    /// Largest limit, m; `None` for an undetermined contact.
    pub worst_limit_m: Option<f64>,
    /// Mean absolute error at the limit, m; `None` for an undetermined contact.
    pub mean_error_m: Option<f64>,
    /// Share of the contacts with a limit within the tolerance, %.
    pub within_tolerance_percent: f64,
    /// Worst score with one sensor missing, if several.
    pub score_one_dead: Option<f64>,
    /// Cost of the sensors.
    pub cost: f64,
    /// True if the layout meets all constraints.
    pub keeps_constraints: bool,
}

impl SensorProblem<'_> {
    /// Assesses any layout on the surface.
    ///
    /// # Errors
    /// [`DesignError::Limit`] if a sensor has no noise or all sensors are disabled.
    pub fn assess(&self, layout: &Layout) -> Result<Assessment, DesignError> {
        let Sensitivity { surface, contacts, force_n, force } = &self.sensitivity;
        let weights = self.sensitivity.score_weights();
        let limit = CramerRaoBound::new(*surface, layout)?;
        let curve = LimitCurve::at_positions(&limit, *force_n, *force, &contacts.positions)?;
        let judged = curve.points.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0);
        let bounds: Option<Vec<(Bound, f64)>> =
            judged.map(|(point, weight)| Some((point.bound?, *weight))).collect();
        let good = |bound: Option<Bound>| {
            bound.is_some_and(|bound| bound.sd_position_m <= self.pool.design.tolerance_m)
        };
        let within = curve.points.iter().zip(&weights).filter(|(point, _)| good(point.bound));
        let within_tolerance_percent = 100.0 * within.map(|(_, weight)| weight).sum::<f64>();
        let (score, score_one_dead) = self.scores(layout);
        let limits = bounds.filter(|bounds| !bounds.is_empty()).map(|bounds| {
            let mean =
                |of: fn(&Bound) -> f64| bounds.iter().map(|(bound, weight)| weight * of(bound)).sum::<f64>();
            let worst = bounds.iter().map(|(bound, _)| bound.sd_position_m).fold(0.0, f64::max);
            (mean(|bound| bound.sd_position_m), worst, mean(Bound::mean_error_m))
        });
        Ok(Assessment {
            score,
            mean_limit_m: limits.map(|(mean, ..)| mean),
            worst_limit_m: limits.map(|(_, worst, _)| worst),
            mean_error_m: limits.map(|(.., error)| error),
            within_tolerance_percent,
            score_one_dead,
            cost: self.cost(layout),
            keeps_constraints: self.keeps_constraints(layout),
        })
    }

    fn scores(&self, layout: &Layout) -> (f64, Option<f64>) {
        let live = layout.sensors().iter().filter(|sensor| !sensor.channel.disabled);
        let rows = self.sensitivity.rows(&live.map(SensorAt::from).collect::<Vec<_>>());
        let value = |dead: Option<usize>| {
            let left: Vec<&[Block]> = rows
                .iter()
                .enumerate()
                .filter(|(i, _)| Some(*i) != dead)
                .map(|(_, row)| row.as_slice())
                .collect();
            self.objective.value(&self.objective.state(&left, ForceBelief::Vague))
        };
        let one_dead = (0..rows.len()).map(|dead| value(Some(dead))).reduce(f64::max);
        (value(None), one_dead.filter(|_| rows.len() > 1))
    }

    /// Cost by the offers; other kinds cost 0.
    fn cost(&self, layout: &Layout) -> f64 {
        layout
            .sensors()
            .iter()
            .filter_map(|sensor| self.offered(sensor))
            .map(|offer| self.pool.design.offers[offer].cost)
            .sum()
    }

    fn offered(&self, sensor: &Sensor) -> Option<usize> {
        self.pool.design.offers.iter().position(|offer| offer.kind == sensor.kind)
    }

    /// Checks the constraints; sites need not be candidates.
    fn keeps_constraints(&self, layout: &Layout) -> bool {
        let (design, extent) = (&self.pool.design, self.pool.extent);
        let placed: Option<Vec<PlacedSensor>> = layout
            .sensors()
            .iter()
            .map(|sensor| Some(PlacedSensor { offer: self.offered(sensor)?, position: sensor.position }))
            .collect();
        let Some(placed) = placed else { return false };
        let apart = placed.iter().enumerate().all(|(i, a)| {
            placed[..i].iter().all(|b| !a.is_same(b, extent) && exclusion(a, b, design, extent).is_none())
        });
        let free = placed.iter().all(|sensor| {
            design.offers[sensor.offer].kind == SensorKind::Reaction
                || !design.keeps_out(sensor.position, extent)
        });
        let complete = design.must_have.iter().all(|wanted| {
            let wanted = PlacedSensor { offer: wanted.offer, position: wanted.position };
            placed.iter().any(|sensor| sensor.is_same(&wanted, extent))
        });
        let symmetric = design.symmetry != Symmetry::Wanted
            || placed.iter().all(|sensor| {
                let position = mirrored(sensor.position, extent);
                placed.iter().any(|other| other.is_same(&PlacedSensor { position, ..*sensor }, extent))
            });
        let paid = design.affords(self.cost(layout));
        placed.len() == design.count && apart && free && complete && symmetric && paid
    }
}

impl SensorProblem<'_> {
    /// Calibrates at even positions, `calibrations` times with fresh noise, and locates the design's
    /// contacts.
    ///
    /// An `estimator` that does not invert influence functions is replaced by the surface's default.
    ///
    /// # Errors
    /// [`EvaluationError`] if a fit fails, or if cancelled.
    pub fn verify(
        &self,
        layout: &Layout,
        estimator: &Estimator,
        calibrations: usize,
        seed: u64,
        watch: Watch,
    ) -> Result<Verification, EvaluationError<FitError>> {
        let Sensitivity { contacts, force_n, force, .. } = &self.sensitivity;
        let known = (*force == Force::Known).then_some(*force_n);
        let setup = Setup::new(self.setup.surface().clone()).with_layout(layout.clone());
        let setup = setup.map_err(SimulateError::from)?.with_force(known).map_err(SimulateError::from)?;
        let guess = Estimator::contenders(&setup).into_iter().next();
        let estimator = match (estimator, &guess) {
            (Estimator::Influence(_), _) | (_, None) => estimator,
            (_, Some(guess)) => guess,
        };
        let extent = self.pool.extent;
        let side = match extent {
            Extent::Line { .. } => TRAINING_ALONG_A_LINE,
            Extent::Plane { .. } => TRAINING_ALONG_A_PLANE,
        };
        let calibration = Calibration::new(&setup, Some(*force_n))
            .map_err(SimulateError::from)?
            .with_presses(&cells(extent, side, side), PRESSES)
            .with_contacts(&contacts.positions, READINGS.div_ceil(contacts.len()));
        let mut judged = Vec::new();
        for k in 0..calibrations as u64 {
            watch.stage("verifying", k as f64 / calibrations as f64)?;
            judged.push(calibration.run(estimator, seed.wrapping_add(k), watch)?.evaluation);
        }
        Ok(Verification::from_calibrations(&judged, contacts, self.pool.design.tolerance_m))
    }

    /// Computes even and designed layouts for each number of sensors.
    ///
    /// # Errors
    /// [`DesignError`] for the largest number, or else for the first without a layout.
    pub fn counts(
        &self,
        range: RangeInclusive<usize>,
        seed: u64,
        watch: Watch,
    ) -> Result<Vec<CountPoint>, DesignError> {
        // A number without a layout fails here, before the long work.
        if !range.is_empty() {
            self.with_count(*range.end())?;
        }
        let point = |count| {
            let problem = self.with_count(count)?;
            let even = problem.even_if_any()?.map(|even| even.assessment);
            Ok(CountPoint { count, even, designed: problem.greedy_exchange(seed, watch)?.assessment })
        };
        range.map(point).collect()
    }
}

/// Layouts of one number of sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CountPoint {
    /// Number of sensors.
    pub count: usize,
    /// Even layout; `None` if there is none.
    pub even: Option<Assessment>,
    /// Layout by greedy choice and exchange.
    pub designed: Assessment,
}

/// Returns the least number of sensors with a score within 10 % of the last point's.
pub fn enough(points: &[CountPoint]) -> Option<usize> {
    let least = points.last()?.designed.score;
    let bound = least + ENOUGH * least.abs();
    points.iter().find(|point| point.designed.score <= bound).map(|point| point.count)
}
