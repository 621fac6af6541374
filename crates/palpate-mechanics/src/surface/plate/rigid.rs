//! Rigid motions of a plate.

use super::mesh::{Mesh, NODE_DEGREES};
use super::spec::{Edge, Edges};
use palpate_numerics::small::add_multiple;

/// 1, x/ℓ and y/ℓ with the longer side ℓ, or coefficients.
pub(super) type Motions = [f64; 3];

pub(super) struct RigidMotions {
    motions: Vec<Vec<f64>>,
    nodes: Vec<(usize, usize)>,
}

impl RigidMotions {
    pub fn new(mesh: &Mesh, edges: Edges) -> Self {
        let [_, far_x, far_y] = motions_at(mesh, mesh.first_degree(mesh.columns, mesh.rows));
        let (middle_x, middle_y) = (mesh.columns / 2, mesh.rows / 2);
        let sides = [
            (edges.left, [0.0, 1.0, 0.0], (mesh.columns, middle_y)),
            (edges.right, [far_x, -1.0, 0.0], (0, middle_y)),
            (edges.bottom, [0.0, 0.0, 1.0], (middle_x, mesh.rows)),
            (edges.top, [far_y, 0.0, -1.0], (middle_x, 0)),
        ];
        let held: Vec<_> = sides.into_iter().filter(|(edge, ..)| *edge != Edge::Free).collect();
        let left = match held[..] {
            [] => vec![
                ([1.0, 0.0, 0.0], (0, 0)),
                ([0.0, 1.0, 0.0], (mesh.columns, 0)),
                ([0.0, 0.0, 1.0], (0, mesh.rows)),
            ],
            [(Edge::Simple, motion, node)] => vec![(motion, node)],
            _ => Vec::new(),
        };
        let (factors, nodes): (Vec<Motions>, Vec<_>) = left.into_iter().unzip();
        let at = |factors: &Motions, degree| {
            motions_at(mesh, degree).iter().zip(factors).map(|(m, f)| m * f).sum()
        };
        let motion = |factors| (0..mesh.degrees()).map(|degree| at(factors, degree)).collect();
        Self { motions: factors.iter().map(motion).collect(), nodes }
    }

    pub fn count(&self) -> usize {
        self.motions.len()
    }

    /// Nodes (column, row) that prevent the motions when constrained.
    pub fn nodes(&self) -> &[(usize, usize)] {
        &self.nodes
    }

    /// R'·f; 0 where its terms cancel to rounding.
    pub fn resultants(&self, load: &(impl Iterator<Item = (usize, f64)> + Clone)) -> Vec<f64> {
        const ROUNDING: f64 = 1e-14;
        let value = |motion: &Vec<f64>| {
            let terms = load.clone().map(|(degree, weight)| weight * motion[degree]);
            let (sum, size) =
                terms.fold((0.0, 0.0), |(sum, size), term: f64| (sum + term, size + term.abs()));
            if sum.abs() > ROUNDING * size { sum } else { 0.0 }
        };
        self.motions.iter().map(value).collect()
    }

    /// Adds motions times `factor` and shares.
    pub fn add(&self, degrees: &mut [f64], factor: f64, shares: &[f64]) {
        for (motion, share) in self.motions.iter().zip(shares) {
            add_multiple(degrees, factor * share, motion);
        }
    }
}

pub(super) fn motions_at(mesh: &Mesh, degree: usize) -> Motions {
    let (node, which) = (degree / NODE_DEGREES, degree % NODE_DEGREES);
    let (column, row) = (node % (mesh.columns + 1), node / (mesh.columns + 1));
    let size_m = |count: usize, side_m: f64| count as f64 * side_m;
    let longer_m = size_m(mesh.columns, mesh.side_x_m).max(size_m(mesh.rows, mesh.side_y_m));
    match which {
        0 => [1.0, size_m(column, mesh.side_x_m) / longer_m, size_m(row, mesh.side_y_m) / longer_m],
        1 => [0.0, mesh.side_x_m / longer_m, 0.0],
        2 => [0.0, 0.0, mesh.side_y_m / longer_m],
        _ => [0.0; 3],
    }
}
