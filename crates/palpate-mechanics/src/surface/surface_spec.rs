//! A surface as data: what a rig describes and a locator file carries.

use serde::{Deserialize, Serialize};

use super::{Beam, Digit, Extent, Plate, SupportedBeam, Surface};

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
