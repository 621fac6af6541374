//! Why a plate cannot be computed.

use crate::contact::Position;
use crate::units::format_length_mm;

/// A plate that cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlateError {
    /// A dimension is not a positive, finite number.
    #[error("a plate's {name} is {value}; it must be greater than 0 and finite")]
    NotPositive {
        /// Which: "length", "width", "thickness" or "youngs_modulus".
        name: &'static str,
        /// Its value in SI units.
        value: f64,
    },
    /// No material has this Poisson's ratio.
    #[error("a plate's poissons_ratio is {value}; it must be greater than -1 and at most 0.5")]
    PoissonsRatio {
        /// The ratio.
        value: f64,
    },
    /// The compliance l²/D is not a positive, finite number.
    #[error("a plate's compliance l²/D is {compliance_m_per_n} m/N; it must be greater than 0 and finite")]
    Compliance {
        /// Longer side, squared, over flexural rigidity, in m/N.
        compliance_m_per_n: f64,
    },
    /// Too few or too many elements.
    #[error("a plate has {elements} elements along its longer side; it must have {fewest} to {most}")]
    Elements {
        /// How many it is to have.
        elements: usize,
        /// The fewest it can have.
        fewest: usize,
        /// The most it can have.
        most: usize,
    },
    /// The factor of the stiffness matrix would not fit.
    #[error(
        "a plate of {elements} elements along its longer side needs {} of memory; at most {} can be used: take fewer elements",
        gibibytes(*bytes), gibibytes(*most)
    )]
    MeshTooLarge {
        /// Elements along the longer side.
        elements: usize,
        /// Estimated bytes.
        bytes: f64,
        /// The most that can be used.
        most: f64,
    },
    /// A support beside the plate.
    #[error(
        "support {number} is at {}, off the plate; it must be within (0, 0) and {}",
        Point(*at), Point(*corner)
    )]
    SupportOffPlate {
        /// Which support, from 1.
        number: usize,
        /// Where it is.
        at: Position,
        /// The corner across from (0, 0).
        corner: Position,
    },
    /// An elastic support without stiffness.
    #[error("support {number} has a stiffness of {value} N/m; it must be greater than 0 and finite")]
    Stiffness {
        /// Which support, from 1.
        number: usize,
        /// Its stiffness, in N/m.
        value: f64,
    },
    /// A support where the edge is held already.
    #[error("support {number} is on the {edge} edge, which is held already; leave it out")]
    SupportOnHeldEdge {
        /// Which support, from 1.
        number: usize,
        /// Which edge.
        edge: &'static str,
    },
    /// Two supports at one place.
    #[error("supports {first} and {second} are both at {}; leave one out", Point(*at))]
    SupportsAtOnePlace {
        /// The first one's number, from 1.
        first: usize,
        /// The second one's number, from 1.
        second: usize,
        /// Where they are.
        at: Position,
    },
    /// Two simple supports that the mesh cannot tell apart.
    #[error(
        "simple supports {first} and {second} are {} apart, less than an element of {} × {}; take more elements, or one support",
        format_length_mm(*distance_m), format_length_mm(*side_x_m), format_length_mm(*side_y_m)
    )]
    SupportsTooClose {
        /// The first one's number, from 1.
        first: usize,
        /// The second one's number, from 1.
        second: usize,
        /// Their distance, in metres.
        distance_m: f64,
        /// An element's side along x, in metres.
        side_x_m: f64,
        /// An element's side along y, in metres.
        side_y_m: f64,
    },
    /// Nothing holds the plate.
    #[error(
        "nothing holds the plate: it can move up and down and tilt every way; hold an edge, or three points"
    )]
    NotHeld,
    /// One point holds it.
    #[error("the plate is held at {} only: it can tilt about it every way; hold it at three points at least", Point(*at))]
    HeldAtOnePoint {
        /// The point.
        at: Position,
    },
    /// All that holds it is on one line.
    #[error(
        "the plate can turn about the line through {} and {}, on which all its supports are; hold it beside that line",
        Point(*from), Point(*to)
    )]
    HeldOnALine {
        /// A point of the line.
        from: Position,
        /// Another point of the line.
        to: Position,
    },
    /// The equations could not be solved.
    #[error("the equations of the plate could not be solved: {reason}")]
    Unsolvable {
        /// Why.
        reason: Unsolvable,
    },
}

/// Why the equations of a plate could not be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unsolvable {
    /// The stiffness matrix has no factor.
    #[error(transparent)]
    Stiffness(#[from] palpate_numerics::SparseCholeskyError),
    /// The compliances of the simple supports have no factor.
    #[error(transparent)]
    Supports(#[from] palpate_numerics::NotPositiveDefinite),
}

/// A position for people.
struct Point(Position);

impl std::fmt::Display for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}, {})", format_length_mm(self.0.x_m), format_length_mm(self.0.y_m))
    }
}

fn gibibytes(bytes: f64) -> String {
    format!("{:.1} GiB", bytes / 2f64.powi(30))
}
