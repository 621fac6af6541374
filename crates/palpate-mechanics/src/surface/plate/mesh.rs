//! The grid of elements on a plate, and where a position is in it.
//!
//! Every node has four degrees of freedom, in this order: w, h_x·∂w/∂x, h_y·∂w/∂y, h_x·h_y·∂²w/∂x∂y, with the
//! deflection w and the sides h_x, h_y of an element. All are lengths, so they are of one size.

use super::hermite;
use crate::contact::Position;
use crate::surface::Extent;

/// Degrees of freedom of a node.
pub(super) const NODE_DEGREES: usize = 4;

/// Equal rectangular elements in `across` columns along x and `up` rows along y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mesh {
    /// Elements along x; at least 1.
    pub across: usize,
    /// Elements along y; at least 1.
    pub up: usize,
    /// Side h_x of an element along x, in metres.
    pub side_x_m: f64,
    /// Side h_y of an element along y, in metres.
    pub side_y_m: f64,
}

/// A derivative of the deflection: how often along x and how often along y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Derivative {
    /// w itself.
    None,
    /// ∂w/∂x.
    X,
    /// ∂w/∂y.
    Y,
    /// ∂²w/∂x².
    XX,
}

/// A place in the mesh: an element, and where in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    column: usize,
    row: usize,
    xi: f64,
    eta: f64,
}

/// The fewest elements along a side: with one alone, a plate clamped all round could not bend.
const FEWEST: usize = 4;

impl Mesh {
    /// `elements` along the longer side of `extent`, and along the shorter one as many as keep them from being longer
    /// than wide, but at least four.
    pub fn new(extent: Extent, elements: usize) -> Self {
        let (length_m, width_m) = (extent.length_m(), extent.width_m().unwrap_or(extent.length_m()));
        let side_m = length_m.max(width_m) / elements as f64;
        let along = |size_m: f64| ((size_m / side_m - 1e-9).ceil() as usize).max(FEWEST);
        let (across, up) = (along(length_m), along(width_m));
        Self { across, up, side_x_m: length_m / across as f64, side_y_m: width_m / up as f64 }
    }

    /// Nodes along x and along y.
    pub fn nodes(&self) -> (usize, usize) {
        (self.across + 1, self.up + 1)
    }

    /// How many degrees of freedom all nodes have together.
    pub fn degrees(&self) -> usize {
        NODE_DEGREES * (self.across + 1) * (self.up + 1)
    }

    /// The first degree of freedom of a node.
    pub fn first_degree(&self, column: usize, row: usize) -> usize {
        NODE_DEGREES * (row * (self.across + 1) + column)
    }

    /// Where `position` is; off the plate, the place in the nearest element that its polynomial continues to.
    pub fn place(&self, position: Position) -> Place {
        let (column, xi) = along(position.x_m / self.side_x_m, self.across);
        let (row, eta) = along(position.y_m / self.side_y_m, self.up);
        Place { column, row, xi, eta }
    }

    /// The same place seen from the element before it along x, when it lies on the boundary between two.
    pub fn place_before(&self, place: Place) -> Option<Place> {
        let on_boundary = place.xi.abs() < 1e-9 && place.column > 0;
        on_boundary.then(|| Place { column: place.column - 1, xi: 1.0 + place.xi, ..place })
    }

    /// The value of the derivative `of` at `place` when the degrees of freedom are `degrees`.
    #[inline]
    pub fn value(&self, degrees: &[f64], place: Place, of: Derivative) -> f64 {
        let (along_x, along_y) = self.factors(place, of);
        let mut sum = 0.0;
        for (end_y, weights_y) in along_y.chunks_exact(2).enumerate() {
            let first = self.first_degree(place.column, place.row + end_y);
            let nodes = &degrees[first..first + 2 * NODE_DEGREES];
            for (node, weights_x) in nodes.chunks_exact(NODE_DEGREES).zip(along_x.chunks_exact(2)) {
                sum += weights_y[0] * (weights_x[0] * node[0] + weights_x[1] * node[1])
                    + weights_y[1] * (weights_x[0] * node[2] + weights_x[1] * node[3]);
            }
        }
        sum
    }

    /// By how much each degree of freedom is multiplied in that value: pairs of degree and factor.
    pub fn weights(&self, place: Place, of: Derivative) -> [(usize, f64); 16] {
        let (along_x, along_y) = self.factors(place, of);
        std::array::from_fn(|i| {
            let (x, y) = (i % 4, i / 4);
            let node = self.first_degree(place.column + x / 2, place.row + y / 2);
            (node + x % 2 + 2 * (y % 2), along_x[x] * along_y[y])
        })
    }

    /// The factors of the shape functions along x and along y.
    #[inline]
    fn factors(&self, place: Place, of: Derivative) -> (hermite::Four, hermite::Four) {
        let Place { xi, eta, .. } = place;
        let over = |functions: hermite::Four, side_m: f64| functions.map(|value| value / side_m);
        match of {
            Derivative::None => (hermite::values(xi), hermite::values(eta)),
            Derivative::X => (over(hermite::slopes(xi), self.side_x_m), hermite::values(eta)),
            Derivative::Y => (hermite::values(xi), over(hermite::slopes(eta), self.side_y_m)),
            Derivative::XX => (over(hermite::curvatures(xi), self.side_x_m.powi(2)), hermite::values(eta)),
        }
    }
}

/// The element of a place that is `steps` elements along, among `count`, and where in it.
#[inline]
fn along(steps: f64, count: usize) -> (usize, f64) {
    // A float becomes the nearest whole number that fits, so that no position is out of bounds.
    let element = (steps as usize).min(count - 1);
    (element, steps - element as f64)
}
