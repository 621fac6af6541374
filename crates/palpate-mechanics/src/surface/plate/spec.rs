//! Description of a plate, with checks.

use serde::{Deserialize, Serialize};

use super::dissection::coupled_pairs;
use super::mesh::{Mesh, NODE_DEGREES};
use crate::contact::Position;
use crate::sensing::SensorKind;
use crate::surface::{Extent, InsensitiveSensor};
use crate::units::format_length_mm;
use palpate_numerics::OutOfRange;

/// A rectangular plate, checked by [`Plate::new`](super::Plate::new).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlateSpec {
    /// Length along x.
    pub length_m: f64,
    /// Width along y.
    pub width_m: f64,
    /// Thickness t; below a tenth of the sides, as shear is neglected.
    pub thickness_m: f64,
    /// Young's modulus E.
    pub youngs_modulus_pa: f64,
    /// Poisson's ratio ν, −1 < ν ≤ 0.5.
    pub poissons_ratio: f64,
    /// Edge supports.
    pub edges: Edges,
    /// Point supports.
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
    /// No deflection; the edge can turn.
    Simple,
    /// No deflection, no slope.
    Clamped,
    /// No support.
    #[default]
    Free,
}

/// A point support.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSupport {
    /// The position.
    pub position: Position,
    /// The kind.
    pub kind: PointSupportKind,
}

/// Kind of a point support.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointSupportKind {
    /// No deflection.
    Simple,
    /// A spring.
    Elastic {
        /// Stiffness k > 0.
        stiffness_n_per_m: f64,
    },
}

impl PlateSpec {
    /// Default, with errors of 10⁻⁴ of the largest deflection (docs/explanation/plates.md).
    pub const DEFAULT_ELEMENTS: usize = 128;

    /// D = E·t³/(12·(1 − ν²)), in N·m.
    pub fn flexural_rigidity(&self) -> f64 {
        self.youngs_modulus_pa * self.thickness_m.powi(3) / (12.0 * (1.0 - self.poissons_ratio.powi(2)))
    }

    pub(super) fn extent(&self) -> Extent {
        Extent::checked_plane(self.length_m, self.width_m)
    }
}

impl Edges {
    /// Returns edges of one kind.
    pub const fn all(edge: Edge) -> Self {
        Self { left: edge, right: edge, bottom: edge, top: edge }
    }
}

impl PointSupport {
    pub(super) fn is_rigid(&self) -> bool {
        matches!(self.kind, PointSupportKind::Simple)
    }
}

/// Error of an invalid plate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlateError {
    /// A dimension is not positive and finite.
    #[error(transparent)]
    NotPositive(#[from] OutOfRange),
    /// Poisson's ratio is out of range.
    #[error("a plate's poissons_ratio is {value}; it must be greater than -1 and at most 0.5")]
    PoissonsRatio {
        /// Poisson's ratio.
        value: f64,
    },
    /// l²/D is not positive and finite.
    #[error("a plate's compliance l²/D is {compliance_m_per_n} m/N; it must be greater than 0 and finite")]
    Compliance {
        /// l²/D, with the longer side l.
        compliance_m_per_n: f64,
    },
    /// Too few or too many elements.
    #[error("a plate has {elements} elements along its longer side; it must have {fewest} to {most}")]
    Elements {
        /// Number of elements.
        elements: usize,
        /// Smallest number.
        fewest: usize,
        /// Largest number.
        most: usize,
    },
    /// The factor is too large.
    #[error(
        "a plate of {elements} elements along its longer side needs {} of memory; at most {} can be used: take fewer elements",
        gibibytes(*bytes), gibibytes(*most)
    )]
    MeshTooLarge {
        /// Number of elements.
        elements: usize,
        /// Estimated memory.
        bytes: f64,
        /// Largest memory.
        most: f64,
    },
    /// A support is off the plate.
    #[error(
        "support {number} is at {}, off the plate; it must be within (0, 0) and {}",
        Point(*at), Point(*corner)
    )]
    SupportOffPlate {
        /// Number of the support.
        number: usize,
        /// The position.
        at: Position,
        /// Corner opposite (0, 0).
        corner: Position,
    },
    /// A stiffness is invalid.
    #[error("support {number} has a stiffness of {value} N/m; it must be greater than 0 and finite")]
    Stiffness {
        /// Number of the support.
        number: usize,
        /// Stiffness.
        value: f64,
    },
    /// A support is on a supported edge.
    #[error("support {number} is on the {edge} edge, which is already supported; remove it")]
    SupportOnHeldEdge {
        /// Number of the support.
        number: usize,
        /// Name of the edge.
        edge: &'static str,
    },
    /// Supports have one position.
    #[error("supports {first} and {second} are both at {}; leave one out", Point(*at))]
    SupportsAtOnePlace {
        /// First number.
        first: usize,
        /// Second number.
        second: usize,
        /// Their position.
        at: Position,
    },
    /// Simple supports in one element.
    #[error(
        "simple supports {first} and {second} are {} apart, less than an element of {} × {}; take more elements, or one support",
        format_length_mm(*distance_m), format_length_mm(*side_x_m), format_length_mm(*side_y_m)
    )]
    SupportsTooClose {
        /// First number.
        first: usize,
        /// Second number.
        second: usize,
        /// Distance.
        distance_m: f64,
        /// Element side along x.
        side_x_m: f64,
        /// Element side along y.
        side_y_m: f64,
    },
    /// The plate has no support.
    #[error(
        "the plate has no supports: it can move up and down and tilt in every direction; support an edge, or three points"
    )]
    NotHeld,
    /// A single point support.
    #[error("the plate is supported only at {}: it can tilt about that point in every direction; support it at three points at least", Point(*at))]
    HeldAtOnePoint {
        /// The point.
        at: Position,
    },
    /// All supports are on one line.
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
    /// The equations have no solution.
    #[error("the equations of the plate could not be solved: {reason}")]
    Unsolvable {
        /// Reason.
        reason: Unsolvable,
    },
}

/// Largest imbalance, relative to the load.
pub(super) const MOST_IMBALANCE: f64 = 1e-9;

/// Error of equations without a solution.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unsolvable {
    /// The stiffness matrix is singular.
    #[error(transparent)]
    Stiffness(#[from] palpate_numerics::SparseCholeskyError),
    /// The equations of the supports are singular.
    #[error("the forces of the point supports could not be computed: {0}")]
    Supports(#[from] palpate_numerics::NotPositiveDefinite),
    /// Forces are not in balance.
    #[error(
        "under a force at {} the supports are {share:e} of it out of balance; it must be at most {:e}",
        Point(*at), MOST_IMBALANCE
    )]
    OutOfBalance {
        /// Imbalance relative to the force.
        share: f64,
        /// Position of the force.
        at: Position,
    },
    /// The watch cancelled the work.
    #[error("{0}")]
    Cancelled(#[from] palpate_numerics::watch::Cancelled),
}

impl Unsolvable {
    /// Suggested remedy.
    pub fn help(&self) -> &'static str {
        "take fewer `elements`, or lengths and stiffnesses that are less far apart"
    }
}

struct Point(Position);

impl std::fmt::Display for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}, {})", format_length_mm(self.0.x_m), format_length_mm(self.0.y_m))
    }
}

fn gibibytes(bytes: f64) -> String {
    format!("{:.1} GiB", bytes / 2f64.powi(30))
}

const FEWEST_ELEMENTS: usize = 4;
const MOST_ELEMENTS: usize = 10_000;

/// 4 GiB.
const MOST_BYTES: f64 = 4.0 * (1u64 << 30) as f64;

/// Tolerance of positions, relative to the longer side.
const SAME_PLACE: f64 = 1e-9;

/// Tolerance of a line, relative to the longer side.
const ON_A_LINE: f64 = 1e-6;

/// Checks a plate, cheap checks first.
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

/// Two simple supports would constrain an element completely.
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

/// Rigid motions w = a + b·x + c·y: a supported edge counts as its ends.
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

/// Matrix elements per pair of nodes.
const PAIR: f64 = (NODE_DEGREES * NODE_DEGREES) as f64;

pub(super) fn estimated_factor_size(spec: &PlateSpec) -> f64 {
    let (columns, rows) = Mesh::new(spec.extent(), spec.elements).nodes();
    PAIR * coupled_pairs(columns, rows)
}

/// Factor, stiffness matrix, and solutions of the supports.
pub(super) fn estimated_bytes(spec: &PlateSpec) -> f64 {
    const NUMBER_BYTES: f64 = 8.0;
    /// Largest ratio of stored to nonzero entries.
    const PADDING: f64 = 1.25;
    /// Value and row, copied by the factorisation.
    const ELEMENT_BYTES: f64 = 2.0 * (8.0 + 8.0);
    let mesh = Mesh::new(spec.extent(), spec.elements);
    let (columns, rows) = mesh.nodes();
    let nodes = columns as f64 * rows as f64;
    let factor = PADDING * estimated_factor_size(spec) * NUMBER_BYTES;
    let matrix = nodes * PAIR * 5.0 * ELEMENT_BYTES;
    let solutions = (spec.supports.len() + 8) as f64 * nodes * NODE_DEGREES as f64 * NUMBER_BYTES;
    factor + matrix + solutions
}

/// On a supported edge w and its derivatives along the edge are 0; on a clamped edge also the slope across
/// it, on a simply supported edge the curvature across it.
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
        return Some(InsensitiveSensor::AtEdge { edge, constraint: held, kind });
    }
    let support = support_at(spec, position).filter(|i| spec.supports[*i].is_rigid())?;
    (kind == SensorKind::Deflection).then_some(InsensitiveSensor::AtSupport { number: support + 1 })
}

pub(super) fn support_at(spec: &PlateSpec, position: Position) -> Option<usize> {
    let slack_m = SAME_PLACE * longer_side_m(spec);
    spec.supports.iter().position(|support| {
        let (dx, dy) = (support.position.x_m - position.x_m, support.position.y_m - position.y_m);
        dx.abs().max(dy.abs()) <= slack_m
    })
}

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

/// ℓ²/D with the longer side ℓ.
pub(super) fn compliance_m_per_n(spec: &PlateSpec) -> f64 {
    longer_side_m(spec).powi(2) / spec.flexural_rigidity()
}

fn longer_side_m(spec: &PlateSpec) -> f64 {
    spec.length_m.max(spec.width_m)
}
