//! Distances of contacts from the edges of a plane, in standard deviations.
//!
//! Next to a supported edge only the size of readings vanishes. The distance is the part of a reading that no
//! contact at the edge explains, at any force and place along it.

use super::table::{Patches, PlaneTable};
use crate::influence::lanes::Lanes;

/// Whitened distances per newton at the nodes of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Edges {
    columns: usize,
    rows: usize,
    inverse_spacing: [f64; 2],
    /// From the nearer edges along and across.
    per_newton: Vec<[f64; 2]>,
}

/// Relative distance of edge contacts from the edge, where a support hides them.
const BESIDE: f64 = 1e-5;

impl Edges {
    pub fn new(table: &PlaneTable, patches: &Patches, weights: &[Lanes]) -> Self {
        let size_m = [table.length_m, table.width_m];
        let spacing_m = table.spacing_m();
        let reading = |[x_m, y_m]: [f64; 2]| -> Vec<f64> {
            let place = patches.place(x_m, y_m);
            (0..patches.groups).flat_map(|group| patches.value(&place, group)).collect()
        };
        // Readings beside an edge across side k, and their change along the edge.
        let at_edge = |k: usize, side: f64| -> Vec<[Vec<f64>; 2]> {
            let count = [table.rows, table.columns][k];
            let beside = |along: f64| {
                let mut place = [0.0; 2];
                place[k] = side * size_m[k];
                place[1 - k] = along * spacing_m[1 - k];
                reading(place)
            };
            let of_node = |node: usize| {
                let (before, behind) = (beside(node as f64 - 0.5), beside(node as f64 + 0.5));
                let along = before.iter().zip(&behind).map(|(before, behind)| behind - before).collect();
                [beside(node as f64), along]
            };
            (0..count).map(of_node).collect()
        };
        let edges = [0, 1].map(|k| [BESIDE, 1.0 - BESIDE].map(|side| at_edge(k, side)));
        let of_node = |node: usize| {
            let weights = weights[node * patches.groups..][..patches.groups].as_flattened();
            let at = table.node(node);
            let own = reading([at.x_m, at.y_m]);
            let along = [node / table.columns, node % table.columns];
            let nearer = |k: usize| {
                let distances = edges[k].each_ref().map(|edge| part_outside(&own, &edge[along[k]], weights));
                distances[0].min(distances[1])
            };
            [nearer(0), nearer(1)]
        };
        Self {
            columns: table.columns,
            rows: table.rows,
            inverse_spacing: spacing_m.map(f64::recip),
            per_newton: (0..table.nodes()).map(of_node).collect(),
        }
    }

    pub fn distances(&self, [x_m, y_m, force_n]: [f64; 3]) -> [f64; 2] {
        let cell = |at_m: f64, inverse: f64, count: usize| {
            let place = (at_m * inverse).clamp(0.0, (count - 1) as f64);
            let cell = (place as usize).min(count - 2);
            (cell, place - cell as f64)
        };
        let (column, along) = cell(x_m, self.inverse_spacing[0], self.columns);
        let (row, across) = cell(y_m, self.inverse_spacing[1], self.rows);
        let node = row * self.columns + column;
        std::array::from_fn(|k| {
            let value = |node: usize| self.per_newton[node][k];
            let line = |node: usize| value(node) + along * (value(node + 1) - value(node));
            let below = line(node);
            force_n * (below + across * (line(node + self.columns) - below))
        })
    }
}

/// Norm of a reading without its components along two others.
fn part_outside(reading: &[f64], [first, second]: &[Vec<f64>; 2], weights: &[f64]) -> f64 {
    let product =
        |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).zip(weights).map(|((a, b), w)| w * a * b).sum() };
    let without = |of: &[f64], other: &[f64]| -> Vec<f64> {
        let square = product(other, other);
        let share = if square > 0.0 { product(of, other) / square } else { 0.0 };
        of.iter().zip(other).map(|(of, other)| of - share * other).collect()
    };
    let left = without(&without(reading, first), &without(second, first));
    product(&left, &left).sqrt()
}
