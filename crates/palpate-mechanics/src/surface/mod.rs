//! Elastic surfaces and their influence functions.

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

/// A surface with a mechanical model.
///
/// Forces are positive downward, deflections upward (founding paper, eq. 1).
pub trait Surface: Send + Sync {
    /// Returns an influence function; on finite elements by one solution.
    fn influence_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_>;

    /// Returns several influence functions.
    fn influence_functions(
        &self,
        kind: SensorKind,
        sensors: &[Position],
    ) -> Vec<Arc<dyn InfluenceFunction + '_>> {
        sensors.iter().map(|sensor| self.influence_function(kind, *sensor)).collect()
    }

    /// Returns [`Surface::influence_functions`], watched.
    ///
    /// # Errors
    /// [`Cancelled`].
    fn influence_functions_watched(
        &self,
        kind: SensorKind,
        sensors: &[Position],
        watch: Watch,
    ) -> Result<Vec<Arc<dyn InfluenceFunction + '_>>, Cancelled> {
        watch.round()?;
        Ok(self.influence_functions(kind, sensors))
    }

    /// Returns a response function.
    fn response_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn ResponseFunction + '_> {
        Arc::new(Proportional(self.influence_function(kind, sensor)))
    }

    /// Returns several response functions.
    fn response_functions(
        &self,
        kind: SensorKind,
        sensors: &[Position],
    ) -> Vec<Arc<dyn ResponseFunction + '_>> {
        sensors.iter().map(|sensor| self.response_function(kind, *sensor)).collect()
    }

    /// Returns [`Surface::response_functions`], watched.
    ///
    /// # Errors
    /// [`Cancelled`].
    fn response_functions_watched(
        &self,
        kind: SensorKind,
        sensors: &[Position],
        watch: Watch,
    ) -> Result<Vec<Arc<dyn ResponseFunction + '_>>, Cancelled> {
        watch.round()?;
        Ok(self.response_functions(kind, sensors))
    }

    /// Returns readings by contact, if that is faster for many sensors.
    fn readings_by_contact(
        &self,
        _sensors: &[(SensorKind, Position)],
    ) -> Option<Arc<dyn ReadingsByContact + '_>> {
        None
    }

    /// Estimates the cost of solutions; `None` for closed forms.
    fn solution_cost(&self, _sensors: usize, _solving: Solving) -> Option<SolutionCost> {
        None
    }

    /// Returns one value of an influence function.
    fn influence(&self, kind: SensorKind, sensor: Position, contact: Position) -> f64 {
        self.influence_function(kind, sensor).at(contact)
    }

    /// True for a support with a reaction force.
    fn is_supported_at(&self, position: Position) -> bool;

    /// Supports with a reaction force, from left to right.
    fn force_supports(&self) -> Vec<Position> {
        Vec::new()
    }

    /// Reason for which a sensor reads 0 for every contact.
    fn insensitive_sensor(&self, _kind: SensorKind, _sensor: Position) -> Option<InsensitiveSensor> {
        None
    }

    /// Solves the surface and checks its balance; otherwise functions may be NaN.
    ///
    /// # Errors
    /// [`Unsolvable`].
    fn check_solution(&self) -> Result<(), Unsolvable> {
        self.check_solution_watched(Watch::NONE)
    }

    /// Checks as [`Surface::check_solution`], watched.
    ///
    /// # Errors
    /// [`Unsolvable`]; cancelled work leaves the surface unchanged.
    fn check_solution_watched(&self, watch: Watch) -> Result<(), Unsolvable> {
        Ok(watch.round()?)
    }

    /// Largest magnitude of `influence`.
    fn full_scale(&self, kind: SensorKind) -> f64;

    /// Extent of the surface.
    fn extent(&self) -> Extent;

    /// Length l along x.
    fn length_m(&self) -> f64 {
        self.extent().length_m()
    }

    /// True for a position on the surface.
    fn contains(&self, position: Position) -> bool {
        self.extent().contains(position)
    }
}

/// Influence function of a sensor.
pub trait InfluenceFunction: Send + Sync {
    /// Reading per newton of downward force, in SI units; 0 for a raw channel.
    fn at(&self, contact: Position) -> f64;

    /// Derivatives by x and y; at a kink, between both sides.
    fn gradient(&self, contact: Position) -> [f64; 2];
}

/// Response function of a sensor.
pub trait ResponseFunction: Send + Sync {
    /// Reading, in SI units; 0 for a raw channel.
    fn at(&self, contact: Contact) -> f64;

    /// Derivatives; at a kink, between both sides.
    fn gradient(&self, contact: Contact) -> ResponseGradient;
}

/// Derivatives of a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponseGradient {
    /// By x and y.
    pub position: [f64; 2],
    /// By the force.
    pub force: f64,
}

/// Response proportional to the force.
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

/// Reason for which a sensor reads 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InsensitiveSensor {
    /// A beam's support fixes the measured quantity.
    #[error("{} there", constraint_name(*kind))]
    Held {
        /// Measured quantity.
        kind: SensorKind,
    },
    /// A plate's edge fixes the measured quantity.
    #[error("the {edge} edge, which is {constraint}, has no {kind} for any contact")]
    AtEdge {
        /// Name of the edge.
        edge: &'static str,
        /// Edge condition.
        constraint: &'static str,
        /// Measured quantity.
        kind: SensorKind,
    },
    /// A rigid support prevents deflection.
    #[error("simple support {number} keeps the plate from deflecting there")]
    AtSupport {
        /// Number of the support.
        number: usize,
    },
}

fn constraint_name(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Deflection => "a support fixes the surface",
        SensorKind::Slope => "a support fixes the slope",
        SensorKind::Strain => "the surface does not bend",
        SensorKind::Reaction | SensorKind::Raw => "no force acts",
    }
}

/// Description of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceSpec {
    /// A simply supported beam.
    Beam(Beam),
    /// A beam with any supports and sections.
    SupportedBeam(Box<SupportedBeam>),
    /// A rectangular plate.
    Plate(Plate),
    /// A cantilever finger.
    Digit(Digit),
    /// A surface without a model.
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
    /// Extent of the surface.
    pub fn extent(&self) -> Extent {
        match self {
            Self::Beam(beam) => beam.extent(),
            Self::SupportedBeam(beam) => beam.extent(),
            Self::Plate(plate) => plate.extent(),
            Self::Digit(digit) => digit.extent(),
            Self::Measured(extent) => *extent,
        }
    }

    /// Model, if any.
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

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Strip {
    length_m: f64,
    width_m: f64,
    thickness_m: f64,
    youngs_modulus_pa: f64,
}

impl Strip {
    fn check(&self, names: [&'static str; 4]) -> Result<(), OutOfRange> {
        let values = [self.length_m, self.width_m, self.thickness_m, self.youngs_modulus_pa];
        OutOfRange::check_positive(names.into_iter().zip(values))
    }

    fn bending_stiffness(&self) -> f64 {
        self.youngs_modulus_pa * self.width_m * self.thickness_m.powi(3) / 12.0
    }
}

#[cfg(test)]
mod tests;
