//! Influence functions of the channels, and their inversion for the contact of a reading.

mod at_nodes;
mod beam;
pub(crate) mod calibration;
mod channels;
mod config;
pub(crate) mod force_linear;
mod grid;
mod inversion;
mod lanes;
pub(crate) mod learning;
mod levenberg;
mod loads;
pub mod measured;
mod missing_channel;
mod moments;
mod noise;
mod plane;
mod prior;
mod untouched_rows;

pub use at_nodes::InfluencesAtNodes;
pub use beam::{BeamLikelihood, BeamLocator, FittedInfluence, InfluenceTable, Scratch};
pub use config::{ForceBelief, Influence, InfluenceFitError, InfluenceSource, Structure};
pub(crate) use force_linear::is_unsaturated;
pub use force_linear::{DriftCourse, ForceLinearLikelihood, ForceLinearLocator, Scatter, Source};
pub use grid::Axis;
pub use loads::{LoadChannel, NotProportional};
pub use noise::Whitening;
pub use plane::{PlaneLocator, PlaneScratch, PlaneTable, PlateLikelihood};

use crate::detectable_force::DetectableForce;
use crate::fit::{Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::force_prior::ONE_WEIGHT;
use crate::offset_course::OffsetCourse;
use crate::recording::Recording;
use crate::setup::Setup;
use crate::status::{FalseAlarmRate, LINE_PLACES, StatusRule, unknowns};
use measured::{MeasuredInfluence, MeasuredLocator};
use palpate_core::Estimate;
use palpate_mechanics::limit::CramerRaoBound;
use palpate_mechanics::surface::Extent;
use palpate_numerics::NotPositiveDefinite;
use serde::{Deserialize, Serialize};

pub(crate) fn sizes_over_a_model(extent: Extent) -> [usize; 2] {
    let (columns, rows) = prior::mixed_sensors(extent);
    let nodes = match extent {
        Extent::Line { .. } => InfluenceTable::NODES,
        Extent::Plane { .. } => PlaneTable::nodes_over(extent),
    };
    [nodes, columns * rows]
}

/// Locator that inverts influence functions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InfluenceLocator {
    /// A line with a model.
    Beam(Box<BeamLocator>),
    /// A plane with a model.
    Plane(Box<PlaneLocator>),
    /// A surface without a model, with readings linear in the force.
    ForceLinear(Box<ForceLinearLocator>),
    /// A surface without a model, with other readings.
    Measured(Box<MeasuredLocator>),
}

impl Fit for Influence {
    type Method = InfluenceLocator;
    type Error = InfluenceFitError;

    fn fit_method(&self, task: FitTask) -> Result<InfluenceLocator, InfluenceFitError> {
        if task.setup.surface().model().is_none() {
            self.check_measured()?;
            if let Some(fitted) = self.of_one_weight(task).fit_force_linear(task)? {
                return Ok(InfluenceLocator::ForceLinear(Box::new(fitted)));
            }
        }
        if task.setup.surface().model().is_none() {
            let touched = task.recording.touched();
            let task = FitTask { recording: &touched, ..task };
            let fitted = MeasuredInfluence::default().fit_method(task)?;
            return Ok(InfluenceLocator::Measured(Box::new(fitted)));
        }
        if self.structure != Structure::Auto {
            return Err(InfluenceFitError::OnlyOnMeasured { what: "`structure`" });
        }
        if let Some(surface) = task.setup.surface().model() {
            surface.check_solution_watched(task.watch)?;
        }
        if let Extent::Plane { .. } = task.setup.surface().extent() {
            return Ok(InfluenceLocator::Plane(Box::new(self.fit_plane(task)?)));
        }
        Ok(InfluenceLocator::Beam(Box::new(self.fit_beam(task)?)))
    }

    fn drift_course(&self, task: FitTask, asked: &Recording) -> Option<OffsetCourse> {
        self.offset_course(task, asked).ok().flatten()
    }
}

impl Influence {
    /// Returns the smallest detectable force at an unknown force, common to `closed-form` and `digit`.
    pub fn lightest_touch<'a>(&self, limit: &'a CramerRaoBound<'a>) -> DetectableForce<'a> {
        let extent = limit.extent();
        let unknowns = unknowns(extent.dimensions(), None);
        let places = match extent {
            Extent::Line { .. } => LINE_PLACES,
            Extent::Plane { .. } => PlaneTable::places(extent),
        };
        let rule = StatusRule::new(limit.enabled_count(), unknowns, places, self.false_alarm_rate);
        let detection = rule.detection(limit.enabled_count(), unknowns);
        DetectableForce::new(
            detection,
            self.false_alarm_rate,
            limit.noise_sds(),
            Box::new(|contact| limit.whitened_reading(contact)),
        )
    }

    /// Returns the offsets of the channels at the rows of `asked` by the drift of the task's recording;
    /// `None` without a drift or without times.
    ///
    /// Touched rows show a drift only where readings follow the force on a surface without a model.
    ///
    /// # Errors
    /// [`InfluenceFitError`] where influence functions cannot be learnt, or the watch stopped it.
    pub fn offset_course(
        &self,
        task: FitTask,
        asked: &Recording,
    ) -> Result<Option<OffsetCourse>, InfluenceFitError> {
        let by_presses = task.setup.surface().model().is_none()
            && !has_nuisance(task.recording)
            && self.structure != Structure::Free;
        let course = match by_presses {
            true => force_linear::offset_course(task, self.structure, asked)?,
            false => None,
        };
        Ok(course.or_else(|| untouched_rows::offset_course(task.recording, asked)))
    }

    /// Checks the settings; `Corrected` uses the recording alone here.
    fn check_measured(&self) -> Result<(), InfluenceFitError> {
        match self {
            Self { source: InfluenceSource::Mechanics, .. } => Err(InfluenceFitError::NoModel),
            Self { contacts: 2.., .. } => {
                Err(InfluenceFitError::NotOnMeasured { what: "locating several contacts" })
            }
            Self { force_sd_n: Some(_), .. } => Err(InfluenceFitError::NotOnMeasured { what: "`force_sd`" }),
            _ => Ok(()),
        }
    }

    fn fit_force_linear(&self, task: FitTask) -> Result<Option<ForceLinearLocator>, InfluenceFitError> {
        if self.structure == Structure::Free
            || self.structure == Structure::Auto && has_nuisance(task.recording)
        {
            return Ok(None);
        }
        let fitted = force_linear::fit(task, self.structure)?;
        match (fitted, self.structure) {
            (None, Structure::ForceLinear | Structure::ForceSaturating | Structure::ForceMonotone) => {
                Err(InfluenceFitError::NoForces)
            }
            (fitted, _) => Ok(fitted.map(|fitted| fitted.with_false_alarm_rate(self.false_alarm_rate))),
        }
    }

    /// True where the recording permits several structures and none is stated.
    pub(crate) fn has_structures(&self, setup: &Setup, recording: &Recording) -> bool {
        self.structure == Structure::Auto
            && setup.surface().model().is_none()
            && !has_nuisance(recording)
            && force_linear::has_forces(setup, recording)
            && !is_one_weight(setup, recording)
    }

    /// Assumes readings proportional to the force for rows of one weight.
    fn of_one_weight(self, FitTask { setup, recording, .. }: FitTask) -> Self {
        match self.structure {
            Structure::Auto if is_one_weight(setup, recording) => {
                Self { structure: Structure::ForceLinear, ..self }
            }
            _ => self,
        }
    }

    /// Fits the influence functions of a plane with a model.
    ///
    /// # Errors
    /// [`InfluenceFitError`] when the surface has no model, several contacts are asked for, or the recording
    /// is insufficient.
    pub fn fit_plane(&self, task: FitTask) -> Result<PlaneLocator, InfluenceFitError> {
        plane::fit(*self, task)
    }

    /// Fits the influence functions of a line with a model.
    ///
    /// # Errors
    /// [`InfluenceFitError`] when the surface has no model or the recording is insufficient.
    pub fn fit_beam(&self, task: FitTask) -> Result<BeamLocator, InfluenceFitError> {
        beam::fit(*self, task)
    }
}

/// True of calibration rows of nearly one force, for an unknown force.
pub(crate) fn is_one_weight(setup: &Setup, recording: &Recording) -> bool {
    let forces_n = || recording.rows.iter().filter(|row| row.touches()).filter_map(|row| row.force_n);
    let ends = forces_n().reduce(f64::min).zip(forces_n().reduce(f64::max));
    setup.force_n().is_none()
        && ends.is_some_and(|(least_n, most_n)| most_n < ONE_WEIGHT * least_n)
        && !has_nuisance(recording)
        && force_linear::has_forces(setup, recording)
}

fn has_nuisance(recording: &Recording) -> bool {
    recording.rows.iter().any(|row| !row.nuisances.is_empty())
}

impl InfluenceLocator {
    /// Disables channel `channel` (from 0); returns false, without a change, when no channel would remain.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] for a singular noise covariance in a locator file.
    pub fn leave_out(&mut self, channel: usize) -> Result<bool, NotPositiveDefinite> {
        match self {
            Self::Beam(beam) => Ok(beam.leave_out(channel)),
            Self::Plane(plane) => Ok(plane.leave_out(channel)),
            Self::ForceLinear(linear) => Ok(linear.leave_out(channel)),
            Self::Measured(measured) => measured.leave_out(channel),
        }
    }
}

impl InfluenceLocator {
    /// Returns the influence functions; `None` where readings are not a multiple of the force.
    pub fn influences_at_nodes(&self) -> Option<InfluencesAtNodes> {
        match self {
            Self::Beam(beam) => Some(beam.influences_at_nodes()),
            Self::Plane(plane) => Some(plane.influences_at_nodes()),
            Self::ForceLinear(linear) => Some(linear.influences_at_nodes()),
            Self::Measured(_) => None,
        }
    }

    /// True where estimates have a force.
    pub fn estimates_force(&self) -> bool {
        match self {
            Self::Beam(_) | Self::Plane(_) | Self::ForceLinear(_) => true,
            Self::Measured(measured) => measured.estimates_force(),
        }
    }

    /// Returns the false-alarm rate of untouched readings; `None` without detection.
    pub fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        match self {
            Self::Beam(beam) => Some(beam.false_alarm_rate()),
            Self::Plane(plane) => Some(plane.false_alarm_rate()),
            Self::ForceLinear(linear) => Some(linear.false_alarm_rate()),
            Self::Measured(_) => None,
        }
    }
}

impl Locate for InfluenceLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        match self {
            Self::Beam(beam) => beam.locate(reading),
            Self::Plane(plane) => plane.locate(reading),
            Self::ForceLinear(linear) => linear.locate(reading),
            Self::Measured(measured) => measured.locate(reading),
        }
    }

    fn locate_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate]) {
        match self {
            Self::Beam(beam) => beam.locate_batch(readings, channels, estimates),
            Self::Plane(plane) => plane.locate_batch(readings, channels, estimates),
            Self::ForceLinear(linear) => linear.locate_batch(readings, channels, estimates),
            Self::Measured(measured) => measured.locate_batch(readings, channels, estimates),
        }
    }

    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        self.false_alarm_rate()
    }

    fn offsets(&self) -> Option<Vec<f64>> {
        match self {
            Self::Beam(beam) => Some(beam.offsets().to_vec()),
            Self::Plane(plane) => Some(plane.offsets().to_vec()),
            Self::ForceLinear(linear) => Some(linear.offsets()),
            Self::Measured(_) => None,
        }
    }

    fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        match self {
            Self::Beam(beam) => Some(beam.channels().noise_in_use()),
            Self::Plane(plane) => Some(plane.channels().noise_in_use()),
            Self::ForceLinear(linear) => Some(linear.noise_of_channels()),
            Self::Measured(_) => None,
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        match self {
            Self::Beam(beam) => beam.check(setup),
            Self::Plane(plane) => plane.check(setup),
            Self::ForceLinear(linear) => linear.check(setup),
            Self::Measured(measured) => measured.check(setup),
        }
    }
}
