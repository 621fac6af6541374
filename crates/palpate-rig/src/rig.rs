//! The rig: a bench with its calibration and estimator, read from one file.

use serde::Deserialize;

use palpate_design::sensors::SensorDesign;
use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::Estimator;
use palpate_estimators::evaluation::{Calibration, Split};
use palpate_estimators::recording::{Recording, TimedRecording};
use palpate_estimators::setup::{Setup, SetupError};
use palpate_estimators::simulate::{MovingContacts, SimulateError, simulate_moving};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::{SurfaceSpec, UniformLoad};
use palpate_numerics::OutOfRange;

use crate::design::DesignKeys;
use crate::document::{self, At};
use crate::error::{RigError, RigProblem};
use crate::estimator::EstimatorKeys;
use crate::motion::{self, MotionKeys};
use crate::recording::RecordingKeys;
use crate::sensors::{self, SensorsKeys};
use crate::surface::SurfaceKeys;
use crate::training::{ContactKeys, LoadKeys, TrainingKeys, check_force};
use crate::values::OneOrMany;

/// A bench, where to press it, and the method that then locates: all checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Surface, sensors and contact.
    pub setup: Setup,
    /// Training positions and presses, to calibrate.
    pub training: Option<Training>,
    /// The method that locates.
    pub estimator: Estimator,
    /// Loads for a load profile to be simulated from.
    pub loads: Vec<UniformLoad>,
    /// Motion of the contacts, and of the beam beneath them, where the rig says.
    pub motion: Option<MovingContacts>,
    /// Candidates and constraints of a sensor design, where the rig says.
    pub design: Option<SensorDesign>,
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
        document::read::<RigFile>("", &document::parse(text)?)?.build()
    }

    /// The bench as it is when pressed to calibrate: with the force of the training presses.
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
        Ok(self.setup.simulate(self.training()?, seed)?)
    }

    /// The calibration at the training positions, to be simulated.
    ///
    /// # Errors
    /// [`RigSimulationError`] when the rig has no training positions, or they cannot be laid out.
    pub fn calibration(&self) -> Result<Calibration, RigSimulationError> {
        Ok(Calibration::from_training(&self.setup, self.training()?)?)
    }

    /// Simulated calibrations with `count` seeds from the first on, each judged by one contact at each position of
    /// [`all_over`](palpate_estimators::arrangement::all_over), by several forces where the rig does not know it: see
    /// [`Calibration::at_forces_of_use`].
    ///
    /// # Errors
    /// [`RigSimulationError`] as for [`Rig::simulate`].
    pub fn trials(&self, count: u64, seed: u64) -> Result<Vec<Split>, RigSimulationError> {
        let calibration = self.calibration()?.at_forces_of_use();
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
        let moving = self.motion.as_ref().ok_or(RigSimulationError::NoMotion)?;
        let pressed = self.pressed_setup().map_err(SimulateError::from)?;
        Ok(simulate_moving(&pressed, moving, seed)?)
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
    /// A bench that cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}

/// Greatest number of values that a recording of the training positions should hold in memory.
const MOST_VALUES: usize = 100_000_000;

/// A rig file.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RigFile {
    /// The elastic body that is touched; every rig has it.
    pub surface: Option<At<SurfaceKeys>>,
    /// The sensors; every rig has some.
    pub sensors: Option<At<OneOrMany<SensorsKeys>>>,
    /// The contacts to be located.
    pub contact: Option<ContactKeys>,
    /// The presses of a calibration.
    pub training: Option<At<TrainingKeys>>,
    /// The method that locates; the founding paper's network unless said otherwise.
    pub estimator: Option<EstimatorKeys>,
    /// Columns of a CSV file by their roles.
    pub recording: Option<At<RecordingKeys>>,
    /// Motions of contacts.
    pub motion: Option<At<OneOrMany<MotionKeys>>>,
    /// Forces spread over parts of the surface.
    #[serde(default)]
    pub load: Vec<At<LoadKeys>>,
    /// Candidates of a sensor design, and its constraints.
    pub design: Option<At<DesignKeys>>,
}

impl RigFile {
    /// Checks the sections beside each other.
    ///
    /// # Errors
    /// [`RigError`] for the first thing that is wrong.
    pub fn build(&self) -> Result<Rig, RigError> {
        let missing = |section| RigProblem::MissingSection { section }.without_place();
        let surface_keys = self.surface.as_ref().ok_or_else(|| missing("[surface]"))?;
        let sensors = self.sensors.as_ref().ok_or_else(|| missing("[sensors]"))?;
        let contact_force = self.contact.as_ref().and_then(|contact| contact.force.as_ref());
        let force_n = contact_force.map(|force| force.si);

        let surface = surface_keys.build()?;
        let layout = sensors::build(sensors, self.recording.as_deref(), &surface)?;
        check_force(contact_force, &surface)?;
        let greatest_force_n = match &self.contact {
            Some(contact) => contact.greatest_force_n(&surface)?,
            None => None,
        };
        let training = self.training(&surface, &layout, force_n)?;
        let estimator = match &self.estimator {
            Some(keys) => keys.build(&layout, force_n)?,
            None => Default::default(),
        };
        let loads = self.load.iter().map(|load| load.build(&surface)).collect::<Result<_, _>>()?;
        let columns =
            self.recording.as_ref().map(|keys| keys.build(&layout, surface.extent())).transpose()?;
        let moving = |keys| motion::build(keys, &surface, surface_keys.density(), force_n);
        let motion = self.motion.as_ref().map(moving).transpose()?;
        let setup = Setup::new(surface).with_layout(layout).map_err(SetupError::from);
        let setup =
            setup.and_then(|setup| Ok(setup.with_force(force_n)?.with_greatest_force(greatest_force_n)?));
        let mut setup = setup.map_err(|error| RigProblem::Setup(error).without_place())?;
        if let Some(columns) = columns {
            setup = setup.recorded_as(columns);
        }
        let design = self.design.as_ref().map(|keys| keys.build(&setup)).transpose()?;
        Ok(Rig { setup, training, estimator, loads, motion, design })
    }

    /// The training positions, of which the readings can be simulated or are recorded.
    fn training(
        &self,
        surface: &SurfaceSpec,
        layout: &Layout,
        force_n: Option<f64>,
    ) -> Result<Option<Training>, RigError> {
        let Some(keys) = &self.training else { return Ok(None) };
        let training = keys.build(surface.extent())?;
        let simulated = surface.model().is_some() && self.recording.is_none();
        if simulated && training.force_n.or(force_n).is_none() {
            return Err(RigProblem::NoForce.at_place(&keys.place));
        }
        check_force(keys.force.as_ref(), surface)?;
        let values = training.count.saturating_mul(training.repeats).saturating_mul(layout.len());
        if values > MOST_VALUES {
            let value = format!("{values} values, positions × repeats × sensors");
            return Err(keys.place.refuse_as(value, format!("at most {MOST_VALUES}")));
        }
        Ok(Some(training))
    }
}
