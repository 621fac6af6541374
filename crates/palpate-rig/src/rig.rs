//! Rig: a bench with its calibration and estimator.

use palpate_design::sensors::SensorDesign;
use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::Estimator;
use palpate_estimators::evaluation::{Calibration, Split};
use palpate_estimators::recording::{Recording, TimedRecording};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::{MovingContacts, SimulateError, simulate_moving_watched};
use palpate_mechanics::surface::UniformLoad;
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::Watch;

use crate::error::RigError;
use crate::sections::RigSections;
use crate::stage::Stage;

/// Checked bench.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Surface, sensors and contact.
    pub setup: Setup,
    /// Training positions and presses.
    pub training: Option<Training>,
    /// Estimator.
    pub estimator: Estimator,
    /// Loads of a load profile.
    pub loads: Vec<UniformLoad>,
    /// Motion of the contacts; `None` without `[motion]`.
    pub motion: Option<MovingContacts>,
    /// Task of a sensor design; `None` without `[design]`.
    pub design: Option<SensorDesign>,
    /// Machine that presses; `None` without `[stage]`.
    pub stage: Option<Stage>,
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// [`RigError`] with place, value and bound.
    ///
    /// ```
    /// use palpate_rig::Rig;
    ///
    /// let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/paper.toml"));
    /// let rig = Rig::from_toml(text)?;
    /// assert_eq!((rig.setup.layout().len(), rig.setup.force_n()), (8, Some(3.0)));
    ///
    /// let text = text.replace("\"400 mm\"", "\"400 N\"");
    /// let error = Rig::from_toml(&text).unwrap_err();
    /// assert_eq!(error.to_string(), "`length`: wrong unit `N`; a length is one of nm, um, mm, cm, m");
    /// assert_eq!(&text[error.span.clone().unwrap()], "\"400 N\"");
    /// # Ok::<(), palpate_rig::RigError>(())
    /// ```
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        Self::from_sections(&RigSections::from_toml(text)?)
    }

    /// Builds a rig from its sections.
    ///
    /// # Errors
    /// [`RigError`] for missing or conflicting sections.
    pub fn from_sections(sections: &RigSections) -> Result<Self, RigError> {
        let setup = sections.setup()?;
        Ok(Self {
            training: sections.training(&setup)?,
            estimator: sections.estimator(&setup)?.unwrap_or_else(|| Estimator::default_for(&setup)),
            loads: sections.loads(setup.surface())?,
            motion: sections.motion(&setup)?,
            design: sections.design(&setup)?,
            stage: sections.stage()?,
            setup,
        })
    }

    /// Setup with the force of the training presses.
    ///
    /// # Errors
    /// [`OutOfRange`] for an invalid force.
    pub fn training_setup(&self) -> Result<Setup, OutOfRange> {
        match &self.training {
            Some(training) => self.setup.with_training_force(training),
            None => Ok(self.setup.clone()),
        }
    }

    /// Simulates the training presses; see [`Setup::simulate`].
    ///
    /// # Errors
    /// [`RigSimulationError`] without training positions, model or force.
    ///
    /// ```
    /// use palpate_rig::Rig;
    ///
    /// let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/noisy-beam.toml"));
    /// let rig = Rig::from_toml(text)?;
    /// let recording = rig.simulate(7)?;
    /// assert_eq!(recording.rows.len(), rig.training()?.count * rig.training()?.repeats);
    /// assert_eq!(recording, rig.simulate(7)?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn simulate(&self, seed: u64) -> Result<Recording, RigSimulationError> {
        self.simulate_watched(seed, Watch::NONE)
    }

    /// [`Rig::simulate`] with progress and cancellation.
    ///
    /// # Errors
    /// As [`Rig::simulate`], and [`SimulateError::Cancelled`].
    pub fn simulate_watched(&self, seed: u64, watch: Watch) -> Result<Recording, RigSimulationError> {
        Ok(self.setup.simulate_watched(self.training()?, seed, watch)?)
    }

    /// [`Rig::simulate_watched`] with the zero of the rig's recordings.
    ///
    /// # Errors
    /// As [`Rig::simulate_watched`], and [`SimulateError::NoUntouchedRow`].
    pub fn simulate_calibration_watched(
        &self,
        seed: u64,
        watch: Watch,
    ) -> Result<Recording, RigSimulationError> {
        let recorded = self.simulate_watched(seed, watch)?;
        Ok(recorded.subtract_zero(self.setup.recording_columns().zero).map_err(SimulateError::from)?)
    }

    /// Calibration at the training positions, for simulations.
    ///
    /// # Errors
    /// [`RigSimulationError`] for missing or invalid training positions.
    pub fn calibration(&self) -> Result<Calibration, RigSimulationError> {
        Ok(Calibration::from_training(&self.setup, self.training()?)?)
    }

    /// Simulates calibrations with `count` seeds from `seed` on, with test contacts at
    /// [`all_over`](palpate_estimators::arrangement::all_over); see [`Calibration::at_forces_of_use`] for an
    /// unknown force.
    ///
    /// # Errors
    /// As [`Rig::simulate`].
    pub fn trials(&self, count: u64, seed: u64) -> Result<Vec<Split>, RigSimulationError> {
        self.trials_watched(count, seed, Watch::NONE)
    }

    /// [`Rig::trials`] with progress and cancellation.
    ///
    /// # Errors
    /// As [`Rig::trials`], and [`SimulateError::Cancelled`].
    pub fn trials_watched(
        &self,
        count: u64,
        seed: u64,
        watch: Watch,
    ) -> Result<Vec<Split>, RigSimulationError> {
        Ok(self.calibration()?.at_forces_of_use().trials_watched(count, seed, watch)?)
    }

    /// Training positions.
    ///
    /// # Errors
    /// [`RigSimulationError::NoTraining`] without any.
    pub fn training(&self) -> Result<&Training, RigSimulationError> {
        self.training.as_ref().ok_or(RigSimulationError::NoTraining)
    }

    /// Simulates `[motion]`; see [`palpate_estimators::simulate::simulate_moving`].
    ///
    /// # Errors
    /// [`RigSimulationError`] without motion, model or force.
    ///
    /// ```
    /// use palpate_rig::Rig;
    ///
    /// let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/moving-plate.toml"));
    /// let recording = Rig::from_toml(text)?.simulate_moving(0)?;
    /// assert!(recording.times_s.windows(2).all(|pair| pair[0] < pair[1]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn simulate_moving(&self, seed: u64) -> Result<TimedRecording, RigSimulationError> {
        self.simulate_moving_watched(seed, Watch::NONE)
    }

    /// [`Rig::simulate_moving`] with progress and cancellation.
    ///
    /// # Errors
    /// As [`Rig::simulate_moving`], and [`SimulateError::Cancelled`].
    pub fn simulate_moving_watched(
        &self,
        seed: u64,
        watch: Watch,
    ) -> Result<TimedRecording, RigSimulationError> {
        let moving = self.motion.as_ref().ok_or(RigSimulationError::NoMotion)?;
        let pressed = self.training_setup().map_err(SimulateError::from)?;
        Ok(simulate_moving_watched(&pressed, moving, seed, watch)?)
    }
}

/// Error of a simulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigSimulationError {
    /// Missing `[training]`.
    #[error("a simulation needs training positions; the rig has no [training]")]
    NoTraining,
    /// Missing `[motion]`.
    #[error("a moving contact needs the section [motion]; the rig has none")]
    NoMotion,
    /// Failed simulation.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}
