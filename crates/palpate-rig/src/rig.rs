//! The rig: a bench with its calibration and estimator, read from one file.

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

/// A bench with its sensors, training positions and estimator, all checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Surface, sensors and contact.
    pub setup: Setup,
    /// Training positions and presses of the calibration.
    pub training: Option<Training>,
    /// The estimator that locates contacts.
    pub estimator: Estimator,
    /// Loads that simulate a load profile.
    pub loads: Vec<UniformLoad>,
    /// Motion of the contacts, and of the beam beneath them; `None` without a `[motion]`.
    pub motion: Option<MovingContacts>,
    /// Candidates and constraints of a sensor design; `None` without a `[design]`.
    pub design: Option<SensorDesign>,
    /// The machine that presses the surface; `None` without a `[stage]`.
    pub stage: Option<Stage>,
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// [`RigError`], with the place in `text`, the value and its bound.
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
    /// [`RigError`] for a missing section, or for one that does not go with the others.
    pub fn from_sections(sections: &RigSections) -> Result<Self, RigError> {
        let setup = sections.setup()?;
        Ok(Self {
            training: sections.training(&setup)?,
            estimator: sections.estimator(&setup)?.unwrap_or_else(|| Estimator::usual(&setup)),
            loads: sections.loads(setup.surface())?,
            motion: sections.motion(&setup)?,
            design: sections.design(&setup)?,
            stage: sections.stage()?,
            setup,
        })
    }

    /// The setup during calibration, with the force of the training presses.
    ///
    /// # Errors
    /// [`OutOfRange`] for a force of the presses that is not greater than 0 and finite.
    pub fn pressed_setup(&self) -> Result<Setup, OutOfRange> {
        match &self.training {
            Some(training) => self.setup.pressed_by(training),
            None => Ok(self.setup.clone()),
        }
    }

    /// Presses the simulated surface at the training positions, with the force of the training presses; see [`Setup::simulate`].
    ///
    /// # Errors
    /// [`RigSimulationError`] when the rig has no training positions, no model or no force.
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

    /// Simulates the presses of a calibration, watched: [`Rig::simulate`] that reports progress and can be stopped.
    ///
    /// # Errors
    /// As for [`Rig::simulate`], and [`SimulateError::Cancelled`].
    pub fn simulate_watched(&self, seed: u64, watch: Watch) -> Result<Recording, RigSimulationError> {
        Ok(self.setup.simulate_watched(self.training()?, seed, watch)?)
    }

    /// Simulates the presses of a calibration for a fit, watched: [`Rig::simulate`] with the zero that recordings of the rig have.
    ///
    /// # Errors
    /// As for [`Rig::simulate_watched`], and [`SimulateError::NoUntouchedRow`].
    pub fn simulate_calibration_watched(
        &self,
        seed: u64,
        watch: Watch,
    ) -> Result<Recording, RigSimulationError> {
        let recorded = self.simulate_watched(seed, watch)?;
        Ok(recorded.zeroed(self.setup.recording_columns().zero).map_err(SimulateError::from)?)
    }

    /// The calibration at the training positions, for simulations.
    ///
    /// # Errors
    /// [`RigSimulationError`] when the rig has no training positions, or they cannot be laid out.
    pub fn calibration(&self) -> Result<Calibration, RigSimulationError> {
        Ok(Calibration::from_training(&self.setup, self.training()?)?)
    }

    /// Simulated calibrations with `count` seeds from `seed` on. Each is judged by one contact at each position of
    /// [`all_over`](palpate_estimators::arrangement::all_over). If the rig's force is unknown, several forces are used: see
    /// [`Calibration::at_forces_of_use`].
    ///
    /// # Errors
    /// [`RigSimulationError`] as for [`Rig::simulate`].
    pub fn trials(&self, count: u64, seed: u64) -> Result<Vec<Split>, RigSimulationError> {
        self.trials_watched(count, seed, Watch::NONE)
    }

    /// Simulates calibrations with `count` seeds, watched: [`Rig::trials`] that reports progress and can be stopped.
    ///
    /// # Errors
    /// As for [`Rig::trials`], and [`SimulateError::Cancelled`].
    pub fn trials_watched(
        &self,
        count: u64,
        seed: u64,
        watch: Watch,
    ) -> Result<Vec<Split>, RigSimulationError> {
        Ok(self.calibration()?.at_forces_of_use().trials_watched(count, seed, watch)?)
    }

    /// The training positions.
    ///
    /// # Errors
    /// [`RigSimulationError::NoTraining`] where the rig has none.
    pub fn training(&self) -> Result<&Training, RigSimulationError> {
        self.training.as_ref().ok_or(RigSimulationError::NoTraining)
    }

    /// Simulates the moving contacts of `[motion]`; see [`palpate_estimators::simulate::simulate_moving`].
    ///
    /// # Errors
    /// [`RigSimulationError`] when the rig has no motion, no model or no force.
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

    /// Simulates the moving contacts, watched: [`Rig::simulate_moving`] that reports progress and can be stopped.
    ///
    /// # Errors
    /// As for [`Rig::simulate_moving`], and [`SimulateError::Cancelled`].
    pub fn simulate_moving_watched(
        &self,
        seed: u64,
        watch: Watch,
    ) -> Result<TimedRecording, RigSimulationError> {
        let moving = self.motion.as_ref().ok_or(RigSimulationError::NoMotion)?;
        let pressed = self.pressed_setup().map_err(SimulateError::from)?;
        Ok(simulate_moving_watched(&pressed, moving, seed, watch)?)
    }
}

/// A rig that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigSimulationError {
    /// The rig has no `[training]`, which determines where to press.
    #[error("a simulation needs training positions; the rig has no [training]")]
    NoTraining,
    /// The rig has no `[motion]`, which determines how a contact moves.
    #[error("a moving contact needs the section [motion]; the rig has none")]
    NoMotion,
    /// The bench cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}
