//! The rig file: one TOML document that says what is on the bench.

mod design;
mod document;
mod error;
mod estimator;
mod file;
mod motion;
mod recording;
mod sensor_design;
mod sensors;
mod study;
mod surface;
mod training;
mod values;

pub use error::{RigError, RigProblem};
pub use sensor_design::{
    ContactPrior, DesignCriterion, KeepOut, MustHave, SensorDesign, SensorOffer, Sites, Symmetry,
};
pub use study::{Arm, AskedLayout, Judging, Study, StudyError, StudyProblem};

use crate::arrangement::{Arrangement, ArrangementError};
use crate::bench::Bench;
use crate::contact::{Contact, Position};
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

/// The moving contacts of a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionRig {
    /// The contact, or the first of two.
    pub first: MovingContact,
    /// The other one.
    pub second: Option<MovingContact>,
    /// The beam with its inertia and damping; nothing for a plate, which is in balance at every reading.
    pub beam: Option<ModalBeam>,
    /// Readings a second, in hertz; greater than 0.
    pub rate_hz: f64,
}

/// One contact that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingContact {
    /// Where it goes.
    pub motion: Motion,
    /// Its force in newtons, where that is not the one of the rig's presses.
    pub force_n: Option<f64>,
}

impl MotionRig {
    /// How long it takes until every contact has arrived, in seconds.
    pub fn duration_s(&self) -> f64 {
        self.moving().map(|contact| contact.motion.duration_s()).fold(0.0, f64::max)
    }

    /// The contacts at `time_s`; `force_n` is the force, in newtons, of those that have none of their own.
    pub fn contacts_at(&self, time_s: f64, force_n: f64) -> Vec<Contact> {
        let at =
            |contact: MovingContact| contact.motion.contact_at(time_s, contact.force_n.unwrap_or(force_n));
        self.moving().map(at).collect()
    }

    /// The same contacts, the first at another speed between its turns.
    #[must_use]
    pub fn at_speed(self, speed_m_per_s: f64) -> Self {
        let motion = Motion { speed_m_per_s, ..self.first.motion };
        Self { first: MovingContact { motion, ..self.first }, ..self }
    }

    fn moving(&self) -> impl Iterator<Item = MovingContact> {
        std::iter::once(self.first).chain(self.second)
    }
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
}

#[cfg(test)]
mod tests;
