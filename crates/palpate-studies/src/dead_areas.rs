//! Dead areas between sensors, as functions of the estimator (Brett and Li).
//!
//! Estimators are calibrated with several sensor counts, and on an [`ArraySensor`] with local responses.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use palpate_estimators::centroid::Centroid;
use palpate_estimators::estimator::{Estimator, contenders};
use palpate_estimators::evaluation::{EvaluatedContact, Evaluation, Split, SplitOrigin, evaluate_splits};
use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulateError;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{ChannelModel, Layout, Sensor, SensorKind};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_rig::{Rig, RigSimulationError};

/// Rig of the study.
pub const RIG_TOML: &str = include_str!("dead-areas.toml");
/// Sensor counts of the study.
pub const COUNTS: [usize; 4] = [2, 4, 8, 16];
/// Point spread that is equal at every count, m.
const FIXED_SPREAD_M: f64 = 0.01;
/// Limit of presentations of a network.
const MOST_PRESENTATIONS: usize = 2_000_000;

/// Settings of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct DeadAreas {
    /// Rig; the number of sensors is replaced.
    pub rig: Rig,
    /// Sensor counts.
    pub counts: Vec<usize>,
    /// Calibrations per count.
    pub calibrations: u64,
    /// Tolerance of the effective length, m.
    pub tolerance_m: f64,
    /// Kinds of excluded estimators.
    pub excluded: Vec<&'static str>,
    /// Seed of noise and fits.
    pub seed: u64,
}

/// Errors of one estimator at one sensor count.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeadAreaRow {
    /// "distributive", or the point spread in words.
    pub sensing: String,
    /// Kind of the estimator.
    pub estimator: &'static str,
    /// Sensors.
    pub sensors: usize,
    /// Share of the contacts within the tolerance, %.
    pub effective_percent: f64,
    /// Mean error, m.
    pub mean_error_m: f64,
    /// Errors folded over the gaps.
    pub folded: FoldedErrors,
}

/// Results of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeadAreaResults {
    /// Rows by estimator and count.
    pub rows: Vec<DeadAreaRow>,
    /// Failed fits: sensing, kind, count and reason.
    #[serde(rename = "left_out")]
    pub omitted: Vec<(String, &'static str, usize, String)>,
}

/// Error of the study.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DeadAreasError {
    /// Failed simulation.
    #[error(transparent)]
    Simulate(#[from] RigSimulationError),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl DeadAreas {
    /// Runs the study.
    ///
    /// # Errors
    /// [`DeadAreasError`] without model, force or training positions, or if cancelled.
    pub fn run(&self, watch: Watch) -> Result<DeadAreaResults, DeadAreasError> {
        let mut findings = DeadAreaResults { rows: Vec::new(), omitted: Vec::new() };
        for &count in &self.counts {
            let rig = self.with_sensors(count);
            let trials = rig.trials(self.calibrations, self.seed)?;
            for estimator in self.estimators(&rig) {
                self.evaluate("distributive", &rig, &estimator, &trials, &mut findings, watch)?;
            }
            for spread in [PointSpread::Metres(FIXED_SPREAD_M), PointSpread::Pitches(0.5)] {
                let array = ArraySensor::new(&rig, count, spread)?;
                let trials = array.trials(self.calibrations, self.seed);
                let estimator = Estimator::Centroid(Centroid);
                self.evaluate(&array.name(), array.rig(), &estimator, &trials, &mut findings, watch)?;
            }
        }
        Ok(findings)
    }

    /// Largest number of rounds that [`DeadAreas::run`] reports.
    pub fn most_rounds(&self) -> u64 {
        let rounds = |count: &usize| {
            let estimators = self.estimators(&self.with_sensors(*count));
            estimators.iter().map(Estimator::most_rounds).sum::<u64>()
        };
        self.calibrations * self.counts.iter().map(rounds).sum::<u64>()
    }

    fn with_sensors(&self, count: usize) -> Rig {
        let mut rig = self.rig.clone();
        let length_m = rig.setup.surface().extent().length_m();
        if let Some(Sensor { kind, channel, .. }) = rig.setup.layout().sensors().first().cloned() {
            let even = Layout::even(kind, count, length_m).into_sensors().into_iter();
            let even = even.map(|sensor| Sensor { channel, ..sensor }).collect();
            let placed = rig.setup.edit_sensors(|sensors| *sensors = even);
            placed.expect("the channel was checked, and they are along the surface");
        }
        rig
    }

    fn estimators(&self, rig: &Rig) -> Vec<Estimator> {
        let rows = rig.training.as_ref().map_or(1, |training| training.count * training.repeats);
        let mut estimators = contenders(&rig.setup, &rig.estimator, rows);
        estimators.retain(|estimator| !self.excluded.contains(&estimator.kind()));
        for estimator in &mut estimators {
            if let Estimator::Network(config) = estimator {
                let most = u32::try_from(MOST_PRESENTATIONS / rows.max(1)).unwrap_or(u32::MAX).max(1);
                config.training.max_epochs = config.training.max_epochs.min(most);
            }
        }
        estimators
    }

    fn evaluate(
        &self,
        sensing: &str,
        rig: &Rig,
        estimator: &Estimator,
        trials: &[Split],
        findings: &mut DeadAreaResults,
        watch: Watch,
    ) -> Result<(), Cancelled> {
        let sensors = rig.setup.layout().len();
        match evaluate_splits(&rig.setup, estimator, trials, self.seed, &|| 0.0, watch) {
            Ok(tried) => {
                let evaluation = &tried.evaluation;
                findings.rows.push(DeadAreaRow {
                    sensing: sensing.to_owned(),
                    estimator: estimator.kind(),
                    sensors,
                    effective_percent: evaluation.effective_percent(self.tolerance_m),
                    mean_error_m: evaluation.summary(None).map_or(f64::NAN, |summary| summary.average_m),
                    folded: FoldedErrors::new(evaluation, rig.setup.layout(), self.tolerance_m),
                });
            }
            Err(error) if Cancelled::caused(&error) => return Err(Cancelled),
            Err(error) => {
                findings.omitted.push((sensing.to_owned(), estimator.kind(), sensors, error.to_string()));
            }
        }
        Ok(())
    }
}

/// Standard deviation of a sensor's point spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointSpread {
    /// In metres.
    Metres(f64),
    /// In pitches of the array.
    Pitches(f64),
}

/// Line of n raw sensors at (i + ½)·l/n. Sensor i reads exp(−(a − x_i)²/(2·s²)) for a contact at a, plus
/// Gaussian noise; s is the point spread.
#[derive(Clone, Debug, PartialEq)]
pub struct ArraySensor {
    rig: Rig,
    spread: PointSpread,
    spread_m: f64,
    presses: Vec<Position>,
}

impl ArraySensor {
    /// Creates an array with the length, training positions, force and relative noise of a rig.
    ///
    /// # Errors
    /// [`RigSimulationError`] without model or training positions.
    pub fn new(rig: &Rig, count: usize, spread: PointSpread) -> Result<Self, RigSimulationError> {
        let model = rig.setup.surface().model().ok_or(SimulateError::NoModel)?;
        let force_n = rig.setup.force_n().ok_or(SimulateError::NoForce)?;
        let training = rig.training()?;
        let length_m = model.length_m();
        let share = |sensor: &Sensor| sensor.channel.noise_sd / (force_n * model.full_scale(sensor.kind));
        let noise_sd = rig.setup.layout().sensors().first().map_or(0.0, share);
        let pitch_m = length_m / count as f64;
        let sensor = |i: usize| Sensor {
            kind: SensorKind::Raw,
            position: Position::along((i as f64 + 0.5) * pitch_m),
            name: format!("raw_{}", i + 1),
            channel: ChannelModel { noise_sd, ..ChannelModel::default() },
        };
        let layout = Layout::new((0..count).map(sensor).collect()).map_err(SimulateError::from)?;
        let setup = Setup::new(model.extent().along_x()).with_layout(layout).map_err(SimulateError::from)?;
        let setup = setup.with_force(Some(force_n)).map_err(SimulateError::from)?;
        let spread_m = match spread {
            PointSpread::Metres(spread_m) => spread_m,
            PointSpread::Pitches(pitches) => pitches * pitch_m,
        };
        let positions = training.positions(setup.surface().extent()).map_err(SimulateError::from)?;
        let presses =
            positions.into_iter().flat_map(|at| std::iter::repeat_n(at, training.repeats)).collect();
        let rig = Rig { setup, loads: Vec::new(), ..rig.clone() };
        Ok(Self { rig, spread, spread_m, presses })
    }

    /// Rig with the training positions.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Name: "array, spread 10 mm" or "array, spread 0.5 pitch".
    pub fn name(&self) -> String {
        match self.spread {
            PointSpread::Metres(spread_m) => format!("array, spread {} mm", spread_m * 1e3),
            PointSpread::Pitches(pitches) => format!("array, spread {pitches} pitch"),
        }
    }

    /// Simulates calibrations with test presses at 399 positions, l/400 apart.
    pub fn trials(&self, count: u64, seed: u64) -> Vec<Split> {
        let length_m = self.rig.setup.surface().extent().length_m();
        let touches: Vec<Position> =
            (1..400).map(|i| Position::along(f64::from(i) / 400.0 * length_m)).collect();
        let trial = |k: u64| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_add(k));
            let training = self.recording(&self.presses, seed, &mut rng);
            let held_out = self.recording(&touches, seed, &mut rng);
            Split { training, held_out, offsets: None, origin: SplitOrigin::Calibration }
        };
        (0..count).map(trial).collect()
    }

    fn recording(&self, positions: &[Position], seed: u64, rng: &mut Xoshiro256PlusPlus) -> Recording {
        let layout = self.rig.setup.layout();
        let row = |position: &Position| {
            let reading = layout.sensors().iter().map(|sensor| {
                let off = position.distance_m(sensor.position) / self.spread_m;
                (-0.5 * off * off).exp() + sensor.channel.noise_sd * rng.sample::<f64, _>(StandardNormal)
            });
            Row {
                position: *position,
                force_n: self.rig.setup.force_n(),
                nuisances: Vec::new(),
                time_s: None,
                reading: reading.collect(),
            }
        };
        let rows = positions.iter().map(row).collect();
        Recording::new(layout, "simulation of an array sensor", rows).seeded(seed)
    }
}

/// Number of bins of half a gap.
pub const FOLDS: usize = 10;

/// Errors between the outermost sensors, folded over all gaps.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoldedErrors {
    /// Non-empty bins from a sensor to the middle of a gap.
    pub folds: Vec<Fold>,
    /// Mean error within 1/10 pitch from sensors, m.
    pub at_sensors_m: f64,
    /// Mean error within 1/10 pitch from middles of gaps, m.
    pub between_m: f64,
    /// Share of errors above the tolerance, %.
    pub dead_percent: f64,
}

/// Errors at one distance from the nearest sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fold {
    /// Distance in pitches, 0 to 0.5.
    pub pitches: f64,
    /// Mean error, m.
    pub mean_error_m: f64,
    /// Number of contacts.
    pub contacts: usize,
}

impl FoldedErrors {
    /// Folds errors over the gaps of a line.
    pub fn new(evaluation: &Evaluation, layout: &Layout, tolerance_m: f64) -> Self {
        let mut places: Vec<f64> = layout.sensors().iter().map(|sensor| sensor.position.x_m).collect();
        places.sort_by(f64::total_cmp);
        let folded: Vec<(f64, f64)> = evaluation
            .located
            .iter()
            .filter_map(|located| Some((pitches_off(&places, located)?, located.error_m())))
            .collect();
        let mean_within = |from: f64, to: f64| {
            let errors =
                folded.iter().filter(|(pitches, _)| (from..=to).contains(pitches)).map(|(_, error)| error);
            let (sum, count) = errors.fold((0.0, 0), |(sum, count), error| (sum + error, count + 1));
            (sum / f64::from(count), count as usize)
        };
        let width = 0.5 / FOLDS as f64;
        let fold = |i: usize| {
            let from = i as f64 * width;
            let (mean_error_m, contacts) = mean_within(from, from + width);
            (contacts > 0).then_some(Fold { pitches: from + 0.5 * width, mean_error_m, contacts })
        };
        let dead = folded.iter().filter(|(_, error_m)| *error_m > tolerance_m).count();
        Self {
            folds: (0..FOLDS).filter_map(fold).collect(),
            at_sensors_m: mean_within(0.0, 0.1).0,
            between_m: mean_within(0.4, 0.5).0,
            dead_percent: 100.0 * dead as f64 / folded.len() as f64,
        }
    }
}

fn pitches_off(places: &[f64], located: &EvaluatedContact) -> Option<f64> {
    let x_m = located.truth.x_m;
    let gap = places.windows(2).find(|gap| gap[0] <= x_m && x_m <= gap[1] && gap[0] < gap[1])?;
    Some((x_m - gap[0]).min(gap[1] - x_m) / (gap[1] - gap[0]))
}

#[cfg(test)]
mod tests;
