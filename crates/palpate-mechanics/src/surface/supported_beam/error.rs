//! Why a beam on supports cannot be computed.

use crate::units::format_length_mm;

/// Why a beam on supports cannot be computed, and what of it is at fault. Sections and supports are numbered from 1, in the
/// order of the description.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SupportedBeamError {
    /// The length or the modulus is not a positive, finite number.
    #[error("a beam's {name} is {value}; it must be greater than 0 and finite")]
    NotPositive {
        /// Which: "length" or "youngs_modulus".
        name: &'static str,
        /// Its value in SI units.
        value: f64,
    },
    /// A dimension of a section is not a positive, finite number.
    #[error("section {number}: the {name} is {value}; it must be greater than 0 and finite")]
    Section {
        /// Which section.
        number: usize,
        /// Which: "width" or "thickness".
        name: &'static str,
        /// Its value in SI units.
        value: f64,
    },
    /// A spring's stiffness is not a positive, finite number.
    #[error("support {number}: the {name} is {value}; it must be greater than 0 and finite")]
    Stiffness {
        /// Which support.
        number: usize,
        /// Which: "stiffness" or "rotational_stiffness".
        name: &'static str,
        /// Its value in SI units.
        value: f64,
    },
    /// More sections than are computed.
    #[error("the beam has {found} sections; it can have at most {most}")]
    TooManySections {
        /// How many there are.
        found: usize,
        /// The most that there can be.
        most: usize,
    },
    /// More supports than are computed.
    #[error("the beam has {found} supports; it can have at most {most}")]
    TooManySupports {
        /// How many there are.
        found: usize,
        /// The most that there can be.
        most: usize,
    },
    /// Sections overlap, or one is out of order.
    #[error(
        "section {number} ends at {}, but the one before it reaches to {}: sections follow each other from left to right and do \
         not overlap",
        format_length_mm(*to_m),
        format_length_mm(*from_m)
    )]
    SectionsOverlap {
        /// Which section.
        number: usize,
        /// Where the one before it ends, or 0, in metres.
        from_m: f64,
        /// Where it ends, in metres.
        to_m: f64,
    },
    /// A section reaches beyond the beam.
    #[error(
        "section {number} ends at {}, beyond the beam's end at {}",
        format_length_mm(*to_m),
        format_length_mm(*length_m)
    )]
    SectionBeyond {
        /// Which section.
        number: usize,
        /// Where it ends, in metres.
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
        /// Where the last one ends, in metres.
        to_m: f64,
        /// The beam's length, in metres.
        length_m: f64,
    },
    /// A support beside the beam.
    #[error(
        "support {number} is at {}, off the beam; it must be within 0 and {}",
        format_length_mm(*at_m),
        format_length_mm(*length_m)
    )]
    SupportOffBeam {
        /// Which support.
        number: usize,
        /// Where it is, in metres.
        at_m: f64,
        /// The beam's length, in metres.
        length_m: f64,
    },
    /// Two supports at one place.
    #[error("supports {first} and {second} are both at {}", format_length_mm(*at_m))]
    SupportsTogether {
        /// The one.
        first: usize,
        /// The other, which comes later.
        second: usize,
        /// Where they are, in metres.
        at_m: f64,
    },
    /// A place within the beam that is said to be a free end.
    #[error(
        "support {number} is `free` at {}, within the beam; free is an end, at 0 or {}",
        format_length_mm(*at_m),
        format_length_mm(*length_m)
    )]
    FreeWithin {
        /// Which support.
        number: usize,
        /// Where it is, in metres.
        at_m: f64,
        /// The beam's length, in metres.
        length_m: f64,
    },
    /// The supports let the beam move as a whole.
    #[error("the beam is a mechanism: {motion}")]
    Mechanism {
        /// How it can move.
        motion: RigidMotion,
    },
    /// The deflections are not numbers that can be computed with.
    #[error(
        "a beam's largest deflection is {compliance_m_per_n} m/N; it must be greater than 0 and finite, and not be lost beside \
         the largest stiffness"
    )]
    Compliance {
        /// The largest deflection per newton, in m/N.
        compliance_m_per_n: f64,
    },
}

/// A motion of the whole beam that bends nothing and that no support takes up.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RigidMotion {
    /// All of them.
    #[error("no support takes up force or couple, so it can move up and down and turn freely")]
    Any,
    /// Up and down.
    #[error("its supports hold the slope only, so it can move up and down freely")]
    UpAndDown,
    /// About the only support.
    #[error("only the support at {} takes up force, so it can turn about that freely", format_length_mm(*about_m))]
    Turning {
        /// Where that support is, in metres.
        about_m: f64,
    },
}

/// What of a beam's description is at fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BeamPart {
    /// All of it.
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
    /// What is at fault.
    pub const fn part(&self) -> BeamPart {
        match *self {
            Self::NotPositive { .. } | Self::Compliance { .. } => BeamPart::Whole,
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

    /// What would help.
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
