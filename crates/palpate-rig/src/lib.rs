//! The rig file, one TOML document that says what is on the bench, and the study file, which varies one.
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod design;
mod document;
mod error;
mod estimator;
mod file;
mod motion;
mod recording;
mod sensors;
mod study;
mod surface;
mod training;
mod values;

pub use error::{RigError, RigProblem};
pub use study::{Arm, AskedLayout, Judging, Study};

use palpate_design::sensors::SensorDesign;
use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::Estimator;
use palpate_estimators::evaluation::{Calibration, Split};
use palpate_estimators::recording::{Recording, TimedRecording};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::{MovingContacts, SimulateError, simulate_moving};
use palpate_mechanics::surface::UniformLoad;

/// A bench, where to press it, and the method that then locates: all checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Surface, sensors and contact.
    pub setup: Setup,
    /// Where to press to calibrate.
    pub training: Option<Training>,
    /// The method that locates.
    pub estimator: Estimator,
    /// Loads for a load profile to be simulated from.
    pub loads: Vec<UniformLoad>,
    /// How a contact moves, and what moves with it, where the rig says.
    pub motion: Option<MovingContacts>,
    /// What a sensor design may choose from, where the rig says.
    pub design: Option<SensorDesign>,
}

impl Rig {
    /// The bench as it is when pressed to calibrate: with the force of the training presses.
    pub fn pressed_setup(&self) -> Setup {
        self.training.as_ref().map_or_else(|| self.setup.clone(), |training| self.setup.pressed_by(training))
    }

    /// Presses the simulated surface at the training positions, with the force of the training presses; see [`Setup::simulate`].
    ///
    /// # Errors
    /// [`RigSimulationError`] when the rig has no training positions, no model or no force.
    pub fn simulate(&self, seed: u64) -> Result<Recording, RigSimulationError> {
        Ok(self.setup.simulate(self.training()?, seed)?)
    }

    /// The calibration at the training positions, to be simulated.
    ///
    /// # Errors
    /// [`RigSimulationError`] when the rig has no training positions, or they cannot be laid out.
    pub fn calibration(&self) -> Result<Calibration, RigSimulationError> {
        Ok(Calibration::of(&self.setup, self.training()?).map_err(SimulateError::from)?)
    }

    /// Simulated calibrations with `count` seeds from the first on, each judged by one contact at each position of
    /// [`all_over`](palpate_estimators::arrangement::all_over).
    ///
    /// # Errors
    /// [`RigSimulationError`] as for [`Rig::simulate`].
    pub fn trials(&self, count: u64, seed: u64) -> Result<Vec<Split>, RigSimulationError> {
        let calibration = self.calibration()?;
        (0..count).map(|k| Ok(calibration.simulate(seed + k)?)).collect()
    }

    /// The training positions.
    ///
    /// # Errors
    /// [`RigSimulationError::NoTraining`] where the rig has none.
    pub fn training(&self) -> Result<&Training, RigSimulationError> {
        self.training.as_ref().ok_or(RigSimulationError::NoTraining)
    }

    /// Moves the contacts as `[motion]` says; see [`simulate_moving`].
    ///
    /// # Errors
    /// [`RigSimulationError`] when the rig has no motion, no model or no force.
    pub fn simulate_moving(&self, seed: u64) -> Result<TimedRecording, RigSimulationError> {
        let moving = self.motion.as_ref().ok_or(RigSimulationError::NoMotion)?;
        Ok(simulate_moving(&self.pressed_setup(), moving, seed)?)
    }
}

/// A rig that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigSimulationError {
    /// The rig does not say where to press.
    #[error("a simulation needs training positions; the rig has no [training]")]
    NoTraining,
    /// The rig does not say how a contact moves.
    #[error("a moving contact needs to be told of; the rig has no [motion]")]
    NoMotion,
    /// What it describes cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}

#[cfg(test)]
mod tests;
