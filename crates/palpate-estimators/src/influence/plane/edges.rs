//! How far contacts are from the edges of a plane, in what readings tell of it.
//!
//! Beside an edge that a support holds readings keep their shape while their size goes to zero: what tells a place from the edge is the
//! part of its readings that no contact at the edge has, whatever its force and its place along the edge.

use super::table::{Patches, PlaneTable};
use crate::influence::lanes::Lanes;

/// Whitened distances of a newton's readings from those of contacts at the edges, at the nodes of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Edges {
    columns: usize,
    rows: usize,
    inverse_spacing: [f64; 2],
    /// From the nearer of the left and the right edge, and of the lower and the upper.
    per_newton: Vec<[f64; 2]>,
}

/// Contacts at an edge are so much of a side away from it: a support hides those at the edge itself.
const BESIDE: f64 = 1e-5;

impl Edges {
    /// The distances of the nodes of a table, by its whitened patches and the weights of the groups of each node.
    pub fn new(table: &PlaneTable, patches: &Patches, weights: &[Lanes]) -> Self {
        let size_m = [table.length_m, table.width_m];
        let spacing_m = table.spacing_m();
        let reading = |[x_m, y_m]: [f64; 2]| -> Vec<f64> {
            let place = patches.place(x_m, y_m);
            (0..patches.groups).flat_map(|group| patches.value(&place, group)).collect()
        };
        let distance = |node: usize, k: usize, side: f64| {
            let (at, weights) =
                (table.node(node), weights[node * patches.groups..][..patches.groups].as_flattened());
            let at = [at.x_m, at.y_m];
            let beside = |along: f64| {
                let mut place = at;
                place[k] = side * size_m[k];
                place[1 - k] += along * spacing_m[1 - k];
                reading(place)
            };
            let (before, behind) = (beside(-0.5), beside(0.5));
            let along = before.iter().zip(&behind).map(|(before, behind)| behind - before).collect();
            part_outside(reading(at), [beside(0.0), along], weights)
        };
        let nearer = |node: usize, k: usize| distance(node, k, BESIDE).min(distance(node, k, 1.0 - BESIDE));
        Self {
            columns: table.columns,
            rows: table.rows,
            inverse_spacing: spacing_m.map(f64::recip),
            per_newton: (0..table.nodes()).map(|node| [nearer(node, 0), nearer(node, 1)]).collect(),
        }
    }

    /// The distances of a contact from the nearer edges along and across, in standard deviations.
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

/// Length of what is left of `of` without its parts along two others.
fn part_outside(mut of: Vec<f64>, [first, mut second]: [Vec<f64>; 2], weights: &[f64]) -> f64 {
    let product =
        |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).zip(weights).map(|((a, b), w)| w * a * b).sum() };
    let without = |of: &mut [f64], other: &[f64]| {
        let square = product(other, other);
        let share = if square > 0.0 { product(of, other) / square } else { 0.0 };
        of.iter_mut().zip(other).for_each(|(of, other)| *of -= share * other);
    };
    without(&mut second, &first);
    without(&mut of, &first);
    without(&mut of, &second);
    product(&of, &of).sqrt()
}
