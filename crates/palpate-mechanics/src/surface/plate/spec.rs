//! The description of a plate, and the checks before any computation.

use serde::{Deserialize, Serialize};

use super::dissection::coupled_pairs;
use super::mesh::{Mesh, NODE_DEGREES};
use crate::contact::Position;
use crate::sensing::SensorKind;
use crate::surface::{Extent, InsensitiveSensor};
use crate::units::format_length_mm;
use palpate_numerics::OutOfRange;

/// A rectangular plate as plain data, which [`Plate::new`](super::Plate::new) checks: x runs along its length from the left
/// edge to the right one, y along its width from the bottom edge to the top one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlateSpec {
    /// Length along x, in metres.
    pub length_m: f64,
    /// Width along y, in metres.
    pub width_m: f64,
    /// Thickness t, in metres; below about a tenth of the sides, because shear is neglected.
    pub thickness_m: f64,
    /// Young's modulus E, in pascals.
    pub youngs_modulus_pa: f64,
    /// Poisson's ratio ν, greater than −1 and at most 0.5.
    pub poissons_ratio: f64,
    /// Conditions along the edges.
    pub edges: Edges,
    /// Supports at points.
    pub supports: Vec<PointSupport>,
    /// Elements along the longer side.
    pub elements: usize,
}

/// Supports of the four edges; edges without a key are free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Edges {
    /// The edge x = 0.
    pub left: Edge,
    /// The edge x = length.
    pub right: Edge,
    /// The edge y = 0.
    pub bottom: Edge,
    /// The edge y = width.
    pub top: Edge,
}

/// Support of an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// The deflection is zero, and the edge can turn.
    Simple,
    /// The deflection and the slope are zero.
    Clamped,
    /// No support.
    #[default]
    Free,
}

/// A support at one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSupport {
    /// Position.
    pub position: Position,
    /// Kind.
    pub kind: PointSupportKind,
}

/// Kind of a support at one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointSupportKind {
    /// The point does not move, and the plate can turn on it.
    Simple,
    /// The deflection is proportional to the force.
    Elastic {
        /// Stiffness k, in newtons per metre; greater than 0.
        stiffness_n_per_m: f64,
    },
}

impl PlateSpec {
    /// Default number of elements along the longer side: the error of deflections is then about 10⁻⁴ of the
    /// largest deflection (docs/explanation/plates.md).
    pub const DEFAULT_ELEMENTS: usize = 128;

    /// Flexural rigidity D = E·t³/(12·(1 − ν²)), in N·m.
    pub fn flexural_rigidity(&self) -> f64 {
        self.youngs_modulus_pa * self.thickness_m.powi(3) / (12.0 * (1.0 - self.poissons_ratio.powi(2)))
    }

    /// The area of the plate, for checked sides.
    pub(super) fn extent(&self) -> Extent {
        Extent::checked_plane(self.length_m, self.width_m)
    }
}

impl Edges {
    /// Edges with one condition on all four sides.
    pub const fn all(edge: Edge) -> Self {
        Self { left: edge, right: edge, bottom: edge, top: edge }
    }
}

impl PointSupport {
    /// True for a support that does not move.
    pub(super) fn is_rigid(&self) -> bool {
        matches!(self.kind, PointSupportKind::Simple)
    }
}

/// A plate that cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlateError {
    /// A dimension is not a positive, finite number.
    #[error(transparent)]
    NotPositive(#[from] OutOfRange),
    /// A Poisson's ratio that is out of range.
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
        /// Requested number.
        elements: usize,
        /// Smallest allowed number.
        fewest: usize,
        /// Largest allowed number.
        most: usize,
    },
    /// The factor of the stiffness matrix would not fit into memory.
    #[error(
        "a plate of {elements} elements along its longer side needs {} of memory; at most {} can be used: take fewer elements",
        gibibytes(*bytes), gibibytes(*most)
    )]
    MeshTooLarge {
        /// Elements along the longer side.
        elements: usize,
        /// Estimated bytes.
        bytes: f64,
        /// The most bytes that can be used.
        most: f64,
    },
    /// A support outside the plate.
    #[error(
        "support {number} is at {}, off the plate; it must be within (0, 0) and {}",
        Point(*at), Point(*corner)
    )]
    SupportOffPlate {
        /// Number of the support, from 1.
        number: usize,
        /// Position.
        at: Position,
        /// The corner opposite (0, 0).
        corner: Position,
    },
    /// An elastic support with an invalid stiffness.
    #[error("support {number} has a stiffness of {value} N/m; it must be greater than 0 and finite")]
    Stiffness {
        /// Number of the support, from 1.
        number: usize,
        /// Stiffness, in N/m.
        value: f64,
    },
    /// A support on an edge that is already supported.
    #[error("support {number} is on the {edge} edge, which is already supported; remove it")]
    SupportOnHeldEdge {
        /// Number of the support, from 1.
        number: usize,
        /// Name of the edge.
        edge: &'static str,
    },
    /// Two supports at one position.
    #[error("supports {first} and {second} are both at {}; leave one out", Point(*at))]
    SupportsAtOnePlace {
        /// Number of the first support, from 1.
        first: usize,
        /// Number of the second support, from 1.
        second: usize,
        /// Their position.
        at: Position,
    },
    /// Two simple supports that the mesh cannot distinguish.
    #[error(
        "simple supports {first} and {second} are {} apart, less than an element of {} × {}; take more elements, or one support",
        format_length_mm(*distance_m), format_length_mm(*side_x_m), format_length_mm(*side_y_m)
    )]
    SupportsTooClose {
        /// Number of the first support, from 1.
        first: usize,
        /// Number of the second support, from 1.
        second: usize,
        /// Their distance, in metres.
        distance_m: f64,
        /// An element's side along x, in metres.
        side_x_m: f64,
        /// An element's side along y, in metres.
        side_y_m: f64,
    },
    /// A plate without supports.
    #[error(
        "the plate has no supports: it can move up and down and tilt in every direction; support an edge, or three points"
    )]
    NotHeld,
    /// A plate with a single point support.
    #[error("the plate is supported only at {}: it can tilt about that point in every direction; support it at three points at least", Point(*at))]
    HeldAtOnePoint {
        /// The point.
        at: Position,
    },
    /// A plate with all its supports on one line.
    #[error(
        "the plate can rotate about the line through {} and {}, on which all its supports are; support it beside that line",
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
        /// Reason of the failure.
        reason: Unsolvable,
    },
}

/// Largest imbalance of force, or of a moment over the longer side, as a share of the load.
pub(super) const MOST_IMBALANCE: f64 = 1e-9;

/// Error of a plate without a solution.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unsolvable {
    /// The stiffness matrix has no factor.
    #[error(transparent)]
    Stiffness(#[from] palpate_numerics::SparseCholeskyError),
    /// The compliances of the simple supports have no factor.
    #[error("the forces of the point supports could not be computed: {0}")]
    Supports(#[from] palpate_numerics::NotPositiveDefinite),
    /// Supports and edges do not balance a force.
    #[error(
        "under a force at {} the supports are {share:e} of it out of balance; it must be at most {:e}",
        Point(*at), MOST_IMBALANCE
    )]
    OutOfBalance {
        /// Unbalanced force, or unbalanced moment over the longer side, as a share of the force.
        share: f64,
        /// Position of the force.
        at: Position,
    },
    /// The watch stopped the work.
    #[error("{0}")]
    Cancelled(#[from] palpate_numerics::watch::Cancelled),
}

impl Unsolvable {
    /// Advice on a remedy.
    pub fn help(&self) -> &'static str {
        "take fewer `elements`, or lengths and stiffnesses that are less far apart"
    }
}

/// A position as text for messages.
struct Point(Position);

impl std::fmt::Display for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}, {})", format_length_mm(self.0.x_m), format_length_mm(self.0.y_m))
    }
}

fn gibibytes(bytes: f64) -> String {
    format!("{:.1} GiB", bytes / 2f64.powi(30))
}

/// Smallest and largest number of elements along the longer side.
const FEWEST_ELEMENTS: usize = 4;
const MOST_ELEMENTS: usize = 10_000;

/// Largest memory for a plate's equations, in bytes: 4 GiB.
const MOST_BYTES: f64 = 4.0 * (1u64 << 30) as f64;

/// Positions closer than this, as a share of the longer side, are the same.
const SAME_PLACE: f64 = 1e-9;

/// Points closer to a line than this, as a share of the longer side, do not prevent rotation about it.
const ON_A_LINE: f64 = 1e-6;

/// Checks all values of a plate, the cheap checks first.
///
/// # Errors
/// [`PlateError`], with the value and its bound.
pub(super) fn check(spec: &PlateSpec) -> Result<(), PlateError> {
    check_numbers(spec)?;
    for (i, support) in spec.supports.iter().enumerate() {
        check_support(spec, i + 1, support)?;
    }
    check_distances(spec)?;
    check_held(spec)?;
    check_memory(spec)
}

fn check_numbers(spec: &PlateSpec) -> Result<(), PlateError> {
    OutOfRange::check_positive([
        ("a plate's length", spec.length_m),
        ("a plate's width", spec.width_m),
        ("a plate's thickness", spec.thickness_m),
        ("a plate's youngs_modulus", spec.youngs_modulus_pa),
    ])?;
    let value = spec.poissons_ratio;
    if !(value > -1.0 && value <= 0.5) {
        return Err(PlateError::PoissonsRatio { value });
    }
    let compliance_m_per_n = compliance_m_per_n(spec);
    if !(compliance_m_per_n > 0.0 && compliance_m_per_n.is_finite()) {
        return Err(PlateError::Compliance { compliance_m_per_n });
    }
    let (elements, fewest, most) = (spec.elements, FEWEST_ELEMENTS, MOST_ELEMENTS);
    if (fewest..=most).contains(&elements) {
        Ok(())
    } else {
        Err(PlateError::Elements { elements, fewest, most })
    }
}

fn check_support(spec: &PlateSpec, number: usize, support: &PointSupport) -> Result<(), PlateError> {
    let at = support.position;
    if !spec.extent().contains(at) {
        let corner = Position { x_m: spec.length_m, y_m: spec.width_m };
        return Err(PlateError::SupportOffPlate { number, at, corner });
    }
    if let PointSupportKind::Elastic { stiffness_n_per_m: value } = support.kind
        && !(value > 0.0 && value.is_finite())
    {
        return Err(PlateError::Stiffness { number, value });
    }
    match edges_at(spec, at).find(|(_, edge)| *edge != Edge::Free) {
        Some((edge, _)) => Err(PlateError::SupportOnHeldEdge { number, edge }),
        None => Ok(()),
    }
}

/// Refuses two supports at one position, and two simple supports in one element: the mesh would have no freedom left there.
fn check_distances(spec: &PlateSpec) -> Result<(), PlateError> {
    let Mesh { side_x_m, side_y_m, .. } = Mesh::new(spec.extent(), spec.elements);
    for (i, one) in spec.supports.iter().enumerate() {
        for (j, other) in spec.supports[..i].iter().enumerate() {
            let (first, second) = (j + 1, i + 1);
            let apart_x_m = (one.position.x_m - other.position.x_m).abs();
            let apart_y_m = (one.position.y_m - other.position.y_m).abs();
            if apart_x_m.max(apart_y_m) <= SAME_PLACE * longer_side_m(spec) {
                return Err(PlateError::SupportsAtOnePlace { first, second, at: one.position });
            }
            let elements_apart = (apart_x_m / side_x_m).max(apart_y_m / side_y_m);
            if one.is_rigid() && other.is_rigid() && elements_apart < 1.0 - 1e-9 {
                let distance_m = apart_x_m.hypot(apart_y_m);
                return Err(PlateError::SupportsTooClose { first, second, distance_m, side_x_m, side_y_m });
            }
        }
    }
    Ok(())
}

/// Refuses a plate that can move without bending, because it has no equilibrium. The rigid motions w = a + b·x + c·y must all be prevented:
/// by a clamped edge, or by points that are not on one line. A supported edge counts as its two ends.
fn check_held(spec: &PlateSpec) -> Result<(), PlateError> {
    let edges = edges(spec);
    if edges.iter().any(|(.., edge)| *edge == Edge::Clamped) {
        return Ok(());
    }
    let held = edges.iter().filter(|(.., edge)| *edge == Edge::Simple);
    let mut points: Vec<Position> = held.flat_map(|(_, ends, _)| *ends).collect();
    points.extend(spec.supports.iter().map(|support| support.position));
    let Some(from) = points.first().copied() else { return Err(PlateError::NotHeld) };
    let tolerance_m = ON_A_LINE * longer_side_m(spec);
    let distance_m = |p: &Position| (p.x_m - from.x_m).hypot(p.y_m - from.y_m);
    let farthest = points.iter().max_by(|p, q| distance_m(p).total_cmp(&distance_m(q)));
    let Some(to) = farthest.copied().filter(|to| distance_m(to) > tolerance_m) else {
        return Err(PlateError::HeldAtOnePoint { at: from });
    };
    let (along_x, along_y) = (to.x_m - from.x_m, to.y_m - from.y_m);
    let beside_m = |p: &Position| {
        (along_x * (p.y_m - from.y_m) - along_y * (p.x_m - from.x_m)).abs() / along_x.hypot(along_y)
    };
    if points.iter().any(|p| beside_m(p) > tolerance_m) {
        Ok(())
    } else {
        Err(PlateError::HeldOnALine { from, to })
    }
}

fn check_memory(spec: &PlateSpec) -> Result<(), PlateError> {
    let bytes = estimated_bytes(spec);
    if bytes <= MOST_BYTES {
        Ok(())
    } else {
        Err(PlateError::MeshTooLarge { elements: spec.elements, bytes, most: MOST_BYTES })
    }
}

/// Matrix elements that couple two nodes.
const PAIR: f64 = (NODE_DEGREES * NODE_DEGREES) as f64;

/// Estimated number of entries of the factor, without stored zeros.
pub(super) fn estimated_factor_size(spec: &PlateSpec) -> f64 {
    let (columns, rows) = Mesh::new(spec.extent(), spec.elements).nodes();
    PAIR * coupled_pairs(columns, rows)
}

/// Upper bound of the memory of the plate's equations, in bytes: the factor, which couples pairs of nodes; the stiffness matrix, where
/// a node couples with itself and its eight neighbours; and the solutions of the point supports.
pub(super) fn estimated_bytes(spec: &PlateSpec) -> f64 {
    const NUMBER_BYTES: f64 = 8.0;
    /// Largest ratio of stored entries to nonzero ones: columns of nearly the same pattern are stored as one block, with zeros.
    const PADDING: f64 = 1.25;
    /// A matrix element is a value and a row, and the library that factors the matrix copies it.
    const ELEMENT_BYTES: f64 = 2.0 * (8.0 + 8.0);
    let mesh = Mesh::new(spec.extent(), spec.elements);
    let (columns, rows) = mesh.nodes();
    let nodes = columns as f64 * rows as f64;
    let factor = PADDING * estimated_factor_size(spec) * NUMBER_BYTES;
    let matrix = nodes * PAIR * 5.0 * ELEMENT_BYTES;
    let solutions = (spec.supports.len() + 8) as f64 * nodes * NODE_DEGREES as f64 * NUMBER_BYTES;
    factor + matrix + solutions
}

/// Reason for which a sensor of this `kind` at `position` reads 0 for every contact; `None` for a sensitive sensor.
///
/// On a supported edge w = 0, so the derivatives of w along the edge are zero too. On a clamped edge the slope across it is
/// zero. On a simply supported edge the bending moment across it is zero, and with it the curvature.
pub(super) fn insensitive_sensor(
    spec: &PlateSpec,
    kind: SensorKind,
    position: Position,
) -> Option<InsensitiveSensor> {
    let still = |(name, edge): &(&'static str, Edge)| {
        let across = matches!(*name, "left" | "right");
        match (kind, edge) {
            (_, Edge::Free) | (SensorKind::Reaction | SensorKind::Raw, _) => false,
            (SensorKind::Deflection, _) => true,
            (SensorKind::Slope, Edge::Simple) | (SensorKind::Strain, Edge::Clamped) => !across,
            (SensorKind::Slope, Edge::Clamped) | (SensorKind::Strain, Edge::Simple) => true,
        }
    };
    if let Some((edge, how)) = edges_at(spec, position).find(still) {
        let held = if how == Edge::Clamped { "clamped" } else { "simply supported" };
        return Some(InsensitiveSensor::AtEdge { edge, held, kind });
    }
    let support = support_at(spec, position).filter(|i| spec.supports[*i].is_rigid())?;
    (kind == SensorKind::Deflection).then_some(InsensitiveSensor::AtSupport { number: support + 1 })
}

/// Index of the support at `position`.
pub(super) fn support_at(spec: &PlateSpec, position: Position) -> Option<usize> {
    let slack_m = SAME_PLACE * longer_side_m(spec);
    spec.supports.iter().position(|support| {
        let (dx, dy) = (support.position.x_m - position.x_m, support.position.y_m - position.y_m);
        dx.abs().max(dy.abs()) <= slack_m
    })
}

/// The edges at `position`, by name, and their conditions.
fn edges_at(spec: &PlateSpec, position: Position) -> impl Iterator<Item = (&'static str, Edge)> {
    let near = |value: f64, bound: f64| (value - bound).abs() <= SAME_PLACE * longer_side_m(spec);
    let on = [
        near(position.x_m, 0.0),
        near(position.x_m, spec.length_m),
        near(position.y_m, 0.0),
        near(position.y_m, spec.width_m),
    ];
    edges(spec).into_iter().zip(on).filter(|(_, on)| *on).map(|((name, _, edge), _)| (name, edge))
}

/// Name, ends and condition of each edge.
fn edges(spec: &PlateSpec) -> [(&'static str, [Position; 2], Edge); 4] {
    let corner = |x_m, y_m| Position { x_m, y_m };
    let (length_m, width_m) = (spec.length_m, spec.width_m);
    let [near, right] = [corner(0.0, 0.0), corner(length_m, 0.0)];
    let [top, far] = [corner(0.0, width_m), corner(length_m, width_m)];
    [
        ("left", [near, top], spec.edges.left),
        ("right", [right, far], spec.edges.right),
        ("bottom", [near, right], spec.edges.bottom),
        ("top", [top, far], spec.edges.top),
    ]
}

/// The plate's own compliance ℓ²/D, with its longer side ℓ, in m/N.
pub(super) fn compliance_m_per_n(spec: &PlateSpec) -> f64 {
    longer_side_m(spec).powi(2) / spec.flexural_rigidity()
}

fn longer_side_m(spec: &PlateSpec) -> f64 {
    spec.length_m.max(spec.width_m)
}
