//! Surfaces and their influence functions: the reading of a sensor under a unit force at a position. Recordings and estimators are elsewhere.

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

/// An elastic surface with a model of its mechanics.
///
/// Forces are positive downward, deflections upward, so deflections are negative as in the founding paper's eq. (1).
pub trait Surface: Send + Sync {
    /// The influence function of a sensor of this `kind` at `sensor`, which must be on the surface. On a surface of finite elements
    /// each call takes one solution, so keep the result.
    fn influence_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_>;

    /// The influence functions of several sensors of one kind; some surfaces compute them faster together than one by one.
    fn influence_functions(
        &self,
        kind: SensorKind,
        sensors: &[Position],
    ) -> Vec<Arc<dyn InfluenceFunction + '_>> {
        sensors.iter().map(|sensor| self.influence_function(kind, *sensor)).collect()
    }

    /// The influence functions of several sensors of one kind, watched during the solution.
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

    /// The response function of a sensor: influence times force, unless the surface bends too far for that.
    fn response_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn ResponseFunction + '_> {
        Arc::new(Proportional(self.influence_function(kind, sensor)))
    }

    /// The response functions of several sensors of one kind, in the way of [`Surface::influence_functions`].
    fn response_functions(
        &self,
        kind: SensorKind,
        sensors: &[Position],
    ) -> Vec<Arc<dyn ResponseFunction + '_>> {
        sensors.iter().map(|sensor| self.response_function(kind, *sensor)).collect()
    }

    /// The response functions of several sensors of one kind, watched during the solution.
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

    /// Readings of many sensors, contact by contact; `None` where a surface has no faster way than influence
    /// functions.
    fn readings_by_contact(
        &self,
        _sensors: &[(SensorKind, Position)],
    ) -> Option<Arc<dyn ReadingsByContact + '_>> {
        None
    }

    /// Estimated work and memory of solving the surface for this number of sensors, without a solution. `None` for closed forms, which take
    /// almost no work and are not solved by contact.
    fn solution_cost(&self, _sensors: usize, _solving: Solving) -> Option<SolutionCost> {
        None
    }

    /// One value of an influence function, for a single use of the sensor.
    fn influence(&self, kind: SensorKind, sensor: Position, contact: Position) -> f64 {
        self.influence_function(kind, sensor).at(contact)
    }

    /// True when a support at `position` has a reaction force, which can be measured.
    fn is_supported_at(&self, position: Position) -> bool;

    /// Positions of single supports with a measurable reaction force, from left to right.
    fn force_supports(&self) -> Vec<Position> {
        Vec::new()
    }

    /// Reason for which a sensor of this `kind` at `sensor` reads 0 for every contact; `None` for a sensitive sensor.
    fn insensitive_sensor(&self, _kind: SensorKind, _sensor: Position) -> Option<InsensitiveSensor> {
        None
    }

    /// Solves the surface, where necessary, and checks that it is in balance under forces all over it. Before this check, and
    /// where no solution exists, the surface's functions may be NaN.
    ///
    /// # Errors
    /// [`Unsolvable`], with the singular equations or the imbalance.
    fn check_solution(&self) -> Result<(), Unsolvable> {
        self.check_solution_watched(Watch::NONE)
    }

    /// Checks the solution as [`Surface::check_solution`] does, watched; a stop leaves the surface unchanged.
    ///
    /// # Errors
    /// As [`Surface::check_solution`], and [`Unsolvable::Cancelled`].
    fn check_solution_watched(&self, watch: Watch) -> Result<(), Unsolvable> {
        Ok(watch.round()?)
    }

    /// The largest magnitude of `influence` for this `kind`, over all sensor and contact positions.
    fn full_scale(&self, kind: SensorKind) -> f64;

    /// The extent of the surface.
    fn extent(&self) -> Extent;

    /// Length l of the surface along x, in metres.
    fn length_m(&self) -> f64 {
        self.extent().length_m()
    }

    /// True for a `position` on the surface, its boundary included.
    fn contains(&self, position: Position) -> bool {
        self.extent().contains(position)
    }
}

/// Influence function of one sensor: its reading per newton of downward force, as a function of the contact's position.
pub trait InfluenceFunction: Send + Sync {
    /// The reading per newton of downward force at `contact`, in SI units per newton (m/N, rad/N, 1/N, N/N); 0 for a raw
    /// channel, which has no model. Off the surface the value has no meaning.
    fn at(&self, contact: Position) -> f64;

    /// Derivatives with respect to the contact's position along x and along y, in the reading's unit per newton and metre; 0 along y on a
    /// one-dimensional surface. At a kink, a value between those of the two sides.
    fn gradient(&self, contact: Position) -> [f64; 2];
}

/// Response function of one sensor: its reading as a function of the contact's position and force.
pub trait ResponseFunction: Send + Sync {
    /// The reading at `contact`, in the sensor's SI unit; 0 for a raw channel. Off the surface the value has no meaning.
    fn at(&self, contact: Contact) -> f64;

    /// Derivatives of the reading with respect to the contact. At a kink, a value between those of the two sides.
    fn gradient(&self, contact: Contact) -> ResponseGradient;
}

/// The derivatives of a reading with respect to its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponseGradient {
    /// With respect to the contact's position along x and along y, in the reading's unit per metre.
    pub position: [f64; 2],
    /// With respect to the contact's force, in the reading's unit per newton.
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

/// Reason for which a sensor reads 0 for every contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InsensitiveSensor {
    /// A support of a beam fixes the measured quantity.
    #[error("{} there", held(*kind))]
    Held {
        /// Quantity that the sensor measures.
        kind: SensorKind,
    },
    /// The edge of a plate fixes the measured quantity.
    #[error("the {edge} edge, which is {held}, has no {kind} for any contact")]
    AtEdge {
        /// Name of the edge.
        edge: &'static str,
        /// Condition along that edge.
        held: &'static str,
        /// Quantity that the sensor measures.
        kind: SensorKind,
    },
    /// The deflection of a plate over a rigid support.
    #[error("simple support {number} keeps the plate from deflecting there")]
    AtSupport {
        /// Number of the support, from 1.
        number: usize,
    },
}

/// Text of the reason for which a beam's sensor of this kind reads 0.
fn held(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Deflection => "a support fixes the surface",
        SensorKind::Slope => "a support fixes the slope",
        SensorKind::Strain => "the surface does not bend",
        SensorKind::Reaction | SensorKind::Raw => "no force acts",
    }
}

/// The description of a surface.
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
    /// A surface without a model, for which only recordings exist.
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
    /// The extent of the surface.
    pub fn extent(&self) -> Extent {
        match self {
            Self::Beam(beam) => beam.extent(),
            Self::SupportedBeam(beam) => beam.extent(),
            Self::Plate(plate) => plate.extent(),
            Self::Digit(digit) => digit.extent(),
            Self::Measured(extent) => *extent,
        }
    }

    /// The mechanics of the surface; `None` without a model.
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
    /// Checks that length, width, thickness and Young's modulus are positive and finite; `names` are for the error.
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
