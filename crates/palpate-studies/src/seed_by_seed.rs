//! Arms whose every seed has a recording of its own.

use super::run::{TrainedSeed, unfitted};
use super::{Judging, StudyRunError};
use palpate_estimators::estimator::Estimator;
use palpate_estimators::evaluation::Calibration;
use palpate_numerics::watch::Watch;
use palpate_rig::{Rig, RigSimulationError};

/// An arm's calibration, simulated anew for each seed.
#[derive(Clone, Debug)]
pub(super) struct SeedBySeed {
    calibration: Calibration,
    /// Patterns of an epoch; 0 for an estimator that is not trained by epochs.
    pub patterns: usize,
}

impl SeedBySeed {
    /// The calibration of a rig; where its sensors have noise, with as many readings at each position as the study judges by.
    pub fn of(rig: &Rig, judging: &Judging) -> Result<Self, RigSimulationError> {
        let noisy = rig.setup.layout.sensors().iter().any(|sensor| sensor.channel.noise_sd > 0.0);
        let readings = if noisy { judging.readings } else { 1 };
        let calibration = rig.calibration()?.judged_at(&judging.positions, readings);
        let is_network = matches!(rig.estimator, Estimator::Network(_));
        let patterns = if is_network { calibration.presses().len() } else { 0 };
        Ok(Self { calibration, patterns })
    }

    /// Simulates, fits and judges.
    pub fn fit(
        &self,
        (name, rig): (&str, &Rig),
        seed: u64,
        watch: Watch,
    ) -> Result<TrainedSeed, StudyRunError> {
        self.calibration.run(&rig.estimator, seed, watch).map_err(|error| unfitted(name, error))
    }
}
