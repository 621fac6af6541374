//! Dead areas: is the surface between sensors located as well as the surface over them?
//!
//! After Brett and Li: whether there are dead areas depends on how readings are interpreted, not on how many sensors there are.
//! Every estimator is calibrated on the same bench with 2, 4, 8, … sensors, and beside them an [`ArraySensor`], whose sensors
//! each respond to contacts near them only. Errors are then folded over all gaps between sensors.

mod array_sensor;
mod folded;

pub use array_sensor::{ArraySensor, Spread};
pub use folded::{FOLDS, Fold, FoldedErrors};

use serde::Serialize;

use palpate_estimators::centroid::Centroid;
use palpate_estimators::estimator::Estimator;
use palpate_estimators::estimator::contenders;
use palpate_estimators::evaluation::{Split, evaluate_splits};
use palpate_mechanics::sensing::{Layout, Sensor};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_rig::{Rig, RigSimulationError};

/// The bench of the study, as a rig.
pub const RIG_TOML: &str = include_str!("../../../../examples/dead-areas.toml");
/// Sensor counts of the study.
pub const COUNTS: [usize; 4] = [2, 4, 8, 16];
/// Standard deviation of the array sensor's point spread where it is the same at every count, in metres.
const FIXED_SPREAD_M: f64 = 0.01;
/// Presentations after which a network trained by back-propagation stops.
const MOST_PRESENTATIONS: usize = 2_000_000;

/// What the study is to do.
#[derive(Clone, Debug, PartialEq)]
pub struct DeadAreas {
    /// Beam, noise, force and training positions; its sensors' kind and noise, not their count.
    pub rig: Rig,
    /// Sensor counts.
    pub counts: Vec<usize>,
    /// Calibrations at each count, each with noise of its own.
    pub calibrations: u64,
    /// An error up to this, in metres, is good enough for the effective length.
    pub tolerance_m: f64,
    /// Kinds of estimators that are left out.
    pub without: Vec<&'static str>,
    /// Seed of noise and fits.
    pub seed: u64,
}

/// How one estimator did at one sensor count.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeadAreaRow {
    /// "distributive", or what the array sensor's point spread is.
    pub sensing: String,
    /// The estimator's kind.
    pub estimator: &'static str,
    /// Sensors.
    pub sensors: usize,
    /// Share of the contacts located within the tolerance, in %.
    pub effective_percent: f64,
    /// Mean error in metres.
    pub mean_error_m: f64,
    /// Errors folded over the gaps between sensors.
    pub folded: FoldedErrors,
}

/// What the study found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeadAreaFindings {
    /// A row an estimator and count.
    pub rows: Vec<DeadAreaRow>,
    /// Estimators that could not be fitted: sensing, kind, count and why.
    pub left_out: Vec<(String, &'static str, usize, String)>,
}

/// Why a study of dead areas does not come to its end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DeadAreasError {
    /// The rig cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] RigSimulationError),
    /// It was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl DeadAreas {
    /// Runs the study.
    ///
    /// # Errors
    /// [`DeadAreasError`] for a rig without a model, a force or training positions, or when `watch` stopped it.
    pub fn run(&self, watch: Watch) -> Result<DeadAreaFindings, DeadAreasError> {
        let mut findings = DeadAreaFindings { rows: Vec::new(), left_out: Vec::new() };
        for &count in &self.counts {
            let rig = self.with_sensors(count);
            let trials = rig.trials(self.calibrations, self.seed)?;
            for estimator in self.estimators(&rig) {
                self.judge("distributive", &rig, &estimator, &trials, &mut findings, watch)?;
            }
            for spread in [Spread::Metres(FIXED_SPREAD_M), Spread::Pitches(0.5)] {
                let array = ArraySensor::like(&rig, count, spread)?;
                let trials = array.trials(self.calibrations, self.seed);
                let estimator = Estimator::Centroid(Centroid);
                self.judge(&array.name(), array.rig(), &estimator, &trials, &mut findings, watch)?;
            }
        }
        Ok(findings)
    }

    /// The most often that [`DeadAreas::run`] asks whether to go on while it fits.
    pub fn most_rounds(&self) -> u64 {
        let rounds = |count: &usize| {
            let estimators = self.estimators(&self.with_sensors(*count));
            estimators.iter().map(Estimator::most_rounds).sum::<u64>()
        };
        self.calibrations * self.counts.iter().map(rounds).sum::<u64>()
    }

    /// The rig with so many sensors of its first kind, evenly placed.
    fn with_sensors(&self, count: usize) -> Rig {
        let mut rig = self.rig.clone();
        let length_m = rig.setup.surface.extent().length_m();
        if let Some(Sensor { kind, channel, .. }) = rig.setup.layout.sensors().first().cloned() {
            let mut layout = Layout::even(kind, count, length_m);
            // A channel of the rig, which was checked.
            if layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel = channel)).is_ok() {
                rig.setup.layout = layout;
            }
        }
        rig
    }

    fn estimators(&self, rig: &Rig) -> Vec<Estimator> {
        let rows = rig.training.as_ref().map_or(1, |training| training.count * training.repeats);
        let mut estimators = contenders(&rig.setup, &rig.estimator, rows);
        estimators.retain(|estimator| !self.without.contains(&estimator.kind()));
        for estimator in &mut estimators {
            if let Estimator::Network(config) = estimator {
                let most = u32::try_from(MOST_PRESENTATIONS / rows.max(1)).unwrap_or(u32::MAX).max(1);
                config.training.max_epochs = config.training.max_epochs.min(most);
            }
        }
        estimators
    }

    /// Adds an estimator's row.
    fn judge(
        &self,
        sensing: &str,
        rig: &Rig,
        estimator: &Estimator,
        trials: &[Split],
        findings: &mut DeadAreaFindings,
        watch: Watch,
    ) -> Result<(), Cancelled> {
        let sensors = rig.setup.layout.len();
        match evaluate_splits(&rig.setup, estimator, trials, self.seed, &|| 0.0, watch) {
            Ok(tried) => {
                let evaluation = &tried.evaluation;
                findings.rows.push(DeadAreaRow {
                    sensing: sensing.to_owned(),
                    estimator: estimator.kind(),
                    sensors,
                    effective_percent: evaluation.effective_percent(self.tolerance_m),
                    mean_error_m: evaluation.summary(None).map_or(f64::NAN, |summary| summary.average_m),
                    folded: FoldedErrors::of(evaluation, &rig.setup.layout, self.tolerance_m),
                });
            }
            Err(error) if Cancelled::caused(&error) => return Err(Cancelled),
            Err(error) => {
                findings.left_out.push((sensing.to_owned(), estimator.kind(), sensors, error.to_string()));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
