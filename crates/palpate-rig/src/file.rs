//! The rig file as a whole.

use serde::Deserialize;

use palpate_estimators::arrangement::Training;
use palpate_estimators::setup::Bench;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::SurfaceSpec;

use crate::Rig;
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

/// More values than a recording of the training positions should hold in memory.
const MOST_VALUES: usize = 100_000_000;

/// A rig file.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RigFile {
    /// The elastic body that is touched.
    pub surface: Option<At<SurfaceKeys>>,
    /// What is measured where.
    pub sensors: Option<At<OneOrMany<SensorsKeys>>>,
    /// The contacts to be located.
    pub contact: Option<ContactKeys>,
    /// The presses of a calibration.
    pub training: Option<At<TrainingKeys>>,
    /// The method that locates; the founding paper's network unless said otherwise.
    pub estimator: Option<EstimatorKeys>,
    /// Which column of a CSV file is what.
    pub recording: Option<At<RecordingKeys>>,
    /// How contacts move.
    pub motion: Option<At<OneOrMany<MotionKeys>>>,
    /// Forces spread over parts of the surface.
    #[serde(default)]
    pub load: Vec<At<LoadKeys>>,
    /// What a sensor design may choose from, and what it must keep to.
    pub design: Option<At<DesignKeys>>,
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// [`RigError`], with the place in `text`, the value and its bound.
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        document::read::<RigFile>("", &document::parse(text)?)?.build()
    }
}

impl RigFile {
    /// Checks the sections beside each other.
    ///
    /// # Errors
    /// [`RigError`] for the first thing that is wrong.
    pub fn build(&self) -> Result<Rig, RigError> {
        let missing = |section| RigProblem::MissingSection { section }.nowhere();
        let surface_keys = self.surface.as_ref().ok_or_else(|| missing("[surface]"))?;
        let sensors = self.sensors.as_ref().ok_or_else(|| missing("[sensors]"))?;
        let contact_force = self.contact.as_ref().and_then(|contact| contact.force.as_ref());
        let force_n = contact_force.map(|force| force.si);

        let surface = surface_keys.build()?;
        let layout = sensors::build(sensors, self.recording.as_deref(), &surface)?;
        check_force(contact_force, &surface)?;
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
        let bench = Bench { surface, layout, force_n, columns };
        let design = self.design.as_ref().map(|keys| keys.build(&bench)).transpose()?;
        Ok(Rig { bench, training, estimator, loads, motion, design })
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
            return Err(RigProblem::NoForce.at(&keys.place));
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
