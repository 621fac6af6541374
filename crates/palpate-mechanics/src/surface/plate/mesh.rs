//! Mesh and elements (Bogner, Fox and Schmit, *The generation of inter-element-compatible stiffness and mass
//! matrices by the use of interpolation formulas*, 1965).
//!
//! Degrees of freedom of a node, in metres: w, h_x·∂w/∂x, h_y·∂w/∂y, h_x·h_y·∂²w/∂x∂y, with element sides
//! h_x, h_y. Shape functions on 0 ≤ ξ ≤ 1: cubic Hermite functions N₀, N₁ of value and slope at 0, N₂, N₃ at
//! 1.

use crate::contact::Position;
use crate::surface::Extent;

pub(super) const NODE_DEGREES: usize = 4;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mesh {
    pub columns: usize,
    pub rows: usize,
    pub side_x_m: f64,
    pub side_y_m: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Derivative {
    None,
    X,
    Y,
    XX,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeshPoint {
    column: usize,
    row: usize,
    xi: f64,
    eta: f64,
}

const FEWEST: usize = 4;

impl Mesh {
    /// Square elements, or shorter along the shorter side.
    pub fn new(extent: Extent, elements: usize) -> Self {
        let (length_m, width_m) = (extent.length_m(), extent.width_m().unwrap_or(extent.length_m()));
        let side_m = length_m.max(width_m) / elements as f64;
        let along = |size_m: f64| ((size_m / side_m - 1e-9).ceil() as usize).max(FEWEST);
        let (across, up) = (along(length_m), along(width_m));
        Self { columns: across, rows: up, side_x_m: length_m / across as f64, side_y_m: width_m / up as f64 }
    }

    pub fn nodes(&self) -> (usize, usize) {
        (self.columns + 1, self.rows + 1)
    }

    pub fn degrees(&self) -> usize {
        NODE_DEGREES * (self.columns + 1) * (self.rows + 1)
    }

    pub fn first_degree(&self, column: usize, row: usize) -> usize {
        NODE_DEGREES * (row * (self.columns + 1) + column)
    }

    pub fn locate(&self, position: Position) -> MeshPoint {
        let (column, xi) = element_at(position.x_m / self.side_x_m, self.columns);
        let (row, eta) = element_at(position.y_m / self.side_y_m, self.rows);
        MeshPoint { column, row, xi, eta }
    }

    pub fn seen_from_before(&self, point: MeshPoint) -> Option<MeshPoint> {
        let on_boundary = point.xi.abs() < 1e-9 && point.column > 0;
        on_boundary.then(|| MeshPoint { column: point.column - 1, xi: 1.0 + point.xi, ..point })
    }

    #[inline]
    pub fn value(&self, degrees: &[f64], point: MeshPoint, of: Derivative) -> f64 {
        let (along_x, along_y) = self.factors(point, of);
        let mut sum = 0.0;
        for (end_y, weights_y) in along_y.chunks_exact(2).enumerate() {
            let first = self.first_degree(point.column, point.row + end_y);
            let nodes = &degrees[first..first + 2 * NODE_DEGREES];
            for (node, weights_x) in nodes.chunks_exact(NODE_DEGREES).zip(along_x.chunks_exact(2)) {
                sum += weights_y[0] * (weights_x[0] * node[0] + weights_x[1] * node[1])
                    + weights_y[1] * (weights_x[0] * node[2] + weights_x[1] * node[3]);
            }
        }
        sum
    }

    pub fn weights(&self, point: MeshPoint, of: Derivative) -> [(usize, f64); 16] {
        let (along_x, along_y) = self.factors(point, of);
        std::array::from_fn(|i| {
            let (x, y) = (i % 4, i / 4);
            let node = self.first_degree(point.column + x / 2, point.row + y / 2);
            (node + x % 2 + 2 * (y % 2), along_x[x] * along_y[y])
        })
    }

    #[inline]
    fn factors(&self, point: MeshPoint, of: Derivative) -> (CornerValues, CornerValues) {
        let MeshPoint { xi, eta, .. } = point;
        let over = |functions: CornerValues, side_m: f64| functions.map(|value| value / side_m);
        match of {
            Derivative::None => (values(xi), values(eta)),
            Derivative::X => (over(slopes(xi), self.side_x_m), values(eta)),
            Derivative::Y => (values(xi), over(slopes(eta), self.side_y_m)),
            Derivative::XX => (over(curvatures(xi), self.side_x_m.powi(2)), values(eta)),
        }
    }
}

#[inline]
fn element_at(steps: f64, count: usize) -> (usize, f64) {
    // Conversion from a float saturates, so that no position is out of bounds.
    let element = (steps as usize).min(count - 1);
    (element, steps - element as f64)
}

type CornerValues = [f64; 4];

type Integrals = [[f64; 4]; 4];

fn values(xi: f64) -> CornerValues {
    let (square, cube) = (xi * xi, xi * xi * xi);
    [1.0 - 3.0 * square + 2.0 * cube, xi - 2.0 * square + cube, 3.0 * square - 2.0 * cube, cube - square]
}

fn slopes(xi: f64) -> CornerValues {
    let square = xi * xi;
    [6.0 * square - 6.0 * xi, 1.0 - 4.0 * xi + 3.0 * square, 6.0 * xi - 6.0 * square, 3.0 * square - 2.0 * xi]
}

fn curvatures(xi: f64) -> CornerValues {
    [12.0 * xi - 6.0, 6.0 * xi - 4.0, 6.0 - 12.0 * xi, 6.0 * xi - 2.0]
}

/// ∫ fᵢ·gⱼ dξ, exact up to degree 7.
fn integrals(f: fn(f64) -> CornerValues, g: fn(f64) -> CornerValues) -> Integrals {
    let mut sums = Integrals::default();
    for (xi, weight) in gauss_points() {
        let (f, g) = (f(xi), g(xi));
        for (row, f) in sums.iter_mut().zip(f) {
            for (sum, g) in row.iter_mut().zip(g) {
                *sum += weight * f * g;
            }
        }
    }
    sums
}

/// Four Gauss points and weights on the unit interval (Abramowitz and Stegun, 25.4.30).
fn gauss_points() -> [(f64, f64); 4] {
    let (root, spread) = (30f64.sqrt(), 2.0 * (6.0f64 / 5.0).sqrt());
    let near = (((3.0 - spread) / 7.0).sqrt(), (18.0 + root) / 36.0);
    let far = (((3.0 + spread) / 7.0).sqrt(), (18.0 - root) / 36.0);
    let at = |x: f64, weight: f64| (0.5 * (1.0 + x), 0.5 * weight);
    [at(-far.0, far.1), at(-near.0, near.1), at(near.0, near.1), at(far.0, far.1)]
}

/// Index 4·y + x is the product of Hermite functions x and y; x = 2·a + p is end a and derivative p.
pub(super) type ElementStiffness = [[f64; 16]; 16];

/// D·∬ (w_xx² + w_yy² + 2·ν·w_xx·w_yy + 2·(1 − ν)·w_xy²)/2 as a quadratic form (Timoshenko and
/// Woinowsky-Krieger, *Theory of Plates and Shells*, 2nd ed., eq. 117).
pub(super) fn element_stiffness(mesh: &Mesh, rigidity_nm: f64, poissons_ratio: f64) -> ElementStiffness {
    let (h_x, h_y, nu) = (mesh.side_x_m, mesh.side_y_m, poissons_ratio);
    let bent = integrals(curvatures, curvatures);
    let level = integrals(values, values);
    let twisted = integrals(slopes, slopes);
    let mixed = integrals(curvatures, values);
    let element = |row: usize, column: usize| {
        let (i, k) = (row % 4, row / 4);
        let (j, l) = (column % 4, column / 4);
        let along_x = bent[i][j] * level[k][l] * h_y / h_x.powi(3);
        let along_y = level[i][j] * bent[k][l] * h_x / h_y.powi(3);
        let both = nu * (mixed[i][j] * mixed[l][k] + mixed[j][i] * mixed[k][l]) / (h_x * h_y);
        let twist = 2.0 * (1.0 - nu) * twisted[i][j] * twisted[k][l] / (h_x * h_y);
        rigidity_nm * (along_x + along_y + both + twist)
    };
    std::array::from_fn(|row| std::array::from_fn(|column| element(row, column)))
}
