//! A beam on any supports, as data.

use serde::{Deserialize, Serialize};

/// A straight beam of rectangular sections and what holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportedBeamSpec {
    /// Length l, in metres.
    pub length_m: f64,
    /// Young's modulus E, in pascals.
    pub youngs_modulus_pa: f64,
    /// Stretches of one section each, from left to right, which together are the beam.
    pub sections: Vec<BeamSection>,
    /// What holds it, in any order.
    pub supports: Vec<BeamSupport>,
}

/// A stretch of the beam that has one width and thickness. It begins where the one before it ends, the first at 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamSection {
    /// Where it ends, in metres.
    pub to_m: f64,
    /// Width of the section, in metres.
    pub width_m: f64,
    /// Thickness t of the section, in metres.
    pub thickness_m: f64,
}

/// A support.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamSupport {
    /// Where it is, in metres from the beam's left end.
    pub at_m: f64,
    /// How it holds the beam.
    pub kind: BeamSupportKind,
}

/// How a support holds the beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum BeamSupportKind {
    /// No deflection, free to turn.
    Simple,
    /// Neither deflection nor slope.
    Clamped,
    /// No slope, free to deflect.
    Guided,
    /// Not at all: an end of the beam without a support, said so.
    Free,
    /// A spring under the beam.
    Elastic {
        /// Upward force per metre of downward deflection, in N/m.
        stiffness_n_per_m: f64,
        /// Couple against the slope, in N·m/rad; `None` where it is free to turn.
        rotational_stiffness_nm_per_rad: Option<f64>,
    },
}

impl BeamSection {
    /// Bending stiffness E·I in N·m², with I = width·t³/12.
    pub fn bending_stiffness(&self, youngs_modulus_pa: f64) -> f64 {
        youngs_modulus_pa * self.width_m * self.thickness_m.powi(3) / 12.0
    }
}

impl BeamSupportKind {
    /// Its name in a rig.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Simple => "simple",
            Self::Clamped => "clamped",
            Self::Guided => "guided",
            Self::Free => "free",
            Self::Elastic { .. } => "elastic",
        }
    }

    /// Whether it takes up force across the beam.
    pub const fn takes_force(self) -> bool {
        matches!(self, Self::Simple | Self::Clamped | Self::Elastic { .. })
    }

    /// Whether it takes up a couple.
    pub const fn takes_couple(self) -> bool {
        matches!(
            self,
            Self::Clamped | Self::Guided | Self::Elastic { rotational_stiffness_nm_per_rad: Some(_), .. }
        )
    }
}
