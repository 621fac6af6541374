//! Sections of a rig, each read by itself.

use serde::Deserialize;

use palpate_design::sensors::SensorDesign;
use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::Estimator;
use palpate_estimators::setup::{Setup, SetupError};
use palpate_estimators::simulate::MovingContacts;
use palpate_mechanics::surface::{SurfaceSpec, UniformLoad};

use crate::design::DesignKeys;
use crate::document::{self, At};
use crate::error::{RigError, RigProblem};
use crate::estimator::EstimatorKeys;
use crate::imperfections::ImperfectionsKeys;
use crate::motion::{self, MotionKeys};
use crate::recording::RecordingKeys;
use crate::sensors::{self, SensorsKeys};
use crate::stage::{Stage, StageKeys};
use crate::surface::SurfaceKeys;
use crate::training::{ContactKeys, LoadKeys, TrainingKeys, check_force};
use crate::values::OneOrMany;

/// Sections of a rig in a text; building checks a section against the others.
///
/// ```
/// use palpate_rig::RigSections;
///
/// let bench = RigSections::from_toml(
///     r#"
///     surface = { kind = "beam", length = "400 mm", width = "40 mm", thickness = "1.2 mm", youngs_modulus = "200 GPa" }
///     sensors = { measure = "deflection", count = 8, noise = "5 um" }
///     "#,
/// )?;
/// let setup = bench.setup()?;
/// assert_eq!(bench.training(&setup)?, None);
///
/// let presses = RigSections::from_toml(r#"training = { count = 10, repeats = 5, force = "3 N" }"#)?;
/// let training = presses.training(&setup)?.expect("the text has a section [training]");
/// assert_eq!(setup.simulate(&training, 0)?.rows.len(), 50);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct RigSections(RigFile);

/// A rig file.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RigFile {
    /// The elastic body; every rig has it.
    pub surface: Option<At<SurfaceKeys>>,
    /// The sensors; every rig has some.
    pub sensors: Option<At<OneOrMany<SensorsKeys>>>,
    /// The contacts to be located.
    pub contact: Option<ContactKeys>,
    /// The presses of a calibration.
    pub training: Option<At<TrainingKeys>>,
    /// The method that locates; the founding paper's network, on a `measured` surface `auto` among `influence` and `gaussian-process`, by default.
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
    /// The machine that presses by itself.
    pub stage: Option<StageKeys>,
    /// Imperfections of a real bench, for simulations.
    pub imperfections: Option<At<ImperfectionsKeys>>,
}

/// Limit of the values in memory.
const MOST_VALUES: usize = 100_000_000;

impl From<RigFile> for RigSections {
    fn from(file: RigFile) -> Self {
        Self(file)
    }
}

impl RigSections {
    /// Reads the sections of a text.
    ///
    /// # Errors
    /// [`RigError`] for an invalid section, key or value.
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        document::read("", &document::parse(text)?).map(Self)
    }

    /// Builds `[surface]`.
    ///
    /// # Errors
    /// [`RigError`] for a missing or invalid section.
    pub fn surface(&self) -> Result<SurfaceSpec, RigError> {
        self.0.surface.as_ref().ok_or_else(|| missing("[surface]"))?.build()
    }

    /// Builds a setup from `[surface]`, `[sensors]`, `[contact]`, `[recording]` and `[imperfections]`.
    ///
    /// # Errors
    /// [`RigError`] for missing or conflicting sections.
    pub fn setup(&self) -> Result<Setup, RigError> {
        let RigFile { surface, sensors, contact, recording, .. } = &self.0;
        // A large surface takes time, so missing sensors are reported first.
        let surface = surface.as_ref().ok_or_else(|| missing("[surface]"))?;
        let sensors = sensors.as_ref().ok_or_else(|| missing("[sensors]"))?;
        let surface = surface.build()?;
        let layout = sensors::build(sensors, recording.as_deref(), &surface)?;
        let force = contact.as_ref().and_then(|contact| contact.force.as_ref());
        check_force(force, &surface)?;
        let greatest_force_n =
            contact.as_ref().map_or(Ok(None), |contact| contact.greatest_force_n(&surface))?;
        let force_range = contact.as_ref().map_or(Ok(None), |contact| contact.force_range(&surface))?;
        let columns = recording.as_ref().map(|keys| keys.build(&layout, surface.extent())).transpose()?;
        let setup = Setup::new(surface).with_layout(layout).map_err(SetupError::from).and_then(|setup| {
            let force_n = force.map(|force| force.si);
            Ok(setup
                .with_force(force_n)?
                .with_greatest_force(greatest_force_n)?
                .with_force_range(force_range))
        });
        let setup = setup.map_err(|error| RigProblem::Setup(error).without_place())?;
        let setup = self.with_imperfections(setup)?;
        Ok(match columns {
            Some(columns) => setup.recorded_as(columns),
            None => setup,
        })
    }

    /// Adds `[imperfections]`, if any.
    ///
    /// # Errors
    /// [`RigError`] if they do not suit the setup.
    pub fn with_imperfections(&self, setup: Setup) -> Result<Setup, RigError> {
        let Some(keys) = &self.0.imperfections else { return Ok(setup) };
        let mut dimensions = setup.layout().sensors().iter().map(|sensor| sensor.kind.dimension());
        let first = dimensions.next();
        let dimension = first.filter(|first| dimensions.all(|other| other == *first));
        let imperfections = keys.build(setup.surface(), dimension)?;
        let setup = setup.with_imperfections(imperfections);
        setup.map_err(|error| RigProblem::Setup(error).at_place(&keys.place))
    }

    /// Builds `[training]`.
    ///
    /// # Errors
    /// [`RigError`] if it does not suit the setup.
    pub fn training(&self, setup: &Setup) -> Result<Option<Training>, RigError> {
        let Some(keys) = &self.0.training else { return Ok(None) };
        let surface = setup.surface();
        let training = keys.build(surface.extent())?;
        let simulated = surface.model().is_some() && setup.columns().is_none();
        if simulated && training.force_n.or(setup.force_n()).is_none() {
            return Err(RigProblem::NoForce.at_place(&keys.place));
        }
        check_force(keys.force.as_ref(), surface)?;
        let untouched =
            setup.imperfections().map_or(0, |imperfections| imperfections.schedule.untouched_rows);
        let rows = training.repeats.saturating_add(untouched as usize);
        let values = training.count.saturating_mul(rows).saturating_mul(setup.layout().len());
        if values > MOST_VALUES {
            let value = format!("{values} values, positions × repeats × sensors");
            return Err(keys.place.refuse_value(value, format!("at most {MOST_VALUES}")));
        }
        Ok(Some(training))
    }

    /// Builds `[estimator]`.
    ///
    /// # Errors
    /// [`RigError`] if it does not suit the setup.
    pub fn estimator(&self, setup: &Setup) -> Result<Option<Estimator>, RigError> {
        self.0.estimator.as_ref().map(|keys| keys.build(setup.layout(), setup.force_n())).transpose()
    }

    /// Builds `[[load]]`.
    ///
    /// # Errors
    /// [`RigError`] if one does not suit the surface.
    pub fn loads(&self, surface: &SurfaceSpec) -> Result<Vec<UniformLoad>, RigError> {
        self.0.load.iter().map(|load| load.build(surface)).collect()
    }

    /// Builds `[motion]`; a beam with a `density` vibrates.
    ///
    /// # Errors
    /// [`RigError`] if it does not suit the setup.
    pub fn motion(&self, setup: &Setup) -> Result<Option<MovingContacts>, RigError> {
        let density = self.0.surface.as_ref().and_then(|surface| surface.density());
        let moving = |keys| motion::build(keys, setup.surface(), density, setup.force_n());
        self.0.motion.as_ref().map(moving).transpose()
    }

    /// Builds `[design]`.
    ///
    /// # Errors
    /// [`RigError`] if it does not suit the setup.
    pub fn design(&self, setup: &Setup) -> Result<Option<SensorDesign>, RigError> {
        self.0.design.as_ref().map(|keys| keys.build(setup)).transpose()
    }

    /// Builds `[stage]`.
    ///
    /// # Errors
    /// [`RigError`] for settings out of range.
    pub fn stage(&self) -> Result<Option<Stage>, RigError> {
        self.0.stage.as_ref().map(StageKeys::build).transpose()
    }
}

fn missing(section: &'static str) -> RigError {
    RigProblem::MissingSection { section }.without_place()
}
