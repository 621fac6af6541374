//! What a layout's locator achieves: calibrated, asked and measured, in simulation with noise.

use serde::Serialize;

use super::SensorProblem;
use super::{KeepGoing, Stage};
use crate::arrangement::{Arrangement, ArrangementError};
use crate::bench::Bench;
use crate::contact::Position;
use crate::estimator::{EstimatorConfig, FitError, Fitting, ReadingError};
use crate::limit::Force;
use crate::sensing::Layout;
use crate::simulate::{SimulateError, simulate_at};

/// Training positions along a line, and along each side of a plane; each is pressed as often.
const TRAINING: usize = 30;
const TRAINING_ON_A_PLANE: usize = 8;
const PRESSES: usize = 20;
/// Readings that a calibration is judged by, about.
const READINGS: usize = 4000;

/// How far a calibrated locator was off, on average over the contacts of a design.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// The mean error, in metres, over all calibrations.
    pub mean_error_m: f64,
    /// Its standard error, in metres, from how the calibrations differ.
    pub standard_error_m: f64,
    /// Share of the contacts located within the tolerance, in %.
    pub within_tolerance_percent: f64,
    /// Calibrations.
    pub calibrations: usize,
}

/// Why a layout cannot be verified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VerificationError {
    /// The bench cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Nowhere to press.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// The locator cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The locator does not take the readings.
    #[error(transparent)]
    Reading(#[from] ReadingError),
}

impl SensorProblem<'_> {
    /// Calibrates the layout at even training positions with the design's force, `calibrations` times with fresh noise, and
    /// locates readings of the design's contacts, whose force the locator knows or does not as the design says. The estimator is
    /// the rig's where that inverts influence functions, else the best guess for the surface. `None` when `keep_going` says no.
    ///
    /// # Errors
    /// [`VerificationError`] when the locator cannot be fitted.
    pub fn verify(
        &self,
        layout: &Layout,
        estimator: &EstimatorConfig,
        calibrations: usize,
        seed: u64,
        keep_going: &mut KeepGoing,
    ) -> Result<Option<Verification>, VerificationError> {
        let force_n = self.touches.force_n;
        let pressed = Bench {
            surface: self.bench.surface.clone(),
            layout: layout.clone(),
            force_n: Some(force_n),
            columns: None,
        };
        let known = (self.touches.force == Force::Known).then_some(force_n);
        let used = Bench { force_n: known, ..pressed.clone() };
        let guess = EstimatorConfig::contenders(&used).into_iter().next();
        let estimator = match (estimator, guess) {
            (EstimatorConfig::Influence(_), _) | (_, None) => estimator.clone(),
            (_, Some(guess)) => guess,
        };
        let training = self.training()?;
        let contacts = &self.touches.contacts;
        let repeats = READINGS.div_ceil(contacts.len());
        let judged = contacts.positions.iter().flat_map(|at| std::iter::repeat_n(*at, repeats));
        let positions: Vec<Position> = training.iter().copied().chain(judged).collect();
        let (mut errors, mut within) = (Vec::new(), 0.0);
        for k in 0..calibrations {
            if !keep_going(Stage::Verification, k as f64 / calibrations as f64) {
                return Ok(None);
            }
            let all = simulate_at(&pressed, &positions, 1, seed.wrapping_add(k as u64))?;
            let pressed_rows: Vec<usize> = (0..training.len()).collect();
            let fitting = Fitting::prepare(&used, &estimator, &all.subset(&pressed_rows))?;
            let fitted = fitting.fit(seed, &mut || keep_going(Stage::Verification, f64::NAN))?;
            let Some(locator) = fitted else { return Ok(None) };
            let mut error_m = 0.0;
            for (i, row) in all.rows[training.len()..].iter().enumerate() {
                let off_m = locator.locate(&row.reading)?.contact.position.distance_m(row.position);
                let share = contacts.weights[i / repeats] / repeats as f64;
                error_m += share * off_m;
                within += if off_m <= self.pool.design.tolerance_m { share } else { 0.0 };
            }
            errors.push(error_m);
        }
        let count = errors.len() as f64;
        let mean_error_m = errors.iter().sum::<f64>() / count;
        let squares: f64 = errors.iter().map(|error| (error - mean_error_m).powi(2)).sum();
        Ok(Some(Verification {
            mean_error_m,
            standard_error_m: (squares / (count - 1.0).max(1.0) / count).sqrt(),
            within_tolerance_percent: 100.0 * within / count,
            calibrations,
        }))
    }

    /// Where to press, each position as often as it is pressed.
    fn training(&self) -> Result<Vec<Position>, ArrangementError> {
        let (arrangement, count) = if self.pool.extent.is_plane() {
            let side = TRAINING_ON_A_PLANE;
            (Arrangement::Grid { columns: side, rows: side }, side * side)
        } else {
            (Arrangement::Even, TRAINING)
        };
        let positions = arrangement.positions(count, self.pool.extent)?;
        Ok(positions.into_iter().flat_map(|at| std::iter::repeat_n(at, PRESSES)).collect())
    }
}
