//! What a layout's locator achieves: calibrated, asked and measured, in simulation with noise.

use super::SensorProblem;
use super::Stage;
use crate::calibration::{CalibrationError, Seeds, Trial, Verification};
use palpate_estimators::arrangement::cells;
use palpate_estimators::estimator::Estimator;
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::Layout;
use palpate_numerics::watch::Watch;

/// Training positions along a line, and along each side of a plane; each is pressed as often.
const TRAINING: usize = 30;
const TRAINING_ON_A_PLANE: usize = 8;
const PRESSES: usize = 20;
/// Readings that a calibration is judged by, about.
const READINGS: usize = 4000;

impl SensorProblem<'_> {
    /// Calibrates the layout at even training positions with the design's force, `calibrations` times with fresh noise, and
    /// locates readings of the design's contacts, whose force the locator knows or does not as the design says. The estimator is
    /// the rig's where that inverts influence functions, else the best guess for the surface.
    ///
    /// # Errors
    /// [`CalibrationError`] when the locator cannot be fitted.
    pub fn verify(
        &self,
        layout: &Layout,
        estimator: &Estimator,
        calibrations: usize,
        seed: u64,
        watch: Watch,
    ) -> Result<Verification, CalibrationError> {
        let force_n = self.touches.force_n;
        let touched = Setup {
            surface: self.setup.surface.clone(),
            layout: layout.clone(),
            force_n: Some(force_n),
            columns: None,
        };
        let known = (self.touches.force == Force::Known).then_some(force_n);
        let used = Setup { force_n: known, ..touched.clone() };
        let guess = Estimator::contenders(&used).into_iter().next();
        let estimator = match (estimator, &guess) {
            (Estimator::Influence(_), _) | (_, None) => estimator,
            (_, Some(guess)) => guess,
        };
        let contacts = &self.touches.contacts;
        let trial = Trial {
            pressed: touched.clone(),
            touched,
            used,
            estimator,
            contacts,
            draws: READINGS.div_ceil(contacts.len()),
            tolerance_m: self.pool.design.tolerance_m,
        };
        let training = self.training();
        let mut calibrated = Vec::new();
        for k in 0..calibrations as u64 {
            watch.stage(Stage::Verification.in_words(), k as f64 / calibrations as f64)?;
            let seeds = Seeds { first: seed.wrapping_add(k), count: 1 };
            calibrated.extend(trial.calibrate(&training, PRESSES, seeds, watch)?);
        }
        Ok(Verification::of(&calibrated, contacts))
    }

    /// Where to press.
    fn training(&self) -> Vec<Position> {
        if self.pool.extent.is_plane() {
            cells(self.pool.extent, TRAINING_ON_A_PLANE, TRAINING_ON_A_PLANE)
        } else {
            cells(self.pool.extent, TRAINING, 1)
        }
    }
}
