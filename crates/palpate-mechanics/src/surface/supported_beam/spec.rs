//! Description of a beam on any supports.

use serde::{Deserialize, Serialize};

use crate::units::{Dimension, Quantity, format_length_mm};
use palpate_numerics::OutOfRange;

/// A rectangular beam on supports, checked by [`SupportedBeam::new`](super::SupportedBeam::new).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportedBeamSpec {
    /// Length l.
    pub length_m: f64,
    /// Young's modulus E.
    pub youngs_modulus_pa: f64,
    /// Parts from left to right.
    pub sections: Vec<BeamSection>,
    /// Supports.
    pub supports: Vec<BeamSupport>,
}

/// A part of constant section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamSection {
    /// End.
    pub to_m: f64,
    /// Width.
    pub width_m: f64,
    /// Thickness t.
    pub thickness_m: f64,
}

/// A support.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamSupport {
    /// Position.
    pub at_m: f64,
    /// The kind.
    pub kind: BeamSupportKind,
}

/// Kind of a support.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum BeamSupportKind {
    /// No deflection.
    Simple,
    /// No deflection, no slope.
    Clamped,
    /// No slope.
    Guided,
    /// A free end.
    Free,
    /// A spring.
    Elastic {
        /// Stiffness.
        stiffness_n_per_m: f64,
        /// Rotational stiffness.
        rotational_stiffness_nm_per_rad: Option<f64>,
    },
}

impl BeamSection {
    /// E·I in N·m², I = width·t³/12.
    pub fn bending_stiffness(&self, youngs_modulus_pa: f64) -> f64 {
        youngs_modulus_pa * self.width_m * self.thickness_m.powi(3) / 12.0
    }
}

impl BeamSupportKind {
    /// Name in a rig.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Simple => "simple",
            Self::Clamped => "clamped",
            Self::Guided => "guided",
            Self::Free => "free",
            Self::Elastic { .. } => "elastic",
        }
    }

    /// True for a support with a reaction force.
    pub const fn has_reaction_force(self) -> bool {
        matches!(self, Self::Simple | Self::Clamped | Self::Elastic { .. })
    }

    /// True for a support with a reaction couple.
    pub const fn has_reaction_couple(self) -> bool {
        matches!(
            self,
            Self::Clamped | Self::Guided | Self::Elastic { rotational_stiffness_nm_per_rad: Some(_), .. }
        )
    }
}

const MOST: usize = 100;
/// Tolerance of positions, relative to the length.
pub(super) const SAME_PLACE: f64 = 1e-9;

impl SupportedBeamSpec {
    /// Checks the description.
    ///
    /// # Errors
    /// [`SupportedBeamError`] for the first fault.
    pub fn check(&self) -> Result<(), SupportedBeamError> {
        OutOfRange::check_positive([
            ("a beam's length", self.length_m),
            ("a beam's youngs_modulus", self.youngs_modulus_pa),
        ])?;
        self.check_sections()?;
        self.check_supports()?;
        self.check_held()
    }

    fn check_sections(&self) -> Result<(), SupportedBeamError> {
        let found = self.sections.len();
        if found > MOST {
            return Err(SupportedBeamError::TooManySections { found, most: MOST });
        }
        let (length_m, slack_m) = (self.length_m, SAME_PLACE * self.length_m);
        let mut from_m = 0.0;
        for (i, &BeamSection { to_m, width_m, thickness_m }) in self.sections.iter().enumerate() {
            let number = i + 1;
            OutOfRange::check_positive([("the width", width_m), ("the thickness", thickness_m)])
                .map_err(|fault| SupportedBeamError::Section { number, fault })?;
            if to_m.is_nan() || to_m <= from_m + slack_m {
                return Err(SupportedBeamError::SectionsOverlap { number, from_m, to_m });
            }
            if to_m > length_m + slack_m {
                return Err(SupportedBeamError::SectionBeyond { number, to_m, length_m });
            }
            from_m = to_m;
        }
        if from_m < length_m - slack_m {
            return Err(SupportedBeamError::SectionsEnd { to_m: from_m, length_m });
        }
        Ok(())
    }

    fn check_supports(&self) -> Result<(), SupportedBeamError> {
        let found = self.supports.len();
        if found > MOST {
            return Err(SupportedBeamError::TooManySupports { found, most: MOST });
        }
        let (length_m, slack_m) = (self.length_m, SAME_PLACE * self.length_m);
        for (i, &BeamSupport { at_m, kind }) in self.supports.iter().enumerate() {
            let number = i + 1;
            if !(-slack_m..=length_m + slack_m).contains(&at_m) {
                return Err(SupportedBeamError::SupportOffBeam { number, at_m, length_m });
            }
            if kind == BeamSupportKind::Free && (slack_m..=length_m - slack_m).contains(&at_m) {
                return Err(SupportedBeamError::FreeWithin { number, at_m, length_m });
            }
            if let BeamSupportKind::Elastic { stiffness_n_per_m, rotational_stiffness_nm_per_rad } = kind {
                let turning =
                    rotational_stiffness_nm_per_rad.map(|value| ("the rotational_stiffness", value));
                let springs = [("the stiffness", stiffness_n_per_m)].into_iter().chain(turning);
                OutOfRange::check_positive(springs)
                    .map_err(|fault| SupportedBeamError::Stiffness { number, fault })?;
            }
            let together = |other: &BeamSupport| (other.at_m - at_m).abs() <= slack_m;
            if let Some(first) = self.supports[..i].iter().position(together) {
                return Err(SupportedBeamError::SupportsTogether { first: first + 1, second: number, at_m });
            }
        }
        Ok(())
    }

    fn check_held(&self) -> Result<(), SupportedBeamError> {
        let mut forces = self.supports.iter().filter(|support| support.kind.has_reaction_force());
        let couples = self.supports.iter().any(|support| support.kind.has_reaction_couple());
        let motion = match (forces.next(), forces.next(), couples) {
            (Some(_), Some(_), _) | (Some(_), None, true) => return Ok(()),
            (Some(only), None, false) => RigidMotion::Turning { about_m: only.at_m },
            (None, _, true) => RigidMotion::UpAndDown,
            (None, _, false) => RigidMotion::Any,
        };
        Err(SupportedBeamError::Mechanism { motion })
    }
}

impl SupportedBeamSpec {
    /// Formats the supports: "clamped at 0 mm, elastic (2 N/mm) at 300 mm".
    pub fn supports_in_words(&self) -> String {
        let mut supports = self.supports.clone();
        supports.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
        let words = |BeamSupport { at_m, kind }: &BeamSupport| {
            format!("{} at {}", kind_in_words(*kind), format_length_mm(*at_m))
        };
        supports.iter().map(words).collect::<Vec<_>>().join(", ")
    }

    /// Formats the sections: "40 mm × 2 mm up to 100 mm, 40 mm × 1.2 mm up to 300 mm".
    pub fn sections_in_words(&self) -> String {
        let size = |section: &BeamSection| {
            format!("{} × {}", format_length_mm(section.width_m), format_length_mm(section.thickness_m))
        };
        match self.sections.as_slice() {
            [only] => size(only),
            sections => {
                let words = |section: &BeamSection| {
                    format!("{} up to {}", size(section), format_length_mm(section.to_m))
                };
                sections.iter().map(words).collect::<Vec<_>>().join(", ")
            }
        }
    }
}

fn kind_in_words(kind: BeamSupportKind) -> String {
    let BeamSupportKind::Elastic { stiffness_n_per_m, rotational_stiffness_nm_per_rad } = kind else {
        return kind.name().to_owned();
    };
    let spring = Quantity { value: stiffness_n_per_m, dimension: Dimension::Stiffness };
    match rotational_stiffness_nm_per_rad {
        Some(value) => {
            let turning = Quantity { value, dimension: Dimension::RotationalStiffness };
            format!("elastic ({spring} and {turning})")
        }
        None => format!("elastic ({spring})"),
    }
}

/// Error of an invalid beam; parts are numbered from 1.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SupportedBeamError {
    /// The length or the modulus is not positive and finite.
    #[error(transparent)]
    NotPositive(#[from] OutOfRange),
    /// A dimension is not positive and finite.
    #[error("section {number}: {fault}")]
    Section {
        /// Number of the section.
        number: usize,
        /// Value and bound.
        fault: OutOfRange,
    },
    /// A stiffness is not positive and finite.
    #[error("support {number}: {fault}")]
    Stiffness {
        /// Number of the support.
        number: usize,
        /// Value and bound.
        fault: OutOfRange,
    },
    /// Too many sections.
    #[error("the beam has {found} sections; it can have at most {most}")]
    TooManySections {
        /// Number of sections.
        found: usize,
        /// Largest number.
        most: usize,
    },
    /// Too many supports.
    #[error("the beam has {found} supports; it can have at most {most}")]
    TooManySupports {
        /// Number of supports.
        found: usize,
        /// Largest number.
        most: usize,
    },
    /// Sections overlap or are out of order.
    #[error(
        "section {number} ends at {}, but the one before it reaches to {}: sections follow each other from left to right and do \
         not overlap",
        format_length_mm(*to_m),
        format_length_mm(*from_m)
    )]
    SectionsOverlap {
        /// Number of the section.
        number: usize,
        /// End of the previous section.
        from_m: f64,
        /// End.
        to_m: f64,
    },
    /// A section ends beyond the beam.
    #[error(
        "section {number} ends at {}, beyond the beam's end at {}",
        format_length_mm(*to_m),
        format_length_mm(*length_m)
    )]
    SectionBeyond {
        /// Number of the section.
        number: usize,
        /// End.
        to_m: f64,
        /// Length of the beam.
        length_m: f64,
    },
    /// The sections end before the beam.
    #[error(
        "the sections cover the beam up to {} only; it is {} long",
        format_length_mm(*to_m),
        format_length_mm(*length_m)
    )]
    SectionsEnd {
        /// End of the last section.
        to_m: f64,
        /// Length of the beam.
        length_m: f64,
    },
    /// A support is off the beam.
    #[error(
        "support {number} is at {}, off the beam; it must be within 0 and {}",
        format_length_mm(*at_m),
        format_length_mm(*length_m)
    )]
    SupportOffBeam {
        /// Number of the support.
        number: usize,
        /// Position.
        at_m: f64,
        /// Length of the beam.
        length_m: f64,
    },
    /// Supports have one position.
    #[error("supports {first} and {second} are both at {}", format_length_mm(*at_m))]
    SupportsTogether {
        /// First number.
        first: usize,
        /// Second number.
        second: usize,
        /// Their position.
        at_m: f64,
    },
    /// A free end is within the beam.
    #[error(
        "support {number} is `free` at {}, within the beam; free is an end, at 0 or {}",
        format_length_mm(*at_m),
        format_length_mm(*length_m)
    )]
    FreeWithin {
        /// Number of the support.
        number: usize,
        /// Position.
        at_m: f64,
        /// Length of the beam.
        length_m: f64,
    },
    /// The supports allow a rigid motion.
    #[error("the beam is a mechanism: {motion}")]
    Mechanism {
        /// Allowed motion.
        motion: RigidMotion,
    },
    /// The compliance is not positive and finite, or lost in rounding.
    #[error(
        "a beam's largest deflection is {compliance_m_per_n} m/N; it must be greater than 0 and finite, and not be lost beside \
         the largest stiffness"
    )]
    Compliance {
        /// Compliance.
        compliance_m_per_n: f64,
    },
}

/// A rigid motion.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RigidMotion {
    /// Translation and rotation.
    #[error("no support takes up force or couple, so it can move up and down and turn freely")]
    Any,
    /// Translation.
    #[error("its supports fix the slope only, so it can move up and down freely")]
    UpAndDown,
    /// Rotation about the only support.
    #[error("only the support at {} takes up force, so it can turn about that freely", format_length_mm(*about_m))]
    Turning {
        /// Position of the support.
        about_m: f64,
    },
}

/// Faulty part of a description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BeamPart {
    /// All of it.
    Whole,
    /// All supports.
    Supports,
    /// One support, from 0.
    Support(usize),
    /// All sections.
    Sections,
    /// One section, from 0.
    Section(usize),
}

impl SupportedBeamError {
    /// Faulty part.
    pub const fn part(&self) -> BeamPart {
        match *self {
            Self::NotPositive(_) | Self::Compliance { .. } => BeamPart::Whole,
            Self::Section { number, .. }
            | Self::SectionsOverlap { number, .. }
            | Self::SectionBeyond { number, .. } => BeamPart::Section(number - 1),
            Self::SectionsEnd { .. } | Self::TooManySections { .. } => BeamPart::Sections,
            Self::Stiffness { number, .. }
            | Self::SupportOffBeam { number, .. }
            | Self::FreeWithin { number, .. }
            | Self::SupportsTogether { second: number, .. } => BeamPart::Support(number - 1),
            Self::Mechanism { .. } | Self::TooManySupports { .. } => BeamPart::Supports,
        }
    }

    /// Suggested remedy.
    pub const fn help(&self) -> Option<&'static str> {
        match self {
            Self::SectionsEnd { .. } => {
                Some("leave `to` out of the last section: it then reaches to the beam's end")
            }
            Self::SupportsTogether { .. } => Some("leave one of them out, or move it"),
            Self::Mechanism { motion: RigidMotion::UpAndDown } => {
                Some("add a support that takes up force: simple, clamped or elastic")
            }
            Self::Mechanism { .. } => {
                Some("clamp one support, or have two that take up force: simple, clamped or elastic")
            }
            Self::FreeWithin { .. } => Some("leave it out: where no support is listed, the beam is free"),
            _ => None,
        }
    }
}
