//! A surface as data: what a rig describes and a locator file carries.

use serde::{Deserialize, Serialize};

use super::{Beam, Digit, Extent, Surface};

/// The surface that is touched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceSpec {
    /// A simply supported beam.
    Beam(Beam),
    /// A flexible cantilever finger.
    Digit(Digit),
    /// A surface without a model, known by recordings only.
    Measured(Extent),
}

impl SurfaceSpec {
    /// The area that can be touched.
    pub fn extent(&self) -> Extent {
        match self {
            Self::Beam(beam) => beam.extent(),
            Self::Digit(digit) => digit.extent(),
            Self::Measured(extent) => *extent,
        }
    }

    /// Its mechanics, where it has a model.
    pub fn model(&self) -> Option<&dyn Surface> {
        match self {
            Self::Beam(beam) => Some(beam),
            Self::Digit(digit) => Some(digit),
            Self::Measured(_) => None,
        }
    }
}
