//! What a sensor reads when a unit force acts somewhere on the surface; nothing of recordings or estimators.

mod beam;
mod digit;
mod elastica;
mod extent;
mod insensitive_sensor;
mod load;
pub mod modal;
mod motion;
pub mod plate;
mod response;
mod supported_beam;
mod surface_spec;

pub use beam::{Beam, BeamError};
pub use digit::{Digit, DigitError};
pub use elastica::{Elastica, ForceDirection};
pub use extent::Extent;
pub use insensitive_sensor::InsensitiveSensor;
pub use load::{UniformLoad, midpoints};
pub use motion::Motion;
pub use plate::{Plate, PlateError};
pub use response::{Proportional, ResponseFunction, ResponseGradient};
pub use supported_beam::{
    BeamPart, BeamSection, BeamSupport, BeamSupportKind, RigidMotion, SupportedBeam, SupportedBeamError,
    SupportedBeamSpec,
};
pub use surface_spec::SurfaceSpec;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::Position;
use crate::sensing::SensorKind;

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

    /// What a sensor reads under any force, its influence times the force unless the surface bends too far for that.
    fn response_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn ResponseFunction + '_> {
        Arc::new(Proportional(self.influence_function(kind, sensor)))
    }

    /// One value of an influence function, where no other of the same sensor is wanted.
    fn influence(&self, kind: SensorKind, sensor: Position, contact: Position) -> f64 {
        self.influence_function(kind, sensor).at(contact)
    }

    /// Whether a support at `position` takes up force, so that its reaction can be measured.
    fn is_supported_at(&self, position: Position) -> bool;

    /// Where supports take up force at single places, so that a reaction can be measured there, from left to right.
    fn force_supports(&self) -> Vec<Position> {
        Vec::new()
    }

    /// Why a sensor of this `kind` at `sensor` reads 0 wherever the surface is touched; `None` where it reads something.
    fn insensitive_sensor(&self, _kind: SensorKind, _sensor: Position) -> Option<InsensitiveSensor> {
        None
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

/// What one sensor reads per newton of downward force, as a function of where the force acts.
pub trait InfluenceFunction: Send + Sync {
    /// The reading per newton of downward force at `contact`, in SI units per newton (m/N, rad/N, 1/N, N/N); 0 for a raw
    /// channel, which no model explains. Off the surface the value has no meaning.
    fn at(&self, contact: Position) -> f64;

    /// How fast it changes as the contact moves along x and along y, in its unit per metre; 0 along y on a
    /// one-dimensional surface. Where the influence has a kink, some value between those of its two sides.
    fn gradient(&self, contact: Position) -> [f64; 2];
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
    /// The first dimension, by name and value, that is not positive and finite, as an error.
    fn check(&self) -> Result<(), (&'static str, f64)> {
        let dimensions = [
            ("length", self.length_m),
            ("width", self.width_m),
            ("thickness", self.thickness_m),
            ("youngs_modulus", self.youngs_modulus_pa),
        ];
        first_not_positive(&dimensions).map_or(Ok(()), Err)
    }

    /// E·I in N·m², with I = width·t³/12.
    fn bending_stiffness(&self) -> f64 {
        self.youngs_modulus_pa * self.width_m * self.thickness_m.powi(3) / 12.0
    }
}

/// The first of some dimensions, by name and value, that is not a positive, finite number.
fn first_not_positive(dimensions: &[(&'static str, f64)]) -> Option<(&'static str, f64)> {
    dimensions.iter().copied().find(|(_, value)| !(*value > 0.0 && value.is_finite()))
}

#[cfg(test)]
mod tests;
