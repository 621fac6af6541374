//! Elliott's chain for a load on a plate: a sensor grid, Karhunen–Loève reduction, and a back-propagation
//! network.
//!
//! References are the influence locator, its tracker and the limit.

mod karhunen_loeve;

pub use karhunen_loeve::KarhunenLoeve;

use karhunen_loeve::{raw_layout, without_model};
use serde::Serialize;

use palpate_estimators::estimator::{Estimator, FitError, Locator, ReadingError, Track, TrackerConfig};
use palpate_estimators::evaluation::{Evaluation, Quantiles, Split};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::network::{InputScale, Network};
use palpate_estimators::recording::TimedRecording;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulateError;
use palpate_estimators::track_errors::{TrackErrors, TrackingError, track_recording};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Bound;
use palpate_mechanics::sensing::NoiseError;
use palpate_mechanics::surface::{Extent, ResponseGradient};
use palpate_numerics::watch::Watch;
use palpate_rig::{Rig, RigSimulationError};

/// Rig of the study.
pub const RIG_TOML: &str = include_str!("elliott.toml");
/// Numbers of components of the study.
pub const COMPONENTS: [usize; 9] = [2, 3, 4, 5, 6, 8, 10, 15, 25];
/// Limit of presentations; noise prevents an error of 0.
pub const PRESENTATIONS: u32 = 3_000_000;
const HIDDEN: usize = 12;
/// Noisy readings need a smaller rate than the founding paper's.
const LEARNING_RATE: f64 = 0.1;
/// Seed offset of the moving load, for independent noise.
const OTHER_NOISE: u64 = 1 << 32;
/// Inner share of the plate in the evaluation.
pub const INNER: f64 = 0.9;

/// Settings of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct Elliott {
    /// Rig with a plate, a known force and a motion; sensors have only noise.
    pub rig: Rig,
    /// Numbers of components; at most the number of sensors.
    pub components: Vec<usize>,
    /// Limit of presentations of a network.
    pub presentations: u32,
    /// Calibrations, each with fresh noise and networks; at least 1.
    pub calibrations: u64,
    /// Tolerance of the effective area, m.
    pub tolerance_m: f64,
    /// Seed of noise and networks.
    pub seed: u64,
}

/// Method of location.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Chain {
    /// Network on this number of components.
    Components(usize),
    /// Network on the readings.
    Readings,
    /// Influence locator, reading by reading.
    Influence,
    /// Tracker on the readings up to each time.
    Filter,
    /// Smoother on all readings.
    Smoother,
}

impl std::fmt::Display for Chain {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Chain::Components(count) => return write!(out, "network on {count} components"),
            Chain::Readings => "network on all readings",
            Chain::Influence => "influence locator",
            Chain::Filter => "influence locator, filter",
            Chain::Smoother => "influence locator, smoother",
        })
    }
}

/// Errors of one chain over the calibrations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChainRow {
    /// Chain.
    pub chain: Chain,
    /// Mean error of inner presses, m; `None` for trackers.
    pub error_m: Option<Quantiles>,
    /// Share of these within the tolerance, %.
    pub effective_percent: Option<Quantiles>,
    /// Mean error of the moving load, m.
    pub moving_error_m: Quantiles,
    /// Mean Cramér–Rao bound of these, m; `None` for trackers or undetermined positions.
    pub limit_m: Option<f64>,
}

/// Results of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ElliottResults {
    /// Variance shares in the first calibration, %.
    pub variance_percent: Vec<f64>,
    /// Rows by chain.
    pub rows: Vec<ChainRow>,
}

/// Error of the study.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ElliottError {
    /// Failed simulation.
    #[error(transparent)]
    Simulate(#[from] RigSimulationError),
    /// Failed fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Reading that does not suit a locator.
    #[error(transparent)]
    Reading(#[from] ReadingError),
    /// Failed tracking.
    #[error(transparent)]
    Follow(#[from] TrackingError),
    /// Singular noise.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// Number of components out of range.
    #[error(
        "{components} components are requested of {sensors} sensors; expected 1 to the number of sensors"
    )]
    Components {
        /// Number of components.
        components: usize,
        /// Sensors.
        sensors: usize,
    },
    /// No calibrations.
    #[error("0 calibrations are requested; expected at least 1")]
    NoCalibration,
    /// Undetected load.
    #[error("the tracker never found the moving load")]
    NothingTracked,
}

#[derive(Clone, Copy, Debug)]
struct ChainErrors {
    /// Mean error (m) and effective area (%).
    pressed: Option<(f64, f64)>,
    moving_error_m: f64,
}

impl Elliott {
    /// Runs the study.
    ///
    /// # Errors
    /// [`ElliottError`] without model, known force, training positions or motion, and for a number of
    /// components out of range.
    pub fn run(&self, watch: Watch) -> Result<ElliottResults, ElliottError> {
        let sensors = self.rig.setup.layout().len();
        if let Some(&components) = self.components.iter().find(|count| !(1..=sensors).contains(*count)) {
            return Err(ElliottError::Components { components, sensors });
        }
        let noise_sd: Vec<f64> = self.rig.setup.layout().reading_sds()?.into_iter().flatten().collect();
        let trials = self.rig.trials(self.calibrations, self.seed)?;
        let mut judged = vec![Vec::new(); self.chains().len()];
        let mut reductions = Vec::new();
        for (seed, trial) in (self.seed..).zip(&trials) {
            let moving = self.rig.simulate_moving(seed.wrapping_add(OTHER_NOISE))?;
            let reduction = KarhunenLoeve::new(&trial.training, &noise_sd);
            let setup = TrialSetup { trial, moving: &moving, reduction: &reduction, seed };
            let every = self.evaluate_chains(&setup, watch)?;
            for (judged, one) in judged.iter_mut().zip(every) {
                judged.push(one);
            }
            reductions.push(reduction);
        }
        let first = reductions.first().ok_or(ElliottError::NoCalibration)?;
        let contacts: Vec<Vec<ResponseGradient>> = self.gradients(&trials)?;
        let row = |(chain, judged): (Chain, Vec<ChainErrors>)| self.row(chain, &judged, first, &contacts);
        let rows = self.chains().into_iter().zip(judged).map(row).collect::<Option<_>>();
        let rows = rows.ok_or(ElliottError::NoCalibration)?;
        Ok(ElliottResults { variance_percent: first.variance_percent(), rows })
    }

    /// Largest number of rounds that [`Elliott::run`] reports.
    pub fn most_rounds(&self) -> u64 {
        let networks = self.components.len() as u64 + 1;
        self.calibrations * networks * u64::from(self.network().training.max_epochs)
    }

    fn chains(&self) -> Vec<Chain> {
        let components = self.components.iter().map(|count| Chain::Components(*count));
        let others = [Chain::Readings, Chain::Influence, Chain::Filter, Chain::Smoother];
        components.chain(others).collect()
    }

    fn network(&self) -> Network {
        let rows = self.rig.training.as_ref().map_or(1, |training| training.count * training.repeats);
        let mut network =
            Network { hidden: vec![HIDDEN], input_scale: InputScale::Standardized, ..Network::default() };
        network.training.learning_rate = LEARNING_RATE;
        network.training.max_epochs =
            (self.presentations / u32::try_from(rows.max(1)).unwrap_or(u32::MAX)).max(1);
        network
    }

    fn evaluate_chains(&self, setup: &TrialSetup, watch: Watch) -> Result<Vec<ChainErrors>, ElliottError> {
        let whole = &self.rig.setup;
        let network = Estimator::Network(self.network());
        let mut judged = Vec::new();
        for &count in &self.components {
            let reduce = |recording| setup.reduction.reduced(recording, count);
            let trial = Split {
                training: reduce(&setup.trial.training),
                held_out: reduce(&setup.trial.held_out),
                offsets: None,
                origin: setup.trial.origin,
            };
            let recording = reduce(&setup.moving.recording);
            let moving = TimedRecording { recording, ..setup.moving.clone() };
            let reduced = without_model(whole, raw_layout(count)).map_err(RigSimulationError::from)?;
            let setup = TrialSetup { trial: &trial, moving: &moving, ..*setup };
            let locator = setup.fit(&reduced, &network, watch)?;
            judged.push(self.evaluate_readings(&locator, &setup)?);
        }
        let locator = setup.fit(whole, &network, watch)?;
        judged.push(self.evaluate_readings(&locator, setup)?);
        let locator = setup.fit(whole, &self.rig.estimator, watch)?;
        judged.push(self.evaluate_readings(&locator, setup)?);
        judged.extend(self.evaluate_tracks(&locator, setup)?);
        Ok(judged)
    }

    fn evaluate_readings(&self, locator: &Locator, setup: &TrialSetup) -> Result<ChainErrors, ElliottError> {
        let mut pressed = Evaluation::new(locator, &setup.trial.held_out)?;
        let extent = self.rig.setup.surface().extent();
        pressed.located.retain(|located| is_inner(located.truth, extent));
        let moving = Evaluation::new(locator, &setup.moving.recording)?;
        let mean_m = |evaluation: &Evaluation| evaluation.summary(None).map_or(f64::NAN, |sum| sum.average_m);
        Ok(ChainErrors {
            pressed: Some((mean_m(&pressed), pressed.effective_percent(self.tolerance_m))),
            moving_error_m: mean_m(&moving),
        })
    }

    /// Errors of filter and smoother.
    fn evaluate_tracks(
        &self,
        locator: &Locator,
        setup: &TrialSetup,
    ) -> Result<[ChainErrors; 2], ElliottError> {
        let followed = track_recording(locator, TrackerConfig::default(), setup.moving)?;
        let (truths, extent) = (setup.moving.truths(), self.rig.setup.surface().extent());
        let judge = |tracks: &[Track]| -> Result<ChainErrors, ElliottError> {
            let errors = TrackErrors::new(tracks, &truths, extent).ok_or(ElliottError::NothingTracked)?;
            Ok(ChainErrors { pressed: None, moving_error_m: errors.track_m })
        };
        Ok([judge(&followed.filtered)?, judge(&followed.smoothed)?])
    }

    fn gradients(&self, trials: &[Split]) -> Result<Vec<Vec<ResponseGradient>>, ElliottError> {
        let setup = &self.rig.setup;
        let model = setup.surface().model().ok_or(RigSimulationError::from(SimulateError::NoModel))?;
        let force_n = setup.force_n().ok_or(RigSimulationError::from(SimulateError::NoForce))?;
        let functions: Vec<_> = setup
            .layout()
            .sensors()
            .iter()
            .map(|sensor| model.response_function(sensor.kind, sensor.position))
            .collect();
        let judged = trials.first().map_or(&[][..], |trial| &trial.held_out.rows);
        let inner = judged.iter().filter(|row| is_inner(row.position, model.extent()));
        let at = |position| functions.iter().map(|f| f.gradient(Contact { position, force_n })).collect();
        Ok(inner.map(|row| at(row.position)).collect())
    }

    fn row(
        &self,
        chain: Chain,
        judged: &[ChainErrors],
        reduction: &KarhunenLoeve,
        contacts: &[Vec<ResponseGradient>],
    ) -> Option<ChainRow> {
        let pressed = |pick: fn((f64, f64)) -> f64| {
            Quantiles::from_values(judged.iter().filter_map(|one| one.pressed.map(pick)).collect())
        };
        let seen = match chain {
            Chain::Components(count) => count,
            _ => self.rig.setup.layout().len(),
        };
        let bounds: Option<Vec<Bound>> =
            contacts.iter().map(|gradients| reduction.bound(gradients, seen)).collect();
        let mean_m = |bounds: Vec<Bound>| {
            bounds.iter().map(Bound::mean_error_m).sum::<f64>() / bounds.len().max(1) as f64
        };
        let is_single = !matches!(chain, Chain::Filter | Chain::Smoother);
        Some(ChainRow {
            chain,
            error_m: pressed(|(error_m, _)| error_m),
            effective_percent: pressed(|(_, percent)| percent),
            moving_error_m: Quantiles::from_values(judged.iter().map(|one| one.moving_error_m).collect())?,
            limit_m: bounds.filter(|_| is_single).map(mean_m),
        })
    }
}

#[derive(Clone, Copy)]
struct TrialSetup<'a> {
    trial: &'a Split,
    moving: &'a TimedRecording,
    reduction: &'a KarhunenLoeve,
    seed: u64,
}

impl TrialSetup<'_> {
    fn fit(&self, of: &Setup, estimator: &Estimator, watch: Watch) -> Result<Locator, FitError> {
        estimator.fit_unchecked(FitTask::new(of, &self.trial.training).seed(self.seed).watch(watch))
    }
}

fn is_inner(position: Position, extent: Extent) -> bool {
    let inner = |(at_m, side_m): (f64, f64)| (at_m / side_m - 0.5).abs() <= 0.5 * INNER;
    extent.coordinates_m(position).zip(extent.sides_m()).all(inner)
}

#[cfg(test)]
mod tests;
