//! What a sensor reads when a unit force acts somewhere on the surface; nothing of recordings or estimators.

mod beam;
mod differences;
mod extent;
mod surface_spec;

pub use beam::{Beam, BeamError};
pub use extent::Extent;
pub use surface_spec::SurfaceSpec;

use crate::contact::Position;
use crate::sensing::SensorKind;

/// An elastic surface with a model.
///
/// Forces are positive downward, deflections upward, so deflections are negative as in the founding paper's eq. (1).
pub trait Surface {
    /// What a sensor of this `kind` at `sensor` reads per newton of downward force at `contact`, in SI units per
    /// newton (m/N, rad/N, 1/N, N/N); 0 for a raw channel, which no model explains.
    ///
    /// Both positions must be on the surface; elsewhere the value has no meaning.
    fn influence(&self, kind: SensorKind, sensor: Position, contact: Position) -> f64;

    /// How fast the influence changes as the contact moves along x and along y: (∂/∂x, ∂/∂y) of [`Surface::influence`],
    /// in its unit per metre; 0 along y on a one-dimensional surface. Where the influence has a kink, some value
    /// between those of its two sides.
    ///
    /// A model that knows it in closed form says so. This default takes differences of second order, precise to about
    /// 10⁻¹⁰ of the full scale over the size of the surface.
    fn influence_gradient(&self, kind: SensorKind, sensor: Position, contact: Position) -> [f64; 2] {
        differences::gradient(self.extent(), contact, |at| self.influence(kind, sensor, at))
    }

    /// The largest magnitude that `influence` has for this `kind`, over all sensor and contact positions.
    fn full_scale(&self, kind: SensorKind) -> f64;

    /// The area that can be touched.
    fn extent(&self) -> Extent;

    /// Length l of the surface along x, in metres.
    fn length_m(&self) -> f64 {
        self.extent().length_m
    }

    /// Whether `position` is on the surface, its boundary included.
    fn contains(&self, position: Position) -> bool {
        self.extent().contains(position)
    }
}

#[cfg(test)]
mod tests;
