//! The stiffness matrix of the whole plate.

use std::collections::HashMap;

use super::mesh::{Mesh, NODE_DEGREES};
use super::stiffness::ElementStiffness;
use super::unknowns::Unknowns;
use palpate_numerics::SparseSymmetric;

/// The sum over some degrees of freedom, each multiplied by its factor: what a point of the plate does, or a sensor reads.
pub(super) type Functional = Vec<(usize, f64)>;

/// A spring under a point of the plate.
pub(super) struct Spring {
    /// The deflection of the point.
    pub deflection: Functional,
    /// Its stiffness, in N/m.
    pub stiffness_n_per_m: f64,
}

/// The stiffness matrix of equal elements and springs, of the unknowns only.
pub(super) fn stiffness_matrix(
    mesh: &Mesh,
    unknowns: &Unknowns,
    element: &ElementStiffness,
    springs: &[Spring],
) -> SparseSymmetric {
    let under = springs_by_degree(springs);
    let mut matrix = SparseSymmetric::with_capacity(unknowns.count() * NEIGHBOURS * NODE_DEGREES / 2);
    for unknown in 0..unknowns.count() {
        let degree = unknowns.degree(unknown);
        let mut column = element_column(mesh, element, degree);
        for (spring, factor) in under.get(&degree).into_iter().flatten() {
            for (other, other_factor) in &spring.deflection {
                column.add(mesh, *other, spring.stiffness_n_per_m * factor * other_factor);
            }
        }
        let elements = column.entries(mesh);
        matrix.push_column(elements.filter_map(|(degree, value)| Some((unknowns.place(degree)?, value))));
    }
    matrix
}

/// The springs whose points move with a degree of freedom, and by how much.
fn springs_by_degree(springs: &[Spring]) -> HashMap<usize, Vec<(&Spring, f64)>> {
    let mut under: HashMap<usize, Vec<(&Spring, f64)>> = HashMap::new();
    for spring in springs {
        for (degree, factor) in &spring.deflection {
            under.entry(*degree).or_default().push((spring, *factor));
        }
    }
    under
}

/// A node couples with itself and the eight around it.
const NEIGHBOURS: usize = 9;

/// One column of the matrix: the couplings of a node's degree of freedom with those of its neighbours.
struct Column {
    /// The node, its column and row in the grid.
    node: (usize, usize),
    /// Neighbours row by row from the one below to the left.
    couplings: [[f64; NODE_DEGREES]; NEIGHBOURS],
}

impl Column {
    /// Adds to the coupling with `degree`, which is one of a neighbour.
    fn add(&mut self, mesh: &Mesh, degree: usize, value: f64) {
        let (node, degree) = (degree / NODE_DEGREES, degree % NODE_DEGREES);
        let (column, row) = (node % (mesh.across + 1), node / (mesh.across + 1));
        let neighbour = 3 * (row + 1 - self.node.1) + (column + 1 - self.node.0);
        self.couplings[neighbour][degree] += value;
    }

    /// Degree of freedom and coupling of all neighbours that exist.
    fn entries(&self, mesh: &Mesh) -> impl Iterator<Item = (usize, f64)> {
        let (columns, rows) = mesh.nodes();
        self.couplings.iter().enumerate().flat_map(move |(i, couplings)| {
            // One more than the neighbour's own, which may be left of or below the grid.
            let (column, row) = (self.node.0 + i % 3, self.node.1 + i / 3);
            let exists = (1..=columns).contains(&column) && (1..=rows).contains(&row);
            let first = if exists { mesh.first_degree(column - 1, row - 1) } else { 0 };
            let degrees = if exists { NODE_DEGREES } else { 0 };
            couplings[..degrees].iter().enumerate().map(move |(degree, value)| (first + degree, *value))
        })
    }
}

/// What the up to four elements around a node add to the column of its `degree`.
fn element_column(mesh: &Mesh, element: &ElementStiffness, degree: usize) -> Column {
    let (node, own) = (degree / NODE_DEGREES, degree % NODE_DEGREES);
    let node = (node % (mesh.across + 1), node / (mesh.across + 1));
    let mut column = Column { node, couplings: [[0.0; NODE_DEGREES]; NEIGHBOURS] };
    for (end_y, end_x) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        // The element of which this node is the end: its first node is (node.0 − end_x, node.1 − end_y).
        let fits = |at: usize, end: usize, count: usize| at >= end && at - end < count;
        if !(fits(node.0, end_x, mesh.across) && fits(node.1, end_y, mesh.up)) {
            continue;
        }
        let row = &element[local(end_x, end_y, own)];
        for (other_y, other_x) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let neighbour = 3 * (1 + other_y - end_y) + (1 + other_x - end_x);
            for (degree, coupling) in column.couplings[neighbour].iter_mut().enumerate() {
                *coupling += row[local(other_x, other_y, degree)];
            }
        }
    }
    column
}

/// Where a node's degree of freedom stands in an element.
fn local(end_x: usize, end_y: usize, degree: usize) -> usize {
    4 * (2 * end_y + degree / 2) + 2 * end_x + degree % 2
}
