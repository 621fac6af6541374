//! The rig file: one TOML document that says what is on the bench.

mod error;
mod sections;
mod sensor_design;
mod validate;
mod value;

pub use error::{RigError, RigProblem};
pub(crate) use sections::{
    ContactSection, EstimatorSection, RigSections, SensorsSections, SurfaceSection, TrainingSection,
};
pub use sensor_design::{
    ContactPrior, DesignCriterion, KeepOut, MustHave, SensorDesign, SensorOffer, Sites, Symmetry,
};
pub(crate) use validate::validate;
pub(crate) use value::{RawQuantity, positive};

use crate::arrangement::{Arrangement, ArrangementError};
use crate::bench::Bench;
use crate::contact::Position;
use crate::estimator::EstimatorConfig;
use crate::mechanics::modal::ModalBeam;
use crate::mechanics::{Extent, Motion, UniformLoad};

/// A bench, where to press it, and the method that then locates: all checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Surface, sensors and contact.
    pub bench: Bench,
    /// Where to press to calibrate.
    pub training: Option<Training>,
    /// The method that locates.
    pub estimator: EstimatorConfig,
    /// Loads for a load profile to be simulated from.
    pub loads: Vec<UniformLoad>,
    /// How a contact moves, and what moves with it, where the rig says.
    pub motion: Option<MotionRig>,
    /// What a sensor design may choose from, where the rig says.
    pub design: Option<SensorDesign>,
}

/// A moving contact of a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionRig {
    /// Where the contact goes.
    pub motion: Motion,
    /// The beam with its inertia and damping.
    pub beam: ModalBeam,
    /// Readings a second, in hertz; greater than 0.
    pub rate_hz: f64,
}

/// The training positions of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// The rule that places them.
    pub arrangement: Arrangement,
    /// How many there are; at least 1.
    pub count: usize,
    /// How often each is pressed; at least 1.
    pub repeats: usize,
    /// The force of these presses in newtons, where it is not the contact's.
    pub force_n: Option<f64>,
}

impl Training {
    /// The positions on a surface of this `extent`, each once.
    ///
    /// # Errors
    /// [`ArrangementError`]; never for the surface of the rig that this belongs to.
    pub fn positions(&self, extent: Extent) -> Result<Vec<Position>, ArrangementError> {
        self.arrangement.positions(self.count, extent)
    }
}

impl Rig {
    /// The bench as it is when pressed to calibrate: with the force of the training presses.
    pub fn pressed_bench(&self) -> Bench {
        let force_n = self.training.as_ref().and_then(|training| training.force_n);
        Bench { force_n: force_n.or(self.bench.force_n), ..self.bench.clone() }
    }

    /// Reads a rig file.
    ///
    /// # Errors
    /// [`RigError`], with the place in `text`, the value and its bound.
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        validate(&toml::from_str(text).map_err(RigError::from_toml)?)
    }
}

#[cfg(test)]
mod tests;
