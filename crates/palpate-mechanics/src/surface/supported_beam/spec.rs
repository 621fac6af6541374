//! The description of a beam on any supports, its checks, and its texts.

use serde::{Deserialize, Serialize};

use crate::units::{Dimension, Quantity, format_length_mm};
use palpate_numerics::OutOfRange;

/// A straight beam of rectangular sections with its supports, as plain data, which [`SupportedBeam::new`](super::SupportedBeam::new) checks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportedBeamSpec {
    /// Length l, in metres.
    pub length_m: f64,
    /// Young's modulus E, in pascals.
    pub youngs_modulus_pa: f64,
    /// Parts of constant section, from left to right, which together cover the beam.
    pub sections: Vec<BeamSection>,
    /// Supports, in any order.
    pub supports: Vec<BeamSupport>,
}

/// A part of the beam with one width and thickness. It begins at the end of the previous one, the first at 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamSection {
    /// End, in metres.
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
    /// Position, in metres from the beam's left end.
    pub at_m: f64,
    /// Kind.
    pub kind: BeamSupportKind,
}

/// Kind of a support: the motions that it prevents.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum BeamSupportKind {
    /// No deflection, free to turn.
    Simple,
    /// Neither deflection nor slope.
    Clamped,
    /// No slope, free to deflect.
    Guided,
    /// An end of the beam without a support, listed explicitly.
    Free,
    /// A spring under the beam.
    Elastic {
        /// Upward force per metre of downward deflection, in N/m.
        stiffness_n_per_m: f64,
        /// Couple against the slope, in N·m/rad; `None` for a support that is free to turn.
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

    /// True for a support with a transverse reaction force.
    pub const fn takes_force(self) -> bool {
        matches!(self, Self::Simple | Self::Clamped | Self::Elastic { .. })
    }

    /// True for a support with a reaction couple.
    pub const fn takes_couple(self) -> bool {
        matches!(
            self,
            Self::Clamped | Self::Guided | Self::Elastic { rotational_stiffness_nm_per_rad: Some(_), .. }
        )
    }
}

/// Largest number of sections, and of supports: more than a bench has.
const MOST: usize = 100;
/// Positions closer than this share of the length are the same.
pub(super) const SAME_PLACE: f64 = 1e-9;

impl SupportedBeamSpec {
    /// Checks that the beam can be computed: values in range, sections that cover it, and enough supports on it at different
    /// positions.
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

    /// Checks that the supports prevent both translation and rotation.
    fn check_held(&self) -> Result<(), SupportedBeamError> {
        let mut forces = self.supports.iter().filter(|support| support.kind.takes_force());
        let couples = self.supports.iter().any(|support| support.kind.takes_couple());
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
    /// Text of the supports from left to right: "clamped at 0 mm, elastic (2 N/mm) at 300 mm".
    pub fn supports_in_words(&self) -> String {
        let mut supports = self.supports.clone();
        supports.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
        let words = |BeamSupport { at_m, kind }: &BeamSupport| {
            format!("{} at {}", kind_in_words(*kind), format_length_mm(*at_m))
        };
        supports.iter().map(words).collect::<Vec<_>>().join(", ")
    }

    /// Text of the sections as width × thickness: "40 mm × 1.2 mm", or "40 mm × 2 mm up to 100 mm, 40 mm × 1.2 mm up to 300 mm".
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

/// Error of a beam on supports that cannot be computed, with the part at fault. Sections and supports are numbered from 1, in the
/// order of the description.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SupportedBeamError {
    /// The length or the modulus is not a positive, finite number.
    #[error(transparent)]
    NotPositive(#[from] OutOfRange),
    /// A dimension of a section is not a positive, finite number.
    #[error("section {number}: {fault}")]
    Section {
        /// Number of the section.
        number: usize,
        /// The dimension, in SI units.
        fault: OutOfRange,
    },
    /// A spring's stiffness is not a positive, finite number.
    #[error("support {number}: {fault}")]
    Stiffness {
        /// Number of the support.
        number: usize,
        /// The stiffness, in SI units.
        fault: OutOfRange,
    },
    /// More sections than the largest number.
    #[error("the beam has {found} sections; it can have at most {most}")]
    TooManySections {
        /// Number of sections.
        found: usize,
        /// Largest number.
        most: usize,
    },
    /// More supports than the largest number.
    #[error("the beam has {found} supports; it can have at most {most}")]
    TooManySupports {
        /// Number of supports.
        found: usize,
        /// Largest number.
        most: usize,
    },
    /// Sections overlap, or are out of order.
    #[error(
        "section {number} ends at {}, but the one before it reaches to {}: sections follow each other from left to right and do \
         not overlap",
        format_length_mm(*to_m),
        format_length_mm(*from_m)
    )]
    SectionsOverlap {
        /// Number of the section.
        number: usize,
        /// End of the section before it, or 0, in metres.
        from_m: f64,
        /// End, in metres.
        to_m: f64,
    },
    /// A section extends beyond the beam.
    #[error(
        "section {number} ends at {}, beyond the beam's end at {}",
        format_length_mm(*to_m),
        format_length_mm(*length_m)
    )]
    SectionBeyond {
        /// Number of the section.
        number: usize,
        /// End, in metres.
        to_m: f64,
        /// The beam's length, in metres.
        length_m: f64,
    },
    /// The sections end before the beam does.
    #[error(
        "the sections cover the beam up to {} only; it is {} long",
        format_length_mm(*to_m),
        format_length_mm(*length_m)
    )]
    SectionsEnd {
        /// End of the last section, in metres.
        to_m: f64,
        /// The beam's length, in metres.
        length_m: f64,
    },
    /// A support off the beam.
    #[error(
        "support {number} is at {}, off the beam; it must be within 0 and {}",
        format_length_mm(*at_m),
        format_length_mm(*length_m)
    )]
    SupportOffBeam {
        /// Number of the support.
        number: usize,
        /// Position, in metres.
        at_m: f64,
        /// The beam's length, in metres.
        length_m: f64,
    },
    /// Two supports at one position.
    #[error("supports {first} and {second} are both at {}", format_length_mm(*at_m))]
    SupportsTogether {
        /// Number of the first support.
        first: usize,
        /// Number of the second support.
        second: usize,
        /// Their position, in metres.
        at_m: f64,
    },
    /// A free end within the beam.
    #[error(
        "support {number} is `free` at {}, within the beam; free is an end, at 0 or {}",
        format_length_mm(*at_m),
        format_length_mm(*length_m)
    )]
    FreeWithin {
        /// Number of the support.
        number: usize,
        /// Position, in metres.
        at_m: f64,
        /// The beam's length, in metres.
        length_m: f64,
    },
    /// The supports let the beam move as a whole.
    #[error("the beam is a mechanism: {motion}")]
    Mechanism {
        /// Motion that the supports allow.
        motion: RigidMotion,
    },
    /// The largest deflection is not positive and finite, or is lost in rounding.
    #[error(
        "a beam's largest deflection is {compliance_m_per_n} m/N; it must be greater than 0 and finite, and not be lost beside \
         the largest stiffness"
    )]
    Compliance {
        /// The largest deflection per newton, in m/N.
        compliance_m_per_n: f64,
    },
}

/// A motion of the whole beam that causes no bending and no reaction of a support.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RigidMotion {
    /// Translation and rotation.
    #[error("no support takes up force or couple, so it can move up and down and turn freely")]
    Any,
    /// Translation up and down.
    #[error("its supports fix the slope only, so it can move up and down freely")]
    UpAndDown,
    /// Rotation about the only support.
    #[error("only the support at {} takes up force, so it can turn about that freely", format_length_mm(*about_m))]
    Turning {
        /// Position of that support, in metres.
        about_m: f64,
    },
}

/// Part of a beam's description at fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BeamPart {
    /// The whole description.
    Whole,
    /// The supports together.
    Supports,
    /// One support, from 0.
    Support(usize),
    /// The sections together.
    Sections,
    /// One section, from 0.
    Section(usize),
}

impl SupportedBeamError {
    /// The part at fault.
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

    /// Advice on a remedy.
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
