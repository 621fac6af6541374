//! Surfaces and their influence functions: the reading of a sensor when a unit force acts somewhere; nothing of recordings or estimators.

mod beam;
mod by_contact;
mod digit;
mod elastica;
mod load;
pub mod modal;
mod motion;
pub mod plate;
mod supported_beam;

pub use crate::contact::Extent;
pub use beam::{Beam, BeamError};
pub use by_contact::{ContactLoad, Influences, ReadingsByContact, SolutionCost, Solving};
pub use digit::{Digit, DigitError};
pub use elastica::{Elastica, ForceDirection};
pub use load::{UniformLoad, midpoints};
pub use motion::Motion;
pub use plate::{Plate, PlateError, Unsolvable};
pub use supported_beam::{
    BeamPart, BeamSection, BeamSupport, BeamSupportKind, RigidMotion, SupportedBeam, SupportedBeamError,
    SupportedBeamSpec,
};

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::{Contact, Position};
use crate::sensing::SensorKind;
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::{Cancelled, Watch};

/// An elastic surface with a model.
///
/// Forces are positive downward, deflections upward, so deflections are negative as in the founding paper's eq. (1).
pub trait Surface: Send + Sync {
    /// The influence function of a sensor of this `kind` at `sensor`, which must be on the surface. On a surface that is
    /// solved by elements this is one solution, so ask once and keep the answer.
    fn influence_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_>;

    /// The influence functions of several sensors of one kind; some surfaces have them sooner together than one by one.
    fn influence_functions(
        &self,
        kind: SensorKind,
        sensors: &[Position],
    ) -> Vec<Arc<dyn InfluenceFunction + '_>> {
        sensors.iter().map(|sensor| self.influence_function(kind, *sensor)).collect()
    }

    /// The same, watched while the surface is solved.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch stopped it.
    fn influence_functions_watched(
        &self,
        kind: SensorKind,
        sensors: &[Position],
        watch: Watch,
    ) -> Result<Vec<Arc<dyn InfluenceFunction + '_>>, Cancelled> {
        watch.round()?;
        Ok(self.influence_functions(kind, sensors))
    }

    /// The response function of a sensor: its influence times the force, unless the surface bends too far for that.
    fn response_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn ResponseFunction + '_> {
        Arc::new(Proportional(self.influence_function(kind, sensor)))
    }

    /// The response functions of several sensors of one kind, as [`Surface::influence_functions`] has their influence functions.
    fn response_functions(
        &self,
        kind: SensorKind,
        sensors: &[Position],
    ) -> Vec<Arc<dyn ResponseFunction + '_>> {
        sensors.iter().map(|sensor| self.response_function(kind, *sensor)).collect()
    }

    /// The same, watched while the surface is solved.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch stopped it.
    fn response_functions_watched(
        &self,
        kind: SensorKind,
        sensors: &[Position],
        watch: Watch,
    ) -> Result<Vec<Arc<dyn ResponseFunction + '_>>, Cancelled> {
        watch.round()?;
        Ok(self.response_functions(kind, sensors))
    }

    /// Readings of many sensors, contact by contact; `None` where a surface has nothing that is sooner than their influence
    /// functions.
    fn readings_by_contact(
        &self,
        _sensors: &[(SensorKind, Position)],
    ) -> Option<Arc<dyn ReadingsByContact + '_>> {
        None
    }

    /// Work and memory of solving the surface for so many sensors, by an estimate that solves nothing; `None` where closed forms take next
    /// to none, and nothing is solved by contact.
    fn solution_cost(&self, _sensors: usize, _solving: Solving) -> Option<SolutionCost> {
        None
    }

    /// One value of an influence function, where no other of the same sensor is wanted.
    fn influence(&self, kind: SensorKind, sensor: Position, contact: Position) -> f64 {
        self.influence_function(kind, sensor).at(contact)
    }

    /// Whether a support at `position` takes up force, so that its reaction can be measured.
    fn is_supported_at(&self, position: Position) -> bool;

    /// Positions at which single supports take up force, so that a reaction can be measured there, from left to right.
    fn force_supports(&self) -> Vec<Position> {
        Vec::new()
    }

    /// Reason for which a sensor of this `kind` at `sensor` reads 0 wherever the surface is touched; `None` where it reads something.
    fn insensitive_sensor(&self, _kind: SensorKind, _sensor: Position) -> Option<InsensitiveSensor> {
        None
    }

    /// Solves the surface, where that has to be done, and checks that it is in balance under forces all over it; before that is known, and
    /// where it cannot be solved, its functions may be NaN.
    ///
    /// # Errors
    /// [`Unsolvable`], with what is singular or out of balance.
    fn check_solution(&self) -> Result<(), Unsolvable> {
        self.check_solution_watched(Watch::NONE)
    }

    /// The same, watched; where it was stopped, the surface is as it was before.
    ///
    /// # Errors
    /// As [`Surface::check_solution`], and [`Unsolvable::Cancelled`].
    fn check_solution_watched(&self, watch: Watch) -> Result<(), Unsolvable> {
        Ok(watch.round()?)
    }

    /// The largest magnitude that `influence` has for this `kind`, over all sensor and contact positions.
    fn full_scale(&self, kind: SensorKind) -> f64;

    /// The area that can be touched.
    fn extent(&self) -> Extent;

    /// Length l of the surface along x, in metres.
    fn length_m(&self) -> f64 {
        self.extent().length_m()
    }

    /// Whether `position` is on the surface, its boundary included.
    fn contains(&self, position: Position) -> bool {
        self.extent().contains(position)
    }
}

/// Influence function of one sensor: its reading per newton of downward force, as a function of where the force acts.
pub trait InfluenceFunction: Send + Sync {
    /// The reading per newton of downward force at `contact`, in SI units per newton (m/N, rad/N, 1/N, N/N); 0 for a raw
    /// channel, which no model explains. Off the surface the value has no meaning.
    fn at(&self, contact: Position) -> f64;

    /// Derivatives by the contact's position along x and along y, in its unit per metre; 0 along y on a
    /// one-dimensional surface. Where the influence has a kink, some value between those of its two sides.
    fn gradient(&self, contact: Position) -> [f64; 2];
}

/// Response function of one sensor: its reading as a function of the contact's position and force.
pub trait ResponseFunction: Send + Sync {
    /// The reading at `contact`, in the sensor's SI unit; 0 for a raw channel. Off the surface the value has no meaning.
    fn at(&self, contact: Contact) -> f64;

    /// Derivatives of the reading by the contact. Where it has a kink, some value between those of its two sides.
    fn gradient(&self, contact: Contact) -> ResponseGradient;
}

/// The derivatives of a reading by its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponseGradient {
    /// By the contact's position along x and along y, in the reading's unit per metre.
    pub position: [f64; 2],
    /// By its force, in the reading's unit per newton.
    pub force: f64,
}

/// Readings that are proportional to the force: force × influence.
#[derive(Clone)]
pub struct Proportional<'a>(pub Arc<dyn InfluenceFunction + 'a>);

impl ResponseFunction for Proportional<'_> {
    fn at(&self, contact: Contact) -> f64 {
        contact.force_n * self.0.at(contact.position)
    }

    fn gradient(&self, contact: Contact) -> ResponseGradient {
        let position = self.0.gradient(contact.position).map(|slope| contact.force_n * slope);
        ResponseGradient { position, force: self.0.at(contact.position) }
    }
}

/// Reason for which a sensor reads 0 wherever the surface is touched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InsensitiveSensor {
    /// A support of a beam holds what it measures.
    #[error("{} there", held(*kind))]
    Held {
        /// Quantity that the sensor measures.
        kind: SensorKind,
    },
    /// The edge of a plate cannot move so.
    #[error("the {edge} edge, which is {held}, has no {kind} wherever the plate is touched")]
    AtEdge {
        /// Which edge.
        edge: &'static str,
        /// Condition along that edge.
        held: &'static str,
        /// Quantity that the sensor measures.
        kind: SensorKind,
    },
    /// The deflection of a plate over a support that does not give.
    #[error("simple support {number} keeps the plate from deflecting there")]
    AtSupport {
        /// Which support, from 1.
        number: usize,
    },
}

/// Reason for which a support leaves a sensor of this kind nothing to read.
fn held(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Deflection => "a support holds the surface",
        SensorKind::Slope => "a support holds the slope",
        SensorKind::Strain => "nothing bends the surface",
        SensorKind::Reaction | SensorKind::Raw => "nothing acts",
    }
}

/// The surface that is touched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceSpec {
    /// A simply supported beam.
    Beam(Beam),
    /// A beam on any supports, with any sections.
    SupportedBeam(Box<SupportedBeam>),
    /// A rectangular plate.
    Plate(Plate),
    /// A flexible cantilever finger.
    Digit(Digit),
    /// A surface without a model, known by recordings only.
    Measured(Extent),
}

impl From<Beam> for SurfaceSpec {
    fn from(beam: Beam) -> Self {
        Self::Beam(beam)
    }
}

impl From<SupportedBeam> for SurfaceSpec {
    fn from(beam: SupportedBeam) -> Self {
        Self::SupportedBeam(Box::new(beam))
    }
}

impl From<Plate> for SurfaceSpec {
    fn from(plate: Plate) -> Self {
        Self::Plate(plate)
    }
}

impl From<Digit> for SurfaceSpec {
    fn from(digit: Digit) -> Self {
        Self::Digit(digit)
    }
}

impl From<Extent> for SurfaceSpec {
    fn from(extent: Extent) -> Self {
        Self::Measured(extent)
    }
}

impl SurfaceSpec {
    /// The area that can be touched.
    pub fn extent(&self) -> Extent {
        match self {
            Self::Beam(beam) => beam.extent(),
            Self::SupportedBeam(beam) => beam.extent(),
            Self::Plate(plate) => plate.extent(),
            Self::Digit(digit) => digit.extent(),
            Self::Measured(extent) => *extent,
        }
    }

    /// Its mechanics, where it has a model.
    pub fn model(&self) -> Option<&dyn Surface> {
        match self {
            Self::Beam(beam) => Some(beam),
            Self::SupportedBeam(beam) => Some(beam.as_ref()),
            Self::Plate(plate) => Some(plate),
            Self::Digit(digit) => Some(digit),
            Self::Measured(_) => None,
        }
    }
}

/// A straight strip of rectangular section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Strip {
    length_m: f64,
    width_m: f64,
    thickness_m: f64,
    youngs_modulus_pa: f64,
}

impl Strip {
    /// Checks that length, width, thickness and Young's modulus, named so in the error, are positive and finite.
    fn check(&self, names: [&'static str; 4]) -> Result<(), OutOfRange> {
        let values = [self.length_m, self.width_m, self.thickness_m, self.youngs_modulus_pa];
        OutOfRange::check_positive(names.into_iter().zip(values))
    }

    /// E·I in N·m², with I = width·t³/12.
    fn bending_stiffness(&self) -> f64 {
        self.youngs_modulus_pa * self.width_m * self.thickness_m.powi(3) / 12.0
    }
}

#[cfg(test)]
mod tests;
