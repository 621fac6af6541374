//! Why sensors cannot be placed.

use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::LimitError;
use palpate_mechanics::sensing::{LayoutError, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::format_length_mm;
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::Cancelled;

/// A constraint that cannot be met, or a setup that nothing can be designed for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// There is no limit to design by.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// The design was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
    /// A number that is not in its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A number of an offered sensor that is not in its range.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// A kind without noise.
    #[error(
        "{kind} sensors have no noise and no resolution; one of them must be greater than 0, or the limit is 0 wherever they sit"
    )]
    SingularNoise {
        /// What they measure.
        kind: SensorKind,
    },
    /// Fewer sites than sensors.
    #[error("{count} sensors are wanted, but only {sites} sites can hold one")]
    TooFewSites {
        /// Sensors that are wanted.
        count: usize,
        /// Sites that are left.
        sites: usize,
    },
    /// The spacing leaves no room.
    #[error(
        "{count} sensors at least {} apart do not fit: {} found place",
        format_length_mm(*spacing_m),
        if *most == 0 { "none".to_owned() } else { format!("at most {most}") }
    )]
    Spacing {
        /// Sensors that are wanted.
        count: usize,
        /// Their least distance, in metres.
        spacing_m: f64,
        /// As many as found place.
        most: usize,
    },
    /// Sensors that do not mirror each other, and too few of them.
    #[error("{count} sensors do not fit when none may mirror another: at most {most} found place")]
    NoMirror {
        /// Sensors that are wanted.
        count: usize,
        /// As many as found place.
        most: usize,
    },
    /// The budget does not suffice.
    #[error("the budget is {budget}; the cheapest {count} sensors cost {least}")]
    Budget {
        /// What there is to spend.
        budget: f64,
        /// Sensors that are wanted.
        count: usize,
        /// What the cheapest layout costs that was found.
        least: f64,
    },
    /// More sensors that every layout has than the layout is to have.
    #[error("`must_have` lists {listed} sensors{}, but only {count} are wanted", if *mirrored { " with their mirror images" } else { "" })]
    TooManyMustHaves {
        /// As many are listed.
        listed: usize,
        /// Sensors that are wanted.
        count: usize,
        /// Whether mirror images are counted too.
        mirrored: bool,
    },
    /// A sensor that every layout has, where it would read nothing.
    #[error("the {kind} sensor of `must_have` at {} would read nothing there", extent.place_in_words(*position))]
    MustHaveReadsNothing {
        /// What it measures.
        kind: SensorKind,
        /// Where it is.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// A sensor that every layout has, where none may sit.
    #[error("the {kind} sensor of `must_have` at {} lies in a `keep_out` zone", extent.place_in_words(*position))]
    MustHaveKeptOut {
        /// What it measures.
        kind: SensorKind,
        /// Where it is.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// Two sensors that every layout has, and that exclude each other.
    #[error("the sensors of `must_have` at {} and {} exclude each other: {}", extent.place_in_words(*first), extent.place_in_words(*second), reason)]
    MustHavesExclude {
        /// Where one is.
        first: Position,
        /// Where the other is.
        second: Position,
        /// Why.
        reason: Exclusion,
        /// The surface.
        extent: Extent,
    },
    /// A sensor that every layout has, without a place for its twin.
    #[error("symmetry is wanted, but the mirror image of the {kind} sensor of `must_have` at {} is no place for one", extent.place_in_words(*position))]
    MustHaveWithoutTwin {
        /// What it measures.
        kind: SensorKind,
        /// Where it is.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// No site has its mirror image among the sites.
    #[error(
        "symmetry is wanted, but {count} sensors cannot be placed symmetrically: {pairs} pairs of sites mirror each other, {middle} sites lie in the middle"
    )]
    Symmetry {
        /// Sensors that are wanted.
        count: usize,
        /// Pairs of sites.
        pairs: usize,
        /// Sites in the middle.
        middle: usize,
    },
    /// A method that has no layout to give.
    #[error("the method `{method}` has no layout for these sensors and constraints")]
    NoLayout {
        /// Its name.
        method: &'static str,
    },
    /// More candidates and contacts than fit into memory.
    #[error("{sites} candidate sites and {contacts} contacts need {:.1} GB; at most {:.1} GB can be held", bytes / 1e9, most / 1e9)]
    TooLarge {
        /// Candidates.
        sites: usize,
        /// Contact positions.
        contacts: usize,
        /// Bytes that they need.
        bytes: f64,
        /// Bytes at most.
        most: f64,
    },
}

/// Why two sensors cannot both be there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exclusion {
    /// They are the same.
    Same,
    /// They are closer than the spacing.
    Spacing {
        /// Their distance, in metres.
        distance_m: f64,
        /// The least distance, in metres.
        spacing_m: f64,
    },
    /// One is the mirror image of the other, which is forbidden.
    Mirror,
}

impl std::fmt::Display for Exclusion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Same => f.write_str("they are the same sensor"),
            Self::Spacing { distance_m, spacing_m } => write!(
                f,
                "they are {} apart, and `spacing` is {}",
                format_length_mm(*distance_m),
                format_length_mm(*spacing_m)
            ),
            Self::Mirror => f.write_str("they mirror each other, and `symmetry` is forbidden"),
        }
    }
}
