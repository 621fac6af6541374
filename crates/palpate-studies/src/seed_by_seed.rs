//! Arms whose every seed has a recording of its own.

use super::run::{TrainedSeed, unfitted};
use super::{Judging, StudyRunError};
use palpate_estimators::estimator::Estimator;
use palpate_estimators::evaluation::Evaluation;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::{SimulateError, simulate_at};
use palpate_mechanics::contact::Position;
use palpate_numerics::watch::Watch;
use palpate_rig::{Rig, RigSimulationError};

/// Where an arm is pressed, first to fit and then to judge.
#[derive(Clone, Debug)]
pub(super) struct SeedBySeed {
    presses: Vec<Position>,
    /// As many of them as are fitted to.
    training: usize,
    /// Patterns of an epoch; 0 for an estimator that is not trained by epochs.
    pub patterns: usize,
}

impl SeedBySeed {
    /// The presses of a rig; where its sensors have noise, as many readings at each position as the study judges by.
    pub fn of(rig: &Rig, judging: &Judging) -> Result<Self, RigSimulationError> {
        let training = rig.training()?;
        let positions = training.positions(rig.setup.surface.extent()).map_err(SimulateError::from)?;
        let noisy = rig.setup.layout.sensors.iter().any(|sensor| sensor.channel.noise_sd > 0.0);
        let readings = if noisy { judging.readings } else { 1 };
        let mut presses = repeated(&positions, training.repeats);
        let training = presses.len();
        presses.extend(repeated(&judging.positions, readings));
        let patterns = if matches!(rig.estimator, Estimator::Network(_)) { training } else { 0 };
        Ok(Self { presses, training, patterns })
    }

    /// Simulates, fits and judges. Calibration and judgement share the bench's gains and offsets, which a seed's first draws
    /// decide; what is judged by has the contact's force.
    pub fn fit(
        &self,
        (name, rig): (&str, &Rig),
        seed: u64,
        watch: Watch,
    ) -> Result<TrainedSeed, StudyRunError> {
        let arm = || name.to_owned();
        // The noise of a row is the same whatever the force, and each row is used once.
        let recorded = |setup: &Setup| {
            let recording = simulate_at(setup, &self.presses, 1, seed);
            recording.map_err(|error| StudyRunError::Simulate { arm: arm(), error: error.into() })
        };
        let rows: Vec<usize> = (0..self.presses.len()).collect();
        let (training, judged) = rows.split_at(self.training);
        let training = recorded(&rig.pressed_setup())?.subset(training);
        let judged = recorded(&touched_setup(rig))?.subset(judged);
        let task = FitTask { setup: &rig.setup, recording: &training, seed, watch };
        let locator = rig.estimator.fit_task(task).map_err(|error| unfitted(name, error))?;
        let evaluation = Evaluation::of(&locator, &judged)
            .map_err(|error| StudyRunError::Reading { arm: arm(), error })?;
        Ok(TrainedSeed { seed, locator, evaluation })
    }
}

/// The bench as contacts touch it: with their force, or where that is not known to the locator, with that of the presses.
pub(super) fn touched_setup(rig: &Rig) -> Setup {
    let force_n = rig.setup.force_n.or(rig.pressed_setup().force_n);
    Setup { force_n, ..rig.setup.clone() }
}

fn repeated(positions: &[Position], times: usize) -> Vec<Position> {
    positions.iter().flat_map(|at| std::iter::repeat_n(*at, times)).collect()
}
