//! Which degrees of freedom are unknown, and in what order they are solved for.

use super::dissection::nested_dissection;
use super::mesh::{Mesh, NODE_DEGREES};
use super::spec::{Edge, Edges};

/// The numbers of the degrees of freedom that no edge holds at zero, in the order of elimination.
pub(super) struct Unknowns {
    /// Of each degree of freedom, where it stands in the equations.
    places: Vec<Option<u32>>,
    /// Degree of freedom of each unknown.
    degrees: Vec<u32>,
}

impl Unknowns {
    /// The unknowns of a mesh whose edges are held so.
    pub fn new(mesh: &Mesh, edges: Edges) -> Self {
        let (columns, rows) = mesh.nodes();
        let mut places = vec![None; mesh.degrees()];
        let mut degrees = Vec::with_capacity(mesh.degrees());
        for (column, row) in nested_dissection(columns, rows) {
            let first = mesh.first_degree(column, row);
            let held = held_degrees(mesh, edges, column, row);
            for degree in (0..NODE_DEGREES).filter(|degree| !held[*degree]).map(|degree| first + degree) {
                places[degree] = Some(degrees.len() as u32);
                degrees.push(degree as u32);
            }
        }
        Self { places, degrees }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.degrees.len()
    }

    /// Where a degree of freedom stands in the equations; `None` when it is held at zero.
    pub fn place(&self, degree: usize) -> Option<usize> {
        self.places[degree].map(|place| place as usize)
    }

    /// The degree of freedom of an unknown.
    pub fn degree(&self, unknown: usize) -> usize {
        self.degrees[unknown] as usize
    }

    /// All degrees of freedom, the held ones 0, when the unknowns are `unknowns`, times `factor`.
    pub fn spread(&self, unknowns: &[f64], factor: f64) -> Vec<f64> {
        self.places.iter().map(|place| place.map_or(0.0, |place| factor * unknowns[place as usize])).collect()
    }
}

/// Which degrees of freedom of a node its edges hold at zero.
///
/// Along an edge that is held w = 0, so its derivative along the edge is zero too; on a clamped one the slope across it is
/// zero as well, and so is that slope's derivative along it.
fn held_degrees(mesh: &Mesh, edges: Edges, column: usize, row: usize) -> [bool; NODE_DEGREES] {
    let on = [
        (column == 0, edges.left, [true, false, true, false]),
        (column == mesh.across, edges.right, [true, false, true, false]),
        (row == 0, edges.bottom, [true, true, false, false]),
        (row == mesh.up, edges.top, [true, true, false, false]),
    ];
    let mut held = [false; NODE_DEGREES];
    for (_, edge, simple) in on.into_iter().filter(|(on, ..)| *on) {
        let holds = match edge {
            Edge::Free => [false; NODE_DEGREES],
            Edge::Simple => simple,
            Edge::Clamped => [true; NODE_DEGREES],
        };
        for (held, holds) in held.iter_mut().zip(holds) {
            *held |= holds;
        }
    }
    held
}
